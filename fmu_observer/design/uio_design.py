"""Model matrices and gain design of the discrete unknown-input observer. Plain NumPy and SciPy, no hybrid system.

The observer itself needs none of this at run time: its gains are parameters, and these functions say where their start
values come from and give new ones for other sampling periods.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from fmu_observer.design.noise_covariance import process_covariance


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


def uio_matrices(mass: float, drag_slope: float) -> tuple[np.ndarray, np.ndarray]:
    """Continuous model of (3.88)-(3.89) with the slip disturbance in the right column of the second row.

    State ``[p, y, d1, d2, d1', d2']``: position, odometer speed, slip speed ``v - y``, acceleration disturbance, and
    their rates. The print has the 1 of row 2 in column 3; with it in column 4 the printed A_d, B_d come out and the
    pair is observable.

    Args:
        mass: train mass [kg]. drag_slope: ``(b + c v) / M`` at the speed of linearisation [1/s].

    Returns:
        A of shape (6, 6) and B of shape (6,), input in newtons.
    """
    A = np.zeros((6, 6))
    A[0, 1] = A[0, 2] = A[1, 3] = A[2, 4] = A[3, 5] = 1.0
    A[1, 1] = -drag_slope
    B = np.zeros(6)
    B[1] = 1.0 / mass
    return A, B


def discretise(A: np.ndarray, B: np.ndarray, period: float) -> tuple[np.ndarray, np.ndarray]:
    """Zero-order-hold discretisation: ``A_d`` of shape (n, n) and ``B_d`` of shape (n,) for a period [s].

    Args:
        A: shape (n, n). B: shape (n, m).
    """
    n = len(B)
    block = np.zeros((n + 1, n + 1))
    block[:n, :n], block[:n, n] = A, B
    exponential = scipy.linalg.expm(block * period)
    return exponential[:n, :n], exponential[:n, n]


def uio_gains(covariances: UioCovariances, drag_slope: float) -> tuple[np.ndarray, np.ndarray]:
    """Steady-state Kalman gains of the two channels, each at its own sampling interval.

    The model splits: the odometer sees (y, d2, d2') whatever the balises do, and the balises add (p, d1, d1'). Each
    channel is a filter for white noise on its second disturbance derivative; the odometer one every `odometer_period`,
    the balise one every `balise_gap`. The joint error is then block triangular, stable when both channels are.

    Args:
        covariances: what to design for. drag_slope: ``(b + c v) / M`` [1/s].

    Returns:
        Odometer gain and balise gain, each of shape (6,) in the order of the whole state, to be multiplied by
        estimate minus measurement and subtracted.
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
