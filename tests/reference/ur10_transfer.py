#!/usr/bin/env python3
"""What is found in one series of a real UR10, carried to its other series: row by row, beside the geometry alone.

    python3 tests/reference/ur10_transfer.py --calib target/release/calib --data ../shared/data/ipa_ur10 [--fit N]

Identifies geometry and diagnoses every N-th row of one series (`--fit`, 4 by default), finds the base anew in the other and predicts
all of it, both ways. Prints mean and largest error (mm) of both models, and how many rows are worse with the diagnosed model by more
than three times their stated sigma, with and without a remark. Needs no packages.
"""
import argparse
import csv
import io
import pathlib
import subprocess
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
SERIES = {"A": "Series_A/measurements_grid.csv", "C": "Series_C/measurements_random_poses.csv"}

INGEST = """
  - id: {id}
    uses: ingest
    with:
      files:
        - file: {file}
          delimiter: ";"
          decimal: comma
          columns:
            q:
              columns: [shoulder_pan_joint, shoulder_lift_joint, elbow_joint, wrist_1_joint, wrist_2_joint, wrist_3_joint]
              unit: rad
            temperature: {{column: measurement_temperature, unit: C, optional: true}}
            x: {{column: measurement_x, unit: mm}}
            y: {{column: measurement_y, unit: mm}}
            z: {{column: measurement_z, unit: mm}}
            sigma_x: {{column: measurement_std_x, unit: mm, optional: true}}
            sigma_y: {{column: measurement_std_y, unit: mm, optional: true}}
            sigma_z: {{column: measurement_std_z, unit: mm, optional: true}}
      instrument: {{constant_um: 10, per_metre_um: 2.5, coverage: 2}}
"""

PIPELINE = """calib: 1
name: ur10_transfer
seed: 1
stages:
  - uses: robot
    with: {{file: {robot}}}
{here}
  - id: fitted
    uses: split
    reads: {{recording: here}}
    with: {{by: every, n: {every}, offset: 0, set: fit, rest: other}}
  - id: geometry
    uses: identify
    reads: {{recording: here, split: fitted}}
    with: {{effects: [base_frame, tool_offset, joint_offset, link_geometry, reduction_ratio]}}
  - id: found
    uses: diagnose
    reads: {{recording: here, split: fitted}}
{there}
  - id: placed
    uses: split
    reads: {{recording: there}}
    with: {{by: every, n: 10, offset: 0, set: fit, rest: other}}
  - id: geometry_there
    uses: transfer
    reads: {{recording: there, split: placed, parameters: geometry, covariance: geometry}}
  - id: found_there
    uses: transfer
    reads: {{recording: there, split: placed, parameters: found, covariance: found}}
"""


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--calib", default="target/debug/calib")
    parser.add_argument("--data", default=ROOT.parent / "shared/data/ipa_ur10", type=pathlib.Path)
    parser.add_argument("--fit", default=4, type=int)
    arguments = parser.parse_args()
    for source, target in (("A", "C"), ("C", "A")):
        with tempfile.TemporaryDirectory() as folder:
            folder = pathlib.Path(folder)
            here, there = (INGEST.format(id=name, file=(arguments.data / SERIES[series]).resolve())
                           for name, series in (("here", source), ("there", target)))
            pipeline = folder / "pipeline.yaml"
            pipeline.write_text(PIPELINE.format(robot=ROOT / "pipelines/ur10/robot.yaml", every=arguments.fit, here=here, there=there))
            run = subprocess.run([arguments.calib, "run", pipeline, "--quiet"], capture_output=True, text=True, cwd=folder)
            if run.returncode != 0:
                raise SystemExit(run.stderr)
            print(f"{source} to {target}")
            print("".join(f"  {line}\n" for line in run.stderr.splitlines() if "warning" in line), end="")

            def rows(step):
                # Columns without any value are not in a table.
                sql = f"SELECT * FROM {step}_prediction ORDER BY sequence"
                query = subprocess.run([arguments.calib, "query", "HEAD", sql, "--csv"], capture_output=True, text=True, cwd=folder)
                if query.returncode != 0:
                    raise SystemExit(query.stderr)
                return list(csv.DictReader(io.StringIO(query.stdout)))

            plain, found = rows("geometry_there"), rows("found_there")
            for name, step in (("geometry", plain), ("diagnosed", found)):
                errors = [float(row["error_mm"]) for row in step]
                print(f"  {name:9} mean {sum(errors) / len(errors):.3f}, max {max(errors):.3f} mm, {len(errors)} rows")
            worse = silent = 0
            for one, other in zip(plain, found):
                sigma = float(other.get("sigma_mm") or 0) ** 2 + float(other.get("noise_mm") or 0) ** 2
                if float(other["error_mm"]) - float(one["error_mm"]) > 3 * sigma ** 0.5:
                    worse += 1
                    silent += not other.get("remark")
            remarked = sum(bool(row.get("remark")) for row in found)
            print(f"  worse by more than three stated sigma: {worse} rows, {silent} of them without a remark; {remarked} rows have one")


if __name__ == "__main__":
    main()
