"""``cosim identify``: parameters of a train from a measured run. One action a kind of parameter: ``davis``."""

from __future__ import annotations

import argparse
from math import isfinite
from pathlib import Path
from typing import Any

import numpy as np

from cosim.cli.arguments import JSON_NOT_TABLE, PARAMETERS_FILE, settings_argument
from cosim.cli.output import print_json, save_figure, write_text
from cosim.cli.scenarios import parse_setting
from cosim.components.recording_data import column_courses, interval_ends
from cosim.errors import CosimError, ScenarioError, nearest
from cosim.results.load_result import load_result
from cosim.results.result import Result
from cosim.simulation.scenario import Scenario
from fmu_observer.identification.davis import (
    LEVEL,
    MINIMUM_SPEED,
    RESOLUTION,
    identify_davis,
)
from fmu_observer.identification.davis_estimate import DavisEstimate, IdentificationError
from fmus.cli.commands import Action, Actions, argument
from fmus.tables.numbers import number
from fmus.text_table import text_table

DONE, NOT_IDENTIFIED = 0, 1
_RUN_SECONDS, _RUN_STEP = 60.0, 0.05


DAVIS = (
    argument("source", metavar="SOURCE", help="results folder, table of any tool, or an FMU, which is driven"),
    argument("--speed", metavar="NAME", help="signal of the speed (default: the only one in m/s)"),
    argument("--effort", metavar="N_OR_NAME", help="constant effort [N], or the signal of a recorded one"),
    argument(
        "--between",
        choices=("hold", "linear"),
        help="what a recorded effort does between samples (default: as in the run; of a table linear)",
    ),
    argument("--mass", type=float, metavar="KG", help="mass with rotating parts; 1 for efforts by mass"),
    argument("--from", type=float, dest="begin", metavar="SECONDS", help="begin of the part to use [s]"),
    argument("--to", type=float, dest="end", metavar="SECONDS", help="end of the part to use [s]"),
    argument(
        "--minimum-speed", type=float, default=MINIMUM_SPEED, metavar="M_S", help="leave out slower samples [m/s]"
    ),
    argument("--level", type=float, default=LEVEL, help="of the intervals (default: 0.95)"),
    argument(
        "--resolution",
        type=float,
        default=RESOLUTION,
        metavar="M_S2",
        help="widest half of an interval that counts as identified, as acceleration at top speed (default: 0.05)",
    ),
    argument("--input", metavar="NAME", help="of an FMU: the input that takes the effort"),
    argument("--stop", type=float, default=_RUN_SECONDS, help="of an FMU: length of the run [s] (default: 60)"),
    argument("--step", type=float, default=_RUN_STEP, help="of an FMU: sampling [s] (default: 0.05)"),
    settings_argument("of an FMU"),
    argument("--plot", type=Path, metavar="FILE", help="write speed and residuals as a picture"),
    PARAMETERS_FILE,
    JSON_NOT_TABLE,
)


def execute(options: argparse.Namespace) -> int:
    """Identify, print and write.

    Args:
        options: of the command line.

    Raises:
        CosimError: nothing can be identified from this source.
    """
    try:
        estimate = _identified(options)
    except IdentificationError as error:
        raise CosimError(f"{options.source}: {error}") from error
    if options.plot is not None:
        from cosim.drawing.residuals import residual_figure  # noqa: PLC0415 - matplotlib only for those who draw

        save_figure(residual_figure(estimate.time, estimate.measured, estimate.residuals), options.plot)
    if options.toml is not None:
        write_text(options.toml, estimate.toml())
    if options.json:
        print_json(_estimate_data(estimate))
    else:
        print(_estimate_text(estimate))
    return DONE if estimate.identified else NOT_IDENTIFIED


def _identified(options: argparse.Namespace) -> DavisEstimate:
    driven = str(options.source).lower().endswith(".fmu")
    result = _driven(options) if driven else _loaded(options)
    effort, column = _effort(options, result, driven)
    instants, rows = np.unique(result.time, return_index=True)  # an event has two rows
    chosen = (instants >= (options.begin if options.begin is not None else -np.inf)) & (
        instants <= (options.end if options.end is not None else np.inf)
    )
    if not len(instants):
        raise IdentificationError("the table has no rows: expected samples of time and speed.")
    if not chosen.any():
        raise IdentificationError(
            f"no sample between --from and --to; there are some from {instants[0]:g} to {instants[-1]:g} s."
        )
    last = (np.append(rows[1:], len(result.time)) - 1)[chosen]
    rows = rows[chosen]
    return identify_davis(
        instants[chosen],
        np.asarray(result[_signal(result, options.speed, "speed", "--speed")])[rows],
        effort=effort if column is None else _course(options, result, column, rows, last),
        mass=options.mass,
        minimum_speed=options.minimum_speed,
        level=options.level,
        resolution=options.resolution,
    )


def _loaded(options: argparse.Namespace) -> Result:
    given = [f"--{name}" for name in ("input", "settings") if getattr(options, name)]
    if given:
        raise ScenarioError(f"{given[0].replace('settings', 'set')} belongs to an FMU; {options.source} is a result.")
    return load_result(options.source)


def _driven(options: argparse.Namespace) -> Result:
    """The run of an FMU under a constant effort."""
    effort = _number(options.effort)
    if options.input is None or effort is None:
        raise ScenarioError(
            f"{options.source}: an FMU is driven; say by which input and how hard: --input effort --effort 60e3 [N]."
        )
    scenario = Scenario.fmu(
        options.source,
        stop=options.stop,
        step=options.step,
        inputs={options.input: effort},
        parameters=dict(parse_setting(text) for text in options.settings),
    )
    outcome = scenario.run(warn=lambda _text: None)
    if outcome.failure is not None:
        raise CosimError(f"{options.source}: {outcome.failure}")
    return outcome.result


def _number(text: str | None) -> float | None:
    try:
        value = float(text) if text is not None else None
    except ValueError:
        return None
    return value if value is not None and isfinite(value) else None


def _course(options: argparse.Namespace, result: Result, column: str, rows: Any, last: Any) -> Any:
    """A recorded effort at begin and end of each interval between samples [N], shape (2, n - 1)."""
    said = {} if options.between is None else {column: options.between}
    return interval_ends(np.asarray(result[column], float), rows, last, column_courses(result, [column], said)[0])


def _effort(options: argparse.Namespace, result: Result, driven: bool) -> tuple[float | None, str | None]:
    """The effort as a number, or the column of a recorded one; an FMU without a mass is left with it unknown."""
    if options.effort is None:
        return None, None
    constant = _number(options.effort)
    if constant is not None:
        return (None if driven and options.mass is None else constant), None
    return None, _signal(result, options.effort, "effort", "--effort")


def _signal(result: Result, asked: str | None, what: str, option: str) -> str:
    """Name of a signal: the one asked for, with or without its component, or the only one in m/s."""
    names = [signal.name for signal in result.signals]
    if asked is not None:
        fitting = [name for name in names if name == asked or name.partition(".")[2] == asked]
        if len(fitting) != 1:
            raise ScenarioError(f"{option} {asked}: no signal of that name; {nearest(asked, names)}")
        return fitting[0]
    speeds = [signal.name for signal in result.signals if signal.unit == "m/s"]
    found = speeds or names
    if len(found) != 1:
        raise ScenarioError(f"which signal is the {what}? Say {option} NAME; there are: {', '.join(found) or 'none'}.")
    return found[0]


def _estimate_text(estimate: DavisEstimate) -> str:
    """The estimate as a table with remarks below."""
    top = estimate.speeds[1]
    percent = f"{100.0 * estimate.level:g} % interval"
    rows = [["coefficient", "estimate", percent, "unit", f"± at {top:.3g} m/s [m/s2]", "identified"]]
    for c in estimate.coefficients:
        interval = f"{number(c.low, 4)} to {number(c.high, 4)}"
        sure = "yes" if c.identified else "no"
        rows.append([c.name, number(c.value, 4), interval, c.unit, number(c.uncertainty, 2), sure])
    head = (
        f"{estimate.points} samples from {estimate.speeds[0]:.3g} to {top:.3g} m/s in {estimate.duration:.4g} s, noise "
        f"{number(estimate.noise, 2)} m/s, condition number {number(estimate.condition, 2)}"
    )
    lines = [head, "", *text_table(rows, left=(0, 3, 5), heading=True), ""]
    return "\n".join([*lines, *(f"- {remark}" for remark in estimate.remarks), "", estimate.toml().rstrip()])


def _estimate_data(estimate: DavisEstimate) -> dict[str, Any]:
    """The estimate as plain data."""
    keys = ("mass", "level", "resolution", "noise", "points", "speeds", "duration", "condition", "confusion")
    coefficients = {
        c.name: {"value": c.value, "low": c.low, "high": c.high, "unit": c.unit, "identified": c.identified}
        for c in estimate.coefficients
    }
    return {"coefficients": coefficients, "remarks": list(estimate.remarks)} | {k: getattr(estimate, k) for k in keys}


GROUP = "Study"
HELP = "identify parameters of a train from a measured run"
PARSER = {"description": "Identify parameters of a train from a measured run."}
ARGUMENTS = (
    Actions(
        (
            Action(
                "davis",
                execute,
                {
                    "help": "running resistance",
                    "description": (
                        "Davis coefficients w0 + w1 v + w2 v^2 from a run with constant or recorded effort, with "
                        "confidence intervals, and what of them cannot be identified."
                    ),
                    "epilog": "Exit codes: 0 all identified, 1 something is not, 2 error.",
                },
                DAVIS,
            ),
        )
    ),
)
