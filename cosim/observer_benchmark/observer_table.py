"""The main table of a comparison of observers: rows of numbers, cells as text, lines of equal width. Touches no
file.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import inf
from typing import Any

from cosim.evaluation.metrics import PhaseMetrics
from cosim.observer_benchmark.observer_scores import CertifiedGap, ObserverScore
from fmus.tables.numbers import number
from fmus.text_table import text_table


def main_row(score: ObserverScore) -> dict[str, Any]:
    """One row of the main table; headings with units.

    Args:
        score: an observer with its numbers.
    """
    whole: PhaseMetrics | None = score.whole
    speed, position = (whole.speed, whole.position) if whole is not None else (None, None)
    at_v, at_p = score.speed_at_balises, score.position_at_balises
    delays = score.indicator.delays if score.indicator is not None else ()
    return {
        "observer": score.label,
        "rms v [m/s]": speed and speed.rms,
        "max |v| [m/s]": speed and speed.max_abs,
        "rms p [m]": position and position.rms,
        "max |p| [m]": position and position.max_abs,
        "at balises rms v [m/s]": at_v and at_v.rms,
        "at balises rms p [m]": at_p and at_p.rms,
        "slip seen after [s]": "/".join("-" if d is None else number(d) for d in delays) or None,
        "false alarms": score.false_alarms,
        "certified [s]": None if score.certificate is None else certified_limit(score.certificate),
        "holds": certified(score.certificate),
        "cost [us/step]": score.cost,
    }


def certified_limit(certificate: CertifiedGap) -> float | str | None:
    """Longest gap that is certified [s], ``any`` where every gap is, None where it is not known.

    Args:
        certificate: of an observer.
    """
    return "any" if certificate.limit == inf else certificate.limit


def certified(certificate: CertifiedGap | None) -> str | None:
    """Whether a certificate holds for the gaps expected and seen, in words.

    Args:
        certificate: with the gaps it was held against; None where there is none.
    """
    if certificate is None:
        return None
    words = {True: "yes", False: "NO", None: "?"}
    return f"{words[certificate.holds_expected]}/{words[certificate.holds_seen]}"


def aligned(rows: Sequence[Mapping[str, str]]) -> str:
    """Rows as lines of equal width; the first column to the left, the others to the right.

    Args:
        rows: texts by heading.
    """
    return "\n".join(text_table([list(rows[0]), *(list(row.values()) for row in rows)], heading=True)) if rows else ""
