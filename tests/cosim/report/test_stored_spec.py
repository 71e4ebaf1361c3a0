"""The roles of a result that was read back are those of the run; those of older results are guessed, and said to be."""

from __future__ import annotations

from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from synthetic_run import OBSERVERS, synthetic_result, synthetic_spec

from cosim.evaluation.spec import ReportSpec
from cosim.evaluation.stored_spec import is_guessed, spec_of
from cosim.results.result import Result
from cosim.results.results_folder import read_results, write_results
from fmus.tables.plain_data import jsonable

JSON = st.recursive(
    st.none() | st.booleans() | st.floats() | st.text(max_size=3),
    lambda inner: (
        st.lists(inner, max_size=3) | st.dictionaries(st.sampled_from(["a", "name", "start", "end"]), inner, max_size=3)
    ),
    max_leaves=6,
)


def plain(spec: ReportSpec) -> Any:
    return jsonable(asdict(spec))


def bare(*names: str) -> Result:
    return Result(np.zeros(3, [("time", "f8"), *((name, "f8") for name in names)]), [])


def test_roles_survive_the_file(tmp_path: Path) -> None:
    spec = synthetic_spec()
    result = replace(synthetic_result(step=1.0), summary={"report": asdict(spec)})
    write_results(result, tmp_path, ("npy",))
    back = read_results(tmp_path)
    assert plain(spec_of(back)) == plain(spec)
    assert not is_guessed(back)


def test_roles_of_an_older_result_are_guessed() -> None:
    result = replace(synthetic_result(step=1.0), summary={"title": "Old"})
    spec, known = spec_of(result), synthetic_spec()
    assert is_guessed(result)
    assert (spec.title, list(spec.observers)) == ("Old", list(OBSERVERS))
    for role in ("true_position", "true_speed", "true_slip", "true_adhesion_force", "odometer"):
        assert getattr(spec, role) == getattr(known, role)


def test_an_observer_is_no_plant() -> None:
    spec = spec_of(bare("o.position", "o.speed", "o.innovation", "p.position", "p.speed"))
    assert (list(spec.observers), spec.true_speed) == (["o"], "p.speed")


@pytest.mark.parametrize("names", [(), ("a.b",), ("position", "speed"), ("x.position",)])
def test_names_without_a_hint_give_no_roles(names: tuple[str, ...]) -> None:
    assert spec_of(bare(*names), "table.csv") == ReportSpec(title="table.csv", observers=[])


@given(st.dictionaries(st.sampled_from(list(asdict(ReportSpec()))), JSON, min_size=1))
def test_any_stored_data_gives_roles(data: dict[str, Any]) -> None:
    spec = spec_of(replace(bare("train.speed"), summary={"report": data}))
    assert isinstance(spec.evaluate_after, float)
    assert all(isinstance(p.start, float) for p in spec.phases)
    assert all(isinstance(number, float) for row in spec.published.values() for number in row.values())
