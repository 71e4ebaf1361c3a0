"""What the page of the multi-vehicle train says of 20 seeds holds for the shipped one, which is among them."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from cosim import Scenario

pytestmark = pytest.mark.compiler
DOCS = Path(__file__).parents[3] / "docs"


# the gallery repeats the numbers of all four; these have all that the table tells, without and with estimates
@pytest.mark.parametrize("name", ["freight_sc2", "freight_sc3"])
def test_the_shipped_seed_is_within_the_table_of_twenty_seeds(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(DOCS / "studies"))
    monkeypatch.syspath_prepend(str(DOCS / "gallery" / "freight_trains"))
    import stories  # type: ignore[import-not-found] # a script of the documentation

    outcome = Scenario.load(name).run(warn=lambda _warning: None)
    page = (DOCS / "theses" / "multi_vehicle_train.md").read_text(encoding="utf-8")
    reported = {
        cells[1].strip(): cells[1 + int(name[-1])].strip()
        for line in page.splitlines()
        if len(cells := line.split("|")) == 7
    }
    for quantity, number in stories.story(outcome).items():
        cell = reported[quantity]
        if " of " in cell:
            count, seeds = map(int, cell.split(" of "))
            assert number in ({0.0} if count == 0 else {1.0} if count == seeds else {0.0, 1.0}), quantity
        else:
            low, high = (
                map(float, cell.partition("(")[2].rstrip(")").split(" to ")) if "(" in cell else [float(cell)] * 2
            )
            margin = 0.01 * max(abs(low), abs(high)) + 1e-9  # the cells have three digits
            assert low - margin <= number <= high + margin, quantity
    for module in ("stories", "train_scenarios"):
        sys.modules.pop(module)
