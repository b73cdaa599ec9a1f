#!/usr/bin/env python3
"""Solves the same calibration problem with calib and with other programs, on one core each, and prints ratios and held-out errors.

    python3 -m venv VENV && VENV/bin/pip install numpy scipy pybotics==3.1.2 robotkinecal==0.1
    VENV/bin/python tests/bench/compare.py [--quick]

The recording is made here, by mathematics of its own (perturbed axes, 4x4 matrices): a UR10's modified DH table, 160 points to fit
and 80 held out, 10 um of noise an axis. Two problems:

- `full`: 48 candidate parameters: base 6, tool 3, joint offsets 6, link geometry 20, ratios 6, a coupling, compliances 6.
- `geometry`: 35 candidates, for programs that know geometry alone. pybotics varies its own 24 MDH + 3 tool + 6 world parameters
  and minimises lengths of errors; robotkinecal its 27 POE parameters, given the points in the aligned base frame.

Every program starts from the nominal robot and the same aligned base. scipy is given the model vectorised over rows, torques at
the commanded posture computed beforehand (calib follows the posture), columns scaled by the same plausible sizes, and each of
methods `lm` and `trf`, both with all candidates, as calib, and with only the visible ones, found beforehand and not counted. The
faster method that gets there counts. calib decides visibility, fits robustly and states uncertainties in the time given.

calib runs as the bench binary (`cargo bench`, profile `bench`: our crate and the numeric crates at opt-level 3, the rest, which a
fit does not use, not optimised). CPU time on one core, the least of several runs
(of calib of several batches): other work on the machine does not count.
"""

import argparse
import contextlib
import io
import json
import os
import subprocess
import sys
import tempfile
import time

for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "RAYON_NUM_THREADS"):
    os.environ[variable] = "1"

import numpy as np
from scipy.optimize import least_squares

FIT, CHECK, SIGMA, GRAVITY = 160, 80, 1e-5, np.array([0.0, 0.0, -9.81])
ROOT = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..")
# alpha, a, theta, d (m): modified DH of a UR10.
MDH = np.array([
    [0, 0, 0, 0.118], [np.pi / 2, 0, np.pi, 0], [0, 0.6127, 0, 0],
    [0, 0.5716, 0, 0.1639], [-np.pi / 2, 0, 0, 0.1157], [np.pi / 2, 0, np.pi, 0.0922],
])
MASSES = np.array([7.1, 12.7, 4.27, 2.0, 2.0, 0.365 + 10.0])
TOOL = np.array([0.06, -0.04, 0.12])


def mdh_matrix(alpha, a, theta, d):
    ca, sa, ct, st = np.cos(alpha), np.sin(alpha), np.cos(theta), np.sin(theta)
    return np.array([[ct, -st, 0, a], [st * ca, ct * ca, -sa, -d * sa], [st * sa, ct * sa, ca, d * ca], [0, 0, 0, 1]])


def rotation(axis, angle):
    x, y, z = axis
    k = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * k + (1 - np.cos(angle)) * k @ k


def about(axis, point, angle):
    out = np.eye(4)
    out[:3, :3] = rotation(axis, angle)
    out[:3, 3] = point - out[:3, :3] @ point
    return out


def shifted(by):
    out = np.eye(4)
    out[:3, 3] = by
    return out


def nominal():
    """Axes, points on them, measured point and centres of mass at the zero pose."""
    frame, axes, points = np.eye(4), [], []
    for row in MDH:
        frame = frame @ mdh_matrix(*row)
        axes.append(frame[:3, 2].copy())
        points.append(frame[:3, 3].copy())
    tool = frame[:3, :3] @ TOOL + frame[:3, 3]
    ends = points[1:] + [tool]
    return np.array(axes), np.array(points), tool, (np.array(points) + np.array(ends)) / 2


AXES, POINTS, HOME, CENTRES = nominal()


def torques(q, axes=AXES, points=POINTS):
    """Gravity torque about every joint of one pose, Nm."""
    frame, frames = np.eye(4), []
    for axis, point, angle in zip(axes, points, q):
        frame = frame @ about(axis, point, angle)
        frames.append(frame)
    where = [f[:3, :3] @ c + f[:3, 3] for f, c in zip(frames, CENTRES)]
    out = []
    for j, frame in enumerate(frames):
        axis, point = frame[:3, :3] @ axes[j], frame[:3, :3] @ points[j] + frame[:3, 3]
        out.append(sum(axis @ np.cross(where[k] - point, MASSES[k] * GRAVITY) for k in range(j, 6)))
    return np.array(out)


def recording(full, seed=1):
    """Joint positions and measured points of a robot with errors."""
    rng = np.random.default_rng(seed)
    axes = np.array([rotation(np.linalg.qr(rng.normal(size=(3, 3)))[0][0], 5e-4 * rng.normal()) @ a for a in AXES])
    points = POINTS + 5e-4 * rng.normal(size=POINTS.shape)
    offset, tool = 1e-3 * rng.normal(size=6), HOME + 5e-4 * rng.normal(size=3)
    ratio, coupling = 3e-4 * full * rng.normal(size=6), 2e-3 * full
    compliance = full * 2e-6 * rng.uniform(0.5, 1.5, 6)
    base = about(np.array([0.36, 0.48, 0.8]), np.zeros(3), 0.7)
    base[:3, 3] = [2.5, -1.0, 0.4]
    q = rng.uniform(-2.6, 2.6, (FIT + CHECK, 6))
    position = np.empty((FIT + CHECK, 3))
    for row, commanded in enumerate(q):
        stiff = commanded * (1 + ratio) + offset
        stiff[5] += coupling * commanded[4]
        angle = stiff
        for _ in range(3):
            angle = stiff + compliance * torques(angle, axes, points)
        frame = base
        for axis, point, turn in zip(axes, points, angle):
            frame = frame @ about(axis, point, turn)
        position[row] = frame[:3, :3] @ tool + frame[:3, 3] + SIGMA * rng.normal(size=3)
    return q, position


def aligned(q, position):
    """The base that puts the nominal robot on the points (Kabsch)."""
    model = Vectorised(q, position, False, np.eye(4)).points(np.zeros(35))
    a, b = model[:FIT].mean(0), position[:FIT].mean(0)
    u, _, vt = np.linalg.svd((position[:FIT] - b).T @ (model[:FIT] - a))
    base = np.eye(4)
    base[:3, :3] = u @ np.diag([1, 1, np.linalg.det(u @ vt)]) @ vt
    base[:3, 3] = b - base[:3, :3] @ a
    return base


def normals(axis):
    order = sorted(np.argsort(np.abs(axis), kind="stable")[:2])
    units = [np.eye(3)[k] - axis * axis[k] for k in order]
    return [unit / np.linalg.norm(unit) for unit in units]


class Vectorised:
    """The model over all rows at once: base, six times (link motion, joint), tool. Parameters: base 6, links 5 x 4, tool 3, offsets 6,
    then ratios 6, coupling 1, compliances 6."""

    def __init__(self, q, position, full, base):
        self.q, self.position, self.base, self.full = q, position, base, full
        self.size = 48 if full else 35
        self.columns = np.arange(self.size)
        self.torque = np.array([torques(row) for row in q]) if full else None
        eye = np.eye(3)
        self.moves = [[(False, d, None) for d in eye] + [(True, d, np.zeros(3)) for d in eye]]
        for j in range(1, 6):
            across = normals(AXES[j])
            self.moves.append([(False, d, None) for d in across] + [(True, d, POINTS[j]) for d in across])
        self.slices = [slice(0, 6)] + [slice(6 + 4 * k, 10 + 4 * k) for k in range(5)]
        self.scale = np.concatenate([[1e-2] * 3 + [1e-2] * 3, [5e-3] * 20, [5e-2] * 3, [2e-2] * 6, [1e-2] * 7 + [1e-5] * 6])[: self.size]

    def station(self, k, p):
        return [about(d, c, v) if turn else shifted(v * d) for (turn, d, c), v in zip(self.moves[k], p[self.slices[k]])]

    def travel(self, p, j):
        out = self.q[:, j] + p[29 + j]
        if self.full:
            out = out + p[35 + j] * self.q[:, j] + p[42 + j] * self.torque[:, j]
            if j == 5:
                out = out + p[41] * self.q[:, 4]
        return out

    def points(self, p, keep=None):
        y = np.broadcast_to(HOME + p[26:29], (len(self.q), 3))
        for j in range(5, -1, -1):
            angle = self.travel(p, j)
            s, c, a = np.sin(angle)[:, None], np.cos(angle)[:, None], AXES[j]
            v = y - POINTS[j]
            cross = np.stack([a[1] * v[:, 2] - a[2] * v[:, 1], a[2] * v[:, 0] - a[0] * v[:, 2], a[0] * v[:, 1] - a[1] * v[:, 0]], 1)
            y = v * c + cross * s + (v @ a)[:, None] * (1 - c) * a + POINTS[j]
            if keep is not None:
                keep.append((y, s, c))
            motion = np.linalg.multi_dot(self.station(j, p)) if j else self.base @ np.linalg.multi_dot(self.station(0, p))
            y = y @ motion[:3, :3].T + motion[:3, 3]
        return y

    def whole(self, x):
        p = np.zeros(self.size)
        p[self.columns] = x * self.scale[self.columns]
        return p

    def residual(self, x):
        return ((self.points(self.whole(x)) - self.position) / SIGMA).ravel()

    def jacobian(self, x):
        p, keep, rows = self.whole(x), [], len(self.q)
        self.points(p, keep)
        out = np.empty((rows, 3, self.size))
        prefix = np.broadcast_to(self.base[:3, :3], (rows, 3, 3))
        for j, (y, s, c) in enumerate(reversed(keep)):
            moves = self.station(j, p)
            heads, tail = [np.eye(4)], np.eye(4)
            for move in moves:
                heads.append(heads[-1] @ move)
            derivatives = [None] * len(moves)
            for k in range(len(moves) - 1, -1, -1):
                turn, d, centre = self.moves[j][k]
                rate = np.zeros((4, 4))
                if turn:
                    rate[:3, :3] = np.array([[0, -d[2], d[1]], [d[2], 0, -d[0]], [-d[1], d[0], 0]])
                    rate[:3, 3] = -rate[:3, :3] @ centre
                else:
                    rate[:3, 3] = d
                tail = moves[k] @ tail
                derivatives[k] = (heads[k] @ rate @ tail)[:3]
            stacked = np.stack(derivatives)
            local = np.tensordot(y, stacked[:, :, :3], ([1], [2])) + stacked[:, :, 3]
            out[:, :, self.slices[j]] = prefix @ local.transpose(0, 2, 1)
            prefix = prefix @ heads[-1][:3, :3]
            velocity = (prefix @ np.cross(AXES[j], y - POINTS[j])[:, :, None])[:, :, 0]
            out[:, :, 29 + j] = velocity
            if self.full:
                out[:, :, 35 + j] = velocity * self.q[:, j, None]
                out[:, :, 42 + j] = velocity * self.torque[:, j, None]
                if j == 5:
                    out[:, :, 41] = velocity * self.q[:, 4, None]
            x_, y_, z_ = AXES[j]
            k = np.array([[0, -z_, y_], [z_, 0, -x_], [-y_, x_, 0]])
            prefix = prefix @ (np.eye(3) + s[:, :, None] * k + (1 - c)[:, :, None] * (k @ k))
        out[:, :, 26:29] = prefix
        return (out * (self.scale / SIGMA)).reshape(3 * rows, self.size)[:, self.columns]


def rms(error):
    return float(np.sqrt((error**2).sum(1).mean()))


def scipy_variants(q, position, full, base, visible, repeats):
    """Seconds, held-out error and description of every variant."""
    fitted = Vectorised(q[:FIT], position[:FIT], full, base)
    held_out = Vectorised(q[FIT:], position[FIT:], full, base)
    central = np.zeros(fitted.size)
    probe = np.random.default_rng(5).normal(size=fitted.size) * 0.05
    analytic, h = fitted.jacobian(probe), 1e-4
    for k in range(fitted.size):
        step = central.copy()
        step[k] = h
        difference = (fitted.residual(probe + step) - fitted.residual(probe - step)) / (2 * h)
        assert np.abs(difference - analytic[:, k]).max() < 1e-4 * max(1.0, np.abs(analytic[:, k]).max()), k
    choices = {"all": np.arange(fitted.size), "visible": visible(fitted)}
    for jacobian in ("2-point", "analytic"):
        for method in ("lm", "trf"):
            for which, columns in choices.items():
                fitted.columns = held_out.columns = columns
                best = np.inf
                for _ in range(repeats):
                    start = time.process_time()
                    solution = least_squares(fitted.residual, np.zeros(len(columns)), method=method,
                                             jac=fitted.jacobian if jacobian == "analytic" else jacobian)
                    best = min(best, time.process_time() - start)
                error = rms(held_out.points(held_out.whole(solution.x)) - position[FIT:])
                yield f"{jacobian}, {which}", best, error, f"{method}, {len(columns)} parameters, {solution.nfev} evaluations"
    fitted.columns = np.arange(fitted.size)


def seen(model):
    """As many columns, in order of precedence, as are independent: what a user who knows the theory would leave free."""
    order = [*range(6), *range(26, 35), *range(6, 26), *range(35, model.size)]
    jacobian = model.jacobian(np.zeros(model.size))
    kept, basis = [], np.empty((jacobian.shape[0], 0))
    for k in order:
        column = jacobian[:, k] / max(np.linalg.norm(jacobian[:, k]), 1e-300)
        rest = column - basis @ (basis.T @ column)
        rest -= basis @ (basis.T @ rest)
        if np.linalg.norm(rest) > 1e-6:
            basis = np.column_stack([basis, rest / np.linalg.norm(rest)])
            kept.append(k)
    return np.array(sorted(kept))


def run_pybotics(q, position, base, limit):
    from pybotics.optimization import OptimizationHandler, compute_absolute_errors, optimize_accuracy
    from pybotics.robot import Robot

    table = MDH.copy()
    robot = Robot.from_parameters(table)
    robot.world_frame = base.copy()
    robot.tool.position = TOOL
    handler = OptimizationHandler(robot, kinematic_chain_mask=True, tool_mask=[True] * 3 + [False] * 3, world_mask=True)
    start = time.process_time()
    solution = least_squares(optimize_accuracy, handler.generate_optimization_vector(), args=(handler, q[:FIT], position[:FIT]),
                             max_nfev=limit)
    seconds = time.process_time() - start
    handler.apply_optimization_vector(solution.x)
    errors = compute_absolute_errors(q[FIT:], position[FIT:], handler.robot)
    note = f"33 parameters, {solution.nfev} evaluations with Jacobian, {solution.message.strip('`. ')}"
    return seconds, float(np.sqrt((errors**2).mean())), note


def run_robotkinecal(q, position, base):
    import roboticstoolbox as rtb
    from robotkinecal import SerialRobotKineCal
    from spatialmath import SE3

    local = (position - base[:3, 3]) @ base[:3, :3] * 1e3  # mm: its tolerance is absolute
    links = [rtb.PoERevolute(axis, point * 1e3) for axis, point in zip(AXES, POINTS)]
    robot = rtb.PoERobot(links, SE3(HOME * 1e3))
    solver = SerialRobotKineCal(robot)
    # Newer roboticstoolbox adds links for base and end that it takes for joints: give it the six screws themselves.
    solver.N_JOINTS, solver.zero_conf_EE_pose = 6, SE3(HOME * 1e3)
    solver.joint_screw_axis = [np.concatenate([np.cross(point * 1e3, axis), axis]) for axis, point in zip(AXES, POINTS)]
    solver.set_observations(list(q[:FIT]), list(local[:FIT]))
    start = time.process_time()
    with contextlib.redirect_stdout(io.StringIO()) as said:
        result = solver.solve()
    seconds = time.process_time() - start
    predicted = np.array([solver.forward_kinematics(7, row).t for row in q[FIT:]])
    warnings = said.getvalue().count("not identifiable")
    return seconds, rms(predicted - local[FIT:]) * 1e-3, f"27 parameters, {result.nb_iterations_executed} iterations, {warnings} warnings of rank"


def run_calib(q, position, full):
    geometry = ["base_frame", "tool_offset", "joint_offset", "link_geometry"]
    problem = {
        "robot": {
            "joints": [{"axis": a.tolist(), "point": p.tolist(), "mass": m, "centre": c.tolist()}
                       for a, p, m, c in zip(AXES, POINTS, MASSES, CENTRES)],
            "tool": HOME.tolist(),
            "couplings": [{"moved": 5, "by": 4}],
        },
        "q": q.ravel().tolist(), "position": position.ravel().tolist(), "sigma": SIGMA, "fit": FIT,
        "effects": geometry + (["reduction_ratio", "coupling_ratio", "joint_compliance"] if full else []),
    }
    with tempfile.NamedTemporaryFile("w", suffix=".json") as file:
        json.dump(problem, file)
        file.flush()
        command = os.environ.get("CALIB_BENCH", "cargo bench --quiet --bench bench --").split()
        done = subprocess.run(command + ["solve", file.name], cwd=ROOT, capture_output=True, text=True)
    if done.returncode:
        sys.exit(done.stderr)
    return json.loads(done.stdout.strip().splitlines()[-1])


def main():
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("--quick", action="store_true", help="pybotics is stopped after 5 evaluations with Jacobian")
    quick = arguments.parse_args().quick
    for name, full in (("full", True), ("geometry", False)):
        q, position = recording(full)
        base = aligned(q, position)
        ours = run_calib(q, position, full)
        print(f"\n{name}: {FIT} points to fit, {CHECK} held out, noise {SIGMA * 3**0.5 * 1e6:.1f} um rms")
        print(f"{'program':<28} {'ms':>10} {'ratio':>8} {'held-out um':>12}  note")

        def line(program, seconds, error, note):
            print(f"{program:<28} {seconds * 1e3:>10.2f} {seconds / ours['seconds']:>8.1f} {error * 1e6:>12.1f}  {note}", flush=True)

        line("calib", ours["seconds"], ours["held_out"],
             f"{ours['free']} of {ours['candidates']} parameters seen, {ours['stop']}; median {ours['median'] * 1e3:.2f} ms")
        fastest = {}
        for variant, seconds, error, note in scipy_variants(q, position, full, base, seen, 6):
            line(f"scipy, {variant}", seconds, error, note)
            if error < 1.1 * ours["held_out"]:
                fastest[variant] = min(seconds, fastest.get(variant, np.inf))
        for variant, seconds in fastest.items():
            print(f"the faster of scipy, {variant}: {seconds / ours['seconds']:.1f} x calib's time")
        if not full:
            for program, run in (("pybotics 3.1.2", lambda: run_pybotics(q, position, base, 5 if quick else None)),
                                 ("robotkinecal 0.1", lambda: run_robotkinecal(q, position, base))):
                try:
                    line(program, *run())
                except Exception as fault:  # a comparison goes on without a program that cannot do the problem
                    print(f"{program:<28} cannot do it: {type(fault).__name__}: {fault}")


if __name__ == "__main__":
    main()
