"""The line Amsterdam - Utrecht: its balise groups, and the scenario over them."""

from __future__ import annotations

import csv

import numpy as np
import pytest

from cosim.balises.layout import TrackLayout, from_csv
from cosim.scenario.shipped import SHIPPED

FILE = "amsterdam_utrecht_balise_groups.csv"


def layout() -> TrackLayout:
    return from_csv(str(SHIPPED / FILE))


def rows() -> list[dict[str, str]]:
    lines = (SHIPPED / FILE).read_text(encoding="utf-8").splitlines()
    return list(csv.DictReader(line for line in lines if not line.startswith("#")))


def test_the_groups_lie_as_the_train_heard_them() -> None:
    """Numbers counted from the source by somebody else."""
    linked = [float(row["position_linked"]) for row in rows() if row["position_linked"]]
    assert len(layout().balises) == 98
    assert len(linked) == 96
    assert layout().positions[2:].tolist() == linked
    gaps = np.diff(linked)
    assert (gaps.min(), gaps.max()) == (50.0, 874.0)
    assert np.percentile(gaps, [25, 50, 75]).tolist() == [66.0, 229.0, 493.0]
    assert round(float(np.percentile(gaps, 95))) == 788
    assert round(float(gaps.mean())) == 313
    assert linked[-1] - linked[0] == pytest.approx(29.7e3, abs=50.0)
    # half of the way lies in gaps of 501 m or more
    longest_first = np.sort(gaps)[::-1]
    assert longest_first[np.searchsorted(np.cumsum(longest_first), gaps.sum() / 2)] == 501.0


def test_positions_follow_from_the_columns_of_the_source() -> None:
    """Linked where linked; before that the plan, moved to agree at the first linked group of its section."""
    first = next(row for row in rows() if row["position_linked"])
    moved = float(first["position_linked"]) - float(first["position_plan"])
    for row, balise in zip(rows(), layout().balises, strict=True):
        plan = float(row["position_plan"]) + (moved if row["section"] == first["section"] else 0.0)
        assert balise.position == (float(row["position_linked"]) if row["position_linked"] else plan)
        assert balise.identity == f"{row['nid_c']}-{row['nid_bg']}"


def test_source_and_licence_are_in_the_file() -> None:
    head = (SHIPPED / FILE).read_text(encoding="utf-8")[:1200]
    assert "openETCS/modeling" in head
    assert "EUPL" in head
