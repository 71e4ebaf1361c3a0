"""The mutation study stands on its page as it comes out now: what is caught, what is not, and no false alarm.

A part of the changes is made again, each kind among them; new deliveries as blocks, whose numbers are those of the
FMUs.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import pytest

ROOT = Path(__file__).resolve().parents[3]
STUDIES = ROOT / "docs" / "studies"
PAGE = ROOT / "docs" / "reference" / "mutation_study.md"
NAMES = ("manoeuvre", "deliveries", "mutants", "repetitions", "verdicts", "mutations")
FEW_DELIVERIES = ("sign of an output", "unit km/h declared, numbers in km/h")
EVERY = 11  # of the runs with another parameter, or under other conditions

pytestmark = pytest.mark.compiler


@pytest.fixture(scope="module")
def study() -> Iterator[SimpleNamespace]:
    """The modules of the study; they find each other by name only, as a script does."""
    sys.path.insert(0, str(STUDIES))
    try:
        modules: dict[str, ModuleType] = {name: import_module(name) for name in NAMES}
    finally:
        sys.path.remove(str(STUDIES))
    yield SimpleNamespace(**modules)
    for name in NAMES:
        del sys.modules[name]


@pytest.fixture(scope="module")
def evaluate(study: Any) -> Iterator[Any]:
    with study.verdicts.evaluate() as evaluated:
        yield evaluated


def cells(change: str) -> list[str]:
    """The row of a change on the page, without the list of those not caught; changes have names of their own."""
    lines = [line for line in PAGE.read_text(encoding="utf-8").splitlines() if line.startswith(f"| {change} |")]
    return [cell.strip() for cell in max(lines, key=lambda line: line.count("|")).strip("| ").split(" | ")]


def as_on_the_page(study: Any, row: Any) -> bool:
    """Whether verdicts and finding are those of the page."""
    _, *verdicts, found = [*cells(row.change), "", "", ""][: 2 + len(row.caught)]
    return verdicts == [study.mutations.WORDS[caught] for caught in row.caught] and found == row.found


def chosen(study: Any) -> list[Any]:
    mutants = study.mutants
    runs = [*mutants.parameter_mutations(0.01), *mutants.parameter_mutations(0.001), *mutants.condition_mutations()]
    deliveries = [m for m in mutants.delivery_mutations() if m.change in FEW_DELIVERIES]
    return [*runs[::EVERY], *deliveries, *mutants.row_mutations()]


def test_changes_are_caught_and_missed_as_the_page_says(study: Any, evaluate: Any) -> None:
    rows = [evaluate.mutation(mutation, "block") for mutation in chosen(study)]
    assert [row.change for row in rows if not as_on_the_page(study, row)] == [], "run: python docs/studies/mutations.py"
    assert [row.change for row in rows if row.harmless and row.caught_by_default] == []
    assert [row.change for row in rows if not row.harmless and not row.caught_by_default and not row.why] == []


def test_the_unchanged_run_gives_no_alarm(study: Any, evaluate: Any) -> None:
    conditions, repetition = study.manoeuvre.Conditions, study.repetitions.Repetition
    ways = [
        repetition("Python", 1, conditions(stepper="python", order=study.manoeuvre.ORDER[::-1]).run),
        repetition("block", 1, conditions(backend="block", fmi_version=2).run),
        repetition("new process", 1, study.repetitions.in_new_process),
        *study.repetitions.other_steps(),
    ]
    rows = [row for way in ways for row in evaluate.repetition(way)]
    assert [(row.change, row.found, row.size) for row in rows if any(row.caught)] == []


def test_rows_that_do_not_nest_are_the_known_exception(evaluate: Any) -> None:
    row = evaluate.not_nested()
    assert row.caught_by_default
    assert row.found in PAGE.read_text(encoding="utf-8")


def test_the_page_shows_twenty_repetitions_and_every_change(study: Any) -> None:
    assert sum(r.times for r in study.repetitions.repetitions()) == study.repetitions.REPETITIONS == 20
    for mutation in study.mutants.all_mutations():
        assert len(cells(mutation.change)) > 1
    for repetition in (*study.repetitions.repetitions(), *study.repetitions.other_steps()):
        assert cells(repetition.what)[1:6] == [str(repetition.times), "0", "0", "0", "0"]
