"""Slaves driven under test: co-simulation of FMI 2.0 and 3.0."""

from __future__ import annotations

from pathlib import Path

from fmpy.model_description import ModelDescription

from fmus.check.checked_instance import FmuInstance
from fmus.fmi.fmi2 import FMI2Slave
from fmus.fmi.fmi3 import FMI3Slave
from fmus.fmi.standard import fmi_version


class FmuSlave2(FmuInstance, FMI2Slave):
    """A co-simulation instance of FMI 2.0; arguments as for `FmuInstance`."""


class FmuSlave3(FmuInstance, FMI3Slave):
    """A co-simulation instance of FMI 3.0; arguments as for `FmuInstance`."""


FmuSlave = FmuSlave2 | FmuSlave3


def make_slave(
    folder: Path, description: ModelDescription, name: str = "checked", *, logging: bool = False
) -> FmuSlave:
    """See `FmuInstance`: one for co-simulation, of the version of its description, not yet instantiated.

    Raises:
        SlaveError: the library cannot be loaded.
    """
    version = FmuSlave2 if fmi_version(description) == 2 else FmuSlave3
    return version(folder, description, name, logging=logging)
