"""Benchmark: what each observer costs, to step, to certify and to construct with its designed gains.

``python tests/benchmarks/observers.py [NAME ...]``; without names all registered systems. Nothing is asserted. A step
is measured over one long ``doStep``, so the cost of the call does not count; `native_fmu.py step` and `stepper.py`
measure calls. A step is an internal step, or the time between two samples where that is shorter: a detector that
samples every millisecond and has internal steps of ten does ten of them.
"""

from __future__ import annotations

import statistics
import sys
import time
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from fmpy import extract, read_model_description
from fmpy.fmi2 import FMU2Slave

from fmu_observer import OBSERVERS
from fmus import RECIPES, cached_fmu
from plant_models.hybrid import HybridSystem, Runtime

STEPS = 20_000
REPETITIONS = 5


def main(names: list[str]) -> None:
    """Print one line for each system."""
    print(f"{'':<32}{'step':>14}{'native':>10}{'Python':>10}{'construct':>11}{'certify':>10}")
    print(f"{'':<32}{'[s]':>14}{'[us/step]':>10}{'[us/step]':>10}{'[ms]':>11}{'[ms]':>10}")
    for name in names or list(RECIPES):
        cls = RECIPES[name]
        system = cls()
        construct = median(cls)
        certify = (
            "-"
            if name not in OBSERVERS or not hasattr(system, "sampled_events")
            else f"{once(lambda s=system: next(s.findings(0.2))):.1f}"
        )
        columns = f"{native(system):>10.3f}{python(system):>10.2f}{1e3 * construct:>11.2f}{certify:>10}"
        print(f"{name:<32}{step_length(system):>14g}{columns}", flush=True)


def step_length(system: HybridSystem) -> float:
    """Internal step, or the shortest period of the samples where that is shorter [s]."""
    starts = {signal.name: signal.start for signal in system.parameter_signals}
    periods = [float(starts[event.period]) for event in system.periodic_events]
    return min([system.internal_step, *periods])


def native(system: HybridSystem) -> float:
    """Microseconds of an internal step in the FMU."""
    with TemporaryDirectory(prefix="observers-") as folder:
        fmu = str(cached_fmu(system, 2))
        description = read_model_description(fmu, validate=False)
        unpacked = Path(extract(fmu, folder))
        slave = FMU2Slave(
            guid=description.guid, unzipDirectory=str(unpacked), modelIdentifier=system.name, instanceName=system.name
        )
        slave.instantiate()
        slave.setupExperiment()
        slave.enterInitializationMode()
        slave.exitInitializationMode()
        length = STEPS * step_length(system)
        instants = iter(range(10**6))
        seconds = median(lambda: slave.doStep(next(instants) * length, length))
        slave.terminate()
        slave.freeInstance()
    return 1e6 * seconds / STEPS


def python(system: HybridSystem) -> float:
    """Microseconds of an internal step in the traced runtime."""
    runtime = Runtime(system)
    runtime.start(0.0)
    length = STEPS // 10 * step_length(system)
    instants = iter(range(1, 10**6))
    return 1e6 * median(lambda: runtime.advance(next(instants) * length)) / (STEPS // 10)


def median(call: Callable[[], Any]) -> float:
    """Median duration [s] of some calls."""
    return statistics.median(_timed(call) for _ in range(REPETITIONS))


def once(call: Callable[[], Any]) -> float:
    """Milliseconds of one call; certificates remember their answers."""
    return 1e3 * _timed(call)


def _timed(call: Callable[[], Any]) -> float:
    begin = time.process_time()  # of this process: others on the machine count as little as can be
    call()
    return time.process_time() - begin


if __name__ == "__main__":
    main(sys.argv[1:])
