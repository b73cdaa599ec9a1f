"""Forward and inverse kinematics of a serial arm and of its corrected model, by plain matrix exponentials.

P = E_0 exp(x1 (q1 + d1)) E_1 ... exp(xn (qn + dn)) E_n tool, screws at the zero pose in the base frame; E_k = exp of the twist that
link k got. SI. Nothing here comes from calib but the numbers of the parameters.
"""
import math

Y = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


def mul(a, b):
    return tuple(tuple(sum(a[i][k] * b[k][j] for k in range(3)) for j in range(3)) for i in range(3))


def apply(a, v):
    return tuple(a[i][0] * v[0] + a[i][1] * v[1] + a[i][2] * v[2] for i in range(3))


def add(a, b):
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])


def sub(a, b):
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


def cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def norm(v):
    return math.sqrt(sum(x * x for x in v))


def transposed(a):
    return tuple(zip(*a))


def rodrigues(axis, angle):
    x, y, z = axis
    s, c = math.sin(angle), math.cos(angle)
    t = 1.0 - c
    return ((c + t * x * x, t * x * y - s * z, t * x * z + s * y),
            (t * x * y + s * z, c + t * y * y, t * y * z - s * x),
            (t * x * z - s * y, t * y * z + s * x, c + t * z * z))


def compose(a, b):
    return mul(a[0], b[0]), add(apply(a[0], b[1]), a[1])


def exp(v, w):
    """The motion of a twist (v; w)."""
    angle = norm(w)
    if angle < 1e-12:
        return Y, tuple(v)
    turn = rodrigues(tuple(x / angle for x in w), angle)
    once = cross(w, v)
    twice = cross(w, once)
    half = math.sin(angle / 2) / angle
    a = 2 * half * half
    b = (1 - angle * angle / 20) / 6 if angle < 1e-2 else (angle - math.sin(angle)) / angle ** 3
    return turn, tuple(v[i] + a * once[i] + b * twice[i] for i in range(3))


def zyx(a, b, c):
    """A about z, then B about the new y, then C about the new x (rad)."""
    return mul(mul(rodrigues((0, 0, 1), a), rodrigues((0, 1, 0), b)), rodrigues((1, 0, 0), c))


def of_quaternion(w, x, y, z):
    n = math.sqrt(w * w + x * x + y * y + z * z)
    w, x, y, z = w / n, x / n, y / n, z / n
    return ((1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
            (2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
            (2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)))


def between(a, b):
    """Rotation vector that turns b into a."""
    r = mul(a, transposed(b))
    v = (r[2][1] - r[1][2], r[0][2] - r[2][0], r[1][0] - r[0][1])
    sine, cosine = norm(v) / 2, (r[0][0] + r[1][1] + r[2][2] - 1) / 2
    angle = math.atan2(sine, cosine)
    if sine < 1e-9:
        return tuple(x / 2 for x in v) if cosine > 0 else (math.pi, 0.0, 0.0)
    return tuple(x / (2 * sine) * angle for x in v)


class Arm:
    """`joints`: (axis, point) of revolute joints, m; `tool`: (rotation, point). Parameters by calib's names, SI."""

    def __init__(self, joints, tool, parameters=None):
        parameters = parameters or {}
        n = len(joints)
        self.joints, self.tool = joints, tool
        self.offset = [parameters.get(f"joint_offset.j{j + 1}", 0.0) for j in range(n)]
        self.ratio = [parameters.get(f"reduction_ratio.j{j + 1}", 0.0) for j in range(n)]
        self.stations = [None]
        for link in range(1, n + 1):
            of = (lambda name: parameters.get(f"link_geometry.l{link}.{name}", 0.0)) if link < n else (lambda name: 0.0)
            w = tuple(of(name) for name in ("rx", "ry", "rz"))
            point = joints[link][1] if link < n else (0.0, 0.0, 0.0)
            # The tilt is about the point of the next joint: v = -w x point.
            v = tuple(of(name) - t for name, t in zip("xyz", cross(w, point)))
            if link == n:
                v = tuple(v[k] + parameters.get(f"tool_offset.{'xyz'[k]}", 0.0) for k in range(3))
            self.stations.append(exp(v, w) if any(v) or any(w) else None)
        known = {f"{e}.j{j + 1}" for e in ("joint_offset", "reduction_ratio") for j in range(n)}
        known |= {f"link_geometry.l{k}.{a}" for k in range(1, n) for a in ("x", "y", "z", "rx", "ry", "rz")}
        known |= {f"tool_offset.{a}" for a in "xyz"} | {f"base_frame.{a}" for a in ("x", "y", "z", "rx", "ry", "rz")}
        strange = [name for name, value in parameters.items() if name not in known and value]
        if strange:
            raise ValueError(f"parameters that this arm does not know: {strange}")

    def place(self, q, screws=False):
        """Pose of the tool; with `screws` also axis and point of every joint as it stands."""
        frame, found = (Y, (0.0, 0.0, 0.0)), []
        for j, (axis, point) in enumerate(self.joints):
            if screws:
                found.append((apply(frame[0], axis), add(apply(frame[0], point), frame[1])))
            turn = rodrigues(axis, q[j] * (1.0 + self.ratio[j]) + self.offset[j])
            frame = compose(frame, (turn, sub(point, apply(turn, point))))
            if self.stations[j + 1]:
                frame = compose(frame, self.stations[j + 1])
        pose = compose(frame, self.tool)
        return (pose, found) if screws else pose

    def point(self, q):
        return self.place(q)[1]

    def solve(self, pose, start, rounds=60):
        """Joints that bring the tool to `pose`, searched from `start`; none where that fails (six joints)."""
        q = list(start)
        for _ in range(rounds):
            (rotation, point), screws = self.place(q, screws=True)
            off = sub(pose[1], point) + between(pose[0], rotation)
            if norm(off) < 1e-12:
                return q
            rows = [[0.0] * 6 for _ in range(6)]
            for j, (axis, at) in enumerate(screws):
                v = cross(axis, sub(point, at))
                for i in range(3):
                    rows[i][j], rows[i + 3][j] = v[i], axis[i]
            step = gauss(rows, off)
            if step is None:
                return None
            size = max(map(abs, step))
            scale = min(1.0, 0.5 / size) if size > 0 else 1.0
            q = [a + scale * b for a, b in zip(q, step)]
            if size < 1e-13:
                return q
        return None


def gauss(rows, right):
    n = len(rows)
    m = [list(row) + [value] for row, value in zip(rows, right)]
    for k in range(n):
        best = max(range(k, n), key=lambda i: abs(m[i][k]))
        if abs(m[best][k]) < 1e-12:
            return None
        m[k], m[best] = m[best], m[k]
        for i in range(k + 1, n):
            f = m[i][k] / m[k][k]
            if f:
                for j in range(k, n + 1):
                    m[i][j] -= f * m[k][j]
    out = [0.0] * n
    for k in reversed(range(n)):
        out[k] = (m[k][n] - sum(m[k][j] * out[j] for j in range(k + 1, n))) / m[k][k]
    return out
