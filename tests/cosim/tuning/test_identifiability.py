"""Directions that change nothing, found in estimates that are known functions of the parameters."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from cosim.tuning.identifiability import Directions, directions, neighbours
from fmu_observer.design.optimisers.search_space import Bounded, SearchSpace

VALUES = {"f.process_covariance[1]": 0.1, "f.process_covariance[4]": 2.0, "f.measurement_covariance": 0.5}
SPACE = SearchSpace([Bounded(name, 1e-6, 20.0, True) for name in VALUES])
TIME = np.linspace(0.0, 1.0, 50)


def found(estimate: Callable[[Mapping[str, float]], np.ndarray]) -> Directions:
    shown = directions(SPACE, [estimate(values) for values in neighbours(SPACE, VALUES)])
    assert shown is not None
    return shown


def test_ratios_are_all_that_matters() -> None:
    """A function of the two ratios: one singular value is that of the second order of a step of 10 %."""
    shown = found(lambda v: np.log(v["f.process_covariance[1]"] / v["f.measurement_covariance"]) * TIME
                  + np.log(v["f.process_covariance[4]"] / v["f.measurement_covariance"]) * TIME**2)  # fmt: skip
    assert shown.scale_invariant
    assert shown.scale < 1e-12
    assert not shown.idle
    assert len(shown.warnings()) == 1
    assert "only their ratios" in shown.warnings()[0]


def test_what_does_not_occur_is_idle_and_the_scale_is_seen() -> None:
    shown = found(lambda v: v["f.process_covariance[1]"] * TIME + v["f.measurement_covariance"] * np.exp(TIME))
    assert shown.idle == ["f.process_covariance[4]"]
    assert not shown.scale_invariant


def test_two_that_only_act_together_are_named_together() -> None:
    """A product: its step-wise logarithmic changes are alike."""
    shown = found(lambda v: v["f.process_covariance[1]"] * v["f.process_covariance[4]"] * TIME
                  + v["f.measurement_covariance"] * TIME**5)  # fmt: skip
    (text,) = [text for text in shown.warnings() if text.startswith("Hardly visible together")]
    assert "process_covariance[1]" in text
    assert "process_covariance[4]" in text
    assert "measurement" not in text


def test_where_nothing_is_stated_nothing_is_said() -> None:
    assert directions(SPACE, [None] * 5) is None
    assert directions(SPACE, [np.full(3, np.nan)] * 5) is None
    assert directions(SPACE, [np.empty(0)] * 5) is None
    assert set(found(lambda _: TIME).idle) == set(VALUES)
