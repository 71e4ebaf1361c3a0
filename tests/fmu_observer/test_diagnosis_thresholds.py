"""Thresholds, false alarms with their intervals, and the observer over a finite window."""

import re
from pathlib import Path

import numpy as np
import pytest
import scipy

from fmu_observer.detection import TrainDiagnosis
from fmu_observer.formulas.diagnosis.finite_window_observer import finite_window_observer, sampled
from fmu_observer.formulas.diagnosis.thresholds import (
    alarm_rate,
    checked,
    clopper_pearson,
    count_alarms,
    largest_threshold,
    rate_threshold,
    smallest_window,
)


def test_intervals_are_those_of_scipy() -> None:
    found = alarm_rate(3, 2.0)
    exact = [scipy.stats.gamma.ppf(q, shape) / 2.0 for q, shape in ((0.025, 3), (0.975, 4))]
    assert (found.low, found.high) == pytest.approx(exact, rel=1e-9)
    assert alarm_rate(0, 1.0).high == pytest.approx(-np.log(0.025), rel=1e-9)
    binomial = scipy.stats.binomtest(9, 10).proportion_ci()
    assert clopper_pearson(9, 10) == pytest.approx((binomial.low, binomial.high), rel=1e-6)
    assert clopper_pearson(0, 5)[0] == 0.0
    assert clopper_pearson(5, 5)[1] == 1.0


def test_alarms_are_counted_where_they_begin() -> None:
    assert count_alarms(np.array([1, 1, 0, 1, 0, 0, 1])) == 3
    assert count_alarms(np.array([])) == 0


@pytest.mark.parametrize("allowed", [0.0, 3.0, 20.0])
def test_the_smallest_threshold_for_a_rate(allowed: float) -> None:
    rng = np.random.default_rng(4)
    recordings = [np.abs(rng.normal(size=900)), np.abs(rng.normal(size=900))]  # 1 Hz: half an hour
    threshold = rate_threshold(recordings, 1.0, allowed)
    counts = {float(v): sum(count_alarms(r > v) for r in recordings) for v in np.unique(np.concatenate(recordings))}
    above = [v for v, n in counts.items() if n > 0.5 * allowed]
    assert threshold == min(v for v in counts if v > (max(above) if above else -1.0))
    assert checked(recordings, threshold, 1.0).rate <= allowed


def test_a_rise_in_steps_is_one_alarm_at_each_threshold_below() -> None:
    assert rate_threshold([np.array([0.0, 1.0, 2.0, 0.0])], 1.0, 0.0) == 2.0


def test_a_threshold_is_worth_less_where_it_was_not_made() -> None:
    rng = np.random.default_rng(5)
    rates = []
    for _ in range(400):
        seen, unseen = [rng.normal(size=200) ** 2], [rng.normal(size=200) ** 2]
        threshold = largest_threshold(seen, 1.0)
        assert checked(seen, threshold, 1.0).alarms == 0
        rates.append(checked(unseen, threshold, 1.0).alarms)
    # One of 201 samples is the largest, each as likely: 200 / 201 alarms are expected, with a deviation of 1.4.
    assert np.mean(rates) == pytest.approx(200 / 201, abs=4 * 1.4 / 20)


@pytest.mark.parametrize("bad", [[], [np.zeros(0)], [np.array([0.0, np.nan])]])
def test_recordings_without_numbers_are_refused(bad: list[np.ndarray]) -> None:
    with pytest.raises(ValueError, match="ecording"):
        largest_threshold(bad)


def test_arguments_out_of_range_are_refused() -> None:
    with pytest.raises(ValueError, match="hours above 0"):
        alarm_rate(1, 0.0)


A, B = sampled(np.array([[0.0, 1.0], [-4.0, -0.2]]), np.array([[0.0], [1.0]]), 0.1)


@pytest.mark.parametrize("samples", [2, 5, 9])
@pytest.mark.parametrize("at", ["first", "last"])
def test_a_window_gives_the_state_exactly(samples: int, at: str) -> None:
    rng = np.random.default_rng(samples)
    states, inputs = [rng.normal(size=2)], rng.normal(size=(samples, 1))
    for u in inputs[:-1]:
        states.append(A @ states[-1] + B @ u)
    C = np.array([[1.0, 0.0]])
    observer = finite_window_observer(A, B, C, samples, at)  # type: ignore[arg-type]
    found = observer.estimate(np.array(states) @ C.T, inputs)
    np.testing.assert_allclose(found, states[0 if at == "first" else -1], atol=1e-11)  # condition 10 over two samples
    assert observer.rank == 2


def test_what_a_window_does_not_show_is_reported() -> None:
    observer = finite_window_observer(A, B, np.array([[1.0, 0.0]]), 1)
    assert observer.rank == 1
    np.testing.assert_allclose(np.abs(observer.unobservable.ravel()), [0.0, 1.0], atol=1e-12)
    held = finite_window_observer(np.eye(2), B, np.array([[1.0, 1.0]]), 4)
    np.testing.assert_allclose(np.abs(held.unobservable.ravel()), [0.5**0.5] * 2, atol=1e-12)
    with pytest.raises(ValueError, match="at least 1"):
        finite_window_observer(A, B, np.eye(2), 0)
    with pytest.raises(ValueError, match="do not fit"):
        finite_window_observer(A, B, np.eye(3), 2)


def test_the_thresholds_in_use_are_those_of_the_study_rounded_up() -> None:
    """The sweep is long, so its table stands for it: what it asks for, and what is in use."""
    page = (Path(__file__).parents[2] / "docs" / "theses" / "train_diagnosis.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| `(threshold_\w+|balise_floor)` \| (\S+) \| (\S+) \|", page, re.MULTILINE)
    starts = {s.name: s.start for s in TrainDiagnosis().parameters}
    assert len(rows) == 16  # of the preset `swept`, then of `wet_rails`
    for i, (name, used, asked) in enumerate(rows):
        preset = starts if i < 8 else starts | dict(TrainDiagnosis.presets["wet_rails"])
        assert preset[name] == pytest.approx(float(used), rel=1e-4), name  # printed with four digits
        assert float(asked) <= float(used) <= 1.5 * float(asked), name


def test_a_window_is_enlarged_until_it_shows_the_fault() -> None:
    rng = np.random.default_rng(0)
    free = [rng.normal(size=4000) for _ in range(4)]
    faulty = [np.concatenate([rng.normal(size=100), 1.6 * rng.normal(size=60)]) for _ in range(3)]
    found = smallest_window(free, faulty, 100, (1, 3, 10, 30, 60))
    assert found is not None
    assert 1 < found.samples < 60  # no single sample of 60 is larger than the largest of 16000 without a fault
    for x, delay in zip(faulty, found.delays, strict=True):
        sums = [np.sum(x[max(k - found.samples + 1, 0) : k + 1] ** 2) for k in range(100, 160)]
        assert int(np.argmax(np.array(sums) > found.threshold)) == delay
    assert smallest_window(free, [x[:160] for x in free], 100, (1, 30)) is None
    with pytest.raises(ValueError, match="shortest recording"):
        smallest_window(free, faulty, 100, (501,))
