"""What each command and script may load: start-up is guarded by what is in `sys.modules`, not by the clock."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from pages import ROOT
from test_fmus.build import linear_fmu

HEAVY = ("casadi", "scipy.linalg", "scipy.optimize", "scipy.signal", "scipy.io", "scipy.sparse", "scipy.stats")
OPTIONAL = ("matplotlib", "pandas", "xarray", "control", "cvxpy", "clarabel", "pyarrow", "h5py", "jinja2")
FOR_NUMBERS = ("numpy", "fmpy", "pydantic", "lxml", "scipy")

SELDOM = ("cosim.studies.sweep", "cosim.comparison.compare", "cosim.ssp.package_loading")
SMALL = """
stop = 1.0
step = 0.1
[components.odometer]
model = "odometer"
"""

SCRIPT = "from cosim import Scenario; Scenario.load('own_fmu')"
NOTHING = (*HEAVY, *OPTIONAL, *FOR_NUMBERS)
BARRED = {
    "cosim --help": NOTHING,
    "cosim --version": NOTHING,
    "cosim list": NOTHING,
    "fmus --help": NOTHING,
    "fmus --version": NOTHING,
    "fmus list": NOTHING,
    "cosim run --help": (*HEAVY, *OPTIONAL, "lxml"),
    "cosim show --help": (*HEAVY, *OPTIONAL, "lxml"),
    "cosim info lag.fmu": (*HEAVY, *OPTIONAL, *SELDOM, "pydantic", "scipy", "cosim.scenario.schema"),
    "cosim show small.toml": (*HEAVY, *OPTIONAL, *SELDOM, "lxml"),
    SCRIPT: (*HEAVY, *OPTIONAL, *SELDOM, "lxml"),
}
"""What must not be loaded, by command; all else a command may load."""

COMMAND = """
import contextlib, io, json, sys
from {package}.cli import main
with contextlib.redirect_stdout(io.StringIO()), contextlib.suppress(SystemExit):
    main({words})
print(json.dumps(sorted(sys.modules)))
"""


def loaded(command: str, folder: Path) -> set[str]:
    """Modules that a command, or a script, has loaded when it ends."""
    package, *words = command.split()
    code = f"{command}\nimport json, sys\nprint(json.dumps(sorted(sys.modules)))"
    if command != SCRIPT:
        code = COMMAND.format(package=package, words=words)
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    done = subprocess.run(
        [sys.executable, "-c", code], env=environment, cwd=folder, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return set(json.loads(done.stdout.splitlines()[-1]))


@pytest.mark.parametrize("command", BARRED)
def test_a_command_loads_nothing_that_it_does_not_use(command: str, tmp_path: Path) -> None:
    (tmp_path / "small.toml").write_text(SMALL)
    if command.endswith(".fmu"):
        linear_fmu(tmp_path, "lag", [[-1.0]], [[1.0]], [[1.0]], [[0.0]], version=2, x0=[1.0])
    if command.endswith(("list", ".toml")):
        loaded(command, tmp_path)  # the first time the models are read, or traced, once for each version of their files
    assert loaded(command, tmp_path) & set(BARRED[command]) == set()


def test_what_is_loaded_would_be_seen(tmp_path: Path) -> None:
    assert "numpy" in loaded("cosim run --help", tmp_path)
