"""Effects that mujoco_maker.py can conceal: how each is drawn, how large it must be to be seen, and what it is called."""
from mujoco_arm import across, np, seen, unit
from mujoco_beyond import BEYOND, read

ARCSEC = np.pi / 180 / 3600


def draw_compliance(c, some=None):
    joints = c.carry if some is None else some
    return [dict(kind="compliance", joint=j, size=c.logu(1.5e-4, 1.5e-3) / c.torque[j], want=("joint_compliance", f"joint {j+1}")) for j in joints]


def few(c, low=1):
    k = int(c.rng.integers(low, len(c.carry) + 1))
    return sorted(int(j) for j in c.rng.choice(c.carry, k, replace=False))


def main_joints(c):
    """Compliance where the gravity torque is large: what wrong torques need in order to show."""
    return [j for j in c.carry if c.torque[j] > 0.2 * max(c.torque)]


def compliance(c):
    return draw_compliance(c, few(c))


def hardening(c):
    j = int(c.rng.choice(main_joints(c)))
    law = ("cubic", c.torque[j] * c.rng.uniform(0.5, 0.9), c.rng.uniform(0.3, 1.2)) if c.rng.random() < 0.5 else ("soft zone", c.torque[j] * c.rng.uniform(0.08, 0.25), c.rng.uniform(1, 2.5))
    others = [k for k in few(c) if k != j] if c.rng.random() < 0.4 else []
    return [dict(kind="hardening", joint=j, size=c.logu(5e-4, 2e-3) / c.torque[j], law=law, want=("joint_hardening", f"joint {j+1}"))] + draw_compliance(c, others)


def flexure(c):
    links = [k for k in c.arm.long if k >= 1 and np.linalg.norm(c.arm.ends[k] - c.arm.points[k]) > 0.15 and k <= c.n - 3]
    k = int(c.rng.choice(links))
    moment = max(c.torque[k : k + 3])
    return [dict(kind="flexure", link=k, size=c.logu(1e-4, 5e-4) / moment, ratio=c.rng.uniform(0.7, 1.4), want=("link_compliance", f"link {k+1}"))] + (draw_compliance(c, few(c)) if c.rng.random() < 0.4 else [])


def floor(c):
    return [dict(kind="floor", size=c.logu(5e-5, 3e-4) / max(c.torque), ratio=float(c.rng.choice([1, c.rng.uniform(0.6, 1.5)])), want=("base_compliance", "base"))] + (draw_compliance(c, few(c)) if c.rng.random() < 0.3 else [])


def backlash(c):
    j = int(c.rng.integers(0, c.n))
    friction = c.torque[j] * c.rng.uniform(0, 0.4) if j in c.carry and c.rng.random() < 0.6 else 1e9
    return [dict(kind="gap", joint=j, size=c.logu(15, 60) * ARCSEC, friction=friction, follow=1 if c.rng.random() < 0.7 else -1, want=("backlash", f"joint {j+1}"))]


def counterbalance(c):
    a, b = 0.3, 0.22
    p = c.arm.points[1]
    up, along = np.array([0, 0, 1.0]), unit(c.arm.ends[1] - p)
    reach = np.linalg.norm(c.arm.ends[1] - p)
    sites = [(0, p + up * a * reach), (1, p + along * b * reach)]
    slack = c.rng.uniform(0.2, 0.7) * (a - b) * reach
    size = c.rng.uniform(0.15, 0.45) * c.torque[1] / (a * b * reach**2)
    return [dict(kind="counterbalance", joint=1, sites=sites, slack=slack, size=size, want=("counterbalance", "joint 2"))] + draw_compliance(c, sorted({1, *few(c)}))


def payload(c):
    mass, centre = (c.rng.choice([-1, 1]) * c.rng.uniform(0.12, 0.35), [0, 0, 0]) if c.rng.random() < 0.5 else (c.rng.uniform(-0.2, 0.3), list(c.rng.normal(0, 0.1, 3) * c.reach / 2))
    return [dict(kind="payload", size=1.0, mass=mass, centre=centre, want=("payload_error", "tool"))] + draw_compliance(c)


def link_mass(c):
    k = int(c.rng.choice([j for j in range(1, c.n - 1) if c.robot["mass"][j] > 0.05 * sum(c.robot["mass"])]))
    return [dict(kind="link_mass", link=k, size=1.0, mass=c.rng.uniform(0.2, 0.5), centre=list(c.rng.normal(0, 0.05, 3) * c.reach), want=("link_mass", f"link {k+1}"))] + draw_compliance(c)


def cable(c, over=1):
    """A hose from before joint j to behind joint j + over - 1, off their axes; it pulls only where it is stretched."""
    j = int(c.rng.choice([k for k in range(1, c.n - 1) if k in c.carry and k + over - 1 < c.n]))
    (u, v), p, q = across(c.arm.axes[j]), c.arm.points[j], c.arm.points[j + over - 1]
    r = 0.16 * c.reach
    turn = c.rng.uniform(0, 2 * np.pi)
    aside = lambda angle: r * (np.cos(angle) * u + np.sin(angle) * v)
    sites = [(j - 1, p + aside(turn)), (j + over - 1, q + 0.8 * aside(turn + c.rng.uniform(0.5, 1.5)))]
    wants = draw_compliance(c)
    size = c.rng.uniform(0.3, 0.6) * c.torque[j] / (r * r)
    return [dict(kind="cable", joint=j, sites=sites, slack=c.rng.uniform(0, 0.7) * r, size=size, want=("cable_drag", f"joint {j+1}"))] + wants


def hose(c):
    effects = cable(c, 2)
    effects[0]["over"] = 2
    return effects


def thermal(c):
    spans = [(a, b) for a in range(c.n - 1) for b in range(a, c.n - 1) if a in c.arm.long and b in c.arm.long]
    a, b = spans[int(c.rng.integers(len(spans)))]
    return [dict(kind="thermal", links=list(range(a, b + 1)), size=float(c.rng.choice([1.15e-5, 2.3e-5])) * c.rng.uniform(0.9, 1.1), want=("thermal_growth", c.span(a, b)))]


def wobble(c):
    j = int(c.rng.integers(0, c.n - 1))
    turning = c.rng.random() < 0.6  # a tilt that turns with the joint; else one that stands in the link before it
    order, ellipse = (int(c.rng.choice([1, 2])), c.rng.choice([-1, 1]) * c.rng.uniform(0.5, 1)) if turning else (1, 0.0)
    return [dict(kind="wobble", joint=j, side="" if turning else "p", order=order, ellipse=ellipse, phase=c.rng.uniform(0, 6.28), size=c.logu(20, 80) * ARCSEC, want=("axis_wobble", f"joint {j+1}"))]


def cyclic(c):
    j, high = int(c.rng.integers(0, c.n)), c.rng.random() < 0.4
    span = np.radians(c.robot["limits"][j][1] - c.robot["limits"][j][0])
    pool = range(5, 41) if high else [o for o in (1, 2, 3, 4) if o * span > 3]
    orders = sorted(int(o) for o in c.rng.choice(list(pool), 1 if c.rng.random() < 0.7 else min(2, len(list(pool))), replace=False))
    return [dict(kind="cyclic", joint=j, waves=[(o, c.rng.uniform(0.5, 1), c.rng.uniform(0, 6.28)) for o in orders], size=c.logu(15, 70) * ARCSEC, want=("gear_cyclic", f"joint {j+1}"))]


def motor(c):
    j = int(c.rng.integers(0, c.n))
    return [dict(kind="cyclic", joint=j, waves=[(int(c.rng.choice([1, 2])) * c.robot["ratio"][j], 1.0, c.rng.uniform(0, 6.28))], size=c.logu(12, 60) * ARCSEC, want=("gear_motor_cyclic", f"joint {j+1}"))]


def zero_step(c):
    j = int(c.rng.integers(1, c.n))
    return [dict(kind="zero_step", joint=j, time=c.moment(), size=c.rng.choice([-1, 1]) * c.logu(15, 80) * ARCSEC, want=("zero_shift", f"joint {j+1}"))]


def tool_step(c):
    return [dict(kind="tool_step", time=c.moment(), way=list(unit(c.rng.normal(0, 1, 3))), size=c.logu(5e-5, 3e-4), want=("tool_shift", "tool"))]


def base_step(c):
    return [dict(kind="base_step", time=c.moment(), way=list(unit(c.rng.normal(0, 1, 3))), turn=list(c.rng.normal(0, 0.4, 3) / c.reach), size=c.logu(5e-5, 3e-4), want=("base_shift", "base"))]


def drift(c):
    power = 1.0 if c.rng.random() < 0.7 else 0.5
    turn = list(c.rng.normal(0, 0.3, 3) / c.reach) if c.rng.random() < 0.5 else [0, 0, 0]
    return [dict(kind="drift", power=power, span=c.end, way=list(unit(c.rng.normal(0, 1, 3))), turn=turn, size=c.logu(6e-5, 3e-4), want=("tracker_drift", "tracker"))]


def lag(c):
    return [dict(kind="lag", share=list(c.rng.uniform(0.8, 1.2, c.n)), size=c.logu(5e-5, 4e-4), want=("joint_log_lag", "recording"))]


def coupling(c):
    pairs = [(m, b) for b in range(c.n) for m in (b - 1, b + 1) if 0 <= m < c.n and (m, b) not in c.arm.coupled]
    m, b = pairs[int(c.rng.integers(len(pairs)))]
    return [dict(kind="coupling", joint=m, by=b, size=c.rng.choice([-1, 1]) * c.logu(2e-4, 1.5e-3), want=("coupling_ratio", f"joint {b+1}->{m+1}"))]


def table(kind):
    def draw(c):
        j = int(c.rng.integers(0, c.n))
        low, high = np.radians(c.robot["limits"][j])
        size = c.logu(60, 200) * ARCSEC if kind == "bump" else c.logu(40, 120) * ARCSEC
        want = ("unknown", f"joint {j+1}")
        return [dict(kind=kind, joint=j, centre=c.rng.uniform(0.7 * low + 0.3 * high, 0.3 * low + 0.7 * high), width=c.rng.uniform(0.08, 0.3), size=size, want=want, accept=("joint_table", f"joint {j+1}"))]
    return draw


def cross(c):
    j = int(c.rng.integers(0, c.n))
    b = int(c.rng.choice([k for k in range(c.n) if k != j]))
    return [dict(kind="cross", joint=j, by=b, order=float(c.rng.choice([1, 2])), phase=c.rng.uniform(0, 6.28), product=bool(c.rng.random() < 0.6), size=c.logu(25, 100) * ARCSEC, want=("unknown", f"joint {j+1}"))]


def creep(c):
    j = int(c.rng.integers(1, c.n))
    return [dict(kind="creep", joint=j, power=float(c.rng.choice([0.5, 1, 2])), span=c.end, size=c.logu(25, 100) * ARCSEC, want=("unknown", f"joint {j+1}"))]


def seat(c):
    return [dict(kind="tool_seat", way=list(unit(c.rng.normal(0, 1, 3))), size=c.logu(5e-5, 2.5e-4), want=("unknown", "tool"))]


def sway(c):
    return [dict(kind="sway", period=c.end * c.rng.uniform(0.15, 0.5), phase=c.rng.uniform(0, 6.28), way=list(unit(c.rng.normal(0, 1, 3))), size=c.logu(5e-5, 2.5e-4), want=("unknown", "base"), accept=("tracker_drift", "tracker"))]


SINGLE = dict(compliance=compliance, hardening=hardening, flexure=flexure, floor=floor, backlash=backlash, counterbalance=counterbalance, payload=payload,
              link_mass=link_mass, cable=cable, thermal=thermal, wobble=wobble, cyclic=cyclic, motor=motor, zero_step=zero_step, tool_step=tool_step,
              base_step=base_step, drift=drift, lag=lag, coupling=coupling)
OPEN = dict(bump=table("bump"), kink=table("kink"), plateau=table("plateau"), cross=cross, creep=creep, seat=seat, sway=sway, hose=hose)
SOFT = {"compliance", "hardening", "flexure", "floor"}
IN_TIME = {"zero_step", "tool_step", "base_step", "drift", "sway", "creep", "thermal", "lag"}
PAIRABLE = [k for k in SINGLE if k not in ("link_mass", "counterbalance", "cable")]


class Case:
    """What a family may ask when it draws an effect."""

    def __init__(self, rng, robot, arm, rows, torque):
        self.rng, self.robot, self.arm, self.n, self.rows = rng, robot, arm, arm.n, rows
        self.torque = np.abs(torque).max(0)
        self.carry = [j for j in range(self.n) if self.torque[j] > 0.03 * self.torque.max()]
        self.reach = np.linalg.norm(np.diff(np.vstack([arm.points, arm.tool]), axis=0), axis=1).sum()
        self.end = rows[-1]["time"]
        self.fit = [r["time"] for r in rows if r["use"] == "fit"]

    def logu(self, low, high):
        return float(np.exp(self.rng.uniform(np.log(low), np.log(high))))

    def moment(self):
        """A time inside the fit, away from the change of payload."""
        share = self.rng.choice([self.rng.uniform(0.15, 0.43), self.rng.uniform(0.57, 0.85)])
        return self.fit[0] + float(share) * (self.fit[-1] - self.fit[0])

    @staticmethod
    def span(a, b):
        return f"link {a+1}" if a == b else f"link {a+1}-{b+1}"


def positions(arm, rows, effects, frames=False):
    """Reflector in the base's frame as the tracker would see it without noise."""
    out = arm.run(rows, effects, frames)
    P, t = out[0], np.array([r["time"] for r in rows])
    for e in effects:
        if e["kind"] in ("base_step", "drift", "sway"):
            f = (t > e["time"]) if e["kind"] == "base_step" else (t / e["span"]) ** e["power"] if e["kind"] == "drift" else np.sin(2 * np.pi * t / e["period"] + e["phase"])
            P = P + (e["size"] * f)[:, None] * (np.array(e["way"]) + np.cross(e.get("turn", [0, 0, 0]), P))
        if e["kind"] == "instrument":
            P = read(P, e)
    return [P] + out[1:]


def measure(arm, rows, effects, jitter):
    """L of each effect, none of it counted that rigid geometry or the other effects imitate; other names for a growth of links."""
    frames = positions(arm, rows, effects, True)[2]
    still = [dict(r, jitter=0 * r["jitter"]) for r in rows]
    whole = positions(arm, still, effects)[0]
    alone = lambda P: seen(whole - P, rows, frames, whole, arm, jitter)

    def less(i, **change):
        e = effects[i]
        gone = dict(e, size=e["size"] * (1e-6 if e["kind"] in SOFT else 0)) | change
        return alone(positions(arm, still, effects[:i] + [gone] + effects[i + 1 :])[0])

    own, near = [less(i) for i in range(len(effects))], []
    Ls = []
    for i, e in enumerate(effects):
        others = [x for k, x in enumerate(own) if k != i]
        if e["kind"] == "hardening":  # what a constant compliance does not explain
            others.append(own[i] - less(i, law=None, size=e["size"]))
        own_left = own[i]
        if others:
            own_left = own[i] - np.array(others).T @ np.linalg.lstsq(np.array(others).T, own[i], rcond=1e-10)[0]
        Ls.append(float(own_left @ own_left))
        if e["kind"] == "thermal":
            for a in range(arm.n - 1):
                for b in range(a, arm.n - 1):
                    if list(range(a, b + 1)) == e["links"]:
                        continue
                    x = own[i] - less(i, links=list(range(a, b + 1)), size=e["size"])
                    if x @ x > 0 and own[i] @ own[i] - (own[i] @ x) ** 2 / (x @ x) < 4:
                        near.append((i, ("thermal_growth", Case.span(a, b))))
    return Ls, near


def conceal(rng, robot, arm, rows, family, jitter, least):
    """Draws effects until each is visible; makes them larger first."""
    arm.build([])
    case = Case(rng, robot, arm, rows, arm.run(rows, [])[1])
    names = {**SINGLE, **OPEN, **BEYOND}
    for _ in range(40):
        if family == "null":
            kinds = []
        elif family == "pairs":
            kinds = list(rng.choice(PAIRABLE, 2, replace=False))
        elif family == "single":
            kinds = [str(rng.choice(list(SINGLE)))]
        elif family == "open":
            kinds = [str(rng.choice(list(OPEN)))]
        elif family == "beyond":
            kinds = [str(rng.choice(list(BEYOND)))]
        else:
            kinds = family.split("+")
        effects = [e for kind in kinds for e in names[kind](case)]
        wants = [e["want"] for e in effects]
        if len(set(wants)) < len(wants) or {("joint_hardening", w[1]) for w in wants if w[0] == "joint_compliance"} & set(wants):
            continue
        arm.build(effects)
        for _ in range(8):
            try:
                Ls, near = measure(arm, rows, effects, jitter)
            except ArithmeticError:
                break
            weak = [i for i, L in enumerate(Ls) if L < least]
            if not weak:
                return kinds, effects, Ls, near
            for i in weak:
                effects[i]["size"] *= 1.5
    raise SystemExit(f"{robot['name']}: no visible case of {family}")

