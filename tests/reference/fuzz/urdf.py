"""A small reader of URDF, of its own: the moving joints from one link to another at the zero pose in the base frame."""
import math
import re
import xml.etree.ElementTree as tree

from . import arm

NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?\Z")


class Unknown(Exception):
    """What this reader does not take for a URDF."""


def numbers(text, count):
    words = text.split()
    if len(words) != count or not all(NUMBER.match(word) for word in words):
        raise Unknown(f"numbers {text!r}")
    return tuple(map(float, words))


def origin(node):
    found = node.find("origin")
    if found is None:
        return arm.Y, (0.0, 0.0, 0.0)
    roll, pitch, yaw = numbers(found.get("rpy", "0 0 0"), 3)
    return arm.zyx(yaw, pitch, roll), numbers(found.get("xyz", "0 0 0"), 3)


def chain(data, base, tip):
    """([(type, unit axis, point, limits)], point of the tip)."""
    try:
        root = tree.fromstring(data)
        by_child = {}
        for joint in root.findall("joint"):
            by_child[joint.find("child").get("link")] = joint
        path, link = [], tip
        while link != base:
            path.append(by_child[link])
            link = by_child[link].find("parent").get("link")
            if len(path) > 1000:
                raise Unknown("circle")
        frame, out = (arm.Y, (0.0, 0.0, 0.0)), []
        for joint in reversed(path):
            frame = arm.compose(frame, origin(joint))
            kind = joint.get("type")
            if kind == "fixed":
                continue
            axis = joint.find("axis")
            axis = (1.0, 0.0, 0.0) if axis is None else numbers(axis.get("xyz", "1 0 0"), 3)
            size = max(map(abs, axis))
            axis = tuple(x / size for x in axis)
            axis = tuple(x / arm.norm(axis) for x in axis)
            limit, limits = joint.find("limit"), None
            if limit is not None and kind != "continuous" and (limit.get("lower") or limit.get("upper")):
                limits = numbers(limit.get("lower", "0"), 1) + numbers(limit.get("upper", "0"), 1)
            out.append(("prismatic" if kind == "prismatic" else "revolute", arm.apply(frame[0], axis), frame[1], limits))
        return out, frame[1]
    except Unknown:
        raise
    except (tree.ParseError, KeyError, AttributeError, ValueError, ZeroDivisionError, OverflowError, RecursionError, LookupError) as error:
        raise Unknown(repr(error)) from error


def differences(found, tip, rows):
    """What differs in calib's table `robot` (rows as JSON objects)."""
    joints = [row for row in rows if row["kind"] in ("revolute", "prismatic")]
    if [row["kind"] for row in joints] != [kind for kind, *_ in found]:
        return f"joints {[row['kind'] for row in joints]}"
    for number, (row, (kind, axis, point, limits)) in enumerate(zip(joints, found), 1):
        for name, mine, theirs in [("axis", axis, [row[f"axis_{a}"] for a in "xyz"]),
                                   ("point", [1e3 * x for x in point], [row[f"point_{a}_mm"] for a in "xyz"])]:
            # Of a revolute joint the point may be any of its axis.
            if any(x is None or not math.isfinite(x) or abs(x - y) > 1e-6 * max(1.0, abs(y)) for x, y in zip(theirs, mine)):
                return f"joint {number}: {name} {theirs}, expected {mine}"
        if limits:
            theirs = [row["lower_mm"] / 1e3, row["upper_mm"] / 1e3] if kind == "prismatic" else [row["lower_rad"], row["upper_rad"]]
            if any(abs(x - y) > 1e-9 * max(1.0, abs(y)) for x, y in zip(theirs, limits)):
                return f"joint {number}: limits {theirs}, expected {limits}"
    tool = [rows[-1][f"point_{a}_mm"] for a in "xyz"]
    if any(abs(x - 1e3 * y) > 1e-6 * max(1.0, abs(x)) for x, y in zip(tool, tip)):
        return f"tool {tool}, expected {tip}"
    return None
