"""Inputs for `calib diagnose` of public recordings of real arms, and the marks of what is known of them.

    python real_torques.py xl330 FOLDER_OF_THE_SET OUT     a servo with a pendulum, by duty (Rhoban/bam, Apache-2.0)
    python real_torques.py backlash FILE SERVO UP DOWN     a servo that holds its angle while two others push it (roboninecom, CC BY 4.0)

The first writes OUT/robot.json, OUT/recording.csv and OUT/pipeline.yaml; run `calib diagnose OUT/pipeline.yaml`. The second prints between which
angles SERVO rests after it was pushed up by the servo UP and down by DOWN, and between which it stands while they push: its makers' backlash.
What is known of the sets, and today's figures, are in pipelines/proof/real/README.md. Nothing but Python's own library is needed.
"""

import csv
import glob
import json
import os
import sys

# kt/R that makes the pendulum's gravity (0.49 kg at 0.1 m) the known one, Nm/V; what the turning motor takes is found as viscous friction.
PER_VOLT = 0.083


def signed(count):
    """Two's complement of 16 bits, as the servo counts its duty (885 is all of it)."""
    return count - 65536 if count >= 32768 else count


def xl330(source, out):
    """The recordings of a pendulum one after the other, each its own trajectory."""
    rows = []
    for number, name in enumerate(sorted(glob.glob(os.path.join(source, "*.json"))), 1):
        with open(name) as file:
            whole = json.load(file)
        entries = whole if isinstance(whole, list) else whole["entries"]
        start = entries[0]["timestamp"]
        for entry in entries:
            duty = signed(entry["load"]) / 885
            rows.append([number, entry["timestamp"] - start, entry["position"], entry["speed"], duty, entry["input_volts"]])
    os.makedirs(out, exist_ok=True)
    last = max(row[0] for row in rows)
    with open(os.path.join(out, "recording.csv"), "w", newline="") as file:
        table = csv.writer(file)
        table.writerow(["trajectory", "use", "time_s", "q1_rad", "dq1_rad_s", "duty1", "supply_v"])
        for row in rows:
            table.writerow([row[0], "validate" if row[0] > 0.75 * last else "fit", *row[1:]])
    robot = {
        "name": "xl330", "axes": [[0, 1, 0]], "points": [[0, 0, 0]], "tool": [0, 0, -100], "mass": [0.49], "com": [[0, 0, -100]],
        "inertia": [[0.0012, 0, 0, 0.0018, 0, 0.0012]], "ratio": [288.35], "kt": [1], "payload": 0, "payload_com": [0, 0, 0],
        "payload_inertia": [0, 0, 0, 0, 0, 0], "gravity": [0, 0, -9.81], "coupling": [],
        "inertia_tolerance": {"mass_rel": 0.01, "com_mm": 2, "inertia_rel": 0.1},
    }
    with open(os.path.join(out, "robot.json"), "w") as file:
        json.dump(robot, file)
    with open(os.path.join(out, "pipeline.yaml"), "w") as file:
        file.write(
            "calib: 1\nname: xl330\nseed: 1\nstages:\n"
            "  - uses: robot\n    with: {file: robot.json, format: case}\n"
            "  - uses: ingest_torques\n    with:\n      files:\n        - file: recording.csv\n          columns:\n"
            "            time: {column: time_s, unit: s}\n            trajectory: {column: trajectory}\n            usage: {column: use}\n"
            "            q: {column: \"q{j}_rad\", unit: rad}\n            velocity: {column: \"dq{j}_rad_s\", unit: rad/s}\n"
            f"            torque: {{duty: \"duty{{j}}\", supply: {{column: supply_v}}, kt_over_r: {PER_VOLT}}}\n"
            "  - uses: diagnose_torques\n"
        )


# Counts by which a servo that pushes is away from where it waits.
AWAY = 100


def backlash(source, servo, *pushers):
    with open(source) as file:
        rows = list(csv.DictReader(file))
    waits = [float(rows[0][f"target pos ({pusher})"]) for pusher in pushers]
    stands = {"at rest": {}, "pushed": {}}
    last, before = None, None
    for row in rows:
        target, angle = row[f"target pos ({servo})"], row[f"pos ({servo})"]
        places = [row[f"pos ({pusher})"] for pusher in pushers]
        if not angle or not all(places):
            continue
        if target != before:
            # It moved by itself: from where it came is no push.
            last, before = None, target
        away = [abs(float(place) - wait) > AWAY for place, wait in zip(places, waits)]
        if any(away):
            last = away.index(True)
        moves = any(float(row[f"speed ({one})"]) for one in (servo, *pushers))
        if last is not None and not moves:
            stands["pushed" if any(away) else "at rest"].setdefault(last, []).append(float(angle))
    for what, sides in stands.items():
        up, down = [sum(sides[side]) / len(sides[side]) for side in (0, 1)]
        print(f"{what}: {(up - down) * 360 / 4096:.2f} deg ({len(sides[0])} and {len(sides[1])} rows)")


if __name__ == "__main__":
    if len(sys.argv) == 4 and sys.argv[1] == "xl330":
        xl330(sys.argv[2], sys.argv[3])
    elif len(sys.argv) == 6 and sys.argv[1] == "backlash":
        backlash(*sys.argv[2:])
    else:
        sys.exit(__doc__)
