"""Commands rolled out in MuJoCo with what calib exports of a diagnosis of drives: its MJCF, with or without its Python."""

import types

import mujoco
import numpy as np

# As calib begins a trajectory: s of rest, steps of the encoder and standard deviations that are rest; s and rows by which a speed is told.
REST, STEPS_AT_REST, SIGMAS_AT_REST = 0.4, 2.5, 8
GLANCE, LOOKS = 0.06, 5
# Rows that may be missing between two.
GAP = 12


def refilled(time, command, period):
    """Times, commands and commanded speeds with the rows put back that are missing, by the cubic through their neighbours."""
    times, values, counts = [time[0]], [command[0]], [1]
    last = len(time) - 1
    for row in range(1, len(time)):
        gap = int(round((time[row] - time[row - 1]) / period))
        if 1 < gap < GAP:
            p, a, b, c = (command[np.clip(k, 0, last)] for k in range(row - 2, row + 2))
            m, k = 0.5 * (b - p), 0.5 * (c - a)
            for t in np.arange(1, gap) / gap:
                times.append(time[row - 1] + t * (time[row] - time[row - 1]))
                values.append(a * (2 * t**3 - 3 * t**2 + 1) + m * (t**3 - 2 * t**2 + t) + b * (3 * t**2 - 2 * t**3) + k * (t**3 - t**2))
                counts.append(1)
            gap = 1
        times.append(time[row])
        values.append(command[row])
        counts.append(max(gap, 1))
    values = np.array(values)
    speed = np.zeros_like(values)
    speed[1:] = np.diff(values, axis=0) / (np.array(counts)[1:, None] * period)
    return np.array(times), values, speed


def begun(time, angle, joints):
    """Angles and speeds where a trajectory begins."""
    since = time - time[0]
    rest = angle[since < REST]
    start, speed = rest.mean(0), np.zeros(len(joints))
    rows = max(int((since < GLANCE).sum()), LOOKS)
    for j, joint in enumerate(joints):
        still = STEPS_AT_REST * joint["encoder_rad"] + SIGMAS_AT_REST * joint.get("noise_rad", 0)
        if np.ptp(rest[:, j]) > still:
            _, speed[j], start[j] = np.polyfit(since[:rows], angle[:rows, j], 2)
    return start, speed


def controller(text):
    """The control of an exported Python file."""
    module = types.ModuleType("control")
    exec(compile(text, "control.py", "exec"), module.__dict__)
    return module.Control


def rolled_out(text, drives, trajectories, control=None):
    """Simulated angles of trajectories (time, commands, measured angles) of one recording, one after the other, at the rows' times; `text` is
    the MJCF, `control` its Python."""
    model = mujoco.MjModel.from_xml_string(text)
    joints, period, step = drives["joints"], 1 / drives["command_rate_hz"], model.opt.timestep
    names = [joint["joint"] for joint in joints]
    number = lambda kind, name: mujoco.mj_name2id(model, kind, name)
    joint = [number(mujoco.mjtObj.mjOBJ_JOINT, name) for name in names]
    where, dofs = model.jnt_qposadr[joint], model.jnt_dofadr[joint]
    servo = [number(mujoco.mjtObj.mjOBJ_ACTUATOR, name) for name in names]
    rate = np.array([number(mujoco.mjtObj.mjOBJ_ACTUATOR, f"{name}_speed") for name in names])
    rates = rate >= 0
    state = mujoco.MjData(model)
    control = controller(control)(model) if control else None
    first, all_angles = trajectories[0][0][0], []
    for time, command, measured in trajectories:
        at, command, speed = refilled(time, command, period)
        start, begins = begun(time, measured, joints)

        def send(k):
            if control:
                control.send(state, command[k], speed[k])
            else:
                state.ctrl[servo] = command[k]
                state.ctrl[rate[rates]] = speed[k][rates]

        def put(speeds):
            state.qpos[where], state.qvel[dofs] = start, speeds

        if control:
            state.qvel[:] = 0
            put(0 * begins)
            control.begin(state, time[0] - first)
            state.qvel[dofs] = begins
        else:
            # Delayed controls are those of the rest; the joints are held meanwhile, gears settle.
            for _ in range(int(0.3 / step)):
                send(0)
                mujoco.mj_step(model, state)
                put(begins if _ + 1 == int(0.3 / step) else 0 * begins)
        seen = (lambda: control.angles(state)) if control else (lambda: state.qpos[where].copy())
        steps = int(np.ceil((time[-1] - time[0]) / step)) + 1
        sent = np.maximum(np.searchsorted(at, time[0] + step * (np.arange(steps) + 0.5), side="right") - 1, 0)
        angles = [seen()]
        for k in sent:
            send(k)
            mujoco.mj_step(model, state)
            angles.append(seen())
        angles = np.array(angles)
        times = time[0] + step * np.arange(len(angles))
        all_angles.append(np.stack([np.interp(time, times, column) for column in angles.T], 1))
    return all_angles
