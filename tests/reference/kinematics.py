"""Forward kinematics and link masses of four arms by Pinocchio, for tests/it/robot.rs.

    python3 -m venv venv && venv/bin/pip install pin && venv/bin/python tests/reference/kinematics.py

Writes kinematics/NAME.urdf and kinematics/NAME.json. The URDFs are made from the arms' axes with link frames turned and
shifted anyhow, a fixed joint in the middle of each chain and a bracket hung on a link, so that an importer has to do all of it.
Lengths m, angles rad; `centre` in the base frame at the zero pose; `rotation` row-major.
"""
import json
import pathlib

import numpy as np
import pinocchio as pin

HERE = pathlib.Path(__file__).parent / "kinematics"
R, P = "revolute", "prismatic"
X, Y, Z = np.eye(3)

UR10 = [(R, Z, (0, 0, 0)), (R, -Y, (0, 0, 127.3)), (R, -Y, (-612, 0, 127.3)), (R, -Y, (-1184.3, 0, 127.3)),
        (R, -Z, (-1184.3, -163.941, 127.3)), (R, -Y, (-1184.3, -163.941, 11.6))]
UP = np.array((0, 0, 500.0))
ARMS = {
    # name: joints (kind, axis, point in mm), tool point in mm, tool axes as columns
    "ur10": (UR10, (-1184.3, -256.141, 11.6), np.array([X, Z, -Y]).T),
    "spherical": ([(R, Z, (0, 0, 0)), (R, -Y, (312, 0, 0)), (R, -Y, (312, 0, 1075)), (R, X, (0, 0, 1310)),
                   (R, -Y, (1594, 0, 1310)), (R, X, (0, 0, 1310))], (1884, -20, 1320), np.array([Z, -Y, X]).T),
    "seven": ([(R, Z, (0, 0, 0)), (R, Y, (0, 0, 340)), (R, Z, (0, 0, 340)), (R, -Y, (0, 0, 740)), (R, Z, (0, 0, 740)),
               (R, Y, (0, 0, 1140)), (R, Z, (0, 0, 1140))], (70, 30, 1300), np.eye(3)),
    "track": ([(P, X, (0, 0, 300))] + [(k, a, UP + p) for k, a, p in UR10], UP + (-1184.3, -256.141, 11.6),
              np.array([X, Z, -Y]).T),
}


def pose(rotation, point):
    out = np.eye(4)
    out[:3, :3], out[:3, 3] = rotation, point
    return out


def origin(parent, child):
    relative = np.linalg.inv(parent) @ child
    numbers = lambda values: " ".join(f"{x:.17g}" for x in values)
    return f'<origin xyz="{numbers(relative[:3, 3])}" rpy="{numbers(pin.rpy.matrixToRpy(relative[:3, :3]))}"/>'


def urdf(name, joints, tool, tool_axes, random):
    lines = [f'<?xml version="1.0"?>', f'<robot name="{name}">', '  <link name="world_base"/>']

    def link(label, mass=None):
        if mass is None:
            lines.append(f'  <link name="{label}"/>')
            return
        centre = " ".join(f"{x:.3f}" for x in random.uniform(-0.2, 0.2, 3))
        lines.append(f'  <link name="{label}"><inertial><origin xyz="{centre}" rpy="0 0 0"/><mass value="{mass:.2f}"/>'
                     '<inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>')

    def joint(label, kind, parent, child, at, axis="", limit=""):
        lines.append(f'  <joint name="{label}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>{at}{axis}{limit}</joint>')

    parent, frame = "world_base", np.eye(4)
    for i, (kind, axis, point) in enumerate(joints):
        turn = pin.rpy.rpyToMatrix(random.uniform(-3, 3, 3))
        here = pose(turn, np.array(point) / 1e3 + axis * random.uniform(-0.3, 0.3))
        link(f"link{i + 1}", random.uniform(1, 50))
        local = " ".join(f"{x:.17g}" for x in turn.T @ axis)
        low, high = (-3.1, 3.1) if kind == R else (0, 3)
        joint(f"joint{i + 1}", kind, parent, f"link{i + 1}", origin(frame, here), f'<axis xyz="{local}"/>',
              f'<limit lower="{low}" upper="{high}" effort="1" velocity="1"/>')
        parent, frame = f"link{i + 1}", here
        if i == 2:
            turned = here @ pose(pin.rpy.rpyToMatrix(0.4, -0.7, 1.1), (0.1, 0.2, -0.3))
            link("adapter", 3)
            joint("adapter_fixed", "fixed", parent, "adapter", origin(here, turned))
            parent, frame = "adapter", turned
        if i == 4:
            link("bracket", 7)
            joint("bracket_fixed", "fixed", parent, "bracket", origin(np.eye(4), pose(np.eye(3), (0.05, -0.1, 0.2))))
    link("tool0")
    joint("tool_fixed", "fixed", parent, "tool0", origin(frame, pose(tool_axes, np.array(tool) / 1e3)))
    return "\n".join(lines + ["</robot>", ""])


def main():
    for seed, (name, (joints, tool, tool_axes)) in enumerate(ARMS.items()):
        random = np.random.default_rng(20200116 + seed)
        text = urdf(name, joints, tool, tool_axes, random)
        (HERE / f"{name}.urdf").write_text(text)
        model = pin.buildModelFromXML(text)
        data, tip = model.createData(), model.getFrameId("tool0")
        rows = []
        for _ in range(12):
            q = np.array([random.uniform(-3.1, 3.1) if kind == R else random.uniform(0, 3) for kind, _, _ in joints])
            pin.framesForwardKinematics(model, data, q)
            at = data.oMf[tip]
            rows.append({"q": q.tolist(), "position": at.translation.tolist(), "rotation": at.rotation.tolist()})
        pin.forwardKinematics(model, data, np.zeros(model.nq))
        bodies = [{"mass": model.inertias[i].mass, "centre": data.oMi[i].act(model.inertias[i].lever).tolist()}
                  for i in range(1, model.njoints)]
        out = {"program": f"pinocchio {pin.__version__}", "poses": rows, "bodies": bodies}
        lines = json.dumps(out).replace('{"q"', '\n {"q"').replace('{"mass"', '\n {"mass"').replace(', "bodies"', ',\n"bodies"')
        (HERE / f"{name}.json").write_text(lines + "\n")


main()
