"""What users give, as the engine takes it."""

from __future__ import annotations

import functools
import os
import re
from collections.abc import Mapping

import numpy as np

from . import _engine

AXES = ("gyro_x", "gyro_y", "gyro_z")
# An option of the program with its value, in a message of the engine: a text in quotes, pairs or a list, a number or the
# name of one; other words go on with the sentence.
VALUE = r"'[^']*'|\"[^\"]*\"|[^\s`,;:)=]+=[^\s`;:)]+|[^\s`,;:)]+,[^\s`;:)]+|[A-Z]+\b|[0-9.]+\b"
OPTION = re.compile(rf"--([a-z]+(?:-[a-z]+)*)(?:[ =]({VALUE}))?")
# A part of a record, which is an argument of `read`: arrays are cut by their slices.
SPAN = re.compile(r"`--span ([0-9.]*),([0-9.]*)`")
# Those that are arguments here as well.
ARGUMENTS = {
    "columns",
    "units",
    "rate",
    "skip-bad",
    "topic",
    "channel",
    "channels",
    "deviations",
    "taus",
    "want",
    "separate",
    "check",
    "seconds",
}


HELP = "help(imu_stand.analyze), help(imu_stand.diagnose) and so on list the arguments"


def in_python(message: str) -> str:
    """A message of the engine with its options as arguments of Python."""

    def argument(found: re.Match) -> str:
        option, value = found[1], found[2]
        if option not in ARGUMENTS:
            return found[0]
        if option == "skip-bad":
            return "skip_bad=True" + (f" {value}" if value else "")
        if value is None:
            return f"`{option}`" if found.string[max(found.start() - 1, 0)] != "`" else option
        if option in ("rate", "check", "seconds") or value[0] in "'\"":
            return f"{option}={value}"
        return f'{option}="{value}"'

    def part(found: re.Match) -> str:
        return f"`span=({found[1] or None}, {found[2] or None})`"

    message = SPAN.sub(part, OPTION.sub(argument, message))
    return message.replace("`--help` after the command lists its options, with an example", HELP)


def saying(function):
    """Has errors of the engine speak of arguments."""

    @functools.wraps(function)
    def wrapped(*args, **kwargs):
        try:
            return function(*args, **kwargs)
        except _engine.Error as error:
            raise _engine.Error(in_python(str(error))) from None

    return wrapped


def pairs(mapping) -> list[tuple[str, str]]:
    """Pairs of a dict, or of a text like ``a=b,c=d``."""
    if mapping is None:
        return []
    if isinstance(mapping, Mapping):
        return [(str(ours), str(theirs)) for ours, theirs in mapping.items()]
    if not isinstance(mapping, str):
        raise TypeError(f"columns and units are dicts or texts, not {type(mapping).__name__}")
    items = [item.partition("=") for item in mapping.split(",")]
    if not all(ours.strip() and equals and theirs.strip() for ours, equals, theirs in items):
        raise _engine.Error(f"`{mapping}` is no list of `ours=theirs`\nwrite gyro_x=gx,gyro_y=gy, or give a dict")
    return [(ours.strip(), theirs.strip()) for ours, _, theirs in items]


class Capture(Mapping):
    """A record: arrays of shape ``(n,)`` by channel, in the units of `units`; NaN where a sample was lost.

    ``time`` is in s, where the record has times. The arrays cannot be written to: what is analyzed is the record itself,
    with its counts, flags and sequence numbers. ``dict(capture)`` and ``pandas.DataFrame(dict(capture))`` are copies to
    work on.
    """

    def __init__(self, engine):
        self._engine = engine
        self._arrays: dict[str, np.ndarray] = {}
        self.units: dict[str, str] = {}
        times = engine.times()
        if times is not None:
            self._add("time", "s", times)
        for name, unit, values in engine.channels():
            self._add(name, unit, values)

    def _add(self, name, unit, values):
        self._arrays[name] = np.frombuffer(values)
        self.units[name] = unit

    def __getitem__(self, name):
        return self._arrays[name]

    def __iter__(self):
        return iter(self._arrays)

    def __len__(self):
        return len(self._arrays)

    def __repr__(self):
        n = len(next(iter(self._arrays.values()), ()))
        return f"Capture of {n} samples: {', '.join(f'{name} in {unit}' for name, unit in self.units.items())}"

    @property
    def header(self) -> dict[str, str]:
        """The ``# key: value`` lines of the capture."""
        return dict(self._engine.header())

    @property
    def notes(self) -> list[str]:
        """What was put in order, left out or missing."""
        return [in_python(note) for note in self._engine.notes()]

    def to_csv(self, path) -> None:
        """Write it as a capture of the program, ``.csv`` or ``.csv.gz``."""
        self._engine.write(os.fspath(path))


def column(name: str, values) -> np.ndarray:
    """A column as an array of numbers; dates become seconds since the first."""
    try:
        array = np.asarray(values)
        if array.dtype.kind == "M":
            array = (array - array[:1]) / np.timedelta64(1, "s")
        elif array.dtype.kind == "m":
            array = array / np.timedelta64(1, "s")
        elif array.dtype.kind == "c":
            raise TypeError("complex")
        array = np.ascontiguousarray(array, dtype=np.float64)
    except (TypeError, ValueError):
        raise _engine.Error(f"column `{name}` does not hold real numbers\nleave it out, or convert it") from None
    if array.ndim != 1:
        raise _engine.Error(f"column `{name}` has the shape {array.shape}\ngive one number a sample: shape (n,)")
    return array


def is_table(data) -> bool:
    """Whether it has named columns, as a data frame of pandas or polars and an Arrow table have."""
    return hasattr(data, "columns") and hasattr(data, "__getitem__")


def named(data) -> dict[str, np.ndarray]:
    """Columns of a dict or a data frame."""
    if isinstance(data, Mapping):
        return {str(name): column(str(name), values) for name, values in data.items()}
    names = getattr(data, "column_names", None)
    names = list(data.columns) if names is None else list(names)
    columns = {}
    for name in names:
        values = data[name]
        if len(getattr(values, "shape", (0,))) > 1:
            raise _engine.Error(f"two columns are called `{name}`\nrename one of them")
        array = np.asarray(values)
        # Text beside the numbers is not asked for; the engine tells of what it needs and does not find.
        if array.dtype.kind in "OUS":
            try:
                array = array.astype(np.float64)
            except (TypeError, ValueError):
                continue
        columns[str(name)] = column(str(name), array)
    index = getattr(data, "index", None)
    if index is not None and "time" not in columns and getattr(index, "dtype", None) is not None:
        dates = np.asarray(index)
        if dates.dtype.kind in "mM":
            columns = {"time": column("index", dates), **columns}
    return columns


def listed(data) -> dict[str, np.ndarray]:
    """Columns of an array: a gyro, or three."""
    array = np.asarray(data)
    if array.dtype.names:
        return {name: column(name, array[name]) for name in array.dtype.names}
    if array.ndim == 1:
        return {AXES[0]: column(AXES[0], array)}
    if array.ndim == 2 and array.shape[1] in (1, 3):
        return {name: column(name, array[:, k]) for k, name in enumerate(AXES[: array.shape[1]])}
    raise _engine.Error(
        f"an array of the shape {array.shape} does not say what is what\n"
        "give shape (n,) for one gyro, (n, 3) for gyro x, y, z, or a dict: {'gyro_x': ..., 'temp': ...}"
    )


def read_file(path, columns, units, rate, skip_bad=False, topic=None, span=None):
    """The record in a file."""
    # Who cannot open it says so with its name.
    with open(path, "rb"):
        pass
    return _engine.read(os.fspath(path), pairs(columns), pairs(units), rate, skip_bad, topic, ends(span))


def ends(span):
    """The two ends of a part of a record, s."""
    if span is None:
        return None
    first, last = span
    return (0.0 if first is None else float(first), np.inf if last is None else float(last))


def given(data, rate, columns, units, name, base=None):
    """The record of what a user gives."""
    if isinstance(data, Capture):
        if any(option is not None for option in (rate, columns, units, base)):
            raise _engine.Error("a Capture says its rate, columns and units itself\ngive them to `read`, or leave them out")
        return data._engine
    if isinstance(data, (str, os.PathLike)):
        if base is not None:
            raise _engine.Error("base: of a file its header says it\nadd a line `# base: turntable` before the column names")
        return read_file(data, columns, units, rate)
    if isinstance(data, Mapping) or is_table(data):
        arrays = named(data)
    else:
        arrays = listed(data)
    about = [] if base is None else [("base", base)]
    bytes_of = [(column_name, values.tobytes()) for column_name, values in arrays.items()]
    rate = None if rate is None else float(rate)
    if rate is not None and not (rate > 0 and np.isfinite(rate)):
        raise _engine.Error("rate: it has to be a number above 0, in Hz")
    return _engine.from_columns(bytes_of, about, pairs(columns), pairs(units), rate, name)


def model_text(model):
    """Text and name of a model file."""
    if model is None:
        return None
    text = getattr(model, "model", model)
    if isinstance(text, str) and "\n" in text:
        return text, "the model"
    with open(text, encoding="utf-8") as file:
        return file.read(), os.path.basename(os.fspath(text))
