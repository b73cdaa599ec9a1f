#!/usr/bin/env python3
"""CPU time of calib's diagnosis and identification of 20,000 x 6 rows of torques, in turn with a numpy least squares and with FIGAROH's.

  pip install numpy scipy pin==4.1.0 figaroh==1.0.2      (figaroh may be missing: it is left out then)
  torque_speed.py CALIB [ROUNDS]                         CALIB: the binary; pipelines/dynamics is taken from this repository

The arm is that of pipelines/dynamics/example; Pinocchio makes the torques of a Fourier series of 40 s at 500 Hz, with viscous and Coulomb
friction at all joints and noise. What is compared, and what not:

- identification: 60 inertial numbers reduced to base parameters, viscous and Coulomb friction of six joints. calib: `inertials: free` and all
  other causes left out; it filters, decimates to at most 4,000 rows, whitens by the noise's autocorrelation and gives a covariance with it,
  held-out errors and friction curves. numpy: the same low-pass on positions, velocities and accelerations by differences, the regressor over
  all rows at once as array operations, pivoted QR for the base, ordinary least squares on all 120,000 rows; nothing is filtered, whitened or
  held out after that. FIGAROH: its own `build_regressor_basic` (a Python loop around Pinocchio's C++ regressor), elimination and `QRDecomposer`
  on the same arrays.
- diagnosis: calib's search for causes beside declared masses. Nothing of the others does it; their time stands beside it for scale alone.
- calib's time is that of the whole process: start, reading text, all tables written to a new store. Python's is that of the method alone,
  after imports and with the arrays in memory. All are CPU seconds of all threads, the median of the rounds.
- The state of CALIB matters: a development build has its numerics at opt-level 2 and all else unoptimised. Its path is printed.
"""

import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pinocchio as pin
from scipy.linalg import qr
from scipy.signal import butter, sosfiltfilt

ROOT = Path(__file__).resolve().parents[2]
RATE, SECONDS, CUTOFF = 500.0, 40.0, 10.0
OTHERS = """current_offset asymmetric_friction stribeck_friction presliding_friction load_friction warmup_friction rotor_inertia torque_constant
spring_balance cable_stiffness torque_ripple joint_elasticity backlash_spikes wrist_coupling payload_error link_mass link_com link_inertia
gravity_direction unknown current_latency contact""".split()


def arm(file):
    """Pinocchio's model of a robot.json with its payload."""
    model, parent, before = pin.Model(), 0, np.zeros(3)
    model.gravity.linear = np.array(file["gravity"])
    n = len(file["axes"])
    for k in range(n):
        point = np.array(file["points"][k]) * 1e-3
        parent = model.addJoint(parent, pin.JointModelRevoluteUnaligned(*file["axes"][k]), pin.SE3(np.eye(3), point - before), f"joint{k + 1}")
        before = point

        def body(mass, centre, moments):
            xx, xy, xz, yy, yz, zz = moments
            inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
            model.appendBodyToJoint(parent, pin.Inertia(mass, centre - point, inertia), pin.SE3.Identity())

        body(file["mass"][k], np.array(file["com"][k]) * 1e-3, file["inertia"][k])
        if k + 1 == n:
            centre = (np.array(file["tool"]) + np.array(file["payload_com"])) * 1e-3
            body(file["payload"], centre, file["payload_inertia"])
    return model


def recorded(model, rng):
    """Times, joints (rad) and torques (Nm) of a Fourier series."""
    n, time_s = model.nv, np.arange(int(RATE * SECONDS)) / RATE
    q, v, a = (np.zeros((len(time_s), n)) for _ in range(3))
    for joint in range(n):
        for harmonic in range(1, 6):
            w, size, phase = 2 * np.pi * 0.1 * harmonic, rng.uniform(0.1, 0.5) / harmonic**0.5, rng.uniform(0, 2 * np.pi)
            q[:, joint] += size * np.sin(w * time_s + phase)
            v[:, joint] += size * w * np.cos(w * time_s + phase)
            a[:, joint] -= size * w * w * np.sin(w * time_s + phase)
    data = model.createData()
    torque = np.array([pin.rnea(model, data, *row) for row in zip(q, v, a)])
    scale = np.abs(torque).max(axis=0) + 0.01 * np.abs(torque).max()
    torque += 0.08 * scale * v + 0.1 * scale * np.tanh(v / 0.01) + 0.01 * scale * rng.normal(size=torque.shape)
    return time_s, q, torque


def filtered(q):
    """Positions after the low-pass, velocities and accelerations by differences."""
    smooth = sosfiltfilt(butter(2, 3 * CUTOFF, fs=RATE, output="sos"), q, axis=0)
    v = np.gradient(smooth, 1 / RATE, axis=0)
    return smooth, v, np.gradient(v, 1 / RATE, axis=0)


def turns(axis, angle):
    k = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    s, c = np.sin(angle)[:, None, None], np.cos(angle)[:, None, None]
    return np.eye(3) + s * k + (1 - c) * (k @ k)


def numpy_regressor(file, q, v, a):
    """Rows x joints x 10 links: torques per inertial number, all rows at once."""
    axes, points, rows = np.array(file["axes"]), np.array(file["points"]) * 1e-3, len(q)
    n = len(axes)
    whole = np.zeros((rows, n, 10 * n))
    w, dw, acc = np.zeros((rows, 3)), np.zeros((rows, 3)), np.tile(-np.array(file["gravity"]), (rows, 1))
    frames, steps, before = [], [], np.zeros(3)
    for link in range(n):
        step = points[link] - before
        before = points[link]
        acc = acc + np.cross(dw, step) + np.cross(w, np.cross(w, step))
        frame = turns(axes[link], q[:, link])
        back = lambda x: np.einsum("rij,ri->rj", frame, x)
        acc, w, dw = back(acc), back(w), back(dw)
        along = axes[link] * v[:, link, None]
        dw = dw + np.cross(w, along) + axes[link] * a[:, link, None]
        w = w + along
        frames.append(frame)
        steps.append(step)
        force, moment = np.zeros((rows, 10, 3)), np.zeros((rows, 10, 3))
        force[:, 0] = acc
        for k, unit in enumerate(np.eye(3)):
            force[:, 1 + k] = np.cross(dw, unit) + np.cross(w, np.cross(w, unit))
            moment[:, 1 + k] = np.cross(unit, acc)
        for k, (i, j) in enumerate([(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)]):
            e = np.zeros((3, 3))
            e[i, j] = e[j, i] = 1
            moment[:, 4 + k] = dw @ e + np.cross(w, w @ e)
        for joint in range(link, -1, -1):
            whole[:, joint, 10 * link:10 * link + 10] = moment @ axes[joint]
            force = np.einsum("rij,rkj->rki", frames[joint], force)
            moment = np.einsum("rij,rkj->rki", frames[joint], moment) + np.cross(steps[joint], force)
    return whole


def by_numpy(file, q, torque):
    q, v, a = filtered(q)
    n = q.shape[1]
    inertial = numpy_regressor(file, q, v, a).transpose(1, 0, 2).reshape(-1, 10 * n)
    friction = np.zeros((n, len(q), 2 * n))
    for joint in range(n):
        friction[joint, :, 2 * joint], friction[joint, :, 2 * joint + 1] = v[:, joint], np.sign(v[:, joint])
    whole = np.hstack([inertial, friction.reshape(-1, 2 * n)])
    size = np.linalg.norm(whole, axis=0)
    used = np.flatnonzero(size > 1e-9 * size.max())
    r, order = qr(whole[:, used] / size[used], mode="r", pivoting=True)
    rank = int((np.abs(np.diag(r)) > 1e-7).sum())
    base = used[order[:rank]]
    solved = np.linalg.lstsq(whole[:, base], torque.T.ravel(), rcond=None)[0]
    return rank, whole[:, base] @ solved


def by_figaroh(model, q, torque):
    from figaroh.tools.qrdecomposition import QRDecomposer
    from figaroh.tools.regressor import build_regressor_basic, build_regressor_reduced, get_index_eliminate

    q, v, a = filtered(q)
    n = model.nv
    config = {"has_friction": True, "has_actuator_inertia": False, "has_joint_offset": False, "is_joint_torques": True,
              "is_external_wrench": False, "force_torque": None, "act_idxv": list(range(n))}
    whole = build_regressor_basic(SimpleNamespace(model=model, data=model.createData()), q, v, a, config)
    names = {f"p{k}": 0.0 for k in range(whole.shape[1])}
    gone, kept = get_index_eliminate(whole, names)
    reduced = build_regressor_reduced(whole, gone)
    base, _, _, values = QRDecomposer().double_decomposition(torque.T.ravel(), reduced, kept)[:4]
    return base.shape[1], base @ values


def cpu_of(method, *arguments):
    begin = time.process_time()
    rank, predicted = method(*arguments)
    return time.process_time() - begin, rank, predicted


def cpu_of_calib(calib, case, settings):
    with tempfile.TemporaryDirectory() as store:
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        command = [calib, "diagnose", str(ROOT / "pipelines/dynamics/pipeline.yaml"), "--json", "--quiet", "--store", store, "--set", f"case={case}"]
        told = subprocess.run(command + settings, capture_output=True, text=True)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
    if told.returncode:
        sys.exit(told.stderr)
    names = sorted(f"{found['effect']} {found['where']}" for found in json.loads(told.stdout)["findings"])
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, names


def main():
    calib, rounds = sys.argv[1], int(sys.argv[2]) if len(sys.argv) > 2 else 3
    file = json.loads((ROOT / "pipelines/dynamics/example/robot.json").read_text())
    model = arm(file)
    time_s, q, torque = recorded(model, np.random.default_rng(5))
    n = q.shape[1]
    with tempfile.TemporaryDirectory() as case:
        Path(case, "robot.json").write_text(json.dumps(file))
        head = ["time_s", "use"] + [f"q{k + 1}_deg" for k in range(n)] + [f"tau{k + 1}_nm" for k in range(n)]
        with open(Path(case, "recording.csv"), "w") as out:
            out.write(",".join(head) + "\n")
            for row in range(len(q)):
                use = "fit" if row < 0.7 * len(q) else "validate"
                cells = [f"{x:.6f}" for x in np.degrees(q[row])] + [f"{x:.4f}" for x in torque[row]]
                out.write(f"{time_s[row]:.4f},{use}," + ",".join(cells) + "\n")
        plain = ["--set", "diagnose_torques.inertials=free", "--set", f"diagnose_torques.without=[{','.join(OTHERS)}]"]
        times = {"identification, calib": [], "diagnosis, calib": [], "least squares, numpy": [], "least squares, FIGAROH": []}
        told = {}
        for _ in range(rounds):
            for name, settings in [("identification, calib", plain), ("diagnosis, calib", [])]:
                cpu, told[name] = cpu_of_calib(calib, case, settings)
                times[name].append(cpu)
            for name, method, with_what in [("least squares, numpy", by_numpy, file), ("least squares, FIGAROH", by_figaroh, model)]:
                try:
                    cpu, rank, predicted = cpu_of(method, with_what, q, torque)
                except ImportError as error:
                    told[name] = f"left out: {error}"
                    continue
                left = np.sqrt(((predicted - torque.T.ravel()) ** 2).reshape(n, -1).mean(axis=1) / torque.var(axis=0))
                told[name] = f"{rank} base parameters with friction, mean NRMSE of all rows {left.mean():.4f}"
                times[name].append(cpu)
    print(f"{len(q)} x {n} rows; CPU seconds, median of {rounds} rounds; calib: {os.path.abspath(calib)}")
    middle = {name: float(np.median(all_of)) for name, all_of in times.items() if all_of}
    for name, what in told.items():
        said = ", ".join(what) if isinstance(what, list) else what
        print(f"  {name}: {middle.get(name, float('nan')):.2f} s  ({said})")
    for other in ("least squares, numpy", "least squares, FIGAROH"):
        if other in middle:
            print(f"{other} over calib's identification: {middle[other] / middle['identification, calib']:.1f}, over its diagnosis: "
                  f"{middle[other] / middle['diagnosis, calib']:.1f}")


main()
