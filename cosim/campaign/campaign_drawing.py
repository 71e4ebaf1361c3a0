"""Pictures of a campaign: empirical distributions by observer, a measure over what varies. Draws on axes given, or on
its own.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes

from cosim.drawing.style import OBSERVER_LINES, axes_or_new, observer_line, styled
from cosim.studies.measures import measure_unit, with_unit

if TYPE_CHECKING:
    from cosim.campaign.campaign_result import CampaignResult

_SIZE = (7.0, 3.6)  # inches
_BINS = 12
"""Parts of the runs, equally many in each, whose median is drawn."""


@styled
def draw_distribution(result: CampaignResult, measures: Sequence[str], ax: Axes | None) -> Axes:
    """Empirical distribution functions: which share of the runs lies below; a run that has no number counts as above.

    Args:
        result: of the campaign. measures: a line for each. ax: axes to draw on; None for a figure of its own.

    Raises:
        OutputError: there is no such measure.
    """
    ax = axes_or_new(ax, _SIZE)
    for name in measures:
        values = result.column(name)
        known = np.sort(np.abs(values[np.isfinite(values)]))
        shares = np.arange(1, len(known) + 1) / max(len(values), 1)
        label = name.rpartition(".")[0] if len(measures) > 1 else None
        ax.step(known, shares, where="post", label=label, **observer_line(measures, name))
    kind = measures[0].rpartition(".")[2] if len(measures) > 1 else measures[0]
    ax.set_xlabel(with_unit(kind, measure_unit(measures[0])))
    ax.set_ylabel("Share of runs below")
    ax.set_ylim(0.0, 1.0)
    if len(measures) > 1:
        ax.legend()
    return ax


@styled
def draw_over(result: CampaignResult, measure: str, against: str, ax: Axes | None) -> Axes:
    """A measure over what varies, a point for each run, and the median of equally many neighbours.

    Args:
        result: of the campaign. measure: its name. against: a number that varies. ax: axes to draw on; None for a
            figure of its own.

    Raises:
        OutputError: there is no such measure or setting.
    """
    ax = axes_or_new(ax, _SIZE)
    x, y = result.column(against), result.column(measure)
    known = np.isfinite(y)
    x, y = x[known], y[known]
    ax.plot(x, y, ".", markersize=3, alpha=0.4, color=OBSERVER_LINES[0]["color"])
    if x.dtype.kind in "if" and len(x) > 2 * _BINS:
        parts = np.array_split(np.argsort(x, kind="stable"), _BINS)
        ax.plot([np.median(x[p]) for p in parts], [np.median(y[p]) for p in parts], **OBSERVER_LINES[1])
    unit = (result.rows.schema.field(against).metadata or {}).get(b"unit", b"").decode() or None
    ax.set_xlabel(with_unit(against, unit))
    ax.set_ylabel(with_unit(measure, measure_unit(measure)))
    return ax
