"""Recombinant E. coli in a batch culture: biomass, glycerol and the enzyme that they make. Knows only the hybrid
foundation.
"""

from __future__ import annotations

from typing import Any, Literal

import numpy as np

from plant_models.exhibits.noisy_plant import NoisyPlant
from plant_models.hybrid import Array, discrete_output, output_signal, parameter, state
from plant_models.hybrid.option import require_chosen

Glycerol = Literal["clamped", "as_published"]
HOUR = 3600.0  # [s]


class EcoliCulture(NoisyPlant):
    """Culture ``dX = mu X - D X``, ``dS = -ys mu X - km X``, ``dP = yp mu i X - D P`` with ``mu = mu_m S / (ks + S)``,
    ``D = kd exp(-kp / P)``, ``i = I / (I + kI)``; X and the light ``L = yl mu i X P`` are measured: Omar 2012, (4.7.1)
    to (4.7.4), constants of its table.

    Time is in seconds, so that the rates of the table are divided by 3600; masses in kg/m3, which is the printed g/l.
    The light has the printed scale, mu in 1/h. The inducer concentration I is not printed: 1 kg/m3 [ours]. kd is
    printed in g/l and acts as a rate.

    Maintenance consumes glycerol that is no longer there: from the printed start it is gone after 7.6 h and becomes
    negative. ``clamped`` [ours] ends growth and maintenance where there is no glycerol.

    Presets: `nominal` (default), start (0.05, 2, 0.01); `other_start`, (0.06, 2.2, 0.012); `noisy`, the nominal start
    with measurement noise of 1 % of X = 0.5 and of the light there.

    Args:
        glycerol: ``clamped``, or ``as_published``.
    """

    name = "ecoli_culture"
    description = "Batch culture of recombinant E. coli, biomass and light measured"
    source = "Omar 2012, (4.7.1)-(4.7.4)"
    internal_step = 36.0
    moving = (
        state("biomass_state", "kg/m3", 0.05, "Biomass"),
        state("glycerol_state", "kg/m3", 2.0, "Glycerol"),
        state("enzyme_state", "kg/m3", 0.01, "Beta-galactosidase"),
    )
    plain_outputs = (
        output_signal("biomass", "kg/m3", "Biomass X"),
        output_signal("glycerol", "kg/m3", "Glycerol S"),
        output_signal("enzyme", "kg/m3", "Beta-galactosidase P"),
        output_signal("light", "1", "Light L without noise, now"),
    )
    presets = {
        "nominal": {},
        "other_start": {"biomass_state": 0.06, "glycerol_state": 2.2, "enzyme_state": 0.012},
        "noisy": {"measurement_noise": (5e-3, 6e-3)},
    }
    default_preset = "nominal"
    option_choices = {"glycerol": ("clamped", "as_published")}

    def __init__(self, glycerol: Glycerol = "clamped") -> None:
        require_chosen(self.name, self.option_choices, glycerol=glycerol)
        self.glycerol: Glycerol = glycerol
        self.declare(
            (
                discrete_output("measured_biomass", "kg/m3", "Measured biomass"),
                discrete_output("measured_light", "1", "Measured light"),
            ),
            (
                parameter("growth_rate", "1/s", 0.49 / HOUR, "Largest growth rate mu_m", min=0.0),
                parameter("half_saturation", "kg/m3", 0.06, "Glycerol ks at half of the growth rate", min=1e-6),
                parameter("decay_threshold", "kg/m3", 0.047, "Enzyme kp that starts the decay", min=0.0),
                parameter("decay_rate", "1/s", 0.005 / HOUR, "Rate kd of decay of biomass and enzyme", min=0.0),
                parameter("maintenance", "1/s", 0.21 / HOUR, "Glycerol km that biomass consumes for itself", min=0.0),
                parameter("half_induction", "kg/m3", 0.03, "Inducer kI at half of the induction", min=1e-6),
                parameter("inducer", "kg/m3", 1.0, "Concentration I of the inducer arabinose", min=0.0),
                parameter("glycerol_yield", "1", 0.75, "Glycerol ys consumed for growth", min=0.0),
                parameter("enzyme_yield", "1", 0.32, "Enzyme yp made with growth", min=0.0),
                parameter("light_yield", "s", 17.6 * HOUR, "Light yl of growing biomass and enzyme", min=0.0),
            ),
            period=0.1 * HOUR,
        )
        super().__init__(glycerol=glycerol)

    def flow(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        X, P = x.biomass_state, x.enzyme_state
        mu, fed = self._growth(x.glycerol_state, p)
        decay = np.where(P > 0.0, p.decay_rate * np.exp(-p.decay_threshold / np.where(P > 0.0, P, 1.0)), 0.0)
        made = p.enzyme_yield * mu * _induction(p) * X
        return {
            "biomass_state": mu * X - decay * X,
            "glycerol_state": -(p.glycerol_yield * mu + p.maintenance * fed) * X,
            "enzyme_state": made - decay * P,
        }

    def measured(self, x: Any, p: Any) -> tuple[Array, ...]:
        """Biomass and light, (4.7.4)."""
        X, growing = x.biomass_state, self._growth(x.glycerol_state, p)[0]
        return X, p.light_yield * growing * _induction(p) * X * x.enzyme_state

    def plain(self, x: Any, p: Any) -> dict[str, Array]:
        biomass, light = self.measured(x, p)
        return {"biomass": biomass, "glycerol": x.glycerol_state, "enzyme": x.enzyme_state, "light": light}

    def _growth(self, S: Array, p: Any) -> tuple[Array, Array]:
        """Growth rate mu [1/s], and 1 where there is glycerol to live on."""
        if self.glycerol == "as_published":
            return p.growth_rate * S / (p.half_saturation + S), 1.0
        left = np.maximum(S, 0.0)
        return p.growth_rate * left / (p.half_saturation + left), np.where(S > 0.0, 1.0, 0.0)


def _induction(p: Any) -> Array:
    return p.inducer / (p.inducer + p.half_induction)
