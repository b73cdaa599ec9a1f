"""Exports in the programs that they are for: kinematics, gravity, friction at three speeds, inertia, in MuJoCo and Pinocchio.

The truth is Pinocchio's, by a description of its own; the command is named by CALIB.
"""

import os
import pathlib
import subprocess

import numpy as np
import pytest

mujoco = pytest.importorskip("mujoco")
pinocchio = pytest.importorskip("pinocchio")

CALIB = os.environ.get("CALIB", "calib")
COULOMB = np.array([6.0, 8.0, 5.0, 2.0, 1.8, 1.2])
VISCOUS = np.array([8.0, 9.7, 6.0, 2.0, 2.0, 1.5])
# Offsets, axes, and mass, centre and inertia (diagonal) of an arm with light wrists.
JOINTS = [
    ("0 0 0.2", "0 0 1", 7.4, "0 -0.02 0.1", (0.03, 0.03, 0.02)),
    ("0 0 0.1", "0 1 0", 13.0, "0 0.1 0.3", (0.4, 0.42, 0.06)),
    ("0 0 0.6", "0 1 0", 4.0, "0.25 0.04 0", (0.01, 0.11, 0.105)),
    ("0.3 0 0", "1 0 0", 2.1, "0.1 0 0.02", (0.002, 0.004, 0.004)),
    ("0.27 0 0", "0 1 0", 2.0, "0.05 0.02 0", (0.002, 0.004, 0.004)),
    ("0.1 0 0", "1 0 0", 0.6, "0.06 0.01 0", (0.0006, 0.0004, 0.0004)),
]


def urdf() -> str:
    out, parent = ['<robot name="arm"><link name="base_link"/>'], "base_link"
    for k, (place, axis, mass, centre, (x, y, z)) in enumerate(JOINTS, 1):
        inertia = f'<inertia ixx="{x}" ixy="0" ixz="0" iyy="{y}" iyz="0" izz="{z}"/>'
        body = f'<inertial><origin xyz="{centre}"/><mass value="{mass}"/>{inertia}</inertial>'
        out.append(
            f'<link name="arm_{k}">{body}</link><joint name="A{k}" type="revolute"><parent link="{parent}"/>'
            f'<child link="arm_{k}"/><origin xyz="{place}"/><axis xyz="{axis}"/>'
            '<limit lower="-3" upper="3" effort="150" velocity="3"/></joint>'
        )
        parent = f"arm_{k}"
    out.append(f'<link name="tool0"/><joint name="t" type="fixed"><parent link="{parent}"/>')
    return "".join(out) + '<child link="tool0"/><origin xyz="0.1 0 0"/></joint></robot>'


PIPELINE = """
calib: 1
name: torques
seed: 1
stages:
  - uses: robot
    with: {file: robot.yaml, urdf: arm.urdf}
  - uses: ingest_torques
    with:
      files:
        - file: log.csv
          columns:
            time: {column: t, unit: s}
            q: {column: 'q{j}', unit: rad}
            torque: {column: 'tau{j}', unit: Nm}
  - uses: diagnose_torques
"""
ROBOT = "calib_robot: 1\nname: arm\nunits: {length: mm, angle: deg}\nkinematics:\n  urdf: {base: base_link, tip: tool0}\ntool: {point: [0, 0, 0]}\n"


def motion(t: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    q, dq, ddq = (np.zeros((len(t), 6)) for _ in range(3))
    rng = np.random.default_rng(4)
    for j in range(6):
        for k in range(1, 5):
            w, phase, size = 2 * np.pi * 0.1 * k, rng.uniform(0, 2 * np.pi), rng.uniform(0.2, 0.5)
            q[:, j] += size * np.sin(w * t + phase)
            dq[:, j] += size * w * np.cos(w * t + phase)
            ddq[:, j] -= size * w * w * np.sin(w * t + phase)
    return q, dq, ddq


@pytest.fixture(scope="module")
def arm(tmp_path_factory: pytest.TempPathFactory) -> tuple[pathlib.Path, object]:
    here = tmp_path_factory.mktemp("exports")
    truth = pinocchio.buildModelFromXML(urdf())
    data = truth.createData()
    t = np.arange(0, 20, 0.01)
    q, dq, ddq = motion(t)
    rows = zip(q, dq, ddq, strict=True)
    tau = np.array([pinocchio.rnea(truth, data, *row) for row in rows])
    tau += COULOMB * np.sign(dq) + VISCOUS * dq
    tau += np.random.default_rng(5).normal(size=tau.shape) * 0.05
    head = ",".join(["t", *(f"q{j}" for j in range(1, 7)), *(f"tau{j}" for j in range(1, 7))])
    table = np.column_stack([t, q, tau])
    np.savetxt(here / "log.csv", table, delimiter=",", header=head, comments="", fmt="%.9g")
    (here / "arm.urdf").write_text(urdf())
    (here / "robot.yaml").write_text(ROBOT)
    (here / "pipeline.yaml").write_text(PIPELINE)
    for words in (["run", "pipeline.yaml"], *(["export", "latest", "--format", f, "--out", f"out.{f}"] for f in ("mjcf", "urdf"))):
        done = subprocess.run([CALIB, *words, "--quiet"], cwd=here, capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
    return here, truth


POSTURES = [np.array(q) for q in ([0, 0.3, 0.4, -0.5, 0.6, 0.2], [1, -0.6, 0.9, 1.2, -0.9, -1], np.zeros(6))]


def test_mujoco_has_kinematics_gravity_inertia_and_friction_at_three_speeds(arm) -> None:
    here, truth = arm
    data = truth.createData()
    tool = truth.getFrameId("tool0")
    model = mujoco.MjModel.from_xml_path(str(here / "out.mjcf"))
    state = mujoco.MjData(model)
    for q in POSTURES:
        state.qpos[:], state.qvel[:] = q, 0
        mujoco.mj_forward(model, state)
        pinocchio.framesForwardKinematics(truth, data, q)
        assert np.allclose(state.site("tool0").xpos, data.oMf[tool].translation, atol=1e-9)
        gravity = pinocchio.computeGeneralizedGravity(truth, data, q)
        assert np.abs(state.qfrc_bias - gravity).max() < 0.5
        inertia = np.zeros((6, 6))
        mujoco.mj_fullM(model, state, inertia) if mujoco.__version__ >= "4" else mujoco.mj_fullM(model, inertia, state.qM)
        wanted = pinocchio.crba(truth, data, q)
        assert np.abs(np.diag(inertia) - np.diag(wanted)).max() < 0.1
        for speed in (0.05, 0.2, 1.0):
            for j in range(6):
                both = []
                for sign in (1, -1):
                    state.qpos[:], state.qvel[:], state.qacc[:] = q, 0, 0
                    state.qvel[j] = sign * speed
                    mujoco.mj_inverse(model, state)
                    both.append(state.qfrc_inverse[j])
                friction = (both[0] - both[1]) / 2
                wanted = COULOMB[j] + VISCOUS[j] * speed
                assert abs(friction - wanted) < 0.1 * wanted, (j, speed, friction, wanted)


def test_pinocchio_reads_the_urdf_with_kinematics_gravity_inertia_and_no_body_that_has_none(arm) -> None:
    here, truth = arm
    data = truth.createData()
    model = pinocchio.buildModelFromUrdf(str(here / "out.urdf"))
    state = model.createData()
    assert [model.existFrame(name) for name in ("arm_3", "tool0", "measured_point")] == [True] * 3
    assert np.allclose(model.upperEffortLimit if hasattr(model, "upperEffortLimit") else model.effortLimit, 150)
    mass = sum(body.mass for body in model.inertias)
    assert abs(mass - sum(joint[2] for joint in JOINTS)) < 0.3 + JOINTS[0][2]
    for q in POSTURES:
        pinocchio.framesForwardKinematics(truth, data, q)
        pinocchio.framesForwardKinematics(model, state, q)
        pairs = ((truth, data, "tool0"), (model, state, "tool0"))
        places = [d.oMf[m.getFrameId(name)].translation for m, d, name in pairs]
        assert np.allclose(*places, atol=1e-9)
        gravity = [pinocchio.computeGeneralizedGravity(m, d, q) for m, d in ((truth, data), (model, state))]
        assert np.abs(gravity[0] - gravity[1]).max() < 0.5
        inertia = [np.diag(pinocchio.crba(m, d, q)) for m, d in ((truth, data), (model, state))]
        assert np.abs(inertia[0] - inertia[1]).max() < 0.1
