"""Benchmark: what a communication step costs in this master and in others; a pair in a loop and a chain of ten trivial
FMUs.

Run it with ``python tests/benchmarks/masters.py [REPETITIONS]``. All masters run in turn within one process, on the
same FMUs (`lag.c`), with all outputs of all steps recorded in memory; loading is not counted. What each one calculates
is checked, to the rounding of its communication step: ``h`` or ``t_(k+1) - t_k``.
"""

from __future__ import annotations

import ctypes
import logging
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass
from functools import lru_cache
from importlib.util import find_spec
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np
from fmpy import extract, read_model_description
from fmpy.fmi2 import FMU2Slave, defaultCallbacks, fmi2CallbackFunctions, fmi2CallbackLoggerTYPE
from lag_fmus import Chain, H, compile_c, make_chain

from cosim import Scenario

Run = tuple[float, np.ndarray]
"""Seconds of the loop, and the outputs at its end, shape (components,)."""
U, Y = 0, 1  # value references
SLOW, FAST = 10_000, 500_000  # steps of masters in Python, and of those without


# -- this package ---------------------------------------------------------------------------------------------------


def ours(stepper: str) -> Callable[[Chain, int, Path], Run]:
    """This master with one of its steppers."""

    def run(chain: Chain, steps: int, _: Path) -> Run:
        scenario = Scenario(stop=steps * H, step=H, master={"stepper": stepper, "algorithm": "gauss-seidel"})
        for name, fmu in zip(chain.names, chain.fmus, strict=True):
            scenario.add(name, fmu=str(fmu))
        scenario.connect(*(f"{source}.y -> {target}.u" for source, target in chain.links))
        outcome = scenario.run(warn=lambda _text: None)
        assert outcome.failure is None, outcome.failure
        assert len(outcome.result.table) == steps + 1
        return outcome.result.summary["wall_seconds"], np.array([outcome[f"{name}.y"][-1] for name in chain.names])

    return run


# -- loops in Python ------------------------------------------------------------------------------------------------


def _slaves(chain: Chain, stack: ExitStack) -> list[Any]:
    slaves = []
    for name, fmu in zip(chain.names, chain.fmus, strict=True):
        description = read_model_description(str(fmu), validate=False)
        folder = stack.enter_context(tempfile.TemporaryDirectory(prefix="masters-"))
        arguments = {"guid": description.guid, "unzipDirectory": extract(str(fmu), folder), "modelIdentifier": "lag"}
        slave = FMU2Slave(**arguments, instanceName=name)
        slave.instantiate()
        stack.callback(slave.freeInstance)
        slave.setupExperiment(startTime=0.0)
        slave.enterInitializationMode()
        slave.exitInitializationMode()
        slaves.append(slave)
    return slaves


def _sources(chain: Chain) -> list[int | None]:
    """Number of the component that feeds each one."""
    numbers = {name: i for i, name in enumerate(chain.names)}
    feeds = {target: numbers[source] for source, target in chain.links}
    return [feeds.get(name) for name in chain.names]


def plain_loop(chain: Chain, steps: int, _: Path) -> Run:
    """The loop that everybody writes with fmpy's documented calls."""
    with ExitStack() as stack:
        slaves, sources = _slaves(chain, stack), _sources(chain)
        values, rows = [0.0] * len(slaves), []
        begin = perf_counter()
        for k in range(steps):
            t = k * H
            for i, slave in enumerate(slaves):
                source = sources[i]
                if source is not None:
                    slave.setReal([U], [values[source]])
                slave.doStep(currentCommunicationPoint=t, communicationStepSize=H)
                values[i] = slave.getReal([Y])[0]
            rows.append((t + H, *values))
        return perf_counter() - begin, np.array(rows[-1][1:])


def ctypes_loop(chain: Chain, steps: int, _: Path) -> Run:
    """The same by somebody who knows fmpy well: arguments allocated once, rows in one array."""
    with ExitStack() as stack:
        slaves, sources = _slaves(chain, stack), _sources(chain)
        values, table = np.zeros(len(slaves)), np.empty((steps, len(slaves) + 1))
        vr_u, vr_y = (ctypes.c_uint32 * 1)(U), (ctypes.c_uint32 * 1)(Y)
        place = [values[i:].ctypes.data_as(ctypes.POINTER(ctypes.c_double)) for i in range(len(slaves))]
        inputs = [None if source is None else place[source] for source in sources]
        parts = [
            (s.component, s.fmi2SetReal, u, s.fmi2DoStep, s.fmi2GetReal, y)
            for s, u, y in zip(slaves, inputs, place, strict=True)
        ]
        begin = perf_counter()
        for k in range(steps):
            t = k * H
            for c, put, u, do_step, get, y in parts:
                if u is not None:
                    put(c, vr_u, 1, u)
                do_step(c, t, H, 1)
                get(c, vr_y, 1, y)
            table[k, 0], table[k, 1:] = t + H, values
        return perf_counter() - begin, table[-1, 1:].copy()


# -- masters of others ----------------------------------------------------------------------------------------------


def container(chain: Chain, steps: int, folder: Path) -> Run:
    """The FMU container of fmu-manipulation-toolbox, components in sequence, stepped by a loop with allocated
    arguments.
    """
    from fmu_manipulation_toolbox.container import FMUContainer

    logging.disable(logging.CRITICAL)  # it warns of inputs without a source, at every building
    made = FMUContainer("loop", chain.fmus[0].parent, fmi_version=2)
    for fmu in chain.fmus:
        made.get_fmu(fmu.name)
    for source, target in chain.links:
        made.add_link(f"{source}.fmu", "y", f"{target}.fmu", "u")
    for fmu in chain.fmus:
        made.add_output(fmu.name, "y", f"out_{fmu.stem}")
    made.make_fmu(str(folder / "loop.fmu"), step_size=H, sequential=True)
    logging.disable(logging.NOTSET)
    description = read_model_description(str(folder / "loop.fmu"), validate=False)
    references = {v.name: v.valueReference for v in description.modelVariables}
    identifier = description.coSimulation.modelIdentifier
    unpacked = extract(str(folder / "loop.fmu"), str(folder / "loop"))
    slave = FMU2Slave(guid=description.guid, unzipDirectory=unpacked, modelIdentifier=identifier, instanceName="loop")
    slave.instantiate(callbacks=_silent())
    slave.setupExperiment(startTime=0.0)
    slave.enterInitializationMode()
    slave.exitInitializationMode()
    n = len(chain.fmus)
    table, vr = np.empty((steps, n + 1)), (ctypes.c_uint32 * n)(*(references[f"out_{name}"] for name in chain.names))
    values = np.zeros(n)
    place, c = values.ctypes.data_as(ctypes.POINTER(ctypes.c_double)), slave.component
    begin = perf_counter()
    for k in range(steps):
        t = k * H
        slave.fmi2DoStep(c, t, H, 1)
        slave.fmi2GetReal(c, vr, n, place)
        table[k, 0], table[k, 1:] = t + H, values
    seconds = perf_counter() - begin
    slave.freeInstance()
    return seconds, table[-1, 1:].copy()


def _silent() -> Any:
    """Callbacks that print nothing."""
    callbacks = fmi2CallbackFunctions()
    callbacks.logger = fmi2CallbackLoggerTYPE(lambda *_: None)
    callbacks.allocateMemory, callbacks.freeMemory = defaultCallbacks.allocateMemory, defaultCallbacks.freeMemory
    return callbacks


def libcosim(chain: Chain, steps: int, folder: Path) -> Run:
    """libcosim's fixed-step algorithm, all steps in one call, its own observer recording in memory. All FMUs step at
    once.
    """
    from libcosimpy.CosimEnums import CosimVariableType
    from libcosimpy.CosimExecution import CosimExecution
    from libcosimpy.CosimLogging import CosimLogLevel, log_output_level
    from libcosimpy.CosimObserver import CosimObserver

    log_output_level(CosimLogLevel.FATAL)
    (folder / "OspSystemStructure.xml").write_text(_system_structure(chain), encoding="utf-8")
    execution = CosimExecution.from_osp_config_file(str(folder))
    observer = CosimObserver.create_time_series(steps + 1)
    execution.add_observer(observer)
    slaves = [execution.slave_index_from_instance_name(name) for name in chain.names]
    for slave in slaves:
        observer.start_time_series(slave, Y, CosimVariableType.REAL)
    begin = perf_counter()
    assert execution.step(steps)
    seconds = perf_counter() - begin
    return seconds, np.array([_last(observer.time_series_real_samples(slave, Y, 1, steps + 1)) for slave in slaves])


def _last(samples: Any) -> float:
    return float(samples[2][-1])


def _system_structure(chain: Chain) -> str:
    simulators = "".join(
        f'<Simulator name="{name}" source="{fmu}" stepSize="{H}"/>'
        for name, fmu in zip(chain.names, chain.fmus, strict=True)
    )
    ends = (
        '<VariableConnection><Variable simulator="{}" name="y"/><Variable simulator="{}" '
        'name="u"/></VariableConnection>'
    )
    return (
        '<OspSystemStructure xmlns="http://opensimulationplatform.com/MSMI/OSPSystemStructure" version="0.1">'
        f"<StartTime>0.0</StartTime><BaseStepSize>{H}</BaseStepSize><Algorithm>fixedStep</Algorithm>"
        f"<Simulators>{simulators}</Simulators>"
        f"<Connections>{''.join(ends.format(*link) for link in chain.links)}</Connections></OspSystemStructure>"
    )


def c_loop(chain: Chain, steps: int, folder: Path) -> Run:
    """A loop in C written for these FMUs only."""
    program = folder / "lag_loop"
    if not program.exists():
        compile_c("lag_loop.c", program)
    arguments = [str(program), *map(str, chain.libraries), str(steps), repr(H), str(int(chain.closed))]
    numbers = [float(x) for x in subprocess.run(arguments, check=True, capture_output=True, text=True).stdout.split()]
    return numbers[0], np.array(numbers[2:])


# -- the comparison -------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Master:
    """One line of the table.

    Args:
        name: text of the line. run: runs it. steps: how many. package: what it needs. at_once: all FMUs step at once
        (Jacobi).
    """

    name: str
    run: Callable[[Chain, int, Path], Run]
    steps: int
    package: str = "cosim"
    at_once: bool = False


MASTERS = (
    Master("C, written for these FMUs", c_loop, FAST),
    Master("this master, compiled stepper", ours("compiled"), FAST, "cosim.compiled"),
    Master("this master, Python stepper", ours("python"), SLOW),
    Master("fmpy, plain loop", plain_loop, SLOW),
    Master("fmpy, loop with allocated arguments", ctypes_loop, SLOW),
    Master("fmu-manipulation-toolbox container", container, SLOW, "fmu_manipulation_toolbox"),
    Master("libcosim", libcosim, SLOW, "libcosimpy", at_once=True),
)
CHAINS = {"a pair in a loop": (2, True), "a chain of ten": (10, False)}


def compare(chain: Chain, folder: Path, repetitions: int) -> dict[str, list[float]]:
    """Microseconds per communication step by master; all masters in turn, so that ratios hold on a noisy machine."""
    times: dict[str, list[float]] = {}
    for repetition in range(repetitions):
        for number, master in enumerate(MASTERS):
            if _is_here(master.package):
                place = folder / f"{number}-{repetition if master.package != 'cosim' else 0}"
                place.mkdir(exist_ok=True)
                seconds, end = master.run(chain, master.steps, place)
                times.setdefault(master.name, []).append(seconds / master.steps * 1e6)
                check(master, end, expected(chain, master.steps, master.at_once))
    return times


def _is_here(package: str) -> bool:
    try:
        return find_spec(package) is not None
    except ModuleNotFoundError:
        return False


@lru_cache
def expected(chain: Chain, steps: int, at_once: bool) -> np.ndarray:
    """Outputs at the end, calculated here: FMUs in sequence, each with the newest values, or all at once with the
    former ones.
    """
    values, sources = [0.0] * len(chain.fmus), _sources(chain)
    for _ in range(steps):
        former = list(values)
        for i, source in enumerate(sources):
            u = 0.0 if source is None else (former if at_once else values)[source]
            values[i] += H * (1.0 + u - 2.0 * values[i])
    return np.array(values)


def check(master: Master, end: np.ndarray, right: np.ndarray) -> None:
    """Times of a master that calculates something else mean nothing."""
    if not np.allclose(end, right, rtol=1e-8, atol=0.0):  # in sequence and at once differ by about H = 1e-5
        raise SystemExit(f"{master.name}: ends with {end}, expected {right}")


def main() -> None:
    """Compare on all chains and print medians."""
    repetitions = int(sys.argv[1]) if len(sys.argv) > 1 else 7
    for title, (count, closed) in CHAINS.items():
        with tempfile.TemporaryDirectory(prefix="masters-") as folder:
            times = compare(make_chain(Path(folder) / "fmus", count, closed), Path(folder), repetitions)
        floor = statistics.median(times[MASTERS[0].name])
        print(f"{title}, us per communication step, {repetitions} repetitions")
        print(f"  {'':<40} {'median':>9} {'least':>9} {'times C':>9}")
        for name in (m.name for m in MASTERS):
            if name in times:
                middle = statistics.median(times[name])
                print(f"  {name:<40} {middle:9.3f} {min(times[name]):9.3f} {middle / floor:9.1f}")
            else:
                print(f"  {name:<40} {'not installed':>9}")


if __name__ == "__main__":
    main()
