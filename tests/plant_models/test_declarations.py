"""Declarations: what is wrong in a system is said when it is written down, by name."""

from __future__ import annotations

from typing import Any

import pytest
from toy_systems import Clockwork, Hyperbola

from plant_models.hybrid import HybridSystem, PeriodicEvent, TracedSystem, TracingError, TriggeredEvent
from plant_models.hybrid.signal import Signal, input_signal, memory, output_signal, parameter, state


def test_a_signal_has_a_legal_name_and_as_many_starts_as_elements() -> None:
    with pytest.raises(ValueError, match=r"'wheel speed' is not a legal identifier"):
        Signal("wheel speed")
    with pytest.raises(ValueError, match=r"size 3 but 2 start values"):
        Signal("table", size=3, start=(1.0, 2.0))
    with pytest.raises(ValueError, match=r"scalar but its start"):
        Signal("table", start=(1.0, 2.0))
    assert Signal("table", size=2, start=4.0).start_values == (4.0, 4.0)
    assert Signal("table", size=2).scalar_names == ("table[1]", "table[2]")


def test_a_payload_belongs_to_its_event_by_name_and_is_discrete() -> None:
    with pytest.raises(ValueError, match=r"must be named 'balise_\.\.\.'"):
        TriggeredEvent("balise", (input_signal("position", "m", variability="discrete"),))
    with pytest.raises(ValueError, match="must be a discrete input"):
        TriggeredEvent("balise", (input_signal("balise_position", "m"),))


def _system(**attributes: Any) -> HybridSystem:
    return type("Faulty", (HybridSystem,), {"name": "faulty", **attributes})()


@pytest.mark.parametrize(
    ("attributes", "message"),
    [
        ({"name": "two words"}, "must be a legal identifier"),
        ({"states": (state("x", "m"),), "outputs": (output_signal("x", "m"),)}, "used twice or reserved: x"),
        ({"inputs": (input_signal("time", "s"),)}, "used twice or reserved: time"),
        ({"states": (memory("m", "1"), state("x", "m"))}, "continuous states before memory"),
        ({"events": (PeriodicEvent("tick", "period"),)}, "unknown parameter 'period'"),
        (
            {"parameters": (parameter("T", "s", 1.0),), "events": (PeriodicEvent("tick", "T", counted_by="ticks"),)},
            "counted by 'ticks'",
        ),
        ({"presets": {"fast": {"gain": 2.0}}}, r"preset 'fast' sets unknown parameters \['gain'\]"),
    ],
)
def test_a_faulty_declaration_is_refused_at_construction(attributes: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        _system(**attributes)


def test_an_unknown_preset_names_the_known_ones() -> None:
    system = _system(parameters=(parameter("gain", "1", 1.0),), presets={"mild": {"gain": 0.5}})
    with pytest.raises(ValueError, match=r"unknown preset 'wild'; it has: mild"):
        system.start_parameters("wild")
    assert system.start_parameters("mild")[0] == 0.5


def test_presets_fill_vectors_and_states() -> None:
    system = _system(
        parameters=(parameter("table", "m", 0.0, size=3),),
        states=(memory("x", "m"),),
        presets={"set": {"table": (1.0, 2.0, 3.0), "x": 7.0}, "same": {"table": 4.0}},
    )
    assert list(system.start_parameters("set")[:3]) == [1.0, 2.0, 3.0]
    assert list(system.start_parameters("same")[:3]) == [4.0, 4.0, 4.0]
    assert system.start_state("set")[0] == 7.0


def test_missing_and_undeclared_outputs_are_named() -> None:
    class Forgetful(Hyperbola):
        def output(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
            return {"z": x.x}

    system = Forgetful()
    with pytest.raises(ValueError, match=r"leaves out \['y'\] and returns undeclared \['z'\]"):
        system.output_vector(0.0, system.start_state(), system.start_inputs(), system.start_parameters())


@pytest.mark.parametrize(
    ("declared", "words"),
    [
        ({"states": (state("place", "m"),)}, r"declares states that flow \(place\) but has no flow\(\)"),
        ({"outputs": (output_signal("speed", "m/s"),)}, r"declares outputs \(speed\) but has no output\(\)"),
        ({"events": (TriggeredEvent("balise"),)}, r"declares events \(balise\) but has no jump\(\)"),
        ({"switchings": ("edge",)}, r"declares switching functions \(edge\) but has no switching\(\)"),
    ],
)
def test_what_is_declared_has_its_equation(declared: dict[str, Any], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        _system(**declared)


@pytest.mark.parametrize(
    ("declared", "words"),
    [
        ({"unit": "Ns/m"}, "Signal 'drag': unknown unit symbol 'Ns' in 'Ns/m'"),
        ({"start": "zero"}, "Signal 'drag' starts with 'zero'; expected a number"),
    ],
)
def test_a_signal_says_what_is_wrong_with_it(declared: dict[str, Any], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        Signal("drag", **declared)


def test_a_misspelt_signal_is_named_when_traced() -> None:
    class Misspelt(Hyperbola):
        def flow(self, t: Any, x: Any, u: Any, p: Any) -> Any:
            return {"x": x.xx}

    with pytest.raises(TracingError, match=r"has no attribute 'xx'; did you mean 'x'\? \(at .*test_declarations"):
        _ = TracedSystem(Misspelt()).step


def test_branching_on_values_is_explained_when_traced() -> None:
    class Branching(Hyperbola):
        def flow(self, t: Any, x: Any, u: Any, p: Any) -> Any:
            return {"x": 1.0 if x.x > 0 else -1.0}

    with pytest.raises(TracingError, match=r"cannot trace .*np\.where instead of 'if'"):
        _ = TracedSystem(Branching()).step
    untraceable = Hyperbola()
    untraceable.traceable = False
    with pytest.raises(TracingError, match="cannot be traced"):
        TracedSystem(untraceable)


def test_inputs_and_parameters_come_in_the_declared_order() -> None:
    system = Clockwork()
    assert [s.name for s in system.input_signals] == ["force", "kick_impulse", "jitter"]
    assert [s.name for s in system.parameter_signals] == ["stiffness", "period", "offset", "internal_step", "seed"]
    p = system.unpack_parameters(system.start_parameters())
    assert list(p.stiffness) == [3.0, 0.5]
    assert p.internal_step == 0.01
