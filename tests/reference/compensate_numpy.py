"""A vectorised Newton in numpy beside `calib compensate`, on the same geometry and the same targets, in the same run.

    calib export MODEL --format json --out model.json
    python compensate_numpy.py model.json CALIB MODEL COUNT

Needs numpy. There the geometry alone is solved, batches at once (stacked Jacobians and solves, least change of the joints) to the same
10 nm; once on vectors alone, once from text to text as calib does it, which solves its whole model. Prints all rates and calib's peak memory.
"""

import json
import os
import resource
import subprocess
import sys
import tempfile
import time

import numpy as np

SETTLED = 1e-8  # m
STEPS = 30
BATCH = 2000  # targets, the fastest here: they stay in the cache


def chain(axes, points, tool, q):
    """Tool points and Jacobians (n, 3, joints) of positions (n, joints)."""
    n, joints = q.shape
    rotation, translation = np.broadcast_to(np.eye(3), (n, 3, 3)), np.zeros((n, 3))
    world_axes, world_points = np.empty((n, joints, 3)), np.empty((n, joints, 3))
    for j in range(joints):
        world_axes[:, j] = rotation @ axes[j]
        world_points[:, j] = rotation @ points[j] + translation
        a = axes[j]
        cross = np.array([[0, -a[2], a[1]], [a[2], 0, -a[0]], [-a[1], a[0], 0]])
        turn = np.eye(3) + np.sin(q[:, j])[:, None, None] * cross + (1 - np.cos(q[:, j]))[:, None, None] * (cross @ cross)
        shift = points[j] - turn @ points[j]
        translation = (rotation @ shift[..., None])[..., 0] + translation
        rotation = rotation @ turn
    point = rotation @ tool + translation
    return point, np.cross(world_axes, point[:, None] - world_points).transpose(0, 2, 1)


def newton(real, nominal, q):
    """Commands, and what is left of the displacement (m); targets that have settled are left alone."""
    wanted, _ = chain(*nominal, q)
    out, left, rows = q.copy(), np.zeros(len(q)), np.arange(len(q))
    for _ in range(STEPS):
        point, jacobian = chain(*real, out[rows])
        error = wanted[rows] - point
        left[rows] = np.linalg.norm(error, axis=1)
        far = left[rows] > SETTLED
        rows, jacobian, error = rows[far], jacobian[far], error[far]
        if not len(rows):
            break
        back = jacobian.transpose(0, 2, 1)
        out[rows] += (back @ np.linalg.solve(jacobian @ back, error[..., None]))[..., 0]
    return out, left.max()


def main(model_file, calib, source, count):
    model = json.load(open(model_file))
    real = (
        np.array([joint["axis"] for joint in model["joints"]]),
        np.array([joint["point_m"] for joint in model["joints"]]),
        np.array(model["tool"]["point_m"]),
    )
    nominal = (np.round(real[0]), np.round(real[1], 3), np.round(real[2], 3))
    limits = np.array([joint["limits"] for joint in model["joints"]])
    middle, half = limits.mean(1), 0.4 * (limits[:, 1] - limits[:, 0])
    q = np.random.default_rng(1).uniform(middle - half, middle + half, size=(int(count), len(limits)))
    batches = max(1, len(q) // BATCH)
    begun, cpu = time.perf_counter(), time.process_time()
    worst = max(newton(real, nominal, part)[1] for part in np.array_split(q, batches))
    numpy_rate, numpy_cpu = len(q) / (time.perf_counter() - begun), (time.process_time() - cpu) / len(q)
    print(f"numpy Newton on vectors: {numpy_rate:,.0f} targets/s, {1e6 * numpy_cpu:.1f} us CPU each, residual {worst * 1e6:.3f} um at most")

    with tempfile.NamedTemporaryFile("w", suffix=".csv") as targets:
        targets.write(",".join(f"q{j + 1}_rad" for j in range(len(limits))) + "\n")
        np.savetxt(targets, q, delimiter=",", fmt="%.9f")
        targets.flush()
        begun = time.perf_counter()
        read = np.loadtxt(targets.name, delimiter=",", skiprows=1)
        solved = np.concatenate([newton(real, nominal, part)[0] for part in np.array_split(read, batches)])
        np.savetxt(targets.name + ".out.csv", solved, delimiter=",", fmt="%.9f")
        text_rate = len(q) / (time.perf_counter() - begun)
        print(f"numpy Newton from text to text: {text_rate:,.0f} targets/s")
        for more in ([], ["--no-sigma"]):
            command = [calib, "compensate", source, targets.name, "--out", targets.name + ".out.csv", "--quiet", *more]
            begun, cpu = time.perf_counter(), children()
            subprocess.run(command, check=True)
            rate, each = len(q) / (time.perf_counter() - begun), (children() - cpu) / len(q)
            peak = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024
            print(
                f"calib {' '.join(more)}: {rate:,.0f} targets/s ({rate / text_rate:.1f} x text to text, {rate / numpy_rate:.1f} x vectors), "
                f"{1e6 * each:.1f} us CPU each ({numpy_cpu / each:.1f} x vectors), peak {peak:.0f} MB"
            )
        os.remove(targets.name + ".out.csv")


def children():
    """CPU seconds of the processes that have ended."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


if __name__ == "__main__":
    main(*sys.argv[1:])
