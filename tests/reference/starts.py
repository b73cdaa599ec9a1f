#!/usr/bin/env python3
"""Does a beetle swarm's start beat a random start at equal total cost? A paired test over seeds of the sr210d twin.

    python3 tests/reference/starts.py [--calib target/debug/calib] [--seeds 20] [--store DIR]

Needs Python alone. Every seed makes a twin and trains twice on its 200 points: 8 networks from a swarm of 50 beetles and 200
generations, and as many networks from random starts as the same cost allows. The swarm spends 30,050 evaluations of the loss; one
evaluation with its gradient costs about 3 and a network takes about 200, so the swarm is worth 50 networks: 8 against 58.
Prints held-out ratios after/before (200 other points), their medians, and the paired difference with a sign test.
"""

import argparse
import json
import math
import os
import statistics
import subprocess
import tempfile

ROOT = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..")
STARTS = {"bso": ("[bso]", 8), "random": ("[random]", 58)}


def ratio(arguments, store, seed, start):
    starts, ensemble = STARTS[start]
    command = [
        arguments.calib, "run", os.path.join(ROOT, "pipelines/sr210d/pipeline.yaml"), "--store", store, "--json", "--quiet",
        "--set", f"seed={seed}", "--set", "network.rivals=[mlp]", "--set", f"network.starts={starts}",
        "--set", f"network.ensemble={ensemble}", "--set", "network.hidden=12",
        # Beside the point here, and costly.
        "--set", "best.rivals=[ridge]",
    ]
    done = json.loads(subprocess.run(command, capture_output=True, text=True, check=True).stdout)
    mean = {(row["step"], row["set"]): row["mean_mm"] for row in done["statistics"]}
    return mean["network", "check"] / mean["stiffness", "check"], mean["stiffness", "check"]


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--calib", default=os.path.join(ROOT, "target/debug/calib"))
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--store")
    arguments = parser.parse_args()
    store = arguments.store or tempfile.mkdtemp()
    pairs = []
    for seed in range(1, arguments.seeds + 1):
        (bso, before), (random, _) = (ratio(arguments, store, seed, start) for start in STARTS)
        pairs.append((bso, random))
        print(f"seed {seed:3}: before {before:.3f} mm, ratio bso {bso:.3f}, random {random:.3f}", flush=True)
    for name, values in zip(STARTS, zip(*pairs)):
        values = sorted(values)
        print(f"{name:>6}: median {statistics.median(values):.3f}, from {values[0]:.3f} to {values[-1]:.3f}")
    differences = [bso - random for bso, random in pairs]
    mean, spread = statistics.mean(differences), statistics.stdev(differences) / math.sqrt(len(differences))
    better = sum(difference < 0 for difference in differences)
    n = len(differences)
    tail = sum(math.comb(n, k) for k in range(max(better, n - better), n + 1)) / 2**n
    print(f"bso - random: {mean:+.4f} +- {spread:.4f} (standard error); bso is better in {better} of {n}, p = {min(1, 2 * tail):.3f}")


if __name__ == "__main__":
    main()
