"""A comparison as files: one HTML page that needs nothing else, its pictures, its data. Touches only the folder it is
given.
"""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from contextlib import AbstractContextManager
from math import inf, isfinite
from pathlib import Path

from cosim.comparison.comparison_text import VERDICTS, signals_table
from cosim.comparison.verdict import Comparison, ComparisonFinding, SignalComparison
from cosim.drawing.style import png
from cosim.report.figures.comparison_figure import comparison_picture
from cosim.report.page.page_files import explained, page_bytes, write_file
from cosim.report.page.render import render
from cosim.report.page.run_statements import Statement
from fmus.tables.numbers import number
from fmus.tables.plain_data import jsonable
from fmus.tables.table import Table

PAGE, DATA, PICTURES = "comparison.html", "comparison.json", "comparison_pictures"
_MOST_PICTURES = 12  # on a page: the worst signals show it
FINDINGS_SHOWN = 6
EVENTS_SHOWN = 50


def write_comparison(comparison: Comparison, directory: str | Path) -> dict[str, Path]:
    """Write a comparison to a folder: page, data, and one picture for each of the worst signals.

    Args:
        comparison: what to write. directory: the folder; created where it does not exist.

    Returns:
        Paths: ``html``, ``json``, and, where a signal that differs can be drawn, ``png`` (the worst one's picture) and
        ``pictures`` (the folder with all of them).

    Raises:
        OutputError: the folder cannot be written.
    """
    folder = Path(directory)
    pictures = draw_pictures(comparison)
    with _explained(folder):
        _remove_pictures(folder / PICTURES)
    paths = {"html": write_page(comparison, folder / PAGE, pictures), "json": folder / DATA}
    with _explained(folder):
        write_file(folder / DATA, page_bytes(json.dumps(jsonable(comparison.to_dict()), indent=2) + "\n"))
    drawn = write_pictures(pictures, folder / PICTURES)
    return paths | ({"png": next(iter(drawn.values())), "pictures": folder / PICTURES} if drawn else {})


def write_page(comparison: Comparison, path: str | Path, pictures: Mapping[str, bytes]) -> Path:
    """Write the page alone, with the pictures inside, and return its path.

    Args:
        comparison: what to write. path: the file; its folder is created. pictures: from `draw_pictures`.

    Raises:
        OutputError: it cannot be written.
    """
    with _explained(Path(path)):
        write_file(Path(path), page_bytes(_comparison_page(comparison, pictures)))
    return Path(path)


def write_pictures(pictures: Mapping[str, bytes], directory: str | Path) -> dict[str, Path]:
    """Write the pictures alone, and return their paths by signal, the worst first.

    Args:
        pictures: from `draw_pictures`. directory: the folder; created where it does not exist.

    Raises:
        OutputError: the folder cannot be written.
    """
    paths = dict(zip(pictures, (Path(directory) / name for name in _file_names(list(pictures))), strict=True))
    with _explained(Path(directory)):
        for signal, path in paths.items():
            write_file(path, pictures[signal])
    return paths


def draw_pictures(comparison: Comparison, most: int = _MOST_PICTURES) -> dict[str, bytes]:
    """Pictures of the worst signals that can be drawn, PNG by signal, the worst first.

    Args:
        comparison: what to draw. most: number of pictures at most.
    """
    drawable = [s for s in comparison.failed if s.curves is not None]
    return {s.name: png(comparison_picture(s).figure) for s in drawable[:most]}


def _comparison_page(comparison: Comparison, pictures: Mapping[str, bytes]) -> str:
    """The page as text."""
    return render(
        "comparison.html.j2",
        f"{comparison.result} against {comparison.reference}",
        comparison=comparison,
        facts=_facts(comparison),
        verdict=_verdict_text(comparison),
        worst=_cut(
            [f"{s.name}: {_in_words(s)}" for s in comparison.failed], FINDINGS_SHOWN, "... and {} more, listed below"
        ),
        found={s.name: _cut([_text(s, f) for f in s.findings] or [_in_words(s)]) for s in comparison.failed},
        pictures=pictures,
        not_drawn=sum(s.curves is not None for s in comparison.failed) - len(pictures),
        differences=_cut([d.text for d in comparison.events.differences], EVENTS_SHOWN),
        packet_differences=_cut([d.text for d in comparison.packets.differences], EVENTS_SHOWN),
        table=_table(comparison),
    )


def _cut(lines: list[str], most: int = FINDINGS_SHOWN, rest: str = "and {} more") -> list[str]:
    """The first lines, and how many more there are."""
    return lines if len(lines) <= most else [*lines[:most], rest.format(len(lines) - most)]


def _facts(comparison: Comparison) -> list[Statement]:
    """The numbers at the head of the page."""
    compared = [s for s in comparison.signals if s.status in ("equal", "within", "differs")]
    failed = comparison.failed
    used = max(map(_use_of_tolerance, comparison.signals), default=-1.0)
    cards: list[Statement] = [
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


def _mood(good: bool) -> str:
    return "good" if good else "bad"


def _verdict_text(comparison: Comparison) -> str:
    """The outcome in a sentence or two."""
    compared = [s for s in comparison.signals if s.status in ("equal", "within", "differs")]
    failed, telegrams, packets = comparison.failed, comparison.events, comparison.packets
    text = f"{len(compared)} signals were compared; "
    text += "all are within tolerance." if not failed else f"{len(failed)} are not as in the reference."
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


def _file_names(signals: Sequence[str]) -> list[str]:
    """File names that every system takes and no two signals share, in order of badness."""
    return [
        f"{place:02d}_{re.sub(r'[^A-Za-z0-9._-]+', '_', name)[:80]}.png" for place, name in enumerate(signals, start=1)
    ]


def _remove_pictures(folder: Path) -> None:
    """Remove what an earlier comparison drew: it would not speak of this one."""
    if folder.is_dir():
        for old in folder.glob("[0-9][0-9]_*.png"):
            old.unlink()
