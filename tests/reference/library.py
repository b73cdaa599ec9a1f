"""The library of arms against public models and published reaches, for tests/it/library_of_arms.rs.

    python3 -m venv venv && venv/bin/pip install numpy pyyaml && venv/bin/python tests/reference/library.py

Reads src/**/robot/library/*.yaml by kinematics of its own, and library/chains.json: joint origins (x y z roll pitch yaw, axis) of
public models, with the source of each; numbers alone, m and rad. Compares the flange at 100 poses drawn over a turn each way, works out the
reach, writes library/poses.json (4 poses of each public model, and the differences) and prints the table.
"""
import json
import pathlib

import numpy as np
import yaml

HERE = pathlib.Path(__file__).parent
FILES = sorted((HERE / "../../src").resolve().rglob("library/*.yaml"))
CHAINS = json.loads((HERE / "library/chains.json").read_text())


def turn(axis, angle):
    x, y, z = np.asarray(axis, float) / np.linalg.norm(axis)
    k = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * k + (1 - np.cos(angle)) * k @ k


def pose(rotation, point):
    out = np.eye(4)
    out[:3, :3], out[:3, 3] = rotation, point
    return out


def frame(x, y, z, roll, pitch, yaw):
    return pose(turn((0, 0, 1), yaw) @ turn((0, 1, 0), pitch) @ turn((1, 0, 0), roll), (x, y, z))


def public(chain, q):
    at = np.linalg.inv(frame(*chain["base"]))
    for row, angle in zip(chain["joints"], q):
        at = at @ frame(*row[:6]) @ pose(turn(row[6:], angle), (0, 0, 0))
    return at @ frame(*chain["tip"])


def ours(file, q):
    """Flange and the points of the joints' frames, m."""
    kind, rows = next(iter(file["kinematics"].items()))
    angles, tool = np.radians, file["tool"]
    rpy = angles(tool.get("orientation", {}).get("rpy", [0, 0, 0]))
    tip = frame(*(np.array(tool["point"]) / 1e3), *rpy)
    at, points = np.eye(4), []
    if kind == "screws":
        for row, angle in zip(rows, q):
            point = np.array(row["point"]) / 1e3
            points.append(at @ np.append(point, 1))
            at = at @ pose(np.eye(3), point) @ pose(turn(row["axis"], angle), (0, 0, 0)) @ pose(np.eye(3), -point)
        return at @ tip, points
    for row, angle in zip(rows, q):
        about_z = pose(turn((0, 0, 1), angle + angles(row.get("theta", 0))), (0, 0, row["d"] / 1e3))
        about_x = pose(turn((1, 0, 0), angles(row["alpha"])), (row["a"] / 1e3, 0, 0))
        points.append((at if kind == "dh" else at @ about_x) @ (0, 0, 0, 1))
        at = at @ (about_z @ about_x if kind == "dh" else about_x @ about_z)
    return at @ tip, points


def reach(file):
    """mm: the farthest that the wrist gets from axis 1, or the flange from joint 2, whichever the file's comment names; within the ranges."""
    text = file["text"].split("reach:")[1].split("\n")[0]
    joints = len(next(iter(file["kinematics"].values())))
    grid = [np.linspace(-170, 170, 171) if not j.get("limits") else np.linspace(*j["limits"], 171) for j in file["joints"]]
    best = 0.0

    def measure(q):
        tip, points = ours(file, q)
        if "axis 1 to the wrist" in text:
            return np.hypot(*points[4][:2])
        if "axis 1 to the flange" in text:
            return np.hypot(*tip[:2, 3])
        if "plane of the arm" in text:
            return np.linalg.norm((points[5] - points[1])[[0, 2]])
        if "axis 2 to axis 6" in text:
            return np.linalg.norm(points[5][:3] - points[1][:3])
        return np.linalg.norm(tip[:3, 3] - points[1][:3])

    bends = [2] if joints == 6 else [3]
    upright = [1]
    q, step = np.zeros(joints), None
    for _ in range(6):
        for k in upright + bends + ([4] if joints == 6 else [5]):
            values = grid[k] if step is None else np.clip(q[k] * 180 / np.pi + np.linspace(-step, step, 41), grid[k][0], grid[k][-1])
            if step is None and k == 1:
                pairs = [(measure(np.where(np.arange(joints) == 1, np.radians(a), np.where(np.arange(joints) == bends[0], np.radians(b), 0.0))), a, b)
                         for a in grid[1][::5] for b in grid[bends[0]][::5]]
                _, a, b = max(pairs)
                q[1], q[bends[0]] = np.radians(a), np.radians(b)
                continue
            scores = []
            for value in values:
                q[k] = np.radians(value)
                scores.append((measure(q), q[k]))
            best, q[k] = max(scores)
        step = 10.0 if step is None else step / 4
    return 1e3 * best


def main():
    random, out = np.random.default_rng(32), {}
    print(f"{'arm':18}{'reach':>8}{'published':>10}{'mm at 100 poses':>17}{'deg':>9}  public model")
    for path in FILES:
        text = path.read_text()
        file = yaml.safe_load(text) | {"text": text}
        name, chain = path.stem, CHAINS.get(path.stem)
        here, published = reach(file), file["about"]["reach"]
        out[name] = {"reach_mm": round(here, 1), "published_mm": published}
        if chain is None:
            print(f"{name:18}{here:8.1f}{published:10}{'-':>17}{'-':>9}  none")
            continue
        poses, apart, turned = [], 0.0, 0.0
        for k in range(100):
            q = np.round(random.uniform(-np.pi, np.pi, len(chain["joints"])), 6)
            a, b = public(chain, q), ours(file, q)[0]
            apart = max(apart, 1e3 * np.linalg.norm(a[:3, 3] - b[:3, 3]))
            twist = a[:3, :3].T @ b[:3, :3]
            turned = max(turned, np.degrees(np.arctan2(np.linalg.norm([twist[2, 1] - twist[1, 2], twist[0, 2] - twist[2, 0], twist[1, 0] - twist[0, 1]]), np.trace(twist) - 1)))
            if k < 4:
                poses.append({"q_rad": list(q), "point_mm": [round(x, 6) for x in 1e3 * a[:3, 3]]})
        out[name] |= {"source": chain["source"], "largest_mm": round(apart, 4), "largest_deg": round(turned, 4), "poses": poses}
        print(f"{name:18}{here:8.1f}{published:10}{apart:17.4f}{turned:9.4f}  {chain['source']}")
    (HERE / "library/poses.json").write_text(json.dumps(out, indent=1) + "\n")


main()
