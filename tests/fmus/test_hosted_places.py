"""Where hosted FMUs come from and where they run: files and packages, bad models, a bare Python, a plain C program."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import sysconfig
import tomllib
import zipfile
from pathlib import Path

import pytest
from fmpy import extract, read_model_description
from fmpy.fmi2 import FMU2Slave
from hosted_models import Gatekeeper, Lister, Needy, not_a_block
from hosted_runs import Loaded, initialize, references

from fmu_observer.block import make_block
from fmu_observer.observers.train import TakagiSugenoCdo
from fmus.cli import main
from fmus.hosted import HostedExportError, build_hosted_fmu
from fmus.hosted.host import OWN_VERSION, HostError, _check_package, package_version
from fmus.toolchain.compile import find_compiler, header_folder

pytestmark = pytest.mark.compiler

HERE = Path(__file__).parent
MODELS = HERE / "hosted_models.py"
PROJECT = HERE.parents[1]


def write(folder: Path, name: str, text: str) -> Path:
    path = folder / name
    path.write_text(text)
    return path


def recipe_of(fmu: Path) -> dict[str, object]:
    with zipfile.ZipFile(fmu) as archive:
        content: dict[str, object] = json.loads(archive.read("resources/hosted.json"))
        return content


# -- what goes in
# -------------------------------------------------------------------------------------------------------


def test_equal_models_give_equal_bytes(tmp_path: Path) -> None:
    one = build_hosted_fmu(Gatekeeper(), tmp_path / "one.fmu")
    two = build_hosted_fmu(f"{MODELS}:Gatekeeper", tmp_path / "two")
    assert one.read_bytes() == two.read_bytes()
    assert two.name == "gatekeeper.fmu"


def test_an_installed_package_is_imported_and_not_copied(tmp_path: Path) -> None:
    fmu = build_hosted_fmu(TakagiSugenoCdo, tmp_path, preset="as_published", late_policy="reject")
    assert recipe_of(fmu)["file"] is None
    loaded = Loaded(fmu, tmp_path / "unpacked")
    slave, block = initialize(loaded.make()), make_block(TakagiSugenoCdo(), 2, preset="as_published")
    block.instantiate()
    initialize(block)
    for k in range(5):
        for one in (slave, block):
            one.doStep(k * 0.1, 0.1)
    every = [v.valueReference for v in loaded.description.modelVariables if v.type == "Real"]
    assert slave.getReal(every) == block.getReal(every)
    loaded.close()


def test_extra_files_lie_beside_the_model(tmp_path: Path) -> None:
    helper = write(tmp_path, "gate_helper.py", "from hosted_base import Gatekeeper\n")
    base = write(tmp_path, "hosted_base.py", MODELS.read_text())
    model = write(
        tmp_path, "gate.py", 'from gate_helper import Gatekeeper\n\nclass Gate(Gatekeeper):\n    name = "gate"\n'
    )
    fmu = build_hosted_fmu(f"{model}:Gate", tmp_path, extra_files=[helper, base])
    loaded = Loaded(fmu, tmp_path / "unpacked")
    initialize(loaded.make()).doStep(0.0, 0.1)
    loaded.close()
    with pytest.raises(
        HostedExportError, match=r"gate\.py imports 'gate_helper', which is not installed .* extra_files"
    ):
        build_hosted_fmu(f"{model}:Gate", tmp_path / "no")
    assert not (tmp_path / "no").exists()


def test_the_licences_of_all_that_is_inside(tmp_path: Path) -> None:
    own, ours = build_hosted_fmu(Gatekeeper, tmp_path), build_hosted_fmu(TakagiSugenoCdo, tmp_path)
    for fmu, terms in ((own, "its terms are its author's to state"), (ours, "TakagiSugenoCdo is part of fmu-observer")):
        with zipfile.ZipFile(fmu) as archive:
            folder = "documentation/licenses/"
            texts = {
                n.removeprefix(folder): archive.read(n).decode() for n in archive.namelist() if n.startswith(folder)
            }
        assert sorted(texts) == ["fmi-headers.txt", "fmu-observer.txt", "license.txt", "pythonfmu.txt"]
        assert texts["fmu-observer.txt"] == (PROJECT / "LICENSE").read_text()
        assert "MIT License" in texts["pythonfmu.txt"]
        assert terms in texts["license.txt"]
        assert all(name in texts["license.txt"] for name in texts if name != "license.txt")


def test_options_go_in(tmp_path: Path) -> None:
    assert recipe_of(build_hosted_fmu(f"{MODELS}:Needy", tmp_path, options={"gain": 2.0}))["options"] == {"gain": 2.0}


def test_two_fmus_that_bring_a_file_of_one_name(tmp_path: Path) -> None:
    values = []
    for folder, limit in (("a", 0.25), ("b", 0.5)):
        (tmp_path / folder).mkdir()
        model = write(
            tmp_path / folder, "model.py", MODELS.read_text().replace('"limit", "m/s", 2.0', f'"limit", "m/s", {limit}')
        )
        loaded = Loaded(build_hosted_fmu(f"{model}:Gatekeeper", tmp_path / folder), tmp_path / folder / "unpacked")
        slave = initialize(loaded.make())
        values += slave.getReal([references(loaded.description)["limit"]])
        slave.doStep(0.0, 1.0)
        values += slave.getReal([references(loaded.description)["place"]])
        loaded.close()
    assert values == pytest.approx([0.25, 1.25, 0.5, 1.5], rel=1e-12)  # 1 m and one second at the limit


# -- what does not go in
# ------------------------------------------------------------------------------------------------


def test_models_that_cannot_be_hosted_are_refused_with_advice(tmp_path: Path) -> None:
    class Hidden(Gatekeeper):
        name = "hidden"

    broken = write(tmp_path, "broken.py", "1 / 0\n")
    silent = Lister()
    del silent.model_description
    for model, options, words in (
        ("nothing", None, "names no class; write path/to/file.py:Class"),
        ("missing.py:Gate", None, "missing.py does not exist"),
        (f"{MODELS}:Nobody", None, "has no class or function 'Nobody'"),
        (f"{MODELS}:Needy", {"gain": -1.0}, "Needy cannot be made: ValueError: gain must not be negative"),
        (f"{broken}:Gate", None, "ZeroDivisionError"),
        (Hidden, None, "define it at the top level of a file"),
        (Needy, {"gain": object()}, "cannot be written into the FMU"),
        (not_a_block, None, "makes a object, which is no HybridSystem and no block either: it lacks instantiate"),
        ("no_such_package.module:Gate", None, "imports 'no_such_package', which is not installed"),
    ):
        with pytest.raises(HostedExportError) as caught:
            build_hosted_fmu(model, tmp_path / "out", options=options)
        assert words in str(caught.value)
    assert not (tmp_path / "out").exists()


def test_an_older_package_is_refused() -> None:
    project = tomllib.loads((PROJECT / "pyproject.toml").read_text())["project"]
    assert package_version() == OWN_VERSION == project["version"]
    _check_package("0.0.1")
    with pytest.raises(HostError, match=r"built with fmu-observer 999\.1\.0, here is"):
        _check_package("999.1.0")


def test_the_command_line_builds_and_suggests_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["build", f"{MODELS}:Gatekeeper", "-o", str(tmp_path)]) == 2
    said = capsys.readouterr().err
    assert "cannot be traced" in said
    assert "fmus build ... --hosted" in said
    assert main(["build", f"{MODELS}:Needy", "--hosted", "--option", "gain=3.0", "-o", str(tmp_path)]) == 0
    fmu = Path(capsys.readouterr().out.strip())
    assert fmu == tmp_path / "needy.fmu"
    assert recipe_of(fmu)["options"] == {"gain": 3.0}
    assert main(["build", f"{MODELS}:Needy", "--hosted", "--platform", "all", "-o", str(tmp_path)]) == 2
    assert "for this machine only" in capsys.readouterr().err
    assert main(["build", f"{MODELS}:Needy", "--hosted", "--option", "gain=-3.0", "-o", str(tmp_path)]) == 2
    assert "gain must not be negative" in capsys.readouterr().err


# -- where it runs
# ------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def unpacked(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("with a space")
    return Path(extract(str(build_hosted_fmu(f"{MODELS}:Gatekeeper", folder)), unzipdir=str(folder / "unpacked")))


BARE = """
import ctypes, sys
sys.path[:] = [p for p in sys.path if "site-packages" not in p and p != sys.argv[3]]
library, said = ctypes.CDLL(sys.argv[1]), []
Logger = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_char_p, ctypes.c_int, ctypes.c_char_p, ctypes.c_char_p)
class Callbacks(ctypes.Structure):
    _fields_ = [("logger", Logger)] + [(name, ctypes.c_void_p) for name in ("allocate", "free", "finished", "environment")]
callbacks = Callbacks(Logger(lambda e, n, status, c, text: said.append(f"{status} {text.decode()}")))
library.fmi2Instantiate.restype = ctypes.c_void_p
made = library.fmi2Instantiate(b"bare", 1, sys.argv[4].encode(), sys.argv[2].encode(), ctypes.byref(callbacks), 0, 0)
print(made, *said)
"""  # noqa: E501


def test_a_python_without_the_package_says_so_and_does_not_crash(unpacked: Path) -> None:
    description = read_model_description(str(unpacked), validate=False)
    uri = (unpacked / "resources").as_uri()
    command = [sys.executable, "-S", "-c", BARE, str(library_of(unpacked)), uri, str(PROJECT), description.guid]
    environment = {k: v for k, v in os.environ.items() if k not in ("PYTHONPATH", "VIRTUAL_ENV")}
    done = subprocess.run(
        command, capture_output=True, text=True, check=False, env=environment, cwd=unpacked, timeout=60
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("None 3 fmi2Instantiate: this FMU needs the Python package fmu-observer")
    assert "missing: plant_models, fmu_observer, fmus" in done.stdout
    assert "pip install fmu-observer" in done.stdout


def library_of(unpacked: Path) -> Path:
    (path,) = (unpacked / "binaries").rglob("*gatekeeper.*")
    return path


@pytest.fixture(scope="module")
def program(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("program") / "host"
    flags = ["-std=c11", "-Wall", "-Wextra", "-Wshadow", "-Werror", f"-I{header_folder()}"]
    subprocess.run([*find_compiler().command, *flags, str(HERE / "hosted_host.c"), "-o", str(path), "-ldl"], check=True)
    return path


def run_program(
    program: Path, unpacked: Path, guid: str | None = None, **environment: str
) -> subprocess.CompletedProcess[str]:
    description = read_model_description(str(unpacked), validate=False)
    refs = references(description)
    words = [
        library_of(unpacked),
        guid or description.guid,
        (unpacked / "resources").as_uri(),
        refs["speed"],
        refs["doubled"],
        1.5,
    ]
    clean = {k: v for k, v in os.environ.items() if k not in ("PYTHONPATH", "VIRTUAL_ENV", "FMU_OBSERVER_LIBPYTHON")}
    return subprocess.run(
        [str(program), *map(str, words)],
        capture_output=True,
        text=True,
        check=False,
        env=clean | environment,
        timeout=60,
    )


def test_a_plain_c_program_gets_the_block_s_values(program: Path, unpacked: Path) -> None:
    python = Path(sysconfig.get_config_var("LIBDIR")) / str(sysconfig.get_config_var("INSTSONAME"))
    packages = os.pathsep.join(map(str, (PROJECT, sysconfig.get_path("purelib"))))
    done = run_program(program, unpacked, FMU_OBSERVER_LIBPYTHON=str(python), PYTHONPATH=packages)
    if not python.is_file():  # a Python without a shared library: no C program can load it, and is told so
        assert done.stdout.startswith(
            "3 fmi2Instantiate: this FMU runs Python code, and there is no Python in this process"
        )
        return
    assert done.returncode == 0, done.stdout + done.stderr
    block = make_block(Gatekeeper(), 2)
    block.instantiate()
    initialize(block, speed=1.5)
    for k in range(100):
        block.doStep(k * 0.01, 0.01)
    expected = block.getReal([references(block.model_description)["doubled"]])[0]
    assert [float(line) for line in done.stdout.splitlines()] == [expected, expected]


def test_a_plain_c_program_without_python_reports_what_to_set(program: Path, unpacked: Path) -> None:
    done = run_program(program, unpacked, FMU_OBSERVER_LIBPYTHON="nowhere/libpython.so")
    assert done.returncode == 2
    assert done.stdout.startswith(
        "3 fmi2Instantiate: this FMU runs Python code, and there is no Python in this process"
    )
    assert "FMU_OBSERVER_LIBPYTHON" in done.stdout
    refused = run_program(program, unpacked, guid="{of another}")
    assert refused.returncode == 2
    assert "was expected, {of another} was given" in refused.stdout


def test_a_folder_that_is_not_the_fmu_s_is_refused(unpacked: Path, tmp_path: Path) -> None:
    description = read_model_description(str(unpacked), validate=False)
    (tmp_path / "binaries" / "linux64").mkdir(parents=True)
    library = tmp_path / "binaries" / "linux64" / library_of(unpacked).name
    library.write_bytes(library_of(unpacked).read_bytes())
    slave = FMU2Slave(
        guid=description.guid, unzipDirectory=str(tmp_path), modelIdentifier="gatekeeper", instanceName="lost"
    )
    with pytest.raises(Exception, match="instantiate"):
        slave.instantiate()
    slave.freeLibrary()
