"""Signatures of a sampled signal while it comes: the properties of Omar 2012, section 2.5, and which parameter they say
has changed. Uses the pencil map and the properties.
"""

from __future__ import annotations

from typing import Any, Literal

import numpy as np

from fmu_observer.formulas.signatures.pencil import NextScaling, pencil_point
from plant_models.hybrid import Array, HybridSystem, PeriodicEvent, vector
from plant_models.hybrid.option import require_chosen, require_whole
from plant_models.hybrid.signal import (
    Signal,
    discrete_output,
    input_signal,
    memory,
    output_signal,
    parameter,
    warning_output,
)

_PROPERTIES = (
    (1, "length", "length of S1 to the middle of its branches", 0.3345),
    (2, "short_tip", "abscissa of the right tip of S2", 0.052),
    (3, "gap", "gap between the right-hand branches of S1", 0.0021),
)
"""Number of each property, its name, what it is, and its value for the nominal `van_der_pol`."""
_CYCLES = 4.0
"""Tips before the properties count: the first two may be those of a transient."""
_TIP_MEMORY: tuple[Signal, ...] = (
    memory("abscissa_before", "1", 0.0, "Abscissa of the long signature one sample ago"),
    memory("abscissa_earlier", "1", 0.0, "Abscissa of the long signature two samples ago"),
    memory("last_tip", "1", 0.0, "Abscissa of the last tip"),
    memory("lowest", "1", 0.0, "Smallest abscissa of the long signature since the last tip"),
    memory("lowest_before", "1", 0.0, "Smallest abscissa between the last two tips"),
    memory("highest", "1", 0.0, "Largest abscissa of the long signature since the last tip"),
    memory("highest_before", "1", 0.0, "Largest abscissa between the last two tips"),
    memory("short_highest", "1", 0.0, "Largest abscissa of the short signature since the last tip"),
    memory("short_before", "1", 0.0, "Largest abscissa of the short signature between the last two tips"),
    memory("tips", "1", 0.0, "Tips found since the start, or since the signal last stopped to oscillate"),
    memory("since_tip", "1", 0.0, "Samples since the last tip"),
    *(memory(f"held_{name}", "1", 0.0, f"Property r{number} at the last tip") for number, name, *_ in _PROPERTIES),
)


_TOLERANCE = 0.01
"""Of the ordinate, as printed."""
_FLAT = -1e9  # below every second difference
_PRINTED_MEMORY: tuple[Signal, ...] = (
    memory("ordinate_before", "1", 0.0, "Ordinate of the long signature one sample ago"),
    memory("tip_ordinate", "1", 0.0, "Ordinate of the last tip, y*"),
    memory("near", "1", 0.0, "Smallest abscissa at that ordinate since the last tip"),
    memory("near_before", "1", 0.0, "Smallest abscissa at the tip's ordinate between the last two tips"),
    memory("short_abscissa", "1", 0.0, "Abscissa of the short signature one sample ago"),
    memory("short_ordinate", "1", 0.0, "Ordinate of the short signature one sample ago"),
    memory("short_earlier", "1", 0.0, "Ordinate of the short signature two samples ago"),
    memory("bend", "1", _FLAT, "Largest second difference of the short ordinates since the last tip"),
    memory("bend_at", "1", 0.0, "Abscissa there"),
    memory("bend_before", "1", _FLAT, "Largest second difference between the last two tips"),
    memory("bend_at_before", "1", 0.0, "Abscissa there"),
)


Reading = Literal["repaired", "as_published"]
LONG, SHORT = 100, 50  # orders of the properties that ship


class SignatureTrack(HybridSystem):
    """Two signatures of a signal, S1 of order `long_order` and S2 of order `short_order`, three properties of them, and
    a verdict: Omar 2012, section 2.5.

    r1 is the length of S1 from its left end to the middle between its right-hand branches, r2 the abscissa of the right
    tip of S2, r3 the gap between those branches. For `van_der_pol` they distinguish the three parameters:

    - r3 is off: p3 has changed, whatever p1 and p2 do;
    - r2 is off, and r1 not by much: p2;
    - r1 is off, and r2 not: p1; r1 is off by more than `strong_change`, and r2 too: both. A small change of p1 beside
      one of p2 cannot be detected.

    Nominal properties are those of the shipped orders: with others measure them, or read the properties alone. The
    signal has to oscillate: properties are taken over the last two ways from tip to tip, and held until the next
    tip. `ready` is 0 until four tips are found, and where none has come for `patience`.

    Args:
        long_order: N of S1. short_order: N of S2, at most that of S1. next_scaling: ``norm``, which the independence of
            the properties needs, or ``literal``. reading: ``repaired`` takes local maxima; ``as_published`` the printed
            formulas, which find points far left of the branches and hop between tips of S2.

    Raises:
        ValueError: an order below 2, orders that are not in order, or an unknown scaling or reading.

    Presets: `van_der_pol` (default): properties of the nominal `van_der_pol` at 100 Hz as measured, thresholds ours.
    """

    name = "signature_track"
    description = "Signature properties of an oscillating signal, and which parameter has changed"
    source = "Omar 2012, (2.3.1)-(2.3.6), section 2.5; detection of the tips ours"
    internal_step = 1e-2
    inputs = (input_signal("signal", "1", 0.0, "The signal"),)
    outputs = (
        *(discrete_output(name, "1", f"r{number}, {text}") for number, name, text, _ in _PROPERTIES),
        discrete_output("abscissa", "1", "Abscissa of the newest point of S1"),
        discrete_output("ready", "1", "1 while the properties count, else 0"),
        discrete_output("noise", "1", "Deviation of the signal's noise, by third differences"),
        warning_output(
            "noisy",
            "1 while the noise is above noise_limit",
            "found more noise than its verdict bears: with three times noise_limit most verdicts are wrong. "
            "Filter the signal, or widen the changes that count",
            ("noise",),
        ),
        *(
            output_signal(f"p{number}_changed", "1", f"1 while the {which} parameter is judged to have changed")
            for number, which in enumerate(("first", "second", "third"), start=1)
        ),
    )
    parameters = (
        parameter("sample_period", "s", 0.01, "Time between two samples, tau", min=1e-6),
        parameter("eps", "1", 1e-3, "Regularisation in the unit of the signal", min=1e-12),
        parameter("patience", "s", 3.0, "Time without a tip after which the properties no longer count", min=0.0),
        *(
            parameter(f"nominal_{name}", "1", value, f"r{number} without a change")
            for number, name, _, value in _PROPERTIES
        ),
        parameter("length_change", "1", 0.01, "Change of r1 that counts", min=0.0),
        parameter("strong_change", "1", 0.02, "Change of r1 that counts although r2 has changed", min=0.0),
        parameter("short_tip_change", "1", 0.002, "Change of r2 that counts", min=0.0),
        parameter("gap_change", "1", 0.006, "Change of r3 that counts", min=0.0),
        parameter("noise_limit", "1", 0.003, "Noise up to which verdicts are right, unit of the signal", min=0.0),
    )
    events = (PeriodicEvent("sampling", "sample_period", description="The signal is read"),)
    presets = {"van_der_pol": {}}
    default_preset = "van_der_pol"
    option_choices = {
        "next_scaling": ("norm", "literal"),
        "reading": ("repaired", "as_published"),
    }

    def __init__(
        self,
        long_order: int = LONG,
        short_order: int = SHORT,
        next_scaling: NextScaling = "norm",
        reading: Reading = "repaired",
    ) -> None:
        require_whole(self.name, 2, long_order=long_order, short_order=short_order)
        if short_order > long_order:
            raise ValueError(f"{self.name}: short_order {short_order} is above long_order {long_order}; exchange them.")
        require_chosen(self.name, self.option_choices, next_scaling=next_scaling, reading=reading)
        self.orders, self.next_scaling, self.reading = (long_order, short_order), next_scaling, reading
        self.states = (
            memory("samples", "1", 0.0, "The last samples, the oldest first", size=long_order),
            memory("taken", "1", 0.0, "Samples taken, counted as far as is needed"),
            *_TIP_MEMORY,
            *(_PRINTED_MEMORY if reading == "as_published" else ()),
        )
        super().__init__(
            long_order=long_order,
            short_order=short_order,
            next_scaling=next_scaling,
            reading=reading,
        )

    def requirements(self, p: Any) -> dict[str, Array]:
        """Nominal properties are measured with the period and the regularisation in use."""
        named = ("nominal_length", "nominal_short_tip", "nominal_gap", "sample_period", "eps")
        start = {s.name: float(s.start_values[0]) for s in self.parameters if s.name in named}
        own = np.stack([np.abs(getattr(p, name) - start[name]) for name in named[:3]])
        differs = np.abs(p.sample_period - start["sample_period"]) + np.abs(p.eps - start["eps"])
        shipped = np.where(np.max(own) > 0.0, 0.0, 1.0)
        other = np.where(differs > 0.0, 1.0, 0.0)
        text = (
            f"nominal_length, nominal_short_tip and nominal_gap belong to samples each {start['sample_period']:g} s, "
            f"eps = {start['eps']:g} and orders {LONG} and {SHORT}: measure them with yours on a run without a change"
        )
        return super().requirements(p) | {text: 1.0 - shipped * other}

    def jump(self, event: str, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        """A sample gives one point to each signature."""
        count, short = self.orders
        past = x.samples
        long_point = pencil_point(past, u.signal, p.eps, self.next_scaling)
        short_point = pencil_point(past[count - short :], u.signal, p.eps, self.next_scaling)
        patience = p.patience / p.sample_period
        if self.reading == "repaired":
            found = _next_tips(x, long_point[0], short_point[0], patience)
        else:
            points = ((long_point[0], long_point[1]), (short_point[0], short_point[1]))
            found = _next_printed(x, *points, patience)
        full = x.taken > count - 0.5
        return {
            "samples": np.hstack([past[1:], vector(u.signal)]),
            "taken": np.minimum(x.taken + 1.0, 1.0 * count),
            **{name: np.where(full, new, getattr(x, name)) for name, new in found.items()},
        }

    def output(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        ready = np.where(x.tips > _CYCLES - 0.5, 1.0, 0.0)
        past = x.samples
        third = past[3:] - 3.0 * past[2:-1] + 3.0 * past[1:-2] - past[:-3]  # white noise: 20 times its variance
        noise = np.sqrt(np.sum(third * third) / (20.0 * max(self.orders[0] - 3, 1)))
        return {
            "length": x.held_length,
            "short_tip": x.held_short_tip,
            "gap": x.held_gap,
            "abscissa": x.abscissa_before,
            "ready": ready,
            "noise": noise,
            "noisy": np.where(noise > p.noise_limit, ready, 0.0),
            **self._verdict(x, ready, p),
        }

    def _verdict(self, x: Any, ready: Array, p: Any) -> dict[str, Array]:
        change = np.abs(x.held_length - p.nominal_length)
        second = np.abs(x.held_short_tip - p.nominal_short_tip) > p.short_tip_change
        first = np.where(second, change - p.strong_change, change - p.length_change) > 0.0
        third = np.abs(x.held_gap - p.nominal_gap) > p.gap_change
        return {
            "p1_changed": ready * np.where(first, 1.0, 0.0),
            "p2_changed": ready * np.where(second, 1.0, 0.0),
            "p3_changed": ready * np.where(third, 1.0, 0.0),
        }


def _next_printed(
    x: Any, long_point: tuple[Array, Array], short_point: tuple[Array, Array], patience: Array
) -> dict[str, Array]:
    """Memory after a sample, with the properties by the printed formulas.

    ``|S_y - y*| < 0.01`` asks for the ordinate of a tip that is still to come; here it is that of the last one.
    """
    tips = _next_tips(x, long_point[0], short_point[0], patience)
    tip = tips["since_tip"] < 0.5
    near = np.where(np.abs(long_point[1] - x.tip_ordinate) < _TOLERANCE, np.minimum(x.near, long_point[0]), x.near)
    bend = short_point[1] - 2.0 * x.short_ordinate + x.short_earlier
    sharper = bend > x.bend
    best, best_at = np.where(sharper, bend, x.bend), np.where(sharper, x.short_abscissa, x.bend_at)
    at_bend = np.where(best > x.bend_before, best_at, x.bend_at_before)
    return tips | {
        "ordinate_before": long_point[1],
        "tip_ordinate": np.where(tip, x.ordinate_before, x.tip_ordinate),
        "near": np.where(tip, x.abscissa_before, near),
        "near_before": np.where(tip, near, x.near_before),
        "short_abscissa": short_point[0],
        "short_ordinate": short_point[1],
        "short_earlier": x.short_ordinate,
        "bend": np.where(tip, _FLAT, best),
        "bend_at": np.where(tip, x.short_abscissa, best_at),
        "bend_before": np.where(tip, best, x.bend_before),
        "bend_at_before": np.where(tip, best_at, x.bend_at_before),
        **_properties(x, tip, near, at_bend),
    }


def _properties(x: Any, tip: Array, near: Array, at_bend: Array) -> dict[str, Array]:
    """Properties, new at a tip, by the smallest abscissa at its ordinate and the abscissa of the sharpest bend."""
    top = np.maximum(x.abscissa_before, x.last_tip)
    nearest = np.minimum(near, x.near_before)
    low = np.minimum(x.lowest, x.lowest_before)
    return {
        "held_length": np.where(tip, 0.5 * (top + nearest) - low, x.held_length),
        "held_short_tip": np.where(tip, at_bend, x.held_short_tip),
        "held_gap": np.where(tip, top - nearest, x.held_gap),
    }


def _next_tips(x: Any, long_abscissa: Array, short_abscissa: Array, patience: Array) -> dict[str, Array]:
    """Memory after a sample.

    A tip is a local maximum of the long signature's abscissa in the upper half of its extent. Extremes are those of
    the last two ways between tips, so that both branches count.
    """
    before = x.abscissa_before
    lowest = np.minimum(x.lowest, x.lowest_before)
    middle = 0.5 * (lowest + np.maximum(x.highest, x.highest_before))
    tip = (before > x.abscissa_earlier) * (before >= long_abscissa) * (before > middle)
    length = 0.5 * (before + x.last_tip) - lowest
    lost = x.since_tip >= patience
    kept = np.where(lost, 0.0, x.tips)
    return {
        "abscissa_before": long_abscissa,
        "abscissa_earlier": before,
        "last_tip": np.where(tip, before, x.last_tip),
        "lowest": np.where(tip, long_abscissa, np.minimum(x.lowest, long_abscissa)),
        "lowest_before": np.where(tip, x.lowest, x.lowest_before),
        "highest": np.where(tip, long_abscissa, np.maximum(x.highest, long_abscissa)),
        "highest_before": np.where(tip, x.highest, x.highest_before),
        "short_highest": np.where(tip, short_abscissa, np.maximum(x.short_highest, short_abscissa)),
        "short_before": np.where(tip, x.short_highest, x.short_before),
        "tips": np.where(tip, kept + 1.0, kept),
        "since_tip": np.where(tip, 0.0, np.where(lost, 0.0, x.since_tip + 1.0)),
        "held_length": np.where(tip, length, x.held_length),
        "held_short_tip": np.where(tip, np.maximum(x.short_highest, x.short_before), x.held_short_tip),
        "held_gap": np.where(tip, np.abs(before - x.last_tip), x.held_gap),
    }
