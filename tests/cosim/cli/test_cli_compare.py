"""``cosim compare``: exit codes, tolerances from the command line and from files, what is printed and written, and
mistakes.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from cosim.baselines import write_baseline
from cosim.cli import main
from cosim.comparison.tolerance import Tolerance, Tolerances
from cosim.results.result import BaliseRecord, Result, SignalInfo
from cosim.results.results_folder import write_results

TIME = np.linspace(0.0, 10.0, 101)
TELEGRAM = BaliseRecord(2.5, 2.5, "B1", 2.5, 2.5, outcomes={"observer": "accepted"})


def result(offset: float = 0.0, events: tuple[BaliseRecord, ...] = (TELEGRAM,), **more: np.ndarray) -> Result:
    """A position from 0 to 10 m and a speed that is `offset` too high; more columns by name of the signal of the
    train.
    """
    columns = {"train.position": TIME, "train.speed": 0.5 * TIME + offset, **{f"train.{k}": v for k, v in more.items()}}
    table = np.empty(len(TIME), [("time", "f8"), *((name, "f8") for name in columns)])
    table["time"] = TIME
    for name, values in columns.items():
        table[name] = values
    return Result(table, [SignalInfo(name, "m" if name.endswith("position") else "m/s") for name in columns], events)


@pytest.fixture
def run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> Callable[..., tuple[int, str, str]]:
    """Runs the command among ``a``, the same again ``same``, and ``b`` with a speed 0.1 m/s too high, in a range of 5
    m/s.
    """
    monkeypatch.chdir(tmp_path)
    for name, made in {"a": result(), "same": result(), "b": result(0.1)}.items():
        write_results(made, name, ("csv",))

    def call(*arguments: str) -> tuple[int, str, str]:
        code = main(["compare", *arguments])
        said = capsys.readouterr()
        return code, said.out, said.err

    return call


Call = Callable[..., tuple[int, str, str]]


def test_equal_runs_end_with_0(run: Call) -> None:
    code, out, err = run("a", "same")
    assert (code, err) == (0, "")
    assert "same agrees with a: 2 equal" in out


def test_different_runs_end_with_1_and_say_where(run: Call) -> None:
    code, out, _ = run("a", "b")
    assert code == 1
    assert "b DIFFERS from a: 1 equal, 1 differ" in out
    assert "train.speed" in out
    assert "0.1 m/s too high" in out


def test_quiet_is_one_line_and_verbose_has_all_signals(run: Call) -> None:
    assert len(run("a", "b", "--quiet")[1].splitlines()) == 1
    assert "train.position" not in run("a", "b")[1]
    assert "train.position" in run("a", "b", "--verbose")[1]


TOLERANCES = [
    (["--rtol", "0.021"], 0),
    (["--rtol", "0.019"], 1),
    (["--atol", "0.101"], 0),
    (["--set-tolerance", "train.speed=0.021"], 0),
    (["--set-tolerance", "train.sp*={absolute = 0.101, relative = 0}"], 0),
    (["--set-tolerance", "train.position=0.021"], 1),
    (["--rtol", "0", "--atol", "0.099"], 1),
    (["--ignore", "train.speed"], 0),
    (["--ignore", "*.speed"], 0),
    (["--signals", "train.position"], 0),
    (["--signals", "train.pos*", "--signals", "train.speed"], 1),
]


@pytest.mark.parametrize(("arguments", "code"), TOLERANCES)
def test_tolerances(arguments: list[str], code: int, run: Call) -> None:
    assert run("a", "b", *arguments)[0] == code


def test_time_tolerance(run: Call) -> None:
    late = result(speed=np.where(TIME > 5.0, 2.0, 1.0))
    write_results(result(speed=np.where(TIME > 4.85, 2.0, 1.0)), "early", ("csv",))
    write_results(late, "late", ("csv",))
    assert run("early", "late", "--ttol", "0.25")[0] == 0
    assert run("early", "late", "--ttol", "0.05")[0] == 1


def test_tolerances_from_a_file_and_over_it(run: Call) -> None:
    text = 'ignore = ["train.pos*"]\n[default]\nrelative = 0.5\n[signals."train.*"]\nabsolute = 0.05\nrelative = 0.0\n'
    Path("tolerances.toml").write_text(text)
    stated = ["--tolerances", "tolerances.toml"]
    code, out, _ = run("a", "b", *stated)
    assert code == 1
    assert "1 ignored" in out
    assert run("a", "b", *stated, "--set-tolerance", "train.speed={absolute = 0.11}")[0] == 0


MISTAKES = [
    (["--rtol", "-1"], "zero or positive"),
    (["--set-tolerance", "train.speed"], "expected SIGNAL=VALUE"),
    (["--set-tolerance", "train.speed=much"], "expected SIGNAL=VALUE"),
    (["--set-tolerance", "train.speed={absolut = 1}"], "did you mean 'absolute'"),
    (["--set-tolerance", "train.speed='x'"], "Tolerance of 'train.speed'"),
    (["--signals", "train.sped"], "did you mean 'train.speed'"),
    (["--tolerances", "none.toml"], "none.toml cannot be read"),
    (["--ignore", "*"], "all 2 common signals are ignored"),
]


@pytest.mark.parametrize(("arguments", "text"), MISTAKES)
def test_mistakes_end_with_2_and_say_what_to_do(arguments: list[str], text: str, run: Call) -> None:
    code, _, err = run("a", "b", *arguments)
    assert code == 2
    assert text in err
    assert err.startswith("cosim: ")


@pytest.mark.parametrize(
    ("content", "text"),
    [
        ("x = ", "not readable as TOML"),
        ("defalt = 1", "did you mean 'default'"),
        ("ignore = 1", "a list"),
        ("default = 1", "tables"),
    ],
)
def test_a_tolerance_file_that_is_none(content: str, text: str, run: Call) -> None:
    Path("t.toml").write_text(content)
    code, _, err = run("a", "b", "--tolerances", "t.toml")
    assert code == 2
    assert text in err


def test_what_is_not_there_ends_with_2(run: Call) -> None:
    code, _, err = run("a", "bb")
    assert code == 2
    assert "There is no bb" in err


def test_a_table_may_stand_for_a_folder(run: Call) -> None:
    assert run("a/table.csv", "same")[0] == 0
    assert run("a", "b/table.csv")[0] == 1


def test_telegrams_count_unless_stated_otherwise(run: Call) -> None:
    write_results(result(events=(replace(TELEGRAM, stamp=2.75, delivered_at=2.75),)), "late", ("csv",))
    code, out, _ = run("a", "late")
    assert code == 1
    assert "'B1'" in out
    assert run("a", "late", "--no-telegrams")[0] == 0


def test_extra_signals_fail_where_asked(run: Call) -> None:
    write_results(result(slip=TIME), "more", ("csv",))
    assert run("a", "more")[0] == 0
    assert run("a", "more", "--extra-fails")[0] == 1
    assert run("more", "a")[0] == 1  # and a missing one always


def test_json(run: Call) -> None:
    code, out, _ = run("a", "b", "--json")
    data = json.loads(out)
    assert code == 1
    assert data["equal"] is False
    assert {s["name"]: s["status"] for s in data["signals"]} == {"train.position": "equal", "train.speed": "differs"}
    assert data["signals"][1]["max_error"] == pytest.approx(0.1, rel=1e-3)  # less what the time tolerance explains


def test_page_and_pictures(run: Call) -> None:
    code, out, _ = run("a", "b", "--html", "pages/one.html", "--plots", "plots")
    assert code == 1
    assert "train.speed: error" in Path("pages/one.html").read_text()
    assert [p.name for p in Path("plots").iterdir()] == ["01_train.speed.png"]
    assert "pages/one.html" in out
    assert "01_train.speed.png" in out


def test_what_was_found_is_printed_also_where_the_page_cannot_be_written(run: Call) -> None:
    Path("file").write_text("")
    code, out, err = run("a", "b", "--html", "file/page.html")
    assert code == 2
    assert "b DIFFERS from a" in out
    assert "cannot be written" in err


def test_a_baseline_brings_its_tolerances(run: Call) -> None:
    wide = Tolerances(by_signal={"train.speed": Tolerance(absolute=0.11)})
    write_baseline(result(), "wide.json", tolerances=wide)
    write_baseline(result(), "usual.json")
    assert run("wide.json", "b")[0] == 0
    assert run("usual.json", "b")[0] == 1
    assert run("wide.json", "b", "--atol", "0.05", "--rtol", "0")[0] == 1  # what is given counts more
    assert run("a", "wide.json")[0] == 0
