"""The adhesion-condition detector, by the slip nearest to the optimum of one of two creep curves, and the maps of these
optima over the speed.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Literal

import numpy as np

from fmu_observer.detection.slip_indicator import DEGRADED, NOMINAL, speed_slip_from_odometer_slip
from plant_models.hybrid import Array, HybridSystem, PeriodicEvent
from plant_models.hybrid.option import require_chosen
from plant_models.hybrid.signal import discrete_output, input_signal, memory, output_signal, parameter, state
from plant_models.railway.adhesion.law import POLACH_DRY, POLACH_WET, PolachCurve
from plant_models.railway.track.track import piecewise_linear

KMH = 3.6  # km/h in one m/s
_MAP_KMH = (1, 2, 3, 4, 5, 6, 8, 10, 12.5, 15, 20, 25, 30, 40, 50, 60, 80, 110, 160)
MAP_SPEEDS = tuple(v / KMH for v in _MAP_KMH)
"""[m/s], from the lowest the thesis shows, and lower, to the speed limit of its line."""


@dataclass(frozen=True)
class _AdhesionMap:
    """Optimal slip and adhesion there over the train speed.

    Attributes:
        speeds: [m/s], ascending. slips: slip of the largest adhesion coefficient, relative to the train speed [1].
        peaks: that coefficient [1].
    """

    speeds: tuple[float, ...]
    slips: tuple[float, ...]
    peaks: tuple[float, ...]


_SlipDefinition = Literal["odometer", "speed"]

_LARGEST_SLIP = 0.95  # of the odometer ratio: beyond, the wheel spins under a train that stands, 19 times over


class AdhesionDetector(HybridSystem):
    """Nominal or degraded adhesion from slip and speed: Bouchama 2024, (4.16)-(4.17).

    At the speed V the maps give the slip ``s_n(V)`` and ``s_d(V)`` at which the nominal and the degraded creep curve
    peak. With the magnitude s of the slip the adhesion is nominal where ``|s_n - s| + alpha < |s_d - s|``, else
    degraded: the slip has to be nearer to the nominal optimum by alpha. In effect that is a threshold on the slip,
    ``(s_n + s_d - alpha) / 2``, that falls with the speed from 21 % at 5 km/h to 4.5 % at 50 km/h.

    Slips of one definition only can be compared. The maps are relative to the train speed, like Polach's s; the
    observers' slip (3.49) is relative to the odometer. It is converted, ``s / (1 - s)``, before the comparison. The
    thesis compares the two as they are: ``slip_definition="speed"`` fed with (3.49) does that.

    The slip is filtered, judged every `check_period`, and a new verdict counts when it has stood for `debounce_time`
    [ours]. Below `min_speed` the last verdict stays. `adhesion_limit` is the peak of the curve judged to be in force.

    Args:
        slip_definition: denominator of the input `slip`: ``odometer``, (3.49) and (4.14), or ``speed``, (3.13).

    Presets: `polach` (default): maps computed from Polach's curves, dry and wet. `as_published`: the printed Table 4.5.
    """

    name = "adhesion_detector"
    description = "Nominal or degraded adhesion, by the optimal slip of two creep curves nearest to the slip"
    source = "Bouchama 2024, (4.16)-(4.17), Table 4.5; filter and debouncing ours"
    internal_step = 1e-2
    states = (
        state("filtered_slip", "1", 0.0, "Magnitude of the slip relative to the train speed, filtered"),
        memory("condition_in_force", "1", NOMINAL, "Verdict in force"),
        memory("contrary_time", "s", 0.0, "Time for which the other verdict has been reached without a break"),
    )
    inputs = (
        input_signal("slip", "1", 0.0, "Slip ratio of the chosen definition"),
        input_signal("speed", "m/s", 0.0, "Train speed, estimated or measured"),
    )
    outputs = (
        discrete_output("condition", "1", "1 nominal, 2 degraded adhesion, debounced"),
        output_signal("raw_condition", "1", "The verdict on the filtered slip now"),
        *(
            output_signal(f"{level}_optimum", "1", f"Optimal slip on {level} adhesion at this speed")
            for level in ("nominal", "degraded")
        ),
        output_signal("adhesion_limit", "1", "Largest adhesion coefficient at this speed in the condition judged"),
    )
    events = (PeriodicEvent("check", "check_period", description="The filtered slip is judged"),)
    default_preset = "polach"
    option_choices = {"slip_definition": ("odometer", "speed")}

    def __init__(self, slip_definition: _SlipDefinition = "odometer") -> None:
        require_chosen(self.name, self.option_choices, slip_definition=slip_definition)
        self.slip_definition = slip_definition
        computed = _map_values(nominal_map(), degraded_map())
        self.parameters = (
            parameter("map_speed", "m/s", MAP_SPEEDS, "Speeds of the maps, ascending", size=len(MAP_SPEEDS)),
            *(parameter(name, "1", values, _TEXTS[name], size=len(values)) for name, values in computed.items()),
            parameter("advantage", "1", 0.01, "How much nearer the nominal optimum has to be, alpha", min=0.0),
            parameter("slip_filter_time", "s", 0.2, "Time constant of the slip filter", min=0.01),
            parameter("debounce_time", "s", 0.5, "Time for which a new verdict has to stand", min=0.0),
            parameter("min_speed", "m/s", 0.5, "Speed below which nothing is judged", min=0.0),
            parameter("check_period", "s", 0.05, "Time between two checks", min=1e-4),
        )
        self.presets = {"polach": computed, "as_published": _map_values(published_map(False), published_map(True))}
        super().__init__(slip_definition=slip_definition)

    def flow(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        return {"filtered_slip": (self._magnitude(u.slip) - x.filtered_slip) / p.slip_filter_time}

    def jump(self, event: str, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        """A check: a contrary verdict that has stood long enough comes into force."""
        verdict = np.where(np.abs(u.speed) > p.min_speed, self._verdict(x, u, p), x.condition_in_force)
        time = np.where(verdict != x.condition_in_force, x.contrary_time + p.check_period, 0.0)
        changes = time - p.check_period >= p.debounce_time - 1e-9  # at its first check a verdict has stood for no time
        changed = np.where(time > 0.0, np.where(changes, verdict, x.condition_in_force), x.condition_in_force)
        return {"condition_in_force": changed, "contrary_time": np.where(changed != x.condition_in_force, 0.0, time)}

    def output(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        nominal, degraded = self._at_speed(u, p, p.nominal_slip_map, p.degraded_slip_map)
        high, low = self._at_speed(u, p, p.nominal_peak_map, p.degraded_peak_map)
        return {
            "condition": x.condition_in_force,
            "raw_condition": self._verdict(x, u, p),
            "nominal_optimum": nominal,
            "degraded_optimum": degraded,
            "adhesion_limit": np.where(x.condition_in_force == DEGRADED, low, high),
        }

    def _verdict(self, x: Any, u: Any, p: Any) -> Array:
        nominal, degraded = self._at_speed(u, p, p.nominal_slip_map, p.degraded_slip_map)
        return condition_of(x.filtered_slip, nominal, degraded, p.advantage)

    def _magnitude(self, slip: Array) -> Array:
        if self.slip_definition == "speed":
            return np.abs(slip)
        return np.abs(speed_slip_from_odometer_slip(np.minimum(slip, _LARGEST_SLIP)))

    @staticmethod
    def _at_speed(u: Any, p: Any, nominal: Array, degraded: Array) -> tuple[Array, Array]:
        speed = np.abs(u.speed)
        return piecewise_linear(speed, p.map_speed, nominal), piecewise_linear(speed, p.map_speed, degraded)


def condition_of(slip: Array, nominal_optimum: Array, degraded_optimum: Array, advantage: Array) -> Array:
    """1 (nominal) where ``|s_n - s| + alpha < |s_d - s|``, else 2 (degraded): Bouchama 2024, (4.17).

    Args:
        slip: its magnitude [1]. nominal_optimum, degraded_optimum: of the same definition [1]. advantage: alpha [1].
    """
    nearer = np.abs(nominal_optimum - slip) + advantage < np.abs(degraded_optimum - slip)
    return np.where(nearer, NOMINAL, DEGRADED)


_TEXTS = {
    "nominal_slip_map": "Optimal slip on nominal adhesion, relative to the train speed",
    "degraded_slip_map": "Optimal slip on degraded adhesion, relative to the train speed",
    "nominal_peak_map": "Largest adhesion coefficient, nominal",
    "degraded_peak_map": "Largest adhesion coefficient, degraded",
}


def _map_values(nominal: _AdhesionMap, degraded: _AdhesionMap) -> dict[str, tuple[float, ...]]:
    return dict(zip(_TEXTS, (nominal.slips, degraded.slips, nominal.peaks, degraded.peaks), strict=True))


@lru_cache(maxsize=32)
def adhesion_map(curve: PolachCurve, speeds: tuple[float, ...] = MAP_SPEEDS) -> _AdhesionMap:
    """Map of a creep curve, each point its first peak.

    Args:
        curve: with numbers, not symbols, for parameters. speeds: [m/s], positive.

    Raises:
        ValueError: a speed is not positive, or the curve has no peak there.

    Source: Bouchama 2024, (4.16) and Table 4.5, which the curves of its Table 3.1 give with the sliding speed in km/h
    and k = 25.
    """
    found = [curve.peak(float(speed)) for speed in speeds]
    return _AdhesionMap(tuple(map(float, speeds)), tuple(slip for slip, _ in found), tuple(peak for _, peak in found))


def nominal_map() -> _AdhesionMap:
    """Map of the dry rail, nominal adhesion."""
    return adhesion_map(POLACH_DRY)


def degraded_map() -> _AdhesionMap:
    """Map of the wet rail, degraded adhesion."""
    return adhesion_map(POLACH_WET)


def published_map(degraded: bool) -> _AdhesionMap:
    """Table 4.5 as printed on the speeds of `MAP_SPEEDS`: linear between its six speeds, constant outside 5 to 50
    km/h.

    Args:
        degraded: True for wet rail, False for dry.
    """
    speeds = np.array([5.0, 10.0, 20.0, 30.0, 40.0, 50.0]) / KMH
    slips = (0.304, 0.20, 0.144, 0.12, 0.096, 0.072) if degraded else (0.10, 0.08, 0.048, 0.04, 0.032, 0.032)
    peaks = (
        (0.2188, 0.1961, 0.1713, 0.1566, 0.1463, 0.1387)
        if degraded
        else (0.3894, 0.3474, 0.3027, 0.2769, 0.2594, 0.2449)
    )
    slips_there, peaks_there = (np.interp(MAP_SPEEDS, speeds, values) for values in (slips, peaks))
    return _AdhesionMap(MAP_SPEEDS, tuple(map(float, slips_there)), tuple(map(float, peaks_there)))
