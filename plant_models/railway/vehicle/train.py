"""The multi-vehicle train: a locomotive on its wheelsets, wagons on couplers, a brake pipe through all of them.

Declares the hybrid system and puts its forces together; wheelset, coupler, brake, resistance and track come from their
own files.
"""

from __future__ import annotations

from functools import reduce
from itertools import pairwise
from operator import add
from typing import Any, Literal

import numpy as np

from plant_models.hybrid import Array, HybridSystem, vector
from plant_models.hybrid.option import require_chosen
from plant_models.railway.adhesion.law import ADHESION_LAWS
from plant_models.railway.track.track import GradientShape, Track, ZoneAxis
from plant_models.railway.vehicle.coupler import coupler_force
from plant_models.railway.vehicle.pneumatic_brake import BrakePipe, brake_force, filling, limited
from plant_models.railway.vehicle.resistance import gradient_resistance, moving_resistance
from plant_models.railway.vehicle.train_signals import (
    AXLE_POSITIONS,
    ONE_WHEEL,
    train_inputs,
    train_outputs,
    train_parameters,
    train_states,
)
from plant_models.railway.vehicle.wheelset import Wheelset


class Train(HybridSystem):
    """One locomotive and n wagons: ``J dw_k = r F_k - r F_ad,k``,
    ``M_i dv_i = F_ad - F_r,i - F_b,i - F_g,i + Fc_{i-1} - Fc_i``.

    Vehicle 1 is the locomotive, vehicle ``i + 1`` wagon i. The states are the position of the locomotive's front, the
    speeds of all vehicles, the elongations ``e_i = p_i - p_{i+1}`` of the couplers beyond their neutral places (so
    vehicle lengths do not appear in them), the rates of the locomotive's wheelsets and the pressures in the brake
    cylinders.

    **Locomotive.** Each of its axles carries the same share of its weight and has its own wheelset and adhesion; wagons
    roll without slip. `effort` is the sum over the axles and shared equally, or one value per axle. A negative effort
    is the electric brake. `brake_demand` is the indirect brake of the whole train, the locomotive's too; both may act
    at once. Axle k passes a zone at ``position - axle_position[k]``, and finds there ``axle_degraded[k]`` of the
    degradation: below 1 for axles whose rail those before them have cleaned. The odometer's `wheel_speed` is that of
    the first axle, the one on the worst rail.

    **Wheel inertia.** The thesis prints one wheel's J = 225 kg.m2 and one rotating mass. Here every axle has 225, which
    makes
    3.0 % of the locomotive's mass, a usual figure; `table_4_2_one_axle` has 225 in all, 0.76 %.

    **Wagon brakes.** `brake_demand` 0 .. 1 is the depression in the brake pipe over that of the full service brake. It
    runs down the pipe as a wave, `BrakePipe`; each vehicle's cylinder fills, `filling`; the shoes are dry friction,
    `brake_force`. What is dry friction (brakes, the constant Davis terms, the hold of standing braked wheels) can stop
    a vehicle and hold it, never push it.

    **Track.** The gradient acts on each vehicle at its middle, the lengths of those before it behind the front. Zones
    lie along the track by default; by time they reach all axles at once.

    Args:
        wagons: number of wagons, 1 to 20.
        axles: wheelsets of the locomotive, 4 or 1.
        effort_per_axle: `effort` is a vector, one value for each axle.
        adhesion: ``burckhardt`` (3.12) or ``polach`` (3.4)-(3.10).
        zones: zones of degraded adhesion along ``position`` or ``time``.
        zone_count: number of zones.
        gradient_shape: gradient ``constant`` between its points, or ``linear``.
        gradient_count: number of gradient points.
        delay_samples: readings of the brake demand from vehicle to vehicle.

    Raises:
        ValueError: an unknown option, or a number out of its range.

    Presets: `table_4_2` (default; damping sign repaired), `table_4_2_one_axle` (total wheel inertia as printed),
    `as_published` (printed damping sign of (4.6): every coupler mode grows, to 400 m/s between vehicles after 3 s).

    Source: Bouchama 2024, (4.1)-(4.6), Table 4.2, section 4.1. Ours: adhesion on the locomotive's own weight (the
    thesis does not say), brake force, brake delay, cylinder times, axle positions, set-valued friction, free play and
    pre-load.
    """

    name = "train"
    description = "Multi-vehicle train: effort and brake demand in, motion, slip of each axle and coupler forces out"
    source = "Bouchama 2024, (4.1)-(4.6), Table 4.2 and section 4.1"
    method = "rosenbrock"  # the wheels' time constants are far below the step near standstill
    stiff = ("train_speed", "wagon_velocity", "axle_rate")  # with all momenta among them; the couplers are slow: 3.4 Hz
    # at the usual step 4e-6 m/s in smooth motion, 5e-4 where a vehicle starts or stops, 2e-3 at the knocks of free play
    default_preset = "table_4_2"
    option_choices = {
        "wagons": range(1, 21),
        "axles": (4, 1),
        "effort_per_axle": (False, True),
        "adhesion": tuple(ADHESION_LAWS),
        "zones": ("position", "time"),
        "zone_count": range(1, 65),
        "gradient_shape": ("constant", "linear"),
        "gradient_count": range(1, 65),
        "delay_samples": range(1, 101),
    }

    def __init__(
        self,
        *,
        wagons: int = 4,
        axles: Literal[1, 4] = 4,
        effort_per_axle: bool = False,
        adhesion: Literal["burckhardt", "polach"] = "burckhardt",
        zones: ZoneAxis = "position",
        zone_count: int = 3,
        gradient_shape: GradientShape = "constant",
        gradient_count: int = 4,
        delay_samples: int = 5,
    ) -> None:
        _check(wagons, axles, effort_per_axle, adhesion, delay_samples)
        self.wagons, self.axles, self.effort_per_axle = wagons, axles, effort_per_axle
        self._law = ADHESION_LAWS[adhesion]()
        self._track = Track(zones, zone_count, gradient_shape, gradient_count)
        self._pipe = BrakePipe(wagons + 1, delay_samples)
        self._declare_signals()
        super().__init__(
            wagons=wagons,
            axles=axles,
            effort_per_axle=effort_per_axle,
            adhesion=adhesion,
            zones=zones,
            zone_count=zone_count,
            gradient_shape=gradient_shape,
            gradient_count=gradient_count,
            delay_samples=delay_samples,
        )

    def _declare_signals(self) -> None:
        """Signals, events, edges and presets of so many wagons and axles."""
        wagons, axles = self.wagons, self.axles
        self.states = (*train_states(wagons, axles), self._pipe.state, self._pipe.memory)
        self.frictions = (
            "train_speed",
            *(f"wagon_velocity[{i + 1}]" for i in range(wagons)),
            *(f"axle_rate[{k + 1}]" for k in range(axles)),
        )
        self.inputs = train_inputs(axles if self.effort_per_axle else None)
        self.outputs = train_outputs(wagons, axles)
        self.parameters = (*train_parameters(wagons, axles), *self._law.parameters, *self._track.parameters)
        self.events = (self._pipe.event,)
        along_track = [f"axle[{k + 1}].{edge}" for k in range(axles) for edge in self._track.edges]
        self.switchings = tuple(along_track) if self._track.zones == "position" else self._track.edges
        self.presets = {
            "table_4_2": {},
            "table_4_2_one_axle": {"wheel_inertia": ONE_WHEEL / axles},
            "as_published": {"coupler_damping": -5e4},
        }

    def rolling(self, speed: float, wheel_radius: float = 0.575) -> dict[str, float]:
        """Start values by name of a train that rolls as one at `speed` [m/s], its wheels without slip [m].

        Args:
            wheel_radius: of all wheels [m].
        """
        starts = {"train_speed": speed, **{f"wagon_velocity[{i + 1}]": speed for i in range(self.wagons)}}
        return starts | {f"axle_rate[{k + 1}]": speed / wheel_radius for k in range(self.axles)}

    def flow(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        """Derivatives of the continuous states without dry friction."""
        wheelsets = self._wheelsets(self.switches(t, x, u, p), x, u, p)
        pushes = self._pushes(x, wheelsets, p)
        accelerations = [push / mass for push, mass in zip(pushes, self._masses(p), strict=True)]
        fillings = [filling(c, pipe, p) for c, pipe in zip(x.cylinder, self._pipe_pressures(x, u, p), strict=True)]
        return {
            "train_position": x.train_speed,
            "elongation": vector(*_elongating(x)),
            "train_speed": accelerations[0],
            "wagon_velocity": vector(*accelerations[1:]),
            "axle_rate": vector(*(w.acceleration(p) for w in wheelsets)),
            "cylinder": vector(*fillings),
            "demand_integral": limited(u.brake_demand),
        }

    def friction(self, t: Array, x: Any, u: Any, p: Any) -> Array:
        """Dry friction on the speeds [m/s2] and on the wheel rates [rad/s2], shape (1 + wagons + axles,)."""
        wheelsets = self._wheelsets(self.switches(t, x, u, p), x, u, p)
        limits = [davis + other for davis, other in self._dry_limits(x, wheelsets, p)]
        decelerations = [limit / mass for limit, mass in zip(limits, self._masses(p), strict=True)]
        return vector(*decelerations, *(w.friction(p) for w in wheelsets))

    def switching(self, t: Array, x: Any, u: Any, p: Any) -> Array:
        """How far beyond the edges of the zones: each axle along the track, all at once by time."""
        front, along_track = x.train_position, self._track.zones == "position"
        places = [front - p.axle_position[k] for k in range(self.axles)] if along_track else [front]
        return vector(*(distance for place in places for distance in self._track.beyond_edges(t, place, p)))

    def requirements(self, p: Any) -> dict[str, Array]:
        return self._track.requirements(p)

    def jump(self, event: str, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        """The brake demand is read, and all earlier readings move down the pipe."""
        return {"demand_integral": 0.0, "pipe_demand": self._pipe.shifted(x.pipe_demand, x.demand_integral, p)}

    def output(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        """The declared outputs; at rest the forces are those that hold the vehicles."""
        wheelsets = self._wheelsets(self.switches(t, x, u, p), x, u, p)
        pushes = self._pushes(x, wheelsets, p)
        limits = self._dry_limits(x, wheelsets, p)
        dry = [_resolved(push, limit[0], v) for push, limit, v in zip(pushes, limits, _speeds(x), strict=True)]
        other = [
            _resolved(push - d, limit[1], v) for push, d, limit, v in zip(pushes, dry, limits, _speeds(x), strict=True)
        ]
        creeps = [w.creep_force(p) for w in wheelsets]
        slips = [w.slip(p) for w in wheelsets]
        rims = [p.wheel_radius * rate for rate in x.axle_rate]
        return {
            "position": x.train_position,
            "speed": x.train_speed,
            "acceleration": (pushes[0] - dry[0] - other[0]) / p.mass,
            "wheel_speed": rims[0],
            "slip": slips[0],
            "adhesion_force": reduce(add, creeps) - other[0],
            "rim_effort": self._rim_effort(x, u, p),
            "resistance_force": reduce(add, [r + d for r, d in zip(self._resistances(x, p), dry, strict=True)]),
            "gradient_force": reduce(add, self._gradients(x, p)),
            "wagon_brake_force": reduce(add, other[1:]),
            "adhesion_degraded": reduce(np.maximum, [w.degraded for w in wheelsets]),
            "axle_speed": vector(*rims),
            "axle_slip": vector(*slips),
            "axle_creep_force": vector(*creeps),
            "wagon_speed": x.wagon_velocity,
            "coupler_force": vector(*self._couplers(x, p)),
            "pipe_pressure": vector(*self._pipe_pressures(x, u, p)),
            "cylinder_pressure": x.cylinder,
        }

    # -- the brake ----------------------------------------------------------------------------------------------------

    def _pipe_pressures(self, x: Any, u: Any, p: Any) -> list[Array]:
        return [self._pipe.pressure(u.brake_demand, x.pipe_demand, i, p) for i in range(self.wagons + 1)]

    def _rim_effort(self, x: Any, u: Any, p: Any) -> Array:
        """What the drive and the indirect brake do at the locomotive's rims [N]; at rest the brake pushes nothing."""
        drive = reduce(add, [u.effort[k] for k in range(self.axles)]) if self.effort_per_axle else u.effort
        return drive - np.sign(x.train_speed) * brake_force(x.cylinder[0], p.braked_mass, p)

    # -- forces, all against the motion but those of rail and couplers ------------------------------------------------

    def _wheelsets(self, passed: Array, x: Any, u: Any, p: Any) -> list[Wheelset]:
        weight = p.mass * p.gravity / self.axles
        pneumatic = brake_force(x.cylinder[0], p.braked_mass, p) / self.axles
        wheelsets = []
        for k, rate in enumerate(x.axle_rate):
            effort = u.effort[k] if self.effort_per_axle else u.effort / self.axles
            edges = len(self._track.edges)
            own = k * edges if self._track.zones == "position" else 0
            degraded = p.axle_degraded[k] * self._track.degraded([passed[own + i] for i in range(edges)])
            brake = np.maximum(-effort, 0.0) + pneumatic
            wheelsets.append(Wheelset(self._law, rate, x.train_speed, np.maximum(effort, 0.0), brake, weight, degraded))
        return wheelsets

    def _pushes(self, x: Any, wheelsets: list[Wheelset], p: Any) -> list[Array]:
        """Forces on the vehicles without dry friction [N]."""
        couplers = [0.0, *self._couplers(x, p), 0.0]
        resistances, gradients = self._resistances(x, p), self._gradients(x, p)
        pushes = [couplers[i] - couplers[i + 1] - resistances[i] - gradients[i] for i in range(self.wagons + 1)]
        return [pushes[0] + reduce(add, [w.creep_force(p) for w in wheelsets]), *pushes[1:]]

    def _couplers(self, x: Any, p: Any) -> list[Array]:
        return [coupler_force(e, rate, p) for e, rate in zip(x.elongation, _elongating(x), strict=True)]

    def _resistances(self, x: Any, p: Any) -> list[Array]:
        first = moving_resistance(x.train_speed, p.davis_b, p.davis_c)
        return [first, *(moving_resistance(v, p.wagon_davis_b, p.wagon_davis_c) for v in x.wagon_velocity)]

    def _gradients(self, x: Any, p: Any) -> list[Array]:
        place = x.train_position - 0.5 * p.length
        places = [place]
        for i, elongation in enumerate(x.elongation):
            place = place - elongation - (0.5 * (p.length + p.wagon_length) if i == 0 else p.wagon_length)
            places.append(place)
        slopes = [self._track.gradient(place, p) for place in places]
        return [gradient_resistance(mass, p.gravity, i) for mass, i in zip(self._masses(p), slopes, strict=True)]

    def _dry_limits(self, x: Any, wheelsets: list[Wheelset], p: Any) -> list[tuple[Array, Array]]:
        """Dry frictions of each vehicle [N]: the constant Davis term, and brake shoes or the hold of braked wheels."""
        first = (p.davis_a, reduce(add, [w.hold(p) for w in wheelsets]))
        shoes = [brake_force(x.cylinder[i + 1], p.wagon_braked_mass[i], p) for i in range(self.wagons)]
        return [first, *((p.wagon_davis_a, force) for force in shoes)]

    def _masses(self, p: Any) -> list[Array]:
        return [p.mass, *(p.wagon_mass[i] for i in range(self.wagons))]


def _speeds(x: Any) -> list[Array]:
    """Speeds of all vehicles [m/s]."""
    return [x.train_speed, *x.wagon_velocity]


def _elongating(x: Any) -> list[Array]:
    """Derivatives of the couplers' elongations [m/s]."""
    return [before - behind for before, behind in pairwise(_speeds(x))]


def _resolved(push: Array, limit: Array, speed: Array) -> Array:
    """Dry friction [N] up to a limit against the motion, or, at rest, against what pushes."""
    return np.where(speed == 0.0, np.clip(push, -limit, limit), np.sign(speed) * limit)


def _check(wagons: int, axles: int, effort_per_axle: bool, adhesion: str, delay_samples: int) -> None:
    if not isinstance(wagons, int) or not 1 <= wagons <= 20:
        hint = " For a locomotive alone use the model 'locomotive'." if wagons == 0 else ""
        raise ValueError(f"train: wagons must be a whole number from 1 to 20, got {wagons!r}.{hint}")
    if axles not in AXLE_POSITIONS:
        raise ValueError(f"train: the locomotive has 4 axles, or 1 that stands for all; got axles = {axles!r}.")
    if not isinstance(effort_per_axle, bool):
        raise ValueError(f"train: effort_per_axle must be true or false, got {effort_per_axle!r}.")
    require_chosen("train", Train.option_choices, adhesion=adhesion)
    if not isinstance(delay_samples, int) or delay_samples < 1:
        raise ValueError(f"train: delay_samples must be a whole number, 1 at least, got {delay_samples!r}.")
