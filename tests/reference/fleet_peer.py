#!/usr/bin/env python3
"""Identifies the robots of a fleet with scipy and joblib, as a person would without calib, and prints the time a robot.

    python3 -m venv VENV && VENV/bin/pip install numpy scipy joblib
    VENV/bin/python tests/reference/fleet_peer.py CASES [--robots 50] [--jobs 2]

CASES holds one folder a robot (robot.json, controller.csv, tracker.csv), as `calib simulate conceal` makes them. The model is that
of `pipelines/fleet`: base 6, tool 3, two turns and two shifts an axis, zeros, ratios, declared couplings, compliance under gravity;
torques at the commanded posture are computed beforehand, the model is vectorised over rows, columns are scaled by plausible sizes.
`least_squares(method="lm")` with its own finite differences. Neither visibility nor sigmas nor a screen: the fit alone.
"""

import argparse
import csv
import json
import os
import time

for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[variable] = "1"

import numpy as np
from joblib import Parallel, delayed
from scipy.optimize import least_squares

GRAVITY = np.array([0.0, 0.0, -9.81])


def turns(axis, angle):
    """Rotation matrices (n, 3, 3) about one axis."""
    x, y, z = axis / np.linalg.norm(axis)
    k = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    s, c = np.sin(angle)[:, None, None], np.cos(angle)[:, None, None]
    return np.eye(3) + s * k + (1 - c) * (k @ k)


def chain(axes, points, q):
    """Frames of every body: rotations and translations, rows first."""
    rows = len(q)
    r, t = np.broadcast_to(np.eye(3), (rows, 3, 3)), np.zeros((rows, 3))
    out = []
    for axis, point, angle in zip(axes, points, q.T):
        turn = turns(axis, angle)
        t = t + np.einsum("nij,nj->ni", r, point - turn @ point)
        r = r @ turn
        out.append((r, t))
    return out


def read(folder):
    robot = json.load(open(folder + "/robot.json"))
    load = lambda name: {row["point_id"]: row for row in csv.DictReader(open(f"{folder}/{name}.csv"))}
    controller, tracker = load("controller"), load("tracker")
    ids = [i for i in controller if i in tracker]
    n = len(robot["axes"])
    q = np.array([[np.radians(float(controller[i][f"q{j + 1}_deg"])) for j in range(n)] for i in ids])
    p = np.array([[float(tracker[i][f"{a}_mm"]) * 1e-3 for a in "xyz"] for i in ids])
    payload = np.array([float(controller[i].get("payload_kg") or 0) for i in ids])
    fit = np.array([controller[i].get("use", "fit") in ("fit", "") for i in ids])
    return robot, q, p, payload, fit


def torques(robot, q, payload):
    axes, points = np.array(robot["axes"], float), np.array(robot["points"]) * 1e-3
    frames = chain(axes, points, q)
    masses = [np.full(len(q), float(m)) for m in robot["mass"]] + [payload]
    centres = [np.array(c) * 1e-3 for c in robot["com"]] + [np.array(robot["tool"]) * 1e-3 + np.array(robot["payload_com"]) * 1e-3]
    bodies = list(range(len(axes))) + [len(axes) - 1]
    out = np.zeros_like(q)
    for j in range(len(axes)):
        r, t = frames[j]
        axis, at = r @ axes[j], np.einsum("nij,j->ni", r, points[j]) + t
        for mass, centre, body in zip(masses, centres, bodies):
            if body >= j:
                arm = frames[body][0] @ centre + frames[body][1] - at
                out[:, j] += np.einsum("ni,ni->n", axis, np.cross(arm, mass[:, None] * GRAVITY))
    return out


def normals(axis):
    order = np.argsort(np.abs(axis), kind="stable")[:2]
    u = np.cross(axis, np.eye(3)[order[0]])
    u /= np.linalg.norm(u)
    return u, np.cross(axis, u)


def identify(folder):
    begun = time.perf_counter()
    robot, q, p, payload, fit = read(folder)
    axes, points, tool = np.array(robot["axes"], float), np.array(robot["points"]) * 1e-3, np.array(robot["tool"]) * 1e-3
    n, torque = len(axes), torques(robot, q, payload)
    pairs = [(moved, by) for moved, by in robot.get("coupling", [])]
    planes = [normals(axis) for axis in axes]

    def split(x):
        sizes = [3, 3, 3, 2 * n, 2 * n, n, n, len(pairs), n]
        return np.split(x, np.cumsum(sizes)[:-1])

    def model(x, rows):
        turn, shift, hand, tilts, moves, zeros, ratios, couplings, soft = split(x)
        drive = q[rows] * (1 + ratios) + zeros + soft * torque[rows]
        for value, (moved, by) in zip(couplings, pairs):
            drive[:, moved] += value * q[rows][:, by]
        bent = [a + tilts[2 * j] * u + tilts[2 * j + 1] * v for j, (a, (u, v)) in enumerate(zip(axes, planes))]
        stood = [b + moves[2 * j] * u + moves[2 * j + 1] * v for j, (b, (u, v)) in enumerate(zip(points, planes))]
        r, t = chain(bent, stood, drive)[-1]
        at = np.einsum("nij,j->ni", r, tool + hand) + t
        angle = np.linalg.norm(turn)
        small = turns(turn / angle, np.array([angle]))[0] if angle > 0 else np.eye(3)
        return (base[0] @ (small @ at.T)).T + base[1] + shift

    base = (np.eye(3), np.zeros(3))
    start = np.zeros(9 + 4 * n + 3 * n + len(pairs))
    a, b = model(start, fit), p[fit]
    u, _, vt = np.linalg.svd((b - b.mean(0)).T @ (a - a.mean(0)))
    turn = u @ np.diag([1, 1, np.linalg.det(u @ vt)]) @ vt
    base = (turn, b.mean(0) - turn @ a.mean(0))
    scale = np.concatenate([np.full(3, 1e-3), np.full(6, 1e-3), np.full(2 * n, 1e-3), np.full(2 * n, 1e-3), np.full(n, 1e-3),
                            np.full(n, 1e-3), np.full(len(pairs), 1e-3), np.full(n, 1e-6)])
    found = least_squares(lambda x: ((model(x * scale, fit) - p[fit]) / 1e-5).ravel(), start, method="trf", x_scale=1.0, max_nfev=30)
    errors = np.linalg.norm(model(found.x * scale, ~fit) - p[~fit], axis=1) * 1e3
    return time.perf_counter() - begun, float(np.sqrt(np.mean(errors**2))) if len(errors) else float("nan")


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("cases")
    parser.add_argument("--robots", type=int, default=50)
    parser.add_argument("--jobs", type=int, default=2)
    wanted = parser.parse_args()
    whole = ("robot.json", "controller.csv", "tracker.csv")
    folders = [f"{wanted.cases}/{name}" for name in sorted(os.listdir(wanted.cases))]
    folders = [f for f in folders if all(os.path.isfile(f"{f}/{name}") for name in whole)]
    def attempt(folder):
        try:
            return identify(folder)
        except Exception:  # a broken robot
            return None
    Parallel(n_jobs=wanted.jobs)(delayed(attempt)(folder) for folder in folders[:wanted.jobs])  # processes and imports
    begun = time.perf_counter()
    found = Parallel(n_jobs=wanted.jobs, batch_size=1)(delayed(attempt)(folder) for folder in folders[:wanted.robots])
    wall = time.perf_counter() - begun
    found = [entry for entry in found if entry]
    print(f"{len(found)} robots in {wall:.2f} s on {wanted.jobs} processes: {wall / len(found) * 1e3:.1f} ms a robot, median "
          f"{np.median([seconds for seconds, _ in found]) * 1e3:.1f} ms of one process; held-out rms, median "
          f"{np.median([rms for _, rms in found]):.4f} mm")


if __name__ == "__main__":
    main()
