"""A strict reader of KRL and RAPID, of its own: what may change in a corrected program, and what must."""
import itertools
import math
import re

from . import arm

NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?\Z")
KRL_MOTIONS = {"PTP", "LIN", "SPTP", "SLIN", "CIRC", "SCIRC"}
AXES, FRAME = ("A1", "A2", "A3", "A4", "A5", "A6"), ("X", "Y", "Z", "A", "B", "C")
REST = {"E1", "E2", "E3", "E4", "E5", "E6", "S", "T"}
POINT = 1.1e-6  # m; 1 um and what rounding of the written numbers adds
TURN = 2e-5  # rad


class Wrong(Exception):
    """A number of an accepted program that is not what it must be."""


def number(text):
    """A token that is one number, or none."""
    return float(text) if NUMBER.match(text) and math.isfinite(float(text)) else None


COMMENT, TEXT = "\x01", "\x02"


def bare(text, comment):
    """The text with comments and strings blanked, position for position; KRL's lines of attributes (`&ACCESS RVO`) are comments."""
    out, state = [], ""
    for at, c in enumerate(text):
        if c == "\n":
            state = ""
        elif state == "" and c == "&" and comment == ";" and not text[text.rfind("\n", 0, at) + 1:at].strip():
            state = ";"
        elif state == "" and c == '"':
            state = '"'
            out.append(TEXT)
            continue
        elif state == '"' and c == '"':
            state = ""
            out.append(TEXT)
            continue
        elif state == "" and c == comment:
            state = ";"
        out.append(c if not state else TEXT if state == '"' else COMMENT)
    return "".join(out)


def groups(text, opening, closing):
    """Outermost brackets as spans, on the bare text."""
    found, depth, start = [], 0, 0
    for at, c in enumerate(text):
        if c == opening:
            depth += 1
            if depth == 1:
                start = at
        elif c == closing and depth:
            depth -= 1
            if depth == 0:
                found.append((start, at + 1))
    return found


def krl_fields(body):
    """Fields of an aggregate: (name, number, text as it stands), or none where one is no `NAME number`."""
    out = []
    for field in body.split(","):
        m = re.match(r"\s*([A-Za-z][A-Za-z0-9_]*)(?:\s+|(?=[+-]))(.*?)\s*\Z", field, re.S)
        if not m:
            return None
        # A sign may stand apart from its number: a unary operator of KRL.
        text = re.sub(r"\A([+-])\s+", r"\1", m.group(2))
        out.append((m.group(1).upper(), number(text)))
    return out


def krl_target(head, group, tail):
    """(kind, values, sure): a target in `{...}` by its line, `sure` where no reading of KRL makes it anything else."""
    m = re.match(r"\{\s*(?:([A-Za-z0-9_]+)\s*:)?(.*)\}\Z", group, re.S)
    if not m:
        return None
    named, fields = (m.group(1) or "").upper(), krl_fields(m.group(2))
    if fields is None or any(value is None for _, value in fields):
        return None
    names = [name for name, _ in fields]
    if len(set(names)) != len(names):
        return None
    words = re.findall(r"[A-Za-z0-9_$]+", head.upper())
    kinds = {"E6AXIS": AXES, "AXIS": AXES, "E6POS": FRAME, "POS": FRAME}
    declared = next((word for word in words if word in kinds), None)
    moves = bool(words) and words[0] in KRL_MOTIONS
    if named:
        wanted = kinds.get(named)
    elif declared:
        wanted = kinds[declared]
    else:
        wanted = AXES if "A1" in names else FRAME if "X" in names else None
    if wanted is None or not set(wanted) <= set(names) or not set(names) <= set(wanted) | REST:
        return None
    values = [dict(fields)[name] for name in wanted]
    plain = re.fullmatch(r"\s*(?:PTP|LIN|SPTP|SLIN)\s*", head, re.I) or re.fullmatch(
        r"\s*(?:GLOBAL\s+)?(?:DECL\s+)?(?:E6AXIS|E6POS|AXIS|POS)\s+[A-Z_][A-Z0-9_]*\s*=\s*", head, re.I)
    ordered = [n for n in names if n in wanted] == list(wanted)
    quiet = re.fullmatch(r"\s*(?:C_(?:PTP|DIS|VEL|ORI))?\s*\x01*\r?\Z", tail, re.I) is not None
    sure = bool(plain) and quiet and ordered and (moves or bool(declared)) and not {COMMENT, TEXT} & set(group)
    return ("joints" if wanted is AXES else "frame"), values, sure


def rapid_lists(text):
    """Nested lists of numbers, or none."""
    tokens = [token for token in re.findall(r"\[|\]|,|[^\[\],]+", text) if token.strip()]
    at = 0

    def parse():
        nonlocal at
        items = []
        at += 1
        while at < len(tokens):
            if tokens[at] == "[":
                items.append(parse())
            else:
                items.append(number(re.sub(r"\A([+-])\s+", r"\1", tokens[at].strip())))
                at += 1
            if at >= len(tokens):
                raise ValueError
            # Between an item and the next there is one comma.
            if tokens[at].strip() == "" and at + 1 < len(tokens):
                at += 1
            if tokens[at] == "]":
                at += 1
                return items
            if tokens[at] != ",":
                raise ValueError
            at += 1
            while at < len(tokens) and tokens[at].strip() == "":
                at += 1
        raise ValueError

    try:
        return parse()
    except (ValueError, IndexError, RecursionError):
        return None


def rapid_targets(node):
    """Targets of a literal, also of an array: [(kind, values)], or none."""
    shape = [len(x) if isinstance(x, list) else 0 for x in node]
    flat = all(isinstance(x, list) and all(not isinstance(y, list) for y in x) for x in node)
    if flat and shape in ([6, 6], [3, 4, 4, 6]):
        numbers = sum(node, [])
        if any(x is None for x in numbers):
            return None
        return [("joints", numbers[:6])] if shape == [6, 6] else [("quaternion", numbers[:7])]
    if all(isinstance(x, list) for x in node) and node:
        found = [rapid_targets(x) for x in node]
        return None if any(f is None for f in found) else sum(found, [])
    return None


def pairs_of_krl(before, after):
    """(kind, given, written) of every aggregate that changed; fails where one is changed that must not, or left that must change."""
    b, a = bare(before, ";"), bare(after, ";")
    gb, ga = groups(b, "{", "}"), groups(a, "{", "}")
    compare_outside(before, after, gb, ga)
    pairs = []
    for (p, q), (s, t) in zip(gb, ga):
        start, end = b.rfind("\n", 0, p) + 1, b.find("\n", q)
        head, tail = b[start:p], b[q: end if end >= 0 else len(b)]
        old = krl_target(head, b[p:q], tail)
        if before[p:q] == after[s:t]:
            if old and old[2]:
                raise Wrong(f"left a target as it was: {before[p:q]!r}")
            continue
        if "\n" in b[p:q] or "{" in b[p + 1:q]:
            raise Wrong(f"changed what is no aggregate: {before[p:q]!r}")
        new = krl_target(head, a[s:t], tail)
        if not old or not new or new[0] != old[0]:
            raise Wrong(f"changed what is no whole target: {before[p:q]!r} to {after[s:t]!r}")
        if re.match(r"\s*:", tail) or re.search(r":\s*\Z", head):
            raise Wrong(f"changed an operand of the geometric operator: {before[start:end]!r}")
        kept = [re.sub(r"([A-Za-z]\w*)\s*[+-]?\s*[0-9.][0-9.eE+-]*", r"\1 #", x) for x in (before[p:q], after[s:t])]
        if kept[0] != kept[1]:
            raise Wrong(f"changed more than numbers: {before[p:q]!r} to {after[s:t]!r}")
        pairs.append((old[0], old[1], new[1]))
    return pairs


def pairs_of_rapid(before, after):
    b, a = bare(before, "!"), bare(after, "!")
    gb, ga = groups(b, "[", "]"), groups(a, "[", "]")
    compare_outside(before, after, gb, ga)
    pairs = []
    for (p, q), (s, t) in zip(gb, ga):
        statement = b[b.rfind(";", 0, p) + 1:p]
        old_lists = rapid_lists(b[p:q].replace(COMMENT, " ")) if TEXT not in b[p:q] else None
        old = rapid_targets(old_lists) if old_lists is not None else None
        if before[p:q] == after[s:t]:
            sure = re.fullmatch(r"\s*(?:LOCAL\s+|TASK\s+)?(?:CONST|PERS|VAR)\s+(jointtarget|robtarget)\s+[A-Za-z]\w*\s*:=\s*", statement, re.I) \
                or re.fullmatch(r"\s*Move(AbsJ|J|L)\s*", statement, re.I)
            if old and sure:
                raise Wrong(f"left a target as it was: {before[p:q]!r}")
            continue
        new_lists = rapid_lists(a[s:t].replace(COMMENT, " ")) if TEXT not in a[s:t] else None
        new = rapid_targets(new_lists) if new_lists is not None else None
        if not old or not new or [k for k, _ in old] != [k for k, _ in new]:
            raise Wrong(f"changed what is no whole target: {before[p:q]!r} to {after[s:t]!r}")
        pairs += [(kind, given, written) for (kind, given), (_, written) in zip(old, new)]
    return pairs


# The line by which a program that was corrected once is known.
STAMP = re.compile(r"[;!#] corrected by calib from [0-9a-f]{16}\r?\n")


def compare_outside(before, after, gb, ga):
    if len(gb) != len(ga):
        raise Wrong(f"{len(gb)} groups became {len(ga)}")
    at, to = 0, 0
    for (p, q), (s, t) in zip(gb, ga):
        if before[at:p] != STAMP.sub("", after[to:s], count=1):
            raise Wrong(f"changed what is outside of targets: {before[at:p]!r} to {after[to:s]!r}")
        at, to = q, t
    if before[at:] != STAMP.sub("", after[to:], count=1):
        raise Wrong(f"changed what follows the last target: {before[at:]!r}")


def wanted_pose(kind, values):
    point = tuple(x * 1e-3 for x in values[:3])
    if kind == "frame":
        return arm.zyx(*(math.radians(x) for x in values[3:])), point
    return arm.of_quaternion(*values[3:]), point


def any_posture(kind, given, written, nominal, real, starts, warned):
    """Whether the real arm, in one of the postures in which the nominal arm is at the written pose, is at the given one."""
    pose, command, seen = wanted_pose(kind, given), wanted_pose(kind, written), []
    for start in starts + postures(command[1]):
        home = nominal.solve(pose, start) if start in starts else None
        q = nominal.solve(command, home or start)
        if q is None or any(max(abs(a - b) for a, b in zip(q, other)) < 1e-6 for other in seen):
            continue
        seen.append(q)
        # With errors of reduction ratios a whole turn more is another pose.
        for turns in itertools.product((0, 1, -1), repeat=3):
            turned = [x + 2 * math.pi * k for x, k in zip(q, (turns[0], 0, 0, turns[1], 0, turns[2]))]
            rotation, point = real.place(turned)
            if arm.norm(arm.sub(point, pose[1])) < POINT and (warned or arm.norm(arm.between(rotation, pose[0])) < TURN):
                return True
    return False


def postures(point):
    """Starts near every way in which an arm with three axes in its wrist can be at a point."""
    ahead = math.atan2(point[1], point[0])
    return [[ahead + back, s, e, w, b, 0.0] for back in (0, math.pi) for s, e in ((0.3, -0.6), (0.9, 0.6), (-0.9, 1.2), (-0.5, 2.0))
            for w, b in ((0.0, 0.6), (0.0, -0.6), (1.5, 0.8), (-1.5, 0.8))]


def judge(pairs, nominal, real, starts, warned):
    """Recomputes every number; gives how many. `starts`: joints from which postures are searched, `warned`: orientation may be off."""
    checked, last = 0, None
    for kind, given, written in pairs:
        checked += len(written)
        if kind == "joints":
            home = [math.radians(x) for x in given]
            off = arm.norm(arm.sub(real.point([math.radians(x) for x in written]), nominal.point(home)))
            if not off < POINT:
                raise Wrong(f"joints {given} became {written}, {off * 1e6:.3f} um off")
            last = home
            continue
        if kind == "quaternion" and abs(math.sqrt(sum(x * x for x in given[3:])) - 1) > 1.01e-3:
            raise Wrong(f"a quaternion of another length was taken: {given}")
        if not any_posture(kind, given, written, nominal, real, ([last] if last else []) + starts, warned):
            raise Wrong(f"pose {given} became {written}: no posture of the real arm at it is the pose that was wanted")
    return checked
