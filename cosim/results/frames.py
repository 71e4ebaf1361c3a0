"""A result of a pandas data frame. Touches no file."""

from __future__ import annotations

from typing import Any

import numpy as np

from cosim.errors import OutputError
from cosim.results.formats.columns import result_of_columns
from cosim.results.result import Result, SignalInfo


def from_pandas(frame: Any) -> Result:
    """A result of a data frame whose index or column ``time`` is in seconds.

    Args:
        frame: `pandas.DataFrame` of numbers; ``attrs["units"]`` and ``attrs["descriptions"]`` are used where they are.
            What is not in SI units is converted.

    Raises:
        OutputError: there is no ``time``, it goes backwards, or a column holds no numbers.
    """
    if frame.index.name is not None or not any(str(c).lower() in ("time", "t") for c in frame.columns):
        frame = frame.reset_index(names=frame.index.name or "time")
    names = [str(name) for name in frame.columns]
    units, descriptions = (frame.attrs.get(key, {}) for key in ("units", "descriptions"))
    columns = [_numbers(name, frame.iloc[:, place]) for place, name in enumerate(names)]
    return Result.of(
        result_of_columns(
            "the data frame",
            names,
            columns,
            {name: units.get(name) for name in names},
            lambda name: SignalInfo(name, description=descriptions.get(name, "")),
        )
    )


def _numbers(name: str, column: Any) -> np.ndarray:
    try:
        return np.asarray(column.to_numpy(dtype=np.float64, na_value=np.nan))
    except (TypeError, ValueError) as error:
        raise OutputError(f"the data frame: column {name!r} must hold numbers ({error}). Leave it out.") from error
