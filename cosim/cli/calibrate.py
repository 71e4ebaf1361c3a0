"""``cosim calibrate SCENARIO|FMU RECORDING``: parameters from a recording, with confidence regions."""

from __future__ import annotations

import argparse
import json
from math import inf
from pathlib import Path
from typing import Any

from cosim import calibration
from cosim.calibration.fitting import Calibration, calibrate
from cosim.calibration.recorded_signals import CalibrationError, sort_columns
from cosim.calibration.runs import FmuRuns, Runs, ScenarioRuns
from cosim.cli.scenarios import between_samples, parse_setting
from cosim.errors import OutputError, ScenarioError
from cosim.results.load import load_result
from cosim.results.summary_file import jsonable
from cosim.simulation.scenario import Scenario

DONE, NOT_IDENTIFIED = 0, 1


def register(commands: Any) -> None:
    """Add the command to the parser.

    Args:
        commands: subparsers of the program.
    """
    text = (
        "Fit parameters of an FMU or a scenario to a recording by least squares, with confidence intervals, and tell "
        "what cannot be identified. An FMU is driven by the columns of the recording that have the names of its inputs."
    )
    epilog = "Exit codes: 0 all identified, 1 something is not, 2 error."
    parser = commands.add_parser("calibrate", description=text, epilog=epilog)
    parser.add_argument("model", metavar="SCENARIO|FMU", help="an .fmu file, or a scenario by name or file")
    parser.add_argument("recording", metavar="RECORDING", help="results folder, or a table of any tool")
    parser.add_argument(
        "--parameters",
        nargs="+",
        required=True,
        metavar="NAME[=GUESS]",
        help="to fit: parameters or start values of states; of a scenario component.parameter",
    )
    parser.add_argument("--signals", nargs="+", metavar="NAME[=COLUMN]", help="to fit (default: all outputs recorded)")
    parser.add_argument(
        "--noise", nargs="+", default=[], metavar="NAME=STD", help="standard deviations (default: from the residuals)"
    )
    parser.add_argument("--set", action="append", default=[], metavar="NAME=VALUE", dest="settings", help="not fitted")
    parser.add_argument(
        "--from", type=float, default=-inf, dest="begin", metavar="SECONDS", help="begin of the part to use"
    )
    parser.add_argument("--to", type=float, default=inf, dest="end", metavar="SECONDS", help="end of the part to use")
    parser.add_argument(
        "--step", type=float, metavar="SECONDS", help="longest communication step (default: the sampling)"
    )
    parser.add_argument(
        "--between",
        nargs="+",
        default=[],
        metavar="[NAME=]hold|linear",
        help="what recorded inputs do between samples (default: as in the run; of a table linear, held if discrete)",
    )
    parser.add_argument("--interface", choices=("co-simulation", "model-exchange"), help="of an FMU that has both")
    parser.add_argument("--level", type=float, default=0.95, help="of the intervals (default: 0.95)")
    parser.add_argument("--plot", type=Path, metavar="FILE", help="write signals and residuals as a picture")
    parser.add_argument("--toml", type=Path, metavar="FILE", help="write the parameters for a scenario")
    parser.add_argument("--json", action="store_true", help="print the data as JSON instead of the table")
    parser.set_defaults(execute=execute)


def execute(options: argparse.Namespace) -> int:
    """Calibrate, print and write.

    Args:
        options: of the command line.

    Raises:
        CosimError: nothing can be calibrated from this recording.
    """
    recording = load_result(options.recording)
    runs = _runs(options)
    try:
        recorded = sort_columns(
            recording,
            options.recording,
            runs.outputs,
            runs.inputs,
            options.signals,
            options.begin,
            options.end,
            between_samples(options.between),
            runs.discrete,
        )
        noise = {name: _number("--noise", name, value) for name, value in map(parse_setting, options.noise)}
        found = calibrate(runs, recorded, noise=noise, level=options.level)
    finally:
        runs.close()
    if options.plot is not None:
        _draw(options.plot, found)
    if options.toml is not None:
        try:
            options.toml.write_text(found.toml(), encoding="utf-8")
        except OSError as error:
            raise OutputError(f"{options.toml} cannot be written: {error.strerror or error}.") from error
    left = [name for name in runs.inputs if name not in recorded.inputs]
    note = f"\n- Not recorded, so held at its start: {', '.join(left)}." if left else ""
    text = f"{found.text()}{note}\n\n{found.toml().rstrip()}"
    print(json.dumps(jsonable(found.to_dict()), indent=2) if options.json else text)
    return DONE if found.identified else NOT_IDENTIFIED


def _runs(options: argparse.Namespace) -> Runs:
    """What is run, with the first guesses given."""
    names, guesses = [], {}
    for text in options.parameters:
        name, sign, _ = text.partition("=")
        names.append(name)
        if sign:
            guesses[name] = _number("--parameters", *parse_setting(text))
    if len(set(names)) < len(names):
        raise CalibrationError(f"--parameters: each once (got {', '.join(names)}).")
    settings = dict(map(parse_setting, options.settings))
    if str(options.model).lower().endswith(".fmu"):
        fixed = {name: _number("--set", name, value) for name, value in settings.items()}
        return FmuRuns(
            options.model,
            names,
            fixed=fixed,
            guesses=guesses,
            interface=options.interface,
            step=options.step,
        )
    scenario = Scenario.load(options.model)
    for name, value in settings.items():
        scenario.set(name, value)
    return ScenarioRuns(scenario, names, guesses)


def _number(option: str, name: str, value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise ScenarioError(f"{option} {name}={value}: expected a number.")
    return float(value)


def _draw(path: Path, found: Calibration) -> None:
    recorded = found.recorded
    figure = calibration.calibration_figure(
        recorded.time, recorded.measured, found.fit.residuals, recorded.units, found.fit.noise
    )
    try:
        figure.savefig(path)
    except (OSError, ValueError) as error:  # matplotlib refuses endings that it does not know by a ValueError
        raise OutputError(f"{path} cannot be written: {error}.") from error
