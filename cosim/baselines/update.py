"""What updating a baseline would do: nothing, say something else of the model, or keep new rows. Reads files, writes
none.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from cosim.baselines.baseline import Baseline
from cosim.baselines.baseline_files import (
    Change,
    change_by,
    draft_texts,
    parse_events,
    parse_table,
    read_baseline,
    summary_of,
)
from cosim.baselines.draft import BaselineDraft, make_draft
from cosim.baselines.recipe import Recipe
from cosim.baselines.regression import Regression, check
from cosim.comparison.comparison import Comparison
from cosim.comparison.tolerance import Tolerances
from cosim.errors import BaselineError, ComparisonError
from cosim.results.result import Result
from cosim.run.outcome import Outcome


@dataclass(frozen=True)
class Update:
    """What updating a baseline would do.

    Args:
        change: ``new``, ``changed`` or ``unchanged``.
        texts: what each file is to hold; none where nothing changes. notes: for people.
        before: comparison with the baseline as it was, where there was one that could be compared.
        after: comparison with the baseline as it will be.
    """

    change: Change
    texts: Mapping[str, str]
    after: Regression
    before: Regression | None = None
    notes: Sequence[str] = field(default=())


def plan_update(
    result: Result | Outcome,
    path: Path,
    tolerances: Tolerances | None = None,
    *,
    recipe: Recipe | None = None,
    signals: Iterable[str] | None = None,
    every: float | None = None,
) -> Update:
    """What writing a baseline of a result over the one at `path` would do.

    Rows within tolerance of the former ones are kept as they are: a new machine or package version changes last digits,
    which nobody wants to read as a difference. The header then states a new delivery.

    Args:
        result: of a run, or its outcome. path: of the JSON file.
        tolerances: None for those of the former baseline. recipe, signals, every: as for `make_draft`.

    Raises:
        BaselineError: no baseline can be made of the result.
    """
    actual = result if isinstance(result, Result) else result.result
    former, notes = _former(path)
    if tolerances is None and former is not None:
        tolerances = former.tolerances
    draft = _sound_draft(actual, path, tolerances, recipe, signals, every)
    before = None
    if former is not None:
        try:
            before = check(result, former, draft.header.tolerances)
        except (BaselineError, ComparisonError) as error:
            notes = [*notes, str(error)]
        if before is not None and _may_stay(before, former, draft):
            draft = _with_former_rows(draft, former, path)
    change = change_by(draft, path)
    texts = draft_texts(draft, path) if change != "unchanged" else {}
    return Update(change, texts, check(result, _as_baseline(draft, path)), before, notes)


def _with_former_rows(draft: BaselineDraft, former: Baseline, path: Path) -> BaselineDraft:
    header = former.header
    kept = replace(draft.header, rows=header.rows, events=header.events, digest=header.digest)
    return BaselineDraft(kept, _text(path, ".csv"), _text(path, ".events.csv"))


def _former(path: Path) -> tuple[Baseline | None, list[str]]:
    if not path.exists():
        return None, []
    try:
        return read_baseline(path), []
    except BaselineError as error:
        return None, [f"The former one could not be read: {error}"]


def _may_stay(before: Comparison, former: Baseline, draft: BaselineDraft) -> bool:
    """Whether the former rows still show what the new ones would."""
    unchanged = all(
        getattr(former.header, key) == getattr(draft.header, key) for key in ("tolerances", "every", "span")
    )
    names = [info.name for info in former.header.signals] == [info.name for info in draft.header.signals]
    return unchanged and names and before.equal and not former.notes


def _text(path: Path, suffix: str) -> str:
    file = path.with_suffix(suffix)
    return file.read_text(encoding="utf-8") if file.exists() else ""


def _sound_draft(
    result: Result,
    path: Path,
    tolerances: Tolerances | None,
    recipe: Recipe | None,
    signals: Iterable[str] | None,
    every: float | None,
) -> BaselineDraft:
    """A draft that the result itself passes."""
    draft = make_draft(result, tolerances, recipe=recipe, signals=signals, every=every)
    found = check(result, _as_baseline(draft, path))
    if found.equal:
        return draft
    worst = found.failed[0].findings[0].text if found.failed and found.failed[0].findings else "see the telegrams"
    raise BaselineError(f"The run does not pass against its own baseline, so it cannot be kept as one: {worst}")


def _as_baseline(draft: BaselineDraft, path: Path) -> Baseline:
    """A draft as it will be read back."""
    header = draft.header
    table, events = parse_table(draft.table, header, path), parse_events(draft.events, header, path)
    return Baseline(header, Result(table, tuple(header.signals), tuple(events), summary_of(header)), path)
