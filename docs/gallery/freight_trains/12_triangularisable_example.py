"""First academic example: convergence of the Takagi-Sugeno observer, premise modes, noise, against the CDO (2.42)."""

from __future__ import annotations

from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from academic import EXAMPLES, STOP, final_quarter, followed
from shared.runner import Together, errors, sampling, unless_rounding
from shared.sheet import Sheet

from fmu_observer.models.exhibits.four_state_example import triangularisable_chain
from fmu_observer.observers.generic.sampled import ExponentialGain

NAME = "triangularisable_example"
CHAIN_GAINS = {"theta": 1.0, "high_gain": (0.4034, 0.0, 0.0, 0.4020, 0.0407, 0.0, 0.0, 0.0404)}  # printed, row by row
CURVES = (
    "published as curves, sampling pattern not available. An independent implementation gave 0.088, 0.018, 0.0032 at "
    "0.5, "
    "1, 2 s with a peak of 43, and for (2.42) 8.0, 4.6, 2.2 with a peak of 10.5"
)
PREMISES = (
    "published: the error goes to zero. That is so with estimated premises only; printed are weights frozen at the "
    "samples. An "
    "independent implementation gave 1.45 frozen and 0.90 live, at another sampling pattern"
)
NOISY = (
    "published as curves: with noise up to 0.3 an independent implementation gave 18 to 21 and, for (2.42), 1.1; "
    "K_i2 is 2600"
)
RUNS = {f"Takagi-Sugeno, {premise} premises": premise for premise in ("estimated", "live", "frozen")}


def chain(**options: Any) -> tuple[np.ndarray, np.ndarray]:
    """Times and errors of the observer (2.42), both outputs sampled."""
    plant, gap, loss = EXAMPLES[NAME]

    def seen(values: Any, noise: Any) -> dict[str, Any]:
        return {"drive": values["total_drive"], "sample_x1": values["x1"], "sample_x2": values["x2"] + noise}

    pair = Together(plant(), ExponentialGain(triangularisable_chain()), seen, **CHAIN_GAINS)
    return errors(pair, STOP, {"sample": sampling(gap, STOP, 0, loss)}, **options)


def main() -> None:
    """Transients, what premises leave, what noise does."""
    sheet = Sheet(__file__, "First academic example, triangularisable", "Bouchama 2024, section 2.5.1, Figures 2.1-2.3")
    figure, axis = plt.subplots(figsize=(8, 4), layout="constrained")
    runs = {label: followed(NAME, premise) for label, premise in RUNS.items()} | {"CDO (2.42)": chain()}
    for label, (t, found) in runs.items():
        size = np.linalg.norm(found, axis=1)
        axis.semilogy(t, size + 1e-12, lw=0.8, label=label)
        if "live" not in label and "frozen" not in label:
            sheet.add(f"peak of the error norm, {label}", "1", None, size.max(), CURVES)
            for end in (0.5, 1.0, 2.0):
                value = size[np.searchsorted(t, end - 1e-6)]
                sheet.add(f"error norm at {end:g} s, {label}", "1", None, value, CURVES, repeats=0.05)
    for label in RUNS:
        value = unless_rounding(final_quarter(*runs[label])[0], 1e-10)
        published = 0.0 if "frozen" in label else None
        sheet.add(f"largest error norm, 15 to 20 s, {label}", "1", published, value, PREMISES, repeats=0.05)
    noise = {"noise": 0.3, "hold": 0.01}
    for label, (t, found) in {
        "Takagi-Sugeno, estimated premises": followed(NAME, "estimated", **noise),
        "CDO (2.42)": chain(**noise),
    }.items():
        sheet.add(
            f"largest error norm, 15 to 20 s, noise up to 0.3, {label}", "1", None, final_quarter(t, found)[0], NOISY
        )
    axis.set(xlabel="time [s]", ylabel="norm of the error [1]")
    sheet.finish(figure, axis)


if __name__ == "__main__":
    main()
