"""A model whose parameters or inputs are not all known: they become states that stay, or walk with noise. A value."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fmu_observer.models.filter_models import FilterModel, Known
from plant_models.hybrid import Array, Signal, input_signal, state


def with_unknown(model: FilterModel, names: Sequence[str]) -> FilterModel:
    """A model of order n + k, parameters or inputs behind its own states; they start at their start values.

    An unknown parameter is a state whose noise is zero, an unknown input one that walks with its noise: which it is, is
    a matter of the process noise that a filter is given. Where noise enters the model through inputs, each unknown
    value gets one more, ``<name>_noise``, by whose integral it walks.

    Args:
        model: the model. names: of scalar parameters or inputs of it.

    Raises:
        ValueError: a name is none of a scalar parameter or an input, or stands twice.
    """
    signals = _found(model, names)
    n, r = model.order, len(model.process_noises)

    def split(x: Array, known: Known) -> Known:
        values = dict(zip(names, x[n:], strict=True))
        return Known(known.t, _filled(model.inputs, known.u, values), _filled(model.parameters, known.p, values))

    def moved(x: Array, w: Array, known: Known, period: Array) -> Array:
        walked = x[n:] + period * w[r:] if r else x[n:]
        return np.hstack([model.moved(x[:n], w[:r], split(x, known), period), walked])

    noises = tuple(input_signal(f"{s.name}_noise", "1", 0.0, f"Rate of {s.name}") for s in signals) if r else ()
    return replace(
        model,
        states=(*model.states, *(state(s.name, s.unit, s.start, s.description) for s in signals)),
        inputs=tuple(s for s in model.inputs if s.name not in names),
        parameters=tuple(s for s in model.parameters if s.name not in names),
        process_noises=(*model.process_noises, *noises),
        moved=moved,
        measured=lambda x, v, known: model.measured(x[:n], v, split(x, known)),
        deviates=None,
    )


def _found(model: FilterModel, names: Sequence[str]) -> list[Signal]:
    """The signals of these names."""
    inputs, parameters = {s.name: s for s in model.inputs}, {s.name: s for s in model.parameters if s.size is None}
    found = [inputs.get(name) or parameters.get(name) for name in names]
    if None in found or len(set(names)) != len(names):
        raise ValueError(
            f"Model {model.name!r}: unknown = {list(names)!r}; expected names of its inputs "
            f"({', '.join(inputs) or 'none'}) or of its scalar parameters ({', '.join(parameters) or 'none'}), each "
            "once."
        )
    return [s for s in found if s is not None]


def _filled(signals: Sequence[Signal], known: Array, values: dict[str, Array]) -> Array:
    """Values of signals in their order, those in `values` and else the known ones, which have theirs; shape (k,)."""
    parts, place = [], 0
    for s in signals:
        if s.name in values:
            parts.append(np.reshape(values[s.name], (1,)))
            continue
        parts.append(known[place : place + s.width])
        place += s.width
    return np.hstack(parts) if parts else np.zeros(0)
