# What the package is made of; what is documented and meant for use is in the package itself.
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
__version__: str

class SpecError(ValueError):
    """What was asked for is wrong (exit code 2 of the command line): every fault a line, with its place."""

class DataError(ValueError):
    """The measurements cannot be used (exit code 10): every fault a line, with its place."""

class StoreError(OSError):
    """The disk or the store refused (exit code 75): later may work."""

class Frame:
    kind: str
    columns: list[str]
    rows: int
    def column(self, name: str) -> list[Any] | None: ...
    def schema_capsule(self) -> object: ...
    def stream_capsule(self) -> object: ...

class Outcome:
    document: str | None
    text: str | None
    page: str | None
    model: Model
    notes: list[str]
    warnings: list[str]
    tables: list[tuple[str, Frame]]

class Model:
    parameters: Frame
    origin: str
    warnings: list[str]
    def predict(self, joints: Array, columns: dict[str, Any]) -> Array: ...
    def compensate(self, joints: Array, columns: dict[str, Any], force: bool) -> tuple[list[Array], list[str]]: ...

class Robot:
    name: str
    joints: list[str]
    notes: list[str]
    limits: Array
    @staticmethod
    def from_file(path: Any) -> Robot: ...
    @staticmethod
    def from_text(label: str, text: str) -> Robot: ...
    @staticmethod
    def from_urdf(path: Any, tip: str) -> Robot: ...
    @staticmethod
    def library(name: str) -> Robot: ...
    def stage(
        self, uses: str, joints: Array, points: Array, sigma: Any, held_out: list[bool] | None, columns: dict[str, Any], settings: str, seed: int,
        progress: Any,
    ) -> Outcome: ...
    def poses(self, request: str, pair: list[str], limits: Array | None) -> tuple[list[Array], str, str]: ...

class Run:
    manifest: str
    tables: list[str]
    def table(self, name: str) -> Frame: ...
    def model(self, step: str | None) -> Model: ...
    def diagnosis(self, step: str | None) -> tuple[str, str, str, str | None]: ...

def run(pipeline: Any, overrides: list[str], store: Any, jobs: int | None, progress: Any) -> Run: ...
def open_run(name: str, store: Any) -> Run: ...
def robots() -> list[str]:
    """Names of the arms of the library, for `Robot.library`."""

def effects() -> str: ...
def command(arguments: list[str]) -> int: ...
