"""The table of losses in docs/reference/events.md is what comes out: events passed on at their instants, and not."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from test_fmus.events import integrator_fmu, received_integral, receiver_fmu, timed_fmu, timed_integral, triggered_fmu

import cosim

PAGE = Path(__file__).parents[4] / "docs" / "reference" / "events.md"


def off(
    first: Path, second: Path, connections: list[str], step: float, exact: float, events: str = "propagate"
) -> float:
    """Error of the integral of the second component after 1 s."""
    scenario = (
        cosim.Scenario(stop=1.0, step=step, master={"events": events})
        .add("s", fmu=str(first))
        .add("r", fmu=str(second))
    )
    outcome = scenario.connect(*connections).run(warn=lambda _: None)
    assert outcome.failure is None
    return float(abs(outcome["r.integral"][-1] - exact))


@pytest.mark.compiler
@pytest.mark.parametrize("step", [0.1, 0.05, 0.02, 0.01])
def test_a_row_of_the_table_is_what_comes_out(tmp_path: Path, step: float) -> None:
    """Losses to the two digits shown; without a loss rounding is left, of which the page shows what it happened to
    be.
    """
    table = PAGE.read_text(encoding="utf-8").partition("| step | jumps, propagated |")[2]
    found = re.search(rf"^\| {1000 * step:g} ms \|(.*)\|$", table, re.MULTILINE)
    assert found is not None
    jumps, jumps_local, clock, clock_blind = (float(cell) for cell in found[1].split("|"))
    assert max(jumps, clock) < 1e-14
    timed, integrator = timed_fmu(tmp_path), integrator_fmu(tmp_path)
    assert off(timed, integrator, ["s.level -> r.u"], step, timed_integral(1.0)) < 1e-14
    assert off(timed, integrator, ["s.level -> r.u"], step, timed_integral(1.0), "local") == pytest.approx(
        jumps_local, rel=0.05
    )
    value = "s.crossing_value -> r.tick_value"
    exact = received_integral(1.0)
    assert off(triggered_fmu(tmp_path), receiver_fmu(tmp_path), ["s.crossing -> r.tick", value], step, exact) < 1e-14
    source, target = (
        triggered_fmu(tmp_path, "blind", event_mode=False),
        receiver_fmu(tmp_path, "deaf", event_mode=False),
    )
    assert off(source, target, [value], step, exact) == pytest.approx(clock_blind, rel=0.05)
