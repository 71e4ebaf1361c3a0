"""Trains drawn from seeds for the study of the choice: what a user knows of each, and what happens to it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np

from cosim import Scenario

STOP, STEP = 150.0, 0.1  # [s]
GRADIENTS = 8


@dataclass(frozen=True)
class Train:
    """A train with all that its scenario says, and with what it does not.

    Args:
        seed: that it was drawn from. mass: in the papers [kg]. gap: between balises at top speed [s]. top: [m/s].
        period: of the odometer [s]. noise: of its readings [m/s]. latency: of telegrams [s]. missed: share of them.
        loss: share of lost packets; None without a network.
        mass_error, resistance_error, wear: largest relative error that the papers have [1]. gradient: largest [1].
        faults: mean number of jams and of skids in a run.
    """

    seed: int
    mass: float
    gap: float
    top: float
    period: float
    noise: float
    latency: float
    missed: float
    loss: float | None
    mass_error: float
    resistance_error: float
    wear: float
    gradient: float
    faults: float

    @classmethod
    def drawn(cls, seed: int) -> Train:
        """A train from its seed."""
        rng = np.random.default_rng(seed)

        def log(low: float, high: float) -> float:
            return float(np.exp(rng.uniform(np.log(low), np.log(high))))

        def sometimes(share: float, high: float) -> float:
            return float(rng.uniform(0.0, high)) if rng.uniform() < share else 0.0

        return cls(
            seed,
            mass=log(60e3, 2000e3),
            gap=log(0.3, 199.0),
            top=float(rng.uniform(12.0, 35.0)),
            period=float(rng.choice([0.1, 0.2])),
            noise=sometimes(0.6, 0.1),
            latency=sometimes(0.5, 0.6),
            missed=sometimes(0.4, 0.2),
            loss=float(rng.uniform(0.02, 0.3)) if rng.uniform() < 0.3 else None,
            mass_error=sometimes(0.8, 0.2),
            resistance_error=sometimes(0.8, 0.5),
            wear=sometimes(0.5, 0.01),
            gradient=sometimes(0.7, 0.01),
            faults=float(rng.integers(0, 4)),
        )

    @cached_property
    def profile(self) -> tuple[list[float], list[float]]:
        """Instants [s] and speeds [m/s] of its journey: away, perhaps a stop on the way, another speed, a stop."""
        rng = np.random.default_rng((self.seed, 1))
        rate, second = rng.uniform(0.25, 0.6), self.top * rng.uniform(0.4, 1.0)
        low = 0.0 if rng.uniform() < 0.5 else self.top * rng.uniform(0.2, 0.8)
        legs = (0.0, self.top, self.top, low, low, second, second, 0.0)
        moving = [abs(b - a) / rate for a, b in pairwise(legs)]
        rest = max(STOP - 15.0 - sum(moving), 30.0)
        shares = iter(rng.dirichlet([4.0, 1.0, 4.0]))
        lengths = [t if t > 0.0 else float(next(shares)) * rest for t in moving]
        return [0.0, *np.cumsum(lengths).tolist()], [float(v) for v in legs]

    @property
    def davis(self) -> dict[str, float]:
        """Running resistance in the papers."""
        return {"davis_a": 0.02 * self.mass, "davis_b": 6e-4 * self.mass, "davis_c": 1.2e-5 * self.mass}

    def scenario(self) -> Scenario:
        """What a user knows: train, driver, odometer, balises, perhaps a network; no observer."""
        made = Scenario(stop=STOP, step=STEP, seed=self.seed, certificates="ignore", title=f"train {self.seed}")
        own = {"traction_coefficient": 1.0, "brake_coefficient": 1.0, "fitted_to": 200.0}
        options = {"gradient_count": GRADIENTS}
        made.add(
            "train", model="longitudinal_train", options=options, parameters={"mass": self.mass, **self.davis, **own}
        )
        follows = {"effort_limit": self.mass, "power_limit": 25.0 * self.mass, "holding_effort": 0.7 * self.mass}
        gains = {"proportional_gain": 0.8 * self.mass, "integral_gain": 0.1 * self.mass}
        profile = dict(zip(("profile_time", "profile_speed"), self.profile, strict=True))
        made.add("driver", model="driver", parameters={**follows, **gains, **profile})
        made.connect("driver.effort -> train.effort", "train.speed -> driver.odometer")
        made.add("odometer", model="odometer", parameters={"sample_period": self.period, "noise_std": self.noise})
        made.connect("train.wheel_speed -> odometer.wheel_speed")
        if self.loss is not None:
            made.network(nodes={"odometer": ["odometer.reading"]}, period=self.period, loss_fraction=self.loss)
        made.balises(
            position="train.position",
            speed="train.speed",
            odometer="odometer.reading",
            layout="spacing",
            spacing=self.gap * self.top,
            track_start=0.0,
            track_end=5e4,
            latency=self.latency,
            missed_fraction=self.missed,
        )
        return made

    def truth(self, hidden: int) -> Scenario:
        """What happens on a hidden seed: another mass, resistance and wheel, slopes, jams and skids.

        Args:
            hidden: number of the seed, from 0.
        """
        rng = np.random.default_rng((self.seed, 2, hidden))
        made = self.scenario().set("seed", 100_000 + 10 * self.seed + hidden)
        mass, drag, wheel = (
            1.0 + float(rng.choice([-1.0, 1.0]) * rng.uniform(0.5, 1.0)) * error
            for error in (self.mass_error, self.resistance_error, self.wear)
        )
        places = np.concatenate(([0.0], np.cumsum(rng.uniform(300.0, 2000.0, GRADIENTS - 1))))
        made.set("train.mass", mass * self.mass).set("train.gradient_position", places.tolist())
        made.set("train.gradient", (self.gradient * rng.uniform(-1.0, 1.0, GRADIENTS)).tolist())
        for name, value in self.davis.items():
            made.set(f"train.{name}", drag * value)
        return self._with_wheel(made, rng, wheel)

    def _with_wheel(self, made: Scenario, rng: np.random.Generator, wear: float) -> Scenario:
        """The wheel between train and odometer, with its faults."""
        table = made.table().model_dump(by_alias=True, exclude_unset=True)
        table["connections"] = [c for c in table["connections"] if "odometer.wheel_speed" not in c]
        table["connections"] += [
            {"from": "train.wheel_speed", "to": "wheel.speed", "factor": wear},
            "wheel.wheel_speed -> odometer.wheel_speed",
        ]
        table["components"]["wheel"] = {
            "model": "wheel_fault",
            "options": {"cause": "stated", "fault_count": 16},
            "parameters": self._faults(rng),
        }
        return Scenario(**table)

    def _faults(self, rng: np.random.Generator) -> dict[str, list[float]]:
        """Jams while the profile falls, skids while it rises: onset, length, depth and kind, in the order of time."""
        times, speeds = self.profile
        pieces = list(zip(times, times[1:], np.diff(speeds), strict=False))
        found: list[tuple[float, float, float, float]] = []
        for kind, depths in ((-1.0, (0.3, 1.0)), (1.0, (0.1, 0.5))):
            legs = [(a, b) for a, b, change in pieces if change * kind > 0.0]
            for _ in range(rng.poisson(self.faults) if legs else 0):
                a, b = legs[rng.integers(len(legs))]
                onset = rng.uniform(a + 0.1 * (b - a), b)
                found.append((float(onset), float(rng.uniform(0.3, 3.0)), float(rng.uniform(*depths)), kind))
        kept: list[tuple[float, float, float, float]] = []
        for fault in sorted(found)[:16]:
            if not kept or fault[0] > kept[-1][0] + kept[-1][1] + 0.1:
                kept.append(fault)
        filled = [*kept, *[(0.0, 0.0, 0.0, -1.0)] * (16 - len(kept))]
        names = ("fault_onset", "fault_length", "fault_depth", "fault_kind")
        return dict(zip(names, ([float(v) for v in column] for column in zip(*filled, strict=True)), strict=True))
