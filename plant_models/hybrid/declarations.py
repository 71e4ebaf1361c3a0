"""What a hybrid system declares: its signals, events, presets and options, and what follows from them.

It knows signals and events, and no equations.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from typing import Any, ClassVar, Literal

import numpy as np

from plant_models.hybrid.event import CommunicationEvent, Event, PeriodicEvent, TriggeredEvent
from plant_models.hybrid.missing import MISSED_SAMPLES
from plant_models.hybrid.noise import FROM_NAME, SEED_LIMIT, Purpose
from plant_models.hybrid.resource import Resource
from plant_models.hybrid.signal import Signal, memory, parameter, width
from plant_models.missing_package import is_installed

Method = Literal["rk4", "rosenbrock", "euler"]
MISSED = memory(MISSED_SAMPLES, "1", 0.0, "Measurements that were missing at samples")


class Declarations:
    """The lists of a `HybridSystem`, whose contract says what stands in them.

    Args:
        options: with which the system was made.
    """

    name: str = ""
    description: str = ""
    source: str = ""
    states: tuple[Signal, ...] = ()
    inputs: tuple[Signal, ...] = ()
    outputs: tuple[Signal, ...] = ()
    parameters: tuple[Signal, ...] = ()
    events: tuple[Event, ...] = ()
    frictions: tuple[str, ...] = ()
    switchings: tuple[str, ...] = ()
    stiff: tuple[str, ...] = ()
    bounded_parameters: tuple[Signal, ...] | Literal["all"] = ()
    resources: tuple[Resource, ...] = ()
    presets: Mapping[str, Mapping[str, Any]] = {}
    default_preset: str | None = None
    method: Method = "rk4"
    late_policy: Literal["replay", "reject", "late"] = "replay"
    internal_step: float = 1e-3
    purpose: Purpose = Purpose.NOISE
    traceable: bool = is_installed("casadi")
    option_choices: ClassVar[Mapping[str, Sequence[Any]]] = {}

    def __init__(self, **options: Any) -> None:
        self.options: dict[str, Any] = options
        self._sampling = {e.name: e for e in self.events if not isinstance(e, CommunicationEvent) and e.samples}
        if self._sampling:
            self._declare_missing()

    def _declare_missing(self) -> None:
        """Samples of events become signals that can be missing, and are counted behind all other states."""
        names = {name for event in self._sampling.values() for name in event.samples}

        def marked(signals: Sequence[Signal]) -> tuple[Signal, ...]:
            return tuple(replace(s, can_be_missing=True) if s.name in names else s for s in signals)

        self.inputs, self.states = marked(self.inputs), (*self.states, MISSED)
        self.events = tuple(
            replace(e, payload=marked(e.payload)) if isinstance(e, TriggeredEvent) else e for e in self.events
        )
        self._sample_signals = {s.name: s for s in self.input_signals if s.name in names}

    @cached_property
    def continuous_count(self) -> int:
        """Number of scalar continuous states."""
        return width([s for s in self.states if s.variability == "continuous"])

    @cached_property
    def state_count(self) -> int:
        """Number of scalar states, continuous and discrete."""
        return width(self.states)

    @cached_property
    def triggered_events(self) -> tuple[TriggeredEvent, ...]:
        """Events that arrive from outside."""
        return tuple(e for e in self.events if isinstance(e, TriggeredEvent))

    @cached_property
    def periodic_events(self) -> tuple[PeriodicEvent, ...]:
        """Events at periodic instants."""
        return tuple(e for e in self.events if isinstance(e, PeriodicEvent))

    @cached_property
    def communication_events(self) -> tuple[CommunicationEvent, ...]:
        """Events at the end of every communication step."""
        return tuple(e for e in self.events if isinstance(e, CommunicationEvent))

    @cached_property
    def noises(self) -> tuple[Signal, ...]:
        """Noise inputs of all periodic events."""
        return tuple(s for e in self.periodic_events for s in e.noises)

    @cached_property
    def input_signals(self) -> tuple[Signal, ...]:
        """Everything `u` holds, in order: inputs, payloads of triggered events, noises."""
        payloads = tuple(s for e in self.triggered_events for s in e.payload)
        return (*self.inputs, *payloads, *self.noises)

    @cached_property
    def parameter_signals(self) -> tuple[Signal, ...]:
        """Everything `p` holds, in order: declared parameters, the internal step, and the seed where there is noise."""
        step = parameter(
            "internal_step", "s", self.internal_step, f"Internal step of the {self.method} integrator", min=1e-9
        )
        text = "Seed of the noise, a whole number; -1: it follows from the instance name"
        seed = parameter("seed", "1", FROM_NAME, text, min=FROM_NAME, max=SEED_LIMIT - 1)
        return (*self.parameters, step, *((seed,) if self.noises else ()))

    def start_state(self, preset: str | None = None) -> np.ndarray:
        """Start values of the states under a preset, shape (n,)."""
        return self._starts_under(preset, self.states)

    def start_inputs(self) -> np.ndarray:
        """Start values of all that `u` holds, shape (m,)."""
        return _starts(self.input_signals)

    def start_parameters(self, preset: str | None = None) -> np.ndarray:
        """Parameter values of a preset, shape (k,).

        Args:
            preset: name of a preset, or None for `default_preset` (the declared starts where there is none).

        Raises:
            ValueError: the preset is unknown.
        """
        return self._starts_under(preset, self.parameter_signals)

    def preset_values(self, preset: str | None = None) -> dict[str, float]:
        """Scalar values a preset sets, states and parameters, by FMI name.

        Raises:
            ValueError: the preset is unknown.
        """
        chosen = preset if preset is not None else self.default_preset
        if chosen is None:
            return {}
        if chosen not in self.presets:
            known = ", ".join(self.presets) or "none"
            raise ValueError(f"{self.name}: unknown preset {chosen!r}; it has: {known}.")
        signals = {s.name: s for s in (*self.parameter_signals, *self.states)}
        values: dict[str, float] = {}
        for name, value in self.presets[chosen].items():
            elements = np.broadcast_to(np.asarray(value, dtype=float), (signals[name].width,))
            values.update(zip(signals[name].scalar_names, map(float, elements), strict=True))
        return values

    def friction_indices(self) -> list[int]:
        """Positions in `x` of the states with dry friction."""
        return [self._place(name) for name in self.frictions]

    def verdict_index(self, event: TriggeredEvent) -> int:
        """Position in `x` of the verdict on an event; -1 where there is none."""
        return self._place(event.verdict) if event.verdict else -1

    def stiff_mask(self) -> np.ndarray | None:
        """1 for continuous states that `rosenbrock` treats implicitly, else 0, shape (nc,); None where it treats all
        so.
        """
        if not self.stiff:
            return None
        continuous = [s for s in self.states if s.variability == "continuous"]
        return np.array([float(s.name in self.stiff) for s in continuous for _ in range(s.width)])

    # -- internals --------------------------------------------------------------------------------------------------

    def _place(self, name: str) -> int:
        """Position in `x` of a scalar state; the names of thousands of others are not written for it."""
        first, whole = 0, name.partition("[")[0]
        for signal in self.states:
            if signal.name == whole:
                return first + signal.scalar_names.index(name)
            first += signal.width
        raise ValueError(f"{self.name}: there is no state {name!r}.")

    def _starts_under(self, preset: str | None, signals: Sequence[Signal]) -> np.ndarray:
        values = self.preset_values(preset)
        pairs = (pair for s in signals for pair in zip(s.scalar_names, s.start_values, strict=True))
        return np.array([values.get(name, start) for name, start in pairs], dtype=float)


def _starts(signals: Sequence[Signal]) -> np.ndarray:
    return np.array([value for s in signals for value in s.start_values], dtype=float)
