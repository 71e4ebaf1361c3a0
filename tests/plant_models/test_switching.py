"""Edges of zones are exact events: what comes out moves with them, and no stage of an integration step sees one
early.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from railway_runs import rolling, started
from toy_systems import Booster, ImplicitBooster
from train_runs import start

from plant_models import Locomotive
from plant_models.hybrid import HybridSystem, Runtime, state, vector
from plant_models.railway.vehicle import Train

STOP, STEP, EFFORT = 3.0, 0.01, 80e3
IN_TIME = {"zone_from[1]": 0.5003, "zone_to[1]": 1.2, "zone_from[2]": 2.0, "zone_to[2]": 2.50019}
ON_TRACK = {"zone_from[1]": 5.0003, "zone_to[1]": 12.0, "zone_from[2]": 20.0, "zone_to[2]": 25.0019}
UNUSED = {"zone_from[3]": 0.0, "zone_to[3]": 0.0}
SHARPEST = {"speed": 3.0, "wheel_speed": 400.0}
"""What a zone moved by 1 s or 1 m may change, in m/s: at an edge the rail's force jumps by up to 190 kN, 2.1 m/s2 of
the locomotive and, of a wheel of 680 kg at its rim, 280 m/s2."""

TRAINS: Mapping[str, tuple[HybridSystem, Any, dict[str, float]]] = {
    "locomotive in time": (Locomotive(), rolling(10.0), IN_TIME),
    "locomotive on the track": (Locomotive(zones="position"), rolling(10.0), ON_TRACK),
    "train in time": (Train(wagons=1, zones="time"), start(Train(wagons=1), 10.0), IN_TIME),
    "train on the track": (Train(wagons=1), start(Train(wagons=1), 10.0), ON_TRACK),
}


def _running(name: str, shift: float = 0.0) -> Runtime:
    system, x0, zones = TRAINS[name]
    runtime = started(system, x0=x0, **{edge: at + shift for edge, at in zones.items()}, **UNUSED)
    runtime.u[0] = EFFORT
    return runtime


def _speeds(runtime: Runtime) -> np.ndarray:
    columns = [[s.name for s in runtime.system.outputs].index(name) for name in SHARPEST]
    rows = []
    for k in range(1, round(STOP / STEP) + 1):
        runtime.advance(k * STEP)
        rows.append(runtime.update_outputs()[columns])
    return np.array(rows)


@pytest.mark.parametrize("name", TRAINS)
def test_zones_moved_a_little_change_little(name: str) -> None:
    """The law: by d, results by O(d); with stages that see an edge early it is 0.03 m/s for any d that crosses one."""
    still = _speeds(_running(name))
    for shift in (1e-9, 1e-5, 2.3e-4, -1e-9, -2.3e-4):
        change = np.abs(_speeds(_running(name, shift)) - still).max(axis=0)
        assert (change > 0.0).all()
        assert (change <= abs(shift) * np.array(list(SHARPEST.values())) + 1e-11).all(), (shift, change)


@pytest.mark.parametrize("name", ["locomotive on the track", "train in time"])
def test_splitting_and_restoring_between_edges_changes_nothing(name: str) -> None:
    whole, pieces = _running(name), _running(name)
    whole.advance(STOP)
    for k in range(1, round(STOP / STEP) + 1):
        saved = pieces.snapshot()
        pieces.advance(k * STEP)
        pieces.restore(saved)
        pieces.advance(k * STEP)
    np.testing.assert_array_equal(whole.x, pieces.x)


@settings(max_examples=25)
@given(
    stretch=st.tuples(st.floats(0.05, 0.5), st.floats(0.01, 0.5)),
    span=st.tuples(st.floats(0.0, 0.5), st.floats(0.001, 0.5)),
    which=st.sampled_from([0, 1]),
)
def test_the_work_done_between_switches_is_exact(stretch: tuple, span: tuple, which: int) -> None:
    """``v(T)^2 = 1 + 2 * 3 * length`` on a stretch alone, ``v(T) = 1 + 2 * duration`` in a span alone, both at any
    edges.
    """
    system = (Booster(), ImplicitBooster())[which]
    off = {"span[1]": 90.0, "span[2]": 91.0}
    runtime = started(system, **{"stretch[1]": stretch[0], "stretch[2]": sum(stretch)}, **off)
    runtime.advance(1.5)
    assert runtime.x[1] ** 2 == pytest.approx(1.0 + 6.0 * stretch[1], abs=1e-12)
    off = {"stretch[1]": 90.0, "stretch[2]": 91.0}
    runtime = started(system, **{"span[1]": span[0], "span[2]": sum(span)}, **off)
    runtime.advance(1.5)
    assert runtime.x[1] == pytest.approx(1.0 + 2.0 * span[1], abs=1e-12)


def test_a_stretch_shorter_than_a_step_and_switches_that_coincide_are_not_missed() -> None:
    runtime = started(Booster(), **{"stretch[1]": 0.2503, "stretch[2]": 0.2504, "span[1]": 0.2503, "span[2]": 0.2503})
    runtime.advance(1.0)
    assert runtime.x[1] ** 2 == pytest.approx(1.0 + 6.0 * 1e-4, abs=1e-12)


class Chattering(Booster):
    """A body that is pushed back wherever it goes: its switch changes without end."""

    states = (*Booster.states, state("elapsed", "s"))
    switchings = ("middle",)

    def switching(self, t: Any, x: Any, u: Any, p: Any) -> Any:
        return vector(x.place - 0.1)

    def _push(self, t: Any, x: Any, u: Any, p: Any) -> Any:
        return 50.0 - 100.0 * self.switches(t, x, u, p)[0]

    def flow(self, t: Any, x: Any, u: Any, p: Any) -> Any:
        push = self._push(t, x, u, p)
        return {"place": push, "rate": push, "elapsed": 1.0}


def test_switches_that_chatter_do_not_stop_time() -> None:
    runtime = started(Chattering())
    runtime.advance(0.1)
    assert runtime.t == 0.1
    assert abs(runtime.x[0] - 0.1) < 0.6
    # what is left of a step after its last division is integrated too
    assert runtime.x[2] == pytest.approx(0.1, abs=1e-12)


@pytest.mark.parametrize(
    ("ends", "said"),
    [
        (
            {"zone_from[2]": 40.0, "zone_to[2]": 40.0},
            "zone 2 has no length: zone_to\\[2\\] must lie behind zone_from\\[2\\]",
        ),
        ({"zone_from[1]": 20.0, "zone_to[1]": 10.0}, "zone 1 has no length"),
        ({"zone_from[3]": 15.0}, "zone 3 overlaps one before it in the list"),
        ({"zone_from[1]": float("nan")}, "zone 1 has no length"),
    ],
)
@pytest.mark.parametrize("system", [Locomotive(), Train(wagons=1, axles=1, zones="time")], ids=lambda s: s.name)
def test_zones_that_overlap_or_have_no_length_are_refused_in_words(system: HybridSystem, ends: dict, said: str) -> None:
    zones = {"zone_from[1]": 10.0, "zone_to[1]": 20.0, "zone_from[2]": 40.0, "zone_to[2]": 50.0, "zone_to[3]": 80.0}
    with pytest.raises(ValueError, match=f"{system.name}: time cannot run with these values: {said}"):
        started(system, **zones | {"zone_from[3]": 70.0} | ends)
    started(system, **zones | {"zone_from[3]": 50.0})  # one may follow the other
