"""Covariances of the motor's filter as they are printed, one preset a row. A table.

The six numbers of a row are variances per sample: of the process noise in current d [A2], current q [A2], speed
[rad2/s2] and angle [rad2], then of both measured currents [A2].
Source: Allaoui 2024, section III.3.1 (hand) and Tables 1 to 3.
"""

from __future__ import annotations

from collections.abc import Mapping

ROWS: Mapping[str, tuple[float, float, float, float, float, float]] = {
    "hand": (0.01, 0.001, 10.0, 10.0, 0.02, 0.001),
    "pso_5": (0.0105, 0.0042, 0.0484, 0.1165, 0.2145, 0.0750),
    "pso_10": (0.0108, 0.0024, 0.0803, 0.1154, 0.1961, 0.0755),
    "pso_15": (0.0014, 0.0043, 0.0898, 0.0881, 0.2245, 0.1270),
    "pso_20": (0.0022, 0.0035, 0.1675, 0.2367, 0.2937, 0.1569),
    "ga_5": (0.036, 0.112, 0.559, 0.971, 0.884, 0.512),
    "ga_10": (0.014, 0.104, 0.856, 1.047, 0.942, 0.655),
    "ga_15": (0.013, 0.141, 0.863, 1.144, 1.760, 1.601),
    "ga_20": (0.013, 0.014, 0.818, 1.258, 0.650, 0.347),
    "bbo_5": (0.1090, 0.3750, 8.8364, 9.0673, 0.1818, 0.0838),
    "bbo_10": (0.0881, 0.4852, 17.7553, 12.3701, 12.2714, 4.1770),
    "bbo_15": (0.5789, 0.1584, 6.1838, 19.4921, 17.0806, 12.9395),
    "bbo_20": (0.0127, 0.0108, 0.6934, 0.5012, 1.5007, 1.5733),
    "hand_repaired": (0.01, 0.001, 10.0, 10.0, 0.01, 0.001),
    "ga_20_repaired": (0.013, 0.014, 0.818, 1.258, 0.650, 1.347),
    "true_noise": (1e-3, 1e-3, 1e-3, 1e-3, 0.1, 0.1),
}
"""Rows by preset. `hand_repaired` has 0.01 in place of the printed 0.02 of current d, `ga_20_repaired` 1.347 in place
of 0.347 of current q: conjectures, which reproduce the printed errors. `true_noise` holds the variances of the noise.
"""

MOTOR_PRESETS = {
    row: {"process_variance": values[:4], "measurement_variance": values[4:]} for row, values in ROWS.items()
}
