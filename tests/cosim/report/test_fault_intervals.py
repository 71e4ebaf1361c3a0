"""Which detection belongs to which fault, where faults follow one another closely."""

from __future__ import annotations

import pytest

from cosim.evaluation.fault_detection import _evaluated_detections


def test_a_detection_of_the_next_fault_is_none_of_the_one_before() -> None:
    """Four jams as in the stopping scenario: 0.45 s apart, less than the grace of a late detection."""
    faults = [(1.0, 1.148), (1.6, 1.749), (3.0, 3.149), (4.0, 4.148)]
    reported = [(a + 0.003, b + 0.002) for a, b in faults]
    starts, ends, false = _evaluated_detections(faults, reported, 9.0)
    assert starts == pytest.approx([0.003] * 4)
    assert ends == pytest.approx([0.002] * 4)
    assert false == 0


def test_a_late_detection_still_belongs_to_its_fault() -> None:
    starts, ends, false = _evaluated_detections([(1.0, 1.1)], [(1.3, 1.4), (1.7, 1.8)], 9.0)
    assert (starts, ends, false) == (pytest.approx([0.3]), pytest.approx([0.3]), 1)


def test_without_faults_every_detection_is_false() -> None:
    assert _evaluated_detections([], [(1.0, 2.0)], 9.0) == ([], [], 1)
