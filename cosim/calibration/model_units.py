"""A recording in the units of the model that is fitted to it: as at a connection of a run."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from cosim.calibration.recorded_signals import CalibrationError, RecordedSignals
from cosim.calibration.runs import Runs
from fmus.fmi.units import NamedUnit, named_unit
from plant_models.hybrid.units import UnitError

Array = NDArray[np.float64]


def in_units_of(runs: Runs, recorded: RecordedSignals) -> tuple[RecordedSignals, list[str]]:
    """The recording in the numbers of the model, and what to know of it. What has no unit, there or here, is taken as
    it is.

    Args:
        runs: the model. recorded: in units of its own.

    Raises:
        CalibrationError: a unit cannot be converted.
    """
    recorded = replace(recorded, units=dict.fromkeys(recorded.measured, "1") | dict(recorded.units))
    own = {name: runs.named_unit(name) for name in recorded.units}
    scales = {name: _conversion(recorded, name, unit) for name, unit in own.items()}
    return (
        replace(
            recorded,
            measured=_scaled(recorded.measured, scales),
            inputs=_scaled(recorded.inputs, scales),
            ends=_scaled(recorded.ends, scales),
            units={name: unit if (to := own[name]) is None else to.name for name, unit in recorded.units.items()},
        ),
        _remarks(recorded, own),
    )


def _conversion(recorded: RecordedSignals, name: str, own: NamedUnit | None) -> tuple[float, float]:
    """Factor and offset from the unit of the recording to that of the model."""
    unit = recorded.units[name]
    if unit == "1" or own is None:
        return 1.0, 0.0
    try:
        return named_unit(unit).to(own)
    except UnitError as error:
        raise CalibrationError(
            f"{recorded.places.get(name, 'The recording')} -> {name}: units {unit!r} and {own.name!r} do not fit: "
            f"{error}."
        ) from error


def _scaled(series: Mapping[str, Array], scales: Mapping[str, tuple[float, float]]) -> dict[str, Array]:
    """Values in the units of the model; those that need no conversion stay the same bits."""
    found = dict(series)
    for name, (factor, offset) in scales.items():
        if name in found and (factor, offset) != (1.0, 0.0):
            found[name] = factor * found[name] + offset
    return found


def _remarks(recorded: RecordedSignals, own: Mapping[str, NamedUnit | None]) -> list[str]:
    """Which numbers were taken as they are, for want of a unit."""
    cases = [
        f"{name} (unit in the recording: {'none' if unit == '1' else unit}, in the model: {to.name if to else 'none'})"
        for name, unit in recorded.units.items()
        if (to := own[name]) is None or (unit == "1" and to.name != "1")
    ]
    return [f"A unit is missing, so numbers are taken as they are: {', '.join(cases)}."] if cases else []
