"""Linearised FMUs against the exact Jacobians of the same equations, and what is said of FMUs that lie."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import lying_fmus
import numpy as np
import pytest
import scipy

import fmus
from cosim import fmu_model
from cosim.cli import main
from cosim.fmu_model.exact import linearise_system
from cosim.fmu_model.linearisation import Linearisation
from cosim.fmu_model.linearise import _differences, _sampled, linearise_fmu
from cosim.fmu_model.sealed import FmuModelError
from plant_models import PLANTS

STATES = {"train_speed": 12.0, "wheel_rate": 21.0}
INPUTS = {"effort": 5e4}


@pytest.fixture(scope="module")
def locomotive() -> Path:
    return fmus.cached_fmu(PLANTS["locomotive"](), fmi_version=3)


@pytest.fixture(scope="module")
def exact() -> Linearisation:
    return linearise_system(PLANTS["locomotive"](), states=STATES, inputs=INPUTS, t=5.0)


@pytest.fixture
def liar(tmp_path: Path) -> Iterator[Path]:
    return lying_fmus.build(tmp_path, xml=lying_fmus.description(model=lying_fmus.STATES))


@pytest.mark.parametrize("version", [2, 3])
def test_matrices_are_the_exact_ones(version: int, exact: Linearisation) -> None:
    path = fmus.cached_fmu(PLANTS["locomotive"](), fmi_version=version)
    found = linearise_fmu(path, states=STATES, inputs=INPUTS, t=5.0)
    assert found.method == "directional derivatives"
    assert found.units["train_speed"] == "m/s"
    for key in "ABCD":  # both come from the same traced derivatives
        np.testing.assert_allclose(getattr(found, key), getattr(exact, key), rtol=1e-12, atol=1e-12)


def test_co_simulation_gives_the_step(locomotive: Path, exact: Linearisation) -> None:
    found = linearise_fmu(
        locomotive, states=STATES, inputs=INPUTS, t=5.0, interface="co-simulation", step=1e-3, outputs=["speed", "slip"]
    )
    assert found.step == 1e-3
    # the slow part of the step: the exponential of A, within the second order of the Rosenbrock step of 5e-4 s
    slow = np.sort(np.log(np.abs(np.linalg.eigvals(found.A))))[::-1] / 1e-3
    expected = np.sort(np.linalg.eigvals(exact.A).real)[::-1]
    np.testing.assert_allclose(slow[:2], expected[:2], atol=0.03)  # of 1400 1/s


def test_the_operating_point_is_where_a_run_arrives(locomotive: Path) -> None:
    found = linearise_fmu(locomotive, inputs=INPUTS, parameters={"mass": 50e3}, t=2.0, outputs=["speed"])
    run = linearise_fmu(
        locomotive, inputs=INPUTS, parameters={"mass": 50e3}, t=2.0, outputs=["speed"], interface="co-simulation"
    )
    np.testing.assert_allclose(found.x, run.x, rtol=1e-3)  # two solvers; the tolerance of the one is 1e-4
    assert found.x[1] > 0.5


def test_hidden_modes_are_reported(exact: Linearisation) -> None:
    part = exact.part(None, ["speed"])
    assert [round(mode.eigenvalue.real, 6) for mode in part.unobservable()] == [0.0]
    assert part.unobservable()[0].taking_part.keys() == {"train_position"}
    assert not exact.unobservable()
    assert not part.uncontrollable()
    assert "1 of 3 modes no output shows" in part.text()


@pytest.mark.parametrize("ending", ["json", "npz", "mat"])
def test_files_hold_the_matrices(exact: Linearisation, tmp_path: Path, ending: str) -> None:
    path = exact.save(tmp_path / f"point.{ending}")
    if ending == "json":
        data = json.loads(path.read_text())
    else:
        data = np.load(path) if ending == "npz" else scipy.io.loadmat(path)
    for key in "ABCD":
        np.testing.assert_array_equal(np.asarray(data[key]), getattr(exact, key))


def test_python_control_gets_names(exact: Linearisation) -> None:
    sys = fmu_model.to_state_space(exact)
    assert sys.state_labels == list(exact.states)
    np.testing.assert_array_equal(sys.A, exact.A)


def test_honest_foreign_fmu_in_the_order_of_its_own_state_vector(liar: Path) -> None:
    found = linearise_fmu(liar)  # its derivatives are declared in another order than its variables
    assert found.states == ("position", "speed")
    assert found.method == "directional derivatives"
    np.testing.assert_allclose(found.A, [[0.0, 1.0], [0.0, -0.5]], atol=1e-12)


def test_states_that_are_not_declared_are_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """As FMUs of pythonfmu have them: outputs with exact starts, and no derivatives."""
    xml = re.sub(r"<Derivatives>.*</Derivatives>|<InitialUnknowns>.*</InitialUnknowns>", "", lying_fmus.description())
    path = lying_fmus.build(tmp_path, xml=re.sub(r' derivative="\d"', "", xml))
    assert main(["linearise", str(path)]) == 2
    assert "Name the variables that hold its state (states)" in capsys.readouterr().err
    found = linearise_fmu(path, state_names=["position", "speed"], step=0.05)
    assert found.A[1, 1] == pytest.approx(np.exp(-0.5 * 0.05), rel=1e-6)  # the rate of the speed is -0.5
    assert main(["linearise", str(path), "--states", "position", "speed", "--set", "speed=2", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["states"]
    assert main(["linearise", "pendulum", "--states", "angle"]) == 2
    assert "belongs to FMUs" in capsys.readouterr().err


def test_wrong_directional_derivatives_are_not_used(tmp_path: Path) -> None:
    path = lying_fmus.build(tmp_path, "DERIVATIVE", xml=lying_fmus.description(model=lying_fmus.STATES))
    found = linearise_fmu(path)
    assert found.method == "central differences"
    assert "is said to be -0.505" in found.remarks[0]
    np.testing.assert_allclose(found.A, [[0.0, 1.0], [0.0, -0.5]], atol=1e-9)  # linear: rounding of differences only


@pytest.mark.parametrize(
    ("lie", "words"), [("STATES_NOT_SET", "does not move position"), ("NAN_DERIVATIVE", "no finite numbers")]
)
def test_lies_are_refused(tmp_path: Path, lie: str, words: str) -> None:
    path = lying_fmus.build(tmp_path, lie, xml=lying_fmus.description(model=lying_fmus.STATES))
    with pytest.raises(FmuModelError, match=words):
        linearise_fmu(path)


def test_command(locomotive: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    at = ["--set", "train_speed=12", "--set", "wheel_rate=21", "--set", "effort=5e4", "--outputs", "speed"]
    assert main(["linearise", str(locomotive), *at, "-o", str(tmp_path / "a.npz")]) == 0
    text = capsys.readouterr().out
    assert "-1422.2" in text
    assert main(["linearise", "locomotive", *at]) == 0
    assert "exact Jacobians" in capsys.readouterr().out
    assert np.load(tmp_path / "a.npz")["C"].shape == (1, 3)


@pytest.mark.parametrize(
    ("words", "reported"),
    [
        (["--set", "trainspeed=1"], "did you mean 'train_speed'"),
        (["--outputs", "sped"], "did you mean 'speed'"),
        (["--inputs", "efort"], "did you mean 'effort'"),
        (["-o", "a.txt"], "expected one of: .json, .npz, .mat"),
        (["--set", "mass=heavy"], "expected a number"),
        (["--at", "-1"], "expected an instant from 0 s on"),
    ],
)
def test_mistakes_are_reported(
    locomotive: Path, words: list[str], reported: str, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    words = [str(tmp_path / word) if word == "a.txt" else word for word in words]
    assert main(["linearise", str(locomotive), *words]) == 2
    assert reported in capsys.readouterr().err


def test_a_model_without_states_is_reported(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["linearise", "inverter"]) == 2
    assert "inverter: it has no continuous states" in capsys.readouterr().err


class Stepped:
    """A co-simulation of dx = -x, whose solver resolves so much of a state, and which forgets what is read too early.

    Args:
        resolution: of the state.
    """

    states, inputs, outputs = ("x",), (), ("y",)

    def __init__(self, resolution: float) -> None:
        self.resolution, self.x = resolution, 0.0

    def nominal(self, _name: str) -> float:
        return 1.0

    def values_at(self, _t: float, x: np.ndarray, _u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        self.x = 0.0  # read before a step it forgets what was set
        return x, 2.0 * x

    def advance(self, _t: float, h: float) -> None:
        self.x *= np.exp(-h)

    def transition(self, t: float, h: float, x: np.ndarray, _u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        self.x = np.round(x[0] / self.resolution) * self.resolution if self.resolution else x[0]
        self.advance(t, h)
        return self.read()

    def read(self) -> tuple[np.ndarray, np.ndarray]:
        return np.array([self.x]), np.array([2.0 * self.x])


@pytest.mark.parametrize(("resolution", "coarse"), [(0.0, False), (1e-9, False), (3e-7, False), (7e-3, True)])
def test_slopes_shorter_than_a_solver_resolves_are_not_believed(resolution: float, coarse: bool) -> None:
    model: Any = Stepped(resolution)
    found, remarks = _differences(model, _sampled(model, 0.0, 0.1), np.array([1.0]), np.zeros(0))
    assert any("too coarse" in remark for remark in remarks) == coarse
    np.testing.assert_allclose(found, [[np.exp(-0.1)], [2.0]], rtol=0.1)


def test_samples_of_an_fmu_are_reported(locomotive: Path) -> None:
    path = fmus.cached_fmu(PLANTS["odometer"](), fmi_version=3)
    between = " ".join(linearise_fmu(path).remarks)
    assert "it holds " in between
    assert "it announces an event at t = " in between
    assert "not in these matrices" in between
    within = " ".join(linearise_fmu(path, interface="co-simulation").remarks)
    assert "has no slope" in within
    assert "events of its own" not in " ".join(linearise_fmu(locomotive).remarks)


def test_a_kink_is_not_called_a_lie(locomotive: Path) -> None:
    assert "the model has a kink here" in linearise_fmu(locomotive).remarks[0]  # the train stands
