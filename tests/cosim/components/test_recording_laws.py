"""The law of recordings: who only listens gets, bit for bit, what it got beside the plant; telegrams included."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from small_scenarios import small

from cosim import Scenario
from cosim.errors import CosimError, ScenarioError
from cosim.results.record_rows import TELEGRAM_ROWS
from cosim.results.result import BaliseRecord
from cosim.run.outcome import Outcome

FAULTS: dict[str, Any] = {
    "latency": 0.03,
    "latency_jitter": 0.05,
    "missed": ["B2"],
    "false_telegrams": [{"time": 0.333, "offset": 3.0}],
}
BLOCK2: dict[str, Any] = {"as": "block2"}
CASES: dict[str, dict[str, Any]] = {
    "in time": {},
    "late, missed and false": {"balises": FAULTS},
    "an FMI 2 receiver": {"balises": FAULTS, "observer": BLOCK2},
    "lines of inputs": {"balises": FAULTS, "master": {"inputs": "interpolate"}},
    "jacobi": {"balises": FAULTS, "master": {"algorithm": "jacobi"}},
    "stale": {"balises": {"timing": "stale"}},
    "by prediction": {"balises": {"method": "predict"}},
    "substeps": {"observer": {"substeps": 3}},
}


def joint(case: dict[str, Any]) -> Scenario:
    scenario = small().balises(**case.get("balises", {})).master(**case.get("master", {}))
    for key, value in case.get("observer", {}).items():
        scenario.set(f"observer.{key}", value)
    return scenario


def playback(folder: Path, case: dict[str, Any]) -> Scenario:
    """Built by hand, as a user would: three recordings and the observer of `small`."""
    scenario = Scenario(stop=0.5, step=0.01)
    for name in ("locomotive", "odometer", "driver"):
        scenario.add(name, recording=str(folder))
    scenario.add("observer", observer="takagi_sugeno_cdo", **{"as": "block3"}, parameters={"estimated_speed": 10.0})
    scenario.connect("driver.effort -> observer.effort", "odometer.reading -> observer.odometer")
    timing = {key: value for key, value in case.get("balises", {}).items() if key == "timing"}
    scenario.balises(
        position="locomotive.position", speed="locomotive.speed", layout="recorded", file=str(folder), **timing
    )
    for key, value in case.get("observer", {}).items():
        scenario.set(f"observer.{key}", value)
    return scenario.master(**case.get("master", {}))


def quietly(scenario: Scenario) -> Outcome:
    return scenario.run(warn=lambda _: None)


@pytest.mark.parametrize("name", CASES)
def test_an_observer_cannot_distinguish_the_recording_from_the_plant(name: str, tmp_path: Path) -> None:
    first = quietly(joint(CASES[name]))
    Outcome(first.result, first.spec, ("csv",) if name == "in time" else ("npy",)).write(tmp_path / "run", report=False)
    second = quietly(playback(tmp_path / "run", CASES[name]))
    assert second.failure is None
    fields = first.result.table.dtype.names or ()
    assert set(second.result.table.dtype.names or ()) == set(fields)
    different = [field for field in fields if first[field].tobytes() != second[field].tobytes()]
    assert [field for field in different if field == "time" or field.startswith("observer.")] == []
    assert [(e.identity, e.outcomes, e.stamp) for e in first.result.events] == [
        (e.identity, e.outcomes, e.stamp) for e in second.result.events
    ]
    assert {e.kind for e in second.result.events} >= ({"true", "missed", "false"} if "late" in name else {"true"})


def test_rows_at_telegrams_hold_what_the_plant_showed_there(tmp_path: Path) -> None:
    first = quietly(joint({}))
    first.write(tmp_path / "run", report=False)
    second = quietly(playback(tmp_path / "run", {}))
    for field in first.result.table.dtype.names or ():
        assert second[field].tobytes() == first[field].tobytes(), field


def test_half_of_a_run_gets_its_own_telegrams_only(tmp_path: Path) -> None:
    quietly(joint({})).write(tmp_path / "run", report=False)
    later = playback(tmp_path / "run", {}).set("start", 0.3)
    outcome = quietly(later)
    assert [e.identity for e in outcome.result.events] == ["B3"]
    assert outcome.result.time[0] == 0.3


# -- a recording as the watched plant
# ---------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("method", "bound"), [("auto", 1e-9), ("rollback", 1e-9), ("predict", 1e-8), ("interpolate", 1e-9)]
)
def test_balises_are_found_in_a_recording(method: str, bound: float, tmp_path: Path) -> None:
    """At 12.5 m/s a balise at p is passed at p / 12.5; bounds: docs/reference/events.md, cubics are exact on lines."""
    time = 0.05 * np.arange(41)
    rows = "\n".join(f"{t!r},{12.5 * t!r},12.5" for t in time.tolist())
    (tmp_path / "log.csv").write_text(f"time,position [m],speed [m/s]\n{rows}\n", encoding="utf-8")
    scenario = Scenario(folder=tmp_path, stop=2.0, step=0.02).add("log", recording="log.csv")
    scenario.balises(
        position="log.position", speed="log.speed", layout="positions", positions=[3.21, 10.0, 17.77], method=method
    )
    events = quietly(scenario).result.events
    np.testing.assert_allclose([e.stamp for e in events], np.array([3.21, 10.0, 17.77]) / 12.5, atol=bound, rtol=0.0)
    assert {e.method for e in events} == {"rollback" if method == "auto" else method}


# -- bad input
# ----------------------------------------------------------------------------------------------------------------


def telegram(**changes: Any) -> BaliseRecord:
    return BaliseRecord(
        **({"stamp": 0.1, "delivered_at": 0.1, "identity": "B1", "position": 1.0, "true_position": 1.0} | changes)
    )


@pytest.mark.parametrize(
    ("records", "keys", "words"),
    [
        ([telegram(delivered_at=0.05)], {}, r"telegram 1 \(B1\) was delivered at 0\.05 s, before its stamp, 0\.1 s"),
        ([telegram(stamp=float("nan"))], {}, r"telegram 1 \(B1\): its stamp is not a finite number"),
        (
            [telegram()],
            {"latency": 0.1, "missed": ["B1"]},
            r"delivers the telegrams as recorded; leave out latency, missed",
        ),
        ([telegram()], {"method": "rollback"}, r"leave out method"),
        (None, {}, r"holds no telegrams.*no such file"),
    ],
)
def test_telegrams_that_cannot_be_delivered_are_refused(
    records: list[BaliseRecord] | None, keys: dict[str, Any], words: str, tmp_path: Path
) -> None:
    if records is not None:
        TELEGRAM_ROWS.write(tmp_path / "events.csv", records)
    with pytest.raises(ScenarioError, match=words):
        small().balises(layout="recorded", file=str(tmp_path / "events.csv"), **{"method": "auto"} | keys).run()


def test_a_wrong_row_of_telegrams_is_reported_with_its_file_once(tmp_path: Path) -> None:
    path = tmp_path / "events.csv"
    path.write_text("stamp,position\n0.1,soon\n", encoding="utf-8")
    with pytest.raises(ScenarioError, match="position: expected a number, got 'soon'") as refused:
        small().balises(layout="recorded", file=str(path), method="auto").run()
    text = str(refused.value)
    assert text.count(str(path)) == 1
    assert f"{path}, line 2" in text
    assert "holds no telegrams" not in text  # it holds one, that is wrong


def test_recorded_telegrams_are_not_exported(tmp_path: Path) -> None:
    TELEGRAM_ROWS.write(tmp_path / "events.csv", [telegram()])
    (tmp_path / "log.csv").write_text("time,position,speed\n0,0,1\n1,1,1\n", encoding="utf-8")
    scenario = Scenario(folder=tmp_path, stop=1.0, step=0.1).add("log", recording="log.csv")
    scenario.balises(position="log.position", speed="log.speed", layout="recorded", file="events.csv")
    assert [e.identity for e in quietly(scenario).result.events] == ["B1"]
    with pytest.raises(CosimError, match="recorded telegrams cannot be exported; lay the balises by 'positions'"):
        scenario.export_ssp(tmp_path / "x.ssp")
