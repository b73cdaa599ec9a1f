#!/usr/bin/env python3
"""A fleet measured twice: which robots changed, and whether those are flagged with the right parameter; and what a pool is worth.

    python3 tests/reference/recalibration.py --calib target/debug/calib [--robots 100] [--changed 10] [--kinds zero,compliance,link]

Twins of the SR210D, every one with zeros, links and compliances of its own; the second time the tracker stands elsewhere, poses are
others, and some robots have changed. Then the same robots with 20 points, with and without priors pooled over the others of their
model, judged on held-out points. Ends with 1 where a changed robot is not flagged with its parameter, more than one other is
flagged, or the pool does not help. Some minutes.
"""

import argparse
import json
import os
import random
import statistics
import subprocess
import sys
import tempfile

ROOT = os.path.abspath(os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", ".."))
PIPELINE = """calib: 1
name: twins
seed: 5
stages:
  - uses: robot
    with: {{file: {root}/pipelines/sr210d/robot.yaml}}
  - uses: simulate
    with:
      truth: {{}}
      tracker: {{position_mm: [4500, -1800, 900], roll_pitch_yaw_deg: [0.3, -0.2, 155]}}
      repeatability_arcsec: [2, 2, 2, 2, 2, 2]
      poses: {{range_deg: [[-90, 90], [-40, 60], [-55, 55], [-120, 120], [-75, 75], [-160, 160]]}}
      blocks: [{{usage: fit, points: {fit}}}, {{usage: validate, points: {check}}}]
  - uses: split
    with: {{by: usage}}
  - {{id: nominal, uses: identify, with: {{effects: [base_frame], folds: 0}}}}
  - {{id: joint, uses: identify, with: {{effects: [base_frame, tool_offset, joint_offset, link_geometry, joint_compliance], folds: 0}}}}
  - uses: compare
  - uses: validate
"""
TARGETS = ("seed", "truth.offset_deg", "truth.links", "truth.compliance_rad_nm", "tracker.position_mm")


def draw(chance, kind):
    """(effect, place, what is added)"""
    if kind == "zero":
        return "zero_shift", f"joint {chance.choice([2, 3, 4, 5])}", chance.choice([-1, 1]) * chance.uniform(0.01, 0.04)
    if kind == "compliance":
        return "joint_compliance", f"joint {chance.choice([2, 3])}", chance.uniform(0.3, 0.6)
    return "link_geometry", "link 3", chance.uniform(0.15, 0.4)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--calib", required=True)
    parser.add_argument("--robots", type=int, default=100)
    parser.add_argument("--changed", type=int, default=10)
    parser.add_argument("--points", type=int, default=80)
    parser.add_argument("--kinds", default="zero,compliance,link")
    parser.add_argument("--seed", type=int, default=1)
    wanted = parser.parse_args()
    calib, chance = os.path.abspath(wanted.calib), random.Random(wanted.seed)
    folder = tempfile.mkdtemp(prefix="calib-recalibration.")
    put = lambda name, text: open(os.path.join(folder, name), "w").write(text)
    robots = [
        ([chance.uniform(-0.1, 0.1) for _ in range(6)], [[chance.uniform(-0.5, 0.5) for _ in range(3)] for _ in range(5)],
         [0] + [c * chance.uniform(0.8, 1.2) for c in (2.0e-7, 3.0e-7, 1.5e-6, 2.0e-6)] + [0])
        for _ in range(wanted.robots)
    ]
    changes = {robot: draw(chance, chance.choice(wanted.kinds.split(","))) for robot in chance.sample(range(wanted.robots), wanted.changed)}
    for campaign, name in enumerate(("spring", "autumn")):
        lines = ["robot,model," + ",".join("set.simulate." + target for target in TARGETS)]
        for robot, (zeros, links, soft) in enumerate(robots):
            zeros, links, soft = list(zeros), [list(link) for link in links], list(soft)
            if campaign and robot in changes:
                effect, place, by = changes[robot]
                number = int(place.split()[1]) - 1
                if effect == "zero_shift":
                    zeros[number] += by
                elif effect == "joint_compliance":
                    soft[number] *= 1 + by
                else:
                    links[number][2] += by
            stated = ", ".join("{link: %d, shift_mm: [%.5f, %.5f, %.5f]}" % (k + 1, *link) for k, link in enumerate(links))
            place = [4500 + 13 * robot * campaign, -1800 + 200 * campaign, 900]
            lines.append(f'robot {robot},sr210d,{1000 * (campaign + 1) + robot},"{zeros}","[{stated}]","{soft}","{place}"')
        put(name + ".csv", "\n".join(lines) + "\n")
    put("twins.yaml", PIPELINE.format(root=ROOT, fit=wanted.points, check=20))
    put("few.yaml", PIPELINE.format(root=ROOT, fit=20, check=60))

    def run(name, pipeline, robots, rest=""):
        put(name + ".yaml", f"calib: 1\nname: {name}\npipeline: {pipeline}\nrobots:\n  - list: {robots}.csv\n{rest}")
        words = [calib, "fleet", "run", os.path.join(folder, name + ".yaml"), "--store", os.path.join(folder, "store"), "--json", "--quiet"]
        told = json.loads(subprocess.run(words, check=True, stdout=subprocess.PIPE).stdout)
        print(f"{name}: {told['done']} robots in {told['wall_seconds']:.0f} s", flush=True)
        return told["robots"]

    run("spring", "twins.yaml", "spring", "groups: {campaign: 2026-04-01}\n")
    autumn = run("autumn", "twins.yaml", "autumn", "groups: {campaign: 2026-10-01}\nprevious: {fleet: spring}\n")
    flags = {robot: entry["flags"] for robot, entry in enumerate(autumn) if entry["flags"]}
    right = 0
    for robot, (effect, place, by) in sorted(changes.items()):
        good = flags.get(robot, "").startswith(f"{effect} {place} since 2026-04-01")
        right += good
        print(f"  robot {robot}: {effect} {place} {by:+.4f}: {'flagged: ' if good else 'MISSED: '}{flags.get(robot)}")
    false = sorted(set(flags) - set(changes))
    print(f"changed robots flagged with the right parameter: {right} of {wanted.changed}; others flagged: {len(false)} of {wanted.robots - wanted.changed}")
    for robot in false:
        print(f"  robot {robot}: {flags[robot]}")

    plain = run("plain", "few.yaml", "spring")
    rest = "prior: {fleet: autumn, stage: joint, by: model, effects: [joint_compliance, joint_offset, link_geometry, tool_offset]}\n"
    pooled = run("pooled", "few.yaml", "spring", rest)
    pairs = [(a["after_rms_mm"], b["after_rms_mm"]) for a, b in zip(plain, pooled)]
    median = [statistics.median(values) for values in zip(*pairs)]
    better = sum(b < a for a, b in pairs)
    print(f"20 points, held-out rms, median: {median[0]:.4f} mm alone, {median[1]:.4f} mm with the pool; better in {better} of {len(pairs)}")
    sys.exit(0 if right == wanted.changed and len(false) <= 1 and median[1] < median[0] else 1)


if __name__ == "__main__":
    main()
