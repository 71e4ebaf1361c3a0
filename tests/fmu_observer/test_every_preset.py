"""Law of every preset: with its own values, in a situation that it is made for, an observer does not diverge, or a
certificate says so before the run.

Beside trains: one with the preset's own mass and resistance rolls at 12 m/s and gains 0.05 m/s2, wheels do not slip,
all is told exactly, balises every 0.3 s and as far apart as is certified. Observers of models: the situations of
`test_every_observer`, as often as the preset is certified for. Motors: the model that the filter believes in.
"""

from __future__ import annotations

from math import inf
from typing import Any

import numpy as np
import pytest
from observer_runner import SteadyMotion
from shipped import shipped
from situations import Follower, Situation, observers

from fmu_observer import OBSERVERS
from fmu_observer.observers.evaluated_observer import GapCertified
from fmu_observer.observers.motors.motor_filter import MotorFilter
from fmu_observer.observers.parameter_values import parameter_values
from plant_models.hybrid import HybridSystem, Runtime, scalar_names

MADE: dict[str, HybridSystem] = {name: shipped(name) for name in OBSERVERS}
CASES = [(name, preset) for name, system in MADE.items() for preset in system.presets or (None,)]
KNOWN = observers()
TRAINS = [c for c in CASES if ".observers.train." in type(MADE[c[0]]).__module__ and not hasattr(MADE[c[0]], "model")]
MODELS = [case for case in CASES if case[0] in KNOWN and case not in TRAINS]
MOTORS = [case for case in CASES if isinstance(MADE[case[0]], MotorFilter)]
NOTHING_CARRIED = {
    "detection": "says what is wrong, and estimates no motion that could be lost",
    "observers.exhibits": "inverts each window anew by a table; its tests follow its plant with every preset",
    "observers.generic.signature": "reads a window anew at each sample; its tests follow its signal",
}
LONGEST, DURATION = 20.0, 60.0  # between balises; of a run behind the first of them [s]
SPEED_LEFT, WAY_LEFT = 0.1, 1.0
"""What may be left [m/s], [m]: twice what the slowest gain leaves at the longest of its gaps, that of an effort held
for 0.1 s; beyond the gaps that are certified thousands are left.
"""


def certified(name: str, preset: str | None, gap: float) -> Any:
    """What is found of such a gap, or None where an observer is not certified."""
    system: Any = MADE[name]
    return next(system.findings(gap, preset=preset)) if isinstance(system, GapCertified) else None


class OwnTrain:
    """The train that a preset believes in, and how its observer hears it."""

    def __init__(self, system: HybridSystem, preset: str | None) -> None:
        self.motion = SteadyMotion(speed=12.0, acceleration=0.05)
        self.system, values = system, parameter_values(system, {}, preset)
        p = dict(zip(scalar_names(system.parameter_signals), values, strict=True))
        wheels = p.get("n_axles", 0.0) * p.get("wheel_inertia", 0.0) / p.get("wheel_radius", 1.0) ** 2
        self.inertia, self.drag = p.get("mass", 1.0) + wheels, [p.get(f"davis_{key}", 0.0) for key in "abc"]
        self.runtime = Runtime(system)
        self.runtime.p[:] = values
        self._place = {name: i for i, name in enumerate(scalar_names(system.input_signals))}
        for i, state in enumerate(scalar_names(system.states)):
            if state in ("estimated_speed", "odometer_speed", "wheel_speed_estimate", "held_speed"):
                self.runtime.x[i] = self.motion.speed

    def force(self, v: float) -> float:
        """The effort that gains 0.05 m/s2 at a speed [N]."""
        return float(self.inertia * self.motion.acceleration + np.polynomial.Polynomial(self.drag)(v))

    def hear(self, t: float, *events: str) -> None:
        v, place = self.motion.v(t), self.motion.position(t)
        reported = {"odometer": v, "gps_position": place, "balise_position": place}
        for name, value in (reported | {"effort": self.force(v)}).items():
            if name in self._place:
                self.runtime.u[self._place[name]] = value
        for event in self.system.triggered_events:
            if event.name in events:
                self.runtime.trigger(event.name)

    def errors(self, gap: float) -> tuple[float, float]:
        """Of speed [m/s] and position [m] at the end of a run with a balise every `gap` [s]."""
        self.hear(0.0)
        self.runtime.start(0.0)
        balises = np.arange(1, round(max(DURATION, 4.0 * gap) / gap) + 1) * gap
        for t in sorted({*np.arange(0.1, balises[-1], 0.1).round(9), *balises.round(9)}):
            self.hear(0.5 * (self.runtime.t + t))
            self.runtime.advance(t)
            self.hear(t, "gps", *(["balise"] if np.isclose(balises, t, rtol=0.0, atol=1e-8).any() else []))
        y = dict(zip(scalar_names(self.system.outputs), self.runtime.update_outputs(), strict=True))
        return y["speed"] - self.motion.v(self.runtime.t), y["position"] - self.motion.position(self.runtime.t)


@pytest.mark.parametrize(("name", "preset"), TRAINS)
def test_a_preset_keeps_the_train_that_it_believes_in(name: str, preset: str | None) -> None:
    short = certified(name, preset, 0.3)
    limit = inf if short is None else short.limit
    assert limit > 0.0
    for gap in {min(0.3, 0.9 * limit), min(0.9 * limit, LONGEST)}:
        on_speed, on_position = OwnTrain(MADE[name], preset).errors(round(gap, 3))
        assert abs(on_speed) < SPEED_LEFT, f"a balise every {gap:.3g} s"
        assert abs(on_position) < WAY_LEFT, f"a balise every {gap:.3g} s"
    assert short is None or bool(short.holds) == (limit >= 0.3)  # what is beyond is told before a run


@pytest.mark.parametrize(("name", "preset"), MODELS)
def test_a_preset_follows_its_plant_or_says_that_it_does_not(name: str, preset: str | None) -> None:
    known = KNOWN[name]
    short = certified(name, preset, known.gap)
    gap = known.gap if short is None else min(known.gap, 0.9 * short.limit)
    if gap <= 0.0:
        assert not short.holds
        return
    follower = Follower(Situation(known.system, known.truth, known.inputs, known.payload, gap))
    values = parameter_values(known.system, {}, preset)
    follower.runtime.p[: len(values)] = values
    first = follower.start().error()
    follower.follow([gap] * round(20.0 / gap))
    assert follower.error() < first, follower.errors()


@pytest.mark.parametrize(("name", "preset"), MOTORS)
def test_a_preset_of_a_motor_filter_keeps_the_motor_that_it_believes_in(name: str, preset: str | None) -> None:
    """From rest, 0.2 s: currents and speed."""
    system: Any = MADE[name]
    runtime = Runtime(system)
    runtime.p[:] = parameter_values(system, {}, preset)
    p, inputs = system.unpack_parameters(runtime.p.copy()), scalar_names(system.input_signals)
    x, largest = np.zeros(system.order), 0.0
    for k in range(round(0.2 / p.sample_period)):
        t = k * p.sample_period
        reported = {n: 3.0 * np.sin(20.0 * t + i) for i, n in enumerate(inputs) if n.startswith("voltage")}
        for n, value in reported.items():
            runtime.u[inputs.index(n)] = value
        seen, _ = system.measure(x, system.unpack_inputs(np.where([n in reported for n in inputs], runtime.u, 0.0)), p)
        runtime.u[[i for i, n in enumerate(inputs) if n.startswith("measured")]] = -np.asarray(seen)
        runtime.start(0.0) if k == 0 else runtime.advance(t)
        largest = max(largest, float(np.abs(runtime.x[:3] - x[:3]).max()))
        x = np.asarray(system.predict(x, system.unpack_inputs(runtime.u.copy()), p)[0])
    assert largest < 0.05 * max(1.0, float(np.abs(x[:3]).max()))


def test_every_preset_has_a_law() -> None:
    """Whoever adds one adds it to a law, or says why nothing of it can be lost."""
    seen = {*TRAINS, *MODELS, *MOTORS}
    left = {name for name, preset in CASES if (name, preset) not in seen and preset is not None}
    rooms = {".".join(type(MADE[name]).__module__.split(".")[1:-1]) for name in left}
    assert rooms <= set(NOTHING_CARRIED), rooms
