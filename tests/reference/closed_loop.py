#!/usr/bin/env python3
"""Do 25 proposed poses decide what a diagnosis leaves open, and do they decide more of it than 25 random ones?

    python3 tests/reference/closed_loop.py --calib target/release/calib --seed 1 --cases 300 --work DIR [--jobs 2] [--json FILE]

`calib simulate conceal` makes recordings with effects of the library, few points and many faint effects, so that rivals stay open.
`calib diagnose` of pipelines/case diagnoses each. A question is a finding with a rival that `calib diagnose` offers poses for, of a probability above
0.05 and not an identity (delta_bic > 0); of several rivals the closest. For every question

proposed  `calib poses --run RUN --separate FINDING RIVAL --count 25`, driven to with the approach that it asks for
random    25 poses within the ranges of the first recording and above the same floor, drawn one by one like those of the first recording,
          half of them without and half with full payload

are measured by `calib simulate record` on the same concealed robot, an hour after the first recording, with its tracker, its noise, its warmth, its
friction and the columns that its log has; each is appended by `later:` of `ingest`, and everything is diagnosed again. Marks, by the sealed truth:

decided    neither of the two (finding, rival) is a rival above 0.05 of the other any more, and exactly those of the two that are true are findings
wrong      the same, but one of the two is a finding and not true, or true and no finding
undecided  one of the two is still a rival of the other above 0.05; or neither is a finding, and one is a rival of something else

An effect that the seal accepts in place of a concealed one counts as true where it is named, and is not missed where it is not.
"""
import argparse
import concurrent.futures
import csv
import json
import math
import os
import pathlib
import random
import resource
import shlex
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
PIPELINE = ROOT / "pipelines/case/pipeline.yaml"
OPTIONS = ["--points", "40", "--natural", "0.5", "--pairs", "0.3", "--faulty", "0"]
ARMS = ["proposed", "random"]
OPEN = 0.05
LATER_S = 3600.0
THERMOMETER_K = 0.15
ARCSEC = math.pi / 648_000
# Lowest height of tool and joints, least distance from the first axis, mm: the rooms of the concealed robots.
ROOM = {"sr210d": (-200, 500), "compact6": (20, 150), "seven7r": (50, 100)}


def calib(arguments, *words, cwd=None):
    """What calib prints, and the CPU seconds that it took."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run([arguments.calib, *map(str, words)], capture_output=True, text=True, cwd=cwd)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    if done.returncode != 0:
        raise RuntimeError(f"calib {words[0]}: {done.stderr.strip()[:400]}")
    return done.stdout, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def diagnose(arguments, pipeline, case, store):
    text, cpu = calib(arguments, "diagnose", pipeline, "--set", f"case={case}", "--store", store, "--json", "--quiet", "--jobs", 1)
    return json.loads(text), cpu


def questions(document):
    """The open rivals that poses are offered for, one a finding: (finding, rival, command)."""
    offers = [shlex.split(line.split("calib ", 1)[1]) for line in document["next_measurements"] or [] if line.startswith("poses for finding ")]
    for number, finding in enumerate(document["findings"], 1):
        rivals = sorted((r for r in finding["rivals"] if r["delta_bic"] > 0 and r["probability"] > OPEN), key=lambda r: r["delta_bic"])
        for rival in rivals:
            command = next((offer for offer in offers if offer[-2:] == [str(number), f"{rival['effect']}@{rival['where']}"]), None)
            if command:
                yield finding, rival, command
                break


# ---- measuring the concealed robot again

def rows(file):
    with open(file, newline="") as handle:
        return list(csv.DictReader(handle))


def twin(truth, blocks, ranges, begin_s, seed):
    """A pipeline that measures the concealed robot."""
    floor, clearance = ROOM[truth["robot"]]
    play = truth["noise"]["joint_repeatability_rad"] / ARCSEC
    settings = {
        "truth": truth["true"],
        "effects": [physical for effect in truth["effects"] for physical in effect["physical"]] + truth["friction"],
        "tracker": truth["tracker"],
        "motors": truth["motors"],
        "repeatability_arcsec": [play] * len(ranges),
        "poses": {"range_deg": ranges, "floor_mm": floor, "clearance_mm": clearance, "candidates": 1},
        "climate": truth["climate"] | {"begin_s": begin_s},
        "blocks": blocks,
    }
    stages = [{"uses": "robot", "with": {"file": "robot.json", "format": "case"}}, {"uses": "simulate", "with": settings}]
    return json.dumps({"calib": 1, "name": "more", "seed": seed, "stages": stages}, indent=1)


def measure(arguments, folder, case, truth, blocks, seed):
    """Controller's and tracker's files of a second measurement, with the columns of the first."""
    first = rows(case / "controller.csv")
    joints = sum(title.startswith("q") for title in first[0])
    columns = [[float(row[f"q{j}_deg"]) for row in first] for j in range(1, joints + 1)]
    # The clock goes on where nobody wrote it down, too.
    lasted_s = float(first[-1]["time_s"]) if "time_s" in first[0] else 19.0 * len(first)
    (folder / "robot.json").write_text((case / "robot.json").read_text())
    (folder / "twin.yaml").write_text(twin(truth, blocks, [[min(c), max(c)] for c in columns], lasted_s + LATER_S, seed))
    calib(arguments, "simulate", "record", "twin.yaml", "--out", "more", "--store", "twin", "--quiet", cwd=folder)
    thermometer = random.Random(seed)
    out = []
    for name in ("controller.csv", "tracker.csv"):
        titles = list(rows(case / name)[0])
        file = folder / name
        with open(file, "w", newline="") as handle:
            writer = csv.DictWriter(handle, titles, extrasaction="ignore", lineterminator="\n")
            writer.writeheader()
            for row in rows(folder / "more" / name):
                if "temp_c" in row:
                    row["temp_c"] = f"{float(row['temp_c']) + thermometer.gauss(0, THERMOMETER_K):.2f}"
                writer.writerow(row)
        out.append(str(file))
    return out


def proposed(arguments, folder, case, truth, command):
    """The proposed poses as blocks, the CPU seconds, and the separation that they promise."""
    poses = folder / "poses.csv"
    floor = ROOM[truth["robot"]][0]
    text, cpu = calib(arguments, *command, "--count", arguments.count, "--floor", floor, "--out", poses, "--json")
    promised = [{key: part[key] for key in ("recorded", "random", "proposed")} for part in json.loads(text)["separation"]]
    if not poses.exists():
        return None, cpu, promised
    joints = [title for title in rows(poses)[0] if title.startswith("q")]
    # Where the log says no directions they are read from the way between the poses: then the arm drives straight.
    sides = [f"dir{j}" for j in range(1, len(joints) + 1)] if "direction" not in truth["hidden_columns"] else []
    given = [
        {"joints_deg": [float(row[j]) for j in joints], "direction": [float(row[d]) for d in sides], "payload_kg": float(row["payload_kg"])}
        for row in rows(poses)
    ]
    return [{"usage": "fit", "given": given}], cpu, promised


def drawn(arguments, case):
    """Random poses as blocks."""
    payloads = sorted({float(row["payload_kg"]) for row in rows(case / "controller.csv")})
    share, left = divmod(arguments.count, len(payloads))
    return [{"usage": "fit", "points": share + (k < left), "payload_kg": kg} for k, kg in enumerate(payloads)]


def appended(files):
    """pipelines/case with a later measurement."""
    text = PIPELINE.read_text()
    place = "      join: {by: id}\n"
    if text.count(place) != 1:
        raise RuntimeError(f"{PIPELINE}: no single line `join: {{by: id}}`")
    return text.replace(place, place + f"      later: [{{files: {json.dumps(files)}}}]\n")


# ---- marks

def name(cause):
    return cause["effect"], cause["where"]


def one_wind_up(found):
    """Hardening of a joint includes its compliance, whether or not that is named too."""
    return {e for e in found if not (e[0] == "joint_compliance" and ("joint_hardening", e[1]) in found)}


def mark(truth, finding, rival, document):
    pair = {name(finding), name(rival)}
    true = one_wind_up({name(e) for e in truth["effects"]}) & pair
    accepted = {name(e) for e in truth["accepted"]} & pair
    findings = {name(f): {name(r) for r in f["rivals"] if r["probability"] is None or r["probability"] > OPEN} for f in document["findings"]}
    named = one_wind_up(pair & set(findings))
    still = any(findings[one] & (pair - {one}) - named for one in named)
    elsewhere = not named and any(pair & rivals for rivals in findings.values())
    if still or elsewhere:
        return "undecided"
    missing = true - named if not named & accepted else set()
    return "decided" if named <= true | accepted and not missing else "wrong"


def one(job):
    """All questions of one recording."""
    number, case, truth, arguments = job
    kept = arguments.work / f"{case.name}.json"
    if kept.exists():
        return json.loads(kept.read_text())
    folder = arguments.work / "runs" / case.name
    folder.mkdir(parents=True, exist_ok=True)
    document, cpu = diagnose(arguments, PIPELINE, case, folder / "store")
    out = {"case": case.name, "findings": len(document["findings"]), "cpu_s": cpu, "questions": []}
    for k, (finding, rival, command) in enumerate(questions(document)):
        causes = {name(e) for e in truth["effects"]}
        asked = {"finding": name(finding), "rival": name(rival), "probability": rival["probability"], "delta_bic": rival["delta_bic"]}
        asked |= {"true": [name(c) in causes for c in (finding, rival)]}
        for arm in ARMS:
            place = folder / f"{k}-{arm}"
            place.mkdir(exist_ok=True)
            try:
                blocks, cpu = drawn(arguments, case), 0.0
                if arm == "proposed":
                    blocks, cpu, asked["separation"] = proposed(arguments, place, case, truth, command)
                if blocks is None:
                    asked[arm] = {"mark": "none proposed"}
                    continue
                seed = arguments.seed * 100_003 + 1000 * number + 10 * k + ARMS.index(arm)
                files = measure(arguments, place, case, truth, blocks, seed)
                (place / "pipeline.yaml").write_text(appended(files))
                later, spent = diagnose(arguments, place / "pipeline.yaml", case, folder / "store")
                said = [[*name(f), f["probability"], [[*name(r), r["probability"]] for r in f["rivals"]]] for f in later["findings"]]
                asked[arm] = {"mark": mark(truth, finding, rival, later), "poses_cpu_s": cpu, "cpu_s": spent, "findings": said}
            except RuntimeError as fault:
                asked[arm] = {"mark": "failed", "why": str(fault)}
        out["questions"].append(asked)
    kept.write_text(json.dumps(out))
    return out


# ---- the table

def interval(count, of):
    """Wilson's 95 % interval, percent."""
    if of == 0:
        return "-"
    z, p = 1.959964, count / of
    middle, half = p + z * z / (2 * of), z * math.sqrt(p * (1 - p) / of + z * z / (4 * of * of))
    low, high = (max(0.0, (middle + sign * half) / (1 + z * z / of)) for sign in (-1, 1))
    return f"{count} of {of} = {100 * p:.0f} % ({100 * low:.0f} to {100 * high:.0f})"


def median(values):
    values = sorted(values)
    return (values[len(values) // 2] + values[(len(values) - 1) // 2]) / 2 if values else float("nan")


def table(asked, count):
    lines = ["| | decided | wrong | undecided | CPU s, median: poses, diagnosis |", "|---|---|---|---|---|"]
    for arm in ARMS:
        marks = [q[arm]["mark"] for q in asked]
        cells = [interval(marks.count(mark), len(marks)) for mark in ("decided", "wrong", "undecided")]
        cells.append(", ".join(f"{median([q[arm][key] for q in asked]):.2f}" for key in ("poses_cpu_s", "cpu_s")))
        lines.append(f"| {count} {arm} poses | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def summary(results, count):
    every = [q for r in results for q in r["questions"]]
    asked = [q for q in every if all(q[arm]["mark"] in ("decided", "wrong", "undecided") for arm in ARMS)]
    print(f"\n{len(results)} recordings, {sum(r['findings'] for r in results)} findings, {len(every)} with a rival that poses may exclude; measured: {len(asked)}\n")
    print(table(asked, count))
    only = {arm: sum(q[arm]["mark"] == "decided" != q[other]["mark"] for q in asked) for arm, other in zip(ARMS, reversed(ARMS))}
    print(f"\ndecided by one of the two only: {only['proposed']} by the proposed, {only['random']} by the random poses")
    kinds = {"the finding is true, the rival is not": [True, False], "the rival is true": [False, True], "both": [True, True], "neither": [False, False]}
    print("\n| before the poses | questions | decided, proposed | decided, random |\n|---|---|---|---|")
    for title, true in kinds.items():
        some = [q for q in asked if q["true"] == true]
        print(f"| {title} | {len(some)} | " + " | ".join(str(sum(q[arm]["mark"] == "decided" for q in some)) for arm in ARMS) + " |")
    for q in every:
        if q not in asked:
            print(q["finding"], q["rival"], *(q[arm].get("why", q[arm]["mark"]) for arm in ARMS), file=sys.stderr)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--calib", default="target/release/calib", type=os.path.abspath)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--cases", type=int, default=300)
    parser.add_argument("--count", type=int, default=25, help="poses of a second measurement")
    parser.add_argument("--work", type=pathlib.Path, required=True, help="where recordings and answers are made; those that are there are kept")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--json", type=pathlib.Path, help="every question and mark")
    arguments = parser.parse_args()
    arguments.work = arguments.work.absolute()
    arguments.work.mkdir(parents=True, exist_ok=True)
    concealed = arguments.work / "set"
    if not concealed.exists():
        calib(arguments, "simulate", "conceal", "--out", concealed, "--seed", arguments.seed, "--cases", arguments.cases, *OPTIONS)
    jobs = []
    for number, case in enumerate(sorted((concealed / "recordings").iterdir())):
        jobs.append((number, case, json.loads((concealed / "sealed" / f"{case.name}.json").read_text()), arguments))
    results = []
    with concurrent.futures.ProcessPoolExecutor(arguments.jobs) as pool:
        for result in pool.map(one, jobs):
            results.append(result)
            for q in result["questions"]:
                print(result["case"], *q["finding"], "|", *q["rival"], q["true"], *(f"{arm}: {q[arm]['mark']}" for arm in ARMS), file=sys.stderr, flush=True)
    summary(results, arguments.count)
    if arguments.json:
        arguments.json.write_text(json.dumps({"seed": arguments.seed, "options": OPTIONS, "recordings": results}, indent=1) + "\n")


if __name__ == "__main__":
    main()
