"""The voltage-source inverter, averaged over a period of its carrier: what reaches the motor of the wanted voltages."""

from __future__ import annotations

from typing import Any

import numpy as np

from plant_models.hybrid import Array, HybridSystem, input_signal, output_signal, parameter
from plant_models.railway.traction.transforms import clarke, inverse_clarke


class Inverter(HybridSystem):
    """Duty cycles by centred zero sequence: ``duty_k = 1/2 + (v_k - (max v + min v)/2) / U``, kept within 0 and 1.

    Up to a vector of ``U / sqrt(3)`` the motor gets the voltages asked for, whatever their angle; beyond, the duties
    are cut and the vector stays in the hexagon of the inverter. Switching itself, dead time and voltage drops are left
    out: the output is the mean over a carrier period. The direct current follows from the balance of power, ``i = 3/2
    (v . i) / U``: what the drive takes from the line, or gives back.

    Source: standard averaged model (space-vector modulation); Allaoui 2024, Fig. 4.15, names an inverter and prints no
    equations.
    """

    name = "inverter"
    description = "Voltage-source inverter with space-vector modulation, averaged"
    source = "standard averaged model; Allaoui 2024, Fig. 4.15, names one"
    internal_step = 1e-2  # nothing flows
    bounded_parameters = "all"
    inputs = (
        *(
            input_signal(f"wanted_voltage_{axis}", "V", 0.0, f"Voltage asked for along {axis}")
            for axis in ("alpha", "beta")
        ),
        input_signal("current_alpha", "A", 0.0, "Current along alpha, for the direct current", optional=True),
        input_signal("current_beta", "A", 0.0, "Current along beta, for the direct current", optional=True),
    )
    outputs = (
        *(output_signal(f"voltage_{axis}", "V", f"Voltage along {axis}") for axis in ("alpha", "beta")),
        *(output_signal(f"duty_{phase}", "1", f"Duty cycle of phase {phase}") for phase in "abc"),
        output_signal("direct_current", "A", "Current taken from the direct voltage"),
    )
    parameters = (parameter("direct_voltage", "V", 28.0, "Direct voltage U", min=1e-9),)
    presets = {"drive_100w": {}, "traction_200kw": {"direct_voltage": 1500.0}}
    default_preset = "drive_100w"

    def output(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        a, b, c = inverse_clarke(u.wanted_voltage_alpha, u.wanted_voltage_beta)
        middle = 0.5 * (np.maximum(np.maximum(a, b), c) + np.minimum(np.minimum(a, b), c))
        duties = [np.minimum(np.maximum(0.5 + (v - middle) / p.direct_voltage, 0.0), 1.0) for v in (a, b, c)]
        alpha, beta, _ = clarke(*(p.direct_voltage * duty for duty in duties))
        power = 1.5 * (alpha * u.current_alpha + beta * u.current_beta)
        return {
            "voltage_alpha": alpha,
            "voltage_beta": beta,
            **{f"duty_{phase}": duty for phase, duty in zip("abc", duties, strict=True)},
            "direct_current": power / p.direct_voltage,
        }
