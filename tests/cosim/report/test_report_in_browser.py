"""The pages in a real browser: on a desktop, on a phone, on paper."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from browser import PHONE, check_page, open_page
from synthetic_run import OBSERVERS, synthetic_result, synthetic_spec

from cosim.diagnostics.messages import Message
from cosim.evaluation.spec import ReportSpec
from cosim.report.page.overlay import write_overlay
from cosim.report.page.run_page import write_report
from cosim.results.result import Result

pytestmark = pytest.mark.browser

SENTENCE = (
    "A rather long sentence that a component logged, "
    "with/a/path/that/does_not_break/anywhere_at_all/because_it_is_one_word. "
)


def talkative() -> Result:
    """A failed run with long texts wherever somebody else writes them."""
    result = synthetic_result(step=0.2)
    long = "unbreakable_" * 15
    summary = dict(result.summary) | {
        "warnings": [SENTENCE * 4, long],
        "notes": [SENTENCE],
        "description": SENTENCE * 3,
    }
    summary |= {
        "components": [{"name": long, "kind": "FMU", "source": f"/{long}.fmu", "cost": {"doStep": {"calls": 9}}}]
    }
    messages = [Message(0.1 * i, "locomotive", "warning", "logAll", SENTENCE) for i in range(150)]
    return replace(result, summary=summary, failure=SENTENCE, messages=messages)


@pytest.fixture(scope="module")
def report(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_report(talkative(), synthetic_spec(), tmp_path_factory.mktemp("report"))


def test_report_is_fit_for_screen_phone_and_paper(report: Path) -> None:
    check_page(report)


def test_overlay_is_fit_for_screen_phone_and_paper(tmp_path: Path) -> None:
    results = [synthetic_result(step=0.2), talkative(), synthetic_result(step=0.4, seed=1)]
    spec = replace(synthetic_spec(), observers=OBSERVERS[:2])
    check_page(write_overlay(results, [spec] * 3, ["first", "a label of many words that may wrap", "l" * 40], tmp_path))


def test_report_without_roles_is_fit_as_well(tmp_path: Path) -> None:
    check_page(write_report(replace(synthetic_result(step=1.0), events=()), ReportSpec(), tmp_path))


def test_verdict_stands_first_and_in_sight(report: Path) -> None:
    with open_page(report, width=PHONE) as page:
        first = page.locator(".verdict")
        assert "ended early" in first.inner_text()
        place = first.bounding_box()
        assert place is not None
        assert place["y"] + place["height"] < 900  # the height of the window


def test_long_lists_are_folded_on_screen_and_open_on_paper(report: Path) -> None:
    seen = "() => document.querySelector('#messages-of-the-components td').checkVisibility()"
    with open_page(report) as page:
        assert page.evaluate(seen) is False
        page.emulate_media(media="print")
        assert page.evaluate(seen) is True
