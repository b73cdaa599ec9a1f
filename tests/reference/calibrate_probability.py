"""Fits the numbers of src/numerics/diagnose/words/probability.rs to proofs (`calib simulate prove --out DIR ...`) by maximum likelihood.

    python3 tests/reference/calibrate_probability.py DIR[=CAUSE,CAUSE] [DIR ...]

Every finding with evidence is one draw: it is what it is called, one of its rivals, or none of these, by the sealed truth; names that
the truth accepts count where none is its own. The causes after DIR are those that its pipeline left out (`diagnose: without`): they
stand for physics that no list holds, which is `unknown` at its place, and their findings count LEFT_OUT each. Prints the numbers, the mean log likelihood and a reliability table of the statements that they make.
Needs nothing but Python.
"""
import json
import math
import re
import sys
from pathlib import Path

LEFT_OUT = 0.3


def atoms(effect, place):
    run = re.fullmatch(r"link (\d+)-(\d+)", place)
    places = [f"link {k}" for k in range(int(run[1]), int(run[2]) + 1)] if run else [place]
    return {(effect, at) for at in places}


def draws(argument):
    """((ln loss, no law), [(delta, right) of own name and rivals], place right, weight) of every finding with evidence."""
    folder, _, left_out = argument.partition("=")
    folder, left_out = Path(folder), left_out.split(",") if left_out else []
    for path in sorted((folder / "verdicts").glob("*.json")):
        answer = json.loads(path.read_text())
        truth = json.loads((folder / "sealed" / path.name).read_text())
        listed = lambda effect: "unknown" if effect in left_out else effect
        strict = [atoms(listed(name["effect"]), name["where"]) for name in truth["effects"] + truth["tampered"]]
        accepted = [atoms(name["effect"], name["where"]) for name in truth["accepted"]]
        places = {place for name in strict + accepted for _, place in name}
        for finding in answer["findings"]:
            loss = finding["evidence"]["delta_bic"]
            if loss is None:
                continue
            said = [(0.0, atoms(finding["effect"], finding["where"]))]
            said += [(rival["delta_bic"], atoms(rival["effect"], rival["where"])) for rival in finding["rivals"]]
            known = strict if any(name in strict for _, name in said) else accepted
            names = [(max(delta, 0.0), name in known) for delta, name in said]
            there = any(place in places for _, place in said[0][1])
            yield (math.log(max(loss, 1.0)), finding["effect"] == "unknown"), names, there, (LEFT_OUT if left_out else 1.0)


def stated(numbers, draw):
    constant, by_loss, no_law, temperature, identity = numbers
    (loss, unknown), names, _, _ = draw
    odds = constant + by_loss * loss + no_law * unknown
    none = 1.0 / (1.0 + math.exp(-odds))
    weight = lambda delta: math.exp(-(delta or identity) / (2.0 * max(temperature, 0.05)))
    weights = [1.0] + [weight(delta) for delta, _ in names[1:]]
    return none, [(1.0 - none) * weight / sum(weights) for weight in weights]


def cost(numbers, all_draws):
    total = 0.0
    for draw in all_draws:
        none, shares = stated(numbers, draw)
        right = [share for share, (_, true) in zip(shares, draw[1]) if true]
        total -= draw[3] * math.log(max(sum(right) if right else none, 1e-9))
    return total / sum(draw[3] for draw in all_draws) + 1e-3 * sum(value * value for value in numbers[:3])


def minimum(function, start):
    """Nelder and Mead (1965)."""
    size = len(start)
    simplex = [list(start)] + [[value + (0.5 if i == k else 0.0) for k, value in enumerate(start)] for i in range(size)]
    scored = sorted((function(point), point) for point in simplex)
    for _ in range(1500):
        centre = [sum(point[k] for _, point in scored[:-1]) / size for k in range(size)]
        worst = scored[-1][1]
        along = lambda factor: [c + factor * (w - c) for c, w in zip(centre, worst)]
        tried = along(-1.0)
        value = function(tried)
        if value < scored[0][0]:
            further = along(-2.0)
            best = function(further)
            scored[-1] = (best, further) if best < value else (value, tried)
        elif value < scored[-2][0]:
            scored[-1] = (value, tried)
        else:
            inner = along(0.5)
            value = function(inner)
            if value < scored[-1][0]:
                scored[-1] = (value, inner)
            else:
                best = scored[0][1]
                shrunk = [[b + 0.5 * (p - b) for b, p in zip(best, point)] for _, point in scored]
                scored = [(function(point), point) for point in shrunk]
        scored.sort()
    return scored[0]


def main():
    all_draws = [draw for argument in sys.argv[1:] for draw in draws(argument)]
    value, numbers = minimum(lambda numbers: cost(numbers, all_draws), [1.0, -1.0, 1.0, 2.0, 4.0])
    print(f"{len(all_draws)} findings, mean -ln likelihood {value:.4f}")
    for name, number in zip(["NONE", "BY_LOSS", "NO_LAW", "TEMPERATURE", "IDENTITY"], numbers):
        print(f"{name:12} {number:.3f}")
    nowhere = [draw for draw in all_draws if not any(true for _, true in draw[1])]
    if nowhere:
        print(f"SAME_PLACE   {sum(draw[2] for draw in nowhere) / len(nowhere):.3f} of {len(nowhere)}")
    said = []
    for draw in all_draws:
        _, shares = stated(numbers, draw)
        said += [(share, true) for share, (_, true) in zip(shares, draw[1])]
    ends = [0.0, 0.1, 0.3, 0.5, 0.7, 0.8, 0.9, 0.95, 1.0]
    for low, high in zip(ends, ends[1:]):
        own = [true for share, true in said if low <= share < high or share == high == 1.0]
        if own:
            print(f"{low:4} to {high:4}: {sum(own)} of {len(own)} = {100 * sum(own) / len(own):.1f} %")
    print(f"Brier score {sum((share - true) ** 2 for share, true in said) / len(said):.4f}")


main()
