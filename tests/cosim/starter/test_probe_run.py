"""Two short runs are compared at the instants that both have, whatever events an FMU has in either."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from cosim.starter.probe_run import _at_common_instants, columns_of

GRID = np.arange(5.0)


def _ran(events: list[float]) -> dict[str, np.ndarray]:
    """Columns of a run: its step instants, and two rows of each of its events, of which the second counts."""
    time = np.sort(np.concatenate([GRID, events, events]))
    after = np.append(np.diff(time) > 0.0, True)
    values = {"plant.speed": np.where(after, 10.0 * time, np.nan)}

    class _Outcome(dict[str, Any]):
        result = SimpleNamespace(time=time)

    return dict(columns_of(_Outcome({"time": time, **values})))  # type: ignore[arg-type]


@given(st.lists(st.floats(0.0, 4.0), max_size=5, unique=True), st.lists(st.floats(0.0, 4.0), max_size=5, unique=True))
def test_events_of_either_run_change_nothing(one: list[float], other: list[float]) -> None:
    less, more = _at_common_instants(_ran(one), _ran(other))
    assert set(GRID) <= set(less["time"])
    for run in (less, more):
        np.testing.assert_array_equal(run["time"], less["time"])
        np.testing.assert_array_equal(run["speed"], 10.0 * less["time"])
