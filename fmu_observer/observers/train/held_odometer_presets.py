"""Gains and bounds of the observers with a held odometer reading, as published and ours. Data only.

`lyapunov_matrix` and `bound_decay` are ours throughout: `bound_matrix` of `fmu_observer.design.proposition_4_1` at 0.93
of the slowest pole, to five digits; a test recomputes the proof. Those of the thesis are parameters of the published
bound: beta, m and the gain.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

# Aguiar Cota 2019, 4.3.4: sets C and D of the running resistance, a unit of mass
SET_C = {"mass": 1.0, "davis_a": 0.0, "davis_b": 0.04, "davis_c": 0.0, "speed_max": 50.0}
SET_D = {"mass": 1.0, "davis_a": 0.46, "davis_b": 5.7e-3, "davis_c": -2.4e-4, "speed_max": 50.0}
NOTHING_UNKNOWN = {
    "odometer_error": 0.0,
    "unknown_acceleration": 0.0,
    "unknown_jerk": 0.0,
    "unknown_jerk_rate": 0.0,
    "acceleration_max": 1.7,
    "odometer_period": 0.2,
}

TABLE_4_1 = {  # by m and alpha: gain, beta, matrix and decay of the carried bound; alpha is not binding in all rows
    (0.1, 100): ((1.14, -2.34, -0.67), 1.9094, (0.67246, 0.42086, -0.73286, 1.1257, -2.8095, 8.682), 0.3),
    (0.1, 10): ((0.88, -2.05, -0.65), 1.9094, (0.70004, 0.47787, -0.84531, 1.3448, -3.0382, 8.6628), 0.26),
    (0.1, 4): ((0.816, -1.647, -0.762), 1.9095, (1.0313, 0.75094, -0.79812, 1.6385, -2.2044, 4.1809), 0.16),
    (0.1, 1): ((0.651, -0.688, -0.198), 2.8692, (2.7824, 3.3214, -4.8056, 10.009, -19.448, 54.031), 0.16),
    (0.5, 100): ((1.68, -3.52, -1.55), 2.8059, (0.50459, 0.32842, -0.37522, 0.60618, -0.92877, 1.719), 0.5),
    (0.5, 10): ((1.46, -2.131, -0.816), 3.5235, (0.88486, 0.71685, -0.79061, 1.4215, -2.2125, 4.4), 0.46),
    (1.0, 100): ((2.96, -5.513, -3.513), 7.1276, (0.35311, 0.18664, -0.093721, 0.19685, -0.1528, 0.16077), 0.93),
}

HELD_ODOMETER_PRESETS: Mapping[str, Mapping[str, Any]] = {
    "repaired": {  # ours: the gain of m = 1 1/s, alpha = 100, for the train of this package
        "gain": (2.96, -5.513, -3.513),
        "gain_schedule": -1.0,
        "published_beta": 7.1276,
        "published_decay": 1.0,
        "lyapunov_matrix": (0.33813, 0.17591, -0.087848, 0.18771, -0.14662, 0.15606),
        "bound_decay": 0.92,
    },
    "as_published": {  # 4.3.4: the beta there belongs to another gain; for this one it is 2.248 at least
        **SET_C,
        **NOTHING_UNKNOWN,
        "gain": (2.9, -5.5, -3.5),
        "gain_schedule": 1.0,
        "published_beta": 1.9,
        "published_decay": 0.1,
        "lyapunov_matrix": (0.34982, 0.18453, -0.093299, 0.19664, -0.15399, 0.16361),
        "bound_decay": 0.92,
    },
    "as_published_set_d": {  # 5.4
        **SET_D,
        **NOTHING_UNKNOWN,
        "gain": (3.4, -3.4, -1.5),
        "gain_schedule": 1.0,
        "published_beta": 1.9,
        "published_decay": 0.1,
        "lyapunov_matrix": (0.31309, 0.22745, -0.077209, 0.34987, -0.33993, 0.56438),
        "bound_decay": 0.58,
    },
    **{
        f"m_{m:g}_alpha_{alpha:g}".replace(".", "_"): {
            **SET_C,
            **NOTHING_UNKNOWN,
            "gain": gain,
            "gain_schedule": 0.0,
            "published_beta": beta,
            "published_decay": m,
            "lyapunov_matrix": P,
            "bound_decay": decay,
        }
        for (m, alpha), (gain, beta, P, decay) in TABLE_4_1.items()
    },
}
