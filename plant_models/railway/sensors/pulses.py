"""Counting pulses: how a toothed wheel turns distance into whole numbers, and these into a speed.

Plain NumPy for the odometers; knows no states.
"""

from __future__ import annotations

import numpy as np

from plant_models.hybrid.system import Array


def pulse_length(teeth: Array, wheel_radius: Array) -> Array:
    """Rim distance of one pulse [m]; of a whole revolution where there are no teeth, so that nothing divides by zero.

    Args:
        teeth: pulses in one revolution [1]. wheel_radius: [m].

    Source: Aguiar Cota 2019, section 2.1.2: ``2 pi r / N_p``.
    """
    return 2.0 * np.pi * wheel_radius / np.maximum(teeth, 1.0)


def counted_pulses(distance: Array, pulse: Array) -> Array:
    """Whole pulses in a rim distance [1].

    A difference of counts telescopes: whatever is left of a pulse belongs to the next window, so no error adds up.

    Args:
        distance: of the rim [m]. pulse: length of a pulse [m].
    """
    return np.floor(distance / pulse)


def pulses_in_window(
    count: Array, last_count: Array, primed: Array, speed: Array, period: Array, pulse: Array
) -> Array:
    """Pulses since the last instant; in the first window those of a wheel that had turned steadily [1].

    Args:
        count: pulses so far [1]. last_count: at the last instant [1]. primed: 0 at the first instant.
        speed: of the rim now [m/s]. period: length of the window [s]. pulse: length of a pulse [m].
    """
    return np.where(primed == 0.0, np.floor(speed * period / pulse), count - last_count)
