"""The result of a run, with what can be made of it: data frames, data sets, files."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, Self

import numpy as np

from cosim.results.declared_units import own_numbers
from cosim.results.result_data import BaliseRecord, PacketRecord, ResultData, SignalInfo
from cosim.results.save import save_result
from cosim.results.to_frames import events_to_pandas, to_pandas, to_xarray
from plant_models.hybrid.units import parse_unit

__all__ = ["BaliseRecord", "PacketRecord", "Result", "SignalInfo"]


@dataclass(frozen=True)
class Result(ResultData):
    """Everything a run leaves behind; see `cosim.results.result_data.ResultData`."""

    @classmethod
    def of(cls, data: ResultData) -> Self:
        """The result of data that were read.

        Args:
            data: as the readers of files return it.
        """
        return cls(**{field.name: getattr(data, field.name) for field in fields(ResultData)})

    def declared(self, name: str) -> np.ndarray:
        """Values of a signal in the unit in which its FMU counts, as the table of the results folder shows them, shape
        (rows,); in SI where that is the same. Indexing gives SI.

        Args:
            name: of the signal.

        Raises:
            KeyError: it was not recorded.
        """
        values, unit = self[name], None if name == "time" else self.info(name).declared_unit
        found = None if unit is None else own_numbers(values, parse_unit(unit))
        return values if found is None else found

    def to_pandas(self, signals: Iterable[str] | None = None) -> Any:
        """A `pandas.DataFrame`; see `cosim.results.to_frames.to_pandas`.

        Args:
            signals: names of those wanted; all by default.
        """
        return to_pandas(self, signals)

    def events_to_pandas(self) -> Any:
        """The telegrams as a `pandas.DataFrame`; see `cosim.results.to_frames.events_to_pandas`."""
        return events_to_pandas(self)

    def to_xarray(self, signals: Iterable[str] | None = None) -> Any:
        """An `xarray.Dataset`; see `cosim.results.to_frames.to_xarray`.

        Args:
            signals: names of those wanted; all by default.
        """
        return to_xarray(self, signals)

    def save(self, path: str | Path) -> list[Path]:
        """Write one file in the format that the ending of its name means; see `cosim.results.save.save_result`.

        Args:
            path: the file.

        Returns:
            The files written.
        """
        return save_result(self, path)
