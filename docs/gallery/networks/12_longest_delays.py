"""How long a delay one, two and three predictors survive, and how long an interval between packets."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np
from arm import LINK_ANGLE, PRINTED, Cell, arm_errors
from shared.sheet import Sheet

from fmu_observer.certificates.printed_bounds.network_bounds import exact_predictor_delay
from fmu_observer.models.known_models import find_model
from fmu_observer.observers.generic.delayed.delayed_state_observer import DelayedStateObserver

SURVIVED = {1: (0.19, 0.20), 2: (0.36, 0.39), 3: (0.54, 0.57)}  # independent: last that works, first that fails
NOT_PRINTED = "the thesis prints no limit; the independent number is the last of a grid that works"
GRIDS = {1: (0.185, 0.19, 0.195, 0.2), 2: (0.345, 0.36, 0.375, 0.39), 3: (0.525, 0.54, 0.555, 0.585)}
LOST = 0.05  # [1]; largest error over the last 10 s of 60 s
THEORY = (
    "tau_MAD with sigma > 0, 1 / L without it; the bounds are sufficient: the delay of the example, 0.15 s, breaks its "
    "own eleven times over"
)


def longest(model: str, predictors: int) -> float:
    """The last delay of a grid that works [s]."""
    delays = np.array(GRIDS[predictors])
    worst = arm_errors([Cell(0.1, d) for d in delays], model, predictors=predictors, stop=60.0).worst(10.0)
    lost = np.flatnonzero(worst > LOST)
    return float(delays[lost[0] - 1] if len(lost) else delays[-1])


def longest_interval(model: str, theta: float, at_once: bool) -> float:
    """The first interval of a grid that fails [s]; inf for none, of the delayed state."""
    intervals = np.array([0.18, 0.19, 0.2, 0.21, 0.22, 0.24, 0.26, 0.3, 0.7])
    cells = [Cell(float(interval), 0.05) for interval in intervals]
    errors = arm_errors(cells, model, theta=theta, predictors=0, stop=40.0, at_once=at_once, beside=0.5)
    late = np.abs(errors.delayed[:, errors.t >= 30.0]).max(axis=(1, 2))
    lost = np.flatnonzero(~(late < LOST))
    return float(intervals[lost[0]]) if len(lost) else np.inf


def main() -> None:
    """Limits by runs, exact limits of the equations at rest, and the bounds of Theorem 2.1."""
    sheet = Sheet(__file__, "How late and how seldom measurements may come", "Hann 2014, Theorem 2.1, (2.17), (2.59)")
    figure, axis = plt.subplots(figsize=(7, 4.5), layout="constrained")
    for model, words in ((LINK_ANGLE, "sin(x2)"), (PRINTED, "sin(x3)")):
        found = []
        A = np.asarray(find_model(model).jacobian(np.zeros(4), np.zeros(1)), dtype=float)
        for m, (works, _) in SURVIVED.items():
            if model == PRINTED and m > 1:
                continue
            found.append(longest(model, m))
            sheet.add(f"longest delay, {m} predictor(s), {words}", "s", None, found[-1], NOT_PRINTED, independent=works)
        exact = exact_predictor_delay(A)
        why = "root test s = l (1 - exp(-s tau)); in its limit cycle the printed arm survives more than at rest"
        sheet.add(f"exact limit of one predictor at rest, {words}", "s", None, exact, why)
        axis.plot(list(SURVIVED)[: len(found)], found, "o-", label=f"runs, {words}")
        axis.plot(list(SURVIVED), [m * exact for m in SURVIVED], "--", label=f"exact at rest, {words}")
    bounds = DelayedStateObserver(LINK_ANGLE).network_bounds()
    sheet.add("tau_MAD of one predictor", "s", None, bounds.longest_delay, THEORY, independent=0.0135)
    sheet.add(
        "predictors that (2.59) asks for 0.15 s", "1", None, bounds.predictors_needed(0.15), THEORY, independent=12
    )
    for model, words, independents in (
        (PRINTED, "sin(x3)", {1.0: (2.1e-4, 0.22), 5.0: (5.7e-4, 0.22)}),
        (LINK_ANGLE, "sin(x2)", {1.0: (1.05e-3, None), 5.0: (7.8e-4, 0.22)}),
    ):
        for theta, (mati, fails) in independents.items():
            values = DelayedStateObserver(model).network_bounds({"theta": theta})
            who = f"{words}, theta {theta:g}"
            sheet.add(f"tau_MATI, {who}", "s", None, values.longest_interval, THEORY, independent=mati)
            strict = "with exp(sigma N tau), which (2.17) leaves out"
            sheet.add(f"tau_MATI, factor kept, {who}", "s", None, values.strict_interval, strict)
            first = longest_interval(model, theta, False)
            why = "first failure in runs of 40 s on a grid of 0.01 s, nodes in turn; an end not reached by then counts"
            shown = first if np.isfinite(first) else "none"
            sheet.add(
                f"interval that fails, {who}", "s", None, shown, why, independent="none" if fails is None else fails
            )
    axis.plot(list(SURVIVED), [m * bounds.longest_delay for m in SURVIVED], ":", label="(2.59)")
    axis.set(xlabel="predictors", ylabel="longest delay [s]", xticks=list(SURVIVED))
    sheet.finish(figure, axis)


if __name__ == "__main__":
    main()
