"""Disturbances of a choice: what observers believe wrongly of the train, and what is wrong with what they hear.

The plant stays as it is, so that sealed FMUs and recordings are disturbed like any other train: a slope is an effort
that moves nothing, a wrong mass is one in the observer, faults act on the odometer's reading. Runs nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

GRAVITY = 9.81  # [m/s2]
_BRAKES, _PULLS, _GATHERS = -0.1, -0.02, 0.05  # accelerations: below it brakes, above it pulls, gathers speed [m/s2]
_MOVES = 1.0  # [m/s]: below this speed no fault is drawn
_APART = 0.1  # least time between two faults, also where they are twice as long [s]
_AFTER = 5.0  # for so long after a fault it is named as a cause [s]
_BELIEVED = 1.8  # most that the error of a resistance is enlarged by, so that a resistance is left
_MOST = 4  # faults of a kind in a run
_HARDER = "harder"
"""What the names of those begin with that do not count."""
_SIGNS = ((1.0, -1.0, 1.0), (-1.0, 1.0, -1.0), (1.0, 1.0, -1.0), (-1.0, -1.0, 1.0))
"""Of the errors of mass, resistance and wheel, for one seed after the other."""


@dataclass(frozen=True)
class Journey:
    """Where a train was, from its recorded run.

    Args:
        time: of the rows [s], shape (rows,). position: [m]. speed: [m/s].
    """

    time: np.ndarray
    position: np.ndarray
    speed: np.ndarray


@dataclass(frozen=True)
class OdometerFault:
    """A wheel that jams or skids.

    Args:
        onset: [s]. length: [s]. depth: share of the speed that is missing or too much [1]. kind: -1 jam, 1 skid.
    """

    onset: float
    length: float
    depth: float
    kind: float


@dataclass(frozen=True)
class Slope:
    """A stretch of the way with a gradient.

    Args:
        onset: when the train reaches it [s]. length: how long it is on it [s]. gradient: uphill positive [1].
    """

    onset: float
    length: float
    gradient: float


@dataclass(frozen=True)
class Disturbance:
    """What is wrong in one run of a choice; as it stands nothing.

    Args:
        name: for people. mass, resistance: what observers believe, as a share of what is right [1].
        wheel: what the odometer reads, as a share of what is right [1]. noise: of a reading, standard deviation [m/s].
        loss: share of the packets that is lost besides [1]. slopes: that nobody knows. faults: of the wheel.
    """

    name: str = "nominal"
    mass: float = 1.0
    resistance: float = 1.0
    wheel: float = 1.0
    noise: float = 0.0
    loss: float = 0.0
    slopes: Sequence[Slope] = ()
    faults: Sequence[OdometerFault] = ()

    def times(self, factor: float) -> Disturbance:
        """The same, each part of it so many times as large, as far as it can be: a wheel is no slower than locked.

        Args:
            factor: at most 2 [1].
        """
        return replace(
            self,
            name=f"{_HARDER} {self.name}",
            mass=1.0 + factor * (self.mass - 1.0),
            resistance=1.0 + min(factor, _BELIEVED) * (self.resistance - 1.0),
            wheel=1.0 + factor * (self.wheel - 1.0),
            noise=factor * self.noise,
            loss=factor * self.loss,
            slopes=[replace(slope, gradient=factor * slope.gradient) for slope in self.slopes],
            faults=[replace(f, length=factor * f.length, depth=min(factor * f.depth, 1.0)) for f in self.faults],
        )

    @property
    def harder(self) -> bool:
        """Whether it is one of those that do not count."""
        return self.name.startswith(_HARDER)

    def cause(self, time: float, *, odometer: bool = True, effort: bool = True) -> str:
        """What acts at an instant [s], in words.

        Args:
            time: [s]. odometer, effort: whether the observer takes them; what it does not take cannot be the cause.
        """
        for fault in self.faults if odometer else ():
            if fault.onset <= time <= fault.onset + fault.length + _AFTER:
                return f"after a wheel that {'jams' if fault.kind < 0.0 else 'skids'} at {fault.onset:.0f} s"
        for slope in self.slopes if effort else ():
            if slope.onset <= time <= slope.onset + slope.length and self.mass != 1.0:
                share = f"{100.0 * abs(self.mass - 1.0):.0f} % too {'much' if self.mass > 1.0 else 'little'} mass"
                return f"on an unknown slope of {1e3 * slope.gradient:+.1f} per mille, with {share}"
        return ""


def drawn(number: int, seed: int, journey: Journey) -> Disturbance:
    """A disturbance from a seed.

    Mass is wrong by 5 to 20 %, resistance by 10 to 50 %, the wheel by 0.3 to 1 %; readings have a noise of 0.02 to
    0.1 m/s; slopes go up to 8 per mille; a network loses 5 to 20 % more; wheels jam while the train brakes (depth 0.3
    to 1) and skid while it gathers speed (0.1 to 0.5), for 0.5 to 3 s. Signs follow from the
    number, so that four seeds have both of each.

    Args:
        number: of the seed, from 1. seed: of the run. journey: of the train.
    """
    rng = np.random.default_rng((seed, number))
    mass, resistance, wheel = _SIGNS[(number - 1) % len(_SIGNS)]
    return Disturbance(
        name=f"seed {number}",
        mass=1.0 + mass * rng.uniform(0.05, 0.2),
        resistance=1.0 + resistance * rng.uniform(0.1, 0.5),
        wheel=1.0 + wheel * rng.uniform(0.003, 0.01),
        noise=rng.uniform(0.02, 0.1),
        loss=rng.uniform(0.05, 0.2),
        slopes=_slopes(rng, journey),
        faults=_faults(rng, journey, -1.0 if number % 2 else 1.0),
    )


def _slopes(rng: np.random.Generator, journey: Journey) -> list[Slope]:
    """Stretches of a tenth to a third of the track, at most 2 km, each with its own gradient, also on the way back."""
    place = journey.position - np.min(journey.position)
    track = float(np.max(place))
    edges = [0.0]
    while edges[-1] < track and len(edges) <= 2 * _MOST:
        edges.append(edges[-1] + min(rng.uniform(0.1, 0.33) * track, rng.uniform(500.0, 2000.0)))
    gradients = 8e-3 * rng.uniform(-1.0, 1.0, len(edges))
    if len(edges) < 2:
        return []
    stretch = np.searchsorted(edges[1:-1], place, side="right")
    rows = [0, *(np.flatnonzero(np.diff(stretch)) + 1).tolist()]
    reached = [*journey.time[rows].tolist(), float(journey.time[-1])]
    return [
        Slope(onset, end - onset, float(gradients[stretch[row]]))
        for row, onset, end in zip(rows, reached, reached[1:], strict=False)
        if end > onset
    ]


def _faults(rng: np.random.Generator, journey: Journey, wanted: float) -> list[OdometerFault]:
    """Jams while the train brakes, skids while it gathers speed or, where it never does, pulls; in the order of time.

    Args:
        wanted: the kind that gives way to no other where the journey is too short for both.
    """
    moving = np.abs(journey.speed) > _MOVES
    pace = _accelerations(journey)
    pulls, gathers = moving & (pace > _PULLS), moving & (pace > _GATHERS)
    jams = _instants(rng, journey.time[moving & (pace < _BRAKES)], every=15.0)
    skids = _instants(rng, journey.time[gathers if np.any(gathers) else pulls], every=20.0)
    every: list[OdometerFault] = []
    for onset, kind in sorted([(t, -1.0) for t in jams] + [(t, 1.0) for t in skids]):
        depth = rng.uniform(0.3, 1.0) if kind < 0.0 else rng.uniform(0.1, 0.5)
        every.append(OdometerFault(onset, float(rng.uniform(0.5, 3.0)), float(depth), kind))
    found = _apart(every)
    if any(fault.kind == wanted for fault in found):
        return found
    return _apart([*(fault for fault in every if fault.kind == wanted), *found])


def _apart(faults: Sequence[OdometerFault]) -> list[OdometerFault]:
    """Those that are apart from all before them in this order, in the order of time."""
    found: list[OdometerFault] = []
    for one in faults:
        if all(a.onset + 2.0 * a.length + _APART < b.onset for a, b in (sorted((one, o), key=_onset) for o in found)):
            found.append(one)
    return sorted(found, key=_onset)


def _onset(fault: OdometerFault) -> float:
    return fault.onset


def _accelerations(journey: Journey) -> np.ndarray:
    """Mean growth of the speed, forwards or backwards, over the second around each row [m/s2], shape (rows,)."""
    pace = np.abs(journey.speed)
    before, after = (np.interp(journey.time + shift, journey.time, pace) for shift in (-0.5, 0.5))
    return np.asarray(after - before)


def _instants(rng: np.random.Generator, times: np.ndarray, every: float) -> list[float]:
    """Instants drawn from those of the rows [s]: one at least, and at most one for each `every` seconds of them."""
    if not len(times):
        return []
    seconds = len(times) * float(np.median(np.diff(times, append=times[-1] + every)))
    most = int(np.clip(round(seconds / every), 1, _MOST))
    return [float(t) for t in rng.choice(times, rng.integers(1, most + 1))]
