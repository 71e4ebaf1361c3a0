"""Telegrams in a table from elsewhere: what it must hold, what is assumed, and a run that has no true position at
all.
"""

from __future__ import annotations

from math import isnan
from pathlib import Path

import pytest

from cosim import Scenario
from cosim.balises.layout import from_csv
from cosim.balises.recorded import RecordedLayout, read_layout
from cosim.choice.playback import train_observers
from cosim.errors import ScenarioError
from cosim.results.record_rows import TELEGRAM_ROWS
from cosim.results.result_data import BaliseRecord

LOG = "time,odometer [km/h],effort [N]\n0,36,0\n2,36,0\n"


def table(folder: Path, text: str) -> Path:
    path = folder / "telegrams.csv"
    path.write_text(text, encoding="utf-8")
    return path


def without_position(folder: Path, telegrams: str) -> Scenario:
    """A logger's odometer at 10 m/s, an observer, telegrams; no plant."""
    table(folder, telegrams)
    (folder / "log.csv").write_text(LOG, encoding="utf-8")
    scenario = Scenario(folder=folder, stop=2.0, step=0.01).add("log", recording="log.csv")
    scenario.add("observer", observer="takagi_sugeno_cdo", parameters={"estimated_speed": 10.0}, **{"as": "block3"})
    scenario.connect("log.odometer -> observer.odometer", "log.effort -> observer.effort")
    return scenario.balises(layout="recorded", file="telegrams.csv")


def quietly(_: str) -> None: ...


def test_stamp_and_position_are_enough(tmp_path: Path) -> None:
    first, second = read_layout(table(tmp_path, "position [km];stamp\n0,02;2,0\n0,01;0,5\n")).records
    assert (first.stamp, first.delivered_at, first.position, first.identity, first.kind) == (
        0.5,
        0.5,
        10.0,
        "T2",
        "true",
    )
    assert (second.stamp, second.position, second.identity) == (2.0, 20.0, "T1")
    assert isnan(first.odometer_reading)
    assert isnan(first.true_position)


def test_what_is_stated_is_taken(tmp_path: Path) -> None:
    text = (
        "stamp,delivered_at [ms],identity,position,kind,odometer_reading "
        "[km/h]\n0.5,700,B1,5,false,36\n0.6,,B2,6,missed,\n"
    )
    one, missed = read_layout(table(tmp_path, text)).records
    assert (one.identity, one.kind) == ("B1", "false")
    assert one.delivered_at == pytest.approx(0.7, rel=1e-15)
    assert one.odometer_reading == pytest.approx(10.0, rel=1e-15)
    assert isnan(missed.delivered_at)


def test_an_observer_listens_to_a_log_without_a_true_position(tmp_path: Path) -> None:
    """At 10 m/s the balises told are where the train is, so the estimate ends at the last one plus 10 m/s times the
    rest.
    """
    events = "stamp,delivered_at,position\n" + "".join(
        f"{0.25 * k},{0.25 * k + 0.055},{2.5 * k}\n" for k in range(1, 8)
    )
    outcome = without_position(tmp_path, events).run(warn=quietly)
    assert [(e.stamp, e.delivered_at) for e in outcome.result.events] == [
        (0.25 * k, 0.25 * k + 0.055) for k in range(1, 8)
    ]
    assert {e.outcomes["observer"] for e in outcome.result.events} == {"replayed"}
    # drag, which the log's effort does not balance
    assert outcome["observer.position"][-1] == pytest.approx(20.0, abs=0.05)


@pytest.mark.parametrize("kind", ["block2", "block3"])
def test_a_telegram_of_the_very_start_is_delivered_and_those_outside_the_run_are_counted(
    tmp_path: Path, kind: str
) -> None:
    """It moves the estimate as one a nanosecond later would. A missed one is nobody's loss."""
    said: list[str] = []
    ends = []
    for stamp in (0.5, 0.5 + 1e-7):
        events = f"stamp,position,kind\n0.1,1,true\n0.2,2,missed\n{stamp:.9f},1005,true\n1.6,1,true\n1.7,1,false\n"
        scenario = without_position(tmp_path, events).set("observer.as", kind)
        outcome = scenario.set("start", 0.5).set("stop", 1.5).run(warn=said.append)
        assert [e.outcomes["observer"] for e in outcome.result.events] == ["accepted"]
        ends.append(outcome["observer.position"][-1])
    assert ends[0] > 900.0
    assert ends[0] == pytest.approx(ends[1], abs=1e-3)  # gains of 1e4 1/s over 1e-7 s
    words = "telegrams outside the run are not delivered: 1 before it starts at 0.5 s and 2 after it stops at 1.5 s."
    assert [text.partition("telegrams.csv: ")[2] for text in said if "outside" in text] == [words] * 2


def test_where_all_telegrams_lie_in_the_run_nothing_is_said_of_them(tmp_path: Path) -> None:
    said: list[str] = []
    without_position(tmp_path, "stamp,position\n0,0\n1,10\n2,20\n").run(warn=said.append)
    assert not [text for text in said if "not delivered" in text]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("stamp,pos\n1,2\n", r"unknown column 'pos'; did you mean 'position'"),
        ("stamp\n1\n", r"need the columns 'stamp' and 'position'; missing: position"),
        ("stamp,position\n1,2\n1.5,x\n", r"line 3: position: expected a number, got 'x'"),
        ("stamp,position\n,2\n", r"line 2: stamp is empty"),
        ("stamp [m],position\n1,2\n", r"'stamp \[m\]': different dimensions"),
        ("stamp,position,kind\n1,2,true\n1,2,lost\n", r"line 3: kind 'lost': expected one of true, missed, false"),
        (
            "time,position\n1,2\n",
            r"a table of signals; expected a results folder, or a CSV with columns 'stamp' and 'position'",
        ),
    ],
)
def test_a_table_that_cannot_be_delivered_is_refused_in_words(text: str, words: str, tmp_path: Path) -> None:
    with pytest.raises(ScenarioError, match=words):
        without_position(tmp_path, text).run(warn=quietly)


def test_position_and_speed_are_left_out_only_beside_a_recording_and_together(tmp_path: Path) -> None:
    table(tmp_path, "stamp,position\n1,2\n")
    alone = Scenario(folder=tmp_path, stop=1.0, step=0.1).add("plant", model="locomotive", **{"as": "block3"})
    recorded = {"layout": "recorded", "file": "telegrams.csv"}
    with pytest.raises(
        ScenarioError, match="no component is a recording; say with 'position' and 'speed' what the plant is"
    ):
        alone.copy().balises(**recorded).run()
    with pytest.raises(ScenarioError, match="'speed' is missing"):
        alone.copy().balises(position="plant.position", **recorded).run()
    with pytest.raises(ScenarioError, match="layout 'instants' needs 'position' and 'speed', outputs of the plant"):
        alone.copy().balises(layout="instants", instants=[0.5]).run()


@pytest.mark.parametrize("accuracy", ["nan", "-0.5", "inf"])
def test_an_accuracy_that_is_none_is_refused_by_row_and_column(tmp_path: Path, accuracy: str) -> None:
    path = table(tmp_path, f"stamp,position,location_accuracy\n0.5,5,3\n0.6,6,{accuracy}\n")
    said = r"telegrams\.csv, line 3: location_accuracy: expected a finite number of 0 m or more, got "
    with pytest.raises(ScenarioError, match=said + accuracy):
        read_layout(path)
    (tmp_path / "track.csv").write_text(f"position,location_accuracy\n5,3\n6,{accuracy}\n", encoding="utf-8")
    with pytest.raises(ScenarioError, match=r"track\.csv, line 3: location_accuracy: expected .* got " + accuracy):
        from_csv(tmp_path / "track.csv")
    record = BaliseRecord(0.5, 0.5, "B1", 5.0, 5.0, float(accuracy))
    with pytest.raises(ScenarioError, match=r"a run: telegram 1 \(B1\): location_accuracy: expected"):
        RecordedLayout((record,), "a run")
    TELEGRAM_ROWS.write(tmp_path / "events.csv", [record])
    with pytest.raises(ValueError, match=r"events\.csv, line 2: location_accuracy: expected"):
        TELEGRAM_ROWS.read(tmp_path / "events.csv")


RECEIVERS = [name for name in train_observers() if name != "delayed_train_observer"]


@pytest.mark.parametrize("way", ["block2", "block3"])
@pytest.mark.parametrize("name", RECEIVERS)
def test_a_telegram_that_is_delivered_twice_counts_once(tmp_path: Path, name: str, way: str) -> None:
    """LAW: no receiver changes by a bit; another telegram of this stamp, and this balise later, are told."""
    ends = []
    for again in ("", "B1,0.5,0.5,5,20\nB1,0.5,0.75,5,20\nB2,1.0,1.3,7,0\n"):
        reported = "identity,stamp,delivered_at,position,location_accuracy\nB1,0.5,0.5,5,20\nB2,1.0,1.1,11,0\n" + again
        scenario = without_position(tmp_path, reported)
        signals = {s.name for s in train_observers()[name]().input_signals}
        scenario.add("receiver", observer=name, **{"as": way})
        wired = [f"log.{s} -> receiver.{s}" for s in ("odometer", "effort") if s in signals]
        outcome = scenario.connect(*wired).set("certificates", "ignore").run(warn=quietly)
        ends.append({s: outcome.result.table[s][-1] for s in outcome.result.table.dtype.names if "receiver." in s})
        fates = [e.outcomes["receiver"] for e in outcome.result.events]
        assert fates.count("repeated") == (3 if again else 0)
    assert ends[0] == ends[1]


def test_false_telegrams_of_one_instant_are_two(tmp_path: Path) -> None:
    reported = "stamp,position,identity,kind\n0.5,5,false,false\n0.5,25,false,false\n"
    outcome = without_position(tmp_path, reported).run(warn=quietly)
    assert [e.outcomes["observer"] for e in outcome.result.events] == ["accepted", "accepted"]
