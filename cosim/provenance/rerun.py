"""Rerun: results are made again from what their folder holds, and compared with those that are there. Changes nothing
in it.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from cosim.comparison.compare import compare
from cosim.comparison.comparison import Comparison
from cosim.comparison.comparison_text import difference_parts
from cosim.errors import OutputError, ProvenanceError
from cosim.results.load_result import load_result
from cosim.results.unfinished import DID_NOT_END
from cosim.run.outcome import Outcome
from cosim.run.results_manifest import Manifest, read_manifest
from cosim.simulation.scenario import Scenario
from fmus.tables.table import Parts, Readable

if TYPE_CHECKING:
    from cosim.comparison.compare import StatedTolerance
    from cosim.results.result import Result
from collections.abc import Sequence
from dataclasses import astuple

from cosim.results.result import BaliseRecord, PacketRecord, Result

LOG = logging.getLogger("cosim")
Verdict = Literal["bit-identical", "within tolerance", "differs"]


CHUNK = 65536


def _equal_result(first: Result, second: Result) -> bool:
    """Whether tables, telegrams and packets agree in every bit.

    One NaN is as good as another, since text files keep no more of it.
    """
    return (
        _equal_table(first.table, second.table)
        and _equal_events(first.events, second.events)
        and _equal_events(first.packets, second.packets)
    )


def _equal_table(first: np.ndarray, second: np.ndarray) -> bool:
    """Whether two tables have the same columns in the same order and the same bits in every row."""
    if first.dtype.names != second.dtype.names or first.shape != second.shape:
        return False
    names = first.dtype.names or ()
    return all(
        _equal_bits(first[name][start : start + CHUNK], second[name][start : start + CHUNK])
        for start in range(0, len(first), CHUNK)
        for name in names
    )


def _equal_events(first: Sequence[BaliseRecord | PacketRecord], second: Sequence[BaliseRecord | PacketRecord]) -> bool:
    """Whether two lists of telegrams or packets are the same."""
    return len(first) == len(second) and all(
        list(map(_bits, astuple(a))) == list(map(_bits, astuple(b))) for a, b in zip(first, second, strict=True)
    )


def _equal_bits(first: np.ndarray, second: np.ndarray) -> bool:
    a, b = np.ascontiguousarray(first).view(np.uint64), np.ascontiguousarray(second).view(np.uint64)
    return bool(np.all((a == b) | (np.isnan(first) & np.isnan(second))))


def _bits(value: object) -> object:
    return float(value).hex() if isinstance(value, float) else dict(value) if isinstance(value, dict) else value


@dataclass(frozen=True)
class Rerun(Readable):
    """What came out of running results again.

    Args:
        directory: the results folder. manifest: what it says of itself.
        outcome: of the new run. comparison: of the new run with the stored results.
        verdict: ``bit-identical`` where every number, telegram and packet is the same.
        changes: what is not as it was: versions, files, models, settings; one line each.
        paths: where the new results were written, by kind; empty where they were not.
        stored_failure: why the stored run ended early, or None.
    """

    directory: Path
    manifest: Manifest
    outcome: Outcome
    comparison: Comparison
    verdict: Verdict
    changes: tuple[str, ...]
    paths: Mapping[str, Path]
    stored_failure: str | None = None

    @property
    def equal(self) -> bool:
        """Whether the results are the same, to the last bit or within the tolerance."""
        return self.verdict != "differs"

    @property
    def verdict_line(self) -> str:
        """The verdict with what was compared."""
        rows, telegrams = len(self.outcome.result.table), len(self.outcome.result.events)
        counts = f"{rows} rows, {len(self.comparison.signals)} signals, {telegrams} telegrams"
        return f"{self.directory}: {self.verdict} ({counts})."

    def parts(self) -> Parts:
        """What changed since, what differs, and the verdict, for people."""
        return [*self.details(), self.verdict_line]

    def details(self, verbose: bool = False) -> Parts:
        """The same without the verdict.

        Args:
            verbose: whether all signals and findings are shown, and not the worst alone.
        """
        lines = []
        if self.verdict == "within tolerance":
            largest = max((s.max_error for s in self.comparison.signals if s.status == "within"), default=0.0)
            lines.append(f"The largest difference is {largest:.3g} in the unit of its signal.")
        lines += ["Changed since:", *(f"  {c}" for c in self.changes)] if self.changes else ["Nothing changed since."]
        return ["\n".join(lines), *difference_parts(self.comparison, verbose)]

    def to_dict(self) -> dict[str, Any]:
        """Plain data for a JSON file."""
        return {
            "directory": str(self.directory),
            "verdict": self.verdict,
            "equal": self.equal,
            "changes": list(self.changes),
            "failure": self.outcome.failure,
            "comparison": self.comparison.to_dict(),
        }


def rerun(
    directory: str | Path,
    *,
    out: str | Path | None = None,
    overrides: Mapping[str, Any] | None = None,
    tolerance: StatedTolerance | None = None,
    trust: bool = False,
    progress: Callable[[float, float], None] | None = None,
    warn: Callable[[str], None] | None = None,
    building: Callable[[str], None] | None = None,
) -> Rerun:
    """Run again what a results folder holds, and compare.

    Args:
        directory: a results folder; it may have been moved, and the files it was made from may be gone.
        out: where to write the new results; by default nothing is written.
        overrides: values to change, as for `Scenario.set`.
        tolerance: how far signals may differ, see `cosim.compare`.
        trust: go on where files of the folder were edited since, and where they are code that was never run here; by
            default that is an error.
        progress, warn, building: as for `Scenario.run`; warnings that the stored results have are not given again.

    Raises:
        ProvenanceError: the folder does not say how it was made, a file was edited, or one that was not kept is gone.
        UntrustedError: it would run code that was never run here.
        CosimError: the scenario cannot be set up any more.
    """
    manifest = read_manifest(directory)
    _check_out(manifest, out)
    edited = _edited(manifest, trust)
    settings = dict(overrides or {})
    _demand_all_there(manifest, settings)
    scenario = _stored_scenario(manifest, trust)
    for name, value in settings.items():
        scenario.set(name, value)
    stored = load_result(directory)
    outcome = scenario.run(progress, warn=_new_ones(warn, stored), building=building)
    paths = {} if out is None else outcome.write(out)  # before anything can be wrong with the comparison
    result = _as_far_as(stored, outcome.result)
    comparison = compare(stored, result, tolerance, extra_fails=True)
    identical = _equal_result(stored, result)
    verdict: Verdict = "bit-identical" if identical else "within tolerance" if comparison.equal else "differs"
    changes = [*edited, *_changes(manifest, outcome), *(f"set: {name} = {value}" for name, value in settings.items())]
    return Rerun(Path(directory), manifest, outcome, comparison, verdict, tuple(changes), paths, stored.failure)


def _stored_scenario(manifest: Manifest, trust: bool) -> Scenario:
    """The scenario that a results folder holds; the log of all calls, which belongs to its folder, is not written
    again.
    """
    scenario = Scenario.load(manifest.directory, trust=trust)
    if scenario.table().master.log_calls:
        scenario.master(log_calls=False)
    return scenario


def _new_ones(warn: Callable[[str], None] | None, stored: Result) -> Callable[[str], None]:
    """Reports only what was not warned of before."""
    known = set(stored.summary.get("warnings", ()))

    def warn_new(text: str) -> None:
        if text not in known:
            (warn or LOG.warning)(text)

    return warn_new


def _edited(manifest: Manifest, trust: bool) -> list[str]:
    """Files that were edited since, in words; refused where nobody trusts them."""
    edited = manifest.edited()
    if edited and not trust:
        raise ProvenanceError("\n".join([*edited, "Undo that, or say that you trust what is there now (--trust)."]))
    return edited


def _demand_all_there(manifest: Manifest, settings: Mapping[str, Any]) -> None:
    """Refuse a run of which something is gone that is not set anew."""
    gone = manifest.missing({f"components.{name}" for name in settings} | set(settings))
    gone += [f"{made['text']} It cannot be run again." for made in manifest.objects.values() if not made["class"]]
    if gone:
        raise ProvenanceError("\n".join(gone))


def _check_out(manifest: Manifest, out: str | Path | None) -> None:
    if out is not None and Path(out).resolve() == manifest.directory.resolve():
        raise OutputError(f"{out} holds the results to be compared with; choose another folder for the new ones.")


def _as_far_as(stored: Result, result: Result) -> Result:
    """The new result; cut where the stored run was taken along by its program and the new one went on."""
    if stored.failure is None or not stored.failure.startswith(DID_NOT_END) or not len(stored.table):
        return result
    end = float(stored.time[-1])
    events = [event for event in result.events if not event.delivered_at > end][: len(stored.events)]
    packets = result.packets[: len(stored.packets)]  # what is kept in order of sending
    return replace(result, table=result.table[: len(stored.table)], events=events, packets=packets)


def _changes(manifest: Manifest, outcome: Outcome) -> list[str]:
    """Versions, models and originals that are not those of the stored results."""
    summary = outcome.result.summary
    before, now = manifest.versions, dict(summary["versions"])
    lines = [
        f"{name}: {before.get(name, 'not known')} then, {now.get(name, 'not known')} now"
        for name in sorted({*before, *now})
        if before.get(name) != now.get(name)
    ]
    models = {c["name"]: c for c in manifest.data.get("components", ())}
    for component in summary["components"]:
        former = models.get(component["name"], {}).get("guid")
        if former != component["guid"]:
            lines.append(f"{component['name']}: model {former} then, {component['guid']} now")
    notes = [
        f"{part['path']}: {part['note']}"
        for foreign in manifest.data["files"]
        for part in foreign["parts"]
        if part.get("note")
    ]
    notes += [made["text"] for made in manifest.objects.values()]
    return lines + notes + manifest.moved_on()
