"""The design of the gains that the unknown-input observer ships with."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy


@dataclass(frozen=True)
class UioCovariances:
    """What the gains are designed for [ours: the thesis prints no gains and no covariances].

    Attributes:
        slip_noise: spectral density of the white second derivative of the slip speed d1 [m2/s5].
        disturbance_noise: spectral density of the white second derivative of the acceleration disturbance d2 [m2/s7].
        odometer_noise: variance of an odometer reading [m2/s2].
        balise_noise: variance of a balise position [m2].
        odometer_period: sampling period of the odometer [s].
        balise_gap: gap between balises the balise gains are designed for [s].
    """

    slip_noise: float = 0.1
    disturbance_noise: float = 0.1
    odometer_noise: float = 0.05**2
    balise_noise: float = 0.1**2
    odometer_period: float = 0.1
    balise_gap: float = 1.0


def uio_gains(covariances: UioCovariances, drag_slope: float) -> tuple[np.ndarray, np.ndarray]:
    """Steady-state Kalman gains of the two channels, each at its own sampling interval.

    The model splits: the odometer sees (y, d2, d2') whatever the balises do, and the balises add (p, d1, d1'). Each
    channel is a filter for white noise on its second disturbance derivative; the odometer one every `odometer_period`,
    the balise one every `balise_gap`. The joint error is then block triangular, stable when both channels are.
    """
    shift = np.diag([1.0, 1.0], 1)
    odometer = shift - np.diag([drag_slope, 0.0, 0.0])
    K_odometer, K_balise = np.zeros(6), np.zeros(6)
    K_odometer[[1, 3, 5]] = _channel_gain(
        odometer, covariances.disturbance_noise, covariances.odometer_noise, covariances.odometer_period
    )
    K_balise[[0, 2, 4]] = _channel_gain(shift, covariances.slip_noise, covariances.balise_noise, covariances.balise_gap)
    return K_odometer, K_balise


def _channel_gain(A: np.ndarray, density: float, variance: float, interval: float) -> np.ndarray:
    """Filter gain ``P C' / (C P C' + R)`` of a chain of three, white noise into its last state, first state
    measured.
    """
    C = np.array([[1.0, 0.0, 0.0]])
    transition, process = scipy.linalg.expm(A * interval), process_covariance(A, np.diag([0.0, 0.0, density]), interval)
    P = scipy.linalg.solve_discrete_are(transition.T, C.T, process, np.array([[variance]]))
    return np.asarray((P @ C.T)[:, 0] / (C @ P @ C.T + variance)[0, 0])


def process_covariance(A: np.ndarray, density: np.ndarray, period: float) -> np.ndarray:
    """Covariance that white noise leaves in ``dx = A x + w`` over one period (Van Loan, IEEE TAC 23 (1978) 395).

    Args:
        A: shape (n, n). density: spectral density of w, shape (n, n) [x2/s]. period: [s].

    Returns:
        ``integral of exp(A s) density exp(A' s) from 0 to period``, shape (n, n), symmetric.
    """
    n = len(A)
    block = np.zeros((2 * n, 2 * n))
    block[:n, :n], block[:n, n:], block[n:, n:] = -A, density, A.T
    exponential = scipy.linalg.expm(block * period)
    covariance = exponential[n:, n:].T @ exponential[:n, n:]
    return np.asarray(0.5 * (covariance + covariance.T))
