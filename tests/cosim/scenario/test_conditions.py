"""Conditions of observers before a run: what does not hold is told, and nothing is said of what ships."""

from __future__ import annotations

from pathlib import Path

import pytest

import cosim
from cosim import Scenario
from cosim.run.observer_findings import evaluate_observers

SHIPPED = sorted(path.stem for path in Path(cosim.__file__).parent.joinpath("scenarios").glob("*.toml"))


def windowed(rows: int, **tables: str) -> Scenario:
    scenario = Scenario(stop=0.1, step=0.05, **tables)
    options = {"model": "linear_pendulum", "window": rows}
    scenario.add("observer", observer="moving_horizon_observer", options=options, backend="block3")
    return scenario


def test_of_what_ships_one_printed_filter_alone_is_reported() -> None:
    """Its own page says that currents along d and q do not tell the angle: Allaoui 2024, rank 3 of 4."""
    reported = {
        name: warnings
        for name in SHIPPED
        if (warnings := evaluate_observers(Scenario.load(name).table().components, {}, "warn", name)[1])
    }
    assert list(reported) == ["traction_drive"]
    assert "filter: its condition DOES NOT HOLD" in reported["traction_drive"][0]
    assert "rank = 3, order = 4" in reported["traction_drive"][0]


def test_a_window_that_does_not_show_a_state_is_reported_before_the_run() -> None:
    """One row of the pendulum is its angle: the rate is known from earlier rows only. Two rows tell both."""
    heard: list[str] = []
    windowed(1).run(warn=heard.append)
    assert any("observer: A window of 1 full row shows 1" in text and "does not show rate" in text for text in heard)
    heard.clear()
    windowed(2).run(warn=heard.append)
    assert not any("report" in text and "window" in text for text in heard)


def test_it_may_be_required_or_left_aside() -> None:
    with pytest.raises(cosim.CosimError, match="does not show rate"):
        windowed(1, certificates="require").run()
    assert evaluate_observers(windowed(1).table().components, {}, "ignore", "here") == ({}, [])
