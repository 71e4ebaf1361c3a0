"""Davis coefficients from the dimensions of the BB 27000: (3.15) against Table 4.1."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np
from shared.sheet import Sheet

from plant_models.railway.vehicle.resistance import davis_from_vehicle

WIDTH, HEIGHT, LENGTH = 2.857, 4.31, 19.5  # [m]
TABLE_4_1 = {"a": 900.0, "b": 32.4, "c": 1.6529}
UNITS = {"a": "N", "b": "N s/m", "c": "N s2/m2"}


def main() -> None:
    """Compute a, b, c and draw the resistance."""
    sheet = Sheet(__file__, "Running resistance of the locomotive", "Bouchama 2024, (3.14)-(3.15), Table 4.1")
    davis = davis_from_vehicle(90e3, 22.5e3, WIDTH * HEIGHT, WIDTH, LENGTH)
    for name, published in TABLE_4_1.items():
        sheet.add(f"coefficient {name}", UNITS[name], published, getattr(davis, name))
    speeds = np.linspace(0.0, 50.0, 200)
    figure, axis = plt.subplots(figsize=(6, 4), layout="constrained")
    axis.plot(3.6 * speeds, (davis.a + davis.b * speeds + davis.c * speeds**2) / 1e3)
    axis.set(xlabel="speed [km/h]", ylabel="running resistance [kN]")
    sheet.finish(figure, grids=[axis])


if __name__ == "__main__":
    main()
