"""The hybrid system: the one abstraction behind every plant, sensor, driver and observer.

Continuous states flow, and jump at declared events. A system is written once in plain NumPy, without branching on
values, and then lives three lives: it runs as Python, it is traced by CasADi, it is generated as C.
This file knows signals and events, and nothing of FMI, masters or files.
"""

from __future__ import annotations

from collections import namedtuple
from collections.abc import Mapping
from functools import cached_property
from typing import Any

import numpy as np

from plant_models.hybrid.arrays import Array, of_length, vector
from plant_models.hybrid.declaration_checks import check_declarations
from plant_models.hybrid.declarations import Declarations
from plant_models.hybrid.missing import is_there, or_else
from plant_models.hybrid.signal import within_bounds
from plant_models.hybrid.signal_layout import SignalLayout

__all__ = ["HybridSystem"]


class HybridSystem(Declarations):
    """Base of all hybrid systems: ``dx/dt = flow(t, x, u, p)`` between events, ``x+ = jump(event, t, x, u, p)`` at
    them.

    The contract:

    1. A subclass sets `name`, `description`, `source`, `states`, `inputs`, `outputs`, `parameters`, `events`, as class
       attributes, or as instance attributes before it calls ``super().__init__()`` when they depend on options.
    2. `flow`, `output`, `jump` and `friction` are pure functions in plain NumPy, without branching on values
       (``np.where``, not ``if``); nothing is kept on ``self`` between calls.
    3. ``x``, ``u`` and ``p`` are named tuples of the states, of the inputs (with event payloads and noises) and of the
       parameters. A state that is a vector or matrix has its declared shape, in a batch with the members as last
       dimension.
    4. All return dictionaries: `flow` the derivatives of all continuous states, `jump` the new values of those states
       that the event changes, `output` every declared output.
    5. Dry friction is declared, not regularised: a state named in `frictions` feels a resistance of magnitude
       `friction(...)` against its sign. The integrator lets it stop exactly at zero and stay there while the flow is
       smaller than the friction.
    6. Equations that change at a place or an instant are declared too: `switchings` names switching functions,
       `switching(...)` computes them, and `flow`, `friction` and `output` ask `switches(...)` on which side of each
       they are. The integrator holds the sides during a step and ends it where one changes its sign: the edge is an
       exact event, seen by no stage early.
    7. Numbers that shape the equations themselves (an order, a mode) are constructor arguments, listed in `options`.
    8. A vector parameter that an exported model reads from a file of its own is listed in `resources`.
    9. Where only some states are stiff, `stiff` names all of these and `rosenbrock` treats them alone implicitly. The
       step keeps its order; with all states that carry a conserved sum among them, momentum say, it stays conserved.
    10. Time does not run with parameters that break one of the `requirements`: bounds of the `bounded_parameters`
        (``"all"`` for every one), or what several must fulfil together. They are checked before time runs, so they are
        about fixed parameters.
        Nor does it begin with states that break one of the `start_requirements`; later nobody asks for these.
    11. `late_policy` is what an event stamped in the past means unless it is set otherwise: to be replayed at its
        stamp, to be rejected, or, for equations that count with the delay, to act when it arrives (``late``).
    12. Measurements that an event reads are its `samples`. They become signals that can be missing, and the memory
        `MISSED` is put behind all states, which counts them; `jump` neither gets nor returns it.
    13. `purpose` is what its noises are drawn for: two systems of different purpose draw independently even from the
        same seed.
    14. A system that cannot be traced says ``traceable = False`` and may then use any Python.
    """

    def __init__(self, **options: Any) -> None:
        super().__init__(**options)
        check_declarations(self)
        self._require_equations()

    # -- what a subclass writes -------------------------------------------------------------------------------------

    def flow(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        """Derivatives of the continuous states by name."""
        return {}

    def output(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        """Values of all outputs by name."""
        return {}

    def jump(self, event: str, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        """What the event changes: new values of states by name."""
        return {}

    def friction(self, t: Array, x: Any, u: Any, p: Any) -> Array:
        """Magnitudes of the dry frictions in units of the derivatives, shape (len(frictions),)."""
        return np.zeros(len(self.frictions))

    def switching(self, t: Array, x: Any, u: Any, p: Any) -> Array:
        """Switching functions, continuous in `t` and `x`: a change of sign switches the equations; shape
        (len(switchings),).
        """
        return np.zeros(len(self.switchings))

    def requirements(self, p: Any) -> dict[str, Array]:
        """What the parameters must fulfil, by what is said where they do not (it names them): 1 where they do, else 0;
        by itself that `bounded_parameters` are within their bounds.
        """
        bounded = self.parameters if self.bounded_parameters == "all" else self.bounded_parameters
        return within_bounds(bounded, p)

    def start_requirements(self, x: Any, p: Any) -> dict[str, Array]:
        """What the states must fulfil where time begins, by what is said where they do not (it names them): 1 where
        they do, else 0.

        Args:
            x: states with which time would begin, before any event.
        """
        return {}

    def _require_equations(self) -> None:
        """What is declared without its equation would stand still and say nothing."""
        continuous = [s.name for s in self.states if s.variability == "continuous"]
        declared = (
            ("flow", "states that flow", continuous),
            ("output", "outputs", [s.name for s in self.outputs]),
            ("jump", "events", [event.name for event in self.events]),
            ("switching", "switching functions", list(self.switchings)),
            ("friction", "dry friction of", list(self.frictions)),
        )
        for equation, what, names in declared:
            if names and getattr(type(self), equation) is getattr(HybridSystem, equation):
                raise ValueError(
                    f"{type(self).__name__} ({self.name!r}) declares {what} ({', '.join(names)}) but has no "
                    f"{equation}(); write it, or leave them out."
                )

    # -- for those who write these functions ------------------------------------------------------------------------

    def switches(self, t: Array, x: Any, u: Any, p: Any) -> Array:
        """1 where a switching function is not negative, else 0: as held over the integration step, if one is on its
        way, otherwise now; shape (len(switchings),)."""
        if u.held_switches is not None:
            return u.held_switches
        return np.where(self.switching(t, x, u, p) >= 0.0, 1.0, 0.0)

    # -- flat arrays ------------------------------------------------------------------------------------------------

    def unpack_states(self, values: Array) -> Any:
        """Named tuple `x` from the flat array, shape (n,) or (n, members)."""
        return self._all_places.named(values)

    def unpack_inputs(self, values: Array, held_switches: Array | None = None) -> Any:
        """Named tuple `u` from the flat array, shape (m,) or (m, members), with the switches that an integration step
        holds.

        Args:
            held_switches: values of the switches, shape (k,); None where the system has none.
        """
        return self._input_type(*self._input_places.values(values), held_switches)

    def unpack_parameters(self, values: Array) -> Any:
        """Named tuple `p` from the flat array, shape (k,) or (k, members)."""
        return self._parameter_places.named(values)

    def state_derivative(self, t: Array, x: Array, u: Array, p: Array, held_switches: Array | None = None) -> Array:
        """`flow` on flat arrays: derivatives of the continuous states, shape (nc,).

        Args:
            held_switches: see `unpack_inputs`.
        """
        derivative = self.flow(t, *self._unpack_all(x, u, p, held_switches))
        return self._flowing_places.flat(derivative, f"{self.name}: flow()", x.shape[1:])

    def output_vector(self, t: Array, x: Array, u: Array, p: Array) -> Array:
        """`output` on flat arrays, stacked in the declared order, shape (q,)."""
        values = self.output(t, *self._unpack_all(x, u, p))
        if not isinstance(values, Mapping):
            raise TypeError(
                f"{self.name}: output() returns a {type(values).__name__}; expected a dictionary of values by name."
            )
        missing = [s.name for s in self.outputs if s.name not in values]
        if missing or len(values) != len(self.outputs):
            extra = sorted(set(values) - {s.name for s in self.outputs})
            raise ValueError(f"{self.name}: output() leaves out {missing} and returns undeclared {extra}.")
        parts = [part for signal in self.outputs for part in signal.entries(values[signal.name])]
        return vector(*parts) if parts else np.zeros(0)

    def jump_vector(self, event: str, t: Array, x: Array, u: Array, p: Array) -> Array:
        """`jump` on flat arrays: the state after the event, shape (n,)."""
        stated, unpacked = self.unpack_inputs(u), self.unpack_parameters(p)
        if not self._sampling:
            return self._jumped(event, t, x, stated, unpacked)
        count, sampled = self.state_count - 1, self._sampling.get(event)
        names = () if sampled is None else sampled.samples
        values = [value for name in names for value in self._sample_signals[name].entries(getattr(stated, name))]
        lacking = sum(1.0 - is_there(value) for value in values)
        whole = sampled is not None and not sampled.leaves_out
        if whole:
            stated = stated._replace(**{name: or_else(getattr(stated, name), 0.0) for name in names})
        after = self._jumped(event, t, x[:count], stated, unpacked)
        if whole:
            after = np.where(lacking > 0.0, x[:count], after)
        missed = np.reshape(x[count] + lacking, (1, *x.shape[1:]))
        return np.vstack([after, missed]) if missed.ndim > 1 else np.hstack([after, missed])

    def friction_vector(self, t: Array, x: Array, u: Array, p: Array, held_switches: Array | None = None) -> Array:
        """`friction` on flat arrays, shape (len(frictions),).

        Args:
            held_switches: see `unpack_inputs`.
        """
        return self.friction(t, *self._unpack_all(x, u, p, held_switches))

    def switching_vector(self, t: Array, x: Array, u: Array, p: Array) -> Array:
        """`switching` on flat arrays, shape (len(switchings),)."""
        values = self.switching(t, *self._unpack_all(x, u, p))
        return of_length(values, len(self.switchings), f"{self.name}: switching()")

    def requirement_vector(self, x: Array, p: Array) -> Array:
        """Values of `requirements`, then of `start_requirements`, in the declared order, stacked."""
        unpacked = self.unpack_parameters(p)
        asked = self.requirements(unpacked), self.start_requirements(self.unpack_states(x), unpacked)
        values = [value for needed in asked for value in needed.values()]
        return vector(*values) if values else np.zeros(0)

    def switch_vector(self, t: Array, x: Array, u: Array, p: Array) -> Array:
        """`switches` on flat arrays, now, shape (len(switchings),); None for a system without any."""
        if not self.switchings:
            return None
        return self.switches(t, *self._unpack_all(x, u, p))

    def held_vector(self, t: float, x: np.ndarray, u: np.ndarray, p: np.ndarray) -> np.ndarray:
        """What a solver holds between events, as it is now: signs of the states with friction, then the switches."""
        switches = self.switch_vector(t, x, u, p)
        return np.concatenate([np.sign(x[self.friction_indices()]), np.zeros(0) if switches is None else switches])

    # -- internals --------------------------------------------------------------------------------------------------

    def _unpack_all(self, x: Array, u: Array, p: Array, held_switches: Array | None = None) -> tuple[Any, Any, Any]:
        return self.unpack_states(x), self.unpack_inputs(u, held_switches), self.unpack_parameters(p)

    def _jumped(self, event: str, t: Array, own: Array, u: Any, p: Any) -> Array:
        """`jump` on the states without the count of missed samples."""
        changed = self.jump(event, t, self._own_places.named(own), u, p)
        return self._own_places.flat(changed, f"{self.name}: jump({event!r})", own.shape[1:], own)

    @cached_property
    def _own_places(self) -> SignalLayout:
        return SignalLayout(self.states[:-1] if self._sampling else self.states)

    @cached_property
    def _flowing_places(self) -> SignalLayout:
        return SignalLayout([s for s in self.states if s.variability == "continuous"])

    @cached_property
    def _all_places(self) -> SignalLayout:
        return SignalLayout(self.states)

    @cached_property
    def _input_type(self) -> Any:
        return namedtuple("Inputs", [*(s.name for s in self.input_signals), "held_switches"], defaults=[None])

    @cached_property
    def _input_places(self) -> SignalLayout:
        return SignalLayout(self.input_signals)

    @cached_property
    def _parameter_places(self) -> SignalLayout:
        return SignalLayout(self.parameter_signals, "Parameters")
