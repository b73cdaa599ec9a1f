#!/usr/bin/env python3
"""Proof of `calib fleet diagnose`: fleets of twins with a cause that each recording alone hardly shows.

    python3 tests/reference/fleet_causes.py OUT --calib target/debug/calib [--fleets 10] [--robots 20] [--points 100] [--nulls 10] [--seed N]

Every robot of a fleet has rigid errors, a tracker's place, poses and noise of its own, and the fleet's cause with a size that scatters by
10 % (and a phase of its own); one robot lacks it. A first fleet of a few robots scales the cause so that ln of the evidence of its cell in
one robot is about 5 (--evidence). Counted: the cause named at its place, findings that are this one or a rival, wrong names (of decided
findings, and of others whose rival is wrong as well), the robot that lacks it listed, others listed; in how many single robots the cell's
odds alone would have been enough; null fleets with any name.
"""

import argparse
import json
import math
import os
import random
import shutil
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


def pipeline(folder, args):
    robot = args.robot_file or os.path.join(ROOT, "pipelines/sr210d/robot.yaml")
    text = f"""calib: 1
name: twins
seed: 5
stages:
  - uses: robot
    with: {{file: {robot}}}
  - uses: simulate
    with:
      truth: {{}}
      tracker: {{position_mm: [4500, -1800, 900], roll_pitch_yaw_deg: [0.3, -0.2, 155]}}
      blocks: [{{usage: fit, points: {args.points}}}]
  - uses: split
    with: {{by: usage}}
  - uses: diagnose
"""
    with open(os.path.join(folder, "twins.yaml"), "w") as file:
        file.write(text)


def fleet(folder, name, effects, r):
    """A fleet whose robot k has effects[k]."""
    os.makedirs(folder, exist_ok=True)
    lines = ["robot,model,plant,set.simulate.seed,set.simulate.truth.offset_deg,set.simulate.truth.links,set.simulate.tracker.position_mm,set.simulate.effects"]
    for k, own in enumerate(effects):
        offsets = [round(r.gauss(0, 0.05), 6) for _ in range(6)]
        links = [f"{{link: {l}, shift_mm: [{r.gauss(0, .3):.5f}, {r.gauss(0, .3):.5f}, {r.gauss(0, .3):.5f}], "
                 f"tilt_arcsec: [{r.gauss(0, 20):.3f}, {r.gauss(0, 20):.3f}, {r.gauss(0, 20):.3f}]}}" for l in range(1, 6)]
        place = [4500 + r.randrange(-900, 900), -1800 + r.randrange(-900, 900), 900 + r.randrange(-300, 300)]
        cells = [json.dumps(offsets), "[" + ", ".join(links) + "]", json.dumps(place), json.dumps(own)]
        quoted = ",".join('"' + cell.replace('"', '""') + '"' for cell in cells)
        lines.append(f"r{k:03},sr210d,{'north' if k % 2 else 'south'},{r.randrange(1 << 30)},{quoted}")
    with open(os.path.join(folder, f"{name}.csv"), "w") as file:
        file.write("\n".join(lines) + "\n")
    path = os.path.join(folder, f"{name}.yaml")
    with open(path, "w") as file:
        file.write(f"calib: 1\nname: {name}\npipeline: twins.yaml\nrobots:\n  - list: {name}.csv\n")
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


def place_of(kind, j):
    return f"{kind} {j}"


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
    args = parser.parse_args()
    args.calib = os.path.abspath(args.calib)
    seed = args.seed if args.seed is not None else random.SystemRandom().randrange(1 << 31)
    print(f"seed {seed}")
    r = random.Random(seed)
    os.makedirs(args.out, exist_ok=True)
    pipeline(args.out, args)
    score = {"named": 0, "one of two": 0, "other": 0, "lacking listed": 0, "others listed": 0, "single": 0, "robots": 0}
    for f in range(args.fleets):
        effect, kind, make, strength = CAUSES[f % len(CAUSES)]
        j = r.choice([2, 3, 4])
        place = place_of(kind, j)
        store = os.path.join(args.out, "store")
        for turn in range(7):
            path = fleet(args.out, f"scale{f}-{turn}", [[make(j, strength, r)] for _ in range(6)], r)
            diagnose(path, store, args)
            seen = [log for log, _ in logs(store, f"scale{f}-{turn}", effect, place)]
            mean = sum(seen) / len(seen)
            if abs(mean - args.evidence) < 1:
                break
            strength *= math.sqrt((args.evidence + 4) / max(mean + 4, 1.2)) if mean > 0 else 2.5
        lacking = r.randrange(args.robots)
        effects = [[] if k == lacking else [make(j, strength * r.gauss(1, 0.1), r)] for k in range(args.robots)]
        begun = time.time()
        answer = diagnose(fleet(args.out, f"fleet{f}", effects, r), store, args)
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
        shutil.rmtree(store)
    null = alone = 0
    for f in range(args.nulls):
        store = os.path.join(args.out, "store")
        answer = diagnose(fleet(args.out, f"null{f}", [[] for _ in range(args.robots)], r), store, args)
        shared = [row["statement"] for row in answer["findings"] if not row["robot"]]
        single = [row["statement"] for row in answer["findings"] if row["robot"]]
        null += bool(shared)
        alone += len(single)
        print(f"null {f}: {shared or 'nothing'}; single {single}", flush=True)
        shutil.rmtree(store)
    print(json.dumps({**score, "fleets": args.fleets, "null fleets": args.nulls, "null named": null, "null single": alone}))


if __name__ == "__main__":
    main()
