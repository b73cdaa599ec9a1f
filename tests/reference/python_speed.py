"""calib in Python: predictions a second against the command, and the same identification against pybotics.

    pip install WHEEL pybotics && python tests/reference/python_speed.py

A UR10 whose lengths, twists and zeros are off by 0.5 mm and 0.5 mrad is measured in 200 poses with 0.02 mm of noise; a quarter is held out.
pybotics fits the same table of Denavit-Hartenberg by scipy's least squares, which moves the parameters that it is given: all of the arm's,
with base and tool.
"""

import contextlib
import inspect
import time

import calib
import numpy as np

HALF = np.pi / 2
# theta rad, d mm, a mm, alpha rad.
UR10 = np.array([[0, 127.3, 0, HALF], [0, 0, -612, 0], [0, 0, -572.3, 0], [0, 163.941, 0, HALF], [0, 115.7, 0, -HALF], [0, 92.2, 0, 0]])
TOOL = np.array([40.0, 25.0, 80.0])
NOISE = 0.02


def measured(poses: int = 200) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Joints, points in the frame of a tracker, and which rows are held out; written here, with neither library."""
    draw = np.random.default_rng(5)
    table = UR10 + np.column_stack([draw.normal(0, 5e-4, 6), *draw.normal(0, 0.5, (2, 6)), draw.normal(0, 5e-4, 6)])
    joints = draw.uniform(-2.5, 2.5, (poses, 6))
    turn = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    points = []
    for q in joints:
        pose = np.eye(4)
        for (theta, d, a, alpha), angle in zip(table, q):
            c, s, ca, sa = np.cos(theta + angle), np.sin(theta + angle), np.cos(alpha), np.sin(alpha)
            pose = pose @ np.array([[c, -s * ca, s * sa, a * c], [s, c * ca, -c * sa, a * s], [0, sa, ca, d], [0, 0, 0, 1.0]])
        points.append(turn @ (pose[:3, :3] @ TOOL + pose[:3, 3]) + [2000, -300, 150])
    return joints, np.array(points) + draw.normal(0, NOISE, (poses, 3)), np.arange(poses) % 4 == 3


def with_calib(joints, points, held_out):
    robot = calib.Robot.from_dh(UR10, tool_mm=TOOL)
    settings = {"effects": ["base_frame", "tool_offset", "joint_offset", "link_geometry"]}
    model = robot.identify(joints, points, NOISE, held_out=held_out, settings=settings)
    return model.predict(joints)


def with_pybotics(joints, points, held_out):
    from pybotics.geometry import vector_2_matrix
    from pybotics.kinematic_chain import MDHKinematicChain
    from pybotics.robot import Robot
    from pybotics.tool import Tool
    from scipy.optimize import least_squares

    # Craig's table of the same arm: a row takes a and alpha of the row before it.
    mdh = np.column_stack([np.r_[0, UR10[:-1, 3]], np.r_[0, UR10[:-1, 2]], UR10[:, 0], UR10[:, 1]])
    start = np.concatenate([mdh.ravel(), TOOL, [2000, -300, 150, 0, 0, HALF]])

    def predicted(x, rows):
        robot = Robot(MDHKinematicChain.from_parameters(x[:24].reshape(6, 4)), tool=Tool())
        robot.tool.position = x[24:27]
        robot.world_frame = vector_2_matrix(x[27:])
        return np.array([robot.fk(q)[:3, 3] for q in joints[rows]])

    fit = np.flatnonzero(~held_out)
    found = least_squares(lambda x: (predicted(x, fit) - points[fit]).ravel(), start, x_scale="jac")
    return predicted(found.x, np.arange(len(joints)))


def rate(model: calib.Model, rows: int = 1_000_000) -> None:
    """Predictions of many poses, and the part that only takes them from numpy: an array of another shape, which is refused."""
    joints = np.random.default_rng(1).uniform(-2.5, 2.5, (rows, 6))
    model.predict(joints[:1000])
    seconds, taken = [], []
    for _ in range(3):
        begun = time.perf_counter()
        model.predict(joints)
        seconds.append(time.perf_counter() - begun)
        begun = time.perf_counter()
        with contextlib.suppress(ValueError):
            model.predict(joints.reshape(-1, 3))
        taken.append(time.perf_counter() - begun)
    print(f"predict: {rows} poses in {min(seconds):.2f} s, {min(taken):.2f} s of it to take the array")


def main() -> None:
    joints, points, held_out = measured()
    print(f"{'':10}  lines  seconds  held-out mean mm  max mm")
    for name, solve in (("calib", with_calib), ("pybotics", with_pybotics)):
        lines = sum(bool(line.strip()) and not line.strip().startswith("#") for line in inspect.getsource(solve).splitlines())
        begun = time.perf_counter()
        try:
            predicted = solve(joints, points, held_out)
        except ImportError as error:
            print(f"{name:10}  {error}")
            continue
        seconds = time.perf_counter() - begun
        error = np.linalg.norm(predicted - points, axis=1)[held_out]
        print(f"{name:10}  {lines:5}  {seconds:7.2f}  {error.mean():16.4f}  {error.max():6.4f}")
    robot = calib.Robot.from_dh(UR10, tool_mm=TOOL)
    rate(robot.identify(joints, points, NOISE))


if __name__ == "__main__":
    main()
