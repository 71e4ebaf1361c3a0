"""Generation refuses what could not be the same inside somebody else's master."""

from __future__ import annotations

from typing import Any

import pytest

from fmus.content.generate import trace_equations
from plant_models.hybrid import HybridSystem, TriggeredEvent, input_signal, output_signal, state, vector


class Hasty(HybridSystem):
    """Its flow reads the payload of an event, which is not known before the event."""

    name = "hasty"
    states = (state("place", "m"),)
    outputs = (output_signal("place_out", "m"),)
    events = (TriggeredEvent("tell", (input_signal("tell_place", "m", variability="discrete"),)),)

    def flow(self, t: Any, x: Any, u: Any, p: Any) -> Any:
        return vector(u.tell_place - x[0])

    def jump(self, event: str, t: Any, x: Any, u: Any, p: Any) -> Any:
        return vector(u.tell_place + 0.0 * x[0])

    def output(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"place_out": x[0]}


def test_a_payload_read_outside_its_event_is_refused() -> None:
    with pytest.raises(ValueError, match="hasty: step reads tell_place, which is known only at the event; keep it in memory"):
        trace_equations(Hasty())
