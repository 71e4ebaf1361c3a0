"""A comparison as files: one HTML page that needs nothing else, its data, pictures where they are asked for. Touches
only the folder it is given.
"""

from __future__ import annotations

import json
from contextlib import AbstractContextManager
from math import inf, isfinite
from pathlib import Path

from cosim.comparison.comparison import Comparison
from cosim.comparison.comparison_text import VERDICTS, signals_table
from cosim.comparison.verdict import ComparisonFinding, EventComparison, SignalComparison
from cosim.report.live.live_page import Card, Folded, LivePage, Mood, PageVerdict, Rows, Section
from cosim.report.live.render import live_page
from cosim.report.page.comparison_curves import comparison_marks, comparison_panels, comparison_recordings
from cosim.report.page.page_files import explained, page_bytes, write_file
from cosim.report.page.picture_files import PictureKind, Pictures, picture_kind, write_numbered
from fmus.tables.numbers import number
from fmus.tables.plain_data import jsonable
from fmus.tables.table import Table

PAGE, DATA, PICTURES = "comparison.html", "comparison.json", "comparison_pictures"
_MOST_PICTURES = 12  # on a page: the worst signals show it
FINDINGS_SHOWN = 6
EVENTS_SHOWN = 50


def write_comparison(comparison: Comparison, directory: str | Path, *, pictures: Pictures = False) -> dict[str, Path]:
    """Write a comparison to a folder: page and data, and where they are asked for pictures of the worst signals.

    Args:
        comparison: what to write. directory: the folder; created where it does not exist.
        pictures: whether they are drawn, see `Pictures`.

    Returns:
        Paths: ``html``, ``json``, and, where a signal that differs was drawn, ``png`` or ``svg`` (the picture of the
        worst one) and ``pictures`` (the folder with all of them).

    Raises:
        OutputError: the folder cannot be written.
    """
    folder = Path(directory)
    kind = picture_kind(pictures)
    drawn = draw_pictures(comparison, kind) if pictures else {}
    paths = {"html": write_page(comparison, folder / PAGE), "json": folder / DATA}
    with _explained(folder):
        write_file(folder / DATA, page_bytes(json.dumps(jsonable(comparison.to_dict()), indent=2) + "\n"))
    files = write_numbered(drawn, folder / PICTURES, kind)
    return paths | ({kind: next(iter(files.values())), "pictures": folder / PICTURES} if files else {})


def write_page(comparison: Comparison, path: str | Path) -> Path:
    """Write the page alone and return its path.

    Args:
        comparison: what to write. path: the file; its folder is created.

    Raises:
        OutputError: it cannot be written.
    """
    with _explained(Path(path)):
        write_file(Path(path), page_bytes(live_page(comparison_page(comparison))))
    return Path(path)


def draw_pictures(comparison: Comparison, kind: PictureKind = "png", most: int = _MOST_PICTURES) -> dict[str, bytes]:
    """Pictures of the worst signals that can be drawn, by signal, the worst first.

    Args:
        comparison: what to draw. kind: of file. most: number of pictures at most.
    """
    from cosim.report.figures.comparison_figure import comparison_picture  # noqa: PLC0415 - matplotlib only to draw

    drawable = [s for s in comparison.failed if s.curves is not None]
    return {s.name: comparison_picture(s, kind) for s in drawable[:most]}


def comparison_page(comparison: Comparison) -> LivePage:
    """What the page of a comparison shows.

    Args:
        comparison: what to show.
    """
    worst = [f"{s.name}: {_in_words(s)}" for s in comparison.failed]
    found = [Folded(s.name, [[_text(s, f) for f in s.findings] or [_in_words(s)]]) for s in comparison.failed]
    verdict = "Equal within tolerance" if comparison.equal else "Different"
    return LivePage(
        title=f"{comparison.result} against {comparison.reference}",
        verdict=PageVerdict(f"{verdict}: {_verdict_text(comparison)}", _mood(comparison.equal)),
        cards=_cards(comparison),
        finding=next(iter([*comparison.causes, *worst]), ""),
        recordings=comparison_recordings(comparison),
        panels=comparison_panels(comparison),
        marks=comparison_marks(comparison),
        sections=[
            Section("What was run differs", [[*comparison.causes]], mood="doubt"),
            Section("The worst signals", [_cut(worst, FINDINGS_SHOWN, "... and {} more, listed below")], mood="bad"),
            Section("Signals that differ", found),
            _events("Balise telegrams", "telegrams", comparison.events),
            _events("Packets of the network", "packets", comparison.packets),
            Section("All signals", [Rows(_table(comparison), plots=False)]),
            Section("Notes", [[note for note in comparison.notes if note not in comparison.causes]]),
        ],
    )


def _events(title: str, what: str, events: EventComparison) -> Section:
    """What became of telegrams or packets."""
    if not events.compared:
        return Section(title, [f"Not compared: one side keeps no {what}."])
    if not (events.matched or events.differences):
        return Section(title, [])
    shift = f", largest difference of two stamps {number(events.max_shift)} s" if events.max_shift > 0 else ""
    return Section(title, [f"{events.matched} match{shift}.", _cut([d.text for d in events.differences], EVENTS_SHOWN)])


def _cut(lines: list[str], most: int = FINDINGS_SHOWN, rest: str = "and {} more") -> list[str]:
    """The first lines, and how many more there are."""
    return lines if len(lines) <= most else [*lines[:most], rest.format(len(lines) - most)]


def _cards(comparison: Comparison) -> list[Card]:
    """The numbers at the head of the page."""
    compared = [s for s in comparison.signals if s.status in ("equal", "within", "differs")]
    failed = comparison.failed
    used = max(map(_use_of_tolerance, comparison.signals), default=-1.0)
    cards: list[Card] = [
        (
            "Verdict",
            "equal" if comparison.equal else "different",
            "within tolerance" if comparison.equal else "",
            _mood(comparison.equal),
        ),
        ("Signals", f"{len(compared)} compared", f"{len(failed)} not as in the reference", _mood(not failed)),
    ]
    if not failed and used >= 0.0:
        cards.append(("Tolerance", f"{number(100.0 * used, 2)} %", "used at most", ""))
    for what, events in (("Balise telegrams", comparison.events), ("Packets", comparison.packets)):
        if events.compared and (events.matched or events.differences):
            counts = f"{events.matched} match", f"{len(events.differences)} differences"
            cards.append((what, *counts, _mood(not events.differences)))
    return cards


def _mood(good: bool) -> Mood:
    return "good" if good else "bad"


def _verdict_text(comparison: Comparison) -> str:
    """The outcome in a sentence or two."""
    compared = [s for s in comparison.signals if s.status in ("equal", "within", "differs")]
    failed, telegrams, packets = comparison.failed, comparison.events, comparison.packets
    text = f"{len(compared)} signals were compared; "
    text += (
        "all are within tolerance."
        if not failed
        else f"{len(failed)} {'is' if len(failed) == 1 else 'are'} not as in the reference."
    )
    if packets.differences:
        text += f" Of the packets {packets.matched} match, and {len(packets.differences)} differences were found."
    if not telegrams.compared:
        return text + " Telegrams were not compared: one side keeps none."
    if telegrams.differences:
        text += (
            f" Of the balise telegrams {telegrams.matched} match, and {len(telegrams.differences)} differences "
            f"were found."
        )
    elif telegrams.matched:
        text += f" All {telegrams.matched} balise telegrams match."
    return text


def _in_words(signal: SignalComparison) -> str:
    """What is wrong with a signal, in a line."""
    if signal.findings:
        return _text(signal, signal.findings[0])
    return VERDICTS.get(signal.status, "differs") + signal.hint


def _text(signal: SignalComparison, finding: ComparisonFinding) -> str:
    """What was found, without the name that stands before it anyway."""
    return finding.text.removeprefix(f"{signal.name}: ")


def _table(comparison: Comparison) -> Table:
    """All signals, the worst first; those that fail stand out by colour and by word."""
    failed = comparison.failed
    others = [s for s in comparison.signals if not any(s is f for f in failed)]
    others.sort(key=_use_of_tolerance, reverse=True)
    return signals_table([*failed, *others], failed)


def _use_of_tolerance(signal: SignalComparison) -> float:
    """Largest error by what is allowed; what was not compared comes last."""
    if signal.status not in ("equal", "within") or not isfinite(signal.max_error):
        return -1.0
    return signal.max_error / signal.allowed if signal.allowed > 0.0 else (inf if signal.max_error > 0.0 else 0.0)


# -- files ------------------------------------------------------------------------------------------------------------


def _explained(place: Path) -> AbstractContextManager[None]:
    return explained(f"The comparison cannot be written to {place}", "Choose another place.")
