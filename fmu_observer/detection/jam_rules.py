"""When an odometer is held to lie, and when it is believed again: what all rules of the jam detector have in common.

The repaired rules are in `repaired_jam_rules`, the printed ones in `jam_detector`.
"""

from __future__ import annotations

from typing import Any, NamedTuple, Protocol

from plant_models.hybrid import Array, Signal, parameter

ROUNDING = 1e-9  # of times that are sums of periods

PERIOD = parameter("odometer_period", "s", 0.2, "Time between two readings of the odometer", min=1e-3)
THRESHOLD = parameter("threshold", "m/s", 0.9, "Residual beyond which the odometer is doubted, eps", min=1e-6)
_RESIDUAL_GAIN = parameter("residual_gain", "1", 2.3, "Residual over speed difference, M", min=1e-6)
_ARMING_DELAY = parameter("arming_delay", "s", 6.0, "Time after the start before any fault is judged", min=0.0)
SHARED_PARAMETERS = (PERIOD, THRESHOLD, _RESIDUAL_GAIN, _ARMING_DELAY)


class Reading(NamedTuple):
    """What is known at an odometer sample.

    Args:
        odometer: the new reading y [m/s].
        speed: estimate of the train speed before the reading is used [m/s].
        residual: ``M (y - speed)`` [m/s].
        effort: traction positive, brake negative [N]; only its sign counts, zero where it is not known.
    """

    odometer: Array
    speed: Array
    residual: Array
    effort: Array


class Passing(NamedTuple):
    """What is known at a balise, of the way since the balise before.

    Args:
        duration: time since that balise [s]. distance: between the two [m]. way: integral of the odometer [m].
        believed: integral of the estimated speed [m]. speed_change: of the odometer from one to the other [m/s].
        accuracy: of the distance [m]. known: 1 where there was a balise before.
    """

    duration: Array
    distance: Array
    way: Array
    believed: Array
    speed_change: Array
    accuracy: Array
    known: Array


class JamVerdict(NamedTuple):
    """What follows from a sample or a balise.

    Args:
        memory: of the rules, what changes of it by name.
        restart: 1 where the estimated speed is to be set to the odometer.
        onset: 1 where a fault begins with this sample.
        shift: to be added to the estimated speed [m/s].
        withdrawn: 1 where the fault that ends with this sample may have been the estimate's: the position is to be set
            to what the odometer's way makes of that at its onset.
    """

    memory: dict[str, Array]
    restart: Array = 0.0
    onset: Array = 0.0
    shift: Array = 0.0
    withdrawn: Array = 0.0


class Rules(Protocol):
    """Rules of a detector.

    Attributes:
        memory: what they remember. parameters: their own, behind `SHARED_PARAMETERS`.
    """

    memory: tuple[Signal, ...]
    parameters: tuple[Signal, ...]

    def at_sample(self, m: Any, reading: Reading, p: Any) -> JamVerdict:
        """Judge an odometer sample.

        Args:
            m: named tuple with the `memory`. reading: the sample.
        """

    def at_balise(self, m: Any, passing: Passing, p: Any) -> JamVerdict:
        """Judge the way between two balises; nothing follows where the rules know no balises.

        Args:
            m: named tuple with the `memory`. passing: the way.
        """
        return JamVerdict({})

    def fault(self, m: Any) -> Array:
        """1 while the odometer is judged to lie or is not confirmed.

        Args:
            m: named tuple with the `memory`.
        """

    def discarded(self, m: Any) -> Array:
        """1 while the estimate must not follow the odometer: while it is judged to lie, unless the rules know more.

        Args:
            m: named tuple with the `memory`.
        """
        return self.fault(m)

    def recovering(self, m: Any) -> Array:
        """1 while it begins to be believed again.

        Args:
            m: named tuple with the `memory`.
        """

    def limit(self, m: Any, p: Any) -> Array:
        """Residual at which the verdict changes [m/s].

        Args:
            m: named tuple with the `memory`.
        """

    def settled_time(self, m: Any, p: Any) -> Array:
        """Time that counts towards judging faults at all [s].

        Args:
            m: named tuple with the `memory`.
        """
