#!/usr/bin/env python3
"""What `calib diagnose` says of many recordings with known answers, kept as tables, so that two versions can be held against each other.

    python3 -m pip install pyarrow
    python3 tests/reference/oracle.py BINARY OUT [--sets practice concealed ...] [--repo DIR] [--maker BINARY] [--jobs 1] [--nice]
    python3 tests/reference/oracle.py --compare A B [--sets ...]
    calib diff A/cases.parquet B/cases.parquet --key set,case --ignore cpu_s
    calib diff A/findings.parquet B/findings.parquet --key set,case,effect,place,number

BINARY diagnoses every recording with the pipelines of the checkout DIR (that of this script, if none is given), each in a process and a store of its
own with one worker thread. OUT holds findings.parquet (a row a finding), cases.parquet (a row a recording) and answers/SET/CASE.json, what the
program printed. Given again after an interruption, it goes on; answers of another binary are refused.

practice          folders with want.json in ../shared/practice beside the checkout; practice_torques: of moving arms, in ../shared/practice_dynamics
concealed         60 recordings of `calib simulate conceal`: a quarter without any effect, a fifth with two, half of the effects in other forms
foreign, torques  40 with effects of no list (`--foreign 1`); 60 of moving arms (`--dynamics`), a quarter without any, a fifth with two
first             pipelines/sr210d, the whole run; its true effects are those of the pipeline
ur5               pipelines/ur5 with its data where the pipeline says: real, so that nothing is marked
sockets           pipelines/sockets with a stage `diagnose` in it: its joints give, which may be named and need not

Recordings are made once, by BINARY or --maker, in the folder `cases` beside OUT, from a fixed seed: acceptance needs fresh ones. Marks:

want.json      a finding is wanted where its name and place are asked for (`a|b`: either; a leading `?`: true, not required), else false. A drifting
               tracker and a moving base are one; runs of links agree where they overlap.
sealed truths  as `calib simulate reveal` marks: a finding is `rival` where only a rival of it is true; a cause is required from L = 50 on
wrong          a name other than `unknown` that is not there: of a false finding, or of the first choice at a true place
exact          every required cause is named, and no finding is false
ratio          held-out rms over the true noise, with what no model can know of foreign effects; else over the stated one; of torques nrmse after over before
cpu_s          user and system time of the process
"""
import argparse
import collections
import concurrent.futures
import hashlib
import json
import math
import os
import pathlib
import re
import resource
import shutil
import subprocess
import tempfile

import pyarrow as pa
import pyarrow.parquet as pq

HERE = pathlib.Path(__file__).resolve().parents[2]
SEED = 50
CONCEALED = {
    "concealed": ["--cases", 60, "--nulls", 0.25, "--pairs", 0.2],
    "foreign": ["--cases", 40, "--foreign", 1],
    "torques": ["--cases", 60, "--nulls", 0.25, "--pairs", 0.2, "--dynamics"]}
PRACTICE = {"practice": "practice", "practice_torques": "practice_dynamics"}
PIPELINES = {"practice": "case", "concealed": "case", "foreign": "case", "practice_torques": "dynamics", "torques": "dynamics", "first": "sr210d"}
# What the twins of two pipelines have, in the words of want.json: gaps and run-outs of motors are true, and not required.
TWINS = {
    "first": {
        "joint_compliance|joint_hardening": [2, 3, 4, 5], "gear_cyclic": [1, 4, 5], "gear_cyclic|gear_load": [2, 3], "base_compliance": ["base"],
        "link_compliance": ["link 2", "link 4"], "?backlash": range(1, 7), "?gear_motor_cyclic": [2, 3, 6]},
    "ur5": {}, "sockets": {"?joint_compliance|joint_hardening": [2, 3, 4, 5, 6]}}
SETS = ["practice", "practice_torques", *CONCEALED, *TWINS]
INSTRUMENT = {"tracker_drift", "base_shift", "frame_shift", "tracker_shift", "unknown"}
DUE, CPU_LIMIT_S = 50.0, 1800

TEXT, REAL, WHOLE, TRUTH = pa.string(), pa.float64(), pa.int64(), pa.bool_()
FINDINGS = pa.schema([
    ("set", TEXT), ("case", TEXT), ("effect", TEXT), ("place", TEXT), ("number", WHOLE), ("rank", WHOLE), ("mark", TEXT), ("wrong", TRUTH),
    ("size_um", REAL), ("size_nm", REAL), ("probability", REAL), ("place_probability", REAL), ("none_probability", REAL), ("parameters", WHOLE), ("rivals", TEXT)])
CASES = pa.schema([
    ("set", TEXT), ("case", TEXT), ("content", TEXT), ("wanted", TEXT), ("missed", TEXT), ("exact", TRUTH), ("required", WHOLE), ("named", WHOLE),
    ("as_rival", WHOLE), ("wrong", WHOLE), ("false", WHOLE), ("verdict", TEXT), ("before_mean_mm", REAL), ("before_max_mm", REAL), ("after_mean_mm", REAL),
    ("after_max_mm", REAL), ("after_rms_mm", REAL), ("noise_floor_mm", REAL), ("before_nrmse", REAL), ("after_nrmse", REAL), ("ratio", REAL),
    ("parameters", WHOLE), ("parameters_of_findings", WHOLE), ("cpu_s", REAL), ("fault", TEXT)])


# ---- the recordings: (set, case, folder, answer)

def jobs(which, arguments):
    if which in TWINS:
        want = [{"effect": effect, "where": f"joint {at}" if isinstance(at, int) else at} for effect, places in TWINS[which].items() for at in places]
        yield which, which, None, ("want", want) if want else ("none", None)
    elif which in PRACTICE:
        folder = arguments.repo.parent / "shared" / PRACTICE[which]
        if not folder.is_dir():
            raise SystemExit(f"{which}: {folder} is missing; --sets names the sets that are wanted")
        for case in sorted(path.parent for path in folder.glob("*/want.json")):
            yield which, case.name, case, ("want", json.loads((case / "want.json").read_text())["effects"])
    else:
        folder = arguments.out.parent / "cases" / f"{which}-{arguments.seed}"
        if not (folder / "seal.json").exists():
            shutil.rmtree(folder, ignore_errors=True)
            command = [arguments.maker, "simulate", "conceal", "--out", folder, "--seed", arguments.seed, *CONCEALED[which]]
            subprocess.run([str(word) for word in command], check=True, stdout=subprocess.DEVNULL)
        for case in sorted((folder / "recordings").iterdir()):
            yield which, case.name, case, ("sealed", json.loads((folder / "sealed" / f"{case.name}.json").read_text()))


# ---- one diagnosis

def child(command, repo, folder):
    """Exit code, stdout, stderr and CPU seconds of one process."""
    with open(folder / "stdout", "w+") as out, open(folder / "stderr", "w+") as err:
        process = subprocess.Popen([str(word) for word in command], cwd=repo, stdout=out, stderr=err)
        resource.prlimit(process.pid, resource.RLIMIT_CPU, (CPU_LIMIT_S, CPU_LIMIT_S))
        _, status, used = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        out.seek(0), err.seek(0)
        return process.returncode, out.read(), err.read(), used.ru_utime + used.ru_stime


def estimated(path):
    """Numbers of a model that were estimated; of a torques' model all that has a standard deviation."""
    return sum(row.get("status") in ("free", "bound") or ("status" not in row and row["sigma"] is not None) for row in pq.read_table(path).to_pylist())


def diagnosed(job, arguments):
    """What the program said: kept, and read again where it is there."""
    which, case, recording, _ = job
    kept = arguments.out / "answers" / which / f"{case}.json"
    if kept.exists():
        return json.loads(kept.read_text())
    with tempfile.TemporaryDirectory(prefix="oracle-") as folder:
        folder = pathlib.Path(folder)
        pipeline = arguments.repo / "pipelines" / PIPELINES.get(which, which) / "pipeline.yaml"
        if which == "sockets":
            shutil.copytree(pipeline.parent, folder / which)
            pipeline = folder / which / "pipeline.yaml"
            pipeline.write_text(pipeline.read_text().replace("  - uses: validate\n", "  - uses: diagnose\n\n  - uses: validate\n"))
        store = ["--store", folder / "store", "--json", "--quiet"]
        words = ["run" if which == "first" else "diagnose", pipeline, *(["--set", f"case={recording}"] if recording else [])]
        code, out, err, cpu = child([arguments.binary, *words, *store, "--jobs", 1], arguments.repo, folder)
        if which == "first" and code in (0, 1):
            code, out, err, _ = child([arguments.binary, "diagnose", "HEAD", *store], arguments.repo, folder)
        tables = list((folder / "store").glob("tables/*/diagnose*.parameters.parquet"))
        answer = json.loads(out) if code in (0, 10) and out.lstrip().startswith("{") else None
        said = {"code": code, "cpu_s": round(cpu, 3), "parameters": estimated(tables[0]) if tables else None}
        said |= {"fault": None if answer and "findings" in answer else err.strip()[-800:] or f"code {code}", "answer": answer}
    kept.parent.mkdir(parents=True, exist_ok=True)
    kept.with_suffix(".part").write_text(json.dumps(said, indent=1) + "\n")
    kept.with_suffix(".part").replace(kept)
    return said


# ---- marks: (mark and whether the name is wrong, of each finding; text, whether required, outcome, of each cause)

def name(one):
    return one["effect"], one["where"]


def atoms(effect, place):
    """One name for each link of a run: `link 2-4` is links 2, 3 and 4."""
    run = re.fullmatch(r"link (\d+)-(\d+)", place)
    return {(effect, f"link {k}") for k in range(int(run[1]), int(run[2]) + 1)} if run else {(effect, place)}


def reach(finding):
    return atoms(*name(finding)).union(*(atoms(*name(rival)) for rival in finding.get("rivals") or []))


def same(want, found):
    """Whether a finding (or a rival of one) is what want.json asks for."""
    kinds = want["effect"].lstrip("?").split("|")
    kinds += ["joint_compliance"] if "joint_hardening" in kinds else []
    moved = {want["where"], found["where"]} == {"tracker", "base"} and found["effect"] in INSTRUMENT
    at_place = moved or not atoms("", want["where"]).isdisjoint(atoms("", found["where"]))
    return list(name(found)) in want.get("accept", []) or (found["effect"] in kinds and at_place)


def marked_by_want(wants, findings):
    there = [any(same(want, finding) for want in wants) for finding in findings]
    marks = [("wanted" if right else "false", not right and finding["effect"] != "unknown") for right, finding in zip(there, findings)]
    causes = []
    for want in wants:
        named = any(same(want, finding) for finding in findings)
        rival = any(same(want, rival) for finding in findings for rival in finding.get("rivals") or [])
        required = not want["effect"].startswith("?") and not want.get("optional")
        causes.append(("@".join(name(want)), required, "named" if named else "rival" if rival else "missed"))
    return marks, causes


def marked_by_truth(truth, findings):
    names = lambda many: set().union(*(atoms(*name(one)) for one in many))
    effects, accepted = truth["effects"], names(truth["accepted"])
    found, reached = names(findings), set().union(*map(reach, findings))
    known = names(effects) | accepted
    if truth["tampered"]:
        known |= {("outlier", "recording"), ("mislabelled_point", "recording")}
    wanted = [cause for cause in effects if cause.get("wanted", True)]
    places = {place for _, place in names(wanted) | accepted}
    marks = []
    for finding in findings:
        own = names([finding])
        mark = "wanted" if own & known else "rival" if reach(finding) & known else "false"
        wrong = mark == "false" or (mark == "rival" and any(place in places for _, place in own))
        marks.append((mark, wrong and finding["effect"] != "unknown"))
    causes = []
    for cause in wanted:
        own, equal = names([cause]), names(cause.get("same") or [])
        outcome = "named" if own <= found or equal & found else "rival" if own <= reached or accepted & found else "missed"
        causes.append((f"{'@'.join(name(cause))} ({cause['form']}, L {cause['L']:.0f})", cause["L"] >= DUE, outcome))
    return marks, causes


def rows_of(job, said):
    which, case, _, (kind, truth) = job
    a = said["answer"] or {}
    findings = a.get("findings", [])
    marks, causes = {"want": marked_by_want, "sealed": marked_by_truth, "none": lambda _, f: ([(None, None)] * len(f), [])}[kind](truth, findings)
    rows = []
    for rank, (finding, (mark, wrong)) in enumerate(zip(findings, marks), 1):
        number = [name(other) for other in findings[:rank]].count(name(finding))
        evidence = finding.get("evidence") or {}
        size = evidence.get("effect_rms_mm")
        rivals = sorted(finding.get("rivals") or [], key=lambda rival: -(rival.get("probability") or 0))
        rows.append({
            "set": which, "case": case, "effect": finding["effect"], "place": finding["where"], "number": number, "rank": rank,
            "mark": mark, "wrong": wrong, "size_um": None if size is None else 1e3 * size, "size_nm": evidence.get("effect_rms_nm"),
            **{key: finding.get(key) for key in ("probability", "place_probability", "none_probability")}, "parameters": len(finding.get("parameters") or []),
            "rivals": "; ".join(f"{'@'.join(name(rival))} {rival.get('probability') or 0:.2f}" for rival in rivals[:6])})
    due = [outcome for _, required, outcome in causes if required]
    row = {key: (a.get(when) or {}).get(f"validate_{key.split('_', 1)[1]}") for when in ("before", "after") for key in CASES.names if key.startswith(when)}
    floor = a.get("noise_floor_mm")
    noise = truth.get("noise") if kind == "sealed" else None
    true_floor = math.sqrt(3) * math.hypot(noise["validate_rms_per_axis_mm"], noise.get("unseen_rms_per_axis_mm", 0.0)) if noise else floor
    over = (row["after_rms_mm"], true_floor) if row["after_nrmse"] is None else (row["after_nrmse"], row["before_nrmse"])
    row |= {
        "set": which, "case": case, "content": truth["content"] if kind == "sealed" else "null" if which in PRACTICE and not due else "",
        "wanted": "; ".join(text if required else f"[{text}]" for text, required, _ in causes),
        "missed": "; ".join(text for text, required, outcome in causes if required and outcome != "named"),
        "verdict": a.get("verdict"), "noise_floor_mm": floor, "ratio": over[0] / over[1] if over[0] is not None and over[1] else None, "parameters": said["parameters"],
        "parameters_of_findings": sum(row["parameters"] for row in rows), "cpu_s": said["cpu_s"], "fault": said["fault"]}
    if kind != "none":
        row |= {"required": len(due), "named": due.count("named"), "as_rival": due.count("rival")}
        row |= {"wrong": sum(row["wrong"] for row in rows), "false": sum(row["mark"] == "false" for row in rows)}
        row |= {"exact": not said["fault"] and not row["false"] and row["named"] == row["required"]}
    return row, rows


def run(arguments):
    arguments.out.mkdir(parents=True, exist_ok=True)
    about, made_by = arguments.out / "binary.json", {"sha256": hashlib.file_digest(open(arguments.binary, "rb"), "sha256").hexdigest(), "seed": arguments.seed}
    if about.exists() and json.loads(about.read_text()) != made_by:
        raise SystemExit(f"{arguments.out}: holds answers of another binary or seed; name a new folder")
    about.write_text(json.dumps(made_by) + "\n")
    todo = [job for which in SETS if which in arguments.sets for job in jobs(which, arguments)]
    cases, findings = [], []
    with concurrent.futures.ThreadPoolExecutor(arguments.jobs) as pool:
        for job, said in zip(todo, pool.map(lambda job: diagnosed(job, arguments), todo)):
            case, rows = rows_of(job, said)
            cases, findings = [*cases, case], [*findings, *rows]
            print("\n".join(told(case, rows, f"{case['set']} {case['case']}")), flush=True)
    for path, rows, schema in ((arguments.out / "cases.parquet", cases, CASES), (arguments.out / "findings.parquet", findings, FINDINGS)):
        others = [row for row in pq.read_table(path).to_pylist() if row["set"] not in arguments.sets] if path.exists() else []
        pq.write_table(pa.Table.from_pylist(others + rows, schema), path)
    print("\n" + table([(arguments.out.name, cases)]))


# ---- what is printed

def told(case, rows, title):
    grade = {True: "exact", False: "-", None: "not judged"}[case.get("exact")]
    held = "" if case["ratio"] is None else f", held out {case['ratio']:.3f} of " + ("before" if case["after_nrmse"] is not None else "the noise")
    mean = "" if case["after_mean_mm"] is None else f", mean {case['after_mean_mm']:.4f} max {case['after_max_mm']:.4f} mm"
    wanted = [f"    wanted {case['wanted'] or 'nothing'}"] if case.get("exact") is False else []
    out = [f"{title}: {grade}, {case['verdict'] or 'failed: ' + case['fault']}{held}{mean}, {case['parameters']} parameters, {case['cpu_s']:.1f} s", *wanted]
    for row in rows:
        size = f"{row['size_um']:.0f} um" if row["size_um"] is not None else "-" if row["size_nm"] is None else f"{row['size_nm']:.3g} Nm"
        mark = "" if row["mark"] is None else row["mark"] + (", wrong" if row["wrong"] else "")
        out.append(f"    {row['effect']}@{row['place']} {size}, p {row['probability'] or 0:.2f} {mark}" + (f" [{row['rivals']}]" if row["rivals"] else ""))
    return out


def table(versions):
    """A line a set and version; the last column of the second: its held-out errors over those of the first. Means of ratios are geometric."""
    geometric = lambda values: f"{math.exp(sum(map(math.log, values)) / len(values)):.3f}" if values else "-"
    widths, heads = (8, 14, 7, 7, 8, 8, 9, 8, 14), ["exact", "named/wanted", "wrong", "false", "nulls", "ratio", "CPU s", "failed", "held out B/A"]
    line = lambda which, label, cells: f"{which:17}{label[:13]:14}" + "".join(f"{cell:>{width}}" for cell, width in zip(cells, widths))
    lines = [line("set", "", heads)]
    sets = [which for which in SETS if any(case["set"] == which for _, cases in versions for case in cases)]
    for which in [*sets, None]:
        first = None
        for label, cases in versions:
            own = {(case["set"], case["case"]): case for case in cases if which in (None, case["set"])}
            judged = [case for case in own.values() if case.get("exact") is not None]
            total = lambda key: sum(case[key] for case in judged)
            nulls = [case for case in judged if case["content"] == "null"]
            error = lambda case: case["after_mean_mm"] or case["after_nrmse"]
            over = [error(own[key]) / error(case) for key, case in (first or {}).items() if key in own and error(case) and error(own[key])]
            first = first or own
            ratio = geometric([case["ratio"] for case in own.values() if case["ratio"]])
            cells = [f"{total('exact')}/{len(judged)}", f"{total('named')}/{total('required')}", total("wrong"), total("false")]
            cells += [f"{sum(case['false'] > 0 for case in nulls)}/{len(nulls)}", ratio, f"{sum(case['cpu_s'] for case in own.values()):.1f}"]
            cells += [sum(case["fault"] is not None for case in own.values()), geometric(over) if over else ""]
            lines.append(line(which or "all", label, cells))
    return "\n".join(lines)


def compare(arguments):
    versions, findings = [], []
    for folder in arguments.compare:
        read = lambda title: [row for row in pq.read_table(folder / f"{title}.parquet").to_pylist() if row["set"] in arguments.sets]
        by_case = collections.defaultdict(list)
        for row in read("findings"):
            by_case[row["set"], row["case"]].append(row)
        versions.append({(case["set"], case["case"]): case for case in read("cases")})
        findings.append(by_case)
    labels = [f"{letter} {folder.resolve().name}" for letter, folder in zip("AB", arguments.compare)]
    common = [key for key in versions[0] if key in versions[1]]
    print(table([(label, [cases[key] for key in common]) for label, cases in zip(labels, versions)]))
    for label, cases in zip(labels, versions):
        if len(cases) > len(common):
            print(f"{len(cases) - len(common)} recordings of {label} are not in the other and not compared")
    names = lambda rows: sorted((row["effect"], row["place"], row["mark"] or "", bool(row["wrong"])) for row in rows)
    for key in common:
        a, b = (cases[key] for cases in versions)
        x, y = (case["after_mean_mm"] or case["after_nrmse"] or 0.0 for case in (a, b))
        off = abs(x - y) > 0.05 * max(x, y)
        if off or names(findings[0][key]) != names(findings[1][key]) or (a["exact"], a["verdict"]) != (b["exact"], b["verdict"]):
            print(f"\n{' '.join(key)}: wanted {a['wanted'] or 'nothing'}")
            for label, case, rows in zip(labels, (a, b), (of[key] for of in findings)):
                print("\n".join("  " + line for line in told(case, rows, label) if not line.startswith("    wanted ")))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("binary", nargs="?", type=pathlib.Path)
    parser.add_argument("out", nargs="?", type=pathlib.Path)
    parser.add_argument("--compare", nargs=2, type=pathlib.Path, metavar=("A", "B"), help="prints a table of two outputs, and every recording that differs")
    parser.add_argument("--sets", nargs="+", choices=SETS, default=SETS)
    parser.add_argument("--repo", type=pathlib.Path, default=HERE, help="the checkout whose pipelines are run")
    parser.add_argument("--maker", type=pathlib.Path, help="the binary that makes the recordings [default: BINARY]")
    parser.add_argument("--seed", type=int, default=SEED)
    parser.add_argument("--jobs", type=int, default=1, help="processes at a time")
    parser.add_argument("--nice", action="store_true", help="gives way to all other processes")
    arguments = parser.parse_args()
    if arguments.compare:
        return compare(arguments)
    if not arguments.out:
        parser.error("BINARY and OUT are needed, or --compare A B")
    os.nice(15 if arguments.nice else 0)
    arguments.maker = arguments.maker or arguments.binary
    for key in ("binary", "out", "repo", "maker"):
        setattr(arguments, key, getattr(arguments, key).resolve())
    run(arguments)


if __name__ == "__main__":
    main()
