"""A strict reader of targets in delimited text, of its own, and what a corrected file must be."""
import math
import re

from . import arm
from .programs import POINT, Wrong

NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?\Z")
UNITS = {"deg": math.pi / 180, "rad": 1.0, "mm": 1e-3, "m": 1.0, "arcsec": math.pi / 648000, "um": 1e-6, "mrad": 1e-3, "in": 0.0254}
NAMES = ("q", "a", "j", "joint")
APPENDED = ["uncorrected_mm", "residual_mm", "iterations", "remark"]


def fields(line, delimiter):
    """A quote opens a field only where it begins one; inside, two are one."""
    out, start, at, quoted = [], 0, 0, False
    while at < len(line):
        c = line[at]
        if quoted and c == '"':
            if line[at + 1:at + 2] == '"':
                at += 1
            else:
                quoted = False
        elif not quoted and c == '"' and not line[start:at].strip():
            quoted = True
        elif not quoted and c == delimiter:
            out.append(line[start:at])
            start = at + 1
        at += 1
    out.append(line[start:])
    return out


def text_of(cell):
    cell = cell.strip()
    if len(cell) > 1 and cell[0] == cell[-1] == '"':
        cell = cell[1:-1]
    return cell.replace('""', '"')


def value(text, delimiter):
    if not NUMBER.match(text) and delimiter != "," and "." not in text and text.count(",") == 1:
        text = text.replace(",", ".")
    if not NUMBER.match(text) or not math.isfinite(float(text)):
        raise Wrong(f"took {text!r} for a number")
    return float(text)


def role(name, robot_names):
    """(what, index, factor to SI) of a column by its name; a unit may stand behind a blank, or in brackets."""
    lower = re.sub(r"[\s\[\]()_/.]+", "_", name.strip().lower()).strip("_")
    stem, _, ending = lower.rpartition("_")
    if not stem or ending not in UNITS:
        return None
    factor = UNITS[ending]
    if stem in robot_names:
        return "q", robot_names.index(stem), factor
    m = re.fullmatch(r"(q|a|j|joint)\+?0*([1-6])", stem)
    if m:
        return "q", int(m.group(2)) - 1, factor
    if stem in ("x", "y", "z"):
        return "x", "xyz".index(stem), factor
    if stem in ("a", "b", "c"):
        return "turn", "abc".index(stem), factor
    return None


def rows_of(text):
    """Lines with their ends, the last without one."""
    return [line for line in re.findall(r"[^\n]*\n|[^\n]+\Z", text)]


def judge(before, after, nominal, real, robot_names, code):
    """Recomputes every number of a corrected file; gives how many."""
    old, new = rows_of(before), rows_of(after)
    if len(old) != len(new):
        raise Wrong(f"{len(old)} lines became {len(new)}")
    k = next(i for i, line in enumerate(old) if line.strip())
    header = old[k].rstrip("\r\n")
    counts = {c: header.count(c) for c in ";\t,"}
    best = max(counts.values())
    delimiter = next((c for c in ",\t;" if counts[c] == best and best > 0), ",")
    names = [text_of(cell) for cell in fields(header.lstrip("\ufeff"), delimiter)]
    found = {}
    for at, name in enumerate(names):
        what = role(name, robot_names)
        if what:
            if what[:2] in found:
                raise Wrong(f"two columns {name!r}")
            found[what[:2]] = (at, what[2])
        if name.strip().lower() in ("qw", "qx", "qy", "qz"):
            found["quaternion", name.strip().lower()] = (at, 1.0)
    joints = [found.get(("q", j)) for j in range(6)]
    given = all(joints)
    if not given and any(joints):
        raise Wrong("some joints only")
    extra = len(fields(new[k].rstrip("\r\n"), delimiter)) - len(names)
    if not new[k].startswith(header):
        raise Wrong(f"the header became {new[k]!r}")
    added = [text_of(c) for c in fields(new[k].rstrip("\r\n"), delimiter)[len(names):]]
    if added != ([] if given else [f"q{j + 1}_deg" for j in range(6)]) + APPENDED:
        raise Wrong(f"appended {added}")
    checked, empty = 0, 0
    for row, (line, corrected) in enumerate(zip(old[k + 1:], new[k + 1:]), k + 2):
        if not line.strip():
            if line != corrected:
                raise Wrong(f"line {row}: an empty line changed")
            continue
        a, b = fields(line.rstrip("\r\n"), delimiter), fields(corrected.rstrip("\r\n"), delimiter)
        if len(a) != len(names) or len(b) != len(names) + extra:
            raise Wrong(f"line {row}: {len(a)} fields became {len(b)}, of {len(names)}")
        own = {at for at, _ in joints} if given else set()
        if any(x != y for at, (x, y) in enumerate(zip(a, b)) if at not in own):
            raise Wrong(f"line {row}: another column changed: {line!r} to {corrected!r}")
        tail = [text_of(cell) for cell in b[len(names):]]
        cells = [text_of(b[at]) for at, _ in joints] if given else tail[:6]
        factors = [factor for _, factor in joints] if given else [math.pi / 180] * 6
        uncorrected, residual, _, remark = tail[-4:]
        home = pose = None
        if given:
            home = [value(text_of(a[at]), delimiter) * factor for at, factor in joints]
            goal = nominal.point(home)
        else:
            goal = tuple(value(text_of(a[at]), delimiter) * factor for at, factor in (found["x", i] for i in range(3)))
            if ("turn", 0) in found:
                pose = arm.zyx(*(value(text_of(a[at]), delimiter) * f for at, f in (found["turn", i] for i in range(3))))
            elif ("quaternion", "qw") in found:
                pose = arm.of_quaternion(*(value(text_of(a[found["quaternion", n][0]]), delimiter) for n in ("qw", "qx", "qy", "qz")))
        if not any(cells):
            empty += 1
            if not remark:
                raise Wrong(f"line {row}: no joints and no reason")
            continue
        q = [value(cell, delimiter) * factor for cell, factor in zip(cells, factors)]
        rotation, point = real.place(q)
        off = arm.norm(arm.sub(point, goal))
        if not off < POINT:
            raise Wrong(f"line {row}: joints {cells} are {off * 1e3:.6f} mm off")
        if pose is not None and "orientation" not in remark and arm.norm(arm.between(rotation, pose)) > 2e-5:
            raise Wrong(f"line {row}: the orientation is {arm.norm(arm.between(rotation, pose)):.2e} rad off")
        if abs(value(residual, delimiter) - off * 1e3) > 1e-4 + POINT * 1e3:
            raise Wrong(f"line {row}: residual {residual}, found {off * 1e3}")
        if home is not None:
            before_mm = arm.norm(arm.sub(real.point(home), goal)) * 1e3
            if abs(before_mm - value(uncorrected, delimiter)) > 2e-4:
                raise Wrong(f"line {row}: uncorrected {uncorrected}, found {before_mm}")
        checked += len(cells) + 3
    if empty and code == 0:
        raise Wrong(f"{empty} targets without joints and code 0")
    if code == 10 and not empty:
        raise Wrong("code 10 and a file in which nothing is missing")
    return checked


def judge_columns(given, found, nominal, real, cartesian, code):
    """The same for a table: columns of numbers by name, as they were given and as they were written."""
    joints = [f"q{j + 1}_rad" for j in range(6)]
    if any(name not in given or name not in found for name in joints) or "residual_mm" not in found:
        return 0
    rows = len(found[joints[0]])
    if len(given[joints[0]]) != rows:
        raise Wrong(f"{len(given[joints[0]])} rows became {rows}")
    checked, empty = 0, 0
    for row in range(rows):
        q = [found[name][row] for name in joints]
        if all(x is None for x in q):
            empty += 1
            continue
        home = [given[name][row] for name in joints]
        goal = tuple(found[f"{a}_mm"][row] * 1e-3 for a in "xyz") if cartesian else nominal.point(home)
        off = arm.norm(arm.sub(real.point(q), goal))
        if not off < POINT:
            raise Wrong(f"row {row + 1}: joints {q} are {off * 1e3:.6f} mm off")
        if abs(found["residual_mm"][row] - off * 1e3) > 1e-4:
            raise Wrong(f"row {row + 1}: residual {found['residual_mm'][row]}, found {off * 1e3}")
        checked += 7
    if (code == 0) == bool(empty):
        raise Wrong(f"code {code}, {empty} targets without joints")
    return checked
