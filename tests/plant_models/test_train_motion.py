"""The train's locomotive, track and signals: axles one by one, gradients under each vehicle, outputs that agree with
the flow.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from railway_runs import outputs, parameters, started
from train_runs import NO_DRAG, recorded, running, start

from plant_models.hybrid import HybridSystem, NumpyKernel, TracedKernel, state
from plant_models.hybrid.integration import effective_flow
from plant_models.railway.vehicle.train import Train

TRAIN = Train()
MASSES = np.array([90e3, 19e3, 19e3, 19e3, 19e3])


def _axles(now: dict[str, float], name: str) -> list[float]:
    return [now[f"{name}[{k + 1}]"] for k in range(4)]


def test_the_train_of_table_4_2_climbs_8_per_mille_with_13_kn_less() -> None:
    level, hill = (running(TRAIN, 10.0, 60e3, **NO_DRAG, **{"gradient[1]": slope}) for slope in (0.0, 0.008))
    for runtime in (level, hill):
        runtime.advance(10.0)
    assert outputs(hill)["gradient_force"] == pytest.approx(13.03e3, abs=5.0)  # 166 t * 9.81 * 0.008
    slower = (outputs(level)["speed"] - outputs(hill)["speed"]) / 10.0
    # 0.0785 m/s2 on 166 t without rotating masses; those of 4 axles take 1.6 %.
    assert slower == pytest.approx(0.0785 * 166e3 / (166e3 + 4 * 225.0 / 0.575**2), rel=2e-3)


def test_each_vehicle_feels_the_gradient_under_its_own_middle() -> None:
    slope = {"gradient[2]": 0.008, "gradient_position[2]": 500.0}
    middles = np.array([9.75, *(19.5 + 14.06 * (i + 0.5) for i in range(4))])
    for front in (509.0, 510.0, 526.0, 527.0, 540.0, 541.0, 554.0, 555.0, 568.0, 569.0):
        runtime = started(TRAIN, x0=start(TRAIN, 5.0, train_position=front), **slope)
        expected = MASSES[front - middles >= 500.0].sum() * 9.81 * 0.008
        assert outputs(runtime)["gradient_force"] == pytest.approx(expected, rel=1e-12, abs=1e-9)


@pytest.mark.parametrize(("front", "inside"), [(103.0, 0), (104.0, 1), (110.0, 2), (115.0, 3), (118.0, 4)])
def test_the_axles_enter_a_wet_zone_one_after_the_other(front: float, inside: int) -> None:
    # 3.3, 5.9, 13.6 and 16.2 m behind the front; the slips settle within milliseconds, the front moves by 3 cm.
    runtime = started(
        TRAIN,
        x0=start(TRAIN, 3.0, train_position=front),
        u0=[80e3, 0.0],
        **{"zone_from[1]": 100.0, "zone_to[1]": 200.0},
    )
    runtime.advance(0.01)
    # over the curves' first slopes
    before, wet = 80e3 / 4 / (22.5e3 * 9.81) / 16.848, 80e3 / 4 / (22.5e3 * 9.81) / 4.025
    slips = np.array(_axles(outputs(runtime), "axle_slip"))
    assert (slips[:inside] > 0.9 * wet).all()
    assert (slips[inside:] < 1.2 * before).all()
    assert outputs(runtime)["adhesion_degraded"] == float(inside > 0)


def test_axles_on_a_cleaned_rail_slip_less() -> None:
    shares = {f"axle_degraded[{k + 1}]": share for k, share in enumerate((1.0, 0.7, 0.4, 0.0))}
    runtime = running(TRAIN, 5.0, 100e3, **{"zone_from[1]": -100.0, "zone_to[1]": 1e6}, **shares)
    runtime.advance(1.0)
    slips = _axles(outputs(runtime), "axle_slip")
    assert slips == sorted(slips, reverse=True)
    assert slips[0] > 2.0 * slips[3]
    assert outputs(runtime)["slip"] == slips[0]
    assert outputs(runtime)["wheel_speed"] == outputs(runtime)["axle_speed[1]"]


def test_an_effort_for_one_axle_drives_that_axle_alone() -> None:
    train = Train(effort_per_axle=True)
    runtime = started(train, x0=start(train, 5.0), u0=[0.0, 30e3, 0.0, -20e3, 0.0])
    runtime.advance(0.5)
    slips = _axles(outputs(runtime), "axle_slip")
    assert slips[1] > 1e-3
    assert slips[3] < -1e-3
    assert abs(slips[0]) < 1e-4
    assert slips[0] == slips[2]


def test_four_equal_axles_with_a_quarter_of_the_inertia_are_one_axle() -> None:
    one = Train(axles=1)
    rows = []
    for train, preset in ((TRAIN, "table_4_2_one_axle"), (one, "table_4_2"), (one, "table_4_2_one_axle")):
        runtime = started(train, preset, x0=start(train, 2.0), u0=[100e3, 0.0])
        runtime.advance(3.0)
        rows.append([outputs(runtime)[name] for name in ("position", "speed", "wheel_speed", "coupler_force[4]")])
    assert rows[1] == rows[2]
    # The same equations; only where the step's guard against bends steps in, it sees four wheels or one.
    assert rows[0] == pytest.approx(rows[1], rel=1e-6)


SPEED = st.sampled_from([-3.0, -1e-3, 0.0, 1e-4, 0.3, 20.0])


@given(
    speeds=st.lists(SPEED, min_size=5, max_size=5),
    rates=st.lists(SPEED, min_size=4, max_size=4),
    elongations=st.lists(st.floats(-0.02, 0.02), min_size=4, max_size=4),
    pressures=st.lists(st.floats(0.0, 3.5e5), min_size=5, max_size=5),
    effort=st.sampled_from([-3e5, -5e3, 0.0, 2e3, 3e5]),
    gradient=st.floats(-0.03, 0.03),
)
def test_the_outputs_are_the_forces_the_integrator_uses(
    speeds: list, rates: list, elongations: list, pressures: list, effort: float, gradient: float
) -> None:
    x = np.array([7.0, *elongations, *speeds, *rates, *pressures, *[0.0] * 21])
    u, p = np.array([effort, 0.3]), parameters(TRAIN, **{"gradient[1]": gradient})
    derivative = effective_flow(TRAIN, 1.0, x, u, p, np.sign(x[TRAIN.friction_indices()]))
    now: dict[str, Any] = TRAIN.output(1.0, TRAIN.unpack_states(x), TRAIN.unpack_inputs(u), TRAIN.unpack_parameters(p))
    assert now["acceleration"] == pytest.approx(derivative[5], rel=1e-9, abs=1e-9)
    force = now["adhesion_force"] - now["resistance_force"] - now["gradient_force"] - now["wagon_brake_force"]
    assert force == pytest.approx(float(MASSES @ derivative[5:10]), rel=1e-9, abs=1e-5)


@pytest.mark.parametrize("wagons", [1, 8])  # that of twenty is traced in test_plants
def test_trains_of_one_and_of_many_wagons_run(wagons: int) -> None:
    runtime = running(Train(wagons=wagons), 0.0, 40e3)
    rows = recorded(runtime, np.array([1.0, 2.0]))
    assert np.isfinite(rows).all()
    assert outputs(runtime)["speed"] > 0.1
    assert len(runtime.x) == 2 + 2 * wagons + 4 + wagons + 1 + 1 + 5 * wagons


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"wagons": 0}, r"from 1 to 20, got 0\. For a locomotive alone use the model 'locomotive'"),
        ({"wagons": 21}, "from 1 to 20, got 21"),
        ({"wagons": 2.5}, r"whole number from 1 to 20, got 2\.5"),
        ({"axles": 2}, "4 axles, or 1 that stands for all; got axles = 2"),
        ({"effort_per_axle": "each"}, "effort_per_axle must be true or false, got 'each'"),
        ({"adhesion": "kalker"}, "unknown adhesion 'kalker'; choose one of: burckhardt, polach"),
        ({"zones": "day"}, "unknown zones 'day'"),
        ({"delay_samples": 0}, "delay_samples must be a whole number, 1 at least, got 0"),
    ],
)
def test_wrong_options_are_refused_in_words(options: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        Train(**options)


def test_the_start_values_of_a_rolling_train_have_no_slip_and_no_coupler_force() -> None:
    now = outputs(running(TRAIN, 12.0))
    assert _axles(now, "axle_slip") == pytest.approx([0.0] * 4, abs=1e-12)
    assert [now[f"coupler_force[{i}]"] for i in range(1, 5)] == [0.0] * 4
    assert [now[f"wagon_speed[{i}]"] for i in range(1, 5)] == [12.0] * 4
    assert _axles(now, "axle_speed") == pytest.approx([12.0] * 4, rel=1e-12)


# -- stiff states alone are implicit
# ------------------------------------------------------------------------------------


def test_plain_numpy_and_the_traced_step_agree_where_a_part_is_implicit() -> None:
    results = []
    for kernel in (NumpyKernel(TRAIN), TracedKernel(TRAIN)):
        kernel.x[:] = start(TRAIN, 0.4, **{"elongation[2]": 0.01})
        kernel.u[:] = [200e3, 0.5]
        kernel.grid_steps(0.0, 0, 12, 1e-3)
        results.append(kernel.x.copy())
    assert results[0] == pytest.approx(results[1], rel=1e-11, abs=1e-13)


def test_stiff_names_states_that_flow() -> None:
    class Faulty(HybridSystem):
        name = "faulty"
        states = (state("x", "m"),)
        stiff = ("y",)

        def flow(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
            return {"x": -x.x}

    with pytest.raises(ValueError, match=r"stiff names \['y'\]; expected names of continuous states"):
        Faulty()
