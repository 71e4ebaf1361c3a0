"""The continuous part of a hybrid system: what flows between events, with memory, payloads and noises held.

Written so that it works on numbers and on traced symbols alike; knows the hybrid foundation only.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from difflib import get_close_matches
from functools import cached_property
from typing import Any

import numpy as np

from plant_models.hybrid import Array, HybridSystem, TracedSystem, scalar_names, vector
from plant_models.hybrid.integration import effective_flow

Values = Mapping[str, float] | Sequence[float] | np.ndarray
"""Numbers by name, those left out at their starts; or all of them in the declared order."""


class ContinuousPart:
    """``dx = f(t, x, u, params)``, ``y = g(t, x, u, params)`` of a hybrid system between its events.

    Args:
        system: the hybrid system. preset: its preset; None for the default one. parameters: values that replace the
            preset's.
        memory: values at which discrete states are held; by default their starts.

    Raises:
        ValueError: an unknown preset or name, or a system in which nothing is continuous.
    """

    def __init__(
        self,
        system: HybridSystem,
        preset: str | None = None,
        parameters: Mapping[str, float] | None = None,
        memory: Mapping[str, float] | None = None,
    ) -> None:
        if not system.continuous_count and (system.states or system.events):
            raise ValueError(
                f"{system.name}: nothing in it is continuous, so it has no continuous part to convert. "
                f"{left_out(system)} "
                f"Run it with plant_models.hybrid.Runtime, or export it as an FMU."
            )
        self.system = system
        count = system.continuous_count
        names = scalar_names(system.states)
        starts = system.start_state(preset)
        self.states, self.start_state = names[:count], starts[:count]
        self.inputs, self.start_inputs = (
            scalar_names(system.inputs),
            system.start_inputs()[: len(scalar_names(system.inputs))],
        )
        self.outputs = scalar_names(system.outputs)
        held = dict(zip(names[count:], map(float, starts[count:]), strict=True))
        self._memory = filled(held, memory, f"{system.name}: memory")
        self._held_inputs = system.start_inputs()[len(self.inputs) :]
        every = dict(
            zip(scalar_names(system.parameter_signals), map(float, system.start_parameters(preset)), strict=True)
        )
        declared = {name: every[name] for name in scalar_names(system.parameters)}
        self.parameters = dict(zip(declared, filled(declared, parameters, f"{system.name}: parameter"), strict=True))
        # internal step, seed
        self._runtime_parameters = [value for name, value in every.items() if name not in declared]

    def point(self, x0: Values | None, u0: Values | None) -> tuple[np.ndarray, np.ndarray]:
        """States, shape (nc,), and inputs, shape (m,): the starts, with some replaced.

        Args:
            x0, u0: what replaces them, see `filled`.
        """
        states = dict(zip(self.states, self.start_state, strict=True))
        inputs = dict(zip(self.inputs, self.start_inputs, strict=True))
        return filled(states, x0, f"{self.system.name}: state"), filled(inputs, u0, f"{self.system.name}: input")

    @cached_property
    def traced(self) -> TracedSystem:
        """The system's CasADi functions.

        Raises:
            TracingError: the system cannot be traced.
        """
        return TracedSystem(self.system)

    def whole(self, x: Array, u: Array, params: Mapping[str, Any]) -> tuple[Array, Array, Array]:
        """State, inputs and parameters as the system's own functions expect them, flat."""
        values = [params.get(name, value) for name, value in self.parameters.items()]
        return _extended(x, self._memory), _extended(u, self._held_inputs), vector(*values, *self._runtime_parameters)

    def derivative(self, t: Array, x: Array, u: Array, params: Mapping[str, Any]) -> Array:
        """Derivatives, dry friction resolved for the signs in `x`, shape (nc,)."""
        state, inputs, p = self.whole(x, u, params)
        indices = self.system.friction_indices()
        signs = np.stack([np.sign(x[i]) for i in indices]) if indices else None
        return effective_flow(self.system, t, state, inputs, p, signs)

    def output(self, t: Array, x: Array, u: Array, params: Mapping[str, Any]) -> Array:
        """Outputs in the declared order, shape (q,)."""
        return self.system.output_vector(t, *self.whole(x, u, params))


def left_out(system: HybridSystem) -> str:
    """What of a hybrid system its continuous part does not hold, in one or two sentences."""
    events = [f"periodic {e.name!r}" for e in system.periodic_events]
    events += [f"triggered {e.name!r}" for e in system.triggered_events]
    events += [f"communication {e.name!r}" for e in system.communication_events]
    memory = scalar_names([s for s in system.states if s.variability == "discrete"])
    if not events and not memory:
        return "Nothing is left out."
    sentences = [f"Left out are its events: {', '.join(events) or 'none'}."]
    if memory:
        sentences.append(f"Held are: {', '.join(memory)}.")
    return " ".join(sentences)


def filled(starts: Mapping[str, float], values: Values | None, what: str) -> np.ndarray:
    """Start values with some replaced by name, or all of them in order.

    Args:
        starts: start values by name. values: what replaces them. what: for messages, as in "train: state".

    Returns:
        Shape (len(starts),).

    Raises:
        ValueError: a name is unknown, the number of values is wrong, or one is not finite.
    """
    result = dict(starts)
    if isinstance(values, Mapping):
        for name, value in values.items():
            result[known(name, starts, what)] = float(value)
    elif values is not None:
        array = np.asarray(values, dtype=float).ravel()
        if array.size != len(result):
            raise ValueError(f"{what}: got {array.size} values, expected {len(result)}: {', '.join(result) or 'none'}.")
        result = dict(zip(result, map(float, array), strict=True))
    wrong = [name for name, value in result.items() if not np.isfinite(value)]
    if wrong:
        raise ValueError(f"{what} {wrong[0]!r} is {result[wrong[0]]!r}; expected a finite number.")
    return np.array(list(result.values()), dtype=float)


def known(name: str, names: Iterable[str], what: str) -> str:
    """The name itself.

    Args:
        what: kind of thing, for the message.

    Raises:
        ValueError: it is not among `names`; the nearest ones are given.
    """
    candidates = list(names)
    if name in candidates:
        return name
    close = get_close_matches(name, candidates, 3, 0.5)
    hint = f"did you mean {', '.join(close)}?" if close else f"known: {', '.join(candidates) or 'none'}."
    raise ValueError(f"{what} {name!r} is unknown; {hint}")


def _extended(values: Array, held: np.ndarray) -> Array:
    return np.hstack([values, held]) if len(held) else values
