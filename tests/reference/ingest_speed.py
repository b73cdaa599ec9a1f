#!/usr/bin/env python3
"""`ingest` beside a bare reading of the same two files by the csv crate: time, CPU time and peak memory.

    cargo build --release --no-default-features && cargo bench --profile release --no-default-features --no-run
    python3 tests/reference/ingest_speed.py --rows 1000000 10000000

A controller's log (name, time, payload, six joints) and a tracker's log (name, x, y, z) of N rows each, joined by name. Every program runs in a process
of its own, in turn, and the better time counts; further `--calib` are measured in the same run.
"""
import argparse, glob, os, pathlib, random, shutil, subprocess, tempfile, time

PIPELINE = """calib: 1
name: speed
seed: 1
stages:
  - uses: robot
    with: {file: robot.yaml}
  - uses: ingest
    with:
      files:
        - file: controller.csv
          columns:
            point_id: {column: name}
            time: {column: time_s, unit: s}
            payload: {column: payload_kg, unit: kg}
            q: {column: "q{j}_deg", unit: deg}
        - file: tracker.csv
          columns:
            point_id: {column: name}
            x: {column: x_mm, unit: mm}
            y: {column: y_mm, unit: mm}
            z: {column: z_mm, unit: mm}
      join: {by: id}
      instrument: {constant_um: 10, per_metre_um: 2.5, coverage: 2}
"""
ROOT = pathlib.Path(__file__).resolve().parents[2]


def make(folder, rows):
    folder.mkdir(parents=True)
    (folder / "pipeline.yaml").write_text(PIPELINE)
    shutil.copy(ROOT / "pipelines/ur10/robot.yaml", folder / "robot.yaml")
    # Rows repeat their numbers after more of them than are compressed together.
    draw, block = random.Random(7), min(rows, 1_000_003)
    joints = [",".join(f"{draw.uniform(-90, 90):.4f}" for _ in range(6)) for _ in range(block)]
    points = [",".join(f"{draw.uniform(-1500, 1500):.5f}" for _ in range(3)) for _ in range(block)]
    with open(folder / "controller.csv", "w") as controller, open(folder / "tracker.csv", "w") as tracker:
        controller.write("name,time_s,payload_kg," + ",".join(f"q{j}_deg" for j in range(1, 7)) + "\n")
        tracker.write("name,x_mm,y_mm,z_mm\n")
        for row in range(rows):
            name = f"P{row:08d}"
            controller.write(f"{name},{row * 0.25:.2f},{row % 6}.5,{joints[row % block]}\n")
            tracker.write(f"{name},{points[row % block]}\n")


def timed(command, folder):
    begun = time.time()
    child = subprocess.Popen(command, cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    out, error = child.stdout.read(), child.stderr.read()
    _, status, usage = os.wait4(child.pid, 0)
    if status:
        raise SystemExit(f"{command}: {error.decode()}{out.decode()}")
    return time.time() - begun, usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1024


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--calib", nargs="+", default=[str(ROOT / "target/release/calib")])
    parser.add_argument("--bare", help="the program of the benches; without it the newest")
    parser.add_argument("--rows", type=int, nargs="+", default=[1_000_000])
    parser.add_argument("--runs", type=int, default=2)
    parser.add_argument("--folder", help="keep the files here, and take those that are there")
    arguments = parser.parse_args()
    built = [file for file in glob.glob(str(ROOT / "target/release/deps/bench-*")) if os.access(file, os.X_OK)]
    bare = arguments.bare or max(built, key=os.path.getmtime)
    top = pathlib.Path(arguments.folder or tempfile.mkdtemp(prefix="ingest-speed-"))
    for rows in arguments.rows:
        folder = top / str(rows)
        if not folder.exists():
            make(folder, rows)
        size = sum((folder / name).stat().st_size for name in ("controller.csv", "tracker.csv"))
        print(f"{rows} rows x 2 files, {size / 1e6:.0f} MB")
        least = {}
        for _ in range(arguments.runs):
            for name in ["bare", *arguments.calib]:
                store = tempfile.mkdtemp(prefix="store-", dir=top)
                calib = [str(pathlib.Path(name).resolve()), "run", "pipeline.yaml", "--store", store]
                figures = timed([bare, "bare", "controller.csv", "tracker.csv"] if name == "bare" else calib, folder)
                shutil.rmtree(store)
                least[name] = [min(pair) for pair in zip(figures, least.get(name, figures))]
        for name, figures in least.items():
            seconds, cpu, memory = figures
            ratios = f"{seconds / least['bare'][0]:5.2f} x, CPU {cpu / least['bare'][1]:5.2f} x"
            print(f"  {name:<40} {seconds:8.2f} s {cpu:8.2f} s CPU {memory:7.0f} MB   {ratios}")
    if not arguments.folder:
        shutil.rmtree(top)


if __name__ == "__main__":
    main()
