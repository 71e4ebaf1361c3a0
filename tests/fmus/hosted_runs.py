"""One run for blocks and hosted FMUs alike, by fmpy's calls; run as a program it does its part of it in a process of
its own.
"""

from __future__ import annotations

import json
import sys
from math import sin
from pathlib import Path
from typing import Any

from fmpy import extract, read_model_description
from fmpy.fmi2 import (
    FMU2Slave,
    calloc,
    fmi2CallbackAllocateMemoryTYPE,
    fmi2CallbackFreeMemoryTYPE,
    fmi2CallbackFunctions,
    fmi2CallbackLoggerTYPE,
    free,
)

H = 0.05
EVENTS = {2: 0.13, 5: 0.25, 6: 0.62, 9: 0.31, 14: 0.74}
"""Stamp by step: inside the step, at its start, far ahead (it waits), late (it is replayed), inside [s]."""


class Loaded:
    """A hosted FMU unpacked in a folder; its instances keep what they log in `log`."""

    def __init__(self, fmu: Path, folder: Path) -> None:
        self.description = read_model_description(str(fmu))
        self.folder = extract(str(fmu), unzipdir=str(folder))
        self.log: list[tuple[int, str]] = []
        self._made: list[Any] = []
        self.callbacks = fmi2CallbackFunctions()
        self.callbacks.logger = fmi2CallbackLoggerTYPE(
            lambda _e, _n, status, _c, text: self.log.append((status, text.decode()))
        )
        self.callbacks.allocateMemory = fmi2CallbackAllocateMemoryTYPE(calloc)
        self.callbacks.freeMemory = fmi2CallbackFreeMemoryTYPE(free)

    def make(self) -> Any:
        """A new instance; logging is off, failures are logged all the same."""
        slave = FMU2Slave(
            unzipDirectory=self.folder,
            guid=self.description.guid,
            instanceName="one",
            modelIdentifier=self.description.coSimulation.modelIdentifier,
        )
        slave.instantiate(callbacks=self.callbacks)
        self._made.append(slave)
        return slave

    def close(self) -> None:
        """Free what was made, instances before libraries."""
        for slave in self._made:
            slave.freeInstance()
        for slave in self._made:
            slave.freeLibrary()


def references(description: Any) -> dict[str, int]:
    return {v.name: v.valueReference for v in description.modelVariables}


def initialize(slave: Any, **starts: float) -> Any:
    """From instantiated to step mode at 0 s."""
    refs = references(slave_description(slave))
    if starts:
        slave.setReal([refs[name] for name in starts], list(starts.values()))
    slave.setupExperiment(startTime=0.0)
    slave.enterInitializationMode()
    slave.exitInitializationMode()
    return slave


def slave_description(slave: Any) -> Any:
    found = getattr(slave, "model_description", None)
    return found if found is not None else read_model_description(slave.unzipDirectory, validate=False)


def drive(slave: Any, first: int, last: int) -> list[float]:
    """Steps `first` to `last - 1` of `Gatekeeper` with its events: all real values after each step."""
    description = slave_description(slave)
    refs = references(description)
    real = [
        v.valueReference for v in description.modelVariables if v.type == "Real" and v.causality in ("output", "local")
    ]
    values: list[float] = []
    for k in range(first, last):
        slave.setReal([refs["speed"]], [1.5 + sin(0.7 * k)])
        if k in EVENTS:
            slave.setReal([refs["balise_position"], refs["balise_time"]], [0.3 * k, EVENTS[k]])
            count = [refs["balise_count"]]
            slave.setInteger(count, [slave.getInteger(count)[0] + 1])
        slave.doStep(k * H, H)
        values += slave.getReal(real)
    return values


def main(fmu: str, folder: str, first: str, last: str, state: str = "") -> None:
    """Print the values of `drive` as JSON, from a serialised state where one is given."""
    loaded = Loaded(Path(fmu), Path(folder))
    slave = initialize(loaded.make())
    if state:
        slave.setFMUstate(slave.deSerializeFMUstate(Path(state).read_bytes()))
    print(json.dumps([value.hex() for value in drive(slave, int(first), int(last))]))
    loaded.close()


if __name__ == "__main__":
    main(*sys.argv[1:])
