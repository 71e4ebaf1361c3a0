"""A plant and an observer of it as one differential equation, and an observer fed sample by sample: references for the
tests.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.integrate import solve_ivp

from fmu_observer.models.observer_model import ObserverModel
from fmu_observer.observers.model_observer import ModelObserver
from fmu_observer.observers.parameter_values import parameter_values
from plant_models.hybrid import Runtime, scalar_names


def joint_errors(
    observer: ModelObserver,
    start: np.ndarray,
    times: list[float],
    torque: Callable[[float], float] = np.sin,
    **gains: object,
) -> np.ndarray:
    """Estimate minus state of the observer's own model at the times, shape (len(times), n); measurements are
    continuous.
    """
    model, n = observer.model, observer.model.order
    p = parameter_values(observer, gains)

    def flow(t: float, x: np.ndarray) -> np.ndarray:
        known = np.array([torque(t)])
        u = np.concatenate([known, model.measured(x[:n])])
        return np.concatenate([model.flow(x[:n], known), observer.state_derivative(t, x[n:], u, p)])

    first = np.concatenate([start, observer.start_state()])
    solution = solve_ivp(flow, (0.0, max(times)), first, method="DOP853", rtol=1e-12, atol=1e-14, t_eval=times)
    return np.asarray(solution.y[n:] - solution.y[:n]).T


def exact_states(model: ObserverModel, start: np.ndarray, torques: np.ndarray, period: float) -> np.ndarray:
    """States of the model at the samples, inputs held in between, by an adaptive solver, shape (len(torques) + 1,
    n).
    """
    states = [np.asarray(start, dtype=float)]
    for torque in torques:
        known = np.array([torque])
        whole = solve_ivp(lambda _t, x, u=known: model.flow(x, u), (0.0, period), states[-1], rtol=1e-12, atol=1e-14)
        states.append(whole.y[:, -1])
    return np.array(states)


def sampled_run(
    observer: ModelObserver, torques: np.ndarray, measured: np.ndarray, period: float, **parameters: float
) -> np.ndarray:
    """Whole states of a periodic observer after each sample, shape (len(measured), k).

    Args:
        torques: held between the samples, one fewer than samples. measured: at the samples. period: between them [s].
    """
    runtime = Runtime(observer)
    names = scalar_names(observer.parameter_signals)
    for name, value in ({"sample_period": period} | parameters).items():
        runtime.p[names.index(name)] = value
    runtime.u[1] = measured[0]
    runtime.start(0.0)
    rows = [runtime.x.copy()]
    for k, torque in enumerate(torques):
        runtime.u[:2] = torque, measured[k + 1]
        runtime.advance((k + 1) * period)
        rows.append(runtime.x.copy())
    return np.array(rows)
