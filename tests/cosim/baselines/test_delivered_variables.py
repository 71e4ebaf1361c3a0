"""What a baseline keeps of the description of an FMU, and what it says when another one is delivered."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from test_fmus.build import linear_fmu

from cosim import Scenario
from cosim.baselines import check, delivery, read_baseline, write_baseline
from cosim.baselines.call import Call
from cosim.baselines.delivery import DeliveredFmu, DeliveredVariable
from cosim.baselines.header_data import header_data
from cosim.comparison.comparison_text import comparison_text
from cosim.errors import BaselineError
from cosim.results.result import Result

WORDS = st.text(st.characters(exclude_categories=["Cs", "Cc"]), min_size=1, max_size=8)
VARIABLES = st.builds(
    DeliveredVariable,
    WORDS,
    st.sampled_from(["input", "output", "parameter", "local"]),
    st.one_of(st.just(""), WORDS, st.floats(allow_nan=False).map(repr)),
    st.one_of(st.just(""), WORDS),
)
DELIVERIES = st.builds(
    DeliveredFmu,
    WORDS,
    WORDS,
    st.dictionaries(st.sampled_from(["startTime", "stopTime", "stepSize"]), st.floats(0.0, 9.0).map(repr)),
    st.lists(VARIABLES, max_size=6, unique_by=lambda v: v.name).map(
        lambda several: {v.name: v for v in sorted(several, key=lambda v: v.name)}
    ),
)
MASS = DeliveredVariable("m_ges", "parameter", "90", "t")
SPEED = DeliveredVariable("v", "output", "", "m/s")
FIRST = DeliveredFmu("Modeller R2021b", "2021-12-01", {"stepSize": "0.01"}, {"m_ges": MASS, "v": SPEED})


@given(DELIVERIES)
def test_what_is_written_is_read_again_and_is_no_change(delivery: DeliveredFmu) -> None:
    again = DeliveredFmu.from_data(json.loads(json.dumps(delivery.to_data())))
    assert again == delivery
    assert delivery.changes_to(again) == []


def changed(name: str, **values: str) -> DeliveredFmu:
    return replace(FIRST, variables={**FIRST.variables, name: replace(FIRST.variables[name], **values)})


def without(name: str) -> DeliveredFmu:
    return replace(FIRST, variables={n: v for n, v in FIRST.variables.items() if n != name})


@pytest.mark.parametrize(
    ("now", "says"),
    [
        (changed("m_ges", start="90.9"), ["m_ges start 90 -> 90.9 t"]),
        (changed("m_ges", start="9.0e1"), []),
        (changed("v", unit="km/h"), ["v unit m/s -> km/h"]),
        (changed("v", causality="local"), ["v causality output -> local"]),
        (without("v"), ["output v removed"]),
        (
            replace(without("v"), variables={"m_ges": MASS, "speed": replace(SPEED, name="speed")}),
            ["output v renamed speed"],
        ),
        (replace(FIRST, tool="Modeller R2023a"), ["tool Modeller R2021b -> Modeller R2023a"]),
        (replace(FIRST, date=""), ["made 2021-12-01 -> not stated"]),
        (replace(FIRST, experiment={"stepSize": "0.02"}), ["default stepSize 0.01 -> 0.02"]),
        (replace(FIRST, experiment={"stepSize": "1e-2"}), []),
        (changed("m_ges", start="90.00000001"), ["m_ges start 90 -> 90.00000001 t"]),
    ],
)
def test_each_change_is_named_with_both_values(now: DeliveredFmu, says: list[str]) -> None:
    assert FIRST.changes_to(now) == says


def test_causes_of_other_outputs_come_before_tool_and_date_and_many_are_counted() -> None:
    several = {f"p{k}": DeliveredVariable(f"p{k}", "parameter", str(k)) for k in range(9)}
    more = {name: replace(v, start="7.5") for name, v in several.items()}
    before, now = replace(FIRST, variables=several), replace(FIRST, tool="other", variables=more)
    words = before.changes_to(now)
    assert words[0] == "p0 start 0 -> 7.5"
    assert words[4:] == ["p4 start 4 -> 7.5", "tool Modeller R2021b -> other", "and 4 more"]


@given(DELIVERIES, DELIVERIES)
def test_the_line_of_changes_is_short_and_counts_the_others(before: DeliveredFmu, now: DeliveredFmu) -> None:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(delivery, "SHOWN", 1000)
        every = before.changes_to(now)
    words = before.changes_to(now)
    if len(every) <= delivery.SHOWN:
        assert words == every
    else:
        assert words[-1] == f"and {len(every) - delivery.SHOWN} more"
        assert [text for text in every if text in words] == words[:-1]


@pytest.mark.parametrize(
    ("new", "renamed"),
    [
        (replace(MASS, name="m_gesamt"), True),
        (replace(MASS, name="m_gesamt", start="9.0e1"), True),
        (replace(MASS, name="m_gesamt", start="80"), False),
        (replace(MASS, name="m_gesamt", unit="kg"), False),
        (replace(MASS, name="m_gesamt", causality="local"), False),
        (replace(MASS, name="payload"), False),
    ],
)
def test_a_parameter_is_renamed_only_where_all_but_a_near_name_agrees(new: DeliveredVariable, renamed: bool) -> None:
    says = FIRST.changes_to(replace(FIRST, variables={"v": SPEED, new.name: new}))
    apart = ["parameter m_ges removed", f"{new.causality} {new.name} added"]
    assert says == ([f"parameter m_ges renamed {new.name}"] if renamed else apart)


def first_order(folder: Path, gain: float = 1.0, **more: object) -> Path:
    given = {"inputs": ["effort"], "outputs": ["speed"], "x0": [1.0]} | more
    return linear_fmu(folder, "train", [[-1.0]], [[gain]], [[1.0]], [[0.0]], version=2, **given)  # type: ignore[arg-type]


def run(fmu: Path) -> Result:
    return Scenario.fmu(fmu, stop=1.0, step=0.1).run(warn=lambda _: None).result


def folders(path: Path) -> tuple[Path, Path]:
    made = path / "first", path / "second"
    for folder in made:
        folder.mkdir()
    return made


@pytest.mark.compiler
def test_the_first_line_of_a_failure_names_what_the_delivery_changed(tmp_path: Path) -> None:
    first, second = folders(tmp_path)
    write_baseline(run(first_order(first)), tmp_path / "base.json")
    baseline = read_baseline(tmp_path / "base.json")
    lines = json.loads((tmp_path / "base.json").read_text(encoding="utf-8"))["components"][0]["delivery"]["variables"]
    assert "effort,input,0.0," in lines
    found = check(run(first_order(second, x0=[1.1])), baseline)
    text = comparison_text(found).splitlines()
    assert text[0] == "fmu: x0[1] start 1 -> 1.1"
    assert "fmu.speed scales by +10 %" in text[3]
    assert found.causes[0] in found.notes
    assert found.to_dict()["causes"] == list(found.causes)


@pytest.mark.compiler
def test_an_older_baseline_is_read_and_says_once_what_it_does_not_know(tmp_path: Path) -> None:
    first, second = folders(tmp_path)
    write_baseline(run(first_order(first)), tmp_path / "base.json")
    data = json.loads((tmp_path / "base.json").read_text(encoding="utf-8"))
    del data["components"][0]["delivery"]
    (tmp_path / "base.json").write_text(json.dumps({**data, "version": "1.0"}), encoding="utf-8")
    baseline = read_baseline(tmp_path / "base.json")
    assert baseline.notes == []
    found = check(run(first_order(second, x0=[1.1])), baseline)
    assert sum("keeps no description of fmu" in line for line in comparison_text(found).splitlines()) == 1
    assert write_baseline(run(first_order(second)), tmp_path / "base.json") == "changed"  # an update adds it
    assert header_data(read_baseline(tmp_path / "base.json").header, tmp_path)["components"][0]["delivery"]


@pytest.mark.compiler
def test_the_same_fmu_in_another_place_or_built_anew_is_no_difference(tmp_path: Path) -> None:
    first, second = folders(tmp_path)
    write_baseline(run(first_order(first)), tmp_path / "base.json")
    found = check(run(first_order(second)), read_baseline(tmp_path / "base.json"))
    assert (found.equal, list(found.causes)) == (True, [])


@pytest.mark.compiler
def test_a_run_that_cannot_start_is_explained_by_what_the_delivery_changed(tmp_path: Path) -> None:
    first, second = folders(tmp_path)
    arguments = {"stop": 1.0, "step": 0.1, "inputs": {"effort": 1.0}}
    path = tmp_path / "base.json"
    write_baseline(Call.run(first_order(first), tmp_path, path, **arguments).subject.result, path)
    with pytest.raises(BaselineError, match=r"^input effort renamed force\n.*effort"):
        Call.run(first_order(second, inputs=["force"]), tmp_path, path, **arguments)
