"""The pendulum plant against its closed forms."""

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.special import ellipj, ellipk

from plant_models.exhibits import Pendulum
from plant_models.hybrid import Runtime, scalar_names


def swing(preset: str | None, seconds: float, **parameters: float) -> np.ndarray:
    """Angle and rate after some seconds."""
    system = Pendulum()
    runtime = Runtime(system)
    runtime.x[:], runtime.p[:] = system.start_state(preset), system.start_parameters(preset)
    for name, value in parameters.items():
        runtime.p[scalar_names(system.parameter_signals).index(name)] = value
    runtime.start(0.0)
    runtime.advance(seconds)
    return np.array(runtime.update_outputs())


@pytest.mark.parametrize("seconds", [0.5, 2.0, 7.3])
def test_without_damping_it_swings_as_the_elliptic_functions_say(seconds: float) -> None:
    """From rest at 1 rad: ``sin(angle / 2) = k sn(K + t, k)``, ``k = sin(1 / 2)``."""
    m = np.sin(0.5) ** 2
    exact = 2.0 * np.arcsin(np.sin(0.5) * ellipj(ellipk(m) + seconds, m)[0])
    assert swing(None, seconds, damping=0.0)[0] == pytest.approx(exact, abs=1e-10)  # Runge-Kutta at 5 ms: h^4


def test_at_small_angles_it_is_linear() -> None:
    exact = expm(np.array([[0.0, 1.0], [-1.0, -0.2]]) * 3.0) @ [0.05, 0.0]
    assert swing("small", 3.0) == pytest.approx(exact, abs=0.05**3)  # sin(x) leaves a sixth of the cube


def test_a_torque_holds_it_and_rest_stays_at_rest() -> None:
    system = Pendulum()
    held = system.state_derivative(0.0, np.array([0.7, 0.0]), np.array([np.sin(0.7)]), system.start_parameters())
    assert held.tolist() == [0.0, 0.0]
    assert swing("rest", 5.0).tolist() == [0.0, 0.0]
