"""Scores `calib diagnose` on folders with known answers.

    python3 tests/reference/score.py CASES_DIR --calib BINARY --pipeline pipelines/case/pipeline.yaml [--jobs 1] [--out DIR] [--only PATTERN]
    python3 tests/reference/score.py CASES_DIR --command "python other.py {case}"        # another program that prints the same JSON

A case is a folder with controller.csv, tracker.csv and robot.json. Its answer is want.json in the folder (`effects`: a list of
{effect, where}; `accept`: further sets that count as right, where the recording cannot separate them) or ../sealed/CASE.json
(`want`; `accepted`: single effects that may stand for one of them). Each case is copied without truth.json and want.json, so nothing can leak.
Grades: exact; rival (each wanted effect is a finding or a rival of one, and nothing else was found); extra; missing; wrong; failed.
"""
import argparse
import concurrent.futures
import fnmatch
import json
import os
import pathlib
import shlex
import shutil
import subprocess
import tempfile
import time

RECORDING = {"outlier", "mislabelled_point"}


def one_wind_up(found):
    """Hardening of a joint includes its compliance, whether or not that is named too."""
    return frozenset(e for e in found if not (e[0] == "joint_compliance" and ("joint_hardening", e[1]) in found))


def pairs(effects):
    return one_wind_up({(e["effect"], e["where"]) for e in effects})


def answer(case):
    """The wanted set first, then the sets that count as right too."""
    own = case / "want.json"
    sealed = [p / "sealed" / f"{case.name}.json" for p in (case.parent, case.parent.parent)]
    found = [f for f in [own, *sealed] if f.exists()]
    if not found:
        return None
    told = json.loads(found[0].read_text())
    if isinstance(told, list):
        return [pairs(told)]
    want = pairs(told["effects"] if found[0] == own else told["want"])
    others = [pairs(e) for e in told.get("accept", [])]
    # A sealed answer lists single effects that may stand for the one that nothing else tells from them.
    for other in pairs(told.get("accepted", [])):
        others += [one_wind_up(want - {w} | {other}) for w in sorted(want) if w[0] not in {"joint_compliance", *RECORDING}]
    return [want, *others]


def faint(case):
    """Effects that the truth says are too small to be seen: L below 50."""
    for file in (case / "truth.json", case.parent / "sealed" / f"{case.name}.json", case.parent.parent / "sealed" / f"{case.name}.json"):
        if file.exists():
            effects = json.loads(file.read_text()).get("effects", [])
            names = [(tuple(e["want"]) if "want" in e else (e.get("effect"), e.get("where")), e.get("L")) for e in effects]
            return {name for name, L in names if L is not None and L < 50}
    return set()


def grade(wants, findings):
    found = pairs(findings)
    if found in wants:
        return "exact"
    reach = {}
    for f in findings:
        me = (f["effect"], f["where"])
        reach[me] = {me} | {(r["effect"], r["where"]) for r in f.get("rivals") or []}
    for want in wants:
        if want and all(any(w in r for r in reach.values()) for w in want) and all(r & want for r in reach.values()):
            return "rival"
    want = wants[0]
    if any(w < found for w in wants):
        return "extra"
    if any(found < w for w in wants):
        return "missing"
    return "wrong"


def covered(wants, findings):
    near = set(pairs(findings)) | {(r["effect"], r["where"]) for f in findings for r in f.get("rivals") or []}
    return any(w <= near for w in wants)


def complaint(text):
    """What a program said before it gave up, without the frames of a backtrace."""
    lines = [line for line in text.splitlines() if line.strip() and not line.lstrip().startswith("at ") and not line.lstrip()[:3].rstrip(":").isdigit()]
    return "\n".join(lines[:6])[:800]


def run(case, args):
    want = answer(case)
    out = {"case": case.name, "want": None if want is None else [sorted(w) for w in want]}
    with tempfile.TemporaryDirectory(prefix="score-") as tmp:
        copy = pathlib.Path(tmp) / "case"
        copy.mkdir()
        for f in case.iterdir():
            if f.is_file() and f.name not in ("truth.json", "want.json"):
                shutil.copyfile(f, copy / f.name)
        if args.command:
            command = [word.replace("{case}", str(copy)) for word in shlex.split(args.command)]
        else:
            command = [args.calib, "diagnose", args.pipeline, "--set", f"case={copy}", "--json", "--quiet", *args.more]
        env = dict(os.environ, OMP_NUM_THREADS="1", OPENBLAS_NUM_THREADS="1")
        began = time.time()
        try:
            done = subprocess.run(command, capture_output=True, text=True, timeout=args.timeout, cwd=tmp, env=env)
            out["seconds"], out["code"] = round(time.time() - began, 2), done.returncode
            text = done.stdout
            out["answer"] = json.loads(text[text.index("{"):]) if "{" in text else None
            if out["answer"] is None or "findings" not in out["answer"]:
                out["error"] = complaint(done.stderr or text)
        except subprocess.TimeoutExpired:
            out.update(seconds=args.timeout, code=None, error=f"longer than {args.timeout} s", answer=None)
        except ValueError as bad:
            out.update(error=f"no JSON: {bad}", answer=None)
    a = out.get("answer")
    if a and "findings" in a and want is not None:
        findings = a["findings"]
        physics = [f for f in findings if f["effect"] not in RECORDING]
        out["grade"] = grade(want, findings)
        out["physics"] = grade([frozenset(e for e in w if e[0] not in RECORDING) for w in want], physics)
        out["covered"] = covered(want, findings)
        small = faint(case)
        out["fair"] = any(w - small == pairs(findings) - small for w in want)
        out["null"] = not any(e[0] not in RECORDING for e in want[0])
        out["alarm"] = out["null"] and bool(physics)
    else:
        out["grade"] = out["physics"] = "failed"
        out["covered"], out["fair"], out["null"], out["alarm"] = False, False, bool(want is not None and not want[0]), False
    return out


def line(r):
    a = r.get("answer") or {}
    num = lambda x: "-" if x is None else f"{x:.4f}"
    rms = lambda k: num((a.get(k) or {}).get("validate_rms_mm"))
    say = lambda e: f"{e[0]}@{e[1].replace(' ', '')}"
    found = [say((f["effect"], f["where"])) + ("(" + "|".join(say((x["effect"], x["where"])) for x in (f.get("rivals") or [])[:4]) + ")" if f.get("rivals") else "")
             for f in a.get("findings", [])]
    text = f"{r['case']:<28} {r['grade']:<7} {a.get('verdict', '-'):<16} {rms('before')} -> {rms('after')} floor {num(a.get('noise_floor_mm'))} {r.get('seconds', 0):6.1f}s"
    if r.get("want") is not None and r["grade"] != "exact":
        text += "\n    want  " + (" ".join(map(say, r["want"][0])) or "nothing")
    text += "\n    found " + (" ".join(found) or "nothing")
    if r.get("error"):
        text += "\n    error " + r["error"].replace("\n", "\n          ")
    return text


def main():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("cases", type=pathlib.Path)
    p.add_argument("--calib")
    p.add_argument("--pipeline", default="pipelines/case/pipeline.yaml", type=os.path.abspath)
    p.add_argument("--command", help="another program; {case} stands for the folder")
    p.add_argument("--jobs", type=int, default=1)
    p.add_argument("--timeout", type=float, default=180)
    p.add_argument("--out", type=pathlib.Path)
    p.add_argument("--only", default="*", help="a pattern of case names")
    p.add_argument("--limit", type=int)
    p.add_argument("--more", nargs="*", default=[], help="further arguments for the program")
    args = p.parse_args()
    if not args.command and not args.calib:
        p.error("either --calib BINARY or --command is needed")
    if args.calib:
        args.calib = os.path.abspath(args.calib)
    cases = sorted(d for d in args.cases.iterdir() if (d / "controller.csv").exists() and fnmatch.fnmatch(d.name, args.only))[:args.limit]
    if not cases:
        p.error(f"{args.cases}: no case folder")
    if args.out:
        args.out.mkdir(parents=True, exist_ok=True)
    os.nice(5)
    results = []
    with concurrent.futures.ThreadPoolExecutor(args.jobs) as pool:
        for r in pool.map(lambda c: run(c, args), cases):
            results.append(r)
            print(line(r), flush=True)
            if args.out:
                (args.out / f"{r['case']}.json").write_text(json.dumps(r, indent=1))
    n = len(results)
    count = lambda f: sum(bool(f(r)) for r in results)
    nulls, real = [r for r in results if r["null"]], [r for r in results if not r["null"]]
    ratio = sorted(r["answer"]["after"]["validate_rms_mm"] / r["answer"]["noise_floor_mm"] for r in results
                   if r.get("answer") and r["answer"].get("after") and r["answer"].get("noise_floor_mm"))
    times = sorted(r.get("seconds", 0) for r in results)
    print(f"== {args.cases}: {n} cases")
    print("   " + ", ".join(f"{g} {count(lambda r: r['grade'] == g)}" for g in ("exact", "rival", "extra", "missing", "wrong", "failed")))
    print(f"   exact {count(lambda r: r['grade'] == 'exact') / n:.1%}; exact without outliers and exchanged points {count(lambda r: r['physics'] == 'exact') / n:.1%}; "
          f"wanted within findings and rivals {count(lambda r: r['covered']) / n:.1%}; exact where effects of L < 50 need not be named {count(lambda r: r['fair']) / n:.1%}")
    if nulls:
        print(f"   false alarms on nulls {sum(r['alarm'] for r in nulls)} of {len(nulls)}")
    if real:
        print(f"   exact where something is concealed {sum(r['grade'] == 'exact' for r in real)} of {len(real)}")
    if ratio:
        print(f"   held-out rms after / floor: median {ratio[len(ratio) // 2]:.3f}, 90th {ratio[int(.9 * len(ratio))]:.2f}, worst {ratio[-1]:.2f}; seconds median {times[len(times) // 2]:.1f}, worst {times[-1]:.1f}")
    families = {}
    for r in real:
        for e in {w[0] for w in r["want"][0]} if r.get("want") else ():
            f = families.setdefault(e, [0, 0, 0])
            got = {x["effect"] for x in (r.get("answer") or {}).get("findings", [])}
            f[0] += 1
            f[1] += r["grade"] == "exact"
            f[2] += e in got
    for e, (k, x, g) in sorted(families.items()):
        print(f"   {e:<20} {k:3} cases, {x:3} exact, named in {g:3}")


main()
