#!/usr/bin/env python3
"""Proof of `calib fleet diagnose`: fleets of arms with a cause that each recording alone hardly shows.

    python3 tests/reference/fleet_causes.py OUT --calib target/debug/calib [--fleets 10] [--robots 20] [--points 100] [--nulls 10] [--seed N]
    ... --mujoco medium6      arms of mujoco_maker.py instead of twins (needs mujoco and numpy)
    ... --torques seven7r     torques of moving arms: recordings of `simulate conceal --dynamics`, to which a ripple of a joint is added
    ... --short 30            of each fleet 20 further robots with so few points, diagnosed with and without what the fleet says
    ... --size 2000           one fleet of so many robots: CPU time and memory, killed and resumed

Every robot of a fleet has rigid errors, a tracker's place, poses and noise of its own, and the fleet's cause with a size that scatters by
10 % (and a phase of its own); one robot lacks it. A first fleet of a few robots scales the cause so that ln of the evidence of its cell in
one robot is about 5 (--evidence). Counted: the cause named at its place, findings that are this one or a rival, wrong names (of decided
findings, and of others whose rival is wrong as well), the robot that lacks it listed, others listed; in how many single robots the cell's
odds alone would have been enough; null fleets with any name. Needs pyarrow.
"""

import argparse
import json
import math
import os
import pathlib
import random
import resource
import shutil
import signal
import subprocess
import time

ROOT = os.path.abspath(os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", ".."))

# Cause, place in the words of the tables, and the twin's effect at a strength.
CAUSES = [
    ("backlash", "joint", lambda j, a, r: {"backlash": {"joint": j, "gap_arcsec": a}}, 6.0),
    ("gear_cyclic", "joint", lambda j, a, r: {"gear_cyclic": {"joint": j, "order": 2 + j % 3, "amplitude_arcsec": a, "phase_deg": r.uniform(0, 360)}}, 4.0),
    ("axis_wobble", "joint", lambda j, a, r: {"axis_wobble": {"joint": j, "order": 2, "amplitude_arcsec": a, "ellipse": 1, "phase_deg": r.uniform(0, 360)}}, 4.0),
    ("joint_compliance", "joint", lambda j, a, r: {"joint_compliance": {"joint": j, "rad_per_nm": 1e-9 * a}}, 20.0),
]


class Twins:
    """Robots that the pipeline simulates."""

    causes = CAUSES

    def __init__(self, args):
        robot = args.robot_file or os.path.join(ROOT, "pipelines/sr210d/robot.yaml")
        self.stages = f"""  - uses: robot
    with: {{file: {robot}}}
  - uses: simulate
    with:
      truth: {{}}
      tracker: {{position_mm: [4500, -1800, 900], roll_pitch_yaw_deg: [0.3, -0.2, 155]}}
      blocks: [{{usage: fit, points: POINTS}}]
  - uses: split
    with: {{by: usage}}
"""
        self.header = "set.simulate.seed,set.simulate.truth.offset_deg,set.simulate.truth.links,set.simulate.tracker.position_mm,set.simulate.effects"

    def robot(self, folder, name, points, own, r):
        offsets = [round(r.gauss(0, 0.05), 6) for _ in range(6)]
        links = [f"{{link: {l}, shift_mm: [{r.gauss(0, .3):.5f}, {r.gauss(0, .3):.5f}, {r.gauss(0, .3):.5f}], "
                 f"tilt_arcsec: [{r.gauss(0, 20):.3f}, {r.gauss(0, 20):.3f}, {r.gauss(0, 20):.3f}]}}" for l in range(1, 6)]
        place = [4500 + r.randrange(-900, 900), -1800 + r.randrange(-900, 900), 900 + r.randrange(-300, 300)]
        return [str(r.randrange(1 << 30)), json.dumps(offsets), "[" + ", ".join(links) + "]", json.dumps(place), json.dumps(own)]


class Arms:
    """Robots that MuJoCo makes: rigid bodies in static equilibrium, in which effects emerge."""

    causes = [
        ("backlash", "joint", lambda j, a, r: dict(kind="gap", joint=j - 1, size=a, friction=1e9, follow=1), 3e-5),
        ("gear_cyclic", "joint", lambda j, a, r: dict(kind="cyclic", joint=j - 1, waves=[(2 + j % 3, 1.0, r.uniform(0, 6.28))], size=a), 2e-5),
        ("axis_wobble", "joint", lambda j, a, r: dict(kind="wobble", joint=j - 1, side="", order=2, ellipse=1.0, phase=r.uniform(0, 6.28), size=a), 2e-5),
        ("joint_compliance", "joint", lambda j, a, r: dict(kind="compliance", joint=j - 1, size=a), 1e-7),
    ]

    def __init__(self, args):
        import mujoco_maker
        self.maker, self.arm = mujoco_maker, mujoco_maker.ROBOTS[args.mujoco]
        text = open(os.path.join(ROOT, "pipelines/case/pipeline.yaml")).read()
        before, after = text.index("stages:\n") + len("stages:\n"), text.index("  - id: nominal")
        self.stages, self.header = text[before:after], "set.case"

    def robot(self, folder, name, points, own, r):
        def conceal(rng, robot, arm, rows, *_):
            arm.build(own)
            return [], [dict(e, want=("hidden", "arm")) for e in own], [0.0] * len(own), []

        self.maker.conceal = conceal
        options = argparse.Namespace(points=3 * points // 2, jitter=3.0, hide=["temp"], scatter="gaussian", outliers=0, exchanged=0, visible=0)
        case = pathlib.Path(folder, "cases", name)
        shutil.rmtree(case, ignore_errors=True)
        self.maker.make(case, r.randrange(1 << 30), self.arm, "shared", options)
        return [str(case.resolve())]


class Torques:
    """Torques of moving arms of one model, with friction of their own, as `simulate conceal --dynamics` makes them; a gear's ripple is added."""

    diagnosis = "diagnose_torques"
    causes = [("torque_ripple", "joint", lambda j, a, r: dict(joint=j, order=2 + j % 3, amplitude=a, phase=r.uniform(0, 2 * math.pi)), 0.3)]

    def __init__(self, args):
        text = open(os.path.join(ROOT, "pipelines/dynamics/pipeline.yaml")).read()
        before, after = text.index("stages:\n") + len("stages:\n"), text.index("  # What the simulated torques lack")
        self.stages, self.header, self.calib, self.arm, self.made = text[before:after], "set.case", args.calib, args.torques, []

    def more(self, folder, r):
        """Further recordings of the arm without a concealed effect; half of them have friction of all joints."""
        seed = r.randrange(1 << 30)
        out = pathlib.Path(folder, f"concealed{seed}")
        subprocess.run([self.calib, "simulate", "conceal", "--dynamics", "--nulls", "1", "--cases", "40", "--seed", str(seed), "--out", out],
                       check=True, capture_output=True)
        self.made += [case for case in sorted(out.glob("recordings/*")) if json.load(open(case / "robot.json"))["name"] == self.arm]

    def robot(self, folder, name, points, own, r):
        while not self.made:
            self.more(folder, r)
        case, new = self.made.pop(), pathlib.Path(folder, "cases", name)
        shutil.rmtree(new, ignore_errors=True)
        shutil.copytree(case, new)
        lines = [line.split(",") for line in open(case / "recording.csv").read().splitlines()]
        for effect in own:
            j = effect["joint"]
            q, tau = (lines[0].index(column) for column in (f"q{j}_deg", f"tau{j}_nm"))
            for row in lines[1:]:
                row[tau] = f"{float(row[tau]) + effect['amplitude'] * math.cos(effect['order'] * math.radians(float(row[q])) + effect['phase']):.4f}"
        with open(new / "recording.csv", "w") as file:
            file.write("\n".join(",".join(row) for row in lines) + "\n")
        return [str(new.resolve())]


def fleet(folder, name, effects, world, r, points, prior=""):
    """A fleet whose robot k has effects[k]."""
    os.makedirs(folder, exist_ok=True)
    variables = "variables: {case: none}\n" if world.header == "set.case" else ""
    with open(os.path.join(folder, f"{name}.pipeline.yaml"), "w") as file:
        file.write(f"calib: 1\nname: {name}\nseed: 5\n{variables}stages:\n{world.stages.replace('POINTS', str(points))}  - uses: {getattr(world, 'diagnosis', 'diagnose')}\n")
    lines = ["robot,model,plant," + world.header.replace("set.case", "folder")]
    for k, own in enumerate(effects):
        quoted = ",".join('"' + cell.replace('"', '""') + '"' for cell in world.robot(folder, f"{name}-{k:05}", points, own, r))
        lines.append(f"r{k:03},arm,{'north' if k % 2 else 'south'},{quoted}")
    with open(os.path.join(folder, f"{name}.csv"), "w") as file:
        file.write("\n".join(lines) + "\n")
    path = os.path.join(folder, f"{name}.yaml")
    variable = ", variable: case" if world.header == "set.case" else ""
    with open(path, "w") as file:
        file.write(f"calib: 1\nname: {name}\npipeline: {name}.pipeline.yaml\n{prior}robots:\n  - {{list: {name}.csv{variable}}}\n")
    return path


def diagnose(path, store, args):
    command = [args.calib, "fleet", "diagnose", path, "--store", store, "--json", "--quiet", "-j", str(args.jobs)]
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode:
        raise SystemExit(f"{path}: {done.stderr[-2000:]}")
    return json.loads(done.stdout)


def first_round(store, name):
    """Rows of cell_evidence of the first round by robot: records whose given cells are none."""
    import pyarrow.parquet as parquet
    out = {}
    root = os.path.join(store, "fleets", name, "records")
    for folder, _, files in os.walk(root):
        for file in files:
            record = json.load(open(os.path.join(folder, file)))
            record = record.get("body", record)
            table = [t for t in record["tables"] if t["kind"] == "cell_evidence"]
            if not table:
                continue
            rows = parquet.read_table(object_of(store, table[0])).to_pylist()
            if any(row["given"] for row in rows):
                continue
            out[record["robot"]] = rows
    return out


def object_of(store, table):
    digest = table["file_hash"]
    return os.path.join(store, "objects", digest[:2], digest + ".parquet")


def logs(store, name, effect, place):
    out = []
    for rows in first_round(store, name).values():
        found = [row for row in rows if not row["shape"] and row["effect"] == effect and row["place"] == place]
        best = max(found, key=lambda row: row["log_evidence"], default=None)
        out.append((best["log_evidence"], best["log_prior"]) if best else (-2.0, math.log(.02)))
    return out


def scaled(out, world, cause, j, args, r):
    """The strength of a cause at a joint at which one robot says about as much of it as is wanted."""
    effect, kind, make, strength = cause
    store = os.path.join(out, "store")
    for turn in range(7):
        name = f"scale{turn}"
        diagnose(fleet(out, name, [[make(j, strength, r)] for _ in range(10)], world, r, args.points), store, args)
        seen = [log for log, _ in logs(store, name, effect, f"{kind} {j}")]
        mean = sum(seen) / len(seen)
        shutil.rmtree(store)
        if abs(mean - args.evidence) < 1:
            break
        strength *= math.sqrt((args.evidence + 4) / max(mean + 4, 1.2)) if mean > 0 else 2.5
    return strength


def short(f, cause, j, strength, world, args, r):
    """Exact diagnoses and wrong names of robots with few points, by themselves and with what the fleet says."""
    import pyarrow.parquet as parquet
    effect, kind, make, _ = cause
    store, state = os.path.join(args.out, "store"), r.getstate()
    score = []
    for name, prior in (("alone", ""), ("expected", f"prior: {{fleet: fleet{f}, stage: diagnose, by: causes}}\n")):
        r.setstate(state)
        effects = [[make(j, strength * r.gauss(1, 0.1), r)] for _ in range(20)]
        path = fleet(args.out, f"{name}{f}", effects, world, r, args.short, prior)
        subprocess.run([args.calib, "fleet", "run", path, "--store", store, "--quiet", "-j", str(args.jobs)], capture_output=True, check=True)
        exact = wrong = 0
        for table in pathlib.Path(store, "tables").glob(f"{name}{f}.*/diagnose.findings.parquet"):
            found = {(row["effect"], row["place"]) for row in parquet.read_table(table).to_pylist()}
            exact += found == {(effect, f"{kind} {j}")}
            wrong += bool(found - {(effect, f"{kind} {j}")})
        score += [exact, wrong]
    return score


def size(world, args, r):
    """One large fleet: CPU time and memory, and what a kill costs."""
    effect, kind, make, strength = world.causes[0]
    strength = args.strength or scaled(args.out, world, world.causes[0], 3, args, r)
    effects = [[] if r.random() < 0.05 else [make(3, strength * r.gauss(1, 0.1), r)] for _ in range(args.size)]
    path, store = fleet(args.out, "large", effects, world, r, args.points), os.path.join(args.out, "large.store")
    command = [args.calib, "fleet", "diagnose", path, "--store", store, "--json", "--quiet", "-j", str(args.jobs)]
    records = lambda: sum(len(files) for _, _, files in os.walk(os.path.join(store, "fleets", "large", "records")))
    begun = time.time()
    killed = subprocess.Popen(command, stdout=subprocess.DEVNULL)
    while records() < args.size // 4 and killed.poll() is None:
        time.sleep(1)
    killed.send_signal(signal.SIGKILL)
    killed.wait()
    kept, first = records(), resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    answer, both = json.loads(done.stdout), resource.getrusage(resource.RUSAGE_CHILDREN)
    cpu = both.ru_utime + both.ru_stime
    print(f"killed with {kept} records; resumed: {answer['computed']} of {answer['computed'] + kept} visits computed then, {answer['rounds']} rounds, "
          f"{cpu:.0f} s CPU = {cpu / (answer['computed'] + kept):.3f} s a robot and round, {time.time() - begun:.0f} s in all, "
          f"peak {both.ru_maxrss / 1024:.0f} MB (first {first.ru_maxrss / 1024:.0f})")
    for row in answer["findings"]:
        if not row["robot"]:
            print(row["statement"], f"(probability {row['probability']:.2f})")
    lacking = {f"r{k:03}" for k, own in enumerate(effects) if not own}
    listed = {row["robot"] for row in answer["outliers"] if row["kind"] == "lacks"}
    print(f"{len(lacking)} lack it, {len(lacking & listed)} of them listed, {len(listed - lacking)} others; "
          f"{sum(bool(row['robot']) for row in answer['findings'])} causes of single robots; page {answer['page']}")


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("out")
    parser.add_argument("--calib", required=True)
    parser.add_argument("--fleets", type=int, default=10)
    parser.add_argument("--nulls", type=int, default=10)
    parser.add_argument("--robots", type=int, default=20)
    parser.add_argument("--points", type=int, default=100)
    parser.add_argument("--evidence", type=float, default=5.0)
    parser.add_argument("--seed", type=int, default=None)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--robot-file", default=None)
    parser.add_argument("--mujoco", default=None)
    parser.add_argument("--torques", default=None)
    parser.add_argument("--short", type=int, default=0)
    parser.add_argument("--size", type=int, default=0)
    parser.add_argument("--strength", type=float, default=None, help="of the cause (torques: Nm), without a search for it")
    args = parser.parse_args()
    args.calib = os.path.abspath(args.calib)
    seed = args.seed if args.seed is not None else random.SystemRandom().randrange(1 << 31)
    print(f"seed {seed}", flush=True)
    r = random.Random(seed)
    os.makedirs(args.out, exist_ok=True)
    world = Arms(args) if args.mujoco else Torques(args) if args.torques else Twins(args)
    if args.size:
        return size(world, args, r)
    score = {"named": 0, "one of two": 0, "other": 0, "lacking listed": 0, "others listed": 0, "single": 0, "robots": 0}
    few = [0] * 4
    for f in range(args.fleets):
        cause = world.causes[f % len(world.causes)]
        effect, kind, make, _ = cause
        # Of the last of these an in-line wrist carries hardly anything.
        j = r.choice([2, 3] if effect == "joint_compliance" and args.mujoco else [2, 3, 4])
        place = f"{kind} {j}"
        store = os.path.join(args.out, "store")
        strength = args.strength or scaled(args.out, world, cause, j, args, r)
        lacking = r.randrange(args.robots)
        effects = [[] if k == lacking else [make(j, strength * r.gauss(1, 0.1), r)] for k in range(args.robots)]
        begun = time.time()
        answer = diagnose(fleet(args.out, f"fleet{f}", effects, world, r, args.points), store, args)
        seconds = time.time() - begun
        single = logs(store, f"fleet{f}", effect, place)
        shared = [row for row in answer["findings"] if not row["robot"]]
        truth = f"{effect.replace('_', ' ')} at {place}"
        is_true = lambda row: (row["effect"], row["place"]) == (effect, place)
        named = any(is_true(row) and row["decided"] for row in shared)
        either = lambda row: not row["decided"] and (is_true(row) or (row["rival"] or "").startswith(truth + " ("))
        open_ = [f"{row['effect']} at {row['place']} ({row['probability']:.2f}) or {row['rival']}" for row in shared if either(row)]
        others = [(row["effect"], row["place"], row["decided"]) for row in shared if not is_true(row) and not either(row)]
        listed = {row["robot"] for row in answer["outliers"] if row["kind"] == "lacks"}
        alone = {row["robot"] for row in answer["outliers"] if row["kind"] != "lacks"}
        score["named"] += named
        score["one of two"] += bool(open_)
        score["other"] += bool(others)
        score["lacking listed"] += f"r{lacking:03}" in listed
        score["others listed"] += len((listed | alone) - {f"r{lacking:03}"})
        score["single"] += sum(log + prior >= 3 for log, prior in single)
        score["robots"] += len(single)
        mean = sum(log for log, _ in single) / len(single)
        print(f"fleet {f}: {effect} at {place}, strength {strength:.3g}, ln E {mean:.1f} a robot: named {named}, one of two {open_}, others {others}, "
              f"r{lacking:03} listed {f'r{lacking:03}' in listed}, also listed {sorted((listed | alone) - {f'r{lacking:03}'})}; "
              f"{answer['rounds']} rounds, {seconds:.0f} s", flush=True)
        if args.short:
            now = short(f, cause, j, strength, world, args, r)
            few = [a + b for a, b in zip(few, now)]
            print(f"    {args.short} points: exact {now[0]} and wrong {now[1]} of 20 alone, {now[2]} and {now[3]} with the fleet's prior", flush=True)
        shutil.rmtree(store)
    null = alone = 0
    for f in range(args.nulls):
        store = os.path.join(args.out, "store")
        answer = diagnose(fleet(args.out, f"null{f}", [[] for _ in range(args.robots)], world, r, args.points), store, args)
        shared = [row["statement"] for row in answer["findings"] if not row["robot"]]
        single = [row["statement"] for row in answer["findings"] if row["robot"]]
        null += bool(shared)
        alone += len(single)
        print(f"null {f}: {shared or 'nothing'}; single {single}", flush=True)
        shutil.rmtree(store)
    print(json.dumps({**score, "fleets": args.fleets, "null fleets": args.nulls, "null named": null, "null single": alone,
                      **({"short: exact, wrong; with prior exact, wrong": few} if args.short else {})}))


if __name__ == "__main__":
    main()
