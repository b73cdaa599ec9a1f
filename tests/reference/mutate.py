#!/usr/bin/env python3
"""Mutation fuzz: programs, targets, tables, robots and pipelines with small damages, and what calib makes of them.

    python3 tests/reference/mutate.py --calib target/release/calib --runs 30000 --seed 1 --jobs 2

Needs Python alone. Of every run: it ends in time and memory with a documented exit code, stderr speaks of no panic, and a refusal
leaves nothing behind. Every number of an accepted program, text or table of targets is recomputed by kinematics of this script's own
(fuzz/arm.py) from the parameters that calib identified: the real arm at the corrected joints is where the nominal one is at the given,
within 1 um. Damaged parameters are refused or give what the sound ones give; an accepted URDF is the one that another reader reads.
Prints kinds by exit codes and every violation with a file that shows it; ends with 1 where there is one. Run N of a seed is always the
same: --only KIND, --index N repeat it.
"""
import argparse
import collections
import concurrent.futures
import json
import math
import os
import pathlib
import random
import resource
import shutil
import subprocess
import sys
import tempfile
import time

from fuzz import bases, mutations, parquet, programs, sheet, urdf
from fuzz.programs import POINT, Wrong

ROOT = pathlib.Path(__file__).resolve().parents[2]
MEMORY = 4 << 30
CODES = {0, 2, 10, 75}
MODEL = ["compensate", "parameters.parquet", "--robot", "robot.yaml", "--quiet", "-j", "1", "--start", "0,0,0,0,28.65,0"]
KRL_WORDS = [b"PTP", b"LIN", b"CIRC", b"LIN_REL", b"SPTP", b"E6AXIS", b"E6POS", b"POS", b"FRAME", b"AXIS", b":", b"A1", b"A6", b"X", b"C", b"E1",
             b"$BASE=", b"{A1 5}", b"PTP {A1 1,A2 2,A3 3,A4 4,A5 5,A6 6}", b"HOME", b"B_AX", b"GEO:", b"}:{", b"DECL", b"=", b";FOLD", b"C_DIS"]
RAPID_WORDS = [b"MoveAbsJ", b"MoveL", b"MoveJ", b"MoveC", b"jointtarget", b"robtarget", b"robtarget:=", b"Offs(", b"RelTool(", b"9E9", b"[", b"]",
               b"\\WObj:=wobj1", b"tooldata", b"[[1,2,3,4,5,6],[9E9,9E9,9E9,9E9,9E9,9E9]]", b";", b":=", b"CONST", b"! "]
CSV_WORDS = [b"q1_deg", b"q1_rad", b"q2_mm", b"A1_deg", b"x_mm", b"x_m", b"qw", b"a_deg", b"payload_kg", b"dir1", b"time_s", b"i1_a", b"temp_c",
             b"remark", b"j3_arcsec", b"=1+1", b"\"", b"\"\"", b"joint6_deg", b"sigma_mm"]
YAML_WORDS = [b"${robot}", b"${x}", b"null", b"~", b"true", b"*a", b"&a", b"!!float", b"<<", b"|", b">", b"---", b"...", b"? ", b"- ", b"{}", b"[]",
              b"1e308", b".inf", b".nan", b"uses:", b"with:", b"effects:", b"diagnose", b"validate", b"report", b"identify", b"kinematics:", b"mdh:"]
URDF_WORDS = [b"<axis xyz=\"1e308 0 1e308\"/>", b"<origin xyz=\"1e308 0 1e308\" rpy=\"0 0 0\"/>", b"type=\"prismatic\"", b"type=\"floating\"",
              b"fixed", b"<mimic joint=\"joint1\"/>", b"&lt;", b"&#0;", b"<!--", b"-->", b"<![CDATA[", b"<link name=\"tool0\"/>", b"xyz=\"0 0 0\"",
              b"<!DOCTYPE r [<!ENTITY a \"b\">]>", b"&a;", b"<mass value=\"-1\"/>", b"<axis xyz=\"0 0 0\"/>", b"mass", b"lower", b"continuous"]


class Bench:
    """One worker: a folder with the sound files, where one mutated file after another is tried."""

    def __init__(self, arguments, cell):
        self.arguments, self.cell, self.calib = arguments, cell, str(pathlib.Path(arguments.calib).resolve())
        self.folder = pathlib.Path(tempfile.mkdtemp(dir=arguments.work))
        for path in cell.folder.iterdir():
            shutil.copyfile(path, self.folder / path.name)
        (self.folder / "m_in.yaml").write_text(bases.TAKE_IN)
        self.urdfs = {name: text.encode() for name, text in bases.urdfs().items()}
        for name in self.urdfs:
            (self.folder / f"u_{name}.yaml").write_text(
                "calib_robot: 1\nname: u\nunits: {length: m, angle: rad}\nkinematics: {urdf: {base: world_base, tip: tool0}}\n")
            (self.folder / f"p_{name}.yaml").write_text(
                f"calib: 1\nname: u\nstages:\n  - uses: robot\n    with: {{file: u_{name}.yaml, urdf: m.urdf}}\n")
        self.files = sorted(os.listdir(self.folder))
        self.tables = {n: (self.folder / f"{n}.parquet").read_bytes() for n in ("parameters", "robot", "recording", "joints", "pose")}
        resource.setrlimit(resource.RLIMIT_AS, (MEMORY, resource.RLIM_INFINITY))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))

    def run(self, *command):
        try:
            done = subprocess.run([self.calib, *command], cwd=self.folder, stdin=subprocess.DEVNULL, capture_output=True,
                                  timeout=self.arguments.limit, close_fds=False)
            return done.returncode, done.stdout, done.stderr
        except subprocess.TimeoutExpired:
            return "slow", b"", b""

    def tidy(self):
        for name in set(os.listdir(self.folder)) - set(self.files):
            path = self.folder / name
            shutil.rmtree(path) if path.is_dir() else path.unlink()

    def left(self, *own):
        return sorted(set(os.listdir(self.folder)) - set(self.files) - set(own))

    def trial(self, kind, index):
        """One mutated file: (exit code, numbers recomputed, what is wrong or none, the command, the file, stderr)."""
        r = random.Random(f"{self.arguments.seed} {kind} {index}")
        self.tidy()
        name, data, command, judge = getattr(self, kind)(r)
        (self.folder / name).write_bytes(data)
        code, out, err = self.run(*command)
        wrong, checked = None, 0
        try:
            if code == "slow":
                wrong = None if kind == "pipeline" else f"no end after {self.arguments.limit} s"
            elif code not in (CODES | ({1} if command[0] == "diff" else set())):
                wrong = f"exit code {code}"
            elif b"panicked" in err or b"RUST_BACKTRACE" in err:
                wrong = "a panic on stderr"
            else:
                checked = judge(code, out, data)
        except Wrong as error:
            wrong = str(error)
        return code, checked, wrong, command, name, data, err

    def nothing_left(self, out, *own):
        if out or self.left(*own):
            raise Wrong(f"a refusal left something: {self.left(*own)} {out[:80]!r}")

    # Every kind: the file's name, its bytes, the command, and what must hold of the result.
    def program(self, r, ending, base, words, pairs):
        data = mutations.mutated(r, base.encode(), mutations.TEXT + [(mutations.word(words), 6)])

        def judge(code, out, data):
            if code:
                self.nothing_left(out, f"m.{ending}")
                return 0
            if self.left(f"m.{ending}", "out"):
                raise Wrong(f"beside the result: {self.left(f'm.{ending}', 'out')}")
            before, after = data.decode("latin-1"), (self.folder / "out").read_bytes().decode("latin-1")
            return programs.judge(pairs(before, after), self.cell.nominal, self.cell.real, [bases.START], False)

        return f"m.{ending}", data, [*MODEL, f"m.{ending}", "--assume-frames", "--out", "out"], judge

    def krl(self, r):
        ending, base = r.choice((("src", bases.KRL), ("dat", bases.KRL_DATA)))
        return self.program(r, ending, base, KRL_WORDS, programs.pairs_of_krl)

    def rapid(self, r):
        return self.program(r, "mod", bases.RAPID, RAPID_WORDS, programs.pairs_of_rapid)

    def text(self, r):
        base = r.choice((bases.JOINT_TEXT, bases.JOINT_NAMES, bases.COMMA_TEXT, bases.POSE_TEXT, bases.QUATERNION_TEXT, bases.POINT_TEXT))
        data = mutations.mutated(r, base.encode(), mutations.TEXT + [(mutations.word(CSV_WORDS), 4)])

        def judge(code, out, data):
            written = (self.folder / "out.csv").exists()
            if code and not (code == 10 and written):
                self.nothing_left(out, "m.csv")
                return 0
            if not written:
                raise Wrong("code 0 and no file")
            before, after = data.decode(), (self.folder / "out.csv").read_bytes().decode()
            return sheet.judge(before, after, self.cell.nominal, self.cell.real, bases.NAMES, code)

        return "m.csv", data, [*MODEL, "m.csv", "--out", "out.csv"], judge

    def targets(self, r):
        what = r.choice(("joints", "pose"))
        data = mutations.mutated(r, self.tables[what], mutations.BINARY)

        def judge(code, out, data):
            written = (self.folder / "out.parquet").exists()
            if code and not (code == 10 and written):
                self.nothing_left(out, "m.parquet")
                return 0
            try:
                given, found = parquet.columns(data), parquet.columns((self.folder / "out.parquet").read_bytes())
            except parquet.Unknown:
                return 0
            return sheet.judge_columns(given, found, self.cell.nominal, self.cell.real, what == "pose", code)

        return "m.parquet", data, [*MODEL, "m.parquet", "--target", what, "--out", "out.parquet"], judge

    def table(self, r):
        what = r.choice(("parameters", "parameters", "robot"))
        data = mutations.mutated(r, self.tables[what], mutations.BINARY)
        model = ["m.parquet", "--robot", "robot.yaml"] if what == "parameters" else ["parameters.parquet", "--robot", "m.parquet"]

        def judge(code, out, data):
            if code:
                self.nothing_left(out, "m.parquet")
            elif out != self.cell.expected:
                raise Wrong(f"damaged {what} were accepted and give other joints")
            return 0 if code else 12

        return "m.parquet", data, ["compensate", *model, "--quiet", "-j", "1", "targets.csv"], judge

    def recording(self, r):
        data = mutations.mutated(r, self.tables["recording"], mutations.BINARY)
        way = r.choice(("ingest", "poses", "diff"))
        command = {"ingest": ["run", "m_in.yaml", "--quiet", "--store", "store", "-j", "1"],
                   "poses": ["poses", "robot.yaml", "-n", "6", "--candidates", "20", "--effects", "joint_offset", "--against", "m.parquet"],
                   "diff": ["diff", "recording.parquet", "m.parquet"]}[way]
        return "m.parquet", data, command, lambda code, out, data: 0

    def urdf(self, r):
        name = r.choice(sorted(self.urdfs))
        data = mutations.mutated(r, self.urdfs[name], mutations.TEXT + [(mutations.word(URDF_WORDS), 6)])

        def judge(code, out, data):
            if code:
                return 0
            try:
                found, tip = urdf.chain(data, "world_base", "tool0")
            except urdf.Unknown:
                return 0
            asked, rows, _ = self.run("query", "HEAD", "SELECT * FROM robot ORDER BY body", "--json", "--store", "store")
            if asked:
                raise Wrong(f"query of an accepted robot: {asked}")
            wrong = urdf.differences(found, tip, json.loads(rows))
            if wrong:
                raise Wrong(f"the URDF was read otherwise: {wrong}")
            return 9 * len(found)

        return "m.urdf", data, ["run", f"p_{name}.yaml", "--quiet", "--store", "store", "-j", "1"], judge

    def robot(self, r):
        base = r.choice((bases.ROBOT, bases.DH))
        data = mutations.mutated(r, base.encode(), mutations.TEXT + [(mutations.word(YAML_WORDS), 3)])

        def judge(code, out, data):
            if code:
                self.nothing_left(out if code != 10 else b"", "m.yaml")
                return 0
            rows = [line.split(",") for line in out.decode().splitlines()[1:]]
            if len(rows) != 2 or not all(math.isfinite(float(cell)) for row in rows for cell in row[:8]):
                raise Wrong(f"not finite: {out[:200]!r}")
            return 0

        return "m.yaml", data, ["compensate", "parameters.parquet", "--robot", "m.yaml", "--quiet", "-j", "1", "targets.csv"], judge

    def pipeline(self, r):
        data = mutations.mutated(r, bases.SHORT.encode(), mutations.TEXT + [(mutations.word(YAML_WORDS), 3)])

        def judge(code, out, data):
            if code:
                return 0
            code, out, err = self.run("run", "m.yaml", "--quiet", "--store", "store", "-j", "1")
            # A YAML may ask for more than there is time for.
            if code != "slow" and code not in CODES or b"panicked" in err:
                raise Wrong(f"`check` found no fault, `run` ends with {code}: {err.decode(errors='replace')[:300]}")
            return 0

        return "m.yaml", data, ["check", "m.yaml"], judge


KINDS = {"krl": 20, "rapid": 15, "text": 18, "targets": 9, "table": 9, "recording": 7, "urdf": 8, "robot": 7, "pipeline": 7}
BENCH = None


def begin(arguments, cell):
    global BENCH
    BENCH = Bench(arguments, cell)


def part(jobs):
    """Runs of one part: (kind, code) -> count, numbers recomputed by kind, violations."""
    codes, checked, wrong = collections.Counter(), collections.Counter(), []
    for kind, index in jobs:
        code, numbers, fault, command, name, data, err = BENCH.trial(kind, index)
        codes[kind, code] += 1
        checked[kind] += numbers
        if fault:
            folder = pathlib.Path(BENCH.arguments.keep) / f"{BENCH.arguments.seed}-{kind}-{index}"
            folder.mkdir(parents=True, exist_ok=True)
            (folder / name).write_bytes(data)
            for sound in set(command) & set(BENCH.files) - {name}:
                shutil.copyfile(BENCH.folder / sound, folder / sound)
            (folder / "command.txt").write_text(f"{' '.join(command)}\n{fault}\n{err.decode(errors='replace')}")
            wrong.append((kind, index, fault, str(folder / name)))
    return codes, checked, wrong


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--calib", default=str(ROOT / "target/release/calib"))
    parser.add_argument("--runs", type=int, default=30_000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--only", choices=sorted(KINDS), help="one kind")
    parser.add_argument("--index", type=int, help="one run, with --only")
    parser.add_argument("--limit", type=float, default=20.0, help="s that one run may take")
    parser.add_argument("--keep", help="where files that show a violation are kept")
    arguments = parser.parse_args()
    shared = pathlib.Path("/dev/shm")
    arguments.keep = arguments.keep or tempfile.mkdtemp(prefix="calib-mutate-")
    with tempfile.TemporaryDirectory(prefix="mutate-", dir=shared if shared.is_dir() else None) as work:
        arguments.work = work
        sound = pathlib.Path(work) / "cell"
        sound.mkdir()
        cell = bases.Cell(str(pathlib.Path(arguments.calib).resolve()), sound)
        kinds = [arguments.only] if arguments.only else sorted(KINDS)
        chosen = random.Random(arguments.seed).choices(kinds, [KINDS[kind] for kind in kinds], k=arguments.runs)
        jobs = [(arguments.only, arguments.index)] if arguments.index is not None else [(kind, n) for n, kind in enumerate(chosen)]
        parts = [jobs[k:k + 100] for k in range(0, len(jobs), 100)]
        codes, checked, wrong, started = collections.Counter(), collections.Counter(), [], time.time()
        with concurrent.futures.ProcessPoolExecutor(arguments.jobs, initializer=begin, initargs=(arguments, cell)) as pool:
            for done, (some, numbers, faults) in enumerate(pool.map(part, parts), 1):
                codes += some
                checked += numbers
                wrong += faults
                for kind, index, fault, path in faults:
                    print(f"{kind} {index}: {fault}\n    {path}", flush=True)
                if sys.stderr.isatty():
                    print(f"\r{min(100 * done, len(jobs))} of {len(jobs)}, {time.time() - started:.0f} s", end="", file=sys.stderr)
    columns = sorted({code for _, code in codes}, key=str)
    print(f"seed {arguments.seed}, {len(jobs)} runs, {time.time() - started:.0f} s")
    print(f"{'kind':10}" + "".join(f"{code!s:>8}" for code in columns) + f"{'numbers':>10}{'wrong':>7}")
    for kind in [*kinds, "all"]:
        of = lambda kind_: kind in (kind_, "all")
        row = [sum(n for (k, c), n in codes.items() if of(k) and c == code) for code in columns]
        numbers = sum(n for k, n in checked.items() if of(k))
        print(f"{kind:10}" + "".join(f"{n:8}" for n in row) + f"{numbers:10}{sum(of(k) for k, *_ in wrong):7}")
    if wrong:
        print(f"{len(wrong)} violations; their files are in {arguments.keep}")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
