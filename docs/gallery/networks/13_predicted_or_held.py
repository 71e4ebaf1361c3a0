"""What the predictions are worth, between packets and over the delay, as a map over both."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np
from arm import LINK_ANGLE, PRINTED, Cell, arm_errors
from shared.sheet import Sheet

INTERVALS = (0.02, 0.05, 0.1, 0.15, 0.2)
DELAYS = (0.01, 0.05, 0.1, 0.15, 0.18)
HELD = {PRINTED: (1.2, 2.3, 3.2), LINK_ANGLE: (0.046, 0.11, 0.23)}  # independent, by interval 0.05, 0.1, 0.15 s
STEADY = (
    "not printed: largest error of the delayed state over the last 10 s, theta = 5; the largest over the four states"
)
NOISE = 1e-4  # [rad2], a hundredth of a radian
MAP = (
    "not printed: rms of the error of the link's angle now, sin(x2), theta = 5, measurements with noise of 0.01 rad; "
    "held means not predicted either"
)


def steady(model: str, between: str) -> np.ndarray:
    """Largest steady error of the delayed state at intervals 0.05, 0.1, 0.15 s."""
    cells = [Cell(interval, 0.15) for interval in (0.05, 0.1, 0.15)]
    errors = arm_errors(cells, model, predictors=0, between=between, stop=60.0)  # type: ignore[arg-type]
    return np.asarray(np.abs(errors.delayed[:, errors.t >= 50.0]).max(axis=(1, 2)))


def main() -> None:
    """Steady errors without the output predictor, and the map."""
    sheet = Sheet(__file__, "Predicted or held", "Hann 2014, (2.16), with and without its predictors")
    for model, words in ((PRINTED, "sin(x3)"), (LINK_ANGLE, "sin(x2)")):
        for interval, held, kept, independent in zip(
            (0.05, 0.1, 0.15), steady(model, "held"), steady(model, "predicted"), HELD[model], strict=True
        ):
            where = f"interval {interval:g} s, {words}"
            sheet.add(f"steady error, output held, {where}", "rad/s", None, held, STEADY, independent=independent)
            sheet.add(f"steady error, output predicted, {where}", "rad/s", None, kept, STEADY, repeats=0.5)
    cells = [Cell(interval, delay) for delay in DELAYS for interval in INTERVALS]
    late = slice(-1000, None)
    rms = [
        np.sqrt((arm_errors(cells, LINK_ANGLE, stop=40.0, variance=NOISE, **kind).now[:, late, 1] ** 2).mean(axis=1))  # type: ignore[arg-type]
        for kind in ({"predictors": 0, "between": "held"}, {"predictors": 1, "between": "predicted"})
    ]
    gain = (rms[0] / rms[1]).reshape(len(DELAYS), len(INTERVALS))
    for i, delay in enumerate(DELAYS):
        held = float(rms[0].reshape(gain.shape)[i, 2])
        sheet.add(f"rms of the angle now, held, delay {delay:g} s, interval 0.1 s", "rad", None, held, MAP)
    at = gain[DELAYS.index(0.15), INTERVALS.index(0.1)]
    sheet.add("held over predicted at delay 0.15 s, interval 0.1 s", "1", None, float(at), MAP, repeats=0.1)
    sheet.add("held over predicted, the least of the map", "1", None, float(gain.min()), MAP, repeats=0.1)
    figure, axis = plt.subplots(figsize=(6, 4.5), layout="constrained")
    picture = axis.imshow(gain, origin="lower", aspect="auto", cmap="viridis")
    axis.set(
        xlabel="interval of the packets [s]",
        ylabel="delay [s]",
        title="rms error of the link's angle, held over predicted",
    )
    axis.grid(visible=False)
    axis.set_xticks(range(len(INTERVALS)), [f"{v:g}" for v in INTERVALS])
    axis.set_yticks(range(len(DELAYS)), [f"{v:g}" for v in DELAYS])
    for i in range(len(DELAYS)):
        for j in range(len(INTERVALS)):
            axis.text(j, i, f"{gain[i, j]:.2g}", ha="center", va="center", color="w", fontsize=8)
    figure.colorbar(picture, label="times")
    sheet.finish(figure)


if __name__ == "__main__":
    main()
