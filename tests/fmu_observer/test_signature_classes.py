"""Classification by signatures: strips between clouds, decisions, values between classes; and the systems that carry
signatures: verdicts on the Van der Pol oscillator and on the wheel of an odometer.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.distance import cdist

from fmu_observer.detection import WheelSignature
from fmu_observer.detection.wheel_signature import CODES, WHEEL_CLASSES, _record_class
from fmu_observer.formulas.signatures.classification import PencilSpace, SeparationError, train_classifier
from fmu_observer.formulas.signatures.clouds import Coordinate, extent, separation
from fmu_observer.formulas.signatures.conditional_estimate import _train_curve, train_conditional
from fmu_observer.formulas.signatures.dynamic_signature import dynamic_signature
from fmu_observer.formulas.signatures.properties import PROPERTIES, branch_tips, printed_branches, printed_tip
from fmu_observer.observers.generic.signature import SignatureTrack
from plant_models.hybrid import Runtime

GALLERY = Path(__file__).resolve().parents[2] / "docs" / "gallery" / "moving_horizon"
SPACE = PencilSpace((4, 8), ("range_xi", "range_eta", "mean_xi", "path_length"), eps=(0.1,), draws=25)


def waves(frequencies: list[float], sizes: list[float], seed: int = 0) -> np.ndarray:
    """Noisy sines of several frequencies [1/sample] and sizes, 40 samples each, shape (40, n)."""
    rng = np.random.default_rng(seed)
    phase = rng.uniform(0.0, 2.0 * np.pi, len(frequencies))
    clean = np.sin(2.0 * np.pi * np.outer(np.arange(40), frequencies) + phase) * sizes
    return clean + 0.01 * rng.standard_normal(clean.shape)


def classes(seed: int) -> tuple[np.ndarray, list[str]]:
    kinds = {"slow": (0.05, 1.0), "quick": (0.12, 1.0), "large": (0.05, 4.0)}
    stated = [(name, *values) for name, values in kinds.items() for _ in range(12)]
    return waves([g[1] for g in stated], [g[2] for g in stated], seed), [g[0] for g in stated]


def test_a_strip_is_the_distance_of_two_clouds():
    rng = np.random.default_rng(0)
    for _ in range(20):
        first, second = rng.uniform(-1.0, 1.0, (2, 2, 30))
        second = second + rng.uniform(2.5, 4.0) * np.array([[np.cos(a := rng.uniform(0, 6)), np.sin(a)]]).T
        found = separation(extent(first), extent(second))
        nearest = cdist(first.T, second.T).min()
        # The widest strip beside the range across it is no wider than the nearest points are apart.
        assert 0.0 < found.gap <= nearest + 1e-12
        assert (found.normal @ first > found.threshold).all()
        assert (found.normal @ second < found.threshold).all()
        turned = separation(extent(second), extent(first))
        assert turned.margin == pytest.approx(found.margin)
        np.testing.assert_allclose(turned.normal, -found.normal, atol=1e-12)


def test_clouds_on_one_line_are_not_held_apart_by_its_thinness():
    along = np.linspace(0.0, 1.0, 20)
    line = np.stack([along, along])
    # Four of twenty points belong to both: three of nineteen steps.
    assert separation(extent(line[:, :12]), extent(line[:, 8:])).margin == pytest.approx(-3.0 / 19.0, abs=1e-9)


def test_classes_are_distinguished_on_held_out_records():
    records, labels = classes(1)
    classifier = train_classifier(records, labels, SPACE)
    others, truth = classes(2)
    found = np.array([*classifier.labels, "undecided"])[classifier.classify(others, strip=0.0).index]
    assert np.mean(found == np.array(truth)) >= 0.97  # one of 36: what lies at the edge of a cloud
    cautious = classifier.classify(others, strip=1.0)
    reported = cautious.index >= 0
    assert (np.array(classifier.labels)[cautious.index[reported]] == np.array(truth)[reported]).all()
    assert reported.mean() > 0.5
    assert (cautious.score >= 0.0).all()


def test_what_is_not_held_apart_is_reported():
    records, labels = classes(1)
    mixed = ["a", "b"] * (len(labels) // 2)
    with pytest.raises(SeparationError, match=r"classes a, b apart .* best strip is -"):
        train_classifier(records, mixed, SPACE)
    assert train_classifier(records, mixed, SPACE, overlap=True).stages[0].margin < 0.0
    with pytest.raises(ValueError, match="36 records and 2 labels"):
        train_classifier(records, ["a", "b"], SPACE)
    with pytest.raises(ValueError, match="two classes at least, the labels name a"):
        train_classifier(records, ["a"] * 36, SPACE)
    with pytest.raises(ValueError, match="unknown property 'height'"):
        Coordinate(4, "height").of(records)


def test_a_value_between_classes_is_interpolated():
    frequencies = np.repeat([0.04, 0.06, 0.08, 0.1], 8)
    curve, _ = _train_curve(waves(list(frequencies), [1.0] * 32), list(frequencies), SPACE)
    between = waves([0.05, 0.07, 0.09] * 4, [1.0] * 12, 7)
    found = curve.locate(between).value
    # Between its neighbours, and nearer than the next class: the noise and the phase move a point by less.
    assert np.abs(found - np.tile([0.05, 0.07, 0.09], 4)).max() < 0.02
    assert np.median(np.abs(found - np.tile([0.05, 0.07, 0.09], 4))) < 0.006


def test_a_second_quantity_follows_under_the_condition_of_the_first():
    pairs = [(f, s) for f in (0.05, 0.08, 0.11) for s in (1.0, 2.0, 3.0) for _ in range(4)]
    space = PencilSpace((4, 8), ("range_xi", "range_eta", "mean_xi", "path_length"), eps=(0.1, 1.0), draws=40)
    first, second = [p[0] for p in pairs], [p[1] for p in pairs]
    estimator, margins = train_conditional(waves(first, second), first, second, space)
    assert set(margins) == {"first", "second at 0.05", "second at 0.08", "second at 0.11"}
    found = estimator.estimate(waves([0.05, 0.08, 0.11] * 5, [2.0] * 15, 3), reach=2.0)
    assert np.median(np.abs(found.first - np.tile([0.05, 0.08, 0.11], 5))) < 0.01  # a third of the way to the next
    assert np.median(np.abs(found.second - 2.0)) < 0.34
    assert found.covered.mean() > 0.5
    strange = estimator.estimate(100.0 * np.random.default_rng(0).standard_normal((40, 10)), reach=1.0)
    assert strange.covered.mean() < 0.5


def test_properties_of_many_signatures_are_those_of_each():
    records = np.random.default_rng(3).standard_normal((30, 5))
    together = dynamic_signature(records, 4)
    for name, quantity in PROPERTIES.items():
        alone = [quantity(dynamic_signature(records[:, i], 4)) for i in range(5)]
        np.testing.assert_allclose(quantity(together), alone, rtol=1e-12, err_msg=name)


def test_tips_are_local_maxima_in_the_upper_half():
    xi = np.array([0.0, 1.0, 0.2, -1.0, -0.5, -0.8, 0.3, 0.7, 0.1])  # a small maximum at -0.5 does not count
    assert branch_tips((xi, xi)) == (1.0, 0.7)
    far, near = branch_tips((xi, xi), interpolate=True)
    parabola = np.polyfit([-1.0, 0.0, 1.0], [0.3, 0.7, 0.1], 2)
    assert near == pytest.approx(np.polyval(parabola, -parabola[1] / (2.0 * parabola[0])))
    assert far > 1.0
    assert branch_tips((np.arange(5.0), np.zeros(5))) == (4.0, 4.0)
    assert printed_branches((xi, np.zeros(9))) == (1.0, -1.0)  # all points have the ordinate of the tip
    assert printed_tip((xi, np.array([0.0, 0.0, 0.0, 5.0, 0.0, 0.0, 0.0, 0.0, 0.0]))) == 0.2


def track_of(signal: np.ndarray, **options: object) -> list[dict[str, float]]:
    """Outputs after each sample of a signal at 100 Hz."""
    system = SignatureTrack(**options)  # type: ignore[arg-type]
    runtime = Runtime(system)
    runtime.u[0] = signal[0]
    runtime.start(0.0)
    found = []
    for k in range(len(signal)):
        found.append(dict(zip([s.name for s in system.outputs], runtime.update_outputs(), strict=True)))
        runtime.u[0] = signal[min(k + 1, len(signal) - 1)]
        runtime.advance(0.01 * (k + 1))
    return found


def test_the_track_finds_the_tips_of_the_stored_curve():
    def flow(_t: float, x: np.ndarray) -> list[float]:
        return [1.5 * x[1], -9.0 * x[0] + 2.25 * (1.0 - (x[0] + 0.05) ** 2) * x[1]]

    instants = 0.01 * np.arange(1000)
    signal = solve_ivp(flow, (0.0, 10.0), [2.0, 0.0], rtol=1e-10, atol=1e-10, t_eval=instants).y[0]
    rows = track_of(signal, long_order=60, short_order=30)
    long, short = dynamic_signature(signal, 60), dynamic_signature(signal, 30)
    np.testing.assert_allclose([r["abscissa"] for r in rows[70:]], long[0, 10:], atol=1e-12)
    # The last two ways between tips: a period is 1.75 s, and a tip is told one sample after it.
    inner = long[0, 1:-1]
    tips = (
        1
        + np.flatnonzero((inner > long[0, :-2]) & (inner >= long[0, 2:]) & (inner > 0.5 * (inner.max() + inner.min())))[
            -3:
        ]
    )
    stored = long[:, tips[0] + 1 : tips[2] + 2]
    far, near = branch_tips(np.concatenate([stored, long[:, tips[1] - 1 : tips[1] + 2]], axis=1))
    assert rows[-1]["ready"] == 1.0
    assert rows[-1]["gap"] == pytest.approx(abs(long[0, tips[1]] - long[0, tips[2]]), abs=1e-12)
    assert rows[-1]["gap"] == pytest.approx(far - near, abs=1e-12)
    assert rows[-1]["length"] == pytest.approx(0.5 * (far + near) - stored[0].min(), abs=1e-12)
    assert rows[-1]["short_tip"] == pytest.approx(short[0, tips[0] + 31 : tips[2] + 32].max(), abs=1e-12)


def test_the_track_is_not_ready_where_nothing_oscillates():
    t = 0.01 * np.arange(1200)
    signal = np.where(t < 6.0, np.sin(2.0 * np.pi * t), 0.3)
    ready = [row["ready"] for row in track_of(signal, long_order=10, short_order=5)]
    assert ready[100] == 0.0  # fewer than four tips yet
    assert ready[590] == 1.0
    assert ready[-1] == 0.0


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"long_order": 10, "short_order": 20}, "exchange them"),
        ({"next_scaling": "Norm"}, "choose one of: norm, literal"),
        ({"reading": "printed"}, "choose one of: repaired, as_published"),
    ],
)
def test_options_that_are_wrong_are_reported(options, said):
    with pytest.raises(ValueError, match=said):
        SignatureTrack(**options)


def wheel(readings: list[float]) -> list[float]:
    """Kinds that the detector tells at readings of 0.2 s."""
    runtime = Runtime(WheelSignature())
    runtime.u[0] = readings[0]
    runtime.start(0.0)
    kinds = []
    for k, _ in enumerate(readings):
        kinds.append(float(runtime.update_outputs()[1]))
        runtime.u[0] = readings[min(k + 1, len(readings) - 1)]
        runtime.advance(0.2 * (k + 1))
    return kinds


def test_a_jam_and_a_skid_are_reported_from_their_begin_to_their_end():
    rolling = [20.0 - 0.2 * k for k in range(30)]
    jam = [v * (0.5 if 10 <= k < 14 else 0.8 if k == 14 else 1.0) for k, v in enumerate(rolling)]
    assert wheel(jam) == [0.0] * 10 + [-1.0] * 4 + [0.0] * 16  # its end in two readings counts once
    skid = [v * (1.4 if 8 <= k < 12 else 1.0) for k, v in enumerate(rolling)]
    assert wheel(skid) == [0.0] * 8 + [1.0] * 4 + [0.0] * 18
    assert wheel(rolling) == [0.0] * 30
    assert wheel([10.0] * 10 + [0.0] * 90)[10:] == [-1.0] * 76 + [0.0] * 14  # given up after 15 s


def test_another_period_than_that_of_the_training_is_refused():
    runtime = Runtime(WheelSignature())
    runtime.p[0] = 0.1
    with pytest.raises(ValueError, match=r"odometer_period must be 0\.2 s: the classes were trained"):
        runtime.start(0.0)


def test_the_detector_decides_as_its_classifier():
    records = np.random.default_rng(4).normal(-0.2, 1.0, (4, 300))
    classified = WHEEL_CLASSES.classify(records, strip=0.0).index
    codes = np.array([CODES[str(label)] for label in WHEEL_CLASSES.labels])[classified]
    np.testing.assert_array_equal(_record_class(WHEEL_CLASSES, list(records)), codes)
    assert set(codes) == {-1.0, 0.0, 1.0}


def test_the_classes_that_ship_are_those_of_their_training(monkeypatch):
    monkeypatch.setattr(sys, "path", [str(GALLERY), *sys.path])
    from wheel_records import trained

    classifier = trained()
    assert [s.label for s in classifier.stages] == [s.label for s in WHEEL_CLASSES.stages]
    for again, ships in zip(classifier.stages, WHEEL_CLASSES.stages, strict=True):
        assert again.plane.coordinates == ships.plane.coordinates
        np.testing.assert_allclose(again.plane.low, ships.plane.low, rtol=1e-7)
        for label, strip in ships.rivals.items():
            np.testing.assert_allclose(again.rivals[label].normal, strip.normal, rtol=1e-7)
            assert again.rivals[label].threshold == pytest.approx(strip.threshold, rel=1e-6)
