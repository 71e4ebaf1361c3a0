"""The structure of a scenario before its run, against structures known by hand and against the run itself."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from hand_made_structures import coupled
from small_scenarios import small
from test_fmus.build import linear_fmu
from test_fmus.events import countdown_fmu, periodic_fmu, receiver_fmu, triggered_fmu
from test_fmus.typed import typed_fmu

from cosim import Scenario
from cosim.errors import CouplingError, FmuLoadError
from fmus.tables.plain_data import jsonable

DIRECT: Any = {"A": [[-1.0]], "B": [[1.0]], "C": [[1.0]], "D": [[0.5]], "inputs": ["u"], "outputs": ["y"]}
HOLDING: Any = DIRECT | {"D": [[0.0]]}


@pytest.fixture
def loops(tmp_path: Path) -> Scenario:
    """A state fed back through a direct part; two direct parts in an algebraic loop; a target of both."""
    linear_fmu(tmp_path, "direct", version=2, **DIRECT)
    linear_fmu(tmp_path, "holding", version=3, units={"u": "N", "y": "m"}, **HOLDING)
    scenario = Scenario(stop=1.0, step=0.1, folder=tmp_path)
    scenario.add("left", fmu="direct.fmu").add("right", fmu="direct.fmu")
    scenario.add("plant", fmu="holding.fmu").add("controller", fmu="direct.fmu", every=2)
    return scenario.connect(
        "plant.y -> controller.u", "controller.y -> plant.u", "left.y -> right.u", "right.y -> left.u"
    )


@pytest.mark.compiler
def test_order_groups_loops_and_what_is_held(loops: Scenario) -> None:
    structure = loops.structure()
    assert structure.groups == (("left", "right"), ("plant", "controller"))
    assert structure.order == ("left", "right", "plant", "controller")
    assert [str(link) for link in structure.held] == ["controller.y -> plant.u"]
    ((*path, last),) = structure.loops
    assert last == path[0]
    assert set(path) == {("left", "u"), ("left", "y"), ("right", "u"), ("right", "y")}
    assert {str(k): (k.in_loop, k.iterated) for k in structure.links} == {
        "plant.y -> controller.u": (False, False),
        "controller.y -> plant.u": (False, False),
        "left.y -> right.u": (True, True),
        "right.y -> left.u": (True, True),
    }
    assert structure.algorithm == "iterate"
    assert "algebraic loop" in structure.reason
    plant, controller = structure.part("plant"), structure.part("controller")
    assert [(p.text, p.depends_on, p.connected) for p in plant.outputs] == [("y [m]", (), True)]
    assert [p.depends_on for p in controller.outputs] == [("u",)]
    assert (plant.kind, plant.fmi_version, plant.rate, controller.rate) == ("FMU", "3.0", "", "every 2 steps")
    assert "saves state" in plant.abilities


@pytest.mark.compiler
def test_jacobi_holds_everything_and_what_it_cannot_solve_is_reported(loops: Scenario) -> None:
    structure = loops.copy().master(algorithm="jacobi").structure()
    assert {link.held for link in structure.links} == {True}
    assert any("does not solve the algebraic loop" in warning for warning in structure.warnings)
    with pytest.raises(CouplingError, match="does not solve the algebraic loop"):
        loops.copy().master(algorithm="jacobi").run()


@pytest.mark.compiler
def test_the_run_steps_in_the_order_and_by_the_algorithm_shown(loops: Scenario) -> None:
    structure, outcome = loops.structure(), loops.run(warn=lambda _: None)
    assert outcome.failure is None
    assert tuple(outcome.result.summary["order"]) == structure.order
    described = {c["name"]: c for c in outcome.result.summary["components"]}
    for part in structure.parts:
        assert (described[part.name]["fmi_version"], described[part.name]["kind"]) == (part.fmi_version, part.kind)


@pytest.mark.compiler
def test_the_shipped_scenario_hangs_together_as_it_runs() -> None:
    scenario = Scenario.load("freight_profile_d")
    structure = scenario.structure()
    outcome = scenario.run(overrides={"stop": 0.1}, warn=lambda _: None)
    assert tuple(outcome.result.summary["order"]) == structure.order
    assert structure.balises is not None
    receivers = {e for event in outcome.result.events for e in event.outcomes}
    assert receivers <= set(structure.balises.receivers)
    recorded = {s.name for s in outcome.result.signals}
    assert {f"{p.name}.{o.name}" for p in structure.parts for o in p.outputs} <= recorded


def test_nothing_is_built_loaded_or_instantiated(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: Any, **__: Any) -> Any:
        raise AssertionError("not for a look at the structure")

    for place in ("fmus.cache.cache_entry", "cosim.components.component.Component.instantiate", "ctypes.CDLL.__init__"):
        monkeypatch.setattr(place, refuse)
    scenario = Scenario.load("freight_profile_d").set("driver.as", "block3")
    structure = scenario.structure()
    assert {part.name for part in structure.parts if part.kind == "block"} == {"driver"}
    with pytest.raises((AssertionError, FmuLoadError), match="not for a look"):
        scenario.run()


@pytest.mark.compiler
def test_clocks_and_arrays(tmp_path: Path) -> None:
    triggered_fmu(tmp_path, "alarm")
    receiver_fmu(tmp_path, "listener")
    typed_fmu(tmp_path, "typed")
    scenario = Scenario(stop=1.0, step=0.1, folder=tmp_path)
    for name, fmu in {"alarm": "alarm", "listener": "listener", "a": "typed", "b": "typed"}.items():
        scenario.add(name, fmu=f"{fmu}.fmu")
    scenario.connect(
        "alarm.crossing -> listener.tick", "alarm.crossing_value -> listener.tick_value", "a.y_matrix -> b.u_matrix"
    )
    structure = scenario.structure()
    assert [str(clock) for clock in structure.clocks] == ["alarm.crossing -> listener.tick"]
    assert [str(k) for k in structure.links] == [
        "alarm.crossing_value -> listener.tick_value",
        "a.y_matrix -> b.u_matrix",
    ]
    kinds = {p.name: p.kind for p in structure.part("a").outputs}
    assert (kinds["y_matrix"], kinds["y_string"]) == ("Float64[2x3]", "String")
    assert {p.name for p in structure.part("b").inputs if p.connected} == {"u_matrix"}


@pytest.mark.compiler
def test_input_clocks_say_when_they_tick(tmp_path: Path) -> None:
    for name, fmu in {"sampler": periodic_fmu, "bell": countdown_fmu}.items():
        fmu(tmp_path, name)
    scenario = Scenario(stop=1.0, step=0.1, folder=tmp_path)
    for name in ("sampler", "bell"):
        scenario.add(name, fmu=f"{name}.fmu")
    lines = {line.split()[0]: line for line in section(scenario.structure().text(), "Inputs and outputs")}
    assert lines["sampler.tick"].endswith("Clock    ticks by the time (constant)")
    assert lines["bell.alarm"].endswith("ticks by the time (countdown)")
    assert lines["sampler.u"].endswith("keeps its start value")


def test_mistakes_are_named_as_a_run_names_them(tmp_path: Path) -> None:
    with pytest.raises(FmuLoadError, match=r"script: components\.plant: .*missing\.fmu"):
        Scenario(stop=1.0, step=0.1, folder=tmp_path).add("plant", fmu="missing.fmu").structure()
    with pytest.raises(CouplingError, match="did you mean 'effort'"):
        small().connect("driver.effrot -> odometer.wheel_speed").structure()


# -- text
# ---------------------------------------------------------------------------------------------------------------


def section(text: str, title: str) -> list[str]:
    """Lines of a section, without its title and the rule below the headings."""
    lines = next(s for s in text.split("\n\n") if s.startswith(title)).split("\n")[1:]
    return [line for line in lines if line.strip("-")]


def test_every_component_signal_and_connection_is_in_the_text() -> None:
    structure = small().structure()
    text = structure.text()
    for link in structure.links:
        (line,) = (
            row
            for row in section(text, "Connections")
            if row.split()[0:3:2] == [".".join(s) for s in (link.source, link.target)]
        )
        assert ("held, of the start of the step" in line) == link.held
        assert ("fresh, of the end of the step" in line) == (not link.held)
    rows = section(text, "Components")[1:]
    assert [row.split()[:2] for row in rows if row] == [[str(i), n] for i, n in enumerate(structure.order, 1)]
    signals = section(text, "Inputs and outputs")[1:]
    assert len(signals) == sum(len(p.inputs) + len(p.outputs) for p in structure.parts)
    assert any("odometer.reading" in s and "output" in s and "m/s" in s and "driver.odometer" in s for s in signals)
    assert section(text, "Algebraic loops") == ["  none"]
    assert any("observer" in line for line in section(text, "Balises"))
    assert structure.reason in text
    assert not any(line != line.rstrip() for line in text.split("\n"))


def test_columns_are_aligned() -> None:
    rows = section(small().structure().text(), "Connections")
    (place,) = {row.index("->") for row in rows[1:]}
    assert rows[0].index("value used") == max(
        row.index("held") if "held" in row else row.index("fresh") for row in rows[1:]
    )
    assert place > 0


def test_a_terminal_is_not_exceeded() -> None:
    structure = coupled([f"component_{i}" for i in range(6)], [(0, i, 1) for i in range(6)])
    assert max(map(len, structure.text().split("\n"))) > 100
    narrow = structure.text(width=100)
    assert max(map(len, narrow.split("\n"))) <= 100
    assert {w.strip("-") for w in structure.text().split()} <= {w.strip("-") for w in narrow.split()}


def test_plain_data_survives_json() -> None:
    structure = small().structure()
    data = json.loads(json.dumps(structure.to_dict()))
    assert data == jsonable(structure.to_dict())
    assert data["order"] == list(structure.order)
    assert {tuple(k["source"]) for k in data["links"]} == {k.source for k in structure.links}
