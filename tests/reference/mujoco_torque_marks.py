#!/usr/bin/env python3
"""Marks `calib diagnose` on the recordings of mujoco_torques.py.

  mujoco_torque_marks.py DIR --calib BINARY [--pipeline pipelines/dynamics/pipeline.yaml]

A hidden cause counts where its L is 50 or more. Exact: a finding has its name and place, or those that data cannot tell from it. Place: a
finding beside plain friction has its place. Wrong: it is not exact, and a finding is there that is neither true nor has what is true among its
rivals. A recording in which nothing is hidden is false where there is such a finding.
"""

import argparse
import json
import shutil
import subprocess
import tempfile
from pathlib import Path

PLAIN = {"viscous_friction", "coulomb_friction"}
LEAST = 50.0


def called(one):
    return one["effect"], one["where"]


def diagnosed(calib, pipeline, case):
    """Findings of a copy without the answer."""
    with tempfile.TemporaryDirectory() as folder:
        for name in ("robot.json", "recording.csv"):
            shutil.copy(case / name, folder)
        command = [calib, "diagnose", pipeline, "--set", f"case={folder}", "--json", "--store", f"{folder}/store"]
        run = subprocess.run(command, capture_output=True, text=True)
    if run.returncode:
        raise SystemExit(f"{case.name}: {run.stderr.strip()}")
    return json.loads(run.stdout)["findings"]


def marked(want, findings):
    true = {called(one) for one in want["effects"]}
    cause = next((one for one in want["effects"] if one["hidden"]), None)
    named = {called(cause)} | {called(one) for one in cause["same"]} if cause else set()
    reach = lambda finding: {called(finding)} | {called(rival) for rival in finding.get("rivals") or []}
    strays = [called(finding) for finding in findings if not reach(finding) & (true | named)]
    found = [called(finding) for finding in findings if finding["effect"] not in PLAIN]
    exact = bool(named & set(found))
    place = bool({where for _, where in named} & {where for _, where in found})
    return cause, {"exact": exact, "place": place, "wrong": not exact and bool(strays)}, strays, found


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("folder", type=Path)
    parser.add_argument("--calib", required=True)
    parser.add_argument("--pipeline", default="pipelines/dynamics/pipeline.yaml")
    told = parser.parse_args()
    sums = {}
    for case in sorted(path for path in told.folder.iterdir() if (path / "want.json").exists()):
        want = json.loads((case / "want.json").read_text())
        cause, mark, strays, found = marked(want, diagnosed(told.calib, told.pipeline, case))
        friction = want["friction"]
        right = not strays and (cause is None or mark["exact"])
        if not right:
            said = f"{cause['effect']} at {cause['where']}, L {cause['L']:.0f}" if cause else "nothing"
            print(f"{case.name} {want['rate']} Hz {friction}: hidden {said}; found {found}; not there {strays}", flush=True)
        for kind in (friction, "all"):
            own = sums.setdefault(kind, dict.fromkeys(["recordings", "due", "faint", "exact", "place", "wrong", "beside", "nulls", "false"], 0))
            own["recordings"] += 1
            if cause is None:
                own["nulls"] += 1
                own["false"] += bool(strays)
            elif cause["L"] < LEAST:
                own["faint"] += 1
            else:
                own["due"] += 1
                own["beside"] += bool(strays)
                for key, value in mark.items():
                    own[key] += value
    print("| dry friction | recordings | causes of L >= 50 | exact | place | wrong name | anything else beside | nulls | false |")
    print("|---|---|---|---|---|---|---|---|---|")
    for kind, own in sorted(sums.items(), reverse=True):
        share = lambda key: f"{own[key]} ({100 * own[key] / max(own['due'], 1):.0f} %)"
        cells = [kind, own["recordings"], own["due"], *(share(key) for key in ("exact", "place", "wrong", "beside")), own["nulls"], own["false"]]
        print("| " + " | ".join(str(cell) for cell in cells) + " |")


main()
