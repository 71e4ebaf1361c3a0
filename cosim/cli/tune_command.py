"""``cosim tune``: parameters searched for the smallest cost over several seeds, and validated with others."""

from __future__ import annotations

import argparse
import logging
from pathlib import Path

from cosim.cli.arguments import FIGURE_FILES, MANY_RUNS, QUIET, many_runs, positive, scenario_arguments
from cosim.cli.scenarios import load_scenario, read_setting
from cosim.errors import ScenarioError
from cosim.results.results_folder import check_writable
from cosim.simulation.scenario import Scenario
from cosim.tuning.parameters import Bounds
from cosim.tuning.tune import tune
from cosim.tuning.tuning_files import PAGE, write_figures
from cosim.tuning.tuning_result import Tuning
from fmus.cli.commands import argument, repeated
from fmus.cli.output import Output
from fmus.cli.parsers import no_number
from fmus.cli.progress import ProgressBar
from plant_models.hybrid.casadi_package import demand_casadi

LOG = logging.getLogger("cosim")
_DONE, _NOT_BETTER = 0, 1


def _seeds(text: str) -> list[int]:
    """``3``, ``0:4`` (0 to 3) or ``1,5,7``."""
    try:
        if ":" in text:
            first, last = text.split(":")
            found = list(range(int(first), int(last)))
        else:
            found = [int(part) for part in text.split(",")]
    except ValueError:
        raise argparse.ArgumentTypeError(f"expected whole numbers such as 3, 0:4 or 1,5,7 (got {text!r})") from None
    if not found:
        raise argparse.ArgumentTypeError(f"{text} holds no seeds; 0:4 are those from 0 to 3")
    return found


GROUP = "Study"
PLACE = 3
HELP = "search parameters for the smallest cost over several seeds"
LOOKS = False
FORMER_OPTIONS = {"--judge": "--validate"}
EXAMPLES = ("cosim tune vendor.toml --observer observer --parameters theta=0.5:5:log",)
PARSER = {
    "description": (
        "Search parameters of an observer, an FMU or a scenario for the smallest cost over training seeds, and "
        "validate the best with other seeds. An observer that only listens is run beside one recording of the "
        "plant a seed."
    ),
    "epilog": (
        "Exit codes: 0 done, 1 the validation seeds do not show that it became better, 2 error or interrupted; the "
        "history is in the folder, --resume goes on with it."
    ),
}
ARGUMENTS = (
    *scenario_arguments(default=None),
    argument("--observer", metavar="NAME", help="component that is tuned, or a shipped observer"),
    argument(
        "--parameters",
        nargs="+",
        required=True,
        metavar="NAME=LOW:HIGH[:log]",
        help="parameters with bounds: of the observer, or component.parameter; process_covariance[1,1] for a diagonal",
    ),
    argument(
        "--method", default="bbo", metavar="NAME", help="bbo (default), pso, ga, cma, gradient, hand, or a full name"
    ),
    repeated("--option", "NAME=VALUE", "of the method, such as population=30"),
    argument(
        "--cost",
        default="state",
        metavar="COST",
        help="state (default), state:estimate=component.signal,..., likelihood, nis, expectation:NUMBER, or a measure "
        "such as speed_error_rms; with a minus sign (--cost=-NAME) the largest is wanted",
    ),
    argument("--seeds", type=_seeds, default=[0], metavar="0:4", help="for training (default: 0)"),
    argument("--validate", type=_seeds, default=[], metavar="10:20", help="for validation before and after"),
    argument("--iterations", type=positive, default=20, metavar="N", help="default: 20"),
    argument(
        "--searches", type=positive, default=1, metavar="N", help="searches, each with another seed of the method"
    ),
    argument("--out", metavar="DIR", help="folder for history and results (default: results/NAME_tuned)"),
    *MANY_RUNS,
    argument("--whole-runs", action="store_true", help="run the whole scenario, also where a recording would do"),
    FIGURE_FILES,
    QUIET,
)


def execute(options: argparse.Namespace) -> Output:
    """What the search that the options ask for has found, as it is written in the folder.

    Raises:
        CosimError: nothing can be tuned.
    """
    demand_casadi()  # hundreds of runs in plain NumPy would take hours
    scenario = load_scenario(options)
    directory = check_writable(
        Path(options.out) if options.out is not None else Path("results") / f"{scenario.name}_tuned"
    )
    found = _tuned(scenario, options, directory)
    for text in found.warnings:
        LOG.warning(text)
    drawn = write_figures(found, directory, options.figures)
    lucky = bool(found.validated) and not found.shown_better
    return Output(
        found.details(),
        found.to_data(),
        {"tuned": directory / "tuned.toml", "page": directory / PAGE} | drawn,
        code=_NOT_BETTER if lucky else _DONE,
        error=KeyboardInterrupt() if found.interrupted else None,
        verdict=found.verdict,
        role="good" if found.shown_better else "doubtful",
    )


def _tuned(scenario: Scenario, options: argparse.Namespace, directory: Path) -> Tuning:
    with ProgressBar("run", silent=options.quiet or options.json) as bar:
        return tune(
            scenario,
            dict(_bounds(text) for text in options.parameters),
            observer=options.observer,
            method=options.method,
            cost=options.cost,
            seeds=options.seeds,
            validate=options.validate,
            iterations=options.iterations,
            searches=options.searches,
            options=dict(read_setting("--option", text) for text in options.option),
            directory=directory,
            **many_runs(options),
            whole_runs=options.whole_runs,
            progress=bar,
        )


def _bounds(text: str) -> tuple[str, Bounds]:
    """``name=low:high`` or ``name=low:high:log``.

    Raises:
        ScenarioError: it is something else.
    """
    name, sign, limits = (part.strip() for part in text.partition("="))
    low, *rest = limits.split(":")
    if not (name and sign) or len(rest) not in {1, 2} or rest[1:] not in ([], ["log"]):
        raise ScenarioError(
            f"--parameters {text!r}: expected NAME=LOW:HIGH or NAME=LOW:HIGH:log, such as theta=0.1:5; an optimiser "
            "does not search without bounds."
        )
    return name, (_bound(name, low), _bound(name, rest[0]), len(rest) == 2)


def _bound(name: str, text: str) -> float:
    """A bound of a parameter."""
    try:
        return float(text)
    except ValueError:
        raise ScenarioError(f"--parameters {name}: {no_number(text)}.") from None
