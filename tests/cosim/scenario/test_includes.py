"""Files that include others: what is merged how, where paths start, and which file is named for a fault."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from copy import deepcopy
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from small_scenarios import small

from cosim import Scenario
from cosim.cli import main
from cosim.errors import CosimError, ScenarioError
from cosim.results.results_folder import read_results
from cosim.scenario.merging import merge

Write = Callable[[str, str], Path]


@pytest.fixture
def write(tmp_path: Path) -> Write:
    """Writes a file beside ``base.toml``, which holds the small scenario, and returns its path."""
    small(title="Base").save(tmp_path / "base.toml")

    def put(name: str, text: str) -> Path:
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
        return path

    return put


def test_a_file_that_only_includes_runs_identically(write: Write) -> None:
    table = Scenario.load(write("mine.toml", 'include = "base.toml"')).run().result.table
    np.testing.assert_array_equal(table, small().run().result.table)


def test_tables_are_merged_later_wins_and_lists_are_replaced(write: Write) -> None:
    write("heavy.toml", 'title = "Heavy"\n[components.locomotive.parameters]\nmass = 95e3\ntrain_speed = 9.0\n')
    mine = write("mine.toml", 'include = ["base.toml", "heavy.toml"]\n[balises]\npositions = [2.0]\nlatency = 0.1\n')
    table = Scenario.load(mine).table()
    parameters = table.components["locomotive"].parameters
    assert table.title == "Heavy"
    assert (parameters["mass"], parameters["train_speed"], parameters["wheel_rate"]) == (95e3, 9.0, 10.0 / 0.575)
    assert table.balises is not None
    assert (table.balises.positions, table.balises.latency, table.balises.method) == ([2.0], 0.1, "rollback")
    order = Scenario.load(write("other.toml", 'include = ["heavy.toml", "base.toml"]')).table()
    assert (order.title, order.components["locomotive"].parameters["train_speed"]) == ("Base", 10.0)


LEAVES = st.integers() | st.text(max_size=3) | st.lists(st.integers(), max_size=2) | st.just(True)
TREES = st.recursive(
    LEAVES, lambda inner: st.dictionaries(st.sampled_from("abcd"), inner, min_size=1, max_size=3), max_leaves=8
)
TABLES = st.dictionaries(st.sampled_from("abcd"), TREES, max_size=4)


def leaves(tree: Mapping[str, Any], path: tuple[str, ...] = ()) -> dict[tuple[str, ...], Any]:
    """Every value that is no table, by its path."""
    found: dict[tuple[str, ...], Any] = {}
    for name, value in tree.items():
        found |= leaves(value, (*path, name)) if isinstance(value, Mapping) else {(*path, name): value}
    return found


@settings(max_examples=200)
@given(TABLES, TABLES)
def test_what_the_later_file_says_holds_and_the_rest_is_the_earlier_ones(
    earlier: dict[str, Any], later: dict[str, Any]
) -> None:
    """Leaf by leaf: those of the later tables, and those of the earlier ones that no later one stands above, at or
    below.
    """
    merged = deepcopy(earlier)
    merge(merged, deepcopy(later))
    new = leaves(later)
    old = {k: v for k, v in leaves(earlier).items() if not any(k[: len(n)] == n or n[: len(k)] == k for n in new)}
    assert leaves(merged) == old | new


def test_connections_are_appended_and_one_to_a_connected_input_replaces(write: Write) -> None:
    added = ["locomotive.speed -> odometer.wheel_speed", "locomotive.speed -> observer.odometer"]
    mine = write("mine.toml", f'include = ["base.toml"]\nconnections = {added}')
    assert Scenario.load(mine).table().connections == [
        "driver.effort -> locomotive.effort, observer.effort",
        "odometer.reading -> driver.odometer",
        *added,
    ]


def test_an_input_can_be_left_free_and_a_component_taken_out_with_its_connections(write: Write) -> None:
    free = Scenario.load(write("free.toml", 'include = ["base.toml"]\nconnections = ["-> observer.effort"]')).table()
    assert "driver.effort -> locomotive.effort" in free.connections
    alone = Scenario.load(
        write("alone.toml", 'include = ["base.toml"]\nbalises = false\n[components]\nobserver = false\n')
    )
    table = alone.table()
    assert set(table.components) == {"locomotive", "odometer", "driver"}
    assert not any("observer" in str(line) for line in table.connections)
    assert table.balises is None
    assert alone.run().failure is None


def test_another_model_starts_anew_and_another_file_of_an_fmu_keeps_its_parameters(write: Write) -> None:
    write("one.toml", "stop = 1.0\nstep = 0.1\n[components.plant]\nfmu = 'v1.fmu'\nparameters = { mass = 2.0 }\n")
    new = (
        Scenario.load(write("two.toml", "include = 'one.toml'\n[components.plant]\nfmu = 'v2.fmu'\n"))
        .table()
        .components["plant"]
    )
    assert (Path(str(new.fmu)).name, new.parameters) == ("v2.fmu", {"mass": 2.0})
    text = "include = 'base.toml'\n[components.observer]\nobserver = 'multirate_cdo'\n"
    other = Scenario.load(write("other.toml", text)).table().components["observer"]
    assert (other.observer, other.backend, other.parameters) == ("multirate_cdo", None, {})


def test_paths_stay_relative_to_the_file_they_stand_in(
    write: Write, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write("track/csv.toml", '[balises]\nlayout = "csv"\nfile = "here.csv"\n')
    write("track/here.csv", "identity,position\nA,1.0\n")
    mine = write("runs/deep/mine.toml", 'include = ["../../base.toml", "../../track/csv.toml"]')
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    monkeypatch.chdir(elsewhere)
    assert [e.identity for e in Scenario.load(mine).run().result.events] == ["A"]


def test_overrides_come_last_and_those_of_an_included_file_before_the_file_that_includes_it(write: Write) -> None:
    write(
        "one.toml",
        'include = ["base.toml"]\nstop = 0.2\n[overrides]\nstop = 0.3\n"locomotive.mass" = 70e3\ndriver.as = '
        '"block2"\n',
    )
    two = write("two.toml", 'include = ["one.toml"]\n[components.locomotive]\nparameters = { mass = 60e3 }\n')
    three = write(
        "three.toml", 'include = ["two.toml"]\nstop = 0.1\n[overrides]\nlocomotive.mass = 50e3\nbalises.seed = 4\n'
    )
    loaded = [Scenario.load(path).table() for path in (two.with_name("one.toml"), two, three)]
    assert [table.components["locomotive"].parameters["mass"] for table in loaded] == [70e3, 60e3, 50e3]
    assert [table.stop for table in loaded] == [0.3, 0.3, 0.1]
    assert [table.components["driver"].backend for table in loaded] == ["block2"] * 3
    assert loaded[2].balises is not None
    assert loaded[2].balises.seed == 4


def test_what_is_set_on_the_command_line_wins(write: Write, tmp_path: Path) -> None:
    mine = write("mine.toml", 'include = ["base.toml"]\n[overrides]\nstop = 0.3\n')
    out = str(tmp_path / "out")
    assert main(["run", str(mine), "--set", "stop=0.2", "--out", out, "--no-report", "--quiet"]) == 0
    assert read_results(out).time[-1] == 0.2


def test_a_shipped_scenario_can_be_included(write: Write) -> None:
    mine = write("mine.toml", 'include = ["freight_profile_d"]\nstop = 10.0\n[components]\nmultirate_cdo = false\n')
    table = Scenario.load(mine).table()
    assert table.stop == 10.0
    assert "discrete_uio" in table.components
    assert "multirate_cdo" not in table.components


FAULTS = {
    "schema": (
        '[components.driver]\nmodle = "driver"\n',
        "",
        r"part\.toml: components\.driver\.modle: unknown key.*included by .*mine",
    ),
    "model": (
        '[components.driver]\nmodel = "drivr"\n',
        "",
        r"part\.toml: components\.driver: unknown model 'drivr'.*included by",
    ),
    "own": (
        "",
        "[components.driver]\npreset = 'x'\n",
        r"mine\.toml: components\.driver: driver has no preset(?!.*included)",
    ),
    "line": ('connections = ["driver.effort"]\n', "", r"part\.toml: connections, line 4: .*included by"),
    "override": (
        "[overrides]\n'drver.x' = 1\n",
        "",
        r"part\.toml: overrides: cannot set 'drver\.x'.*did you mean 'driver'",
    ),
    "own override": ("", "[overrides]\n'balise.seed' = 1\n", r"mine\.toml: overrides: .*did you mean 'balises'"),
    "no table": ("", "overrides = 3\n", r"mine\.toml: overrides: expected a table"),
    "removed": (
        "",
        "[components]\nobsrver = false\n",
        r"mine\.toml: components\.obsrver = false.*did you mean 'observer'",
    ),
    "free": (
        "",
        "connections = ['-> driver.odometr']\n",
        r"mine\.toml: connections: .*did you mean 'driver\.odometer'",
    ),
    "no list": ("connections = 'a -> b'\n", "", r"part\.toml: connections: expected a list"),
    "toml": ("[[[", "", r"part\.toml: not readable as TOML.*included by .*mine\.toml"),
}


@pytest.mark.parametrize("case", FAULTS)
def test_a_fault_is_reported_with_the_file_it_stands_in(case: str, write: Write) -> None:
    part, mine, message = FAULTS[case]
    write("part.toml", 'include = "base.toml"\n' + part if part != "[[[" else part)
    with pytest.raises(CosimError, match=message):
        Scenario.load(write("mine.toml", 'include = ["part.toml"]\n' + mine)).run()


def test_files_that_include_one_another_are_refused_with_the_chain(write: Write) -> None:
    write("a.toml", 'include = "b.toml"')
    write("b.toml", 'include = ["base.toml", "c.toml"]')
    c = write("c.toml", 'include = "a.toml"')
    for path, names in ((c, "cabc"), (write("m.toml", 'include = "m.toml"'), "mm")):
        with pytest.raises(ScenarioError) as caught:
            Scenario.load(path)
        chain = " -> ".join(str(path.parent / f"{name}.toml") for name in names)
        assert str(caught.value) == f"Scenario files include one another in a circle: {chain}."


@pytest.mark.parametrize(
    ("include", "message"),
    [
        ('"nowhere.toml"', r"mine\.toml: include: Scenario file .*nowhere\.toml does not exist"),
        ('"freight_profile_e"', r"mine\.toml: include: No scenario .*did you mean 'freight_profile_d'"),
        ("3", r"mine\.toml: include: expected a list"),
        ('["base.toml", 3]', r"mine\.toml: include: expected a list"),
        ('"system.ssp"', r"mine\.toml: include: system\.ssp is a system structure package"),
    ],
)
def test_what_cannot_be_included_is_reported(include: str, message: str, write: Write) -> None:
    with pytest.raises(ScenarioError, match=message):
        Scenario.load(write("mine.toml", f"include = {include}"))


def test_a_file_may_be_included_twice(write: Write) -> None:
    write("one.toml", 'include = "base.toml"\nstop = 0.2\n')
    write("two.toml", 'include = "base.toml"\nstep = 0.02\n')
    table = Scenario.load(write("mine.toml", 'include = ["one.toml", "two.toml"]')).table()
    assert (table.stop, table.step, len(table.connections)) == (0.5, 0.02, 3)
