"""What a run says before it starts: the gap it expects, the certified alternative, and spacings nobody expects."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from small_scenarios import small

from cosim import CosimError, Scenario
from cosim.balises.layout import InstantLayout, by_positions
from cosim.run.expected_gaps import expected_gap
from cosim.run.observer_findings import evaluate_observers
from cosim.scenario.scenario_tables import BalisesTable, ComponentTable
from fmu_observer import OBSERVERS
from fmu_observer.observers.evaluated_observer import OTHER_GAINS

POSITIONS = [50.0, 150.0, 250.0]


def warnings_of(observer: str, speed: float | None, **table: Any) -> list[str]:
    """Warnings for one observer over balises every 100 m, the first after 50 m."""
    balises = BalisesTable(
        position="p.position", speed="p.speed", layout="positions", positions=POSITIONS, expected_speed=speed
    )
    gap = expected_gap(by_positions(POSITIONS), balises, 0.0)
    return evaluate_observers(
        {"observer": ComponentTable(observer=observer, **table)}, {"observer": gap}, "warn", "here"
    )[1]


@pytest.mark.parametrize(
    ("observer", "table", "advice"),
    [
        ("differentiator_cdo", {}, "theta at most 0.4 is certified for 10 s"),
        ("multirate_cdo", {}, "theta_2 at most 0.4 is certified for 10 s"),
        (
            "takagi_sugeno_cdo",
            {},
            "innovation_decay = balise_gain_position = 0.8, balise_gain_speed = 0.16 and odometer gains of 0 are "
            "certified "
            "for 10 s",
        ),
    ],
)
def test_the_warning_names_the_nearest_certified_gains(observer: str, table: dict[str, Any], advice: str) -> None:
    (warning,) = warnings_of(observer, 10.0, **table)
    assert warning.endswith(
        f" Expected: 10 s (up to 100 m between balises or to the first one, at the expected 10 m/s). Instead: {advice}."
    )


def test_what_is_advised_is_certified() -> None:
    (warning,) = warnings_of("differentiator_cdo", 10.0)
    theta = float(warning.partition("theta at most ")[2].split()[0])
    assert warnings_of("differentiator_cdo", 10.0, parameters={"theta": theta}) == []
    assert warnings_of("differentiator_cdo", 10.0, parameters={"theta": 1.02 * theta}) != []


def test_a_decay_alone_is_advised_where_it_is_enough() -> None:
    scenario = small().set("balises.expected_speed", 3.0).set("observer.innovation_decay", 3.0)  # 1.5 m: 0.5 s
    warnings = scenario.run(overrides={"stop": 0.02}).warnings
    assert any("Instead: innovation_decay = 9.9 is certified for 0.5 s." in warning for warning in warnings)


def test_without_a_speed_it_says_from_which_speed_on_the_gains_are_enough() -> None:
    (warning,) = warnings_of("differentiator_cdo", None)
    assert "its gains are certified up to 0.5 s, enough for 100 m from 200 m/s on" in warning
    assert "give balises.expected_speed" in warning


def test_no_advice_is_reported_where_none_is_known_or_needed() -> None:
    (warning,) = warnings_of("discrete_uio", 10.0)
    assert "Instead" not in warning
    assert all(f.what != OTHER_GAINS for f in OBSERVERS["differentiator_cdo"]().findings(0.4))  # type: ignore[attr-defined]
    far = {
        "innovation_decay": 3.0,
        "balise_gain_position": 2.4,
        "balise_gain_speed": 0.0,
        "odometer_gain_position": 0.7,
        "odometer_gain_speed": 1.6,
    }
    assert warnings_of("takagi_sugeno_cdo", 10.0, parameters=far) == []


def test_an_adapting_observer_is_reported_when_the_layout_is_another() -> None:
    calm = {"assumed_acceleration": 0.3, "ratio": 2.0}
    (warning,) = warnings_of("adaptive_gain_cdo", 10.0, parameters=calm)
    assert warning.startswith(
        "observer: expects balises every 50 m within 0 %, but the layout has them 100 to 100 m apart"
    )
    assert warnings_of("adaptive_gain_cdo", 10.0, parameters=calm | {"expected_spacing": 100.0}) == []
    assert warnings_of("adaptive_gain_cdo", 10.0, parameters=calm, options={"spacing": "learnt"}) == []


def test_an_adapting_observer_is_advised_within_its_rule_and_else_a_constant_gain() -> None:
    hasty = {"expected_spacing": 100.0, "assumed_acceleration": 1.0, "ratio": 3.5}
    (warning,) = warnings_of("adaptive_gain_cdo", 10.0, parameters=hasty)
    assert "Instead: ratio = 2 and theta_min = 0.3 are certified for 10 s." in warning
    (warning,) = warnings_of("adaptive_gain_cdo", 2.0, parameters=hasty)
    assert "Instead: theta_min = theta_max = 0.08 is certified for 50 s." in warning


def test_only_distances_give_distances() -> None:
    table = BalisesTable(
        position="p.position", speed="p.speed", layout="instants", instants=[1.0, 2.5], expected_speed=None
    )
    gap = expected_gap(InstantLayout(np.array([1.0, 2.5])), table, 0.0)
    assert (gap.seconds, gap.distance, gap.spacings) == (1.5, None, None)
    alone = expected_gap(by_positions([30.0]), table, 0.0)
    assert (alone.distance, alone.spacings) == (30.0, None)


def test_two_balises_at_one_place_are_refused_in_words() -> None:
    with pytest.raises(CosimError, match="one at a place"):
        small().set("balises.positions", [1.0, 1.0]).run()


def test_the_adapting_observer_runs_over_balises_laid_by_distance() -> None:
    """A constant gain of 8 has lost the train by the end, the adapting one follows it to a centimetre a second."""
    errors = {}
    for observer, parameters in (
        ("adaptive_gain_cdo", {"expected_spacing": 15.0}),
        ("differentiator_cdo", {"theta": 8.0}),
    ):
        made: Scenario = small(certificates="ignore").set("stop", 40.0)
        made.set("observer.observer", observer).set("observer.parameters", {"estimated_speed": 9.0, **parameters})
        made.set("balises.positions", [15.0 * k for k in range(1, 25)])
        outcome = made.run()
        assert outcome.failure is None
        errors[observer] = abs(outcome["observer.speed"][-1] - outcome["locomotive.speed"][-1])
    assert errors["adaptive_gain_cdo"] < 0.01
    assert not errors["differentiator_cdo"] < 1.0


def test_balises_before_the_start_of_the_track_do_not_count() -> None:
    reported = {"position": "a.p", "speed": "a.v", "layout": "positions", "positions": [0.0, 900.0, 1000.0, 1300.0]}
    layout = by_positions(reported["positions"])
    whole = BalisesTable.model_validate(reported | {"expected_speed": 10.0})
    assert expected_gap(layout, whole, 0.0).seconds == 90.0
    later = BalisesTable.model_validate(reported | {"expected_speed": 10.0, "track_start": 950.0})
    assert expected_gap(layout, later, 0.0).seconds == 30.0
    assert expected_gap(layout, later, 0.0).spacings == (300.0, 300.0)
    behind = BalisesTable.model_validate(reported | {"expected_speed": 10.0, "track_start": 2000.0})
    assert "no balise lies behind" in expected_gap(layout, behind, 0.0).reason
