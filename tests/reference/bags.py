#!/usr/bin/env python3
"""Recordings of ROS 2: what calib reads of them is, bit by bit, what the Python package `rosbags` reads; and how long a million messages take.

    pip install rosbags mcap numpy pyarrow
    python3 tests/reference/bags.py --calib target/release/calib [--bags ../shared/data/ur10_bags] [--messages 1000000]

Each bag becomes the table `motion` of `ingest_torques` (position, velocity, effort, stamp of each message); bags are those of the folder, and
some that the package `mcap` and SQLite write here: chunks in lz4, zstd or none, both orders of bytes, joints in changing order.
"""
import argparse, pathlib, resource, sqlite3, struct, subprocess, tempfile, time
import mcap, mcap.writer, numpy as np, pyarrow.parquet as parquet, rosbags
from importlib.metadata import version
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore

ROOT = pathlib.Path(__file__).resolve().parents[2]
STORE = get_typestore(Stores.ROS2_HUMBLE)
JOINTS = ["shoulder_pan_joint", "shoulder_lift_joint", "elbow_joint", "wrist_1_joint", "wrist_2_joint", "wrist_3_joint"]
PIPELINE = """calib: 1
name: b
seed: 1
stages:
  - uses: robot
    with: {{file: robot.yaml}}
  - uses: ingest_torques
    with:
      limits: ignore
      files:
        - file: {file}
          topic: /joint_states
          columns:
            time: {{column: stamp, unit: s}}
            q: {{columns: [{position}], unit: rad}}
            velocity: {{columns: [{velocity}], unit: rad/s}}
            current: {{columns: [{effort}], unit: A}}
"""


def written(path, kind, count, big):
    """A bag of so many joint states, every eight milliseconds."""
    draw, order = np.random.default_rng(7), ">" if big else "<"
    names = [np.array(JOINTS)[np.roll(np.arange(6), k)] for k in range(6)]
    head = []
    for own in names:
        body = struct.pack(order + "I", 7)
        for name in ["finger", *own]:
            body += b"\0" * (-len(body) % 4) + struct.pack(order + "I", len(name) + 1) + name.encode() + b"\0"
        head.append(body)
    block = draw.normal(size=(min(count, 4099), 6, 3))

    def message(k):
        stamp = 1_700_000_000_123_456_789 + 8_000_000 * k
        body = struct.pack(order + "iI", stamp // 10**9, stamp % 10**9) + struct.pack(order + "I", 1) + b"\0"
        body += b"\0" * (-len(body) % 4) + head[k % 6]
        for what in range(3):
            # A list is its length and, from the next multiple of eight, its numbers.
            body += b"\0" * (-len(body) % 4) + struct.pack(order + "I", 7)
            body += b"\0" * (-len(body) % 8)
            body += struct.pack(order + "7d", 9.0, *np.roll(block[k % len(block), :, what] + 1e-7 * k, -(k % 6)))
        return stamp, bytes([0, 0 if big else 1, 0, 0]) + body

    kind_of = "sensor_msgs/msg/JointState"
    if kind == "db3":
        base = sqlite3.connect(path)
        base.execute("CREATE TABLE topics(id INTEGER PRIMARY KEY,name TEXT NOT NULL,type TEXT NOT NULL,serialization_format TEXT NOT NULL,offered_qos_profiles TEXT NOT NULL)")
        base.execute("CREATE TABLE messages(id INTEGER PRIMARY KEY,topic_id INTEGER NOT NULL,timestamp INTEGER NOT NULL, data BLOB NOT NULL)")
        base.execute("INSERT INTO topics VALUES(1,'/joint_states',?,'cdr','')", (kind_of,))
        base.executemany("INSERT INTO messages(topic_id,timestamp,data) VALUES(1,?,?)", (message(k) for k in range(count)))
        base.commit()
        base.close()
        return
    with open(path, "wb") as out:
        compression = {"lz4": mcap.writer.CompressionType.LZ4, "zstd": mcap.writer.CompressionType.ZSTD, "none": mcap.writer.CompressionType.NONE}[kind]
        writer = mcap.writer.Writer(out, compression=compression, use_chunking=kind != "none")
        writer.start("ros2")
        definition = STORE.generate_msgdef(kind_of, ros_version=2)[0].encode()
        schema = writer.register_schema(kind_of, "ros2msg", definition)
        channel = writer.register_channel("/joint_states", "cdr", schema)
        for k in range(count):
            stamp, data = message(k)
            writer.add_message(channel, stamp, data, stamp)
        writer.finish()


def ours(calib, folder, bag):
    names = {what: ", ".join(f"{joint}.{what}" for joint in JOINTS) for what in ("position", "velocity", "effort")}
    (folder / "robot.yaml").write_text((ROOT / "pipelines/ur10/robot.yaml").read_text())
    (folder / "b.yaml").write_text(PIPELINE.format(file=bag, **names))
    begun = time.time()
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run([calib, "run", "b.yaml", "--store", "s", "--force", "--quiet"], cwd=folder, check=True, stdout=subprocess.DEVNULL)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    table = parquet.read_table(folder / "s/tables/b/ingest_torques.motion.parquet")
    took = f"{time.time() - begun:.2f} s, {after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime:.2f} s of CPU, {after.ru_maxrss / 1024:.0f} MB at most"
    return table, took


def theirs(bag):
    rows = []
    with AnyReader([bag], default_typestore=STORE) as reader:
        for connection, _, raw in reader.messages([one for one in reader.connections if one.topic == "/joint_states"]):
            state = reader.deserialize(raw, connection.msgtype)
            at = [state.name.index(joint) for joint in JOINTS]
            # The nearest number to the whole stamp, as a text of it is read.
            stamp = float(f"{state.header.stamp.sec}.{state.header.stamp.nanosec:09d}")
            rows.append([stamp, *state.position[at], *state.velocity[at], *state.effort[at]])
    return np.array(rows)


def columns(table):
    joints = [pattern.format(j) for pattern in ("q{}_rad", "dq{}_rad_s", "i{}_a") for j in range(1, 7)]
    return np.column_stack([table[name].to_numpy() for name in ["time_s", *joints]])


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--calib", required=True, type=pathlib.Path)
    parser.add_argument("--bags", type=pathlib.Path)
    parser.add_argument("--messages", type=int, default=0)
    given = parser.parse_args()
    print(f"rosbags {version('rosbags')}, mcap {version('mcap')}")
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        bags = [given.bags / "ur10_exciting_trajectory.db3"] if given.bags else []
        for kind in ("lz4", "zstd", "none", "db3"):
            for big in (False, True):
                path = folder / f"{kind}_{'big' if big else 'little'}.{'db3' if kind == 'db3' else 'mcap'}"
                written(path, kind, 2000, big)
                bags.append(path)
        for bag in bags:
            table, _ = ours(given.calib.resolve(), folder, bag.resolve())
            expected = theirs(bag)
            read = columns(table)
            equal = read.shape == expected.shape and (read.view(np.int64) == expected.view(np.int64)).all()
            print(f"{bag.name}: {len(expected)} messages, {'equal to the bit' if equal else 'NOT EQUAL'}")
            assert equal, (read.shape, expected.shape, table.column_names)
        for kind in ("zstd", "lz4", "db3") if given.messages else ():
            path = folder / f"many.{'db3' if kind == 'db3' else 'mcap'}"
            path.unlink(missing_ok=True)
            written(path, kind, given.messages, False)
            print(f"{kind}: {given.messages} messages, {path.stat().st_size / 1e6:.0f} MB: {ours(given.calib.resolve(), folder, path)[1]}")


main()
