"""Fits what findings say of their own probability to proofs (`calib simulate prove --left-out --out DIR ...`, `--foreign 1`).

    python3 tests/reference/calibrate_probability.py DIR [DIR ...]

Of recordings with one listed cause of L 50 or more, diagnosed with the whole list and without that cause: MIMICRY, TEMPERATURE and
IDENTITY by the least Brier score of the names that are stated, where 0.3 of all causes are in no list, but for several names that take up
loads, which are counted (MIMICRY_OF_LOADS is the ratio of the counts, each with a half more). Of foreign effects: by what the
stated probabilities of places of findings without a name are to be multiplied, of one alone (PLACED) and of one of several
(PLACED_AMONG). The numbers stand in `src/numerics/criteria`. Needs nothing but Python.
"""
import itertools
import json
import math
import re
import sys
from pathlib import Path

UNLISTED = 0.3
MISLED = 0.02
DUE = 50.0
# Causes several of which take up what depends on loads.
OF_LOADS = {"joint_hardening", "joint_warming", "link_mass"}


def atoms(effect, place):
    run = re.fullmatch(r"link (\d+)-(\d+)", place)
    places = [f"link {k}" for k in range(int(run[1]), int(run[2]) + 1)] if run else [place]
    return {(effect, at) for at in places}


def known(truth, without):
    """Names that are right, and their places; `without` is the effect that was left out."""
    names = truth["effects"] + truth["tampered"] + truth["accepted"]
    names += [name for cause in truth["effects"] for name in cause.get("same") or []]
    out = set().union(*(atoms(name["effect"], name["where"]) for name in names))
    places = {place for _, place in out}
    return {name for name in out if name[0] != without}, places


def answers(folder):
    """(whether its cause was left out, names that are right, places that are right, findings) of every diagnosis of a cause that is due."""
    for path in sorted((folder / "sealed").glob("*.json")):
        truth = json.loads(path.read_text())
        wanted = [cause for cause in truth["effects"] if cause.get("wanted")]
        if not wanted or wanted[0]["L"] < DUE:
            continue
        for out in [False, True]:
            answer = folder / "verdicts" / ("left_out" if out else "") / path.name
            if answer.exists():
                right, places = known(truth, wanted[0]["effect"] if out else None)
                yield wanted[0]["effect"], out, right, places, json.loads(answer.read_text())["findings"]


def name_of_loads(finding):
    """The name of a finding that takes up loads, stated or taken back; of warming only that of a stiffness."""
    names = [finding["effect"]] + [rival["effect"] for rival in finding["rivals"] if rival["where"] == finding["where"]]
    stiffness = any("stiffness" in number["name"] for number in finding["parameters"])
    own = [name for name in names if name in OF_LOADS and (name != "joint_warming" or stiffness)]
    return own[0] if own and finding["effect"] in OF_LOADS | {"unknown"} else None


def statements(named, mimicry, temperature, identity):
    """(weight, probability, right) of each finding with a name and of its rivals; `floor` is the least that its set states for none."""
    least = min(max(UNLISTED * mimicry / (UNLISTED * mimicry + 1.0 - UNLISTED), MISLED), 1.0 - MISLED)
    for out, right, finding, floor in named:
        none = finding["none_probability"]
        none = least if none <= floor + 1e-9 else max(none, least)
        names = [(0.0, atoms(finding["effect"], finding["where"]))]
        names += [(rival["delta_bic"], atoms(rival["effect"], rival["where"])) for rival in finding["rivals"]]
        loss = lambda delta: identity if delta == 0.0 else max(delta, 0.0)
        weights = [1.0] + [math.exp(-loss(delta) / (2.0 * temperature)) for delta, _ in names[1:]]
        for weight, (_, name) in zip(weights, names):
            yield (UNLISTED if out else 1.0 - UNLISTED), (1.0 - none) * weight / sum(weights), bool(name & right)


def brier(all_statements):
    all_statements = list(all_statements)
    return sum(w * (p - right) ** 2 for w, p, right in all_statements) / sum(w for w, _, _ in all_statements)


def main():
    sets = [list(answers(Path(folder))) for folder in sys.argv[1:]]
    every = [answer for one in sets for answer in one]
    stated = lambda one: [finding["none_probability"] for *_, findings in one for finding in findings if finding["effect"] != "unknown"]
    least = lambda one: min(stated(one), default=0.0)
    floors = [least(one) for one in sets for _ in one]
    named, of_loads = [], [0, 0]
    for (_, out, right, _, findings), floor in zip(every, floors):
        loads = [finding for finding in findings if name_of_loads(finding)]
        several = loads if len(loads) > 1 else []
        is_right = any(atoms(name_of_loads(finding), finding["where"]) & right for finding in several)
        of_loads[out] += bool(several) and is_right != out
        named += [(out, right, finding, floor) for finding in findings if finding["effect"] != "unknown" and finding not in several
                  and finding["evidence"] and finding["evidence"]["delta_bic"] is not None]
    if any(out for out, *_ in named):
        grid = itertools.product([0.05 * k for k in range(1, 31)], [0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0], [0.5, 1.0, 2.0, 4.0, 8.0])
        score, best = min((brier(statements(named, *numbers)), numbers) for numbers in grid)
        print(f"{len(named)} findings with a name: Brier score {score:.4f}")
        for name, number in zip(["MIMICRY", "TEMPERATURE", "IDENTITY"], best):
            print(f"{name:12} {number:.2f}")
        said = list(statements(named, *best))
        ends = [0.0, 0.1, 0.3, 0.5, 0.7, 0.8, 0.9, 0.95, 1.0]
        for low, high in zip(ends, ends[1:]):
            own = [one for one in said if low <= one[1] < high]
            weight = sum(w for w, _, _ in own)
            if own:
                print(f"{low:4} to {high:4}: stated {sum(w * p for w, p, _ in own) / weight:.3f}, "
                      f"right {sum(w * right for w, _, right in own) / weight:.3f} of {len(own)}")
        print(f"MIMICRY_OF_LOADS {(of_loads[1] + 0.5) / (of_loads[0] + 0.5):.1f}: recordings with several names that take up loads, "
              f"right with the whole list {of_loads[0]}, wrong without the cause {of_loads[1]}")
    for title, alone in [("PLACED", True), ("PLACED_AMONG", False)]:
        right, stated = [], 0.0
        for effect, out, _, places, findings in every:
            own = [finding for finding in findings if finding["effect"] == "unknown"]
            if effect == "unknown" and not out and (len(own) == 1) == alone:
                right += [any(place in places for _, place in atoms("unknown", finding["where"])) for finding in own]
                stated += sum(finding["place_probability"] for finding in own)
        if right:
            print(f"{title:12} times {sum(right) / stated:.2f}: {sum(right)} of {len(right)} are right, stated are {stated:.1f}")


main()
