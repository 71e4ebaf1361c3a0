"""The law of the adaptive observers: estimates of a state and of unknown constants, the excitation these get, and the
covariance of both errors. Pure functions after Hann 2014, section 4; covariance, cap and holding are ours.

Sizes: n states, m unknown constants, q measurements. ``c`` is the innovation that acts, shape (q,), ``C xh - w`` with a
predicted output w, or ``C xh(t_k) - y`` held. With it

    ``d xh = A xh + B + Phi rhoh - inv(S) C' c + lambda d rhoh``, ``d rhoh = -H R H chi' c``
    ``d lambda = (A - inv(S) C' C) lambda + Phi``, ``d S = -mu S - S A - A' S + C' C``; what is carried is inv(S)
    ``d R = -R (chi' chi + forgetting floor I) R + forgetting R``

chi is what the innovation depends on the constants by. Published it is ``C lambda``, as if measurements were there
always. Sampled [ours], ``d chi = -C inv(S) C' chi``, ``chi = C lambda`` at a sample, lambda is driven by chi in place
of ``C lambda``, and ``d w`` gets ``(C lambda - chi) d rhoh``. Then ``xh - x - lambda (rhoh - rho)`` obeys the equations
of the observer that knows the constants, whatever the instants, and the constants those of least squares.

inv(R) is the filtered Gramian of chi, plus the floor: without excitation R would grow without bound, with a
floor it never exceeds ``1 / floor``. H has a 1 for each constant that is learnt and a 0 for each that is held.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from plant_models.hybrid import Array, Signal, state, vector

_LARGEST_CLOSED = 3  # sizes whose smallest eigenvalue is given in closed form
_TINY = 1e-60  # keeps quotients and slopes finite where there is nothing yet
_GUARD = 1e-3  # of the least excitation
_NEARLY_ONE = 1.0 - 1e-15


class Sizes(NamedTuple):
    """Numbers of states n, unknown constants m and measurements q, and whether the sensitivity of the output is sampled
    like the output.
    """

    n: int
    m: int
    q: int
    sampled: bool = False

    @property
    def error(self) -> int:
        """Components of the error: states, constants, predicted outputs or held innovations."""
        return self.n + self.m + self.q


class Adaptation(NamedTuple):
    """What an adaptive observer carries beside its estimates.

    Args:
        R: adaptation gain, shape (m, m). sensitivity: lambda, shape (n, m). seen: chi, shape (q, m).
        inverse_S: shape (n, n).
        excitation: mean of ``chi' chi`` over the excitation window, shape (m, m). covariance: of the error
            of states, constants and predicted outputs (or held innovations), shape (n + m + q, n + m + q).
    """

    R: Array
    sensitivity: Array
    seen: Array
    inverse_S: Array
    excitation: Array
    covariance: Array


class Plant(NamedTuple):
    """The matrices at an instant.

    Args:
        A: shape (n, n). B: shape (n,). Phi: shape (n, m). C: shape (q, n), each row in units of its own weight. noise:
            intensity of the disturbances of states, constants and predicted outputs, a square matrix, or 0.
    """

    A: Array
    B: Array
    Phi: Array
    C: Array
    noise: Array = 0.0


class Gains(NamedTuple):
    """What acts on the state of the observer that knows the constants, ``inv(S) C'``, shape (n, q); on the constants,
    ``H R H chi'``, shape (m, q); on the state in all, shape (n, q); on the predicted output, shape (q, q).
    """

    state: Array
    constants: Array
    total: Array
    output: Array


def start_covariance(C: np.ndarray, deviations: Sequence[float], sizes: Sizes, predicts: bool) -> np.ndarray:
    """Covariance of the error at the start, where ``w = C xh`` and ``c = 0``, shape (n + m + q, n + m + q).

    Args:
        C: shape (q, n). deviations: of states and constants, shape (n + m,). sizes: see there. predicts: whether the
            output is predicted; else the innovation is held.
    """
    n, m, _q = sizes[:3]
    spread = np.zeros((sizes.error, n + m))
    spread[: n + m] = np.eye(n + m)
    if predicts:
        spread[n + m :, :n] = C
    return np.asarray(spread @ np.diag(np.square(deviations)) @ spread.T)


def adaptation_states(
    sizes: Sizes, covariance: np.ndarray, gain: float = 1.0, inverse_s: float = 1.0
) -> tuple[Signal, ...]:
    """The states of an `Adaptation`, in its order.

    Args:
        sizes: see there. covariance: at the start, see `start_covariance`. gain, inverse_s: R and
            inv(S) at the start, times identity; 1 as published.
    """
    n, m, q = sizes[:3]

    def triangle(name: str, first: np.ndarray, description: str) -> Signal:
        text = f"{description}, upper triangle row by row"
        return state(name, "1", first, text, shape=first.shape, symmetric=True)

    sampled = state("seen_sensitivity", "1", 0.0, "Sensitivity chi of the innovation", shape=(q, m))
    return (
        triangle("adaptation_gain", gain * np.eye(m), "Adaptation gain R"),
        state("sensitivity", "1", 0.0, "Sensitivity lambda of the state, row by row", shape=(n, m)),
        *((sampled,) if sizes.sampled else ()),
        triangle("inverse_s", inverse_s * np.eye(n), "Inverse of S, of which the state's gain is made"),
        triangle("mean_excitation", np.zeros((m, m)), "Mean Gramian of the excitation over its window"),
        triangle("error_covariance", covariance, "Covariance of the errors of state, constants and outputs"),
    )


def adaptation_of(x: Any, C: Array, sizes: Sizes) -> Adaptation:
    """An adaptation from its states.

    Args:
        x: states of the observer, by name. C: shape (q, n). sizes: see there.
    """
    seen = x.seen_sensitivity if sizes.sampled else C @ x.sensitivity
    return Adaptation(x.adaptation_gain, x.sensitivity, seen, x.inverse_s, x.mean_excitation, x.error_covariance)


def gains_of(adaptation: Adaptation, C: Array, learnt: Array) -> Gains:
    """The gains in force.

    Args:
        adaptation: see there. C: shape (q, n). learnt: 1 or 0 for each constant, shape (m,).
    """
    on_state = adaptation.inverse_S @ C.T
    mask = np.reshape(learnt, (-1, 1))
    on_constants = mask * (adaptation.R @ (mask * adaptation.seen.T))
    on_output = (C @ adaptation.sensitivity - adaptation.seen) @ on_constants
    return Gains(on_state, on_constants, on_state + adaptation.sensitivity @ on_constants, on_output)


def adaptation_flow(
    adaptation: Adaptation, plant: Plant, gains: Gains, error_drift: Array, mu: Array, p: Any, sizes: Sizes
) -> dict[str, Array]:
    """Derivatives of the states of an adaptation.

    Args:
        adaptation: see there. plant: matrices now. gains: in force. error_drift: see `error_drift`. mu: decay of S
            [1/s]. p: named tuple with `forgetting` [1/s], `gain_floor` and `excitation_time` [s]. sizes: see there.
    """
    R, L, seen, Z, E, V = adaptation
    A, C = plant.A, plant.C
    gramian = seen.T @ seen
    floor = p.forgetting * p.gain_floor * np.eye(sizes.m)
    FV = error_drift @ V
    return {
        "adaptation_gain": p.forgetting * R - R @ (gramian + floor) @ R,
        "sensitivity": A @ L - gains.state @ seen + plant.Phi,
        **({"seen_sensitivity": -(C @ gains.state) @ seen} if sizes.sampled else {}),
        "inverse_s": mu * Z + A @ Z + Z @ A.T - gains.state @ gains.state.T,
        "mean_excitation": (gramian - E) / p.excitation_time,
        "error_covariance": FV + FV.T + plant.noise,
    }


def error_drift(plant: Plant, gains: Gains, sizes: Sizes, predicts: bool) -> Array:
    """Matrix of the error ``(xh - x, rhoh - rho, w - y)``, or of ``(.., .., c)`` for a held innovation, between
    samples.

    Args:
        plant: matrices now. gains: in force. sizes: see there. predicts: whether the output is predicted.
    """
    n, m, q = sizes[:3]
    model = np.hstack([plant.A, plant.Phi])
    none = np.zeros((m, n + m))
    if predicts:
        free = np.vstack([model, none, plant.C @ model])
        free = np.hstack([free, np.zeros((n + m + q, q))])
        reads = np.hstack([plant.C, np.zeros((q, m)), -np.eye(q)])
        acts = np.vstack([gains.total, gains.constants, gains.output])
        return free - acts @ reads
    top = np.hstack([model, -gains.total])
    middle = np.hstack([none, -gains.constants])
    return np.vstack([top, middle, np.zeros((q, n + m + q))])


def _own_excitation(E: Array, size: int, guard: Array = _TINY) -> Array:
    """Excitation of each constant given the others, ``1 / diag(inv(E))``, shape (m,)."""
    if size == 1:
        return vector(E[0, 0])
    own = [E[i, i] + guard for i in range(size)]
    if size == 2:
        return vector(*(E[i, i] - E[0, 1] ** 2 / np.maximum(own[1 - i], _TINY) for i in range(2)))
    found = []
    for i, j, k in ((0, 1, 2), (1, 0, 2), (2, 0, 1)):
        others = np.maximum(own[j] * own[k] - E[j, k] ** 2, _TINY)
        shared = E[i, j] ** 2 * own[k] - 2.0 * E[i, j] * E[i, k] * E[j, k] + E[i, k] ** 2 * own[j]
        found.append(E[i, i] - shared / others)
    return vector(*found)


def learnt_constants(E: Array, least: Array, size: int) -> Array:
    """1 for each constant whose excitation is at least `least`, else 0, shape (m,).

    Args:
        E: mean Gramian, shape (m, m). least: excitation below which a constant is held; 0 for never. size: m.
    """
    found = _own_excitation(E, size, _GUARD * least + _TINY)
    return vector(*(np.where(least > 0.0, np.where(found[i] >= least, 1.0, 0.0), 1.0) for i in range(size)))


def smallest_eigenvalue(E: Array, size: int) -> Array:
    """Smallest eigenvalue of a symmetric matrix in closed form.

    Args:
        E: shape (size, size). size: 1 to 3.

    Raises:
        ValueError: the size is larger.
    """
    if size > _LARGEST_CLOSED:
        raise ValueError(f"The smallest eigenvalue is known in closed form up to size {_LARGEST_CLOSED}, got {size}.")
    mean = sum((E[i, i] for i in range(size)), 0.0) / size
    if size == 1:
        return mean
    if size == 2:
        return mean - np.sqrt(0.25 * (E[0, 0] - E[1, 1]) ** 2 + E[0, 1] * E[0, 1] + _TINY)
    off = E[0, 1] ** 2 + E[0, 2] ** 2 + E[1, 2] ** 2
    spread = np.sqrt((sum((E[i, i] - mean) ** 2 for i in range(3)) + 2.0 * off) / 6.0 + _TINY)
    unit = (E - mean * np.eye(3)) / spread
    half = 0.5 * (
        unit[0, 0] * (unit[1, 1] * unit[2, 2] - unit[1, 2] ** 2)
        - unit[0, 1] * (unit[0, 1] * unit[2, 2] - unit[1, 2] * unit[0, 2])
        + unit[0, 2] * (unit[0, 1] * unit[1, 2] - unit[1, 1] * unit[0, 2])
    )
    angle = np.arccos(np.clip(half, -_NEARLY_ONE, _NEARLY_ONE)) / 3.0
    return mean + 2.0 * spread * np.cos(angle + 2.0 * np.pi / 3.0)
