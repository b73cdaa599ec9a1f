#!/usr/bin/env python3
"""`calib diff` beside DuckDB's hand-written query and datacompy: counts, time, peak memory, on two tables of N rows x 12 columns.

    python3 tests/reference/diff_speed.py --calib target/release/calib --rows 10000000

Needs duckdb, and datacompy with polars for its part (`--without-datacompy` leaves it out). Every tool runs in a process of its own, twice in turn; the
better time counts. The tables are keyed by (robot, pose); 0.1 % of c3 is changed, 100 rows are missing on each side.
"""
import argparse, json, os, pathlib, resource, subprocess, sys, tempfile, time

QUERY = """select count(*) filter (a.robot is not null and b.robot is not null and not ({equal})) as changed,
  count(*) filter (a.robot is not null and b.robot is not null and ({equal})) as same,
  count(*) filter (b.robot is null) as only_a, count(*) filter (a.robot is null) as only_b,
  {statistics} from read_parquet('{a}') a full outer join read_parquet('{b}') b on a.robot = b.robot and a.pose = b.pose"""
COLUMNS = [f"c{k}" for k in range(1, 11)]


def make(folder, rows):
    import duckdb
    c = duckdb.connect()
    c.execute("set preserve_insertion_order=true")
    values = ", ".join(f"(hash(i * 31 + {k}) % 1000000007) / 1000.0 as c{k}" for k in range(1, 11))
    c.execute(f"create table a as select 'r' || lpad(cast(i // 1000 as varchar), 5, '0') robot, i % 1000 pose, {values} from range({rows}) t(i)")
    rest = ", ".join(f"c{k}" for k in range(4, 11))
    c.execute(f"""create table b as select robot, pose, c1, c2, case when hash(robot || pose) % 1000 = 7 then c3 + 0.5 else c3 end c3, {rest}
                  from a where not (robot = 'r00000' and pose < 100)""")
    c.execute("insert into b select 'zz', pose, " + ", ".join(COLUMNS) + " from a where robot = 'r00001' and pose < 100")
    for name, order in (("a", "robot, pose"), ("b", "robot, pose")):
        c.execute(f"copy (select * from {name} order by {order}) to '{folder}/{name}.parquet' (format parquet)")
    c.execute(f"copy (select * from b order by hash(robot || pose)) to '{folder}/shuffled.parquet' (format parquet)")


def duckdb_part(a, b):
    import duckdb
    equal = " and ".join(f"a.{c} is not distinct from b.{c}" for c in COLUMNS)
    statistics = ", ".join(f"max(abs(b.{c} - a.{c})), sqrt(avg((b.{c} - a.{c}) ** 2)), avg(b.{c} - a.{c})" for c in COLUMNS)
    row = duckdb.connect().execute(QUERY.format(equal=equal, statistics=statistics, a=a, b=b)).fetchone()
    print(json.dumps(dict(zip(("changed", "same", "only_a", "only_b"), row[:4]))))


def datacompy_part(a, b):
    import datacompy, polars
    compare = datacompy.PolarsCompare(polars.read_parquet(a), polars.read_parquet(b), join_columns=["robot", "pose"])
    rows = compare.intersect_rows
    changed = compare.count_matching_rows()
    print(json.dumps({"same": int(changed), "changed": rows.height - int(changed), "only_a": compare.df1_unq_rows.height, "only_b": compare.df2_unq_rows.height}))


def calib_counts(out):
    rows = json.loads(out)["rows"]
    return {name: rows[name] for name in ("changed", "same", "only_a", "only_b")}


def timed(command, counts=json.loads):
    begun = time.time()
    child = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
    out = child.stdout.read()
    _, _, usage = os.wait4(child.pid, 0)
    return time.time() - begun, usage.ru_maxrss / 1024, counts(out) if out else None


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--calib", default="target/release/calib")
    parser.add_argument("--rows", type=int, default=10_000_000)
    parser.add_argument("--folder", help="keep the tables here, and take those that are there")
    parser.add_argument("--without-datacompy", action="store_true")
    parser.add_argument("--part", nargs=3, help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.part:
        tool, a, b = arguments.part
        return {"duckdb": duckdb_part, "datacompy": datacompy_part}[tool](a, b)
    folder = pathlib.Path(arguments.folder or tempfile.mkdtemp(prefix="diff-speed-"))
    folder.mkdir(exist_ok=True)
    if not (folder / "shuffled.parquet").exists():
        make(folder, arguments.rows)
    results = {}
    for order, other in (("sorted", "b"), ("shuffled", "shuffled")):
        a, b = str(folder / "a.parquet"), str(folder / f"{other}.parquet")
        part = lambda tool: [sys.executable, __file__, "--part", tool, a, b]
        tools = [("calib", [arguments.calib, "diff", a, b, "--key", "robot,pose", "--json"], calib_counts), ("duckdb", part("duckdb"), json.loads)]
        if not arguments.without_datacompy:
            tools.append(("datacompy", part("datacompy"), json.loads))
        for turn in range(2):
            for name, command, counts in tools:
                if turn and name == "datacompy":
                    continue
                found = timed(command, counts)
                best = results.get((order, name))
                results[order, name] = min(best, found) if best else found
    print(f"{'order':9} {'tool':10} {'seconds':>8} {'peak MiB':>9}  counts")
    for (order, name), (seconds, memory, counts) in results.items():
        print(f"{order:9} {name:10} {seconds:8.2f} {memory:9.0f}  {counts}")


if __name__ == "__main__":
    main()
