"""Algorithms as a scenario asks for them: keys, summary, refusals with their place, results so far."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from test_fmus.masses import DIVERGENT, Chain, Loop, Part, cuts

import cosim
import cosim.cli


def scenario(parts: dict[str, Part], connections: Any, folder: Path, **capabilities: Any) -> cosim.Scenario:
    made = cosim.Scenario(stop=0.5, step=0.05, folder=folder)
    for name, part in parts.items():
        part.fmu(folder, 2, **capabilities)
        made.add(name, fmu=f"{name}.fmu")
    return made.connect(*connections)


@pytest.mark.compiler
def test_the_summary_says_what_was_chosen_and_why(tmp_path: Path) -> None:
    """An algebraic loop that plain exchange never solves, found, iterated and told of, without asking for anything."""
    outcome = scenario(DIVERGENT.parts, DIVERGENT.connections, tmp_path).run()
    assert outcome.failure is None
    np.testing.assert_allclose(outcome["first.y"], DIVERGENT.solution[0], rtol=1e-10)
    reported = outcome.result.summary["master"]["algorithm"]
    assert reported["name"] == "iterate"
    assert reported["reason"] == (
        "There is an algebraic loop, first.u -> first.y -> second.u -> second.y -> first.u; the rest is stepped by "
        "Gauss-Seidel."
    )
    assert reported["groups"] == [["first", "second"]]
    assert reported["loops"][0]["iterated"] == ["second.y"]
    assert set(reported["loops"][0]) >= {
        "mean_iterations",
        "max_iterations",
        "largest_residual",
        "worst_step",
        "method",
        "jacobian",
    }


@pytest.mark.compiler
def test_held_connections_are_reported(tmp_path: Path) -> None:
    cut = cuts(Chain.two())["force-displacement"]
    made = scenario(dict(cut.parts), cut.connections, tmp_path)
    reported = {}
    for algorithm in ("auto", "jacobi", "iterate"):
        reported[algorithm] = (
            made.copy().master(algorithm=algorithm, threads=2).run().result.summary["master"]["algorithm"]
        )
    assert reported["auto"]["name"] == "gauss-seidel"
    assert reported["auto"]["held"] == ["mass2.f_left -> mass1.f_right"]
    assert sorted(reported["jacobi"]["held"]) == sorted(cut.connections)
    assert reported["iterate"]["held"] == []


@pytest.mark.compiler
@pytest.mark.parametrize("algorithm", ["jacobi", "gauss-seidel"])
def test_a_refusal_names_file_and_loop(tmp_path: Path, algorithm: str) -> None:
    made = scenario(DIVERGENT.parts, DIVERGENT.connections, tmp_path).master(algorithm=algorithm)
    with pytest.raises(
        cosim.CosimError, match=rf"^script: master.algorithm = '{algorithm}' does not solve the algebraic loop first.u"
    ):
        made.run()


@pytest.mark.compiler
def test_without_saved_states_the_remedy_is_reported(tmp_path: Path) -> None:
    made = scenario(DIVERGENT.parts, DIVERGENT.connections, tmp_path, state=False)
    with pytest.raises(cosim.CosimError, match=r"cannot: first, second\. Use FMUs that can, or break the loop"):
        made.run()


@pytest.mark.compiler
def test_silence_about_dependencies_is_noted_and_iterated_on_request(tmp_path: Path) -> None:
    loop = Loop(a=0.5, b=1.0, c=-0.8, d=2.0)
    made = scenario(loop.parts, loop.connections, tmp_path, declare_dependencies=False)
    quiet = made.run().result.summary
    assert quiet["master"]["algorithm"]["name"] == "gauss-seidel"
    assert any(note.startswith("Possible algebraic loop first.u -> first.y -> second.u") for note in quiet["notes"])
    asked = made.master(algorithm="iterate").run()
    assert asked["second.y"][-1] == pytest.approx(loop.solution[1], rel=1e-9)
    assert not any("Possible" in note for note in asked.result.summary["notes"])


@pytest.mark.compiler
def test_a_component_of_an_iterated_loop_takes_every_step(tmp_path: Path) -> None:
    DIVERGENT.fmus(tmp_path, 2)
    made = (
        cosim.Scenario(stop=0.5, step=0.05, folder=tmp_path)
        .add("first", fmu="first.fmu")
        .add("second", fmu="second.fmu", every=2)
    )
    with pytest.raises(
        cosim.CosimError, match="second: every = 2 is not possible: it is part of a loop that is iterated"
    ):
        made.connect(*DIVERGENT.connections).run()


@pytest.mark.compiler
def test_a_loop_that_does_not_converge_keeps_the_results_and_shows_its_residuals(tmp_path: Path, capsys: Any) -> None:
    """Too few sweeps for the method: the run fails on the command line without a traceback, and the rows so far are
    written.
    """
    turn = np.array([[0.0, -2.0], [2.0, 0.0]])
    parts = {
        name: Part(name, turn, np.zeros((2, 1)), np.array([[0.0, 1.0]]), np.array([[gain]]), ("u",), ("y",), (1.0, 0.0))
        for name, gain in (("first", 0.9), ("second", 0.9))
    }
    for part in parts.values():
        part.fmu(tmp_path, 2)
    file = tmp_path / "loop.toml"
    file.write_text(
        'stop = 0.5\nstep = 0.05\nconnections = ["first.y -> second.u", "second.y -> first.u"]\n'
        '[components.first]\nfmu = "first.fmu"\n[components.second]\nfmu = "second.fmu"\n'
        '[master]\nalgorithm = "auto"\n[master.iteration]\nmethod = "fixed-point"\nmax_iterations = 5\n',
        encoding="utf-8",
    )
    status = cosim.cli.main(["run", str(file), "--out", str(tmp_path / "out")])
    said = capsys.readouterr()
    text = said.out + said.err
    assert status != 0
    assert "5 sweeps by 'fixed-point' do not converge. Scaled residuals (1 is converged): " in text
    assert "Try master.iteration.method = 'newton'" in text
    assert "Traceback" not in text
    assert (tmp_path / "out" / "table.csv").read_text(encoding="utf-8").count("\n") >= 2
