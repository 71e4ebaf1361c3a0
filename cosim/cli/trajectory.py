"""``cosim export --trajectory``: the trajectory behind a recording, smoothed from odometer and balises."""

from __future__ import annotations

import argparse
from dataclasses import asdict
from pathlib import Path

import numpy as np

from cosim.balises.recorded import read_layout
from cosim.errors import CosimError, ScenarioError, nearest
from cosim.evaluation.reference_trajectory import (
    GATE,
    JERK,
    SCALE,
    SIGNALS,
    SLIP,
    ReferenceTrajectory,
    reference_trajectory,
    sampled_rows,
)
from cosim.results.load_result import load_result
from cosim.results.result import Result, SignalInfo
from cosim.results.save import save_result
from fmus.cli.commands import Argument, ArgumentGroup, argument
from fmus.cli.output import Output
from fmus.tables.numbers import number

BALISE = 0.5  # standard deviation of a balise's position where no accuracy was stated [m]
ACCURACY = 0.5  # of the stated location accuracy, a bound, is taken for a standard deviation

TRAJECTORY = ArgumentGroup(
    (
        argument("--trajectory", action="store_true", help="write it: position and speed with standard deviations"),
        argument("--odometer", metavar="NAME", help="signal of the odometer (default: that of the report)"),
        argument("--telegrams", metavar="FILE", help="results folder or events.csv (default: those of SOURCE)"),
        argument("--odometer-std", type=float, default=0.1, metavar="M_S", help="noise of a reading [m/s]"),
        argument("--balise-std", type=float, metavar="M", help="of a balise [m] (default: half its accuracy)"),
        argument("--jerk-density", type=float, default=JERK, metavar="Q", help="of the train [m2/s5]"),
        argument("--scale-std", type=float, default=SCALE, metavar="S", help="of the wheel radius, relative [1]"),
        argument("--gate", type=float, default=GATE, help="standard deviations beyond which a reading is slip"),
        argument("--slip", type=float, default=SLIP, metavar="M_S", help="the same as a speed [m/s]"),
    ),
    "the trajectory behind a recording",
    "odometer and balises, smoothed forwards and backwards: for a report that has no truth of its own",
)


def idle_words(options: argparse.Namespace) -> list[str]:
    """The flags of `TRAJECTORY` that are stated although no trajectory is asked for.

    Args:
        options: of the command line.
    """
    others = [a for a in TRAJECTORY.arguments if isinstance(a, Argument) and a.names != ("--trajectory",)]
    stated = {a.names[0]: getattr(options, a.names[0].lstrip("-").replace("-", "_")) for a in others}
    return [a.names[0] for a in others if stated[a.names[0]] != a.keywords.get("default")]


def export_trajectory(options: argparse.Namespace) -> Output:
    """Read, smooth, write, and report how well the noises fit.

    Args:
        options: of the command line.

    Raises:
        CosimError: there is no odometer or no balise, or the file cannot be written.
    """
    result = load_result(options.scenario)
    name = _odometer(result, options.odometer)
    found = _smoothed(options, result, name)
    written = save_result(_as_result(found), options.target)
    data = {"odometer": name, "balises": found.balises, "readings": found.readings, "left_out": found.left_out}
    text = f"{_reference_text(found, name)}\nwritten: {', '.join(map(str, written))}"
    return Output([text], data | {"consistency": asdict(found.found), "file": str(options.target), "written": written})


def _smoothed(options: argparse.Namespace, result: Result, name: str) -> ReferenceTrajectory:
    """The trajectory by the odometer of this name."""
    stamps, positions, spreads = _balises(result, options)
    rows = sampled_rows(result.time, result[name])
    try:
        return reference_trajectory(
            result.time[rows],
            result[name][rows],
            stamps,
            positions,
            odometer_std=options.odometer_std,
            balise_std=spreads,
            jerk_density=options.jerk_density,
            scale_std=options.scale_std,
            gate=options.gate,
            slip=options.slip,
        )
    except ScenarioError as error:
        raise CosimError(f"{options.scenario}, {name}: {error}") from error


def _as_result(found: ReferenceTrajectory) -> Result:
    """The trajectory as a result: the quantities, and each with ``_std``.

    Args:
        found: from `reference_trajectory`.
    """
    columns = {"time": found.time}
    signals = []
    for i, (name, (unit, text)) in enumerate(SIGNALS.items()):
        columns |= {name: found.values[:, i], f"{name}_std": found.deviations[:, i]}
        signals += [
            SignalInfo(name, unit, description=text),
            SignalInfo(f"{name}_std", unit, description=f"Standard deviation: {text}"),
        ]
    table = np.zeros(len(found.time), dtype=[(name, float) for name in columns])
    for name, values in columns.items():
        table[name] = values
    return Result(table, tuple(signals))


def _reference_text(found: ReferenceTrajectory, odometer: str) -> str:
    """What was smoothed, and how far it may be off.

    Args:
        found: from `reference_trajectory`. odometer: name of the signal.
    """
    position, speed = (found.deviations[:, i] for i in (0, 1))
    lines = [
        f"{found.balises} balises and {found.readings} readings of {odometer}; {found.left_out} left out as slip",
        f"standard deviation of the position: {number(float(np.median(position)))} m in the median, "
        f"{number(float(position.max()))} m at most; of the speed {number(float(np.median(speed)))} m/s, "
        f"{number(float(speed.max()))} m/s",
        f"normalised innovations: mean {number(found.found.mean)}, expected {number(found.found.degrees)} "
        f"({number(found.found.band.low)} to {number(found.found.band.high)}): {found.found.verdict}",
    ]
    if found.found.verdict == "overconfident":
        lines.append("The noises assumed are too small: raise --odometer-std, --balise-std or --jerk-density.")
    if found.found.verdict == "underconfident":
        lines.append("The noises assumed are too large: lower --odometer-std or --jerk-density.")
    return "\n".join(lines)


def _odometer(result: Result, asked: str | None) -> str:
    names = [signal.name for signal in result.signals]
    report = result.summary.get("report")
    wanted = asked or (report.get("odometer") if isinstance(report, dict) else None)
    if wanted is None:
        raise ScenarioError(f"which signal is the odometer? Say --odometer NAME; there are: {', '.join(names)}.")
    fitting = [name for name in names if wanted in (name, name.partition(".")[2])]
    if len(fitting) != 1:
        raise ScenarioError(f"--odometer {wanted}: no signal of that name; {nearest(wanted, names)}")
    return fitting[0]


def _balises(result: Result, options: argparse.Namespace) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Stamps [s], positions [m] and standard deviations [m] of the telegrams that were read."""
    events = result.events if options.telegrams is None else read_layout(Path(options.telegrams)).records
    chosen = sorted((e for e in events if e.kind != "missed" and np.isfinite(e.position)), key=lambda e: e.stamp)
    if options.balise_std is not None:
        spreads = [options.balise_std] * len(chosen)
    else:
        spreads = [ACCURACY * e.location_accuracy if e.location_accuracy > 0.0 else BALISE for e in chosen]
    return np.array([e.stamp for e in chosen]), np.array([e.position for e in chosen]), np.array(spreads)
