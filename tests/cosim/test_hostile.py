"""FMUs that harm their process: nothing ends green, what was computed is kept, and who did it is told."""

from __future__ import annotations

import ctypes
import errno
import locale
import math
import mmap
import os
import signal
import subprocess
import sys
import time
import zipfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from test_fmus.events import DEEDS, hostile_fmu

from cosim import CosimError, Scenario, load_result
from cosim.cli import main
from cosim.compiled.library import _stepper_library
from cosim.components.loading import FMI2Component
from cosim.errors import OutputError
from cosim.process import exit_guard, watch
from cosim.process.interruption import STOPPING, ends_like_ctrl_c
from cosim.process.last_call import LAST_CALL, PAGE, TEXTS, USED, LastCall, make_page
from cosim.results import row_file
from cosim.results.salvage import rescue
from cosim.results.unfinished import only_run
from cosim.runs.run import Run
from cosim.runs.workers import Team
from fmus import cache
from fmus.fmi import surroundings
from fmus.toolchain.compile import find_compiler
from plant_models import PLANTS
from plant_models.disk_cache.files import seal

pytestmark = [pytest.mark.compiler, pytest.mark.skipif(not hasattr(os, "fork"), reason="watching needs fork")]


@pytest.fixture(scope="module")
def fmu(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return hostile_fmu(tmp_path_factory.mktemp("hostile"))


@pytest.fixture(autouse=True)
def ordinary_signals() -> Iterator[None]:
    """As at a prompt, also where the tests run in the background or under nohup, with some of the signals ignored."""
    before = {number: signal.getsignal(number) for number in STOPPING}
    for number in STOPPING:
        signal.signal(number, signal.default_int_handler if number == signal.SIGINT else signal.SIG_DFL)
    yield
    for number, handler in before.items():
        signal.signal(number, handler)


def hostile(fmu: Path, deed: str, **master: Any) -> Scenario:
    parameters = {"deed": float(DEEDS.index(deed))}
    master = {"isolate": "no"} | master  # whatever it did before
    return Scenario(stop=0.5, step=0.01, master=master).add("bad", fmu=str(fmu), log="all", parameters=parameters)


def saved(fmu: Path, folder: Path, deed: str, **master: Any) -> str:
    path = folder / "scenario.toml"
    hostile(fmu, deed, **master).save(path)
    return str(path)


def start(fmu: Path, folder: Path, deed: str, *options: str, **master: Any) -> subprocess.Popen[str]:
    what = saved(fmu, folder, deed, **master)
    command = [sys.executable, "-m", "cosim.cli", "run", what, "--out", "out", "--no-report", "--quiet", *options]
    streams: Any = {"stderr": subprocess.PIPE, "stdout": subprocess.DEVNULL, "text": True}
    return subprocess.Popen(command, cwd=folder, start_new_session=True, **streams)


def reported(process: subprocess.Popen[str]) -> str:
    """What a command that is to end with 2 wrote to its error stream."""
    try:
        _, error = process.communicate(timeout=60)
    except subprocess.TimeoutExpired:  # what hangs is not left behind
        os.killpg(process.pid, signal.SIGKILL)
        raise
    assert process.returncode == 2, error
    assert "Traceback" not in error
    return error


DEATHS = [
    ("exits", "python", "in doStep at t = 0.24 s ended the program with exit code 0"),
    ("exits-at-once", "compiled", "in doStep at t = 0.24 s ended the program with exit code 0"),
    ("crashes", "compiled", "in doStep at t = 0.24 s ended with SIGSEGV"),
]


@pytest.mark.parametrize(("deed", "stepper", "words"), DEATHS)
def test_a_death_is_reported_and_every_row_is_kept(
    fmu: Path, tmp_path: Path, deed: str, stepper: str, words: str
) -> None:
    error = reported(start(fmu, tmp_path, deed, stepper=stepper))
    assert f"component 'bad' {words}" in error
    result = load_result(tmp_path / "out")
    assert result.time[-1] == pytest.approx(0.24)
    assert len(result.table) == 25
    assert words in str(result.failure)
    assert (tmp_path / "out" / "table.csv").exists()
    assert not (tmp_path / "out" / ".unfinished").exists()


@pytest.mark.parametrize("deed", ["closes-opened", "closes-all"])
@pytest.mark.parametrize("options", [(), ("--stream",)])
def test_who_closes_the_files_of_the_program_is_told_and_loses_no_row(
    deed: str, options: tuple[str, ...], fmu: Path, tmp_path: Path
) -> None:
    """Rows are in a map of memory, which no descriptor is needed for."""
    said = reported(start(fmu, tmp_path, deed, *options))
    assert "the FMU of component 'bad' closed files that this program had open" in said
    result = load_result(tmp_path / "out")
    assert (result.failure or "").startswith("the run did not end")
    assert result.time[-1] >= 0.24  # where it closed them


def test_what_was_streamed_is_whole(fmu: Path, tmp_path: Path) -> None:
    reported(start(fmu, tmp_path, "crashes", "--stream", stepper="python"))
    result = load_result(tmp_path / "out")
    assert len(result.table) == 25
    assert "SIGSEGV" in str(result.failure)
    assert sorted(p.name for p in (tmp_path / "out").iterdir()) == [
        "events.csv",
        "made_from",
        "messages.csv",
        "summary.json",
        "table.npy",
    ]


def test_results_are_written_before_anything_is_closed(fmu: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """In this process, where nobody dies; the next test is the whole of it."""
    order: list[str] = []
    for closing in ("terminate", "free"):
        monkeypatch.setattr(FMI2Component, closing, lambda _self, what=closing: order.append(what))
    hostile(fmu, "nothing").run(finished=lambda _outcome: order.append("written"))
    assert order[0] == "written"
    assert {"terminate", "free"} <= set(order)


@pytest.mark.parametrize("deed", ["crashes-when-freed", "crashes-when-terminated"])
def test_a_crash_at_the_end_loses_nothing(fmu: Path, tmp_path: Path, deed: str) -> None:
    error = reported(start(fmu, tmp_path, deed))
    assert f"The results were written before: {tmp_path / 'out'}" in error  # absolute, though it was not given so
    result = load_result(tmp_path / "out")
    assert (len(result.table), result.failure) == (51, None)
    assert not (tmp_path / "out" / ".unfinished").exists()


def test_a_call_past_its_limit_ends_the_run_in_words(fmu: Path, tmp_path: Path) -> None:
    error = reported(start(fmu, tmp_path, "hangs", call_timeout=0.5))
    assert "component 'bad' in doStep at t = 0.24 s has not returned for 0.5 s" in error
    assert len(load_result(tmp_path / "out").table) == 25


def test_a_call_that_has_no_time_yet_is_limited_too(fmu: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("HOSTILE_HANGS_WHERE_IT_IS_LOADED", "1")
    error = reported(start(fmu, tmp_path, "nothing", call_timeout=0.5))
    assert "component 'bad' in loading its library has not returned for 0.5 s" in error
    assert "Nothing had been computed yet." in error


@pytest.mark.parametrize(("deed", "where"), [("terminated", "terminate"), ("freed", "freeInstance")])
def test_an_end_that_never_comes_is_limited_and_loses_nothing(fmu: Path, tmp_path: Path, deed: str, where: str) -> None:
    error = reported(start(fmu, tmp_path, f"hangs-when-{deed}", call_timeout=0.5))
    assert f"component 'bad' in {where} at t = 0.5 s has not returned for 0.5 s" in error
    assert f"The results were written before: {tmp_path / 'out'}" in error
    assert len(load_result(tmp_path / "out").table) == 51


def test_where_no_limit_is_asked_for_a_call_has_ten_minutes_and_an_end_half_a_one(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    page = LastCall(mmap.mmap(-1, PAGE))
    monkeypatch.setattr(exit_guard, "LAST_CALL", page)
    seen: list[float] = []
    for page.timed in (True, False):
        with exit_guard.limited_calls(None, ends=True):
            with exit_guard.limited_calls(None):
                seen.append(page.seconds_at_most)
            seen.append(page.seconds_at_most)
    assert seen == [600.0, 30.0, 600.0, 30.0]
    assert page.seconds_at_most == 0.0


def test_an_end_that_never_comes_ends_a_script_in_words_and_keeps_what_was_streamed(fmu: Path, tmp_path: Path) -> None:
    script = (
        "from cosim import Scenario; from cosim.process import exit_guard; exit_guard._ENDING = 0.3; "
        f"Scenario.load({saved(fmu, tmp_path, 'hangs-when-freed')!r}).run(stream='out')"
    )
    command = [sys.executable, "-c", script]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=60.0, check=False)
    assert done.returncode == 2
    assert "component 'bad' in freeInstance at t = 0.5 s has not returned for 0.3 s" in done.stderr
    assert len(load_result(tmp_path / "out").table) == 51


def test_an_error_of_terminate_is_a_warning_of_the_run(fmu: Path) -> None:
    warnings: list[str] = []
    outcome = hostile(fmu, "fails-when-terminated").run(warn=warnings.append)
    assert warnings[-1] == outcome.warnings[-1]
    assert warnings[-1].startswith("bad could not be put away after the run, which is complete: ")
    assert "terminate failed: fmi2Terminate failed with status 3 (error)" in warnings[-1]


@pytest.mark.parametrize("stays", [0.2, math.nan, math.inf, -0.0])
def test_a_limit_is_for_one_call_and_not_for_many(monkeypatch: pytest.MonkeyPatch, stays: float) -> None:
    """As the watch looks: the same call three times 0.2 s, then others, then one that stays, at whatever time."""
    page = LastCall(mmap.mmap(-1, PAGE))
    monkeypatch.setattr(watch, "LAST_CALL", page)
    page.limit(0.5)
    ended: list[str] = []
    looking = watch._Watch(0)
    monkeypatch.setattr(looking, "_end", ended.append)
    for now in [(1, 0.0)] * 3 + [(2, 0.0), (2, 0.1), (2, 0.2)] + [(0, 0.2)] * 4:
        page.call[0], page.time[0] = now
        looking._check_duration(0.2)
    assert ended == []
    page.call[0], page.time[0] = 1, stays
    for _ in range(4):
        looking._check_duration(0.2)
    assert ended == ["has not returned for 0.5 s, the limit of a call, which call_timeout sets"]


def test_a_limit_holds_in_a_script_that_nobody_watches(monkeypatch: pytest.MonkeyPatch) -> None:
    ended: list[str] = []
    monkeypatch.setattr(exit_guard, "_give_up", ended.append)
    with exit_guard.limited_calls(0.1):
        for number in range(1, 6):
            LAST_CALL.call[0] = number
            time.sleep(0.05)
        assert ended == []
        time.sleep(0.3)
    LAST_CALL.call[0] = 0
    assert ended[0] == "has not returned for 0.1 s, the limit of a call, which call_timeout sets"


@pytest.mark.parametrize("number", STOPPING[1:], ids=lambda n: n.name)
def test_other_signals_do_what_ctrl_c_does_unless_they_are_ignored(number: signal.Signals) -> None:
    before = signal.getsignal(number)
    with pytest.raises(KeyboardInterrupt), ends_like_ctrl_c():
        signal.raise_signal(number)
    assert signal.getsignal(number) == before
    signal.signal(number, signal.SIG_IGN)  # under nohup
    try:
        with ends_like_ctrl_c():
            signal.raise_signal(number)
    finally:
        signal.signal(number, before)


@pytest.mark.parametrize("number", STOPPING[1:], ids=lambda n: n.name)
def test_ctrl_c_works_while_an_fmu_hangs(fmu: Path, tmp_path: Path, number: signal.Signals) -> None:
    process = start(fmu, tmp_path, "hangs", stepper="python")
    block = tmp_path / "out" / ".unfinished" / "table.npy"
    while not block.exists() and process.poll() is None:
        time.sleep(0.05)
    time.sleep(0.5)
    process.send_signal(number)
    assert "component 'bad' in doStep at t = 0.24 s does not return; the run was interrupted" in reported(process)
    assert len(load_result(tmp_path / "out").table) == 25


@pytest.mark.parametrize("end", [lambda process: os.killpg(process.pid, signal.SIGKILL), subprocess.Popen.kill])
def test_rows_of_a_run_that_is_killed_with_who_watches_it_are_read_and_kept(
    fmu: Path, tmp_path: Path, end: Callable[[subprocess.Popen[str]], None]
) -> None:
    """Killed as a group, or the watch alone, which takes the process along in which the FMU hangs."""
    process, out = start(fmu, tmp_path, "hangs", stepper="python"), tmp_path / "out"
    while not (out / ".unfinished" / "table.npy").exists() and process.poll() is None:
        time.sleep(0.05)
    time.sleep(0.5)
    with pytest.raises(OutputError, match=r"Another run is writing to .*: wait for its end"), only_run(out):
        pass
    end(process)
    process.communicate(timeout=60)
    time.sleep(0.2)
    with only_run(out):
        assert len(load_result(out).table) == 25
        assert rescue(out).endswith(f"was ended from outside: its 25 rows are kept in {out}-unfinished-1.")
        assert rescue(out) == ""
    kept = load_result(f"{out}-unfinished-1")
    assert len(kept.table) == 25
    assert "its program was ended from outside" in str(kept.failure)


def test_former_results_are_not_taken_for_those_of_a_run_that_did_not_end(
    fmu: Path, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    hostile(fmu, "nothing").run().write(tmp_path, report=False)
    hostile(fmu, "nothing").run(stream=tmp_path / ".unfinished")
    assert len(load_result(tmp_path).table) == 51
    assert "these are former results; a later run that has not ended is in" in caplog.text


def test_a_disk_without_room_for_the_spare_rows_costs_their_safety_and_not_the_run(
    fmu: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_: Any) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(row_file, "allocate", full)
    warnings: list[str] = []
    outcome = hostile(fmu, "nothing").run(fallback=tmp_path / ".unfinished", warn=warnings.append)
    assert len(outcome.result.table) == 51
    assert any("in memory alone" in text and "No space left on device" in text for text in warnings)
    with pytest.raises(OutputError, match="No row was recorded"):
        hostile(fmu, "nothing").run(stream=tmp_path / "asked")
    assert len(load_result(tmp_path / "asked").table) == 0


@pytest.mark.parametrize("stepper", ["python", "compiled"])
def test_ctrl_c_within_a_step_loses_no_row(fmu: Path, stepper: str) -> None:
    """The signal comes in the middle of a chunk of the compiled stepper, or in a call of the Python one."""
    outcome = hostile(fmu, "interrupts", stepper=stepper).run()
    assert outcome.failure is not None
    assert "interrupted" in outcome.failure
    assert outcome.result.time[-1] >= 0.25 - 1e-12


def test_streaming_keeps_rows_that_were_recorded_at_once(fmu: Path, tmp_path: Path) -> None:
    """In a script, which nobody watches: the whole run takes a millisecond."""
    script = f"from cosim import Scenario; Scenario.load({saved(fmu, tmp_path, 'crashes')!r}).run(stream='out')"
    done = subprocess.run([sys.executable, "-c", script], cwd=tmp_path, capture_output=True, check=False)
    assert done.returncode == -signal.SIGSEGV
    assert len(load_result(tmp_path / "out").table) == 25


def test_pytest_is_not_green(fmu: Path, tmp_path: Path) -> None:
    (tmp_path / "test_it.py").write_text(
        "from cosim import Scenario\n"
        "def test_bad():\n"
        "    s = Scenario(stop=0.5, step=0.01, master={'isolate': 'no'})\n"
        f"    s.add('bad', fmu={str(fmu)!r}, parameters={{'deed': 1.0}})\n"
        "    s.run()\n"
    )
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "test_it.py"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert "component 'bad' in doStep at t = 0.24 s ended the program by calling exit()" in done.stderr
    assert "test_it.py::test_bad" in done.stderr


@pytest.mark.parametrize(
    ("deed", "words"), [("exits", ": its process ended with exit code 0"), ("hangs", " has not returned for 0.3 s")]
)
def test_a_worker_reports_who_took_it_along(fmu: Path, deed: str, words: str) -> None:
    with Team(1) as team:
        ((_, ended),) = team.each([Run(hostile(fmu, deed, call_timeout=0.3))])
    assert ended.failure is not None
    assert ended.failure.reason.startswith(f"component 'bad' in doStep at t = 0.24 s{words}")
    assert not ended.failure.outside


def test_a_process_that_attaches_a_page_writes_to_that_one(tmp_path: Path) -> None:
    watched, own = make_page(tmp_path / "page"), LastCall(mmap.mmap(-1, PAGE))
    own.attach(tmp_path / "page")
    own.begin("train", "doStep", 3.2)
    assert watched.words() == own.words() == "component 'train' in doStep at t = 3.2 s"
    own.end(0)
    assert watched.exit_code == 0


def test_words_run_out_without_harm(tmp_path: Path) -> None:
    page = make_page(tmp_path / "page")
    for number in range(3000):
        page.call[0] = page.number(f"component{number}", "doStep")
    assert "of which nothing is known" in page.words()
    assert TEXTS + page._cells[USED] <= len(page.memory) // 2
    assert LAST_CALL.words() == ""


# -- what belongs to everybody ----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("deed", "what"),
    [
        ("moves", "the working directory"),
        ("rounds", "the rounding of floating-point numbers"),
        ("closes", "the standard streams"),
        ("deafens", "the response to Ctrl-C"),
        ("localises", "the locale"),
        ("lowers-limits", "the limits RLIMIT_NOFILE"),
        ("masks", "the permissions of new files"),
    ],
)
@pytest.mark.parametrize("stepper", ["python", "compiled"])
def test_what_an_fmu_changes_for_all_is_put_back_and_reported(
    fmu: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, deed: str, what: str, stepper: str
) -> None:
    monkeypatch.chdir(tmp_path)
    before, language = surroundings.Surroundings(), locale.setlocale(locale.LC_ALL)
    assert main(["run", saved(fmu, tmp_path, deed, stepper=stepper), "--out", "out", "--no-report", "--quiet"]) == 0
    assert before.put_back() == []
    assert locale.setlocale(locale.LC_ALL) == language
    assert Path.cwd() == tmp_path
    assert 0.1 + 0.2 == 0.30000000000000004 and -0.1 - 0.2 == -0.30000000000000004  # noqa: PT018 - rounded to nearest
    warnings = load_result(tmp_path / "out").summary["warnings"]
    assert [w for w in warnings if w.startswith(f"bad: its steps change {what}")]


@pytest.mark.parametrize(
    ("deed", "what"),
    [("sets-variable", "the environment variables TEST_FMUS_HOSTILE"), ("handles", "the response to SIGUSR2")],
)
def test_what_it_may_need_itself_is_reported_and_left(fmu: Path, tmp_path: Path, deed: str, what: str) -> None:
    """By the command as a user runs it: what is left would be left in this process."""
    command = [sys.executable, "-m", "cosim.cli", "run", saved(fmu, tmp_path, deed), "--out", "out", "--verbose"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=True)
    words = f"bad: its steps change {what} of the whole program; that was left so"
    assert words in " ".join(done.stderr.split())


@pytest.mark.parametrize("stepper", ["python", "compiled"])
def test_warnings_that_calls_return_are_counted(fmu: Path, tmp_path: Path, stepper: str) -> None:
    """Of the 50 steps of 0.01 s those from 0.25 s on."""
    assert main(["run", saved(fmu, tmp_path, "warns", stepper=stepper), "--out", str(tmp_path / "out"), "--quiet"]) == 0
    warnings = load_result(tmp_path / "out").summary["warnings"]
    expected = "bad returned the status warning, and the run went on: fmi2DoStep 25 times, first at t = 0.25 s."
    assert [w for w in warnings if "status warning" in w] == [expected]
    assert expected in (tmp_path / "out" / "report.html").read_text(encoding="utf-8")


@pytest.mark.skipif(not surroundings._has_mxcsr(), reason="x86-64 with glibc")
def test_flushing_small_numbers_to_zero_is_put_back() -> None:
    """Of the modes of floating-point numbers the one that no function of C tells."""
    before, library = surroundings.Surroundings(), surroundings._library()
    environment = (ctypes.c_uint32 * (surroundings.ENVIRONMENT_BYTES // 4))()
    library.fegetenv(environment)
    environment[surroundings.MXCSR_AT // 4] |= 0x8040
    library.fesetenv(environment)
    assert before.put_back() == [surroundings.FLOATS]
    assert float("2.5e-308") / 4.0 > 0.0


def test_it_is_put_back_while_the_run_goes_on(fmu: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    seen: list[Path] = []
    hostile(fmu, "moves", stepper="python").set("stop", 1.0).run(
        progress=lambda *_: seen.append(Path.cwd()), warn=lambda _: None
    )
    assert seen[-1] == tmp_path  # told before the run is over


def test_escape_sequences_never_reach_the_terminal(
    fmu: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["run", saved(fmu, tmp_path, "paints"), "--out", str(tmp_path / "out"), "--no-report", "--quiet"]) == 0
    shown = "".join(capsys.readouterr())
    result = load_result(tmp_path / "out")
    assert "\x1b" not in shown + (tmp_path / "out" / "messages.csv").read_text() + str(result.summary)
    assert result.messages[0].text == "\\x1b]0;owned\\x07\\x1b[31mred"


# -- the resolution of time -------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "keys",
    [
        {"start": 1e9, "stop": 1e9 + 1e-6, "step": 1e-7},
        {"stop": 1e-7, "step": 1e-10},
        {"start": 9e16, "stop": 9.0000001e16, "step": 100.0},
    ],
)
def test_steps_below_the_resolution_of_time_are_refused(keys: dict[str, float]) -> None:
    with pytest.raises(CosimError, match=r"step .* s is too short: times near .* s are distinct"):
        Scenario(**keys).add("driver", model="driver").table()


def test_parts_of_steps_below_the_resolution_of_time_are_refused() -> None:
    with pytest.raises(CosimError, match=r"one of 10000000 substeps, 1e-09 s is too short"):
        Scenario(stop=1.0, step=0.01).add("driver", model="driver", substeps=10_000_000).table()
    with pytest.raises(CosimError, match=r"master\.smallest_step 1e-30 s is too short"):
        Scenario(stop=1.0, step=0.01, master={"smallest_step": 1e-30}).add("driver", model="driver").table()


# -- damaged files of the cache ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("damage", [b"", b"PK\x03\x04", None])
def test_a_damaged_fmu_in_the_cache_is_built_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture, damage: bytes | None
) -> None:
    monkeypatch.setattr("fmus.build.BuildDraft", FakeDraft)
    monkeypatch.setenv("FMU_OBSERVER_CACHE", str(tmp_path))
    system, first_byte = PLANTS["odometer"](), 30 + len("modelDescription.xml")  # that of the compressed content
    entry = cache.cache_entry(system, 2)
    assert entry.draft is not None
    entry.path.parent.mkdir(parents=True)
    with zipfile.ZipFile(entry.path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("modelDescription.xml", "words " * 100)
    assert cache.cache_entry(system, 2).draft is not None  # an FMU that nobody here has put there
    seal(entry.path)
    assert cache.cache_entry(system, 2).draft is None
    whole = entry.path.read_bytes()
    entry.path.write_bytes(whole[:first_byte] + b"\xff" + whole[first_byte + 1 :] if damage is None else damage)
    assert cache.cache_entry(system, 2).draft is not None
    assert cache.cache_entry(PLANTS["odometer"](), 2).draft is not None
    reported = f"The cached FMU {entry.path} is not the one that was put there; it is built again."
    assert [record.getMessage() for record in caplog.records] == [reported] * 3


class FakeDraft:
    @staticmethod
    def of(*_: Any) -> str:
        return "to be built"


def test_a_damaged_stepper_in_the_cache_is_built_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    built: list[Path] = []

    def compiled(_compiler: Any, folder: Path, _sources: Any, name: str) -> Path:
        built.append(folder)
        (folder / name).write_bytes(b"a library" * 1000)
        return folder / name

    monkeypatch.setattr("fmus.toolchain.cached_library.compile_library", compiled)
    path = _stepper_library(find_compiler(), tmp_path)
    assert _stepper_library(find_compiler(), tmp_path) == path
    assert len(built) == 1
    path.write_bytes(path.read_bytes()[:5000])
    assert len(_stepper_library(find_compiler(), tmp_path).read_bytes()) == 9000
    assert len(built) == 2
