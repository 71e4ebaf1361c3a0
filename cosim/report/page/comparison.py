"""A comparison as files: one HTML page that needs nothing else, its pictures, its data. Touches only the folder it is
given.
"""

from __future__ import annotations

import json
import re
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from html import escape
from math import inf, isfinite
from pathlib import Path

from cosim.comparison.verdict import Comparison, Finding, SignalComparison
from cosim.drawing.style import png
from cosim.errors import OutputError
from cosim.evaluation.numbers import DASH, number
from cosim.report.figures.comparison_figure import comparison_picture
from cosim.report.page.parts import box, bullets, chapters, facts, page, paragraph, picture, scrolling
from cosim.results.summary_file import jsonable

PAGE, DATA, PICTURES = "comparison.html", "comparison.json", "comparison_pictures"
MOST_PICTURES = 12  # on a page: the worst signals tell the story
FINDINGS_SHOWN = 6
EVENTS_SHOWN = 50
HEADINGS = (
    "Signal",
    "Unit",
    "Verdict",
    "Largest error",
    "Allowed",
    "At [s]",
    "Largest shift [s]",
    "Error, rms",
    "Outside [%]",
)
VERDICTS = {
    "equal": "equal to the bit",
    "within": "within tolerance",
    "differs": "differs",
    "missing": "missing in the result",
    "extra": "only in the result",
    "ignored": "not compared",
}


def write_comparison(
    comparison: Comparison, directory: str | Path, most_pictures: int = MOST_PICTURES
) -> dict[str, Path]:
    """Write a comparison to a folder: page, data, and one picture for each of the worst signals.

    Args:
        comparison: what to write. directory: the folder; created where it does not exist.
        most_pictures: number of pictures at most, of the worst signals.

    Returns:
        Paths: ``html``, ``json``, and, where a signal that differs can be drawn, ``png`` (the worst one's picture) and
        ``pictures`` (the folder with all of them).

    Raises:
        OutputError: the folder cannot be written.
    """
    folder = Path(directory)
    pictures = draw_pictures(comparison, most_pictures)
    with _explained(folder):
        _remove_pictures(folder / PICTURES)
        drawn = _write_pictures(pictures, folder / PICTURES)
        _write(folder / PAGE, comparison_page(comparison, pictures))
        _write(folder / DATA, comparison_json(comparison))
    paths = {"html": folder / PAGE, "json": folder / DATA}
    return paths | ({"png": next(iter(drawn.values())), "pictures": folder / PICTURES} if drawn else {})


def write_page(comparison: Comparison, path: str | Path, most_pictures: int = MOST_PICTURES) -> Path:
    """Write the page alone, with the pictures inside; raises as `write_comparison` does."""
    file = Path(path)
    text = comparison_page(comparison, draw_pictures(comparison, most_pictures))
    with _explained(file):
        _write(file, text)
    return file


def write_pictures(
    comparison: Comparison, directory: str | Path, most_pictures: int = MOST_PICTURES
) -> dict[str, Path]:
    """Write the pictures alone: paths by signal, the worst first; raises as `write_comparison` does."""
    pictures = draw_pictures(comparison, most_pictures)
    with _explained(Path(directory)):
        return _write_pictures(pictures, Path(directory))


def draw_pictures(comparison: Comparison, most: int = MOST_PICTURES) -> dict[str, bytes]:
    """Pictures of the worst signals that can be drawn, as PNG by signal, the worst first."""
    drawable = [s for s in comparison.failed if s.curves is not None]
    return {s.name: png(comparison_picture(s).figure) for s in drawable[:most]}


def comparison_json(comparison: Comparison) -> str:
    """The comparison as JSON, without curves."""
    return json.dumps(jsonable(comparison.to_dict()), indent=2) + "\n"


def comparison_page(comparison: Comparison, pictures: Mapping[str, bytes]) -> str:
    """The page as text.

    Args:
        comparison: what was found. pictures: PNG by signal, from `draw_pictures`.
    """
    title = f"{comparison.result} against {comparison.reference}"
    return page(
        title,
        [
            f"<header>\n<h1>{escape(title)}</h1>\n{facts(_facts(comparison))}</header>",
            _verdict(comparison),
            chapters(
                {
                    "Signals that differ": [
                        *(_signal(s, pictures) for s in comparison.failed),
                        _left_out(comparison, pictures),
                    ],
                    "Balise telegrams": _events(comparison),
                    "All signals": [_table(comparison)],
                    "Notes": [bullets(comparison.notes)],
                }
            ),
        ],
    )


def _facts(comparison: Comparison) -> list[tuple[str, str, str, str]]:
    """The numbers at the head of the page."""
    compared = [s for s in comparison.signals if s.status in ("equal", "within", "differs")]
    failed, events = comparison.failed, comparison.events
    used = max(map(_use_of_tolerance, comparison.signals), default=-1.0)
    cards = [
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
    if events.compared and (events.matched or events.differences):
        cards.append(
            (
                "Balise telegrams",
                f"{events.matched} match",
                f"{len(events.differences)} differences",
                _mood(not events.differences),
            )
        )
    return cards


def _mood(good: bool) -> str:
    return "good" if good else "bad"


def verdict_text(comparison: Comparison) -> str:
    """The outcome in a sentence or two."""
    compared = [s for s in comparison.signals if s.status in ("equal", "within", "differs")]
    failed, telegrams = comparison.failed, comparison.events
    text = f"{len(compared)} signals were compared; "
    text += "all are within tolerance." if not failed else f"{len(failed)} are not as in the reference."
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


def _verdict(comparison: Comparison) -> str:
    content = paragraph(verdict_text(comparison))
    if comparison.equal:
        return box("success", "Equal within tolerance", content)
    worst = [f"{s.name}: {_in_words(s)}" for s in comparison.failed[:FINDINGS_SHOWN]]
    if len(comparison.failed) > FINDINGS_SHOWN:
        worst.append(f"... and {len(comparison.failed) - FINDINGS_SHOWN} more, listed below")
    return box("failure", "Different", content + bullets(worst))


def _in_words(signal: SignalComparison) -> str:
    """What is wrong with a signal, in a line."""
    if signal.findings:
        return _text(signal, signal.findings[0])
    near = f"; nearest: {', '.join(signal.nearest)}" if signal.nearest else ""
    return VERDICTS[signal.status] + near


def _text(signal: SignalComparison, finding: Finding) -> str:
    """What was found, without the name that stands before it anyway."""
    return finding.text.removeprefix(f"{signal.name}: ")


def _signal(signal: SignalComparison, pictures: Mapping[str, bytes]) -> str:
    """One signal that differs: what was found, and its picture."""
    found = [_text(signal, f) for f in signal.findings[:FINDINGS_SHOWN]] or [_in_words(signal)]
    if len(signal.findings) > FINDINGS_SHOWN:
        found.append(f"and {len(signal.findings) - FINDINGS_SHOWN} more")
    if signal.name not in pictures:
        return f"<h3>{escape(signal.name)}</h3>\n{bullets(found)}"
    caption = "Both curves over the tolerance tube; the error in the band it may lie in; the worst point enlarged."
    return f"<h3>{escape(signal.name)}</h3>\n{bullets(found)}\n{picture(pictures[signal.name], signal.name, caption)}"


def _left_out(comparison: Comparison, pictures: Mapping[str, bytes]) -> str:
    drawable = sum(1 for s in comparison.failed if s.curves is not None)
    left = drawable - len(pictures)
    return (
        paragraph(f"Only the {len(pictures)} worst signals are drawn; {left} more could be drawn.") if left > 0 else ""
    )


def _events(comparison: Comparison) -> list[str]:
    events = comparison.events
    if not events.compared:
        return [paragraph("Not compared: one side keeps no telegrams.")]
    if not events.matched and not events.differences:
        return []
    shift = f", largest difference of two stamps {number(events.max_shift)} s" if events.max_shift > 0.0 else ""
    lines = [d.text for d in events.differences[:EVENTS_SHOWN]]
    left = len(events.differences) - len(lines)
    return [
        paragraph(f"{events.matched} match{shift}."),
        bullets([*lines, *([f"and {left} more"] if left > 0 else [])]),
    ]


def _table(comparison: Comparison) -> str:
    """All signals, the worst first; those that fail stand out by colour and by word."""
    failed = comparison.failed
    others = [s for s in comparison.signals if not any(s is f for f in failed)]
    others.sort(key=_use_of_tolerance, reverse=True)
    head = "".join(f'<th scope="col">{escape(text)}</th>' for text in HEADINGS)
    rows = "\n".join([*(_row(s, True) for s in failed), *(_row(s, False) for s in others)])
    return scrolling(f"<table>\n<thead><tr>{head}</tr></thead>\n<tbody>\n{rows}\n</tbody>\n</table>") if rows else ""


def _use_of_tolerance(signal: SignalComparison) -> float:
    """Largest error by what is allowed; what was not compared comes last."""
    if signal.status not in ("equal", "within") or not isfinite(signal.max_error):
        return -1.0
    return signal.max_error / signal.allowed if signal.allowed > 0.0 else (inf if signal.max_error > 0.0 else 0.0)


def _row(signal: SignalComparison, failed: bool) -> str:
    compared = signal.status in ("equal", "within", "differs")
    outside = number(100.0 * signal.share_outside) if compared else DASH
    shift = number(signal.max_shift) if compared else DASH
    sizes = (
        number(signal.max_error),
        number(signal.allowed),
        number(signal.max_error_at, 6),
        shift,
        number(signal.rms_error),
        outside,
    )
    cells = "".join(f'<td class="number">{escape(text)}</td>' for text in sizes)
    verdict = f'<td class="bad">{VERDICTS[signal.status]}</td>' if failed else f"<td>{VERDICTS[signal.status]}</td>"
    return f'<tr><th scope="row">{escape(signal.name)}</th><td>{escape(signal.unit)}</td>{verdict}{cells}</tr>'


# -- files ------------------------------------------------------------------------------------------------------------


@contextmanager
def _explained(place: Path) -> Iterator[None]:
    """Turns what the file system refuses into an error for users."""
    try:
        yield
    except OSError as error:
        reason = error.strerror or str(error)
        raise OutputError(f"The comparison cannot be written to {place}: {reason}. Choose another place.") from error


def _write(path: Path, text: str) -> None:
    _write_bytes(path, text.encode("utf-8", "backslashreplace"))


def _write_bytes(path: Path, data: bytes) -> None:
    """Write a file beside its place first, so that no half of it is ever seen."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=path.parent, prefix=".writing-") as scratch:
        part = Path(scratch) / path.name
        part.write_bytes(data)
        part.replace(path)


def _write_pictures(pictures: Mapping[str, bytes], folder: Path) -> dict[str, Path]:
    names = dict(zip(pictures, _file_names(list(pictures)), strict=True))
    for signal, data in pictures.items():
        _write_bytes(folder / names[signal], data)
    return {signal: folder / name for signal, name in names.items()}


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
