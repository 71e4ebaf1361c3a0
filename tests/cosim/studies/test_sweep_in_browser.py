"""The page of a sweep of more runs than have a page each, in a browser, from its file."""

from __future__ import annotations

import shlex
from pathlib import Path

import pytest
from browser import check_page, open_page
from small_scenarios import small

from cosim.cli import main
from cosim.studies.sweep_files import MOST_PAGES, run_folder, write_index
from cosim.studies.sweep_runs import SweepRun, SweepRuns

pytestmark = pytest.mark.browser
RUNS, CHOSEN = 200, 150
LARGEST = 3e6
"""Bytes of a page."""


def swept(folder: Path) -> SweepRuns:
    """Made-up measures of many runs; the results of one of them are there."""
    runs = [
        SweepRun(
            number=i,
            settings={"locomotive.mass": 70e3 + 100.0 * i, "seed": i % 7},
            measures={f"observer.measure_{k}": float((i * k) % 11) for k in range(30)},
            folder=folder / run_folder(i),
        )
        for i in range(RUNS)
    ]
    small().run().write(folder / run_folder(CHOSEN), report=False)
    return SweepRuns(small(), ["locomotive.mass", "seed"], runs)


def test_a_click_on_a_run_without_a_page_leads_to_it(tmp_path: Path) -> None:
    assert RUNS > MOST_PAGES
    folder = tmp_path / 'of "many" runs & more'
    path = write_index(swept(folder), folder)["page"]
    assert path.stat().st_size < LARGEST
    check_page(path)
    with open_page(path) as page:
        page.locator("tbody tr").nth(CHOSEN).locator("button.link").click()
        offer = page.locator(".offer")
        command = shlex.split(offer.locator("code").inner_text())
        assert command == ["cosim", "open", str(folder / run_folder(CHOSEN))]
        assert main([*command[1:], "--no-browser"]) == 0
        offer.locator("a").click()
        page.wait_for_selector("#explorer[data-ready]")
        page.go_back()
        line = page.locator("polyline.run").nth(3)
        line.dispatch_event("click")
        assert page.locator(".offer code").inner_text().endswith(run_folder(3) + '"')
