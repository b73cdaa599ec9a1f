#!/usr/bin/env python3
"""Wrong set-ups of two arms, made from recordings of the twin: is each named, is its remedy right, is the exit code right?

    python3 tests/reference/setups.py --calib target/debug/calib [--only TEXT] [--arm NAME] [--details]

Every set-up is one slip between files, robot file and pipeline. Marks: `named` where the first finding (or the verdict) says what was done, `remedy`
where it says what to write to undo it, `code` where `calib diagnose` ends with the code that is due: 10 where the set-up is wrong, 0 where it is a
warning or no error at all, 2 where the pipeline is refused with its place. Where a slip cannot be seen, or equals another, the mark is of the other.
"""
import argparse
import collections
import csv
import json
import pathlib
import re
import subprocess
import sys
import tempfile

PIPELINE = """calib: 1
name: setup
seed: 1
stages:
  - uses: robot
    with: {file: robot.json, format: case}
  - uses: ingest
    with:
      files:
        - file: controller.csv
          columns:
            point_id: {column: point_id}
            payload: {column: payload_kg, unit: kg, optional: true}
            q: {column: "q{j}_deg", unit: deg}
        - file: tracker.csv
          columns:
            point_id: {column: point_id}
            x: {column: x_mm, unit: mm}
            y: {column: y_mm, unit: mm}
            z: {column: z_mm, unit: mm}
      join: {by: id}
      instrument: {constant_um: 10, per_metre_um: 2.5, coverage: 2}
  - uses: split
    with: {by: every, n: 4}
  - uses: diagnose
"""


class Cell:
    """Files of a recording, to be spoilt."""

    def __init__(self, folder):
        self.controller = list(csv.DictReader(open(folder / "controller.csv")))
        self.tracker = list(csv.DictReader(open(folder / "tracker.csv")))
        self.robot = json.load(open(folder / "robot.json"))
        self.pipeline = PIPELINE
        self.joints = len(self.robot["axes"])

    def joint(self, change):
        for row in self.controller:
            q = [float(row[f"q{j + 1}_deg"]) for j in range(self.joints)]
            for j, value in enumerate(change(q)):
                row[f"q{j + 1}_deg"] = repr(value)

    def point(self, change):
        for row in self.tracker:
            for axis, value in zip("xyz", change([float(row[f"{axis}_mm"]) for axis in "xyz"])):
                row[f"{axis}_mm"] = repr(value)

    def by_order(self):
        self.pipeline = self.pipeline.replace("join: {by: id}", "join: {by: order}").replace("            point_id: {column: point_id}\n            x", "            x")

    def write(self, folder):
        for name, rows in (("controller.csv", self.controller), ("tracker.csv", self.tracker)):
            with open(folder / name, "w", newline="") as file:
                writer = csv.DictWriter(file, rows[0].keys())
                writer.writeheader()
                writer.writerows(rows)
        (folder / "robot.json").write_text(json.dumps(self.robot))
        (folder / "pipeline.yaml").write_text(self.pipeline)


def signs(*reversed_joints):
    def spoil(cell):
        cell.joint(lambda q: [-value if j + 1 in reversed_joints else value for j, value in enumerate(q)])
    return spoil


def zeros(**by):
    def spoil(cell):
        cell.joint(lambda q: [value + by.get(f"j{j + 1}", 0) for j, value in enumerate(q)])
    return spoil


def exchanged(a, b):
    def spoil(cell):
        def change(q):
            q[a - 1], q[b - 1] = q[b - 1], q[a - 1]
            return q
        cell.joint(change)
    return spoil


def coupled(sign):
    return lambda cell: cell.joint(lambda q: [value + sign * q[1] if j == 2 else value for j, value in enumerate(q)])


def scaled(factor):
    return lambda cell: cell.point(lambda x: [factor * value for value in x])


def turned(change):
    return lambda cell: cell.point(change)


def angles(factor):
    return lambda cell: cell.joint(lambda q: [factor * value for value in q])


def setting(old, new):
    def spoil(cell):
        assert old in cell.pipeline
        cell.pipeline = cell.pipeline.replace(old, new)
    return spoil


def both(*all_of):
    def spoil(cell):
        for one in all_of:
            one(cell)
    return spoil


def shifted(cell):
    cell.by_order()
    cell.tracker = cell.tracker[1:] + cell.tracker[:1]


def reversed_rows(cell):
    cell.by_order()
    cell.tracker.reverse()


def by_text(cell):
    cell.by_order()
    order = sorted(range(len(cell.tracker)), key=lambda k: str(k + 1))
    cell.tracker = [cell.tracker[k] for k in order]


def lengths(factor):
    def spoil(cell):
        for key in ("points", "com"):
            cell.robot[key] = [[factor * value for value in row] for row in cell.robot[key]]
        for key in ("tool", "payload_com"):
            cell.robot[key] = [factor * value for value in cell.robot[key]]
    return spoil


def longer(joint, axis, by):
    """All behind a joint is displaced in the robot file."""
    def spoil(cell):
        for row in cell.robot["points"][joint:]:
            row[axis] += by
        cell.robot["tool"][axis] += by
    return spoil


def axis_typo(cell):
    cell.robot["points"][1][0] += 120


def other_arm(cell):
    """The longer arm of the same family."""
    longer(2, 2, 125)(cell)
    longer(4, 0, 210)(cell)


def flange_for_tool(cell):
    wrist = cell.robot["points"][-1]
    cell.robot["tool"] = [2 * wrist[k] - cell.robot["tool"][k] for k in range(3)]


def no_tool(cell):
    cell.robot["tool"] = list(cell.robot["points"][-1])


def blank_payload(cell):
    for row in cell.controller:
        row["payload_kg"] = ""


def rounded(cell):
    cell.joint(lambda q: [round(value, 1) for value in q])


def two_arms(cell):
    """The second half was measured after the tracker had been moved."""
    half = len(cell.tracker) // 2
    for k, row in enumerate(cell.tracker):
        if k >= half:
            x, y, z = (float(row[f"{axis}_mm"]) for axis in "xyz")
            row["x_mm"], row["y_mm"], row["z_mm"] = repr(y + 700), repr(-x + 1200), repr(z + 40)


def other_ids(cell):
    for row in cell.tracker:
        row["point_id"] = "pt_" + row["point_id"][1:]


def sign_list(joints, *reversed_joints):
    return re.escape("sign: [" + ", ".join("-1" if j + 1 in reversed_joints else "1" for j in range(joints)) + "]")


def zero_list(joints, **by):
    return re.escape("zero: [" + ", ".join(str(by.get(f"j{j + 1}", 0)) for j in range(joints)) + "]")


MIRROR = "mirror image"
GENERAL = r"none of the usual errors explains it|the joints are|mirror image|differs from the robot file"

#: Name, slip, code, what is said, what mends it. `.` where nothing is asked.
SETUPS = [
    *[(f"joint {j} reversed", signs(j), 10, rf"joint {j} turns the other way|mirror image" if j == 1 else rf"joint {j} turns the other way",
       ("sign", j)) for j in range(1, 7)],
    ("joints 1, 4, 6 reversed", signs(1, 4, 6), 10, r"joints 1, 4, 6 turn the other way", ("sign", 1, 4, 6)),
    ("joints 2, 3, 5 reversed", signs(2, 3, 5), 10, r"joints 2, 3, 5 turn the other way", ("sign", 2, 3, 5)),
    ("joints 2, 3 reversed", signs(2, 3), 10, r"joints 2, 3 turn the other way", ("sign", 2, 3)),
    ("all joints reversed", signs(1, 2, 3, 4, 5, 6), 10, r"turn the other way|mirror image", ("sign", 1, 2, 3, 4, 5, 6)),
    ("joint 2 counts from +90", zeros(j2=90), 10, r"reads 90 deg at the zero of joint 2", ("zero", {"j2": 90})),
    ("joint 2 counts from -90", zeros(j2=-90), 10, r"reads -90 deg at the zero of joint 2", ("zero", {"j2": -90})),
    ("joint 3 counts from +90", zeros(j3=90), 10, r"reads 90 deg at the zero of joint 3", ("zero", {"j3": 90})),
    ("joint 5 counts from -90", zeros(j5=-90), 10, r"reads -90 deg at the zero of joint 5", ("zero", {"j5": -90})),
    ("joints 2 and 3 count from -90 and +90", zeros(j2=-90, j3=90), 10, r"-90 deg at the zero of joint 2 and 90 deg at that of joint 3",
     ("zero", {"j2": -90, "j3": 90})),
    ("joint 3 mastered 5 deg off", zeros(j3=5), 10, r"zero of joint 3 is off by", r"master joint 3"),
    ("points in m read in mm", scaled(1e-3), 10, r"points are in metres", r"x: \{\.\., unit: m\}"),
    ("points in inches read in mm", scaled(1 / 25.4), 10, r"points are in inches", r"x: \{\.\., unit: in\}"),
    ("points in um read in mm", scaled(1e3), 10, r"holds micrometres", r"`unit: um`"),
    ("joints in rad read in deg", angles(3.141592653589793 / 180), 10, r"joints are in rad", r"unit: rad"),
    ("joints in deg read in rad", setting("unit: deg", "unit: rad"), 10, r"deg", r"unit: deg"),
    ("joints 2 and 3 exchanged", exchanged(2, 3), 10, r"joints 2 and 3 are exchanged", r"\[<joint 1>, <joint 3>, <joint 2>,"),
    ("joints 4 and 5 exchanged", exchanged(4, 5), 10, r"joints 4 and 5 are exchanged", r"<joint 3>, <joint 5>, <joint 4>,"),
    ("y of the tracker negated", turned(lambda x: [x[0], -x[1], x[2]]), 10, MIRROR, r"exchange the columns of `x` and `y`"),
    ("x and y of the tracker exchanged", turned(lambda x: [x[1], x[0], x[2]]), 10, MIRROR, r"exchange the columns of `x` and `y`"),
    ("joint 3 reported plus joint 2", coupled(1), 10, r"joint 3 is reported plus the angle of joint 2", r"joint: 3, by: 2, ratio: 1"),
    ("joint 3 reported minus joint 2", coupled(-1), 10, r"joint 3 is reported minus the angle of joint 2", r"joint: 3, by: 2, ratio: -1"),
    ("points one row late, joined by order", shifted, 10, r"rows? (ahead of|behind)", r"join: \{by: id\}"),
    ("points in reverse order", reversed_rows, 10, r"reverse order", r"join: \{by: id\}"),
    ("points sorted as text", by_text, 10, r"sorted by name as text", r"join: \{by: id\}"),
    ("other ids in the tracker's file", other_ids, 10, r"no partner|partners for", r"ids must be the same|match: number|e\.g\."),
    ("a length 100 mm too long", longer(2, 2, 100), 10, r"a length in the robot file|only the axis|by more than manufacture", r"typing error"),
    ("lengths of the robot file in m", lengths(1e-3), 10, r"lengths of the robot file are in (metres|millimetres)", r"units: \{length: "),
    ("another arm of the family", other_arm, 10, r"none of the usual errors|more than manufacture allows|a length in the robot file", r"robot file"),
    ("metres, and joint 4 reversed", both(scaled(1e-3), signs(4)), 10, r"(?s)metres.*joint 4|joint 4.*metres", r"(?s)unit: m.*sign|sign.*unit: m"),
    ("two stations in one recording", two_arms, 10, r"two set-ups are in one recording", r"recording of its own"),
    ("payload left blank", blank_payload, 0, r"payload", r"payload"),
    ("joints logged to 0.1 deg", rounded, 0, r"0\.1 deg|rounded", r"."),
    # The point is estimated, so that nothing else is wrong: a warning.
    ("tool entered inverse", flange_for_tool, 0, r"measured point is \d+ mm from the `tool`", r"its signs and in the frame"),
    ("tool left at the wrist", no_tool, 0, r"measured point is \d+ mm from the `tool`", r"is it that of this recording"),
]


def remedy(asked, joints):
    if isinstance(asked, str):
        return asked
    kind, *rest = asked
    if kind == "sign":
        return sign_list(joints, *rest)
    return zero_list(joints, **rest[0])


def told(calib, folder, store):
    done = subprocess.run([calib, "diagnose", "pipeline.yaml", "--quiet", "--store", store], cwd=folder, capture_output=True, text=True)
    return done.returncode, done.stdout + done.stderr


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--calib", default="target/debug/calib")
    parser.add_argument("--only", default="")
    parser.add_argument("--arm", choices=["sr210d", "compact6"])
    parser.add_argument("--details", action="store_true")
    arguments = parser.parse_args()
    calib = str(pathlib.Path(arguments.calib).resolve())
    counts = collections.Counter()
    with tempfile.TemporaryDirectory() as work:
        work = pathlib.Path(work)
        print(f"{'arm':9} {'set-up':42} named remedy code")
        for arm, seed in (("sr210d", 3), ("compact6", 5)):
            if arguments.arm and arguments.arm != arm:
                continue
            made = work / arm
            subprocess.run([calib, "simulate", "conceal", "--out", made, "--seed", str(seed), "--cases", "1", "--family", "gear_cyclic", "--robot",
                            arm, "--points", "120"], check=True, capture_output=True)
            for number, (name, slip, due, said, mend) in enumerate(SETUPS):
                if arguments.only not in name:
                    continue
                cell = Cell(made / "recordings" / "c0001")
                slip(cell)
                folder = work / f"{arm}_{number}"
                folder.mkdir()
                cell.write(folder)
                code, text = told(calib, folder, folder / "store")
                flat = " ".join(text.split())
                marks = [bool(re.search(said, flat)), bool(re.search(remedy(mend, cell.joints), flat)), code == due]
                counts.update({"set-ups": 1, "named": marks[0], "remedy": marks[1], "code": marks[2]})
                shown = ["yes" if mark else "NO" for mark in marks]
                print(f"{arm:9} {name:42} {shown[0]:5} {shown[1]:6} {shown[2]:4} {code}", flush=True)
                if arguments.details or not all(marks):
                    print("    " + flat[:700], flush=True)
    print(f"{counts['set-ups']} set-ups: {counts['named']} named, {counts['remedy']} with the right remedy, {counts['code']} with the right code")
    sys.exit(0 if counts["named"] == counts["remedy"] == counts["code"] == counts["set-ups"] else 1)


if __name__ == "__main__":
    main()
