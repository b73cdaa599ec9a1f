#!/usr/bin/env python3
"""What halving and doubling does of every number by which a diagnosis decides (src/numerics/criteria).

    cargo build -p calib -p calib-diagnose --example ablate --features calib-diagnose/ablate
    python3 tests/reference/ablate.py --program target/debug/examples/ablate --seed 7 --recordings 24 --jobs 1 [--lines FILE] [--write]

Recordings are concealed ones, by turns with a cause of the list, with that cause taken out of the list, and with physics of no list. A
criterion is scaled only in recordings that come by it. For every criterion the change of five scores is printed, halved / doubled, over so
many recordings: exact (listed ones whose findings are the causes and no others), place (some finding has the place of the effect), wrong
(a wrong name with 0.5 or more), explained (verdicts other than `unexplained`), silent (no finding), and the geometric mean of the held-out
error over its own at 1. `--write` puts the outcome into the tables, as the last entry of each row; `--lines` keeps what the program printed,
and is read first, so that a run can be gone on with.
"""
import argparse
import collections
import concurrent.futures
import json
import math
import os
import pathlib
import re
import subprocess

ROOM = pathlib.Path(__file__).resolve().parents[2] / "src/numerics/criteria"
SCORES = ["exact", "placed", "wrong", "explained", "silent"]


def scores(program, seed, recording, points, only):
    """The lines of one recording."""
    command = [program, str(seed), str(recording), "1", str(points), *only]
    run = subprocess.run(command, capture_output=True, text=True, env=os.environ | {"RAYON_NUM_THREADS": "1"})
    return [json.loads(line) for line in run.stdout.splitlines()]


def changes(lines):
    """Criterion -> factor -> what it changes in the recordings that came by it."""
    plain = {line["recording"]: line for line in lines if not line["criterion"]}
    found = collections.defaultdict(lambda: collections.defaultdict(list))
    for line in lines:
        if line["criterion"] and line["recording"] in plain:
            found[line["criterion"]][line["factor"]].append((plain[line["recording"]], line))
    return found


def words(pairs):
    """What halving or doubling does, in words; empty where no figure differs."""
    told = []
    for score in SCORES:
        better, worse = (sum(a[score] != b[score] and b[score] == way for a, b in pairs) for way in (True, False))
        if better or worse:
            told.append(f"{score} " + " ".join(f"{sign}{count}" for sign, count in (("+", better), ("-", worse)) if count))
    ratios = [b["held_out"] / a["held_out"] for a, b in pairs if a["held_out"] and b["held_out"]]
    mean = math.exp(sum(map(math.log, ratios)) / len(ratios)) if ratios else 1.0
    moved = sum(abs(ratio - 1.0) > 1e-3 for ratio in ratios)
    if moved:
        told.append(f"held out x{mean:.3f}, {moved} moved")
    return ", ".join(told)


def outcome(by_factor):
    counts = {len(pairs) for pairs in by_factor.values()}
    half, double = (words(by_factor.get(factor, [])) for factor in (0.5, 2.0))
    if not half and not double:
        return f"changes nothing on {max(counts)}"
    return f"of {max(counts)}: halved {half or 'nothing'}; doubled {double or 'nothing'}"


def write(told):
    """Puts outcomes into the tables."""
    for path in sorted(ROOM.glob("*.rs")):
        text = path.read_text()
        for name, outcome in told.items():
            room, own = name.split("::")
            if room == path.stem:
                row = re.compile(rf'(^    {own}: .*?, ")([^"]*)(";$)', re.MULTILINE | re.DOTALL)
                text = row.sub(lambda found: found[1] + outcome + found[3], text, count=1)
        if text != path.read_text():
            path.write_text(text)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", type=os.path.abspath, default="target/debug/examples/ablate")
    parser.add_argument("--seed", type=int, default=7)
    parser.add_argument("--recordings", type=int, default=24)
    parser.add_argument("--points", type=int, default=0, help="to fit, of every recording [50 to 400]")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--only", nargs="*", default=[], help="criteria, as room::NAME")
    parser.add_argument("--lines", type=pathlib.Path)
    parser.add_argument("--write", action="store_true")
    arguments = parser.parse_args()
    kept = arguments.lines.read_text().splitlines() if arguments.lines and arguments.lines.exists() else []
    lines = [json.loads(line) for line in kept]
    todo = sorted(set(range(arguments.recordings)) - {line["recording"] for line in lines})
    with concurrent.futures.ThreadPoolExecutor(arguments.jobs) as pool:
        for some in pool.map(lambda one: scores(arguments.program, arguments.seed, one, arguments.points, arguments.only), todo):
            lines += some
            if arguments.lines:
                with arguments.lines.open("a") as out:
                    out.writelines(json.dumps(line) + "\n" for line in some)
    told = {name: outcome(by_factor) for name, by_factor in sorted(changes(lines).items())}
    print("\n".join(f"{name:32} {outcome}" for name, outcome in told.items()))
    if arguments.write:
        write(told)


if __name__ == "__main__":
    main()
