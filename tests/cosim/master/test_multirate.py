"""Components at their own rates: what a slow one sees, what the others see of it, and the order that is left."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from linear_runs import load, prepare, run_cut
from mock_slaves import Counter, component
from test_fmus.masses import Chain, cuts

from cosim.errors import CouplingError
from cosim.master.control.multirate import set_rates
from cosim.master.master import close

CHAIN = Chain.two(damping=0.1)
CUT = cuts(CHAIN)["displacement-displacement"]


def test_a_slow_component_is_stepped_at_its_own_points_and_held_between(tmp_path: Path) -> None:
    seen = run_cut(CUT, CHAIN, tmp_path, 0.01, 40, every={"mass2": 4})
    calls = {s.component.name: s.component.calls for s in seen.master.plan.steps}
    assert calls == {"mass1": 40, "mass2": 10}
    slow = seen.table["mass2.p"]
    for k in range(0, 40, 4):
        assert (slow[k : k + 4] == slow[k]).all()
        assert slow[k + 4] != slow[k]


def test_a_slow_component_sees_what_is_there_when_its_step_ends(tmp_path: Path) -> None:
    """Fed one way, its values at its own points are those of a run in which everybody takes the long step."""
    one_way = [c for c in CUT.connections if c.startswith("mass1")]
    tables = []
    for h, count, every in ((0.01, 40, {"mass2": 4}), (0.04, 10, {})):
        master, _ = prepare(load(CUT, tmp_path, 2), one_way, h, count, every=every)
        master.run()
        close(master.plan)
        tables.append(master.recorder.table())
    np.testing.assert_allclose(tables[0]["mass2.p"][::4], tables[1]["mass2.p"], rtol=0.0, atol=1e-14)


@pytest.mark.parametrize(("inputs", "order"), [("hold", 1.0), ("extrapolate", 2.0)])
def test_the_order_is_that_of_the_lines(inputs: str, order: float, tmp_path: Path) -> None:
    """At the points at which all have been stepped; in between the slow one is held, which is of first order by
    itself.
    """
    errors = []
    for n in (100, 200, 400):
        seen = run_cut(
            CUT,
            CHAIN,
            tmp_path,
            1.0 / n,
            n,
            inputs=inputs,
            every={"mass2": 2},
            capabilities={"input_derivatives": True},
        )
        common = seen.table[::2]
        exact = CHAIN.reference(common["time"])
        errors.append(max(np.abs(common[signal] - exact[q]).max() for q, signal in CUT.signals.items()))
    assert np.log2(errors[1] / errors[2]) == pytest.approx(order, abs=0.15)


def test_the_line_of_a_slow_component_spans_its_own_step(tmp_path: Path) -> None:
    seen = run_cut(CUT, CHAIN, tmp_path, 0.01, 20, inputs="interpolate", every={"mass2": 4})
    history = seen.master.plan.find("mass2").interpolator.save()
    np.testing.assert_allclose(history.later_at, 0.2)
    np.testing.assert_allclose(history.earlier_at, 0.16)


def test_substeps_are_taken_and_change_nothing_for_inputs_that_are_held(tmp_path: Path) -> None:
    """The FMU is exact for a held input: its own step length is free."""
    whole = run_cut(CUT, CHAIN, tmp_path, 0.02, 25)
    parts = run_cut(CUT, CHAIN, tmp_path, 0.02, 25, substeps={"mass1": 5})
    calls = {s.component.name: s.component.calls for s in parts.master.plan.steps}
    assert calls == {"mass1": 125, "mass2": 25}
    for name in ("mass1.p", "mass2.v"):
        np.testing.assert_allclose(parts.table[name], whole.table[name], rtol=0.0, atol=1e-13)


def test_the_rest_of_the_run_is_stepped_too(tmp_path: Path) -> None:
    seen = run_cut(CUT, CHAIN, tmp_path, 0.01, 10, every={"mass2": 4})
    assert [s.component.time for s in seen.master.plan.steps] == pytest.approx([0.1, 0.1])
    assert {s.component.name: s.component.calls for s in seen.master.plan.steps}["mass2"] == 3


def rates(every: dict[str, int], substeps: dict[str, int] | None = None, taken: Any = None, vary: bool = True) -> None:
    counter = component(Counter(), "c")
    if not vary:
        counter.capabilities = type(counter.capabilities)()
    master, _ = prepare({"c": counter}, [], 0.1, 10)
    set_rates(master.plan, master.axis, every, substeps or {}, taken or {})


def test_rates_that_cannot_be_are_refused() -> None:
    with pytest.raises(CouplingError, match=r"c: 'every' and 'substeps' exclude each other"):
        rates({"c": 2}, {"c": 2})
    with pytest.raises(CouplingError, match=r"c: every = 2 is not possible: it is watched for balises"):
        rates({"c": 2}, taken={"c": "it is watched for balises"})
    with pytest.raises(
        CouplingError, match=r"every = 3 does not divide the 10 steps of the run, and the component cannot vary"
    ):
        rates({"c": 3}, vary=False)
    rates({"c": 5}, vary=False)
