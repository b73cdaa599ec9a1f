#!/usr/bin/env python3
"""Real recordings of commands and angles: what calib's findings leave in rows that it did not see, and what the usual least squares leaves.

    pip install mujoco numpy
    python3 tests/reference/drives_real.py DATA --calib CALIB --out DIR [--only go2 so101] [--no-rival]

DATA holds `go2_chirp` and `so101_sage`. Go2: each leg by itself, windows of 1.5 s fitted and held out in turn. SO-101: three recordings are
fitted together, all others judge. The rival: armature, damping, dry friction, offset and delay of every joint, fitted to the same rows by
Gauss and Newton in MuJoCo's own roll-outs.
"""
import argparse
import csv
import io
import json
import pathlib
import shutil
import subprocess
import sys

import numpy as np

LEGS = ["FL", "FR", "RL", "RR"]
PARTS = ["hip", "thigh", "calf"]
ARM = ["shoulder_pan", "shoulder_lift", "elbow_flex", "wrist_flex", "wrist_roll"]
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


def recording(folder, is_fitted):
    """Time, commands, angles and rows to fit of a recording of the arm."""

    def lists(name):
        rows = list(csv.DictReader((folder / name).open()))
        return np.array([float(row["timestamp"]) / 1e6 for row in rows]), np.array([json.loads(row["positions"])[: len(ARM)] for row in rows])

    (time, command), (_, angle) = lists("control.csv"), lists("state_motor.csv")
    return time, command, angle, np.full(len(time), is_fitted)


class Rival:
    """The usual least squares: five numbers a joint in MuJoCo's own roll-outs."""

    # Usual sizes of armature, damping, dry friction, offset and delay, and the least of each.
    SIZES = np.array([0.01, 0.5, 0.1, 0.02, 0.01])
    LEAST = np.array([1e-4, 0.0, 0.0, -1.0, 0.0])

    def __init__(self, xml, joints, gains, step, recordings):
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
        self.step, self.recordings = step, recordings
        m = self.model
        start = [m.dof_armature, m.dof_damping, m.dof_frictionloss]
        self.start = np.array([[a[d] for a in start] + [0.0, 0.0] for d in self.dofs])

    def simulate(self, numbers, which):
        time, command, angle, _ = self.recordings[which]
        m = self.model
        for k, of in enumerate([m.dof_armature, m.dof_damping, m.dof_frictionloss]):
            of[self.dofs] = numbers[:, k]
        grid = np.arange(time[0], time[-1], self.step)
        control = np.empty((len(grid), len(self.dofs)))
        for j in range(len(self.dofs)):
            at = np.searchsorted(time, grid + 1e-9 - numbers[j, 4], side="right") - 1
            control[:, j] = command[np.clip(at, 0, None), j] + numbers[j, 3]
        data = self.mujoco.MjData(m)
        data.qpos[self.angles] = angle[:3].mean(0)
        size = self.mujoco.mj_stateSize(m, self.mujoco.mjtState.mjSTATE_FULLPHYSICS)
        state = np.empty(size)
        self.mujoco.mj_getState(m, data, state, self.mujoco.mjtState.mjSTATE_FULLPHYSICS)
        states, _ = self.rollout.rollout(m, data, state[None], control[None])
        # A state is that after its step; the first quantity is time.
        all_angles = np.vstack([state[None, 1 : 1 + m.nq], states[0][:, 1 : 1 + m.nq]])[:, self.angles]
        return np.array([np.interp(time - time[0], self.step * np.arange(len(all_angles)), a) for a in all_angles.T]).T

    def residual(self, numbers, fitted=True):
        parts = []
        for k, (_, _, angle, rows) in enumerate(self.recordings):
            if rows.any() or not fitted:
                error = angle - self.simulate(numbers, k)
                parts.append(error[rows] if fitted else error)
        return parts

    def fit(self, rounds=8):
        numbers = np.maximum(self.start, self.LEAST)
        sizes = np.broadcast_to(self.SIZES, numbers.shape)
        flat = lambda parts: np.concatenate([p.ravel() for p in parts])
        residual, damp = flat(self.residual(numbers)), 1e-3
        for _ in range(rounds):
            columns = []
            for k in range(numbers.size):
                trial = numbers.copy()
                trial.ravel()[k] += 0.02 * sizes.ravel()[k]
                columns.append((residual - flat(self.residual(trial))) / 0.02)
            a = np.array(columns).T
            gram, gradient = a.T @ a, a.T @ residual
            while damp < 1e6:
                change = np.linalg.solve(gram + damp * np.diag(np.diag(gram) + 1e-12), gradient).reshape(numbers.shape)
                trial = np.maximum(numbers + change * sizes, self.LEAST)
                now = flat(self.residual(trial))
                if np.isfinite(now).all() and now @ now < residual @ residual:
                    break
                damp *= 10
            else:
                break
            gain = 1 - (now @ now) / (residual @ residual)
            numbers, residual, damp = trial, now, damp / 10
            if gain < 1e-3:
                break
        return numbers


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
            rival = Rival(xml, names, (20, 1.5, limits), 0.001, [(time, table[:, 1:13], table[:, 13:], rows)])
            for what, numbers in (("as it is", rival.start), ("five numbers a joint", rival.fit())):
                (error,) = rival.residual(numbers, fitted=False)
                rms = lambda rows: np.degrees(np.sqrt((error[rows] ** 2).mean()))
                print(f"go2 in MuJoCo, {what}: held out {rms(~rows):.3f} deg (fitted {rms(rows):.3f})", flush=True)
    if "so101" in options.only:
        folder, names = so101(options.data, options.out)
        document, course = diagnosed(options.calib, folder)
        print("so101: mrad rms of each recording, before -> after, by joint")
        tell(document)
        breaks = np.flatnonzero(np.diff(course["time_s"]) > 0.5) + 1
        parts = np.split(np.arange(len(course["time_s"])), breaks)
        for name, rows in zip(names, parts, strict=True):
            rms = lambda what, j: 1e3 * np.sqrt(((course[f"measured{j}_rad"] - course[f"{what}{j}_rad"])[rows] ** 2).mean())
            cells = "  ".join(f"{rms('simulated', j):5.1f} -> {rms('corrected', j):5.1f}" for j in range(1, len(ARM) + 1))
            print(f"  {'fitted  ' if name in FITTED else 'held out'} {name:25} {cells}")
        if not options.no_rival:
            recordings = [recording(options.data / "so101_sage" / name, name in FITTED) for name in names]
            xml = (options.data / "so101_sage" / "so101.xml").read_text()
            rival = Rival(xml, ARM, (998.22, 2.731, [3.35] * len(ARM)), 0.002, recordings)
            errors = rival.residual(rival.fit(), fitted=False)
            print("so101 in MuJoCo, five numbers a joint: mrad rms of each recording, by joint")
            for name, error in zip(names, errors):
                cells = "  ".join(f"{rms:5.1f}" for rms in 1e3 * np.sqrt((error**2).mean(0)))
                print(f"  {'fitted  ' if name in FITTED else 'held out'} {name:25} {cells}")


if __name__ == "__main__":
    main()
