"""Base of observers that invert the signature of a window of samples and blend it with the model's prediction."""

from __future__ import annotations

from abc import abstractmethod
from collections import namedtuple
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from fmu_observer.formulas.signatures.pencil import NextScaling, pencil_point
from fmu_observer.models.observer_model import named_as, stacked_of
from fmu_observer.observers.parameter_values import Value, parameter_values
from plant_models.exhibits.noisy_plant import NoisyPlant
from plant_models.hybrid import Array, HybridSystem, PeriodicEvent, vector
from plant_models.hybrid.integration import rk4_step
from plant_models.hybrid.scan import enclosed, scan
from plant_models.hybrid.signal import (
    OutputWarning,
    Signal,
    discrete_output,
    input_signal,
    memory,
    parameter,
    within_bounds,
)

_OUTSIDE_CELLS = 0.5
"""Cells beyond its table from which a window counts as outside: less comes of rounding and of mild noise."""

TABLE_ERROR = 1e-6
"""Of its range, that a table may be off its parameters: they are written with so many digits at least [ours]."""

_RECENT = 50.0
"""Windows of which more than half beyond the table are reported, although there were many within it before [ours]."""

_MOSTLY = OutputWarning(
    "found more than half of its windows beyond its table, of all or of some fifty: the state is not in the set the "
    "table was built for, its parameters are not those of the table, or the noise is too large. Widen the set, build "
    "the table anew (`tabulated`), or lower the gain",
    shows=("outside_count", "window_count"),
    at_end=True,
)
NEVER = OutputWarning(
    "its window never filled, and its estimates are the start values and the model alone. Let the run last longer",
    reaches=1.0,
)
_NO_MODEL = ("sample_period", "process_noise", "measurement_noise")


class InvertedWindow(NamedTuple):
    """What the signature of a window shows.

    Attributes:
        state: at the oldest sample of the window, shape (n,). outside: how far beyond the table, in cells [1].
        own: values of the subclass' own memory, one each.
    """

    state: Array
    outside: Array
    own: tuple[Array, ...] = ()


class SignatureObserver(HybridSystem):
    """Base of observers of a `NoisyPlant` by the signature of its last samples: Omar 2012, sections 4.2 to 4.6.

    At each sample: 1. the window moves on; 2. its signature is inverted, which gives the state at its oldest sample
    (4.3.4); 3. the model brings this state to now (4.2.4); 4. it is blended with what the model made of the last
    estimate, by the gain q (4.6.8). Until the window is full the model runs alone. The window holds the sample at hand;
    that of the thesis ends one sample before it.

    The contract: a subclass calls `declare` before ``super().__init__`` and writes `inverted`; where model parameters
    are estimated it overrides `model_parameters`.
    """

    internal_step = 0.1  # nothing flows between samples
    plant: NoisyPlant
    window: int
    scaling: NextScaling

    def declare(
        self,
        plant: NoisyPlant,
        window: int,
        scaling: NextScaling,
        gain: float,
        eps: float,
        own_parameters: Sequence[Signal] = (),
        own_memory: Sequence[Signal] = (),
        own_outputs: Sequence[Signal] = (),
        known: Sequence[str] = (),
    ) -> None:
        """Set signals and event.

        Args:
            plant: whose equations are the model. window: samples, N_O. scaling: of the next sample, see `pencil_point`.
            gain: default q. eps: default regularisation, in the unit of the samples.
            own_parameters, own_memory, own_outputs: of the subclass; memory and outputs correspond one to one.
            known: names of parameters of the plant that are not parameters of the observer.
        """
        self.plant, self.window, self.scaling = plant, window, scaling
        self._named = named = plant.plain_outputs[: len(plant.moving)]
        measured = plant.outputs[len(plant.plain_outputs) :]
        self._measured = tuple(s.name for s in measured)
        pairs = list(zip(plant.moving, named, strict=True))
        self.states = (*_remembered(pairs, measured, window), *own_memory)
        self.inputs = tuple(input_signal(s.name, s.unit, 0.0, s.description) for s in measured)
        self.outputs = (*_window_outputs(named), *own_outputs)
        self._own_memory, self._own_outputs = tuple(own_memory), tuple(own_outputs)
        self.parameters = (*_settings(plant, known, gain, eps), *own_parameters)
        self.events = (PeriodicEvent("sampling", "sample_period", description="A sample is read"),)

    # -- what a subclass writes -------------------------------------------------------------------------------------

    @abstractmethod
    def inverted(self, past: Sequence[Array], x: Any, p: Any) -> InvertedWindow:
        """State at the oldest sample of the window.

        Args:
            past: samples of each measurement, the oldest first, shape (N_O,) each. x: memory before, by name.
        """

    def table_errors(self, p: Any) -> dict[str, Array]:
        """Largest difference of each table from what the parameters make of it, by its name, over what it may be off: 1
        and less is legal. At some of its places: a parameter that matters moves nearly all.
        """
        return {}

    def model_parameters(self, own: Sequence[Array], p: Any) -> Any:
        """Parameters of the plant's equations.

        Args:
            own: values of the subclass' own memory. p: parameters of the observer.
        """
        return p

    def adopted(self, now: Array, u: Any) -> Array:
        """The state of the signature, brought to now, with what is measured at once put in; shape (n,).

        Args:
            now: shape (n,).
        """
        return now

    # -- what it may use --------------------------------------------------------------------------------------------

    def moved(self, start: Array, steps: int, model: Any) -> list[Array]:
        """States of the model over some periods, the start first, ``steps + 1`` of them.

        Args:
            start: shape (n,) or (n, ...). steps: periods. model: parameters of the equations and `sample_period`.
        """
        states = [start]
        for _ in range(steps):
            states.append(rk4_step(lambda _t, x: self.plant.rates(x, model), 0.0, model.sample_period, states[-1]))
        return states

    def brought(self, start: Array, steps: int, model: Any) -> Array:
        """The last of these states alone, shape (n,); a loop in the generated C.

        Args:
            start: shape (n,). steps: periods. model: see `moved`.
        """

        def row(carry: Any, _row: Any, shared: Any) -> Any:
            return (
                self.moved(carry[0], 1, self._model(*(shared[0][i] for i in range(len(self._model._fields)))))[-1],
            ), ()

        def loop(state: Array, values: Array) -> tuple[Array, ...]:
            carry, _ = scan(row, (state,), [(np.zeros(1),)] * steps, (values,))
            return (carry[0],)

        values = vector(*(getattr(model, name) for name in self._model._fields))
        return enclosed(loop, start, values)[0]

    def points(self, samples: Array, order: int, eps: Array) -> tuple[Array, Array]:
        """Abscissas and ordinates of a signature, shape (M, ...) each.

        Args:
            samples: the oldest first, shape (M + N, ...). order: N. eps: regularisation.
        """
        count = len(samples) - order
        found = [pencil_point(samples[i : i + order], samples[i + order], eps, self.scaling) for i in range(count)]
        return np.stack([point[0] for point in found]), np.stack([point[1] for point in found])

    def model_values(self, parameters: Mapping[str, Value] | None = None, preset: str | None = None) -> Any:
        """Named tuple of all parameters, some replaced.

        Args:
            parameters: values by name. preset: to start from; None for the default one.

        Raises:
            ValueError: a parameter is unknown, not finite or of another size, or the preset is unknown.
        """
        return self.unpack_parameters(parameter_values(self, parameters, preset, "to build the table"))

    # -- what follows -----------------------------------------------------------------------------------------------

    def jump(self, event: str, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        """Move the window on, invert its signature, blend."""
        width, own = self.window, self._own(x)
        past = {name: np.hstack([getattr(x, f"past_{name}")[1:], vector(getattr(u, name))]) for name in self._measured}
        count = np.minimum(x.samples_held + 1.0, float(width))
        full = np.where(count > width - 0.5, 1.0, 0.0)
        before = stacked_of(x, self._named, "estimated_")
        ahead = np.where(x.samples_held > 0.5, self.moved(before, 1, self.model_parameters(own, p))[-1], before)
        found = self.inverted([*past.values()], x, p)
        now = self.adopted(self.brought(found.state, width - 1, self.model_parameters(found.own, p)), u)
        windows, beyond = x.windows_inverted, full * np.where(found.outside > _OUTSIDE_CELLS, 1.0, 0.0)
        share = x.share_outside + full * (beyond - x.share_outside) / np.minimum(windows + 1.0, _RECENT)  # all, or last
        long = np.where(windows > _RECENT, np.where(share > 0.5, 1.0, x.long_outside), x.long_outside)
        kept = (np.where(full > 0.5, new, old) for new, old in zip(found.own, own, strict=True))
        return {
            **named_as(self._named, _blended(ahead, now, p.gain, full), "estimated_"),
            **named_as(self._named, np.where(full > 0.5, now, ahead), "looked_up_"),
            **{f"past_{name}": samples for name, samples in past.items()},
            "samples_held": count,
            "windows_inverted": windows + full,
            "windows_outside": x.windows_outside + beyond,
            "share_outside": share,
            "long_outside": long,
            **named_as(self._own_memory, kept),
        }

    def output(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        windows, outsides = x.windows_inverted, x.windows_outside
        return {
            **{s.name: getattr(x, f"estimated_{s.name}") for s in self._named},
            **{f"{s.name}_look_up": getattr(x, f"looked_up_{s.name}") for s in self._named},
            "window_full": np.where(x.samples_held > self.window - 0.5, 1.0, 0.0),
            "window_count": windows,
            "outside_count": outsides,
            "mostly_outside": np.where(outsides > 0.5 * windows, 1.0, x.long_outside),
            **named_as(self._own_outputs, self._own(x)),
        }

    def requirements(self, p: Any) -> dict[str, Array]:
        """Parameters are finite and within their bounds, and tables are those of the other parameters."""
        tables = {
            f"{name} must belong to the other parameters: build it anew with tabulated(parameters), and set both": off
            for name, off in self.table_errors(p).items()
        }
        kept = {text: np.where(off <= 1.0, 1.0, 0.0) for text, off in tables.items()}
        return super().requirements(p) | within_bounds([s for s in self.parameters if s.name != "table"], p) | kept

    # -- internals --------------------------------------------------------------------------------------------------

    @cached_property
    def _model(self) -> Any:
        """Type of the parameters of the equations, and of the period."""
        names = [s.name for s in self.plant.parameters if s.name not in _NO_MODEL]
        return namedtuple("Model", [*names, "sample_period"])

    def _fill_table(self, table: np.ndarray) -> None:
        """Make a table, which needs a system that is made, the start value of `table`."""
        start = tuple(map(float, table))
        self.parameters = tuple(replace(s, start=start) if s.name == "table" else s for s in self.parameters)
        self.__dict__.pop("parameter_signals", None)

    def _own(self, x: Any) -> list[Array]:
        """Values of the subclass' own memory."""
        return [getattr(x, s.name) for s in self._own_memory]


def _settings(plant: NoisyPlant, known: Sequence[str], gain: float, eps: float) -> tuple[Signal, ...]:
    """Parameters of the model but those `known`, the sampling period, the gain and the regularisation."""
    period = next(s for s in plant.parameters if s.name == "sample_period")
    return (
        *(s for s in plant.parameters if s.name not in (*_NO_MODEL, *known)),
        parameter("sample_period", "s", period.start, "Time tau between two samples", min=1e-6),
        parameter("gain", "1", gain, "Gain q of the signature's estimate; 0 for the model alone", min=0.0),
        parameter("regularisation", "1", eps, "eps of the pencil map, in the unit of the samples", min=1e-9),
    )


def _remembered(pairs: Sequence[tuple[Signal, Signal]], measured: Sequence[Signal], window: int) -> tuple[Signal, ...]:
    """Estimates, look-ups, the window and its counts; `pairs` are states of the plant with the outputs showing them."""
    return (
        *(memory(f"estimated_{s.name}", s.unit, m.start, f"Estimate: {s.description}") for m, s in pairs),
        *(memory(f"looked_up_{s.name}", s.unit, m.start, f"Of the signature: {s.description}") for m, s in pairs),
        *(memory(f"past_{s.name}", s.unit, 0.0, f"{s.description}, oldest first", size=window) for s in measured),
        memory("samples_held", "1", 0.0, "Samples in the window"),
        memory("windows_inverted", "1", 0.0, "Full windows so far"),
        memory("windows_outside", "1", 0.0, "Full windows beyond the table so far"),
        memory("share_outside", "1", 0.0, "Share of the last windows beyond the table, the newest weighing most"),
        memory("long_outside", "1", 0.0, "1 once this share was above a half"),
    )


def _window_outputs(named: Sequence[Signal]) -> tuple[Signal, ...]:
    """Estimates, look-ups, and how full the window is and how often it was beyond the table."""
    return (
        *(discrete_output(s.name, s.unit, f"Estimate: {s.description}") for s in named),
        *(discrete_output(f"{s.name}_look_up", s.unit, f"Of the signature alone: {s.description}") for s in named),
        discrete_output("window_full", "1", "1 once the window is full, and estimates are corrected", warning=NEVER),
        discrete_output("window_count", "1", "Full windows so far"),
        discrete_output("outside_count", "1", "Full windows beyond the table so far"),
        discrete_output("mostly_outside", "1", "1 where most windows were beyond the table", warning=_MOSTLY),
    )


def _blended(predicted: Array, estimate: Array, gain: Array, ready: Array = 1.0) -> Array:
    """``(x_m + q x_s) / (1 + q)``, the filter (4.6.8) and (4.7.9) of Omar 2012.

    The estimate enters with the weight q / (1 + q): 0.0099 for q = 0.01, 0.0909 for 0.1, 0.1667 for 0.2, 0.2308 for
    0.3. q = 0 leaves the model to itself.
    """
    return np.where(ready > 0.5, (predicted + gain * estimate) / (1.0 + gain), predicted)
