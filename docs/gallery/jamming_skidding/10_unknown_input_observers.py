"""Gains and poles of the printed proportional-integral observer, and what unknown-input observers do with an unknown
effort.
"""

from __future__ import annotations

from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from shared.sheet import Sheet

from fmu_observer.design.decoupling import decoupling_condition
from fmu_observer.design.extended_disturbance import extended_gain
from fmu_observer.models.observer_model import named_as, stacked_of
from fmu_observer.models.train.coupled_vehicles_model import coupled_vehicles
from fmu_observer.observers.generic.continuous import DecouplingUio, Luenberger, ProportionalIntegralUio
from plant_models.hybrid import HybridSystem, Runtime, input_signal, output_signal, vector

STEP, STOP = 5e-3, 20.0  # [s]
LOST = 0.4  # of the effort, from 8 s to 12 s [m/s2]
OURS = "ours: locomotive and wagon behind a coupler; the thesis shows these two observers on no plant of order three"


class Beside(HybridSystem):
    """The plant of `coupled_vehicles` under an unknown acceleration, and an observer that sees both speeds."""

    name, description, source = "beside", "A plant and its observer", "docs/gallery"
    inputs = (input_signal("unknown", "m/s2"),)

    def __init__(self, observer: Any) -> None:
        self.model, self.observer = observer.model, observer
        self.states = (*self.model.states, *observer.states)
        self.outputs = (output_signal("error", "m"), output_signal("residual", "m/s"))
        self._p = observer.unpack_parameters(observer.start_parameters())
        super().__init__()

    def flow(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        moved = self.model.flow(stacked_of(x, self.model.states), vector(0.0)) + self.model.H @ vector(u.unknown)
        return named_as(self.model.states, moved) | self.observer.flow(t, x, self._seen(x), self._p)

    def output(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        found = self.observer.output(t, x, self._seen(x), self._p)
        return {"error": found["elongation"] - x.elongation, "residual": found.get("residual_wagon_speed", 0.0)}

    def _seen(self, x: Any) -> Any:
        return self.observer.unpack_inputs(vector(0.0, *(self.model.C @ stacked_of(x, self.model.states))))


def run(observer: Any) -> tuple[np.ndarray, np.ndarray]:
    """Times and outputs while the locomotive loses its effort for four seconds."""
    runtime = Runtime(Beside(observer))
    runtime.start(0.0)
    times, rows = [], []
    for k in range(1, round(STOP / STEP) + 1):
        runtime.u[0] = -LOST if 8.0 <= (k - 1) * STEP < 12.0 else 0.0
        runtime.advance(k * STEP)
        times.append(k * STEP)
        rows.append(runtime.update_outputs().copy())
    return np.array(times), np.array(rows)


def main() -> None:
    """Printed gains, existence, and the coupler's elongation while the effort is lost."""
    sheet = Sheet(__file__, "Unknown-input observers", "Aguiar Cota 2019, (2.12)-(2.17), 3.2.3.1")
    gain = extended_gain(np.array([[-0.1]]), np.eye(1), np.eye(1), 2, [-50.0, -50.0, -1.5])
    for name, value, published in zip(("v", "d", "d'"), gain[:, 0], (101.4, 2650.0, 3750.0), strict=True):
        sheet.add(f"gain of {name} for poles -50, -50, -1.5 1/s", "SI", published, value)
    printed = next(ProportionalIntegralUio().findings(preset="as_published"))
    sheet.add("slowest pole of the printed gain", "1/s", -1.5, printed.numbers["abscissa"], independent=-1.5)
    exists = decoupling_condition(coupled_vehicles())
    sheet.add("rank(C H) where two speeds are measured", "1", None, exists.numbers["rank_CH"], OURS)
    sheet.add("invariant zeros there", "1", None, exists.numbers["invariant_zeros"], OURS)
    figure, axis = plt.subplots(figsize=(6, 4), layout="constrained")
    kinds = {
        "luenberger": Luenberger("coupled_vehicles"),
        "proportional_integral_uio": ProportionalIntegralUio("coupled_vehicles", rho=1),
        "decoupling_uio": DecouplingUio(),
    }
    for name, observer in kinds.items():
        t, rows = run(observer)
        late = t > 8.0
        worst = float(np.abs(rows[late, 0]).max())
        shown: Any = 1e3 * worst if worst > 1e-9 else "< 1e-6"
        sheet.add(f"largest error of the elongation under a lost effort, {name}", "mm", None, shown, OURS, repeats=0.05)
        axis.plot(t[late], 1e3 * rows[late, 0], label=name)
    axis.set(xlabel="time [s]", ylabel="error of the coupler's elongation [mm]")
    sheet.finish(figure, axis)


if __name__ == "__main__":
    main()
