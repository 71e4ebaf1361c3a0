"""Libraries that stay loaded change no result: the second run in a process is the first one, bit for bit."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from cosim import Scenario, shipped_scenarios
from cosim.components import kept_libraries
from cosim.components.loading import load_fmu
from cosim.results.result import Result
from cosim.run import component_models as models

REPEATED = ("freight_profile_b_10_hz", "freight_profile_d", "freight_profile_d_10_hz", "freight_sc3", "freight_sc4")
"""Their components are those of others that are tried."""
SHIPPED = [name for name in shipped_scenarios() if name not in ("own_fmu", *REPEATED)]


@pytest.fixture(autouse=True)
def none_kept() -> Iterator[None]:
    """Every test begins without kept libraries."""
    kept_libraries._let_all_go()
    yield
    kept_libraries._let_all_go()


def short(name: str) -> Scenario:
    scenario = Scenario.load(name)
    scenario._data.pop("expect", None)
    scenario._data.get("balises", {}).pop("false_telegrams", None)  # they come later than the run ends
    return scenario.set("stop", 8.0).set("certificates", "ignore").set("report.phases", [])


def assert_equal(one: Result, other: Result) -> None:
    assert one.failure == other.failure
    np.testing.assert_array_equal(one.table.view(np.uint64), other.table.view(np.uint64))
    assert repr(one.events) == repr(other.events)  # as texts: a reading that is not known is no number


@pytest.mark.parametrize("name", SHIPPED)
def test_a_seed_in_a_study_is_the_seed_alone(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    scenario = short(name)
    seeds: dict[str, list[float]] = {
        "stop": [8.0, 7.5]
    }  # a seed changes nothing where a scenario leaves nothing to chance
    if scenario.table().balises is not None:
        seeds["balises.seed"] = [4, 0]
    together = [run.outcome.result for run in scenario.vary(seeds, "zip").each() if run.outcome is not None]
    monkeypatch.setattr(models, "load_shipped", load_fmu)
    alone = [run.outcome.result for run in scenario.vary(seeds, "zip").each() if run.outcome is not None]
    assert len(together) == len(alone) == 2
    for one, other in zip(together, alone, strict=True):
        assert_equal(one, other)
    assert len(together[0].table) != len(together[1].table) or not np.array_equal(
        together[0].table.view(np.uint64), together[1].table.view(np.uint64)
    )


def test_a_library_is_loaded_once_and_makes_way(monkeypatch: pytest.MonkeyPatch) -> None:
    loaded: list[str] = []

    def load(path: Path, name: str) -> object:
        loaded.append(name)
        return load_fmu(path, name)

    monkeypatch.setattr(kept_libraries, "load_fmu", load)
    scenario = Scenario(stop=0.2, step=0.01).add("train", model="locomotive").add("odometer", model="odometer")
    scenario.connect("train.wheel_speed -> odometer.wheel_speed").set("train.train_speed", 10.0)
    first, second = (scenario.run().result for _ in range(2))
    assert sorted(loaded) == ["odometer", "train"]
    assert_equal(first, second)
    kept = list(kept_libraries._kept.values())
    assert [one.used for one in kept] == [0, 0]
    folders = [Path(one.component.slave.unzipDirectory) for one in kept]
    kept[0].used = 1  # as while its component is in a run
    monkeypatch.setattr(kept_libraries, "MOST", 1)
    Scenario(stop=0.2, step=0.01).add("other", model="locomotive").run()
    assert [one.used for one in kept_libraries._kept.values()] == [1, 0]
    assert [folder.is_dir() for folder in folders] == [True, False]
    kept[0].used = 0
