"""Parameter values of a preset with some of them replaced: used wherever a gain in use is evaluated."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from plant_models.hybrid import HybridSystem, Signal

Value = float | Sequence[float] | np.ndarray


def parameter_values(
    system: HybridSystem,
    overrides: Mapping[str, Value] | None = None,
    preset: str | None = None,
    purpose: str = "to certify",
) -> np.ndarray:
    """Parameters of a preset with some replaced, flat, shape (k,).

    Args:
        system: whose parameters. overrides: values by name, scalars or whole vectors (``theta``, ``gain[1]``,
            ``gain``).
        preset: preset to start from; None for the system's default.
        purpose: for the message, as in "unknown parameter x to certify".

    Raises:
        ValueError: a parameter is unknown, not finite, outside its bounds or of another size, or the preset is unknown.
    """
    return replaced_parameters(system, system.start_parameters(preset), overrides or {}, purpose)


def replaced_parameters(
    system: HybridSystem, values: np.ndarray, overrides: Mapping[str, Value], purpose: str = "to certify"
) -> np.ndarray:
    """Parameters with some replaced, flat, shape (k,).

    Args:
        system: whose parameters. values: of all of them, shape (k,); they stay as they are.
        overrides, purpose: as for `parameter_values`.

    Raises:
        ValueError: as `parameter_values`.
    """
    values = values.copy()
    names = [name for signal in system.parameter_signals for name in signal.scalar_names]
    signals = {name: signal for signal in system.parameter_signals for name in (signal.name, *signal.scalar_names)}
    vectors = {signal.name: signal.scalar_names for signal in system.parameter_signals}
    for name, value in overrides.items():
        targets = (name,) if name in names else vectors.get(name)
        if targets is None:
            raise ValueError(f"{system.name}: unknown parameter {name!r} {purpose}; it has: {', '.join(vectors)}.")
        elements = _numbers(value)
        if elements.size not in (1, len(targets)) or not np.all(np.isfinite(elements)):
            raise ValueError(
                f"{system.name}: parameter {name!r} {purpose} needs {len(targets)} finite number(s), got {value!r}."
            )
        _check_bounds(f"{system.name}: parameter {name!r} {purpose}", signals[name], elements)
        values[[names.index(target) for target in targets]] = elements
    return values


def _check_bounds(where: str, signal: Signal, elements: np.ndarray) -> None:
    limits = {"least": signal.min, "most": signal.max}
    low, high = (
        np.inf * sign if limit is None else limit for sign, limit in zip((-1, 1), limits.values(), strict=True)
    )
    if elements.min() < low or elements.max() > high:
        within = " and ".join(f"at {word} {limit:g}" for word, limit in limits.items() if limit is not None)
        unit = "" if signal.unit == "1" else f" {signal.unit}"
        raise ValueError(f"{where} must be {within}{unit}, got {elements.tolist()}.")


def _numbers(value: Value) -> np.ndarray:
    """Flat, shape (k,); an empty array where it holds no numbers."""
    try:
        return np.asarray(value, dtype=float).ravel()
    except (TypeError, ValueError):
        return np.zeros(0)
