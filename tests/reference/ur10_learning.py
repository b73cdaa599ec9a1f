#!/usr/bin/env python3
"""What named physics and a correction learned on top of it make of a real robot, on rows that neither has seen.

    python3 tests/reference/ur10_learning.py --calib target/release/calib [--data ../shared/data/ipa_ur10] [--only NAME ...]

Runs `pipelines/ur10` on both series of the UR10 recording of Fraunhofer IPA (README.md says where it comes from), with every
fourth row and with the last quarter held out, and prints held-out mean and largest error after every step, and what was learnt.
Needs no packages; a case takes two minutes or more. Carrying a correction to the other series: `cargo test --test it transfer`.
"""
import argparse
import json
import pathlib
import subprocess
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
SERIES = {"C": "Series_C/measurements_random_poses.csv", "A": "Series_A/measurements_grid.csv"}
EVERY = "{by: every, n: 4, offset: 3}"
SPLITS = {"every fourth row": EVERY, "last quarter": "{by: blocks, count: 4, sets: [fit, fit, fit, validate]}"}


def main():
    cases = {f"{series} {split}": (series, split) for split in SPLITS for series in SERIES}
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--calib", default=ROOT / "target/debug/calib")
    parser.add_argument("--data", default=ROOT.parent / "shared/data/ipa_ur10", type=pathlib.Path)
    parser.add_argument("--only", nargs="*", default=list(cases))
    arguments = parser.parse_args()
    source = (ROOT / "pipelines/ur10/pipeline.yaml").read_text()
    assert source.count(EVERY) == 1
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        (folder / "robot.yaml").write_text((ROOT / "pipelines/ur10/robot.yaml").read_text())
        for name in arguments.only:
            series, split = cases[name]
            (folder / "pipeline.yaml").write_text(source.replace(EVERY, SPLITS[split]))
            begun = time.monotonic()
            command = [arguments.calib, "run", folder / "pipeline.yaml", "--json", "--quiet", "--store", folder / f"store {name}",
                       "--set", f"data={arguments.data.resolve()}", "--set", f"series={SERIES[series]}"]
            run = subprocess.run(command, capture_output=True, text=True)
            print(f"{name}, {time.monotonic() - begun:.0f} s", flush=True)
            if run.returncode != 0:
                print(f"  exit {run.returncode}\n{run.stderr}")
                continue
            said = json.loads(run.stdout)
            for row in said["statistics"]:
                if row["set"] == "validate":
                    print(f"  {row['step']:<10} mean {row['mean_mm']:.4f}  max {row['max_mm']:.3f} mm")
            for row in said["corrections"]:
                if row["chosen"]:
                    print(f"  learned on top: {row['rival']}; {row['reason']}", flush=True)


if __name__ == "__main__":
    main()
