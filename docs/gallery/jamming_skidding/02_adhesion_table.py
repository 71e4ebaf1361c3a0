"""The adhesion that railways count on, over the speed: Table 2.1 and (2.7)."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np
from shared.sheet import Sheet

from plant_models import PLANTS
from plant_models.hybrid import Runtime
from plant_models.railway.adhesion.adhesion_table import STANDING_ADHESION, adhesion_coefficient
from plant_models.railway.vehicle.resistance import ADHESION_LEVELS

PUBLISHED = {
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
INDEPENDENT = {0.0: 0.33, 50.0: 0.22, 100.0: 0.165, 200.0: 0.11, 300.0: 0.0825}
LEVEL = "the thesis names the level and gives no number: its share of the dry adhesion is ours"


def limit(level: float, kmh: float) -> float:
    """Largest deceleration [m/s2] that the rails give the plant, on the level [1] at a speed [km/h]."""
    runtime = Runtime(PLANTS["longitudinal_train"]())
    system = runtime.system
    runtime.x[1] = kmh / 3.6
    runtime.p[[s.name for s in system.parameters].index("adhesion_level")] = level
    runtime.start(0.0)
    return float(runtime.update_outputs()[[s.name for s in system.outputs].index("adhesion_limit")])


def main() -> None:
    """The table, the law at five speeds, and what is left on bad rails."""
    sheet = Sheet(__file__, "Adhesion between wheel and rail", "Aguiar Cota 2019, (2.6)-(2.7), Table 2.1")
    for railway, published in PUBLISHED.items():
        sheet.add(f"adhesion at rest, {railway}", "1", published, STANDING_ADHESION[railway])
    for kmh, independent in INDEPENDENT.items():
        found = float(adhesion_coefficient(kmh / 3.6, 0.33))
        why = "not printed at speeds; the independent number is of the same formula"
        sheet.add(f"coefficient at {kmh:g} km/h, 0.33 at rest", "1", None, found, why, independent=independent)
    for name, level in ADHESION_LEVELS.items():
        sheet.add(f"largest braking at 100 km/h, {name}", "m/s2", None, limit(level, 100.0), LEVEL)
    speeds = np.linspace(0.0, 300.0, 200)
    figure, axis = plt.subplots(figsize=(7, 4.5), layout="constrained")
    for railway in ("usa_sd75mac", "sncf_mono_motor_bogie", "sncf_multi_motor_bogie", "renfe_diesel_low"):
        axis.plot(speeds, adhesion_coefficient(speeds / 3.6, STANDING_ADHESION[railway]), label=railway)
    for name, level in ADHESION_LEVELS.items():
        if name != "dry":
            axis.plot(speeds, level * adhesion_coefficient(speeds / 3.6, 0.33), "--", label=f"0.33, {name}")
    axis.set(xlabel="speed [km/h]", ylabel="adhesion coefficient [1]", ylim=(0.0, 0.5))
    sheet.finish(figure, axis)


if __name__ == "__main__":
    main()
