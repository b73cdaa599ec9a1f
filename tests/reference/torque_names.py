#!/usr/bin/env python3
"""What a diagnosis named in concealed recordings of torques, held against the truth: signs, ends of the search, standard deviations.

    calib simulate prove --dynamics --out DIR --seed N --cases 300 --nulls 0.2 --pairs 0.2 --open 0.1
    python3 tests/reference/torque_names.py DIR

Counts findings whose number has another sign than the concealed law of that name and place (of friction: that drives), whose shape number is
at an end of what is looked for, and none of whose numbers is two standard deviations. Prints each, and the counts. Needs no packages.
"""
import json
import math
import re
import sys
from pathlib import Path

# Parameter of a finding, number of the law, and whether they have the same sign.
SIGNS = {
    "viscous_friction": ("viscous", "size", 1), "coulomb_friction": ("coulomb", "size", 1), "asymmetric_friction": ("asymmetry", "size", 1),
    "stribeck_friction": ("stribeck", "size", 1), "presliding_friction": ("kept", "size", 1), "load_friction": ("share", "share", 1),
    "rotor_inertia": ("inertia", "inertia", 1), "torque_constant": ("relative", "share", 1), "current_offset": ("offset", "size", 1),
    "cable_stiffness": ("stiffness", "stiffness", 1), "current_latency": ("latency", "time", 1), "backlash_spikes": ("height", "size", 1),
    "payload_error": ("mass", "mass", 1), "link_mass": ("relative", "share", 1),
}
# Positive of any arm, concealed or not.
POSITIVE = {"viscous_friction", "coulomb_friction", "stribeck_friction", "presliding_friction", "load_friction", "rotor_inertia", "backlash_spikes"}
ENDS = {
    "viscous_friction": {"exponent": (0.4, 1.6)}, "stribeck_friction": {"speed": (0.02, 0.5), "exponent": (0.4, 2.5)},
    "presliding_friction": {"travel": (3e-4, 0.05)}, "joint_elasticity": {"resonance": (2.0, 20.0), "damping": (0.005, 0.6)},
    "backlash_spikes": {"time": (0.01, 0.3)}, "warmup_friction": {"time": (1.0, None)}, "current_offset": {"time": (2.0, None)},
    "wrist_coupling": {"ratio": (0.05, 2.0)}, "current_latency": {"latency": (None, 48.0)}, "torque_ripple": {"order": (None, 9), "motor_order": (None, 3)},
}
LONGEST = 0.9
NEAR = 0.02


def laws(truth):
    """Numbers of each concealed law by effect and place."""
    known = {}
    for effect in truth["effects"]:
        numbers = re.findall(r"(\w+): (-?[\d.]+(?:e-?\d+)?)", effect["law"])
        known[effect["effect"], effect["where"]] = {name: float(value) for name, value in numbers}
    return known


def at_end(value, end):
    return end is not None and value != 0 and abs(math.log(abs(value / end))) < NEAR


def judged(finding, known, seconds):
    effect, numbers = finding["effect"], {one["name"]: one for one in finding["parameters"]}
    if effect == "unknown":
        return
    own, law, same = SIGNS.get(effect, (None, None, 1))
    value = numbers[own]["value"] if own in numbers else None
    true = known.get((effect, finding["where"]), {}).get(law)
    if value is not None and true is not None and value * true * same < 0:
        yield "sign"
    elif value is not None and effect in POSITIVE and value <= 0:
        yield "sign"
    for name, (least, most) in ENDS.get(effect, {}).items():
        most = LONGEST * seconds if name == "time" and most is None else most
        if name in numbers and (at_end(numbers[name]["value"], least) or at_end(numbers[name]["value"], most)):
            yield "end"
    sure = [abs(one["value"]) / one["sigma"] for one in finding["parameters"] if one.get("sigma")]
    if sure and max(sure) < 2.0:
        yield "two sigma"


def main(folder):
    counts, findings, recordings = {"sign": 0, "end": 0, "two sigma": 0}, 0, 0
    for path in sorted(folder.glob("verdicts/*.json")):
        truth = json.loads((folder / "sealed" / path.name).read_text())
        said = json.loads(path.read_text())
        recordings += 1
        with open(folder / "recordings" / path.stem / "recording.csv", encoding="utf-8") as file:
            last = file.readlines()[-1]
        known = laws(truth)
        for finding in said["findings"]:
            findings += 1
            for what in judged(finding, known, float(last.split(",")[0])):
                counts[what] += 1
                numbers = ", ".join(f"{one['name']} {one['value']:.4g} +- {one.get('sigma') or 0:.2g}" for one in finding["parameters"])
                print(f"{path.stem} {what}: {finding['effect']} {finding['where']} ({numbers}); concealed {known.get((finding['effect'], finding['where']))}")
    print(f"{recordings} recordings, {findings} findings: " + ", ".join(f"{what} {count}" for what, count in counts.items()))
    return 1 if any(counts.values()) else 0


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    sys.exit(main(Path(sys.argv[1])))
