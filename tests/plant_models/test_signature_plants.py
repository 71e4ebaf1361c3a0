"""Plants of the examples on inversion of signatures, against closed forms and the numbers of the specification."""

from __future__ import annotations

import numpy as np
import pytest
import scipy

from plant_models.exhibits import BrakedOscillator, EcoliCulture, GasPhaseReaction, ThreeStateCascade
from plant_models.exhibits.ecoli_culture import HOUR
from plant_models.exhibits.noisy_plant import NoisyPlant
from plant_models.exhibits.oscillators import Variant
from plant_models.hybrid.integration import rk4_step


def solved(
    plant: NoisyPlant, times: list[float], start: tuple[float, ...] | None = None, **values: float
) -> np.ndarray:
    """States at these times by an adaptive solver, shape (n, times)."""
    p = plant.unpack_parameters(plant.start_parameters())._replace(**values)
    x0 = plant.start_state()[: len(plant.moving)] if start is None else start
    found = scipy.integrate.solve_ivp(
        lambda _t, x: plant.rates(x, p),
        (0.0, times[-1]),
        x0,
        t_eval=times,
        rtol=1e-9,
        atol=1e-12,
        method="LSODA",
    )
    return np.asarray(found.y)


def test_the_reaction_is_its_closed_form() -> None:
    x = solved(GasPhaseReaction(), [1.0, 10.0])
    times = np.array([1.0, 10.0])
    np.testing.assert_allclose(x[0], 2.5 / (1.0 + 2.0 * 0.15 * 2.5 * times), rtol=1e-7)  # tolerance of the solver
    np.testing.assert_allclose(x[0] + 2.0 * x[1], 3.5, rtol=1e-12)


def test_the_culture_has_the_numbers_of_the_specification_and_stops_where_glycerol_ends() -> None:
    x = solved(EcoliCulture("as_published"), [5.0 * HOUR, 7.0 * HOUR])
    assert x[:, 0] == pytest.approx([0.531, 1.423, 0.159], abs=5e-4)  # three digits given
    assert x[:, 1] == pytest.approx([1.321, 0.459, 0.405], abs=5e-4)
    late = {}
    for kind in ("clamped", "as_published"):
        plant, x = EcoliCulture(kind), np.array([0.05, 2.0, 0.01])  # type: ignore[arg-type]
        p = plant.unpack_parameters(plant.start_parameters())
        for _ in range(400):  # 8 h in steps of 72 s; an adaptive solver is long at the end of the glycerol
            x = rk4_step(lambda _t, z, plant=plant, p=p: plant.rates(z, p), 0.0, 72.0, x)
        late[kind] = x[1]
    rest = -0.06 * 0.21 / (0.75 * 0.49 + 0.21)  # where shrinking gives back what maintenance takes: dS = 0
    assert late["as_published"] == pytest.approx(rest, rel=1e-3)
    assert abs(late["clamped"]) < 0.01  # the overshoot of one step


def test_light_changes_little_with_glycerol() -> None:
    plant = EcoliCulture()
    p = plant.unpack_parameters(plant.start_parameters())
    light = [plant.measured(plant.named(np.array([0.5, S, 0.15])), p)[1] for S in (1.5 - 1e-4, 1.5 + 1e-4)]
    scale = float(p.light_yield * p.growth_rate * p.inducer / (p.inducer + p.half_induction) * 0.5 * 0.15)
    assert (light[1] - light[0]) / 2e-4 / scale == pytest.approx(0.02465, abs=5e-6)  # digits given


def test_the_limit_cycle_of_the_oscillator_fits_the_printed_set() -> None:
    times = list(np.linspace(100.0, 105.0, 500))
    for braking, amplitudes in ((0.1, (0.89, 2.68)), (2.25, (0.89, 3.27))):
        x = solved(BrakedOscillator(), times, braking=braking)
        assert np.abs(x[1]).max() == pytest.approx(amplitudes[1], abs=0.02)  # digits given, and a grid of 10 ms
        if braking < 1.0:
            assert np.abs(x[0]).max() == pytest.approx(amplitudes[0], abs=0.01)
    now = BrakedOscillator().named(np.array([0.5, 2.0]))
    variants: tuple[tuple[Variant, float], ...] = (("speed", 2.0), ("root", 0.5))
    assert all(float(BrakedOscillator(variant).measured(now, None)[0]) == y for variant, y in variants)


def test_the_last_state_of_the_cascade_is_a_ramp_and_the_others_follow() -> None:
    x = solved(ThreeStateCascade(), [0.46, 1.0])
    np.testing.assert_allclose(x[2], 0.7 + 5.0 * np.array([0.46, 1.0]), rtol=1e-9)
    e, t = 0.07, np.array([0.46, 1.0])
    risen = 0.7 * t + 2.5 * t**2  # of dx2 = x3 (1 + e x2): 1 + e x2 grows as exp(e times the integral of x3)
    np.testing.assert_allclose(x[1], ((1.0 - 2.7 * e) * np.exp(e * risen) - 1.0) / e, rtol=1e-6)


def test_unknown_variants_are_refused() -> None:
    with pytest.raises(ValueError, match="unknown variant 'odd'"):
        BrakedOscillator("odd")  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="unknown glycerol 'odd'"):
        EcoliCulture("odd")  # type: ignore[arg-type]
