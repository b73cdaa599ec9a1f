"""Twins of public recordings of real arms, made and marked: what calib says of each against what was put in.

    python truth_twins.py CALIB OUT [--seed N] [--count 60] [--nulls 20] [--only KIND]

Kinds, at the sizes and noises of the real sets (pipelines/proof/real/README.md):
  mass     a surgical arm, two turning joints and one that slides, without and with 105 or 205 g at a place of a link
  servo    a pendulum on a servo by its duty: friction by load, driving and driven back, or with its square; an encoder of 4096 counts in the loop
  model    six joints at 25 Hz with the torques of the controller's own model: currents against its torques leave friction, over speed by a power below one
  mount    six joints on a wall, a ceiling or a slant; the robot file says nothing of it
  play     a joint with an encoder on its motor and one on its link, 240 poses from either side: play of 0.02 to 0.8 deg, and an error twice a turn
A null has no friction, no mass, no play and stands upright. OUT holds a folder of each recording with its truth.json, and marks.json. Needs numpy.
"""

import argparse
import json
import math
import os
import re
import subprocess

import numpy as np

G = 9.81
KINDS = ["mass", "servo", "model", "mount", "play"]


# An arm: axes and points at the zero pose (m), and bodies; torques by Newton and Euler, all rows at once.


def turn(axis, angle):
    x, y, z = axis.T
    c, s = np.cos(angle), np.sin(angle)
    v = 1 - c
    rows = [[c + x * x * v, x * y * v - z * s, x * z * v + y * s], [y * x * v + z * s, c + y * y * v, y * z * v - x * s], [z * x * v - y * s, z * y * v + x * s, c + z * z * v]]
    return np.array(rows).transpose(2, 0, 1)


def times(matrix, vector):
    return np.einsum("nij,nj->ni", matrix, vector)


class Arm:
    def __init__(self, axes, points, slides, tool, mass, com, inertia):
        self.axes, self.points = np.array(axes, float), np.array(points, float)
        self.slides, self.tool = slides, np.array(tool, float)
        self.mass, self.com = list(mass), [np.array(c, float) for c in com]
        self.inertia = [np.diag(i) for i in inertia]

    def torque(self, q, v, a, gravity, points=()):
        """Nm and N; `points` are (link, kg, place at the zero pose) in addition."""
        rows, n = q.shape
        still = np.zeros((rows, 3))
        frame, shift = np.tile(np.eye(3), (rows, 1, 1)), still.copy()
        spin, gain, origin, moves = still.copy(), still.copy(), still.copy(), still.copy()
        joints, loads = [], []
        for j in range(n):
            axis = times(frame, np.tile(self.axes[j], (rows, 1)))
            point = times(frame, np.tile(self.points[j], (rows, 1))) + shift
            if self.slides[j]:
                slid = axis * q[:, j : j + 1]
                point, shift = point + slid, shift + slid
            arm = point - origin
            moves = moves + np.cross(gain, arm) + np.cross(spin, np.cross(spin, arm))
            rate = axis * v[:, j : j + 1]
            if self.slides[j]:
                moves = moves + 2 * np.cross(spin, rate) + axis * a[:, j : j + 1]
            else:
                gain = gain + axis * a[:, j : j + 1] + np.cross(spin, rate)
                spin = spin + rate
                by = turn(axis, q[:, j])
                shift = point - times(by, point - shift)
                frame = by @ frame
            origin = point
            joints.append((axis, point))
            bodies = [(self.mass[j], self.com[j], self.inertia[j])]
            bodies += [(kg, np.array(place, float), np.zeros((3, 3))) for link, kg, place in points if link == j]
            for mass, com, inertia in bodies:
                centre = times(frame, np.tile(com, (rows, 1))) + shift
                out = centre - origin
                pulled = moves + np.cross(gain, out) + np.cross(spin, np.cross(spin, out)) - gravity
                tensor = frame @ inertia @ frame.transpose(0, 2, 1)
                moment = times(tensor, gain) + np.cross(spin, times(tensor, spin))
                loads.append((j, centre, mass * pulled, moment))
        torque = np.zeros((rows, n))
        for j, (axis, point) in enumerate(joints):
            for link, centre, force, moment in loads:
                if link >= j:
                    felt = force if self.slides[j] else moment + np.cross(centre - point, force)
                    torque[:, j] += (axis * felt).sum(1)
        return torque

    def urdf(self, inertials):
        number = lambda all: " ".join(f"{x:.9g}" for x in all)
        text = ['<robot name="twin">', '<link name="base"/>']
        before = np.zeros(3)
        for j, point in enumerate(self.points):
            kind, reach = ("prismatic", 1.0) if self.slides[j] else ("revolute", 6.28)
            text.append(f'<link name="l{j + 1}">')
            if inertials:
                ixx, iyy, izz = np.diag(self.inertia[j])
                text.append(f'<inertial><origin xyz="{number(self.com[j] - point)}"/><mass value="{self.mass[j]:.9g}"/>')
                text.append(f'<inertia ixx="{ixx:.9g}" iyy="{iyy:.9g}" izz="{izz:.9g}" ixy="0" ixz="0" iyz="0"/></inertial>')
            text.append("</link>")
            parent = f"l{j}" if j else "base"
            text.append(f'<joint name="j{j + 1}" type="{kind}"><parent link="{parent}"/><child link="l{j + 1}"/><origin xyz="{number(point - before)}"/>')
            text.append(f'<axis xyz="{number(self.axes[j])}"/><limit lower="-{reach}" upper="{reach}" effort="500" velocity="10"/></joint>')
            before = point
        last = len(self.points)
        text.append(f'<link name="tool"/><joint name="flange" type="fixed"><parent link="l{last}"/><child link="tool"/><origin xyz="{number(self.tool - before)}"/></joint></robot>')
        return "\n".join(text)


def surgical(dice):
    across = dice.uniform(0.04, 0.08)
    out = dice.uniform(0.3, 0.45)
    return Arm(
        [[0, 0, 1], [0, 1, 0], [0, 0, -1]], [[0, 0, 0], [across, 0, 0], [across + out, 0, 0]], [False, False, True], [across + out, 0, -0.4],
        dice.uniform([2.5, 1.6, 0.4], [3.5, 2.4, 0.7]), [[0.03, 0.01, -0.05], [across + 0.4 * out, 0, 0.01], [across + out, 0, -0.15]],
        [[0.02, 0.02, 0.01], [0.004, 0.03, 0.03], [0.004, 0.004, 0.0004]],
    )


def six(dice):
    a, b, c = dice.uniform([0.12, 0.22, 0.19], [0.19, 0.45, 0.4])
    points = [[0, 0, 0], [0, 0, a], [b, 0, a], [b + c, 0, a], [b + c, 0.11, a], [b + c, 0.11, a - 0.085]]
    heavy = dice.uniform(0.8, 2.2)
    mass = heavy * np.array([2.0, 3.4, 1.3, 0.8, 0.8, 0.35])
    com = [[0, 0.01, a - 0.02], [0.5 * b, 0.1, a], [b + 0.5 * c, 0.02, a], [b + c, 0.09, a + 0.01], [b + c, 0.11, a - 0.05], [b + c + 0.01, 0.12, a - 0.1]]
    inertia = [[0.006, 0.006, 0.004], [0.01, 0.06, 0.06], [0.003, 0.02, 0.02], [0.002, 0.002, 0.001], [0.002, 0.002, 0.001], [0.0003, 0.0003, 0.0003]]
    return Arm([[0, 0, 1], [0, 1, 0], [0, 1, 0], [0, 1, 0], [0, 0, -1], [0, 1, 0]], points, [False] * 6, [b + c, 0.2, a - 0.085], mass, com, [heavy * np.array(i) for i in inertia])


def sines(dice, rate, seconds, sizes):
    """Angles, velocities, accelerations of a motion of five sines a joint."""
    t = np.arange(int(rate * seconds)) / rate
    q, v, a = (np.zeros((len(t), len(sizes))) for _ in range(3))
    for j, size in enumerate(sizes):
        for k in range(1, 6):
            pace, phase = 2 * math.pi * 0.08 * k * dice.uniform(0.9, 1.1), dice.uniform(0, 2 * math.pi)
            part = size * dice.uniform(0.3, 1) / k**0.7
            q[:, j] += part * np.sin(pace * t + phase)
            v[:, j] += part * pace * np.cos(pace * t + phase)
            a[:, j] -= part * pace**2 * np.sin(pace * t + phase)
    return t, q, v, a


def sheet(path, names, columns):
    np.savetxt(path, np.column_stack(columns), delimiter=",", header=",".join(names), comments="", fmt="%.9g")


def write(folder, name, text):
    with open(os.path.join(folder, name), "w") as file:
        file.write(text if isinstance(text, str) else json.dumps(text, indent=1))


def robot(folder, arm, inertials=True):
    write(folder, "arm.urdf", arm.urdf(inertials))
    tolerance = "mass_tolerance: {mass: 0.02, centre: 2, inertia: 0.1}\n" if inertials else ""
    write(folder, "robot.yaml", "calib_robot: 1\nname: twin\nunits: {length: mm, angle: deg}\nkinematics: {urdf: {base: base, tip: tool}}\n" + tolerance)


HEAD = "calib: 1\nname: twin\nseed: 1\nstages:\n- {uses: robot, with: {file: robot.yaml, urdf: arm.urdf}}\n"


def ingest(file, columns, name=""):
    named = f"  id: {name}\n" if name else ""
    return f"- uses: ingest_torques\n{named}  with:\n    files:\n    - file: {file}\n      columns:\n" + "".join(f"        {line}\n" for line in columns)


# The kinds: each writes a recording and returns what is true of it.


def mass(folder, dice, null):
    arm = surgical(dice)
    robot(folder, arm)
    friction = [dice.uniform(low, high) for low, high in [(0.05, 0.2), (0.05, 0.2), (1.0, 3.0), (0.05, 0.3), (0.05, 0.3), (3.0, 12.0)]]
    link = int(dice.integers(1, 3))
    kg = float(dice.choice([0.105, 0.205]))
    span = (arm.points[2] if link == 1 else arm.tool) - arm.points[link]
    share = dice.uniform(0.5, 1.0)
    place = arm.points[link] + share * span
    for number, name in enumerate(["before", "after"]):
        t, q, v, a = sines(dice, 100, 40, [0.5, 0.4, 0.05])
        points = [(link, kg, place)] if number and not null else []
        torque = arm.torque(q, v, a, np.array([0, 0, -G]), points)
        torque += np.array(friction[:3]) * np.tanh(v / np.array([0.01, 0.01, 0.002])) + np.array(friction[3:]) * v
        torque += dice.normal(size=q.shape) * np.array([0.02, 0.02, 0.15])
        sheet(os.path.join(folder, f"{name}.csv"), ["t", "q1", "q2", "q3", "u1", "u2", "u3"], [t, q[:, :2], 1e3 * q[:, 2], torque])
    columns = ["time: {column: t, unit: s}", "q: {column: 'q{j}', unit: rad, linear_unit: mm}", "torque: {column: 'u{j}', unit: Nm, linear_unit: N}"]
    text = HEAD + ingest("before.csv", columns, "before") + "- {uses: diagnose_torques, id: first}\n" + ingest("after.csv", columns, "after")
    write(folder, "pipeline.yaml", text + "- {uses: diagnose_torques, id: second}\n- uses: compare_torques\n")
    return {"link": link + 1, "mass": kg, "moment": kg * share * float(np.linalg.norm(span)), "null": null}


def servo(folder, dice, null):
    """Forward dynamics of a pendulum behind a motor whose duty the controller makes of counts."""
    # A servo without any friction swings: what a turning motor takes holds that of a null, and is stated.
    inertia, weight, per_volt, per_speed = 0.0067, 0.49 * G * 0.1, 0.083, 0.03 if null else 0.0
    form = ["linear", "directional", "square"][dice.integers(3)]
    viscous, coulomb = dice.uniform(0.02, 0.05), dice.choice([0.0, dice.uniform(0.01, 0.03)])
    driving = dice.uniform(0.15, 0.3)
    back = driving * dice.uniform(0.3, 0.6) if form == "directional" else driving
    if null:
        viscous, coulomb, driving, back, form = 0.0, 0.0, 0.0, 0.0, "none"
    most, step, count = 0.6, 2.5e-4, 2 * math.pi / 4096
    rows = []
    for number in range(12):
        kp, volts, pace, size = float(dice.choice([100, 200, 400])), dice.uniform(7.2, 7.4), dice.uniform(0.3, 1.0), dice.uniform(0.7, 1.5)
        angle, speed, duty, shown, next_control, noise = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        rolled = dice.normal(size=int(6 / step))
        for k in range(int(6 / step)):
            time = k * step
            if time >= next_control:
                goal = size * math.sin(2 * math.pi * pace * time * (1 + 0.1 * time * (number % 2)))
                shown = round(angle / count) * count
                duty = max(-1, min(1, round(2.54 * kp * (goal - shown)) / 885))
                rows.append([number + 1, time, shown, speed, duty, volts + 0.05 * dice.normal()])
                next_control += 1 / 190
            # What a real one leaves: 0.02 Nm that lasts 50 ms.
            noise += -step / 0.05 * noise + 0.02 * math.sqrt(2 * step / 0.05) * rolled[k]
            sign = math.tanh(speed / 0.02)
            free = per_volt * duty * volts - (viscous + per_speed) * speed - coulomb * sign - noise
            load = free
            for _ in range(3):
                part = driving if load * sign > 0 else back
                lost = part * (load * load / most if form == "square" else abs(load))
                load = free - sign * lost
            speed += step * (load - weight * math.sin(angle)) / inertia
            angle += step * speed
    text = ["trajectory,use,t,q,v,duty,supply"]
    text += [f"{row[0]},{'validate' if row[0] > 9 else 'fit'}," + ",".join(f"{x:.6f}" for x in row[1:]) for row in rows]
    write(folder, "log.csv", "\n".join(text) + "\n")
    write(folder, "robot.json", {
        "name": "servo", "axes": [[0, 1, 0]], "points": [[0, 0, 0]], "tool": [0, 0, -100], "mass": [0.49], "com": [[0, 0, -100]],
        "inertia": [[0.0012, 0, 0, 0.0018, 0, 0.0012]], "ratio": [288.35], "kt": [1], "payload": 0, "payload_com": [0, 0, 0],
        "payload_inertia": [0] * 6, "gravity": [0, 0, -G], "coupling": [], "inertia_tolerance": {"mass_rel": 0.01, "com_mm": 2, "inertia_rel": 0.1},
    })
    taken = f", kt2_over_r: {per_speed}" if per_speed else ""
    columns = ["time: {column: t, unit: s}", "trajectory: {column: trajectory}", "usage: {column: use}", "q: {columns: [q], unit: rad}",
               "velocity: {columns: [v], unit: rad/s}", f"torque: {{duty: [duty], supply: {{column: supply}}, kt_over_r: {per_volt}{taken}}}"]
    head = HEAD.replace("robot.yaml, urdf: arm.urdf", "robot.json, format: case")
    write(folder, "pipeline.yaml", head + ingest("log.csv", columns) + "- uses: diagnose_torques\n")
    return {"form": form, "viscous": viscous, "coulomb": float(coulomb), "driving": driving, "back": back, "null": null}


def model(folder, dice, null):
    arm = six(dice)
    robot(folder, arm, inertials=False)
    t, q, v, a = sines(dice, 25, 36, [0.8] * 6)
    rigid = arm.torque(q, v, a, np.array([0, 0, -G]))
    size = np.array([2.6, 2.9, 1.5, 0.6, 0.6, 0.5]) * dice.uniform(0.7, 1.3, 6)
    viscous = np.array([4.7, 3.1, 1.7, 0.7, 0.7, 0.5]) * dice.uniform(0.7, 1.3, 6)
    power, share = dice.choice([1.0, dice.uniform(0.6, 0.8)]), float(dice.choice([0, dice.uniform(0.05, 0.1)]))
    if null:
        size, viscous, share = 0 * size, 0 * viscous, 0.0
    sign = np.tanh(v / 0.003)
    friction = size * sign + viscous * np.sign(v) * np.abs(v) ** power
    friction[:, 1] += share * np.abs(rigid[:, 1]) * sign[:, 1]
    noise = np.array([0.15, 0.15, 0.1, 0.04, 0.04, 0.03]) * dice.normal(size=q.shape)
    names = ["t"] + [f"{what}{j + 1}" for what in "qus" for j in range(6)]
    sheet(os.path.join(folder, "log.csv"), names, [t, q, rigid + friction + noise, rigid])
    columns = ["time: {column: t, unit: s}", "q: {column: 'q{j}', unit: rad}", "torque: {column: 'u{j}', unit: Nm}", "simulated: {column: 's{j}', unit: Nm}"]
    write(folder, "pipeline.yaml", HEAD + ingest("log.csv", columns) + "- uses: diagnose_torques\n")
    # Numbers of friction whose power is another are those of its line over the recorded speeds.
    fastest = np.abs(v).max(0)
    line = [np.polyfit(x := np.linspace(0, f, 500), s + b * x**power, 1) for s, b, f in zip(size, viscous, fastest)]
    return {"coulomb": [float(one[1]) for one in line], "viscous": [float(one[0]) for one in line], "power": float(power), "share": share, "null": null}


def mount(folder, dice, null):
    arm = six(dice)
    robot(folder, arm)
    way = dice.normal(size=3)
    sides = [[0, 0, 1], [1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], way / np.linalg.norm(way)]
    down = np.array([0, 0, -1]) if null else np.array(sides[dice.integers(6)], float)
    if down[2] < -0.9 and not null:
        down = -down
    t, q, v, a = sines(dice, 50, 40, [0.7] * 6)
    torque = arm.torque(q, v, a, G * down)
    if not null:
        torque += np.array([2, 2, 1, 0.5, 0.5, 0.3]) * (np.tanh(v / 0.01) + 1.2 * v)
    torque += np.array([0.3, 0.3, 0.2, 0.08, 0.08, 0.05]) * dice.normal(size=q.shape)
    sheet(os.path.join(folder, "log.csv"), ["t"] + [f"{what}{j + 1}" for what in "qu" for j in range(6)], [t, q, torque])
    columns = ["time: {column: t, unit: s}", "q: {column: 'q{j}', unit: rad}", "torque: {column: 'u{j}', unit: Nm}"]
    write(folder, "pipeline.yaml", HEAD + ingest("log.csv", columns) + "- uses: diagnose_torques\n")
    return {"down": down.tolist(), "null": null}


def play(folder, dice, null):
    """What the link's encoder reads is a rotation about the joint's axis, at angles of the motor's."""
    q = dice.uniform(-1.2, 1.2, 240)
    side = np.sign(np.diff(np.concatenate([[0], q])))
    gap, wave = (0.0, 0.0) if null else (math.radians(dice.uniform(0.02, 0.8)), dice.uniform(5e-5, 2e-4))
    link = q - 0.5 * gap * side + wave * np.sin(2 * q + dice.uniform(0, 6)) + 5 / 206265 * dice.normal(size=len(q))
    count = 2 * math.pi / 2**19
    link = np.round(link / count) * count
    none = np.zeros(len(q))
    sheet(os.path.join(folder, "log.csv"), ["q", "side", "a", "b", "c"], [q, side, none, link, none])
    screws = "kinematics:\n  screws:\n    - {axis: [0, 1, 0], point: [0, 0, 0]}\ntool: {point: [0, 0, -100]}\n"
    write(folder, "robot.yaml", "calib_robot: 1\nname: twin\nunits: {length: mm, angle: deg}\n" + screws)
    columns = ["q: {columns: [q], unit: rad}", "direction: {columns: [side]}", "orientation: {rotation_vector: [a, b, c], unit: rad}",
               "sigma_orientation: {value: 5, unit: arcsec}"]
    text = HEAD.replace(", urdf: arm.urdf", "") + ingest("log.csv", columns).replace("ingest_torques", "ingest")
    text += "- {uses: split, with: {by: every, n: 4}}\n- {uses: identify, with: {effects: [base_frame, joint_offset]}}\n- uses: diagnose\n"
    write(folder, "pipeline.yaml", text)
    return {"gap": gap, "null": null}


MAKERS = {"mass": mass, "servo": servo, "model": model, "mount": mount, "play": play}


# Marks: right, partly, wrong or silent, with why.


def run(calib, folder, *words):
    command = [calib, *words, "--store", os.path.join(folder, "store")]
    done = subprocess.run(command, capture_output=True, text=True, cwd=folder)
    try:
        answer = json.loads(done.stdout)
    except ValueError:
        answer = {}
    return answer, done.stdout + done.stderr


def number(finding, name):
    for one in finding["parameters"]:
        if one["name"] == name:
            return one["value"]
    return None


def near(value, truth, share):
    return value is not None and abs(value - truth) <= share * abs(truth)


def mark_of(found, truths):
    """By (name, place) -> whether its numbers are right; any other finding is wrong."""
    named = {(one["effect"], one["where"]): one for one in found}
    extra = [key for key in named if key not in truths]
    if extra:
        return "wrong", f"{extra}"
    judged = {key: check(named[key]) for key, check in truths.items() if key in named and check}
    missing = [key for key, check in truths.items() if key not in named and check]
    off = [key for key, is_right in judged.items() if not is_right]
    if not missing and not off:
        return "right", ""
    return ("partly" if named else "silent"), f"missing {missing}, sizes {[(key, named[key]['parameters']) for key in off]}"


def mark_mass(calib, folder, truth):
    answer, text = run(calib, folder, "run", "pipeline.yaml", "--json", "--quiet")
    if "changes" not in answer:
        return "blocked", text[-300:]
    changed = [one for one in answer["changes"] if one.get("rank")]
    carried = [one for one in changed if one["effect"] in ("payload", "added_mass")]
    if [one for one in changed if one not in carried]:
        return "wrong", f"{changed}"
    if not carried or truth["null"]:
        silent = "right" if truth["null"] and not carried else "silent" if not carried else "wrong"
        return silent, f"{carried}"
    last = 3
    places = " ".join([one["place"] + " " + (one["rivals"] or "") for one in carried])
    real = ["tool", f"link {last}"] if truth["link"] == last else [f"link {truth['link']}"]
    if not any(place in places for place in real):
        return "wrong", f"{carried}"
    sizes = {one["name"].split(".")[-1]: one["change"] for one in carried}
    seen = near(sizes.get("moment"), truth["moment"], 0.1) or near(sizes.get("mass"), truth["mass"], 0.15)
    return ("right" if seen else "partly"), f"{carried}"


def mark_servo(calib, folder, truth):
    answer, text = run(calib, folder, "diagnose", "pipeline.yaml", "--json", "--quiet")
    if "findings" not in answer:
        return "blocked", text[-300:]
    truths = {}
    if not truth["null"]:
        mean = 0.5 * (truth["driving"] + truth["back"])

        def friction(one, load=0.4):
            """Nm at a load, whatever its law."""
            shares = [number(one, name) for name in ("share", "share_driven_back") if number(one, name) is not None]
            most = number(one, "at_load") or load
            return sum(shares) / len(shares) * most * (load / most) ** (number(one, "exponent") or 1)

        true = mean * (0.4**2 / 0.6 if truth["form"] == "square" else 0.4)
        truths["viscous_friction", "joint 1"] = lambda one: near(number(one, "viscous"), truth["viscous"], 0.3)
        truths["load_friction", "joint 1"] = lambda one: near(friction(one), true, 0.4)
        if truth["coulomb"]:
            truths["coulomb_friction", "joint 1"] = None
        if truth["form"] == "directional":
            # Another share where the load drives is a factor on the torque while the joint moves.
            truths["torque_constant", "joint 1"] = None
    return mark_of(answer["findings"], truths)


def mark_model(calib, folder, truth):
    answer, text = run(calib, folder, "diagnose", "pipeline.yaml", "--json", "--quiet")
    if "findings" not in answer:
        return "blocked", text[-300:]
    truths = {}

    def over_speed(one, j, loose):
        """By its slope, or by the power of speed where that is another than the first."""
        power = number(one, "exponent") or 1
        return abs(power - truth["power"]) <= 0.15 and (truth["power"] != 1 or near(number(one, "viscous"), truth["viscous"][j], loose))

    if not truth["null"]:
        for j in range(6):
            place = f"joint {j + 1}"
            check = j < 3
            # Load friction and Coulomb friction of a joint under a load of one size are one number.
            loose = 0.3 if truth["share"] and j == 1 else 0.2
            truths["viscous_friction", place] = (lambda one, j=j, loose=loose: over_speed(one, j, loose)) if check else None
            truths["coulomb_friction", place] = (lambda one, j=j, loose=loose: near(number(one, "coulomb"), truth["coulomb"][j], loose) or truth["power"] != 1) if check else None
        if truth["share"]:
            truths["load_friction", "joint 2"] = lambda one: near(number(one, "share"), truth["share"], 0.4)
    return mark_of(answer["findings"], truths)


def mark_mount(calib, folder, truth):
    answer, text = run(calib, folder, "diagnose", "pipeline.yaml", "--json", "--quiet")
    declared = re.search(r"gravity: \[([-\d., e]+)\]", text)
    if truth["null"]:
        found = answer.get("findings")
        return ("right", "") if found == [] and not declared else ("wrong", f"{found} {text[-300:]}")
    if not declared:
        return "wrong", text[-400:]
    way = np.array([float(x) for x in declared[1].split(",")])
    off = math.degrees(math.acos(min(1, float(way @ truth["down"]) / np.linalg.norm(way))))
    # Friction hides some degrees of a slant: the remainder is found as a tilt.
    if off > 10:
        return "wrong", f"{off:.1f} deg off"
    robot = os.path.join(folder, "robot.yaml")
    with open(robot) as file:
        text = file.read()
    write(folder, "robot.yaml", text + f"gravity: [{declared[1]}]\n")
    answer, text = run(calib, folder, "diagnose", "pipeline.yaml", "--json", "--quiet")
    if "findings" not in answer:
        return "blocked", text[-300:]
    allowed = {(name, f"joint {j + 1}"): None for name in ("viscous_friction", "coulomb_friction") for j in range(6)}
    allowed["gravity_direction", "base"] = None
    return mark_of(answer["findings"], allowed)


def mark_play(calib, folder, truth):
    answer, text = run(calib, folder, "diagnose", "pipeline.yaml", "--json", "--quiet")
    if "findings" not in answer:
        return "blocked", text[-300:]
    truths = {}
    if not truth["null"]:
        half = math.degrees(truth["gap"]) * 1800
        truths["backlash", "joint 1"] = lambda one: near(abs(number(one, "j1.half_gap") or 0), half, 0.05)
        # The error twice a turn is one of these over less than half a turn.
        truths |= {(name, "joint 1"): None for name in ("gear_cyclic", "joint_table", "joint_compliance", "unknown")}
    return mark_of(answer["findings"], truths)


MARKERS = {"mass": mark_mass, "servo": mark_servo, "model": mark_model, "mount": mark_mount, "play": mark_play}


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("calib")
    parser.add_argument("out")
    parser.add_argument("--seed", type=int)
    parser.add_argument("--count", type=int, default=60)
    parser.add_argument("--nulls", type=int, default=20)
    parser.add_argument("--only", choices=KINDS)
    asked = parser.parse_args()
    seed = asked.seed if asked.seed is not None else int.from_bytes(os.urandom(4), "big")
    calib = os.path.abspath(asked.calib)
    marks, tally = [], {}
    for number in range(asked.count + asked.nulls):
        kind, null = KINDS[number % len(KINDS)], number >= asked.count
        if asked.only and kind != asked.only:
            continue
        folder = os.path.join(os.path.abspath(asked.out), f"{number:03}_{kind}{'_null' if null else ''}")
        os.makedirs(folder, exist_ok=True)
        truth = MAKERS[kind](folder, np.random.default_rng([seed, number]), null)
        write(folder, "truth.json", truth)
        mark, why = MARKERS[kind](calib, folder, truth)
        marks.append({"recording": os.path.basename(folder), "kind": kind, "null": null, "mark": mark, "why": why, "truth": truth})
        counts = tally.setdefault("null " + kind if null else kind, {})
        counts[mark] = counts.get(mark, 0) + 1
        print(f"{os.path.basename(folder)}: {mark} {why if mark != 'right' else ''}", flush=True)
    write(asked.out, "marks.json", {"seed": seed, "marks": marks})
    print(f"seed {seed}")
    for kind, counts in tally.items():
        print(f"{kind}: {counts}")


if __name__ == "__main__":
    main()
