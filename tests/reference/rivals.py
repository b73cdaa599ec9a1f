#!/usr/bin/env python3
"""What `calib diagnose` makes of concealed recordings, beside what a person would take today, on the same rows.

    python3 -m venv venv && venv/bin/pip install numpy scipy scikit-learn pysindy gplearn
    OMP_NUM_THREADS=1 venv/bin/python tests/reference/rivals.py --calib target/release/calib --seed 1 --cases 60 --work DIR [--json FILE]

`calib simulate conceal` makes half of the recordings with `--families library` (a fifth without any effect, a fifth with two, a tenth in no
list), half with `--families beyond` (an eighth without any effect). `--worlds "left out" foreign` asks of physics in no list instead: of one cause a
recording, which calib's own list lacks (`without`), and of effects drawn at random (`--foreign 1`). Every program gets the folder of a recording and nothing else, learns from
the rows that the recording says are to fit, and foretells the others. The answers are opened afterwards.

The rivals start from the same identified geometry (rivals_arm.py: base, tool, links, ratios and couplings by least squares, rows grossly off left
out, noise from the tracker's statement and from points measured twice), and keep geometry free in whatever they fit. All choose by
cross-validation within the rows to fit: an addition has to foretell rows that it was not learnt from, by three standard errors of the
difference; otherwise nothing is said. Findings stand in the order in which they were added, or of the displacement they explain.

calib           the pipeline of pipelines/case, whole; findings and held-out errors from its tables by `calib query`
PySINDy, plain  STLSQ and SR3 on polynomials, sines to order 30, load, approach, temperature, time and their products at each joint, projected
                through the Jacobian. A group is what can be read as one law at one joint; forward by group (of those that foretell as well as the
                best, the one with the fewest columns), thresholds by four folds, then backward. Place and name: the group.
PySINDy, laws   the same with a library of laws at every place (rivals_sparse.py): 24 laws of calib's own list, hysteresis, heat, steps, bending,
                the base, the tool and the tracker among them. Who takes PySINDy today has no such library; this line has our list and another search.
gplearn         symbolic regression of one function of a place's variables at a time (rivals_curves.py lists them: joints, tilts, links, base, tool,
                tracker). Evolved on 65 % of the rows, judged on the others; up to four functions. Place: that of the function. Name: from the variables
                that matter when shuffled and from the shape (a line in the load is wind-up, a step in time a shift, a sine of the joint a gear).
calib, whole list  the same with the cause that was left out back in the list: what the true model leaves; where nothing was left out, calib again.
GP              the same with a Gaussian process of scikit-learn's ARD kernel; length scales by marginal likelihood, judged in four folds.
GP at the place the same, and told the place of the effect: nothing is left to find but the function, over the variables of the place.
prototype       the Python program that calib grew out of, if `--prototype` names its folder: it prints the same JSON as `calib diagnose`.

PySR is not among them: it downloads Julia when it is first imported. Not named by gplearn and GP: a wrong mass, a lagging log. Marks are of recordings:

place   the first finding sits where a cause with L >= 50, or what is accepted for it, sits
name    the first finding is that cause by name; `unknown` where it has none. What comes along with a cause, as the wind-up of a spring that
        warms, neither counts nor hurts
exact   the findings are the causes, neither more nor less (fainter ones are free)
wrong   a name was given that is not there
held    held-out rms over floor sqrt(1 + p / (n - p - 1)): the true noise, p of geometry and of the true causes, n coordinates to fit
"""
import argparse
import importlib.metadata
import json
import multiprocessing
import os
import pathlib
import resource
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
POINT_FAULTS = {"outlier", "mislabelled_point"}
DUE = 50
FAMILIES = {
    "library": ["--nulls", "0.2", "--pairs", "0.2", "--open", "0.1"],
    "beyond": ["--nulls", "0.125"],
    "left out": ["--faulty", "0"],
    "foreign": ["--foreign", "1", "--faulty", "0"],
}
METHODS = ["calib", "calib, whole list", "PySINDy, plain", "PySINDy, laws", "gplearn", "GP", "GP at the place", "prototype"]


def make(arguments):
    """The folders of the recordings with their sealed answers."""
    out = []
    for i, families in enumerate(arguments.worlds):
        folder = arguments.work / families.replace(" ", "_")
        if not folder.exists():
            cases = (arguments.cases + len(arguments.worlds) - 1 - i) // len(arguments.worlds)
            drawn_from, more = families if families == "beyond" else "library", FAMILIES[families]
            command = [arguments.calib, "simulate", "conceal", "--out", folder, "--families", drawn_from, "--seed", arguments.seed, "--cases", cases, *more]
            subprocess.run([str(word) for word in command], check=True, stdout=subprocess.DEVNULL)
        out += [(families, case, folder / "sealed" / f"{case.name}.json") for case in sorted((folder / "recordings").iterdir())]
    return out


# ---- the programs: (findings [(effect, place)], held-out rms mm)

def children():
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def calib(case, arguments, without):
    with tempfile.TemporaryDirectory(dir=arguments.work) as folder:
        store = pathlib.Path(folder) / "store"
        run = [arguments.calib, "run", ROOT / "pipelines/case/pipeline.yaml", "--set", f"case={case}", "--store", store]
        if without:
            run += ["--set", f"diagnose.without={json.dumps(without)}"]
        subprocess.run(run, check=True, capture_output=True)
        spent = children()

        def query(sql):
            return json.loads(subprocess.run([arguments.calib, "query", "HEAD", sql, "--store", store, "--json"], check=True, capture_output=True).stdout)

        findings = [(row["effect"], row["place"]) for row in query("SELECT effect, place FROM diagnose_findings ORDER BY rank")]
        errors = [row["error_mm"] for row in query("SELECT error_mm FROM diagnose_prediction WHERE \"set\" = 'validate'")]
    return findings, (sum(e * e for e in errors) / len(errors))**0.5, spent


def prototype(case, arguments, _without):
    run = subprocess.run([sys.executable, arguments.prototype / "diagnose.py", case, "--json"], check=True, capture_output=True, timeout=600)
    said = json.loads(run.stdout)
    return [(f["effect"], f["where"]) for f in said["findings"]], said["after"]["validate_rms_mm"], children()


def in_process(method, case, seed, places):
    import numpy as np
    import rivals_curves
    import rivals_sparse
    from rivals_arm import Recording, Rigid

    rigid, rng = Rigid(Recording(case)), np.random.default_rng(seed)
    findings, shift = {
        "PySINDy, plain": lambda: rivals_sparse.sparse(rigid, rng, rivals_sparse.plain),
        "PySINDy, laws": lambda: rivals_sparse.sparse(rigid, rng, rivals_sparse.library),
        "gplearn": lambda: rivals_curves.symbolic(rigid, rng),
        "GP": lambda: rivals_curves.gaussian_process(rigid, rng),
        "GP at the place": lambda: rivals_curves.gaussian_process(rigid, rng, places=places),
    }[method]()
    return findings, rigid.error(shift)


def one(job):
    """All programs on one recording."""
    (families, case, sealed), number, arguments = job
    kept = arguments.work / f"{families}-{case.name}.json"
    out = json.loads(kept.read_text()) if kept.exists() else {"families": families, "case": case.name, "answers": {}}
    truth = json.loads(sealed.read_text())
    for method in arguments.only:
        if method not in out["answers"]:
            out["answers"][method] = ask(method, case, number, arguments, truth, families)
    out["causes"] = [[e["effect"], e["where"], e["form"], round(e["L"], 1)] for e in truth["effects"] if e["wanted"]]
    for answer in out["answers"].values():
        answer["marks"] = mark(truth, answer)
    kept.write_text(json.dumps(out))
    return out


def ask(method, case, seed, arguments, truth, families):
    """What a program says. Of the truth `calib` is told which causes its list shall lack, and `GP at the place` the places, nobody else anything."""
    try:
        wanted = [effect for effect in truth["effects"] if effect["wanted"]]
        if method in ("calib", "calib, whole list", "prototype"):
            before = children()
            without = sorted({e["effect"] for e in wanted}) if families == "left out" and method == "calib" else []
            findings, held, after = (prototype if method == "prototype" else calib)(case, arguments, without)
            cpu = after - before
        else:
            before = time.process_time()
            findings, held = in_process(method, case, seed, {e["where"] for e in wanted})
            cpu = time.process_time() - before
        return {"findings": findings, "held_mm": held, "cpu_s": cpu}
    except Exception as fault:  # a program that gives up has said nothing; it is counted
        return {"failed": f"{type(fault).__name__}: {fault}"[:300]}


# ---- marks

def atoms(pairs):
    """A run of links counts as its links; hardening of a joint includes its compliance."""
    out = set()
    for effect, place in pairs:
        first, _, last = place.removeprefix("link ").partition("-")
        links = place.startswith("link ") and last
        out |= {(effect, f"link {k}") for k in range(int(first), int(last) + 1)} if links else {(effect, place)}
    return {(e, p) for e, p in out if not (e == "joint_compliance" and ("joint_hardening", p) in out)}


def mark(truth, answer):
    listed = lambda key: atoms((e["effect"], e["where"]) for e in key if e["effect"] not in POINT_FAULTS)
    physical = [pair for pair in answer.get("findings", []) if pair[0] not in POINT_FAULTS]
    found = atoms(physical)
    wants, accepted = [listed(want) for want in truth["accept"]] or [set()], listed(truth["accepted"])
    wants += [want - {w} | {other} for want in wants[:1] for w in want for other in accepted]
    strong = lambda keep: listed([e for e in truth["effects"] if e["wanted"] and keep(e["L"])])
    due, faint = strong(lambda L: L >= DUE), strong(lambda L: L < DUE)
    known = {(e["effect"], e["where"]) for e in truth["effects"]}
    known = known | atoms(known) | accepted | set().union(*wants)
    beside = atoms((e["effect"], e["where"]) for e in truth["effects"] if not e["wanted"]) - due - accepted
    right = {place for _, place in due | accepted}
    elsewhere = {place for _, place in beside} - right
    at = atoms([pair for pair in physical if not {place for _, place in atoms([pair])} <= elsewhere][:1])
    called = atoms([pair for pair in physical if not atoms([pair]) <= beside][:1])
    out = {"null": not wants[0], "due": bool(due), "failed": "failed" in answer}
    out["place"] = any(place in right for _, place in at)
    out["name"] = bool(called & (due | accepted))
    out["exact"] = any(want - faint == found - faint for want in wants)
    out["wrong"] = any(e != "unknown" and (e, p) not in known for e, p in found)
    out["alarm"] = out["null"] and bool(found)
    p = truth["geometry_rank"] + sum(len(e["parameters"]) for e in truth["effects"])
    n = 3 * truth["points"]["fit"]
    noise = truth["noise"]
    square = noise["validate_rms_per_axis_mm"]**2 * (1 + p / max(n - p - 1, 1))
    bound = (3 * (square + noise.get("unseen_rms_per_axis_mm", 0.0)**2))**0.5
    out["ratio"] = answer["held_mm"] / bound if "held_mm" in answer else None
    return out


# ---- the table

def median(values):
    values = sorted(values)
    k = len(values)
    return float("nan") if not k else (values[k // 2] + values[(k - 1) // 2]) / 2


def line(results, method):
    answers = [r["answers"][method] for r in results if method in r["answers"]]
    marks = [a["marks"] for a in answers]
    count = lambda key, of: f"{sum(m[key] for m in of)} of {len(of)}"
    due, nulls = [m for m in marks if m["due"]], [m for m in marks if m["null"]]
    ratios = [m["ratio"] for m in due if m["ratio"] is not None]
    cpu = [a["cpu_s"] for a in answers if "cpu_s" in a]
    cells = [count("place", due), count("name", due), count("exact", due), count("wrong", due), count("alarm", nulls)]
    cells += [f"{median(ratios):.3f}", f"{sum(r <= 1.15 for r in ratios)} of {len(due)}", f"{median(cpu):.1f} / {max(cpu, default=0):.0f}"]
    return f"| {method} | " + " | ".join(cells) + " |" + (f" {sum(m['failed'] for m in marks)} failed" if any(m["failed"] for m in marks) else "")


def table(results, methods):
    head = "| | place right | name right | recording exact | a wrong name | nulls accused | held-out / bound, median | within 1.15 | CPU s, median / most |"
    return "\n".join([head, "|" + "---|" * 9, *(line(results, method) for method in methods)])


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--calib", default="target/release/calib", type=os.path.abspath)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--cases", type=int, default=60)
    parser.add_argument("--work", type=pathlib.Path, required=True, help="where recordings and answers are made; those that are there are kept")
    parser.add_argument("--prototype", type=pathlib.Path, help="folder of the Python prototype's diagnose.py; without it that line is left out")
    parser.add_argument("--worlds", nargs="*", default=["library", "beyond"], choices=list(FAMILIES))
    parser.add_argument("--only", nargs="*", default=METHODS, choices=METHODS)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--json", type=pathlib.Path, help="every finding and mark")
    arguments = parser.parse_args()
    arguments.work = arguments.work.absolute()
    arguments.work.mkdir(parents=True, exist_ok=True)
    if arguments.prototype is None or not (arguments.prototype / "diagnose.py").exists():
        arguments.only = [method for method in arguments.only if method != "prototype"]
    os.environ |= {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    jobs = [(case, number, arguments) for number, case in enumerate(make(arguments))]
    results = []
    with multiprocessing.get_context("spawn").Pool(arguments.jobs) as pool:
        for result in pool.imap(one, jobs):
            results.append(result)
            print(result["families"], result["case"], result["causes"], file=sys.stderr)
            for method, a in result["answers"].items():
                held = "-" if a["marks"]["ratio"] is None else f"{a['marks']['ratio']:.3f}"
                print(f"    {method:15} {held:>7} {a.get('cpu_s', 0):5.1f} s", a.get("failed", a.get("findings")), file=sys.stderr, flush=True)
    installed = {found.metadata["Name"]: found.version for found in importlib.metadata.distributions()}
    versions = {name: installed[name] for name in ("numpy", "scipy", "scikit-learn", "pysindy", "gplearn") if name in installed}
    for title in [None, *arguments.worlds]:
        some = [r for r in results if title in (None, r["families"])]
        print(f"\n{title or 'all'}: {len(some)} recordings\n\n{table(some, arguments.only)}")
    print("\n" + ", ".join(f"{name} {version}" for name, version in versions.items()))
    if arguments.json:
        arguments.json.write_text(json.dumps({"seed": arguments.seed, "versions": versions, "recordings": results}, indent=1) + "\n")


if __name__ == "__main__":
    main()
