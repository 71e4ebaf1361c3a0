"""A reading that is lost, or was read before, is missing where it can be left out, and never read as a new one."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from shipped import shipped

import cosim
from fmu_observer import OBSERVERS
from plant_models.hybrid import HybridSystem, Runtime, output_signal, scalar_names, state

TRAIN = {"mass": 90e3, "davis_a": 900.0, "davis_b": 32.0, "davis_c": 1.7}
EFFORT = {"effort": 60e3}
BLOCK, STEPPERS = {"as": "block3"}, ("python", "compiled")
SIGNAL, ARRIVED = "network.odometer.reading", "network.arrived.observer.odometer"
LEAVING_OUT = sorted(
    name
    for name, system in ((name, shipped(name)) for name in OBSERVERS)
    if any(s.name == "odometer" and s.can_be_missing for s in system.input_signals)
    and {"mass", "davis_a", "odometer_period"} <= {p.name for p in system.parameters}
    and any(s.name == "odometer_fault" for s in system.outputs)
)


def run(
    name: str,
    backend: str = "block3",
    stepper: str = "python",
    *,
    sampling: float = 0.1,
    step: float = 0.05,
    every: int = 1,
    **network: Any,
) -> Any:
    """A train that pulls away with a constant effort; its observer hears the odometer by packets."""
    made = cosim.Scenario(stop=30.0, step=step, certificates="ignore", seed=1)
    forces = {"traction_coefficient": 1.0, "brake_coefficient": 1.0}
    made.add("train", model="longitudinal_train", parameters=TRAIN | forces | EFFORT, **{"as": backend})
    made.add("odometer", model="odometer", parameters={"sample_period": 0.1}, **{"as": backend})
    own = TRAIN | {"odometer_period": sampling} | EFFORT
    made.add("observer", observer=name, parameters=own, every=every, **{"as": backend})
    made.connect("train.speed -> odometer.wheel_speed", "odometer.reading -> observer.odometer")
    made.network(**({"nodes": {"tachometer": ["odometer.reading"]}, "period": 0.1} | network))
    made.master(stepper=stepper)
    return made.run(warn=lambda _: None)


def missed(outcome: Any) -> int:
    found = next(c for c in outcome.result.summary["components"] if c["name"] == "observer")
    return int(found["events"]["missed_samples"])


@pytest.mark.parametrize("name", LEAVING_OUT)
def test_lost_packets_are_no_wheel_fault(name: str) -> None:
    """Whoever leaves the odometer out raises no flag more with loss than without, and is as near to the train."""
    whole, lossy = (run(name, loss_fraction=share) for share in (0.0, 0.3))
    assert ARRIVED not in whole.result.table.dtype.names  # without loss nothing changes
    lost = sum(p.kind == "lost" for p in lossy.result.packets)
    assert lost - 1 <= missed(lossy) <= lost  # one that is lost at the end is not sampled any more
    assert (lossy["observer.odometer_fault"] > 0.0).sum() <= (whole["observer.odometer_fault"] > 0.0).sum()
    errors = [np.abs(o["observer.position"] - o["train.position"]).max() for o in (whole, lossy)]
    # three readings in ten held for 30 s would lag by .3 * .1 s * 19 m/s, .6 m or more
    assert errors[1] < errors[0] + 0.1
    assert any("left out, at observer.odometer" in note for note in lossy.result.summary["notes"])


@pytest.mark.parametrize(
    ("backend", "stepper"), [("block2", "python"), ("fmu3", "python"), ("fmu3", "compiled"), ("fmu2", "compiled")]
)
def test_blocks_and_fmus_leave_out_equal_samples(backend: str, stepper: str) -> None:
    reference, outcome = (run("quasi_lpv_uio", *how, loss_fraction=0.3) for how in ((), (backend, stepper)))
    assert outcome.result.summary["master"]["stepper"]["name"] == stepper
    assert missed(outcome) == missed(reference) > 50
    np.testing.assert_allclose(outcome["observer.position"], reference["observer.position"], rtol=1e-10, atol=1e-10)
    np.testing.assert_array_equal(np.isnan(outcome[ARRIVED]), np.isnan(reference[ARRIVED]))


def test_a_gap_begins_when_the_reading_is_read_or_its_packet_would_arrive_and_ends_with_the_next() -> None:
    outcome = run("quasi_lpv_uio", loss_fraction=0.3, delay=0.03)
    time, arrived, held = outcome["time"], outcome[ARRIVED], outcome[SIGNAL]
    gone = {p.number for p in outcome.result.packets if p.kind == "lost"}
    for k in range(1, 290):  # between two deliveries
        inside = (time > 0.1 * k + 0.03 + 1e-6) & (time < 0.1 * k + 0.13 - 1e-6)
        assert inside.any()
        unread = inside & (time < 0.1 * (k + 1) - 1e-6)  # its sample is the first after the delivery
        assert np.isnan(arrived[unread]).all() == (k in gone)
        assert np.isnan(arrived[inside & (time > 0.1 * (k + 1) + 1e-6)]).all()
        assert np.isfinite(held[inside]).all()
        if k not in gone:
            np.testing.assert_array_equal(arrived[unread], held[unread])


# -- samples between two packets ---------------------------------------------------------------------------------------

FASTER: dict[str, Any] = {"period": 0.1, "jitter": 0.03, "seed": 4}
SAMPLING = sorted(
    name for name, system in OBSERVERS.items() if any(getattr(e, "samples", ()) for e in system().periodic_events)
)


def waves_for(signals: Any) -> HybridSystem:
    """A source with a wave for each signal, in its unit; outputs are known at any time."""
    named = tuple(output_signal(f"wave_{i}", s.unit, "A wave") for i, s in enumerate(signals))

    class Waves(HybridSystem):
        name = "waves"
        internal_step = 1e-3
        states = (state("elapsed", "s", 0.0, "Time since the start"),)
        outputs = named

        def flow(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
            return {"elapsed": 1.0}

        def output(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
            return {s.name: 0.1 * np.sin((1.0 + 0.3 * i) * t + i) for i, s in enumerate(named)}

    return Waves()


@pytest.mark.parametrize("name", SAMPLING)
def test_a_reading_is_read_once_however_often_it_is_sampled(name: str) -> None:
    """LAW: of the samples between two packets the first reads, the others are missing; beside it runs the observer
    alone, told NaN there by hand, and ends in the same state.
    """
    system = OBSERVERS[name]()
    (event,) = (e for e in system.periodic_events if e.samples)
    read = [s for s in system.input_signals if s.name in event.samples]
    period = float(getattr(system.unpack_parameters(system.start_parameters()), event.period))
    stop = 60.0 * period
    made = cosim.Scenario(stop=stop, step=2.5 * period, certificates="ignore")
    sources = [n for s in read for n in s.scalar_names]
    made.add("waves", model=waves_for([s for s in read for _ in s.scalar_names]), **{"as": "block3"})
    seeded = {"seed": 3} if system.noises else {}
    made.add("observer", observer=name, parameters=seeded, **{"as": "block3"})
    made.connect(*(f"waves.wave_{i} -> observer.{n}" for i, n in enumerate(sources)))
    node = [f"waves.wave_{i}" for i in range(len(sources))]
    made.network(nodes={"node": node}, period=4.3 * period, jitter=2.1 * period, delay=0.4 * period, seed=7)
    outcome = made.run(warn=lambda _: None)
    assert outcome.failure is None, outcome.failure

    runtime = Runtime(system)
    places = [scalar_names(system.input_signals).index(n) for n in sources]
    if seeded:
        runtime.p[scalar_names(system.parameter_signals).index("seed")] = 3.0
    first = [0.1 * np.sin(i) for i in range(len(sources))]  # what is measured at the start counts as a packet there
    arriving = [(0.0, first), *((p.delivered_at, list(p.values.values())) for p in outcome.result.packets)]
    runtime.u[places] = first
    runtime.start(0.0)
    reported, k = 0, 1
    while k * period < stop + 1e-9:
        new = [values for at, values in arriving if (k - 1) * period - 1e-9 <= at < k * period - 1e-9]
        runtime.u[places] = new[-1] if new else np.nan
        reported += bool(new)
        runtime.advance(k * period)
        k += 1
    runtime.update_outputs()
    assert reported < 0.3 * k  # most samples lie between two packets
    assert missed(outcome) == (k - 1 - reported) * len(sources)
    expected = dict(zip(scalar_names(system.outputs), runtime.y, strict=True))
    found = {n: outcome[f"observer.{n}"][-1] for n in expected}
    # the block halts where packets arrive, which leaves rounding in what flows; sigma points lose half of the digits
    for n, value in expected.items():
        np.testing.assert_allclose(found[n], value, rtol=1e-7, atol=1e-9, err_msg=n)
    assert any("is read once" in note for note in outcome.result.summary["notes"])


def test_samples_that_are_no_faster_than_packets_change_nothing() -> None:
    """Without loss they read what is held, and no step is cut."""
    outcome = run("balise_odometer_ekf")
    assert ARRIVED not in outcome.result.table.dtype.names
    assert not any("is read once" in note for note in outcome.result.summary["notes"])


@pytest.mark.parametrize(("name", "every"), [("discrete_uio", 1), ("quasi_lpv_uio", 2)])
def test_who_reads_a_held_reading_again_is_named(name: str, every: int) -> None:
    """An observer that leaves nothing out, and one that takes steps of its own."""
    outcome = run(name, sampling=0.01, every=every)
    assert outcome.failure is None
    assert ARRIVED not in outcome.result.table.dtype.names
    assert any("for a new one, at observer.odometer" in note for note in outcome.result.summary["notes"])


@pytest.mark.parametrize("name", LEAVING_OUT)
@pytest.mark.parametrize("network", [{}, FASTER, {"delay": 0.03}, {"loss_fraction": 0.2}], ids=str)
def test_samples_between_packets_are_no_wheel_fault(name: str, network: dict[str, Any]) -> None:
    """Ten samples a packet: no flag, and no further from the train than by the age of a packet."""
    outcome = run(name, sampling=0.01, **network)
    assert not (outcome["observer.odometer_fault"] > 0.0).any()
    age = 0.1 + network.get("delay", 0.0) + network.get("jitter", 0.0)
    packets = outcome.result.packets
    longest = max(np.diff([p.delivered_at for p in packets if p.kind != "lost"])) - 0.1
    error = np.abs(outcome["observer.position"] - outcome["train.position"]).max()
    assert error < (age + longest) * outcome["train.speed"].max()


@pytest.mark.compiler
@pytest.mark.parametrize("version", ["fmu2", "fmu3"])
def test_both_steppers_leave_out_equal_samples(version: str) -> None:
    """Bit by bit, also where a sample lies between two communication points."""
    for sampling in (0.01, 0.025):
        runs = [run("quasi_lpv_uio", version, s, sampling=sampling, loss_fraction=0.1, **FASTER) for s in STEPPERS]
        assert runs[1].result.summary["master"]["stepper"]["name"] == "compiled"
        assert runs[0].result.table.tobytes() == runs[1].result.table.tobytes()
        assert missed(runs[0]) == missed(runs[1]) > 500


@pytest.mark.parametrize("step", [0.05, 0.01])
def test_a_record_in_the_place_of_the_network_gives_equal_bits(step: float, tmp_path: Path) -> None:
    """What arrived is a column that can be missing, held: an observer cannot tell it from packets."""
    whole = run("balise_odometer_ekf", sampling=0.01, step=step, loss_fraction=0.1, **FASTER)
    whole.write(tmp_path / "run", report=False)
    made = cosim.Scenario(stop=30.0, step=step, certificates="ignore", seed=1)
    made.add("log", recording=str(tmp_path / "run"))
    made.add("observer", observer="balise_odometer_ekf", parameters=TRAIN | {"odometer_period": 0.01} | EFFORT, **BLOCK)
    made.connect(f"log.{ARRIVED} -> observer.odometer")
    again = made.run(warn=lambda _: None)
    assert missed(again) == missed(whole)
    for name in ("position", "speed", "odometer_fault"):
        ends = [np.interp(whole["time"], o["time"], o[f"observer.{name}"]) for o in (whole, again)]
        np.testing.assert_array_equal(*ends)
