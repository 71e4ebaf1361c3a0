"""The single-mass train: one body, one wheel, the adhesion between them.

Declares the hybrid system and its forces; the curves, the resistance and the track come from their own files.
"""

from __future__ import annotations

from typing import Any, Literal

import numpy as np

from plant_models.hybrid import Array, HybridSystem, input_signal, output_signal, parameter, state, vector
from plant_models.hybrid.option import require_chosen
from plant_models.railway.adhesion.law import ADHESION_LAWS
from plant_models.railway.track.track import GradientShape, Track, ZoneAxis
from plant_models.railway.vehicle.resistance import gradient_resistance, moving_resistance
from plant_models.railway.vehicle.train_signals import DOWNHILL_PULL, FREE_FALL, POINT_OUTPUTS, POINT_STATES, SLIP_FLOOR

_CHAPTER_3 = {"davis_b": 32.0, "davis_c": 1.7}
_TABLE_4_1 = {"mass": 166e3, "davis_b": 32.4, "davis_c": 1.6529}


class Locomotive(HybridSystem):
    """Train as one mass on one wheel: ``J dw = r F - r F_ad(lam)``, ``dp = v``, ``M dv = F_ad - F_r(v) - F_g(p)``.

    The adhesion force is ``F_ad = mu(lam) M g`` with the slip ``lam = (r w - v) / max(|v|, slip_floor)``; the floor
    keeps the slip finite at standstill. ``J`` is ``n_axles * wheel_inertia``: the thesis prints one wheel's inertia and
    does not say whether it stands for all axles, so ``n_axles`` is 1 as printed, and 4 in a preset of its own.

    Everything that resists is resolved as such and cannot drive:

    - A negative `effort` is a brake: dry friction ``r |F| / J`` on the wheel. It can lock the wheel, never turn it
      backwards.
    - The constant Davis term is dry friction ``a / M`` on the train. It can stop the train, never push it.
    - While a braked wheel stands, the contact holds the train like dry friction, up to the smaller of brake and
      adhesion limit. A creep curve alone is a damper at standstill and would let a parked train crawl down a gradient.
      The hold fades between half and full slip: a sliding wheel has the friction of the curve.

    So a train under its brake stops in finite time and stays; without brake it stays where the gradient pulls less than
    ``davis_a``, and rolls otherwise, backwards too. Traction acts in one direction, `effort` > 0 along increasing
    position.

    Args:
        adhesion: ``burckhardt`` (3.12) or ``polach`` (3.4)-(3.10).
        zones: zones of degraded adhesion along ``time`` or ``position``.
        zone_count: number of zones.
        gradient_shape: gradient ``constant`` between its points, or ``linear``.
        gradient_count: number of gradient points.

    Raises:
        ValueError: an unknown option, or a count below one.

    Presets: `chapter_3` (default), `chapter_3_four_axles`, `table_4_1` (the thesis applies the adhesion of the whole
    166 t train, although only its 90 t locomotive is motored), `table_4_1_motored_axles` (adhesion of the 90 t only).

    Source: Bouchama 2024, (3.1)-(3.3), (3.11)-(3.15), Table 4.1; the set-valued friction, the hold and the floor are
    ours.
    """

    name = "locomotive"
    description = "Single-mass train with wheel slip: effort in, position, speed and wheel speed out"
    source = "Bouchama 2024, (3.1)-(3.15) and Table 4.1"
    method = "rosenbrock"  # the wheel's time constant is 4.6e-5 s per m/s of speed: far below the step near standstill
    internal_step = 5e-4  # at 1 ms the linearly implicit step overshoots the creep curve below the slip floor by mm/s
    states = (
        *POINT_STATES,
        state(
            "wheel_rate", "rad/s", 0.0, "Angular speed of the wheel at start; speed / wheel_radius for a rolling wheel"
        ),
    )
    frictions = ("train_speed", "wheel_rate")
    inputs = (input_signal("effort", "N", 0.0, "Effort at the wheel rim: traction > 0, brake < 0"),)
    outputs = (
        *POINT_OUTPUTS,
        output_signal("wheel_speed", "m/s", "Circumferential speed of the wheel, r*w", display_unit="km/h"),
        output_signal("slip", "1", "Slip ratio (r*w - v) / max(|v|, slip_floor), (3.13)"),
        output_signal("adhesion_force", "N", "Force of the rail on the wheel along the track"),
        output_signal("resistance_force", "N", "Running resistance, against the motion"),
        DOWNHILL_PULL,
        output_signal("adhesion_degraded", "1", "0 nominal .. 1 degraded adhesion"),
    )
    presets = {
        "chapter_3": _CHAPTER_3,
        "chapter_3_four_axles": {**_CHAPTER_3, "n_axles": 4.0},
        "table_4_1": _TABLE_4_1,
        "table_4_1_motored_axles": {**_TABLE_4_1, "adhesive_share": 90.0 / 166.0},
    }
    default_preset = "chapter_3"
    option_choices = {
        "adhesion": tuple(ADHESION_LAWS),
        "zones": ("time", "position"),
        "zone_count": range(1, 65),
        "gradient_shape": ("constant", "linear"),
        "gradient_count": range(1, 65),
    }

    def __init__(
        self,
        *,
        adhesion: Literal["burckhardt", "polach"] = "burckhardt",
        zones: ZoneAxis = "time",
        zone_count: int = 3,
        gradient_shape: GradientShape = "constant",
        gradient_count: int = 4,
    ) -> None:
        require_chosen(self.name, self.option_choices, adhesion=adhesion)
        self._law = ADHESION_LAWS[adhesion]()
        self._track = Track(zones, zone_count, gradient_shape, gradient_count)
        self.switchings = self._track.edges
        self.parameters = (*_VEHICLE, *self._law.parameters, *self._track.parameters)
        super().__init__(
            adhesion=adhesion,
            zones=zones,
            zone_count=zone_count,
            gradient_shape=gradient_shape,
            gradient_count=gradient_count,
        )

    def flow(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        """Derivatives of position, speed and wheel rate without dry friction."""
        creep = self._creep_force(t, x, u, p)
        resistance = moving_resistance(x.train_speed, p.davis_b, p.davis_c) + self._gradient_force(x.train_position, p)
        traction = np.maximum(u.effort, 0.0)
        return {
            "train_position": x.train_speed,
            "train_speed": (creep - resistance) / p.mass,
            "wheel_rate": p.wheel_radius * (traction - creep) / (p.n_axles * p.wheel_inertia),
        }

    def friction(self, t: Array, x: Any, u: Any, p: Any) -> Array:
        """Dry friction on the speed [m/s2] and on the wheel rate [rad/s2], shape (2,) or (2, members)."""
        brake = np.maximum(-u.effort, 0.0)
        return vector(
            (p.davis_a + self._standing_hold(t, x, u, p)) / p.mass,
            p.wheel_radius * brake / (p.n_axles * p.wheel_inertia),
        )

    def output(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        """The declared outputs; at rest the forces are those that hold the train."""
        speed, creep = x.train_speed, self._creep_force(t, x, u, p)
        gradient = self._gradient_force(x.train_position, p)
        moving = moving_resistance(speed, p.davis_b, p.davis_c)
        direction = np.sign(speed)
        push = creep - moving - gradient
        dry = np.where(speed == 0.0, np.clip(push, -p.davis_a, p.davis_a), direction * p.davis_a)
        hold = self._standing_hold(t, x, u, p)
        held = np.where(speed == 0.0, np.clip(push - dry, -hold, hold), direction * hold)
        return {
            "position": x.train_position,
            "speed": speed,
            "acceleration": (push - dry - held) / p.mass,
            "wheel_speed": p.wheel_radius * x.wheel_rate,
            "slip": self._slip(x, p),
            "adhesion_force": creep - held,
            "resistance_force": moving + dry,
            "gradient_force": gradient,
            "adhesion_degraded": self._degraded(t, x, u, p),
        }

    def switching(self, t: Array, x: Any, u: Any, p: Any) -> Array:
        return vector(*self._track.beyond_edges(t, x.train_position, p))

    def requirements(self, p: Any) -> dict[str, Array]:
        return self._track.requirements(p)

    # -- forces -----------------------------------------------------------------------------------------------------

    def _slip(self, x: Any, p: Any) -> Array:
        return (p.wheel_radius * x.wheel_rate - x.train_speed) / np.maximum(np.abs(x.train_speed), p.slip_floor)

    def _degraded(self, t: Array, x: Any, u: Any, p: Any) -> Array:
        return self._track.degraded(self.switches(t, x, u, p))

    def _creep_force(self, t: Array, x: Any, u: Any, p: Any) -> Array:
        reference = np.maximum(np.abs(x.train_speed), p.slip_floor)
        return self._law.coefficient(self._slip(x, p), reference, self._degraded(t, x, u, p), p) * _adhesive_weight(p)

    def _gradient_force(self, position: Array, p: Any) -> Array:
        return gradient_resistance(p.mass, p.gravity, self._track.gradient(position, p))

    def _standing_hold(self, t: Array, x: Any, u: Any, p: Any) -> Array:
        """Force [N] by which a standing braked wheel holds the train beyond what the creep curve does already."""
        brake = np.maximum(-u.effort, 0.0)
        limit = self._law.limit(self._degraded(t, x, u, p), p) * _adhesive_weight(p)
        missing = np.maximum(np.minimum(brake, limit) - np.abs(self._creep_force(t, x, u, p)), 0.0)
        fading = np.clip(2.0 - 2.0 * np.abs(self._slip(x, p)), 0.0, 1.0)
        return np.where(x.wheel_rate == 0.0, missing * fading, 0.0)


def _adhesive_weight(p: Any) -> Array:
    return p.adhesive_share * p.mass * p.gravity


_VEHICLE = (
    parameter("mass", "kg", 90e3, "Mass of the train M", min=1.0),
    parameter("adhesive_share", "1", 1.0, "Share of the mass that rests on motored and braked axles", min=0.0, max=1.0),
    parameter("wheel_inertia", "kg.m2", 225.0, "Moment of inertia of one axle J", min=1e-3),
    parameter("n_axles", "1", 1.0, "Number of axles; the total inertia is n_axles * wheel_inertia", min=1.0),
    parameter("wheel_radius", "m", 0.575, "Radius of the wheel r", min=1e-3),
    FREE_FALL,
    parameter("davis_a", "N", 900.0, "Running resistance, constant part; dry friction", min=0.0),
    parameter("davis_b", "N.s/m", 32.0, "Running resistance, viscous part", min=0.0),
    parameter("davis_c", "N.s2/m2", 1.7, "Running resistance, aerodynamic part", min=0.0),
    SLIP_FLOOR,
)
