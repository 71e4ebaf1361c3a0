"""What became of the expectations of a scenario, for the report: verdict first, what is not met before what is."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

from cosim.evaluation.facts import list_entry
from cosim.expectations.judged import Judged
from cosim.report.page.parts import box, bullets, scrolling
from cosim.results.result import Result


def unmet_box(result: Result) -> str:
    """A box with what is not met; empty where all is as expected."""
    judged = _judged(result)
    unmet = [j for j in judged if not j.passed]
    if not unmet:
        return ""
    return box(
        "failure", f"{len(unmet)} of {len(judged)} expectations not met", bullets(f"{j.name}: {j.text}" for j in unmet)
    )


def expectations_table(result: Result) -> list[str]:
    """All expectations with what was measured; empty where the scenario has none."""
    judged = _judged(result)
    return [_table([*(j for j in judged if not j.passed), *(j for j in judged if j.passed)])] if judged else []


def _judged(result: Result) -> list[Judged]:
    return [Judged.from_data(data) for data in list_entry(result, "expectations")]


def _table(judged: Sequence[Judged]) -> str:
    head = "".join(f'<th scope="col">{text}</th>' for text in ("Verdict", "Expected", "Measured"))
    verdicts = {True: '<th scope="row">met</th>', False: '<th scope="row" class="bad">not met</th>'}
    body = "\n".join(f"<tr>{verdicts[j.passed]}<td>{escape(j.name)}</td><td>{escape(j.text)}</td></tr>" for j in judged)
    return scrolling(f"<table>\n<thead><tr>{head}</tr></thead>\n<tbody>\n{body}\n</tbody>\n</table>")
