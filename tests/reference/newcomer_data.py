#!/usr/bin/env python3
"""Twelve ways in which a newcomer's files are written, each through `calib init` and `calib check --data`: machine time, lines to edit, result.

    python3 tests/reference/newcomer_data.py --calib target/debug/calib [--only TEXT] [--details]

The files are those of a simulated arm (`calib simulate conceal`), written anew; reflectors, orientations and the arm on a track are placed by forward
kinematics of this script. `right`: what `init` wrote, with the data sheet as its robot file and nothing else changed, gives the error of the plain
files, from as many rows. `asks`: `init` did not understand something and says so where it wrote REPLACE. Anything else is wrong. REPLACE and CHECK
are the lines that `init` marks, beyond those that every pipeline has (instrument, identity).
"""
import argparse
import csv
import datetime
import io
import math
import pathlib
import random
import re
import resource
import shutil
import subprocess
import sys
import tempfile
import time
import zipfile

SHEET = pathlib.Path(__file__).resolve().parents[2] / "pipelines" / "sr210d" / "robot.yaml"
#: x y z of a reflector at the tool, mm, zero pose.
REFLECTORS = {"A": (1835, 53, 1263), "B": (1835, -60, 1340), "C": (1900, 10, 1395)}


def product(a, b):
    return [[sum(a[i][k] * b[k][j] for k in range(4)) for j in range(4)] for i in range(4)]


def about(axis, point, angle):
    x, y, z = axis
    c, s = math.cos(angle), math.sin(angle)
    v = 1 - c
    turn = [[c + x * x * v, x * y * v - z * s, x * z * v + y * s], [y * x * v + z * s, c + y * y * v, y * z * v - x * s],
            [z * x * v - y * s, z * y * v + x * s, c + z * z * v]]
    moved = [point[i] - sum(turn[i][k] * point[k] for k in range(3)) for i in range(3)]
    return [[*turn[i], moved[i]] for i in range(3)] + [[0, 0, 0, 1]]


def along(axis, length):
    return [[1 if i == j else 0 for j in range(3)] + [axis[i] * length] for i in range(3)] + [[0, 0, 0, 1]]


AXES = [((0, 0, 1), (0, 0, 0)), ((0, -1, 0), (312, 0, 0)), ((0, -1, 0), (312, 0, 1075)), ((1, 0, 0), (0, 0, 1310)),
        ((0, -1, 0), (1594, 0, 1310)), ((1, 0, 0), (0, 0, 1310))]
#: The arm's base as the tracker sees it.
BASE = product([[1, 0, 0, 3900], [0, 1, 0, -1100], [0, 0, 1, 250], [0, 0, 0, 1]], about((0, 0, 1), (0, 0, 0), 2.1))


def flange(q):
    pose = BASE
    for (axis, point), degrees in zip(AXES, q):
        pose = product(pose, about(axis, point, math.radians(degrees)))
    return pose


def place(pose, point, rng):
    return [sum(pose[i][k] * point[k] for k in range(3)) + pose[i][3] + rng.gauss(0, 0.012) for i in range(3)]


def quaternion(pose):
    w = math.sqrt(max(0.0, 1 + pose[0][0] + pose[1][1] + pose[2][2])) / 2
    if w < 1e-6:
        w = 1e-6
    return [w] + [(pose[i][j] - pose[j][i]) / (4 * w) for i, j in ((2, 1), (0, 2), (1, 0))]


class Files:
    """The plain recording, and a folder to write it to in another way."""

    def __init__(self, recording, folder):
        read = lambda name: list(csv.DictReader(open(recording / name)))
        self.folder, self.rng = folder, random.Random(7)
        points = {row["point_id"]: row for row in read("tracker.csv")}
        self.rows = [(row, points[row["point_id"]]) for row in read("controller.csv")]
        self.robot = SHEET.read_text().replace("tool: {point: [1854, 50, 1340]}", "tool: {point: [1835, 53, 1263]}")
        self.options = []

    def q(self, row):
        return [float(row[f"q{j}_deg"]) for j in range(1, 7)]

    def write(self, name, header, rows, delimiter=",", encoding="utf-8"):
        lines = ([delimiter.join(header)] if header else []) + [delimiter.join(str(cell) for cell in row) for row in rows]
        (self.folder / name).write_bytes("".join(line + "\n" for line in lines).encode(encoding))
        return name

    def controller(self, name=lambda row: row["point_id"], more=()):
        header = ["Point", *[f"J{j}" for j in range(1, 7)], "payload_kg", *more]
        rows = [[name(row), *[row[f"q{j}_deg"] for j in range(1, 7)], row["payload_kg"], *[row[key] for key in more]] for row, _ in self.rows]
        return self.write("controller.csv", header, rows)

    def points(self):
        return [[point["point_id"], *[point[f"{axis}_mm"] for axis in "xyz"]] for _, point in self.rows]


def plain(files):
    return [files.controller(), files.write("tracker.csv", ["Point", "X [mm]", "Y [mm]", "Z [mm]"], files.points())]


def headerless(files):
    return [files.controller(), files.write("tracker.txt", None, files.points(), " ")]


def other_names(files):
    number = lambda name: int(name[1:])
    points = [[f"pt_{number(name):04}", *rest] for name, *rest in files.points()]
    return [files.controller(lambda row: f"Pose {number(row['point_id'])}"), files.write("tracker.csv", ["name", "x", "y", "z"], points)]


def utf_16(files):
    comma = lambda cells: [str(cell).replace(".", ",") for cell in cells]
    rows = [comma([row["point_id"], *files.q(row), row["payload_kg"], *[point[f"{axis}_mm"] for axis in "xyz"]]) for row, point in files.rows]
    header = ["Punkt", *[f"Achse {j} [Grad]" for j in range(1, 7)], "Nutzlast [kg]", "X [mm]", "Y [mm]", "Z [mm]"]
    return [files.write("messung.txt", header, rows, "\t", "utf-16")]


def thousands(files):
    mark = lambda text: f"{float(text):,.3f}".replace(",", "_").replace(".", ",").replace("_", ".")
    points = [[name, *[mark(cell) for cell in cells]] for name, *cells in files.points()]
    return [files.controller(), files.write("tracker.csv", ["Point", "X", "Y", "Z"], points, ";")]


def text_cells(files):
    """A workbook in which every number is a text."""
    header = ["Point", *[f"J{j}" for j in range(1, 7)], "payload_kg", "X [mm]", "Y [mm]", "Z [mm]"]
    rows = [[row["point_id"], *[row[f"q{j}_deg"] for j in range(1, 7)], row["payload_kg"], *[point[f"{axis}_mm"] for axis in "xyz"]]
            for row, point in files.rows]
    cells = lambda row: "".join(f'<c t="inlineStr"><is><t>{cell}</t></is></c>' for cell in row)
    sheet = "".join(f"<row>{cells(row)}</row>" for row in [header, *rows])
    kind = "http://schemas.openxmlformats.org"
    parts = {
        "[Content_Types].xml": f'<Types xmlns="{kind}/package/2006/content-types"><Default Extension="xml" ContentType="application/xml"/>'
        '<Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/>'
        '<Override PartName="/xl/workbook.xml" ContentType="application/vnd.openxmlformats-officedocument.spreadsheetml.sheet.main+xml"/>'
        '<Override PartName="/xl/worksheets/sheet1.xml" ContentType="application/vnd.openxmlformats-officedocument.spreadsheetml.worksheet+xml"/></Types>',
        "_rels/.rels": f'<Relationships xmlns="{kind}/package/2006/relationships"><Relationship Id="r1" Type="{kind}/officeDocument/2006/'
        'relationships/officeDocument" Target="xl/workbook.xml"/></Relationships>',
        "xl/workbook.xml": f'<workbook xmlns="{kind}/spreadsheetml/2006/main" xmlns:r="{kind}/officeDocument/2006/relationships"><sheets>'
        '<sheet name="Messung" sheetId="1" r:id="r1"/></sheets></workbook>',
        "xl/_rels/workbook.xml.rels": f'<Relationships xmlns="{kind}/package/2006/relationships"><Relationship Id="r1" Type="{kind}/'
        'officeDocument/2006/relationships/worksheet" Target="worksheets/sheet1.xml"/></Relationships>',
        "xl/worksheets/sheet1.xml": f'<worksheet xmlns="{kind}/spreadsheetml/2006/main"><sheetData>{sheet}</sheetData></worksheet>',
    }
    book = io.BytesIO()
    with zipfile.ZipFile(book, "w") as archive:
        for name, text in parts.items():
            archive.writestr(name, '<?xml version="1.0" encoding="UTF-8"?>' + text)
    (files.folder / "messung.xlsx").write_bytes(book.getvalue())
    return ["messung.xlsx"]


def reflectors(files):
    names = [files.controller()]
    for name, point in REFLECTORS.items():
        rows = [[row["point_id"], *[f"{value:.4f}" for value in place(flange(files.q(row)), point, files.rng)]] for row, _ in files.rows]
        names.append(files.write(f"smr_{name}.csv", ["Point", "X [mm]", "Y [mm]", "Z [mm]"], rows))
    return names


def grid_and_check(files):
    header = ["Point", *[f"J{j}" for j in range(1, 7)], "payload_kg", "X", "Y", "Z"]
    rows = [[row["point_id"], *files.q(row), row["payload_kg"], *[point[f"{axis}_mm"] for axis in "xyz"]] for row, point in files.rows]
    return [files.write("grid.csv", header, rows[:150]), files.write("check.csv", header, rows[150:])]


def track(files):
    """Seven axes from a URDF, the first of them a track; the tip is named as its maker does."""
    lines = ['<robot name="cell">', '<link name="world"/>']
    chain = [("prismatic", (0, 1, 0), (0, 0, 0), "lower=\"-2\" upper=\"2\"")]
    chain += [("revolute", axis, point, "lower=\"-6.2\" upper=\"6.2\"") for axis, point in AXES]
    last = (0, 0, 0)
    for k, (kind, axis, point, limits) in enumerate(chain):
        step = [(point[i] - last[i]) / 1e3 for i in range(3)]
        last = point
        lines.append(f'<link name="l{k}"/><joint name="a{k}" type="{kind}"><parent link="{"world" if k == 0 else f"l{k - 1}"}"/><child link="l{k}"/>'
                     f'<origin xyz="{step[0]} {step[1]} {step[2]}"/><axis xyz="{axis[0]} {axis[1]} {axis[2]}"/>'
                     f'<limit {limits} effort="1" velocity="1"/></joint>')
    tip = [(REFLECTORS["A"][i] - last[i]) / 1e3 for i in range(3)]
    lines.append(f'<link name="smr_holder"/><joint name="f" type="fixed"><parent link="l6"/><child link="smr_holder"/>'
                 f'<origin xyz="{tip[0]} {tip[1]} {tip[2]}"/></joint></robot>')
    (files.folder / "cell.urdf").write_text("\n".join(lines))
    rows = []
    for row, _ in files.rows:
        rail = files.rng.uniform(-1500, 1500)
        pose = BASE
        for (axis, point), value in zip([((0, 1, 0), None), *AXES], [rail, *files.q(row)]):
            pose = product(pose, along(axis, value) if point is None else about(axis, point, math.radians(value)))
        rows.append([row["point_id"], f"{rail:.3f}", *files.q(row), *[f"{value:.4f}" for value in place(pose, REFLECTORS["A"], files.rng)]])
    files.robot = None
    files.options = ["--urdf", "cell.urdf", "--tip", "smr_holder"]
    return [files.write("data.csv", ["Point", "J1_mm", *[f"J{j}_deg" for j in range(2, 8)], "X_mm", "Y_mm", "Z_mm"], rows)]


def u95(files):
    points = [[*row, 0.036, 0.036, 0.041] for row in files.points()]
    return [files.controller(), files.write("tracker.csv", ["Point", "X [mm]", "Y [mm]", "Z [mm]", "U95 X [mm]", "U95 Y [mm]", "U95 Z [mm]"], points)]


def quaternions(files):
    rows = []
    for row, _ in files.rows:
        pose = flange(files.q(row))
        rows.append([row["point_id"], *[f"{value:.4f}" for value in place(pose, REFLECTORS["A"], files.rng)],
                     *[f"{value:.8f}" for value in quaternion(pose)]])
    return [files.controller(), files.write("tracker.csv", ["Point", "X", "Y", "Z", "qw", "qx", "qy", "qz"], rows)]


def locale_times(files):
    """No ids: times of day of a German and of an American program, of clocks half a second apart."""
    begin = datetime.datetime(2026, 11, 22, 8, 15, 0)
    at = lambda row, late: begin + datetime.timedelta(seconds=float(row["time_s"]) + late)
    german = lambda moment: moment.strftime("%d.%m.%Y %H:%M:%S,") + f"{moment.microsecond // 1000:03}"
    american = lambda moment: moment.strftime("%m/%d/%Y %I:%M:%S.") + f"{moment.microsecond // 1000:03}" + moment.strftime(" %p")
    rows = [[german(at(row, 0)), *[str(value).replace(".", ",") for value in files.q(row)]] for row, _ in files.rows]
    one = files.write("steuerung.csv", ["Zeit", *[f"A{j}" for j in range(1, 7)]], rows, ";")
    rows = [[american(at(row, 1.5)), *[point[f"{axis}_mm"] for axis in "xyz"]] for row, point in files.rows]
    return [one, files.write("tracker.csv", ["Timestamp", "X", "Y", "Z"], rows)]


def wide(files):
    """Fifty thousand channels beside what matters."""
    blank = ["0.5"] * 50_000
    header = ["Point", *[f"J{j}" for j in range(1, 7)], "payload_kg", "X", "Y", "Z", *[f"ch{k}" for k in range(len(blank))]]
    rows = [[row["point_id"], *files.q(row), row["payload_kg"], *[point[f"{axis}_mm"] for axis in "xyz"], *blank] for row, point in files.rows]
    return [files.write("data.csv", header, rows)]


#: Name, files, rows of the recording for each pose, largest mean error after geometry, mm (None: that of the plain files).
VARIANTS = [
    ("plain files", plain, 1, None), ("points without a header", headerless, 1, None), ("ids that match by number", other_names, 1, None),
    ("UTF-16, tabs, decimal comma", utf_16, 1, None), ("1.234,567", thousands, 1, None), ("numbers as text in a sheet", text_cells, 1, None),
    ("three reflectors, a file each", reflectors, 3, 0.03), ("grid and check set", grid_and_check, 1, None),
    ("URDF with a track and a tip", track, 1, 0.03), ("U95 columns", u95, 1, None), ("quaternions", quaternions, 1, 0.03),
    ("time stamps of two locales", locale_times, 1, None), ("50,000 columns", wide, 1, None),
]
#: Marks that every pipeline has: instrument, and four in identity, in two lines.
USUAL = 2


def timed(command, folder):
    before, begun = resource.getrusage(resource.RUSAGE_CHILDREN), time.monotonic()
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return done.returncode, done.stdout + done.stderr, time.monotonic() - begun, cpu


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--calib", default="target/debug/calib")
    parser.add_argument("--only", default="")
    parser.add_argument("--details", action="store_true")
    arguments = parser.parse_args()
    calib = str(pathlib.Path(arguments.calib).resolve())
    bad, usual = 0, None
    with tempfile.TemporaryDirectory() as work:
        work = pathlib.Path(work)
        subprocess.run([calib, "simulate", "conceal", "--out", work / "own", "--seed", "3", "--cases", "1", "--family", "gear_cyclic", "--robot", "sr210d",
                        "--points", "150"], check=True, capture_output=True)
        print(f"{'files':32} REPLACE CHECK  rows   after mm  wall s  CPU s  result")
        for name, write, targets, most in VARIANTS:
            if arguments.only not in name and name != "plain files":
                continue
            folder = work / write.__name__
            folder.mkdir()
            files = Files(work / "own" / "recordings" / "c0001", folder)
            data = write(files)
            code, said, wall, cpu = timed([calib, "init", ".", *files.options, "--data", *data], folder)
            rows, after, marks = None, None, (0, 0)
            if (folder / "pipeline.yaml").is_file():
                text = (folder / "pipeline.yaml").read_text()
                lines = text.splitlines()
                marks = tuple(sum(word in line for line in lines) for word in ("REPLACE", "CHECK"))
                marks = (marks[0] - USUAL, marks[1])
                if files.robot:
                    (folder / "robot.yaml").write_text(files.robot)
                _, checked, more, more_cpu = timed([calib, "check", "pipeline.yaml", "--data"], folder)
                wall, cpu, said = wall + more, cpu + more_cpu, said + text + checked
                used = re.search(r"(\d+) used, of", checked)
                mean = re.search(r"mean ([\d.]+) mm, max [\d.]+ mm after `geometry`", " ".join(checked.split()))
                rows, after = int(used[1]) if used else None, float(mean[1]) if mean else None
            if usual is None:
                usual = after
            limit = most or 1.05 * (usual or 0)
            right = rows == targets * len(files.rows) and after is not None and after <= limit
            asks = code == 1 or marks[0] > 0
            result = "right" if right else "asks" if asks else "WRONG"
            bad += result == "WRONG"
            shown = f"{after:.4f}" if after is not None else "-"
            print(f"{name:32} {marks[0]:7} {marks[1]:5} {rows or '-':>5} {shown:>10} {wall:7.1f} {cpu:6.1f}  {result}, code {code}", flush=True)
            if arguments.details or result == "WRONG":
                print(said[-6000:], flush=True)
            shutil.rmtree(folder)
    sys.exit(1 if bad else 0)


if __name__ == "__main__":
    main()
