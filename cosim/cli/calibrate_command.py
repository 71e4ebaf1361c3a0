"""``cosim calibrate SCENARIO|FMU RECORDING``: parameters from a recording, with confidence regions."""

from __future__ import annotations

import argparse
from math import inf
from pathlib import Path
from typing import Any

from cosim import calibration
from cosim.calibration.fitting import Calibration, calibrate
from cosim.calibration.recorded_signals import CalibrationError, sort_columns
from cosim.calibration.runs import FmuRuns, Runs, ScenarioRuns
from cosim.cli.arguments import JSON_NOT_TABLE, PARAMETERS_FILE, settings_argument
from cosim.cli.output import print_json, save_figure, write_text
from cosim.cli.scenarios import between_samples, parse_setting, setting_number
from cosim.results.load_result import load_result
from cosim.simulation.scenario import Scenario
from fmus.cli.commands import argument

DONE, NOT_IDENTIFIED = 0, 1

GROUP = "Study"
HELP = "fit parameters of an FMU or a scenario to a recording"
PARSER = {
    "description": (
        "Fit parameters of an FMU or a scenario to a recording by least squares, with confidence intervals, and tell "
        "what cannot be identified. An FMU is driven by the columns of the recording that have the names of its inputs."
    ),
    "epilog": "Exit codes: 0 all identified, 1 something is not, 2 error.",
}
ARGUMENTS = (
    argument("model", metavar="SCENARIO|FMU", help="an .fmu file, or a scenario by name or file"),
    argument("recording", metavar="RECORDING", help="results folder, or a table of any tool"),
    argument(
        "--parameters",
        nargs="+",
        required=True,
        metavar="NAME[=GUESS]",
        help="to fit: parameters or start values of states; of a scenario component.parameter",
    ),
    argument("--signals", nargs="+", metavar="NAME[=COLUMN]", help="to fit (default: all outputs recorded)"),
    argument(
        "--noise", nargs="+", default=[], metavar="NAME=STD", help="standard deviations (default: from the residuals)"
    ),
    settings_argument("not fitted"),
    argument("--from", type=float, default=-inf, dest="begin", metavar="SECONDS", help="begin of the part to use"),
    argument("--to", type=float, default=inf, dest="end", metavar="SECONDS", help="end of the part to use"),
    argument("--step", type=float, metavar="SECONDS", help="longest communication step (default: the sampling)"),
    argument(
        "--between",
        nargs="+",
        default=[],
        metavar="[NAME=]hold|linear",
        help="what recorded inputs do between samples (default: as in the run; of a table linear, held if discrete)",
    ),
    argument("--interface", choices=("co-simulation", "model-exchange"), help="of an FMU that has both"),
    argument("--level", type=float, default=0.95, help="of the intervals (default: 0.95)"),
    argument("--plot", type=Path, metavar="FILE", help="write signals and residuals as a picture"),
    PARAMETERS_FILE,
    JSON_NOT_TABLE,
)


def execute(options: argparse.Namespace) -> int:
    """Calibrate, print and write.

    Args:
        options: of the command line.

    Raises:
        CosimError: nothing can be calibrated from this recording.
    """
    found, left = _calibrated(options)
    if options.plot is not None:
        save_figure(_figure(found), options.plot)
    if options.toml is not None:
        write_text(options.toml, found.toml())
    if options.json:
        print_json(found.to_dict())
    else:
        note = f"\n- Not recorded, so held at its start: {', '.join(left)}." if left else ""
        print(f"{found.text()}{note}\n\n{found.toml().rstrip()}")
    return DONE if found.identified else NOT_IDENTIFIED


def _calibrated(options: argparse.Namespace) -> tuple[Calibration, list[str]]:
    """The calibration, and the inputs that were not recorded."""
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
        noise = {name: setting_number("--noise", name, value) for name, value in map(parse_setting, options.noise)}
        found = calibrate(runs, recorded, noise=noise, level=options.level)
        return found, [name for name in runs.inputs if name not in recorded.inputs]
    finally:
        runs.close()


def _runs(options: argparse.Namespace) -> Runs:
    """What is run, with the first guesses given."""
    names, guesses = [], {}
    for text in options.parameters:
        name, sign, _ = text.partition("=")
        names.append(name)
        if sign:
            guesses[name] = setting_number("--parameters", *parse_setting(text))
    if len(set(names)) < len(names):
        raise CalibrationError(f"--parameters: each once (got {', '.join(names)}).")
    settings = dict(map(parse_setting, options.settings))
    if str(options.model).lower().endswith(".fmu"):
        fixed = {name: setting_number("--set", name, value) for name, value in settings.items()}
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


def _figure(found: Calibration) -> Any:
    recorded = found.recorded
    return calibration.calibration_figure(
        recorded.time, recorded.measured, found.fit.residuals, recorded.units, found.fit.noise
    )
