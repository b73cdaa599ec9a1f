"""A vectorised Newton in numpy beside `calib compensate`, on the same geometry and the same targets, in the same run.

    calib export MODEL --format json --out model.json
    python compensate_numpy.py model.json CALIB MODEL COUNT

Needs numpy. All targets are solved at once in numpy (batched Jacobians and solves, least change of the joints, four steps, which bring the
residual below a nanometre); calib reads the targets as text, solves its whole model and writes text. Prints both rates and calib's peak memory.
"""

import json
import os
import resource
import subprocess
import sys
import tempfile
import time

import numpy as np


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
    wanted, _ = chain(*nominal, q)
    out = q.copy()
    for _ in range(4):
        point, jacobian = chain(*real, out)
        step = np.linalg.solve(jacobian @ jacobian.transpose(0, 2, 1), (wanted - point)[..., None])
        out += (jacobian.transpose(0, 2, 1) @ step)[..., 0]
    point, _ = chain(*real, out)
    return out, np.linalg.norm(wanted - point, axis=1).max()


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
    begun, cpu = time.perf_counter(), time.process_time()
    worst = max(newton(real, nominal, part)[1] for part in np.array_split(q, max(1, len(q) // 20000)))
    numpy_rate, numpy_cpu = len(q) / (time.perf_counter() - begun), (time.process_time() - cpu) / len(q)
    print(f"numpy Newton: {numpy_rate:,.0f} targets/s, {1e6 * numpy_cpu:.1f} us CPU each, residual {worst * 1e3:.1e} mm at most")

    with tempfile.NamedTemporaryFile("w", suffix=".csv") as targets:
        targets.write(",".join(f"q{j + 1}_rad" for j in range(len(limits))) + "\n")
        np.savetxt(targets, q, delimiter=",", fmt="%.9f")
        targets.flush()
        for more in ([], ["--no-sigma"]):
            command = [calib, "compensate", source, targets.name, "--out", targets.name + ".out.csv", "--quiet", *more]
            begun, cpu = time.perf_counter(), children()
            subprocess.run(command, check=True)
            rate, each = len(q) / (time.perf_counter() - begun), (children() - cpu) / len(q)
            peak = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024
            print(
                f"calib {' '.join(more)}: {rate:,.0f} targets/s ({rate / numpy_rate:.1f} x), {1e6 * each:.1f} us CPU each "
                f"({numpy_cpu / each:.1f} x), text in and out, peak {peak:.0f} MB"
            )
        os.remove(targets.name + ".out.csv")


def children():
    """CPU seconds of the processes that have ended."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


if __name__ == "__main__":
    main(*sys.argv[1:])
