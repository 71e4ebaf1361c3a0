"""The accuracy of the plants is what the page says; a part of its table is computed again."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

DOCS = Path(__file__).parents[2] / "docs"


@pytest.mark.parametrize(("run", "output"), [("60 kN from rest", "speed"), ("as printed", "x1")])
def test_the_error_at_the_shipped_step_is_that_of_the_page(
    run: str, output: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.syspath_prepend(str(DOCS / "studies"))
    import accuracy  # type: ignore[import-not-found] # a script of the documentation

    journey = next(j for j in accuracy.JOURNEYS if j.what == run)
    (found,) = accuracy.errors(journey, (1.0,))
    page = (DOCS / "reference" / "accuracy.md").read_text(encoding="utf-8")
    row = next(line for line in page.splitlines() if f"| `{journey.plant}` | {run} |" in line and "(shipped)" in line)
    said = next(word.split()[1] for word in row.split("|")[4].split(",") if word.split()[0] == output)
    assert found[output] == pytest.approx(float(said), rel=0.1)
    sys.modules.pop("accuracy")
