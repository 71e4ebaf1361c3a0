"""Campaigns: the same table whoever does the runs, in whatever order, killed and resumed; each run made again is its
row.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from small_scenarios import small
from test_fmus.events import DEEDS, hostile_fmu

from cosim import Scenario, load_result
from cosim.campaign.again import run_again
from cosim.campaign.campaign import make_campaign
from cosim.campaign.campaign_result import CampaignResult
from cosim.campaign.plan import planned_runs
from cosim.campaign.store import PARTS, read_rows
from cosim.errors import CosimError, OutputError, ScenarioError

VARY = {"seed": {"whole": [0, 9999]}, "locomotive.mass": {"normal": [90.0, 5.0], "low": 80.0, "unit": "t"}}
NOT_KEPT = {"failures": 0, "worst": 0}


def noisy(**campaign: Any) -> Scenario:
    """A small scenario with chance in it, and a campaign."""
    s = small().set("odometer.noise_std", 0.1)
    table = {"runs": 6, "vary": VARY, "keep": NOT_KEPT, **campaign}
    return s.with_settings({"campaign": table})


def table_of(directory: Path) -> list[dict[str, Any]]:
    """All rows but for how long they took, as texts, in which NaN equals itself."""
    rows = read_rows(directory).to_pylist()
    return [{name: repr(value) for name, value in row.items() if name != "seconds"} for row in rows]


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a campaign that nothing disturbed."""
    folder = tmp_path_factory.mktemp("undisturbed")
    make_campaign(noisy()).run(folder, progress=False)
    return folder


def test_two_workers_give_the_same_table(undisturbed: Path, tmp_path: Path) -> None:
    make_campaign(noisy()).run(tmp_path, workers=2, progress=False)
    assert table_of(tmp_path) == table_of(undisturbed)
    assert len({row["observer.position_error_max"] for row in table_of(tmp_path)}) == 6


def test_what_varies_may_be_written_in_any_order(undisturbed: Path) -> None:
    keys = [run.key for run in make_campaign(noisy(vary=dict(reversed(VARY.items())))).runs]
    assert keys == [row["key"].strip("'") for row in table_of(undisturbed)]


def test_a_run_that_is_made_again_is_its_row(undisturbed: Path, tmp_path: Path) -> None:
    campaign = make_campaign(Scenario.load(undisturbed / "scenario.toml"))
    result = CampaignResult.read(undisturbed, campaign.table, campaign.names)
    again = run_again(result, campaign, result.key(4)[:10], tmp_path / "out", progress=False)
    assert (again.number, again.differs) == (4, {})
    assert load_result(tmp_path / "out").summary["sweep_settings"].keys() == VARY.keys()
    with pytest.raises(ScenarioError, match="no run has a key"):
        run_again(result, campaign, "zz", None, progress=False)


KILLED = """
import sys
from pathlib import Path
sys.path[:0] = {path!r}
from test_campaign import noisy
from cosim.campaign.campaign import make_campaign
make_campaign(noisy()).run(Path({folder!r}), progress=False, resume=True)
"""


@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="there is no such signal")
def test_killed_and_resumed_the_table_is_the_same(undisturbed: Path, tmp_path: Path) -> None:
    here = Path(__file__).parent
    code = KILLED.format(path=[str(here), str(here.parent), str(here.parents[1])], folder=str(tmp_path))
    process = subprocess.Popen([sys.executable, "-c", code])
    end = time.monotonic() + 120.0
    while not list(tmp_path.glob(f"{PARTS}/*.parquet")) and process.poll() is None:
        assert time.monotonic() < end
        time.sleep(0.01)
    process.kill()
    process.wait()
    make_campaign(noisy()).run(tmp_path, progress=False, resume=True)
    assert table_of(tmp_path) == table_of(undisturbed)
    assert not list(tmp_path.glob(f"{PARTS}/*.jsonl"))


def test_rows_of_a_chunk_that_was_killed_are_taken_over(undisturbed: Path, tmp_path: Path) -> None:
    campaign = make_campaign(noisy())
    chunk = campaign._chunks(campaign._opened(tmp_path, False), False)[2][0]
    row = read_rows(undisturbed).to_pylist()[2] | {"seconds": 123.0}
    assert row["key"] == chunk.runs[0].key
    chunk.store.note(2, "killed", {"key": row["key"]})
    chunk.store.note(2, "killed", row)
    with chunk.store.spill(2, "killed").open("ab") as file:
        file.write(b'{"key": "half a li')
    campaign.run(tmp_path, progress=False, resume=True)
    assert table_of(tmp_path) == table_of(undisturbed)
    assert read_rows(tmp_path).to_pylist()[2]["seconds"] == 123.0


@pytest.mark.compiler
@pytest.mark.skipif(not hasattr(os, "fork"), reason="the crash is a signal")
def test_a_crash_is_the_row_of_its_run_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("cosim.campaign.campaign._LARGEST", 3)  # 9 runs: chunks of three
    fmu = hostile_fmu(tmp_path)
    deeds = [float(DEEDS.index("crashes" if number in (1, 2, 5) else "nothing")) for number in range(9)]
    s = Scenario(stop=0.5, step=0.1).add("bad", fmu=fmu)
    vary = {"bad.deed": deeds, "seed": list(range(9))}
    campaign = make_campaign(s.with_settings({"campaign": {"method": "zip", "vary": vary, "keep": NOT_KEPT}}))
    result = campaign.run(tmp_path / "out", progress=False)
    assert [row["number"] for row in read_rows(tmp_path / "out").to_pylist()] == list(range(9))
    assert sorted(result.failures) == [1, 2, 5]
    assert "bad" in result.failures[1]
    assert result.causes()[0].startswith("3 failed (run 1): ")
    again = campaign.run(tmp_path / "out", progress=False, resume=True, retry=True)
    assert sorted(again.failures) == [1, 2, 5]


def test_another_campaign_is_refused_with_what_differs(undisturbed: Path) -> None:
    before = table_of(undisturbed)
    with pytest.raises(OutputError, match=r"differs in campaign.seed: none there, 4 here"):
        make_campaign(noisy(seed=4)).run(undisturbed, progress=False, resume=True)
    with pytest.raises(OutputError, match="the scenario, or the content of its files"):
        make_campaign(noisy().set("stop", 0.4)).run(undisturbed, progress=False, resume=True)
    with pytest.raises(OutputError, match="go on with --resume"):
        make_campaign(noisy()).run(undisturbed, progress=False)
    assert table_of(undisturbed) == before


def test_designs_stand_over_the_same_disturbances(tmp_path: Path) -> None:
    campaign = make_campaign(noisy(runs=7, design={"odometer.noise_std": [0.1, 0.2]}))
    settings = [run.planned.settings for run in campaign.runs]
    assert [one["odometer.noise_std"] for one in settings] == [0.1, 0.2] * 7
    assert all(settings[k]["seed"] == settings[k + 1]["seed"] for k in range(0, 14, 2))
    pairs = campaign.run(tmp_path, progress=False).comparisons()
    assert pairs is not None
    assert len(pairs.rows) == 1


def test_numbers_come_in_the_unit_of_the_setting() -> None:
    masses = [run.settings["locomotive.mass"] for run in planned_runs(noisy(), noisy().table().campaign)]  # type: ignore[arg-type]
    assert all(80e3 <= mass <= 120e3 for mass in masses)


def test_columns_have_units(undisturbed: Path) -> None:
    schema = read_rows(undisturbed).schema
    units = {name: schema.field(name).metadata[b"unit"] for name in ("locomotive.mass", "observer.speed_error_max")}
    assert units == {"locomotive.mass": b"kg", "observer.speed_error_max": b"m/s"}
    assert str(schema.field("seed").type) == "int64"


def test_the_worst_and_a_sample_are_kept_whole(tmp_path: Path) -> None:
    keep = {"worst": 1, "sample": 2, "of": ["observer.position_error_max"]}
    result = make_campaign(noisy(keep=keep)).run(tmp_path, progress=False)
    worst = result.worst("observer.position_error_max")[0]
    assert worst in result.kept
    assert 2 <= len(result.kept) <= 3
    assert all((folder / "summary.json").is_file() for folder in result.kept.values())
    position = result.column("observer.position_error_max")
    assert np.nanargmax(position) == worst


def test_pictures_are_drawn(undisturbed: Path) -> None:
    campaign = make_campaign(noisy())
    result = CampaignResult.read(undisturbed, campaign.table, campaign.names)
    assert result.plot().get_ylabel() == "Share of runs below"
    assert result.plot("observer.speed_error_max", "locomotive.mass").get_xlabel() == "locomotive.mass [kg]"


@pytest.mark.parametrize(
    ("campaign", "said"),
    [
        ({"vary": {"locomotive.mas": [1.0, 2.0]}}, "campaign.vary: .*did you mean 'mass'"),
        ({"vary": {"locomotive.mass": {"uniform": [5.0, 2.0]}}}, "campaign.vary.locomotive.mass: A range needs"),
        ({"vary": {"seed": {"unifrm": [0, 1]}}}, "cannot set 'seed.unifrm'"),
        ({"vary": {"balises.latency": {"uniform": [-5.0, 2.0]}}}, r"campaign.vary.balises.latency: -\d"),
        ({"vary": {"seed": {"whole": [0, 5], "unit": "t"}}}, "campaign.vary.seed: unit 't' cannot be"),
        ({"faults": True}, "no component with a fault"),
        ({"method": "grid", "runs": None}, "takes lists"),
        ({"where": ["seed > 5 and seed < 5"]}, "campaign.where: 0 of"),
    ],
)
def test_what_cannot_be_is_refused_with_its_key(campaign: dict[str, Any], said: str) -> None:
    with pytest.raises(CosimError, match=said):
        make_campaign(noisy(**campaign))


@pytest.mark.parametrize(
    ("campaign", "said"),
    [
        ({"runs": 0}, "campaign.runs"),
        ({"vary": {"seed": {"uniform": [0, 1], "log": [1, 2]}}}, "uniform and log"),
        ({"vary": {}}, "nothing varies"),
        ({"method": "grid"}, "'runs' is not given with method 'grid'"),
        ({"correlate": [["seed", "other", 0.5]]}, "'other' is not varied"),
        ({"design": {"seed": [1]}}, "both 'vary' and 'design'"),
    ],
)
def test_a_table_that_cannot_be_is_refused_with_its_key(campaign: dict[str, Any], said: str) -> None:
    with pytest.raises(ScenarioError, match=said):
        noisy(**campaign).table()


def test_a_measure_that_no_run_has_is_named(tmp_path: Path) -> None:
    keep = {"of": ["observer.position_eror_max"]}
    with pytest.raises(ScenarioError, match=r"did you mean 'observer.position_error_max'"):
        make_campaign(noisy(runs=1, keep=keep)).run(tmp_path, progress=False)
