"""Checks that a program registers, and those of packages that are wrong, in a check run."""

from __future__ import annotations

import sys
from importlib import import_module
from importlib.metadata import EntryPoint
from pathlib import Path

import pytest

from fmus import cached_fmu
from fmus.check import Verdict, check_fmu
from fmus.check.check import Check
from fmus.check.context import Context
from fmus.check.findings import CheckOutcome, passed
from fmus.check.known_checks import CHECKS
from fmus.recipes import recipe
from plant_models import registry

OWN = """
from fmus.check.check import NOTE, Check
from fmus.check.findings import noted


class OutputsCheck(Check, failing=NOTE):
    name = "outputs"

    @staticmethod
    def run(context):
        return noted(f"{sum(v.causality == 'output' for v in context.description.modelVariables)} outputs")


class TextCheck(Check):
    name = "text"
    failing = NOTE

    @staticmethod
    def run(context):
        return "fine"
"""


@pytest.fixture
def few(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two shipped checks, and an announced one that cannot be loaded."""
    group = CHECKS.group
    entries = [EntryPoint("gone", "no_such_module:Gone", group)]
    monkeypatch.setattr(registry, "announced", lambda group: entries if group == CHECKS.group else [])
    monkeypatch.setattr(CHECKS, "_members", None)
    kept = {name: CHECKS.members[name] for name in ("loading", "initialise", "gone")}
    monkeypatch.setattr(CHECKS, "_members", kept)
    monkeypatch.setattr(CHECKS, "_own", {})


@pytest.mark.usefixtures("few")
def test_a_registered_check_is_made_by_the_child_process(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "own_checks.py").write_text(OWN)
    monkeypatch.syspath_prepend(str(tmp_path))
    CHECKS["outputs"] = import_module("own_checks").OutputsCheck
    CHECKS["text"] = import_module("own_checks").TextCheck
    report = check_fmu(cached_fmu(recipe("odometer")))
    assert report.finding("outputs").detail == "2 outputs"
    assert report.finding("text").verdict is Verdict.ERROR
    assert "of this check, not of the FMU" in report.finding("text").detail
    assert "run() returned str; expected a CheckOutcome" in report.finding("text").detail
    left_out = report.finding("gone")
    assert left_out.verdict is Verdict.NOTE
    assert "left out: the check 'gone' of an installed package (no_such_module:Gone) cannot be" in left_out.detail
    (tmp_path / "own_checks.py").write_text("1 / 0\n")
    broken = check_fmu(cached_fmu(recipe("odometer")))
    assert broken.finding("outputs").verdict is Verdict.ERROR
    assert "own_checks.py cannot be run: ZeroDivisionError" in broken.finding("outputs").detail
    assert broken.finding("loading").verdict is Verdict.PASS
    del sys.modules["own_checks"]


@pytest.mark.usefixtures("few")
def test_a_check_that_no_other_process_finds_is_refused() -> None:
    class Hidden(Check):
        name = "hidden"

        @staticmethod
        def run(context: Context) -> CheckOutcome:
            return passed(str(context))

    CHECKS["hidden"] = Hidden
    with pytest.raises(ValueError, match="Hidden cannot be found again; define it at the top level of a file"):
        check_fmu(cached_fmu(recipe("odometer")))
    Hidden.__module__ = "__main__"
    with pytest.raises(ValueError, match="'hidden' stands in the program itself; put it into a file and import that"):
        check_fmu(cached_fmu(recipe("odometer")))
    with pytest.raises(ValueError, match=r"the check 'number' is no subclass of fmus\.check\.check\.Check"):
        CHECKS["number"] = 3  # type: ignore[assignment]


def test_a_misspelt_keyword_of_a_check_is_refused() -> None:
    with pytest.raises(TypeError, match="MisspeltCheck: a check has no 'advise'; it has name, failing, advice, basis"):
        type("MisspeltCheck", (Check,), {}, advise="none")
