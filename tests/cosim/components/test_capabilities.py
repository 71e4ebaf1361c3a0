"""Capability flags: read from descriptions of every FMI version, and respected."""

from __future__ import annotations

import zipfile
from dataclasses import fields
from pathlib import Path
from typing import Any, ClassVar

import pytest
from fmpy.fmi1 import FMICallException
from mock_slaves import FMI2, Mock, Train, component, started, variable
from test_fmus.build import linear_fmu

import cosim
from cosim.components.description import read_description
from cosim.components.loading import load_fmu
from cosim.errors import CosimError, CouplingError, RunError
from fmus.check.probe import probe
from fmus.fmi.capabilities import Capabilities, read_capabilities, tool_warning

LAG: dict[str, Any] = {"A": [[-1.0]], "B": [[1.0]], "C": [[1.0]], "D": [[0.5]], "inputs": ["u"], "outputs": ["y"]}

FLAGS_1 = (
    "canHandleVariableCommunicationStepSize canInterpolateInputs canRunAsynchronuously "
    "canBeInstantiatedOnlyOncePerProcess"
)
FLAGS_2 = f"{FLAGS_1} needsExecutionTool canNotUseMemoryManagementFunctions canGetAndSetFMUstate canSerializeFMUstate"
FLAGS_3 = (
    "canHandleVariableCommunicationStepSize canBeInstantiatedOnlyOncePerProcess needsExecutionTool "
    "canGetAndSetFMUState "
    "canSerializeFMUState providesDirectionalDerivatives providesAdjointDerivatives providesPerElementDependencies "
    "providesIntermediateUpdate mightReturnEarlyFromDoStep canReturnEarlyAfterIntermediateUpdate hasEventMode "
    "providesEvaluateDiscreteStates"
)
CASES = (
    *((1, flag) for flag in FLAGS_1.split()),
    *((2, flag) for flag in [*FLAGS_2.split(), "providesDirectionalDerivative"]),
    *((3, flag) for flag in FLAGS_3.split()),
)
RENAMED = {
    "canGetAndSetFMUstate": "canGetAndSetFMUState",
    "canSerializeFMUstate": "canSerializeFMUState",
    "providesDirectionalDerivative": "providesDirectionalDerivatives",
}


def described(folder: Path, version: int, attributes: str) -> Capabilities:
    """What is read from a description with these attributes."""
    token = "instantiationToken" if version == 3 else "guid"
    interface = f'<CoSimulation modelIdentifier="toy" {attributes}/>'
    more = ""
    if version == 1:
        interface = ""
        more = (
            f"<Implementation><CoSimulation_StandAlone><Capabilities "
            f"{attributes}/></CoSimulation_StandAlone></Implementation>"
        )
    head = f'fmiVersion="{version}.0" modelName="toy" {token}="t"'
    if version == 1:
        head += ' modelIdentifier="toy" numberOfContinuousStates="0" numberOfEventIndicators="0"'
    xml = f"<fmiModelDescription {head}>{interface}<ModelVariables/>{more or '<ModelStructure/>'}</fmiModelDescription>"
    path = folder / "toy.fmu"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("modelDescription.xml", xml)
    return read_capabilities(read_description(path))


@pytest.mark.parametrize(("version", "flag"), CASES)
def test_each_flag_is_read_where_the_version_has_it(tmp_path: Path, version: int, flag: str) -> None:
    name = RENAMED.get(flag, flag)
    assert described(tmp_path, version, f'{flag}="true"').declared() == {name: True}
    assert described(tmp_path, version, f'{flag}="false"').declared() == {}


def test_numbers_are_numbers(tmp_path: Path) -> None:
    three = described(
        tmp_path,
        3,
        'fixedInternalStepSize="0.01" maxOutputDerivativeOrder="2" recommendedIntermediateInputSmoothness="-1"',
    )
    assert three.declared() == {
        "fixedInternalStepSize": 0.01,
        "maxOutputDerivativeOrder": 2,
        "recommendedIntermediateInputSmoothness": -1,
    }
    assert described(tmp_path, 1, 'maxOutputDerivativeOrder="1"').declared() == {"maxOutputDerivativeOrder": 1}


def test_a_tool_coupling_of_fmi_1_needs_its_tool(tmp_path: Path) -> None:
    made = described(tmp_path, 1, "")
    assert not made.needsExecutionTool
    text = (tmp_path / "toy.fmu").read_bytes()
    assert b"CoSimulation_StandAlone" in text
    with zipfile.ZipFile(tmp_path / "toy.fmu") as archive:
        xml = archive.read("modelDescription.xml").decode().replace("CoSimulation_StandAlone", "CoSimulation_Tool")
    with zipfile.ZipFile(tmp_path / "tool.fmu", "w") as archive:
        archive.writestr("modelDescription.xml", xml)
    assert read_capabilities(read_description(tmp_path / "tool.fmu")).needsExecutionTool


def test_every_flag_has_a_default_and_none_is_declared_by_silence() -> None:
    assert Capabilities().declared() == {}
    assert len(fields(Capabilities)) == 19
    description = Train().model_description
    description.coSimulation = None
    assert read_capabilities(description) == Capabilities()


# -- one instance in a process
# ----------------------------------------------------------------------------------------------


@pytest.mark.compiler
def test_a_second_instance_is_refused_before_anything_is_loaded(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also where the second one is a copy under another name."""
    alone = linear_fmu(tmp_path, "alone", **LAG, once_per_process=True)
    copy = tmp_path / "copy.fmu"
    copy.write_bytes(alone.read_bytes())
    monkeypatch.setattr("cosim.run.component_models.load_fmu", lambda *_: pytest.fail("it was loaded"))
    s = cosim.Scenario(stop=1.0, step=0.1).add("first", fmu=str(alone)).add("second", fmu=str(copy))
    with pytest.raises(
        CosimError, match=r"components 'first' and 'second' are the same FMU \(copy.fmu\), which can be .* only once"
    ):
        s.run()


@pytest.mark.compiler
def test_one_instance_and_others_of_other_fmus_run(tmp_path: Path) -> None:
    alone = linear_fmu(tmp_path, "alone", **LAG, once_per_process=True)
    other = linear_fmu(tmp_path, "other", **LAG, once_per_process=True)
    free = linear_fmu(tmp_path, "free", **LAG)
    s = cosim.Scenario(stop=0.2, step=0.1)
    for name, path in {"a": alone, "b": other, "c": free, "d": free}.items():
        s.add(name, fmu=str(path))
    assert s.run().failure is None


@pytest.mark.compiler
def test_the_probe_makes_no_second_instance(tmp_path: Path) -> None:
    path = linear_fmu(tmp_path, "alone", **LAG, once_per_process=True)
    made = []

    def make() -> Any:
        made.append(load_fmu(path, "alone"))
        made[-1].instantiate = lambda: pytest.fail("it was instantiated")
        return made[-1]

    report = probe(make, {}, 0.0, 0.1)
    assert len(made) == 1
    assert "one instance per process only" in report.remarks[0]


# -- another program
# ----------------------------------------------------------------------------------------------------------


class Remote(Train):
    """Cannot be instantiated: its tool is not there."""

    capabilities: ClassVar[dict[str, Any]] = {"needsExecutionTool": True}

    def _describe(self) -> Any:
        description = super()._describe()
        description.generationTool = "TrainTool 7"
        return description

    def instantiate(self, **_: Any) -> None:
        raise FMICallException("fmi3InstantiateCoSimulation", 3)


def test_a_failed_instantiation_mentions_the_tool() -> None:
    with pytest.raises(
        RunError, match=r"instantiate failed: .* Perhaps because: mock: .*needsExecutionTool\); it was made with Tr"
    ):
        started(Remote())


def test_without_the_flag_nobody_speaks_of_tools() -> None:
    class Broken(Remote):
        capabilities: ClassVar[dict[str, Any]] = {}

    with pytest.raises(RunError) as caught:
        started(Broken())
    assert "program" not in str(caught.value)
    assert tool_warning("mock", Train().model_description) is None


@pytest.mark.compiler
def test_the_user_is_warned_before_the_run(tmp_path: Path) -> None:
    path = linear_fmu(tmp_path, "remote", **LAG, needs_tool=True)
    outcome = cosim.Scenario(stop=0.1, step=0.1).add("remote", fmu=str(path)).run()
    reported = [w for w in outcome.result.summary["warnings"] if "needsExecutionTool" in w]
    assert reported == [
        "remote: the FMU needs another program to be installed (needsExecutionTool); its description does not say "
        "which."
    ]


# -- what a step returns
# --------------------------------------------------------------------------------------------------------


class Waiting(FMI2, Mock):
    """Returns before it is done."""

    def doStep(self, t: float, h: float, noSetFMUStatePriorToCurrentPoint: bool = True) -> None:
        raise FMICallException("fmi2DoStep", 5)


@pytest.mark.parametrize(
    ("declared", "words"), [(True, "as canRunAsynchronuously allows"), (False, "against its description")]
)
def test_a_pending_step_is_refused_clearly(declared: bool, words: str) -> None:
    slave = type("Asynchronous", (Waiting,), {"capabilities": {"canRunAsynchronuously": declared}})()
    made = started(slave)
    with pytest.raises(
        RunError, match=rf"t = 0 s: doStep returned before it was done \(status pending\), {words}; slaves that"
    ):
        made.advance(0.0, 0.1)


# -- derivatives
# ----------------------------------------------------------------------------------------------------------


@pytest.mark.compiler
@pytest.mark.parametrize("version", [1, 2])
def test_input_derivatives_make_the_input_a_line(tmp_path: Path, version: Any) -> None:
    """x' = u - x with u = 1 + 2 t, x(0) = 0: x = 2 t - 1 + exp(-t), exact in the FMU, so only rounding is left."""
    from math import exp

    import numpy as np

    path = linear_fmu(tmp_path, "lag", **LAG | {"D": [[0.0]]}, version=version, input_derivatives=True)
    made = load_fmu(path, "lag")
    made.instantiate()
    made.enter_initialization(0.0, 1.0)
    made.exit_initialization()
    write, u = made.writer(["u"])
    u[0] = 1.0
    write()
    tell, slope = made.make_derivative_writer(["u"])
    slope[0] = 2.0
    tell()
    made.advance(0.0, 0.5)
    values = np.zeros(1)
    made.reader(["y"], values)()
    assert values[0] == pytest.approx(exp(-0.5), rel=1e-14)
    made.free()


@pytest.mark.compiler
def test_who_takes_no_derivatives_says_so(tmp_path: Path) -> None:
    plain = load_fmu(linear_fmu(tmp_path, "plain", **LAG, version=2), "plain")
    with pytest.raises(
        CouplingError, match="plain takes no derivatives of inputs: it does not declare canInterpolateInputs"
    ):
        plain.make_derivative_writer(["u"])
    plain.free()
    with pytest.raises(CouplingError, match="mock takes no derivatives of inputs: FMI 3 has no input derivatives"):
        component(Train()).make_derivative_writer(["effort"])


@pytest.mark.compiler
@pytest.mark.parametrize("version", [2, 3])
def test_directional_derivatives_are_those_of_the_matrices(tmp_path: Path, version: Any) -> None:
    d = [[0.5, -2.0], [0.0, 3.0]]
    path = linear_fmu(
        tmp_path,
        "pair",
        [[-1.0]],
        [[1.0, 0.0]],
        [[1.0], [2.0]],
        d,
        version=version,
        inputs=["a", "b"],
        outputs=["p", "q"],
        directional=True,
    )
    made = load_fmu(path, "pair")
    made.instantiate()
    made.enter_initialization(0.0, 1.0)
    made.exit_initialization()
    made.advance(0.0, 0.1)
    assert made.directional_derivative(["q", "p"], ["b", "a"], [1.0, 10.0]).tolist() == [3.0, 3.0]
    assert made.directional_derivative(["p"], ["a"], [2.0]).tolist() == [1.0]
    made.free()


def test_a_block_gives_its_derivatives_by_an_equal_call() -> None:
    """dp = v, dv = push over a step of 0.5 s from a state: neither output depends on the push directly."""
    from coupled_runs import Pushed, block

    made = block(Pushed(), "p", 3)
    made.instantiate()
    made.enter_initialization(0.0, 1.0)
    assert made.directional_derivative(["speed", "position"], ["push"], [1.0]).tolist() == [0.0, 0.0]
    assert made.directional_derivative(["speed", "position"], ["v", "p"], [2.0, 3.0]).tolist() == [2.0, 3.0]


def test_who_gives_no_directional_derivatives_says_so() -> None:
    with pytest.raises(CouplingError, match="mock gives no directional derivatives: it does not declare them"):
        component(Train()).directional_derivative(["speed"], ["effort"], [1.0])


def test_elements_of_arrays_have_derivatives_too() -> None:
    """The slave is asked for whole arrays: y = 2 u reversed, so dy[2] by du[2] along 5 is 10, and dy[1] follows
    u[3].
    """

    class Reversing(Mock):
        capabilities: ClassVar[dict[str, Any]] = {"providesDirectionalDerivative": True}

        def more_variables(self) -> list[Any]:
            return [
                variable("u", "input", 1, "Float64", shape=(3,)),
                variable("y", "output", 2, "Float64", shape=(3,)),
                variable("label", "output", 3, "String"),
            ]

        def getDirectionalDerivative(self, unknowns: Any, knowns: Any, seed: Any, nSensitivity: int) -> list[float]:
            assert (list(unknowns), list(knowns), len(seed), nSensitivity) == ([2], [1], 3, 3)
            return [2.0 * s for s in reversed(seed)]

    made = component(Reversing())
    assert made.directional_derivative(["y[2]"], ["u[2]"], [5.0]).tolist() == [10.0]
    assert made.directional_derivative(["y[3]", "y[1]"], ["u[3]", "u[1]"], [1.0, 7.0]).tolist() == [14.0, 2.0]
    assert made.directional_derivative(["y"], ["u"], [1.0, 2.0, 3.0]).tolist() == [6.0, 4.0, 2.0]
    with pytest.raises(CouplingError, match=r"mock.label has no derivative: it is a String"):
        made.directional_derivative(["label"], ["u"], [1.0, 2.0, 3.0])
