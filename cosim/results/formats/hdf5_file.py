"""Results as HDF5, to the last bit: for MATLAB's ``h5read``, xarray, Julia. Touches only the file it is given.

A dataset each for ``time`` and every signal, in the unit that its FMU declares, with the attributes ``unit`` and
``units`` (the name xarray knows), ``si_unit`` where this is another one, ``variability``, ``description`` and, where
there is one, ``display_unit``; ``time`` is the dimension scale of all. The
group ``events`` holds the telegrams, a dataset each column. Summary and failure are attributes of the file, the summary
as JSON.
"""

from __future__ import annotations

import io
import json
import math
from collections.abc import Container, Sequence
from contextlib import AbstractContextManager
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np

from cosim.errors import OutputError
from cosim.results.declared_units import in_own_units, own_units
from cosim.results.formats.about import BLOCK, blocks, bring_to_si, signal_of_texts, signal_texts, signals_of
from cosim.results.formats.columns import result_of_columns
from cosim.results.formats.format import Format
from cosim.results.optional import optional_module
from cosim.results.record_rows import TELEGRAM_ROWS
from cosim.results.result_data import BaliseRecord, ResultData, SignalInfo
from cosim.results.summary_file import restored
from cosim.results.table_layout import table_of
from fmus.tables.plain_data import jsonable

LAYOUT = "fmu-observer result 1"
TIME, EVENTS = "time", "events"
CHUNK = 16384  # rows compressed together at most
FEW = 256  # rows that are not worth it


class _GuardedFile(AbstractContextManager["_GuardedFile"]):
    """A new binary file to write and read back, for ``h5py.File``.

    Args:
        path: of the file.

    Raises:
        OSError: it cannot be opened; or, when it is closed, it could not be written.
    """

    def __init__(self, path: str | Path) -> None:
        self._file = io.FileIO(path, "w+b")
        self.refusal: OSError | None = None

    def write(self, data: Any) -> int:
        """Write all of it, or remember why that failed.

        Args:
            data: bytes.
        """
        view = memoryview(data).cast("B")
        done = 0
        try:
            while done < len(view):
                done += self._file.write(view[done:]) or 0
        except OSError as error:
            self.refusal = self.refusal or error
            self._file.seek(len(view) - done, io.SEEK_CUR)
        return len(view)

    def readinto(self, buffer: Any) -> int:
        """Fill the buffer; what the disk did not take reads as zeros."""
        view = memoryview(buffer).cast("B")
        done = self._file.readinto(view) or 0
        while done < len(view) and (more := self._file.readinto(view[done:])):
            done += more
        view[done:] = bytes(len(view) - done)
        return len(view)

    def read(self, size: int = -1) -> bytes:
        """As of any file; by this h5py knows that it is one.

        Args:
            size: bytes at most; -1 for all.
        """
        return self._file.read(size) or b""

    def seek(self, offset: int, whence: int = io.SEEK_SET) -> int:
        """As of any file.

        Args:
            offset: [bytes].
            whence: from where on, as in `io`.
        """
        return self._file.seek(offset, whence)

    def tell(self) -> int:
        """As of any file."""
        return self._file.tell()

    def truncate(self, size: int | None = None) -> int:
        """As of any file.

        Args:
            size: [bytes]; None for the present place.
        """
        try:
            return self._file.truncate(size)
        except OSError as error:
            self.refusal = self.refusal or error
            return self._file.tell() if size is None else size

    def flush(self) -> None:
        """Nothing is held back."""

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._file.close()
        if self.refusal is not None:
            raise self.refusal


def _h5py() -> Any:
    return optional_module("h5py", "HDF5 files")


def _columns(file: Any, rows: int, chunk: int, signals: Sequence[SignalInfo], own: Container[str]) -> list[Any]:
    """Empty datasets of time and signals, `chunk` rows compressed together; of some in their own units."""
    storage = (
        {"chunks": (min(rows, chunk),), "compression": "gzip", "compression_opts": 1, "shuffle": True}
        if rows > FEW
        else {}
    )
    time = file.create_dataset(TIME, (rows,), "f8", **storage)
    time.make_scale(TIME)
    time.attrs.update({"unit": "s", "units": "s", "description": "time"})
    datasets, taken = [time], {TIME, EVENTS}
    for place, signal in enumerate(signals):
        name = _dataset_name(signal.name, taken)
        dataset = file.create_dataset(name, (rows,), "f8", **storage)
        dataset.dims[0].attach_scale(time)
        texts = signal_texts(signal, signal.name in own)
        texts |= {"units": texts["unit"], "long_name": signal.description}  # as xarray calls them
        dataset.attrs.update({key: text for key, text in texts.items() if text or key == "description"})
        dataset.attrs["column"] = place
        if name != signal.name:
            dataset.attrs["name"] = signal.name
        datasets.append(dataset)
    return datasets


def _dataset_name(name: str, taken: set[str]) -> str:
    """A name that HDF5 takes: a slash would make a group, and ``.`` is the group itself."""
    plain = name.replace("/", "|") if name.strip(".") else f"signal {name}".rstrip()
    while plain in taken:
        plain += "_"
    taken.add(plain)
    return plain


def _write_events(group: Any, events: Sequence[BaliseRecord]) -> None:
    text = _h5py().string_dtype()
    rows = [TELEGRAM_ROWS.row(event) for event in events]
    for name in TELEGRAM_ROWS.columns:
        kind = "f8" if name in TELEGRAM_ROWS.numbers else text
        group.create_dataset(name, data=[row[name] for row in rows], dtype=kind, shape=(len(rows),))


def _ours(file: Any) -> ResultData:
    found = [dataset for name, dataset in file.items() if name not in (TIME, EVENTS)]
    datasets = sorted(found, key=lambda dataset: int(dataset.attrs["column"]))
    texts = {_name(dataset): {key: _text(value) for key, value in dataset.attrs.items()} for dataset in datasets}
    signals = [signal_of_texts(name, says) for name, says in texts.items()]
    columns = [dataset[:] for dataset in (file[TIME], *datasets)]
    table = bring_to_si(table_of([TIME, *texts], columns), texts)
    stored = {name: file[EVENTS][name] for name in TELEGRAM_ROWS.columns}
    cells = {n: (c if n in TELEGRAM_ROWS.numbers else c.asstr())[:].tolist() for n, c in stored.items()}
    events = TELEGRAM_ROWS.records(cells)
    summary = {"events_recorded": True, **restored(json.loads(file.attrs["summary"]))}
    return ResultData(table, signals, events, summary, _text(file.attrs.get("failure")))


def _name(dataset: Any) -> str:
    return _text(dataset.attrs.get("name")) or dataset.name.removeprefix("/")


def _text(value: Any) -> str | None:
    """An attribute as text: other tools write bytes, or arrays of one text."""
    if isinstance(value, np.ndarray):
        value = value.ravel()[0] if value.size == 1 else None
    return value.decode("utf-8", "replace") if isinstance(value, bytes) else None if value is None else str(value)


def _foreign(source: str, file: Any) -> ResultData:
    """Vectors as long as that of time, wherever they are; text and matrices are left out."""
    vectors: dict[str, Any] = {}

    def collect(name: str, item: Any) -> None:
        shape = getattr(item, "shape", None)
        if shape and math.prod(shape) == max(shape) and item.dtype.kind in "biuf":
            vectors[name.replace("/", ".")] = item

    file.visititems(collect)
    named = [name for name in vectors if name.rpartition(".")[2].lower() in ("time", "t")]
    time = min(named, key=lambda name: (name.count("."), len(name) == 1), default="")
    if not time:
        held = ", ".join(list(vectors)[:8]) or "no vectors of numbers"
        raise OutputError(f"{source}: there is no vector 'time'; it holds: {held}.")
    kept = {name: item for name, item in vectors.items() if item.size == vectors[time].size}
    names = ["time" if name == time else name for name in kept]
    units = {name: _unit(item.attrs) for name, item in zip(names, kept.values(), strict=True)}
    columns = [np.asarray(item[()], np.float64).ravel() for item in kept.values()]
    return result_of_columns(source, names, columns, units)


def _unit(attributes: Any) -> str | None:
    return next((_text(attributes[key]) for key in ("units", "unit", "UNIT") if key in attributes), None)


class Hdf5Format(Format):
    """HDF5, as SDF reads it."""

    name = "hdf5"
    endings = (".h5", ".hdf5")
    speed = 1
    package = "h5py"

    @staticmethod
    def write(path: Path, result: ResultData) -> None:  # noqa: D102 - see Format
        signals, own = signals_of(result), own_units(result.table, result.signals)
        chunk = min(CHUNK, max(BLOCK // result.table.dtype.itemsize, 1))
        options = {"libver": ("v108", "latest"), "rdcc_nbytes": 8 * chunk}  # it keeps so much of each column
        h5py = _h5py()
        with _GuardedFile(path) as target, h5py.File(target, "w", **options) as file:
            file.attrs["layout"] = LAYOUT
            file.attrs["summary"] = json.dumps(jsonable(result.summary), ensure_ascii=False, allow_nan=False)
            if result.failure is not None:
                file.attrs["failure"] = result.failure
            datasets = _columns(file, len(result.table), chunk, signals, own)
            for start, kept in blocks(result.table):
                rows = in_own_units(kept, own)
                for field, dataset in zip(result.table.dtype.names or (), datasets, strict=True):
                    dataset[start : start + len(rows)] = rows[field]
            _write_events(file.create_group(EVENTS), result.events)

    @staticmethod
    def read(path: Path) -> ResultData:  # noqa: D102 - see Format
        h5py = _h5py()
        try:
            with h5py.File(path, "r") as file:
                return _ours(file) if _text(file.attrs.get("layout")) == LAYOUT else _foreign(str(path), file)
        except OSError as error:
            if path.is_file():
                raise ValueError(f"{path} is not an HDF5 file that can be read: {error}") from error
            raise
