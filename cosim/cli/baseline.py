"""``cosim baseline``: make, check, show and update baselines, put them into an FMU and take them out."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cosim.baselines import check, read_baseline
from cosim.baselines.data import header_data
from cosim.baselines.files import baseline_path, write_texts
from cosim.baselines.recipe import Recipe
from cosim.baselines.references import embed_baseline, find_references, read_reference
from cosim.baselines.references.extract import extract_reference
from cosim.baselines.subject import Subject, make_subject, run_again
from cosim.baselines.update import plan_update
from cosim.cli.baseline_text import print_json, tell_change, tell_comparison, tell_header
from cosim.cli.scenarios import OVERRIDES, between_samples, parse_setting, simulated_time_bar
from cosim.cli.tolerances import Asked, add_tolerances, asked_tolerances, chosen_tolerances
from cosim.comparison.tolerance import Tolerances
from cosim.components.description import read_description
from cosim.errors import BaselineError
from cosim.results.load import load_result
from fmus.cli.progress import ProgressBar

if TYPE_CHECKING:
    from cosim.baselines import Baseline, Regression
    from cosim.baselines.subject import Subject
    from cosim.comparison.tolerance import Tolerances

DONE, DIFFERS = 0, 1
EPILOG = "Exit codes: 0 equal within tolerance or done, 1 different, 2 error."


def register(commands: Any) -> None:
    """Add the command and its actions to the parser.

    Args:
        commands: subparsers of the program.
    """
    description = "Keep a result as a baseline, and check later ones against it."
    parser = commands.add_parser("baseline", description=description, epilog=EPILOG)
    actions = parser.add_subparsers(dest="action", required=True, metavar="ACTION")
    _register_make(actions)
    _register_check(actions)
    show = _action(actions, "show", "show what a baseline is of", _show)
    _add_file(show)
    update = _action(actions, "update", "run again and accept the outputs as they are now", _update)
    _add_file(update)
    _add_tolerances(update)
    _register_references(actions)


def _register_make(actions: Any) -> None:
    make = _action(actions, "make", "run an FMU or a scenario and keep its outputs", _make)
    make.add_argument(
        "subject", metavar="FMU_OR_SCENARIO", help="an FMU, a scenario by name or file, or a results folder"
    )
    _add_file(make)
    make.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="NAME=VALUE",
        dest="settings",
        help=f"of a scenario: {OVERRIDES}; of an FMU: a start value or a constant input",
    )
    make.add_argument("--inputs", metavar="TABLE", help="of an FMU: a table with a column for each input")
    make.add_argument(
        "--between",
        nargs="+",
        default=[],
        metavar="[NAME=]hold|linear",
        help="what inputs of the table do between its rows (default: linear, held where discrete)",
    )
    for key, what in (("start", "begin"), ("stop", "end"), ("step", "communication step")):
        make.add_argument(f"--{key}", type=float, metavar="SECONDS", help=f"{what} of the run [s]")
    make.add_argument(
        "--record", nargs="+", default=[], metavar="NAME", help="of an FMU: variables to record besides the outputs"
    )
    make.add_argument("--signals", nargs="+", action="extend", metavar="PATTERN", help="signals to keep (default: all)")
    make.add_argument(
        "--every", type=float, metavar="SECONDS", help="least spacing of the rows [s] (default: about 2000 rows)"
    )
    make.add_argument("--force", action="store_true", help="replace a baseline that is there already")
    _add_tolerances(make)


def _register_check(actions: Any) -> None:
    check = _action(actions, "check", "run again, or take a given result, and compare", _check)
    check.add_argument("file", metavar="FILE.json", help="the baseline, or an FMU that holds references")
    check.add_argument(
        "--against", metavar="FMU_OR_RESULT", help="another FMU to run, or a results folder or table to compare"
    )
    check.add_argument("--reference", metavar="NAME", help="of several references in an FMU: this one only")
    check.add_argument("--plots", metavar="DIR", help="write a page with pictures of what differs to this folder")
    check.add_argument("--verbose", action="store_true", help="print all signals and everything that was found")
    _add_tolerances(check)


def _register_references(actions: Any) -> None:
    embed = _action(actions, "embed", "write a copy of an FMU that holds the baseline (FMI-LS-REF)", _embed)
    _add_file(embed)
    embed.add_argument("fmu", metavar="FMU", help="the FMU that the baseline is of")
    embed.add_argument("-o", "--output", metavar="COPY.fmu", required=True, help="the copy; may be the FMU itself")
    embed.add_argument("--name", help="of the reference (default: that of the baseline)")
    extract = _action(actions, "extract", "take a reference (FMI-LS-REF) out of an FMU as a baseline", _extract)
    extract.add_argument("fmu", metavar="FMU", help="the FMU that holds it")
    _add_file(extract)
    extract.add_argument("--reference", metavar="NAME", help="which one, where there are several")
    extract.add_argument("--force", action="store_true", help="replace a baseline that is there already")


def _action(actions: Any, name: str, help_text: str, execute: Any) -> argparse.ArgumentParser:
    parser: argparse.ArgumentParser = actions.add_parser(
        name, help=help_text, description=f"{help_text[0].upper()}{help_text[1:]}."
    )
    parser.add_argument("--json", action="store_true", help="print JSON instead of text")
    parser.add_argument("--quiet", action="store_true", help="no progress bar")
    parser.set_defaults(execute=execute)
    return parser


def _add_file(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("file", metavar="FILE.json", help="the baseline; its tables stand beside it")


def _add_tolerances(parser: argparse.ArgumentParser) -> None:
    add_tolerances(parser.add_argument_group("tolerances", "those in the baseline, or the usual ones, where not given"))


# -- actions ----------------------------------------------------------------------------------------------------------


def _make(options: argparse.Namespace) -> int:
    path = _free(baseline_path(options.file), options.force)
    tolerances = chosen_tolerances(options, asked_tolerances(options), Tolerances())
    subject = _subject(options)
    given = subject.outcome or subject.result
    update = plan_update(given, path, tolerances, recipe=subject.recipe, signals=options.signals, every=options.every)
    return _write(update, path, options)


def _subject(options: argparse.Namespace) -> Subject:
    if Path(options.subject).is_dir():
        return Subject(Recipe(), load_result(options.subject))
    with _progress(options) as bar:
        return make_subject(
            options.subject,
            Path(),
            start=options.start,
            stop=options.stop,
            step=options.step,
            record=options.record,
            interpolation=between_samples(options.between),
            progress=bar,
            warn=_warn,
            **_values(options),
        )


def _values(options: argparse.Namespace) -> dict[str, Any]:
    """What ``--set`` and ``--inputs`` mean: overrides of a scenario; constant inputs and start values of an FMU."""
    values = dict(parse_setting(setting) for setting in options.settings)
    if Path(options.subject).suffix.lower() != ".fmu":
        return {"overrides": values, "inputs": options.inputs}
    variables = read_description(options.subject, options.subject).modelVariables
    held = {v.name: values.pop(v.name) for v in variables if v.causality == "input" and v.name in values}
    if held and options.inputs:
        raise BaselineError(
            f"Give the inputs in the table {options.inputs} or with --set, not both: {', '.join(held)}."
        )
    return {"inputs": options.inputs or held, "parameters": values}


def _check(options: argparse.Namespace) -> int:
    asked = asked_tolerances(options)
    found = [_check_one(baseline, asked, options) for baseline in _baselines(options)]
    if options.json:
        print_json([one.to_dict() for one in found] if len(found) > 1 else found[0].to_dict())
    else:
        for one in found:
            tell_comparison(one, options.verbose)
    if options.plots:
        _draw(found, options)
    return DONE if all(one.equal for one in found) else DIFFERS


def _baselines(options: argparse.Namespace) -> list[Baseline]:
    if Path(options.file).suffix.lower() != ".fmu":
        return [read_baseline(options.file)]
    names = [reference.name for reference in find_references(options.file)]
    if options.reference or len(names) < 2:
        return [read_reference(options.file, options.reference)]
    return [read_reference(options.file, name) for name in names]


def _check_one(baseline: Baseline, asked: Asked, options: argparse.Namespace) -> Regression:
    tolerances: Tolerances = chosen_tolerances(options, asked, baseline.tolerances)
    other = options.against
    if other is not None and Path(other).suffix.lower() != ".fmu":
        return check(load_result(other), baseline, tolerances, label=other)
    with _progress(options) as bar:
        subject = run_again(baseline, other, bar, _warn)
    return check(
        subject.outcome or subject.result, baseline, tolerances, label=Path(other or subject.recipe.source).name
    )


def _draw(found: list[Regression], options: argparse.Namespace) -> None:
    from cosim.report.page.comparison import write_comparison  # noqa: PLC0415 - matplotlib only for those who look

    for one in found:
        folder = Path(options.plots) / one.reference if len(found) > 1 else Path(options.plots)
        for kind, path in write_comparison(one, folder).items():
            print(f"{kind:>10}: {path}", file=sys.stderr if options.json else sys.stdout)


def _show(options: argparse.Namespace) -> int:
    baseline = read_baseline(options.file)
    if options.json:
        print_json(header_data(baseline.header, baseline.path.parent) | {"notes": list(baseline.notes)})
    else:
        tell_header(baseline)
    return DONE


def _update(options: argparse.Namespace) -> int:
    baseline = read_baseline(options.file)
    tolerances = chosen_tolerances(options, asked_tolerances(options), baseline.tolerances)
    with _progress(options) as bar:
        subject = run_again(baseline, None, bar, _warn)
    header = baseline.header
    update = plan_update(
        subject.outcome or subject.result,
        baseline.path,
        tolerances,
        recipe=header.recipe,
        signals=header.selection,
        every=header.every,
    )
    return _write(update, baseline.path, options)


def _write(update: Any, path: Path, options: argparse.Namespace) -> int:
    if update.texts:
        write_texts(update.texts, path)
    tell_change(update, path, options.json)
    return DONE


def _embed(options: argparse.Namespace) -> int:
    target = embed_baseline(read_baseline(options.file), options.fmu, options.output, options.name)
    print_json({"file": str(target)}) if options.json else print(
        f"{target} holds {options.name or Path(options.file).stem}."
    )
    return DONE


def _extract(options: argparse.Namespace) -> int:
    path = _free(baseline_path(options.file), options.force)
    extract_reference(options.fmu, path, options.reference)
    print_json({"file": str(path)}) if options.json else print(f"{path} written.")
    return DONE


def _free(path: Path, force: bool) -> Path:
    """A path where nothing is lost by writing.

    Raises:
        BaselineError: a baseline is there already.
    """
    if path.exists() and not force:
        raise BaselineError(
            f"{path} exists already; accept new outputs with 'cosim baseline update', or replace it with --force."
        )
    return path


def _progress(options: argparse.Namespace) -> ProgressBar:
    return simulated_time_bar(silent=options.quiet or options.json)


def _warn(text: str) -> None:
    print(f"warning: {text}", file=sys.stderr, flush=True)
