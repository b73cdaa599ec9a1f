"""A Gaussian process and symbolic regression for rivals.py: one unknown function of a place's own variables at a time.

A channel is a place with the displacement of the tool that a unit of it makes, and the variables that a function there may have. Both
methods learn f in `residual = direction f(variables) + geometry + noise` with geometry free at the same time: in the sums
`M = A'A`, `b = A'y` of the whitened columns A = direction, freed of geometry. Functions found before count as geometry.
"""
import warnings

import numpy as np
from gplearn.fitness import make_fitness
from gplearn.genetic import SymbolicRegressor
from scipy.linalg import lu_factor, lu_solve
from scipy.optimize import minimize
from sklearn.gaussian_process.kernels import RBF, ConstantKernel

from rivals_arm import turning
from rivals_sparse import beam, explained, gain, unit


class Channel:
    def __init__(self, kind, place, direction, variables):
        self.kind, self.place, self.direction = kind, place, direction
        alive = {name: x for name, x in variables.items() if x is not None and np.ptp(x) > 1e-9}
        self.names, self.values = list(alive), np.stack(list(alive.values()), -1) if alive else None
        if alive:
            self.scaled = (self.values - self.values.mean(0)) / self.values.std(0)


def channels(rigid):
    c = rigid.c
    t, warm = unit(c.time), c.warm
    act = lambda station, twist: (rigid.stations[station] @ twist[..., None])[..., 0]
    one = np.ones(c.count)
    out = []
    for j in range(c.n):
        q, here = c.q[:, j], f"joint {j + 1}"
        own = {"q": q, "load": rigid.torque[:, j], "dir": c.direction[:, j], "time": t, "warm": warm, "move": c.move[:, j]}
        if np.abs(own["load"]).max() < 1e-3 * np.abs(rigid.torque).max():
            del own["load"]
        if c.gear is not None:
            own |= {"motor sin": np.sin(c.gear[j] * q), "motor cos": np.cos(c.gear[j] * q)}
        own |= {f"q{i + 1}": c.q[:, i] for i in (j - 1, j + 1) if 0 <= i < c.n}
        out.append(Channel("joint", here, rigid.joints[j], own))
        end = c.points[j + 1] if j + 1 < c.n else c.tool
        moment = rigid.own_axes(j + 1, rigid.moment(j + 2, end) if j + 1 < c.n else rigid.moment(j + 1, c.points[j]))
        for e in np.linalg.svd(c.axes[j][None])[2][1:]:
            variables = {"q": q, "moment": moment @ e, "time": t, "warm": warm}
            out.append(Channel("tilt", here, act(j + 1, turning(c.points[j], np.outer(one, e))), variables))
        span = end - c.points[j]
        if j + 1 < c.n and np.linalg.norm(span) > 50:
            grown = act(j + 1, np.outer(one, np.concatenate([span, np.zeros(3)])))
            out.append(Channel("growth", f"link {j + 1}", grown, {"time": t, "warm": warm}))
    foot = rigid.moment(0, np.zeros(3))
    for axis in range(6):
        own = {"time": t, "warm": warm} | ({"moment": foot[:, axis - 3]} if axis in (3, 4) else {})
        out.append(Channel("stand", "base", rigid.stations[0][..., axis], own))
    for axis in range(3):
        out.append(Channel("tool", "tool", rigid.stations[c.n][..., axis], {"time": t, "payload": c.payload}))
    distance, azimuth, elevation, along, aside, upward = beam(rigid)
    own = {"azimuth": azimuth, "elevation": elevation, "range": distance, "time": t, "warm": warm}
    level = (distance * np.cos(elevation))[:, None]
    return out + [Channel("tracker", "tracker", d, own) for d in (aside * level, upward * distance[:, None], along * distance[:, None])]


class Sums:
    """M and b of one channel on some rows, with geometry and found functions free."""

    def __init__(self, rigid, rows, found):
        self.rows, self.rigid = rows, rigid
        g = rigid.whitened(np.concatenate([rigid.geometry, *[f[..., None] for f in found]], -1))[rows]
        g = g.reshape(-1, g.shape[-1])
        u, s, _ = np.linalg.svd(g / (np.linalg.norm(g, axis=0) + 1e-300), full_matrices=False)
        self.u = u[:, s > 1e-6 * s[0]]
        y = rigid.whitened(rigid.residual)[rows].ravel()
        self.y = y - self.u @ (self.u.T @ y)

    def of(self, direction):
        a = self.rigid.whitened(direction)[self.rows]
        shadow = np.einsum("ia,iar->ir", a, self.u.reshape(*a.shape, -1))
        return np.diag((a**2).sum(1)) - shadow @ shadow.T, (a * self.y.reshape(a.shape)).sum(1)


def parts(rigid, rng, share):
    """Rows to fit, split by poses."""
    poses = np.unique(rigid.c.pose[rigid.fit])
    some = rng.permutation(poses)[:int(share * len(poses))]
    learn = rigid.fit & np.isin(rigid.c.pose, some)
    return np.flatnonzero(learn), np.flatnonzero(rigid.fit & ~learn)


def left_over(rigid, learn, test, found):
    """Squared errors row by row of `test` when geometry and found functions are fitted to `learn`."""
    both = np.concatenate([rigid.geometry, *[f[..., None] for f in found]], -1)
    a, y = rigid.whitened(both), rigid.whitened(rigid.residual)
    x = a[learn].reshape(-1, a.shape[-1])
    size = np.linalg.norm(x, axis=0) + 1e-300
    beta = np.linalg.lstsq(x / size, y[learn].ravel(), rcond=1e-7)[0] / size
    return ((y[test] - a[test] @ beta)**2).sum(1)


# ---- Gaussian process

class Process:
    """f ~ GP(0, amplitude RBF with a length scale a variable), by marginal likelihood with geometry free."""

    def __init__(self, x, m, b, steps, short):
        self.x, self.m, self.b = x, m, b
        size = max(b @ b / max(b @ m @ b, 1e-300), 1e-30)
        first = np.full(x.shape[1], 1.5 if not short else 3.0)
        if short:
            first[0] = 0.25
        start = ConstantKernel((b * size).var() + 1e-300, (1e-30, 1e10)) * RBF(first, (0.03, 300.0))
        low, high = start.bounds.T
        low[0], high[0] = start.theta[0] - 12, start.theta[0] + 12
        self.kernel = start
        found = minimize(self.loss, start.theta, jac=True, method="L-BFGS-B", bounds=list(zip(low, high)), options={"maxiter": steps})
        self.kernel, self.value = start.clone_with_theta(found.x), found.fun

    def loss(self, theta):
        k, slope = self.kernel.clone_with_theta(theta)(self.x, eval_gradient=True)
        system = np.eye(len(k)) + self.m @ k
        factor = lu_factor(system, check_finite=False)
        alpha, inner = lu_solve(factor, self.b), lu_solve(factor, self.m)
        weight = np.outer(alpha, alpha) - inner
        value = 0.5 * (np.log(np.abs(np.diag(factor[0]))).sum() - self.b @ k @ alpha)
        return value, -0.5 * np.einsum("ij,ijk->k", weight, slope)

    def at(self, x, m=None, b=None, rows=slice(None)):
        """The function at x, learnt from these sums at the process's own rows (or some of them)."""
        m, b = (self.m, self.b) if m is None else (m, b)
        own = self.x[rows]
        return self.kernel(x, own) @ np.linalg.solve(np.eye(len(b)) + m @ self.kernel(own), b)


def process_round(rigid, all_channels, found, rng, certain, last):
    """The channel whose process foretells rows best that it has not seen: (gain, channel, f, scores)."""
    few = np.sort(rng.permutation(np.flatnonzero(rigid.fit))[:90])
    sums = Sums(rigid, few, found)
    scores = {}
    for i in last:
        channel = all_channels[i]
        m, b = sums.of(channel.direction)
        trials = [Process(channel.scaled[few], m, b, 12, short) for short in ((False, True) if channel.kind == "joint" else (False,))]
        scores[i] = min(trial.value for trial in trials)
    best = None
    rows = np.flatnonzero(rigid.fit)
    folds = [parts(rigid, rng, 0.75) for _ in range(4)]
    for i in sorted(scores, key=scores.get)[:4]:
        channel = all_channels[i]
        m, b = Sums(rigid, rows, found).of(channel.direction)
        trials = [Process(channel.scaled[rows], m, b, 25, short) for short in ((False, True) if channel.kind == "joint" else (False,))]
        process = min(trials, key=lambda trial: trial.value)
        before, after = [], []
        for learn, test in folds:
            m, b = Sums(rigid, learn, found).of(channel.direction)
            f = process.at(channel.scaled, m, b, np.isin(rows, learn))
            before.append(left_over(rigid, learn, test, found))
            after.append(left_over(rigid, learn, test, [*found, channel.direction * f[:, None]]))
        amount, sure = gain(np.concatenate(before), np.concatenate(after))
        sure /= np.sqrt(sum(len(x) for x in after) / len(rows))
        if sure > certain and (best is None or amount > best[0]):
            best = amount, channel, process.at
    return best and (best[1], best[2]), scores


def gaussian_process(rigid, rng, certain=3.0, rounds=4, places=None):
    """At any place, or only at some: joints tilt, too, and the link behind a joint is at its place."""
    return forward(rigid, rng, certain, rounds, process_round, places)


# ---- symbolic regression

def evolve(channel, rows, m, b, population, generations, seed, price):
    """A formula by gplearn; its fitness is the share of the residual that its best multiple explains with geometry free."""

    def explains(y, f, w):
        if len(f) != len(b):
            return 0.0
        f = f - f.mean()
        power = f @ m @ f
        return (b @ f)**2 / power if np.isfinite(power) and power > 1e-6 * (f @ (np.diag(m) * f)) > 0 else 0.0

    model = SymbolicRegressor(
        population_size=population, generations=generations, tournament_size=max(population // 40, 5), const_range=(-6.0, 6.0),
        init_depth=(2, 4), function_set=("add", "sub", "mul", "div", "sin", "cos", "abs"), random_state=seed,
        metric=make_fitness(function=explains, greater_is_better=True), parsimony_coefficient=price, p_crossover=0.7,
        p_subtree_mutation=0.1, p_hoist_mutation=0.05, p_point_mutation=0.1)
    with warnings.catch_warnings(), np.errstate(all="ignore"):
        warnings.simplefilter("ignore")
        model.fit(channel.values[rows], b)
    return model


def symbols_round(rigid, all_channels, found, rng, certain, last):
    learn, test = parts(rigid, rng, 0.65)
    sums = Sums(rigid, learn, found)
    before = left_over(rigid, learn, test, found)
    scores, seed = {}, int(rng.integers(2**31))
    for i in last:
        m, b = sums.of(all_channels[i].direction)
        scores[i] = -evolve(all_channels[i], learn, m, b, 150, 6, seed, 1.0).run_details_["best_fitness"][-1]
    best = None
    for i in sorted(scores, key=scores.get)[:3]:
        channel = all_channels[i]
        m, b = sums.of(channel.direction)
        for price in (0.5, 4.0):
            model = evolve(channel, learn, m, b, 800, 12, seed, price)
            if not np.isfinite(model.predict(channel.values)).all():
                continue
            f = model.predict(channel.values)
            amount, sure = gain(before, left_over(rigid, learn, test, [*found, channel.direction * f[:, None]]))
            if sure > certain and (best is None or amount > best[0]):
                best = amount, channel, model
    return best and (best[1], lambda x, model=best[2], channel=best[1]: model.predict(x * channel.values.std(0) + channel.values.mean(0))), scores


def symbolic(rigid, rng, certain=3.0, rounds=4):
    return forward(rigid, rng, certain, rounds, symbols_round)


# ---- both

def forward(rigid, rng, certain, rounds, one_round, places=None):
    """Adds functions while rows that were not used to learn them are foretold better."""
    all_channels = [channel for channel in channels(rigid) if channel.names and (places is None or is_at(channel.place, places))]
    found, findings, last = [], [], range(len(all_channels))
    for _ in range(rounds):
        step, scores = one_round(rigid, all_channels, found, rng, certain, last)
        if step is None:
            break
        channel, function = step
        f = function(channel.scaled)
        name = named(channel, importance(channel, function, rng), f, rigid.fit)
        if name not in findings:
            findings.append(name)
        found.append(channel.direction * f[:, None])
        last = sorted(scores, key=scores.get)[:12]
    return findings, explained(rigid, np.stack(found, -1) if found else np.zeros((*rigid.residual.shape, 0)))


def is_at(place, places):
    """Whether a channel acts at one of some places; what acts along a link acts at the joints that it joins."""
    number = lambda name: {int(part) for part in name.partition(" ")[2].split("-") if part.isdigit()}
    return place in places or any(name.startswith("link") and number(place) and min(number(name)) <= min(number(place)) <= max(number(name)) + 1 for name in places)


def importance(channel, function, rng):
    """How far the function moves when one variable is shuffled, over its own spread."""
    f = function(channel.scaled)
    out = {}
    for i, name in enumerate(channel.names):
        x = channel.scaled.copy()
        x[:, i] = rng.permutation(x[:, i])
        out[name] = float(((function(x) - f)**2).mean() / max(2 * f.var(), 1e-300))
    if "motor sin" in out:
        out["motor"] = out.pop("motor sin") + out.pop("motor cos")
    return out


def share(f, *columns):
    """Of a function's spread that these columns and a constant make up for."""
    a = np.stack([*columns, np.ones(len(f))], -1)
    return 1 - ((f - a @ np.linalg.lstsq(a, f, rcond=1e-9)[0])**2).sum() / max(((f - f.mean())**2).sum(), 1e-300)


def jumps(f, t):
    """Whether a step describes the function of time better than a line or a bend."""
    cuts = np.quantile(t, np.linspace(0.05, 0.95, 40))
    return max(share(f, (t > cut).astype(float)) for cut in cuts) > max(share(f, t), share(f, t, t**2) - 0.05)


def named(channel, weights, f, rows):
    """The law that a person would read from a function: its important variables, and its shape in them."""
    f = f[rows]
    x = {name: channel.values[rows, i] for i, name in enumerate(channel.names)}
    main = {name for name, weight in weights.items() if weight > 0.25} or {max(weights, key=weights.get)}
    first = max(weights, key=weights.get)
    here = channel.place
    if channel.kind == "joint":
        for both, law in (({"load", "q"}, "gear_load"), ({"dir", "q"}, "gear_flank"), ({"load", "warm"}, "joint_warming"), ({"q", "warm"}, "joint_warming"),
                          ({"load", "time"}, "joint_warming"), ({"dir", "time"}, "backlash"), ({"dir", "load"}, "backlash")):
            if both <= main:
                return law, here
        if first == "load":
            line, sign = share(f, x["load"]), share(f, np.sign(x["load"]))
            return ("joint_compliance" if line > 0.985 else "backlash" if sign > line else "joint_hardening"), here
        if first == "q":
            wave = max(share(f, np.sin(order * x["q"]), np.cos(order * x["q"])) for order in range(1, 49))
            return ("gear_cyclic" if wave > 0.5 else "unknown"), here
        if first == "time":
            return ("zero_shift" if jumps(f, x["time"]) else "joint_warming"), here
        return {"dir": "backlash", "move": "presliding", "warm": "joint_warming", "motor": "gear_motor_cyclic"}.get(first, "cable_drag"), here
    if channel.kind == "tilt":
        link = here.replace("joint", "link")
        return {"q": ("axis_wobble", here), "moment": ("link_compliance", link)}.get(first, ("unknown", link))
    if channel.kind == "growth":
        return "thermal_growth", here
    if channel.kind == "stand":
        if first == "moment":
            return "base_compliance", "base"
        return ("base_shift", "base") if first == "time" and jumps(f, x["time"]) else ("tracker_drift", "tracker")
    if channel.kind == "tool":
        return ("tool_shift" if first == "time" else "payload_error"), "tool"
    laws = {"azimuth": "tracker_circle", "elevation": "tracker_elevation", "range": "tracker_offset", "warm": "tracker_refraction"}
    return laws.get(first, "tracker_drift"), "tracker"
