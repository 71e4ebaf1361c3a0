"""Modes that no measurement shows: against the Hautus test, against closed forms, and in words."""

from __future__ import annotations

import numpy as np
import pytest
import scipy
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy.linalg import block_diag
from steady_train import steady_train

from fmu_observer.models.exhibits.pendulum_model import pendulum
from fmu_observer.observability import (
    MeasuredSystem,
    UnobservableError,
    measured_model,
    measured_plant,
    require_detectable,
    require_observable,
    undetectable_modes,
    unobservable_modes,
)
from plant_models import Locomotive


def hautus_defect(A: np.ndarray, C: np.ndarray, eigenvalue: complex) -> int:
    """How many independent eigenvectors of an eigenvalue lie in the kernel of C."""
    pencil = np.vstack([eigenvalue * np.eye(len(A)) - A, C])
    values = np.linalg.svd(pencil, compute_uv=False)
    return int(np.sum(values < 1e-8 * max(values[0], 1.0)))


@settings(max_examples=80)
@given(
    hidden=st.lists(st.sampled_from([-3.0, -0.5, 0.0, 0.25, 2.0]), max_size=3, unique=True),
    seen=st.lists(st.sampled_from([-2.0, -1.0, 0.5, 1.0]), min_size=1, max_size=3, unique=True),
    seed=st.integers(0, 10**6),
)
@example(hidden=[0.0], seen=[-2.0, -1.0], seed=0)  # what is hidden is nothing but rounding
def test_the_modes_are_those_of_the_hautus_test(hidden: list[float], seen: list[float], seed: int) -> None:
    draw = np.random.default_rng(seed)
    n = len(hidden) + len(seen)
    A = np.diag([*hidden, *seen])
    # the seen states may drive the hidden ones
    A[: len(hidden), len(hidden) :] = draw.normal(size=(len(hidden), len(seen)))
    C = np.hstack([np.zeros((1, len(hidden))), draw.uniform(0.5, 2.0, (1, len(seen)))])
    turn = np.linalg.qr(draw.normal(size=(n, n)))[0]
    system = MeasuredSystem(turn @ A @ turn.T, C @ turn.T)
    found = unobservable_modes(system)
    assert [m.eigenvalue for m in found] == pytest.approx(sorted(hidden, reverse=True), abs=1e-9)
    for value in [*hidden, *seen]:
        assert hautus_defect(system.A, system.C, value) == hidden.count(value)
    for mode in found:
        np.testing.assert_allclose(system.A @ mode.vector, mode.eigenvalue.real * mode.vector, atol=1e-9)
        np.testing.assert_allclose(system.C @ mode.vector, 0.0, atol=1e-9)
    assert len(undetectable_modes(system)) == sum(value >= 0.0 for value in hidden)
    if not found:
        require_observable(system)


def test_an_oscillation_is_reported_once_with_its_period() -> None:
    hidden = np.array([[-0.1, 2.0], [-2.0, -0.1]])
    system = MeasuredSystem(block_diag(hidden, -1.0), [[0.0, 0.0, 1.0]], states=["swing", "turn", "level"])
    (mode,) = unobservable_modes(system)
    assert mode.eigenvalue == pytest.approx(-0.1 + 2.0j)
    text = mode.explain()
    assert "period 3.142 s" in text
    assert "decays with time constant 10 s" in text
    assert list(mode.taking_part) == ["swing", "turn"]
    require_detectable(system)
    with pytest.raises(UnobservableError, match=r"mode that no measurement shows: eigenvalue -0\.1 \+- 2i 1/s"):
        require_observable(system)


@pytest.mark.parametrize(
    ("A", "said"),
    [
        (0.9, "eigenvalue 0.9 (decays with time constant 0.9491 s)"),
        (1.0, "eigenvalue 1 (an offset that stays)"),
        (1.1, "eigenvalue 1.1 (grows with time constant 1.049 s)"),
        (0.0, "eigenvalue 0 (gone after a step)"),
        (-0.5, "eigenvalue -0.5 (period 0.2 s, decays with time constant 0.1443 s)"),
    ],
)
def test_a_factor_by_step_is_read_as_one(A: float, said: str) -> None:
    (mode,) = unobservable_modes(MeasuredSystem(np.diag([A, 0.3]), [[0.0, 1.0]], step=0.1))
    assert mode.explain() == f"{said}, in the states x1 (1)"
    assert mode.decays == (abs(A) < 1.0)


@settings(deadline=None)
@given(seed=st.integers(0, 2**32 - 1), step=st.floats(1e-3, 1.0))
def test_modes_from_step_to_step_are_those_of_continuous_time(seed: int, step: float) -> None:
    """The exponential of A has the eigenvectors of A, and its factors have the time constants of A."""
    random = np.random.default_rng(seed)
    hidden, shift = random.normal(size=(2, 2)), random.normal(size=(2, 2))
    A = block_diag(hidden, [[-1.0]]) / max(1.0, float(np.linalg.norm(hidden)))
    A[:2, 2:] = shift[:, :1]
    C = [[0.0, 0.0, 1.0]]
    continuous = unobservable_modes(MeasuredSystem(A, C))
    sampled = unobservable_modes(MeasuredSystem(scipy.linalg.expm(step * A), C, step=step))
    assert len(continuous) == len(sampled)
    found, expected = (np.sort_complex([mode.exponent for mode in modes]) for modes in (sampled, continuous))
    np.testing.assert_allclose(found, expected, rtol=1e-6, atol=1e-9 / step)


@pytest.mark.parametrize("turned", [False, True])
def test_a_chain_of_integrators_behind_the_sensor_is_found_whole(turned: bool) -> None:
    shift = np.diag(np.ones(3), 1)
    turn = np.linalg.qr(np.random.default_rng(3).normal(size=(4, 4)))[0] if turned else np.eye(4)
    system = MeasuredSystem(turn @ shift @ turn.T, np.array([[0.0, 0.0, 0.0, 1.0]]) @ turn.T)
    modes = unobservable_modes(system)
    assert [(m.eigenvalue, m.chain) for m in modes] == [(0.0, 1), (0.0, 2), (0.0, 3)]
    for i, mode in enumerate(modes):
        assert np.abs(turn.T @ mode.vector)[i] == pytest.approx(np.linalg.norm(mode.vector), rel=1e-9)


def test_the_printed_unknown_input_observer_has_rank_four_and_the_corrected_one_six() -> None:
    """Bouchama 2024, (3.88)-(3.89): printed with a 1 in column 3 of row 2; the observability ranks are independently
    measured.
    """
    drag = (32.4 + 1.65287 * 13.9) / 90e3
    A = np.zeros((6, 6))
    A[0, 1] = A[0, 2] = A[2, 4] = A[3, 5] = 1.0
    A[1, 1] = -drag
    names = ["position", "odometer", "slip_speed", "disturbance", "slip_rate", "disturbance_rate"]
    for column, rank in ((2, 4), (3, 6)):
        matrix = A.copy()
        matrix[1, column] = 1.0
        modes = unobservable_modes(MeasuredSystem(matrix, np.eye(6)[:2], states=names))
        assert 6 - len(modes) == rank
        assert [list(m.taking_part) for m in modes] == [["disturbance"], ["disturbance_rate"]][: 6 - rank]


def test_slow_modes_beside_a_fast_one_are_not_lost() -> None:
    """An observability matrix holds powers of A: here 1e-12 beside 1, which a rank test takes for zero."""
    system = MeasuredSystem(np.diag([-1000.0, -1e-3, -2e-3]), [[1.0, 1.0, 1.0]])
    assert unobservable_modes(system) == []


# -- the train ------------------------------------------------------------------------------------------------------


def test_an_odometer_alone_never_shows_where_the_train_is() -> None:
    blind = measured_plant(Locomotive(), *steady_train(13.9), continuous=["wheel_speed"])
    with pytest.raises(
        UnobservableError, match=r"locomotive: .*eigenvalue 0 1/s \(an offset that stays\).*train_position \(1\)"
    ) as error:
        require_detectable(blind)
    assert [list(m.taking_part) for m in error.value.modes] == [["train_position"]]
    require_observable(
        measured_plant(Locomotive(), *steady_train(13.9), continuous=["wheel_speed"], sampled=["position"])
    )


def test_an_observer_model_is_linearised_where_it_is_asked() -> None:
    system = measured_model(pendulum(), x0=[np.pi / 3.0, 0.0])
    np.testing.assert_allclose(system.A, [[0.0, 1.0], [-0.5, -0.2]], atol=1e-15)  # -cos(angle), -damping
    assert system.C_continuous.shape == (0, 2)
    require_observable(system)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"A": np.ones((2, 3)), "C_sampled": [[1.0, 0.0]]}, r"A has shape \(2, 3\), expected \(n, n\)"),
        ({"A": np.eye(2), "C_sampled": [[1.0, 0.0, 0.0]]}, r"C_sampled has shape \(1, 3\), expected 2 columns"),
        ({"A": np.eye(2)}, r"nothing is measured"),
        ({"A": np.eye(2), "C_continuous": [[np.nan, 0.0]]}, r"C_continuous must hold finite numbers"),
        ({"A": np.eye(2), "C_continuous": [[1.0, 0.0]], "scales": [1.0, 0.0]}, r"scales positive"),
        ({"A": np.eye(2), "C_continuous": [[1.0, 0.0]], "states": ["a"]}, r"1 state names, 2 scales; expected 2"),
    ],
)
def test_wrong_matrices_are_named(arguments: dict, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        MeasuredSystem(**arguments, name="train")


def test_wrong_names_are_named() -> None:
    with pytest.raises(ValueError, match=r"locomotive: output 'speeed' is unknown; did you mean speed"):
        measured_plant(Locomotive(), continuous=["speeed"])
    with pytest.raises(ValueError, match=r"pendulum: measurement 'rate' is unknown; known: angle"):
        measured_model(pendulum(), ["rate"])
