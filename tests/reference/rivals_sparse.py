"""Sparse regression in the manner of SINDy for rivals.py: a library of laws at every place, projected through the Jacobian.

`library` lists columns (law, place, displacement of the tool); `sparse` selects places forward, and at each place laws by
PySINDy's STLSQ and SR3 on columns that are whitened, freed of what geometry can do, and of norm one: coefficients are then in
standard deviations of the noise, and thresholds have a meaning.
"""
import warnings

import numpy as np
import pysindy

from rivals_arm import turning

FOLDS, ORDERS = 4, 30


def waves(x, orders):
    return [f(order * x) for order in orders for f in (np.sin, np.cos)]


def unit(x):
    return (x - x.min()) / max(np.ptp(x), 1e-12)


def steps(time, fit, count=15):
    """Functions of time that jump between two of the points to fit."""
    known = np.unique(time[fit])
    cuts = known[np.linspace(2, len(known) - 3, min(count, len(known) - 4)).astype(int)]
    return [(time > cut).astype(float) for cut in cuts]


def hysteresis(c, j, travel):
    """Dahl's state of a joint that went straight from row to row."""
    state, out = 0.0, []
    for way in c.move[:, j]:
        state = np.sign(way) + (state - np.sign(way)) * np.exp(-abs(way) / travel)
        out.append(state)
    return np.array(out)


def heat(c, j, cooling):
    """Warmth that a joint's travel leaves, rad."""
    state, out = 0.0, []
    for way, dt in zip(c.move[:, j], np.diff(c.time, prepend=c.time[0])):
        state = state * np.exp(-max(dt, 0) / cooling) + abs(way)
        out.append(state)
    return np.array(out)


def lagged(c, value, lag):
    state, out = value[0], []
    for x, dt in zip(value, np.diff(c.time, prepend=c.time[0])):
        state = x + (state - x) * np.exp(-max(dt, 0) / lag)
        out.append(state)
    return np.array(out)


def warmths(c):
    """What may be the temperature of the arm above its start: the logged one and its lags, or curves of time."""
    span = max(np.ptp(c.time), 1.0)
    grown = [1 - np.exp(-(c.time - c.time.min()) / (span * share)) for share in (0.15, 0.5, 2.0)]
    if c.warm is None:
        return grown
    return [c.warm - c.warm[0]] + [lagged(c, c.warm - c.warm[0], lag) for lag in (200.0, 1000.0)] + grown[1:2]


def at_joint(rigid, j):
    """(law, values) of one joint."""
    c, q, torque, d = rigid.c, rigid.c.q[:, j], rigid.torque[:, j], rigid.c.direction[:, j]
    peak = np.abs(torque).max()
    out = [("gear_cyclic", x) for x in waves(q, range(1, ORDERS + 1))]
    out += [("gear_flank", d * x) for x in waves(q, range(1, 13))]
    out += [("backlash", d), ("backlash", d * unit(c.time))]
    if c.gear is not None:
        out += [("gear_motor_cyclic", x) for x in waves(c.gear[j] * q, (1, 2))]
    if peak > 1e-3 * max(np.abs(rigid.torque).max(), 1e-9):
        t = torque / peak
        out += [("joint_compliance", t)] + [("joint_hardening", x) for x in (t * abs(t), t**3, np.tanh(t / 0.3), t / (1 + abs(t) / 0.15))]
        out += [("backlash", x) for x in (np.sign(t), np.tanh(t / 0.05), d * abs(t))]
        out += [("gear_load", t * x) for x in waves(q, range(1, 13))]
        out += [("joint_warming", t * x) for x in warmths(c)[:2]]
        if np.ptp(c.payload) > 0:
            out.append(("payload_error", rigid.payload_torque[:, j] / peak))
    out += [("zero_shift", x) for x in steps(c.time, rigid.fit)]
    out += [("joint_warming", x * y) for x in warmths(c) for y in (1, q)]
    for cooling in (150.0, 600.0):
        out += [("joint_warming", heat(c, j, cooling) * y) for y in (1, q)]
    out += [("presliding", hysteresis(c, j, np.radians(travel))) for travel in (1.0, 3.0, 9.0)]
    for i in range(c.n):
        if i != j:
            out += [("cable_drag", x) for x in (np.sin(c.q[:, i]), np.cos(c.q[:, i]), np.sin(q + c.q[:, i]), np.cos(q + c.q[:, i]))]
            out.append(("unknown", q * c.q[:, i]))
    out += [("unknown", x) for x in (q**2, q**3, abs(q - np.median(q)))]
    centres = np.quantile(q, np.linspace(0.1, 0.9, 7))
    return out + [("unknown", np.exp(-(((q - x) / 0.25)**2))) for x in centres]


def library(rigid):
    """[(law, place, displacement of the tool (rows, 3))]."""
    c, out = rigid.c, []
    add = lambda law, place, column: out.append((law, place, column))
    for j in range(c.n):
        here = f"joint {j + 1}"
        for law, value in at_joint(rigid, j):
            add(law, "tool" if law == "payload_error" else here, rigid.joints[j] * value[:, None])
        across = np.linalg.svd(c.axes[j][None])[2][1:]
        for e in across:
            for value in waves(c.q[:, j], (1, 2)):
                twist = turning(c.points[j], np.outer(value, e))
                add("axis_wobble", here, (rigid.stations[j + 1] @ twist[..., None])[..., 0])
    for k in range(1, c.n):
        here, end = f"link {k}", c.points[k]
        span = end - c.points[k - 1]
        length = np.linalg.norm(span)
        if length < 50:
            continue
        moment = rigid.own_axes(k, rigid.moment(k + 1, end))
        for value in warmths(c):
            add("thermal_growth", here, (rigid.stations[k] @ np.concatenate([span, np.zeros(3)])) * value[:, None])
        for e in np.linalg.svd((span / length)[None])[2][1:]:
            bend = turning((end + c.points[k - 1]) / 2, np.outer(moment @ e, e))
            add("link_compliance", here, (rigid.stations[k] @ bend[..., None])[..., 0])
            for value in warmths(c)[:2]:
                bow = turning(c.points[k - 1], np.outer(value, e))
                add("unknown", here, (rigid.stations[k] @ bow[..., None])[..., 0])
    mounts(rigid, add)
    instrument(rigid, add)
    return out


def mounts(rigid, add):
    c, foot = rigid.c, rigid.moment(0, np.zeros(3))
    for axis in range(2):
        tilt = np.zeros((c.count, 6))
        tilt[:, 3 + axis] = foot[:, axis]
        add("base_compliance", "base", (rigid.stations[0] @ tilt[..., None])[..., 0])
    t = unit(c.time)
    slow = [t, t**2, *(1 - np.exp(-t / share) for share in (0.1, 0.4))]
    for axis in range(6):
        column = rigid.stations[0][..., axis]
        for value in steps(c.time, rigid.fit):
            add("base_shift", "base", column * value[:, None])
        for value in slow:
            add("tracker_drift", "tracker", column * value[:, None])
        for value in waves(2 * np.pi * t, (1, 2, 3, 5, 8)):
            add("unknown", "base", column * value[:, None])
        if axis < 3:
            for value in steps(c.time, rigid.fit):
                add("tool_shift", "tool", rigid.stations[c.n][..., axis] * value[:, None])
    late = np.einsum("jni,nj->ni", np.array(rigid.joints), c.move)
    add("joint_log_lag", "recording", late)


def beam(rigid):
    """Range (m), azimuth, elevation and their directions at each point as foretold, from the origin of the recording."""
    distance = np.linalg.norm(rigid.tip, axis=1)
    azimuth, elevation = np.arctan2(rigid.tip[:, 1], rigid.tip[:, 0]), np.arcsin(rigid.tip[:, 2] / distance)
    along = rigid.tip / distance[:, None]
    aside = np.stack([-np.sin(azimuth), np.cos(azimuth), 0 * azimuth], -1)
    return distance / 1e3, azimuth, elevation, along, aside, np.cross(along, aside)


def instrument(rigid, add):
    c = rigid.c
    distance, azimuth, elevation, along, aside, upward = beam(rigid)
    level = distance * np.cos(elevation)
    for value in waves(azimuth, (1, 2)):
        add("tracker_circle", "tracker", aside * (level * value)[:, None])
    for value in [np.ones(c.count), *waves(elevation, (1, 2))]:
        add("tracker_elevation", "tracker", upward * (distance * value)[:, None])
    add("tracker_elevation", "tracker", aside * (distance * np.sin(elevation))[:, None])
    for value in [np.ones(c.count), distance**2, *waves(2 * np.pi * distance, (1, 2))]:
        add("tracker_offset", "tracker", along * value[:, None])
    for value in warmths(c):
        add("tracker_refraction", "tracker", along * (distance * value)[:, None])


class Bench:
    """Columns and target freed of geometry and of what was selected: on all rows to fit, and fold by fold."""

    def __init__(self, rigid, columns, rng):
        self.rigid, self.columns = rigid, columns
        fit = rigid.fit
        self.x = rigid.whitened(columns)[fit]
        self.y = rigid.whitened(rigid.residual)[fit]
        self.g = rigid.whitened(rigid.geometry)[fit]
        poses = np.unique(rigid.c.pose[fit])
        part = dict(zip(rng.permutation(poses), np.arange(len(poses)) % FOLDS))
        self.fold = np.array([part[p] for p in rigid.c.pose[fit]])
        self.rng = rng

    def nuisance(self, taken):
        return np.concatenate([self.g, self.x[..., taken]], -1)

    def freed(self, taken):
        """What learns from all rows, and from all but each fold."""
        every = np.ones(len(self.fold), bool)
        g = self.nuisance(taken)
        g = g / (np.sqrt((g**2).sum((0, 1))) + 1e-300)
        return [Freed(self, g, rows, test) for rows, test in [(every, every)] + [(self.fold != k, self.fold == k) for k in range(FOLDS)]]


class Freed:
    """Geometry and what was selected are learnt from `rows`, and taken off the rows to learn from and to judge by."""

    def __init__(self, bench, g, rows, test):
        self.x, self.rows, self.test = bench.x, rows, test
        self.g, self.far = g[rows].reshape(-1, g.shape[-1]), g[test].reshape(-1, g.shape[-1])
        u, s, v = np.linalg.svd(self.g, full_matrices=False)
        keep = s > 1e-6 * s[0]
        self.back = (v[keep].T / s[keep]) @ u[:, keep].T
        y = bench.y[rows].ravel()
        self.y, self.far_y = y - self.g @ (self.back @ y), bench.y[test].ravel() - self.far @ (self.back @ y)

    def of(self, ids):
        """These columns on both kinds of rows; what geometry makes up for is nought."""
        ids = np.asarray(ids, int)
        x, far = (self.x[..., ids][rows].reshape(3 * rows.sum(), len(ids)) for rows in (self.rows, self.test))
        c = self.back @ x
        left = x - self.g @ c
        size = np.sqrt((left**2).sum(0))
        size = np.where(size <= 1e-3 * np.sqrt((x**2).sum(0)), np.inf, size)
        return left / size, self.y, (far - self.far @ c) / size, self.far_y, self.test


def least(x, y):
    return np.linalg.lstsq(x, y, rcond=1e-8)[0]


def chosen(optimizer, x, y):
    """Indices of the columns that an optimizer of PySINDy keeps; the same normal equations in fewer rows."""
    q, r = np.linalg.qr(x)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        optimizer.fit(r, (q.T @ y)[:, None])
    return np.flatnonzero(optimizer.coef_[0])


def optimizers(x, y):
    """PySINDy's, with thresholds in standard deviations and as shares of the largest correlation."""
    top = np.abs(x.T @ y).max()
    if x.shape[1] <= 4:
        yield lambda: pysindy.STLSQ(threshold=min(2.0, 0.5 * top), alpha=1e-3, max_iter=10)
        return
    for threshold in sorted({3.0, 5.0, 9.0, 0.15 * top, 0.35 * top, 0.7 * top}):
        if threshold <= top:
            yield lambda: pysindy.STLSQ(threshold=threshold, alpha=0.05, max_iter=10)
    for share in (0.2, 0.5):
        weight = max(share * top, 3.0)**2 / 2
        yield lambda: pysindy.SR3(reg_weight_lam=weight, regularizer="L0", relax_coeff_nu=1.0, max_iter=30)


def judged(folds, pick):
    """Squared errors row by row under fits without them, for columns that `pick` chooses in each."""
    out = None
    for k, (x, y, xt, yt, test) in enumerate(folds):
        out = np.zeros(len(test)) if out is None else out
        ids = pick(k, x, y)
        left = yt - (xt[:, ids] @ least(x[:, ids], y) if len(ids) else 0)
        out[test] = (left.reshape(-1, 3)**2).sum(1)
    return out


def gain(before, after):
    """How much smaller held-in errors are, and in standard errors."""
    d = before - after
    return d.sum(), d.sum() / max(d.std() * np.sqrt(len(d)), 1e-12)


def at_group(freed, ids):
    """The best set of a group's columns by cross-validation: (errors, set)."""
    folds = [part.of(ids) for part in freed[1:]]
    x, y = freed[0].of(ids)[:2]
    live = np.flatnonzero(np.abs(x).max(0) > 0)
    best = None
    for make in optimizers(x[:, live], y) if len(live) else ():
        kept = live[chosen(make(), x[:, live], y)]
        if not 0 < len(kept) <= len(y) // 6:
            continue
        errors = judged(folds, lambda k, x, y: live[chosen(make(), x[:, live], y)])
        if best is None or errors.sum() < best[0].sum():
            best = errors, ids[kept]
    return best


def promise(part, ids):
    """The most that a group could explain, in variances of the noise; and that less what chance gives so many columns."""
    x, y = part.of(ids)[:2]
    x = x[:, np.abs(x).max(0) > 0]
    most = y @ y - ((y - x @ least(x, y))**2).sum() if x.shape[1] else 0.0
    return most, most - x.shape[1]


def without(bench, parts, certain):
    """Leaves out one by one what the others make up for: held-in errors grow by less than `certain` standard errors."""
    while len(parts) > 1:
        everything = np.concatenate(list(parts.values()))
        freed = [part.of(everything) for part in bench.freed(np.array([], int))[1:]]
        full = judged(freed, lambda k, x, y: np.arange(len(everything)))
        costs = {}
        for name, ids in parts.items():
            rest = np.flatnonzero(~np.isin(everything, ids))
            costs[name] = gain(judged(freed, lambda k, x, y: rest), full)[1]
        least_name = min(costs, key=costs.get)
        if costs[least_name] > certain:
            break
        parts = {name: ids for name, ids in parts.items() if name != least_name}
    return parts


def plain(rigid):
    """What anybody would try first: polynomials, waves and products of a joint's own variables, at joints alone."""
    c, out = rigid.c, []
    warm = c.warm if c.warm is not None else unit(c.time)
    for j in range(c.n):
        q, d, t = c.q[:, j], c.direction[:, j], unit(c.time)
        load = rigid.torque[:, j] / max(np.abs(rigid.torque[:, j]).max(), 1e-9)
        terms = [("unknown", x) for x in (q**2, q**3)] + [("gear_cyclic", x) for x in waves(q, range(1, ORDERS + 1))]
        terms += [("joint_compliance", load)] + [("joint_hardening", x) for x in (load * abs(load), load**2, load**3)]
        terms += [("backlash", x) for x in (d, d * load)] + [("zero_shift", x) for x in (t, t**2, t**3)]
        terms += [("joint_warming", warm * x) for x in (1, q, load)]
        terms += [("gear_load", load * x) for x in waves(q, range(1, 5))] + [("gear_flank", d * x) for x in waves(q, range(1, 5))]
        terms += [("cable_drag", f(c.q[:, i])) for i in range(c.n) if i != j for f in (np.sin, np.cos)]
        out += [(law, f"joint {j + 1}", rigid.joints[j] * x[:, None]) for law, x in terms]
    return out


def sparse(rigid, rng, laws=library, certain=3.0, rounds=8):
    """Findings [(law, place)] strongest first, and the displacement of the tool that they and geometry explain."""
    listed = laws(rigid)
    members = {}
    for i, (law, place, _) in enumerate(listed):
        members.setdefault((law, place), []).append(i)
    members = {name: np.array(ids) for name, ids in members.items()}
    bench = Bench(rigid, np.stack([column for _, _, column in listed], -1), rng)
    parts = {}
    for _ in range(rounds):
        freed = bench.freed(np.concatenate([np.array([], int), *parts.values()]).astype(int))
        before = judged([part.of([]) for part in freed[1:]], lambda k, x, y: [])
        promises = {name: promise(freed[0], ids) for name, ids in members.items()}
        found, most = {}, 0.0
        for name in sorted(promises, key=promises.get, reverse=True):
            at_most, beyond_chance = promises[name]
            # Three standard errors are some 36 variances; and what explains half of what another foretells does not win.
            group = None if beyond_chance < 20 or at_most < most / 2 else at_group(freed, members[name])
            if group is not None and gain(before, group[0])[1] > certain:
                found[name] = group
                most = max(most, gain(before, group[0])[0])
        if not found:
            break
        # The fewest columns of those that foretell as well as the best, within one standard error.
        best = min((errors for errors, _ in found.values()), key=np.sum)
        name = min(found, key=lambda name: (gain(found[name][0], best)[1] > 1, len(found[name][1]), found[name][0].sum()))
        kept = found[name][1]
        parts[name] = np.union1d(parts.get(name, []), kept).astype(int)
    parts = without(bench, parts, certain)
    taken = np.concatenate([np.array([], int), *parts.values()]).astype(int)
    size = {name: np.abs(explained(rigid, bench.columns[..., taken], ids, taken)).sum() for name, ids in parts.items()}
    findings = sorted(parts, key=size.get, reverse=True)
    return findings, explained(rigid, bench.columns[..., taken])


def explained(rigid, columns, only=None, taken=None):
    """What geometry and these columns displace, fitted together; or what some of the columns do of it."""
    both = np.concatenate([rigid.geometry, columns], -1)
    a, y = rigid.whitened(both)[rigid.fit].reshape(-1, both.shape[-1]), rigid.whitened(rigid.residual)[rigid.fit].ravel()
    size = np.linalg.norm(a, axis=0) + 1e-300
    x = np.linalg.lstsq(a / size, y, rcond=1e-7)[0] / size
    if only is not None:
        x = x * np.isin(np.arange(len(x)), rigid.geometry.shape[-1] + np.flatnonzero(np.isin(taken, only)))
    return both @ x
