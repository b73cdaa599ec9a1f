"""Friction that calib finds in recordings of real arms against plain least squares of the same rows, at several cut-offs.

    python torques_by_least_squares.py CALIB FOLDER [--only SET] [--out OUT]

FOLDER holds the public sets, as far as they were fetched (pipelines/proof/real/README.md says from where):
  xl330_bam  the servo with a pendulum, JSON files       ur3e_rad  fig9.xlsx, RTDE of a UR3e
  ur10_bags  ur10_exciting_trajectory.db3                tx40      curr_data.csv and pos_read_data.csv
The rows are those that calib read (its table of motion) and fitted. Least squares know nothing of noise, of other causes and of tolerances: viscous and
Coulomb friction (none that would drive) and an offset of every joint, load friction where calib names it, beside the rigid arm: point masses that span the ten numbers of
each link, the inertia of the pendulum of known weight, or the controller's own torques. The width over which the sign of friction turns is the best of a few.
Prints a line a number: calib's, that of least squares, and the ratio. Needs numpy.
"""

import argparse
import csv
import io
import os
import re
import subprocess
import sys

import numpy as np
import real_torques
from truth_twins import G, Arm

WIDTHS = [0.002, 0.005, 0.01, 0.02, 0.03, 0.05, 0.08]
# Least singular value, over the greatest, of a combination of masses that the rows show.
SHOWN = 1e-6
SHARE = 0.2


# Arms by their Denavit and Hartenberg lines: theta at zero (deg), d (m), a (m), alpha (deg).

UR10 = [(0, 0.1273, 0, 90), (0, 0, -0.612, 0), (0, 0, -0.5723, 0), (0, 0.163941, 0, 90), (0, 0.1157, 0, -90), (0, 0.0922, 0, 0)]
TX40 = [(0, 0.32, 0, -90), (-90, 0.035, 0.225, 0), (90, 0, 0, 90), (0, 0.225, 0, -90), (0, 0, 0, 90), (0, 0.065, 0, 0)]


def chain(lines):
    """An arm with masses that are to be found."""
    pose, axes, points = np.eye(4), [], []
    for theta, d, a, alpha in lines:
        axes.append(pose[:3, 2])
        points.append(pose[:3, 3])
        (ct, st), (ca, sa) = [(np.cos(x), np.sin(x)) for x in np.radians([theta, alpha])]
        pose = pose @ np.array([[ct, -st * ca, st * sa, a * ct], [st, ct * ca, -ct * sa, a * st], [0, sa, ca, d], [0, 0, 0, 1]])
    count = len(lines)
    return Arm(axes, points, [False] * count, pose[:3, 3], [0] * count, points, [[0, 0, 0]] * count)


# The recordings: a pipeline in a folder; columns of the rigid torque, joints whose motor turns with another joint, and what is known of the torque.


def head(name):
    return f"calib: 1\nname: {name}\nseed: 1\nstages:\n"


def robot_of(lines, name):
    rows = "".join(f"    - {{theta: {t}, d: {1e3 * d:g}, a: {1e3 * a:g}, alpha: {al}}}\n" for t, d, a, al in lines)
    return f"calib_robot: 1\nname: {name}\nunits: {{length: mm, angle: deg}}\nkinematics:\n  dh:\n{rows}tool: {{point: [0, 0, 0]}}\n"


def put(folder, name, text):
    with open(os.path.join(folder, name), "w") as file:
        file.write(text)


def xl330(source, out):
    real_torques.xl330(source, out)
    return (lambda q, v, a: [[a[:, 0]]]), {}, lambda q: 0.49 * G * 0.1 * np.sin(q)


def ur3e(source, out):
    columns = "".join(
        f"        {name}: {{columns: [{', '.join(f'{of}_{j}' for j in range(6))}], unit: {unit}}}\n"
        for name, of, unit in [("q", "actual_q", "rad"), ("velocity", "actual_qd", "rad/s"), ("current", "target_current", "A"), ("simulated", "target_moment", "Nm")]
    )
    if not os.path.exists(os.path.join(out, "arm")):
        subprocess.run([CALIB, "init", "arm", "--robot", "ur3e"], cwd=out, check=True, capture_output=True)
    file = os.path.abspath(os.path.join(source, "fig9.xlsx"))
    put(out, "pipeline.yaml", head("ur3e") + "- {uses: robot, with: {file: arm/robot.yaml}}\n- uses: ingest_torques\n  with:\n    files:\n"
        f"    - file: {file}\n      columns:\n        time: {{column: timestamp, unit: s}}\n{columns}- uses: diagnose_torques\n")
    return (lambda q, v, a: []), {}, nothing


def ur10(source, out):
    joints = ["shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3"]
    columns = "".join(
        f"        {name}: {{columns: [{', '.join(f'{j}_joint.{of}' for j in joints)}], unit: {unit}}}\n"
        for name, of, unit in [("q", "position", "rad"), ("velocity", "velocity", "rad/s"), ("torque", "effort", "Nm")]
    )
    file = os.path.abspath(os.path.join(source, "ur10_exciting_trajectory.db3"))
    put(out, "robot.yaml", robot_of(UR10, "UR10"))
    put(out, "pipeline.yaml", head("ur10") + "- {uses: robot, with: {file: robot.yaml}}\n- uses: ingest_torques\n  with:\n    files:\n"
        f"    - file: {file}\n      topic: /joint_states\n      columns:\n        time: {{column: stamp, unit: s}}\n{columns}- uses: diagnose_torques\n")
    return by_masses(chain(UR10)), {}, nothing


def tx40(source, out):
    """Motor 6 turns with joint 5, too; currents are torques of the motors in a unit of their own. 500 rows a second of 5,000."""
    current = np.loadtxt(os.path.join(source, "curr_data.csv"), delimiter=",", skiprows=1)[::10]
    motor = np.loadtxt(os.path.join(source, "pos_read_data.csv"), delimiter=",", skiprows=1)[::10]
    ratio = np.diag([32.0, 32, 45, -48, 45, 32])
    ratio[5, 4] = 32
    q = np.linalg.solve(ratio, motor.T).T
    t = 0.002 * np.arange(len(q))
    names = ["t"] + [f"{what}{j + 1}" for what in "qu" for j in range(6)]
    np.savetxt(os.path.join(out, "log.csv"), np.column_stack([t, q, current @ ratio]), delimiter=",", header=",".join(names), comments="", fmt="%.9g")
    put(out, "robot.yaml", robot_of(TX40, "TX40"))
    put(out, "pipeline.yaml", head("tx40") + "- {uses: robot, with: {file: robot.yaml}}\n- uses: ingest_torques\n  with:\n    files:\n    - file: log.csv\n"
        "      columns:\n        time: {column: t, unit: s}\n        q: {column: 'q{j}', unit: rad}\n        torque: {column: 'u{j}', unit: Nm}\n- uses: diagnose_torques\n")
    return by_masses(chain(TX40)), {5: 4}, nothing


def nothing(q):
    return np.zeros(q.shape)


def by_masses(arm):
    """Torques of ten point masses of 1 kg on each link, whose sums are all ten numbers of it."""
    dice = np.random.default_rng(1)
    places = dice.uniform(-0.3, 0.3, (10, 3))
    down = np.array([0, 0, -G])

    def columns(q, v, a):
        links = range(len(arm.points))
        return [arm.torque(q, v, a, down, [(link, 1.0, arm.points[link] + place)]).T for link in links for place in places]

    return columns


SETS = {
    "xl330_bam": (xl330, [3, 8, 20]),
    "ur3e_rad": (ur3e, [2, 3, 5]),
    "ur10_bags": (ur10, [3, 6, 10]),
    "tx40": (tx40, [4, 8, 15]),
}


# Least squares.


def low_passed(course, rate, cutoff):
    """Without delay, by the gain of a Butterworth filter of fourth order run both ways; the ends are mirrored."""
    count = len(course)
    long = np.concatenate([2 * course[0] - course[count - 1 : 0 : -1], course, 2 * course[-1] - course[-2::-1]])
    share = np.fft.rfftfreq(len(long), 1 / rate) / cutoff
    return np.fft.irfft(np.fft.rfft(long) / (1 + share**8), len(long))[count - 1 : 2 * count - 1]


def columns_of(table, what):
    names = [name for name in table.dtype.names if name.startswith(what) and name[len(what)].isdigit()]
    return np.column_stack([table[name] for name in names]) if names else None


class Run:
    """A trajectory at even times: angles, their derivatives, torques, and which rows are fitted."""

    def __init__(self, table, rows, fitted, torque, cutoff, known):
        time = table["time_s"][rows]
        step = np.median(np.diff(time))
        even = time[0] + step * np.arange(int((time[-1] - time[0]) / step) + 1)
        at = lambda courses: np.column_stack([np.interp(even, time, course) for course in courses[rows].T])
        self.rate = 1 / step
        self.q = np.column_stack([low_passed(course, self.rate, 3 * cutoff) for course in at(columns_of(table, "q")).T])
        self.v = np.gradient(self.q, step, axis=0)
        self.a = np.gradient(self.v, step, axis=0)
        simulated = columns_of(table, "sim_tau")
        self.simulated = None if simulated is None else at(simulated)
        self.known = known(self.q)
        self.torque = at(torque) - self.known - (0 if simulated is None else self.simulated)
        use = np.interp(even, time, fitted[rows]) > 0.5
        use[: int(self.rate)] = use[-int(self.rate) :] = False
        self.rows = np.flatnonzero(use)[:: max(1, int(self.rate / (2.5 * cutoff)))]
        self.cutoff = cutoff

    def passed(self, course):
        return low_passed(course, self.rate, self.cutoff)[self.rows]


def runs(table, fitted, torque, cutoff, known):
    edges = np.flatnonzero(np.diff(table["trajectory"])) + 1
    rows = [rows for rows in np.split(np.arange(len(table)), edges) if len(rows) > 200]
    all = [Run(table, one, fitted, torque, cutoff, known) for one in rows]
    return [run for run in all if len(run.rows)]


def friction(run, joint, width, load, rigid, coupled, drives):
    """Courses at joints: (joint, course) of each coefficient; none of viscous (0) and Coulomb friction (1) that `drives`."""
    ones, also = np.ones(len(run.q)), coupled.get(joint)
    v = run.v[:, joint] + (run.v[:, also] if also is not None else 0)
    sign = np.tanh(v / width)
    viscous, coulomb = [0 * ones if (joint, k) in drives else course for k, course in enumerate((v, sign))]
    at = [joint] if also is None else [joint, also]
    columns = [[(j, viscous) for j in at], [(j, coulomb) for j in at], [(joint, ones)]]
    if load:
        forward = 0.5 * (1 + np.sign(rigid) * sign)
        for share in [ones] if load == 1 else [forward, 1 - forward]:
            columns.append([(joint, share * np.abs(rigid) * sign)])
    return columns


def solved(all, base, width, load, rigid, coupled, drives):
    """What is left, the coefficients of the rigid arm, and those of each joint."""
    joints = range(all[0].q.shape[1])
    blocks = []
    for run, columns, pulled in zip(all, base, rigid):
        own = [friction(run, j, width, load[j], None if pulled is None else pulled[:, j], coupled, drives) for j in joints]
        columns = [list(enumerate(column)) for column in columns] + [column for of_joint in own for column in of_joint]
        block = np.zeros((len(joints), len(run.rows), len(columns)))
        for k, column in enumerate(columns):
            for j, course in column:
                block[j, :, k] = run.passed(course)
        blocks.append(block)
    matrix = np.concatenate(blocks, axis=1)
    matrix = matrix.reshape(-1, matrix.shape[2])
    right = np.concatenate([np.concatenate([run.passed(run.torque[:, j]) for run in all]) for j in joints])
    scale = np.linalg.norm(matrix, axis=0) + 1e-12
    values, *_ = np.linalg.lstsq(matrix / scale, right, rcond=SHOWN)
    left = np.sum((right - matrix / scale @ values) ** 2)
    values, masses = np.where(scale > 1e-9, values / scale, 0), len(base[0])
    found, k = [], masses
    for j in joints:
        found.append(values[k : k + 3 + load[j]])
        k += 3 + load[j]
    return left, values[:masses], found


def least_squares(all, masses, load, coupled):
    """The best width of a sign, and the numbers of every joint: viscous, Coulomb, offset, shares of the load where `load` says so many."""
    base = [masses(run.q, run.v, run.a) for run in all]
    rigid, none = [run.simulated for run in all], [0] * len(load)

    def best(load, drives=()):
        found = min((solved(all, base, width, load, rigid, coupled, drives) + (width,) for width in WIDTHS), key=lambda one: one[0])
        negative = [(j, k) for j, numbers in enumerate(found[2]) for k in (0, 1) if numbers[k] < 0 and (j, k) not in drives]
        return best(load, [*drives, *negative]) if negative else found

    if any(load) and rigid[0] is None:
        # The load is that of the masses without load friction.
        weights = best(none)[1]
        rigid = [run.known + sum(weight * np.array(column).T for weight, column in zip(weights, columns)) for run, columns in zip(all, base)]
    _, _, found, width = best(load)
    return width, found


# calib.


def asked(folder, words):
    done = subprocess.run([CALIB, *words, "--store", "store"], cwd=folder, capture_output=True, text=True)
    if done.returncode:
        sys.exit(done.stdout + done.stderr)
    return done.stdout


def query(folder, question):
    rows = list(csv.reader(io.StringIO(asked(folder, ["query", "HEAD", question, "--csv"]))))
    return rows[0], rows[1:]


def motion(folder):
    names, rows = query(folder, "select * from motion")
    usage = np.array([row[names.index("usage")] for row in rows])
    kept = [k for k, name in enumerate(names) if name != "usage"]
    table = np.array([tuple(float(row[k] or "nan") for k in kept) for row in rows], dtype=[(names[k], float) for k in kept])
    return table, usage


def findings(folder):
    """By (name, place), its numbers."""
    _, rows = query(folder, "select f.effect, f.place, n.name, n.value from torque_findings f join torque_numbers n on f.rank = n.rank")
    found = {}
    for effect, place, name, number in rows:
        found.setdefault((effect, place), {})[name] = float(number)
    return found


def torques(folder, table):
    """Nm: of currents by the motor constants and ratios of the robot file."""
    currents = columns_of(table, "i")
    if currents is None:
        return columns_of(table, "tau")
    with open(os.path.join(folder, "arm", "robot.yaml")) as file:
        text = file.read()
    number = lambda key: np.array([float(one) for one in re.findall(rf"{key}: ([\d.]+)", text)])
    return currents * number("reduction_ratio") * number("motor_constant")


def compare(name, folder, rigid, cutoff):
    asked(folder, ["run", "pipeline.yaml", "--quiet", "--set", f"diagnose_torques.cutoff_hz={cutoff}"])
    table, usage = motion(folder)
    masses, coupled, known = rigid
    joints = columns_of(table, "q").shape[1]
    by = findings(folder)
    load = [sum(name.startswith("share") for name in by.get(("load_friction", f"joint {j + 1}"), [])) for j in range(joints)]
    labels = set(usage)
    fitted = (usage == "fit").astype(float) if {"fit"} < labels else (np.arange(len(table)) < 0.7 * len(table)).astype(float)
    width, numbers = least_squares(runs(table, fitted, torques(folder, table), cutoff, known), masses, load, coupled)
    within = []
    for j in range(joints):
        place = f"joint {j + 1}"
        names = ["wrist_coupling"] * 2 if j in coupled else ["viscous_friction", "coulomb_friction"]
        lines = [(names[0], "viscous", 0), (names[1], "coulomb", 1)]
        if load[j]:
            lines += [("load_friction", "share", 3)] + ([("load_friction", "share_driven_back", 4)] if load[j] == 2 else [])
        also = sorted(effect for effect, where in by if where == place and effect not in names + ["load_friction"])
        for effect, quantity, k in lines:
            ours, theirs = by.get((effect, place), {}).get(quantity), numbers[j][k]
            if quantity == "coulomb" and ours is not None:
                # Of one that is greater in one direction, the mean of both.
                ours += 0.5 * by.get(("asymmetric_friction", place), {}).get("asymmetry", 0)
            if ours is None and theirs == 0:
                continue
            ratio = ours / theirs if ours is not None and theirs else None
            good = ratio is not None and abs(ratio - 1) <= SHARE
            within.append(good)
            shown = "-" if ours is None else f"{ours:.4g}"
            print(f"{name} | {cutoff} Hz | {place} | {quantity} | {shown} | {theirs:.4g} | {'-' if ratio is None else f'{ratio:.2f}'} | {', '.join(also)}")
            also = []
    print(f"{name} at {cutoff} Hz: {sum(within)} of {len(within)} within {100 * SHARE:.0f} %; sign of friction over {width} rad/s", flush=True)
    return sum(within), len(within)


def main():
    global CALIB
    parser = argparse.ArgumentParser()
    parser.add_argument("calib")
    parser.add_argument("folder")
    parser.add_argument("--only", choices=SETS)
    parser.add_argument("--out", default="torques_by_least_squares")
    args = parser.parse_args()
    CALIB = os.path.abspath(args.calib)
    print("set | low-pass | joint | number | calib | least squares | ratio | also found there")
    for name, (make, cutoffs) in SETS.items():
        source, out = os.path.join(args.folder, name), os.path.join(os.path.abspath(args.out), name)
        if (args.only and args.only != name) or not os.path.isdir(source):
            continue
        os.makedirs(out, exist_ok=True)
        rigid = make(source, out)
        for cutoff in cutoffs:
            compare(name, out, rigid, cutoff)


if __name__ == "__main__":
    main()
