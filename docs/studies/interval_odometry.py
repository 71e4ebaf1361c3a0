"""Is the train inside its interval, and how wide is it? ``python docs/studies/interval_odometry.py [RUNS]``.

Runs of ten minutes on a line of equal spacing. Everything is drawn within the limits that `interval_odometry` states,
uniformly or, in every second run, at their ends: mass, effort, running resistance, wheel, creep and gradient, the noise
of readings and the places of groups. Twenty jams and spins of both signs last .1 to 3 s each; their wheel takes its
other speed at 5 to 40 m/s2, and any part of the effort is lost meanwhile. The truth is integrated by itself, with
classical Runge-Kutta steps of 20 ms.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from fmu_observer.observers.train import IntervalOdometry
from plant_models.hybrid import Runtime, scalar_names

MASS, DAVIS = 873e3, (4320.0, 160.0, 9.6)  # of the freight train on the line Amsterdam - Utrecht
TRACTION, BRAKE = 3e5, 6e5  # [N]
PERIOD, FINE, DURATION = 0.2, 0.02, 600.0  # [s]
RATIO = round(PERIOD / FINE)
CREEP = {"dry": 0.01, "wet": 0.05}
DEEP = ((0.0, 0.75), (1.25, 2.0))
"""Speeds of a wheel that lies, as shares of the train's."""
SHALLOW = ((0.8, 0.94), (1.06, 1.2))
"""The same near to what creep explains, which breaks what is assumed of lies."""


@dataclass(frozen=True)
class Journey:
    """Args: place: [m], speed: [m/s], effort: [N], reading: [m/s], each every `FINE` seconds, shape (n,)."""

    place: np.ndarray
    speed: np.ndarray
    effort: np.ndarray
    reading: np.ndarray


class _Wheel:
    """Speed of the wheel that is counted: rolling with creep, or on its own way while it lies.

    Args:
        chance, draw: of numbers, and of one from -1 to 1. creep: its limit. lies: how many. depths: of them.
    """

    def __init__(
        self,
        chance: np.random.Generator,
        draw: Callable[[], float],
        creep: float,
        lies: int,
        depths: Sequence[tuple[float, float]],
    ) -> None:
        self.chance, self.creep, self.depths = chance, creep, depths
        self.starts = sorted(chance.uniform(10.0, DURATION - 10.0, lies))
        self.radius, self.share, self.creeping = 1.0 + 0.01 * draw(), 1.0, 0.5 * (1.0 + draw())
        self.own: float | None = None
        self.ends = self.depth = self.rate = 0.0

    def turn(self, t: float, speed: float, effort: float) -> float:
        """Its circumferential speed [m/s]."""
        rolling = speed * self.radius * (1.0 + self.creeping * self.creep * np.sign(effort))
        if self.own is None and self.starts and t >= self.starts[0]:
            self.starts.pop(0)
            low, high = self.depths[self.chance.integers(len(self.depths))]
            self.own, self.depth = rolling, self.chance.uniform(low, high)
            self.ends, self.rate = t + self.chance.uniform(0.1, 3.0), self.chance.uniform(5.0, 40.0)
            self.share = self.chance.uniform()
        if self.own is None:
            return rolling
        target = self.depth * speed if t < self.ends else rolling
        self.own += float(np.clip(target - self.own, -self.rate * FINE, self.rate * FINE))
        if t >= self.ends and abs(self.own - rolling) < 1e-9:
            self.own, self.share = None, 1.0
            return rolling
        return self.own


def drive(seed: int, rail: str, *, lies: int = 20, depths: Sequence[tuple[float, float]] = DEEP) -> Journey:
    """A journey within the limits, at their ends where the seed is odd.

    Args:
        seed: of all chance. rail: ``dry`` or ``wet``. lies: how many. depths: of them.
    """
    chance = np.random.default_rng(seed)
    draw = (lambda: float(chance.choice([-1.0, 1.0]))) if seed % 2 else (lambda: float(chance.uniform(-1.0, 1.0)))
    mass, gain, drag = MASS * (1.0 + 0.03 * draw()), 1.0 + 0.03 * draw(), 1.0 + 0.2 * draw()
    wheel = _Wheel(chance, draw, CREEP[rail], lies, depths)
    rows = np.zeros((round(DURATION / FINE) + 1, 4))
    place, speed, effort, slope, wanted = 0.0, 30.0, 0.0, 0.0, 38.9
    for k in range(len(rows)):
        t = k * FINE
        slope = 0.005 * draw() if k % round(10.0 / FINE) == 0 else slope
        wanted = float(chance.choice([10.0, 25.0, 38.9])) if k % round(120.0 / FINE) == 0 else wanted
        reading = wheel.turn(t, speed, effort) + 0.05 * draw()
        if k % RATIO == 0:  # the reading is of the effort until now
            effort = float(np.clip(3e5 * (wanted - speed), -BRAKE, TRACTION)) if abs(wanted - speed) > 0.3 else 0.0
        rows[k] = place, speed, effort, reading
        force = effort * gain * wheel.share

        def acceleration(v: float, force: float = force, slope: float = slope) -> float:
            return (force - (DAVIS[0] + DAVIS[1] * v + DAVIS[2] * v * v) * drag) / mass - 9.81 * slope

        faster = max(_runge_kutta(acceleration, speed), 0.0)
        place, speed = place + 0.5 * FINE * (speed + faster), faster
    return Journey(*rows.T)


def _runge_kutta(f: Callable[[float], float], v: float) -> float:
    a = f(v)
    b = f(v + 0.5 * FINE * a)
    c = f(v + 0.5 * FINE * b)
    return v + FINE * (a + 2.0 * b + 2.0 * c + f(v + FINE * c)) / 6.0


@dataclass(frozen=True)
class Found:
    """Args: outside, too_fast: rows at which the place and the speed are not inside. rows: in all.
    half: mean half-width over the way [m]. allowed: the same of SUBSET-041. broken: assumptions found broken.
    """

    outside: int
    too_fast: int
    rows: int
    half: float
    allowed: float
    broken: int


def observe(
    journey: Journey, spacing: float, rail: str, effort: str = "known", seed: int = 0, **limits: float
) -> Found:
    """The observer beside a journey.

    Args:
        journey: of the train. spacing: of groups [m]. rail: ``dry`` or ``wet``. effort: option of the observer.
        seed: of the places of groups. limits: parameters in place of the stated ones.
    """
    system = IntervalOdometry(effort=effort)
    runtime, chance = Runtime(system), np.random.default_rng(seed)
    inputs, outputs = list(scalar_names(system.input_signals)), list(scalar_names(system.outputs))
    stated = dict(zip(("davis_a", "davis_b", "davis_c"), DAVIS, strict=True)) | {"mass": MASS, "creep": CREEP[rail]}
    stated |= {"start_position_error": 1.0, "traction_max": 1.04 * TRACTION, "brake_max": 1.04 * BRAKE} | limits
    runtime.p[:] = system.start_parameters()
    for name, value in stated.items():
        runtime.p[list(scalar_names(system.parameter_signals)).index(name)] = value
    effort_at, odometer, balise = (inputs.index(n) for n in ("effort", "odometer", "balise_position"))
    front, speeds = (
        [outputs.index(n) for n in names]
        for names in (("min_safe_front_end", "max_safe_front_end"), ("min_speed", "max_speed"))
    )
    runtime.u[odometer] = journey.reading[0]
    runtime.start(0.0)
    next_group, last, rows = spacing, 0.0, []
    for k in range(0, len(journey.place) - RATIO, RATIO):
        now, step = k + RATIO, slice(k, k + RATIO + 1)
        runtime.u[effort_at] = journey.effort[k]
        while next_group <= journey.place[now]:
            runtime.advance(float(np.interp(next_group, journey.place[step], FINE * np.arange(k, now + 1))))
            runtime.u[balise] = next_group + (chance.choice([-1.0, 1.0]) if seed % 2 else chance.uniform(-1.0, 1.0))
            runtime.trigger("balise")
            last, next_group = next_group, next_group + spacing
        runtime.advance(max(runtime.t, now * FINE - 1e-4))
        runtime.u[odometer] = journey.reading[now]
        runtime.advance(now * FINE)
        y = runtime.update_outputs()
        rows.append(
            (*y[front], *y[speeds], journey.place[now], journey.speed[now], 5.0 + 0.05 * (journey.place[now] - last))
        )
    low, high, slowest, fastest, place, speed, allowed = np.array(rows).T
    way = np.diff(place, prepend=0.0)
    return Found(
        int(np.sum((place < low - ROUNDING) | (place > high + ROUNDING))),
        int(np.sum((speed < slowest - ROUNDING) | (speed > fastest + ROUNDING))),
        len(rows),
        float(np.sum(0.5 * (high - low) * way) / place[-1]),
        float(np.sum(allowed * way) / place[-1]),
        int(y[outputs.index("broken_count")]),
    )


ROUNDING = 1e-6
"""What the truth errs itself [m, m/s]: 3e4 Runge-Kutta steps of a smooth motion err below 1e-8."""


def main(runs: int) -> None:
    """Print the table."""
    print("| groups every | rail | effort | lies | train outside | of rows | speed outside | half-width | share |")
    cases = [(DEEP, spacing) for spacing in (300.0, 700.0, 1500.0)] + [(SHALLOW, 700.0)]
    for (lies, spacing), rail in product(cases, CREEP):
        journeys = [drive(seed, rail, depths=lies) for seed in range(runs)]
        for effort in ("known", "unknown"):
            found = [observe(j, spacing, rail, effort, seed) for seed, j in enumerate(journeys)]
            half, allowed = (float(np.mean([getattr(f, name) for f in found])) for name in ("half", "allowed"))
            outside, too_fast, rows = (sum(getattr(f, name) for f in found) for name in ("outside", "too_fast", "rows"))
            what = f"{spacing:g} m | {rail} | {effort} | {'deep' if lies is DEEP else 'shallow'}"
            lost = f"{outside} rows of {sum(f.outside > 0 for f in found)} in {runs} runs | {rows}"
            print(f"| {what} | {lost} | {too_fast} | {half:.2f} m | {half / allowed:.2f} |", flush=True)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 20)
