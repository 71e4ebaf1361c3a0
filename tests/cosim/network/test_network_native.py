"""Networks beside native FMUs: the compiled stepper gives Python's numbers, and so does any process."""

from __future__ import annotations

from typing import Any

import pytest
from toys import run, scenario

from cosim import Outcome, Scenario

NETWORKS: tuple[dict[str, Any], ...] = (
    {"period": 0.04},
    {"period": 0.04, "delay": 0.05},
    {"period": 0.04, "delay_model": "uniform", "delay_spread": 0.2, "jitter": 0.01, "duplicate_fraction": 0.2},
    {"period": 0.04, "protocol": "try-once-discard", "loss_fraction": 0.3, "delay": 0.02},
)


def stepped_by(stepper: str, backend: str, network: dict[str, Any]) -> Outcome:
    return scenario(0.01, backend, **network).master(stepper=stepper).run(warn=lambda _: None)


@pytest.mark.compiler
@pytest.mark.parametrize("backend", ["fmu3", "fmu2"])
@pytest.mark.parametrize("network", NETWORKS)
def test_the_compiled_stepper_gives_the_rows_of_python(network: dict[str, Any], backend: str) -> None:
    python, compiled = (stepped_by(kind, backend, network).result for kind in ("python", "auto"))
    assert compiled.summary["master"]["stepper"]["steps_compiled"] > 0
    assert compiled.table.tobytes() == python.table.tobytes()
    assert [repr(p) for p in compiled.packets] == [repr(p) for p in python.packets]
    assert any("Packets are sent and delivered by Python" in note for note in compiled.summary["notes"])


@pytest.mark.compiler
def test_native_fmus_are_notified_of_what_blocks_are_notified() -> None:
    names = ("listener.estimate", "listener.first", "listener.second", "listener.packets")
    block, native = (run(0.01, backend, **NETWORKS[2]) for backend in ("block3", "fmu2"))
    assert [native[name][-1] for name in names] == pytest.approx([block[name][-1] for name in names], abs=1e-12)


def test_a_sweep_in_two_processes_is_that_in_one() -> None:
    def packets(workers: int) -> list[str]:
        sweep = scenario(0.05, stop=1.0, **NETWORKS[2]).vary({"network.seed": [1, 2], "network.delay": [0.0, 0.1]})
        runs = sorted(sweep.each(workers=workers), key=lambda one: one.number)
        return [repr(one.outcome.result.packets) for one in runs if one.outcome is not None]

    alone = packets(1)
    assert len(set(alone)) == 4
    assert packets(2) == alone


def test_the_shipped_scenario_meets_its_expectations() -> None:
    outcome = Scenario.load("freight_over_network").run(warn=lambda _: None).check()
    counts = next(c["events"] for c in outcome.result.summary["components"] if c["name"] == "remote")
    assert counts["replayed"] == counts["accepted"] == sum(e.kind == "true" for e in outcome.result.events)
    packets = outcome.result.summary["network"]["packets"]
    assert packets["antenna"]["largest_age"] == pytest.approx(0.037, abs=1e-9)
