"""Levant's differentiator: its gains in both readings of Table 1.1, accuracy by order, exponents of the error with
noise.
"""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np
from shared.sheet import Sheet

from fmu_observer.formulas.differentiation.differentiator_gains import LEVANT_GAINS
from fmu_observer.observers.generic.differentiators import LevantDifferentiator
from plant_models.hybrid import Runtime

STEP = 1e-3  # [s]
TABLE_1_1 = ("1.1", "1.1 1.5", "1.1 2.12 2", "1.1 3.06 4.18 3", "1.1 4.57 9.3 10.03 5", "1.1 6.75 20.26 32.24 23.72 7")
READING = (
    "no errors are published. At a step of 0.1 ms an independent implementation gave 0, 5e-5, 4e-4 for n = 2, and with "
    "the "
    "gains in the printed order 0.20, 0.59, 1.41"
)
EXPONENT = "Theorem 3 gives the order of the error; two decades of noise, and constants that differ between their ends"


def followed(order: int, signal: np.ndarray, step: float = STEP, bound: float = 1.0) -> np.ndarray:
    """Estimates after each step, the signal held over it, shape (len(signal), n + 1)."""
    runtime = Runtime(LevantDifferentiator(order))
    runtime.p[:] = bound, step
    runtime.start(0.0)
    rows = np.empty((len(signal), order + 1))
    for k, value in enumerate(signal):
        runtime.u[0] = value
        runtime.advance((k + 1) * step)
        rows[k] = runtime.x
    return rows


def as_printed(order: int, signal: np.ndarray) -> np.ndarray:
    """The same with gain i of Table 1.1 in equation i, which no part of the package offers."""
    z, powers = np.zeros(order + 1), np.arange(order, -1, -1) / (order + 1)
    rows = np.empty((len(signal), order + 1))
    for k, value in enumerate(signal):
        s = z[0] - value
        z = z + STEP * (-np.array(LEVANT_GAINS[order]) * np.abs(s) ** powers * np.sign(s) + np.append(z[1:], 0.0))
        rows[k] = z
    return rows


def sine_errors(rows: np.ndarray, step: float = STEP, last: float = 6.0) -> np.ndarray:
    """Largest errors of sin and its derivatives over the last seconds, shape (n + 1,)."""
    t = step * np.arange(1, len(rows) + 1)
    exact = np.sin(t[:, None] + 0.5 * np.pi * np.arange(rows.shape[1]))
    return np.asarray(np.abs(rows - exact)[t > t[-1] - last].max(axis=0))


def exponents(order: int) -> np.ndarray:
    """Slopes of log error over log noise between 1e-4 and 1e-2, for the slowest noise that cannot be told from the
    signal.
    """
    step, t, sizes = 4e-4, 4e-4 * np.arange(30_000), (1e-4, 1e-2)
    noisy = (np.sin(t) + eps * np.cos(eps ** (-1.0 / (order + 1)) * t) for eps in sizes)
    low, high = (sine_errors(followed(order, signal, step, 2.0), step) for signal in noisy)
    return np.asarray(np.log(high / low) / np.log(sizes[1] / sizes[0]))


def main() -> None:
    """Accuracy by order and reading, and the exponents."""
    sheet = Sheet(__file__, "Levant's differentiator", "Bouchama 2024, (1.14), Theorem 3, Table 1.1")
    for order, printed in enumerate(TABLE_1_1):
        sheet.add(
            f"gains of order {order}, the last equation first",
            "1",
            printed,
            " ".join(f"{g:g}" for g in LEVANT_GAINS[order]),
        )
    signal = np.sin(STEP * np.arange(20_000))
    figure, axis = plt.subplots(figsize=(6, 4), layout="constrained")
    for order in range(1, 6):
        found = sine_errors(followed(order, signal))
        for i in sorted({1, order}):
            name = f"error of derivative {i} of sin(t), order {order}, reversed gains, step 1 ms"
            # Chatter about zero error: its size is steady to some ten percent.
            sheet.add(name, "1", None, found[i], READING, repeats=0.5)
        axis.semilogy(range(order + 1), np.maximum(found, 1e-8), "o-", label=f"order {order}")
    for order in (2, 3):
        wrong = sine_errors(as_printed(order, signal))
        for i in range(order + 1):
            name = f"error of derivative {i} of sin(t), order {order}, gains in the printed order"
            sheet.add(name, "1", None, wrong[i], READING, repeats=0.9)  # it does not settle
        axis.semilogy(range(order + 1), wrong, "x--", label=f"order {order}, printed order")
    for order in (1, 2):
        for i, exponent in enumerate(exponents(order)):
            published = (order + 1 - i) / (order + 1)
            sheet.add(
                f"exponent of the noise, derivative {i}, order {order}",
                "1",
                published,
                exponent,
                EXPONENT,
                repeats=0.05,
            )
    axis.set(xlabel="derivative", ylabel="largest error, last 6 s [1]")
    axis.set_xticks(range(6))
    sheet.finish(figure, axis)


if __name__ == "__main__":
    main()
