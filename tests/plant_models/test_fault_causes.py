"""Laws over all causes of faults, in a signal and in a wheel alike; causes of a user's own, and those that clash."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from railway_runs import outputs, started

from plant_models import FAULT_CAUSES, PLANTS
from plant_models.faults.fault_cause import Fault, FaultCause
from plant_models.hybrid import Runtime, TracedSystem, input_signal, parameter, state, width
from plant_models.hybrid.requirements import unfulfilled

CAUSES = sorted(FAULT_CAUSES)
SYSTEMS = ("signal_fault", "wheel_fault")
FAULT = {"fault_onset": 0.5, "fault_length": 0.3, "fault_gain": 0.7, "fault_offset": 0.4, "fault_loss": 0.5}


def _values(system: Any, **changes: float) -> np.ndarray:
    """Parameters, of which the first element of those that are there is changed."""
    p = system.start_parameters()
    names = [name for s in system.parameter_signals for name in s.scalar_names]
    for name, value in changes.items():
        for element in (name, f"{name}[1]"):
            if element in names:
                p[names.index(element)] = value
    return p


def _readings(system: Any, p: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """First output and `active` in one second, of a signal of 20 that is braked."""
    runtime = Runtime(system)
    runtime.p[:] = p
    names = [s.name for s in system.inputs]
    runtime.u[0] = 20.0
    if "effort" in names:
        runtime.u[names.index("effort")] = -1.0
    runtime.start(0.0)
    rows = []
    for k in range(1, 21):
        runtime.advance(0.05 * k)
        rows.append(runtime.update_outputs().copy())
    table = np.array(rows)
    return table[:, 0], table[:, [s.name for s in system.outputs].index("active")]


@pytest.mark.parametrize("system", SYSTEMS)
@pytest.mark.parametrize("cause", CAUSES)
def test_a_cause_says_what_it_is_and_traces(cause: str, system: str) -> None:
    made = PLANTS[system](cause=cause)
    assert FAULT_CAUSES[cause].name == cause
    assert FAULT_CAUSES[cause].description
    signals = (*made.states, *made.input_signals, *made.parameter_signals)
    assert [s.name for s in signals if not s.description or not s.unit] == []
    assert TracedSystem(made).step.n_in() == 5


@pytest.mark.parametrize("system", SYSTEMS)
@pytest.mark.parametrize("cause", CAUSES)
def test_what_studies_draw_is_legal_at_both_ends(cause: str, system: str) -> None:
    made = PLANTS[system](cause=cause)
    ranges = FAULT_CAUSES[cause].ranges
    assert ranges
    for end in (1, 2):
        assert unfulfilled(made, _values(made, **{entry[0]: entry[end] for entry in ranges})) is None
    assert {name for name, *_ in ranges} <= {s.name for s in made.parameters}


@pytest.mark.parametrize("system", SYSTEMS)
@pytest.mark.parametrize("cause", CAUSES)
def test_a_turned_fault_is_wrong_by_as_much_the_other_way(cause: str, system: str) -> None:
    made = PLANTS[system](cause=cause, fault_count=1)
    fault = FAULT | {name: high for name, _, high in FAULT_CAUSES[cause].ranges}
    p = _values(made, **fault)
    turned = made.cause.turned(made.unpack_parameters(p))
    if turned is None:
        return  # an input decides the sign
    readings, active = _readings(made, p)
    others, equal = _readings(made, _values(made, **fault | {k: float(np.ravel(v)[0]) for k, v in turned.items()}))
    assert np.array_equal(active, equal)
    assert active.any()
    np.testing.assert_allclose(readings - 20.0, 20.0 - others, atol=1e-12)
    assert np.array_equal(readings != 20.0, active > 0.0)


class Worn(FaultCause):
    """A wheel whose radius is smaller than believed turns too fast."""

    name = "worn"
    description = "A worn wheel"
    parameters = (parameter("wear", "1", 0.02, "Share of the radius that is worn off", min=0.0, max=0.5),)

    def fault(self, t: Any, x: Any, u: Any, p: Any, passed: Any, values: Any) -> Fault:
        return Fault(p.wear / (1.0 - p.wear))


@pytest.mark.parametrize("system", SYSTEMS)
def test_a_cause_of_a_users_own_is_a_file(system: str, tmp_path: Path) -> None:
    text = Path(__file__).read_text(encoding="utf-8")
    file = tmp_path / "worn.py"
    own = text[text.index("class Worn") : text.index("@pytest.mark.parametrize", text.index("class Worn"))]
    heads = (
        "from typing import Any",
        "from plant_models.faults.fault_cause import Fault, FaultCause",
        "from plant_models.hybrid import parameter",
    )
    file.write_text("\n".join([*heads, own]), encoding="utf-8")
    made = PLANTS[system](cause=f"{file}:Worn")
    readings, active = _readings(made, _values(made, wear=0.2))
    assert readings == pytest.approx(25.0)
    assert (active == 1.0).all()


def test_what_flows_in_a_cause_flows_in_a_signal_and_its_edges_are_exact() -> None:
    runtime = started(PLANTS["signal_fault"](cause="stated"), None, None, [1.0, 1.0], **{
        "fault_onset[1]": 0.0101, "fault_length[1]": 1.0, "release_time": 0.0502
    })  # fmt: skip
    runtime.advance(0.06)
    assert runtime.update_outputs()[0] == 0.0
    runtime.advance(0.0101 + 0.0502 + 1e-9)
    assert runtime.update_outputs()[0] == 1.0


def test_the_distance_of_a_ramped_wheel_has_exact_edges() -> None:
    ramp = {"fault_onset[1]": 0.1013, "fault_rise[1]": 0.2, "fault_length[1]": 0.3, "fault_fall[1]": 0.4}
    for step in (1.7, 0.05):
        runtime = started(
            PLANTS["wheel_fault"](cause="gain_and_offset"), None, None, [10.0, 0.0, 1e9, 0.0], **ramp,
            **{"fault_gain[1]": 0.5, "fault_offset[1]": 1.0},
        )  # fmt: skip
        for k in range(1, round(1.7 / step) + 1):
            runtime.advance(k * step)
        # the area of the trapezium, 0.6 s, times what is missing, 4 m/s
        assert runtime.update_outputs()[1] == pytest.approx(17.0 - 4.0 * 0.6, abs=1e-9)


def test_lost_samples_of_a_wheel_are_lost_to_its_distance_whatever_this_is_counted_from() -> None:
    found = {}
    for source in ("speed", "position"):
        wheel = PLANTS["wheel_fault"](cause="lost_samples", distance_from=source)
        lost = {"fault_onset[1]": 1.0, "fault_length[1]": 10.0, "fault_loss[1]": 1.0, "sample_period": 0.1}
        runtime = started(wheel, None, None, np.zeros(width(wheel.input_signals)), **lost)
        for k in range(40):  # the speed rises by steps, and what is lost stays at the last one before the fault
            runtime.u[0] = float(k // 2)
            runtime.advance(0.05 * (k + 1))
        if source == "position":
            runtime.u[4] = 0.1 * sum(range(20))
        found[source] = outputs(runtime)["wheel_distance"]
    assert found["position"] == pytest.approx(found["speed"], abs=1e-9)
    assert found["speed"] < 0.1 * sum(range(20)) - 4.0


def _cause(**members: Any) -> type[FaultCause]:
    made: type[FaultCause] = type("Own", (Worn,), members)
    return made


@pytest.mark.parametrize(
    ("members", "words"),
    [
        (
            {"parameters": (parameter("speed", "m/s", 0.0, "No input"),)},
            r"'worn' declares 'speed' \(parameter, m/s\), but wheel_fault has another 'speed' \(input, m/s\)",
        ),
        (
            {"inputs": (input_signal("effort", "kN"),)},
            r"declares 'effort' \(input, kN\), .* another 'effort' \(input, N\)",
        ),
        ({"states": (state("rim_distance", "m"),)}, r"another 'rim_distance' \(local, m\); give it another name"),
        (
            {"__init__": lambda self, radius: setattr(self, "radius", radius)},
            r"Own: .*'radius'; its options are: radius",
        ),
    ],
    ids=["another meaning", "another unit", "a state of the system's", "constructor"],
)
def test_a_cause_that_does_not_fit_is_refused_in_words(
    members: dict[str, Any], words: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(FAULT_CAUSES._own, "worn", _cause(**members))
    with pytest.raises(ValueError, match=words):
        PLANTS["wheel_fault"](cause="worn")


def test_an_unknown_cause_a_class_that_is_none_and_losses_of_another_are_refused() -> None:
    with pytest.raises(ValueError, match=r"Unknown cause 'luck'; choose one of: adhesion, .*, or write file.py:Class"):
        PLANTS["signal_fault"](cause="luck")
    with pytest.raises(ValueError, match=r"fractions:Fraction is a class of base Rational, no subclass of FaultCause"):
        PLANTS["wheel_fault"](cause="fractions:Fraction")
    with pytest.raises(ValueError, match=r"fault_cause:FaultCause is not complete: it has no fault\(\); write it"):
        PLANTS["wheel_fault"](cause="plant_models.faults.fault_cause:FaultCause")
    with pytest.raises(ValueError, match=r"losses belong to the cause 'lost_samples', got cause 'stated'"):
        PLANTS["signal_fault"](cause="stated", losses=True)


def test_faults_of_an_own_name_are_used_where_the_system_has_them_too() -> None:
    made = PLANTS["wheel_fault"](cause="adhesion")
    names = [s.name for s in (*made.inputs, *made.parameters)]
    assert names == [
        *("speed", "effort", "adhesion_limit", "brake_released"),
        *("release_time", "jam_loss", "skid_loss", "lock_time", "spin_depth", "sliding_share"),
    ]
