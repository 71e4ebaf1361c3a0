"""Base of the augmented observers: the train before them, with the force of its couplers and of the gradient unknown.

Position, speed, and an unknown acceleration with its rate, corrected by positions of two kinds: balises and satellite
fixes. Where the traction comes from and how the gains are shaped is left to the subclasses.
"""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import replace
from math import isfinite
from typing import Any, Literal

import numpy as np

from fmu_observer.certificates.aperiodic import certify_sampled_error, with_switching_noted
from fmu_observer.certificates.finding import Finding
from fmu_observer.certificates.sampled_error import SampledError
from fmu_observer.models.observer_model import named_as
from fmu_observer.observers.train.standstill import held_disturbance, stands
from fmu_observer.observers.train.train_observer import Estimate, TrainObserver
from fmu_observer.observers.train.train_signals import MOTION, SPEED
from plant_models.hybrid import Array, PeriodicEvent, TriggeredEvent
from plant_models.hybrid.option import require_chosen
from plant_models.hybrid.signal import Signal, input_signal, memory, output_signal, parameter, state
from plant_models.railway.vehicle.resistance import GRAVITY

ORDER = 4  # position, speed, unknown acceleration, its rate
_BALISE_LAST, _FIX_LAST = 1.0, 2.0
SENSORS = ("balise", "gps")
_POSITION_OF = {"balise": "balise_position", "gps": "gps_position", "fix": "fix_position"}  # event to input

GPS = TriggeredEvent(
    "gps",
    (input_signal("gps_position", "m", 0.0, "Position of the satellite fix", variability="discrete"),),
    "A satellite fix of the position, at its own time stamp",
)
_SAMPLED_FIX = PeriodicEvent("fix", "fix_period", description="The held position of the receiver is read")
_FIX_POSITION = input_signal("fix_position", "m", 0.0, "Position of the last satellite fix, held by the receiver")
_FIX_PERIOD = parameter(
    "fix_period",
    "s",
    0.1,
    "Time between two fixes: the longest for the certificate, the period where sampled",
    min=1e-6,
)
Fixes = Literal["event", "sampled"]
WAYS_OF_FIXES = ("event", "sampled")


class AugmentedTrainObserver(TrainObserver):
    """Observer of a locomotive that pulls vehicles it does not model: Bouchama 2024, (4.7)-(4.13).

    ``dp = v``, ``dv = (F - a sgn(v) - b v - c v|v|)/M + delta``, ``d delta = delta'``, ``d delta' = 0``, each less
    ``g_i eta`` with the decaying innovation ``d eta = -decay eta``. M is the mass of the locomotive alone, and
    ``delta = -(Fc + M g i)/M`` with the coupler force Fc (tension positive) and the gradient i: with the printed matrix
    the third state is this acceleration and not the force d of (4.7). Output `coupler_force` is
    ``-M delta - M g gradient``: with the input `gradient` left at zero it is coupler and gradient together.

    Positions come from balises and from satellite fixes, each with gains of its own. Fixes come at the event `gps`, at
    their own stamps, or, with the option ``fixes="sampled"``, as the input `fix_position`, read every `fix_period` from
    the start on. A sample sets ``eta = p - y`` and puts the gains of its sensor in force; what was left of the sample
    before is dropped [ours]. A sensor whose gains are zero is not used.

    The unknown acceleration is extrapolated as a line between samples, so without any sample the position error grows
    with the cube of the time. While the observed train stands, held by its brake or its friction, the unknown
    acceleration stays and its rate fades [ours]: positions show nothing of a force that friction takes, and learnt from
    them it would wind up until it pushed the train off.

    What is certified: any sequence of balise gaps up to the one asked for while there are no fixes; and where both
    sensors are used, any sequence of fixes and balises in any order with gaps up to `fix_period`, which is what happens
    while fixes come. The change from one of the two regimes to the other is taken to be rare.

    Args:
        options: of the observer, see its `option_choices`.
    """

    frictions = (SPEED.name,)
    own_states: tuple[Signal, ...] = ()
    own_parameters: tuple[Signal, ...] = ()
    own_events: tuple[PeriodicEvent, ...] = ()
    inputs = (
        *TrainObserver.inputs,
        input_signal("gradient", "1", 0.0, "Sine of the slope angle, uphill positive, where known", optional=True),
    )
    outputs = (
        *(s for s in TrainObserver.outputs if s.name != "innovation"),
        output_signal("innovation", "m", "Estimated minus measured position at the last balise or fix, as it acts now"),
        output_signal(
            "coupler_force", "N", "Force of the first coupler, pull positive; with gravity where no gradient is fed"
        ),
        output_signal("disturbance", "m/s2", "Estimated acceleration by coupler and gradient"),
    )
    estimator_memory = (memory("last_sensor", "1", 0.0, "1 when a balise came last, 2 when a fix did, 0 before"),)

    def __init__(self, fixes: Fixes = "event", **options: Any) -> None:
        require_chosen(self.name, {"fixes": WAYS_OF_FIXES}, fixes=fixes)
        if fixes == "sampled":
            self.inputs = (*self.inputs, _FIX_POSITION)
        self.estimator_events = (GPS if fixes == "event" else _SAMPLED_FIX, *self.own_events)
        self.estimator_states = (
            *MOTION,
            state("unknown_acceleration", "m/s2", 0.0, "Acceleration by coupler and gradient, delta"),
            state("unknown_jerk", "m/s3", 0.0, "Its rate"),
            state("position_innovation", "m", 0.0, "Position error seen at the last balise or fix, decaying since"),
            *self.own_states,
        )
        self.estimator_parameters = (*self.own_parameters, _FIX_PERIOD)
        super().__init__(fixes=fixes, **options)

    # -- what a subclass writes -------------------------------------------------------------------------------------

    @abstractmethod
    def traction(self, x: Any, u: Any, p: Any) -> Array:
        """Force between wheels and rails [N]."""

    @abstractmethod
    def gains_of(self, sensor: str, p: Any) -> tuple[tuple[Array, ...], Array]:
        """Gains ``g_1 ... g_4`` of a sensor [1/s^i] and the decay rate of its innovation [1/s]."""

    @abstractmethod
    def drag(self, x: Any, u: Any, p: Any) -> Array:
        """Speed-dependent resistance [N]."""

    @abstractmethod
    def error_drifts(self, p: Any) -> tuple[np.ndarray, ...]:
        """Error matrices between samples at the corners of what is uncertain, each of shape (4, 4)."""

    def own_flow(self, x: Any, u: Any, p: Any) -> dict[str, Array]:
        """Derivatives of the states that the subclass adds, by name."""
        return {}

    def continuous_correction(self, x: Any, u: Any, p: Any) -> tuple[Array, ...]:
        """Correction by continuous measurements, to be subtracted from the four derivatives."""
        return (0.0,) * ORDER

    # -- what follows -----------------------------------------------------------------------------------------------

    def estimator_flow(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        gains, decay = self._in_force(x, p)
        traction = np.maximum(self.traction(x, u, p), 0.0)  # a negative one is a brake: see friction
        acceleration = (traction - self.drag(x, u, p)) / p.mass + x.unknown_acceleration
        continuous, innovation = self.continuous_correction(x, u, p), x.position_innovation
        model = (x.estimated_speed, acceleration, x.unknown_jerk, 0.0)
        corrected = [model[i] - gains[i] * innovation - continuous[i] for i in range(ORDER)]
        standing = stands(x.estimated_speed)
        corrected[2:] = held_disturbance(standing, corrected[2], corrected[3], x.unknown_jerk, decay)
        return (
            named_as(self.estimator_states[:ORDER], corrected)
            | {"position_innovation": -decay * innovation}
            | self.own_flow(x, u, p)
        )

    def estimate(self, x: Any, u: Any, p: Any) -> Estimate:
        return Estimate(x.estimated_position, x.estimated_speed, self.traction(x, u, p), x.position_innovation)

    def output(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        force = -p.mass * (x.unknown_acceleration + GRAVITY * u.gradient)
        return super().output(t, x, u, p) | {"coupler_force": force, "disturbance": x.unknown_acceleration}

    def update(self, event: str, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        """A balise or a fix sets the innovation anew and puts its gains in force; the estimates stay continuous."""
        if event not in _POSITION_OF:
            return self.own_jump(event, x, u, p)
        sensor, last = ("balise", _BALISE_LAST) if event == "balise" else ("gps", _FIX_LAST)
        measured = getattr(u, _POSITION_OF[event])
        used = self.gains_of(sensor, p)[0][0] > 0.0
        return {
            "position_innovation": np.where(used, x.estimated_position - measured, x.position_innovation),
            "last_sensor": np.where(used, last, x.last_sensor),
        }

    def listens(self, p: Any) -> Array:
        """Whether balises have gains."""
        return np.where(self.gains_of("balise", p)[0][0] > 0.0, 1.0, 0.0)

    def own_jump(self, event: str, x: Any, u: Any, p: Any) -> dict[str, Array]:
        """What an event changes that the subclass adds."""
        raise NotImplementedError(f"{type(self).__name__} has no jump for event {event!r}.")

    def gap_finding(self, gap: float, p: Any) -> Finding:
        """Certificate of the sensors in use: of balises, and where fixes are used too, of fixes and of mixtures of
        both.
        """
        used = [sensor for sensor in SENSORS if float(self.gains_of(sensor, p)[0][0]) > 0.0] or ["balise"]
        model = (
            "four-state error of position, speed, unknown acceleration and its rate, drag slopes at their extremes, "
            "constant over a gap; the second derivative of the unknown acceleration and the error of the traction, "
            "inputs to it, and standstill are left out"
        )
        errors = self._errors_of(used[0], p)
        found = certify_sampled_error(errors, gap, f"{model}; corrected by '{used[0]}' samples")
        found = with_switching_noted(found, errors, "drag slopes")
        if len(used) == 1:
            return found
        alone, mixed = (self._mixture(sensors, float(p.fix_period), p, model) for sensors in (("gps",), SENSORS))
        rare = "; the change between times with fixes and without is taken to be rare"
        return found.also(
            _described(alone, "fixes alone", ""), _described(mixed, "fixes and balises in any order", rare)
        )

    def sampled_events(self, p: Any) -> tuple[str, ...]:
        """Balises, or fixes where balises have no gains; what comes beside them is judged as a mixture."""
        return ("balise",) if float(self.gains_of("balise", p)[0][0]) > 0.0 else (self.estimator_events[0].name,)

    # -- internals --------------------------------------------------------------------------------------------------

    def _in_force(self, x: Any, p: Any) -> tuple[tuple[Array, ...], Array]:
        fix = x.last_sensor == _FIX_LAST
        (by_balise, slow), (by_fix, fast) = (self.gains_of(sensor, p) for sensor in SENSORS)
        gains = tuple(np.where(fix, b, a) for a, b in zip(by_balise, by_fix, strict=True))
        return gains, np.where(fix, fast, slow)

    def _errors_of(self, sensor: str, p: Any) -> tuple[SampledError, ...]:
        gains, decay = self.gains_of(sensor, p)
        return tuple(SampledError.of(drift.tolist(), gains, float(decay)) for drift in self.error_drifts(p))

    def _mixture(self, sensors: tuple[str, ...], gap: float, p: Any, model: str) -> Finding:
        vertices = tuple(error for sensor in sensors for error in self._errors_of(sensor, p))
        return certify_sampled_error(vertices, gap, model)


def _described(found: Finding, what: str, further: str) -> Finding:
    """A finding about gaps as a condition of another, with its verdict in words."""
    verdict = "certified" if found.holds else "NOT certified"
    reach = f"limit {found.value:.4g} s" if isfinite(found.limit) else f"no limit found up to {found.value:.4g} s"
    text = f"{what} {verdict} for gaps up to {found.demand:.4g} s ({reach}){further}"
    return replace(found, what=what, statement=text)
