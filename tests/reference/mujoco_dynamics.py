#!/usr/bin/env python3
"""Torques of rigid arms by MuJoCo and by Pinocchio, for the test that holds calib's inverse dynamics, its regressor and the twin's
inverse dynamics against them.

  pip install mujoco==4.0.0 pin==4.1.0 numpy
  mujoco_dynamics.py > tests/it/torques/rigid_arms.json

Three arms drawn at random (5, 6 and 7 turning joints, no two axes alike), ten motions each. Every body has a full inertia. Stops where
the two engines differ by more than 1e-9 of the largest torque. Numbers are SI, base frame at zero pose; inertias about the centre.

Of two motions of each arm also the columns of the regressor: torques (Nm) at the joints up to a link per unit of each of the link's ten
numbers (mass, mass times centre from the joint's point, inertia about that point: xx xy xz yy yz zz). Pinocchio's are those of its own
`computeJointTorqueRegressor`. MuJoCo has no regressor and takes only bodies that exist: one link after the other gets eleven bodies whose
numbers are independent, and the ten columns are what their torques differ by, solved for the numbers. Written as
[link][number][joint up to the link].
"""

import json
import sys

import mujoco
import numpy as np
import pinocchio as pin

GRAVITY = np.array([0.3, -0.8, -9.7])


def drawn(rng, n):
    links, point = [], np.array([0.0, 0.0, 0.3])
    for _ in range(n):
        axis = rng.normal(size=3)
        points = point.copy()
        point = point + rng.uniform(0.1, 0.4) * (lambda v: v / np.linalg.norm(v))(rng.normal(size=3))
        principal = rng.uniform(0.02, 0.2, 3)
        principal[2] = rng.uniform(abs(principal[0] - principal[1]), principal[0] + principal[1])
        turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        inertia = turn @ np.diag(principal) @ turn.T
        links.append({"axis": axis / np.linalg.norm(axis), "point": points, "mass": rng.uniform(2, 20),
                      "centre": points + rng.uniform(-0.2, 0.2, 3), "inertia": 0.5 * (inertia + inertia.T)})
    return links


def six(m):
    return [m[0, 0], m[0, 1], m[0, 2], m[1, 1], m[1, 2], m[2, 2]]


def by_mujoco(links):
    spec = mujoco.MjSpec()
    spec.compiler.degree = False
    spec.compiler.balanceinertia = False
    spec.option.gravity = GRAVITY
    body, before = spec.worldbody, np.zeros(3)
    for link in links:
        body = body.add_body(pos=link["point"] - before)
        before = link["point"]
        m = six(link["inertia"])
        body.mass, body.ipos, body.explicitinertial = link["mass"], link["centre"] - link["point"], True
        body.fullinertia = [m[0], m[3], m[5], m[1], m[2], m[4]]
        body.add_joint(type=mujoco.mjtJoint.mjJNT_HINGE, axis=link["axis"])
    model = spec.compile()
    data = mujoco.MjData(model)

    def torque(q, v, a):
        data.qpos[:], data.qvel[:], data.qacc[:] = q, v, a
        mujoco.mj_inverse(model, data)
        return data.qfrc_inverse.copy()

    return torque


def by_pinocchio(links):
    model, parent, before = pin.Model(), 0, np.zeros(3)
    model.gravity.linear = GRAVITY
    for k, link in enumerate(links):
        joint = pin.JointModelRevoluteUnaligned(*link["axis"])
        parent = model.addJoint(parent, joint, pin.SE3(np.eye(3), link["point"] - before), f"joint{k + 1}")
        before = link["point"]
        model.appendBodyToJoint(parent, pin.Inertia(link["mass"], link["centre"] - link["point"], link["inertia"]), pin.SE3.Identity())
    data = model.createData()
    return model, lambda q, v, a: pin.rnea(model, data, q, v, a).copy()


def ten(link):
    """Mass, first moment and inertia about the joint's point."""
    r, m = link["centre"] - link["point"], link["mass"]
    return np.array([m, *(m * r), *six(link["inertia"] + m * (r @ r * np.eye(3) - np.outer(r, r)))])


def columns_by_mujoco(rng, links, motion):
    """Columns of each link, and by how much their solution leaves the torques unexplained (Nm)."""
    columns, left = [], 0.0
    for k, link in enumerate(links):
        bodies = [link] + [{**drawn(rng, 1)[0], "axis": link["axis"], "point": link["point"]} for _ in range(14)]
        for body in bodies[1:]:
            body["centre"] = link["point"] + rng.uniform(-0.4, 0.4, 3)
        torques = np.array([by_mujoco(links[:k] + [body] + links[k + 1:])(*motion) for body in bodies])
        numbers = np.array([ten(body) for body in bodies])
        change, effect = numbers[1:] - numbers[0], torques[1:] - torques[0]
        own = np.linalg.lstsq(change, effect, rcond=None)[0]
        left = max(left, np.abs(change @ own - effect).max())
        columns.append(own[:, :k + 1])
    return columns, left


def columns_by_pinocchio(model, motion):
    whole = pin.computeJointTorqueRegressor(model, model.createData(), *motion)
    order = [0, 1, 2, 3, 4, 5, 7, 6, 8, 9]  # Pinocchio counts xx xy yy xz yz zz.
    return [whole[:k + 1, 10 * k:10 * k + 10].T[order] for k in range(model.nv)]


def main():
    rng, arms = np.random.default_rng(20), []
    for n in (5, 6, 7):
        links = drawn(rng, n)
        mujoco_torque, (model, pinocchio_torque) = by_mujoco(links), by_pinocchio(links)
        rows, columns = [], []
        for number in range(10):
            q, v, a = rng.uniform(-3, 3, n), rng.uniform(-2, 2, n), rng.uniform(-5, 5, n)
            one, other = mujoco_torque(q, v, a), pinocchio_torque(q, v, a)
            off = np.abs(one - other).max() / np.abs(one).max()
            if off > 1e-9:
                sys.exit(f"{n} joints: MuJoCo and Pinocchio differ by {off:.1e}")
            if number < 2:
                own, left = columns_by_mujoco(np.random.default_rng(n), links, (q, v, a))
                direct = columns_by_pinocchio(model, (q, v, a))
                off = max(np.abs(x - y).max() for x, y in zip(own, direct))
                print(f"{n} joints, motion {number + 1}: columns of the engines differ by {off:.1e} Nm, bodies by {left:.1e} Nm", file=sys.stderr)
                if off > 1e-9:
                    sys.exit("columns of MuJoCo and Pinocchio differ by more than 1e-9 Nm")
                columns.append({"mujoco": [c.tolist() for c in own], "pinocchio": [c.tolist() for c in direct]})
            rows.append({"q": list(q), "v": list(v), "a": list(a), "mujoco": list(one), "pinocchio": list(other)})
        told = [{"axis": list(k["axis"]), "point": list(k["point"]), "mass": k["mass"], "centre": list(k["centre"]),
                 "inertia": six(k["inertia"])} for k in links]
        arms.append({"gravity": list(GRAVITY), "links": told, "rows": rows, "columns": columns})
    versions = f"MuJoCo {mujoco.__version__}, Pinocchio {pin.__version__}"
    json.dump({"made_by": f"tests/reference/mujoco_dynamics.py, {versions}", "arms": arms}, sys.stdout)
    print()


main()
