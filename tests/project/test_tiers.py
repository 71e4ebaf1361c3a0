"""The tiers follow from times that were measured: they fit the tests that there are, and the first tier its budget."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
import tiers

TESTS = tiers.ROOT / "tests"
AGAIN = "measure anew: python -m pytest -q -n 2 --dist worksteal --measure -m 'not slow or follows'"


def test_the_first_tier_is_within_its_budget() -> None:
    """The cheapest remedy is a smaller `tiers.LIMIT`; the best one a law that needs less."""
    spent = 0.0
    for laws in tiers.measured().values():
        for law, cases in laws.items():
            spent += sum(seconds for case, seconds in cases.items() if not law or case not in tiers.left(cases))
    assert spent <= tiers.BUDGET


def test_the_times_are_those_of_the_tests_that_there_are() -> None:
    """One in ten may be unknown or gone: those that are unknown are in the first tier, which so grows unseen."""
    files = {path.relative_to(tiers.ROOT).as_posix() for path in TESTS.rglob("test_*.py")}
    assert len(files - set(tiers.measured())) <= len(files) / 10, AGAIN
    names = [(file, law.rpartition("::")[2]) for file, laws in tiers.measured().items() for law in laws if law]
    gone = [f"{file}::{law}" for file, law in names if file not in files or f"def {law}(" not in _text(file)]
    assert len(gone) <= len(names) / 10, f"{AGAIN}\ngone: {gone}"


def _text(file: str) -> str:
    return (tiers.ROOT / file).read_text(encoding="utf-8")


def test_of_a_law_the_quickest_cases_are_kept_and_of_what_is_new_all() -> None:
    half = tiers.LIMIT / 2.0
    assert tiers.left({"[a]": 1.2 * half, "[b]": half, "[c]": 0.1}) == {"[a]"}
    assert tiers.left({"": 2.1 * half}) == {""}
    assert tiers.left({"": 1.9 * half}) == set()
    assert not tiers.is_dear("tests/test_new.py::test_new[case]")


def test_what_a_run_measures_stands_in_the_place_of_what_was_known(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tiers, "TIMES", tmp_path / "times.json")
    monkeypatch.setattr(tiers, "measured", lambda: {"tests/gone.py": {"": {"": 1.0}}, "tests/tiers.py": {}})
    dear = 2.0 * tiers.LIMIT
    tiers.write_times({"tests/a.py::test_law[1]": dear, "tests/a.py::test_law[2]": 0.1, "tests/a.py::test_other": 0.2})
    assert re.sub(r"\s", "", (tmp_path / "times.json").read_text()) == (
        f'{{"tests/a.py":{{"":{{"":0.2}},"test_law":{{"[1]":{dear},"[2]":0.1}}}},"tests/tiers.py":{{}}}}'
    )


def test_what_follows_from_a_room_changes_with_its_files_and_with_no_others(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("room/__init__.py", "room/laws.py", "room/data/a.c", "room/inner/__init__.py", "page.md"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(name)
    monkeypatch.setattr(tiers, "ROOT", tmp_path)
    monkeypatch.setattr(tiers, "FOLLOWS", tmp_path / "follows.json")
    tiers.FOLLOWS.write_text("{}")
    forget(monkeypatch)
    tiers.write_follows({"test": ["room", "page.md"]})
    assert tiers.has_changed("another test")
    assert not tiers.has_changed("test")
    for name, changes in (("room/inner/__init__.py", False), ("room/data/a.c", True), ("page.md", True)):
        (tmp_path / name).write_text("changed")
        forget(monkeypatch)
        assert tiers.has_changed("test") == changes
        (tmp_path / name).write_text(name)


def forget(monkeypatch: pytest.MonkeyPatch) -> None:
    """Files are read once in a process."""
    for name in ("_digest", "_follows"):
        monkeypatch.setattr(tiers, name, getattr(getattr(tiers, name), "__wrapped__", getattr(tiers, name)))


def test_another_change_draws_another_sample() -> None:
    names = [f"test[{k}]" for k in range(1000)]
    one, other = ({name for name in names if tiers.is_drawn(name, seed, 4)} for seed in ("one", "other"))
    assert all(150 < len(drawn) < 350 for drawn in (one, other))
    assert len(one & other) < 120
