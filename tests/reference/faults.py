#!/usr/bin/env python3
"""A campaign of faults against a store: kill -9, full disk, obstacles, torn and flipped files, wrong clocks, two runs at once, a moved store.

    python3 tests/reference/faults.py --calib target/debug/calib --faults 500 --seed 1

Needs Python alone. After every fault the same command is run again; it must end with the tables of an undisturbed run, or refuse with
words that say what to do (and end well once that is done). Exit code 0 where no wrong result was accepted and no committed table lost.
"""
import argparse, collections, hashlib, json, os, pathlib, random, re, resource, shutil, signal, subprocess, sys, tempfile, time

ROOT = pathlib.Path(__file__).resolve().parents[2]
PIPELINE = ROOT / "tests/it/resume/pipeline.yaml"
REMEDY = re.compile(r"run again|calib run|runs again|--store DIR|free some space|move it|writable|delete it|set it again|restore|calib log")


class Failure(Exception):
    pass


def files(store, *folders):
    found = []
    for folder in folders:
        found += [p for p in (store / folder).rglob("*") if p.is_file()]
    return sorted(found)


def sha(path):
    return hashlib.sha256(path.read_bytes()).hexdigest()


def run(calib, store, *more, pre=None, kill_after=None):
    command = [calib, "run", str(PIPELINE), "--quiet", "--json", "--store", str(store), *more]
    child = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, preexec_fn=pre)
    if kill_after is not None:
        try:
            child.wait(kill_after)
        except subprocess.TimeoutExpired:
            child.send_signal(signal.SIGKILL)
    out, err = child.communicate(timeout=300)
    return child.returncode, out.decode(), err.decode()


def hashes(out):
    result = json.loads(out)
    return {f"{s['id']}.{o['port']}": o["table_hash"] for s in result["stages"] for o in s["outputs"]}


def verify(calib, store):
    done = subprocess.run([calib, "verify", "--store", str(store), "--json"], capture_output=True, text=True)
    if done.returncode not in (0, 1):
        raise Failure(f"verify ended with {done.returncode}: {done.stderr}")
    return done.returncode, json.loads(done.stdout)["faults"]


def write(path, data):
    os.chmod(path, 0o644)
    path.write_bytes(data)


class Campaign:
    def __init__(self, calib, work, seed):
        self.calib, self.work, self.random = calib, work, random.Random(seed)
        self.base = work / "base"
        begun = time.time()
        code, out, err = run(calib, self.base)
        self.seconds = time.time() - begun
        assert code == 0, err
        self.wanted = hashes(out)
        self.bytes = {p.name: sha(p) for p in files(self.base, "tables")}
        self.other = hashes(run(calib, work / "other", "--set", "seed=99")[1])

    def fresh(self, full):
        store = self.work / "store"
        shutil.rmtree(store, ignore_errors=True)
        if full:
            shutil.copytree(self.base, store)
        return store

    def refused_well(self, code, err):
        if code not in (2, 75) or not REMEDY.search(err):
            raise Failure(f"code {code} without a word of what to do: {err.strip()!r}")

    def heals(self, store, *more, tries=2):
        """The same command again: in the end the tables of an undisturbed run, under their names, with their bytes."""
        refusals = 0
        for _ in range(tries + 1):
            code, out, err = run(self.calib, store, *more)
            if code == 0:
                break
            self.refused_well(code, err)
            refusals += 1
        else:
            raise Failure(f"refused {refusals} times: {err.strip()!r}")
        if hashes(out) != (self.other if more else self.wanted):
            raise Failure("wrong tables were accepted")
        if not more and {p.name: sha(p) for p in files(store, "tables")} != self.bytes:
            raise Failure("the tables that people open are not those of the run")
        return refusals

    def committed(self, store):
        return {p.relative_to(store): sha(p) for p in files(store, "actions", "objects")}

    def kept(self, store, before, but=()):
        after = self.committed(store)
        lost = [str(p) for p in before if p not in but and after.get(p) != before[p]]
        if lost:
            raise Failure(f"lost: {lost[:3]}")

    def clean(self, store):
        code, faults = verify(self.calib, store)
        if code != 0:
            raise Failure(f"verify after healing: {faults[:3]}")

    # Every kind of fault: does it, sees what the tool makes of it.
    def kill(self):
        store = self.fresh(False)
        for _ in range(self.random.choice([1, 1, 2])):
            run(self.calib, store, kill_after=self.random.uniform(0, self.seconds * 1.1))
        before = self.committed(store)
        whole = {p: h for p, h in before.items() if p.parts[0] == "actions"}
        self.heals(store, tries=0)
        self.kept(store, whole)
        self.clean(store)

    def full_disk(self):
        store = self.fresh(self.random.random() < 0.3)
        limit = int(2 ** self.random.uniform(3, 18))

        def pre():
            signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
            resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))

        before = self.committed(store) if store.exists() else {}
        code, _, err = run(self.calib, store, "--force", pre=pre)
        if code != 0:
            self.refused_well(code, err)
        self.kept(store, {p: h for p, h in before.items() if p.parts[0] == "objects"})
        self.heals(store, tries=0)
        self.clean(store)

    def obstacle(self):
        store = self.fresh(True)
        name = self.random.choice(["tmp", "objects", "actions", "runs", "tables", "documents", "tables/resume"])
        aside = self.work / "aside"
        shutil.rmtree(aside, ignore_errors=True)
        (store / name).rename(aside)
        (store / name).write_text("in the way")
        code, out, err = run(self.calib, store, "--force")
        if code == 0:
            if hashes(out) != self.wanted:
                raise Failure("wrong tables were accepted")
        else:
            self.refused_well(code, err)
        (store / name).unlink()
        aside.rename(store / name)
        self.heals(store, tries=0)
        self.clean(store)

    def torn(self):
        store = self.fresh(True)
        path = self.random.choice(files(store, "objects", "actions"))
        data = path.read_bytes()
        before = self.committed(store)
        path.unlink()
        path.write_bytes(data[: self.random.randrange(len(data))])
        if verify(self.calib, store)[0] != 1:
            raise Failure(f"verify did not see the torn {path.name}")
        self.heals(store)
        self.kept(store, before, but={path.relative_to(store)})

    def flip(self):
        store = self.fresh(True)
        path = self.random.choice(files(store, "objects", "actions", "runs", "tables", "documents") + [store / "format.json"])
        data = bytearray(path.read_bytes())
        bit = self.random.randrange(len(data) * 8)
        data[bit // 8] ^= 1 << (bit % 8)
        before = self.committed(store)
        write(path, bytes(data))
        if verify(self.calib, store)[0] != 1:
            raise Failure(f"verify did not see bit {bit} of {path.relative_to(store)}")
        if path.name == "format.json":
            code, _, err = run(self.calib, store)
            self.refused_well(code, err)
            return
        self.heals(store)
        self.kept(store, before, but={path.relative_to(store)})

    def removed(self):
        store = self.fresh(True)
        path = self.random.choice(files(store, "objects", "actions", "runs", "tables", "documents"))
        before = self.committed(store)
        path.unlink()
        self.heals(store)
        self.kept(store, before, but={path.relative_to(store)})

    def clock(self):
        store = self.fresh(True)
        future = time.time() + self.random.uniform(1e3, 1e9)
        for path in files(store, ".") + [store]:
            os.utime(path, (future, future))
        runs = list((store / "runs").iterdir())
        runs[0].rename(store / "runs" / ("7" + self.random.choice("0123456789ABCDEFGHJKMNPQRSTVWXY") * 25))  # no id comes after 7ZZZ...
        shown = subprocess.run([self.calib, "gc", "--store", str(store), "--keep-runs", "1"], capture_output=True, text=True)
        before = self.committed(store)
        self.kept(store, before)
        self.heals(store, tries=0)
        log = subprocess.run([self.calib, "log", "--store", str(store)], capture_output=True, text=True).stdout
        if "0 run, 7 cached" not in log.splitlines()[0]:
            raise Failure(f"the last run is not the first in the log: {log}")

    def two_at_once(self):
        store = self.fresh(False)
        same = self.random.random() < 0.5
        command = [self.calib, "run", str(PIPELINE), "--quiet", "--json", "--store", str(store)]
        children = [subprocess.Popen(command + more, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
                    for more in ([], [] if same else ["--set", "seed=99"])]
        killed = self.random.random() < 0.4
        if killed:
            time.sleep(self.random.uniform(0, self.seconds))
            children[1].kill()
        for child, wanted in zip(children, (self.wanted, self.wanted if same else self.other)):
            out, err = child.communicate(timeout=300)
            if child.returncode == 0 and hashes(out.decode()) != wanted:
                raise Failure("wrong tables were accepted")
            if child.returncode not in (0, -9):
                raise Failure(f"one of two runs failed: {err.decode().strip()!r}")
        self.heals(store, tries=0)
        self.clean(store)

    def moved(self):
        store = self.fresh(True)
        to = self.work / f"moved {self.random.randrange(10)}"
        shutil.rmtree(to, ignore_errors=True)
        if self.random.random() < 0.5:
            store.rename(to)
        else:
            shutil.copytree(store, to)
        before = self.committed(to)
        self.heals(to, tries=0)
        self.kept(to, before)
        self.clean(to)
        shutil.rmtree(to)

    def other_disk(self):
        folder = pathlib.Path("/dev/shm")
        if not folder.is_dir():
            return
        with tempfile.TemporaryDirectory(dir=folder) as place:
            store = pathlib.Path(place) / "store"
            run(self.calib, store, kill_after=self.random.uniform(0, self.seconds))
            self.heals(store, tries=0)
            self.clean(store)


KINDS = {"kill -9 at a random moment": ("kill", 24), "full disk": ("full_disk", 14), "obstacle in a folder": ("obstacle", 8),
         "torn file": ("torn", 14), "flipped bit": ("flip", 18), "removed file": ("removed", 8), "clock backwards": ("clock", 3),
         "two runs at once": ("two_at_once", 6), "moved store": ("moved", 3), "another disk": ("other_disk", 2)}


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--calib", default=str(ROOT / "target/debug/calib"))
    parser.add_argument("--faults", type=int, default=500)
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="faults-") as work:
        campaign = Campaign(arguments.calib, pathlib.Path(work), arguments.seed)
        choice = random.Random(arguments.seed)
        names, weights = list(KINDS), [weight for _, weight in KINDS.values()]
        done, failed = collections.Counter(), collections.defaultdict(list)
        for number in range(arguments.faults):
            kind = choice.choices(names, weights)[0]
            try:
                getattr(campaign, KINDS[kind][0])()
            except Failure as failure:
                failed[kind].append(f"fault {number}: {failure}")
                print(f"{kind}: fault {number}: {failure}", flush=True)
            done[kind] += 1
    width = max(map(len, names))
    print(f"{'fault':{width}}  injected  wrong")
    for kind in names:
        print(f"{kind:{width}}  {done[kind]:8}  {len(failed[kind]):5}")
    wrong = sum(map(len, failed.values()))
    print(f"{'all':{width}}  {sum(done.values()):8}  {wrong:5}")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
