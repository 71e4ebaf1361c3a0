"""Law: two streams of chance of one run are independent unless the user couples them.

Bands are five standard errors of independent numbers: one false alarm in 1.7 million comparisons, and the seeds are
fixed.
"""

from __future__ import annotations

import tomllib
from itertools import combinations
from pathlib import Path
from typing import Any
from zipfile import ZipFile

import numpy as np
import pytest
from fmpy import simulate_fmu
from shipped import shipped

from cosim import Scenario
from cosim.balises.telegram import Channel, Crossing
from cosim.cli import main
from cosim.errors import CosimError, ScenarioError
from cosim.network.chance import Chance
from cosim.network.settings import NetworkSettings, Node
from cosim.provenance.rerun import rerun
from cosim.run.outcome import Outcome
from cosim.tuning.shifted_seeds import drawn, with_seed
from fmu_observer import OBSERVERS
from fmus import Batch, cached_fmu
from plant_models import PLANTS
from plant_models.hybrid import HybridSystem, Runtime, width
from plant_models.hybrid.noise import RUN_SEED, Purpose, seed_of, standard_normal

NOISY = {"noise_std": 0.05, "sample_period": 0.1, "wheel_speed": 20.0}
OPTIONS: dict[str, dict[str, Any]] = {"wheel_fault": {"cause": "drawn"}, "signal_fault": {"losses": True}}
"""Those that draw only where they are asked to."""


def _drawing() -> dict[str, HybridSystem]:
    made = {}
    for registry in (PLANTS, OBSERVERS):
        for name in registry.usable():
            found = registry[name]
            if isinstance(found, type):
                found = found(**OPTIONS[name]) if name in OPTIONS else shipped(name)
            if isinstance(found, HybridSystem) and found.noises:
                made[name] = found
    return made


SYSTEMS = _drawing()


def _first_draws(system: HybridSystem, name: str, **values: float) -> np.ndarray:
    """The noises of the events that are due when time begins."""
    runtime = Runtime(system, name=name)
    for key, value in values.items():
        runtime.p[[s.name for s in system.parameter_signals].index(key) - len(system.parameter_signals)] = value
    runtime.start(0.0)
    return np.asarray(runtime.u[len(runtime.u) - width(system.noises) :]).copy()


def test_every_system_that_draws_is_among_them() -> None:
    assert {"odometer", "doppler_radar", "wheel_fault", "signal_fault", "network_protocol", "wind"} <= set(SYSTEMS)
    assert {"ensemble_kalman_filter", "particle_filter", "gps", "pulse_odometer", "cart_pendulum"} <= set(SYSTEMS)


@pytest.mark.parametrize("name", SYSTEMS)
def test_a_system_draws_from_run_component_purpose_signal_and_number(name: str) -> None:
    """Two of any system that draw at the start draw different numbers, from the stream of their name; a seed of their
    own couples them.
    """
    system = SYSTEMS[name]
    one, other = _first_draws(system, "one"), _first_draws(system, "other")
    due = one != 0.0
    expected = [standard_normal(seed_of(RUN_SEED, "one"), j, 0, system.purpose) for j in range(len(one))]
    assert due.any()
    np.testing.assert_array_equal(one[due], np.array(expected)[due])
    assert (one[due] != other[due]).all()
    np.testing.assert_array_equal(_first_draws(system, "one", seed=5.0), _first_draws(system, "other", seed=5.0))


def test_streams_of_all_systems_of_a_run_are_independent() -> None:
    """Of two components of each system: each of the first four signals against every other."""
    count, most = 400, 4
    streams = [
        [standard_normal(seed_of(RUN_SEED, f"{name}_{k}"), j, i, system.purpose) for i in range(count)]
        for name, system in SYSTEMS.items()
        for k in (1, 2)
        for j in range(min(width(system.noises), most))
    ]
    correlation = np.corrcoef(streams)
    assert np.abs(correlation[np.triu_indices(len(streams), 1)]).max() < 5.0 / np.sqrt(count)


def sensors(**tables: Any) -> Scenario:
    scenario = Scenario(stop=120.0, step=0.05, certificates="ignore", **tables)
    for name in ("a", "b"):
        scenario.add(name, model="odometer", parameters=NOISY, **{"as": "block3"})
    radar = {"noise_share": 0.0, "noise_std": 0.05, "scale_error": 0.0, "lowest_speed": 0.0, "speed": 20.0}
    return scenario.add("radar", model="doppler_radar", parameters=radar, **{"as": "block3"})


def samples(outcome: Outcome, *names: str) -> list[np.ndarray]:
    """Readings between samples, where filters of sensors have settled."""
    return [np.asarray(outcome[f"{name}.reading"])[61::2] for name in names]


def quiet(scenario: Scenario) -> Outcome:
    return scenario.run(warn=lambda _text: None)


def test_sensors_with_default_seeds_are_independent() -> None:
    found = samples(quiet(sensors()), "a", "b", "radar")
    for one, other in combinations(found, 2):
        assert abs(np.corrcoef(one, other)[0, 1]) < 5.0 / np.sqrt(len(one))
    assert found[0].std() == pytest.approx(0.05, rel=5.0 / np.sqrt(2.0 * len(found[0])))


def test_the_order_of_components_changes_nothing_and_the_run_seed_all() -> None:
    tables = sensors().table().components
    turned = Scenario(stop=120.0, step=0.05, certificates="ignore")
    for name in reversed(tables):
        turned.add(name, **tables[name].model_dump(by_alias=True, exclude_unset=True))
    first, again, other = quiet(sensors()), quiet(turned), quiet(sensors(seed=1))
    for name in ("a", "b", "radar"):
        np.testing.assert_array_equal(first[f"{name}.reading"], again[f"{name}.reading"])
        before, after = samples(first, name)[0], samples(other, name)[0]
        assert abs(np.corrcoef(before, after)[0, 1]) < 5.0 / np.sqrt(len(before))


def test_a_seed_of_its_own_pins_a_component() -> None:
    pinned = sensors().set("a.seed", 3).set("b.seed", 3)
    one, other = quiet(pinned), quiet(pinned.copy().set("seed", 9))
    for name in ("a", "b"):
        np.testing.assert_array_equal(one["a.reading"], other[f"{name}.reading"])
    assert (samples(one, "radar")[0] != samples(other, "radar")[0]).any()


@pytest.mark.parametrize("seeds", [{}, {"odometer.seed": 4, "network.seed": 4, "seed": 4}], ids=["default", "equal"])
def test_packets_are_lost_whatever_they_carry(seeds: dict[str, int]) -> None:
    """Readings that arrive have the mean and deviation of those that are sent, with one seed for both too."""
    scenario = Scenario(stop=400.0, step=0.1, certificates="ignore")
    scenario.add("odometer", model="odometer", parameters=NOISY, **{"as": "block3"})
    scenario.add("receiver", model="signal_fault", options={"unit": "m/s"}, **{"as": "block3"})
    scenario.connect("odometer.reading -> receiver.healthy")
    scenario.network(nodes={"node": ["odometer.reading"]}, period=0.1, offset=0.05, loss_fraction=0.3)
    for name, value in seeds.items():
        scenario.set(name, value)
    packets = quiet(scenario).result.packets
    read = np.array([next(iter(p.values.values())) for p in packets if p.kind == "sent"])
    noise = (read[1:] - 20.0) / 0.05  # the first reading, before the first sample, is the start
    assert abs(noise.mean()) < 5.0 / np.sqrt(len(noise))
    assert noise.std() == pytest.approx(1.0, abs=5.0 / np.sqrt(2.0 * len(noise)))


def test_what_a_network_draws_is_independent_of_all_else_with_one_seed() -> None:
    settings = NetworkSettings(
        (Node("n", ("a.b",)),), jitter=1e-3, delay_model="uniform", delay_spread=1.0, loss_fraction=0.5, seed=6
    )
    network, count = Chance(settings, 0.0), 2000
    streams = [
        [network.instant(k) - k * settings.period for k in range(count)],
        [float(network.lost(k)) for k in range(count)],
        [network.delay(k) for k in range(count)],
        [network.delay(k, second=True) for k in range(count)],
        *([standard_normal(6, j, k, purpose) for k in range(count)] for purpose in Purpose for j in range(4)),
    ]
    correlation = np.corrcoef(streams)
    own = 4 + int(Purpose.NETWORK) * 4 + np.arange(4)  # the very numbers that it draws from
    others = np.setdiff1d(np.arange(4, len(streams)), own)
    assert np.abs(correlation[:4][:, others]).max() < 5.0 / np.sqrt(count)
    assert np.abs(correlation[:4, :4][np.triu_indices(4, 1)]).max() < 5.0 / np.sqrt(count)


def test_what_befalls_telegrams_is_independent_of_all_else_with_one_seed() -> None:
    """Misses, latencies and position errors, where sensors, network, faults and filters have the seed too."""
    channel, count = Channel(latency_jitter=1.0, missed_fraction=0.3, position_noise=1.0, seed=6), 2000
    reported = [channel.transmit(Crossing(0.0, 0.0, "B1", 1.0), k, 0.0) for k in range(count)]
    read = np.array([e.kind == "true" for e in reported])
    late, error = np.array([e.delivered_at for e in reported]), np.array([e.position for e in reported])
    for purpose in set(Purpose) - {Purpose.TELEGRAMS}:
        for j in range(4):
            noise = np.array([standard_normal(6, j, k, purpose) for k in range(count)])
            for seen, drawn_so in ((read, noise), (late[read], noise[read]), (error, noise)):
                assert abs(np.corrcoef(seen, drawn_so)[0, 1]) < 5.0 / np.sqrt(len(seen))
    assert abs(np.corrcoef(late[read], error[read])[0, 1]) < 5.0 / np.sqrt(read.sum())
    assert abs(np.corrcoef(read, error)[0, 1]) < 5.0 / np.sqrt(count)


def test_the_shipped_odometers_of_the_diagnosis_are_independent() -> None:
    outcome = quiet(Scenario.load("train_diagnosis").set("stop", 40.0).set("expect", []))
    apart = (outcome["odometer_1.reading"] - outcome["odometer_2.reading"])[100::10]  # one true speed
    assert apart.std() > 0.5 * np.sqrt(2.0) * 0.03  # quantised and aggregated; equal numbers would give 0


@pytest.mark.compiler
def test_one_name_and_seed_is_one_stream_in_every_form() -> None:
    """Runtime, block, FMI 2, FMI 3, both steppers, batch, and an FMU alone in another master, bit for bit."""
    count, h = 100, 0.1
    runs = {}
    for run_seed in (RUN_SEED, 12):
        for form in ("block2", "block3", "fmu2", "fmu3"):
            for stepper in ("python", "compiled") if form.startswith("fmu") else ("python",):
                scenario = Scenario(stop=count * h, step=h, seed=run_seed, master={"stepper": stepper})
                scenario.add("one", model="odometer", parameters=NOISY, **{"as": form})
                runs[run_seed, form, stepper] = np.asarray(quiet(scenario)["one.reading"])
        batch = Batch("odometer", 2)
        for name, value in {**NOISY, "seed": float(seed_of(run_seed, "one"))}.items():
            batch.set(name, value)
        batch.start()
        runs[run_seed, "batch", ""] = batch.run(h * np.arange(1, count + 1), ["reading"])[1, :, 0]
    runtime = Runtime(SYSTEMS["odometer"], name="one")
    names = [s.name for s in runtime.system.parameter_signals]
    for name in ("noise_std", "sample_period"):
        runtime.p[names.index(name)] = NOISY[name]
    runtime.u[0] = NOISY["wheel_speed"]
    runtime.start(0.0)
    alone = [float(runtime.update_outputs()[0])]
    for k in range(1, count + 1):
        runtime.advance(h * k)
        runtime.communicate()
        alone.append(float(runtime.update_outputs()[0]))
    runs[RUN_SEED, "runtime", ""] = np.array(alone)
    for version in (2, 3):
        foreign = simulate_fmu(
            str(cached_fmu(SYSTEMS["odometer"], version)),
            start_values={**NOISY},
            stop_time=count * h,
            output_interval=h,
            fmi_type="CoSimulation",
        )["reading"]
        scenario = Scenario(stop=count * h, step=h).add("odometer", model="odometer", parameters=NOISY)
        np.testing.assert_array_equal(foreign, quiet(scenario)["odometer.reading"])  # fmpy names it as the model
    for (run_seed, *_), found in runs.items():
        np.testing.assert_array_equal(found, runs[run_seed, "fmu3", "compiled"])
    assert (runs[RUN_SEED, "fmu3", "python"][1:] != runs[12, "fmu3", "python"][1:]).all()


@pytest.mark.compiler
@pytest.mark.parametrize("seed", [RUN_SEED, 5])
def test_a_package_for_other_tools_draws_as_the_scenario(tmp_path: Path, seed: int) -> None:
    """The FMU finds the seed of the default run by its name; that of another run stands among its parameters."""
    scenario = Scenario(stop=5.0, step=0.1, seed=seed).add("one", model="odometer", parameters=NOISY)
    scenario.export_ssp(tmp_path / "one.ssp")
    again = Scenario.load(tmp_path / "one.ssp")
    np.testing.assert_array_equal(quiet(again)["one.reading"], quiet(scenario)["one.reading"])
    with ZipFile(tmp_path / "one.ssp") as package:
        reported = 'name="seed"' in package.read("resources/one.ssv").decode()
    assert reported == (seed != RUN_SEED)


@pytest.mark.compiler
def test_members_of_a_batch_draw_numbers_of_their_own() -> None:
    batch = Batch("odometer", 3)
    for name, value in NOISY.items():
        batch.set(name, value)
    batch.start()
    found = batch.run(0.1 * np.arange(1, 1001), ["reading"])[:, 10:, 0]
    assert np.abs(np.corrcoef(found)[np.triu_indices(3, 1)]).max() < 5.0 / np.sqrt(found.shape[1])
    assert batch.get("seed").tolist() == [float(seed_of(RUN_SEED, f"odometer[{i}]")) for i in range(3)]


def test_a_run_says_its_seed_and_is_made_again_with_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "s.toml").write_text(
        'stop = 1.0\nstep = 0.1\n[components.o]\nmodel = "odometer"\nas = "block3"\n'
        "parameters = { noise_std = 0.05, sample_period = 0.1, wheel_speed = 20.0 }\n"
    )
    runs = []
    for said in (["--seed", "7"], ["--set", "seed=7"], []):
        out = tmp_path / f"out{len(runs)}"
        assert main(["run", str(tmp_path / "s.toml"), "--out", str(out), "--no-report", "--quiet", *said]) == 0
        runs.append(Scenario.load(out))
        made_from = tomllib.loads((out / "made_from" / "scenario.toml").read_text())
        assert made_from.get("seed", RUN_SEED) == (7 if said else RUN_SEED)
    capsys.readouterr()
    first, second, default = (np.asarray(quiet(run)["o.reading"]) for run in runs)
    np.testing.assert_array_equal(first, second)
    assert (first != default).any()
    assert quiet(runs[0]).result.summary["seed"] == 7
    assert rerun(tmp_path / "out0").equal


def test_seeds_of_studies_move_the_seed_of_the_run() -> None:
    scenario = sensors(seed=4).set("b.seed", 1)
    assert drawn(scenario) == ["a", "radar"]
    assert with_seed(scenario, 3).table().seed == 7
    assert scenario.table().seed == 4


@pytest.mark.parametrize("value", [1.5, -1, "abc", float("nan"), True, 2**53, "3"])
def test_a_run_seed_is_a_whole_number(value: Any) -> None:
    with pytest.raises(
        ScenarioError, match=r"^script: seed: expected a whole number from 0 to 9007199254740991 \(got "
    ):
        sensors(seed=value).table()


@pytest.mark.parametrize("value", [1.5, -2, "abc", float("nan"), 2**53])
@pytest.mark.parametrize("key", ["a.seed", "balises.seed", "network.seed"])
def test_a_seed_of_its_own_is_a_whole_number(key: str, value: Any) -> None:
    scenario = sensors()
    if key == "balises.seed":
        scenario.balises(position="train.position", speed="a.reading", layout="aperiodic")
    if key == "network.seed":
        scenario.network(nodes={"n": ["a.reading"]}, period=0.1)
    with pytest.raises(CosimError, match=r"script: .*(a|balises|network)\.(parameters\.)?seed"):
        quiet(scenario.set(key, value))
