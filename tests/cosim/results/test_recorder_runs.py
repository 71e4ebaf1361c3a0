"""Recording in whole runs: past the stated memory, thinned, with a full disk; and everything downstream on a table in a
file.
"""

from __future__ import annotations

import resource
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from small_scenarios import small

from cosim.errors import OutputError
from cosim.results import recorder as recorder_module
from cosim.results.result import SignalInfo
from cosim.results.results_folder import read_results
from cosim.results.si import in_si
from cosim.run.outcome import Outcome
from plant_models.hybrid.units import Unit, parse_unit

KEEP_20_ROWS = 0.005  # MB, at some 30 columns


@pytest.fixture(autouse=True)
def small_blocks(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(recorder_module, "BLOCK", 2e3)


def run(**master: Any) -> Outcome:
    stated = {"certificates": "ignore", "report.tables": ["csv", "mat"]}
    return small(master=master).run(overrides=stated, warn=lambda _text: None)


def test_a_run_that_outgrows_its_memory_is_an_equal_run(tmp_path: Path) -> None:
    whole, streamed = run(), run(record_memory=KEEP_20_ROWS)
    assert isinstance(streamed.result.table, np.memmap)
    assert not isinstance(whole.result.table, np.memmap)
    np.testing.assert_array_equal(streamed.result.table, whole.result.table)
    # 51 points, two rows for each of three balises
    assert streamed.result.summary["rows"] == len(whole.result.table) == 57
    written = streamed.write(tmp_path)
    np.testing.assert_array_equal(read_results(tmp_path).table, whole.result.table)
    assert written["report"].stat().st_size > 1e5
    written["csv"].unlink()
    np.testing.assert_array_equal(read_results(tmp_path).table, whole.result.table)  # from the MAT file


@pytest.mark.parametrize("memory", [256.0, KEEP_20_ROWS])
def test_thinned_rows_are_rows_of_the_whole_run(memory: float) -> None:
    whole, thinned = run().result, run(record_every=7, record_memory=memory).result
    times = [0.07 * k for k in range(8)]  # of 51 points: 0, 7, ..., 49
    events = [t for event in whole.events for t in (event.stamp, event.stamp)]
    after = [np.ceil(event.stamp / 0.01) * 0.01 for event in whole.events]
    points = {round(t, 9) for t in (*times, *after, 0.5)}
    np.testing.assert_allclose(thinned.time, sorted([*points, *events]), atol=1e-9)
    rows = {tuple(row) for row in whole.table.tolist()}
    assert all(tuple(row) in rows for row in thinned.table.tolist())
    assert thinned.summary["reached"] == whole.summary["reached"] == 0.5


def test_a_full_disk_is_the_end_of_the_run_and_not_of_its_results(tmp_path: Path) -> None:
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (4000, hard))
    try:
        outcome = run(record_memory=KEEP_20_ROWS)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert outcome.failure is not None
    assert "cannot continue on disk" in outcome.failure
    np.testing.assert_array_equal(outcome.result.table, run().result.table[: len(outcome.result.table)])
    assert 10 < len(outcome.result.table) < 50
    assert outcome.write(tmp_path, report=False)["csv"].exists()


def test_conversion_to_si_takes_a_table_block_by_block(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("cosim.results.si.CHUNK", 7)
    names = ["a.speed", "a.angle", "a.place", "a.odd"]
    table = np.zeros(40, dtype=[(n, float) for n in ("time", *names)])
    for i, name in enumerate(("time", *names)):
        table[name] = np.arange(40.0) + 100 * i
    units: dict[str, Unit | None] = {
        "a.speed": parse_unit("km/h"),
        "a.angle": parse_unit("deg"),
        "a.place": parse_unit("m"),
    }
    whole = table.copy()
    found, signals = in_si(table, [SignalInfo(n) for n in names], units.get)
    np.testing.assert_allclose(found["a.speed"], whole["a.speed"] / 3.6, rtol=1e-15)
    np.testing.assert_allclose(found["a.angle"], np.deg2rad(whole["a.angle"]), rtol=1e-15)
    np.testing.assert_array_equal(found["a.place"], whole["a.place"])
    assert [s.unit for s in signals] == ["m/s", "rad", "1", "1"]


def test_the_table_as_it_is_in_memory_is_written_and_read_without_loading_it(tmp_path: Path) -> None:
    outcome = small(master={"record_memory": KEEP_20_ROWS}, report={"tables": ["npy"]}).run()
    paths = outcome.write(tmp_path, report=False)
    assert set(paths) & {"csv", "mat", "npy"} == {"npy"}
    found = read_results(tmp_path).table
    assert isinstance(found, np.memmap)
    np.testing.assert_array_equal(found, outcome.result.table)
    (tmp_path / "table.npy").write_bytes(b"\x93NUMPY")
    with pytest.raises(OutputError, match=r"table\.npy is not a result table"):
        read_results(tmp_path)
