"""Full inversion of the cascade of three states, by envelopes of classes; Figures 4.20 to 4.25."""

from __future__ import annotations

import casadi as ca
import matplotlib.pyplot as plt
import numpy as np
from shared.sheet import Sheet
from windows import driven, recorded, rms

from fmu_observer.formulas.signatures.dynamic_signature import dynamic_signature
from fmu_observer.formulas.signatures.pencil import NextScaling
from fmu_observer.observers.exhibits import CascadeSignature
from plant_models.exhibits import ThreeStateCascade

RULE = "norm form, and literal form with eps of 0.1 and more, have the rule, here and there"
LITERAL = "8 fail, all of x2 < 0: 94.6 % of these have the rule, as the independent implementation found"
SLOPES = (
    "here the slope from the first to the last point of the seven nodes; the independent one, same form "
    "and eps, has five monotone and a kink at x1 = -3 and 3; how it took the slope is not stated. The observer "
    "takes the place on the curve of chords, which need not be monotone"
)
ERRORS = (
    "no number is printed; independent is another inversion, nearest neighbours on a grid of 15^3, nodes 0.43 apart, "
    "see below: this one reads envelopes, median lines and chords of a table of 7^3, nodes 1 apart"
)
NEIGHBOURS = (
    "median point and chord of each signature, in units of their deviation over the grid. The nearest node of 15^3 is "
    "0.11 off in the median in whatever it tells, so that 0.046 needs a mean of neighbours, or states near nodes; "
    "how many neighbours, what scales and which states are not stated there"
)
FINER = "with 13^3 nodes, 0.5 apart: the table makes a part of the error; the rest is the method"
CASES: tuple[tuple[NextScaling, float, int, tuple[float | None, ...]], ...] = (
    ("literal", 1.0, 15, (0.046, 0.068, 0.224)),
    ("norm", 1e-3, 15, (0.20, 0.34, 0.43)),
    ("literal", 1.0, 7, (None, None, None)),
)
RUN = (
    "figure lost; guess (1, -1, 0) is ours. x3 comes of small differences of a chord: its error is that of the guess, "
    "or more"
)
LEFT = "x3 = 0.7 + 5 t leaves the tables' set after 0.46 s: the figure can be of the beginning only"
SHOWN = {"0.2 s to 0.45 s": (0.2, 0.45), "0.5 s to 0.6 s": (0.5, 0.6)}


def main() -> None:
    """The sign rule, slopes, errors of the look-up, and the printed run."""
    sheet = Sheet(
        __file__, "Cascade of three states: classes and envelopes", "Omar 2012, section 4.6.2, Figs. 4.20-4.25"
    )
    observer, finer = CascadeSignature(), CascadeSignature(13)
    nodes = observer.nodes
    grid = np.stack(np.meshgrid(nodes, nodes, nodes, indexing="ij"))
    p = observer.unpack_parameters(observer.start_parameters())
    windows = outputs(observer, grid, p)
    for scaling, eps, independent in (
        ("norm", 1e-3, 294),
        ("norm", 1.0, 294),
        ("literal", 0.1, 294),
        ("literal", 1e-3, None),
    ):
        median = np.median(dynamic_signature(windows, 67, eps, scaling)[0], axis=0)
        fits = int((np.sign(median) == np.sign(grid[1]))[grid[1] != 0].sum())
        text = f"signatures of 294 whose median has the sign of x2, {scaling}, eps = {eps:g}"
        why = RULE if independent else LITERAL
        sheet.add(text, "1", 294, fits, why, independent=independent)
    norm = dynamic_signature(windows, 67, 1e-3, "norm")
    chord = norm[:, -1] - norm[:, 0]
    steps = np.diff(chord[1] / chord[0], axis=2)
    monotone = (steps > 0.0).all(axis=2) | (steps < 0.0).all(axis=2)
    text = "of 7 curves of the slope over x3 at x2 = 3, monotone, norm"
    sheet.add(text, "1", 7, int(monotone[:, -1].sum()), SLOPES, independent=5)
    sheet.add("of all 49 such curves, monotone, norm", "1", None, int(monotone.sum()), SLOPES)

    states = np.random.default_rng(0).uniform(-3.0, 3.0, (3, 40))
    for scaling, independent in (("literal", (0.046, 0.068, 0.224)), ("norm", (0.20, 0.34, 0.43))):
        one = observer if scaling == "literal" else CascadeSignature(7, "norm")
        reported = inverted(one, outputs(one, states, p), p)
        for i in range(3):
            error = float(np.median(np.abs(reported[i] - states[i])))
            text = f"median error of x{i + 1}, 40 states of the set, {scaling}"
            sheet.add(text, "1", None, error, ERRORS, independent=independent[i])
        if scaling == "norm":
            continue
        reported = inverted(finer, outputs(finer, states, p), p)
        for i in range(3):
            error = float(np.median(np.abs(reported[i] - states[i])))
            sheet.add(f"the same of x{i + 1}, literal, 13 nodes", "1", None, error, FINER)

    add_neighbours(sheet, observer, p)
    true = recorded(ThreeStateCascade(), 0.6, 1e-3)
    start = {"estimated_x1": 1.0, "estimated_x2": -1.0, "estimated_x3": 0.0}
    runs = {
        "7 nodes": driven(observer, true["measured_x1"][:, None], **start),
        "13 nodes": driven(finer, true["measured_x1"][:, None], **start),
        "model alone": driven(observer, true["measured_x1"][:, None], gain=0.0, **start),
    }
    for label, reported in runs.items():
        for span, (low, high) in SHOWN.items():
            rows = (true["time"] >= low) & (true["time"] <= high)
            for name in ("x1", "x2", "x3"):
                why = LEFT if low >= 0.46 else RUN
                sheet.add(
                    f"RMSE of {name}, {span}, q = 0.1, {label}".replace("q = 0.1, model", "model"),
                    "1",
                    None,
                    rms(reported, true, name, rows),
                    why,
                )
    figure, axes = plt.subplots(1, 4, figsize=(13, 3.3), layout="constrained")
    axes[0].scatter(*norm[:, 16].reshape(2, -1), c=np.sign(grid[1]).ravel(), s=8, cmap="coolwarm")
    axes[0].set(title="a middle point of each signature, by sign of x2", xlabel="abscissa", ylabel="ordinate")
    axes[0].title.set_fontsize(8)
    for axis, name in zip(axes[1:], ("x1", "x2", "x3"), strict=True):
        axis.plot(true["time"], true[name], "k", label="true")
        for label, reported in runs.items():
            axis.plot(true["time"], reported[name], lw=0.9, label=label)
        axis.axvline(0.46, color="0.6", lw=0.8)
        axis.set(xlabel="time [s]", ylabel=name)
    axes[1].legend(fontsize=7)
    sheet.finish(figure)


def inverted(observer: CascadeSignature, windows: np.ndarray, p: object) -> np.ndarray:
    """States at the start of windows of shape (N_O, n), shape (3, n); traced once, where each one in NumPy is slow."""
    window = ca.SX.sym("window", len(windows))
    reported = observer.inverted([ca.ArrayInterface.SX(window, shape=(len(windows),))], None, p)
    return np.array(ca.Function("inverted", [window], [ca.SX(reported.state)])(windows))


def add_neighbours(sheet: Sheet, observer: CascadeSignature, p: object) -> None:
    """Errors of the means of nearest neighbours, among signatures of a grid, of the same 40 states and of 200 more."""
    few, many = (np.random.default_rng(seed).uniform(-3.0, 3.0, (3, n)) for seed, n in ((0, 40), (1, 200)))
    states, grids = np.hstack([few, many]), {}
    for count in (15, 7):
        axis = np.linspace(-3.0, 3.0, count)
        grid = np.stack(np.meshgrid(axis, axis, axis, indexing="ij")).reshape(3, -1)
        grids[count] = grid, outputs(observer, np.hstack([grid, states]), p)
    for scaling, eps, count, independent in CASES:
        grid, windows = grids[count]
        read = reported_by(windows, eps, scaling)
        known, asked = np.split(read / read[:, : grid.shape[1]].std(axis=1, keepdims=True), [grid.shape[1]], axis=1)
        distance = np.sqrt(((known[:, :, None] - asked[:, None]) ** 2).sum(axis=0))
        for nearest in (1, 8):
            rows = np.argpartition(distance, nearest, axis=0)[:nearest]
            weights = 1.0 / (np.take_along_axis(distance, rows, axis=0) + 1e-12)
            errors = np.abs((grid[:, rows] * weights).sum(axis=1) / weights.sum(axis=0) - states)
            for i in range(3):
                text = f"median error of x{i + 1} by {nearest} of {count}^3 neighbours, {scaling}"
                first, rest = np.median(errors[i, :40]), np.median(errors[i, 40:])
                value = f"{first:.3f}; {rest:.3f} over 200 more states"
                sheet.add(text, "1", None, value, NEIGHBOURS, independent=independent[i])


def reported_by(windows: np.ndarray, eps: float, scaling: NextScaling) -> np.ndarray:
    """Median point and chord of signatures, shape (4, n)."""
    found = dynamic_signature(windows, 67, eps, scaling)
    return np.concatenate([np.median(found, axis=1), found[:, -1] - found[:, 0]])


def outputs(observer: CascadeSignature, states: np.ndarray, p: object) -> np.ndarray:
    """Windows of the output from states, shape (N_O, ...)."""
    return np.stack([x[0] for x in observer.moved(states, observer.window - 1, observer.model_parameters((), p))])


main()
