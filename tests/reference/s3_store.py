#!/usr/bin/env python3
"""A store in a bucket, against a local S3 server: killed machines, machines that go on, two at once, flipped bits, refusals.

    cargo build --features s3
    python3 tests/reference/s3_store.py --calib target/debug/calib

Needs moto (the server) and boto3; where they are missing it makes itself an environment with them in the folder for temporary files.
A machine is a process with a cache of its own. The bucket keeps every version, so that what was written twice shows. Exit code 0 where all holds.
"""
import argparse, collections, json, os, pathlib, random, signal, socket, subprocess, sys, tempfile, time, venv

try:
    import boto3, moto
except ImportError:
    own = pathlib.Path(tempfile.gettempdir()) / "calib-s3-environment"
    if not (own / "ready").exists():
        venv.create(own, with_pip=True, clear=True)
        subprocess.run([own / "bin/pip", "install", "--quiet", "moto[server]", "boto3"], check=True)
        (own / "ready").touch()
    os.execv(own / "bin/python", [own / "bin/python", *sys.argv])

ROOT = pathlib.Path(__file__).resolve().parents[2]
BUCKET = "cell"
checks = collections.Counter()


def holds(what, true, detail=""):
    checks[what, bool(true)] += 1
    if not true:
        print(f"FAILED: {what} {detail}", flush=True)


class Lab:
    def __init__(self, calib, pipeline, work):
        self.calib, self.pipeline, self.work, self.machines = str(pathlib.Path(calib).resolve()), str(pipeline), work, 0
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            port = free.getsockname()[1]
        self.url = f"http://127.0.0.1:{port}"
        log = open(work / "server.log", "w")
        self.server = subprocess.Popen([sys.executable, "-m", "moto.server", "-p", str(port)], stdout=log, stderr=log)
        self.s3 = boto3.client("s3", endpoint_url=self.url, aws_access_key_id="k", aws_secret_access_key="s", region_name="us-east-1")
        for _ in range(100):
            try:
                self.s3.create_bucket(Bucket=BUCKET)
                break
            except Exception:
                time.sleep(0.2)
        self.s3.put_bucket_versioning(Bucket=BUCKET, VersioningConfiguration={"Status": "Enabled"})

    def machine(self):
        self.machines += 1
        return self.work / f"machine{self.machines}"

    def environment(self, machine, **more):
        kept = {name: value for name, value in os.environ.items() if not name.startswith("AWS_")}
        keys = dict(AWS_ACCESS_KEY_ID="k", AWS_SECRET_ACCESS_KEY="s", AWS_REGION="us-east-1", AWS_ENDPOINT_URL=self.url, AWS_ALLOW_HTTP="true")
        changed = {name: value for name, value in {**keys, **more}.items() if value is not None}
        return {**kept, **changed, "CALIB_CACHE": str(machine)}

    def start(self, machine, *command, **more):
        return subprocess.Popen([self.calib, *command], env=self.environment(machine, **more), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)

    def calls(self, machine, *command, **more):
        child = self.start(machine, *command, **more)
        out, err = child.communicate(timeout=600)
        return child.returncode, out, err

    def run(self, machine, store, *more):
        return self.calls(machine, "run", self.pipeline, "--json", "--quiet", "--store", store, *more)

    def keys(self, folder):
        pages = self.s3.get_paginator("list_objects_v2").paginate(Bucket=BUCKET, Prefix=folder)
        return [entry["Key"] for page in pages for entry in page.get("Contents", [])]

    def versions(self, folder):
        pages = self.s3.get_paginator("list_object_versions").paginate(Bucket=BUCKET, Prefix=folder)
        return collections.Counter(entry["Key"] for page in pages for entry in page.get("Versions", []))

    def body(self, key):
        return self.s3.get_object(Bucket=BUCKET, Key=key)["Body"].read()

    def sound(self, store, what):
        code, out, err = self.calls(self.machine(), "verify", "--store", store, "--json")
        holds(what, code == 0, out[:400] + err)


def hashes(out):
    return {f"{stage['id']}.{output['port']}": output["table_hash"] for stage in json.loads(out)["stages"] for output in stage["outputs"]}


def executed(out):
    return sum(stage["status"] == "executed" for stage in json.loads(out)["stages"])


def kills(lab, chance, wanted, seconds, rounds):
    for turn in range(rounds):
        name = f"killed{turn}"
        store = f"s3://{BUCKET}/{name}"
        child = lab.start(lab.machine(), "run", lab.pipeline, "--quiet", "--store", store)
        time.sleep(chance.uniform(0.05, 1.0) * seconds)
        child.send_signal(signal.SIGKILL)
        child.communicate()
        done = len(lab.keys(f"{name}/actions/"))
        if lab.keys(f"{name}/"):
            lab.sound(store, "after kill -9 nothing is visible by half")
        second = lab.machine()
        code, out, err = lab.run(second, store)
        holds("another machine goes on and ends as an undisturbed run", code == 0 and hashes(out) == wanted, err)
        holds("it does nothing twice", executed(out) == len(json.loads(out)["stages"]) - done, f"{executed(out)} after {done}")
        code, out, err = lab.run(lab.machine(), store)
        holds("a third has nothing to do", code == 0 and executed(out) == 0 and hashes(out) == wanted, err)
        lab.sound(store, "verify after going on")
        twice = [key for key, count in lab.versions(f"{name}/actions/").items() if count > 1]
        holds("no action record is written twice", not twice, str(twice))
        print(f"  killed with {done} stages committed, {len(wanted)} tables right", flush=True)


def at_once(lab, wanted, rounds):
    for turn in range(rounds):
        name = f"both{turn}"
        store = f"s3://{BUCKET}/{name}"
        # In every other round the two share a cache, as two processes of one person do.
        machines = [lab.machine()] * 2 if turn % 2 else [lab.machine(), lab.machine()]
        both = [lab.start(machine, "run", lab.pipeline, "--json", "--quiet", "--store", store) for machine in machines]
        outs = [(child.communicate(timeout=600), child.returncode) for child in both]
        for (out, err), code in outs:
            holds("of two at once both end right", code == 0 and hashes(out) == wanted, err)
            holds("and without a word of conflict", "deterministic" not in out + err, err)
        counts = lab.versions(f"{name}/actions/")
        holds("every conflict is decided once", counts and max(counts.values()) == 1, str(counts))
        shared = sum(executed(out) for (out, _), _ in outs)
        lab.sound(store, "verify after two at once")
        print(f"  two at once: {shared} stages executed for {len(counts)} records", flush=True)


def flips(lab, chance, wanted, rounds):
    name = "flipped"
    store = f"s3://{BUCKET}/{name}"
    first = lab.machine()
    assert lab.run(first, store)[0] == 0
    for turn in range(rounds):
        key = chance.choice([key for key in lab.keys(f"{name}/") if "/objects/" in key] if turn % 2 else lab.keys(f"{name}/"))
        sound = lab.body(key)
        bad = bytearray(sound)
        bit = chance.randrange(8 * len(bad))
        bad[bit // 8] ^= 1 << bit % 8
        lab.s3.put_object(Bucket=BUCKET, Key=key, Body=bytes(bad))
        code, out, err = lab.calls(lab.machine(), "verify", "--store", store)
        at_fault = key.split("/", 1)[1]
        holds("verify finds one flipped bit and says where", code in (1, 2, 75) and at_fault.split("/")[1 if "runs/" in at_fault else -1] in out + err, f"{key}: {out[:300]}{err}")
        if "/objects/" in key:
            code, out, err = lab.run(lab.machine(), store)
            holds("a damaged table is made anew by who needs it", code == 0 and hashes(out) == wanted and executed(out) >= 1, err)
            lab.sound(store, "verify after mending")
        else:
            lab.s3.put_object(Bucket=BUCKET, Key=key, Body=sound)
    return first, store


def looks(lab, first, store):
    """What other verbs say on a machine that has nothing yet."""
    runs = lambda: json.loads(lab.calls(lab.machine(), "log", "--json", "--store", store)[1])
    code, _, err = lab.run(first, store, "--set", "seed=99", "--force")
    holds("another seed", code == 0, err)
    log = runs()
    holds("log", len(log if isinstance(log, list) else log["runs"]) >= 2, str(log)[:200])
    for command, codes in [
        (["show", "HEAD"], (0,)), (["tag", "HEAD", "delivered"], (0,)), (["tag"], (0,)), (["show", "delivered"], (0,)),
        (["diff", "HEAD~1", "HEAD", "--stat"], (0, 1)), (["lineage", "HEAD/geometry/parameters"], (0,)), (["explain", "geometry"], (0,)),
        (["fleet", "status", "none.yaml"], (2,)), (["gc"], (2,)),
    ]:
        code, out, err = lab.calls(lab.machine(), *command, "--store", store)
        holds(f"{command[0]} from an empty cache", code in codes and (out or err), f"{code}: {out[:200]}{err}")
        print(f"  calib {' '.join(command)}: {code}: {(out or err).strip().splitlines()[-1][:150]}", flush=True)


def refusals(lab, store):
    """What a person reads who set something wrong."""
    cases = [
        ("no credentials", store, dict(AWS_ACCESS_KEY_ID=None, AWS_SECRET_ACCESS_KEY=None), 2, "AWS_ACCESS_KEY_ID"),
        ("no bucket", "s3://elsewhere/x", {}, 2, "there is no bucket"),
        ("no network", store, dict(AWS_ENDPOINT_URL="http://127.0.0.1:9"), 75, "check the network"),
        ("http", store, dict(AWS_ALLOW_HTTP=None), 2, "AWS_ALLOW_HTTP"),
        ("no bucket named", "s3://", {}, 2, "s3://BUCKET/PREFIX"),
    ]
    lab.s3.put_object(Bucket=BUCKET, Key="photos/one.jpg", Body=b"x")
    cases.append(("not a store", f"s3://{BUCKET}/photos", {}, 2, "not a calib store"))
    for what, place, more, wanted, words in cases:
        begun = time.time()
        code, out, err = lab.calls(lab.machine(), "log", "--store", place, **more)
        holds(f"refusal: {what}", code == wanted and words in err, f"{code}: {err}")
        print(f"  {what} ({time.time() - begun:.1f} s): {code}: {err.strip()[:230]}", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--calib", default="target/debug/calib", help="built with --features s3")
    parser.add_argument("--pipeline", default=ROOT / "pipelines/sr210d/pipeline.yaml")
    parser.add_argument("--rounds", type=int, default=6)
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    chance = random.Random(arguments.seed)
    with tempfile.TemporaryDirectory(prefix="s3-store-") as work:
        lab = Lab(arguments.calib, arguments.pipeline, pathlib.Path(work))
        try:
            code, out, err = lab.run(lab.machine(), str(pathlib.Path(work) / "folder"))
            assert code == 0, err
            wanted, begun = hashes(out), time.time()
            code, out, err = lab.run(lab.machine(), f"s3://{BUCKET}/whole")
            seconds = time.time() - begun
            holds("a run in a bucket is a run in a folder", code == 0 and hashes(out) == wanted, err)
            print(f"  {len(wanted)} tables in {seconds:.1f} s", flush=True)
            kills(lab, chance, wanted, seconds, arguments.rounds)
            at_once(lab, wanted, max(1, arguments.rounds // 3))
            first, store = flips(lab, chance, wanted, 2 * arguments.rounds)
            looks(lab, first, store)
            refusals(lab, store)
        finally:
            lab.server.terminate()
    for what in sorted({what for what, _ in checks}):
        print(f"{what:62} {checks[what, True]:4} of {checks[what, True] + checks[what, False]}")
    sys.exit(any(count for (_, true), count in checks.items() if not true))


if __name__ == "__main__":
    main()
