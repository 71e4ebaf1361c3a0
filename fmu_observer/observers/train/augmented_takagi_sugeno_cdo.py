"""S7, Takagi-Sugeno family: augmented observer on the applied effort, with a continuous odometer and sampled
positions.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from fmu_observer.design.augmented_gains import augmented_matrix
from fmu_observer.observers.train.augmented_observer import ORDER, WAYS_OF_FIXES, AugmentedTrainObserver, Fixes
from plant_models.hybrid import Array, parameter

NONE = (0.0,) * ORDER
# design_for_gap(0.5), and position_gains of UNIT_POLES times 1.5 and 0.7, rounded to six digits; a test recomputes
# them.
BALISES_ONLY = (8.24228, 23.3807, 27.0470, 10.7682)
BALISES_BESIDE_FIXES = (6.825, 16.0313, 15.3563, 5.0625)
FIXES = (3.185, 3.49125, 1.56065, 0.2401)
ODOMETER = (0.0, 3.0, 3.0, 1.0)  # three poles at -1 for speed, unknown acceleration and its rate


def _preset(balise: tuple[float, ...], gps: tuple[float, ...], odometer: tuple[float, ...] = NONE) -> dict[str, Any]:
    return {
        "balise_gain": balise,
        "balise_decay": balise[0],
        "gps_gain": gps,
        "gps_decay": gps[0],
        "odometer_gain": odometer,
    }


class AugmentedTakagiSugenoCdo(AugmentedTrainObserver):
    """Takagi-Sugeno observer of a locomotive in a train: Bouchama 2024, (4.12)-(4.13) with (2.6).

    `AugmentedTrainObserver` with the applied effort for F, plus ``-K_2 (v - y)`` with the odometer y; the drag is
    ``(b + c v_i) v`` blended between the vertices ``v_1 = premise_min`` and ``v_2 = premise_max`` by the weight
    ``h_1 = (v_2 - y)/(v_2 - v_1)``, limited to [0, 1], of the odometer now.

    Ours, none is printed: all gains, and that they are the same at both vertices, whose drag slopes differ by a
    thousandth of the slowest pole; the certificate covers both vertices. The thesis interpolates the odometer, which
    needs the next sample; here it is the input as it stands, held between samples where it is sampled.

    The inertia of the wheels is neglected, as in (3.44): ``(J / r^2)`` times the acceleration is taken for coupler
    force, 1.4 kN at 0.5 m/s2 with four axles. Slip does not disturb position and speed unless `odometer_gain` is set.

    Args:
        fixes: how satellite fixes come: ``event``, or ``sampled`` from the input `fix_position`.

    Presets [ours]: `gps_and_balises` (default): poles 1.5 and 0.7 times (0.5, 0.8, 1.25, 2), balises certified to 0.66
    s and any mixture with fixes to 0.25 s, enough for 10 Hz. `gps`: the same for fixes, no balises. `balises`: designed
    for 0.5 s, certified to 0.55 s. `odometer_trusted`: speed and coupler force from the odometer, positions correct the
    position only; certified for gaps of any length, but slip goes into the speed.
    """

    name = "augmented_takagi_sugeno_cdo"
    description = "Augmented Takagi-Sugeno observer: speed, position and coupler force of a locomotive in a train"
    source = "Bouchama 2024, (4.12)-(4.13); gains ours"
    own_parameters = (
        parameter("premise_min", "m/s", 5.0, "Speed of the first vertex", min=0.0),
        parameter("premise_max", "m/s", 50.0, "Speed of the second vertex", min=0.0),
        parameter(
            "balise_gain", "1", BALISES_BESIDE_FIXES, "Gain of balises, state i per m; all 0: not used", size=ORDER
        ),
        parameter("balise_decay", "1/s", BALISES_BESIDE_FIXES[0], "Decay rate of the innovation of a balise", min=0.0),
        parameter("gps_gain", "1", FIXES, "Gain of satellite fixes, state i per m; all 0: not used", size=ORDER),
        parameter("gps_decay", "1/s", FIXES[0], "Decay rate of the innovation of a fix", min=0.0),
        parameter("odometer_gain", "1", NONE, "Gain of the continuous odometer, state i per m/s", size=ORDER),
    )
    stability_parameters = (*(s.name for s in own_parameters), "fix_period")
    presets = {
        "gps_and_balises": _preset(BALISES_BESIDE_FIXES, FIXES),
        "gps": _preset(NONE, FIXES),
        "balises": _preset(BALISES_ONLY, NONE),
        "odometer_trusted": _preset((2.0, 0.0, 0.0, 0.0), (0.5, 0.0, 0.0, 0.0), ODOMETER),
    }
    default_preset = "gps_and_balises"
    option_choices = {"fixes": WAYS_OF_FIXES}

    def __init__(self, fixes: Fixes = "event") -> None:
        super().__init__(fixes=fixes)

    def traction(self, x: Any, u: Any, p: Any) -> Array:
        """The applied effort [N]."""
        return u.effort

    def drag(self, x: Any, u: Any, p: Any) -> Array:
        """``(b + c v_i) v`` [N], blended over the vertices by the odometer."""
        span = p.premise_max - p.premise_min  # at equal vertices any weight is right
        h = np.clip((p.premise_max - u.odometer) / np.where(span == 0.0, 1.0, span), 0.0, 1.0)
        return (p.davis_b + p.davis_c * (h * p.premise_min + (1.0 - h) * p.premise_max)) * x.estimated_speed

    def continuous_correction(self, x: Any, u: Any, p: Any) -> tuple[Array, ...]:
        """``K_2 (v - y)``."""
        return tuple(p.odometer_gain[i] * (x.estimated_speed - u.odometer) for i in range(ORDER))

    def gains_of(self, sensor: str, p: Any) -> tuple[tuple[Array, ...], Array]:
        """The parameters of the sensor."""
        gain, decay = (p.balise_gain, p.balise_decay) if sensor == "balise" else (p.gps_gain, p.gps_decay)
        return tuple(gain[i] for i in range(ORDER)), decay

    def premise_range(self, p: Any) -> tuple[str, float, float]:
        """Input that the weights depend on, and the speeds of the vertices [m/s], between which they are exact."""
        low, high = sorted((float(p.premise_min), float(p.premise_max)))
        return "odometer", low, high

    def error_drifts(self, p: Any) -> tuple[np.ndarray, ...]:
        """Matrices at both vertices; the drag is linear in the speed at any weight."""
        odometer = np.outer(np.asarray(p.odometer_gain, dtype=float), np.eye(ORDER)[1])
        speeds = (float(p.premise_min), float(p.premise_max))
        return tuple(augmented_matrix(float((p.davis_b + p.davis_c * v) / p.mass)) - odometer for v in speeds)
