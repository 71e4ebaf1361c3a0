"""``cosim export SOURCE TARGET``: a scenario as SSP, a result in another format, the trajectory behind a recording."""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path

from cosim.cli.arguments import TRUST_CODE, settings_argument
from cosim.cli.scenarios import load_scenario
from cosim.cli.trajectory import TRAJECTORY, export_trajectory, idle_words
from cosim.errors import OutputError, ScenarioError
from cosim.results.declared_units import in_si_only
from cosim.results.formats.known_formats import format_of
from cosim.results.load_result import load_result
from cosim.results.save import save_result
from cosim.results.selection import selected
from cosim.scenario.package_names import is_package
from fmus.cli.commands import ArgumentGroup, argument
from fmus.cli.output import Output

GROUP = "Models and files"
PLACE = 4
HELP = "write a scenario as SSP, a result in another format, the trajectory behind a recording"
LOOKS = True
FORMER = {"convert": "cosim export SOURCE TARGET", "reference": "cosim export SOURCE TARGET --trajectory"}
EXAMPLES = (
    "cosim export vendor.toml vendor.ssp",
    "cosim export results/vendor vendor.mat",
)
PARSER = {
    "description": (
        "Write for other tools. TARGET.ssp: SOURCE is a scenario, written as a system structure package. Any other "
        "TARGET: SOURCE is a results folder or a table of any tool, in the format that the ending says, such as "
        ".csv, .mat (MATLAB), .modelica.mat (Dymola, OpenModelica), .npy, .parquet, .h5; with --trajectory the "
        "trajectory that it was most likely made on."
    ),
    "epilog": "Exit codes: 0 written, 2 error.",
}
ARGUMENTS = (
    argument("scenario", metavar="SOURCE", help="a scenario, by name or file; or a results folder or table"),
    argument("target", type=Path, metavar="TARGET", help="file to write"),
    ArgumentGroup(
        (
            settings_argument(),
            TRUST_CODE,
            argument("--ssp-version", choices=("1.0", "2.0"), help="version of SSP (default: 2.0)"),
        ),
        "a scenario",
    ),
    ArgumentGroup(
        (
            argument("--signals", nargs="+", action="extend", metavar="PATTERN", help="these only, e.g. 'train.*'"),
            argument("--si", action="store_true", help="in SI also where FMUs declare other units"),
            argument("--no-units", action="store_true", help="CSV headings without units, in SI"),
        ),
        "a result",
    ),
    TRAJECTORY,
)


def execute(options: argparse.Namespace) -> Output:
    """Read, choose, write, as the options ask; what was written and what the format does not keep."""
    if is_package(str(options.target)):
        _refuse(options, "a scenario", "signals", "si", "no_units", "trajectory")
        path = load_scenario(options).export_ssp(options.target, options.ssp_version or "2.0")
        return Output([str(path)], {"file": str(path)})
    _refuse(options, "a result", "settings", "ssp_version")
    if options.trajectory:
        return export_trajectory(options)
    idle = idle_words(options)
    if idle:
        raise ScenarioError(f"{', '.join(idle)}: only with --trajectory, which is not there.")
    return _export_result(options.scenario, options)


def _refuse(options: argparse.Namespace, source: str, *others: str) -> None:
    """Refuse options that are of another kind of source.

    Raises:
        ScenarioError: one is given.
    """
    for name in others:
        if getattr(options, name):
            flag = "set" if name == "settings" else name.replace("_", "-")
            raise ScenarioError(f"--{flag} does not go with {source}, which {options.target} is written from.")


def _export_result(source: str, options: argparse.Namespace) -> Output:
    target, wanted = options.target, format_of(options.target)
    if target.exists() and Path(source).exists() and target.samefile(source):
        raise OutputError(f"{target} is the source itself. Choose another name.")
    result = load_result(source)
    if options.signals:
        result = selected(result, options.signals)
    if options.si:
        result = replace(result, signals=in_si_only(result.signals))
    written = save_result(result, target, units=not options.no_units)
    counts = {"rows": len(result.table), "signals": len(result.signals), "telegrams": len(result.events)}
    lines = [f"{', '.join(f'{number} {what}' for what, number in counts.items())}: {', '.join(map(str, written))}"]
    if wanted.name == "npy" and any(signal.unit != "1" for signal in result.signals):
        lines.append("A NumPy file keeps no units; .parquet, .h5, .mat and .csv do.")
    return Output(["\n".join(lines)], counts | {"written": written, "remarks": lines[1:]})
