"""What a user asks and gets: certify by observer, overrides, words and data."""

import json
from dataclasses import asdict

import numpy as np
import pytest
from observer_runner import TRAIN_OBSERVERS

from fmu_observer.certificates.finding import Finding
from fmu_observer.certificates.gap_findings import CONSTANT_GAP, GROWTH
from fmu_observer.certificates.sample_products import TwoRateError, certify_two_rate_error
from fmu_observer.observers.train import DifferentiatorCdo, DiscreteUio, TakagiSugenoCdo, TrainObserver


@pytest.mark.parametrize("make", TRAIN_OBSERVERS.values(), ids=TRAIN_OBSERVERS)
def test_every_observer_certifies_half_a_second_by_default(make: type[TrainObserver]) -> None:
    observer = make()
    certificate = next(observer.findings(0.5))
    assert isinstance(certificate, Finding)
    assert certificate.holds
    assert certificate.demand <= certificate.limit <= certificate.condition(CONSTANT_GAP).limit
    assert certificate.explain().startswith(f"{observer.name} (")
    assert certificate.lyapunov_matrix


@pytest.mark.parametrize("make", TRAIN_OBSERVERS.values(), ids=TRAIN_OBSERVERS)
def test_the_data_is_plain_and_the_words_name_the_model(make: type[TrainObserver]) -> None:
    for gap in (0.3, 9.0):
        certificate = next(make().findings(gap))
        data = json.loads(json.dumps(certificate.to_dict(), allow_nan=False))
        assert data["demand"] == gap
        assert Finding.of(asdict(certificate)) == certificate
        assert certificate.source in certificate.explain()
        assert ("stable for every sequence" in certificate.explain()) is certificate.holds


def test_the_very_gains_in_use_are_certified() -> None:
    observer = TakagiSugenoCdo()
    by_override = next(observer.findings(0.5, {"innovation_decay": 3.0}))
    by_preset = next(observer.findings(0.5, preset="as_published"))
    assert by_override.numbers[GROWTH] == by_preset.numbers[GROWTH]
    assert observer.deciding_values({"innovation_decay": 3.0})["innovation_decay"] == 3.0
    slower = next(DifferentiatorCdo().findings(1.5, {"theta": 2.0}))
    assert slower.holds
    assert not next(DifferentiatorCdo().findings(1.5)).holds


def test_vectors_can_be_replaced_whole_or_by_element() -> None:
    observer = TakagiSugenoCdo()
    whole = next(observer.findings(0.3, {"balise_gain_speed": (20.0, 21.0)}))
    single = next(observer.findings(0.3, {"balise_gain_speed[1]": 20.0, "balise_gain_speed[2]": 21.0}))
    assert whole == single
    assert whole.numbers[GROWTH] != next(observer.findings(0.3)).numbers[GROWTH]


def test_the_sentences_distinguish_the_three_cases() -> None:
    observer = DifferentiatorCdo()
    assert "stable for every sequence of balise gaps up to 0.4 s" in next(observer.findings(0.4)).explain()
    assert "NOT CERTIFIED for mixed balise gaps up to 0.55 s" in next(observer.findings(0.55)).explain()
    assert "UNSTABLE at a constant balise gap of 0.7 s" in next(observer.findings(0.7)).explain()


@pytest.mark.parametrize("gap", [0.0, -1.0, np.inf, np.nan])
def test_a_gap_must_be_positive_and_finite(gap: float) -> None:
    with pytest.raises(ValueError, match="gap must be positive"):
        next(DifferentiatorCdo().findings(gap))


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"thetas": 8.0}, "unknown parameter 'thetas'"),
        ({"high_gain": (1.0, 2.0, 3.0)}, "needs 2 finite"),
        ({"theta": np.nan}, "finite"),
    ],
)
def test_bad_parameters_are_refused_by_name(parameters: dict[str, object], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        next(DifferentiatorCdo().findings(0.5, parameters))  # type: ignore[arg-type]


def test_an_unknown_preset_is_refused() -> None:
    with pytest.raises(ValueError, match="unknown preset"):
        next(TakagiSugenoCdo().findings(0.5, preset="as_hoped"))


@pytest.mark.parametrize(
    "override", [{"balise_gain": 0.0}, {"odometer_gain": 0.0}, {"balise_gain[1]": 3.0}, {"odometer_period": 1.0}]
)
def test_an_unknown_input_observer_without_its_corrections_is_not_certified(override: dict[str, float]) -> None:
    assert not next(DiscreteUio().findings(0.5, override)).holds


def test_two_rate_products_are_what_happens_between_samples() -> None:
    error = TwoRateError(((0.0, 1.0), (0.0, 0.0)), (0.0, 0.5), (0.6, 0.3), 1, 0, 0.1)
    flow = np.array([[1.0, 0.1], [0.0, 1.0]])
    odometer, balise = np.array([[1.0, 0.0], [0.0, 0.5]]), np.array([[0.4, 0.0], [-0.3, 1.0]])
    products = error.products(3, 3)
    np.testing.assert_allclose(products[0, 0], odometer @ flow @ balise, atol=1e-14)  # balise right after a sample
    np.testing.assert_allclose(products[0, 2], odometer @ balise @ flow, atol=1e-14)  # right before the next
    np.testing.assert_allclose(products[2, 2], odometer @ balise @ flow @ odometer @ flow @ odometer @ flow, atol=1e-14)
    assert certify_two_rate_error(error, 0.5, "toy").holds
