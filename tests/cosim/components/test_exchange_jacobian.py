"""Directional derivatives as the Jacobian of the solver: the right solution, fewer calls, and lies that are seen."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Literal

import numpy as np
import pytest
from test_fmus.exchange import exchange_fmu
from test_fmus.stepped import Stepped

import fmus
from cosim import Scenario
from fmus.exchange import motion
from fmus.exchange.model_calls import ModelCalls
from plant_models.hybrid import HybridSystem, output_signal, parameter, state, vector

ENDS = {"OSCILLATES": (400.0, 600.0, 2000.0), "REACTION": (0.4, 4e3, 4e7)}
BY_OTHERS = {
    "OSCILLATES": [
        [1.6932094268309077, -0.0009069343138535401],
        [1.4845756932879237, -0.0012330698826296801],
        [1.7061677321704989, -0.0008928097010247803],
    ],
    "REACTION": [
        [0.9851721138609979, 3.386395378975048e-05],
        [0.18320225777672683, 8.94237125277682e-07],
        [5.2030718441192065e-05, 2.0813357318919965e-10],
    ],
}
"""There by SciPy's Radau at a relative tolerance of 1e-13, which at 1e-12 gives the same to 3e-13."""
TOLERANCE = 1e-7
ERROR = 1e3 * TOLERANCE
"""Of states of size one: van der Pol carries what it errs along to its next turn, some hundred times the tolerance."""


def solved(path: Path, ends: tuple[float, ...]) -> tuple[np.ndarray, dict[str, Any]]:
    """Outputs at the ends of steps [s], and what the solver says of itself."""
    fmu = Stepped(path, TOLERANCE)
    try:
        rows = [fmu.to(end)[:2] for end in ends]
        return np.array(rows), fmu.component.slave.solved.summary()
    finally:
        fmu.free()


@pytest.fixture
def by_differences(monkeypatch: pytest.MonkeyPatch) -> pytest.MonkeyPatch:
    """Nothing is known of directional derivatives, until it is undone."""
    monkeypatch.setattr(motion, "directional_derivatives", lambda *_: None)
    return monkeypatch


@pytest.mark.parametrize("version", [2, 3])
@pytest.mark.parametrize("model", ["OSCILLATES", "REACTION"])
def test_stiff_models_have_the_solution_of_another_method(
    tmp_path: Path, by_differences: pytest.MonkeyPatch, model: str, version: int
) -> None:
    path = exchange_fmu(tmp_path, model, version)
    without, said = solved(path, ENDS[model])
    assert said["jacobian"] == "differences"
    by_differences.undo()
    found, said = solved(path, ENDS[model])
    assert said["jacobian"] == "directional derivatives"
    for rows in (found, without):
        np.testing.assert_allclose(rows, BY_OTHERS[model], atol=ERROR)


@pytest.mark.parametrize("lie", ["ALWAYS", "LATER"])
@pytest.mark.parametrize("version", [2, 3])
def test_derivatives_that_are_wrong_are_seen_before_they_do_harm(tmp_path: Path, version: int, lie: str) -> None:
    """The second kind is a billion times too large, and the solver by itself would take any step for solved."""
    found, said = solved(exchange_fmu(tmp_path, "OSCILLATES", version, lie=lie), ENDS["OSCILLATES"])
    np.testing.assert_allclose(found, BY_OTHERS["OSCILLATES"], atol=ERROR)
    assert said["jacobian"].startswith("differences, since the directional derivatives of der(speed) are not what")


def test_a_run_tells_of_derivatives_that_were_wrong(tmp_path: Path) -> None:
    s = Scenario(stop=1.0, step=0.5).add("plant", fmu=str(exchange_fmu(tmp_path, "OSCILLATES", lie="ALWAYS")))
    notes = s.run().result.summary["notes"]
    assert any(note.startswith("plant: the solver takes differences, since the directional") for note in notes)


class Rod(HybridSystem):
    """Heat along a rod of thirty pieces that radiates: neighbours level out a thousand times as fast as it cools."""

    name, description, source = "rod", "Heat along a rod", "a law of Fourier and one of Stefan and Boltzmann"
    states = (state("heat", "1", start=tuple(np.linspace(1.0, 2.0, 30).tolist()), size=30),)
    outputs = (output_signal("first", "1"), output_signal("last", "1"))
    parameters = (parameter("conduction", "1", 1e3),)

    def flow(self, t: Any, x: Any, u: Any, p: Any) -> Any:
        wide = [x.heat[0], *[x.heat[k] for k in range(30)], x.heat[29]]
        led = [p.conduction * (wide[k] - 2.0 * wide[k + 1] + wide[k + 2]) - 0.1 * wide[k + 1] ** 4 for k in range(30)]
        return {"heat": vector(*led)}

    def output(self, t: Any, x: Any, u: Any, p: Any) -> Any:
        return {"first": x.heat[0], "last": x.heat[29]}


@pytest.mark.parametrize("version", [2, 3])
def test_many_states_cost_fewer_calls_of_their_derivatives(
    tmp_path: Path, by_differences: pytest.MonkeyPatch, version: Literal[2, 3]
) -> None:
    path = fmus.build_fmu(Rod(), tmp_path / "rod.fmu", fmi_version=version)
    without, counted = exchanged(path)
    by_differences.undo()
    found, fewer = exchanged(path)
    np.testing.assert_allclose(found, without, atol=100.0 * TOLERANCE)
    assert (counted["jacobian"], fewer["jacobian"]) == ("differences", "directional derivatives")
    assert fewer["derivatives"] <= counted["derivatives"] - 2 * 30  # a difference for each state, twice at the least


def exchanged(path: Path) -> tuple[np.ndarray, dict[str, Any]]:
    """The outputs of a run by the solver, and what it says of itself."""
    s = Scenario(stop=1.0, step=0.1).add("rod", fmu=str(path), interface="model-exchange", tolerance=TOLERANCE)
    outcome = s.run()
    assert outcome.failure is None
    values = np.array([outcome["rod.first"], outcome["rod.last"]])
    return values, outcome.result.summary["components"][0]["solver"]


def test_an_array_of_states_has_the_jacobian_of_its_elements(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """In C and in Python: the same steps as with a variable for each state."""
    runs = []
    for arrays, native in ((False, True), (True, True), (True, False)):
        if not native:
            monkeypatch.setattr(ModelCalls, "native", lambda *_: None)
        fmu = Stepped(exchange_fmu(tmp_path / f"{arrays}", "REACTION", 3, arrays=arrays), 1e-6)
        rows = [fmu.to(0.1 * k)[:2].tolist() for k in range(1, 21)]
        runs.append((rows, fmu.component.slave.solved.summary()))
        fmu.free()
    assert runs[0][1]["jacobian"] == "directional derivatives"
    assert runs[0] == runs[1] == runs[2]
