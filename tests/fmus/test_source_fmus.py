"""FMUs that bring C sources and no library: what they are refused with, and what compiling them makes of them."""

from __future__ import annotations

import re
import zipfile
from collections.abc import Callable
from ctypes import CDLL, c_int
from pathlib import Path
from typing import Any

import fmpy
import numpy as np
import pytest
from lying_fmus import SOURCE, build, description

from cosim.cli import main as cosim
from fmus import CompilationError, CompilerMissing
from fmus.cli import main as fmus
from fmus.fmi.archive import NotAnFmuError, open_archive
from fmus.source_build import compile_sources

pytestmark = pytest.mark.compiler

LIAR = description().replace(
    '<CoSimulation modelIdentifier="liar"', '<CoSimulation modelIdentifier="liar" needsExecutionTool="false"'
)
"""Without a list of source files, as of many tools."""
FIRST_CALL = '#include "fmi3Functions.h"\nconst char* fmi3GetVersion(void) { return "3.0"; }\n'
ALONE = 'stop = 0.2\nstep = 0.01\n[components.plant]\nfmu = "vendor.fmu"\n'
Make = Callable[..., Path]


@pytest.fixture
def made(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Make:
    """Writes an FMU of some files; nothing was ever compiled here."""
    monkeypatch.setenv("FMU_OBSERVER_CACHE", str(tmp_path / "cache"))
    monkeypatch.chdir(tmp_path)

    def make(files: dict[str, str], name: str = "vendor.fmu") -> Path:
        with zipfile.ZipFile(name, "w") as archive:
            for inner, text in files.items():
                archive.writestr(inner, text)
        return Path(name)

    return make


def three(*sets: str, files: dict[str, str]) -> dict[str, str]:
    """The files of an FMI 3 FMU that is described as far as compiling it goes."""
    xml = (
        '<fmiModelDescription fmiVersion="3.0" modelName="toy" instantiationToken="t"><CoSimulation '
        'modelIdentifier="toy"/><ModelVariables/><ModelStructure/></fmiModelDescription>'
    )
    building = (
        '<?xml version="1.0"?><fmiBuildDescription fmiVersion="3.0"><BuildConfiguration modelIdentifier="toy">'
        f"{''.join(sets)}</BuildConfiguration></fmiBuildDescription>"
    )
    return {
        "modelDescription.xml": f'<?xml version="1.0"?>{xml}',
        "sources/buildDescription.xml": building,
        **{f"sources/{name}": text for name, text in files.items()},
    }


def simulated(path: Path) -> Any:
    return fmpy.simulate_fmu(str(path), stop_time=1.0, output_interval=0.1, output=["position", "speed"])


def test_every_command_names_the_one_that_compiles(made: Make, capfd: pytest.CaptureFixture[str]) -> None:
    """Until it was compiled."""
    path = made({"modelDescription.xml": LIAR, "sources/liar.c": SOURCE.read_text()})
    named = rf"brings its C sources: compile them once with: fmus compile .*{path}"
    for command, code in ((["cosim", "info"], 0), (["cosim", "new"], 0), (["fmus", "check"], 2), (["fmus", "info"], 0)):
        assert {"cosim": cosim, "fmus": fmus}[command[0]]([command[1], str(path)]) in (code, 1), command
        assert re.search(named, "".join(capfd.readouterr())), command
    Path("alone.toml").write_text(ALONE)
    assert cosim(["run", "alone.toml"]) == 2
    assert re.search(named, capfd.readouterr().err)


def test_a_file_that_was_compiled_runs_as_it_is(made: Make, capfd: pytest.CaptureFixture[str]) -> None:
    """And so does the file with the library; the numbers are those of the maker's own library."""
    path = made({"modelDescription.xml": LIAR, "sources/liar.c": SOURCE.read_text()})
    before = path.read_bytes()
    assert fmus(["compile", str(path), "-o", "whole.fmu"]) == 0
    assert "vendor.fmu runs" not in capfd.readouterr().out
    assert open_archive(Path("whole.fmu")).here == [fmpy.platform]
    assert open_archive(path).why_not_here() == ""
    Path("alone.toml").write_text(ALONE)
    assert cosim(["run", "alone.toml"]) == 0
    assert cosim(["info", str(path)]) == 0
    assert "yes, by a library that was compiled of its sources here" in capfd.readouterr().out
    assert path.read_bytes() == before
    np.testing.assert_array_equal(simulated(Path("whole.fmu")), simulated(build(Path("own"), xml=LIAR)))


def test_each_source_set_has_its_own_language_definitions_and_folders(made: Make) -> None:
    """fmpy builds the first set only, passes "None" where a definition has no value, and includes no folder."""
    one = (
        '<SourceFileSet language="C99"><SourceFile name="main.c"/><PreprocessorDefinition name="EMPTY"/>'
        '<PreprocessorDefinition name="MORE" value="20"/><PreprocessorDefinition name="NOT" value="1" optional="true"/>'
        "</SourceFileSet>"
    )
    two = '<SourceFileSet><SourceFile name="deep/main.c"/><IncludeDirectory name="deep/inc"/></SourceFileSet>'
    files = {
        "main.c": FIRST_CALL
        + "#ifdef NOT\n#error optional\n#endif\nint part(void);\n"
        + '#if EMPTY != 1\n#error without a value\n#endif\n__attribute__((visibility("default"))) '
        + "int whole(void) { return part() + MORE; }\n",
        "deep/main.c": "#include <part.h>\nint part(void) { return PART; }\n",
        "deep/inc/part.h": "#define PART 3\n",
    }
    build = compile_sources(made(three(one, two, files=files)))
    whole = CDLL(str(build.libraries[0])).whole
    whole.restype = c_int
    assert whole() == 23
    assert not build.kept
    assert compile_sources(Path("vendor.fmu")).kept


def test_what_cannot_be_compiled_is_said(made: Make, monkeypatch: pytest.MonkeyPatch) -> None:
    """The last lines of the compiler; files that are listed and not there; names that nobody would find."""
    one = '<SourceFileSet><SourceFile name="main.c"/></SourceFileSet>'
    cases = [
        (CompilationError, "toy.fmu: its sources .*\n.*main.c:1:.*error", {"main.c": "int broken(\n"}),
        (
            CompilationError,
            "toy.fmu: its sources .*\n(.*\n)*.*undefined.*there",
            {"main.c": FIRST_CALL + "int there(void); int f(void) { return there(); }"},
        ),
        (
            CompilationError,
            "no function fmi3GetVersion; they are made for static linking",
            {"main.c": "int toy_fmi3GetVersion(void) { return 3; }"},
        ),
        (NotAnFmuError, "source files that it does not hold: sources/main.c", {"other.c": ""}),
    ]
    for kind, words, files in cases:
        path = made(three(one, files=files), "toy.fmu")
        with pytest.raises(kind, match=words) as caught:
            compile_sources(path)
        assert len(str(caught.value).splitlines()) < 16
        assert not open_archive(path).compiled_here()
    path = made(three(one, files={"main.c": FIRST_CALL}), "toy.fmu")
    monkeypatch.setenv("CC", "no-such-compiler")
    with pytest.raises(CompilerMissing, match=r"no-such-compiler.*Install one"):
        compile_sources(path)


def test_what_is_not_to_be_compiled_is_said(made: Make, capfd: pytest.CaptureFixture[str]) -> None:
    """No sources, a library that is there, and a target that is the FMU itself."""
    one = '<SourceFileSet><SourceFile name="main.c"/></SourceFileSet>'
    files = three(one, files={"main.c": FIRST_CALL})
    sealed = made({"modelDescription.xml": files["modelDescription.xml"]}, "sealed.fmu")
    assert "compile" not in open_archive(sealed).why_not_here()
    assert fmus(["compile", str(sealed)]) == 2
    assert "sealed.fmu brings no C sources: ask its maker" in capfd.readouterr().err
    library = f"binaries/{fmpy.platform_tuple}/toy{fmpy.sharedLibraryExtension}"
    whole = made(files | {library: "x"}, "whole.fmu")
    assert fmus(["compile", str(whole)]) == 2
    assert "has a library for this platform already" in capfd.readouterr().err
    path = made(files)
    assert fmus(["compile", str(path), "-o", str(path)]) == 2
    assert "vendor.fmu is the FMU itself" in capfd.readouterr().err


def test_a_build_description_that_is_copied_or_broken_stops_nobody(made: Make) -> None:
    """A single configuration is meant for the model, whatever it is named after, as in the Reference FMUs; with a
    library nobody needs it.
    """
    one = '<SourceFileSet><SourceFile name="main.c"/></SourceFileSet>'
    files = three(one, files={"main.c": FIRST_CALL})
    xml = files["sources/buildDescription.xml"]
    for wrong in (xml.replace('"toy"', '"other"'), xml[:60], xml.replace('"3.0"', '"9.0"')):
        path = made(files | {"sources/buildDescription.xml": wrong})
        assert [c.modelIdentifier for c in open_archive(path).build_configurations()] == ["toy"]
        assert compile_sources(path).libraries[0].name == f"toy{fmpy.sharedLibraryExtension}"
