"""What a probe run shows of an FMU whose description is silent: roles, units and directions of its signals, each with
its reason.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from math import isnan, nan

from cosim.components.stated_units import StatedUnit
from cosim.starter.guessed_signal import GuessedSignal, fits
from cosim.starter.inspected_fmu import InspectedFmu
from cosim.starter.probe_run import MORE, ProbeRun
from cosim.starter.starter_roles import PlantRoles
from cosim.starter.step_response import FORCES, SPEEDS, FoundMotion, StepResponse, find_motion, force_unit, wheel_unit
from cosim.starter.step_response import speed_unit_by_effort as by_effort
from fmus.fmi.types import FLOATING_TYPES

_INPUTS, _PARAMETERS = 6, 20
"""How many are tried."""
_HEAVIER = 1.25
_LIGHT, _HEAVY = 5.0, 5000.0  # [t]


@dataclass(frozen=True)
class Fact:
    """Something that the description does not say.

    Args:
        stated: it, as a scenario states it. reason: why.
    """

    stated: StatedUnit
    reason: str

    def over(self, other: Fact | None) -> Fact:
        """This one, with what only the other one says of the same variable."""
        if other is None:
            return self
        both = other.stated.model_dump(exclude_unset=True) | self.stated.model_dump(exclude_unset=True)
        return Fact(StatedUnit.model_validate(both), f"{self.reason}; {other.reason}")


@dataclass
class ProbedFacts:
    """What is known behind the probe.

    Args:
        facts: by name of the variable. radius: of the wheels [m], where one turns.
    """

    facts: dict[str, Fact] = field(default_factory=dict)
    radius: float | None = None


def is_silent(inspected: InspectedFmu, roles: PlantRoles) -> bool:
    """Whether a probe run can say more than the description: an input and outputs, one of them without a unit.

    Args:
        inspected: what the FMU says. roles: what its signals were guessed to be.
    """
    found = [roles.position, roles.speed, roles.effort, *([roles.wheel_speed] if roles.wheel_speed else [])]
    known = all(guess is not None and guess.signal.unit is not None for guess in found)
    outputs = any(signal.unit is None and signal.type in FLOATING_TYPES for signal in inspected.outputs)
    inputs = [signal for signal in inspected.inputs if signal.type in FLOATING_TYPES]
    return not known and bool(inputs) and (outputs or any(signal.unit is None for signal in inputs))


def probe(inspected: InspectedFmu, roles: PlantRoles, run: ProbeRun) -> ProbedFacts:
    """Step its inputs and see.

    Args:
        inspected: what the FMU says. roles: what its signals were guessed to be. run: how it is run.
    """
    inputs = [roles.effort.signal] if roles.effort else [s for s in inspected.inputs if _can_be_effort(s)]
    for effort in inputs[:_INPUTS]:
        response = run.respond(effort.name, {})
        if response is not None:
            found = _Probed(inspected, roles, run, effort, response)
            found.find()
            if found.known.facts:
                return found.known
    return ProbedFacts()


def _can_be_effort(signal: GuessedSignal) -> bool:
    """A number in no unit, or in one of a force or of a share of it, that is not named as the surroundings: neither a
    mass flow nor an ambient pressure drives a train.
    """
    has_unit = signal.meaning is None or any(fits(signal, unit) for unit in ("N", "1"))
    return signal.type in FLOATING_TYPES and has_unit and not signal.acts_from_outside


@dataclass
class _Probed:
    """The response to one input, and what follows from it."""

    inspected: InspectedFmu
    roles: PlantRoles
    run: ProbeRun
    effort: GuessedSignal
    response: StepResponse
    known: ProbedFacts = field(default_factory=ProbedFacts)

    def find(self) -> None:
        """Everything, the later from the earlier."""
        declared = [s.name for s in (*self.inspected.outputs, *self.inspected.hidden) if s.meaning is not None]
        named = [guess.signal.name for guess in (self.roles.speed, self.roles.position) if guess is not None]
        mass = self._mass()
        motion = find_motion(self.response, declared, named) or self._by_effort(mass)
        if motion is None:
            self.known.facts.clear()
            return
        rate = self.response.slope(motion.speed) * SPEEDS[motion.speed_unit]
        force = force_unit(abs(rate), mass)
        size = f"1 of it accelerates the train by {abs(rate):.3g} m/s2"
        weight = f", {'a train' if mass is None or isnan(mass) else f'{mass / 1e3:.6g} t'}"
        turned = self._turned(rate > 0.0, motion)
        self._motion(motion, turned)
        self._state(self.effort, "effort", force, turned == "effort", size + weight)
        self._wheel(motion, turned == "speed")

    def _motion(self, motion: FoundMotion, turned: str) -> None:
        signals = {s.name: s for s in (*self.inspected.outputs, *self.inspected.hidden)}
        reason = f"its rate is the effort by the mass, in {motion.speed_unit}"
        if motion.position is not None:
            k = self.response.integral_factor(motion.position, motion.speed)
            reason = f"d({motion.position})/dt = {k:.4g} {motion.speed}"
            self._state(signals[motion.position], "position", motion.position_unit, turned == "position", reason)
        self._state(signals[motion.speed], "speed", motion.speed_unit, turned == "speed", reason)

    def _turned(self, follows: bool, motion: FoundMotion) -> str:
        """Which of the three counts in the other direction than both others."""
        if motion.agree < 0:
            return "position" if follows else "speed"
        return "" if follows else "effort"

    def _wheel(self, motion: FoundMotion, turned: bool) -> None:
        """Another output that grows with the speed, as that of a wheel does."""
        named = [] if self.roles.wheel_speed is None else [self.roles.wheel_speed.signal.name]
        signals = {s.name: s for s in self.inspected.outputs if s.unit is None and s.name != motion.speed}
        speed = self.response.slope(motion.speed) * SPEEDS[motion.speed_unit]
        for name in sorted((n for n in self.response.speeds() if n in signals), key=lambda n: n not in named):
            ratio = self.response.slope(name) / speed
            found = wheel_unit(abs(ratio))
            if found is not None:
                unit, self.known.radius = found
                radius = "" if self.known.radius is None else f", a wheel of {self.known.radius:g} m"
                reason = f"{abs(ratio):.4g} times the speed in m/s{radius}"
                self._state(signals[name], "wheel_speed", unit, (ratio < 0.0) != turned, reason)
                return

    def _by_effort(self, mass: float | None) -> FoundMotion | None:
        """The speed by its name where there is no position that it is the rate of."""
        guess, meaning = self.roles.speed, self.effort.meaning
        if guess is None or guess.signal.name not in self.response.columns or mass is None:
            return None
        rate = abs(self.response.slope(guess.signal.name))
        for force in FORCES.values() if meaning is None else (abs(meaning.factor),):
            found = "m/s" if guess.signal.meaning is not None else by_effort(rate, force, mass)
            if found is not None:
                return FoundMotion(guess.signal.name, found)
        return None

    # -- the mass ----------------------------------------------------------------------------------------------------

    def _mass(self) -> float | None:
        """Mass of the train [kg]; None where no parameter is one, NaN where one is named so that no train has."""
        for signal, reason in self._masses():
            value = signal.start or 0.0
            if signal.meaning is not None:
                return value * signal.meaning.factor
            if not _may_be_mass(signal):
                return nan
            unit, factor = ("t", 1e3) if value <= _HEAVY else ("kg", 1.0)
            size = f"{value:g} kg is no train" if unit == "t" else f"{value:g} t is no train"
            self._state(signal, "mass", unit, False, f"{reason}{size}")
            return value * factor
        return None

    def _masses(self) -> Iterator[tuple[GuessedSignal, str]]:
        """Parameters that may be the mass, and why."""
        if self.roles.mass is not None and (self.roles.mass.signal.start or 0.0) > 0.0:
            yield self.roles.mass.signal, ""
            return
        size, (speed, *_) = self.response.step / (MORE - 1.0), self.response.speeds()
        for signal in [s for s in self.inspected.parameters if s.unit is None and _may_be_mass(s)][:_PARAMETERS]:
            heavier = self.run.respond(self.effort.name, {signal.name: _HEAVIER * (signal.start or 0.0)}, size)
            if heavier is not None and 0.97 < _HEAVIER * heavier.slope(speed) / self.response.slope(speed) < 1.03:
                yield signal, "a quarter more of it makes the train as much slower; "

    def _state(self, signal: GuessedSignal, meaning: str, unit: str | None, turned: bool, reason: str) -> None:
        """Keep what the description does not say."""
        known: dict[str, object] = {} if signal.unit is not None or unit is None else {"unit": unit}
        if turned and (known or signal.unit is not None):
            known["sign"] = -1
        self.known.facts[signal.name] = Fact(StatedUnit.model_validate(known | {"meaning": meaning}), reason)


def _may_be_mass(signal: GuessedSignal) -> bool:
    start = signal.start or 0.0
    return signal.type in FLOATING_TYPES and (_LIGHT <= start <= _HEAVY or 1e3 * _LIGHT < start <= 1e3 * _HEAVY)
