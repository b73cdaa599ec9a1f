#!/usr/bin/env python3
"""What `calib diagnose` makes of a real robot, and of faults injected into its recording.

    python3 tests/reference/ur10_diagnosis.py --calib target/release/calib --data ../shared/data/ipa_ur10 [--only NAME ...]

Runs the UR10 recording of Fraunhofer IPA (pipelines/gallery.md says where it comes from) whole, by blocks, and with
a shifted joint log, exchanged rows, a joint of the wrong sign and a slow drift of the temperature written into copies of the
file. Prints a line a case: held-out mean and largest error before and after, seconds, findings. Needs no packages.
"""
import argparse
import csv
import json
import pathlib
import shutil
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
C = "Series_C/measurements_random_poses.csv"
A = "Series_A/measurements_grid.csv"
JOINTS = ["shoulder_pan_joint", "shoulder_lift_joint", "elbow_joint", "wrist_1_joint", "wrist_2_joint", "wrist_3_joint"]
POINT = ["measurement_x", "measurement_y", "measurement_z"]


def number(text):
    return float(text.replace(",", "."))


def text(value):
    return repr(value).replace(".", ",")


def shifted(rows):
    """The joint log of a stretch belongs to the row 30 before."""
    joints = [[row[name] for name in JOINTS] for row in rows]
    for i in range(len(rows) * 3 // 5, len(rows)):
        for name, value in zip(JOINTS, joints[i - 30]):
            rows[i][name] = value


def exchanged(rows):
    a, b = len(rows) // 3, len(rows) // 3 + 5
    for name in POINT:
        rows[a][name], rows[b][name] = rows[b][name], rows[a][name]


def flipped(rows):
    for row in rows:
        row["wrist_1_joint"] = text(-number(row["wrist_1_joint"]))


def drifting(rows):
    """0.3 K/h of a steel-like arm: the points grow about the base by 12e-6 a kelvin, 20 s a row."""
    for i, row in enumerate(rows):
        kelvin = 0.3 * i * 20 / 3600
        row["measurement_temperature"] = text(number(row["measurement_temperature"]) + kelvin)
        for name in POINT:
            row[name] = text(number(row[name]) * (1 + 12e-6 * kelvin))


EVERY = "{by: every, n: 4, offset: 3}"
BLOCKS = "{by: blocks, count: 4, sets: [fit, fit, fit, validate]}"
CASES = {
    "C every fourth row": (C, None, EVERY),
    "C last quarter": (C, None, BLOCKS),
    "A every fourth row": (A, None, EVERY),
    "A last quarter": (A, None, BLOCKS),
    "C joint log shifted by 30 rows": (C, shifted, EVERY),
    "C two rows exchanged": (C, exchanged, EVERY),
    "C wrist 1 of the wrong sign": (C, flipped, EVERY),
    "C drift of 0.3 K/h": (C, drifting, EVERY),
}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--calib", default="target/debug/calib")
    parser.add_argument("--data", default=ROOT.parent / "shared/data/ipa_ur10", type=pathlib.Path)
    parser.add_argument("--only", nargs="*", default=list(CASES))
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        for name in arguments.only:
            series, change, split = CASES[name]
            data = arguments.data
            if change:
                with open(data / series, newline="", encoding="utf-8-sig") as file:
                    reader = csv.DictReader(file, delimiter=";")
                    rows = list(reader)
                change(rows)
                data = folder / "data"
                (data / series).parent.mkdir(parents=True, exist_ok=True)
                with open(data / series, "w", newline="") as file:
                    writer = csv.DictWriter(file, reader.fieldnames, delimiter=";")
                    writer.writeheader()
                    writer.writerows(rows)
            own = shutil.copytree(ROOT / "pipelines/ur10", folder / f"pipeline {name}") / "pipeline.yaml"
            own.write_text(own.read_text().replace(EVERY, split))
            begun = time.monotonic()
            command = [arguments.calib, "diagnose", own, "--json", "--quiet"]
            command += ["--store", folder / f"store {name}", "--set", f"data={data}", "--set", f"series={series}"]
            run = subprocess.run(command, capture_output=True, text=True)
            seconds = time.monotonic() - begun
            if run.returncode != 0:
                print(f"{name}: exit {run.returncode}\n{run.stderr}")
                continue
            said = json.loads(run.stdout)
            before, after = (said[key] or {} for key in ("before", "after"))
            figure = lambda of, key: "-" if of.get(key) is None else f"{of[key]:.3f}"
            errors = (f"{what} {figure(before, key)} -> {figure(after, key)} mm"
                      for what, key in (("mean", "validate_mean_mm"), ("max", "validate_max_mm")))
            print(f"{name}: {said['verdict']}, {', '.join(errors)}, {seconds:.0f} s")
            for finding in said["findings"]:
                print(f"    {finding['effect']:18} {finding['where']:14} {finding['statement']}")
            sys.stdout.flush()


if __name__ == "__main__":
    main()
