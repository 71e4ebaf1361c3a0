"""Bad input of the exporter: what it says, that it exits with 2 and no traceback, and that nothing half-written is
left.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
import zipfile
from argparse import Namespace
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from fmus import CompilerMissing, UnknownRecipeError, build_fmu, cached_fmu, recipe
from fmus.cli import main
from fmus.cli.failures import in_words
from fmus.content.names import NameRefusedError
from fmus.pack import check_target
from plant_models.hybrid import HybridSystem, TriggeredEvent, input_signal, output_signal, state

Output = pytest.CaptureFixture[str]
ROOT = Path(__file__).parents[2]
NOBODY_MAY_WRITE = Path("/") / "proc" / "fmus"
"""Not even root; a folder of mode 555 would not stop it."""


def refused(arguments: list[str], capsys: Output) -> str:
    """What the command line says when it refuses."""
    assert main(arguments) == 2
    said = capsys.readouterr()
    assert "Traceback" not in said.err
    assert said.out == ""
    return said.err


MODEL = """
import numpy as np
from plant_models.hybrid import HybridSystem, input_signal, output_signal, state

class Trolley(HybridSystem):
    name = "trolley"
    states = (state("rate", "m/s"),)
    inputs = (input_signal("effort", "N"),)
    outputs = (output_signal("speed", "m/s"),)
    option_choices = {"brake": ("none", "linear")}

    def __init__(self, brake="none"):
        super().__init__(brake=brake)

    def flow(self, t, x, u, p):
FLOW
        return {"rate": u.effort}

    def output(self, t, x, u, p):
        return {"speed": x.rate}
"""


@pytest.fixture
def own_model(tmp_path: Path) -> Callable[..., Path]:
    """Writes a user's file: ``own_model(lines of flow, replacements)``."""

    def write(flow: str = "        pass", **replacements: str) -> Path:
        text = MODEL.replace("FLOW", flow)
        for old, new in replacements.items():
            text = text.replace(old, new)
        path = tmp_path / "own.py"
        path.write_text(text)
        return path

    return write


# -- the user's own system -------------------------------------------------------------------------------------------


@pytest.mark.compiler
def test_a_users_own_system_is_built_from_its_file(
    own_model: Callable[..., Path], tmp_path: Path, capsys: Output
) -> None:
    path = own_model()
    for name in (f"{path}:Trolley", str(path)):  # one class in the file: it need not be named
        assert main(["build", name, "--option", "brake=linear", "-o", str(tmp_path / "out")]) == 0
        assert Path(capsys.readouterr().out.strip()) == tmp_path / "out" / "trolley.fmu"
    assert sorted(p.name for p in tmp_path.iterdir()) == ["out", "own.py"]  # no compiled Python beside it


@pytest.mark.parametrize(
    ("flow", "line", "words"),
    [
        ("        if x.rate > 0:\n            return {'rate': 0.0}", "if x.rate > 0:", "np.where instead of 'if'"),
        ("        return {'rate': np.array([u.effort + x.rate])[0]}", "np.array", "vector(...) instead of np.array"),
        ("        return u.efort", "return u.efort", "no attribute 'efort'"),
    ],
)
def test_what_cannot_be_traced(
    flow: str, line: str, words: str, own_model: Callable[..., Path], tmp_path: Path, capsys: Output
) -> None:
    said = refused(["build", f"{own_model(flow)}:Trolley", "-o", str(tmp_path)], capsys)
    assert "trolley: cannot trace flow" in said
    assert "own.py:1" in said  # file and line number
    assert line in said
    assert words in said
    assert list(tmp_path.glob("*.fmu")) == []


@pytest.mark.parametrize(
    ("name", "replacements", "words"),
    [
        ("own.py:Trolly", {}, "no subclass of HybridSystem named 'Trolly'; it has: Trolley"),
        ("own.py:np", {}, "named 'np'"),
        ("other.py:Trolley", {}, "other.py does not exist"),
        ("own.py:Trolley", {"import numpy": "import nompy"}, "ModuleNotFoundError: No module named 'nompy'"),
        ("own.py:Trolley", {"class Trolley(": "class Trolley("[:-1]}, "SyntaxError"),
        ("own.py:Trolley", {'state("rate", "m/s")': 'state("speed", "m/s")'}, "names used twice or reserved: speed"),
        ("own.py:Trolley", {'"effort", "N"': '"ef fort", "N"'}, "'ef fort' is not a legal identifier"),
        ("own.py:Trolley", {'name = "trolley"': 'name = "trolley 2"'}, "must be a legal identifier"),
        ("own.py:Trolley", {'name = "trolley"': 'name = "double"'}, "'double' is a word of C"),
        (
            "own.py:Trolley",
            {'"effort", "N"': '"kraft_größe", "N"'},
            "'kraft_größe' of a signal is not legal in C and FMI",
        ),
        ("own.py:Trolley", {'"effort", "N"': '"effort", "furlong"'}, "furlong"),
        ("own.py:Trolley", {'"effort", "N"': '"effort", "N", 0.0, "Pull\\x01"'}, "'effort' holds the character U+0001"),
    ],
)
def test_mistakes_in_a_users_file(
    name: str, replacements: dict[str, str], words: str, own_model: Callable[..., Path], tmp_path: Path, capsys: Output
) -> None:
    path = own_model(**replacements)
    assert words in refused(["build", str(path.parent / name), "-o", str(tmp_path / "out")], capsys)
    assert not (tmp_path / "out").exists()


def test_options_of_a_users_system_are_checked(own_model: Callable[..., Path], capsys: Output) -> None:
    path = own_model()
    assert "one of none, linear" in refused(["build", f"{path}:Trolley", "--option", "brake=drag"], capsys)
    assert "its options are: brake" in refused(["build", f"{path}:Trolley", "--option", "break=1"], capsys)


def named(name: str, event: str = "ping") -> HybridSystem:
    class Named(HybridSystem):
        states = (state("place", "m"),)
        outputs = (output_signal("out", "m"),)
        events = (TriggeredEvent(event, (input_signal(f"{event}_value", "m", variability="discrete"),)),)

        def flow(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
            return {"place": 1.0}

        def jump(self, event: str, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
            return {"place": x.place + 1.0}

        def output(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
            return {"out": x.place}

    Named.name = name
    return Named()


@pytest.mark.parametrize("name", ["runtime", "instance", "events", "main", "while", "zug_größe", "x" * 64])
def test_names_that_c_does_not_take(name: str, tmp_path: Path) -> None:
    with pytest.raises(NameRefusedError, match=name[:20]):
        build_fmu(named(name), tmp_path)
    with pytest.raises(NameRefusedError, match="an event is not legal"):
        build_fmu(named("fine", event="größe"), tmp_path)
    assert list(tmp_path.iterdir()) == []


# -- the command line -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["locomotive", "--platform", "win46"], "did you mean 'win64'"),
        (["locomotive", "odometer", "-o", "both.fmu"], "give a folder"),
        (["locomotive", "--fmi", "both", "-o", "both.fmu"], "give a folder"),
        (["locomotive", "odometer", "--preset", "chapter_3"], "belong to one model"),
        (["odometer", "odometer"], "would overwrite each other"),
        ([], "names of models"),
        (["odometer", "--all"], "names of models"),
    ],
)
def test_contradictions(arguments: list[str], words: str, capsys: Output) -> None:
    assert words in refused(["build", *arguments], capsys)


def test_without_any_compiler_both_ways_out_are_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Output
) -> None:
    monkeypatch.delenv("CC", raising=False)
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.setitem(sys.modules, "ziglang", None)
    said = refused(["build", "odometer", "-o", str(tmp_path)], capsys)
    assert "Install one" in said
    assert "pip install 'fmu-observer[cross]'" in said
    assert "pip install 'fmu-observer[cross]'" in refused(
        ["build", "odometer", "--platform", "all", "-o", str(tmp_path)], capsys
    )
    assert list(tmp_path.iterdir()) == []


# -- targets that cannot be written
# --------------------------------------------------------------------------------------


@pytest.fixture
def no_compiler_is_asked(monkeypatch: pytest.MonkeyPatch) -> None:
    """A compiler that does not exist: who gets as far as looking for it has checked the target too late."""
    monkeypatch.setenv("CC", "no-such-compiler")


@pytest.mark.usefixtures("no_compiler_is_asked")
def test_targets_are_checked_before_the_work(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    (tmp_path / "folder.fmu").mkdir()
    with pytest.raises(NotADirectoryError, match="file"):
        build_fmu(recipe("odometer"), tmp_path / "file" / "deeper")
    with pytest.raises(IsADirectoryError, match="is a folder"):
        build_fmu(recipe("odometer"), tmp_path / "folder.fmu")
    with pytest.raises(OSError, match="choose another folder"):
        build_fmu(recipe("odometer"), NOBODY_MAY_WRITE / "odometer.fmu")
    with pytest.raises(CompilerMissing):
        build_fmu(recipe("odometer"), tmp_path / "fine")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["file", "folder.fmu"]


@pytest.mark.usefixtures("no_compiler_is_asked")
def test_the_command_line_says_so_too(tmp_path: Path, capsys: Output) -> None:
    (tmp_path / "file").write_text("")
    assert "cannot be written" in refused(["build", "odometer", "-o", str(tmp_path / "file" / "x")], capsys)


def test_a_target_that_can_be_written_is_left_as_it_was(tmp_path: Path) -> None:
    older = tmp_path / "older.fmu"
    older.write_text("older")
    for target in (older, tmp_path / "a" / "b" / "new.fmu"):
        check_target(target)
    assert [path.name for path in tmp_path.iterdir()] == ["older.fmu"]
    assert older.read_text() == "older"


# -- a disk that is full, and a user who has had enough
# --------------------------------------------------------------------

FULL = """
import errno, os, resource, sys
from pathlib import Path
from fmus.pack import pack_fmu
resource.setrlimit(resource.RLIMIT_FSIZE, (20000, 20000))
try:
    pack_fmu({"binaries/x/noise.so": os.urandom(100000)}, Path(sys.argv[1]))
except OSError as error:
    print("refused", error.errno == errno.EFBIG, error.filename == sys.argv[1])
"""


def in_another_process(command: list[str], folder: Path, **environment: str) -> subprocess.CompletedProcess[str]:
    everything = os.environ | {"PYTHONPATH": str(ROOT)} | environment
    return subprocess.run(command, cwd=folder, env=everything, capture_output=True, text=True, check=False)


@pytest.mark.skipif(sys.platform == "win32", reason="the limit of file sizes is POSIX's")
def test_a_full_disk_leaves_the_older_file(tmp_path: Path) -> None:
    target = tmp_path / "model.fmu"
    target.write_text("older")
    done = in_another_process([sys.executable, "-c", FULL, str(target)], tmp_path)
    assert done.stdout == "refused True True\n", done.stderr
    assert target.read_text() == "older"
    assert [path.name for path in tmp_path.iterdir()] == ["model.fmu"]


INTERRUPTING = """
import os, signal, sys, time
if "--version" in sys.argv:
    print("interrupting compiler 1.0")
else:
    os.kill(os.getppid(), signal.SIGINT)
    signal.pause()
"""


@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
def test_an_interrupted_build_leaves_nothing(tmp_path: Path) -> None:
    """The compiler itself interrupts the build, as Ctrl-C does, and would then never end."""
    compiler, scratch, out = tmp_path / "cc.py", tmp_path / "scratch", tmp_path / "out"
    compiler.write_text(INTERRUPTING)
    scratch.mkdir()
    command = [sys.executable, "-m", "fmus.cli", "build", "odometer", "-o", str(out)]
    done = in_another_process(command, tmp_path, CC=f"{sys.executable} {compiler}", TMPDIR=str(scratch))
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.strip().splitlines()[-1] == "fmus: interrupted."
    assert "Traceback" not in done.stderr
    assert not out.exists()
    assert list(scratch.iterdir()) == []


INTERRUPTING_MODEL = """
import os, signal, sys
if "-c" in sys.argv:
    os.kill(os.getppid(), signal.SIGINT)
"""


@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
@pytest.mark.parametrize("handling", ["SIG_DFL", "SIG_IGN"])  # a script that starts it with '&' has SIGINT ignored
def test_an_interrupted_hosted_build_leaves_nothing(handling: str, tmp_path: Path) -> None:
    """The model interrupts the build, once it runs in the process of its own in which it is tried."""
    model, scratch, out = tmp_path / "model.py", tmp_path / "scratch", tmp_path / "out"
    own = MODEL.replace("FLOW", "        pass").replace("import numpy as np", INTERRUPTING_MODEL)
    model.write_text(own)
    scratch.mkdir()
    start = (
        f"import signal; signal.signal(signal.SIGINT, signal.{handling}); import os, sys; os.execv(sys.executable, "
        f"sys.argv[1:])"
    )
    build = [sys.executable, "-m", "fmus.cli", "build", f"{model}:Trolley", "--hosted", "-o", str(out)]
    done = in_another_process([sys.executable, "-c", start, *build], tmp_path, TMPDIR=str(scratch))
    assert (done.returncode, done.stdout) == (2, ""), done.stderr
    assert done.stderr.strip() == "fmus: interrupted."
    assert not out.exists()
    assert list(scratch.iterdir()) == []


# -- what nobody foresaw
# ------------------------------------------------------------------------------------------------


def test_an_unexpected_key_error_says_what_failed(
    tmp_path: Path, capsys: Output, own_model: Callable[..., Path]
) -> None:
    """From a user's class, in a place that nothing guards."""
    path = own_model()
    path.write_text(
        path.read_text().replace(
            "    def output", "    @property\n    def traceable(self):\n        return {}['y']\n\n    def output"
        )
    )
    said = refused(["build", f"{path}:Trolley", "-o", str(tmp_path / "out")], capsys)
    assert f"fmus: unexpected KeyError: 'y' while building {path}:Trolley into {tmp_path / 'out'} ({path}:" in said


def test_words_for_errors_without_a_file_name() -> None:
    building = Namespace(names=["trolley"], output=Path("out"))
    full = in_words(OSError(28, "No space left on device"), building)
    assert full == "No space left on device, while building trolley into out"
    assert in_words(OSError(27, "File too large", "x.fmu"), building) == "x.fmu: File too large"
    assert in_words(IndexError("list index out of range"), building).startswith(
        "unexpected IndexError: list index out of range while"
    )
    assert in_words(UnknownRecipeError("There is no model 'x'."), building) == "There is no model 'x'."
    assert (
        in_words(RuntimeError(), Namespace(file=Path("a.fmu")))
        == "unexpected RuntimeError while reading a.fmu; please look there, or report it."
    )


# -- info on files that are no good
# -------------------------------------------------------------------------------------


def rewritten(source: Path, target: Path, change: Callable[[str, bytes], tuple[str, bytes] | None]) -> Path:
    """A copy of an FMU with files renamed, changed or left out."""
    with zipfile.ZipFile(source) as old, zipfile.ZipFile(target, "w") as new:
        for name in old.namelist():
            changed = change(name, old.read(name))
            if changed is not None:
                new.writestr(*changed)
    return target


@pytest.mark.compiler
def test_info_on_a_corrupt_archive(tmp_path: Path, capsys: Output) -> None:
    content = cached_fmu(recipe("odometer")).read_bytes()
    cut = tmp_path / "cut.fmu"
    cut.write_bytes(content[: len(content) // 2])
    assert "cut.fmu cannot be read as an FMU" in refused(["info", str(cut)], capsys)
    with zipfile.ZipFile(cached_fmu(recipe("odometer"))) as archive:
        start = archive.getinfo("sources/runtime.c").header_offset + 200
    flipped = tmp_path / "flipped.fmu"
    flipped.write_bytes(
        content[:start] + bytes(255 - byte for byte in content[start : start + 50]) + content[start + 50 :]
    )
    assert main(["info", str(flipped)]) == 1
    assert "problem: The archive is damaged" in capsys.readouterr().out


@pytest.mark.compiler
def test_info_on_an_fmu_for_another_platform(version: int, tmp_path: Path, capsys: Output) -> None:
    fmu = cached_fmu(recipe("odometer"), version)  # type: ignore[arg-type]
    foreign = "binaries/aarch64-solaris/odometer.so"
    elsewhere = rewritten(fmu, tmp_path / "e.fmu", lambda n, b: (foreign, b"") if n.startswith("binaries/") else (n, b))
    main(["info", str(elsewhere)])
    shown = capsys.readouterr().out
    assert re.search("platforms +aarch64-solaris", shown)
    assert re.search(r"this machine .*\) +no, it has no library for this platform", shown)
    assert "fmus compile" in shown
    main(["info", str(fmu)])
    assert re.search(r"this machine .*\) +yes", capsys.readouterr().out)


@pytest.mark.compiler
def test_info_sees_a_library_in_the_wrong_folder(version: int, tmp_path: Path, capsys: Output) -> None:
    fmu = cached_fmu(recipe("odometer"), version)  # type: ignore[arg-type]
    folder = {2: "win64", 3: "x86_64-windows"}[version]
    wrong = f"binaries/{folder}/odometer.dll"
    swapped = rewritten(fmu, tmp_path / "s.fmu", lambda n, b: (wrong, b) if n.startswith("binaries/") else (n, b))
    assert main(["info", str(swapped)]) == 1
    assert f"problem: {wrong} is a library for" in capsys.readouterr().out
