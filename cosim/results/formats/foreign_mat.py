"""MATLAB files as results: ours, trajectories of Modelica tools, vectors of equal length; and results as such a
trajectory. Touches only the file it is given.
"""

from __future__ import annotations

import json
import math
import struct
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
import scipy

from cosim.errors import OutputError
from cosim.results.formats.about import about_text, blocks, signals_of, with_about
from cosim.results.formats.columns import numbered, result_of_columns
from cosim.results.formats.format import Format
from cosim.results.formats.mat_file import MatFormat
from cosim.results.result_data import ResultData, SignalInfo
from cosim.results.table_layout import column_names, table_of

TEXTS = 3  # in ``dataInfo``: a text over time, in the matrix ``stringData``


_ACLASS = [text.ljust(11) for text in ("Atrajectory", "1.1", "", "binTrans")]  # OpenModelica wants it so to the byte
_ABOUT = "fmu_observer"
_TEXT, _INTEGERS, _DOUBLES = 51, 20, 0  # types of a matrix: little-endian; letters are bytes of UTF-8
_LARGEST = 2**31 - 1


def _write_modelica(path: str | Path, result: ResultData) -> None:
    """Write a result; a table larger than the memory is written block by block."""
    names = column_names(result.table)
    if len(result.table) > _LARGEST:
        raise ValueError(
            f"A Modelica trajectory holds at most {_LARGEST} rows, got {len(result.table)}. Use another format."
        )
    signals = signals_of(result)
    parameters = _parameters(result.summary, names)
    with Path(path).open("wb") as file:
        _matrix(file, "Aclass", _TEXT, np.array([list(text) for text in _ACLASS], "S1"))
        _text_matrix(file, "name", [*names, *parameters])
        _text_matrix(file, "description", ["Time [s]", *map(_description, signals), *[""] * len(parameters)])
        _matrix(file, "dataInfo", _INTEGERS, _data_info(len(names), len(parameters)))
        ends = _ends(result.table)
        _matrix(file, "data_1", _DOUBLES, np.array([ends, *([value] * 2 for value in parameters.values())]))
        _header(file, "data_2", _DOUBLES, len(names), len(result.table))
        for _, rows in blocks(result.table):
            file.write(np.ascontiguousarray(rows).tobytes())
        more = {"signals": [asdict(signal) for signal in signals], "about": about_text(result)}
        _text_matrix(file, _ABOUT, [json.dumps(more, ensure_ascii=False)])


def _parameters(summary: Mapping[str, Any], taken: Iterable[str]) -> dict[str, float]:
    """Start values of the components by ``component.parameter``, but for those that have a column."""
    found: dict[str, float] = {}
    for component in summary.get("components", ()):
        for name, value in (component.get("parameters") or {}).items():
            if isinstance(value, (bool, int, float)) and not math.isnan(value):  # OpenModelica takes NaN for a change
                found[f"{component['name']}.{name}"] = float(value)
    known = set(taken)
    return {name: value for name, value in found.items() if name not in known}


def _ends(table: np.ndarray) -> list[float]:
    return [float(table["time"][0]), float(table["time"][-1])] if len(table) else [0.0, 0.0]


def _data_info(columns: int, parameters: int) -> np.ndarray:
    """For each name: matrix (0 for time), row in it, linear interpolation, and what holds outside: nothing, or the
    value.
    """
    rows = [
        (0, 1, 0, -1),
        *((2, i + 1, 0, -1) for i in range(1, columns)),
        *((1, i + 2, 0, 0) for i in range(parameters)),
    ]
    return np.array(rows, np.int32).T


def _description(signal: SignalInfo) -> str:
    unit = signal.unit if signal.display_unit is None else f"{signal.unit}|{signal.display_unit}"
    if unit == "1" and not signal.description.endswith("]"):
        return signal.description
    return f"{signal.description} [{unit}]" if signal.description else f"[{unit}]"


def _split_description(text: str) -> tuple[str, str | None, str | None]:
    """Description, unit and display unit of a description in such a file, e.g. ``Mass of the train [kg]``.

    Dymola puts types in too, ``[:#(type=Boolean)]``, which are left out.
    """
    start = text.rfind("[")
    if start < 0 or not text.endswith("]"):
        return text, None, None
    unit, _, display = text[start + 1 : -1].partition(":#")[0].partition("|")
    return text[:start].removesuffix(" "), unit or None, display or None


def _text_matrix(file: BinaryIO, name: str, texts: Sequence[str]) -> None:
    """Texts filled up with NUL, each a column."""
    encoded = [text.encode() for text in texts]
    width = max(map(len, encoded)) + 1  # one NUL at least: then trailing spaces are part of a text
    _header(file, name, _TEXT, width, len(texts))
    file.write(b"".join(text.ljust(width, b"\0") for text in encoded))


def _matrix(file: BinaryIO, name: str, kind: int, values: np.ndarray) -> None:
    _header(file, name, kind, *values.shape)
    file.write(values.tobytes(order="F"))


def _header(file: BinaryIO, name: str, kind: int, rows: int, columns: int) -> None:
    file.write(struct.pack("<5i", kind, rows, columns, 0, len(name) + 1) + name.encode() + b"\0")


def read_foreign_mat(path: Path, *, texts: bool = False) -> ResultData:
    """Read a MAT file of version 4 to 7: ours, a Modelica trajectory (``binTrans`` or ``binNormal``), or vectors with
    ``time``.

    Args:
        path: the file. texts: whether vectors of texts are taken, see `cosim.results.load_result.load_result`; else
            they are left out, as whatever else a workspace holds.

    Raises:
        OutputError: it is none of these; the message says what it holds.
        ValueError: the file is broken. OSError: it cannot be read.
    """
    try:
        with path.open("rb") as file:
            content = scipy.io.loadmat(file, chars_as_strings=False)
    except Exception as error:  # whatever a broken file leads SciPy into: a dozen kinds were seen
        if isinstance(error, OSError) and error.errno is not None:
            raise
        hint = "It must be a MAT file of version 4 to 7 (in MATLAB: save ... -v7)."
        raise OutputError(f"{path} is not a MAT file that can be read: {error}. {hint}") from error
    if "Aclass" in content:
        return _trajectory(str(path), content)
    if "signals" in content and "events" in content:
        result = MatFormat.read(path)
        return replace(result, summary={"events_recorded": True, **result.summary})
    return _vectors(str(path), content, texts)


# --- trajectories -----------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class _Trajectory:
    """The matrices of a trajectory of version 1.1, one variable a row.

    Args:
        signals: the variables. info: matrix and place of each, shape (variables, 4). start: values at the start, of
            ``data_1``.
        data: values over time, of ``data_2``. about: what we put into files of ours.
    """

    signals: list[SignalInfo]
    info: np.ndarray
    start: np.ndarray
    data: np.ndarray
    about: str | None


def _trajectory(source: str, content: Mapping[str, Any]) -> ResultData:
    """The result of a trajectory, of whatever version and order."""
    kind = [text.strip() for text in _texts(content["Aclass"], transposed=False)]
    transposed = kind[3:4] != ["binNormal"]
    if kind[:1] == ["Atrajectory"] and {"names", "data"} <= content.keys():  # version 1.0: plots exported by Dymola
        columns = list(np.asarray(_rows_first(content["data"], transposed).T, np.float64))
        return result_of_columns(source, _texts(content["names"], transposed), columns, {})
    lacking = [n for n in ("name", "description", "dataInfo", "data_1", "data_2") if n not in content]
    if kind[:1] != ["Atrajectory"] or lacking:
        what = f"it lacks {', '.join(lacking)}" if lacking else f"it says {kind[:2]}"
        raise OutputError(f"{source}: expected a trajectory as Dymola and OpenModelica write it; {what}.")
    trajectory = _matrices(source, content, transposed)
    return _foreign(source, trajectory) if trajectory.about is None else _ours(trajectory, trajectory.about)


def _matrices(source: str, content: Mapping[str, Any], transposed: bool) -> _Trajectory:
    names = _texts(content["name"], transposed)
    descriptions = [_split_description(text) for text in _texts(content["description"], transposed)]
    info = _rows_first(content["dataInfo"], transposed)
    constants = _rows_first(content["data_1"], transposed)
    start = constants[0] if len(constants) else np.zeros(0)  # nothing is constant
    data = _rows_first(content["data_2"], transposed).T
    limits = {0: len(data), 1: len(start), 2: len(data), TEXTS: _LARGEST if "stringData" in content else 0}
    if not len(names) == len(descriptions) == len(info) or info.shape[1] < 2:
        counts = f"{len(names)} names, {len(descriptions)} descriptions, dataInfo {info.shape}"
        raise OutputError(f"{source}: the trajectory contradicts itself ({counts}).")
    for name, (table, place) in zip(names, info[:, :2].tolist(), strict=True):
        if not 1 <= abs(place) <= limits.get(table, 0):
            where = f"row {abs(place):g} of data_{table:g}"
            raise OutputError(f"{source}: variable {name!r} should be in {where}, which has no such row.")
    described = zip(names, descriptions, strict=True)
    signals = [SignalInfo(name, unit or "1", show, "continuous", text) for name, (text, unit, show) in described]
    about = _texts(content[_ABOUT], True)[0] if _ABOUT in content else None
    return _Trajectory(signals, info[:, :2].astype(int), start, data, about)


def _foreign(source: str, trajectory: _Trajectory) -> ResultData:
    """Variables over time become columns, aliases with their sign; what is constant goes to ``summary["parameters"]``.

    Texts over time, which OpenModelica knows since 2026, are left out.
    """
    columns: dict[str, np.ndarray] = {}
    parameters: dict[str, np.ndarray] = {}
    for signal, (table, place) in zip(trajectory.signals, trajectory.info.tolist(), strict=True):
        if table == TEXTS:
            continue
        values = (trajectory.start if table == 1 else trajectory.data)[abs(place) - 1]
        signed = np.asarray(values, np.float64) * np.sign(place)
        (parameters if table == 1 else columns)[signal.name] = signed
    known = {signal.name: signal for signal in trajectory.signals}
    units = {name: known[name].unit if known[name].unit != "1" else None for name in columns}
    result = result_of_columns(source, list(columns), list(columns.values()), units, lambda name: known[name])
    return replace(result, summary={"parameters": {name: float(value) for name, value in parameters.items()}})


def _ours(trajectory: _Trajectory, about: str) -> ResultData:
    """A trajectory that `_write_modelica` wrote: nothing is converted, nothing is left out."""
    more = json.loads(about)
    signals = [SignalInfo(**signal) for signal in more["signals"]]
    table = table_of(["time", *(s.name for s in signals)], list(trajectory.data))
    return with_about(table, signals, more["about"])


def _rows_first(matrix: np.ndarray, transposed: bool) -> np.ndarray:
    return np.asarray(matrix.T if transposed else matrix)


def _texts(letters: np.ndarray, transposed: bool) -> list[str]:
    """Texts of a matrix of letters, each a column where `transposed`: bytes of UTF-8, filled up with NUL or spaces."""
    rows = np.atleast_2d(letters.T if transposed else letters)
    texts = ["".join(letter or "\0" for letter in row) for row in rows.tolist()]
    filled = any("\0" in text for text in texts)
    return [_decoded(text.rstrip("\0") if filled and transposed else text.rstrip("\0 ")) for text in texts]


def _decoded(text: str) -> str:
    try:
        return text.encode("latin-1").decode("utf-8")
    except UnicodeError:
        return text


# --- vectors ----------------------------------------------------------------------------------------------------------


def _vectors(source: str, content: Mapping[str, Any], texts: bool) -> ResultData:
    """All vectors as long as ``time``: a workspace, as from Simulink's *To Workspace* blocks saved as arrays."""
    arrays = {n: v for n, v in content.items() if isinstance(v, np.ndarray) and v.dtype.kind in "biuf" and v.ndim == 2}
    vectors = {n: v.ravel() for n, v in arrays.items() if 1 in v.shape}
    time = next((name for wanted in ("time", "t", "tout") for name in vectors if name.lower() == wanted), None)
    if time is None:
        held = ", ".join(f"{n} {np.shape(v)}" for n, v in content.items() if not n.startswith("__"))
        raise OutputError(f"{source}: there is no vector 'time'; it holds: {held or 'nothing'}.")
    kept = {n: np.asarray(v, np.float64) for n, v in vectors.items() if len(v) == len(vectors[time])}
    rows = {n: _text_rows(v) for n, v in content.items() if isinstance(v, np.ndarray)} if texts else {}
    said = {n: numbered(found) for n, found in rows.items() if found and len(found) == len(vectors[time])}
    kept |= {n: numbers for n, (numbers, _) in said.items()}
    names = ["time" if name == time else name for name in kept]
    return result_of_columns(source, names, list(kept.values()), {}, texts={n: items for n, (_, items) in said.items()})


def _text_rows(found: np.ndarray) -> list[str | None]:
    """The rows of a cell array of texts, or of a matrix of letters, whose rows MATLAB fills up with spaces; nothing
    where it is neither. An empty cell is no text.
    """
    if found.dtype.kind == "U" and found.ndim == 2:
        return ["".join(row).rstrip() or None for row in found.tolist()]
    cells = found.ravel().tolist() if found.dtype.kind == "O" and found.ndim == 2 and 1 in found.shape else []
    letters = [np.asarray(cell) for cell in cells]
    if not all(cell.dtype.kind == "U" or not cell.size for cell in letters):
        return []
    return ["".join(map(str, cell.ravel().tolist())) or None for cell in letters]


class ModelicaFormat(Format):
    """MAT 4 as Dymola and OpenModelica write it."""

    name = "modelica"
    endings = (".modelica.mat",)
    speed = -2

    @staticmethod
    def write(path: Path, result: ResultData) -> None:  # noqa: D102 - see Format
        _write_modelica(path, result)

    @staticmethod
    def read(path: Path) -> ResultData:  # noqa: D102 - see Format
        return read_foreign_mat(path)
