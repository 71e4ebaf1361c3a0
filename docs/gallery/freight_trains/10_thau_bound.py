"""Thau's condition: the printed bound (1.8), the valid one, and a nonlinearity between the two that makes the error
grow.
"""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np
from shared.sheet import Sheet

from fmu_observer.models.known_models import find_model
from fmu_observer.observers.generic.continuous import Thau

UNSAFE = "(1.8) has the wrong eigenvalues; an independent implementation gave 7.12 for it and 0.438 for the valid bound"
GROWS = "below the printed bound, which should exclude it"


def main() -> None:
    """Both bounds for the gain (4, 4), and the growth of the error where phi has a constant slope."""
    sheet = Sheet(__file__, "Thau's condition, printed and valid", "Bouchama 2024, (1.8), Theorem 1")
    observer = Thau("pendulum")
    values = next(observer.findings()).numbers
    sheet.add("Lipschitz constant allowed, gain (4, 4)", "1/s", values["printed_bound"], values["bound"], UNSAFE)
    sheet.add("the same in the best scaled coordinates", "1/s", None, values["scaled_bound"], UNSAFE)
    model = find_model("pendulum")
    gain = np.reshape(observer.start_parameters()[: model.order], (model.order, -1))
    slopes = np.linspace(0.0, 9.0, 901)
    # phi = (0, s x1), whose Lipschitz constant is s: the error moves with A - L C + [[0, 0], [s, 0]].
    growth = np.array([np.linalg.eigvals(model.A - gain @ model.C + [[0.0, 0.0], [s, 0.0]]).real.max() for s in slopes])
    sheet.add("slope of phi from which the error grows", "1/s", None, slopes[np.argmax(growth > 0.0)], GROWS)
    figure, axis = plt.subplots(figsize=(6, 4), layout="constrained")
    axis.plot(slopes, growth, "k")
    axis.axhline(0.0, color="0.6", lw=0.8)
    axis.axvline(values["bound"], color="tab:green", label="valid bound")
    axis.axvline(values["printed_bound"], color="tab:red", ls="--", label="printed bound")
    axis.set(xlabel="Lipschitz constant of phi = (0, s x1) [1/s]", ylabel="growth of the error [1/s]")
    sheet.finish(figure, axis, fontsize=8.5)


if __name__ == "__main__":
    main()
