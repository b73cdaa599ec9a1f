"""Makes industrial robots accurate, and says why they were not.

Arrays are float64 of numpy and carry their units in their names: joints in rad (mm of a joint that slides), points in mm. Tables come back
as `Table`, which pandas, polars and pyarrow take without a copy. Errors are `SpecError`, `DataError` (both ValueError), `StoreError`
(OSError) and TypeError, with the sentence of the command line.
"""

from __future__ import annotations

import json
import os
import signal
import sys
import tempfile
from collections.abc import Callable, Mapping, Sequence
from html import escape
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import _calib
from ._calib import DataError, SpecError, StoreError, __version__, robots

__all__ = [
    "Commands", "DataError", "Diagnosis", "Model", "Proposal", "Robot", "Run", "SpecError", "StoreError", "Table", "__version__", "drives", "effects", "open_run",
    "robots", "run",
]

Array = NDArray[np.float64]
Path = str | os.PathLike[str]
#: Called with the stage, units done, units in all (None where that is not known) and a text.
Progress = Callable[[str, int, int | None, str], object]


class Table:
    """A table: its columns carry their units in their names, `calib schema KIND` says what each means.

    `polars.DataFrame(table)`, `pyarrow.table(table)` and `pandas.DataFrame.from_arrow(table)` take its columns without a copy (Arrow
    PyCapsule interface); `table["x_mm"]` is one column as an array, NaN or None where nothing is known.
    """

    def __init__(self, frame: _calib.Frame) -> None:
        self._frame = frame

    @property
    def kind(self) -> str:
        """The name of its schema."""
        return self._frame.kind

    @property
    def columns(self) -> list[str]:
        """Names of its columns, in their order."""
        return self._frame.columns

    def __len__(self) -> int:
        return self._frame.rows

    def __getitem__(self, name: str) -> NDArray[Any]:
        values = self._frame.column(name)
        if values is None:
            raise KeyError(f"no column `{name}`; there are: {', '.join(self.columns)}")
        is_number = all(isinstance(value, float | None) for value in values)
        return np.array(values, dtype=float if is_number else None)

    def __arrow_c_schema__(self) -> object:
        return self._frame.schema_capsule()

    def __arrow_c_stream__(self, requested_schema: object = None) -> object:
        return self._frame.stream_capsule()

    def __repr__(self) -> str:
        return f"<calib.Table {self.kind}: {len(self)} rows, {len(self.columns)} columns>"


class Commands:
    """Corrected commands, and what is known of each."""

    def __init__(self, arrays: list[Array], remarks: list[str]) -> None:
        #: Shape (rows, joints), rad (mm of a joint that slides); NaN in rows that are not reached or refused.
        self.joints: Array = arrays[0]
        #: Shape (rows,): how far the uncorrected commands would be off by the model, mm.
        self.uncorrected_mm: Array = arrays[1]
        #: Shape (rows,): what the model leaves, mm.
        self.residual_mm: Array = arrays[2]
        #: Shape (rows,): uncertainty (95 %) of the point that is reached, mm; NaN where it is not known.
        self.u95_mm: Array = arrays[3]
        #: What is wrong with each, empty if nothing.
        self.remarks: list[str] = remarks

    def __len__(self) -> int:
        return len(self.remarks)


class Proposal:
    """Poses to measure, and what they promise."""

    def __init__(self, arrays: list[Array], document: str, text: str) -> None:
        #: Shape (rows, joints), rad (mm of a joint that slides), in the order of driving.
        self.joints: Array = arrays[0]
        #: Shape (rows,), kg.
        self.payload_kg: Array = arrays[1]
        #: Shape (rows, joints): 1 where the joint's last move goes upwards, -1 where downwards.
        self.direction: Array = arrays[2]
        #: All of it, as `calib poses --json` prints it.
        self.document: dict[str, Any] = json.loads(document)
        self._text = text

    def __len__(self) -> int:
        return len(self.payload_kg)

    def __str__(self) -> str:
        return self._text


class Model:
    """An identified arm: it predicts where the tool is, and corrects commands."""

    def __init__(self, model: _calib.Model, outcome: _calib.Outcome | None = None) -> None:
        self._model = model
        self._tables = dict(outcome.tables) if outcome else {}
        #: What the stage noted, a sentence each.
        self.notes: list[str] = outcome.notes if outcome else []
        #: What must not be overlooked.
        self.warnings: list[str] = model.warnings + (outcome.warnings if outcome else [])

    @property
    def parameters(self) -> Table:
        """Estimated parameters with standard deviations and reasons: the table `parameters`."""
        return Table(self._model.parameters)

    @property
    def tables(self) -> list[str]:
        """Names of the tables of its stage; none of a model of a run, whose tables `Run.table` gives."""
        return list(self._tables)

    def table(self, name: str) -> Table:
        """A table of its stage: prediction, covariance, observability, ... Raises SpecError where there is none."""
        if name not in self._tables:
            raise SpecError(f"no table `{name}`; there are: {', '.join(self._tables)}")
        return Table(self._tables[name])

    def predict(self, joints: Array, **columns: Any) -> Array:
        """Where the tool is: shape (rows, 3), mm in the frame of the instrument.

        joints: float64, shape (rows, joints), rad (mm of a joint that slides), as the controller counts them.
        columns: payload_kg, temp_c, time_s, dir, ... as in `Robot.identify`; without time_s laws over time are what they were last.
        """
        return self._model.predict(joints, columns)

    def compensate(self, joints: Array, *, force: bool = False, **columns: Any) -> Commands:
        """Commands with which the real arm comes to where the nominal one would be at these joints.

        joints: as in `predict`. columns: payload_kg, temp_c, time_s, dir, i_a. Limits are those of `calib compensate`; `force` insists on a
        model and on commands that are refused. Raises DataError where the model is refused, or needs a payload that is not stated.
        """
        return Commands(*self._model.compensate(joints, columns, force))

    def __repr__(self) -> str:
        return f"<calib.Model of {self._model.origin}: {len(self.parameters)} parameters>"


class Diagnosis:
    """Verdict, findings with their rivals, and the table of causes."""

    def __init__(
        self, document: str, text: str, html: str | None, table: Callable[[str], Table], warnings: list[str], model: Model | None
    ) -> None:
        #: All of it, as `calib diagnose --json` prints it.
        self.document: dict[str, Any] = json.loads(document)
        #: The page of `calib diagnose --html`; None of torques.
        self.html: str | None = html
        #: What must not be overlooked, a sentence each.
        self.warnings: list[str] = warnings
        #: The arm with all that was found; None of a run, where `Run.model` gives it.
        self.model: Model | None = model
        #: A table by its name: findings, rivals, cells, shares, parameters, prediction, ...
        self.table: Callable[[str], Table] = table
        self._text = text
        #: Where its tables are, if they go with it.
        self._folder: tempfile.TemporaryDirectory[str] | None = None

    @property
    def verdict(self) -> str:
        """`explained`, `unexplained`, `wrong_setup`, ..."""
        return str(self.document["verdict"])

    @property
    def statement(self) -> str:
        """The verdict in a sentence."""
        return str(self.document["statement"])

    @property
    def findings(self) -> list[dict[str, Any]]:
        """A dictionary a finding: effect, where, statement, probability, parameters, evidence, rivals, ..."""
        findings: list[dict[str, Any]] = self.document["findings"]
        return findings

    @property
    def rivals(self) -> Table:
        """Other explanations of findings that these data do not exclude."""
        return self.table("rivals")

    @property
    def cells(self) -> Table:
        """The table of causes: what was compared, at which place and by which variable."""
        return self.table("cells")

    def __str__(self) -> str:
        return self._text

    def __repr__(self) -> str:
        return f"<calib.Diagnosis {self.verdict}: {len(self.findings)} findings>"

    def _repr_html_(self) -> str | None:
        # In a frame of its own: the style of the page is none of the notebook's.
        style = "width:100%;height:40em;border:0"
        return self.html and f'<iframe srcdoc="{escape(self.html)}" style="{style}" sandbox=""></iframe>'


class Robot:
    """A robot as its owner believes it to be: a serial arm at its zero pose."""

    def __init__(self, robot: _calib.Robot) -> None:
        self._robot = robot

    @classmethod
    def from_file(cls, path: Path) -> Robot:
        """Reads calib's robot file (YAML), or a practice robot.json. Raises SpecError with every fault of the file."""
        return cls(_calib.Robot.from_file(path))

    @classmethod
    def from_text(cls, text: str) -> Robot:
        """Reads the text of a robot file, YAML or JSON."""
        return cls(_calib.Robot.from_text("text", text))

    @classmethod
    def from_urdf(cls, path: Path, tip: str = "tool0") -> Robot:
        """Reads a URDF: the chain of joints that ends at the link `tip`."""
        return cls(_calib.Robot.from_urdf(path, tip))

    @classmethod
    def from_dh(
        cls, rows: Array | Sequence[Sequence[float]], *, modified: bool = False, tool_mm: Sequence[float] = (0, 0, 0), name: str = "robot"
    ) -> Robot:
        """An arm of revolute joints by its Denavit-Hartenberg table.

        rows: shape (joints, 4): theta (rad), d (mm), a (mm), alpha (rad); standard, or Craig's where modified.
        tool_mm: the measured point in the last frame.
        """
        table = np.asarray(rows, dtype=float)
        if table.ndim != 2 or table.shape[1] != 4:
            raise ValueError(f"rows: shape {list(table.shape)}; expected [joints, 4]: theta rad, d mm, a mm, alpha rad")
        chain = [dict(zip(("theta", "d", "a", "alpha"), row)) for row in table.tolist()]
        file = {
            "calib_robot": 1, "name": name, "units": {"length": "mm", "angle": "rad"}, "tool": {"point": [float(value) for value in tool_mm]},
            "kinematics": {"mdh" if modified else "dh": chain},
        }
        return cls(_calib.Robot.from_text("rows", json.dumps(file)))

    @classmethod
    def library(cls, name: str) -> Robot:
        """An arm of the library; `calib.robots()` names all."""
        return cls(_calib.Robot.library(name))

    @property
    def name(self) -> str:
        """As its file calls it."""
        return self._robot.name

    @property
    def joints(self) -> list[str]:
        """Names of its joints, from the base on."""
        return self._robot.joints

    @property
    def limits(self) -> Array:
        """Travel of each joint, shape (joints, 2), rad (mm of a joint that slides); NaN where none is stated."""
        return self._robot.limits

    @property
    def notes(self) -> list[str]:
        """What a person should know of how it was read."""
        return self._robot.notes

    def __repr__(self) -> str:
        return f"<calib.Robot {self.name}: {len(self.joints)} joints>"

    def identify(
        self, joints: Array, points: Array, sigma: float | str | Array | None = None, *, held_out: Sequence[bool] | NDArray[np.bool_] | None = None,
        settings: Mapping[str, Any] | None = None, seed: int = 1, progress: Progress | None = None, **columns: Any,
    ) -> Model:
        """Identifies base, tool, geometry, gears and compliance in one estimation: the stage `identify`, with its defaults.

        joints: float64, shape (rows, joints), rad (mm of a joint that slides), in the order of recording.
        points: float64, shape (rows, 3), mm, in the frame of the instrument, wherever it stands.
        sigma: noise of the points, mm, one standard deviation of each axis: a number, shape (rows,) or (rows, 3), or the name of an
            instrument, e.g. "leica_at960"; without it a weight to start from.
        held_out: a boolean a row: fitted to by nothing, these rows judge; without it every fourth pose.
        settings: as `with:` of the stage, e.g. {"effects": ["base_frame", "tool_offset", "joint_offset"]}.
        seed: that of the pipeline.
        progress: called with the stage, units done, units in all or None, and a text.
        columns: columns of the table `recording`, a value for all rows or one a row: payload_kg, temp_c, time_s, target, point_id, ...;
            of columns of each joint shape (rows, joints): dir, i_a.

        Raises TypeError where an array is none of float64, ValueError (DataError, SpecError) where its shape or its numbers are wrong.
        """
        outcome = self._stage("identify", joints, points, sigma, held_out, settings, seed, progress, columns)
        return Model(outcome.model, outcome)

    def diagnose(
        self, joints: Array, points: Array, sigma: float | str | Array | None = None, *, held_out: Sequence[bool] | NDArray[np.bool_] | None = None,
        settings: Mapping[str, Any] | None = None, seed: int = 1, progress: Progress | None = None, **columns: Any,
    ) -> Diagnosis:
        """Says where robot and recording differ and which causes explain it: the stage `diagnose`, with its defaults.

        Arguments and errors are those of `identify`; settings are e.g. {"without": ["backlash"], "effects": ["my_effect.yaml"]}.
        """
        outcome = self._stage("diagnose", joints, points, sigma, held_out, settings, seed, progress, columns)
        model = Model(outcome.model, outcome)
        return Diagnosis(outcome.document or "", outcome.text or "", outcome.page, model.table, model.warnings, model)

    def poses(
        self, count: int = 50, *, separate: tuple[str, str] | None = None, limits: Array | None = None, settings: Mapping[str, Any] | None = None,
    ) -> Proposal:
        """Proposes poses to measure, as `calib poses` does: the best for all parameters together, or to separate two effects.

        Self-collision is not checked, nor collision with the cell: drive them slowly first.

        separate: names of two effects, e.g. ("reduction_ratio", "joint_compliance").
        limits: float64, shape (joints, 2), rad (mm of a joint that slides), instead of the robot's.
        settings: effects (names), box ([[x, x], [y, y], [z, z]], mm), floor (mm), payload (kg), sigma (mm), margin (percent of the travel
            left free at either end), candidates, seed.

        Raises SpecError where a setting is wrong, a joint has no limits, or the arm cannot go there; ValueError for unknown settings.
        """
        request = json.dumps({"count": count, **(settings or {})})
        return Proposal(*self._robot.poses(request, list(separate or ()), limits))

    def _stage(
        self, uses: str, joints: Array, points: Array, sigma: float | str | Array | None, held_out: Any, settings: Mapping[str, Any] | None,
        seed: int, progress: Progress | None, columns: dict[str, Any],
    ) -> _calib.Outcome:
        mask = None if held_out is None else np.asarray(held_out, dtype=bool).tolist()
        with_ = json.dumps(dict(settings or {}))
        return self._robot.stage(uses, joints, points, sigma, mask, columns, with_, seed, progress)


class Run:
    """A run in a store: its tables, its models and its diagnosis."""

    def __init__(self, run: _calib.Run) -> None:
        self._run = run
        #: What was done, with which files, settings and hashes.
        self.manifest: dict[str, Any] = json.loads(run.manifest)

    @property
    def id(self) -> str:
        """As `calib log` shows it."""
        return str(self.manifest["run_id"])

    @property
    def tables(self) -> list[str]:
        """Names of its tables, `stage.port`, in the order of the pipeline."""
        return self._run.tables

    def table(self, name: str) -> Table:
        """A table: `stage.port`, or its kind where one stage alone writes it. Raises SpecError where there is none."""
        return Table(self._run.table(name))

    def model(self, step: str | None = None) -> Model:
        """The model of a step, else of the step that stands for the run. Raises DataError where the set-up is wrong."""
        return Model(self._run.model(step))

    def diagnosis(self, step: str | None = None) -> Diagnosis:
        """What its stage `diagnose` said, `step` where it has several."""
        stage, document, text, html = self._run.diagnosis(step)
        warnings = next(one["warnings"] for one in self.manifest["stages"] if one["id"] == stage)
        return Diagnosis(document, text, html, lambda name: self.table(f"{stage}.{name}"), warnings, None)

    def __repr__(self) -> str:
        return f"<calib.Run {self.id} of {self.manifest['pipeline']['name']}: {len(self.manifest['stages'])} stages>"


def run(
    pipeline: Path, set: Mapping[str, Any] | None = None, *, store: Path | None = None, jobs: int | None = None, progress: Progress | None = None
) -> Run:
    """Runs a pipeline as `calib run` does: what is done already is not done again.

    set: variables, the seed or settings of a stage, as --set of the command line: {"case": "r07", "split.n": 5}.
    store: a folder or s3://BUCKET/PREFIX; without it .calib in the working directory.
    jobs: worker threads, without it all cores; no result depends on it.
    progress: as in `Robot.identify`.

    Raises SpecError with every fault of the YAML, DataError where the measurements are rejected.
    """
    shown = {name: value if isinstance(value, str) else json.dumps(value) for name, value in (set or {}).items()}
    overrides = [f"{name}={value}" for name, value in shown.items()]
    return Run(_calib.run(pipeline, overrides, store, jobs, progress))


def drives(
    mjcf: Path, described: Mapping[str, Any], time: Array, command: Array, angle: Array, *, trajectory: Sequence[int] | NDArray[np.int_] | None = None,
    held_out: Sequence[bool] | NDArray[np.bool_] | None = None, settings: Mapping[str, Any] | None = None, jobs: int | None = None,
    progress: Progress | None = None,
) -> Diagnosis:
    """Says which physics the simulation of commanded joints lacks, from commands and measured angles: the stage `diagnose_drives`.

    mjcf: the robot as it is simulated, a file.
    described: as drives.json: {"command_rate_hz": 50, "joints": [{"joint": "lift", "kp": 20, "kd": 0.5, "kd_on": "speed", "torque_limit_nm": 3,
        "encoder_rad": 0.0015, "noise_rad": 0.0003}, ...]}, joints from the base outwards.
    time: shape (rows,), s.
    command, angle: shape (rows, joints), rad; an angle is measured at its time, then the command is sent, which holds until the next row.
    trajectory: a number a row, another one where a trajectory begins; without it all rows are one.
    held_out: a boolean a row: fitted to by nothing, these rows judge.
    settings: further ones of the stage, e.g. {"without": ["backlash"]}.

    Raises ValueError (DataError, SpecError) where shapes or numbers are wrong.
    """
    rows = len(time)
    commands, angles = np.asarray(command, dtype=float), np.asarray(angle, dtype=float)
    if commands.ndim != 2 or commands.shape != angles.shape or len(commands) != rows:
        raise DataError(f"command {commands.shape} and angle {angles.shape}: expected ({rows}, joints) of both")
    count = commands.shape[1]
    tells = np.zeros(rows, dtype=int) if trajectory is None else np.asarray(trajectory)
    judges = np.zeros(rows, dtype=bool) if held_out is None else np.asarray(held_out, dtype=bool)
    if len(tells) != rows or len(judges) != rows:
        raise DataError(f"trajectory {len(tells)} and held_out {len(judges)}: expected {rows}, one a row")
    names = [f"{name}{joint}_rad" for name in ("cmd", "q") for joint in range(1, count + 1)]
    lines = [",".join(["time_s", "traj", "use", *names])]
    for row in range(rows):
        numbers = [float(number) for number in (*commands[row], *angles[row])]
        use = "validate" if judges[row] else "fit"
        lines.append(",".join([repr(float(time[row])), str(tells[row]), use, *map(repr, numbers)]))
    folder = tempfile.TemporaryDirectory()
    stage = {
        "uses": "diagnose_drives",
        "with": {"robot": os.path.abspath(mjcf), "drives": "drives.json", "recording": "recording.csv", **(settings or {})},
    }
    # JSON is YAML.
    pipeline = {"calib": 1, "name": "drives", "seed": 1, "stages": [stage]}
    texts = {"recording.csv": "\n".join(lines) + "\n", "drives.json": json.dumps(dict(described)), "pipeline.yaml": json.dumps(pipeline)}
    for name, text in texts.items():
        with open(os.path.join(folder.name, name), "w", encoding="utf-8") as file:
            file.write(text)
    done = run(os.path.join(folder.name, "pipeline.yaml"), store=os.path.join(folder.name, "store"), jobs=jobs, progress=progress)
    diagnosis = done.diagnosis()
    diagnosis._folder = folder
    return diagnosis


def open_run(name: str = "HEAD", *, store: Path | None = None) -> Run:
    """A run as `calib log` names it: HEAD, HEAD~1, a tag, or an id. Raises SpecError where there is none."""
    return Run(_calib.open_run(name, store))


def effects() -> list[dict[str, Any]]:
    """The causes that calib knows: name, place, formula, size, confounded, needs and measure, as `calib effects --json` prints them."""
    causes: list[dict[str, Any]] = json.loads(_calib.effects())
    return causes


def main() -> None:
    """The command `calib`."""
    # Ctrl-C ends the command at once, as it does without Python.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    sys.exit(_calib.command(sys.argv))
