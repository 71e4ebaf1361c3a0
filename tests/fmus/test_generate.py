"""Generation refuses what could not be the same inside somebody else's master."""

from __future__ import annotations

import math
import random
from typing import Any

import numpy as np
import pytest

from fmus.content.generate import GenerationError, trace_equations
from plant_models.hybrid import HybridSystem, TracingError, TriggeredEvent, vector
from plant_models.hybrid.signal import Signal, input_signal, output_signal, state


class Hasty(HybridSystem):
    """Its flow reads the payload of an event, which is not known before the event."""

    name = "hasty"
    states = (state("place", "m"),)
    outputs = (output_signal("place_out", "m"),)
    events = (TriggeredEvent("report", (input_signal("report_place", "m", variability="discrete"),)),)

    def flow(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"place": u.report_place - x.place}

    def jump(self, event: str, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"place": u.report_place}

    def output(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"place_out": x.place}


def test_a_payload_read_outside_its_event_is_refused() -> None:
    with pytest.raises(
        ValueError, match="hasty: step reads report_place, which is known only at the event; keep it in memory"
    ):
        trace_equations(Hasty())


class Plain(HybridSystem):
    """What the wrong ones below are derived from."""

    name = "plain"
    states = (state("x", "1", 1.0),)
    outputs = (output_signal("y", "1"),)

    def flow(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"x": -x.x}

    def output(self, t: Any, x: Any, u: Any, p: Any) -> Any:
        return {"y": x.x}


class Mathematical(Plain):
    def flow(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"x": -x.x + math.sin(x.x)}


class Numerical(Plain):
    def output(self, t: Any, x: Any, u: Any, p: Any) -> Any:
        return {"y": float(x.x)}


class Listing(Plain):
    def flow(self, t: Any, x: Any, u: Any, p: Any) -> Any:
        return vector(-x.x)


class Long(Plain):
    def flow(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"x": vector(x.x, x.x)}


class Bare(Plain):
    def output(self, t: Any, x: Any, u: Any, p: Any) -> Any:
        return x.x


class Misspelt(Plain):
    def flow(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"x": -x.x * u.frce}


ADVICE = "Write it in plain NumPy without branching on values"


@pytest.mark.parametrize(
    ("system", "message", "line", "advised"),
    [
        (Mathematical, "cannot trace flow: a traced value has no number", 'return {"x": -x.x + math.sin', True),
        (Numerical, "cannot trace output: a traced value has no number", 'return {"y": float', True),
        (Listing, "cannot trace flow: flow() returns a ArrayInterfaceSX; expected a dictionary", "", False),
        (Long, "cannot trace flow: flow() returns 'x' of shape (2,); expected one number", "", False),
        (Bare, "cannot trace output: output() returns a ArrayInterfaceSX; expected a dictionary", "", False),
        (Misspelt, "cannot trace flow: 'Inputs' object has no attribute 'frce'", 'return {"x": -x.x * u.frce}', False),
    ],
)
def test_what_cannot_be_traced_is_said_with_its_own_line(
    system: type[Plain], message: str, line: str, advised: bool
) -> None:
    with pytest.raises(TracingError) as caught:
        trace_equations(system())
    text = str(caught.value)
    assert text.startswith(f"plain: {message}")
    assert "test_generate.py:" in text
    assert line in text
    assert (ADVICE in text) == advised


def test_constants_may_be_turned_into_numbers() -> None:
    class Constant(Plain):
        def flow(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
            return {"x": -x.x * math.sqrt(2.0) * float(np.float64(3.0))}

    assert trace_equations(Constant()).derivative is not None


def test_equations_that_differ_each_time_are_refused() -> None:
    class Dicing(Plain):
        def flow(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
            return {"x": -x.x * random.random()}

    with pytest.raises(GenerationError, match="plain: its functions give other equations each time they are traced"):
        trace_equations(Dicing())


@pytest.mark.parametrize("attribute", ["inputs", "outputs", "parameters"])
def test_a_signal_in_the_wrong_list_is_refused(attribute: str) -> None:
    wrong = type("Wrong", (Plain,), {attribute: (Signal("z", "1"),)})
    with pytest.raises(ValueError, match=f"'z' is listed in {attribute} but has causality 'local'"):
        wrong()
