"""What every rival in rivals.py starts from: a recording, its rigid arm identified by least squares, and what may move its tool.

Screws at the zero pose, mm and rad. The arm is a chain of stations: 0 the base, k the body that joint k moves; every station has a
constant small twist (geometry), every joint a ratio. Shares no code with calib and none with its twin.
"""
import csv
import json
import pathlib

import numpy as np

GRAVITY = np.array([0.0, 0.0, -9.81])


def hat(v):
    out = np.zeros((*v.shape[:-1], 3, 3))
    out[..., 0, 1], out[..., 0, 2], out[..., 1, 2] = -v[..., 2], v[..., 1], -v[..., 0]
    return out - np.swapaxes(out, -1, -2)


def motion(twist):
    """The exponential of twists (..., 6): rotation and translation."""
    v, w = twist[..., :3], twist[..., 3:]
    angle = np.linalg.norm(w, axis=-1)[..., None, None]
    turn, safe = hat(w), np.where(angle < 1e-2, 1.0, angle)
    series = lambda exact, *c: np.where(angle < 1e-2, c[0] + c[1] * angle**2 + c[2] * angle**4, exact)
    a = series(np.sin(safe) / safe, 1, -1 / 6, 1 / 120)
    b = series((1 - np.cos(safe)) / safe**2, 1 / 2, -1 / 24, 1 / 720)
    c = series((safe - np.sin(safe)) / safe**3, 1 / 6, -1 / 120, 1 / 5040)
    eye = np.eye(3)
    return eye + a * turn + b * turn @ turn, ((eye + b * turn + c * turn @ turn) @ v[..., None])[..., 0]


def turning(point, w):
    """A small turn w about a point of the zero pose, as a twist."""
    return np.concatenate([np.cross(np.broadcast_to(point, w.shape), w), w], -1)


def read(path):
    with open(path, newline="") as file:
        rows = list(csv.DictReader(file))
    return {key: [row[key] for row in rows] for key in rows[0]}


class Recording:
    """The columns of a folder with robot.json, controller.csv and tracker.csv; angles rad, lengths mm."""

    def __init__(self, folder):
        folder = pathlib.Path(folder)
        robot = json.loads((folder / "robot.json").read_text())
        told, seen = read(folder / "controller.csv"), read(folder / "tracker.csv")
        at = {name: i for i, name in enumerate(seen["point_id"])}
        rows = [i for i, name in enumerate(told["point_id"]) if name in at]
        number = lambda key: np.array([float(told[key][i]) for i in rows])
        self.axes = np.array(robot["axes"], float)
        self.points, self.tool = np.array(robot["points"], float), np.array(robot["tool"], float)
        self.screws = np.hstack([np.cross(self.points, self.axes), self.axes])
        self.n, self.count = len(self.axes), len(rows)
        self.mass = np.array(robot.get("mass") or np.zeros(self.n))
        self.centre = np.array(robot.get("com") or self.points)
        self.payload_centre = self.tool + np.array(robot.get("payload_com", [0, 0, 0]), float)
        self.gear = np.array(robot["ratio"]) if robot.get("ratio") else None
        self.coupling = [tuple(pair) for pair in robot.get("coupling", [])]
        self.q = np.radians(np.stack([number(f"q{j + 1}_deg") for j in range(self.n)], -1))
        self.seen = np.array([[float(seen[key][at[told["point_id"][i]]]) for key in ("x_mm", "y_mm", "z_mm")] for i in rows])
        self.time = number("time_s") if "time_s" in told else np.arange(self.count) * 25.0
        self.warm = number("temp_c") if "temp_c" in told else None
        self.payload = number("payload_kg") if "payload_kg" in told else np.zeros(self.count)
        self.held = np.array([told["use"][i] == "validate" for i in rows])
        self.move = np.diff(self.q, axis=0, prepend=self.q[:1])
        if "dir1" in told:
            self.direction = np.stack([number(f"dir{j + 1}") for j in range(self.n)], -1)
        else:
            self.direction = np.sign(self.move)
            for i in range(1, self.count):
                self.direction[i] = np.where(self.direction[i] == 0, self.direction[i - 1], self.direction[i])
        again = (np.abs(self.move).max(1) < 1e-9) & (np.diff(self.payload, prepend=np.nan) == 0)
        self.pose = np.cumsum(~again)
        self.again = again


class Rigid:
    """The nominal arm with identified base, geometry, ratios and couplings; rows grossly off are left out of the fit."""

    def __init__(self, recording):
        c = self.c = recording
        self.twists, self.ratio, self.pull = np.zeros((c.n + 1, 6)), np.zeros(c.n), np.zeros(len(c.coupling))
        self.fit = ~c.held
        self.sigma = (0.010 + 0.0025e-3 * np.linalg.norm(c.seen, axis=1)) / 2
        self.place_base()
        self.solve(5)
        for _ in range(2):
            error = np.linalg.norm(self.residual, axis=1)
            gross = self.fit & (error > max(8 * np.median(error[self.fit]), 0.05))
            if not 0 < gross.sum() <= 0.06 * self.fit.sum():
                break
            self.fit &= ~gross
            self.solve(4)
        self.weigh()
        self.solve(3)
        self.loads()

    def place_base(self):
        self.base = (np.eye(3), np.zeros(3))
        here, fit = self.chain()[0], self.fit
        for _ in range(3):
            a, b = here[fit].mean(0), self.c.seen[fit].mean(0)
            u, _, v = np.linalg.svd((here[fit] - a).T @ (self.c.seen[fit] - b))
            turn = v.T @ np.diag([1, 1, np.sign(np.linalg.det(v.T @ u.T))]) @ u.T
            self.base = (turn, b - turn @ a)
            error = np.linalg.norm(here @ turn.T + self.base[1] - self.c.seen, axis=1)
            fit = self.fit & (error < 4 * np.median(error[self.fit]))

    def chain(self):
        """Tool points, and what a twist of each station (in its zero-pose axes) does to them."""
        c = self.c
        turned = c.q * (1 + self.ratio)
        for (moved, by), pull in zip(c.coupling, self.pull):
            turned[:, moved] += pull * c.q[:, by]
        r, p, frames = np.broadcast_to(self.base[0], (c.count, 3, 3)), np.broadcast_to(self.base[1], (c.count, 3)), []
        for k in range(c.n + 1):
            frames.append((r, p))
            for twist in [self.twists[k]] + ([c.screws[k] * turned[:, k:k + 1]] if k < c.n else []):
                turn, shift = motion(twist)
                p, r = p + (r @ shift[..., None])[..., 0], r @ turn
        tip = p + r @ c.tool
        reach = [(np.swapaxes(r, 1, 2) @ (tip - p)[..., None])[..., 0] for r, p in frames]
        return tip, [r @ np.concatenate([np.broadcast_to(np.eye(3), r.shape), -hat(x)], -1) for (r, _), x in zip(frames, reach)]

    def solve(self, steps):
        c = self.c
        for step in range(steps + 1):
            tip, self.stations = self.chain()
            self.tip, self.residual = tip, c.seen - tip
            self.joints = [self.stations[k + 1] @ c.screws[k] for k in range(c.n)]
            columns = self.stations + [(self.joints[k] * c.q[:, k:k + 1])[..., None] for k in range(c.n)]
            columns += [(self.joints[moved] * c.q[:, by:by + 1])[..., None] for moved, by in c.coupling]
            self.geometry = np.concatenate(columns, -1)
            if step == steps:
                break
            a = (self.geometry[self.fit] / self.sigma[self.fit, None, None]).reshape(-1, self.geometry.shape[-1])
            # 10 mm and 10 mrad of each number: too wide to be felt, but what no recording can show stays small.
            now = np.concatenate([self.twists.ravel(), self.ratio, self.pull])
            prior = np.concatenate([np.tile(np.repeat([0.1, 100.0], 3), c.n + 1), np.full(len(now) - 6 * c.n - 6, 100.0)])
            size = np.sqrt((a**2).sum(0) + prior**2)
            both = np.vstack([a, np.diag(prior)]) / size
            left = np.concatenate([(self.residual[self.fit] / self.sigma[self.fit, None]).ravel(), -prior * now])
            x = np.linalg.lstsq(both, left, rcond=1e-12)[0] / size
            self.twists += x[:6 * c.n + 6].reshape(-1, 6)
            self.ratio += x[6 * c.n + 6:7 * c.n + 6]
            self.pull += x[7 * c.n + 6:]

    def weigh(self):
        """Whitens by the tracker's noise and the joints' repeatability, which points measured twice tell."""
        c = self.c
        i = np.where(c.again & self.fit & np.roll(self.fit, 1))[0]
        spread = sum(j[:, :, None] * j[:, None] for j in self.joints)
        between = c.seen[i] - c.seen[i - 1]
        more = ((between**2).sum(1) / 2 - 3 * self.sigma[i]**2).mean() / np.trace(spread[i], axis1=1, axis2=2).mean() if len(i) > 3 else 0
        cover = self.sigma[:, None, None]**2 * np.eye(3) + max(more, 0) * spread
        self.white = np.linalg.inv(np.linalg.cholesky(cover))

    def loads(self):
        """Torque on each joint (Nm) and the moment about any point of the zero pose, in the base's axes."""
        c = self.c
        r, p, self.frames = np.broadcast_to(np.eye(3), (c.count, 3, 3)), np.zeros((c.count, 3)), []
        for k in range(c.n):
            self.frames.append((r, p))
            turn, shift = motion(c.screws[k] * c.q[:, k:k + 1])
            p, r = p + (r @ shift[..., None])[..., 0], r @ turn
        self.frames.append((r, p))
        at = lambda k, x: self.frames[k][1] + self.frames[k][0] @ x
        self.bodies = [(k + 1, np.full(c.count, c.mass[k]), at(k + 1, c.centre[k])) for k in range(c.n)]
        self.carried = (c.n, c.payload, at(c.n, c.payload_centre))
        along = [self.frames[k][0] @ c.axes[k] for k in range(c.n)]
        self.torque = np.stack([(self.moment(k + 1, c.points[k]) * along[k]).sum(1) for k in range(c.n)], -1)
        self.payload_torque = np.stack([(self.moment(k + 1, c.points[k], [self.carried]) * along[k]).sum(1) for k in range(c.n)], -1)

    def moment(self, station, point, bodies=None):
        """Of everything from a station on, about a point of that station."""
        frame = self.frames[max(station - 1, 0)] if station else self.frames[0]
        about = frame[1] + frame[0] @ point
        out = np.zeros((self.c.count, 3))
        for k, mass, centre in bodies or [*self.bodies, self.carried]:
            if k >= station:
                out += np.cross(centre - about, mass[:, None] * GRAVITY) / 1e3
        return out

    def own_axes(self, station, moment):
        return (np.swapaxes(self.frames[station][0], 1, 2) @ moment[..., None])[..., 0]

    def error(self, shift=0.0):
        """Held-out root mean square error, mm, when `shift` is subtracted from what the rigid arm leaves."""
        left = (self.residual - shift)[self.c.held]
        return float(np.sqrt((left**2).sum(1).mean()))

    def whitened(self, columns):
        """(rows, 3, k) or (rows, 3) in standard deviations of the noise."""
        return self.white @ columns if columns.ndim == 3 else (self.white @ columns[..., None])[..., 0]
