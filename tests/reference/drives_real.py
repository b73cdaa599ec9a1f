#!/usr/bin/env python3
"""Real recordings of commands and angles: what calib's findings leave in rows that it did not see, and what the usual least squares leaves.

    pip install mujoco numpy scipy
    python3 tests/reference/drives_real.py DATA --calib CALIB --out DIR [--only go2 so101] [--no-rival]

DATA holds `go2_chirp` and `so101_sage`. Go2: each leg by itself, windows of 1.5 s fitted and held out in turn. SO-101: three recordings are
fitted together, all others judge. The rival: five numbers of every joint (Go2: armature, damping, dry friction, offset and delay; SO-101:
stiffness, damping, armature, viscous and dry friction), fitted to the same rows by scipy's bounded least squares in MuJoCo's own roll-outs.
"""
import argparse
import copy
import csv
import dataclasses
import io
import json
import pathlib
import shutil
import subprocess
import sys
from concurrent import futures

import numpy as np

LEGS = ["FL", "FR", "RL", "RR"]
PARTS = ["hip", "thigh", "calf"]
ARM = ["shoulder_pan", "shoulder_lift", "elbow_flex", "wrist_flex", "wrist_roll"]
# Of the rival's derivatives.
THREADS = 2
FITTED = ["multisine", "friction_gravity", "step_response"]
TOLERANCE = {"mass_rel": 0.05, "com_mm": 5, "inertia_rel": 0.2}


def go2(data, out, leg):
    """The pipeline of a leg."""
    joints = [
        {"joint": f"{leg}_{part}_joint", "kp": 20, "kd": 1.5, "kd_on": "speed", "torque_limit_nm": 45.43 if part == "calf" else 23.7, "encoder_rad": 3e-5, "noise_rad": 2e-5}
        for part in PARTS
    ]
    drives = {"command_rate_hz": 200, "joints": joints, "inertia_tolerance": TOLERANCE}
    here = data / "go2_chirp"
    settings = {
        "robot": str(here / "go2.xml"),
        "drives": "drives.json",
        "recording": str(here / "recording.csv"),
        "columns": {"command": "cmd_{name}", "angle": "q_{name}"},
        "hold_out": {"windows": 1.5},
    }
    return written(out / f"go2_{leg}", drives, settings)


def so101(data, out):
    """The pipeline of the arm."""
    here = data / "so101_sage"
    joints = [{"joint": name, "kp": 998.22, "kd": 2.731, "kd_on": "speed", "torque_limit_nm": 3.35, "encoder_rad": 0.001534, "noise_rad": 2e-4} for name in ARM]
    drives = {"command_rate_hz": 49.88, "joints": joints, "inertia_tolerance": TOLERANCE}
    files = lambda name: {"file": str(here / name / "state_motor.csv"), "commands": str(here / name / "control.csv")}
    others = sorted(p.name for p in here.iterdir() if p.is_dir() and p.name not in FITTED)
    recording = [files(name) for name in FITTED] + [files(name) | {"usage": "validate"} for name in others]
    settings = {
        "robot": str(here / "so101.xml"),
        "drives": "drives.json",
        "recording": recording,
        "columns": {"time": "timestamp", "time_unit": "us", "command": "positions", "angle": "positions"},
    }
    return written(out / "so101", drives, settings), FITTED + others


def written(folder, drives, settings):
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "drives.json").write_text(json.dumps(drives, indent=1))
    # JSON is YAML.
    stage = {"uses": "diagnose_drives", "with": settings}
    (folder / "pipeline.yaml").write_text(json.dumps({"calib": 1, "name": folder.name, "seed": 1, "stages": [stage]}, indent=1))
    return folder


def diagnosed(calib, folder):
    """calib's answer, and the course of all rows."""
    store = folder / "store"
    shutil.rmtree(store, ignore_errors=True)
    for verb in (["run"], ["diagnose", "--json"]):
        answer = subprocess.run([calib, *verb, "--store", str(store), str(folder / "pipeline.yaml")], capture_output=True, text=True)
        with (folder / "log.txt").open("w" if verb == ["run"] else "a") as log:
            log.write(answer.stderr)
        if answer.returncode:
            sys.exit(answer.stderr)
    document = json.loads(answer.stdout)
    (folder / "answer.json").write_text(answer.stdout)
    query = "SELECT * FROM diagnose_drives.course ORDER BY sequence"
    table = subprocess.run([calib, "query", "--store", str(store), "HEAD", query, "--csv"], capture_output=True, text=True)
    if table.returncode:
        sys.exit(table.stderr)
    rows = list(csv.reader(io.StringIO(table.stdout)))
    head = rows[0]
    values = np.array([[float({"true": 1, "false": 0}.get(cell, cell)) for cell in row] for row in rows[1:]])
    return document, {name: values[:, k] for k, name in enumerate(head)}


def in_mujoco(calib, folder, recordings, stated):
    """The residual (mrad rms) of the exported MJCF with its Python, rolled out in MuJoCo, over that which calib states; of rows that judge.
    `recordings` as (time, command, angle, fitted rows)."""
    sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "python"))
    from drives_in_mujoco import rolled_out

    def exported(name):
        words = [calib, "export", "--store", str(folder / "store"), "--quiet", "--format", name, str(folder / "pipeline.yaml")]
        done = subprocess.run(words, capture_output=True, text=True)
        return done.stdout if done.returncode == 0 else sys.exit(done.stderr)

    drives = json.loads((folder / "drives.json").read_text())
    text, control = exported("mjcf"), exported("mjcf_control")
    errors = []
    for time, command, angle, fitted in recordings:
        if not fitted.all():
            (simulated,) = rolled_out(text, drives, [(time, command, angle)], control)
            errors.append((angle - simulated)[~fitted].ravel())
    rms = 1e3 * np.sqrt((np.concatenate(errors) ** 2).mean())
    print(f"  in MuJoCo: {rms:.3f} mrad, {rms / stated:.3f} of the {stated:.3f} mrad that are stated", flush=True)


def recording(folder, is_fitted):
    """Time, commands, angles and rows to fit of a recording of the arm."""

    def lists(name):
        rows = list(csv.DictReader((folder / name).open()))
        return np.array([float(row["timestamp"]) / 1e6 for row in rows]), np.array([json.loads(row["positions"])[: len(ARM)] for row in rows])

    (time, command), (_, angle) = lists("control.csv"), lists("state_motor.csv")
    return time, command, angle, np.full(len(time), is_fitted)


@dataclasses.dataclass(frozen=True)
class Quantity:
    """A number of every joint that the usual least squares fits."""

    name: str
    size: float
    low: float
    high: float
    by_logarithm: bool = True

    def scaled(self, value):
        value = np.clip(value, self.low, self.high)
        return np.log(value / self.size) if self.by_logarithm else value / self.size

    def value(self, scaled):
        return np.clip(self.size * np.exp(scaled) if self.by_logarithm else self.size * scaled, self.low, self.high)


ARMATURE = Quantity("armature", 0.01, 1e-4, 0.5)
VISCOUS = Quantity("viscous friction", 0.5, 1e-3, 50)
DRY = Quantity("dry friction", 0.1, 1e-4, 5)
STIFFNESS = Quantity("stiffness", 50, 0.5, 5000)
DAMPING = Quantity("damping", 1, 1e-3, 100)
OFFSET = Quantity("offset", 0.02, -1, 1, False)
DELAY = Quantity("delay", 0.01, 0, 0.3, False)


class Rival:
    """The usual least squares: five numbers a joint in MuJoCo's own roll-outs, bounded and scaled (scipy), from several starts."""

    def __init__(self, xml, joints, gains, step, recordings, quantities):
        """`joints` by name; `gains` kp, kd and limits; `recordings` as (time, command, angle, fitted rows)."""
        import mujoco
        from mujoco import rollout

        spec = mujoco.MjSpec.from_string(xml)
        for actuator in list(spec.actuators):
            spec.delete(actuator)
        kp, kd, limits = gains
        for name, limit in zip(joints, limits):
            servo = spec.add_actuator(name=f"servo_{name}", target=name, trntype=mujoco.mjtTrn.mjTRN_JOINT)
            servo.gainprm[0], servo.biastype = kp, mujoco.mjtBias.mjBIAS_AFFINE
            servo.biasprm[1:3] = -kp, -kd
            servo.forcelimited, servo.forcerange = 1, [-limit, limit]
        spec.option.timestep, spec.option.integrator = step, mujoco.mjtIntegrator.mjINT_IMPLICITFAST
        spec.option.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT | mujoco.mjtDisableBit.mjDSBL_LIMIT
        self.model, self.rollout, self.mujoco = spec.compile(), rollout, mujoco
        ids = [self.model.joint(name) for name in joints]
        self.dofs, self.angles = [int(j.dofadr[0]) for j in ids], [int(j.qposadr[0]) for j in ids]
        self.step, self.recordings, self.quantities = step, recordings, quantities
        m = self.model
        # MuJoCo's default friction creeps; this is as stiff as the step allows.
        m.dof_solref[self.dofs] = [2 * step, 1]
        known = {
            ARMATURE: m.dof_armature[self.dofs],
            VISCOUS: m.dof_damping[self.dofs],
            DRY: m.dof_frictionloss[self.dofs],
            STIFFNESS: np.full(len(joints), kp),
            DAMPING: np.full(len(joints), kd),
        }
        zero = np.zeros(len(joints))
        self.start = np.array([quantity.scaled(known.get(quantity, zero)) for quantity in quantities]).T

    def simulate(self, scaled, which, seconds):
        time, command, angle, _ = self.recordings[which]
        m = copy.copy(self.model)
        numbers = {quantity: quantity.value(column) for quantity, column in zip(self.quantities, scaled.T)}
        for quantity, of in ((ARMATURE, m.dof_armature), (VISCOUS, m.dof_damping), (DRY, m.dof_frictionloss)):
            if quantity in numbers:
                of[self.dofs] = numbers[quantity]
        if STIFFNESS in numbers:
            m.actuator_gainprm[:, 0] = numbers[STIFFNESS]
            m.actuator_biasprm[:, 1] = -numbers[STIFFNESS]
        if DAMPING in numbers:
            m.actuator_biasprm[:, 2] = -numbers[DAMPING]
        zero = np.zeros(len(self.dofs))
        offset, delay = numbers.get(OFFSET, zero), numbers.get(DELAY, zero)
        rows = time <= time[0] + seconds
        grid = np.arange(time[0], time[rows][-1], self.step)
        control = np.empty((len(grid), len(self.dofs)))
        for j in range(len(self.dofs)):
            at = np.searchsorted(time, grid + 1e-9 - delay[j], side="right") - 1
            control[:, j] = command[np.clip(at, 0, None), j] + offset[j]
        data = self.mujoco.MjData(m)
        data.qpos[self.angles] = angle[:3].mean(0)
        size = self.mujoco.mj_stateSize(m, self.mujoco.mjtState.mjSTATE_FULLPHYSICS)
        state = np.empty(size)
        self.mujoco.mj_getState(m, data, state, self.mujoco.mjtState.mjSTATE_FULLPHYSICS)
        states, _ = self.rollout.rollout(m, data, state[None], control[None])
        # A state is that after its step; the first quantity is time.
        all_angles = np.vstack([state[None, 1 : 1 + m.nq], states[0][:, 1 : 1 + m.nq]])[:, self.angles]
        return np.array([np.interp(time[rows] - time[0], self.step * np.arange(len(all_angles)), a) for a in all_angles.T]).T

    def residual(self, scaled, fitted=True, seconds=np.inf):
        parts = []
        for k, (_, _, angle, rows) in enumerate(self.recordings):
            if rows.any() or not fitted:
                simulated = self.simulate(scaled, k, seconds)
                error = angle[: len(simulated)] - simulated
                parts.append(error[rows[: len(simulated)]] if fitted else error)
        return parts

    def from_start(self, start, steps, seconds):
        """Bounded least squares from a start on the first `seconds` of each recording."""
        from scipy.optimize import least_squares

        def residual(x):
            flat = np.concatenate([p.ravel() for p in self.residual(x.reshape(start.shape), seconds=seconds)])
            # mrad; a simulation that runs away is as bad as no motion is long.
            return np.clip(np.nan_to_num(1e3 * flat, nan=1e4), -1e4, 1e4)

        def derivative(x):
            middle, step = residual(x), 0.02
            with futures.ThreadPoolExecutor(THREADS) as pool:
                moved = list(pool.map(residual, x + step * np.eye(x.size)))
            return np.array([(column - middle) / step for column in moved]).T

        bounds = [[quantity.scaled(limit) for quantity in self.quantities] for limit in (-np.inf, np.inf)]
        bounds = [np.broadcast_to(limit, start.shape).ravel() for limit in bounds]
        begun = np.clip(start.ravel(), bounds[0] + 1e-6, bounds[1] - 1e-6)
        return least_squares(residual, begun, derivative, bounds, method="trf", x_scale=1.0, ftol=1e-4, xtol=1e-4, max_nfev=steps)

    def fit(self, starts, seconds=20):
        """The best of all starts on a part of the rows, then all rows; says how each went."""
        tried = []
        for name, start in starts:
            answer = self.from_start(start, 25, seconds)
            tried.append((answer.cost, answer))
            print(f"  rival from {name}: {np.sqrt(2 * answer.cost / len(answer.fun)):.2f} mrad of {seconds} s each, {answer.nfev} steps ({answer.message})", flush=True)
        best = min(tried, key=lambda one: one[0])[1]
        answer = self.from_start(best.x.reshape(self.start.shape), 25, np.inf)
        print(f"  rival, all fitted rows: {np.sqrt(2 * answer.cost / len(answer.fun)):.2f} mrad, {answer.nfev} steps ({answer.message})")
        scaled = answer.x.reshape(self.start.shape)
        for quantity, column in zip(self.quantities, scaled.T):
            print(f"    {quantity.name}: {np.array2string(quantity.value(column), precision=4)}")
        return scaled

    def starts(self, seed=1, count=2):
        """The file as it is, and random ones around usual sizes."""
        random = np.random.default_rng(seed)
        yield "the file as it is", self.start
        for k in range(count):
            yield f"random start {k + 1}", random.normal(0, 1, self.start.shape) * [quantity.by_logarithm for quantity in self.quantities]


def tell(document):
    for finding in document["findings"]:
        numbers = ", ".join(f"{p['name']} {p['value']:.4g}" for p in finding.get("parameters", []))
        print(f"    {finding['effect']} at {finding['where']}: {numbers}")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("data", type=pathlib.Path)
    parser.add_argument("--calib", default="calib")
    parser.add_argument("--out", type=pathlib.Path, required=True)
    parser.add_argument("--only", nargs="*", default=["go2", "so101"])
    parser.add_argument("--legs", nargs="*", default=LEGS)
    parser.add_argument("--no-rival", action="store_true")
    options = parser.parse_args()
    if "go2" in options.only:
        squares = []
        for leg in options.legs:
            document, course = diagnosed(options.calib, go2(options.data, options.out, leg))
            held = course["held_out"] > 0
            print(f"go2 {leg}: deg rms held out, before and after")
            tell(document)
            table = np.loadtxt(options.data / "go2_chirp" / "recording.csv", delimiter=",", skiprows=1)
            own = 3 * LEGS.index(leg) + np.arange(3)
            rows = np.floor((table[:, 0] - table[0, 0] + 1e-6) / 1.5) % 2 == 0
            all_rows = (table[:, 0], table[:, 1 + own], table[:, 13 + own], rows)
            in_mujoco(options.calib, options.out / f"go2_{leg}", [all_rows], document["after"]["validate_rms_mrad"])
            for j, part in enumerate(PARTS, 1):
                errors = [np.degrees(course[f"measured{j}_rad"] - course[f"{what}{j}_rad"]) for what in ("simulated", "corrected")]
                before, after = (np.sqrt((e[held] ** 2).mean()) for e in errors)
                fitted = np.sqrt((errors[1][~held] ** 2).mean())
                squares.append((before**2, after**2, fitted**2))
                print(f"  {part:6} {before:.3f} {after:.3f} (fitted {fitted:.3f})")
        before, after, fitted = np.sqrt(np.mean(squares, axis=0))
        print(f"go2, {len(squares)} joints: held out {before:.3f} -> {after:.3f} deg (fitted {fitted:.3f})")
        if not options.no_rival:
            table = np.loadtxt(options.data / "go2_chirp" / "recording.csv", delimiter=",", skiprows=1)
            time = table[:, 0]
            rows = np.floor((time - time[0] + 1e-6) / 1.5) % 2 == 0
            names = [f"{leg}_{part}_joint" for leg in LEGS for part in PARTS]
            limits = [45.43 if "calf" in name else 23.7 for name in names]
            xml = (options.data / "go2_chirp" / "go2.xml").read_text()
            rival = Rival(xml, names, (20, 1.5, limits), 0.001, [(time, table[:, 1:13], table[:, 13:], rows)], [ARMATURE, VISCOUS, DRY, OFFSET, DELAY])
            fitted = rival.fit([("the file as it is", rival.start)], seconds=np.inf)
            for what, numbers in (("as it is", rival.start), ("five numbers a joint", fitted)):
                (error,) = rival.residual(numbers, fitted=False)
                rms = lambda rows: np.degrees(np.sqrt((error[rows] ** 2).mean()))
                print(f"go2 in MuJoCo, {what}: held out {rms(~rows):.3f} deg (fitted {rms(rows):.3f})", flush=True)
    if "so101" in options.only:
        of_so101(options)


def of_so101(options):
    """A table of all recordings: as published, with calib's findings, by the usual least squares."""
    folder, names = so101(options.data, options.out)
    document, course = diagnosed(options.calib, folder)
    tell(document)
    recordings = [recording(options.data / "so101_sage" / name, name in FITTED) for name in names]
    in_mujoco(options.calib, folder, recordings, document["after"]["validate_rms_mrad"])
    breaks = np.flatnonzero(np.diff(course["time_s"]) > 0.5) + 1
    parts = np.split(np.arange(len(course["time_s"])), breaks)
    index = range(1, len(ARM) + 1)
    errors = [np.stack([course[f"measured{j}_rad"] - course[f"{what}{j}_rad"] for j in index], 1) for what in ("simulated", "corrected")]
    tables = {"as published": [errors[0][rows] for rows in parts], "with the findings": [errors[1][rows] for rows in parts]}
    assert len(parts) == len(names)
    if not options.no_rival:
        tables["five numbers a joint"] = so101_rival(options.data, names)
    rms = lambda error: 1e3 * np.sqrt((error**2).mean(0))
    print("so101: mrad rms of each recording by joint; then of shoulder and elbow, and of all joints")
    for k, name in enumerate(names):
        print(f"  {'fitted  ' if name in FITTED else 'held out'} {name}")
        for what, parts in tables.items():
            error = parts[k]
            cells = "".join(f"{x:7.1f}" for x in [*rms(error), rms(error[:, 1:3].ravel()), rms(error.ravel())])
            print(f"    {what:22}{cells}")
    held = [k for k, name in enumerate(names) if name not in FITTED]
    for what, parts in tables.items():
        error = np.concatenate([parts[k] for k in held])
        print(f"so101 held out, {what}: shoulder and elbow {rms(error[:, 1:3].ravel()):.1f} mrad, all joints {rms(error.ravel()):.1f} mrad")


def so101_rival(data, names):
    """What the usual least squares leaves of each recording."""
    recordings = [recording(data / "so101_sage" / name, name in FITTED) for name in names]
    xml = (data / "so101_sage" / "so101.xml").read_text()
    quantities = [STIFFNESS, DAMPING, ARMATURE, VISCOUS, DRY]
    rival = Rival(xml, ARM, (998.22, 2.731, [3.35] * len(ARM)), 0.004, recordings, quantities)
    return rival.residual(rival.fit(rival.starts()), fitted=False)


if __name__ == "__main__":
    main()
