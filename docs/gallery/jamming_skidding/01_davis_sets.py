"""The resistances that the thesis uses, per unit mass: where they hold, and where they pull the train."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np
from shared.sheet import Sheet

from plant_models.railway.vehicle.resistance import DAVIS_SETS, davis_from_vehicle

NOT_PRINTED = "only the coefficients are published; the independent number is computed from them"
INDEPENDENT = {
    "set_b": {45.0: -0.331},
    "set_d": {0.0: 0.46, 17.0: 0.4875, 30.0: 0.415, 45.0: 0.2305, 50.0: 0.145},
    "set_e": {17.0: 0.371, 30.0: 0.35, 45.0: 0.2825},
    "set_f": {17.0: 0.277, 30.0: 0.22, 45.0: 0.07},
}
ZERO_CROSSINGS = {"set_b": 17.2, "set_d": 57.2, "set_f": 50.0}
TGV = {"constant part": 2.885, "viscous part at 300 km/h": 12.54, "aerodynamic part at 300 km/h": 44.1}


def main() -> None:
    """Resistances at some speeds, speeds at which they vanish, and all sets as curves."""
    sheet = Sheet(
        __file__,
        "Davis resistance: sets A to F, and the rolling-stock formula",
        "Aguiar Cota 2019, (2.2)-(2.5), sections 3.2.3, 3.3.4, 4.3.4, Table 5.1",
    )
    for name, values in INDEPENDENT.items():
        for speed, independent in values.items():
            found = DAVIS_SETS[name].resistance(speed)
            sheet.add(f"w({speed:g} m/s), {name}", "m/s2", None, found, NOT_PRINTED, independent=independent)
    for name, independent in ZERO_CROSSINGS.items():
        crossing = DAVIS_SETS[name].zero_crossing
        assert crossing is not None
        sheet.add(f"speed at which {name} vanishes", "m/s", None, crossing, NOT_PRINTED, independent=independent)
    tgv = davis_from_vehicle(418e3, 17e3, 10.0, 10.0, 200.0, gamma=0.9, k1=9e-4, k2=20e-6)
    speed = 300.0 / 3.6
    why = "the thesis prints the formula and its ranges; 418 t, 17 t an axle and 200 m of a TGV are ours"
    for (part, independent), found in zip(
        TGV.items(), (tgv.a / 1e3, tgv.b * speed / 1e3, tgv.c * speed**2 / 1e3), strict=True
    ):
        sheet.add(f"TGV, {part}", "kN", None, found, why, independent=independent)
    figure, axis = plt.subplots(figsize=(7, 4.5), layout="constrained")
    speeds = np.linspace(0.0, 60.0, 200)
    for name, chosen in DAVIS_SETS.items():
        if name in {"set_a", "set_b_observer"}:  # five times the others at 50 m/s; B less 20 %
            continue
        fitted = (speeds >= chosen.fitted_from) & (speeds <= chosen.fitted_to)
        w = np.array([chosen.resistance(v) for v in speeds])
        (curve,) = axis.plot(speeds, w, ":", lw=1)
        axis.plot(speeds[fitted], w[fitted], color=curve.get_color(), label=name)
    axis.axhline(0.0, color="k", lw=0.5)
    axis.set(xlabel="speed [m/s]", ylabel="resistance per unit mass [m/s2]", ylim=(-0.8, 1.5))
    axis.legend(title="solid: within the range of the fit")
    axis.grid(alpha=0.3)
    sheet.finish(figure)


if __name__ == "__main__":
    main()
