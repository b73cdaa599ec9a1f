"""Effects beyond the list that mujoco_maker.py can conceal: instruments, memory, interactions.

Each is drawn like those of mujoco_effects.py. `state` is what a row contributes for size 1, from what the arm lived through up to it:
logged joints, times and warmth. Angles rad, lengths m, temperatures K above the start.
"""
from mujoco_arm import np, unit

ARCSEC = np.pi / 180 / 3600


def column(c, key):
    return np.array([row[key] for row in c.rows])


def joint_state(c, j, state, size, want, needs=(), accept=None):
    effect = dict(kind="joint_state", joint=j, state=np.asarray(state, float), size=size, needs=list(needs), want=(want, f"joint {j+1}"))
    return [effect | (dict(accept=(accept, f"joint {j+1}")) if accept else {})]


def torque_state(c, j, state, size, want, full=0.0, needs=(), accept=None):
    """A turn of size times state times torque, which saturates at `full` Nm (0: never)."""
    return [dict(joint_state(c, j, state, size / c.torque[j], want, needs, accept)[0], kind="torque_state", full=full)]


def turning(c):
    return int(c.rng.integers(0, c.n - 1))


def bearing(c):
    heavy = [j for j in c.carry if c.torque[j] > 0.2 * max(c.torque) and j < c.n - 1]
    return int(c.rng.choice(heavy))


def behind(c, lag):
    """Temperature of a body that follows the logged one with a time constant; straight between rows."""
    out, before, logged, body = [], 0.0, 0.0, 0.0
    for time, warm in zip(column(c, "time"), column(c, "warm")):
        trail = (warm - logged) / (time - before) * lag
        body = warm - trail + (body - logged + trail) * np.exp(-(time - before) / lag)
        before, logged = time, warm
        out.append(body)
    return np.array(out)


def recent(c, j, cooling):
    """Travel of a joint that has not cooled off."""
    out, before, heat = [], 0.0, 0.0
    for time, move in zip(column(c, "time"), column(c, "move")[:, j]):
        heat, before = heat * np.exp(-(time - before) / cooling) + abs(move), time
        out.append(heat)
    return np.array(out)


def presliding(c):
    j, travel = turning(c), np.radians(c.logu(0.5, 4))
    limits = [travel] if c.rng.random() < 0.5 else [travel * c.logu(0.3, 3) for _ in range(int(c.rng.integers(3, 5)))]
    out, z = [], np.zeros(len(limits))
    for move in column(c, "move")[:, j]:
        if len(limits) == 1:  # Dahl
            s = np.sign(move)
            z = s + (z - s) * np.exp(-abs(move) / travel) if move else z
            out.append(-z[0])
        else:  # Maxwell slip
            z = np.clip(z + move, -np.array(limits), limits)
            out.append(-np.mean(z / limits))
    return joint_state(c, j, out, c.logu(10, 60) * ARCSEC, "presliding", ["dir"])


def own_heat(c):
    j, cooling = turning(c), c.end * c.rng.uniform(0.06, 0.25)
    heat = recent(c, j, cooling)
    if c.rng.random() < 0.5:  # casing and oil, saturating
        heat = np.tanh((heat + recent(c, j, cooling * c.rng.uniform(0.1, 0.4))) / heat.max())
    off = heat / heat.max() * (column(c, "q")[:, j] if c.rng.random() < 0.4 else 1)
    return joint_state(c, j, off, c.rng.choice([-1, 1]) * c.logu(15, 80) * ARCSEC, "joint_warming", ["time"])


def late_heat(c):
    j, lag = turning(c), c.end * c.rng.uniform(0.04, 0.2)
    warm = behind(c, lag)
    if c.rng.random() < 0.5:
        warm = (warm + behind(c, lag * c.rng.uniform(3, 6))) / 2
    off = warm / 12 * (column(c, "q")[:, j] if c.rng.random() < 0.4 else 1)
    return joint_state(c, j, off, c.rng.choice([-1, 1]) * c.logu(15, 80) * ARCSEC, "joint_warming", ["time", "temp"])


def warm_ratio(c):
    j, warm = turning(c), column(c, "warm")
    warm = warm / 12 if c.rng.random() < 0.5 else np.tanh(warm / c.rng.uniform(5, 10))
    return joint_state(c, j, warm * column(c, "q")[:, j], c.rng.choice([-1, 1]) * c.logu(15, 80) * ARCSEC, "joint_warming", ["temp"])


def warm_spring(c):
    warm = column(c, "warm")
    warm = warm / 12 if c.rng.random() < 0.5 else np.tanh(warm / c.rng.uniform(5, 10))
    return torque_state(c, bearing(c), warm, c.logu(20, 80) * ARCSEC, "joint_warming", 0.0, ["temp"], "joint_compliance")


def gear_load(c):
    j = bearing(c)
    wave = np.sin(int(c.rng.integers(1, 6)) * column(c, "q")[:, j] + c.rng.uniform(0, 6.28))
    full = 0.0 if c.rng.random() < 0.5 else c.torque[j] * c.rng.uniform(0.2, 0.5)
    return torque_state(c, j, wave, c.logu(15, 60) * ARCSEC, "gear_load", full)


def gear_flank(c):
    j, first = turning(c), int(c.rng.integers(1, 5))
    q, wave = column(c, "q")[:, j], lambda order: np.sin(order * q + c.rng.uniform(0, 6.28))
    run_out = wave(first) + (c.rng.uniform(0.5, 1) * wave(first + int(c.rng.integers(1, 5))) if c.rng.random() < 0.5 else 0)
    return joint_state(c, j, run_out * column(c, "dir")[:, j], c.logu(10, 50) * ARCSEC, "gear_flank", ["dir"])


def side_spring(c):
    j = bearing(c)
    return torque_state(c, j, -column(c, "dir")[:, j], c.logu(15, 60) * ARCSEC, "backlash", 0.0, ["dir"], "joint_hardening")


def growing_gap(c):
    j, u, start = turning(c), column(c, "time") / c.end, c.rng.uniform(0.1, 0.4)
    grown = u if c.rng.random() < 0.5 else 1 - np.exp(-u / c.rng.uniform(0.15, 0.5))
    state = -(start + (1 - start) * grown) * column(c, "dir")[:, j]
    return joint_state(c, j, state, c.logu(10, 40) * ARCSEC, "backlash", ["dir", "time"], "unknown")


def link_state(c, state, want, needs, accept=None):
    long = [k for k in c.arm.long if np.linalg.norm(c.arm.ends[k] - c.arm.points[k]) > 0.15 and k + 1 < c.n]
    k = int(c.rng.choice(long))
    effect = dict(kind="link_state", link=k, state=np.asarray(state(k), float), size=c.rng.uniform(8e-6, 1.6e-5), needs=needs, want=(want, f"link {k+1}"))
    return [effect | (dict(accept=(accept, f"link {k+1}")) if accept else {})]


def lagging_link(c):
    lag, core = c.end * c.rng.uniform(0.05, 0.2), c.end * c.rng.uniform(0.2, 0.5)
    warm = behind(c, lag)
    if c.rng.random() < 0.5:
        warm = (warm + behind(c, lag + core)) / 2
    return link_state(c, lambda k: warm, "thermal_growth", ["time", "temp"])


def bent_link(c):
    power = int(c.rng.integers(1, 3))
    return link_state(c, lambda k: column(c, "warm") * np.cos(column(c, "q")[:, k + 1]) ** power, "unknown", ["temp"], "thermal_growth")


def stand(c):
    """A tracker somewhere, upright within some degrees: what it reads is bent about its own origin and axis."""
    a, (b, d) = c.rng.uniform(-np.pi, np.pi, 2), c.rng.normal(0, 0.03, 2)
    z = np.array([[np.cos(a[0]), -np.sin(a[0]), 0], [np.sin(a[0]), np.cos(a[0]), 0], [0, 0, 1]])
    x = np.array([[1, 0, 0], [0, np.cos(b), -np.sin(b)], [0, np.sin(b), np.cos(b)]])
    y = np.array([[np.cos(d), 0, np.sin(d)], [0, 1, 0], [-np.sin(d), 0, np.cos(d)]])
    at = np.array([np.cos(a[1]), np.sin(a[1]), 0]) * c.robot["stand"] * c.rng.uniform(0.8, 1.2) + [0, 0, c.rng.uniform(-1, 0.2)]
    return dict(turn=(x @ y @ z).tolist(), at=at.tolist())


def instrument(c, form, size, name, needs=(), place="tracker", accept=None, **numbers):
    effect = dict(kind="instrument", form=form, size=size, stand=stand(c), needs=list(needs), want=(name, place), **numbers)
    return [effect | (dict(accept=accept) if accept else {})]


def circle(c):
    order = 1 if c.rng.random() < 0.5 else int(c.rng.choice([0, 2]))  # 0: the arctangent of a centre off the axis
    return instrument(c, "circle", c.logu(4, 40) * ARCSEC, "tracker_circle", order=order, phase=c.rng.uniform(0, 6.28))


def head(c):
    form = str(c.rng.choice(["sag", "sag", "vertical", "transit"]))
    return instrument(c, form, c.rng.choice([-1, 1]) * c.logu(5, 40) * ARCSEC, "tracker_elevation", index=c.rng.uniform(-1, 1), phase=c.rng.uniform(0, 6.28))


def offset(c):
    form = str(c.rng.choice(["range", "range", "cycle", "square"]))
    return instrument(c, form, c.rng.choice([-1, 1]) * c.logu(3e-5, 3e-4), "tracker_offset", wave=c.logu(0.3, 1.5), phase=c.rng.uniform(0, 6.28))


def refraction(c):
    form, t = c.rng.random(), column(c, "time")
    warm = column(c, "warm") if form < 0.5 else behind(c, c.end * c.rng.uniform(0.05, 0.2)) if form < 0.75 else 12 * (1 - np.exp(-t / (c.end * c.rng.uniform(0.15, 0.6))))
    needs = ["temp"] if form < 0.5 else ["temp", "time"] if form < 0.75 else ["time"]
    return instrument(c, "scale", c.rng.choice([-1, 1]) * c.rng.uniform(0.8e-6, 1.2e-6), "tracker_refraction", needs, state=warm)


def swing(c):
    t = column(c, "time")
    wave = np.sin(2 * np.pi * t / (c.end / c.rng.uniform(2, 6)) + c.rng.uniform(0, 6.28))
    if c.rng.random() < 0.5:
        wave = wave * np.exp(-t / (c.end * c.rng.uniform(0.3, 0.8)))
    return instrument(c, "shift", c.logu(3e-5, 1.5e-4), "unknown", ["time"], accept=("unknown", "base"), way=list(unit(c.rng.normal(0, 1, 3))), turn=[0, 0, 0], state=wave)


def knock(c):
    since, back = column(c, "time") - c.moment(), c.rng.uniform(0.3, 0.7) if c.rng.random() < 0.5 else 0.0
    step = np.where(since >= 0, 1 - back * (1 - np.exp(-np.maximum(since, 0) / (0.1 * c.end))), 0)
    turn = list(c.rng.normal(0, 0.3, 3) / c.robot["stand"])
    return instrument(c, "shift", c.logu(4e-5, 2e-4), "base_shift", ["time"], "base", ("tracker_drift", "tracker"), way=list(unit(c.rng.normal(0, 1, 3))), turn=turn, state=step)


BEYOND = dict(circle=circle, head=head, offset=offset, refraction=refraction, swing=swing, knock=knock, presliding=presliding, own_heat=own_heat,
              late_heat=late_heat, lagging_link=lagging_link, gear_load=gear_load, gear_flank=gear_flank, warm_ratio=warm_ratio, warm_spring=warm_spring,
              side_spring=side_spring, growing_gap=growing_gap, bent_link=bent_link)


def read(P, e):
    """What an instrument with an error reads, back in the base's frame; P are true points there."""
    turn, at = np.array(e["stand"]["turn"]), np.array(e["stand"]["at"])
    Q = P @ turn.T + at
    form, size = e["form"], e["size"]
    level, r = np.hypot(Q[:, 0], Q[:, 1]), np.linalg.norm(Q, axis=1)
    az, el = np.arctan2(Q[:, 1], Q[:, 0]), np.arctan2(Q[:, 2], level)
    if form == "shift":
        s = (size * e["state"])[:, None]
        return (Q + s * (np.array(e["way"]) + np.cross(e["turn"], Q)) - at) @ turn
    if form == "circle" and e["order"]:
        az = az + size * np.sin(e["order"] * az + e["phase"])
    elif form == "circle":
        az = np.arctan2(np.sin(az) + size * np.sin(e["phase"]), np.cos(az) - size * np.cos(e["phase"]))
    elif form == "sag":
        el = el + size * (e["index"] + np.cos(el))
    elif form == "vertical":
        el = el + size * np.sin(el + e["phase"])
    elif form == "transit":
        az = az + size * np.tan(el)
    elif form == "range":
        r = r + size
    elif form == "cycle":
        r = r + 0.3 * size * np.sin(2 * np.pi * r / e["wave"] + e["phase"])
    elif form == "square":
        r = r + 0.2 * size * r**2
    elif form == "scale":
        r = r * (1 + size * e["state"])
    Q = np.stack([r * np.cos(el) * np.cos(az), r * np.cos(el) * np.sin(az), r * np.sin(el)], 1)
    return (Q - at) @ turn


def scatter(rng, P, sigma, kind):
    """Errors of the instrument's coordinates (rows, 3) of the stated standard deviation."""
    z = rng.normal(0, 1, P.shape)
    if kind == "student":  # 3 degrees of freedom have variance 3
        z /= np.sqrt((rng.normal(0, 1, (3, *P.shape)) ** 2).sum(0))
    elif kind == "uneven":
        z *= np.exp(0.5 * rng.normal(0, 1, (len(P), 1)) - 0.25)
    elif kind == "wandering":
        for i in range(1, len(z)):
            z[i] = 0.9 * z[i - 1] + np.sqrt(1 - 0.81) * z[i]
    return z * sigma[:, None]


SCATTERS = ["gaussian", "student", "uneven", "wandering"]
