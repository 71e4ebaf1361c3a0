"""The adhesion-condition detector: its maps against the printed table, its rule, its debouncing."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from observer_runner import SystemRunner

from fmu_observer.detection import (
    AdhesionDetector,
    adhesion_map,
    condition_of,
    degraded_map,
    nominal_map,
    published_map,
)
from plant_models.railway.adhesion import POLACH_DRY, POLACH_WET

KMH = 1.0 / 3.6
SHARED = AdhesionDetector()
PRINTED = {  # Table 4.5: speed [km/h]: largest coefficient and optimal slip [%], nominal, then degraded
    5: (0.3894, 10.0, 0.2188, 30.4),
    10: (0.3474, 8.0, 0.1961, 20.0),
    20: (0.3027, 4.8, 0.1713, 14.4),
    30: (0.2769, 4.0, 0.1566, 12.0),
    40: (0.2594, 3.2, 0.1463, 9.6),
    50: (0.2449, 3.2, 0.1387, 7.2),
}


def detector(
    speed: float,
    slip: float,
    seconds: float = 5.0,
    definition: str = "odometer",
    preset: str = "polach",
    **parameters: float,
) -> SystemRunner:
    runner = SystemRunner(AdhesionDetector(definition), preset=preset, **parameters)  # type: ignore[arg-type]
    runner.set("u", {"speed": speed, "slip": slip})
    runner.runtime.start(0.0)
    runner.runtime.advance(seconds)
    return runner


def at_once(speed: float, filtered: float, preset: str = "polach") -> dict[str, float]:
    """Outputs for a filtered slip, without a run."""
    system = SHARED
    x, u = system.start_state(), np.array([0.0, speed])
    x[0] = filtered
    values = system.output_vector(0.0, x, u, system.start_parameters(preset))
    return dict(zip([s.name for s in system.outputs], map(float, values), strict=True))


@pytest.mark.parametrize("speed", PRINTED)
def test_the_maps_give_the_printed_table(speed: int) -> None:
    high, nominal, low, degraded = PRINTED[speed]
    # The printed slips lie on a grid of 0.8 % and two are truncated: 1.8 points; its peaks then are 0.6 % low at most.
    for found, peak, slip in ((nominal_map(), high, nominal), (degraded_map(), low, degraded)):
        at = int(np.argmin(np.abs(np.array(found.speeds) - speed * KMH)))
        assert found.speeds[at] == pytest.approx(speed * KMH, rel=1e-12)
        assert found.peaks[at] == pytest.approx(peak, rel=0.006)
        assert 100.0 * found.slips[at] == pytest.approx(slip, abs=1.8)
    for printed, peak, slip in ((published_map(False), high, nominal), (published_map(True), low, degraded)):
        at = int(np.argmin(np.abs(np.array(printed.speeds) - speed * KMH)))
        assert (printed.peaks[at], 100.0 * printed.slips[at]) == pytest.approx((peak, slip), rel=1e-12)


@settings(max_examples=40, deadline=None)
@given(speed=st.floats(1.0, 160.0), wet=st.booleans())
def test_between_its_points_the_detector_follows_the_curve(speed: float, wet: bool) -> None:
    curve = POLACH_WET if wet else POLACH_DRY
    slips = np.geomspace(1e-3, 3.0, 20001)  # to 0.04 %
    values = curve.coefficient(slips, speed * KMH)
    best = slips[np.flatnonzero((values[1:-1] > values[:-2]) & (values[1:-1] > values[2:]))[0] + 1]
    found = at_once(speed * KMH, 0.0)["degraded_optimum" if wet else "nominal_optimum"]
    # Linear between points a factor 2 to 1.1 apart; at most 4.4 % (1.5 km/h) and 4.9 % (wet, 55 km/h), of a dense scan.
    assert found == pytest.approx(best, rel=0.05)


def test_the_worked_example_of_the_thesis() -> None:
    runner = detector(5.0 * KMH, 0.35, definition="speed", preset="as_published")
    out = runner.outputs()
    assert 100.0 * abs(out["nominal_optimum"] - 0.35) == pytest.approx(25.0, abs=1e-9)
    assert 100.0 * abs(out["degraded_optimum"] - 0.35) == pytest.approx(4.6, abs=1e-9)
    assert (out["condition"], out["raw_condition"]) == (2.0, 2.0)
    assert out["adhesion_limit"] == pytest.approx(0.2188, abs=1e-12)


def test_slips_are_compared_on_one_denominator() -> None:
    """35 % of the odometer is 54 % of the train speed; 18 % is nominal as it stands and degraded once converted."""
    assert detector(5.0 * KMH, 0.35).state("filtered_slip") == pytest.approx(0.35 / 0.65, abs=1e-9)
    assert detector(5.0 * KMH, -1.0).state("filtered_slip") == pytest.approx(0.5, abs=1e-9)
    assert detector(5.0 * KMH, 0.18, definition="speed").outputs()["condition"] == 1.0
    assert detector(5.0 * KMH, 0.18).outputs()["condition"] == 2.0
    assert detector(5.0 * KMH, 1.0).state("filtered_slip") == pytest.approx(19.0, rel=1e-9)  # 0.95 / 0.05, the limit


@pytest.mark.parametrize("preset", ["polach", "as_published"])
def test_a_wheel_at_either_optimum_is_distinguished(preset: str) -> None:
    for speed in PRINTED:
        out = at_once(speed * KMH, 0.0, preset)
        for key, level in (("nominal_optimum", 1.0), ("degraded_optimum", 2.0)):
            assert at_once(speed * KMH, out[key], preset)["raw_condition"] == level


@given(slip=st.floats(0.0, 2.0), nominal=st.floats(0.01, 0.2), gap=st.floats(0.02, 0.5), alpha=st.floats(0.0, 0.015))
def test_the_rule_is_a_threshold(slip: float, nominal: float, gap: float, alpha: float) -> None:
    threshold = nominal + 0.5 * (gap - alpha)
    if abs(slip - threshold) > 1e-9:
        assert condition_of(slip, nominal, nominal + gap, alpha) == (1.0 if slip < threshold else 2.0)


def test_alpha_is_one_percent_by_default() -> None:
    # 9.1 + 15 = 24.1 % from the degraded optimum and 24.1 - 1 from the nominal one: just not nearer by more than alpha.
    assert condition_of(0.2, 0.1, 0.31, 0.01) == 2.0
    assert condition_of(0.2, 0.1, 0.312, 0.01) == 1.0
    assert AdhesionDetector().preset_values("polach").get("advantage", 0.01) == 0.01


@pytest.mark.parametrize(("seconds", "condition"), [(0.5, 1.0), (0.7, 2.0)])
def test_a_verdict_has_to_stand(seconds: float, condition: float) -> None:
    """0.5 s to stand, after 8 ms of filter: 54 % passes the 21 % that tell the two apart at once."""
    assert detector(5.0 * KMH, 0.35, seconds).outputs()["condition"] == condition


def test_a_broken_verdict_starts_again() -> None:
    runner = detector(10.0, 0.4, 0.45, slip_filter_time=0.01)
    for _ in range(4):
        for slip in (0.0, 0.4):
            runner.set("u", {"slip": slip})
            runner.runtime.advance(runner.runtime.t + 0.45)
    assert runner.outputs()["raw_condition"] == 2.0
    assert runner.outputs()["condition"] == 1.0


def test_at_rest_the_verdict_stays() -> None:
    runner = detector(10.0, 0.4)
    assert runner.outputs()["condition"] == 2.0
    runner.set("u", {"speed": 0.0, "slip": 0.0})
    runner.runtime.advance(10.0)
    assert runner.outputs()["raw_condition"] == 1.0
    assert runner.outputs()["condition"] == 2.0


def test_maps_are_of_any_curve_and_bad_ones_are_refused() -> None:
    # spec 5.1, continuous maximum
    assert adhesion_map(POLACH_DRY, (5.0 * KMH,)).slips[0] == pytest.approx(0.112, abs=5e-4)
    assert published_map(False).slips[0] == 0.10
    with pytest.raises(ValueError, match="positive speed"):
        adhesion_map(POLACH_DRY, (0.0,))
    with pytest.raises(ValueError, match="unknown slip_definition 'both'"):
        AdhesionDetector("both")  # type: ignore[arg-type]


def test_a_wheel_that_spins_without_bound_is_no_optimum() -> None:
    """At 160 km/h the coefficient at ten times the train speed is the largest of all; the map keeps the first peak."""
    fastest = nominal_map()
    assert POLACH_DRY.coefficient(10.0, 160.0 * KMH) > fastest.peaks[-1]
    assert fastest.slips[-1] < 0.02
    assert np.all(np.diff(fastest.slips) < 0.0)
    assert np.all(np.diff(degraded_map().slips) < 0.0)
