"""The adhesion that a railway counts on: one number a type of engine, falling with the speed.

Numbers and one formula; knows nothing of slip, vehicles or track.
"""

from __future__ import annotations

from plant_models.hybrid import Array

STANDING_ADHESION = {
    "sncf_multi_motor_bogie": 0.33,
    "sncf_mono_motor_bogie": 0.35,
    "db_diesel": 0.30,
    "db_electric": 0.33,
    "renfe_diesel_low": 0.22,
    "renfe_diesel_high": 0.29,
    "renfe_electric_classic": 0.27,
    "renfe_electric_modern": 0.31,
    "usa_sd75mac": 0.45,
}
"""Adhesion coefficient at standstill ``delta0`` [1] by railway and engine. Source: Aguiar Cota 2019, Table 2.1."""


def adhesion_coefficient(speed: Array, standing: Array) -> Array:
    """Adhesion coefficient on dry rails, ``delta0 / (1 + 0.01 v)`` with v in km/h [1].

    Args:
        speed: magnitude of the speed [m/s], any shape.
        standing: coefficient at standstill ``delta0`` [1], see `STANDING_ADHESION`.

    Source: Aguiar Cota 2019, (2.7).
    """
    return standing / (1.0 + 0.036 * speed)
