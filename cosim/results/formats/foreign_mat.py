"""MATLAB files as results: ours, trajectories of Modelica tools, vectors of equal length. Only reads the file it is
given.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import scipy

from cosim.errors import OutputError
from cosim.results.formats.about import with_about
from cosim.results.formats.columns import result_of_columns
from cosim.results.formats.format import Format
from cosim.results.formats.mat_file import MatFormat
from cosim.results.formats.modelica_file import ABOUT, LARGEST, split_description, write_modelica
from cosim.results.result_data import ResultData, SignalInfo
from cosim.results.table_layout import table_of

TEXTS = 3  # in ``dataInfo``: a text over time, in the matrix ``stringData``


def read_foreign_mat(path: Path) -> ResultData:
    """Read a MAT file of version 4 to 7: ours, a Modelica trajectory (``binTrans`` or ``binNormal``), or vectors with
    ``time``.

    Args:
        path: the file.

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
    return _vectors(str(path), content)


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
    descriptions = [split_description(text) for text in _texts(content["description"], transposed)]
    info = _rows_first(content["dataInfo"], transposed)
    constants = _rows_first(content["data_1"], transposed)
    start = constants[0] if len(constants) else np.zeros(0)  # nothing is constant
    data = _rows_first(content["data_2"], transposed).T
    limits = {0: len(data), 1: len(start), 2: len(data), TEXTS: LARGEST if "stringData" in content else 0}
    if not len(names) == len(descriptions) == len(info) or info.shape[1] < 2:
        counts = f"{len(names)} names, {len(descriptions)} descriptions, dataInfo {info.shape}"
        raise OutputError(f"{source}: the trajectory contradicts itself ({counts}).")
    for name, (table, place) in zip(names, info[:, :2].tolist(), strict=True):
        if not 1 <= abs(place) <= limits.get(table, 0):
            where = f"row {abs(place):g} of data_{table:g}"
            raise OutputError(f"{source}: variable {name!r} should be in {where}, which has no such row.")
    described = zip(names, descriptions, strict=True)
    signals = [SignalInfo(name, unit or "1", show, "continuous", text) for name, (text, unit, show) in described]
    about = _texts(content[ABOUT], True)[0] if ABOUT in content else None
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
    """A trajectory that `write_modelica` wrote: nothing is converted, nothing is left out."""
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


def _vectors(source: str, content: Mapping[str, Any]) -> ResultData:
    """All vectors as long as ``time``: a workspace, as from Simulink's *To Workspace* blocks saved as arrays."""
    arrays = {n: v for n, v in content.items() if isinstance(v, np.ndarray) and v.dtype.kind in "biuf" and v.ndim == 2}
    vectors = {n: v.ravel() for n, v in arrays.items() if 1 in v.shape}
    time = next((name for wanted in ("time", "t", "tout") for name in vectors if name.lower() == wanted), None)
    if time is None:
        held = ", ".join(f"{n} {np.shape(v)}" for n, v in content.items() if not n.startswith("__"))
        raise OutputError(f"{source}: there is no vector 'time'; it holds: {held or 'nothing'}.")
    kept = {n: v for n, v in vectors.items() if len(v) == len(vectors[time])}
    names = ["time" if name == time else name for name in kept]
    return result_of_columns(source, names, [np.asarray(v, np.float64) for v in kept.values()], {})


class ModelicaFormat(Format):
    """MAT 4 as Dymola and OpenModelica write it."""

    name = "modelica"
    endings = (".modelica.mat",)
    speed = -2

    @staticmethod
    def write(path: Path, result: ResultData) -> None:  # noqa: D102 - see Format
        write_modelica(path, result)

    @staticmethod
    def read(path: Path) -> ResultData:  # noqa: D102 - see Format
        return read_foreign_mat(path)
