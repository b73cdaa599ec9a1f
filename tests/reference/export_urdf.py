"""Loads an exported URDF in Pinocchio and MuJoCo and compares the tool with the exported screws at 1,000 poses.

    calib export MODEL --format json --out model.json
    calib export MODEL --format urdf --out model.urdf
    python export_urdf.py model.json model.urdf

Needs numpy, pin and mujoco. Prints the largest distance of each in mm; fails above 1e-6 mm.
"""

import json
import sys

import mujoco
import numpy as np
import pinocchio


def turn(axis, angle):
    cross = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross


def tool(model, q):
    point = np.array(model["tool"]["point_m"])
    for joint, value in reversed(list(zip(model["joints"], q))):
        axis, on = np.array(joint["axis"]), np.array(joint["point_m"])
        point = point + axis * value if joint["kind"] == "prismatic" else on + turn(axis, value) @ (point - on)
    return point


def with_inertia(text):
    """MuJoCo wants a mass on every moving body; ours leave it out where it is not known."""
    import xml.etree.ElementTree as tree

    root = tree.fromstring(text)
    for link in root.iter("link"):
        if link.find("inertial") is None:
            inertial = tree.SubElement(link, "inertial")
            tree.SubElement(inertial, "mass", value="1")
            tree.SubElement(inertial, "inertia", ixx="1", ixy="0", ixz="0", iyy="1", iyz="0", izz="1")
    # Else MuJoCo melts the fixed tool into the last link.
    options = tree.SubElement(root, "mujoco")
    tree.SubElement(options, "compiler", fusestatic="false")
    return tree.tostring(root, encoding="unicode")


def main(model_file, urdf_file):
    model = json.load(open(model_file))
    limits = [joint["limits"] or [-1.0, 1.0] for joint in model["joints"]]
    poses = np.random.default_rng(1).uniform(*np.array(limits).T, size=(1000, len(limits)))
    ours = np.array([tool(model, q) for q in poses])

    pin = pinocchio.buildModelFromUrdf(urdf_file)
    data, frame = pin.createData(), pin.getFrameId("tool0")
    theirs = []
    for q in poses:
        pinocchio.framesForwardKinematics(pin, data, q)
        theirs.append(data.oMf[frame].translation.copy())
    by_pinocchio = np.linalg.norm(ours - theirs, axis=1).max() * 1e3

    sim = mujoco.MjModel.from_xml_string(with_inertia(open(urdf_file).read()))
    state, body = mujoco.MjData(sim), mujoco.mj_name2id(sim, mujoco.mjtObj.mjOBJ_BODY, "tool0")
    theirs = []
    for q in poses:
        state.qpos[:] = q
        mujoco.mj_kinematics(sim, state)
        theirs.append(state.xpos[body].copy())
    by_mujoco = np.linalg.norm(ours - theirs, axis=1).max() * 1e3

    print(f"1000 poses: Pinocchio {by_pinocchio:.1e} mm, MuJoCo {by_mujoco:.1e} mm at most")
    return 0 if max(by_pinocchio, by_mujoco) <= 1e-6 else 1


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
