"""A mode that an FMU enters while a filter runs, and keeps, is found although the check before the run did not see
it.
"""

from __future__ import annotations

from pathlib import Path

import lying_fmus
import pytest

from cosim.fmu_filter.component import FmuFilterModel
from cosim.fmu_filter.settings import FilterTable
from cosim.fmu_filter.shadow import EVERY
from cosim.fmu_model.sealed import FmuModelError

H = 0.01


def _forced(filter_: FmuFilterModel, steps: range, highest: float) -> list[dict[str, float]]:
    """Steps with a force of 1, and the highest one for some steps from the twentieth on."""
    inputs = {signal.name: 0.0 for signal in filter_.inputs} | {"measured_speed": 1.0}
    return [filter_.step(k * H, inputs | {"force": highest if 20 <= k < 25 else 1.0}, H) for k in steps]


def _made(path: Path, kind: str = "ekf") -> FmuFilterModel:
    table = {"kind": kind, "measurements": {"speed": 0.5}, "start_deviation": {"speed": 1.0}}
    return FmuFilterModel(path, FilterTable.model_validate(table))


@pytest.mark.parametrize("kind", ["ekf", "ukf"])
def test_a_latch_is_found_by_the_next_comparison(kind: str, tmp_path: Path) -> None:
    path = lying_fmus.build(tmp_path, "LATCHES")
    filter_ = _made(path, kind)
    _forced(filter_, range(20), 6.0)
    with pytest.raises(
        FmuModelError, match=r"started again from its states .* at t = 0\.3 s, .* \(samples, delays, modes\)"
    ):
        _forced(filter_, range(20, 20 + 2 * EVERY), 6.0)
    _forced(_made(path, kind), range(60), 4.0)  # never latched, it is as honest as any


def test_the_undisturbed_run_goes_back_with_the_filter(tmp_path: Path) -> None:
    filter_ = _made(lying_fmus.build(tmp_path))
    _forced(filter_, range(17), 6.0)
    state = filter_.get_state()
    once = _forced(filter_, range(17, 45), 6.0)
    filter_.set_state(state)
    assert _forced(filter_, range(17, 45), 6.0) == once
    assert filter_._shadow is not None


def test_what_does_not_save_its_state_is_compared_until_it_goes_back(tmp_path: Path) -> None:
    filter_ = _made(lying_fmus.build(tmp_path, xml=lying_fmus.description(slave={})))
    _forced(filter_, range(15), 6.0)
    assert filter_._shadow is not None
    filter_.set_state(filter_.get_state())
    assert filter_._shadow is None
    _forced(filter_, range(15, 45), 6.0)
