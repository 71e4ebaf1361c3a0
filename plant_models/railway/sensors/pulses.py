"""Counting pulses: how a toothed wheel turns distance into whole numbers, and these into a speed.

Plain NumPy for the odometers; knows no states.
"""

from __future__ import annotations

import numpy as np

from plant_models.hybrid import Array

BOUND = 4.0  # standard deviations of noise that count as its bound


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


def reading_bound(noise_std: Array, teeth: Array, wheel_radius: Array, period: Array) -> Array:
    """How far a reading is from the mean speed of a wheel over its period, at most [m/s]: noise and whole pulses.

    Of noise alone four standard deviations, which at five readings a second one in an hour exceeds. A count that is
    short of q at its begin and at its end by any part of it is off by less than q in all, with the variance ``q^2 /
    6``, q one pulse in a period; both together are within the smaller of the sum and of four deviations.

    Args:
        noise_std: standard deviation of the noise [m/s]. teeth: pulses in one revolution, 0 for no quantisation.
            wheel_radius: [m]. period: of a reading [s].
    """
    step = np.where(teeth > 0.0, pulse_length(teeth, wheel_radius) / period, 0.0)
    both = np.sqrt(noise_std * noise_std + step * step / 6.0)
    return np.minimum(BOUND * noise_std + step, BOUND * both)


def pulses_in_window(
    count: Array, last_count: Array, primed: Array, speed: Array, period: Array, pulse: Array
) -> Array:
    """Pulses since the last instant; in the first window those of a wheel that had turned steadily [1].

    Args:
        count: pulses so far [1]. last_count: at the last instant [1]. primed: 0 at the first instant.
        speed: of the rim now [m/s]. period: length of the window [s]. pulse: length of a pulse [m].
    """
    return np.where(primed == 0.0, np.floor(speed * period / pulse), count - last_count)
