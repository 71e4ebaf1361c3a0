"""The three-threshold fault detector: a residual raises it, has to fall, and shows the end of the fault when it rises
again.

Its rules are pure functions, which an observer with a detector inside uses too; the detector is a system of its own.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from plant_models.hybrid import Array, HybridSystem, PeriodicEvent, discrete_output, input_signal, memory, parameter
from plant_models.hybrid.signal import within_bounds

NEVER = 1e9  # [s]
ROUNDING = 1e-9  # [s], of summed sample periods

THRESHOLD_PARAMETERS = (
    parameter("threshold_start", "m/s", 0.005, "Residual above which a fault begins, eps1", min=0.0),
    parameter("threshold_end", "m/s", 0.005, "Residual above which it ends, once it had fallen, eps2", min=0.0),
    parameter("threshold_quiet", "m/s", 0.001, "Residual below which the next rise counts, eps3", min=0.0),
    parameter("residual_filter_time", "s", 0.0, "Time constant of the residual's low-pass filter; 0: none", min=0.0),
    parameter("longest_fault", "s", 1.0, "Time after which a fault is given up, whatever the residual", min=0.0),
)
"""Thresholds, filter and time-out of the detector, for systems that carry it inside."""

THRESHOLD_MEMORY = (
    memory("filtered_residual", "m/s", 0.0, "Magnitude of the residual, filtered"),
    memory("detected_fault", "1", 0.0, "1 while a fault is detected, FD"),
    memory("armed", "1", 1.0, "1 when the next rise of the residual counts, the flag of the thesis"),
    memory("fault_time", "s", 0.0, "Time since the fault was detected"),
)
"""What the detector remembers."""


def evaluate(x: Any, residual: Array, sample_period: Array, p: Any) -> dict[str, Array]:
    """One sample of the detector.

    1. ``r > eps1``, flag, no fault: a fault begins, the flag falls.
    2. ``r < eps3``: the flag rises.
    3. ``r > eps2``, flag, fault: the fault ends, the flag falls.

    Ours: a fault that lasts `longest_fault` is given up. The rules alone never end a false alarm, because nothing is
    left in the residual that could rise.

    Args:
        x: named tuple with the `THRESHOLD_MEMORY`. residual: ``v - vhat`` of this sample [m/s].
        sample_period: time since the last one [s].
        p: named tuple with the `THRESHOLD_PARAMETERS`.

    Returns:
        The memory after it, by name.

    Source: Aguiar Cota 2019, (3.18) and 3.2.2.3.
    """
    level = _filtered(x, residual, sample_period, p)
    time = np.where(x.detected_fault > 0.0, x.fault_time + sample_period, 0.0)
    begins = np.where(level > p.threshold_start, x.armed * (1.0 - x.detected_fault), 0.0)
    ends = np.where(level > p.threshold_end, x.armed * x.detected_fault, 0.0)
    over_limit = np.where(time >= p.longest_fault - ROUNDING, x.detected_fault, 0.0)
    over = np.maximum(ends, over_limit)
    fault = np.where(begins > 0.0, 1.0, np.where(over > 0.0, 0.0, x.detected_fault))
    armed = np.where(level < p.threshold_quiet, 1.0, x.armed)
    armed = np.where(np.maximum(begins, over) > 0.0, 0.0, armed)
    return {
        "filtered_residual": level,
        "detected_fault": fault,
        "armed": armed,
        "fault_time": np.where(fault > 0.0, time, 0.0),
    }


def _filtered(x: Any, residual: Array, sample_period: Array, p: Any) -> Array:
    """Magnitude of the residual behind the low-pass filter [m/s]."""
    unfiltered = p.residual_filter_time <= 0.0
    weight = np.where(unfiltered, 1.0, -np.expm1(-sample_period / np.where(unfiltered, 1.0, p.residual_filter_time)))
    return x.filtered_residual + weight * (np.abs(residual) - x.filtered_residual)


def threshold_requirements(p: Any) -> dict[str, Array]:
    """What the thresholds must fulfil: within their bounds, and in order.

    Args:
        p: named tuple with the `THRESHOLD_PARAMETERS`.

    Returns:
        By text: 1 where it is fulfilled, else 0.
    """
    return within_bounds(THRESHOLD_PARAMETERS, p) | {
        "threshold_quiet must be below threshold_start: a fault that begins at a residual counted as quiet has no "
        "onset": np.where(p.threshold_quiet < p.threshold_start, 1.0, 0.0),
        "threshold_quiet must be below threshold_end: else a fault would end while its residual is still "
        "falling": np.where(p.threshold_quiet < p.threshold_end, 1.0, 0.0),
    }


class ThresholdDetector(HybridSystem):
    """Fault detector for a residual that shows only the begin and the end of a fault: Aguiar Cota 2019, (3.18).

    An observer with integrators absorbs a lasting fault: its residual peaks at the onset, falls, and peaks again, with
    the other sign, when the fault ends. So the second rise is the end. `evaluate` has the rules. They need a residual
    that is quiet without a fault: thresholds of 5 mm/s and 1 mm/s, as printed, are for quasi-continuous speed, not for
    an odometer that is held for 200 ms.

    The residual is judged every `sample_period`. The printed rules have no way out of a false alarm, nor of an end that
    was missed; `longest_fault` is one [ours].

    Presets: `repaired` (default; gives a fault up after 1 s), `as_published` (never), `filtered` (low-pass of 2 ms; the
    thesis filters, and does not print the constant).
    """

    name = "threshold_detector"
    description = "Fault detector with three thresholds: begin, quiet, end of a fault in a residual"
    source = "Aguiar Cota 2019, (3.18), 3.2.2.3; the time-out is ours"
    states = THRESHOLD_MEMORY
    inputs = (input_signal("residual", "m/s", 0.0, "Measured minus estimated speed"),)
    outputs = (
        discrete_output("odometer_fault", "1", "1 while a fault is detected"),
        discrete_output("recovering", "1", "1 while the residual of a fault has fallen: its end is awaited"),
        discrete_output("residual_level", "m/s", "Magnitude of the residual as judged"),
    )
    parameters = (
        *THRESHOLD_PARAMETERS,
        parameter("sample_period", "s", 1e-3, "Time between two judgements", min=1e-6),
    )
    events = (PeriodicEvent("sampling", "sample_period", description="The residual is judged"),)
    presets = {
        "repaired": {},
        "as_published": {"longest_fault": NEVER},
        "filtered": {"residual_filter_time": 2e-3},
    }
    default_preset = "repaired"

    def requirements(self, p: Any) -> dict[str, Array]:
        return super().requirements(p) | threshold_requirements(p)

    def jump(self, event: str, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        return evaluate(x, u.residual, p.sample_period, p)

    def output(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        return {
            "odometer_fault": x.detected_fault,
            "recovering": x.detected_fault * x.armed,
            "residual_level": x.filtered_residual,
        }
