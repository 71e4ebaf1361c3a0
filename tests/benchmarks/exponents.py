"""Benchmark: how the cost of every reader, comparison and table grows with what it counts.

Run it with ``python tests/benchmarks/exponents.py [PART OF A NAME]`` from the root of the project. CPU seconds at 10^3,
10^4 and 10^5 of each, in one process, and the growth: the exponent between the two larger sizes. 1 is linear, 2 is
quadratic. Nothing is asserted.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from itertools import chain
from math import log10
from pathlib import Path

import numpy as np
from cpu_time import seconds

from cosim import Scenario
from cosim.balises.layout import from_csv
from cosim.balises.telegram import Mailbox
from cosim.baselines.baseline_files import read_baseline, write_baseline
from cosim.baselines.regression import check
from cosim.comparison.compare import compare_results
from cosim.errors import ScenarioError
from cosim.evaluation.stored_spec import spec_of
from cosim.report.page.run_page import write_report_page
from cosim.results.load_result import load_result
from cosim.results.record_rows import PACKET_ROWS, TELEGRAM_ROWS
from cosim.results.result import BaliseRecord, PacketRecord, Result, SignalInfo
from cosim.results.results_folder import read_results, write_results
from cosim.results.table_layout import table_of
from cosim.runs.journal import read_lines, write_line
from fmus.tables.table import Table, name_column, text_column

SIZES = (10**3, 10**4, 10**5)
ENOUGH = 60.0
"""A size is left out where the one before took a tenth of this [s]."""
FEW = 10
"""Rows of a result whose signals, telegrams or packets are counted."""

Measured = Callable[[], object]


def result(rows: int, signals: int = 1, *, held: bool = False, shift: float = 0.0) -> Result:
    """A run of `rows` rows; its signals are waves, or held for ten rows each; `shift` is added."""
    time = 0.01 * np.arange(rows)
    wave = np.round(np.sin(0.3 * (np.floor(10.0 * time) if held else time)), 6) + shift
    infos = [SignalInfo(f"one.s{i}", "m", "one", "discrete" if held else "continuous", "") for i in range(signals)]
    table = table_of(["time", *(s.name for s in infos)], [time, *(wave + i for i in range(signals))])
    return Result(table=table, signals=tuple(infos), summary={"events_recorded": True})


def _telegrams(count: int, late: float = 0.0, names: int = 10**9) -> tuple[BaliseRecord, ...]:
    return tuple(
        BaliseRecord(0.01 * i + late, 0.01 * i + late, f"B{i % names}", float(i), float(i), outcomes={"o": "accepted"})
        for i in range(count)
    )


def _packets(count: int) -> tuple[PacketRecord, ...]:
    return tuple(
        PacketRecord(0.01 * i, 0.01 * i + 0.001, "node", i, {"one.s0": 1.0}, outcomes={"o": "accepted"})
        for i in range(count)
    )


def _compared(one: Result, two: Result) -> Measured:
    return lambda: compare_results(one, two)


def compare_rows(count: int, _folder: Path) -> Measured:
    return _compared(result(count), result(count, shift=1.0))


def compare_held_rows(count: int, _folder: Path) -> Measured:
    return _compared(result(count, held=True), result(count, held=True, shift=1.0))


def compare_signals(count: int, _folder: Path) -> Measured:
    return _compared(result(FEW, count // 10), result(FEW, count // 10, shift=1.0))


def compare_telegrams(count: int, _folder: Path) -> Measured:
    one, two = (replace(result(FEW), events=_telegrams(count, late)) for late in (0.0, 1e-6))
    return _compared(one, two)


def compare_telegrams_of_few_balises(count: int, _folder: Path) -> Measured:
    one, two = (replace(result(FEW), events=_telegrams(n, 0.0, 7)) for n in (count, count - 3))
    return _compared(one, two)


def compare_packets(count: int, _folder: Path) -> Measured:
    one, two = (replace(result(FEW), packets=_packets(n)) for n in (count, count - 3))
    return _compared(one, two)


def layout(count: int, folder: Path, twice: int = 0) -> Measured:
    file = folder / "balises.csv"
    rows = (f"B{i - twice * (i == count - 1)},{i}.5\n" for i in range(count))
    file.write_text("identity,position_m\n" + "".join(rows), encoding="utf-8")

    def read() -> None:
        with suppress(ScenarioError):
            from_csv(file)

    return read


def layout_with_one_twice(count: int, folder: Path) -> Measured:
    return layout(count, folder, 1)


def mailbox(count: int, _folder: Path) -> Measured:
    telegrams = _telegrams(count)

    def post() -> None:
        box: Mailbox[BaliseRecord] = Mailbox()
        for telegram in telegrams:
            box.post(telegram)

    return post


def read_folder(count: int, folder: Path) -> Measured:
    one = replace(result(count), events=_telegrams(count), packets=_packets(count))
    write_results(one, folder / "run")
    return lambda: read_results(folder / "run")


def write_folder(count: int, folder: Path) -> Measured:
    one = replace(result(count), events=_telegrams(count), packets=_packets(count))
    return lambda: write_results(one, folder / "run")


def _columns(count: int, folder: Path, ending: str) -> Measured:
    file = folder / f"wide.{ending}"
    result(FEW, count // 10).save(file)
    return lambda: load_result(file)


def signals_of_csv(count: int, folder: Path) -> Measured:
    return _columns(count, folder, "csv")


def signals_of_mat(count: int, folder: Path) -> Measured:
    return _columns(count, folder, "mat")


def signals_of_npy(count: int, folder: Path) -> Measured:
    return _columns(count, folder, "npy")


def signals_of_hdf5(count: int, folder: Path) -> Measured:
    return _columns(count, folder, "h5")


def signals_of_parquet(count: int, folder: Path) -> Measured:
    return _columns(count, folder, "parquet")


def rows_of_hdf5(count: int, folder: Path) -> Measured:
    result(count).save(folder / "long.h5")
    return lambda: load_result(folder / "long.h5")


def rows_of_parquet(count: int, folder: Path) -> Measured:
    result(count).save(folder / "long.parquet")
    return lambda: load_result(folder / "long.parquet")


def _page(shown: Result, folder: Path) -> Measured:
    return lambda: write_report_page(shown, spec_of(shown), folder / "page.html")


def page_of_rows(count: int, folder: Path) -> Measured:
    return _page(result(count), folder)


def page_of_signals_by_ten(count: int, folder: Path) -> Measured:
    return _page(result(FEW, count // 10), folder)


def page_of_telegrams(count: int, folder: Path) -> Measured:
    return _page(replace(result(FEW), events=_telegrams(count)), folder)


def _chain(count: int) -> Scenario:
    """Odometers, each of which measures what the one before has read, one step long."""
    chained = Scenario(stop=0.01, step=0.01)
    for number in range(count):
        chained.add(f"o{number}", model="odometer", parameters={} if number else {"wheel_speed": 0.0})
    links = [f"o{number}.reading -> o{number + 1}.wheel_speed" for number in range(count - 1)]
    return chained.connect(*links)


def components_by_hundred_run(count: int, _folder: Path) -> Measured:
    chained = _chain(count // 100)
    return lambda: chained.run(warn=lambda _: None, progress=False)


def components_by_hundred_stated(count: int, _folder: Path) -> Measured:
    return lambda: _chain(count // 100)


def rows_of_mat(count: int, folder: Path) -> Measured:
    file = folder / "long.mat"
    result(count).save(file)
    return lambda: load_result(file)


def baseline_made(count: int, folder: Path) -> Measured:
    one = result(count)
    return lambda: write_baseline(one, folder / "kept.json")


def baseline_checked(count: int, folder: Path) -> Measured:
    one = result(count)
    write_baseline(one, folder / "kept.json")
    return lambda: check(one, read_baseline(folder / "kept.json"))


def baseline_signals(count: int, folder: Path) -> Measured:
    one = result(FEW, count // 10)
    write_baseline(one, folder / "kept.json")
    return lambda: check(one, read_baseline(folder / "kept.json"))


def journal(count: int, folder: Path) -> Measured:
    for i in range(count):
        write_line(folder / "runs.jsonl", {"key": str(i), "row": {"rms": float(i)}})
    return lambda: read_lines(folder / "runs.jsonl")


def _table(count: int) -> Table:
    rows = [(f"n{i}", f"what became of run {i}", float(i)) for i in range(count)]
    return Table("runs", [name_column("name"), text_column("text"), text_column("value")], rows)


def table_as_text(count: int, _folder: Path) -> Measured:
    table = _table(count)
    return lambda: table.text(100)


def table_as_page(count: int, _folder: Path) -> Measured:
    return _table(count)._repr_html_


def telegram_rows(count: int, folder: Path) -> Measured:
    file = folder / "events.csv"
    TELEGRAM_ROWS.write(file, _telegrams(count))
    return lambda: TELEGRAM_ROWS.read(file)


def packet_rows(count: int, folder: Path) -> Measured:
    file = folder / "packets.csv"
    PACKET_ROWS.write(file, _packets(count))
    return lambda: PACKET_ROWS.read(file)


CASES = (
    (compare_rows, compare_held_rows, compare_signals, compare_telegrams, compare_telegrams_of_few_balises),
    (compare_packets, layout, layout_with_one_twice, mailbox, telegram_rows, packet_rows, write_folder, read_folder),
    (signals_of_csv, signals_of_mat, signals_of_npy, rows_of_mat, baseline_made, baseline_checked, baseline_signals),
    (journal, table_as_text, table_as_page, signals_of_hdf5, signals_of_parquet, rows_of_hdf5, rows_of_parquet),
    (page_of_rows, page_of_signals_by_ten, page_of_telegrams, components_by_hundred_stated, components_by_hundred_run),
)


def main(part: str = "") -> None:
    """The table of those whose name holds `part`."""
    print(f"{'CPU seconds at':<36}" + "".join(f"{size:>10,}" for size in SIZES) + "    growth")
    for case in chain.from_iterable(CASES):
        if part not in case.__name__:
            continue
        spent: list[float] = []
        for size in SIZES:
            if spent and spent[-1] > 0.1 * ENOUGH:
                break
            with tempfile.TemporaryDirectory(prefix="exponents-") as folder:
                measured = case(size, Path(folder))
                spent.append(seconds(measured))
        growth = log10(max(spent[-1], 1e-9) / max(spent[-2], 1e-9))
        cells = [*(f"{value:10.3f}" for value in spent), *(f"{'-':>10}" for _ in SIZES[len(spent) :])]
        print(f"{case.__name__.replace('_', ' '):<36}{''.join(cells)}{growth:10.2f}", flush=True)


if __name__ == "__main__":
    main(*sys.argv[1:2])
