"""The balise list that travels with an FMU: found by URI and by path, read at instantiation, refused where it is
wrong.
"""

from __future__ import annotations

import shutil
import subprocess
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from c_hosts import Unpacked, Wiring, compile_host, run
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from cosim.balises.layout import from_csv
from cosim.errors import ScenarioError
from fmu_observer.block import make_block
from fmus import build_fmu, cached_fmu
from fmus.content.generate import GenerationError
from fmus.content.resources import resource_files
from plant_models import BaliseReader

pytestmark = pytest.mark.compiler

UNUSED = 1e30
ROOM = 4


@pytest.fixture(scope="module")
def loop(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The host program."""
    return compile_host("loop", tmp_path_factory.mktemp("resource"))


@pytest.fixture(scope="module")
def readers(tmp_path_factory: pytest.TempPathFactory) -> dict[int, Unpacked]:
    """A reader with room for four balises and two of its own, FMI 2 and FMI 3, in a folder whose name needs escapes."""
    folder = tmp_path_factory.mktemp("with space, 100 % and ü")
    system = BaliseReader(layout="positions", balise_capacity=ROOM, positions=(0.1 + 0.2, 7.0))
    return {v: Unpacked.of(cached_fmu(system, v), folder / str(v)) for v in (2, 3)}  # type: ignore[arg-type]


class Relocated(Unpacked):
    """An FMU whose folder of resources is told in another way."""

    location = ""

    @property
    def resources(self) -> str:
        return self.location


def _wiring(reader: Unpacked, location: str | None, folder: Path) -> tuple[Wiring, Path]:
    if location is not None:
        relocated = Relocated(reader.description, reader.folder, reader.library)
        relocated.location = location
        reader = relocated
    wiring = Wiring().slave("reader", reader).record(*(f"reader.positions[{i + 1}]" for i in range(ROOM)))
    return wiring, wiring.write(folder / "wiring.txt")


def positions(loop: Path, reader: Unpacked, folder: Path, location: str | None = None) -> list[float]:
    """The parameter after instantiation."""
    wiring, file = _wiring(reader, location, folder)
    run([str(loop), str(file), str(folder / "out.csv")])
    row = wiring.read(folder / "out.csv")[0]
    return [float(row[name]) for name in wiring.recorded]


def refusal(loop: Path, reader: Unpacked, folder: Path, location: str | None = None) -> str:
    """What an FMU says that cannot be instantiated."""
    _, file = _wiring(reader, location, folder)
    done = subprocess.run([str(loop), str(file), str(folder / "out.csv")], capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert "could not be instantiated" in done.stderr
    return done.stderr


def table(folder: Path, text: str | bytes) -> Path:
    """A folder of resources with a balise list."""
    place = folder / "own resources"
    place.mkdir(exist_ok=True)
    (place / "balises.csv").write_bytes(text.encode() if isinstance(text, str) else text)
    return place


@pytest.mark.parametrize("version", [2, 3])
def test_an_fmu_reads_what_it_was_built_with(
    version: int, loop: Path, readers: dict[int, Unpacked], tmp_path: Path
) -> None:
    assert (readers[version].folder / "resources" / "balises.csv").read_text() == "position\n0.30000000000000004\n7.0\n"
    assert positions(loop, readers[version], tmp_path) == [0.1 + 0.2, 7.0, UNUSED, UNUSED]


FORMS: dict[str, Callable[[Path], str]] = {
    "uri": lambda p: p.as_uri(),
    "uri with a slash": lambda p: p.as_uri() + "/",
    "uri with localhost": lambda p: p.as_uri().replace("file:///", "file://localhost/"),
    "uri with one slash": lambda p: p.as_uri().replace("file:///", "file:/"),
    "uri in capitals": lambda p: p.as_uri().replace("file:", "FILE:"),
    "small hexadecimals": lambda p: p.as_uri().replace("%2C", "%2c"),
    "uri that was not escaped": lambda p: f"file://{p}",
    "path": str,
    "path with a slash": lambda p: f"{p}/",
}


@pytest.mark.parametrize("version", [2, 3])
@pytest.mark.parametrize("form", FORMS)
def test_the_folder_is_found(form: str, version: int, loop: Path, readers: dict[int, Unpacked], tmp_path: Path) -> None:
    place = table(tmp_path, "position\n1\n2.5\n3e2\n")
    assert positions(loop, readers[version], tmp_path, FORMS[form](place)) == [1.0, 2.5, 300.0, UNUSED]


@pytest.mark.parametrize("location", ["", "file:///no/such/folder", "https://example.org/resources", "%zz"])
def test_without_a_file_the_start_values_stand(
    location: str, loop: Path, readers: dict[int, Unpacked], tmp_path: Path
) -> None:
    assert positions(loop, readers[2], tmp_path, location) == [0.1 + 0.2, 7.0, UNUSED, UNUSED]


RIGHT = [
    "position\n1\n2\n3\n4\n",
    "position\r\n1\r\n2\r\n",
    "\ufeffposition\n1\n\n2",
    'identity, position ,location_accuracy\n"A ""the first, by number"" of all", 1 ,5\nB,2,\n',
    "position\n-5.25e-1\n+.5\n",
    "position\n",
]


@pytest.mark.parametrize("text", RIGHT)
def test_what_the_master_reads_the_fmu_reads(
    text: str, loop: Path, readers: dict[int, Unpacked], tmp_path: Path
) -> None:
    place = table(tmp_path, text.replace(" position ", " position"))
    try:
        expected = from_csv(place / "balises.csv").positions.tolist()
    except ScenarioError:  # the master wants a balise at least; a reader without one hears nothing
        expected = []
    table(tmp_path, text)
    assert positions(loop, readers[3], tmp_path, str(place)) == [*expected, *[UNUSED] * (ROOM - len(expected))]


WRONG = {
    "": "line 1: the header has no column 'position'",
    "place\n1\n": "line 1: the header has no column 'position'",
    "position\n1\nhere\n": "line 3: 'here' in column 'position' is not a finite number",
    "position\n1\n1,5\n": "line 3: position 1 follows 1",
    "position\n0x10\n": "line 2: '0x10' in column",
    "position\nnan\n": "line 2: 'nan' in column",
    "position\n1e999\n": "line 2: '1e999' in column",
    "id,position\na,1\nb\n": "line 3: '' in column 'position'",
    "position\n5\n\n4\n": "line 4: position 4 follows 5; list them in increasing order, each once",
    "position\n1\n2\n3\n4\n5\n": "line 6: more rows than the 4 this FMU has room for",
    "position\n" + "1" * 3000: "line 2: longer than 1022 characters",
}


@pytest.mark.parametrize("version", [2, 3])
@pytest.mark.parametrize("text", WRONG)
def test_a_wrong_file_is_refused_by_name_and_line(
    text: str, version: int, loop: Path, readers: dict[int, Unpacked], tmp_path: Path
) -> None:
    place = table(tmp_path, text)
    said = refusal(loop, readers[version], tmp_path, str(place))
    assert f"{place / 'balises.csv'}, {WRONG[text]}" in said


def test_a_folder_in_place_of_the_file_is_refused(loop: Path, readers: dict[int, Unpacked], tmp_path: Path) -> None:
    (tmp_path / "balises.csv").mkdir()
    assert "balises.csv: cannot be read after line 0" in refusal(loop, readers[3], tmp_path, str(tmp_path))


def test_a_file_that_is_there_and_cannot_be_opened_is_refused(
    loop: Path, readers: dict[int, Unpacked], tmp_path: Path
) -> None:
    (tmp_path / "balises.csv").symlink_to("balises.csv")
    assert "balises.csv: cannot be opened: " in refusal(loop, readers[3], tmp_path, str(tmp_path))


@given(text=st.one_of(st.binary(max_size=80), st.text('position,"\n\r .1e+-9', max_size=80).map(str.encode)))
@settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_any_bytes_are_read_or_refused(text: bytes, loop: Path, readers: dict[int, Unpacked], tmp_path: Path) -> None:
    place = table(tmp_path, b"position\n" + text)
    _, file = _wiring(readers[3], str(place), tmp_path)
    done = subprocess.run([str(loop), str(file), str(tmp_path / "out.csv")], capture_output=True, check=False)
    assert done.returncode in (0, 1)
    assert done.returncode == 0 or b"balises.csv, line" in done.stderr


def test_a_reset_keeps_the_file_and_a_set_parameter_wins(
    readers: dict[int, Unpacked], handle: type[Any], tmp_path: Path
) -> None:
    folder = Path(shutil.copytree(readers[2].folder, tmp_path / "other"))
    (folder / "resources" / "balises.csv").write_text("position\n5\n", encoding="utf-8")
    one = handle(folder, folder)
    one.instantiate()
    one.set(**{"positions[1]": 3.0})
    assert one.get("positions[1]") == [3.0]
    one.slave.reset()
    assert one.get("positions[1]", "positions[2]").tolist() == [5.0, UNUSED]
    one.slave.freeInstance()


def test_the_block_has_the_values_of_the_file() -> None:
    system = BaliseReader(layout="positions", balise_capacity=ROOM, positions=(1.0, 2.0))
    block = make_block(system, fmi_version=2)
    starts = {v.name: v.start for v in block.model_description.modelVariables if v.name.startswith("positions")}
    assert [float(starts[f"positions[{i + 1}]"]) for i in range(ROOM)] == [1.0, 2.0, UNUSED, UNUSED]


def test_only_a_list_has_a_file(tmp_path: Path) -> None:
    with zipfile.ZipFile(build_fmu(BaliseReader(), tmp_path / "a.fmu")) as archive:
        assert not [name for name in archive.namelist() if name.startswith("resources/")]


@pytest.mark.parametrize("second", [1.0, 2.0])
def test_start_values_increase_each_listed_once(second: float) -> None:
    reader = BaliseReader(layout="positions", balise_capacity=ROOM)
    reader.presets = {"muddled": {"positions": (2.0, second, UNUSED, UNUSED)}}
    with pytest.raises(GenerationError, match=r"start values of positions must increase; balises\.csv lists them so"):
        resource_files(reader, "muddled")


def test_start_values_that_do_not_increase_cannot_go_into_a_file(tmp_path: Path) -> None:
    class Muddled(BaliseReader):
        presets = {"muddled": {"positions": (2.0, 1.0, UNUSED, UNUSED)}}  # noqa: RUF012

    with pytest.raises(GenerationError, match=r"start values of positions must increase; balises\.csv lists them so"):
        build_fmu(Muddled(layout="positions", balise_capacity=ROOM), tmp_path / "m.fmu", preset="muddled")
    assert list(tmp_path.iterdir()) == []
