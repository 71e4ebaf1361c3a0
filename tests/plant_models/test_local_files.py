"""A user's file together with the files beside it that it imports: an edit of any of them is followed."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest

from cosim.errors import ProvenanceError
from cosim.provenance.rerun import rerun
from cosim.simulation.scenario import Scenario
from fmus import cached_fmu
from plant_models.local_files import files_digest, local_files
from plant_models.user_file import Expected, load_class

ANY = Expected("class", lambda found: isinstance(found, type))

PYTHON = """
class Own:
    outputs = ["x"]

    def step(self, t, inputs, dt):
        import {helper}
        return {{"x": {helper}.GAIN}}


import {helper}
"""

SYSTEM = """
from own_constants import CLIMB
from plant_models.exhibits.oscillators import Pendulum


class Own(Pendulum):
    name = "own_pendulum"

    def flow(self, t, x, u, p):
        return {name: CLIMB * rate for name, rate in super().flow(t, x, u, p).items()}
"""


@pytest.fixture(autouse=True)
def _no_neighbours_left() -> Iterator[None]:
    before = set(sys.modules)
    yield
    for name in set(sys.modules) - before:
        if name.startswith("own_"):
            del sys.modules[name]


def test_files_are_found_through_one_another(tmp_path: Path) -> None:
    (tmp_path / "own.py").write_text("import json, own_a.inner\nimport own_missing\n")
    (tmp_path / "own_a").mkdir()
    (tmp_path / "own_a" / "__init__.py").write_text("from own_b import x\nfrom . import inner\n")
    (tmp_path / "own_a" / "inner.py").write_text("def f():\n    import own, own_c\n")
    for name in ("own_b", "own_c", "json", "own_unused"):
        (tmp_path / f"{name}.py").write_text("x = (\n")
    found = local_files(tmp_path / "own.py")
    assert set(found) == {"own_a", "own_a.inner", "own_b", "own_c"}
    assert found["own_a"] == tmp_path / "own_a" / "__init__.py"
    before = files_digest(tmp_path / "own.py")
    (tmp_path / "own_c.py").write_text("x = 1\n")
    assert files_digest(tmp_path / "own.py") != before


def test_a_changed_neighbour_is_read_again_and_kept(tmp_path: Path) -> None:
    (tmp_path / "own.py").write_text(PYTHON.format(helper="own_helper"))
    values = []
    for gain in (1.5, 2.5):
        (tmp_path / "own_helper.py").write_text("from own_gain import GAIN\n")
        (tmp_path / "own_gain.py").write_text(f"GAIN = {gain}\n")
        outcome = Scenario(folder=tmp_path, stop=1.0, step=0.5).add("own", model="own.py").run()
        values.append(outcome["own.x"][-1])
    assert values == [1.5, 2.5]
    outcome.write(tmp_path / "out", report=False)
    (tmp_path / "own_gain.py").unlink()
    again = rerun(tmp_path / "out")
    assert again.verdict == "bit-identical"
    assert [line for line in again.changes if "gain" not in line] == []


def test_two_folders_may_have_neighbours_of_one_name(tmp_path: Path) -> None:
    for folder, gain in (("a", 1.0), ("b", 2.0)):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "own.py").write_text("from own_same import GAIN\nclass Own:\n    gain = GAIN\n")
        (tmp_path / folder / "own_same.py").write_text(f"GAIN = {gain}\n")
    gains = [load_class(f"{folder}/own.py", ANY, tmp_path).gain for folder in "abab"]
    assert gains == [1.0, 2.0, 1.0, 2.0]


@pytest.mark.compiler
def test_the_fmu_and_the_block_follow_an_edit(tmp_path: Path) -> None:
    (tmp_path / "own.py").write_text(SYSTEM)
    fmus: list[Path] = []
    values: dict[str, list[Any]] = {"block3": [], "fmu3": []}
    for climb in (1.0, 0.5):
        (tmp_path / "own_constants.py").write_text(f"CLIMB = {climb}\n")
        fmus.append(cached_fmu(load_class("own.py", ANY, tmp_path)()))
        for backend, found in values.items():
            scenario = Scenario(folder=tmp_path, stop=0.2, step=0.1)
            outcome = scenario.add("own", model="own.py", **{"as": backend}).run()
            found.append(outcome.result.table[-1].tolist())
    assert fmus[0] != fmus[1]
    assert values["block3"] == values["fmu3"]
    assert values["fmu3"][0] != values["fmu3"][1]


def test_a_rerun_says_what_is_kept_of_an_instance(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(tmp_path))
    (tmp_path / "own_gain.py").write_text(
        "class Own:\n    outputs = ['x']\n    def __init__(self, x0=1.0):\n        self.x0 = x0\n        self.x = x0\n"
        "    def step(self, t, inputs, dt):\n        pass\n"
    )
    own = import_module("own_gain").Own
    Scenario(stop=1.0, step=0.5).add("own", model=own(x0=2.0)).run().write(tmp_path / "out", report=False)
    again = rerun(tmp_path / "out")
    assert again.verdict == "bit-identical"
    words = "were kept its class and its settings (x0 = 2.0), nothing else."
    assert [line.endswith(words) for line in again.changes] == [True]

    class Hidden(own):  # type: ignore[misc, valid-type]
        pass

    Scenario(stop=1.0, step=0.5).add("own", model=Hidden).run().write(tmp_path / "gone", report=False)
    with pytest.raises(ProvenanceError, match=r"own: the class .*Hidden stands in no file.* It cannot be run again"):
        rerun(tmp_path / "gone")
