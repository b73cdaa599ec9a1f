"""How much of a hidden cause a recording of torques can show, and which other names would say the same; for mujoco_torques.py.

L is the squared torque of the cause over the noise of its rows, after masses within their tolerance and the friction of every joint have
absorbed what they can. Another name says the same where it leaves less than 12, or less than 2 % of L.
"""

import mujoco
import numpy as np

STEP = 20  # Rows that are averaged into one, as a low-pass does.
SAME, SAME_SHARE = 12.0, 0.02


def averaged(torque):
    whole = len(torque) // STEP * STEP
    return torque[:whole].reshape(-1, STEP, torque.shape[1]).mean(axis=1)


def rigid(model, motion):
    data, out = mujoco.MjData(model), np.zeros_like(motion[0])
    for row, (q, v, a) in enumerate(zip(*motion)):
        data.qpos[:], data.qvel[:], data.qacc[:] = q, v, a
        mujoco.mj_inverse(model, data)
        out[row] = data.qfrc_inverse
    return out


def inertial(arm, motion, model_of):
    """Torques per change of the arm: masses, centres and inertias by one standard deviation, and what a wrong arm may be called."""
    before = rigid(model_of(arm), motion)

    def column(**changed):
        return rigid(model_of({**arm, **changed}), motion) - before

    def with_one(key, k, value):
        return {key: [value if other == k else one for other, one in enumerate(arm[key])]}

    base, named = [], []
    last = len(arm["masses"]) - 1
    for k, inertia in enumerate(arm["inertia"]):
        mass = column(masses=np.where(np.arange(last + 1) == k, 1.01, 1.0) * arm["masses"])
        steps = [0.004 * np.eye(3)[axis] for axis in range(3)]
        centre = [column(centres=np.array(with_one("centres", k, arm["centres"][k] + step)["centres"])) for step in steps]
        size, turns = 0.05 * np.abs(inertia).max(), []
        for row, other in [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)]:
            more = inertia.copy()
            # The same in both halves of the matrix; a diagonal that stays a body's.
            more[row, other] += size if row == other else 0.5 * size
            if row != other:
                more[other, row] += 0.5 * size
            turns.append(column(**with_one("inertia", k, more)))
        base += [mass, *centre, *turns]
        place = f"link {k + 1}"
        named += [("link_mass", place, [mass]), ("link_com", place, centre), ("link_inertia", place, turns)]
    heavier = column(payload=1.1 * arm["payload"])
    moved = [column(payload_centre=arm["payload_centre"] + 0.01 * np.eye(3)[axis]) for axis in range(3)]
    named += [("payload_error", "tool", [heavier]), ("payload_error", "tool", [heavier, *moved])]
    tilts = [column(gravity=arm["gravity"] + 0.1 * np.eye(3)[axis]) for axis in range(2)]
    named.append(("gravity_direction", "base", tilts))
    return base, named


def at_joints(torque, motion):
    """What acts at one joint: friction that every joint has, and names."""
    q, v, a = motion
    n = q.shape[1]

    def at(joint, values):
        out = np.zeros_like(q)
        out[:, joint] = values
        return out

    common, named = [], []
    for j in range(n):
        place, sign = f"joint {j + 1}", np.tanh(v[:, j] / 0.01)
        common += [at(j, v[:, j]), at(j, sign)]
        one = np.ones(len(q))
        named += [("rotor_inertia", place, [at(j, a[:, j])]), ("current_offset", place, [at(j, one)]),
                  ("torque_constant", place, [at(j, torque[:, j])]), ("asymmetric_friction", place, [at(j, np.maximum(sign, 0))])]
        for name in ("cable_stiffness", "spring_balance"):
            named.append((name, place, [at(j, q[:, j]), at(j, one)]))
        named += [("torque_ripple", place, [at(j, np.sin(h * q[:, j])), at(j, np.cos(h * q[:, j]))]) for h in range(1, 4)]
    return common, named


def visible(effect, torque, motion, arm, noise, model_of):
    """L and the other names of an effect (rows x joints, Nm); `noise` (Nm) is of STEP rows."""
    sparse = [part[STEP // 2 :: STEP][: len(effect) // STEP] for part in motion]
    own = averaged(effect) / noise
    base, names = inertial(arm, sparse, model_of)
    common, more = at_joints(torque[STEP // 2 :: STEP][: len(own)], sparse)
    whitened = lambda columns: np.array([(column / noise).ravel() for column in columns]).T
    # Masses cost what their tolerance says: rows that hold each at nought.
    absorbed = np.vstack([whitened(base + common), np.eye(len(base), len(base) + len(common))])
    scaled = absorbed / np.sqrt((absorbed**2).sum(axis=0))
    span, sizes, _ = np.linalg.svd(scaled, full_matrices=False)
    span = span[:, sizes > 1e-9 * sizes[0]]
    beside = lambda columns: columns - span @ (span.T @ columns)
    below = np.zeros(len(base))
    apart = beside(np.r_[own.ravel(), below])
    size = float(apart @ apart)

    def left(columns):
        rows = beside(np.vstack([whitened(columns), np.zeros((len(base), len(columns)))]))
        solved = np.linalg.lstsq(rows / (np.sqrt((rows**2).sum(axis=0)) + 1e-12), apart, rcond=1e-9)[0]
        return size - float(apart @ (rows / (np.sqrt((rows**2).sum(axis=0)) + 1e-12) @ solved))

    same = sorted({(name, place) for name, place, columns in names + more if left(columns) < max(SAME, SAME_SHARE * size)})
    return {"L": round(size, 1), "same": [{"effect": name, "where": place} for name, place in same]}
