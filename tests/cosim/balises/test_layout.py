"""Balise layouts: each balise is found once, files are read or refused with the line."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cosim.balises.layout import Balise, InstantLayout, TrackLayout, aperiodic, by_positions, by_spacing, from_csv
from cosim.errors import ScenarioError

places = st.lists(st.integers(-50, 50), min_size=1, max_size=12, unique=True).map(sorted)
motions = st.lists(st.integers(-60, 60), min_size=2, max_size=15)


@given(places, st.lists(st.integers(-60, 60), min_size=2, max_size=30).map(sorted), st.booleans())
def test_any_partition_of_a_motion_one_way_passes_each_balise_once(
    where: list[int], stops: list[int], back: bool
) -> None:
    """Stops may lie exactly on balises. A balise at the very start of the motion is not passed."""
    layout = by_positions(where)
    path = stops[::-1] if back else stops
    passed = [b.position for a, b_ in pairwise(path) for b in layout.crossed(a, b_)]
    inside = [p for p in where if (path[-1] <= p < path[0] if back else path[0] < p <= path[-1])]
    assert passed == (inside[::-1] if back else inside)


@given(places, motions, st.integers(1, 4))
def test_dividing_a_motion_to_and_fro_changes_nothing(where: list[int], path: list[int], parts: int) -> None:
    layout = by_positions(where)

    def passed(points: list[float]) -> list[float]:
        return [b.position for a, c in pairwise(points) for b in layout.crossed(a, c)]

    fine = [a + (c - a) * k / parts for a, c in pairwise(path) for k in range(parts)] + [path[-1]]
    assert passed(fine) == passed([float(p) for p in path])


@given(places, st.floats(-60.0, 60.0))
def test_gaps_are_the_nearest_on_either_side(where: list[int], position: float) -> None:
    behind, ahead = by_positions(where).gaps(position)
    assert behind == min([position - p for p in where if p < position], default=np.inf)
    assert ahead == min([p - position for p in where if p > position], default=np.inf)


@given(st.lists(st.floats(0.0, 10.0), min_size=1, max_size=10, unique=True).map(sorted), st.integers(1, 40))
def test_instants_are_found_once_on_any_axis(instants: list[float], count: int) -> None:
    layout = InstantLayout(np.array(instants))
    axis = [k * 10.0 / count for k in range(count)] + [10.0]
    found = [t for a, b in pairwise(axis) for t in layout.within(a, b)]
    assert found == [t for t in instants if t > 0.0]
    assert layout.identity(instants[-1]) == f"I{len(instants)}"


def test_spacing() -> None:
    layout = by_spacing(0.1, 0.1, 0.7, 2.0)
    assert len(layout.balises) == 7  # 0.7 is included although 0.1 + 6 * 0.1 is a rounding above it
    assert layout.balises[0] == Balise("B1", 0.1, 2.0)
    assert layout.nearest(0.26).identity == "B3"
    for spacing, first, last in ((0.0, 0.0, 1.0), (-1.0, 0.0, 1.0), (np.nan, 0.0, 1.0), (1.0, 5.0, 4.0)):
        with pytest.raises(ScenarioError):
            by_spacing(spacing, first, last)


@pytest.mark.parametrize(
    ("balises", "match"),
    [
        ((), "at least one"),
        ((Balise("a", 1.0), Balise("b", 1.0)), "number 2 at 1 m follows number 1 at 1 m"),
        ((Balise("a", 2.0), Balise("b", 1.0)), "increasing position"),
        ((Balise("a", np.nan),), "not a finite number"),
        ((Balise("a", 1.0), Balise("a", 2.0)), "identity of its own; used more than once: a"),
        ((Balise("a", 1.0, -2.0),), "'a': location accuracy must not be negative"),
    ],
)
def test_impossible_layouts_are_refused(balises: tuple[Balise, ...], match: str) -> None:
    with pytest.raises(ScenarioError, match=match):
        TrackLayout(balises)


def test_instants_must_increase() -> None:
    for bad in ([1.0, 1.0], [2.0, 1.0], [np.nan]):
        with pytest.raises(ScenarioError, match="finite and increasing"):
            InstantLayout(np.array(bad))


def test_balises_outside_the_track_are_refused() -> None:
    by_positions([1.0, 2.0]).check_within(1.0, 2.0)
    with pytest.raises(ScenarioError, match=r"'B2' at 2 m lies outside the track from 0 m to 1.5 m"):
        by_positions([1.0, 2.0]).check_within(0.0, 1.5)


def written(folder: Path, text: str, encoding: str = "utf-8") -> Path:
    path = folder / "balises.csv"
    path.write_text(text, encoding=encoding)
    return path


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig"])
def test_a_list_is_read(tmp_path: Path, encoding: str) -> None:
    path = written(tmp_path, "position, identity, location_accuracy\n10.5, Nord, 3\n\n20, ,\n", encoding)
    assert from_csv(path).balises == (Balise("Nord", 10.5, 3.0), Balise("B2", 20.0, 0.0))
    assert from_csv(path, 0.5).balises == (Balise("Nord", 10.5, 3.0), Balise("B2", 20.0, 0.5))


def test_lines_that_name_the_source_are_left_out(tmp_path: Path) -> None:
    path = written(tmp_path, "# surveyed in spring\nposition,section\n10.5,1\n# a gap\n20,2\n")
    assert from_csv(path).balises == (Balise("B1", 10.5), Balise("B2", 20.0))
    with pytest.raises(ScenarioError, match="line 5: could not convert"):
        from_csv(written(tmp_path, "# surveyed\nposition\n1\n# gap\nx\n"))


@pytest.mark.parametrize(
    ("text", "match"),
    [
        ("place\n1\n", "no column 'position' in the header"),
        ("", "no column 'position'"),
        ("position\n1\n\nx\n", "line 4: could not convert string to float: 'x'"),
        ("position\n2\n1\n", "increasing position"),
        ("position\n", "at least one"),
        ("position\nnan\n", "not a finite number"),
    ],
)
def test_a_bad_list_is_refused_with_its_line(tmp_path: Path, text: str, match: str) -> None:
    with pytest.raises(ScenarioError, match=match):
        from_csv(written(tmp_path, text))


def test_a_list_that_is_not_there_or_not_text(tmp_path: Path) -> None:
    with pytest.raises(ScenarioError, match="does not exist"):
        from_csv(tmp_path / "none.csv")
    path = tmp_path / "balises.csv"
    path.write_bytes(b"position\n\xff\xfe\n")
    with pytest.raises(ScenarioError, match="cannot be read"):
        from_csv(path)


@given(st.integers(0, 1000))
def test_aperiodic_gaps(seed: int) -> None:
    """Uniform gaps first, some stretched ones later; the same seed gives the same pattern, a longer run a longer
    one.
    """
    layout = aperiodic(30.0, seed)
    gaps = np.diff([0.0, *layout.instants])
    early = np.append(0.0, layout.instants[:-1]) <= 7.9
    assert np.all((gaps[early] >= 0.1) & (gaps[early] <= 0.5))
    assert np.all(gaps <= 1.25)
    np.testing.assert_array_equal(aperiodic(60.0, seed).instants[: len(gaps)], layout.instants)
    assert np.any(aperiodic(30.0, seed + 1).instants[:5] != layout.instants[:5])


def test_aperiodic_may_begin_anywhere_and_has_drop_outs() -> None:
    assert aperiodic(5.0, 1, start=-5.0).instants[0] < -4.0
    assert np.max(np.diff(aperiodic(300.0, 0).instants)) > 0.6
    for low, high in ((0.0, 0.5), (0.5, 0.1)):
        with pytest.raises(ScenarioError, match="0 < min_gap <= max_gap"):
            aperiodic(1.0, 0, min_gap=low, max_gap=high)


@pytest.mark.parametrize("last", [5.0e6, 1e20, 1e308, float("inf")])
def test_more_balises_than_a_line_has_are_refused_at_once(last: float) -> None:
    """1e20 / 5 balises would fill the memory."""
    with pytest.raises(ScenarioError, match=r"Balises every 5 m .* are more than 1e\+06"):
        by_spacing(5.0, 0.0, last)
    assert len(by_spacing(5.0, 0.0, 4990.0).positions) == 999
