"""Loads an exported MJCF in MuJoCo and compares the site `tool0` with the exported screws at 1,000 poses.

    calib export MODEL --format json --out model.json
    calib export MODEL --format mjcf --out model.xml
    python export_mjcf.py model.json model.xml

Needs numpy and mujoco. Prints the largest distance in mm; fails above 1e-6 mm.
"""

import json
import sys

import mujoco
import numpy as np


def turn(axis, angle):
    cross = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross


def tool(model, q):
    point = np.array(model["tool"]["point_m"])
    for joint, value in reversed(list(zip(model["joints"], q))):
        axis, on = np.array(joint["axis"]), np.array(joint["point_m"])
        point = point + axis * value if joint["kind"] == "prismatic" else on + turn(axis, value) @ (point - on)
    return point


model = json.load(open(sys.argv[1]))
loaded = mujoco.MjModel.from_xml_path(sys.argv[2])
state = mujoco.MjData(loaded)
draw = np.random.default_rng(1)
apart = 0.0
for _ in range(1000):
    q = draw.uniform(-2, 2, loaded.nq)
    state.qpos[:] = q
    mujoco.mj_forward(loaded, state)
    apart = max(apart, 1e3 * np.linalg.norm(state.site("tool0").xpos - tool(model, q)))
print(f"MuJoCo {mujoco.__version__}: {apart:.1e} mm")
sys.exit(apart > 1e-6)
