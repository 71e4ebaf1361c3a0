"""What runs and compares FMUs needs neither tracing nor solver nor figures: without each package, and in an environment
that has what the workflow files for continuous integration install and nothing else.
"""

from __future__ import annotations

import json
import os
import shlex
import shutil
import subprocess
import sys
import tomllib
import venv
from pathlib import Path
from xml.etree import ElementTree

import pytest
import yaml
from pages import PACKAGES, ROOT, generator
from test_fmus.build import linear_fmu

CI = ROOT / "docs" / "ci"
MOST = 300e6
"""Bytes that the installation brings."""
TEST = """
def test_train(fmu_regression):
    fmu_regression("train.fmu", stop=1.0, step=0.1, inputs={"effort": 1.0})
"""
SCENARIO = """
stop = 1.0
step = 0.1
[components.train]
fmu = "train.fmu"
parameters = {effort = 1.0}
"""
ENOUGH = (
    ("run", "train.toml", "--quiet", "--out", "one"),
    ("run", "train.toml", "--quiet", "--out", "two"),
    ("compare", "one", "two", "--quiet", "--html", "page.html"),
    ("baseline", "make", "train.fmu", "base.json", "--stop", "1", "--step", "0.1", "--quiet"),
    ("baseline", "check", "base.json", "--quiet"),
    ("info", "train.fmu"),
    ("list",),
)
"""Commands that need no more than FMUs do."""
MORE = (
    (("choose", "train.fmu"), "casadi"),
    (("tune", "train.toml", "--observer", "train", "--parameters", "x0[1]=0.5:2"), "casadi"),
    (("run", "freight_profile_d", "--quiet"), "casadi"),
)
"""Commands that need a package, and which."""
BLOCKED = """
import sys
for name in sys.argv[1].split(","):
    sys.modules[name] = None
import json
from cosim.cli import PROGRAM
codes = [PROGRAM.run(words) for words in json.loads(sys.argv[2])]
import pytest
print(codes, pytest.main(["-q", "-p", "no:cacheprovider", "--fmu-baseline=update", "test_train.py"]),
      pytest.main(["-q", "-p", "no:cacheprovider", "test_train.py"]))
"""


def delivered(folder: Path, start: float = 1.0) -> None:
    """An FMU, its test and a scenario of it in a folder."""
    linear_fmu(
        folder,
        "train",
        [[-1.0]],
        [[1.0]],
        [[1.0]],
        [[0.0]],
        version=2,
        inputs=["effort"],
        outputs=["speed"],
        x0=[start],
    )
    (folder / "test_train.py").write_text(TEST, encoding="utf-8")
    (folder / "train.toml").write_text(SCENARIO, encoding="utf-8")


def run(words: list[str], folder: Path, **more: str) -> subprocess.CompletedProcess[str]:
    environment = {k: v for k, v in os.environ.items() if not k.startswith(("PYTHON", "PIP_NO", "GITHUB"))}
    return subprocess.run(
        words, cwd=folder, env=environment | more, capture_output=True, text=True, check=False, timeout=600
    )


@pytest.mark.compiler
@pytest.mark.parametrize("package", ["casadi", "clarabel", "control", "matplotlib"])
def test_without_a_package_everything_that_an_fmu_needs_runs(package: str, tmp_path: Path) -> None:
    delivered(tmp_path)
    words = [sys.executable, "-c", BLOCKED, package, json.dumps(ENOUGH)]
    done = run(words, tmp_path, FMU_OBSERVER_CACHE=str(tmp_path / "cache"), PYTHONPATH=str(ROOT))
    assert done.stdout.splitlines()[-1] == f"{[0] * len(ENOUGH)} 0 0", done.stdout + done.stderr


@pytest.mark.compiler
@pytest.mark.parametrize(("words", "package"), MORE, ids=[words[0] for words, _ in MORE])
def test_what_needs_more_names_it_with_the_command(words: list[str], package: str, tmp_path: Path) -> None:
    delivered(tmp_path)
    code = BLOCKED.partition("import pytest")[0]
    done = run(
        [sys.executable, "-c", code, package, json.dumps([words])],
        tmp_path,
        FMU_OBSERVER_CACHE=str(tmp_path / "cache"),
        PYTHONPATH=str(ROOT),
    )
    (line,) = [line for line in done.stderr.splitlines() if not line.startswith("warning: ")]
    assert line.startswith("cosim: ")
    assert line.endswith(f"the package {package} is not installed; pip install 'casadi>=3.8'")


def lines() -> dict[str, list[str]]:
    """Commands of the two workflow files, by file."""
    on_github = yaml.safe_load((CI / "github.yml").read_text(encoding="utf-8"))
    steps = on_github["jobs"]["regression"]["steps"]
    on_gitlab = yaml.safe_load((CI / "gitlab.yml").read_text(encoding="utf-8"))
    return {"github": [s["run"] for s in steps if "run" in s], "gitlab": on_gitlab["regression"]["script"]}


def test_both_services_install_and_test_alike_and_keep_what_pytest_leaves() -> None:
    commands = lines()
    assert commands["github"] == commands["gitlab"]
    install, test = commands["github"]
    kept = [d for d in dependencies() if d.startswith("fmpy")]
    assert install == f"pip install -r requirements-run.txt && pip install --no-deps {kept[0]!r} fmu-observer"
    steps = yaml.safe_load((CI / "github.yml").read_text(encoding="utf-8"))["jobs"]["regression"]["steps"]
    paths = next(s["with"]["path"].split() for s in steps if s.get("if") == "always()")
    job = yaml.safe_load((CI / "gitlab.yml").read_text(encoding="utf-8"))["regression"]["artifacts"]
    assert f"--fmu-artifacts={paths[0]}" in test
    assert f"--junitxml={paths[1]}" in test
    assert (job["paths"], job["reports"]["junit"], job["when"]) == ([paths[0]], paths[1], "always")


def dependencies() -> list[str]:
    return list(tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["dependencies"])


def size(folder: Path) -> int:
    return sum(path.lstat().st_size for path in folder.rglob("*") if path.is_file())


@pytest.mark.compiler
@pytest.mark.slow
def test_the_documented_lines_install_little_and_test_a_delivery(tmp_path: Path) -> None:
    source, project, place = tmp_path / "source", tmp_path / "project", tmp_path / "venv"
    for package in PACKAGES:
        shutil.copytree(ROOT / package, source / package, ignore=shutil.ignore_patterns("__pycache__"))
    for name in ("pyproject.toml", "README.md", "LICENSE", "NOTICE"):
        shutil.copy(ROOT / name, source / name)
    project.mkdir()
    delivered(project)
    shutil.copy(generator().RUN_REQUIREMENTS, project)
    venv.create(place, with_pip=True)
    bare = size(place)
    install, test = lines()["github"]
    path = f"{place / 'bin'}{os.pathsep}{os.environ['PATH']}"
    cache = str(tmp_path / "cache")

    def shell(line: str, **more: str) -> subprocess.CompletedProcess[str]:
        return run(["bash", "-c", line], project, PATH=path, FMU_OBSERVER_CACHE=cache, **more)

    done = shell(install.replace("fmu-observer", str(source)))
    assert done.returncode == 0, done.stderr
    assert size(place) - bare < MOST
    made = shell(f"{test} --fmu-baseline=update")
    assert made.returncode == 0, made.stdout
    assert shell(test).returncode == 0
    for words in ENOUGH:
        done = shell(shlex.join(["cosim", *words]))
        assert done.returncode == 0, (words, done.stdout, done.stderr)
    for words, package in MORE:
        done = shell(shlex.join(["cosim", *words]))
        assert (done.returncode, "Traceback" in done.stderr) == (2, False)
        assert f"the package {package} is not installed; pip install '" in done.stderr

    delivered(project, 1.1)
    summary = project / "summary.md"
    done = shell(test, GITHUB_ACTIONS="true", GITHUB_STEP_SUMMARY=str(summary), GITHUB_WORKSPACE=str(project))
    assert done.returncode == 1
    assert "\nfmu: x0[1] start 1 -> 1.1\n" in done.stdout
    assert "\n::error file=test_train.py,line=" in done.stdout
    assert "fmu: x0[1] start 1 -&gt; 1.1" in summary.read_text(encoding="utf-8")
    properties = {p.get("name"): p.get("value") for p in ElementTree.parse(project / "junit.xml").iter("property")}
    assert properties["fmu_changed"] == "fmu: x0[1] start 1 -> 1.1"
    assert (project / properties["fmu_html"]).is_file()
    assert (project / "differences" / "index.html").is_file()
