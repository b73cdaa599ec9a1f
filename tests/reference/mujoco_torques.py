#!/usr/bin/env python3
"""Recordings of moving arms by MuJoCo whose hidden physics is known, as folders for `pipelines/dynamics`.

  pip install mujoco numpy
  mujoco_torques.py DIR [--seed 1] [--cases 60]
  mujoco_torque_marks.py DIR --calib BINARY

Three arms (5, 6 and 7 turning joints), 100 to 500 Hz, sums of sines and moves from point to point, steps of the encoders, noise of the
currents. Each folder has robot.json and recording.csv (what a user has) and want.json (what MuJoCo's model has besides, L of the hidden cause
and the names that data cannot tell from it). Every joint has MuJoCo's damping and dry friction; one further cause is hidden in four of five
recordings.

Of four recordings two have MuJoCo's `frictionloss` as a model has it by default: a soft constraint whose torque is -loss * clip((a + b v) /
(R loss)), with b = 2 / (0.95 * 0.02 s) by solref and solimp. It turns as the sign of v + a / b does: 9.5 ms before the velocity, and over a
width of R loss / b of its own at each joint. In one of these the arm is simulated forward: a controller of positions (8 Hz, damping 0.8,
torques of the rigid arm, none against friction) drives it 1000 times a second, joints stick at rest and where they turn, and the torque
commanded in a step is logged with the position at its beginning. In all others torques are those of mj_inverse along the planned motion, and
in two of four dry friction is a gear's, that turns with the velocity alone.
"""

import argparse
import json
from pathlib import Path

import mujoco
import numpy as np
from mujoco_visible import STEP, visible

Z, Y, X = [0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]
# Axes, points (m) and masses (kg) of the links.
ARMS = {
    "mujoco5": ([Z, Y, Y, Y, X], [[0, 0, 0.1], [0.05, 0, 0.35], [0.05, 0, 0.8], [0.45, 0, 0.85], [0.6, 0, 0.85]], [18, 14, 9, 4, 1.5]),
    "mujoco6": ([Z, Y, Y, X, Y, X], [[0, 0, 0.2], [0.15, 0, 0.5], [0.15, 0, 1.1], [0.4, 0, 1.2], [0.8, 0, 1.2], [0.95, 0, 1.2]],
                [60, 45, 30, 14, 7, 2.5]),
    "mujoco7": ([Z, Y, Z, Y, Z, Y, X], [[0, 0, 0.15], [0, 0, 0.34], [0, 0, 0.55], [0, 0, 0.74], [0, 0, 0.95], [0, 0, 1.14], [0.08, 0, 1.14]],
                [5, 5, 4, 4, 3, 2.5, 1]),
}
CAUSES = ["rotor_inertia", "cable_stiffness", "link_mass", "link_com", "payload_error", "gravity_direction", "contact", "torque_constant",
          "current_offset", "current_latency", "torque_ripple", "warmup_friction"]
FINE = 500  # Hz of the motion.
SUBSTEPS = 2  # Of the forward simulation in a step of the motion.
PACE = 2 * np.pi * 8  # rad/s, of the controller.


def rod(mass, span):
    length = max(np.linalg.norm(span), 0.08)
    along = span / max(np.linalg.norm(span), 1e-9)
    radius = 0.2 * length + 0.03
    axial, lateral = 0.5 * mass * radius**2, mass * (length**2 / 12 + radius**2 / 4)
    return lateral * np.eye(3) + (axial - lateral) * np.outer(along, along)


def six(m):
    return [m[0, 0], m[0, 1], m[0, 2], m[1, 1], m[1, 2], m[2, 2]]


def declared(name, rng):
    axes, points, masses = ARMS[name]
    points = np.array(points, float)
    tool = points[-1] + np.array(axes[-1]) * 0.12
    ends = np.vstack([points[1:], tool])
    centres = 0.55 * points + 0.45 * ends + rng.uniform(-0.02, 0.02, points.shape)
    inertia = [rod(m, e - p) for m, p, e in zip(masses, points, ends)]
    payload = round(masses[-1] * rng.uniform(1.0, 3.0), 1)
    return {"axes": axes, "points": points, "masses": np.array(masses, float), "centres": centres, "inertia": inertia, "tool": tool,
            "payload": payload, "payload_centre": tool + np.array([0.03, 0.02, 0.05]), "payload_inertia": 0.004 * payload * np.eye(3),
            "gravity": np.array([0, 0, -9.81])}


def number(like, value):
    return [value] + [0.0] * (len(like) - 1) if np.ndim(like) else value


def model_of(arm, damping, loss, armature, stiffness, springref):
    spec = mujoco.MjSpec()
    spec.compiler.degree = False
    spec.option.gravity = arm["gravity"]
    spec.option.timestep = 1.0 / FINE
    body, before = spec.worldbody, np.zeros(3)
    for k, axis in enumerate(arm["axes"]):
        point = arm["points"][k]
        body = body.add_body(name=f"link{k}", pos=point - before)
        before = point
        mass, centre, inertia = arm["masses"][k], arm["centres"][k], arm["inertia"][k]
        if k + 1 == len(arm["axes"]):
            # The payload is one body with the last link.
            whole = mass + arm["payload"]
            middle = (mass * centre + arm["payload"] * arm["payload_centre"]) / whole
            both = np.zeros((3, 3))
            for m, c, i in [(mass, centre, inertia), (arm["payload"], arm["payload_centre"], arm["payload_inertia"])]:
                r = c - middle
                both += i + m * (r @ r * np.eye(3) - np.outer(r, r))
            mass, centre, inertia = whole, middle, both
        m = six(inertia)
        body.mass, body.ipos, body.explicitinertial = mass, centre - point, True
        body.fullinertia = [m[0], m[3], m[5], m[1], m[2], m[4]]
        joint = body.add_joint(type=mujoco.mjtJoint.mjJNT_HINGE, axis=axis)
        joint.armature, joint.springref, joint.frictionloss = armature[k], springref, loss[k]
        # Polynomials since MuJoCo 4.
        joint.damping = number(joint.damping, damping[k])
        joint.stiffness = number(joint.stiffness, stiffness[k])
    return spec.compile()


def smooth(x):
    x = np.clip(x, 0, 1)
    return x**3 * (10 + x * (6 * x - 15))


def sines(rng, n, duration):
    t = np.arange(0, duration, 1 / FINE)
    gate = smooth(t) * smooth(duration - t)
    q = np.zeros((len(t), n))
    for j in range(n):
        for k in (1, 2, 3, 5):
            q[:, j] += rng.uniform(0.3, 1) / k * np.sin(2 * np.pi * k / duration * rng.uniform(0.9, 1.1) * 1.6 * t + rng.uniform(0, 6.2))
        q[:, j] *= rng.uniform(0.6, 1.0) / np.abs(q[:, j]).max()
    return rng.uniform(-0.3, 0.3, n) + gate[:, None] * q


def moves(rng, n, duration):
    t = np.arange(0, duration, 1 / FINE)
    q, start, now = np.zeros((len(t), n)), 0.4, rng.uniform(-1, 1, n)
    q[:] = now
    while start < duration:
        to = rng.uniform(-1, 1, n)
        takes = max(1.9 * np.abs(to - now).max() / rng.uniform(0.6, 1.5), 0.6)
        q = np.where(t[:, None] >= start, now + smooth((t - start) / takes)[:, None] * (to - now), q)
        start, now = start + takes + rng.uniform(0.3, 0.6), to
    return q


def hidden(cause, arm, rng, peak):
    """What the real arm has: a changed arm, and numbers of MuJoCo's joints and of the recording."""
    n = len(arm["axes"])
    real = {k: (np.array(v) if isinstance(v, list) else v) for k, v in arm.items()}
    real["masses"], real["centres"], real["inertia"] = arm["masses"].copy(), arm["centres"].copy(), [i.copy() for i in arm["inertia"]]
    told = {"armature": np.zeros(n), "stiffness": np.zeros(n), "springref": 0.0}
    joint, link, sign = int(rng.integers(n)), int(rng.integers(1, n - 1)), rng.choice([-1, 1])
    place = f"joint {joint + 1}"
    if cause == "rotor_inertia":
        told["armature"][joint] = peak[joint] * rng.uniform(0.02, 0.05)
    elif cause == "cable_stiffness":
        told["stiffness"][joint], told["springref"] = peak[joint] * rng.uniform(0.06, 0.15), rng.uniform(-1, 1)
    elif cause == "link_mass":
        share = sign * rng.uniform(0.1, 0.2)
        real["masses"][link] *= 1 + share
        real["inertia"][link] *= 1 + share
        place = f"link {link + 1}"
    elif cause == "link_com":
        step = rng.normal(size=3)
        real["centres"][link] += rng.uniform(0.03, 0.06) * step / np.linalg.norm(step)
        place = f"link {link + 1}"
    elif cause == "payload_error":
        share = sign * rng.uniform(0.15, 0.4)
        real["payload"] *= 1 + share
        real["payload_inertia"] = real["payload_inertia"] * (1 + share)
        told["mass"], place = float(real["payload"] - arm["payload"]), "tool"
    elif cause == "gravity_direction":
        tilt, about = np.radians(rng.uniform(1.2, 3)), rng.uniform(0, 6.2)
        real["gravity"] = 9.81 * np.array([np.sin(tilt) * np.cos(about), np.sin(tilt) * np.sin(about), -np.cos(tilt)])
        place = "base"
    elif cause == "contact":
        force = rng.normal(size=3)
        told["force"] = 0.15 * peak.max() * force / np.linalg.norm(force) / np.linalg.norm(arm["tool"])
        told["start"] = rng.uniform(3, 9)
        told["end"], place = told["start"] + rng.uniform(0.9, 1.6), "arm"
    elif cause == "torque_constant":
        told["gain"] = sign * rng.uniform(0.08, 0.15)
    elif cause == "current_offset":
        told["offset"] = sign * peak[joint] * rng.uniform(0.05, 0.1)
    elif cause == "current_latency":
        told["late"], place = rng.integers(4, 11) / FINE, "recording"
    elif cause == "torque_ripple":
        told["ripple"] = (peak[joint] * rng.uniform(0.03, 0.06), int(rng.integers(2, 7)), rng.uniform(0, 6.2))
    elif cause == "warmup_friction":
        told["warm"] = (rng.uniform(0.5, 1.0), rng.uniform(6, 12))
    told["joint"], told["place"] = joint, place
    return real, told


def rows_of(q, step):
    v = np.gradient(q, step, axis=0)
    return q, v, np.gradient(v, step, axis=0)


def torques(model, arm, motion, told, begin, friction):
    """Torques of a motion: of the bodies, damping and dry friction, of what is hidden, of the drives."""
    q, v, a = motion
    data = mujoco.MjData(model)
    out, dry, last = np.zeros_like(q), np.zeros_like(q), model.nbody - 1
    joint, t = told["joint"], begin + np.arange(len(q)) / FINE
    for row in range(len(q)):
        data.qpos[:], data.qvel[:], data.qacc[:] = q[row], v[row], a[row]
        mujoco.mj_inverse(model, data)
        out[row], dry[row] = data.qfrc_inverse, -data.qfrc_constraint
        if "force" in told and told["start"] < t[row] < told["end"]:
            push = told["force"] * np.sin(np.pi * (t[row] - told["start"]) / (told["end"] - told["start"]))
            at = data.xpos[last] + data.xmat[last].reshape(3, 3) @ (arm["tool"] - arm["points"][-1])
            jac = np.zeros((3, q.shape[1]))
            mujoco.mj_jac(model, data, jac, None, at, last)
            out[row] -= jac.T @ push
    if not model.dof_frictionloss.any():
        dry = friction[1] * np.tanh(v / 0.01)
        out += dry
    if "warm" in told:
        share, lasts = told["warm"]
        out[:, joint] += share * np.exp(-t / lasts) * (friction[0][joint] * v[:, joint] + dry[:, joint])
    return logged(out, q, told)


def driven(model, arm, motion, told, begin, friction):
    """Torques that a controller commands, and where the arm then is."""
    q, v, a = motion
    model.opt.timestep = 1 / (FINE * SUBSTEPS)
    data, joint, last = mujoco.MjData(model), told["joint"], model.nbody - 1
    data.qpos[:], data.qvel[:] = q[0], v[0]
    out, where, mass, loss = np.zeros_like(q), np.zeros_like(q), np.zeros((model.nv, model.nv)), model.dof_frictionloss.copy()
    jac = np.zeros((3, model.nv))
    for step in range(len(q) * SUBSTEPS):
        row, share = divmod(step, SUBSTEPS)
        now, after = [part[row] for part in motion], [part[min(row + 1, len(q) - 1)] for part in motion]
        aim, speed, pull = [one + (other - one) * share / SUBSTEPS for one, other in zip(now, after)]
        time = begin + step * model.opt.timestep
        mujoco.mj_forward(model, data)
        mujoco.mj_fullM(model, data, mass)
        wanted = pull + PACE**2 * (aim - data.qpos) + 1.6 * PACE * (speed - data.qvel)
        command = mass @ wanted + data.qfrc_bias
        if share == 0:
            out[row], where[row] = command, data.qpos
        data.qfrc_applied[:] = command
        if "warm" in told:
            more = told["warm"][0] * np.exp(-time / told["warm"][1])
            model.dof_frictionloss[joint] = (1 + more) * loss[joint]
            data.qfrc_applied[joint] -= more * friction[0][joint] * data.qvel[joint]
        if "force" in told and told["start"] < time < told["end"]:
            at = data.xpos[last] + data.xmat[last].reshape(3, 3) @ (arm["tool"] - arm["points"][-1])
            mujoco.mj_jac(model, data, jac, None, at, last)
            data.qfrc_applied += jac.T @ told["force"] * np.sin(np.pi * (time - told["start"]) / (told["end"] - told["start"]))
        mujoco.mj_step(model, data)
    return where, logged(out, where, told)


def logged(out, q, told):
    """Torques as the drives log them."""
    joint = told["joint"]
    if "ripple" in told:
        size, order, phase = told["ripple"]
        out[:, joint] += size * np.sin(order * q[:, joint] + phase)
    out[:, joint] *= 1 + told.get("gain", 0.0)
    out[:, joint] += told.get("offset", 0.0)
    shift = int(round(told.get("late", 0.0) * FINE))
    return np.vstack([np.repeat(out[:1], shift, axis=0), out[: len(out) - shift]]) if shift else out


def case(folder, number, seed):
    rng = np.random.default_rng([seed, number])
    name = list(ARMS)[(number + number // 15) % 3]
    arm = declared(name, rng)
    n, rate = len(arm["axes"]), int(rng.choice([100, 125, 200, 250, 500]))
    nothing, soft = np.zeros(n), number % 4 < 2
    motions = [sines(rng, n, 16), moves(rng, n, 12), sines(rng, n, 10), moves(rng, n, 8)]
    motions = [rows_of(q, 1 / FINE) for q in motions]
    bare = model_of(arm, nothing, nothing, nothing, nothing, 0.0)
    peak = np.abs(torques(bare, arm, [part[::10] for part in motions[0]], {"joint": 0}, 0.0, (nothing, nothing))).max(axis=0)
    peak = np.maximum(peak, 0.02 * peak.max())
    cause = CAUSES[(number - number // 5 - 1) % len(CAUSES)] if number % 5 else None
    real, told = hidden(cause, arm, rng, peak)
    scatter = lambda sigma, shape: sigma * np.clip(rng.normal(size=shape), -2, 2)
    mass, centre = 1 + scatter(0.01, n), scatter(0.004, (n, 3))
    friction = (peak * rng.uniform(0.04, 0.1, n), peak * rng.uniform(0.05, 0.12, n))

    def built(own, beside):
        """MuJoCo's model of an arm, with what no user knows of it."""
        own = {**own, "masses": own["masses"] * mass, "centres": own["centres"] + centre}
        loss = friction[1] if soft else nothing
        return model_of(own, friction[0], loss, beside.get("armature", nothing), beside.get("stiffness", nothing), beside.get("springref", 0.0))

    begins = np.cumsum([0.0] + [len(q) / FINE + 2.0 for q, _, _ in motions])

    def clean(own, beside, by, count):
        """What `by` makes of motions, without noise."""
        return [by(built(own, beside), own, motion, beside, begin, friction) for motion, begin in zip(motions[:count], begins)]

    if number % 4 == 1:
        places, torque = zip(*clean(real, told, driven, 4))
    else:
        places, torque = [q for q, _, _ in motions], clean(real, told, torques, 4)
    ratio, constant = np.full(n, 100.0), np.maximum(peak / 100.0 / 8.0, 1e-3)
    encoder, every = 360.0 / 2**18, FINE // rate
    noise = 0.02 * peak
    lines = ["time_s,traj,use," + ",".join(f"q{j + 1}_deg" for j in range(n)) + "," + ",".join(f"i{j + 1}_a" for j in range(n))]
    begin = 0.0
    for stretch, q in enumerate(places):
        for row in range(0, len(q), every):
            angle = np.round(np.degrees(q[row]) / encoder) * encoder
            current = (torque[stretch][row] + noise * rng.normal(size=n)) / (ratio * constant)
            cells = [f"{begin + row / FINE:.4f}", str(stretch + 1), "fit" if stretch < 2 else "validate"]
            lines.append(",".join(cells + [f"{x:.5f}" for x in angle] + [f"{np.round(x / 0.002) * 0.002:.3f}" for x in current]))
        begin += len(q) / FINE + 2.0
    mm = lambda p: [round(1e3 * float(x), 4) for x in p]
    robot = {"name": name, "axes": arm["axes"], "points": [mm(p) for p in arm["points"]], "tool": mm(arm["tool"]),
             "mass": [float(m) for m in arm["masses"]], "com": [mm(c) for c in arm["centres"]], "inertia": [six(i) for i in arm["inertia"]],
             "ratio": [float(r) for r in ratio], "kt": [float(k) for k in constant], "payload": float(arm["payload"]),
             "payload_com": mm(arm["payload_centre"] - arm["tool"]), "payload_inertia": six(arm["payload_inertia"]),
             "gravity": [float(g) for g in arm["gravity"]], "coupling": [],
             "inertia_tolerance": {"mass_rel": 0.01, "com_mm": 4.0, "inertia_rel": 0.05}}
    effects = [{"effect": f, "where": f"joint {j + 1}", "hidden": False} for j in range(n) for f in ("viscous_friction", "coulomb_friction")]
    if cause:
        numbers = {k: (np.array(v).tolist()) for k, v in told.items() if k in ("start", "end", "mass", "gain", "offset", "late")}
        with_it = clean(real, told, torques, 2)
        effect = np.vstack(with_it) - np.vstack(clean(arm, {"joint": told["joint"]}, torques, 2))
        fitted = [np.vstack([motion[k] for motion in motions[:2]]) for k in range(3)]
        seen = visible(effect, np.vstack(with_it), fitted, arm, noise / np.sqrt(STEP * rate / FINE), lambda own: model_of(own, *4 * [nothing], 0.0))
        effects.insert(0, {"effect": cause, "where": told["place"], "hidden": True, **seen, **numbers})
    where = folder / f"mujoco_{number:03}"
    where.mkdir(parents=True, exist_ok=True)
    (where / "robot.json").write_text(json.dumps(robot, indent=1) + "\n")
    (where / "recording.csv").write_text("\n".join(lines) + "\n")
    (where / "want.json").write_text(json.dumps({"rate": rate, "friction": ["frictionloss", "frictionloss, driven", "gear", "gear"][number % 4], "effects": effects}, indent=1) + "\n")


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("folder", type=Path)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--cases", type=int, default=60)
    told = parser.parse_args()
    for number in range(told.cases):
        case(told.folder, number, told.seed)


main()
