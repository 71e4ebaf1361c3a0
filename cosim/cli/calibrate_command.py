"""``cosim calibrate MODEL RECORDING``: parameters from a recording, with confidence regions."""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from inspect import signature
from math import inf
from pathlib import Path
from typing import Any

import cosim
from cosim import calibration
from cosim.calibration.fitting import Calibration, calibrate
from cosim.calibration.fmu_runs import CALL_TIMEOUT, FmuRuns
from cosim.calibration.recorded_signals import CalibrationError, Selection, sort_columns
from cosim.calibration.running_resistance import RunningResistance
from cosim.calibration.runs import Runs
from cosim.cli.arguments import MANY_RUNS, PARAMETERS_FILE, TRUST_RESULTS, positive_number, settings_argument
from cosim.cli.output import save_figure, write_text
from cosim.cli.scenarios import between_samples, parse_setting, setting_number
from cosim.cli.stated_units import UNIT, stated_of
from cosim.errors import CosimError, ScenarioError, nearest
from cosim.results.load_result import load_result
from cosim.results.result import Result
from cosim.results.results_folder import check_writable
from cosim.runs.journal import Journal
from fmus import cached_fmu
from fmus.cli.commands import argument
from fmus.cli.output import Output
from plant_models import PLANTS

_NOT_IDENTIFIED = 1
RUNNING_RESISTANCE = "running_resistance"
_RUN_SECONDS, _RUN_STEP = 60.0, 0.05

GROUP = "Study"
PLACE = 4
HELP = "fit parameters of an FMU, a train model or a scenario to a recording"
LOOKS = False
FORMER = {
    "identify": "cosim calibrate running_resistance RECORDING, with --signals speed=NAME for --speed NAME, --inputs "
    "effort=N_OR_NAME for --effort, --set mass=KG for --mass, --set minimum_speed=M_S and --set resolution=M_S2 for "
    "these options, and of an FMU --drive NAME=VALUE for --input NAME and --set"
}
EXAMPLES = (
    "cosim calibrate vendor.fmu measured.csv --parameters mass=80e3",
    "cosim calibrate running_resistance measured.csv --set mass=80e3",
)
PARSER = {
    "description": (
        "Fit parameters of an FMU, a train model of the package or a scenario to a recording by least squares, with "
        "confidence intervals, and say what cannot be identified. A model is driven by the columns of the recording "
        "that have the names of its inputs. Numbers are converted to the units of the model, and taken as they are "
        "where one of the two has no unit. running_resistance, v' = effort/mass - w0 - w1 v - w2 v^2, fits davis_a, "
        "davis_b and davis_c to a measured speed and needs neither guesses nor a compiler; its settings (--set) are "
        "mass, minimum_speed and resolution."
    ),
    "epilog": "Exit codes: 0 all identified, 1 something is not, 2 error.",
}
ARGUMENTS = (
    argument(
        "model",
        metavar="MODEL",
        help="an .fmu file, a plant by name, running_resistance, or a scenario by name or file",
    ),
    argument("recording", metavar="RECORDING", help="results folder, table of any tool, or an FMU, which is driven"),
    argument(
        "--parameters",
        nargs="+",
        metavar="NAME[=GUESS]",
        help="to fit: parameters or start values of states; of a scenario component.parameter",
    ),
    argument(
        "--signals",
        nargs="+",
        metavar="NAME[=COLUMN]",
        help="to fit (default: all outputs recorded, or the only column of the unit of the only output)",
    ),
    argument(
        "--inputs",
        nargs="+",
        default=[],
        metavar="NAME=COLUMN|NUMBER",
        help="what drives an input (default: the column of its name); a number is in the unit of the input",
    ),
    argument(
        "--noise",
        nargs="+",
        default=[],
        metavar="NAME=STD",
        help="standard deviations in the units of the model (default: from the residuals)",
    ),
    settings_argument("not fitted"),
    TRUST_RESULTS,
    UNIT,
    argument("--from", type=float, default=-inf, dest="begin", metavar="SECONDS", help="begin of the part to use"),
    argument("--to", type=float, default=inf, dest="end", metavar="SECONDS", help="end of the part to use"),
    argument(
        "--step",
        type=positive_number,
        metavar="SECONDS",
        help="longest communication step (default: the sampling); of an FMU that is driven its sampling (0.05)",
    ),
    argument(
        "--between",
        nargs="+",
        default=[],
        metavar="[NAME=]hold|linear",
        help="what recorded inputs do between samples (default: as in the run; of a table linear, held if discrete)",
    ),
    argument("--interface", choices=("co-simulation", "model-exchange"), help="of an FMU that has both"),
    argument("--level", type=float, default=0.95, help="of the intervals (default: 0.95)"),
    argument(
        "--drive",
        nargs="+",
        default=[],
        metavar="NAME=VALUE",
        help="of an FMU as the recording: constant inputs, and parameters; an input of the model of this name is known",
    ),
    argument("--stop", type=float, default=_RUN_SECONDS, help="of an FMU that is driven: end of the run [s] (60)"),
    argument("--plot", type=Path, metavar="FILE", help="write signals and residuals as a picture"),
    PARAMETERS_FILE,
    argument("--out", type=Path, metavar="DIR", help="folder of the journal of the runs, which --resume goes on with"),
    argument(
        "--call-timeout",
        type=positive_number,
        metavar="SECONDS",
        help=f"how long a call of an FMU may last ({CALL_TIMEOUT:g}; of a scenario master.call_timeout)",
    ),
    *MANY_RUNS,
)


def execute(options: argparse.Namespace) -> Output:
    """The calibration, with picture and parameters written where the options ask for them.

    Raises:
        CosimError: nothing can be calibrated from this recording.
    """
    found, left = _calibrated(options)
    if options.plot is not None:
        save_figure(_figure(found), options.plot)
    if options.toml is not None:
        write_text(options.toml, found.toml())
    note = [f"- Not recorded, so held at its start: {', '.join(left)}."] if left else []
    parts = [*found.parts(), *note, found.toml().rstrip()]
    if found.identified:
        return Output(parts, found.to_dict(), verdict="All parameters are identified.")
    verdict = f"NOT identified: {', '.join(sorted(found.not_identified)) or 'the search did not converge'}."
    return Output(parts, found.to_dict(), code=_NOT_IDENTIFIED, verdict=verdict, role="bad")


def _calibrated(options: argparse.Namespace) -> tuple[Calibration, list[str]]:
    """The calibration, and the inputs that were not recorded."""
    is_known = str(options.model).lower().endswith(".fmu")  # else what is stated is of an FMU that is driven
    recording = _recording(options, () if is_known else options.unit)
    inputs = dict(map(parse_setting, options.inputs))
    runs = _runs(options, inputs)
    try:
        selection = Selection(
            options.signals,
            inputs,
            options.begin,
            options.end,
            between_samples(options.between),
        )
        outputs = {name: runs.named_unit(name) for name in runs.outputs}
        recorded = sort_columns(recording, options.recording, outputs, runs.inputs, selection, runs.discrete)
        found = calibrate(runs, recorded, noise=_numbers("--noise", options.noise), level=options.level)
        return found, [name for name in runs.inputs if name not in recorded.inputs]
    finally:
        runs.close()


def _recording(options: argparse.Namespace, units: Sequence[str]) -> Result:
    """The recording, of an FMU the run under constant inputs, with these among its columns, and units as stated."""
    stated = stated_of(options.recording, units)
    driven = _numbers("--drive", options.drive)
    if not str(options.recording).lower().endswith(".fmu"):
        if driven:
            raise ScenarioError(f"--drive belongs to an FMU; {options.recording} is a result.")
        return load_result(options.recording)
    if not driven:
        raise ScenarioError(
            f"{options.recording}: an FMU is driven; say by which input and how hard: --drive effort=60e3 [N]."
        )
    step, record = options.step or _RUN_STEP, list(driven)
    scenario = cosim.Scenario.fmu(
        options.recording, stop=options.stop, step=step, parameters=driven, record=record, units=stated
    )
    outcome = scenario.run(warn=lambda _text: None)
    if outcome.failure is not None:
        raise CosimError(f"{options.recording}: {outcome.failure}")
    return outcome.result


def _numbers(option: str, texts: Sequence[str]) -> dict[str, float]:
    """Numbers by name, of an option ``NAME=VALUE``."""
    return {name: setting_number(option, name, value) for name, value in map(parse_setting, texts)}


def _runs(options: argparse.Namespace, inputs: Mapping[str, Any]) -> Runs:
    """What is run, with first guesses."""
    names = [text.partition("=")[0] for text in options.parameters or ()]
    if len(set(names)) < len(names):
        raise CalibrationError(f"--parameters: each once (got {', '.join(names)}).")
    if options.model == RUNNING_RESISTANCE:
        return _running_resistance(options, inputs)
    if not names:
        raise CalibrationError("--parameters: say what is fitted, such as --parameters mass=80e3.")
    guesses = _numbers("--parameters", [text for text in options.parameters if "=" in text])
    if options.resume and options.out is None:
        raise CalibrationError("--resume goes on with the runs in a folder: say which, --out DIR.")
    journal = options.out and Journal(check_writable(options.out), resume=options.resume, retry=options.retry)
    where = {"workers": options.workers, "scheduler": options.scheduler, "journal": journal}
    if str(options.model).lower().endswith(".fmu") or options.model in PLANTS:
        return _fmu_runs(options, names, guesses, where)
    scenario = cosim.Scenario.load(options.model, trust=options.trust)
    for name, value in map(parse_setting, options.settings):
        scenario.set(name, value)
    if options.call_timeout is not None:
        scenario.set("master.call_timeout", options.call_timeout)
    runs: Runs = calibration.ScenarioRuns(scenario, names, guesses, **where)
    return runs


def _fmu_runs(
    options: argparse.Namespace, names: Sequence[str], guesses: Mapping[str, float], where: Mapping[str, Any]
) -> Runs:
    """Runs of an FMU, or of that of a train model of the package."""
    path = cached_fmu(PLANTS[options.model](), fmi_version=3) if options.model in PLANTS else options.model
    return FmuRuns(
        path,
        names,
        fixed=_numbers("--set", options.settings),
        guesses=guesses,
        units=stated_of(path, options.unit),
        interface=options.interface,
        step=options.step,
        call_timeout=CALL_TIMEOUT if options.call_timeout is None else options.call_timeout,
        **where,
    )


def _running_resistance(options: argparse.Namespace, inputs: Mapping[str, Any]) -> RunningResistance:
    """The model that needs no guesses."""
    if options.parameters:
        raise CalibrationError(f"--parameters: {RUNNING_RESISTANCE} fits all of its own and guesses them itself.")
    settings = _numbers("--set", options.settings)
    known = list(signature(RunningResistance).parameters)
    for name in settings:
        if name not in known:
            raise CalibrationError(f"--set {name}: no setting of {RUNNING_RESISTANCE}; {nearest(name, known)}")
    if "effort" in inputs and "mass" not in settings:
        raise CalibrationError(
            "An effort in newtons needs the mass [kg], rotating parts included: --set mass=KG; for efforts by mass "
            "[m/s2] --set mass=1."
        )
    return RunningResistance(**settings)


def _figure(found: Calibration) -> Any:
    recorded = found.recorded
    return calibration.calibration_figure(
        recorded.time, recorded.measured, found.fit.residuals, recorded.units, found.fit.noise
    )
