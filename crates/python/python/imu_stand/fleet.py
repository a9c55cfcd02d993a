"""Many captures: a table with a row for each capture and channel, by whatever engine maps over data frames.

=================  ======================================================================================
`diagnose_frame`   a frame of readings of some captures in, a frame of one row a capture and channel out
`EMPTY`            such a frame without rows: names and types, for engines that ask for them beforehand
`causes`           how many captures of a table have each cause, and how large it is in them
`pool`             N, B and K of a table over captures: mean, interval, scatter from capture to capture
`representative`   which capture represents a table, and which ones stand out, and by what
=================  ======================================================================================

`diagnose_frame` is a function of one data frame without a state of its own, so that any engine maps it::

    dask      frame.map_partitions(diagnose_frame, by="capture", rate=20, meta=EMPTY)
    Spark     frame.groupBy("capture").applyInPandas(partial(diagnose_frame, rate=20), schema)
    Ray       data.groupby("capture").map_groups(partial(diagnose_frame, rate=20), batch_format="pandas")

A capture has to lie in one partition whole. One that cannot be diagnosed is a row that says why, so that it stops no
job. The same capture and seed give the same row, on whatever worker, in whatever order.

Units: N deg/sqrt(h), B deg/h, K deg/s/sqrt(s), angles deg, where the gyros are in deg/s or rad/s.
"""

from __future__ import annotations

import json
import math

import pandas as pd

from . import Error, analyze, diagnose

__all__ = ["EMPTY", "causes", "diagnose_frame", "pool", "representative"]

#: Columns of the table and their types.
_TYPES = {
    "capture": "object",
    "channel": "object",
    "seconds": "float64",
    "rate_hz": "float64",
    "samples": "int64",
    "verdict": "object",
    "causes": "object",
    "material": "int64",
    "findings": "object",
    "unexplained": "int64",
    "p_before": "float64",
    "p_after": "float64",
    "n": "float64",
    "n_error": "float64",
    "b": "float64",
    "b_low": "float64",
    "b_high": "float64",
    "k": "float64",
    "k_error": "float64",
    "angle_10s_deg": "float64",
    "angle_100s_deg": "float64",
    "error": "object",
}

#: A table without rows.
EMPTY = pd.DataFrame({name: pd.Series(dtype=kind) for name, kind in _TYPES.items()})

#: Figures of a row that pool over captures: the value and its standard error.
_FIGURES = {"n": "n_error", "k": "k_error"}

#: Chance that one of the captures of a table of equal ones is said to stand out.
_ODD = 0.05


def _empty_row(capture, error):
    row = {name: math.nan if kind == "float64" else 0 if kind == "int64" else "" for name, kind in _TYPES.items()}
    return {**row, "capture": capture, "error": error}


def _parameter(of: dict, name: str, key: str) -> float:
    value = (of.get(name) or {}).get(key)
    return math.nan if value is None else float(value)


def _of_channel(capture, name: str, result: dict, bias: dict) -> dict:
    """The row of a channel of a diagnosis."""
    own = [f for f in result["findings"] if name in f["channels"]]
    model = result["extended"].get(name) or result["baseline"].get(name) or {}
    held = (result.get("replicates") or {}).get(name) or {}
    chance = lambda when: math.nan if when not in held else float(held[when]["p_value"])

    def angle(span: str) -> float:
        """Angles of different causes are taken for independent; NaN where none of them is known."""
        all_of = [((f.get("consequence") or {}).get("angle_rms_deg") or {}).get(span) for f in own]
        known = [float(a) for a in all_of if a is not None]
        return math.sqrt(sum(a * a for a in known)) if known or not own else math.nan

    told = [
        {
            "cause": f["cause"],
            "parameters": (f.get("per_channel") or {}).get(name) or f["parameters"],
            "consequence": f.get("consequence"),
            "material": f.get("material"),
            "alternatives": [a["cause"] for a in f["alternatives"]],
        }
        for f in own
    ]
    about = result["input"]
    return {
        "capture": capture,
        "channel": name,
        "seconds": about["seconds"],
        "rate_hz": about["rate_hz"],
        "samples": about["samples"],
        "verdict": result["verdict"],
        "causes": ";".join(f["cause"] for f in own),
        "material": sum(f.get("material") is not False for f in own),
        "findings": json.dumps(told),
        "unexplained": sum(u["channel"] == name for u in result["unexplained"]),
        "p_before": chance("before"),
        "p_after": chance("after"),
        "n": _parameter(model, "angle_random_walk", "value"),
        "n_error": _parameter(model, "angle_random_walk", "std_error"),
        "b": _parameter(bias, "bias_instability", "value"),
        "b_low": _parameter(bias, "bias_instability", "low"),
        "b_high": _parameter(bias, "bias_instability", "high"),
        "k": _parameter(model, "rate_random_walk", "value"),
        "k_error": _parameter(model, "rate_random_walk", "std_error"),
        "angle_10s_deg": angle("10s"),
        "angle_100s_deg": angle("100s"),
        "error": "",
    }


def diagnose_frame(
    frame: pd.DataFrame, *, by: str = "capture", rate=None, columns=None, units=None, order=None, allan=True, **options
) -> pd.DataFrame:
    """Diagnose each capture of a data frame.

    Parameters
    ----------
    frame : pandas.DataFrame
        Readings, a row each, of some captures, each of them whole.
    by : str
        Column that says which capture a row is of.
    rate : float, optional
        Sample rate, Hz, where there is no time.
    columns, units
        As in `imu_stand.diagnose`.
    order : str, optional
        Column that the rows of a capture are sorted by; without it they stand as they were recorded.
    allan : bool
        Whether B is estimated too, which takes the Allan deviations of each channel.
    **options
        Of `imu_stand.diagnose`: ``seed``, ``replicates``, ``base``, ``matters``.

    Returns
    -------
    pandas.DataFrame
        A row for each capture and gyro, columns and types as `EMPTY`: ``n``, ``k`` beside the causes found; ``b`` from the
        Allan deviation, NaN where it is not established (``b_high`` is then its limit); ``findings`` as JSON; ``angle_*``
        the rms angle that the causes together make; ``material`` how many of them matter; ``error``, empty where there is none.

    Raises
    ------
    imu_stand.Error
        Where ``by`` or ``order`` is no column.
    """
    for name in (by, order):
        if name is not None and name not in frame.columns:
            raise Error(f"no column {name} in the frame; it has {', '.join(map(str, frame.columns))}\nname one of them")
    rows = []
    for capture, readings in frame.groupby(by, sort=True, observed=True):
        readings = readings if order is None else readings.sort_values(order, kind="stable")
        data = readings.drop(columns=by).reset_index(drop=True)
        given = {"rate": rate, "columns": columns, "units": units, "name": str(capture)}
        try:
            result = diagnose(data, **given, **options)
            biases = analyze(data, **given)["channels"] if allan else {}
        except Error as error:
            rows.append(_empty_row(capture, str(error)))
            continue
        for name in result["baseline"]:
            rows.append(_of_channel(capture, name, result, biases.get(name, {}).get("parameters", {})))
    table = pd.DataFrame(rows, columns=list(_TYPES))
    return table.astype(_TYPES)


def causes(table: pd.DataFrame) -> pd.DataFrame:
    """How many captures of a table have each cause.

    Parameters
    ----------
    table : pandas.DataFrame
        Of `diagnose_frame`.

    Returns
    -------
    pandas.DataFrame
        By ``channel`` and ``cause``: ``captures`` that have it, their ``share`` of those diagnosed with its 95 % interval
        (Wilson's), ``low`` and ``high``, and the median of ``angle_100s_deg`` in them.
    """
    good = table[table["error"] == ""]
    counted = good.groupby("channel").size()
    each = good.assign(cause=good["causes"].str.split(";")).explode("cause")
    each = each[each["cause"] != ""]
    of = each.groupby(["channel", "cause"]).agg(captures=("capture", "nunique"), angle_100s_deg=("angle_100s_deg", "median"))
    of = of.reset_index()
    all_of = of["channel"].map(counted).astype("float64")
    share = of["captures"] / all_of
    z = 1.959964
    middle = (share + z * z / (2 * all_of)) / (1 + z * z / all_of)
    half = z / (1 + z * z / all_of) * (share * (1 - share) / all_of + z * z / (4 * all_of**2)) ** 0.5
    of = of.assign(share=share, low=middle - half, high=middle + half)
    return of.sort_values(["channel", "captures"], ascending=[True, False], ignore_index=True)


def pool(table: pd.DataFrame, by=("channel",)) -> pd.DataFrame:
    """N and K over captures, as those of one population.

    The captures scatter by more than their errors: a random-effects mean (DerSimonian and Laird 1986, Controlled Clinical
    Trials 7: 177-188).

    Parameters
    ----------
    table : pandas.DataFrame
        Of `diagnose_frame`.
    by : sequence of str
        Columns whose values make a population each.

    Returns
    -------
    pandas.DataFrame
        By those columns and ``figure`` (``n``, ``k``): ``captures``, ``mean``, its 95 % interval ``low`` and ``high``, and
        ``scatter``, the standard deviation from capture to capture beyond the errors.
    """
    rows = []
    for key, own in table[table["error"] == ""].groupby(list(by), observed=True):
        for figure, error in _FIGURES.items():
            some = own[own[error] > 0]
            if some.empty:
                continue
            x, variance = some[figure], some[error] ** 2
            weight = 1 / variance
            fixed = (weight * x).sum() / weight.sum()
            excess = (weight * (x - fixed) ** 2).sum() - (len(x) - 1)
            scale = weight.sum() - (weight**2).sum() / weight.sum()
            between = max(excess / scale, 0.0) if scale > 0 else 0.0
            weight = 1 / (variance + between)
            mean, half = (weight * x).sum() / weight.sum(), 1.959964 / weight.sum() ** 0.5
            names = dict(zip(by, key if isinstance(key, tuple) else (key,)))
            figures = {"captures": len(x), "mean": mean, "low": mean - half, "high": mean + half}
            rows.append({**names, "figure": figure, **figures, "scatter": between**0.5})
    return pd.DataFrame(rows, columns=[*by, "figure", "captures", "mean", "low", "high", "scatter"])


def representative(table: pd.DataFrame) -> pd.DataFrame:
    """Which capture represents a table, and which ones stand out.

    Parameters
    ----------
    table : pandas.DataFrame
        Of `diagnose_frame`.

    Returns
    -------
    pandas.DataFrame
        A row a capture, nearest first: ``distance``, the largest deviation of its figures (N, K and the angle over 100 s of
        its causes, each channel) from the median over captures in robust standard deviations (1.4826 times the median
        absolute deviation, and the median error of the figure); ``by``, that figure; ``odd``, whether normal scatter makes
        one such deviation in the table with a chance below 5 %.
    """
    good = table[table["error"] == ""]
    parts = []
    for channel, own in good.groupby("channel", observed=True):
        own = own.set_index("capture")
        for figure in (*_FIGURES, "angle_100s_deg"):
            x = own[figure].astype("float64")
            centre = x.median()
            error = own[_FIGURES[figure]].median() if figure in _FIGURES else 0.0
            width = math.hypot(1.4826 * (x - centre).abs().median(), 0.0 if math.isnan(error) else error)
            if width > 0:
                parts.append(((x - centre).abs() / width).rename(f"{figure} of {channel}"))
    if not parts:
        return pd.DataFrame(columns=["capture", "distance", "by", "odd"])
    all_of = pd.concat(parts, axis=1)
    distance = all_of.max(axis=1)
    limit = _two_sided(_ODD / max(all_of.notna().to_numpy().sum(), 1))
    told = pd.DataFrame({"distance": distance, "by": all_of.idxmax(axis=1), "odd": distance > limit})
    return told.rename_axis("capture").reset_index().sort_values("distance", ignore_index=True)


def _two_sided(chance: float) -> float:
    """The normal deviate that is exceeded to either side with this chance."""
    from statistics import NormalDist

    return NormalDist().inv_cdf(1 - chance / 2)
