#!/usr/bin/env python3
"""Every export opened by its consumer: the tool at 1,000 poses is where the exported JSON has it.

    pip install numpy pin mujoco yourdfpy xacro drake
    python3 tests/reference/exports.py --calib target/release/calib

A UR10e by its description (frames as in ur_description: z along each joint, base_link turned by half a turn, flange and tool0 at the end) is
simulated with errors, identified and exported. URDF is read by Pinocchio and yourdfpy, MJCF by MuJoCo, SDFormat by Drake; the xacro include by
xacro, in a copy of the description in which only the `<origin/>` of joints changed, and then by yourdfpy: whatever is not an origin is as it was.
ur_kinematics is put into the joints as ur_macro.xacro does it, and read by Pinocchio. Fails beyond 1e-9 mm.
"""
import argparse, json, pathlib, re, subprocess, tempfile, xml.etree.ElementTree as tree
from importlib.metadata import version
import mujoco, numpy as np, pinocchio, xacro, yaml, yourdfpy

JOINTS = ["shoulder_pan_joint", "shoulder_lift_joint", "elbow_joint", "wrist_1_joint", "wrist_2_joint", "wrist_3_joint"]
LINKS = ["shoulder", "upper_arm", "forearm", "wrist_1", "wrist_2", "wrist_3"]
HALF = np.pi / 2
# config/ur10e/default_kinematics.yaml
NOMINAL = [([0, 0, 0.1807], [0, 0, 0]), ([0, 0, 0], [HALF, 0, 0]), ([-0.6127, 0, 0], [0, 0, 0]), ([-0.57155, 0, 0.17415], [0, 0, 0]),
           ([0, -0.11985, 0], [HALF, 0, 0]), ([0, 0.11655, 0], [HALF, np.pi, np.pi])]
TOOL = [0.04, 0.03, 0.12]
PIPELINE = """calib: 1
name: exports
seed: 3
stages:
  - uses: robot
    with: {file: robot.yaml, urdf: arm.urdf}
  - uses: simulate
    with:
      truth: {offset_deg: [0.02, -0.05, 0.04, 0.03, -0.06, 0.0], links: [{link: 2, shift_mm: [0.4, 0.2, -0.3], tilt_arcsec: [40, 20, 60]}]}
      poses: {floor_mm: 100, clearance_mm: 200}
      blocks: [{usage: fit, points: 60}, {usage: validate, points: 20}]
  - uses: split
    with: {by: usage}
  - uses: identify
    with: {on: [fit]}
  - uses: validate
  - uses: report
    with: {identity: {robot serial: "20225500123"}}
"""


def numbers(values):
    return " ".join(repr(float(value)) for value in values)


def description(origins):
    """The arm as its maker describes it, with these origins of the joints."""
    text = '<robot name="ur10e">\n  <link name="base_link"/>\n  <link name="base_link_inertia"/>\n'
    text += f'  <joint name="fixed" type="fixed"><parent link="base_link"/><child link="base_link_inertia"/><origin xyz="0 0 0" rpy="0 0 {np.pi!r}"/></joint>\n'
    parent = "base_link_inertia"
    for joint, link, (xyz, rpy) in zip(JOINTS, LINKS, origins):
        text += f'  <link name="{link}_link"><inertial><origin xyz="0.01 0.02 0.03"/><mass value="3.5"/><inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial></link>\n'
        text += f'  <joint name="{joint}" type="revolute"><parent link="{parent}"/><child link="{link}_link"/><origin xyz="{numbers(xyz)}" rpy="{numbers(rpy)}"/><axis xyz="0 0 1"/><limit lower="-6.28" upper="6.28" effort="330" velocity="2.1"/></joint>\n'
        parent = f"{link}_link"
    text += '  <link name="flange"/>\n  <link name="tool0"/>\n'
    text += f'  <joint name="to_flange" type="fixed"><parent link="{parent}"/><child link="flange"/><origin xyz="0 0 0" rpy="0 {-HALF!r} {-HALF!r}"/></joint>\n'
    text += f'  <joint name="to_tool0" type="fixed"><parent link="flange"/><child link="tool0"/><origin xyz="0 0 0" rpy="{HALF!r} 0 {HALF!r}"/></joint>\n'
    return text + "</robot>\n"


def turn(axis, angle):
    cross = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross


def expected(model, q):
    point = np.array(model["tool"]["point_m"])
    for joint, angle in reversed(list(zip(model["joints"], q))):
        axis, on = np.array(joint["axis"]), np.array(joint["point_m"])
        point = on + turn(axis, angle) @ (point - on)
    return point


def in_tool0(text):
    """Where the remarks of a file put the measured point, m."""
    return np.array([float(x) for x in re.search(r"stands at (\S+) (\S+) (\S+) m", text).groups()])


def by_pinocchio(text, poses, frame, tool):
    model = pinocchio.buildModelFromXML(text)
    data, frame = model.createData(), model.getFrameId(frame)
    for q in poses:
        pinocchio.framesForwardKinematics(model, data, q)
        yield data.oMf[frame].act(tool)


def by_yourdfpy(path, poses, frame, tool):
    arm = yourdfpy.URDF.load(str(path), load_meshes=False, build_scene_graph=True)
    for q in poses:
        arm.update_cfg(q)
        yield (arm.get_transform(frame, "base_link") @ np.append(tool, 1.0))[:3]


def by_mujoco(path, poses):
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    for q in poses:
        data.qpos[:] = q
        mujoco.mj_forward(model, data)
        yield data.site("tool0").xpos.copy()


def by_drake(path, poses):
    from pydrake.multibody.parsing import Parser
    from pydrake.multibody.plant import MultibodyPlant

    plant = MultibodyPlant(0.0)
    Parser(plant).AddModels(str(path))
    plant.Finalize()
    context, frame = plant.CreateDefaultContext(), plant.GetFrameByName("tool0")
    for q in poses:
        plant.SetPositions(context, q)
        yield plant.CalcRelativeTransform(context, plant.world_frame(), frame).translation()


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--calib", required=True, type=pathlib.Path)
    calib = str(parser.parse_args().calib.resolve())
    worst = 0.0
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        (folder / "arm.urdf").write_text(description(NOMINAL))
        (folder / "robot.yaml").write_text(f"calib_robot: 1\nname: UR10e\nunits: {{length: m, angle: rad}}\nkinematics:\n  urdf: {{base: base_link, tip: tool0}}\ntool: {{point: {TOOL}}}\n")
        (folder / "p.yaml").write_text(PIPELINE)
        subprocess.run([calib, "run", "p.yaml", "--quiet"], cwd=folder, check=True, stdout=subprocess.DEVNULL)
        files = {format: folder / f"arm_{format}.{ending}" for format, ending in
                 [("json", "json"), ("urdf", "urdf"), ("mjcf", "xml"), ("sdf", "sdf"), ("xacro", "xacro"), ("ur_kinematics", "yaml")]}
        for format, path in files.items():
            subprocess.run([calib, "export", "latest", "--format", format, "--out", path, "--quiet"], cwd=folder, check=True)
            subprocess.run([calib, "check-export", path, "--against", "latest"], cwd=folder, check=True, stdout=subprocess.DEVNULL)
        model = json.loads(files["json"].read_text())
        poses = np.random.default_rng(1).uniform(-3, 3, size=(1000, 6))
        ours = np.array([expected(model, q) for q in poses])

        def compare(what, theirs):
            nonlocal worst
            apart = 1e3 * np.linalg.norm(ours - np.array(list(theirs)), axis=1).max()
            worst = max(worst, apart)
            print(f"{what:32} {apart:.1e} mm")

        none = np.zeros(3)
        compare(f"urdf, Pinocchio {pinocchio.__version__}", by_pinocchio(files["urdf"].read_text(), poses, "tool0", none))
        compare(f"urdf, yourdfpy {version('yourdfpy')}", by_yourdfpy(files["urdf"], poses, "tool0", none))
        compare(f"mjcf, MuJoCo {mujoco.__version__}", by_mujoco(files["mjcf"], poses))
        compare(f"sdf, Drake {version('drake')}", by_drake(files["sdf"], poses))
        # As ur_macro.xacro puts them into the joints.
        text = files["ur_kinematics"].read_text()
        read = yaml.safe_load(text)["kinematics"]
        origins = [([read[link][k] for k in "xyz"], [read[link][k] for k in ("roll", "pitch", "yaw")]) for link in LINKS]
        compare("ur_kinematics, Pinocchio", by_pinocchio(description(origins), poses, "tool0", in_tool0(text)))
        # The user's own file with the include: origins of moving joints are asked for, all else stays.
        own = description(NOMINAL)
        asked = own.replace('<robot name="ur10e">', f'<robot name="ur10e" xmlns:xacro="http://www.ros.org/wiki/xacro">\n<xacro:include filename="{files["xacro"]}"/>')
        for joint in JOINTS:
            asked = re.sub(rf'(name="{joint}".*?)<origin [^/]*/>', rf'\1<xacro:calib_origin joint="{joint}"/>', asked)
        (folder / "own.xacro").write_text(asked)
        expanded = xacro.process_file(str(folder / "own.xacro")).toprettyxml(indent="  ")
        (folder / "own.urdf").write_text(expanded)
        compare(f"xacro {version('xacro')}, yourdfpy", by_yourdfpy(folder / "own.urdf", poses, "wrist_3_link", in_tool0(files["xacro"].read_text())))
        plain = lambda text: [(node.tag, sorted(node.attrib.items())) for node in tree.fromstring(text).iter() if node.tag != "origin"]
        assert plain(expanded) == plain(own), "the include changed more than origins"
        for format in ("urdf", "mjcf", "sdf"):
            assert 'effort="0"' not in files[format].read_text()
    assert worst <= 1e-9, worst


main()
