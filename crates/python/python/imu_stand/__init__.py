"""Allan deviations with intervals, and what a simulation of an inertial sensor gets wrong.

The engine of the program ``imu-stand``: ``numpy`` in, dictionaries out, with the keys of the JSON that the program
writes. What computes releases the interpreter's lock, so that threads run side by side.

=============  ==========================================================================================
`analyze`      Allan deviations with 95 % intervals, and N, B, K, R, Q
`diagnose`     what white noise, random walk and a constant bias get wrong; causes with sizes; a better model
`plan`         how long to record for an answer
`simulate`     a record from a model file
`read`         a capture or a log, as the program reads it
=============  ==========================================================================================

Units: rates in deg/s, accelerations in m/s^2, temperatures in degC, voltages in V, times in s, unless ``units`` says
otherwise of what is given. Results say their units.
"""

from __future__ import annotations

import warnings

from . import _engine
from ._engine import Error, __version__
from ._given import Capture, given, model_text, read_file, saying
from ._results import Analysis, Diagnosis, Plan, loaded

__all__ = [
    "Analysis",
    "Capture",
    "Diagnosis",
    "Error",
    "Plan",
    "__version__",
    "analyze",
    "diagnose",
    "plan",
    "read",
    "simulate",
]


@saying
def read(path, *, columns=None, units=None, rate=None, skip_bad=False, topic=None, span=None) -> Capture:
    """Read a capture (``.csv``, ``.csv.gz``), any other table of text, or a log (MCAP, ROS 1 bag, ULog).

    Parquet, HDF5, ``.mat`` and NPZ are the business of pandas, h5py, scipy and numpy: give `diagnose` what they read.

    Parameters
    ----------
    path : str or path-like
        The file.
    columns : dict or str, optional
        Which column is what, ours to theirs: ``{"time": "t", "gyro_x": "gx"}``, or the text of ``--columns``.
    units : dict or str, optional
        Units of quantities or channels: ``{"gyro": "rad/s", "time": "ms"}``, or the text of ``--units``.
    rate : float, optional
        Sample rate, Hz, where the rows have no times.
    skip_bad : bool
        Leave out rows that cannot be read, and count them in `Capture.notes`.
    topic : str, optional
        Which topic of a log that has several IMUs.
    span : tuple of two floats, optional
        A part of the record alone, from one time to another, s from its first row; None leaves an end out.

    Raises
    ------
    Error
        Where it cannot be read: says what was found and what to do.
    """
    return Capture(read_file(path, columns, units, rate, skip_bad, topic, span))


@saying
def analyze(
    data,
    rate=None,
    *,
    deviations=("oadev",),
    taus="octave",
    channels=None,
    columns=None,
    units=None,
    seed=0,
    name="array",
) -> Analysis:
    """Allan deviations with 95 % intervals, and the noise parameters of IEEE Std 952.

    Parameters
    ----------
    data : array, dict of arrays, DataFrame, `Capture` or path
        An array of shape ``(n,)`` is one gyro, ``(n, 3)`` three of them, x, y, z, in deg/s. A dict or a data frame has
        names: ``time``, ``gyro_x``, ``acc_x``, ``temp`` ..., or others that ``columns`` maps. NaN is a lost sample.
    rate : float, optional
        Sample rate, Hz. Needed where there is no time.
    deviations : sequence of str
        Of ``oadev``, ``adev``, ``mdev``, ``tdev``, ``hdev``, ``ohdev``, ``totdev``, ``mtotdev``, ``theo1``, ...
    taus : str
        Cluster times: ``octave``, ``decade``, ``all`` or ``log:N``.
    channels : sequence of str, optional
        Only these.
    columns, units
        As in `read`: ``units={"gyro": "rad/s"}``.
    seed : int
        Of the replicates behind intervals.
    name : str
        What the result calls the data, under ``input.file``.

    Returns
    -------
    Analysis
        A dict, ``imu-stand-analysis/1``: ``result["channels"]["gyro_x"]["deviations"]["oadev"]`` is a list of
        ``{"tau_s", "deviation", "low", "high", "edf", "n"}``; ``["parameters"]["angle_random_walk"]`` has ``value``,
        ``std_error``, ``low``, ``high``, ``unit``; ``value`` is ``None`` where it is not established, and ``high`` then
        its upper limit. `Analysis.curve` has a deviation as arrays.

    Raises
    ------
    Error
        Too few samples, no rate, no such channel: says what to do.
    """
    capture = given(data, rate, columns, units, name)
    names = None if channels is None else [str(channel) for channel in channels]
    asked = [deviations] if isinstance(deviations, str) else [str(d) for d in deviations]
    return loaded(Analysis, _engine.analyze(capture, asked, taus, names, seed))


@saying
def diagnose(
    data,
    rate=None,
    *,
    columns=None,
    units=None,
    base=None,
    channels=None,
    seed=0,
    replicates=_engine.REPLICATES,
    matters=100 * _engine.MATTERS,
    name="array",
) -> Diagnosis:
    """What a simulation by white noise, random walk and a constant bias gets wrong, why, and by how much.

    Parameters
    ----------
    data : array, dict of arrays, DataFrame, `Capture` or path
        As in `analyze`. The more of temperature, supply, motor command and acceleration there is, the more causes can be
        told apart.
    rate : float, optional
        Sample rate, Hz. Needed where there is no time.
    columns, units
        As in `read`.
    base : {"static", "moving", "turntable"}, optional
        What the base under the sensor did.
    channels : sequence of str, optional
        Only these, accelerometers at rest too: ``["gyro_x", "acc_x"]``. Without it all gyros.
    seed : int
        Of whatever is random.
    replicates : int
        Simulations of each model that the record is compared with; 0 for none, else 19 at least.
    matters : float
        Change of an angle or a deviation, per cent, from which on a cause is ``material``.
    name : str
        What the result calls the data, under ``input.file``.

    Returns
    -------
    Diagnosis
        A dict, ``imu-stand-diagnosis/1``: ``verdict``, ``findings`` (``cause``, ``channels``, ``parameters`` with unit and
        standard error, ``gain``, ``consequence``), ``unexplained``, ``checks``, ``not_tested``. ``str()`` of it is what the
        program prints, `Diagnosis.model` the extended model, `Diagnosis.report_html` the report.

    Raises
    ------
    Error
        Too few samples, no rate, no gyro: says what to do.
    """
    if replicates and replicates < 19:
        raise Error("replicates: a chance of 5 % takes 19 of them at least\nreplicates=0 for none")
    if not matters > 0:
        raise Error("matters: it has to be above 0, in per cent")
    capture = given(data, rate, columns, units, name, base)
    named = None if channels is None else [str(name) for name in channels]
    engine = _engine.diagnose(capture, named, seed, replicates, matters / 100)
    result = loaded(Diagnosis, engine.json())
    result._keep(engine)
    return result


@saying
def plan(
    want=None,
    *,
    separate=None,
    data=None,
    rate=None,
    model=None,
    channel=None,
    check=None,
    seed=0,
    name="array",
) -> Plan:
    """How long to record for an answer that is missing.

    Parameters
    ----------
    want : str, optional
        ``"K within 20 %"`` (of N, B, K, Q, R; 95 %) or ``"angle within 2 deg after 600 s"``, several by commas.
    separate : str or pair of str, optional
        Two causes to be told apart: ``("temperature", "rate_ramp")``.
    data : optional
        A record whose noise is the present knowledge, as in `analyze`; without it and without ``model`` the paper's stand.
    rate : float, optional
        Sample rate, Hz: of ``data`` without times, or of the record that is planned.
    model : str, path or `Diagnosis`, optional
        A model file, its text, or the diagnosis whose model it is.
    channel : str, optional
        The gyro, where there are several.
    check : int, optional
        Simulated records that each promise is checked by; 0 for none.
    seed : int
        Of the check.

    Returns
    -------
    Plan
        A dict, ``imu-stand-plan/1``: ``want`` (``term``, ``seconds``, ``checked_share`` ...), ``angle``, ``separate``.
    """
    if data is not None and model is not None:
        raise Error("plan: `data` and `model` are both given\ngive the one whose noise is to be planned with")
    causes = separate if separate is None or isinstance(separate, str) else ",".join(separate)
    capture = None if data is None else given(data, rate, None, None, name)
    wanted = {
        "want": want,
        "separate": causes,
        "channel": channel,
        "rate_hz": rate,
        "check": check,
        "seed": seed,
    }
    return loaded(Plan, _engine.plan(capture, model_text(model), wanted))


@saying
def simulate(model=None, seconds=600.0, rate=None, seed=1) -> Capture:
    """A record straight from a model file: the same seed gives the same record.

    Parameters
    ----------
    model : str, path or `Diagnosis`, optional
        A model file, its text, or the diagnosis whose model it is; without it the paper's stand.
    seconds : float
        Length, s.
    rate : float, optional
        Sample rate, Hz; without it the model's.
    seed : int
        Of the noise.

    Returns
    -------
    Capture
        Arrays of shape ``(n,)`` by channel, and ``time`` in s.
    """
    capture, said = _engine.simulate(model_text(model), float(seconds), rate, seed)
    for warning in said:
        warnings.warn(warning, stacklevel=3)
    return Capture(capture)
