#!/usr/bin/env python3
"""`calib fleet run` against scipy's `least_squares` and joblib on the same robots, in CPU-seconds a robot.

    python3 tests/reference/fleet_peer.py OUT --calib target/release/calib [--robots 40] [--points 100] [--jobs 2] [--seed 1]

Both read the same files and identify the same model (that of `pipelines/fleet`): base 6, tool 3, two turns and two shifts an axis, zeros,
ratios, couplings, compliance under gravity. The peer is vectorised over rows, its columns are scaled by plausible sizes; it has neither
sigmas nor a screen of wrong points nor tables. Printed: CPU-seconds a robot of each (the peer's without the start of its processes), held-out
errors, the ratio, and by the runs' records which share of calib's time is reading, fits, and all else (planning, hashing, writing).
"""

import argparse
import csv
import json
import os
import pathlib
import resource
import shutil
import subprocess
import time

for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[variable] = "1"

import numpy as np
from joblib import Parallel, delayed
from scipy.optimize import least_squares

ROOT = pathlib.Path(__file__).resolve().parents[2]
GRAVITY = np.array([0.0, 0.0, -9.81])


def turns(axis, angle):
    """Rotation matrices (n, 3, 3) about one axis."""
    x, y, z = axis / np.linalg.norm(axis)
    k = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    s, c = np.sin(angle)[:, None, None], np.cos(angle)[:, None, None]
    return np.eye(3) + s * k + (1 - c) * (k @ k)


def chain(axes, points, q):
    """Frames of every body: rotations and translations, rows first."""
    r, t = np.broadcast_to(np.eye(3), (len(q), 3, 3)), np.zeros((len(q), 3))
    for axis, point, angle in zip(axes, points, q.T):
        turn = turns(axis, angle)
        t = t + np.einsum("nij,nj->ni", r, point - turn @ point)
        r = r @ turn
        yield r, t


def read(folder):
    robot = json.load(open(folder / "robot.json"))
    controller, tracker = ({row["point_id"]: row for row in csv.DictReader(open(folder / f"{name}.csv"))} for name in ("controller", "tracker"))
    ids = [i for i in controller if i in tracker]
    q = np.radians([[float(controller[i][f"q{j + 1}_deg"]) for j in range(len(robot["axes"]))] for i in ids])
    p = np.array([[float(tracker[i][f"{a}_mm"]) * 1e-3 for a in "xyz"] for i in ids])
    payload = np.array([float(controller[i].get("payload_kg") or 0) for i in ids])
    return robot, q, p, payload, np.array([controller[i].get("use", "fit") in ("fit", "") for i in ids])


def torques(robot, q, payload):
    axes, points = np.array(robot["axes"], float), np.array(robot["points"]) * 1e-3
    frames, last = list(chain(axes, points, q)), len(axes) - 1
    bodies = [(np.full(len(q), float(m)), np.array(c) * 1e-3, body) for body, (m, c) in enumerate(zip(robot["mass"], robot["com"]))]
    bodies.append((payload, np.array(robot["tool"]) * 1e-3 + np.array(robot["payload_com"]) * 1e-3, last))
    out = np.zeros_like(q)
    for j, (r, t) in enumerate(frames):
        axis, at = r @ axes[j], np.einsum("nij,j->ni", r, points[j]) + t
        for mass, centre, body in bodies:
            if body >= j:
                arm = frames[body][0] @ centre + frames[body][1] - at
                out[:, j] += np.einsum("ni,ni->n", axis, np.cross(arm, mass[:, None] * GRAVITY))
    return out


def normals(axis):
    u = np.cross(axis, np.eye(3)[np.argsort(np.abs(axis), kind="stable")[0]])
    return u / np.linalg.norm(u), np.cross(axis, u / np.linalg.norm(u))


def identify(folder):
    """CPU-seconds and the held-out rms, mm."""
    begun = time.process_time()
    robot, q, p, payload, fit = read(folder)
    axes, points, tool = np.array(robot["axes"], float), np.array(robot["points"]) * 1e-3, np.array(robot["tool"]) * 1e-3
    n, torque, pairs = len(axes), torques(robot, q, payload), robot.get("coupling", [])
    planes, base = [normals(axis) for axis in axes], (np.eye(3), np.zeros(3))
    sizes = [3, 3, 3, 2 * n, 2 * n, n, n, len(pairs), n]
    scale = np.repeat([1e-3] * 8 + [1e-6], sizes)

    def model(x, rows):
        turn, shift, hand, tilts, moves, zeros, ratios, couplings, soft = np.split(x * scale, np.cumsum(sizes)[:-1])
        drive = q[rows] * (1 + ratios) + zeros + soft * torque[rows]
        for value, (moved, by) in zip(couplings, pairs):
            drive[:, moved] += value * q[rows][:, by]
        bent, stood = ([a + by[2 * j] * planes[j][0] + by[2 * j + 1] * planes[j][1] for j, a in enumerate(of)] for of, by in ((axes, tilts), (points, moves)))
        *_, (r, t) = chain(bent, stood, drive)
        at = np.einsum("nij,j->ni", r, tool + hand) + t
        angle = np.linalg.norm(turn)
        small = turns(turn / angle, np.array([angle]))[0] if angle > 0 else np.eye(3)
        return (base[0] @ (small @ at.T)).T + base[1] + shift

    start = np.zeros(sum(sizes))
    a, b = model(start, fit), p[fit]
    u, _, vt = np.linalg.svd((b - b.mean(0)).T @ (a - a.mean(0)))
    turn = u @ np.diag([1, 1, np.linalg.det(u @ vt)]) @ vt
    base = (turn, b.mean(0) - turn @ a.mean(0))
    found = least_squares(lambda x: ((model(x, fit) - p[fit]) / 1e-5).ravel(), start, method="trf", max_nfev=30)
    errors = np.linalg.norm(model(found.x, ~fit) - p[~fit], axis=1) * 1e3
    return time.process_time() - begun, float(np.sqrt(np.mean(errors**2)))


def where(store):
    """Seconds of reading, of fits and in all, by the manifests of the robots' runs."""
    sums = {"reading": 0.0, "fits": 0.0, "other stages": 0.0, "all": 0.0}
    for path in store.glob("runs/*/manifest.json"):
        manifest = json.load(open(path))
        sums["all"] += manifest["wall_seconds"]
        for stage in manifest["stages"]:
            kind = {"robot": "reading", "ingest": "reading", "identify": "fits"}.get(stage["uses"], "other stages")
            sums[kind] += stage["wall_seconds"]
    return sums


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("out", type=pathlib.Path)
    parser.add_argument("--calib", required=True)
    parser.add_argument("--robots", type=int, default=40)
    parser.add_argument("--points", type=int, default=100)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--seed", type=int, default=1)
    args = parser.parse_args()
    calib, out = os.path.abspath(args.calib), args.out.resolve()
    shutil.rmtree(out, ignore_errors=True)
    subprocess.run([calib, "simulate", "conceal", "--out", out, "--cases", str(args.robots), "--points", str(args.points), "--robot", "sr210d",
                    "--nulls", "1", "--faulty", "0", "--seed", str(args.seed)], check=True, stdout=subprocess.DEVNULL)
    (out / "FLEET.yaml").write_text(f"calib: 1\nname: peer\npipeline: {ROOT}/pipelines/fleet/pipeline.yaml\nrobots:\n  - folders: recordings/*\n")
    cpu = lambda: sum(resource.getrusage(resource.RUSAGE_CHILDREN)[:2])
    before = cpu()
    done = subprocess.run([calib, "fleet", "run", out / "FLEET.yaml", "--store", out / "store", "--json", "--quiet", "-j", str(args.jobs)],
                          check=True, capture_output=True, text=True)
    ours, robots = (cpu() - before) / args.robots, json.loads(done.stdout)["robots"]
    assert all(robot["status"] == "done" for robot in robots)
    peer = Parallel(n_jobs=args.jobs)(delayed(identify)(folder) for folder in sorted(out.glob("recordings/*")))
    theirs = sum(seconds for seconds, _ in peer) / args.robots
    print(f"{args.robots} robots of {args.points} points: calib {1e3 * ours:.1f} ms CPU a robot, scipy {1e3 * theirs:.1f} ms: {theirs / ours:.1f} x; held-out rms, "
          f"median, {np.median([robot['after_rms_mm'] for robot in robots]):.4f} and {np.median([rms for _, rms in peer]):.4f} mm")
    sums = where(out / "store")
    whole = sums.pop("all")
    print(", ".join(f"{name} {100 * seconds / whole:.0f} %" for name, seconds in sums.items()) + f", planning, hashing and writing {100 - 100 * sum(sums.values()) / whole:.0f} %")


if __name__ == "__main__":
    main()
