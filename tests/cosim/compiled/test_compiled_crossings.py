"""Steps over balises that the compiled stepper does by itself: tables and telegrams of the Python stepper, to the last
bit.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from compiled_runs import assert_equal, both, steps_compiled
from hypothesis import given, settings
from hypothesis import strategies as st
from test_fmus.build import linear_fmu
from test_fmus.events import awkward_fmu

from cosim import Scenario
from fmus.build import build_fmu
from plant_models.hybrid import HybridSystem, TriggeredEvent, input_signal, memory, output_signal

STEP, COUNT = 0.1, 60
RECEIVERS = ("takagi_sugeno_cdo", "discrete_uio")
FIELDS = ("position", "location_accuracy", "odometer_reading", "delivered_at")


class Listener(HybridSystem):
    """Remembers all that a telegram says."""

    name = "listener"
    states = tuple(memory(field, "1") for field in FIELDS)
    outputs = tuple(output_signal(f"told_{field}", "1", variability="discrete") for field in FIELDS)
    events = (
        TriggeredEvent("balise", tuple(input_signal(f"balise_{f}", "1", variability="discrete") for f in FIELDS)),
    )
    internal_step = 0.1

    def jump(self, event: str, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {field: getattr(u, f"balise_{field}") for field in FIELDS}

    def output(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {f"told_{field}": getattr(x, field) for field in FIELDS}


@pytest.fixture(scope="module")
def plants(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """A train that swings to and fro about 0 m, with 5 m to either side, and one that gets ever faster."""
    folder = tmp_path_factory.mktemp("plants")
    swing = [[0.0, 1.0], [-1.0, 0.0]], [0.0, 5.0]
    flight = [[0.0, 1.0], [0.0, 0.05]], [-5.0, 1.0]
    made = {}
    for name, (matrix, start) in {"swing": swing, "flight": flight}.items():
        for version in (2, 3):
            made[f"{name}{version}"] = linear_fmu(
                folder,
                f"{name}{version}",
                matrix,
                [[0.0], [0.0]],
                np.eye(2).tolist(),
                [[0.0], [0.0]],
                version=version,  # type: ignore[arg-type]
                inputs=["u"],
                outputs=["position", "speed"],
                x0=start,
                units={"position": "m", "speed": "m/s"},
            )
    return made


def journey(plant: Path, *, receivers: int, algorithm: str = "gauss-seidel", **balises: Any) -> Scenario:
    """A plant, and observers that are told what it passes; its speed is the odometer."""
    made = Scenario(stop=COUNT * STEP, step=STEP, certificates="ignore").add("train", fmu=str(plant))
    for name in RECEIVERS[:receivers]:
        made.add(name, observer=name, **{"as": "fmu3"}).connect(f"train.speed -> {name}.odometer")
    made.master(algorithm=algorithm)
    return made.balises(
        position="train.position",
        speed="train.speed",
        odometer="train.speed",
        receivers=list(RECEIVERS[:receivers]),
        method="rollback",
        **balises,
    )


@settings(max_examples=12)
@given(
    plant=st.sampled_from(["swing2", "swing3", "flight2", "flight3"]),
    receivers=st.integers(0, 2),
    algorithm=st.sampled_from(["gauss-seidel", "jacobi"]),
    places=st.lists(st.floats(-5.0, 5.0), min_size=1, max_size=12, unique=True),
)
def test_balises_by_place(
    plants: dict[str, Path], plant: str, receivers: int, algorithm: str, places: list[float]
) -> None:
    """Where the train turns, and where several lie within a step, Python takes over with what has been said so far."""
    layout = {"layout": "positions", "positions": sorted(places), "location_accuracy": 0.3}
    scenario = journey(plants[plant], receivers=receivers, algorithm=algorithm, **layout)
    python, compiled = both(scenario)
    assert python.failure is None
    assert_equal(python, compiled)
    assert steps_compiled(compiled) >= COUNT - len(python.result.events) - 4


INSTANTS = st.integers(1, COUNT).flatmap(
    lambda k: st.sampled_from([0.0, 0.5e-9, -0.5e-9, 1.5e-9, -1.5e-9, 0.01, 0.05, -1e-6]).map(
        lambda more: max(k * STEP + more, 1e-6)
    )
)
"""On communication points, next to them on either side of what counts as the same time, and well within a step."""


@settings(max_examples=12)
@given(
    plant=st.sampled_from(["swing2", "flight3"]),
    receivers=st.integers(0, 2),
    algorithm=st.sampled_from(["gauss-seidel", "jacobi"]),
    instants=st.lists(INSTANTS, min_size=1, max_size=20, unique=True),
)
def test_balises_by_instant(
    plants: dict[str, Path], plant: str, receivers: int, algorithm: str, instants: list[float]
) -> None:
    scenario = journey(
        plants[plant], receivers=receivers, algorithm=algorithm, layout="instants", instants=sorted(instants)
    )
    python, compiled = both(scenario)
    assert python.failure is None
    assert_equal(python, compiled)
    single = [t for t in instants if all(abs(t - other) > STEP for other in instants if other != t)]
    assert (
        steps_compiled(compiled) >= COUNT - (len(instants) - len(single)) - 2
    )  # two: where the recorder has no room for its rows


def test_none_of_the_default_scenario_is_left_to_python() -> None:
    overrides = {"certificates": "ignore", "stop": 20.0, "master.stepper": "compiled"} | {
        f"{n}.as": "fmu3" for n in OBSERVERS
    }
    outcome = Scenario.load("freight_profile_d").run(overrides=overrides, warn=lambda _: None)
    assert steps_compiled(outcome) >= 2000 - 2
    assert len(outcome.result.events) > 40


OBSERVERS = ("differentiator_cdo", "takagi_sugeno_cdo", "multirate_cdo", "discrete_uio")


def test_what_is_not_delivered_at_once_stays_with_python(plants: dict[str, Path]) -> None:
    """Telegrams that are late, may be missed, or are blurred."""
    instants = {"layout": "instants", "instants": [0.35, 2.01, 3.3, 4.777]}
    places = {"layout": "positions", "positions": [-2.0, 1.0, 2.7], "location_accuracy": 0.5}
    for balises in (
        instants | {"latency": 0.03},
        instants | {"latency_jitter": 0.2},
        instants | {"missed_fraction": 0.4},
        places | {"position_noise": 0.7},
        places | {"missed": ["B2"]},
    ):
        python, compiled = both(journey(plants["flight3"], receivers=1, **balises))
        assert python.failure is None
        assert_equal(python, compiled)
        assert steps_compiled(compiled) >= COUNT - 3 * len(python.result.events)


def test_all_that_a_telegram_says_is_delivered(plants: dict[str, Path], tmp_path: Path) -> None:
    listener = build_fmu(Listener(), tmp_path, 3)
    places = {"layout": "positions", "positions": [-2.0, 0.0, 0.5], "location_accuracy": 0.4}
    for layout in (places, {"layout": "instants", "instants": [0.35, 2.0, 3.3]}):
        scenario = journey(plants["flight3"], receivers=0, **layout)
        scenario.add("listener", fmu=str(listener)).balises(receivers=["listener"])
        python, compiled = both(scenario)
        assert len(python.result.events) == 3
        assert_equal(python, compiled)
        assert steps_compiled(compiled) == COUNT
        last = compiled.result.events[-1]
        assert [compiled.result[f"listener.told_{field}"][-1] for field in FIELDS] == [
            getattr(last, field) for field in FIELDS
        ]


def test_what_is_logged_on_the_way_has_its_time(plants: dict[str, Path], tmp_path: Path) -> None:
    scenario = journey(
        plants["flight3"], receivers=1, layout="instants", instants=[0.04 + STEP * k for k in range(COUNT)]
    )
    scenario.add("odd", fmu=str(awkward_fmu(tmp_path, "chatty")), log="all").connect("train.speed -> odd.u")
    python, compiled = both(scenario)
    assert len(python.result.messages) > COUNT // 2
    assert_equal(python, compiled)
    assert compiled.result.messages == python.result.messages
    assert steps_compiled(compiled) >= COUNT - 2
