#!/usr/bin/env python3
"""Records the example of pipelines/drives: MuJoCo itself simulates the arm, with causes that robot.xml and drives.json do not have.

    pip install mujoco numpy
    python3 tests/reference/drives_example.py [--folder pipelines/drives/example]

Runge and Kutta's steps of 0.25 ms, stiff dry friction: another integrator than calib's. What is concealed stands in truth.json.
"""
import argparse
import json
import pathlib

import mujoco
import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[2]
REST = 0.5
FRICTION = ("lift", 0.22)
DELAY_S = 0.015


def motion(kind, t, draw):
    """Commands of three joints that begin and end at rest at home."""
    home, end = np.array([0.0, 0.3, 0.6]), t[-1]
    reach = np.array([0.6, 0.45, 0.5])
    envelope = np.clip((t - REST) / 0.8, 0, 1) * np.clip((end - REST - t) / 0.8, 0, 1)
    if kind == "sines":
        waves = [(draw.uniform(0.15, 1.6, 4), draw.uniform(0, 2 * np.pi, 4), draw.uniform(0.3, 1.0, 4)) for _ in range(3)]
        curves = [sum(a * np.sin(2 * np.pi * f * (t - REST) + p) for f, p, a in zip(*wave)) / wave[2].sum() * 1.4 for wave in waves]
        return home + envelope[:, None] * reach * np.array(curves).T
    if kind == "chirp":
        phase = 2 * np.pi * (0.2 * (t - REST) + 0.5 * 0.5 * (t - REST) ** 2)
        return home + envelope[:, None] * reach * 0.5 * np.array([np.sin(phase), np.sin(phase + 2), np.sin(0.8 * phase + 4)]).T
    # From point to point with rests, half cosines.
    out, at, k = np.repeat(home[None], len(t), 0), home, int(REST * 100)
    while k + 200 < len(t):
        goal = home if k + 330 >= len(t) else home + reach * draw.uniform(-1, 1, 3)
        steps = 75
        share = 0.5 - 0.5 * np.cos(np.pi * np.arange(steps) / steps)
        out[k : k + steps] = at + share[:, None] * (goal - at)
        out[k + steps :] = goal
        at, k = goal, k + steps + 45
    return out


def model(folder, drives):
    text = (folder / "robot.xml").read_text().replace('timestep="0.0005"', 'timestep="0.00025"')
    lines = [
        f'<general joint="{d["joint"]}" gainprm="{d["kp"]}" biastype="affine" biasprm="0 -{d["kp"]} -{d["kd"]}"'
        f' forcelimited="true" forcerange="-{d["torque_limit_nm"]} {d["torque_limit_nm"]}"/>'
        for d in drives["joints"]
    ]
    arm = mujoco.MjModel.from_xml_string(text.replace("</mujoco>", f"<actuator>{''.join(lines)}</actuator></mujoco>"))
    joint = mujoco.mj_name2id(arm, mujoco.mjtObj.mjOBJ_JOINT, FRICTION[0])
    arm.dof_frictionloss[joint] += FRICTION[1]
    # The true arm is another one of the series: its masses are within their tolerance.
    arm.body_mass[1:] *= 1 + drives["inertia_tolerance"]["mass_rel"] * np.array([0.6, -0.8, 0.5])
    return arm


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--folder", type=pathlib.Path, default=ROOT / "pipelines/drives/example")
    folder = parser.parse_args().folder
    drives, draw = json.loads((folder / "drives.json").read_text()), np.random.default_rng(7)
    arm, rate = model(folder, drives), drives["command_rate_hz"]
    names = [d["joint"] for d in drives["joints"]]
    rows = ["time_s,traj,use," + ",".join([f"cmd{j}_rad" for j in (1, 2, 3)] + [f"q{j}_rad" for j in (1, 2, 3)])]
    begin = 0.0
    kinds = [("sines", "fit", 4.5), ("chirp", "fit", 4), ("sines", "fit", 4.5), ("points", "validate", 5)]
    for number, (kind, use, seconds) in enumerate(kinds, 1):
        t = np.arange(int(seconds * rate)) / rate
        command = motion(kind, t, draw).round(5)
        state, step = mujoco.MjData(arm), arm.opt.timestep
        state.qpos[:] = command[0]
        sent = lambda time: command[np.clip(int(np.floor((time - DELAY_S) * rate + 1e-6)), 0, len(t) - 1)]
        # Before the first row the arm has held its pose for 2 s.
        for _ in range(int(2 / step)):
            state.ctrl[:] = command[0]
            mujoco.mj_step(arm, state)
        begun = state.time
        for row, time in enumerate(t):
            while state.time - begun < time - 0.5 * step:
                state.ctrl[:] = sent(state.time - begun + 0.5 * step)
                mujoco.mj_step(arm, state)
            noisy = [state.qpos[j] + draw.normal(0, d["noise_rad"]) for j, d in enumerate(drives["joints"])]
            counted = [round(q / d["encoder_rad"]) * d["encoder_rad"] for q, d in zip(noisy, drives["joints"])]
            cells = [f"{begin + time:.2f}", str(number), use, *(f"{c:.5f}" for c in command[row]), *(f"{q:.5f}" for q in counted)]
            rows.append(",".join(cells))
        begin += seconds + 1
    (folder / "recording.csv").write_text("\n".join(rows) + "\n")
    effects = [
        {"effect": "coulomb_friction", "where": f"joint {names.index(FRICTION[0]) + 1}", "c_nm": FRICTION[1]},
        {"effect": "command_delay", "where": "arm", "delay_s": DELAY_S},
    ]
    (folder / "truth.json").write_text(json.dumps({"effects": effects}, indent=1) + "\n")


if __name__ == "__main__":
    main()
