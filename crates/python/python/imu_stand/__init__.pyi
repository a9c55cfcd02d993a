from collections.abc import Iterator, Mapping, Sequence
from os import PathLike
from typing import Any, Literal, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

__version__: str
__all__: list[str]

# An array (n,) or (n, 3), a dict or data frame of columns (n,), a record, or a file.
Data = Union[ArrayLike, Mapping[str, ArrayLike], "Capture", str, PathLike[str], Any]
Pairs = Union[Mapping[str, str], str, None]
Model = Union[str, PathLike[str], "Diagnosis", None]

class Error(ValueError): ...

class Capture(Mapping[str, NDArray[np.float64]]):
    units: dict[str, str]
    def __getitem__(self, name: str) -> NDArray[np.float64]: ...
    def __iter__(self) -> Iterator[str]: ...
    def __len__(self) -> int: ...
    @property
    def header(self) -> dict[str, str]: ...
    @property
    def notes(self) -> list[str]: ...
    def to_csv(self, path: Union[str, PathLike[str]]) -> None: ...

class Analysis(dict[str, Any]):
    def curve(self, channel: str, deviation: str = "oadev") -> dict[str, NDArray[np.float64]]: ...
    def _repr_html_(self) -> str: ...

class Diagnosis(dict[str, Any]):
    text: str
    model: str
    def report_html(self) -> str: ...
    def _repr_html_(self) -> str: ...

class Plan(dict[str, Any]):
    def _repr_html_(self) -> str: ...

def read(
    path: Union[str, PathLike[str]],
    *,
    columns: Pairs = None,
    units: Pairs = None,
    rate: Union[float, None] = None,
    skip_bad: bool = False,
    topic: Union[str, None] = None,
    span: Union[tuple[Union[float, None], Union[float, None]], None] = None,
) -> Capture: ...
def analyze(
    data: Data,
    rate: Union[float, None] = None,
    *,
    deviations: Union[str, Sequence[str]] = ("oadev",),
    taus: str = "octave",
    channels: Union[Sequence[str], None] = None,
    columns: Pairs = None,
    units: Pairs = None,
    seed: int = 0,
    name: str = "array",
) -> Analysis: ...
def diagnose(
    data: Data,
    rate: Union[float, None] = None,
    *,
    columns: Pairs = None,
    units: Pairs = None,
    base: Union[Literal["static", "moving", "turntable"], None] = None,
    channels: Union[Sequence[str], None] = None,
    seed: int = 0,
    replicates: int = ...,
    matters: float = ...,
    name: str = "array",
) -> Diagnosis: ...
def plan(
    want: Union[str, None] = None,
    *,
    separate: Union[str, Sequence[str], None] = None,
    data: Union[Data, None] = None,
    rate: Union[float, None] = None,
    model: Model = None,
    channel: Union[str, None] = None,
    check: Union[int, None] = None,
    seed: int = 0,
    name: str = "array",
) -> Plan: ...
def simulate(
    model: Model = None,
    seconds: float = 600.0,
    rate: Union[float, None] = None,
    seed: int = 1,
) -> Capture: ...
