"""The wheel says what the command line says, to the last digit, and what is wrong with arrays."""

import json
import os
import pathlib
import signal
import subprocess
import sys
import threading
import time

import calib
import numpy as np
import pandas
import polars
import pyarrow
import pytest
from recorded import EXAMPLE, recording

PIPELINE = """
calib: 1
name: arrays
seed: 1
stages:
  - uses: robot
    with: {file: robot.json, format: case}
  - uses: ingest
    with:
      instrument: leica_at960
      files:
        - file: measured.csv
          columns:
            q: {column: 'q{j}', unit: rad}
            x: {column: x, unit: mm}
            y: {column: y, unit: mm}
            z: {column: z, unit: mm}
            usage: {column: use}
            payload: {column: payload_kg, unit: kg}
            time: {column: time_s, unit: s}
            temperature: {column: temp_c, unit: C}
  - uses: split
    with: {by: usage}
  - uses: identify
  - uses: diagnose
"""


def command(*arguments: str, cwd: object = None, input: str = "") -> str:
    done = subprocess.run(["calib", *arguments], cwd=cwd, input=input, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def arm() -> calib.Robot:
    return calib.Robot.from_file(EXAMPLE / "r01" / "robot.json")


@pytest.fixture(scope="module")
def arrays():
    return recording("r01")


@pytest.fixture(scope="module")
def model(arm, arrays) -> calib.Model:
    joints, points, held_out, columns = arrays
    return arm.identify(joints, points, "leica_at960", held_out=held_out, **columns)


@pytest.fixture(scope="module")
def diagnosis(arm, arrays) -> calib.Diagnosis:
    joints, points, held_out, columns = arrays
    return arm.diagnose(joints, points, "leica_at960", held_out=held_out, **columns)


@pytest.fixture(scope="module")
def run_by_command(arrays, tmp_path_factory):
    """The same numbers in a file, run by the command."""
    joints, points, held_out, columns = arrays
    folder = tmp_path_factory.mktemp("cell")
    (folder / "pipeline.yaml").write_text(PIPELINE)
    (folder / "robot.json").write_bytes((EXAMPLE / "r01" / "robot.json").read_bytes())
    lines = [",".join([*(f"q{j}" for j in range(1, 7)), "x", "y", "z", "use", *columns])]
    for row in range(len(joints)):
        numbers = [*joints[row], *points[row]]
        use = "validate" if held_out[row] else "fit"
        lines.append(",".join([*map(repr, map(float, numbers)), use, *(repr(float(values[row])) for values in columns.values())]))
    (folder / "measured.csv").write_text("\n".join(lines) + "\n")
    command("run", "pipeline.yaml", "--quiet", cwd=folder)
    return folder


def test_tables_are_those_of_the_command_line_to_the_last_digit(run_by_command, model, diagnosis):
    run = calib.open_run(store=run_by_command / ".calib")
    for stage, tables in (("identify", model), ("diagnose", diagnosis.model)):
        for name in tables.tables:
            assert pyarrow.table(tables.table(name)).equals(pyarrow.table(run.table(f"{stage}.{name}"))), f"{stage}.{name}"
    printed = json.loads(command("diagnose", "HEAD", "--json", cwd=run_by_command))
    assert diagnosis.findings == printed["findings"]
    assert run.diagnosis().document == {**printed, "next_measurements": run.diagnosis().document["next_measurements"]}


def test_a_cause_is_named_from_arrays_in_ten_lines(diagnosis):
    truth = json.loads((EXAMPLE / "truth.json").read_text())["concealed"]["r01"][0]
    found = diagnosis.findings[0]
    assert (diagnosis.verdict, found["effect"], found["where"]) == ("explained", truth["effect"], truth["where"])
    assert "steps by 17.9 arcsec" in str(diagnosis)
    assert diagnosis._repr_html_().startswith("<iframe srcdoc=") and "zero shift" in diagnosis.html
    assert len(diagnosis.rivals) >= 1 and "follows" in diagnosis.cells.columns


def test_predictions_are_those_of_the_table(model, arrays):
    joints, points, held_out, columns = arrays
    predicted = model.predict(joints, **columns)
    table = model.table("prediction")
    printed = np.column_stack([table[name] for name in ("x_mm", "y_mm", "z_mm")])
    assert np.abs(predicted - printed).max() < 1e-9
    # Concealed: 17.6 arcsec of joint 1 at 3 m; without it the arm is known to the noise.
    assert np.linalg.norm(predicted - points, axis=1)[held_out].mean() < 0.2


def test_commands_are_those_of_the_command_line(run_by_command, model, arrays):
    joints = arrays[0][:20]
    commands = model.compensate(joints, payload_kg=0.0)
    header = ",".join(f"q{j}_rad" for j in range(1, 7)) + ",payload_kg"
    lines = [",".join([*(repr(float(q)) for q in row), "0"]) for row in joints]
    printed = command("compensate", "HEAD", "-", "--step", "identify", "--quiet", cwd=run_by_command, input="\n".join([header, *lines]) + "\n")
    printed = np.array([[float(cell) for cell in line.split(",")[:6]] for line in printed.splitlines()[1:]])
    # The command line writes ten digits.
    assert np.abs(commands.joints - printed).max() < 1e-9
    lines = "\n".join(json.dumps({"joints_rad": row, "payload_kg": 0}) for row in joints.tolist())
    printed = command("serve-model", "HEAD", "--step", "identify", "--quiet", cwd=run_by_command, input=lines)
    answers = [json.loads(line) for line in printed.splitlines()]
    assert [answer["joints_rad"] for answer in answers] == commands.joints.tolist()
    assert len(commands) == 20


def test_tables_go_to_pandas_polars_and_pyarrow_without_a_copy(model):
    table = model.table("prediction")
    arrow = pyarrow.table(table)
    assert polars.DataFrame(table).shape == arrow.shape == (len(table), len(table.columns))
    assert list(pandas.DataFrame.from_arrow(table).columns) == table.columns if hasattr(pandas.DataFrame, "from_arrow") else True
    address = arrow.column("x_mm").chunk(0).buffers()[1].address
    assert pyarrow.table(table).column("x_mm").chunk(0).buffers()[1].address == address
    assert table["x_mm"].dtype == float and table["held_out"].dtype == bool and table["point_id"][0] == "row 1"
    assert pyarrow.schema(table).names == table.columns
    with pytest.raises(KeyError, match="no column `x`; there are: sequence"):
        table["x"]


@pytest.mark.parametrize(
    ("change", "error", "sentence"),
    [
        (lambda q, p: (q.tolist(), p), TypeError, r"^joints: a list; expected an array of float64, e.g. numpy.asarray\(joints, dtype=float\)"),
        (lambda q, p: (q.astype(np.float32), p), TypeError, "^joints: dtype float32; expected an array of float64"),
        (lambda q, p: (q[:, :5], p), ValueError, r"^joints: shape \[\d+, 5\]; expected \[rows, 6\]: a column for each joint of "),
        (lambda q, p: (q, p.ravel()), ValueError, r"^points: shape \[\d+\]; expected \[rows, 3\]: x, y, z in mm"),
        (lambda q, p: (q, p[:-1]), calib.DataError, r"^points: \d+ values; expected \d+"),
        (lambda q, p: (with_nan(q), p), calib.DataError, "^joints, row 3, joint 3: NaN is not a number"),
        (lambda q, p: (q, with_nan(p)), calib.DataError, "^points, row 3: NaN is not a number"),
        (lambda q, p: (np.degrees(q), p), calib.DataError, "declared in rad, but .* hold a joint beyond one and a half turns, .*; if the array holds degrees"),
    ],
)
def test_arrays_that_are_none_are_told_apart(arm, arrays, change, error, sentence):
    joints, points = change(arrays[0], arrays[1])
    with pytest.raises(error, match=sentence):
        arm.identify(joints, points, 0.01)


def with_nan(array: np.ndarray) -> np.ndarray:
    changed = array.copy()
    changed[3, 2] = np.nan
    return changed


def test_settings_and_names_are_told_as_on_the_command_line(arm, arrays, tmp_path):
    joints, points = arrays[:2]
    with pytest.raises(calib.SpecError, match=r"identify: with.efects: unknown key; did you mean `effects`\?"):
        arm.identify(joints, points, settings={"efects": []})
    with pytest.raises(calib.SpecError, match=r"payload: no such column; did you mean `payload_kg`\?"):
        arm.identify(joints, points, payload=1.0)
    with pytest.raises(calib.SpecError, match=r"unknown instrument `leica`"):
        arm.identify(joints, points, "leica")
    with pytest.raises(calib.SpecError, match=r"no arm `ur11e` in the library; did you mean"):
        calib.Robot.library("ur11e")
    with pytest.raises(calib.SpecError, match="no such file"):
        calib.run(tmp_path / "none.yaml")
    with pytest.raises(ValueError, match=r"rows: shape \[6\]; expected \[joints, 4\]"):
        calib.Robot.from_dh([0.0] * 6)


def test_robots_come_from_tables_files_and_the_library(tmp_path):
    half = np.pi / 2
    ur10 = [[0, 127.3, 0, half], [0, 0, -612, 0], [0, 0, -572.3, 0], [0, 163.941, 0, half], [0, 115.7, 0, -half], [0, 92.2, 0, 0]]
    assert len(calib.Robot.from_dh(ur10, name="UR10").joints) == 6
    assert calib.Robot.library("ur10e").limits.shape == (6, 2)
    assert "ur10e" in calib.robots()
    urdf = tmp_path / "arm.urdf"
    urdf.write_text(
        '<robot name="two"><link name="base"/><link name="one"/><link name="tool0"/>'
        '<joint name="a" type="revolute"><parent link="base"/><child link="one"/><axis xyz="0 0 1"/><limit lower="-3" upper="3"/></joint>'
        '<joint name="b" type="revolute"><parent link="one"/><child link="tool0"/><origin xyz="0.5 0 0"/><axis xyz="0 1 0"/>'
        '<limit lower="-2" upper="2"/></joint></robot>'
    )
    arm = calib.Robot.from_urdf(urdf)
    assert (arm.name, arm.joints) == ("arm", ["a", "b"])
    assert any(cause["name"] == "backlash" for cause in calib.effects())


def test_poses_are_those_of_the_command_line(tmp_path):
    arm = calib.Robot.library("ur10e")
    asked = {"payload": [0.0, 5.0], "floor": 200.0, "candidates": 200, "seed": 3}
    limits = np.tile(np.radians([-170.0, 170.0]), (6, 1))
    found = arm.poses(20, limits=limits, settings=asked)
    (tmp_path / "arm.yaml").write_text(command("robots", "ur10e"))
    options = ["--limits", ",".join(["-170:170"] * 6), "--payload", "0,5", "--floor", "200", "--candidates", "200", "--seed", "3", "--json"]
    answer = json.loads(command("poses", str(tmp_path / "arm.yaml"), "--count", "20", *options))
    assert found.joints.shape == (20, 6) and len(found) == 20 and set(found.payload_kg) <= {0.0, 5.0}
    assert found.document["poses"] == answer["poses"]
    assert np.allclose(np.degrees(found.joints[:, 0]), [pose["q1_deg"] for pose in answer["poses"]], atol=6e-5)
    with pytest.raises(calib.SpecError, match="did you mean `joint_compliance`"):
        arm.poses(separate=("reduction_ratio", "joint_complience"))
    with pytest.raises(calib.SpecError, match="separate: expected two effects"):
        arm.poses(separate=("reduction_ratio",))
    with pytest.raises(calib.SpecError, match="count: expected 1 to 2000, found 0"):
        arm.poses(0)
    with pytest.raises(calib.SpecError, match="limits: .* is empty"):
        arm.poses(limits=-limits)
    with pytest.raises(ValueError, match="unknown field `flor`"):
        arm.poses(settings={"flor": 200.0})
    with pytest.raises(calib.SpecError, match="has no limits"):
        calib.Robot.from_dh([[0.0, 400.0, 25.0, -1.57]] * 3).poses()


def test_a_pipeline_is_run_with_progress_and_its_tables_are_read(run_by_command):
    seen = []
    run = calib.run(
        run_by_command / "pipeline.yaml", {"seed": 2, "identify.folds": 0}, store=run_by_command / ".calib",
        progress=lambda stage, done, total, text: seen.append((stage, done, total, text)),
    )
    assert {"identify", "diagnose"} <= {stage for stage, *_ in seen}
    assert run.manifest["seed"] == 2 and "diagnose.cells" in run.tables
    assert len(run.table("diagnose/prediction")) == len(run.table("recording"))
    assert run.model("identify").predict(np.zeros((2, 6)), payload_kg=0.0).shape == (2, 3)
    with pytest.raises(calib.SpecError, match="has no table `predictions`"):
        run.table("predictions")


def test_drives_are_diagnosed_from_arrays():
    example = pathlib.Path(__file__).parents[2] / "pipelines" / "drives" / "example"
    log = pandas.read_csv(example / "recording.csv")
    described = json.loads((example / "drives.json").read_text())
    command, angle = (log[[f"{name}{joint}_rad" for joint in (1, 2, 3)]].to_numpy() for name in ("cmd", "q"))
    time_s, judges = log["time_s"].to_numpy(), (log["use"] != "fit").to_numpy()
    diagnosis = calib.drives(example / "robot.xml", described, time_s, command, angle, trajectory=log["traj"].to_numpy(), held_out=judges)
    concealed = json.loads((example / "truth.json").read_text())["effects"]
    assert {(one["effect"], one["where"]) for one in diagnosis.findings} == {(one["effect"], one["where"]) for one in concealed}
    assert len(diagnosis.table("joints")) == 3
    with pytest.raises(calib.DataError, match="expected .* of both"):
        calib.drives(example / "robot.xml", described, time_s, command[:, 0], angle)


def test_a_callable_that_fails_and_ctrl_c_end_the_work_at_once(arm, arrays):
    joints, points, held_out, columns = arrays

    def failing(*_):
        raise RuntimeError("enough")

    with pytest.raises(RuntimeError, match="enough"):
        arm.diagnose(joints, points, 0.01, held_out=held_out, progress=failing)
    # Many rows: seconds of work.
    many = [np.concatenate([array + 1e-4 * k for k in range(30)]) for array in (joints, points)]
    # What a shell starts in the background ignores it.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    begun = time.monotonic()
    threading.Timer(0.5, lambda: os.kill(os.getpid(), signal.SIGINT)).start()
    with pytest.raises(KeyboardInterrupt):
        arm.diagnose(*many, 0.01)
    assert time.monotonic() - begun < 1.5


def test_a_run_that_is_interrupted_is_recorded_as_such_and_can_be_run_again(run_by_command):
    store = run_by_command / ".interrupted"

    def failing(stage, *_):
        if stage == "diagnose":
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        calib.run(run_by_command / "pipeline.yaml", store=store, progress=failing)
    # The work ends at its next step.
    for _ in range(100):
        last = json.loads(command("log", "--json", "--store", str(store)))[0]
        if last["status"] == "failed":
            break
        time.sleep(0.1)
    assert (last["status"], last["error"]) == ("failed", "diagnose: was interrupted: run it again")
    assert calib.run(run_by_command / "pipeline.yaml", store=store).manifest["status"] == "done"


def test_other_threads_go_on_while_one_computes(arm, arrays):
    ticks, ended = [], threading.Event()

    def tick():
        while not ended.wait(0.01):
            ticks.append(time.monotonic())

    thread = threading.Thread(target=tick)
    thread.start()
    arm.diagnose(*arrays[:2], 0.01)
    ended.set()
    thread.join()
    assert len(ticks) > 20 and max(np.diff(ticks)) < 0.5


def test_the_command_is_installed_and_the_notebook_runs(tmp_path):
    assert command("--version").startswith("calib ")
    assert calib.__version__ in command("--version")
    script = os.path.join(os.path.dirname(__file__), "notebook.py")
    subprocess.run([sys.executable, script], cwd=tmp_path, check=True)
    pictures = sorted(path.name for path in tmp_path.glob("*.png"))
    assert pictures == ["causes.png", "residuals.png"] and all((tmp_path / name).stat().st_size > 10_000 for name in pictures)
