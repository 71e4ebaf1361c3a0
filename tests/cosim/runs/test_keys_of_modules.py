"""The key of a run follows the content of the user's code, however the scenario names it."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

import plant_models
from cosim.runs.keys import table_content
from cosim.runs.run import Run
from cosim.scenario.schema import ScenarioTable
from cosim.simulation.scenario import Scenario
from plant_models.local_files import module_digest

MODEL = """{imports}


class Own:
    outputs = ["x"]

    def step(self, t, inputs, dt):
        return {{"x": 1.0}}
"""
RELATIVE = "from .. import above\nfrom .beside import x\nimport own_library"
FILES = {
    "own_package/__init__.py": "x = 1\n",
    "own_package/inner/__init__.py": "",
    "own_package/inner/model.py": MODEL.format(
        imports="from .. import above\nfrom .beside import x\nimport own_library"
    ),
    "own_package/inner/beside.py": "import own_library.deep\nx = 1\n",
    "own_package/above.py": "x = 1\n",
    "own_package/unused.py": "x = 1\n",
    "own_namespace/model.py": MODEL.format(imports="from .helper import x"),
    "own_namespace/helper.py": "x = 1\n",
    "own_file.py": MODEL.format(imports="def later():\n    from own_library import x\n    return x"),
    "lib/own_library/__init__.py": "x = 1\n",
    "lib/own_library/deep.py": "x = 1\n",
}
"""Of two folders in which modules are looked for."""
ON_LIBRARY = ("lib/own_library/__init__.py", "lib/own_library/deep.py")
RESTS_ON = {
    "own_package.inner.model:Own": (
        "own_package/__init__.py",
        "own_package/inner/__init__.py",
        "own_package/inner/model.py",
        "own_package/inner/beside.py",
        "own_package/above.py",
        *ON_LIBRARY,
    ),
    "own_namespace.model:Own": ("own_namespace/model.py", "own_namespace/helper.py"),
    "own_file:Own": ("own_file.py", *ON_LIBRARY),
    "own_file.py:Own": ("own_file.py", *ON_LIBRARY),
}


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    for name, text in FILES.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)
    for place in (tmp_path, tmp_path / "lib"):
        monkeypatch.syspath_prepend(str(place))
    yield tmp_path
    for name in [name for name in sys.modules if name.startswith("own_")]:
        del sys.modules[name]


@pytest.mark.parametrize("model", RESTS_ON)
def test_a_change_of_any_file_that_a_model_rests_on_is_another_run(model: str, folder: Path) -> None:
    scenario = Scenario(folder=folder, stop=1.0, step=0.5).add("own", model=model)
    before = Run(scenario).key
    changed = []
    for name, text in FILES.items():
        (folder / name).write_text(text + "# another comment\n")
        if Run(scenario).key != before:
            changed.append(name)
        (folder / name).write_text(text)
    assert Run(scenario).key == before
    assert set(changed) == set(RESTS_ON[model])


def test_an_option_and_a_registered_name_are_code_too(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(plant_models.PLANTS._own, "own_registered", type("Own", (), {"__module__": "own_file"}))
    tables = [
        ScenarioTable.model_validate({"stop": 1.0, "step": 0.5, "components": {"own": component}})
        for component in ({"model": "wheel_fault", "options": {"cause": "own_file:Own"}}, {"model": "own_registered"})
    ]
    before = [table_content(table, folder) for table in tables]
    (folder / "own_file.py").write_text(FILES["own_file.py"] + "# another comment\n")
    assert not {table_content(table, folder) for table in tables} & set(before)
    assert plant_models.PLANTS.targets("own_missing") == []


def test_a_digest_runs_nothing(folder: Path) -> None:
    (folder / "own_package" / "__init__.py").write_text("raise RuntimeError('a digest runs no code')\n")
    assert module_digest("own_package.inner.model") != module_digest("own_package.inner.missing")
    assert module_digest("own_missing") == module_digest("own_missing.inner")
    assert "own_package" not in sys.modules
