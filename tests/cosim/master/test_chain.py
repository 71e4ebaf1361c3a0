"""The chain of a planned component: one order, told by `cosim show`, and nobody who goes around it."""

from __future__ import annotations

import ast
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from coupled_runs import prepare
from mock_slaves import Counter, component
from small_scenarios import small
from test_fmus.build import linear_fmu
from test_fmus.events import receiver_fmu, triggered_fmu

import cosim
from cosim import Scenario
from cosim.coupling.chain import Mover, Position, Stage
from cosim.coupling.planned import PlannedComponent
from cosim.master.master import Master, close

MOVES = {"move", "prepare", "drive", "advance", "step"}


def planned() -> PlannedComponent:
    return prepare([component(Counter(), "counter")], [], 0.1, 1).plan.steps[0]


def noting(position: Position, seen: list[str]) -> Stage:
    def around(word: str) -> Callable[[Mover], Mover]:
        def wrap(inner: Mover) -> Mover:
            def way(t: float, until: float) -> None:
                seen.append(f"{position.name} {word}")
                inner(t, until)

            return way

        return wrap

    return Stage(position, position.name, move=around("move"), drive=around("drive"))


@pytest.mark.parametrize("order", [list(Position), list(reversed(Position)), [2, 0, 3, 1]])
def test_stages_stand_in_one_order_whatever_the_order_in_which_they_are_added(order: list[int]) -> None:
    step, seen = planned(), list[str]()
    for position in order:
        step.add_stage(noting(Position(position), seen))
    step.component.enter_initialization(0.0, 1.0)
    step.component.exit_initialization()
    step.move(0.0, 0.1)
    names = [p.name for p in Position]
    assert seen == [f"{name} move" for name in names] + [f"{name} drive" for name in names]
    assert step.chain() == (*names, "advance, read outputs")
    assert step.taken_over
    step.component.free()


def test_a_stage_replaces_the_one_at_its_position() -> None:
    step = planned()
    for text in ("first", "second"):
        step.add_stage(Stage(Position.COMPILED, text))
    assert step.chain() == ("second", "advance, read outputs")
    assert not step.taken_over


def test_nobody_assigns_to_what_moves_a_component() -> None:
    found = []
    for file in Path(cosim.__file__).parent.rglob("*.py"):
        for node in ast.walk(ast.parse(file.read_text())):
            targets = node.targets if isinstance(node, ast.Assign) else []
            names = {n.attr for t in targets for n in ast.walk(t) if isinstance(n, ast.Attribute)}
            found += [file.name] if names & MOVES and file.name != "planned.py" else []
        assert "ignore[method-assign]" not in file.read_text()
    assert found == []


# -- told before the run as it is in the run
# --------------------------------------------------------------------------


def lag(folder: Path, count: int = 2, **table: Any) -> Scenario:
    linear_fmu(folder, "lag", [[-1.0]], [[1.0]], [[1.0]], [[0.0]], version=2, x0=[1.0])
    scenario = Scenario(stop=0.4, step=0.1, folder=folder)
    for i in range(count):
        scenario.add(f"c{i}", fmu="lag.fmu", **(table if i == 0 else {}))
    return scenario.connect(*(f"c{i}.y1 -> c{(i + 1) % count}.u1" for i in range(count)))


def events(folder: Path) -> Scenario:
    triggered_fmu(folder, "alarm")
    receiver_fmu(folder, "listener")
    linear_fmu(folder, "lag", [[-1.0]], [[1.0]], [[1.0]], [[0.0]], version=2, x0=[1.0])
    scenario = Scenario(stop=0.4, step=0.1, folder=folder)
    for name, file in {"alarm": "alarm", "listener": "listener", "lag": "lag"}.items():
        scenario.add(name, fmu=f"{file}.fmu")
    return scenario.connect("alarm.crossing -> listener.tick", "alarm.crossing_value -> listener.tick_value, lag.u1")


CASES: dict[str, Callable[[Path], Scenario]] = {
    "balises": lambda _: small(),
    "balises told late, method by the probe": lambda _: small().balises(method="auto", timing="stale"),
    "compiled": lag,
    "slow": lambda folder: lag(folder, every=2),
    "substeps": lambda folder: lag(folder, substeps=3),
    "interpolated": lambda folder: lag(folder).master(inputs="extrapolate"),
    "error control": lambda folder: lag(folder).master(control="doubling"),
    "events": events,
    "local events": lambda folder: events(folder).master(events="local"),
}


@pytest.mark.compiler
@pytest.mark.parametrize("case", CASES)
def test_show_lists_the_chains_of_the_run(case: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    masters: list[Master] = []
    run = Master.run
    monkeypatch.setattr(Master, "run", lambda master: (masters.append(master), run(master))[1])
    scenario = CASES[case](tmp_path)
    structure = scenario.structure()
    scenario.run()
    (master,) = masters
    close(master.plan)
    for step in master.plan.steps:
        reported = " > ".join(structure.part(step.component.name).chain)
        pattern = re.escape(reported).replace(r"chosen\ at\ set\-up", r"[a-z\-]+")
        assert re.fullmatch(pattern.replace(r"\ \(where\ the\ run\ can\ use\ it\)", ""), " > ".join(step.chain()))
        assert reported in structure.text()
    lengths = {"balises": 2, "compiled": 2, "slow": 3, "substeps": 2, "events": 3, "local events": 2}
    assert max(len(part.chain) for part in structure.parts) == lengths.get(case, max(1, 2 * ("told late" in case)))
