"""Every FMU that ships passes its own check clean, in both FMI versions, and the master's probe says the same of it."""

from __future__ import annotations

from typing import Any

import pytest

from fmus import RECIPES, cached_fmu, recipe
from fmus.check import Class, Verdict, check_fmu
from fmus.check.checked_instance import make_slave
from fmus.check.probe import probe
from fmus.fmi.archive import open_archive

pytestmark = pytest.mark.compiler


@pytest.mark.parametrize("version", [2, 3])
@pytest.mark.each_kind
@pytest.mark.parametrize("name", list(RECIPES))
def test_a_shipped_fmu_passes_clean(name: str, version: Any) -> None:
    report = check_fmu(cached_fmu(recipe(name), version))
    assert {f.check: f.detail for f in report.findings if f.verdict not in (Verdict.PASS, Verdict.SKIPPED)} == {}
    assert report.verdict is Class.USE
    passed = {f.check for f in report.findings if f.verdict is Verdict.PASS}
    assert {
        "divided steps",
        "short step",
        "state round trip",
        "state in another instance",
        "reset and re-run",
    } <= passed


@pytest.mark.parametrize("version", [2, 3])
def test_directional_derivatives_are_found_and_compared(version: Any) -> None:
    """In FMI 3.0 the capability has another name, which fmpy does not read."""
    report = check_fmu(cached_fmu(recipe("locomotive"), version))
    for check in ("directional derivatives", "model exchange: directional derivatives"):
        assert report.finding(check).verdict is Verdict.PASS
        assert "derivatives agree with finite differences" in report.finding(check).detail


@pytest.mark.parametrize("version", [2, 3])
def test_the_probe_takes_the_instances_of_the_check(version: Any) -> None:
    archive = open_archive(cached_fmu(recipe("locomotive"), version))
    with archive.unpacked() as folder:
        report = probe(lambda: make_slave(folder, archive.description), {"mass": 60e3}, 0.0, 0.1)
    assert (report.honest_step, report.exact_state, report.repeatable, report.excited) == (True,) * 4, report.remarks
