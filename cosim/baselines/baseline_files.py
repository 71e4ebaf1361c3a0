"""Baselines on disk: ``NAME.json`` says what was run, ``NAME.csv`` holds rows, ``NAME.events.csv`` telegrams.

Written so that a version control system shows what changed: one row a line, columns in alphabetical order, a line feed
at the end of each, no time of day and no absolute paths. Files that would not change are not touched.
"""

from __future__ import annotations

import csv
import io
import json
import tempfile
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path
from typing import Any, Literal

import numpy as np

from cosim.baselines.baseline import Baseline, Header
from cosim.baselines.draft import BaselineDraft, make_draft, text_digest
from cosim.baselines.header_data import header_data, header_from, is_newer
from cosim.baselines.recipe import Recipe
from cosim.comparison.tolerance import Tolerances
from cosim.errors import BaselineError, OutputError, nearest, not_utf8
from cosim.results.record_rows import TELEGRAM_ROWS
from cosim.results.result import BaliseRecord, Result
from cosim.results.table_layout import table_dtype
from fmus.near_files import what_it_is
from fmus.tables.plain_data import jsonable
from plant_models.left_behind import owned

Change = Literal["new", "changed", "unchanged"]
MARKERS = ("<<<<<<< ", "=======", ">>>>>>> ")
_HOW_TO_MAKE = "Make it with 'cosim baseline make', or with 'pytest --fmu-baseline=update' where a test uses it."

_NAMED = 4
"""Baselines of a folder that are named; of more the number is."""
_WRITE_AGAIN = "Restore it from version control, or make it again."


def parse_table(text: str, header: Header, file: Path) -> np.ndarray:
    """The rows of a baseline; columns are found by name.

    Args:
        text: of the CSV. header: of the baseline. file: its name for messages.

    Returns:
        Structured array, shape (rows,), ``time`` first, then the signals in the order of the header.

    Raises:
        BaselineError: it is cut off, a column is missing, or a cell is no number.
    """
    if not text.strip():
        raise BaselineError(f"{file} is empty; {header.rows} rows were written. {_WRITE_AGAIN}")
    first, _, body = text.partition("\n")
    names = next(csv.reader([first]))
    wanted = ["time", *(info.name for info in header.signals)]
    places = {name: place for place, name in reversed(list(enumerate(names)))}
    missing = [name for name in wanted if name not in places]
    if missing:
        raise BaselineError(f"{file}: no column {missing[0]!r}, which the header names. {_WRITE_AGAIN}")
    rows = _all_numbers(body, len(names), file)
    if len(rows) != header.rows or not text.endswith("\n"):
        raise BaselineError(
            f"{file} is cut off or was added to: {len(rows)} rows, {header.rows} were written. {_WRITE_AGAIN}"
        )
    table = np.empty(len(rows), table_dtype(wanted))
    for name in wanted:
        table[name] = rows[:, places[name]]
    if np.any(np.diff(table["time"]) < 0.0):
        line = int(np.flatnonzero(np.diff(table["time"]) < 0.0)[0]) + 3
        raise BaselineError(f"{file}, line {line}: time runs backwards. {_WRITE_AGAIN}")
    return table


def _all_numbers(body: str, count: int, file: Path) -> np.ndarray:
    """The numbers of the lines behind the heading, `count` in each, shape (rows, count)."""
    if body.strip():
        with suppress(ValueError):
            values = np.loadtxt(io.StringIO(body), delimiter=",", ndmin=2, comments=None)
            if values.shape[1] == count:
                return values
    reader = csv.reader(io.StringIO(body))  # for what is wrong in words
    rows = [_numbers(row, count, file, reader.line_num + 1) for row in reader if row]
    return np.array(rows, dtype=np.float64).reshape(len(rows), count)


def _numbers(row: list[str], count: int, file: Path, line: int) -> list[float]:
    if len(row) != count:
        raise BaselineError(
            f"{file}, line {line}: {len(row)} cells, expected {count}; the file is cut off or damaged. {_WRITE_AGAIN}"
        )
    try:
        return [float(cell) for cell in row]
    except ValueError as error:
        expected = "expected numbers with a decimal point"
        raise BaselineError(f"{file}, line {line}: {error}; {expected}. {_WRITE_AGAIN}") from error


def parse_events(text: str, header: Header, file: Path) -> list[BaliseRecord]:
    """The telegrams of a baseline.

    Args:
        text: content of the file.
        header: what the baseline says of itself.
        file: its path, for messages.

    Raises:
        BaselineError: it is cut off, a column is missing, or a cell cannot be read.
    """
    if not text:
        return []
    reader = csv.DictReader(io.StringIO(text))
    missing = [name for name in TELEGRAM_ROWS.columns if name not in (reader.fieldnames or ())]
    if missing:
        raise BaselineError(f"{file}: no column {missing[0]!r}. {_WRITE_AGAIN}")
    events = []
    for row in reader:
        try:
            events.append(TELEGRAM_ROWS.record(row))
        except (KeyError, TypeError, ValueError) as error:
            raise BaselineError(f"{file}, line {reader.line_num}: {error}. {_WRITE_AGAIN}") from error
    if len(events) != header.events:
        raise BaselineError(
            f"{file} is cut off or was added to: {len(events)} telegrams, {header.events} were written. {_WRITE_AGAIN}"
        )
    return events


def parts(path: Path) -> dict[str, Path]:
    """The files of a baseline by what they hold; `path` is that of the JSON file."""
    return {"header": path, "table": path.with_suffix(".csv"), "events": path.with_suffix(".events.csv")}


def baseline_path(path: str | Path) -> Path:
    """The JSON file of a baseline, whichever of its files was named.

    Args:
        path: the JSON file, its table or its telegrams.
    """
    path = Path(path)
    name = path.name.removesuffix(".json").removesuffix(".csv").removesuffix(".events")
    return path.with_name(name + ".json")


def is_baseline(path: str | Path) -> bool:
    """Whether a path is that of a baseline: a JSON file that says so. Nothing is checked beyond that.

    Args:
        path: the file.
    """
    path = Path(path)
    if path.suffix != ".json" or not path.is_file():
        return False
    with path.open(encoding="utf-8", errors="replace") as file:
        return '"fmu-observer baseline"' in file.read(10_000)


def write_baseline(
    result: Result,
    path: str | Path,
    *,
    tolerances: Tolerances | None = None,
    recipe: Recipe | None = None,
    signals: Iterable[str] | None = None,
    every: float | None = None,
) -> Change:
    """Write a baseline of a result.

    Args:
        result: of a run that was found right. path: of the JSON file; the CSV stands beside it.
        tolerances, recipe, signals, every: as for `make_draft`.

    Returns:
        ``new``, ``changed``, or ``unchanged`` where the files say the same already; they are then not touched.

    Raises:
        BaselineError: the run failed or is empty, or a pattern fits no signal.
        OutputError: the files cannot be written; former ones are then still whole.
    """
    return write_draft(make_draft(result, tolerances, recipe=recipe, signals=signals, every=every), path)


def write_draft(draft: BaselineDraft, path: str | Path) -> Change:
    """Write a draft, see `write_baseline`.

    Args:
        draft: what the files are to hold.
        path: the JSON file; the tables stand beside it.
    """
    path = baseline_path(path)
    change = change_by(draft, path)
    if change != "unchanged":
        write_texts(draft_texts(draft, path), path)
    return change


def draft_texts(draft: BaselineDraft, path: Path) -> dict[str, str]:
    """What each file of a baseline at `path` is to hold.

    Args:
        draft: what the files are to hold.
    """
    data = jsonable(header_data(draft.header, path.parent))
    text = json.dumps(data, indent=2, ensure_ascii=False, allow_nan=False) + "\n"
    return {"header": text, "table": draft.table, "events": draft.events}


def write_texts(texts: dict[str, str], path: Path) -> None:
    """Write the files of a baseline, the header last; an empty text removes its file.

    Args:
        texts: content by name of the file.
        path: the JSON file.

    Raises:
        OutputError: a file cannot be written, or a table that belongs to no baseline is in the way.
    """
    _demand_free(path)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=path.parent, prefix=owned(".writing-", path.parent)) as scratch:
            for kind in ("table", "events", "header"):
                (Path(scratch) / kind).write_text(texts[kind], encoding="utf-8", newline="\n")
            for kind in ("table", "events", "header"):
                if texts[kind]:
                    (Path(scratch) / kind).replace(parts(path)[kind])
                else:
                    parts(path)[kind].unlink(missing_ok=True)
    except OSError as error:
        reason = error.strerror or str(error)
        raise OutputError(
            f"The baseline {path} could not be written: {reason}. Former files are still whole."
        ) from error


def _demand_free(path: Path) -> None:
    """Refuse to write a table over one that belongs to no baseline: somebody's inputs, say.

    Raises:
        OutputError: there is one.
    """
    for kind in ("table", "events"):
        if parts(path)[kind].exists() and not path.exists():
            raise OutputError(
                f"{parts(path)[kind]} exists and belongs to no baseline ({path.name} is not there); it is not "
                "overwritten. Give the baseline another name, or remove the file."
            )


def change_by(draft: BaselineDraft, path: Path) -> Change:
    """What writing a draft would do. Other versions alone are no change: nothing else is to be seen in them.

    Args:
        draft: what the files are to hold.
        path: the JSON file.
    """
    if not path.exists():
        return "new"
    former = {kind: _text(file) for kind, file in parts(path).items()}
    wanted = draft_texts(draft, path)
    if any(former[kind] != wanted[kind] for kind in ("table", "events")):
        return "changed"
    try:
        before, after = json.loads(former["header"]), json.loads(wanted["header"])
    except ValueError:
        return "changed"
    for data in (before, after):
        data.pop("versions", None)
    return "unchanged" if before == after else "changed"


def _text(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8")  # line endings become line feeds
    except (OSError, UnicodeDecodeError):
        return ""


def read_baseline(path: str | Path) -> Baseline:
    """Read a baseline.

    Args:
        path: of its JSON file, or of one of the tables beside it.

    Returns:
        The baseline; its `notes` state what was odd and did not matter.

    Raises:
        BaselineError: it is missing, unreadable, cut off, in conflict after a merge, or of another version of the
        layout.
    """
    _demand_no_folder(Path(path))
    path = baseline_path(path)
    header = _read_header(path)
    files = parts(path)
    table = _demanded(files["table"], f"it belongs to {path.name}")
    events = _demanded(files["events"], f"{path.name} speaks of {header.events} telegrams") if header.events else ""
    result = Result(
        table=parse_table(table, header, files["table"]),
        signals=tuple(header.signals),
        events=tuple(parse_events(events, header, files["events"])),
        summary=summary_of(header),
    )
    notes = [f"{path.name} was written by a newer version of the layout ({header.version})."] * is_newer(header.version)
    if text_digest(table, events) != header.digest:
        notes.append(f"{files['table'].name} is not as it was written: edited by hand, or merged.")
    return Baseline(header, result, path, notes)


def summary_of(header: Header) -> dict[str, Any]:
    """What a run would say of itself, as far as the header states it.

    Args:
        header: what the baseline says of itself.
    """
    components = [
        {key: getattr(entry, key) for key in entry.__dataclass_fields__ if key != "delivery"} | {"source": entry.file}
        for entry in header.components
    ]
    summary: dict[str, Any] = {"title": header.title, "versions": dict(header.versions), **header.span}
    return summary | {"components": components, "events_recorded": header.events is not None}


def _demand_no_folder(path: Path) -> None:
    """Refuse a folder, unless the JSON file of its name stands beside it.

    Raises:
        BaselineError: it is one; the baselines in it are named.
    """
    if not path.is_dir() or (path.name and path.with_name(f"{path.name}.json").is_file()):
        return
    inside = sorted(str(file) for file in path.glob("*.json") if is_baseline(file))
    if not inside:
        raise BaselineError(f"{path} is a folder without a baseline; expected the .json of one. {_HOW_TO_MAKE}")
    more = f" and {len(inside) - _NAMED} more" if len(inside) > _NAMED else ""
    found = f"{', '.join(inside[:_NAMED])}{more}"
    raise BaselineError(f"{path} is a folder; name the .json of one baseline. It holds {found}.")


def _read_header(path: Path) -> Header:
    if not path.is_file():
        stated = path.with_suffix("")
        if kind := what_it_is(stated):
            raise BaselineError(f"{stated} is {kind}; expected the .json of a baseline. {_HOW_TO_MAKE}")
        others = sorted(other.name for other in path.parent.glob("*.json")) if path.parent.is_dir() else []
        near = f" That folder holds others; {nearest(path.name, others)}" if others else ""
        raise BaselineError(f"There is no baseline {path}.{near} {_HOW_TO_MAKE}")
    text = _demanded(path, "it is the header of a baseline")
    try:
        return header_from(json.loads(text), path.parent)
    except json.JSONDecodeError as error:
        raise BaselineError(f"{path}, line {error.lineno}: not readable as JSON: {error.msg}. {_AGAIN}") from error
    except BaselineError as error:
        raise BaselineError(f"{path}: {error}") from error


_AGAIN = "Restore it from version control, or make it again."


def _demanded(path: Path, why: str) -> str:
    """The text of a file that must be there, without conflicts of a merge."""
    try:
        text = path.read_text(encoding="utf-8-sig")
    except FileNotFoundError as error:
        raise BaselineError(f"{path} is missing: {why}. {_AGAIN}") from error
    except UnicodeDecodeError as error:
        raise BaselineError(f"{path}: {not_utf8(path.read_bytes())}. {_AGAIN}") from error
    except OSError as error:
        raise BaselineError(f"{path} cannot be read: {error}. {_AGAIN}") from error
    marked = any(marker in text for marker in MARKERS)
    for number, line in enumerate(text.splitlines() if marked else (), 1):
        if line.startswith(MARKERS[::2]) or line == MARKERS[1]:
            raise BaselineError(
                f"{path}, line {number}: holds the conflict of a merge ({line[:7]}). Decide it, or make it again."
            )
    return text
