"""The exported FMU computes what the Python runtime computes, in FMI 2 and in FMI 3."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from fmpy import read_model_description, simulate_fmu
from fmpy.validation import validate_fmu

from fmus import cached_fmu
from plant_models.hybrid import HybridSystem

pytestmark = pytest.mark.compiler

AGREEMENT = 1e-12
"""Python and C do the same operations in the same order; the room is for a C library whose `sin` or `exp` rounds
differently.
"""


def test_every_fmu_is_valid(system: HybridSystem, version: int) -> None:
    assert validate_fmu(str(cached_fmu(system, version))) == []  # type: ignore[arg-type]


@pytest.fixture
def pair(
    version: int, component: Callable[..., Any], reference: Callable[[str], Any]
) -> Callable[[str], tuple[Any, Any]]:
    """The reference of a system and its FMU, by name."""
    return lambda name: (reference(name), component(name, version))


def test_fmu_and_runtime_agree(
    system_name: str, pair: Callable[[str], tuple[Any, Any]], drive: Callable[..., np.ndarray]
) -> None:
    expected, made = pair(system_name)
    expected.initialize()
    made.initialize()
    h = min(0.013, 13.0 * _shortest_period(expected.system))
    wanted, got = drive(expected, h, 200), drive(made, h, 200)
    assert np.isfinite(wanted).all()
    assert np.ptp(wanted, axis=0).max(initial=1.0) > 0.0  # something moved
    np.testing.assert_allclose(got, wanted, rtol=AGREEMENT, atol=AGREEMENT)


def _shortest_period(system: HybridSystem) -> float:
    """Of the periodic events [s]; the runtime in Python takes its time for each of them."""
    p = system.unpack_parameters(system.start_parameters())
    return min((float(getattr(p, event.period)) for event in system.periodic_events), default=np.inf)


@pytest.mark.parametrize("name", ["oscillator", "slider", "sampler", "tracker"])
@pytest.mark.parametrize("first", [100, 10**8])  # from 1.3 s, and from 1.3e6 s where times have gaps of 2e-10 s
def test_agreement_is_bit_for_bit_from_a_late_start(
    name: str, first: int, pair: Callable[[str], tuple[Any, Any]], drive: Callable[..., np.ndarray]
) -> None:
    # These use + - * / and the C library's sin, cos, log, sqrt, which Python's math and CasADi call as well.
    expected, made = pair(name)
    expected.initialize(0.013 * first)
    made.initialize(0.013 * first)
    np.testing.assert_array_equal(drive(made, 0.013, 300, first), drive(expected, 0.013, 300, first))


def test_fmpy_simulates_it(system: HybridSystem, version: int) -> None:
    result = simulate_fmu(str(cached_fmu(system, version)), stop_time=0.5, output_interval=0.05)  # type: ignore[arg-type]
    assert len(result) == 11
    assert all(np.isfinite(result[name]).all() for name in result.dtype.names)


def test_preset_gives_the_start_values(version: int, reference: Callable[[str], Any]) -> None:
    system = reference("oscillator").system
    fmu = cached_fmu(system, version, preset="soft")  # type: ignore[arg-type]
    assert fmu != cached_fmu(system, version)  # type: ignore[arg-type]
    starts = {v.name: v.start for v in read_model_description(str(fmu)).modelVariables}
    assert (float(starts["stiffness"]), float(starts["position"]), float(starts["damping"])) == (4.0, 2.0, 0.5)


def test_parameters_and_start_states_can_be_set(
    version: int, component: Callable[..., Any], reference: Callable[[str], Any], drive: Callable[..., np.ndarray]
) -> None:
    expected, made, plain = reference("oscillator"), component("oscillator", version), component("oscillator", version)
    chosen = {"stiffness": 12.0, "damping": 0.1, "position": -2.0, "speed": 3.0, "internal_step": 0.004}
    expected.initialize(**chosen)
    made.initialize(**chosen)
    plain.initialize()
    got = drive(made, 0.01, 50)
    np.testing.assert_array_equal(got, drive(expected, 0.01, 50))
    assert np.abs(got - drive(plain, 0.01, 50)).max() > 0.1


def test_tunable_parameter_changes_between_steps(version: int, component: Callable[..., Any]) -> None:
    made = component("oscillator", version)
    made.initialize()
    before = made.get("acceleration")
    made.set(damping=0.5)
    made.step(0.0, 0.01)
    made.set(damping=50.0)
    assert made.get("damping") == 50.0
    assert made.get("acceleration") != before


def test_outputs_follow_inputs_at_once(version: int, component: Callable[..., Any]) -> None:
    made = component("gain", version)
    made.initialize(2.0)
    assert made.get("twice") == 8.0  # 2 * 3 + t
    made.set(force=5.0)
    assert made.get("twice") == 12.0


def test_seed_decides_the_noise(version: int, component: Callable[..., Any], drive: Callable[..., np.ndarray]) -> None:
    runs = []
    for seed in (0.0, 7.0, 7.0):
        made = component("sampler", version)
        made.initialize(seed=seed)
        runs.append(drive(made, 0.02, 40))
    assert np.abs(runs[0] - runs[1]).max() > 0.01
    np.testing.assert_array_equal(runs[1], runs[2])


def test_vector_signals_are_scalars_with_indices(version: int, component: Callable[..., Any]) -> None:
    made = component("sampler", version)
    made.initialize()
    np.testing.assert_array_equal(made.get("ring[1]", "ring[2]", "ring[3]"), [1.0, 2.0, 3.0])


@pytest.mark.parametrize("name", ["oscillator", "sampler"])
def test_splitting_steps_on_the_grid_changes_nothing(name: str, version: int, component: Callable[..., Any]) -> None:
    whole, split = component(name, version), component(name, version)
    whole.initialize()
    split.initialize()
    h = 0.02  # a whole number of internal steps of both systems
    for k in range(30):
        whole.step(k * h, h)
        split.step(k * h, h / 2)
        split.step(k * h + h / 2, h / 2)
        np.testing.assert_array_equal(whole.values(), split.values())


def test_two_instances_do_not_disturb_each_other(
    version: int, component: Callable[..., Any], drive: Callable[..., np.ndarray]
) -> None:
    alone = component("tracker", version)
    alone.initialize()
    expected = drive(alone, 0.01, 20)
    one, other = component("tracker", version), component("tracker", version)
    one.initialize()
    other.initialize(position=500.0, gain=0.1)
    rows = []
    for k in range(20):
        rows.append(drive(one, 0.01, 1, k))
        drive(other, 0.01, 1, k)
    np.testing.assert_array_equal(np.vstack(rows), expected)
