"""Recordings with concealed effects, made by MuJoCo: an outside judge of what `calib diagnose` says.

    python3 -m venv venv && venv/bin/pip install "mujoco<4" numpy
    venv/bin/python tests/reference/mujoco_maker.py OUT_DIR --cases 20 --seed 7 --family null

Arms are rigid bodies on hinges in series: a driven one, elastic ones for gears, flexures inside links, the floor. Each pose is the
engine's static equilibrium under gravity, springs and tendons, so effects emerge; none is a column of a regression. Every arm has
manufacturing errors (axes, points, zeros, ratios, couplings). A case folder holds robot.json, controller.csv and tracker.csv, the
secret truth.json, and want.json with the effects' names (`accept` lists sets that the recording cannot tell from it).
`--family beyond` draws instruments, memory and interactions (mujoco_beyond.py) in turn, with short moves, a swinging temperature, an arm of
five joints, too, and a tracker that scatters in one of four ways. Robot files hold hinges only, so no arm stands on a track.
Effects too small to matter are drawn larger: L = sum of squares / noise variance, after rigid geometry has absorbed what it can, is at
least `--visible`, and stands in truth.json. Same seed, same bytes. Lengths mm in files, m in here; angles deg in files, rad in here.
"""
import argparse
import csv
import itertools
import json
import pathlib

from mujoco_arm import Arm, noise_sigma, np, unit
from mujoco_beyond import BEYOND, SCATTERS, scatter
from mujoco_effects import IN_TIME, OPEN, SINGLE, conceal, positions

X, Y, Z = [1, 0, 0], [0, 1, 0], [0, 0, 1]
NY, NZ = [0, -1, 0], [0, 0, -1]

# Nominal arms: axes and points at the zero pose; `limits` deg, `stand` distance of the tracker in m, `fine` size of the ratios' errors.
ROBOTS = {
    "heavy6": dict(  # 210 kg, spherical wrist, wrist motors behind axis 3
        axes=[Z, NY, NY, X, NY, X], points=[[0, 0, 0], [312, 0, 0], [312, 0, 1075], [640, 0, 1310], [1594, 0, 1310], [1700, 0, 1310]],
        tool=[1854, 50, 1340], mass=[340, 140, 160, 55, 35, 14],
        com=[[150, 0, -120], [312, 60, 380], [112, 0, 1310], [850, 0, 1310], [1614, 0, 1310], [1774, 0, 1310]],
        ratio=[213, 214, 203, 192, 178, 117], kt=[0.98, 0.95, 0.91, 0.7, 0.7, 0.6], payload=210, payload_com=[140, -30, 10],
        coupling=[[5, 4]], limits=[(-120, 120), (-50, 72), (-62, 60), (-160, 160), (-110, 110), (-170, 170)], stand=3.4, fine=4e-4),
    "offset6": dict(  # desktop arm, offset wrist, zero pose stretched out along x
        axes=[Z, Y, Y, Y, NZ, Y], points=[[0, 0, 0], [0, 0, 165], [441, 0, 165], [846, 0, 165], [846, 118, 165], [846, 118, 67]],
        tool=[858, 207, 82], mass=[4.1, 8.2, 3.3, 1.6, 1.5, 0.35],
        com=[[0, 12, 140], [190, 125, 165], [620, 25, 165], [846, 80, 160], [846, 118, 95], [846, 185, 67]],
        ratio=[121, 121, 101, 101, 101, 101], kt=[0.11, 0.11, 0.1, 0.085, 0.085, 0.085], payload=6, payload_com=[15, 50, -20],
        coupling=[], limits=[(-165, 165), (-150, -20), (-140, 140), (-165, 165), (-165, 165), (-170, 170)], stand=1.7, fine=1e-4),
    "seven": dict(  # redundant arm, 14 kg
        axes=[Z, Y, Z, NY, Z, Y, Z], points=[[0, 0, 0], [0, 0, 325], [0, 0, 510], [0, 0, 735], [0, 0, 930], [0, 0, 1125], [0, 0, 1240]],
        tool=[34, 12, 1282], mass=[5.6, 5.2, 4.3, 3.9, 2.9, 2.2, 0.7],
        com=[[0, -15, 190], [0, 35, 390], [0, 22, 570], [0, -28, 790], [0, -12, 950], [0, 8, 1130], [0, 0, 1250]],
        ratio=[160, 160, 160, 160, 100, 160, 160], kt=[0.16, 0.16, 0.14, 0.14, 0.1, 0.1, 0.1], payload=9, payload_com=[-12, 18, 55],
        coupling=[], limits=[(-160, 160), (-105, 105), (-160, 160), (-110, 110), (-160, 160), (-110, 110), (-165, 165)], stand=1.6, fine=1e-4),
    "medium6": dict(  # 20 kg, 1.4 m, in-line wrist, zero pose with the upper arm upright
        axes=[Z, Y, Y, X, Y, X], points=[[0, 0, 0], [165, 0, 470], [165, 0, 1080], [420, 0, 1205], [815, 0, 1205], [870, 0, 1205]],
        tool=[925, -38, 1228], mass=[68, 34, 41, 13, 7, 1.8],
        com=[[60, 0, 330], [170, -75, 760], [150, 20, 1190], [600, 5, 1205], [830, 0, 1205], [890, 0, 1205]],
        ratio=[141, 153, 129, 85, 81, 51], kt=[0.42, 0.44, 0.4, 0.21, 0.2, 0.2], payload=20, payload_com=[70, 20, -35],
        coupling=[[4, 3], [5, 4]], limits=[(-150, 150), (-60, 80), (-100, 60), (-165, 165), (-115, 115), (-170, 170)], stand=2.3, fine=3e-4),
    "forearm6": dict(  # 60 kg, 2.1 m, heavy forearm, the reflector on axis 6
        axes=[Z, NY, Y, X, NY, X], points=[[0, 0, 0], [260, 0, 565], [260, 0, 1330], [700, 0, 1490], [1290, 0, 1490], [1390, 0, 1490]],
        tool=[1485, 0, 1490], mass=[210, 95, 155, 48, 22, 6],
        com=[[90, 10, 410], [260, 110, 900], [395, -25, 1475], [1010, 0, 1490], [1310, 0, 1490], [1420, 0, 1490]],
        ratio=[179, 185, 171, 140, 126, 91], kt=[0.8, 0.85, 0.8, 0.5, 0.5, 0.45], payload=60, payload_com=[110, 25, 45],
        coupling=[[5, 4]], limits=[(-140, 140), (-70, 55), (-55, 95), (-160, 160), (-105, 105), (-170, 170)], stand=3.0, fine=3e-4),
}
# Beyond the list only: arms whose cases were drawn before stay as they were.
FIVE = {
    "five": dict(  # 8 kg, no turn of the forearm
        axes=[Z, Y, Y, Y, X], points=[[0, 0, 0], [140, 0, 390], [140, 0, 890], [720, 0, 960], [720, 0, 960]],
        tool=[865, 24, 975], mass=[48, 27, 17, 6, 1.6], com=[[80, 0, 240], [150, 35, 600], [300, -15, 930], [760, 0, 960], [835, 0, 960]],
        ratio=[141, 161, 121, 101, 81], kt=[0.35, 0.35, 0.3, 0.2, 0.18], payload=8, payload_com=[40, 10, -15],
        coupling=[], limits=[(-165, 165), (-60, 80), (-80, 65), (-115, 115), (-170, 170)], stand=2.0, fine=2e-4),
}
ROBOTS = {name: dict(robot, name=name) for name, robot in ROBOTS.items()}
FIVE = {name: dict(robot, name=name) for name, robot in FIVE.items()}


def record(rng, robot, count, span, jitter, repeats, beyond=False):
    """Rows as the arm lived them: joints the controller logged, payload, time, warm-up, direction and length of the last move."""
    n, limits = len(robot["axes"]), np.radians(robot["limits"])
    first = count // 3
    q = rng.uniform(limits[:, 0], limits[:, 1], (count, n))
    payload = np.r_[np.zeros(first), np.full(first, robot["payload"]), rng.choice([0, robot["payload"]], count - 2 * first)].astype(float)
    if repeats:
        for i in sorted(rng.choice(np.arange(1, count), count // 10, replace=False)):
            if i not in (first, 2 * first):
                q[i], payload[i] = q[i - 1], payload[i - 1]
    if beyond:  # short moves, in which memory shows
        for i in range(1, count):
            if i not in (first, 2 * first) and rng.random() < 0.35:
                away = np.radians(np.exp(rng.uniform(np.log(0.2), np.log(6))))
                q[i] = np.clip(q[i - 1] + rng.uniform(-away, away, n), limits[:, 0], limits[:, 1])
    q = np.radians(np.round(np.degrees(q), 4))
    time = np.round(np.cumsum(rng.uniform(0.65, 1.35, count)) * span / count, 2)
    tau, rise = rng.uniform(0.2, 0.6) * span, rng.uniform(8, 16)
    swing, period, phase = (rng.uniform(2, 4), span / rng.uniform(2, 5), 0.0) if beyond else (0.0, 1.0, 0.0)  # else warmth is a function of time
    rows, way, before = [], np.ones(n), np.zeros(n)
    for i in range(count):
        move = q[i] - before
        way, before = np.where(move == 0, way, np.sign(move)), q[i]
        rows.append(dict(q=q[i], time=float(time[i]), payload=float(payload[i]), use="fit" if i < 2 * first else "validate", dir=way,
                         move=move, warm=float(rise * (1 - np.exp(-time[i] / tau)) + swing * np.sin(2 * np.pi * time[i] / period)), i=i, jitter=rng.normal(0, 1, n) * jitter))
    return rows


def spoil(rng, P, rows, outliers, exchanged):
    """Gross errors in rows of the fit. Returns what was done."""
    fit = [i for i, r in enumerate(rows) if r["use"] == "fit"]
    chosen = [int(i) for i in rng.choice(fit, outliers + 2 * exchanged, replace=False)]
    for i in chosen[:outliers]:
        P[i] += unit(rng.normal(0, 1, 3)) * rng.uniform(0.6e-3, 3e-3)
    for a, b in zip(chosen[outliers::2], chosen[outliers + 1 :: 2]):
        P[[a, b]] = P[[b, a]]
    return chosen


def alternatives(effects, near):
    """Sets of effects that a recording does not tell from the wanted ones."""
    options = []
    for i, e in enumerate(effects):
        own = [[e["want"]]] + [[w] for k, w in near if k == i]
        if "accept" in e:
            own.append([e["accept"]])
        if e["kind"] == "cable" and e["joint"] == 1:  # a spring over joint 2 is what a balancer is
            own.append([("counterbalance", "joint 2")])
        if e["kind"] == "hardening":
            own.append([e["want"], ("joint_compliance", e["want"][1])])
        if e["kind"] == "cable" and e.get("over", 1) == 2:
            own += [[("cable_drag", f"joint {e['joint'] + 2}")], [e["want"], ("cable_drag", f"joint {e['joint'] + 2}")]]
        options.append(own)
    sets = [sum(choice, []) for choice in itertools.islice(itertools.product(*options), 64)]
    return [list(dict.fromkeys(s)) for s in sets]


def named(effects):
    return [dict(effect=e, where=w) for e, w in effects]


def make(folder, seed, robot, family, options):
    rng = np.random.default_rng(seed)
    count = options.points or int(rng.integers(100, 261))
    jitter = options.jitter * 1e-6 if options.jitter is not None else float(rng.choice([0, rng.uniform(2e-6, 16e-6)]))
    repeats = rng.random() < 0.5
    beyond = family == "beyond" or bool(set(family.split("+")) & set(BEYOND))
    rows = record(rng, robot, count, rng.uniform(15, 24) * count, jitter, repeats, beyond)
    arm = Arm(robot, rng)
    kinds, effects, visible, near = conceal(rng, robot, arm, rows, family, jitter, options.visible)
    P, load = positions(arm, rows, effects)
    hidden = set(options.hide)
    if not options.hide:
        hidden = {name for name, share in dict(temp=0.25, dir=0.15, current=0.15).items() if rng.random() < share}
        if not set(kinds) & IN_TIME and rng.random() < 0.06:
            hidden.add("time")
        if set(kinds) & {"counterbalance", "cable", "hose"}:
            hidden.discard("current")
        hidden -= {name for e in effects for name in e.get("needs", [])}
    # The tracker stands somewhere, upright within some milliradians, and looks at the reflector.
    a = rng.uniform(-np.pi, np.pi, 2)
    turn = np.array([[np.cos(a[0]), -np.sin(a[0]), 0], [np.sin(a[0]), np.cos(a[0]), 0], [0, 0, 1]])
    lean, sides = rng.normal(0, 3e-3, 2), np.eye(3)
    sides[0, 2], sides[2, 0], sides[1, 2], sides[2, 1] = lean[0], -lean[0], lean[1], -lean[1]
    turn = np.linalg.qr(sides @ turn)[0] * np.sign(np.diag(np.linalg.qr(sides @ turn)[1]))
    at = np.array([np.cos(a[1]), np.sin(a[1]), 0]) * robot["stand"] * rng.uniform(0.8, 1.2) + [0, 0, rng.uniform(-1, 0.2)]
    for e in effects:
        if "stand" in e:  # what is wrong with the instrument was drawn for where it stands
            turn, at = np.array(e["stand"]["turn"]), np.array(e["stand"]["at"])
    P = P @ turn.T + at
    noise = options.scatter or (str(rng.choice(SCATTERS, p=[0.55, 0.15, 0.15, 0.15])) if beyond else "gaussian")
    P = P + scatter(rng, P, noise_sigma(P), noise)
    outliers = options.outliers if options.outliers is not None else int(rng.choice([0, 1, 2], p=[0.88, 0.07, 0.05]))
    exchanged = options.exchanged if options.exchanged is not None else int(rng.random() < 0.06)
    spoiled = spoil(rng, P, rows, outliers, exchanged)
    # Motors hold what pulls at the joints; some with friction of the last move.
    ratio, kt, rated = np.array(robot["ratio"], float), np.array(robot["kt"], float), np.abs(load).max()
    friction = rng.uniform(0.01, 0.03) * np.abs(load).max(0) if rng.random() < 0.25 else np.zeros(arm.n)
    ways = np.array([r["dir"] for r in rows])
    current = (-load + friction * ways + rng.normal(0, 1.3e-3 * rated, load.shape)) / (ratio * kt)

    folder.mkdir(parents=True)
    ids = [f"P{i + 1:04}" for i in range(count)]
    joints = range(1, arm.n + 1)
    table = {"point_id": ids}
    if "time" not in hidden:
        table["time_s"] = [f"{r['time']:.2f}" for r in rows]
    table["use"], table["payload_kg"] = [r["use"] for r in rows], [f"{r['payload']:.1f}" for r in rows]
    for j in joints:
        table[f"q{j}_deg"] = [f"{np.degrees(r['q'][j - 1]):.4f}" for r in rows]
    if "current" not in hidden:
        for j in joints:
            table[f"i{j}_a"] = [f"{x:.4f}" for x in current[:, j - 1]]
    if "dir" not in hidden:
        for j in joints:
            table[f"dir{j}"] = [f"{int(x)}" for x in ways[:, j - 1]]
    if "temp" not in hidden:
        table["temp_c"] = [f"{20 + r['warm'] + rng.normal(0, 0.15):.2f}" for r in rows]
    write(folder / "controller.csv", table)
    seen_at = {"point_id": ids}
    if "time" not in hidden:
        seen_at["time_s"] = [f"{r['time'] + 1.5:.2f}" for r in rows]
    write(folder / "tracker.csv", seen_at | {f"{c}_mm": [f"{1e3 * x:.5f}" for x in P[:, i]] for i, c in enumerate("xyz")})
    keys = ["name", "axes", "points", "tool", "mass", "com", "ratio", "kt", "payload", "payload_com", "coupling"]
    (folder / "robot.json").write_text(json.dumps({k: robot[k] for k in keys}, indent=1) + "\n")
    sets = alternatives(effects, near)
    extra = ([("outlier", "recording")] if outliers else []) + ([("mislabelled_point", "recording")] if exchanged else [])
    accept = [s + extra for s in sets[1:]]
    if "lag" in kinds and not outliers:  # nobody knows from where the arm came to the first point
        accept += [s + [("outlier", "recording")] + extra for s in sets]
    (folder / "want.json").write_text(json.dumps(dict(case=folder.name, effects=named(sets[0] + extra), accept=[named(s) for s in accept]), indent=1) + "\n")
    truth = dict(label=folder.name, robot=robot["name"], seed=seed, family=family, kinds=kinds, effects=[dict({k: v for k, v in e.items() if k != "state"}, L=round(L, 1)) for e, L in zip(effects, visible)],
                 hide=sorted(hidden), outliers=outliers, exchanged=exchanged, spoiled=[ids[i] for i in spoiled], jitter_rad=jitter, **(dict(scatter=noise) if noise != "gaussian" else {}), repeats=bool(repeats),
                 points=count, friction_nm=friction, true=dict(axis=arm.axes, point=1e3 * arm.points, tool=1e3 * arm.tool, off=arm.zero, red=arm.scale,
                                                               cpl={f"{m}<-{b}": r for (m, b), r in arm.coupled.items()}))
    (folder / "truth.json").write_text(json.dumps(truth, indent=1, default=lambda x: x.tolist()) + "\n")
    return kinds, effects, visible


def write(path, table):
    with open(path, "w", newline="") as f:
        out = csv.writer(f, lineterminator="\n")
        out.writerow(table)
        out.writerows(zip(*table.values()))


def main():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("out", type=pathlib.Path)
    p.add_argument("--cases", type=int, default=10)
    p.add_argument("--seed", type=int, default=1)
    p.add_argument("--family", default="single", help="null, single, pairs, open, all (every single in turn), beyond (every one beyond the list in turn), or names joined by +: " + ", ".join([*SINGLE, *OPEN, *BEYOND]))
    p.add_argument("--robot", help="one of " + ", ".join([*ROBOTS, *FIVE]) + ", or a robot.json of your own, to which `limits` (deg, a pair a joint; default 110 both ways) and `stand` (m) may be added; default: any of them")
    p.add_argument("--points", type=int, help="rows, a third of them for validation; default 100 to 260")
    p.add_argument("--hide", nargs="*", default=[], choices=["temp", "dir", "current", "time"], help="columns to leave out; default: some, at random")
    p.add_argument("--jitter", type=float, help="repeatability of each joint, urad; default: none in half of the cases, else 2 to 16")
    p.add_argument("--scatter", choices=SCATTERS, help="how the tracker scatters; default: gaussian, beyond the list any of them")
    p.add_argument("--outliers", type=int)
    p.add_argument("--exchanged", type=int, help="pairs of points")
    p.add_argument("--visible", type=float, default=100, help="smallest L of every effect")
    options = p.parse_args()
    arms = ROBOTS | FIVE if options.family == "beyond" or options.robot in FIVE else ROBOTS
    if options.robot and options.robot not in arms:
        own = json.loads(pathlib.Path(options.robot).read_text())
        robots = [dict(stand=3.0, limits=[(-110, 110)] * len(own["axes"])) | own]
    else:
        robots = [arms[options.robot]] if options.robot else list(arms.values())
    for i in range(options.cases):
        turns = {"all": list(SINGLE), "beyond": list(BEYOND)}.get(options.family, [options.family])
        family = turns[i % len(turns)]
        seed = options.seed * 100_000 + i
        robot = robots[int(np.random.default_rng([seed, 1]).integers(len(robots)))]
        kinds, effects, visible = make(options.out / f"m{seed}", seed, robot, family, options)
        print(f"m{seed} {robot['name']:<9}", "; ".join(f"{e['want'][0]}@{e['want'][1]} L {L:.0f}" for e, L in zip(effects, visible)) or "nothing", flush=True)


if __name__ == "__main__":
    main()
