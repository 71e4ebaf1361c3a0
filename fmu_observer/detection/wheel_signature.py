"""A wheel that jams or skids, detected by the signature of its odometer's record alone. Uses the trained classes and
the pencil map.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from fmu_observer.detection.jam_detector import ODOMETER_SAMPLE
from fmu_observer.formulas.signatures.classification import Plane, SearchStage, SignatureClassifier
from fmu_observer.formulas.signatures.clouds import Coordinate, Separation
from fmu_observer.formulas.signatures.pencil import pencil_point
from fmu_observer.formulas.signatures.properties import PROPERTIES
from plant_models.hybrid import Array, HybridSystem, discrete_output, input_signal, memory, parameter, vector

STEADY, DROP, RISE = "steady", "drop", "rise"
CHANGES = 4
"""Changes from reading to reading in a record."""
_PLANE_1 = Plane(
    (
        Coordinate(2, "max_eta", 10.0, "norm"),
        Coordinate(2, "range_xi", 0.1, "norm"),
    ),
    np.array([0.48824321, 9.35163292e-05]),
    np.array([1.94450841, 68.2743576]),
)
_PLANE_2 = Plane(
    (
        Coordinate(2, "min_eta", 10.0, "literal"),
        Coordinate(2, "min_eta", 1.0, "norm"),
    ),
    np.array([-1.39895177, -13.9128048]),
    np.array([1.9117224, 14.5279604]),
)
WHEEL_CLASSES = SignatureClassifier(
    (
        SearchStage(
            DROP,
            _PLANE_1,
            {
                STEADY: Separation(0.00672659163, 0.00610860294, np.array([0.996194698, -0.0871557427]), 0.0173349324),
                RISE: Separation(0.00988674917, 0.00922705105, np.array([0.99756405, -0.0697564737]), 0.0161031639),
            },
            0.00672659163,
        ),
        SearchStage(
            STEADY,
            _PLANE_2,
            {
                RISE: Separation(0.00579823116, 0.00303093431, np.array([0.906307787, -0.422618262]), 0.474184313),
            },
            0.00579823116,
        ),
    ),
    RISE,
    (STEADY, DROP, RISE),
)
"""Decisions of `wheel_signature`: at 5 Hz and 0.05 m/s of noise, faults of at least 0.6 m/s."""


_TRAINED_PERIOD = 0.2  # [s]
CODES: Mapping[str, float] = {STEADY: 0.0, DROP: -1.0, RISE: 1.0}


class WheelSignature(HybridSystem):
    """Jams and skids of the wheel that an odometer counts, by the signature of the last changes of its reading: the
    coordinates and clouds of Omar 2012, sections 3.4.2-3.4.5, for a train [ours].

    At each reading the record of the last four changes is *steady*, a *drop* or a *rise*. A drop begins a jam and a
    rise ends it; a rise of a wheel that was believed begins a skid and a drop ends it. A change that is reported does
    not enter the record, and a second one of the same kind at the next reading belongs to the first, for a reading is a
    mean over the period in which the fault began. A fault that does not end is given up after `hold_limit`.

    The detector knows neither effort nor model, so it serves where no observer runs, and it is worse than
    `jam_detector` where one does: docs/theses/signatures.md has both error rates. The classes were trained at 5 Hz, and
    another period is refused: the change by the effort grows with it, noise and the step of a fault do not, so that no
    factor makes one record the other.
    """

    name = "wheel_signature"
    description = "Jams and skids of the odometer's wheel from the signature of its record"
    source = "Omar 2012, sections 2.3 and 3.4, for the record of an odometer; classes trained on synthetic trains"
    internal_step = 1e-2
    bounded_parameters = "all"
    inputs = (input_signal("odometer", "m/s", 0.0, "Odometer speed", display_unit="km/h"),)
    outputs = (
        discrete_output("odometer_fault", "1", "1 while the wheel is judged to jam or skid, else 0"),
        discrete_output("kind", "1", "-1 a jam, 1 a skid, 0 neither"),
        discrete_output("change", "1", "The newest record: -1 a drop, 1 a rise, 0 steady"),
        discrete_output("fault_time", "s", "Time since the fault was told"),
    )
    parameters = (
        parameter("odometer_period", "s", _TRAINED_PERIOD, "Time between two readings of the odometer", min=1e-3),
        parameter("hold_limit", "s", 15.0, "Longest time for which a fault is held that does not end", min=0.0),
    )
    states = (
        memory("changes", "m/s", 0.0, "The last changes of the reading, the oldest first", size=CHANGES),
        memory("last_reading", "m/s", 0.0, "Reading before"),
        memory("readings", "1", 0.0, "Readings taken, counted as far as is needed"),
        memory("reported_kind", "1", 0.0, "-1 a jam, 1 a skid, 0 neither"),
        memory("reported_change", "1", 0.0, "Class of the newest record"),
        memory("held_time", "s", 0.0, "Time since the fault was told"),
    )
    events = (ODOMETER_SAMPLE,)

    def requirements(self, p: Any) -> dict[str, Array]:
        """Parameters keep their bounds, and the period is that of the training."""
        trained = (
            f"odometer_period must be {_TRAINED_PERIOD:g} s: the classes were trained on changes over that time, and "
            "say nothing about others. Read the odometer at that rate, or train classes of your own "
            "(docs/gallery/moving_horizon/wheel_records.py)"
        )
        kept = np.where(np.abs(p.odometer_period - _TRAINED_PERIOD) < 1e-6, 1.0, 0.0)
        return super().requirements(p) | {trained: kept}

    def jump(self, event: str, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        taken, kind = x.readings, x.reported_kind
        change = np.where(taken > 0.5, u.odometer - x.last_reading, 0.0)
        record = [*x.changes[1:], change]
        newest = np.where(taken > CHANGES - 0.5, _record_class(WHEEL_CLASSES, record), 0.0)
        acts = np.where(newest == x.reported_change, 0.0, newest)
        kept = np.where(acts * kind == 0.0, np.where(kind == 0.0, acts, kind), np.where(acts == kind, kind, 0.0))
        time = np.where(kept == 0.0, 0.0, np.where(kept == kind, x.held_time + p.odometer_period, 0.0))
        over = time > p.hold_limit
        record[-1] = np.where(newest == 0.0, change, record[-2])
        return {
            "changes": vector(*record),
            "last_reading": u.odometer,
            "readings": np.minimum(taken + 1.0, 1.0 * CHANGES),
            "reported_kind": np.where(over, 0.0, kept),
            "reported_change": newest,
            "held_time": np.where(over, 0.0, time),
        }

    def output(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        newest = {"kind": x.reported_kind, "change": x.reported_change, "fault_time": x.held_time}
        return {"odometer_fault": np.abs(x.reported_kind)} | newest


def _record_class(classes: SignatureClassifier, record: Sequence[Array]) -> Array:
    """Class of a record by the decisions of a classifier: -1 a drop, 1 a rise, 0 steady. It traces."""
    verdict = CODES[str(classes.last)] + 0.0 * record[-1]
    for stage in reversed(classes.stages):
        abscissa, ordinate = _point(stage.plane, record)
        inside: Array = 1.0
        for rival in stage.rivals.values():
            beyond = rival.normal[0] * abscissa + rival.normal[1] * ordinate - rival.threshold
            inside = inside * np.where(beyond > 0.0, 1.0, 0.0)
        verdict = np.where(inside > 0.5, CODES[str(stage.label)], verdict)
    return verdict


def _point(plane: Plane, record: Sequence[Array]) -> tuple[Array, Array]:
    """The record's point in a plane."""
    values = (_value(coordinate, record) for coordinate in plane.coordinates)
    abscissa, ordinate = ((v - low) / size for v, low, size in zip(values, plane.low, plane.size, strict=True))
    return abscissa, ordinate


def _value(coordinate: Coordinate, record: Sequence[Array]) -> Array:
    order = coordinate.order
    points = [
        pencil_point(vector(*record[i : i + order]), record[i + order], coordinate.eps, coordinate.next_scaling)
        for i in range(len(record) - order)
    ]
    curve: Any = (vector(*(point[0] for point in points)), vector(*(point[1] for point in points)))
    return PROPERTIES[coordinate.quantity](curve)
