"""``--figures``: one option of all commands that make a page; no figure without it, and none of an earlier call."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from xml.etree import ElementTree

import pytest
from small_scenarios import small

from cosim import Scenario
from cosim.cli import main


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A scenario, two runs of it, a baseline of the first, and a scenario that is tuned."""
    folder = tmp_path_factory.mktemp("figures")
    small().save(folder / "small.toml")
    for name, mass in (("one", 80e3), ("two", 90e3)):
        small().set("locomotive.mass", mass).run().write(folder / name, report=False)
    fast = Scenario(stop=0.1, step=0.01)
    fast.add("train", model="locomotive", **{"as": "block3"}, parameters={"train_speed": 10.0, "effort": 5e4})
    fast.expect("signal", name="fast", signal="train.speed", start=0.05, min=10.1)
    fast.save(folder / "fast.toml")
    assert main(["baseline", "make", str(folder / "one"), str(folder / "one.json"), *ONE]) == 0
    return folder


TUNE = ("--parameters", "train.mass=60e3:120e3", "--cost=-expectation:fast", "--method", "hand", "--iterations", "2")
ONE = ("--signals", "locomotive.speed")
COMMANDS = {
    "run": ("run", "{0}/small.toml", "--out", "{1}"),
    "report": ("report", "{0}/one", "--out", "{1}/page.html"),
    "several": ("report", "{0}/one", "{0}/two", "--out", "{1}/page.html"),
    "compare": ("compare", "{0}/one", "{0}/two", "--html", "{1}/page.html", *ONE),
    "plots": ("compare", "{0}/one", "{0}/two", "--plots", "{1}", *ONE),
    "sweep": ("sweep", "{0}/small.toml", "--vary", "locomotive.mass=80e3,90e3", "--table-only", "--out", "{1}"),
    "tune": ("tune", "{0}/fast.toml", *TUNE, "--out", "{1}"),
    "choose": ("choose", "{0}/small.toml", "--seeds", "1", "--observers", "observer", "--out", "{1}"),
    "baseline": ("baseline", "check", "{0}/one.json", "--against", "{0}/two", "--plots", "{1}"),
}
DRAWN_IN_ANY_CASE = ("plots", "baseline")
"""Commands whose ``--plots`` asks for pictures."""


def drawn(command: Sequence[str], folder: Path, out: Path) -> list[Path]:
    """Pictures in a folder after a command."""
    assert main([word.format(folder, out) for word in command]) in (0, 1)
    return sorted(path for path in out.rglob("*") if path.suffix in (".png", ".svg"))


@pytest.mark.parametrize("name", COMMANDS)
def test_figures_are_of_the_kind_that_is_asked_for(
    name: str, folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    command = COMMANDS[name]
    pictures = drawn(command, folder, tmp_path / "none")
    assert bool(pictures) == (name in DRAWN_IN_ANY_CASE)
    pictures = drawn([*command, "--figures", "svg"], folder, tmp_path / "out")
    assert pictures
    assert {path.suffix for path in pictures} == {".svg"}
    assert {ElementTree.parse(path).getroot().tag for path in pictures} == {"{http://www.w3.org/2000/svg}svg"}
    names = {path.stem for path in pictures}
    first = {path.name: path.read_bytes() for path in pictures}
    if name not in ("run", "tune", "choose", "sweep"):  # which take some time: elapsed, or to search
        again = drawn([*command, "--figures", "svg"], folder, tmp_path / "out")
        assert {path.name: path.read_bytes() for path in again} == first
        pictures = drawn([*command, "--figures"], folder, tmp_path / "out")
        assert {path.suffix for path in pictures} == {".png"}  # the others went
        assert {path.stem for path in pictures} == names
    capsys.readouterr()


def test_what_is_no_kind_is_said(folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["run", "--figures", str(folder / "small.toml"), "--out", str(tmp_path)])
    assert "expected png or svg (got" in capsys.readouterr().err
    assert main(["choose", str(folder / "small.toml"), "--figures"]) == 2
    assert "--figures draws beside the page: say with --out DIR" in capsys.readouterr().err
