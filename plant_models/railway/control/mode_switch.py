"""The switch: which mode drives the train, and which adhesion level counts. Pure functions with hysteresis.

Modes: 1 traction, 2 electric brake, 3 indirect (air) brake, 4 combined brake. Levels: 1 nominal, 2 degraded.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from plant_models.hybrid import Array
from plant_models.railway.control.logic import either, every, holds, some

TRACTION, ELECTRIC, INDIRECT, COMBINED = 1.0, 2.0, 3.0, 4.0
NOMINAL, DEGRADED = 1.0, 2.0


class Situation(NamedTuple):
    """What the switch examines.

    `mode` and `level`: mode until now, adhesion level now. `wanted`: force that the regulator of `mode` asks for [N].
    `error`: reference minus speed [m/s]. `acceleration`: of the reference [m/s2]. `speed`: of train or wheel, the
    slower [m/s].
    `coupler_force`: tension > 0 [N]. `standing`: 1 where the train is to stand and does.
    """

    mode: Array
    level: Array
    wanted: Array
    error: Array
    acceleration: Array
    speed: Array
    coupler_force: Array
    standing: Array

    def next_mode(self, p: Any) -> Array:
        """Mode for the coming period.

        1. Between traction and brake the sign of the wanted force decides, but only when the reference accelerates that
           way, or the error has left `error_band`; in between the train coasts.
        2. A brake is electric until the reference decelerates by `service_deceleration`, the speed falls to where the
           electric brake fades, the coupler is pressed beyond its soft limit, or the adhesion is degraded: then air is
           used, on all wheels of the train, until the brake ends (an air brake is not released and applied again for
           small changes).
        3. Air and electric brake are combined where the train runs faster than the reference by `combined_error`, or
           more is wanted than the air brake has; that ends at half the error and 80 % of the force.
        """
        braking = _brakes(self, p)
        both = _asks_for_both(self, p)
        air = every(
            braking, holds(p.full_brake_force > 0.0), some(holds(self.mode > 2.5), both, _asks_for_air(self, p))
        )
        combined = every(air, both, 1.0 - self.standing)
        return either(combined, COMBINED, either(air, INDIRECT, either(braking, ELECTRIC, TRACTION)))


def next_level(
    level: Array, quiet_time: Array, condition: Array, period: Array, recovery_time: Array
) -> tuple[Array, Array]:
    """Adhesion level and the time [s] for which the condition has been nominal.

    Degraded at once, nominal again only after `recovery_time` [s] of nominal reports.

    Args:
        quiet_time: since the last degraded report [s]. period: between two calls [s].
    """
    degraded = holds(condition > 1.5)
    quiet = either(degraded, 0.0, np.minimum(quiet_time + period, recovery_time))
    recovered = holds(quiet >= recovery_time - 0.5 * period)
    return either(degraded, DEGRADED, either(recovered, NOMINAL, level)), quiet


def _brakes(s: Situation, p: Any) -> Array:
    ends = every(
        holds(s.wanted > 0.0),
        some(holds(s.acceleration > p.acceleration_band), holds(s.error > p.error_band)),
        1.0 - s.standing,
    )
    begins = every(
        holds(s.wanted < 0.0), some(holds(s.acceleration < -p.acceleration_band), holds(s.error < -p.error_band))
    )
    return either(holds(s.mode > 1.5), 1.0 - ends, some(begins, s.standing))


def _asks_for_air(s: Situation, p: Any) -> Array:
    return some(
        holds(s.acceleration < -p.service_deceleration),
        holds(np.abs(s.speed) < p.electric_fade_start),
        holds(-s.coupler_force > p.coupler_soft_limit),
        holds(s.level > 1.5),
        s.standing,
    )


def _asks_for_both(s: Situation, p: Any) -> Array:
    now = holds(s.mode > 3.5)
    error_limit = p.combined_error * either(now, 0.5, 1.0)
    force_limit = p.full_brake_force * either(now, 0.8, 1.0)
    return some(holds(s.error < -error_limit), holds(s.wanted < -force_limit))
