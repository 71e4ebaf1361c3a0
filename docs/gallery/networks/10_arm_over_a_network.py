"""The robot arm whose measurements come later than the next ones are sent: Fig. 2.3."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np
from arm import LINK_ANGLE, PRINTED, PUBLISHED_START, Cell, arm_errors
from shared.sheet import Sheet

from fmu_observer.models.known_models import find_model

STARTS = "the thesis shows a figure and prints no number; z(0) = 0, which it leaves open"
REACHED = "the error falls below 0.05 before the last distance s is zero, at 2 sqrt|s_3(0)|, s_3(0) = 2 - 0.15 * 94.7"


def main() -> None:
    """Eigenvalues of both readings, when the error is gone, and the reaching time."""
    sheet = Sheet(__file__, "A robot arm behind a network of two nodes", "Hann 2014, section 2.5, Fig. 2.3")
    figure, axis = plt.subplots(figsize=(7, 4.5), layout="constrained")
    for model, words, growth in ((PRINTED, "sin(x3), as printed", 0.67), (LINK_ANGLE, "sin(x2)", -0.43)):
        A = np.asarray(find_model(model).jacobian(np.zeros(4), np.zeros(1)), dtype=float)
        values = np.linalg.eigvals(A)
        fastest = float(values[np.argmax(values.imag)].real)
        why = "not printed: real part at rest; the arm of the printed equations ends in a limit cycle"
        sheet.add(f"growth of the fast mode, {words}", "1/s", None, fastest, why, independent=growth)
        for theta in (1.0, 5.0):
            errors = arm_errors([Cell(0.1, 0.15)], model, theta=theta)
            norm = np.abs(errors.now[0]).max(axis=1)
            settled = float(errors.t[norm > 0.05].max() + 0.01)
            axis.semilogy(errors.t, np.maximum(norm, 1e-7), label=f"{words}, theta {theta:g} 1/s")
            sheet.add(f"error below 0.05 from, {words}, theta {theta:g}", "s", None, settled, STARTS, independent=6.3)
    rate = find_model(LINK_ANGLE).flow(np.array(PUBLISHED_START), np.zeros(1))
    distance = np.abs(np.array(PUBLISHED_START) - 0.15 * rate).max()
    sheet.add("reaching time of the predictor", "s", None, 2.0 * float(np.sqrt(distance)), REACHED, independent=6.98)
    axis.set(xlabel="time [s]", ylabel="largest error of the state now", title="packet every 0.1 s, delay 0.15 s")
    sheet.finish(figure, axis)


if __name__ == "__main__":
    main()
