"""What a report needs to know about a run: which signals play which role. Standard library only."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field


@dataclass(frozen=True)
class Phase:
    """A part of the run to be judged on its own, ``start <= t <= end`` [s]."""

    name: str
    start: float
    end: float


@dataclass(frozen=True)
class ReportSpec:
    """Roles of the recorded signals; a role without a signal is left out of the report.

    Args:
        title: heading of the report.
        true_position, true_speed, true_slip, true_adhesion_force, true_fault, odometer, speed_reference: names of
            recorded signals; `true_fault` is not zero while a fault acts: while the odometer lies, say.
        detection: output of the observers that is not zero while they report a fault. delay_limit: longest delay of its
            detection that is allowed [s], or None.
        observers: component names of the observers; signals are ``<name>.position``, ``.speed``, ``.slip``,
            ``.adhesion_force``, ``.slip_indicator``, and that of `detection`, each used where it was recorded.
        other_trains: components with a ``position`` and a ``speed`` that are drawn beside the true ones: the same train
            under another controller, say.
        labels: text to show for an observer or another train.
        phases: parts of the run for the table.
        zones: low-adhesion zones in time [s].
        evaluate_after: start of the evaluation, after the start-up transient [s].
        published: published numbers by observer and phase, ``{observer: {phase: max |speed error| [m/s]}}``.
        independent: independently measured numbers, likewise.
        notes: sentences to stand below the table (why numbers differ).
    """

    title: str = "Co-simulation"
    true_position: str | None = None
    true_speed: str | None = None
    true_slip: str | None = None
    true_adhesion_force: str | None = None
    true_fault: str | None = None
    odometer: str | None = None
    speed_reference: str | None = None
    observers: Sequence[str] = ()
    other_trains: Sequence[str] = ()
    labels: Mapping[str, str] = field(default_factory=dict)
    phases: Sequence[Phase] = ()
    zones: Sequence[tuple[float, float]] = ()
    evaluate_after: float = 0.0
    detection: str = "odometer_fault"
    delay_limit: float | None = None
    published: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    independent: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    notes: Sequence[str] = ()
