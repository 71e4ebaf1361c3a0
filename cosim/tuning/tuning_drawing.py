"""Picture of a tuning: how the searches converge. Draws on a figure of its own."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure

from cosim.drawing.style import OBSERVER_LINES, axes_or_new, picture, styled

if TYPE_CHECKING:
    from cosim.tuning.tuning_result import Tuning


@styled
def _convergence_figure(tuning: Tuning) -> Figure:
    """The best cost so far over the candidates that were asked for, a line for each search, and the cost before.

    Args:
        tuning: what was found.
    """
    ax, before = axes_or_new(None, (7.0, 3.6)), float(np.mean(tuning.before))
    for place, search in enumerate(tuning.searches):
        style = OBSERVER_LINES[place % len(OBSERVER_LINES)]
        ax.step(search.evaluations, search.costs, where="post", label=f"search {search.seed}", **style)
    ax.axhline(before, color="black", linewidth=0.8, linestyle=":", label="before")
    costs = [before, *(cost for search in tuning.searches for cost in search.costs)]
    ax.set_yscale("log" if min(costs) > 0.0 else "linear")
    ax.set_xlabel("candidates [1]")
    ax.set_ylabel("best cost [1]")
    ax.legend()
    figure = ax.get_figure(root=True)
    assert isinstance(figure, Figure)
    return figure


def draw_convergence(tuning: Tuning, kind: str) -> dict[str, bytes]:
    """The picture as a file, by the stem of its name.

    Args:
        tuning: what was found. kind: of file, ``png`` or ``svg``.
    """
    return {"convergence": picture(_convergence_figure(tuning), kind)}
