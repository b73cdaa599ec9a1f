"""A recording of the repository as arrays: pipelines/case/example, whose truth.json says what it hides."""

import csv
from pathlib import Path

import numpy as np

REPOSITORY = Path(__file__).resolve().parents[2]
EXAMPLE = REPOSITORY / "pipelines" / "case" / "example"


def rows(path: Path) -> list[dict[str, str]]:
    with path.open() as file:
        return list(csv.DictReader(file))


def recording(case: str) -> tuple[np.ndarray, np.ndarray, np.ndarray, dict[str, np.ndarray]]:
    """Joints (rad), points (mm), which rows are held out, and the circumstances of a recording."""
    measured = {row["point_id"]: row for row in rows(EXAMPLE / case / "tracker.csv")}
    both = [row | {"measured": measured[row["point_id"]]} for row in rows(EXAMPLE / case / "controller.csv") if row["point_id"] in measured]
    joints = np.radians([[float(row[f"q{j}_deg"]) for j in range(1, 7)] for row in both])
    points = np.array([[float(row["measured"][axis]) for axis in ("x_mm", "y_mm", "z_mm")] for row in both])
    known = [name for name in ("payload_kg", "time_s", "temp_c") if name in both[0]]
    columns = {name: np.array([float(row[name]) for row in both]) for name in known}
    return joints, points, np.array([row["use"] != "fit" for row in both]), columns
