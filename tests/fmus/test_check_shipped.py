"""Every FMU that ships passes its own check clean, in both FMI versions, and the master's probe says the same of it."""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fmus import RECIPES, cached_fmu, recipe
from fmus.check import Class, Verdict, check_fmu
from fmus.check.behaviour import honest_step
from fmus.check.checked_instance import make_slave
from fmus.check.probe import probe
from fmus.check.runner import Runner
from fmus.fmi.archive import open_archive
from plant_models import PLANTS
from plant_models.hybrid import HybridSystem, Signal

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


WHEEL_RADIUS = 0.575
"""Of trains that ship [m]: a wheel rolls at the speed of the train divided by it."""
SPEEDS = (0.0, 1e-3, 20.0)
"""From standstill, stopping, at speed [m/s]."""
ZONES = ((-100.0, 2900.0), (4000.0, 4300.0), (5000.0, 5300.0))
"""Slippery places [m], from the start on."""


def _starts(system: HybridSystem, speed: float, slippery: bool) -> dict[str, float]:
    """Start values of a plant that moves at `speed` [m/s], on slippery rails where it knows of any."""
    rates = {"m/s": speed, "rad/s": speed / WHEEL_RADIUS}
    rolling = {n: rates[s.unit] for s in system.states if s.unit in rates for n in _elements(s)}
    laid = [_elements(s) for s in system.parameters if s.name in ("zone_from", "zone_to")]
    zones = {n: ends[side] for side, names in enumerate(laid) for n, ends in zip(names, ZONES, strict=False)}
    return rolling | (zones if slippery else {})


def _elements(signal: Signal) -> list[str]:
    return [f"{signal.name}[{i + 1}]" for i in range(signal.size)] if signal.size else [signal.name]


@pytest.mark.slow
@pytest.mark.parametrize("name", list(PLANTS))
def test_no_shipped_plant_is_called_a_liar(name: str) -> None:
    """At any step from 10 us to 1 s, from standstill, stopping, at speed, in a slippery zone."""
    system = recipe(name)
    archive = open_archive(cached_fmu(system, 3))
    trains = any(s.unit == "m/s" for s in system.states)
    states = st.tuples(st.sampled_from(SPEEDS), st.booleans()) if trains else st.just((0.0, False))
    with archive.unpacked() as folder:

        @settings(max_examples=10, deadline=None)
        @given(st.floats(-5.0, 0.0), states)
        def law(exponent: float, state: tuple[float, bool]) -> None:
            starts = _starts(system, *state) if trains else {}
            with Runner(lambda: make_slave(folder, archive.description), starts, 0.0, 10.0**exponent) as runner:
                runner.excite()
                assert honest_step(runner) == ""

        law()
