"""``cosim baseline``: make, check, show and update baselines, put them into an FMU and take them out."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cosim.baselines import check, read_baseline
from cosim.baselines.baseline_files import baseline_path, write_texts
from cosim.baselines.call import Call
from cosim.baselines.header_data import header_data
from cosim.baselines.recipe import Recipe
from cosim.baselines.references import embed_baseline, find_references, read_reference
from cosim.baselines.references.extract import extract_reference
from cosim.baselines.subject import Subject, make_subject, run_again
from cosim.baselines.update import plan_update
from cosim.cli.arguments import FIGURE_FILES, OVERRIDES, QUIET, number_from_zero, positive_number, settings_argument
from cosim.cli.scenarios import between_samples, parse_setting, simulated_time_bar
from cosim.cli.stated_units import UNIT, stated_of
from cosim.cli.tolerances import TOLERANCES, Asked, asked_tolerances, chosen_tolerances
from cosim.comparison.compare import curve_of
from cosim.comparison.comparison_text import comparison_parts, comparison_verdict, difference_parts
from cosim.comparison.tolerance import Tolerances
from cosim.components.description import read_description
from cosim.errors import BaselineError, OutputError
from cosim.report.page.picture_files import Pictures
from cosim.results.load_result import load_result
from fmus.cli.commands import Action, Actions, Argument, ArgumentGroup, Execute, argument
from fmus.cli.output import Output
from fmus.cli.progress import ProgressBar
from fmus.tables.table import Parts, Table, name_column, text_column

if TYPE_CHECKING:
    from cosim.baselines import Baseline, Regression
    from cosim.baselines.update import Update

DIFFERS = 1
CODES = "0 equal within tolerance, 1 different, 2 error"


FILE = argument("file", metavar="FILE.json", help="the baseline; its tables stand beside it")
FORCE = argument("--force", action="store_true", help="replace a baseline that is there already")
ALLOWED = ArgumentGroup(TOLERANCES, "tolerances", "those in the baseline, or the usual ones, where not given")
_MAKE = (
    argument("subject", metavar="FMU_OR_SCENARIO", help="an FMU, a scenario by name or file, or a results folder"),
    FILE,
    settings_argument(f"of a scenario: {OVERRIDES}; of an FMU: a start value or a constant input"),
    UNIT,
    argument("--inputs", metavar="TABLE", help="of an FMU: a table with a column for each input"),
    argument(
        "--between",
        nargs="+",
        default=[],
        metavar="[NAME=]hold|linear",
        help="what inputs of the table do between its rows (default: linear, held where discrete)",
    ),
    argument("--start", type=float, metavar="SECONDS", help="begin of the run [s]"),
    argument("--stop", type=float, metavar="SECONDS", help="end of the run [s]"),
    argument("--step", type=positive_number, metavar="SECONDS", help="communication step of the run [s]"),
    argument(
        "--record", nargs="+", default=[], metavar="NAME", help="of an FMU: variables to record besides the outputs"
    ),
    argument("--signals", nargs="+", action="extend", metavar="PATTERN", help="signals to keep (default: all)"),
    argument(
        "--every",
        type=number_from_zero,
        metavar="SECONDS",
        help="least spacing of the rows [s] (default: about 2000 rows)",
    ),
    FORCE,
    ALLOWED,
)
CHECK = (
    argument("file", metavar="FILE.json", help="the baseline, or an FMU that holds references"),
    argument("--against", metavar="FMU_OR_RESULT", help="another FMU to run, or a results folder or table to compare"),
    argument("--reference", metavar="NAME", help="of several references in an FMU: this one only"),
    argument("--plots", metavar="DIR", help="write a page and pictures of what differs to this folder"),
    FIGURE_FILES,
    argument("--verbose", action="store_true", help="print all signals and everything that was found"),
    ALLOWED,
)
_EMBED = (
    FILE,
    argument("fmu", metavar="FMU", help="the FMU that the baseline is of"),
    argument("-o", "--output", metavar="COPY.fmu", required=True, help="the copy; may be the FMU itself"),
    argument("--name", help="of the reference (default: that of the baseline)"),
)
_EXTRACT = (
    argument("fmu", metavar="FMU", help="the FMU that holds it"),
    FILE,
    argument("--reference", metavar="NAME", help="which one, where there are several"),
    FORCE,
)


_COLUMNS = (
    name_column("signal"),
    text_column("allowed", meaning="How far a value may differ", write="+- {:.3g}".format),
    text_column("unit"),
    text_column("description"),
)


def _make(options: argparse.Namespace) -> Output:
    if Path(options.subject).suffix.lower() == ".json":
        raise BaselineError(f"{options.subject}: expected what is run, an FMU or a scenario, and behind it FILE.json.")
    path = _free(baseline_path(options.file), options.force)
    tolerances = chosen_tolerances(options, asked_tolerances(options), Tolerances())
    subject = _subject(options)
    stated = subject.outcome or subject.result
    update = plan_update(stated, path, tolerances, recipe=subject.recipe, signals=options.signals, every=options.every)
    return _written(update, path)


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
            **_values(options),
        )


def _values(options: argparse.Namespace) -> dict[str, Any]:
    """What ``--set`` and ``--inputs`` mean: overrides of a scenario; constant inputs and start values of an FMU."""
    values = dict(parse_setting(setting) for setting in options.settings)
    stated = stated_of(options.subject, options.unit)
    if Path(options.subject).suffix.lower() != ".fmu":
        return {"overrides": values, "inputs": options.inputs}
    variables = read_description(options.subject, options.subject).modelVariables
    held = {v.name: values.pop(v.name) for v in variables if v.causality == "input" and v.name in values}
    if held and options.inputs:
        raise BaselineError(
            f"Give the inputs in the table {options.inputs} or with --set, not both: {', '.join(held)}."
        )
    units = {name: fact.model_dump(exclude_defaults=True) for name, fact in stated.items()}
    return {"inputs": options.inputs or held, "parameters": values, "units": units}


def _check(options: argparse.Namespace) -> Output:
    asked = asked_tolerances(options)
    found = [_check_one(baseline, asked, options) for baseline in _baselines(options)]
    data = [one.to_dict() for one in found] if len(found) > 1 else found[0].to_dict()
    if len(found) == 1:
        parts, verdict = difference_parts(found[0], options.verbose), comparison_verdict(found[0])
    else:
        parts = [part for one in found for part in comparison_parts(one, options.verbose)]
        verdict = _of_several(found)
    output = Output(parts, data, verdict=verdict)
    output = output if all(one.equal for one in found) else replace(output, code=DIFFERS, role="bad")
    folder = options.plots or ("." if options.figures else None)
    return output if folder is None else _drawn(output, found, Path(folder), options.figures or True)


def _of_several(found: Sequence[Regression]) -> str:
    """Whether all references are met, in a line."""
    bad = [one.reference for one in found if not one.equal]
    return f"{len(found) - len(bad)} of {len(found)} references agree" + (f"; {', '.join(bad)} DIFFER." if bad else ".")


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
        subject = run_again(baseline, other, bar)
    return check(
        subject.outcome or subject.result, baseline, tolerances, label=Path(other or subject.recipe.source).name
    )


def _drawn(output: Output, found: Sequence[Regression], folder: Path, figures: Pictures) -> Output:
    """The same with the pages; what was found is kept where one cannot be written."""
    from cosim.report.page.comparison import write_comparison  # noqa: PLC0415 - only for those who write

    files: dict[str, Path] = {}
    try:
        for one in found:
            several = len(found) > 1
            paths = write_comparison(one, folder / one.reference if several else folder, pictures=figures)
            files |= {f"{kind} of {one.reference}" if several else kind: path for kind, path in paths.items()}
    except OutputError as error:
        return replace(output, files=files, error=error)
    return replace(output, files=files)


def _show(options: argparse.Namespace) -> Output:
    baseline = read_baseline(options.file)
    data = header_data(baseline.header, baseline.path.parent) | {"notes": list(baseline.notes)}
    return Output(_header(baseline), data)


def _update(options: argparse.Namespace) -> Output:
    baseline = read_baseline(options.file)
    tolerances = chosen_tolerances(options, asked_tolerances(options), baseline.tolerances)
    with _progress(options) as bar:
        subject = run_again(baseline, None, bar)
    header = baseline.header
    update = plan_update(
        subject.outcome or subject.result,
        baseline.path,
        tolerances,
        recipe=header.recipe,
        signals=header.selection,
        every=header.every,
    )
    return _written(update, baseline.path)


def _written(update: Update, path: Path) -> Output:
    if update.texts:
        write_texts(dict(update.texts), path)
    return _change(update, path)


def _embed(options: argparse.Namespace) -> Output:
    target = embed_baseline(read_baseline(options.file), options.fmu, options.output, options.name)
    return Output([f"{target} holds {options.name or Path(options.file).stem}."], {"file": str(target)})


def _extract(options: argparse.Namespace) -> Output:
    path = _free(baseline_path(options.file), options.force)
    extract_reference(options.fmu, path, options.reference)
    return Output([f"{path} written."], {"file": str(path)})


def _change(update: Update, path: Path) -> Output:
    """What was written."""
    notes = [*update.notes, *(Call.worst(update.before) if update.before is not None else [])]
    rows = update.after.baseline.header.rows if update.after.baseline is not None else 0
    line = f"{path}: {update.change}, {len(update.after.signals)} signals, {rows} rows."
    data = {"file": str(path), "change": update.change, "notes": notes}
    return Output(["\n".join(f"note: {note}" for note in notes)], data, verdict=line)


def _header(baseline: Baseline) -> Parts:
    """What a baseline is of."""
    header = baseline.header
    span = header.span
    telegrams = "" if header.events is None else f", {header.events} telegrams"
    lines = [
        f"{baseline.path}: {header.title}",
        f"  {span['start']:g} to {span['stop']:g} s at {span['step']:g} s steps; {header.rows} rows{telegrams}",
        f"  run again from: {header.recipe.source or 'nothing (made from a result)'}",
    ]
    for entry in header.components:
        file = f", {entry.file}" if entry.file else ""
        lines.append(f"  {entry.name}: model {entry.model}, FMI {entry.fmi_version}, GUID {entry.guid}{file}")
        lines += [f"    {name} = {value}" for name, value in entry.parameters.items()]
    versions = ", ".join(f"{name} {value}" for name, value in header.versions.items()) or "not known"
    remarks = [f"ignored: {pattern}" for pattern in header.tolerances.ignore]
    remarks += [f"note: {note}" for note in baseline.notes]
    rows = [[info.name, _allowed(baseline, info.name), info.unit, info.description] for info in header.signals]
    text = "\n".join([*lines, f"  made with: {versions}"])
    return [text, Table("allowed", _COLUMNS, rows), "\n".join(f"  {remark}" for remark in remarks)]


def _allowed(baseline: Baseline, name: str) -> float:
    """Largest error of a signal that is allowed, in its unit."""
    return baseline.tolerances.value_for(name, curve_of(baseline.result, name))


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


def _action(
    name: str,
    execute: Execute,
    text: str,
    arguments: Sequence[Argument | ArgumentGroup],
    codes: str = "0 done, 2 error",
    *,
    looks: bool = False,
) -> Action:
    words = {"help": text, "description": f"{text[0].upper()}{text[1:]}.", "epilog": f"Exit codes: {codes}."}
    return Action(name, execute, words, (QUIET, *arguments), looks)


GROUP = "Compare"
PLACE = 4
HELP = "make, check and update baselines"
LOOKS = False
EXAMPLES = (
    "cosim baseline make vendor.toml vendor.json",
    "cosim baseline make vendor.fmu vendor.json --stop 60 --step 0.01",
    "cosim baseline check vendor.json",
    "cosim baseline check vendor.json --against new/vendor.fmu",
    "cosim baseline show vendor.json",
    "cosim baseline update vendor.json",
    "cosim baseline embed vendor.json vendor.fmu -o vendor_with_reference.fmu",
    "cosim baseline extract vendor_with_reference.fmu vendor.json",
)
PARSER = {"description": "Keep a result as a baseline, and check later ones against it."}
ARGUMENTS = (
    Actions(
        (
            _action("make", _make, "run an FMU or a scenario and keep its outputs", _MAKE),
            _action("check", _check, "run again, or take a given result, and compare", CHECK, CODES),
            _action("show", _show, "show what a baseline is of", (FILE,), looks=True),
            _action("update", _update, "run again and accept the outputs as they are now", (FILE, ALLOWED)),
            _action("embed", _embed, "write a copy of an FMU that holds the baseline (FMI-LS-REF)", _EMBED, looks=True),
            _action(
                "extract", _extract, "take a reference (FMI-LS-REF) out of an FMU as a baseline", _EXTRACT, looks=True
            ),
        )
    ),
)
