"""The simulation that calib exports of a diagnosis of drives, rolled out in MuJoCo itself: its residual is the one that calib states.

Cases are folders as pipelines/drives takes them: the example, recordings that are concealed for a proof (DRIVE_CONCEALED, how many, none unless
stated; DRIVE_SEED, of which seed), and those that are named in DRIVE_CASES (folders, with `:` between them).
"""

import csv
import json
import os
import pathlib
import subprocess

import numpy as np
import pytest

pytest.importorskip("mujoco")

from drives_in_mujoco import rolled_out  # noqa: E402

CALIB = os.environ.get("CALIB", "calib")
PIPELINE = pathlib.Path(__file__).resolve().parents[2] / "pipelines/drives/pipeline.yaml"
CONCEALED = int(os.environ.get("DRIVE_CONCEALED", "0"))
CASES = [PIPELINE.parent / "example", *map(pathlib.Path, filter(None, os.environ.get("DRIVE_CASES", "").split(":")))]


def calib(verb, case, store, *options):
    words = [CALIB, verb, PIPELINE, "--set", f"case={case}", "--store", store, "--quiet", *options]
    done = subprocess.run(list(map(str, words)), capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.fixture(scope="session")
def concealed(tmp_path_factory):
    """Folders of concealed recordings."""
    folder = tmp_path_factory.mktemp("concealed") / "set"
    words = [CALIB, "simulate", "conceal", "--drives", "--out", folder, "--cases", CONCEALED, "--seed", os.environ.get("DRIVE_SEED", "7")]
    done = subprocess.run(list(map(str, words)), capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return sorted((folder / "recordings").iterdir())


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_the_exported_mjcf_has_the_residual_that_calib_states(case, tmp_path):
    is_carried(case, tmp_path)


@pytest.mark.parametrize("number", range(CONCEALED))
def test_the_exported_mjcf_of_a_concealed_recording_has_the_residual_that_calib_states(number, concealed, tmp_path):
    is_carried(concealed[number], tmp_path)


def is_carried(case, tmp_path):
    """The residual in MuJoCo is within 5 % of the stated one: with the Python of the model, and of the model alone, but for what its head
    says that it does not carry."""
    document = json.loads(calib("diagnose", case, tmp_path / "store", "--json"))
    text, control = (calib("export", case, tmp_path / "store", "--format", name) for name in ("mjcf", "mjcf_control"))
    drives = json.loads((case / "drives.json").read_text())
    with open(case / "recording.csv") as file:
        rows = list(csv.DictReader(file))
    index = range(1, len(drives["joints"]) + 1)
    trajectories, judges = [], []
    for trajectory in dict.fromkeys(row["traj"] for row in rows):
        own = [row for row in rows if row["traj"] == trajectory]
        column = lambda name: np.array([[float(row[name.format(j)]) for j in index] for row in own])
        trajectories.append((np.array([float(row["time_s"]) for row in own]), column("cmd{}_rad"), column("q{}_rad")))
        judges.append(own[0]["use"] != "fit")
    stated = document["after"]["validate_rms_mrad"]
    left_out = [line for line in text.splitlines() if "not carried:" in line]
    ratios = []
    for python in (None, control):
        simulated = rolled_out(text, drives, trajectories, python)
        errors = [(measured - angles).ravel() for (_, _, measured), angles, is_judge in zip(trajectories, simulated, judges) if is_judge]
        ratios.append(1e3 * float(np.sqrt(np.mean(np.concatenate(errors) ** 2))) / stated)
    found = [f"{finding['effect']} at {finding['where']}" for finding in document["findings"]]
    print(f"{case.name}: stated {stated:.4f} mrad, in MuJoCo {ratios[0]:.4f} of it, with the Python {ratios[1]:.4f}; {found}; {left_out}")
    assert abs(ratios[1] - 1) < 0.05
    if not left_out:
        assert abs(ratios[0] - 1) < 0.05


def test_isaac_settings_have_every_joint_and_the_delay_in_steps(tmp_path):
    text = calib("export", CASES[0], tmp_path / "store", "--format", "isaac")
    document = json.loads(calib("export", CASES[0], tmp_path / "store", "--format", "json"))
    delay = document["simulation"]["joint 2"]["command_delay"]["value"]
    assert f"min_delay: {round(delay / 0.005)}" in text
    for name in ["pan", "lift", "elbow"]:
        assert f'"{name}":\n    joint_names_expr: ["{name}"]\n    effort_limit: 4.0\n' in text
    assert document["simulation"]["joint 2"]["friction"]["value"] > 0.25
