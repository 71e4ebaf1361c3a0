"""What `fmus check` looks at: start values and ranges, arrays, local variables, aliases, the default experiment, longer
runs.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from fmpy.model_description import ModelVariable, VariableAlias
from lying_fmus import build, description
from test_fmus.typed import expected, typed_fmu

from fmus.check import Class, Verdict, check_fmu
from fmus.check.checked_instance import FmuInstance, make_slave
from fmus.check.runner import END, Runner, end_of_experiment
from fmus.fmi.archive import open_archive

pytestmark = pytest.mark.compiler

OUTPUTS = '<Outputs><Unknown index="2"/><Unknown index="3"/></Outputs>'


@contextmanager
def runner_of(path: Path, starts: Mapping[str, Any] | None = None, until: float | None = None) -> Iterator[Runner]:
    archive = open_archive(path)
    with archive.unpacked() as folder:
        runner = Runner(lambda: make_slave(folder, archive.description), starts or {}, 0.0, 0.01, until=until)
        try:
            yield runner
        finally:
            runner.put_away()


def test_inputs_begin_at_their_start_values_and_stay_in_their_range(tmp_path: Path) -> None:
    xml = description().replace(
        '"input" variability="continuous"><Real start="0"/>',
        '"input" variability="continuous"><Real start="5" min="4" max="6"/>',
    )
    path = build(tmp_path, xml=xml)
    for starts, own in (({}, 5.0), ({"force": 4.5}, 4.5)):
        with runner_of(path, starts) as runner:
            runner.begin()
            assert isinstance(runner.component, FmuInstance)
            seen = []
            for amplitude in (0.0, 0.5, 1e5):
                runner.set_inputs(amplitude)
                seen.append(float(runner.component.read(["force"])[0]))
        assert seen == [own, own + 0.5, 6.0]


def test_elements_of_arrays_are_outputs_and_inputs(tmp_path: Path) -> None:
    archive = open_archive(typed_fmu(tmp_path, version=3))
    with archive.unpacked() as folder:
        slave = make_slave(folder, archive.description)
        try:
            slave.instantiate()
            slave.enter_initialization(0.0, 1.0)
            slave.exit_initialization()
            assert {"y_float64", "y_vector[3]", "y_matrix[2,3]", "y_pair_int64[2]"} <= set(slave.names("output"))
            write, buffer = slave.writer(slave.names("input"))
            buffer[slave.names("input").index("u_matrix[2,1]")] = 7.0
            write()
            slave.advance(0.0, 0.1)
            matrix = slave.read([f"y_matrix[{i},{j}]" for i in (1, 2) for j in (1, 2, 3)]).reshape(2, 3)
            stated = np.zeros((2, 3))
            stated[1, 0] = 7.0
            np.testing.assert_array_equal(matrix, expected("u_matrix", stated.tolist()))
        finally:
            slave.terminate()
            slave.free()


def test_local_variables_are_read_where_there_is_no_output(tmp_path: Path) -> None:
    xml = description().replace('causality="output"', 'causality="local"').replace(OUTPUTS, "")
    report = check_fmu(build(tmp_path, "UNSHORTENED", xml=xml))
    assert "position" in report.finding("divided steps").detail
    assert report.verdict is Class.LIMITS


def test_an_fmu_that_ends_by_itself_is_evaluated_by_what_it_does_before(tmp_path: Path) -> None:
    report = check_fmu(build(tmp_path, "ENDS"))
    stepping = report.finding("stepping")
    assert (stepping.verdict, stepping.detail) == (Verdict.LIMIT, "30 steps of 0.01 s, then it asks for the end")
    assert "0.3 s" in stepping.advice
    assert [f.check for f in report.limits] == ["stepping"]


def test_a_longer_check_where_asked(tmp_path: Path) -> None:
    path = build(tmp_path, "NAN_MUCH_LATER")
    assert check_fmu(path).finding("stepping").detail.startswith("50 steps of 0.01 s")
    report = check_fmu(path, until=1.0)
    assert report.finding("stepping").detail == "not finite while stepping: position = nan, speed = nan"
    assert (report.verdict, report.steps) == (Class.DISTRUST, 100)


def test_no_step_leaves_the_default_experiment_unless_asked(tmp_path: Path) -> None:
    short = build(tmp_path, xml=description().replace('stopTime="10"', 'stopTime="0.2"'))
    report = check_fmu(short)
    assert report.steps == 20
    assert report.verdict is Class.USE
    assert check_fmu(short, steps=30).steps == 30


def test_the_announced_end_is_that_of_the_experiment(tmp_path: Path) -> None:
    """Some tools divide the time up to it: a far end makes their FMUs coarse, or hang."""
    path = build(tmp_path)
    for until, end in ((None, 10.0), (50.0, 50.0)):
        with runner_of(path, until=until) as runner:
            assert runner.end == end
            runner.begin()
    assert end_of_experiment(SimpleNamespace(defaultExperiment=None), 2.0) == 2.0 + END


def test_an_alias_is_its_variable() -> None:
    own = ModelVariable(
        name="v", valueReference=2, type="Float64", causality="output", aliases=[VariableAlias(name="mass.v")]
    )
    alias = ModelVariable(name="mass.v", valueReference=2, type="Float64", causality="output", alias=own)
    described = SimpleNamespace(description=SimpleNamespace(modelVariables=[own, alias]))
    assert FmuInstance.names(described, "output") == ["v"]  # type: ignore[arg-type]


def test_steps_are_counted_and_others_stand_where_they_end(tmp_path: Path) -> None:
    """Equal to the instants of a run, which are products, to the last digit; a shorter step is no multiple."""
    with runner_of(build(tmp_path)) as runner:
        runner.begin()
        seen = []
        for _ in range(1000):
            runner.step(0.01)
            seen.append(runner.now)
        assert seen == [k * 0.01 for k in range(1, 1001)]
        runner.step(0.003137)
        assert runner.now == 10.0 + 0.003137


def _without_pulse(xml: str) -> str:
    return re.sub(r'    <ScalarVariable name="pulse_\w+".*?</ScalarVariable>\n', "", xml, flags=re.DOTALL)


def test_a_sampled_input_is_moved_where_no_continuous_one_is_there(tmp_path: Path) -> None:
    """From rest, nothing but the force moves it."""
    xml = _without_pulse(description()).replace('"input" variability="continuous"', '"input" variability="discrete"')
    with runner_of(build(tmp_path, xml=xml), {"speed": 0.0}) as runner:
        assert runner.excite()
        assert runner.amplitude > 0.0


def test_what_has_no_inputs_and_never_moves_is_noted(tmp_path: Path) -> None:
    """A constant: to the end of its experiment a run meets nothing else. With an input it would not be known."""
    xml = _without_pulse(description())
    driven = xml.replace('<Real start="1"/>', '<Real start="0"/>')
    alone = driven.replace('causality="input" variability="continuous"', 'causality="parameter" variability="tunable"')
    for name, one, seen in (("alone", alone, Verdict.NOTE), ("driven", driven, Verdict.PASS)):
        finding = check_fmu(build(tmp_path / name, xml=one), starts={"speed": 0.0}).finding("stepping")
        assert finding.verdict is seen, finding
        assert ("nothing moves to the end of its experiment" in finding.detail) == (seen is Verdict.NOTE)
