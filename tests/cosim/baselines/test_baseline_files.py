"""Baselines on disk: they survive what happens to files and machines, and say what is wrong with the others."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from small_scenarios import small

from cosim.baselines import check, read_baseline, write_baseline
from cosim.baselines.baseline_files import parts
from cosim.comparison.tolerance import Tolerance, Tolerances
from cosim.errors import BaselineError, ComparisonError, OutputError
from cosim.results.result import Result, SignalInfo
from cosim.results.table_layout import table_dtype


def quiet(_: str) -> None: ...


@pytest.fixture(scope="module")
def run() -> Result:
    return small().run(warn=quiet).result


def hand_made(rows: int = 11, unit: str = "m/s", **summary: Any) -> Result:
    table = np.zeros(rows, table_dtype(["time", "train.speed", "train.brake"]))
    table["time"] = 0.1 * np.arange(rows)
    table["train.speed"] = np.sin(table["time"])
    table["train.brake"] = table["time"] > 0.55
    signals = [
        SignalInfo("train.speed", unit, "km/h", description="Geschwindigkeit, µ"),
        SignalInfo("train.brake", variability="discrete"),
    ]
    return Result(table, signals, summary=summary)


def component(**changes: str) -> dict[str, str]:
    return {
        "name": "train",
        "kind": "FMU",
        "model": "Locomotive",
        "guid": "{1}",
        "fmi_version": "2.0",
        "source": "x.fmu",
    } | changes


def test_a_run_passes_against_its_own_baseline_from_disk(run: Result, tmp_path: Path) -> None:
    assert write_baseline(run, tmp_path / "run.json") == "new"
    baseline = read_baseline(tmp_path / "run.json")
    comparison = check(run, baseline)
    assert comparison.equal
    assert (comparison.events.matched, comparison.events.compared, list(comparison.notes)) == (3, True, [])
    assert {signal.name for signal in comparison.signals} == {info.name for info in run.signals}
    assert list(baseline.result.signals) == sorted(run.signals, key=lambda info: info.name)
    # the tolerance as H: absolute plus share of the range, of which rounding takes a thousandth
    for info in run.signals:
        values = run[info.name]
        scale = float(np.ptp(values)) or float(np.abs(values).max())
        assert np.abs(baseline.result[info.name] - values).max() <= 1e-3 * (1e-9 + 1e-4 * scale)


def test_tolerance_of_zero_keeps_every_bit(run: Result, tmp_path: Path) -> None:
    exact = Tolerances(Tolerance(absolute=0.0, relative=0.0, time=0.0))
    write_baseline(run, tmp_path / "run.json", tolerances=exact)
    baseline = read_baseline(tmp_path / "run.json")
    assert all(np.array_equal(baseline.result[name], run[name]) for name in run.table.dtype.names or ())
    assert [(e.stamp, e.position) for e in baseline.result.events] == [(e.stamp, e.position) for e in run.events]
    assert {signal.status for signal in check(run, baseline).signals} == {"equal"}
    off = replace(run, table=run.table.copy())
    off.table["locomotive.speed"][7] = np.nextafter(off.table["locomotive.speed"][7], np.inf)
    assert [signal.name for signal in check(off, baseline).failed] == ["locomotive.speed"]


@pytest.mark.parametrize("tight", [Tolerance(time=0.0), Tolerance(absolute=0.0, relative=1e-14)], ids=["time", "value"])
def test_telegrams_pass_against_their_own_baseline_under_tight_tolerances(
    tight: Tolerance, run: Result, tmp_path: Path
) -> None:
    """Twelve digits of a stamp, or of an odometer reading, are then not enough."""
    events = [replace(e, odometer_reading=e.odometer_reading + np.pi * 1e-13 * k) for k, e in enumerate(run.events)]
    result = replace(run, events=events)
    write_baseline(result, tmp_path / "run.json", tolerances=Tolerances(tight))
    assert check(result, read_baseline(tmp_path / "run.json")).equal
    late = replace(
        result, events=[replace(e, stamp=e.stamp + 1e-5, delivered_at=e.delivered_at + 1e-5) for e in events]
    )
    assert not check(late, read_baseline(tmp_path / "run.json")).equal


def test_files_are_made_for_version_control(run: Result, tmp_path: Path) -> None:
    write_baseline(run, tmp_path / "run.json")
    files = parts(tmp_path / "run.json")
    texts = {kind: file.read_bytes() for kind, file in files.items()}
    assert not any(b"\r" in text or str(tmp_path).encode() in text for text in texts.values())
    assert not re.search(rb"\d{4}-\d\d-\d\d|\d\d:\d\d:\d\d|created|seconds", texts["header"])
    names = texts["table"].splitlines()[0].decode().split(",")
    assert names == ["time", *sorted(names[1:])]
    assert len(texts["table"].splitlines()) == 1 + len(run.table)
    before = {file: file.stat().st_mtime_ns for file in files.values()}
    assert write_baseline(run, tmp_path / "run.json") == "unchanged"
    assert {file: file.stat().st_mtime_ns for file in files.values()} == before


def test_survives_another_order_of_components(run: Result, tmp_path: Path) -> None:
    write_baseline(run, tmp_path / "run.json")
    names = list(run.table.dtype.names or ())
    turned = np.empty(len(run.table), table_dtype(["time", *names[:0:-1]]))
    for name in names:
        turned[name] = run.table[name]
    summary = {**run.summary, "components": run.summary["components"][::-1], "order": run.summary["order"][::-1]}
    other = Result(turned, list(run.signals)[::-1], run.events, summary)
    comparison = check(other, read_baseline(tmp_path / "run.json"))
    assert comparison.equal
    assert not comparison.notes
    assert write_baseline(other, tmp_path / "run.json") == "unchanged"


def test_survives_other_line_endings_and_a_byte_order_mark(run: Result, tmp_path: Path) -> None:
    write_baseline(run, tmp_path / "run.json")
    for file in parts(tmp_path / "run.json").values():
        file.write_bytes(b"\xef\xbb\xbf" + file.read_bytes().replace(b"\n", b"\r\n"))
    baseline = read_baseline(tmp_path / "run.json")
    assert not baseline.notes
    assert check(run, baseline).equal


def test_survives_newer_versions_and_says_so(run: Result, tmp_path: Path) -> None:
    write_baseline(run, tmp_path / "run.json")
    data = json.loads((tmp_path / "run.json").read_text(encoding="utf-8"))
    data["versions"] |= {"fmu-observer": "0.0.1", "platform": "win32 AMD64"}
    data |= {"version": "1.7", "added later": {"by": "a newer version"}}
    data["signals"][0]["added later"] = True
    (tmp_path / "run.json").write_text(json.dumps(data), encoding="utf-8")
    comparison = check(run, read_baseline(tmp_path / "run.json"))
    assert comparison.equal
    reported = " ".join(comparison.notes)
    assert "newer version" in reported
    assert "fmu-observer" in reported
    assert "win32" in reported


LOCALE = """
import locale, sys
from contextlib import suppress
from pathlib import Path
with suppress(locale.Error):
    locale.setlocale(locale.LC_ALL, "")
from test_baseline_files import hand_made
from cosim.baselines import check, read_baseline, write_baseline
there, here = map(Path, sys.argv[1:])
print(check(hand_made(), read_baseline(there)).equal, write_baseline(hand_made(), here))
"""


def test_survives_another_locale(tmp_path: Path) -> None:
    write_baseline(hand_made(), tmp_path / "here.json")
    made = subprocess.run(  # a locale with a decimal comma, where the system has what it takes
        ["localedef", "-i", "de_DE", "-f", "ISO-8859-1", str(tmp_path / "comma")], capture_output=True, check=False
    )
    name = "comma" if made.returncode == 0 else "C"
    environment = os.environ | {"LOCPATH": str(tmp_path), "LC_ALL": name, "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}
    environment["PYTHONPATH"] = os.pathsep.join([str(Path(__file__).parent), *sys.path])
    command = [sys.executable, "-c", LOCALE, str(tmp_path / "here.json"), str(tmp_path / "there.json")]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert done.stdout.split() == ["True", "new"], done.stderr
    assert (tmp_path / "there.csv").read_bytes() == (tmp_path / "here.csv").read_bytes()
    assert (tmp_path / "there.json").read_bytes() == (tmp_path / "here.json").read_bytes()


def test_editing_by_hand_is_noticed_and_goes_on(tmp_path: Path) -> None:
    write_baseline(hand_made(), tmp_path / "run.json")
    table = tmp_path / "run.csv"
    table.write_text(table.read_text(encoding="utf-8").replace("0.1,0,0.0998334", "0.1,0,0.0998333"), encoding="utf-8")
    comparison = check(hand_made(), read_baseline(tmp_path / "run.json"))
    assert comparison.equal
    assert any("edited by hand" in note for note in comparison.notes)


def broken(text: str, kind: str) -> str:
    return {
        "cut in a row": text[: len(text) * 2 // 3],
        "cut after a row": "".join(text.splitlines(keepends=True)[:-3]),
        "no line feed": text[:-1],
        "merge": text.replace("\n0.3,", "\n<<<<<<< HEAD\n0.3,", 1).replace("\n0.4,", "\n=======\n0.4,", 1),
        "decimal comma": re.sub(r"\n0\.3,0,0\.(\d+)", r'\n0.3,0,"0,\1"', text),
        "renamed": text.replace("train.speed", "train.velocity"),
        "backwards": text.replace("\n0.3,", "\n0.05,"),
        "empty": "",
    }[kind]


@pytest.mark.parametrize(
    ("kind", "says"),
    [
        ("cut in a row", "cut off"),
        ("cut after a row", "cut off or was added to: 8 rows, 11 were written"),
        ("no line feed", "cut off"),
        ("merge", "run.csv, line 5: holds the conflict of a merge"),
        ("decimal comma", "line 5"),
        ("renamed", "no column 'train.speed'"),
        ("backwards", "run.csv, line 5: time runs backwards"),
        ("empty", "empty"),
    ],
)
def test_a_damaged_table_is_refused_in_words(kind: str, says: str, tmp_path: Path) -> None:
    write_baseline(hand_made(), tmp_path / "run.json")
    table = tmp_path / "run.csv"
    table.write_text(broken(table.read_text(encoding="utf-8"), kind), encoding="utf-8")
    with pytest.raises(BaselineError, match=re.escape(says)):
        read_baseline(tmp_path / "run.json")


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (lambda text: "{" + text[1:-20], "not readable as JSON"),
        (lambda text: "<<<<<<< HEAD\n" + text, "line 1: holds the conflict of a merge"),
        (lambda text: text.replace('"version": "1.1"', '"version": "2.0"'), "version 2.0 of the layout"),
        (lambda text: text.replace("fmu-observer baseline", "something"), "not a baseline"),
        (lambda text: text.replace('"signals": [', '"singals": [', 1), "'signals' is missing"),
        (lambda text: text.replace('"kind": "result"', '"kind": "cake"'), "run.kind is 'cake'"),
        (lambda text: text.replace('"relative": 0.0001', '"relative": -1'), "relative"),
    ],
)
def test_a_damaged_header_is_refused_in_words(change: Any, says: str, tmp_path: Path) -> None:
    write_baseline(hand_made(), tmp_path / "run.json")
    header = tmp_path / "run.json"
    header.write_text(change(header.read_text(encoding="utf-8")), encoding="utf-8")
    with pytest.raises(BaselineError, match=re.escape(says)) as caught:
        read_baseline(header)
    assert "run.json" in str(caught.value)


def test_a_folder_is_no_baseline_and_those_in_it_are_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "kept").mkdir()
    (tmp_path / "kept" / "other.json").write_text("{}", encoding="utf-8")
    with pytest.raises(BaselineError, match=r"kept is a folder without a baseline; expected the \.json.*baseline make"):
        read_baseline(tmp_path / "kept")
    for name in "abcdef":
        write_baseline(hand_made(), tmp_path / "kept" / f"{name}.json")
    monkeypatch.chdir(tmp_path / "kept")
    with pytest.raises(
        BaselineError, match=r"^\. is a folder.* It holds a\.json, b\.json, c\.json, d\.json and 2 more\.$"
    ):
        read_baseline(".")
    write_baseline(hand_made(), tmp_path / "kept.json")
    assert read_baseline(tmp_path / "kept").path == tmp_path / "kept.json"  # the file of that name comes first


def test_what_is_missing_is_said_with_what_is_there(tmp_path: Path) -> None:
    write_baseline(hand_made(), tmp_path / "braking.json")
    with pytest.raises(
        BaselineError, match=r"There is no baseline .*braknig\.json.*'braking\.json'.*fmu-baseline=update"
    ):
        read_baseline(tmp_path / "braknig.json")
    (tmp_path / "braking.csv").unlink()
    with pytest.raises(BaselineError, match=r"braking\.csv is missing"):
        read_baseline(tmp_path / "braking.json")


def test_missing_telegrams_are_noticed(run: Result, tmp_path: Path) -> None:
    write_baseline(run, tmp_path / "run.json")
    events = parts(tmp_path / "run.json")["events"]
    events.write_text("".join(events.read_text(encoding="utf-8").splitlines(keepends=True)[:-1]), encoding="utf-8")
    with pytest.raises(BaselineError, match="2 telegrams, 3 were written"):
        read_baseline(tmp_path / "run.json")


def test_another_model_is_refused_and_another_delivery_is_not(tmp_path: Path) -> None:
    write_baseline(hand_made(components=[component()]), tmp_path / "run.json")
    baseline = read_baseline(tmp_path / "run.json")
    with pytest.raises(BaselineError, match=r"'Locomotive' \(GUID \{1\}\).*'Wagon' \(GUID \{2\}\)"):
        check(hand_made(components=[component(model="Wagon", guid="{2}")]), baseline)
    comparison = check(hand_made(components=[component(guid="{2}")]), baseline)
    assert comparison.equal
    assert any("a new delivery of the model 'Locomotive'" in note for note in comparison.notes)
    assert any("{2}" in note for note in comparison.notes)


def test_a_renamed_signal_is_missing_and_the_nearest_is_named(tmp_path: Path) -> None:
    write_baseline(hand_made(), tmp_path / "run.json")
    reported = hand_made()
    renamed = np.array(reported.table).view(table_dtype(["time", "train.speeed", "train.brake"]))
    result = Result(renamed, [replace(reported.signals[0], name="train.speeed"), reported.signals[1]])
    comparison = check(result, read_baseline(tmp_path / "run.json"))
    assert [(s.name, s.status, s.nearest[0]) for s in comparison.failed] == [("train.speed", "missing", "train.speeed")]


def test_an_empty_or_failed_run_is_no_baseline_and_cannot_be_checked(tmp_path: Path) -> None:
    write_baseline(hand_made(), tmp_path / "run.json")
    with pytest.raises(ComparisonError, match="empty"):
        check(hand_made(0), read_baseline(tmp_path / "run.json"))
    with pytest.raises(BaselineError, match="empty run"):
        write_baseline(hand_made(0), tmp_path / "empty.json")
    with pytest.raises(BaselineError, match="failed: it broke"):
        write_baseline(replace(hand_made(), failure="it broke"), tmp_path / "failed.json")
    assert {file.name for file in tmp_path.iterdir()} == {"run.json", "run.csv"}


def test_a_table_that_is_somebody_elses_is_not_overwritten(tmp_path: Path) -> None:
    (tmp_path / "run.csv").write_text("time,effort\n0,1\n", encoding="utf-8")
    with pytest.raises(OutputError, match=r"run\.csv exists and belongs to no baseline"):
        write_baseline(hand_made(), tmp_path / "run.json")
    assert [file.name for file in tmp_path.iterdir()] == ["run.csv"]
    assert (tmp_path / "run.csv").read_text(encoding="utf-8") == "time,effort\n0,1\n"


def test_chosen_signals_only(tmp_path: Path) -> None:
    write_baseline(hand_made(), tmp_path / "run.json", signals=["speed"])  # one component: its name may be left out
    baseline = read_baseline(tmp_path / "run.json")
    assert [info.name for info in baseline.result.signals] == ["train.speed"]
    assert [signal.name for signal in check(hand_made(), baseline).signals] == ["train.speed"]
    with pytest.raises(BaselineError, match=r"No signal fits 'train\.sped'; did you mean 'train\.speed'"):
        write_baseline(hand_made(), tmp_path / "run.json", signals=["train.sped"])


def test_long_runs_are_thinned_but_for_events_and_changes(tmp_path: Path) -> None:
    long = hand_made(10_001)
    table = np.insert(long.table, 5000, long.table[5000])  # an event: two rows with the same time
    table["train.speed"][5001:] += 1.0
    table["train.brake"][:] = np.arange(len(table)) >= 7773
    write_baseline(replace(long, table=table), tmp_path / "run.json")
    baseline = read_baseline(tmp_path / "run.json")
    kept = baseline.result.time
    assert 1500 <= len(kept) <= 2010
    assert kept[0] == 0.0
    assert kept[-1] == 1000.0
    assert np.sum(kept == 500.0) == 2
    change = table["time"][7773]
    assert np.isclose(kept, change - 0.1).any()
    assert np.isclose(kept, change).any()
    assert check(replace(long, table=table), baseline).equal
    write_baseline(replace(long, table=table), tmp_path / "coarse.json", every=10.0)
    assert np.median(np.diff(read_baseline(tmp_path / "coarse.json").result.time)) == pytest.approx(10.0)
    with pytest.raises(BaselineError, match="spacing"):
        write_baseline(long, tmp_path / "coarse.json", every=-1.0)
