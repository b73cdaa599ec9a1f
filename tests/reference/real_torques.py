#!/usr/bin/env python3
"""Turns two public recordings of moving arms into folders for pipelines/dynamics: robot.json (geometry alone) and recording.csv.

  real_torques.py tx40 DATA OUT     DATA holds pos_read_data.csv and curr_data.csv of figaroh-examples (Apache-2.0): Staubli TX40, 5 kHz
  real_torques.py ur10 BAG.db3 OUT  a rosbag2 of sensor_msgs/JointState of unisa-acg/inverse-dynamics-solver (BSD-3): UR10, 125 Hz

  calib diagnose pipelines/dynamics/pipeline.yaml --set case=OUT --set diagnose_torques.hold_out.last=0.4 \\
      --set diagnose_torques.inertials=free --set diagnose_torques.cutoff_hz=6

No masses are declared, so base parameters are identified. Needs nothing but Python.
"""

import csv
import json
import math
import sqlite3
import struct
import sys
from pathlib import Path


def matmul(a, b):
    return [[sum(a[i][k] * b[k][j] for k in range(4)) for j in range(4)] for i in range(4)]


def turn_z(q, along=0.0):
    c, s = math.cos(q), math.sin(q)
    return [[c, -s, 0, 0], [s, c, 0, 0], [0, 0, 1, along], [0, 0, 0, 1]]


def turn_x(alpha, along=0.0):
    c, s = round(math.cos(alpha), 15), round(math.sin(alpha), 15)
    return [[1, 0, 0, along], [0, c, -s, 0], [0, s, c, 0], [0, 0, 0, 1]]


def arm(name, rows, modified, tool, ratio, coupling):
    """Axes and points (mm) at zero of rows (alpha, a, d); `modified`: x before z (Khalil), else after it (Denavit and Hartenberg)."""
    at, axes, points = turn_z(0), [], []
    for alpha, a, d in rows:
        if modified:
            at = matmul(at, turn_x(alpha, a))
        axes.append([at[i][2] for i in range(3)])
        points.append([1e3 * at[i][3] for i in range(3)])
        at = matmul(at, turn_z(0, d))
        if not modified:
            at = matmul(at, turn_x(alpha, a))
    last = [1e3 * (at[i][3] + tool * at[i][2]) for i in range(3)]
    n = len(rows)
    return {"name": name, "axes": axes, "points": points, "tool": last, "ratio": ratio, "kt": [1.0] * n, "coupling": coupling,
            "gravity": [0, 0, -9.81]}


def write(out, robot, time, joints, torque):
    out.mkdir(parents=True, exist_ok=True)
    (out / "robot.json").write_text(json.dumps(robot, indent=1) + "\n")
    n = len(joints[0])
    with open(out / "recording.csv", "w", encoding="utf-8") as file:
        file.write(",".join(["time_s"] + [f"q{j}_deg" for j in range(1, n + 1)] + [f"tau{j}_nm" for j in range(1, n + 1)]) + "\n")
        for t, q, tau in zip(time, joints, torque):
            numbers = [f"{t:.6f}"] + [f"{math.degrees(x):.7f}" for x in q] + [f"{x:.6f}" for x in tau]
            file.write(",".join(numbers) + "\n")


def tx40(data, out):
    def read(name):
        with open(data / name, encoding="utf-8") as file:
            return [[float(x) for x in row] for row in list(csv.reader(file))[1:]]

    # Motors to joints: motor 6 turns with joint 5, too.
    ratio = [32.0, 32.0, 45.0, -48.0, 45.0, 32.0]
    joints, torque = [], []
    for p, i in zip(read("pos_read_data.csv"), read("curr_data.csv")):
        q = [p[j] / ratio[j] for j in range(5)]
        q.append((p[5] - 32.0 * q[4]) / 32.0)
        q[1] -= math.pi / 2
        q[2] += math.pi / 2
        joints.append(q)
        tau = [ratio[j] * i[j] for j in range(6)]
        tau[4] += 32.0 * i[5]
        torque.append(tau)
    quarter = math.pi / 2
    rows = [(0, 0, 0), (-quarter, 0, 0), (0, 0.225, 0.035), (quarter, 0, 0.225), (-quarter, 0, 0), (quarter, 0, 0)]
    robot = arm("TX40", rows, True, 0.065, [abs(x) for x in ratio], [])
    write(out, robot, [0.0002 * k for k in range(len(joints))], joints, torque)


def joint_states(bag):
    """Time (s), names, position, effort of every message of a bag (CDR, little endian)."""
    for stamp, data in sqlite3.connect(f"file:{bag}?mode=ro", uri=True).execute("select timestamp, data from messages order by timestamp"):
        at = 4

        def number(form, size):
            nonlocal at
            # Aligned to its size, counted from behind the encapsulation.
            at += -(at - 4) % size
            at += size
            return struct.unpack_from("<" + form, data, at - size)[0]

        def text():
            nonlocal at
            length = number("I", 4)
            at += length
            return data[at - length:at - 1].decode()

        sec, nanosec = number("i", 4), number("I", 4)
        text()
        names = [text() for _ in range(number("I", 4))]
        position, _, effort = [[number("d", 8) for _ in range(number("I", 4))] for _ in range(3)]
        yield (sec + 1e-9 * nanosec) or 1e-9 * stamp, names, position, effort


def ur10(bag, out):
    order = ["shoulder_pan_joint", "shoulder_lift_joint", "elbow_joint", "wrist_1_joint", "wrist_2_joint", "wrist_3_joint"]
    time, joints, torque = [], [], []
    for t, names, position, effort in joint_states(bag):
        if len(effort) != 6 or (time and t <= time[-1]):
            continue
        place = [names.index(name) for name in order]
        time.append(t)
        joints.append([position[k] for k in place])
        torque.append([effort[k] for k in place])
    quarter = math.pi / 2
    rows = [(quarter, 0, 0.1273), (0, -0.612, 0), (0, -0.5723, 0), (quarter, 0, 0.163941), (-quarter, 0, 0.1157), (0, 0, 0.0922)]
    robot = arm("UR10", rows, False, 0.0, [100.0] * 6, [])
    write(out, robot, [t - time[0] for t in time], joints, torque)


if __name__ == "__main__":
    if len(sys.argv) != 4 or sys.argv[1] not in ("tx40", "ur10"):
        sys.exit(__doc__)
    {"tx40": tx40, "ur10": ur10}[sys.argv[1]](Path(sys.argv[2]), Path(sys.argv[3]))
