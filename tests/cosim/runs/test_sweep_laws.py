"""Random small studies: whatever is varied, the table does not depend on workers, order and sittings."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import pytest
from hypothesis import Phase, given, settings
from hypothesis import strategies as st

from cosim import Scenario
from cosim.runs.journal import JOURNAL, read_lines
from cosim.studies.seed_runs import seed_study
from cosim.studies.sweep import Sweep

VARIATIONS = st.fixed_dictionaries(
    {
        "train.mass": st.floats(6e4, 1.2e5),
        "train.effort": st.floats(-1e5, 1e5),
        "stop": st.sampled_from([0.05, 0.1, 0.2]),
        "seed": st.integers(0, 3),
        "balises.file": st.sampled_from(["balises.csv", "missing.csv"]),
    }
)


@pytest.fixture(scope="module")
def plant(tmp_path_factory: pytest.TempPathFactory) -> Scenario:
    """A locomotive that passes a balise, or cannot begin, with an odometer whose noise follows the seed."""
    folder = tmp_path_factory.mktemp("track")
    (folder / "balises.csv").write_text("position\n0.5\n")
    scenario = Scenario(folder=folder, step=0.01).add(
        "train", model="locomotive", **{"as": "block3"}, parameters={"train_speed": 10.0}
    )
    scenario.add("odometer", model="odometer", **{"as": "block3"}, parameters={"noise_std": 0.1})
    scenario.connect("train.wheel_speed -> odometer.wheel_speed")
    balises = {"position": "train.position", "speed": "train.speed", "odometer": "odometer.reading"}
    return scenario.balises(**balises, layout="csv", file="balises.csv", latency_jitter=0.01)


def last(outcome: Any) -> float:
    return float(outcome["odometer.reading"][-1])


def rows(sweep: Sweep, **how: Any) -> list[str]:
    """The table as text, to the last bit; runs by their settings."""
    table = sweep.run(measure={"reading": last}, keep=False, **how).table()
    return sorted(str(sorted({**row, "run": 0}.items())) for row in table)


class _InterruptedError(Exception):
    """In place of somebody who has had enough."""


@settings(max_examples=4, deadline=None, phases=[Phase.generate])
@given(data=st.data(), varied=st.lists(VARIATIONS, min_size=1, max_size=5))
def test_the_table_of_a_sweep_is_equal_to_the_bit(data: Any, varied: list[dict[str, Any]], plant: Scenario) -> None:
    sweep = plant.vary([{**each, "balises.file": str(plant.folder / each["balises.file"])} for each in varied])
    whole = rows(sweep)
    assert rows(sweep, workers=2) == whole
    shuffled = data.draw(st.permutations(sweep.variations))
    assert rows(plant.vary(shuffled)) == whole
    stop = data.draw(st.integers(1, len(varied)))

    def enough(done: int, _all: int) -> None:
        if done == stop:
            raise _InterruptedError

    with TemporaryDirectory() as folder:
        with pytest.raises(_InterruptedError):
            rows(sweep, directory=folder, folders=False, progress=enough)
        assert len(read_lines(Path(folder) / JOURNAL)) == stop
        assert rows(plant.vary(shuffled), workers=2, directory=folder, folders=False, resume=True) == whole


def test_seeds_are_equal_with_workers_and_resumed(plant: Scenario, tmp_path: Path) -> None:
    scenario = plant.copy().set("stop", 0.2).set("balises.file", str(plant.folder / "balises.csv"))
    scenario.add("observer", observer="takagi_sugeno_cdo", **{"as": "block3"}, parameters={"estimated_speed": 10.0})
    scenario.connect("odometer.reading -> observer.odometer")
    scenario.report(true_position="train.position", true_speed="train.speed")
    whole = seed_study(scenario, range(4))
    seed_study(scenario, [2, 0], directory=tmp_path)
    resumed = seed_study(scenario, range(4), workers=2, directory=tmp_path, resume=True)
    assert resumed.to_data() == whole.to_data()
    assert len({row.errors["observer", "whole run"] for row in whole.each}) == 4  # chance does something
    assert len(read_lines(tmp_path / JOURNAL)) == 4
