"""What the diagnosis of a wind turbine refuses before it runs, and what it warns of after: settings with which its
verdict means nothing. Pure functions on its states by name.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from fmu_observer.observers.exhibits.drive_train_residuals import WINDOW
from fmu_observer.observers.exhibits.efficiency_inversion import BLOCKS
from plant_models.hybrid import Array, warning_output

_OUTSIDE_UPDATES = 12.0
"""Updates in a row without a bracket that are too many: the default grid moves from 0.97 to 0.05 in eleven."""
_REPEATED_SHARE = 0.25
"""Share of samples without a new reading that is too large; sensors read half as often repeat every second one."""

WARNINGS = (
    warning_output(
        "efficiency_unknown",
        "1 until the window of the efficiency is full",
        f"never estimated the efficiency: the run is shorter than the {BLOCKS + 1} times update_period that its "
        "window needs, and no loss can be seen; lower update_period, or let the run go on",
        at_end=True,
    ),
    warning_output(
        "efficiency_outside",
        "1 where the grid has long not bracketed the efficiency",
        f"took the end of its grid for the efficiency: for {_OUTSIDE_UPDATES:g} updates and more the grid "
        "bracketed no measurement; widen it (grid_lowest, grid_highest, least_efficiency, most_efficiency), and "
        "check wind_bias",
        ("efficiency_estimate",),
    ),
    warning_output(
        "efficiency_impossible",
        "1 where the efficiency is above 1 by more than its limit",
        "estimated an efficiency that no drive train has, more than efficiency_limit above 1: the torque of the "
        "wind is estimated wrongly, and the alarm of the efficiency means nothing; check wind_bias and rotor data",
        ("efficiency_estimate",),
    ),
    warning_output(
        "readings_repeated",
        "1 where many samples brought no new reading",
        "found speeds and torque unchanged at more than a quarter of its samples: sensors are read less often than "
        "its sample_period, or nothing moves and there is no noise; limits and gains hold for sensors that are "
        "read at every sample",
        at_end=True,
    ),
)


def repeats(m: Any, u: Any, starts: Array) -> Array:
    """1 where a sample brings no new reading of first rotor speed, first generator speed and torque.

    Args:
        m: named tuple with `DRIVE_MEMORY`, as it was before.
        starts: 1 at the first sample, else 0.
    """
    pairs = (
        (u.rotor_speed[0], m.rotor_first[WINDOW - 2]),
        (u.generator_speed[0], m.generator_first[WINDOW - 2]),
        (u.torque, m.torques[WINDOW - 2]),
    )
    unchanged: Array = 1.0 - starts
    for now, before in pairs:
        unchanged = np.where(now == before, unchanged, 0.0)
    return unchanged


def warned(m: Any, p: Any) -> dict[str, Array]:
    """Values of `WARNINGS` by name.

    Args:
        m: states of the diagnosis.
    """
    return {
        "efficiency_unknown": np.where(m.full_blocks > BLOCKS + 0.5, 0.0, 1.0),
        "efficiency_outside": np.where(m.outside_updates >= _OUTSIDE_UPDATES, 1.0, 0.0),
        "efficiency_impossible": np.where(m.held_efficiency_estimate > 1.0 + p.efficiency_limit, 1.0, 0.0),
        "readings_repeated": np.where(m.repeated > _REPEATED_SHARE * np.maximum(m.samples, 1.0), 1.0, 0.0),
    }
