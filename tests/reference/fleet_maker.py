#!/usr/bin/env python3
"""Makes a fleet of simulated robots of three models, some with a concealed effect, some with broken files, and its fleet file.

    python3 tests/reference/fleet_maker.py OUT --calib target/debug/calib [--robots 2000] [--effects 0.1] [--broken 0.02]

OUT/robots/NAME holds a recording of 60 to 160 points to fit and as many again by half to check; OUT/truth.json says what is hidden
in whom and who is broken, and how; OUT/FLEET.yaml runs `pipelines/fleet`, OUT/DIAGNOSE.yaml the same with `diagnose`, for a share
of the robots. The same seed gives the same files.
"""

import argparse
import json
import os
import random
import shutil
import subprocess

ROOT = os.path.abspath(os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", ".."))
POINTS = (60, 85, 110, 135, 160)
MODELS = ("sr210d", "compact6", "seven7r")


def spoil(folder, how):
    path = lambda name: os.path.join(folder, name)
    text = lambda name: open(path(name)).read()

    def put(name, content):
        with open(path(name), "w") as file:
            file.write(content)

    if how == "no tracker file":
        os.remove(path("tracker.csv"))
    elif how == "no robot file":
        os.remove(path("robot.json"))
    elif how == "robot file cut off":
        put("robot.json", text("robot.json")[:200])
    elif how == "empty controller file":
        put("controller.csv", "")
    elif how == "column missing":
        put("tracker.csv", text("tracker.csv").replace("x_mm", "x", 1))
    elif how == "no points in common":
        put("tracker.csv", text("tracker.csv").replace("\nP", "\nQ"))
    elif how == "not text":
        with open(path("controller.csv"), "wb") as file:
            file.write(bytes(range(256)) * 40)
    elif how == "only a header":
        put("tracker.csv", text("tracker.csv").splitlines()[0] + "\n")


SPOILT = ("no tracker file", "no robot file", "robot file cut off", "empty controller file", "column missing", "no points in common",
          "not text", "only a header")


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("out")
    parser.add_argument("--calib", required=True)
    parser.add_argument("--robots", type=int, default=2000)
    parser.add_argument("--effects", type=float, default=0.1)
    parser.add_argument("--broken", type=float, default=0.02)
    parser.add_argument("--diagnose", type=int, default=200, help="robots of DIAGNOSE.yaml")
    parser.add_argument("--seed", type=int, default=1)
    wanted = parser.parse_args()
    chance = random.Random(wanted.seed)
    os.makedirs(os.path.join(wanted.out, "robots"))
    truth, names = {}, []
    batches = [(points, model) for points in POINTS for model in MODELS]
    for number, (points, model) in enumerate(batches):
        cases = wanted.robots // len(batches) + (number < wanted.robots % len(batches))
        made = os.path.join(wanted.out, "made")
        subprocess.run([wanted.calib, "simulate", "conceal", "--out", made, "--cases", str(cases), "--points", str(points), "--robot",
                        model, "--nulls", str(1 - wanted.effects), "--faulty", "0", "--seed", str(wanted.seed * 1000 + number)],
                       check=True, stdout=subprocess.DEVNULL)
        for case in sorted(os.listdir(os.path.join(made, "recordings"))):
            name = f"{model}-{points}-{case}"
            shutil.move(os.path.join(made, "recordings", case), os.path.join(wanted.out, "robots", name))
            truth[name] = {"sealed": json.load(open(os.path.join(made, "sealed", case + ".json"))), "broken": None}
            names.append(name)
        shutil.rmtree(made)
    for number, name in enumerate(sorted(chance.sample(names, round(wanted.broken * len(names))))):
        truth[name]["broken"] = SPOILT[number % len(SPOILT)]
        spoil(os.path.join(wanted.out, "robots", name), SPOILT[number % len(SPOILT)])
    json.dump(truth, open(os.path.join(wanted.out, "truth.json"), "w"), indent=1)
    pipeline = open(os.path.join(ROOT, "pipelines", "fleet", "pipeline.yaml")).read()
    pipeline = pipeline.replace("../../../shared", os.path.join(ROOT, "..", "shared"))
    for file, stage in (("pipeline", ""), ("diagnose", "  - uses: diagnose\n\n")):
        with open(os.path.join(wanted.out, file + ".yaml"), "w") as out:
            out.write(pipeline.replace("  - uses: compare\n", stage + "  - uses: compare\n"))
    sources = lambda pattern: "".join(f"  - {{folders: \"robots/{model}-{pattern}\", groups: {{model: {model}}}}}\n" for model in MODELS)
    with open(os.path.join(wanted.out, "FLEET.yaml"), "w") as out:
        out.write(f"calib: 1\nname: fleet\npipeline: pipeline.yaml\nrobots:\n{sources('*')}")
    step = max(1, len(names) // wanted.diagnose)
    with open(os.path.join(wanted.out, "some.csv"), "w") as out:
        out.write("robot,folder,model\n" + "".join(f"{name},robots/{name},{name.split('-')[0]}\n" for name in sorted(names)[::step]))
    with open(os.path.join(wanted.out, "DIAGNOSE.yaml"), "w") as out:
        out.write("calib: 1\nname: diagnosed\npipeline: diagnose.yaml\nrobots:\n  - list: some.csv\n")
    print(f"{len(names)} robots, {sum(bool(t['broken']) for t in truth.values())} broken: {wanted.out}")


if __name__ == "__main__":
    main()
