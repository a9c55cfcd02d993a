"""Results: dictionaries that show themselves."""

from __future__ import annotations

import json
from html import escape

import numpy as np

from . import _engine
from ._given import in_python


def loaded(kind, text: str):
    """A result of the engine's JSON."""
    return kind(json.loads(text))


def number(value, digits: int = 4) -> str:
    """A number for a table."""
    return "-" if value is None else f"{value:.{digits}g}"


def interval(of: dict) -> str:
    """A value with its interval and unit, or the upper limit."""
    unit = of.get("unit", "")
    if of.get("value") is not None:
        return f"{number(of['value'])} ({number(of.get('low'))} to {number(of.get('high'))}) {unit}"
    if of.get("high") is not None:
        return f"not established; at most {number(of['high'])} {unit}"
    return "nothing known"


def table(heads, rows) -> str:
    """A table of HTML; every cell is text."""
    line = lambda cells, tag: "<tr>" + "".join(f"<{tag}>{escape(str(c))}</{tag}>" for c in cells) + "</tr>"
    return "<table>" + line(heads, "th") + "".join(line(row, "td") for row in rows) + "</table>"


def head(what: str, of: dict) -> str:
    """The line over a result."""
    return (
        f"<p><b>{escape(what)}</b> {escape(str(of.get('file', '')))}: {number(of.get('seconds'), 6)} s at "
        f"{number(of.get('rate_hz'), 6)} Hz, {of.get('samples')} samples</p>"
    )


class Analysis(dict):
    """An analysis, ``imu-stand-analysis/1``."""

    def curve(self, channel: str, deviation: str = "oadev") -> dict[str, np.ndarray]:
        """A deviation as arrays of shape ``(k,)``: ``tau_s`` in s; ``deviation``, ``low``, ``high`` in the channel's unit
        (of ``tdev`` times s); ``edf``; ``n``."""
        points = self["channels"][channel]["deviations"][deviation]
        return {key: np.array([p[key] for p in points]) for key in ("tau_s", "deviation", "low", "high", "edf", "n")}

    def _rows(self) -> list:
        """Channel, letter and interval of every parameter."""
        letters = {
            "angle_random_walk": "N",
            "bias_instability": "B",
            "rate_random_walk": "K",
            "rate_ramp": "R",
            "quantization_noise": "Q",
        }
        rows = []
        for name, channel in self["channels"].items():
            fits = channel.get("parameters_hold_from_s") is not None
            for key, letter in letters.items():
                rows.append((name, letter, interval(channel["parameters"][key]) + ("" if fits else " ?")))
        return rows

    def _notes(self) -> list:
        """What a reader of the parameters has to know, in arguments of Python."""
        notes = self["input"].get("notes", []) + [
            f"{name}: {warning}" for name, channel in self["channels"].items() for warning in channel["warnings"]
        ]
        doubt = any(c.get("parameters_hold_from_s") is None for c in self["channels"].values())
        if doubt:
            notes = ["?: the terms do not describe this channel; `diagnose` says what is in it", *notes]
        return [in_python(note) for note in notes]

    def __str__(self) -> str:
        of = self["input"]
        lines = [f"{of['file']}: {number(of['seconds'], 6)} s at {number(of['rate_hz'], 6)} Hz, {of['samples']} samples"]
        lines += [f"    {name}  {letter} {size}" for name, letter, size in self._rows()]
        return "\n".join(lines + self._notes())

    def _repr_html_(self) -> str:
        return (
            head("Analysis of", self["input"])
            + table(("channel", "", "95 %"), self._rows())
            + "".join(f"<p>{escape(note)}</p>" for note in self._notes())
        )


class Diagnosis(dict):
    """A diagnosis, ``imu-stand-diagnosis/1``.

    ``str()`` of it is what the program prints. It can be pickled and sent between processes; the report is then left
    behind, and `text` and `model` come along.
    """

    text: str = ""
    model: str = ""
    _engine = None

    def _keep(self, engine):
        self._engine = engine
        self.text = engine.text()
        self.model = engine.model()

    def __reduce__(self):
        return (type(self), (dict(self),), {"text": self.text, "model": self.model})

    def __str__(self) -> str:
        return in_python(self.text) or super().__str__()

    def report_html(self) -> str:
        """The report as ``imu-stand diagnose --report`` writes it: one page of HTML, complete in itself. It takes some
        seconds, for it simulates both models 199 times."""
        if self._engine is None:
            raise _engine.Error(
                "this diagnosis came from a file or another process, without its record\n"
                "make the report where `diagnose` was called"
            )
        return self._engine.report()

    def _sentence(self) -> str:
        """The verdict in a sentence, as the program prints it; its word alone where that is not known."""
        _, found, rest = self.text.partition("verdict  ")
        return " ".join(rest.split("\n\n")[0].split()) if found else self["verdict"]

    def _repr_html_(self) -> str:
        rows = []
        for finding in self["findings"]:
            sizes = [
                f"{name.replace('_', ' ')} {number(p['value'])}"
                + (f" ± {number(1.96 * p['std_error'], 2)}" if p.get("std_error") else "")
                + f" {p['unit'] if p['unit'] != '1' else ''}"
                for name, p in finding["parameters"].items()
            ]
            does = finding.get("consequence") or {}
            cost = [(does.get(key, {}), unit) for key, unit in (("angle_rms_deg", "deg"), ("velocity_rms_mps", "m/s"))]
            rows.append(
                (
                    finding["cause"],
                    ", ".join(finding["channels"]),
                    "; ".join(sizes),
                    ", ".join(f"{number(value, 2)} {unit} after {horizon}" for by, unit in cost for horizon, value in by.items())
                    + ("" if finding.get("material", True) else " (too small to matter)"),
                    " or ".join(a["cause"] for a in finding["alternatives"]) or "-",
                )
            )
        left = [f"{entry['channel']}: {entry['what']}" for entry in self["unexplained"]]
        return (
            head(f"Diagnosis: {self._sentence()}.", self["input"])
            + (table(("cause", "channels", "size, 95 %", "angle or velocity error", "may also be"), rows) if rows else "<p>No cause.</p>")
            + "".join(f"<p>No name for: {escape(entry)}</p>" for entry in left)
        )


class Plan(dict):
    """A plan, ``imu-stand-plan/1``."""

    def _repr_html_(self) -> str:
        rows = [
            (f"{w['term']} within {number(w['within_percent'])} %", f"record {number(w['seconds'])} s")
            for w in self["want"]
        ]
        for angle in self["angle"]:
            wish = f"angle within {number(angle['within_deg'])} deg after {number(angle['after_s'])} s"
            still = angle["calibration_s"]
            best = f"no calibration does it; the best, {number(angle['best_calibration_s'])} s, gives {number(angle['best_within_deg'])} deg"
            rows.append((wish, best if still is None else f"stand still for {number(still)} s first"))
        for told in self["separate"]:
            sizes = [f"{number(apart)} at {number(seconds)} s" for seconds, _, apart in told["sizes"] if apart is not None]
            rows.append((f"{told['cause']} against {told['rival']}: {told['excitation']}", "; ".join(sizes) or told["why"]))
        return f"<p><b>Plan</b> from {escape(self['noise']['from'])}</p>" + table(("wish", "answer, 95 %"), rows)
