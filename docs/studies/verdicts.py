"""Holds the runs of the mutation study against baselines, as the fixture `fmu_regression` does; the verdicts are
rows.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from math import isfinite
from pathlib import Path
from tempfile import TemporaryDirectory

from manoeuvre import Conditions
from mutants import Mutation
from repetitions import Repetition

from cosim import Result
from cosim.baselines import Baseline, check, read_baseline, write_baseline
from cosim.comparison.comparison import Comparison
from cosim.comparison.tolerance import Tolerance, Tolerances
from cosim.comparison.verdict import SignalComparison
from cosim.results.shown_unit import ShownUnit

DEFAULT = Tolerance().relative
RELATIVE = (1e-3, DEFAULT, 1e-6)
THINNED = 0.04  # [s], so that its rows are points of all steps of the study
NOT_NESTED = 0.05, 0.02  # [s], rows of a baseline and communication step: neither has all points of the other


@dataclass(frozen=True)
class Row:
    """What became of one change or repetition.

    Args:
        group, change: what was done. caught: at each of `RELATIVE`.
        found: the worst signal and what is wrong with it, at the default. size: how large that is.
        others: how many more signals and telegrams. why, harmless: as of the mutation.
    """

    group: str
    change: str
    caught: tuple[bool, ...]
    found: str
    size: str
    others: str = ""
    why: str = ""
    harmless: bool = False

    @property
    def caught_by_default(self) -> bool:
        """At the default tolerance."""
        return self.caught[RELATIVE.index(DEFAULT)]


@dataclass(frozen=True)
class Evaluator:
    """The unchanged result and its baselines, read back from their files: one for each of `RELATIVE`, and a thinned
    one.
    """

    reference: Result
    baselines: Sequence[Baseline]
    thinned: Baseline

    def mutation(self, mutation: Mutation, backend: str = "fmu") -> Row:
        """Change one thing and compare."""
        result = mutation.make(self.reference, backend)
        return self._row(mutation.group, mutation.change, result, mutation.why, mutation.harmless)

    def repetition(self, repetition: Repetition) -> Iterator[Row]:
        """Run the same and compare; each result with the thinned baseline too."""
        for k in range(repetition.times):
            result = repetition.make()
            yield self._row(f"{k + 1}", repetition.what, result)
            thinned = check(result, self.thinned)
            yield Row(f"{k + 1}, thinned", repetition.what, (not thinned.equal,) * len(RELATIVE), *_reported(thinned))

    def not_nested(self) -> Row:
        """A run and a thinned baseline of which neither has all points of the other."""
        every, step = NOT_NESTED
        with TemporaryDirectory() as folder:
            baseline = _kept(self.reference, Path(folder) / "rows.json", DEFAULT, every)
        found = check(Conditions(step=step).run(), baseline)
        what = f"step {1000.0 * step:g} ms against a baseline with a row every {1000.0 * every:g} ms"
        return Row("not nested", what, (not found.equal,) * len(RELATIVE), *_reported(found))

    def _row(self, group: str, change: str, result: Result, why: str = "", harmless: bool = False) -> Row:
        found = [check(result, baseline) for baseline in self.baselines]
        caught = tuple(not comparison.equal for comparison in found)
        return Row(group, change, caught, *_reported(found[RELATIVE.index(DEFAULT)]), why, harmless)


@contextmanager
def evaluate() -> Iterator[Evaluator]:
    """The run, its baselines written to files and read again."""
    reference = Conditions().run()
    with TemporaryDirectory() as folder:
        baselines = [_kept(reference, Path(folder) / f"{k}.json", relative) for k, relative in enumerate(RELATIVE)]
        yield Evaluator(reference, baselines, _kept(reference, Path(folder) / "thinned.json", DEFAULT, THINNED))


def largest(comparison: Comparison) -> tuple[float, str]:
    """Largest value error as a multiple of what is allowed, and the signal."""
    ratios = [(s.max_error / s.allowed, s.name) for s in comparison.signals if isfinite(s.max_error)]
    return max(ratios, default=(0.0, ""))


def counted(rows: Iterable[Row]) -> tuple[int, int]:
    """How many are caught at the default tolerance, and how many there are."""
    caught = [row.caught_by_default for row in rows]
    return sum(caught), len(caught)


def _kept(reference: Result, path: Path, relative: float, every: float | None = None) -> Baseline:
    write_baseline(reference, path, tolerances=Tolerances.of(relative), every=every)
    return read_baseline(path)


def _reported(comparison: Comparison) -> tuple[str, str, str]:
    """What is worst, how large it is, and what else."""
    failed, telegrams = comparison.failed, comparison.events.differences
    if failed:
        balises = {(d.reference or d.result).identity for d in telegrams}  # type: ignore[union-attr]  # one of them is there
        more = [_number(len(failed) - 1, "signal"), _number(len(balises), "telegram")]
        return f"`{failed[0].name}`: {_kind(failed[0])}", _size(failed[0]), ", ".join(filter(None, more))
    if telegrams:
        kinds = ", ".join(sorted({d.kind for d in telegrams}))
        return f"telegrams: {kinds}", f"{comparison.events.max_shift:.2g} s" if comparison.events.max_shift else "", ""
    ratio, name = largest(comparison)
    return "", f"{ratio:.2g} of allowed, `{name}`" if ratio > 1e-3 else "nothing", ""


def _number(count: int, what: str) -> str:
    return f"{count} {what}{'s' if count > 1 else ''}" if count else ""


def _kind(signal: SignalComparison) -> str:
    return signal.findings[0].kind if signal.findings else signal.status


def _size(signal: SignalComparison) -> str:
    if not signal.findings or not isfinite(signal.findings[0].size):
        return ""
    worst = signal.findings[0]
    if worst.kind == "nan":
        return f"{worst.size:.0f} point"
    unit = "s" if worst.kind not in ("value", "jump_missing", "jump_extra") else signal.unit
    ratio = f", {worst.size / worst.allowed:.2g} × allowed" if worst.allowed > 0.0 else ""
    return f"{ShownUnit(unit).text(float(f'{worst.size:.3g}'))}{ratio}"
