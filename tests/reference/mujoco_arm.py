"""An arm with manufacturing errors as a MuJoCo model, and its static poses under gravity, springs and tendons: for mujoco_maker.py.

Rigid bodies on hinges in series: a driven one per joint, an elastic one for its gear, two square to it for its bearing before and
behind, two pairs inside each long link, one pair under the base. Lengths m, angles rad, torques Nm.
"""
import sys

try:
    import mujoco
    import numpy as np
except ImportError as missing:
    print(f"skipped: {missing}; pip install mujoco numpy")
    sys.exit(0)

X, Y = [1, 0, 0], [0, 1, 0]


def text(v):
    return " ".join(f"{x:.15g}" for x in v)


def unit(v):
    return np.asarray(v, float) / np.linalg.norm(v)


def across(axis):
    """Two directions square to an axis."""
    a = unit(np.cross(axis, [0.3, 0.5, 0.8]))
    return a, unit(np.cross(axis, a))


class Arm:
    """The true arm as an MJCF model, and its static poses."""

    def __init__(self, robot, rng, errors=1.0):
        self.robot, self.n = robot, len(robot["axes"])
        n, g = self.n, lambda sigma, *shape: rng.normal(0, sigma * errors, shape)
        self.nominal_points = np.array(robot["points"], float) / 1e3
        self.axes = np.array([unit(np.array(a) + g(3e-4, 3)) for a in robot["axes"]])
        self.points = self.nominal_points + g(4e-4, n, 3)
        self.tool = np.array(robot["tool"], float) / 1e3 + g(3e-4, 3)
        self.zero, self.scale = g(5e-4, n), 1 + g(robot.get("fine", 3e-4), n)
        self.coupled = {tuple(c): float(g(4e-4, 1)[0]) for c in robot["coupling"]}
        self.payload_at = (np.array(robot["tool"], float) + robot["payload_com"]) / 1e3
        self.ends = np.vstack([self.points[1:], self.tool])
        self.long = [k for k in range(n - 1) if np.linalg.norm(self.ends[k] - self.points[k]) > 0.06]

    def build(self, effects):
        """Compiles the model; tendons of the effects become part of it."""
        sites = {k: "" for k in range(-1, self.n)}
        tendons = ""
        for i, e in enumerate(effects):
            if "sites" in e:
                for end, (body, at) in enumerate(e["sites"]):
                    origin = self.points[body] if body >= 0 else np.zeros(3)
                    sites[body] += f'<site name="t{i}_{end}" pos="{text(np.array(at) - origin)}"/>'
                tendons += f'<spatial name="t{i}" stiffness="0" springlength="0 {e["slack"]:.9g}"><site site="t{i}_0"/><site site="t{i}_1"/></spatial>'
        hinge = lambda name, axis, at=(0, 0, 0): f'<joint name="{name}" type="hinge" axis="{text(axis)}" pos="{text(at)}"/>'
        inertial = lambda at, mass: f'<inertial pos="{text(at)}" mass="{mass:.9g}" diaginertia="1 1 1"/>'
        out = ('<mujoco><compiler angle="radian" autolimits="true" inertiagrouprange="0 5"/><option gravity="0 0 -9.81"/><default><joint armature="1"/></default>'
               f'<worldbody><body name="base" pos="0 0 0">{hinge("fx", X)}{hinge("fy", Y)}{inertial([0, 0, 0], 1)}{sites[-1]}')
        before, depth = np.zeros(3), 1
        for j in range(self.n):
            p, (u, v) = self.points[j], across(self.axes[j])
            out += f'<body name="l{j}" pos="{text(p - before)}">'
            out += hinge(f"pu{j}", u) + hinge(f"pv{j}", v) + hinge(f"q{j}", self.axes[j]) + hinge(f"e{j}", self.axes[j]) + hinge(f"u{j}", u) + hinge(f"v{j}", v)
            out += inertial(np.array(self.robot["com"][j]) / 1e3 - self.nominal_points[j], self.robot["mass"][j]) + sites[j]
            before, depth = p, depth + 1
            if j in self.long:
                along = self.ends[j] - p
                a, b = across(along)
                for i, share in enumerate((0.28, 0.7)):
                    at = p + share * along
                    out += f'<body name="f{j}_{i}" pos="{text(at - before)}">{hinge(f"fa{j}_{i}", a)}{hinge(f"fb{j}_{i}", b)}{inertial([0, 0, 0], 1e-6)}'
                    before, depth = at, depth + 1
        out += f'<site name="smr" pos="{text(self.tool - before)}"/><body name="load" pos="{text(self.payload_at - before)}">{inertial([0, 0, 0], 1)}</body>'
        out += "</body>" * depth + f"</worldbody><tendon>{tendons}</tendon></mujoco>"
        m = self.model = mujoco.MjModel.from_xml_string(out)
        self.data = mujoco.MjData(m)
        self.at = {m.joint(i).name: m.joint(i).qposadr[0] for i in range(m.njnt)}
        self.rest = dict(mass=m.body_mass.copy(), pos=m.body_pos.copy(), ipos=m.body_ipos.copy(), site=m.site_pos.copy())
        self.kids = {k: [b for b in range(m.nbody) if m.body(b).name == f"f{k}_0" or m.body(b).name == f"f{k}_1" or m.body(b).name == (f"l{k+1}" if k + 1 < self.n else "load")]
                     for k in range(self.n)}

    def set_row(self, row, effects):
        """Drives the joints as the controller was told, with what effects do to bodies and drives. Returns hinges that give way."""
        m, d, n, q = self.model, self.data, self.n, row["q"].copy()
        m.body_mass[:], m.body_pos[:], m.body_ipos[:], m.site_pos[:] = self.rest["mass"], self.rest["pos"], self.rest["ipos"], self.rest["site"]
        m.jnt_stiffness[:], m.tendon_stiffness[:], d.qpos[:], d.qvel[:] = 0, 0, 0, 0
        load, smr = m.body("load").id, m.site("smr").id
        m.body_mass[load] = row["payload"] + 1e-9
        for e in effects:
            if e["kind"] == "lag":
                q += e["size"] * np.array(e["share"]) * row["move"]
        drive = self.zero + self.scale * q + row["jitter"]
        for (moved, by), ratio in self.coupled.items():
            drive[moved] += ratio * q[by]
        soft = {}
        for i, e in enumerate(effects):
            k, size, j = e["kind"], e["size"], e.get("joint")
            if k in ("compliance", "hardening"):
                soft[self.at[f"e{j}"]] = (size, e.get("law"))
            elif k == "flexure":
                for axis in "ab":
                    for s, share in enumerate((0.5, 0.5)):
                        soft[self.at[f"f{axis}{e['link']}_{s}"]] = (size * share * (e["ratio"] if axis == "b" else 1), None)
            elif k == "floor":
                soft[self.at["fx"]], soft[self.at["fy"]] = (size, None), (size * e["ratio"], None)
            elif k in ("counterbalance", "cable"):
                m.tendon_stiffness[m.tendon(f"t{i}").id] = size
            elif k == "payload":
                if row["payload"] > 0:
                    m.body_mass[load] *= 1 + size * e["mass"]
                    m.body_pos[load] += size * np.array(e["centre"])
            elif k == "link_mass":
                body = m.body(f"l{e['link']}").id
                m.body_mass[body] *= 1 + size * e["mass"]
                m.body_ipos[body] += size * np.array(e["centre"])
            elif k == "thermal":
                for link in e["links"]:
                    m.body_pos[self.kids[link]] *= 1 + size * row["warm"]
            elif k == "link_state":
                m.body_pos[self.kids[e["link"]]] *= 1 + size * e["state"][row["i"]]
            elif k == "joint_state":
                drive[j] += size * e["state"][row["i"]]
            elif k == "wobble":
                side, turn = e["side"], e["order"] * q[j] + e["phase"]
                d.qpos[self.at[f"{side}u{j}"]] += size * np.cos(turn)
                d.qpos[self.at[f"{side}v{j}"]] += size * e["ellipse"] * np.sin(turn)
            elif k == "zero_step":
                drive[j] += size * (row["time"] > e["time"])
            elif k == "tool_step":
                m.site_pos[smr] += size * np.array(e["way"]) * (row["time"] > e["time"])
            elif k == "tool_seat":
                m.site_pos[smr] += size * np.array(e["way"]) * (row["payload"] > 0)
            elif k == "cyclic":
                drive[j] += sum(size * a * np.sin(o * q[j] + p) for o, a, p in e["waves"])
            elif k == "coupling":
                drive[j] += size * q[e["by"]]
            elif k == "bump":
                drive[j] += size * np.exp(-(((q[j] - e["centre"]) / e["width"]) ** 2))
            elif k == "kink":
                drive[j] += size * max(q[j] - e["centre"], 0)
            elif k == "plateau":
                drive[j] += size * np.tanh((q[j] - e["centre"]) / e["width"])
            elif k == "cross":
                drive[j] += size * np.sin(q[e["by"]] * e["order"] + e["phase"]) * (np.cos(q[j]) if e["product"] else 1)
            elif k == "creep":
                drive[j] += size * (row["time"] / e["span"]) ** e["power"]
        d.qpos[[self.at[f"q{j}"] for j in range(n)]] = drive
        return soft

    def settle(self, soft):
        """Newton's way to equilibrium of springs, tendons and gravity. Returns the load on every hinge, Nm."""
        m, d = self.model, self.data
        dofs = np.array(sorted(soft), int)
        linear = np.array([soft[i][1] is None for i in dofs], bool)
        for i in dofs[linear]:
            m.jnt_stiffness[i] = 1 / soft[i][0]
        for _ in range(60):
            mujoco.mj_fwdPosition(m, d)
            mujoco.mj_fwdVelocity(m, d)
            load = d.qfrc_passive - d.qfrc_bias
            if not len(dofs):
                break
            step = np.zeros(len(dofs))
            for s, i in enumerate(dofs):
                compliance, law = soft[i]
                if law is None:
                    step[s] = load[i] * compliance
                else:
                    step[s] = wind_up(load[i], compliance, law) - d.qpos[i]
            d.qpos[dofs] += step
            if np.abs(step).max() < 1e-12:
                break
        else:
            raise ArithmeticError("no equilibrium")
        own = m.jnt_stiffness * d.qpos
        return load + own  # without the hinges' own springs

    def pose(self, row, effects):
        """Reflector in the base frame (m) and load torques at the joints (Nm)."""
        soft = self.set_row(row, effects)
        load = self.settle(soft)
        loaded = [e for e in effects if e["kind"] in ("gap", "torque_state")]
        if loaded:
            for e in loaded:
                torque = load[self.at[f"q{e['joint']}"]]
                if e["kind"] == "torque_state":
                    held = e["full"] * np.tanh(torque / e["full"]) if e["full"] else torque
                    self.data.qpos[self.at[f"q{e['joint']}"]] += e["size"] * e["state"][row["i"]] * held
                    continue
                side = np.sign(torque) if abs(torque) > e["friction"] else e["follow"] * row["dir"][e["joint"]]
                self.data.qpos[self.at[f"q{e['joint']}"]] += e["size"] * side
            load = self.settle(soft)
        mujoco.mj_kinematics(self.model, self.data)
        return self.data.site("smr").xpos.copy(), load[[self.at[f"q{j}"] for j in range(self.n)]]

    def run(self, rows, effects, frames=False):
        out = [self.pose(row, effects) + ((self.frame(),) if frames else ()) for row in rows]
        return [np.array([o[i] for o in out]) for i in range(2 + frames)]

    def frame(self):
        """Columns of the reflector's motion by rigid errors: a twist of the base and of each link."""
        d, p = self.data, self.data.site("smr").xpos
        columns = []
        for name in ["base"] + [f"l{j}" for j in range(self.n)]:
            R, o = d.body(name).xmat.reshape(3, 3), d.body(name).xpos
            columns += [R, np.cross(R.T, p - o).T]
        joints = [np.cross(d.xaxis[self.at[f"q{j}"]], p - d.xanchor[self.at[f"q{j}"]])[:, None] for j in range(self.n)]
        return np.hstack(columns + joints)


def wind_up(torque, compliance, law):
    """Angle of a gear whose stiffness grows with load: cubic hardening, or a soft zone near zero load."""
    form, t0, share = law
    if form == "cubic":  # torque = k (a + b a^3): Newton from the linear answer
        b, y, a = share / (compliance * t0) ** 2, torque * compliance, torque * compliance
        for _ in range(50):
            a -= (a + b * a**3 - y) / (1 + 3 * b * a * a)
        return a
    soft = min(abs(torque), t0)
    return np.sign(torque) * compliance * (soft * (1 + share) + max(abs(torque) - t0, 0))


def noise_sigma(P):
    return (10e-6 + 2.5e-6 * np.linalg.norm(P, axis=1)) / 2


def seen(difference, rows, frames, P, arm, jitter):
    """A displacement (rows, 3) in units of the noise, after rigid geometry, ratios and declared couplings absorbed their part.

    Only rows of the fit. The sum of its squares is L.
    """
    n, q, fit = arm.n, np.array([r["q"] for r in rows]), np.array([r["use"] == "fit" for r in rows])
    S, J = frames[:, :, : 6 * (n + 1)], frames[:, :, 6 * (n + 1):]
    A = np.concatenate([S, J * q[:, None, :]] + [(J[:, :, a] * q[:, b, None])[:, :, None] for a, b in arm.coupled], 2)
    V = noise_sigma(P)[:, None, None] ** 2 * np.eye(3) + jitter**2 * J @ np.swapaxes(J, 1, 2)
    W = np.linalg.inv(np.linalg.cholesky(V))[fit]
    A, d = (W @ A[fit]).reshape(-1, A.shape[2]), (W @ difference[fit][..., None]).ravel()
    U, s, _ = np.linalg.svd(A / (np.linalg.norm(A, axis=0) + 1e-300), full_matrices=False)
    U = U[:, s > 1e-9 * s[0]]
    return d - U @ (U.T @ d)
