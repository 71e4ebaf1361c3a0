"""Laws of demands: what is certified is what a finding covers, neither more nor less."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

from hypothesis import example, given, settings
from hypothesis import strategies as st

from cosim.certify import Certified, Demands, certified
from fmu_observer.certificates.finding import Finding, Kind
from fmu_observer.observers.generic.delayed import DelayedStateObserver
from fmu_observer.observers.train import DifferentiatorCdo

TRAIN = DifferentiatorCdo()
PREDICTOR = DelayedStateObserver("flexible_joint_arm", memory_places=60)


@cache
def of_train(demands: Demands) -> Certified:
    return certified("train", TRAIN, demands)


@given(period=st.floats(0.01, 3.0))
@settings(max_examples=15, deadline=None)
def test_a_constant_gap_is_certified_below_its_limit(period: float) -> None:
    (limit,) = (found.value for found in of_train(Demands()).findings if found.kind == "exact")
    found = of_train(Demands(period=period))
    (demanded,) = found.demanded
    assert (demanded.holds, demanded.demand) == (period < limit, period)
    assert (found.unmet == []) == (period < limit)
    assert demanded in found.findings  # the table shows that it was held against


@given(delay=st.floats(0.01, 0.6))
@settings(max_examples=5, deadline=None)
def test_a_delay_is_certified_where_predictors_and_memory_bear_it(delay: float) -> None:
    p = PREDICTOR.unpack_parameters(PREDICTOR.start_parameters())
    memory = PREDICTOR.total_places * float(p.memory_period)
    found = certified("arm", PREDICTOR, Demands(delay=delay))
    assert [f.holds for f in found.demanded] == [delay < 0.19594, delay <= memory] or abs(delay - 0.196) < 1e-3
    assert all("delay" in text or "declared_memory" in text for text in found.unmet)


def test_what_is_not_demanded_is_not_held_against() -> None:
    assert of_train(Demands()).demanded == ()
    assert all(isinstance(f, Finding) and f.holds is None for f in of_train(Demands()).findings)


@dataclass(frozen=True)
class Searched:
    """What is known of an observer is one limit."""

    limit: Finding
    parameter_signals = triggered_events = ()

    def findings(self, *_: object) -> list[Finding]:
        return [self.limit]


@given(period=st.floats(0.1, 2.0), kind=st.sampled_from(["exact", "not found up to"]))
@example(period=1.0, kind="exact")
@example(period=1.0, kind="not found up to")
def test_up_to_where_a_search_found_no_limit_includes_its_end_and_a_limit_does_not(period: float, kind: Kind) -> None:
    found = certified("o", Searched(Finding("constant gap", 1.0, "s", kind, "a test")), Demands(period=period))
    assert (found.unmet == []) == (period < 1.0 or (period == 1.0 and kind == "not found up to"))
