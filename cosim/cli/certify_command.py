"""``cosim certify WHAT``: how long gaps and delays may be, and how large an error, for an observer with its gains or
for those of a scenario.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from cosim.certify import Certified, Demands, certified, findings_table, scenario_observers, simulated
from cosim.cli.arguments import TRUST_CODE, number_from_zero, positive_number, settings_argument
from cosim.cli.model_info import declared_model, in_own_words
from cosim.cli.scenarios import load_scenario, read_setting
from cosim.errors import CosimError
from cosim.run.component_models import make_declared, stated_parameters
from cosim.run.run_seeds import with_seeds
from cosim.run.task import RunTask
from cosim.scenario.includes import read_tables
from cosim.scenario.scenario_tables import ComponentTable
from cosim.scenario.schema import parse_part
from cosim.scenario.shipped import shipped_scenarios
from fmus.cli.commands import argument, repeated
from fmus.cli.output import Output
from fmus.tables.table import Parts

_NOT_CERTIFIED = 1
_FEWEST = 4
_KINDS = ("sufficient", "exact")

GROUP = "Observers"
PLACE = 2
HELP = "gaps, delays and errors for which observers are certified"
LOOKS = True
FORMER = {"bound": "cosim certify OBSERVER --error M_S --missing N", "limits": "cosim certify OBSERVER"}
EXAMPLES = (
    "cosim certify takagi_sugeno_cdo",
    "cosim certify vendor.toml",
)
PARSER = {
    "description": (
        "What holds for an observer with its gains: how long gaps between samples and delays may be, as printed, "
        "exactly and by simulation, whether its condition holds, and how wrong its speed may be. Of a scenario, each "
        "observer is held against the gaps that balises and network bring."
    ),
    "epilog": "Exit codes: 0 done, 1 what is demanded is not certified, 2 error.",
}
ARGUMENTS = (
    argument(
        "what", metavar="WHAT", help="an observer by name or file.py:Class, a file.toml with its gains, or a scenario"
    ),
    argument("--preset", metavar="NAME", help="values to start from (default: the observer's own)"),
    settings_argument(
        "a parameter, for instance --set theta=5 or --set 'gain=[3.4, -3.4, -1.5]'; of a scenario any key"
    ),
    TRUST_CODE,
    repeated("--option", "NAME=VALUE", "an option, for instance --option nodes=2"),
    argument("--gap", type=positive_number, metavar="S", help="certify any mixture of gaps up to this [s]"),
    argument("--period", type=positive_number, metavar="S", help="certify this constant gap [s]"),
    argument("--delay", type=number_from_zero, metavar="S", help="certify samples that arrive this late [s]"),
    argument(
        "--error",
        type=positive_number,
        metavar="M_S",
        help="certify this largest speed error before the next sample [m/s]",
    ),
    argument("--missing", type=int, default=0, metavar="N", help="bound the error over up to N missing samples too"),
    argument("--by", choices=_KINDS, default="sufficient", help="kind of bound that decides (default: sufficient)"),
    argument("--no-simulation", action="store_true", help="leave the limits out that are found by simulation"),
    argument("--members", type=int, default=16, metavar="N", help="values that are simulated at once (default: 16)"),
)


def execute(options: argparse.Namespace) -> Output:
    """The findings, and which demands are not met.

    Args:
        options: of the command line.

    Raises:
        CosimError: there is no such observer or scenario, nothing is known of it, or an argument is not legal.
    """
    if options.members < _FEWEST:
        raise CosimError(f"certify: --members {options.members}: expected {_FEWEST} values or more at once.")
    demands = Demands(options.gap, options.period, options.delay, options.error, options.missing, options.by)
    observers = _observers(options, demands)
    unmet = [text for one in observers for text in one.unmet]
    data = {"observers": [one.to_dict() for one in observers], "not_certified": unmet}
    parts: Parts = [findings_table(observers), "\n".join(f"not certified: {text}" for text in unmet)]
    verdict = _verdict(len(unmet), sum(len(one.demanded) for one in observers))
    if unmet:
        return Output(parts, data, code=_NOT_CERTIFIED, verdict=verdict, role="bad")
    return Output(parts, data, verdict=verdict)


def _verdict(unmet: int, demanded: int) -> str:
    """Whether what is demanded is certified, in a line."""
    if unmet:
        return f"NOT certified: {unmet} of {demanded} demands."
    return f"Certified: all {demanded} demands." if demanded else "Nothing was demanded: see --gap, --period, --error."


def _observers(options: argparse.Namespace, demands: Demands) -> list[Certified]:
    if options.what in shipped_scenarios() or Path(options.what).suffix.lower() in (".toml", ".ssp"):
        gains = _gains_file(options.what)
        return _of_scenario(options, demands) if gains is None else [_of_gains(gains, options, demands)]
    made = declared_model(options.what, "certify", ("observer",), _read("--option", options.option))
    return [_certified(options.what, made, _read("--set", options.settings), options.preset, options, demands)]


def _read(option: str, texts: Sequence[str]) -> dict[str, Any]:
    """Values by name."""
    return dict(read_setting(option, text) for text in texts)


def _gains_file(what: str) -> ComponentTable | None:
    """The table of an observer in a file, None for a scenario."""
    path = Path(what)
    if path.suffix.lower() != ".toml" or not path.is_file():
        return None
    data = read_tables(path).data
    if "observer" not in data:
        return None
    table: ComponentTable = parse_part({"components": {"gains": data}}, what).components["gains"]
    return table


def _of_gains(table: ComponentTable, options: argparse.Namespace, demands: Demands) -> Certified:
    made: Any = make_declared(table, options.what)
    parameters = stated_parameters(table, made) | _read("--set", options.settings)
    return _certified(str(table.observer), made, parameters, options.preset or table.preset, options, demands)


def _of_scenario(options: argparse.Namespace, demands: Demands) -> list[Certified]:
    scenario = load_scenario(argparse.Namespace(scenario=options.what, settings=options.settings, trust=options.trust))
    task = RunTask(with_seeds(scenario.table()), scenario.name, scenario.folder, scenario.where)
    found = list(scenario_observers(task, demands))
    if not found:
        raise CosimError(f"{scenario.where}: no observer of this scenario has findings.")
    return found


def _certified(
    name: str, made: Any, parameters: dict[str, Any], preset: str | None, options: argparse.Namespace, demands: Demands
) -> Certified:
    if not hasattr(made, "findings"):
        raise CosimError(f"Observer {name!r} has no findings: {_why_none(made)}")
    if (demands.error is not None or demands.missing) and not hasattr(made, "error_bounds"):
        raise CosimError(
            f"Observer {name!r} has no bound of its error; discrete_measurement_observer and "
            "continuous_discrete_observer do."
        )
    with in_own_words(name, "certify"):
        found = certified(name, made, demands, parameters, preset)
        kept = [one for one in found.findings if not (options.no_simulation and one.search is not None)]
        results = tuple(simulated(one, options.members) for one in kept)
    return Certified(name, results, found.demanded, found.notes)


def _why_none(system: Any) -> str:
    if not system.triggered_events:
        return "no measurement comes to it as an event, so there are no gaps; try delayed_state_observer."
    return (
        "it declares no error equations (a method findings). Where it follows the odometer between its events "
        f"{', '.join(e.name for e in system.triggered_events)}, run it in a scenario with longer gaps."
    )
