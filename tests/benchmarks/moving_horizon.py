"""What a real-time iteration costs: a native FMU of the train's moving-horizon observer, one reading a step of 0.1 s.

``python tests/benchmarks/moving_horizon.py [ROWS ...]``: median, 99 % and worst of 2000 steps after the window is full,
beside the Kalman filter of the same train in the same run; and what it costs to build the FMU. A window of 220 rows
holds 200 readings and 20 balises. Through fmpy, whose calls cost about 10 us of each step. A reading of a wheel that
slides and false balises cost what others do: the iteration has no branches. Last the same windows solved to
convergence, as Python blocks, 100 steps, in CPU time.
"""

from __future__ import annotations

import resource
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from fmpy import extract, read_model_description
from fmpy.fmi2 import FMU2Slave

from fmu_observer import OBSERVERS
from fmu_observer.block import make_block
from fmu_observer.observers.full_convergence import FullBaliseMovingHorizon
from fmu_observer.observers.train.balise_moving_horizon import BaliseMovingHorizon
from fmus import build_fmu
from plant_models.hybrid import HybridSystem

WINDOWS = (10, 60, 220)
STEPS, PERIOD, BALISE_EVERY = 2000, 0.1, 11  # readings to a balise: 20 balises among 220 rows
FULL_STEPS = 100


def main(windows: tuple[int, ...]) -> None:
    """Print a line for the Kalman filter, then one for each window and number of passes.

    Args:
        windows: rows.
    """
    print(f"{'observer':40}{'median':>9}{'99 %':>9}{'worst':>9} us{'build':>9} s CPU{'library':>10} kB")
    with tempfile.TemporaryDirectory(prefix="moving-horizon-") as folder:
        measure("balise_odometer_ekf", OBSERVERS["balise_odometer_ekf"](), Path(folder) / "filter")
        for window in windows:
            for passes in (1, 2):
                name = f"balise_moving_horizon {window} rows, {passes} pass{'es' if passes > 1 else ''}"
                measure(name, BaliseMovingHorizon(window, passes), Path(folder) / f"{window}_{passes}")
    for window in windows:
        for loss in ("squares", "geman_mcclure"):
            block = make_block(FullBaliseMovingHorizon(window=window, loss=loss), fmi_version=2)
            references = {v.name: v.valueReference for v in block.model_description.modelVariables}
            costs = steps(block, references, FULL_STEPS, time.process_time)
            print(f"{f'to convergence {window} rows, {loss}':40}{reported(costs)}", flush=True)


def measure(name: str, system: HybridSystem, folder: Path) -> None:
    """Build an FMU and time its steps.

    Args:
        name: for the table. system: the observer. folder: for its files.
    """
    folder.mkdir()
    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime + time.process_time()
    fmu = build_fmu(system, folder / "it.fmu", 2)
    built = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime + time.process_time() - before
    description = read_model_description(str(fmu), validate=False)
    unpacked = extract(str(fmu), str(folder / "unpacked"))
    identifier = description.coSimulation.modelIdentifier
    slave = FMU2Slave(guid=description.guid, unzipDirectory=unpacked, modelIdentifier=identifier)
    costs = steps(slave, {v.name: v.valueReference for v in description.modelVariables})
    library = next(Path(unpacked, "binaries").glob("*/*")).stat().st_size
    print(f"{name:40}{reported(costs)}{built:12.1f}{library / 1e3:16.0f}", flush=True)


def reported(costs: np.ndarray) -> str:
    """Median, 99 % and worst, as columns [us].

    Args:
        costs: of the steps [s].
    """
    return "".join(f"{value:9.1f}" for value in np.percentile(costs, [50, 99, 100]) * 1e6)


def steps(
    slave: Any, references: dict[str, int], count: int = STEPS, clock: Callable[[], float] = time.perf_counter
) -> np.ndarray:
    """Seconds of the steps in which a reading arrives, after the window is full.

    Args:
        slave: the FMU, or a block. references: value references by name. count: steps after the window is full.
        clock: tells the seconds.
    """
    slave.instantiate()
    slave.setupExperiment(startTime=0.0)
    slave.enterInitializationMode()
    slave.setReal([references["effort"], references["odometer"]], [2000.0, 20.0])
    slave.exitInitializationMode()
    rng, costs = np.random.default_rng(0), []
    for k in range(count + 300):
        slave.setReal([references["odometer"]], [20.0 + 0.1 * rng.normal()])
        if k % BALISE_EVERY == BALISE_EVERY - 1:
            stamp = (k + 0.5) * PERIOD
            slave.setReal([references["balise_position"], references["balise_time"]], [20.0 * stamp, stamp])
            slave.setInteger([references["balise_count"]], [k // BALISE_EVERY + 1])
        begin = clock()
        slave.doStep(k * PERIOD, PERIOD)
        spent = clock() - begin
        if k >= 300 and k % BALISE_EVERY != BALISE_EVERY - 1:
            costs.append(spent)
    slave.terminate()
    slave.freeInstance()
    return np.array(costs)


if __name__ == "__main__":
    main(tuple(map(int, sys.argv[1:])) or WINDOWS)
