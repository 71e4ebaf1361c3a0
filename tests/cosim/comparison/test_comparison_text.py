"""The comparison as text, and the notes beside it."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from made_results import STRICT, compared, made

from cosim.comparison.compare import compare_results, notes
from cosim.comparison.comparison_text import MOST_LINES, comparison_text
from cosim.comparison.tolerance import Tolerance, Tolerances
from cosim.comparison.verdict import EventComparison, EventDifference
from cosim.results.result import BaliseRecord

TIME = np.arange(101) * 0.01
SPEED = 10.0 * TIME
UNITS = {"train.speed": "m/s", "train.place": "m"}
BUMP = np.where((TIME > 0.315) & (TIME < 0.485), 0.12, 0.0)


def test_a_finding_says_where_how_much_and_what_is_allowed() -> None:
    bump = 0.06 * (1.0 - np.cos(2.0 * np.pi * np.clip((TIME - 0.3) / 0.2, 0.0, 1.0)))
    other = made(TIME, train__speed=SPEED + bump, units=UNITS)
    one = compared(made(TIME, train__speed=SPEED, units=UNITS), other, Tolerance(0.002, 0.0))["train.speed"]
    assert [finding.text for finding in one.findings] == [
        "train.speed: from 0.31 to 0.49 s 19 points outside the tube, at worst 0.12 m/s too high at 0.4 s (allowed "
        "0.002 m/s)"
    ]
    # the allowed time is a millionth of a second
    assert one.worst[0] == pytest.approx((0.4, 4.0, 4.12, 0.12), abs=2e-5)


def test_text_shows_what_differs_and_verbose_all() -> None:
    reference = made(TIME, train__speed=SPEED, train__place=TIME, gone=TIME, units=UNITS)
    result = made(TIME, train__speed=SPEED + BUMP, train__place=TIME + 1e-5, gone_=TIME, units=UNITS)
    comparison = compared(reference, result)
    text = comparison_text(comparison)
    assert text.startswith("result DIFFERS from reference: 1 within tolerance, 1 differ, 1 missing, 1 extra;")
    assert "gone: missing in the result; gone_ has its values" in text
    assert "too high" in text
    assert "worst points" in text
    assert "train.place" not in text
    assert "train.place" in comparison_text(comparison, verbose=True)
    assert max(map(len, text.splitlines())) <= 130


def test_what_all_signals_share_is_reported_once() -> None:
    reference = made(TIME, a=TIME, b=TIME, c=TIME)
    text = comparison_text(compared(reference, made(TIME[:-1], a=TIME[:-1], b=TIME[:-1], c=TIME[:-1])))
    assert text.count("ends at 0.99 s instead of 1 s") == 1
    assert "all 3 signals" in text


def test_noise_is_stated_in_few_lines() -> None:
    noise = 0.01 * np.random.default_rng(0).standard_normal(1001)
    time = np.arange(1001) * 0.01
    comparison = compared(made(time, y=time), made(time, y=time + noise))
    assert len(comparison["y"].findings) <= 20
    assert comparison["y"].share_outside == pytest.approx(np.mean(np.abs(noise) > 1e-3), abs=0.005)
    assert len(comparison_text(comparison).splitlines()) <= 20


def test_an_agreement_is_one_line() -> None:
    some = made(TIME, y=TIME)
    assert comparison_text(compared(some, some)) == (
        "result agrees with reference: 1 equal; telegrams not compared: one side keeps none."
    )


def test_telegrams_are_listed() -> None:
    record = BaliseRecord(0.5, 0.6, "b1", 5.0, 5.0)
    one, two = (
        made(TIME, y=TIME, events=[record]),
        made(TIME, y=TIME, events=[replace(record, identity="b2", stamp=0.9)]),
    )
    text = comparison_text(compared(one, two))
    assert "telegram 'b1' (true) of 0.5 s is missing" in text
    assert "telegram 'b2' (true) of 0.9 s is only in the result" in text


def test_json_data_is_plain() -> None:
    data = compared(made(TIME, y=SPEED), made(TIME, y=SPEED + BUMP)).to_dict()
    assert json.loads(json.dumps(data))["equal"] is False


def test_notes_name_versions_parameters_and_misspelt_tolerances() -> None:
    def run(**changes: object) -> dict[str, object]:
        entry = {"name": "plant", "guid": "{1}", "parameters": {"mass": 1.0, "drag": 2.0}}
        return {"versions": {"numpy": "2.0", "python": "3.11"}, "components": [entry | changes], "step": 0.1}

    one = made(TIME, y=TIME, summary=run())
    two = made(TIME, y=TIME, summary=run(guid="{2}", parameters={"mass": 1.5}) | {"versions": {"numpy": "2.1"}})
    assert notes(one, replace(two, failure="it blew up"), Tolerances(by_signal={"yy": STRICT}), ("A", "B")) == [
        "B: the run ended early: it blew up",
        "plant has the GUID {2} instead of {1}.",
        "Parameter plant.mass is 1.5 instead of 1.0.",
        "Parameter plant.drag is its default instead of 2.0.",
        "Other versions: numpy 2.1 instead of 2.0.",
        "The tolerance for 'yy' fits no signal; did you mean 'y'?",
    ]
    assert "note: Other versions" in comparison_text(compare_results(one, two))


@settings(deadline=None, max_examples=25)
@given(
    st.integers(0, 60),
    st.integers(0, 5),
    st.integers(0, 40),
    st.integers(0, 40),
    st.integers(0, 9),
    st.integers(0, 9),
    st.booleans(),
)
def test_a_difference_fits_a_screen_and_begins_with_its_cause(
    differ: int, missing: int, telegrams: int, packets: int, causes: int, notes: int, ends: bool
) -> None:
    """Many signals, telegrams, causes and notes at once: what there is more is counted, and the first of each shown."""
    some = {f"train.s{k}": SPEED + k for k in range(differ)}
    other = {name: np.roll(values, 40 + k) for k, (name, values) in enumerate(some.items())}
    gone = {f"gone{k}": TIME for k in range(missing)}
    events = [BaliseRecord(0.01 * k, 0.6, f"b{k}", 5.0, 5.0) for k in range(telegrams)]
    one = made(TIME, y=TIME, **some, **gone, events=[BaliseRecord(0.5, 0.6, "own", 5.0, 5.0)])
    two = made(TIME[:-1] if ends else TIME, y=TIME[: 100 if ends else 101], events=events)
    if not ends:
        two = made(TIME, y=TIME, **other, events=events)
    found = compared(one, two)
    reasons = [f"cause {k}" for k in range(causes)]
    sent = [EventDifference("missing", None, None, f"packet {k} is missing") for k in range(packets)]
    remarks = [*reasons, *(f"remark {k}" for k in range(notes))]
    found = replace(found, causes=reasons, notes=remarks, packets=EventComparison(differences=sent))
    lines = comparison_text(found).splitlines()
    assert len(lines) <= MOST_LINES
    assert [line for line in lines if line.startswith("cause")] == reasons[: 3 if causes <= 3 else 2]
    assert found.equal or not causes or lines[0] == "cause 0"
    assert any("DIFFERS" in line or "agrees" in line for line in lines[: 1 + min(causes, 3)])
    assert len(comparison_text(found, verbose=True).splitlines()) >= len(lines)
