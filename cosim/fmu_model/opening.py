"""Opening an FMU as a model: which interface serves, and an instance of it."""

from __future__ import annotations

import os
import shutil
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from fmpy.model_description import ModelDescription

from cosim.components.description import open_fmu
from cosim.components.stated_units import NONE_STATED, StatedUnit, state_units
from cosim.components.unpacking import unpack
from cosim.errors import FmuLoadError
from cosim.fmu_model.co_simulation import CoSimulationModel
from cosim.fmu_model.exchange import ExchangeModel
from cosim.fmu_model.sealed import FmuModelError, SealedModel
from fmus.check.checked_instance import SlaveError, make_slave
from fmus.check.exchange_model import make_model
from fmus.fmi.archive import NotAnFmuError
from fmus.fmi.standard import CO_SIMULATION, STEPPED, Interface, fmi_version


def open_model(
    path: str | Path,
    interface: Interface | None = None,
    *,
    states: Sequence[str] | None = None,
    outputs: Sequence[str] | None = None,
    inputs: Sequence[str] | None = None,
    parameters: Mapping[str, float] | None = None,
    units: Mapping[str, StatedUnit] = NONE_STATED,
) -> SealedModel:
    """Open an FMU as a model whose states can be written.

    Args:
        path: the ``.fmu`` file.
        interface: ``co-simulation`` or ``model-exchange``; None for co-simulation where the FMU has it.
        states: names of the states; None for the continuous states that it declares.
        outputs: names of what is read; None for all real outputs.
        inputs: names of what is written; None for all real inputs.
        parameters: start values by name.
        units: what is stated of its variables, by name, see `cosim.components.stated_units`.

    Returns:
        The model; `close` it at the end.

    Raises:
        FmuLoadError: the file is missing or broken, or cannot run here.
        CouplingError: the stated units do not fit it.
        FmuModelError: it has no such interface, no states, unknown names, or states that cannot be set.
    """
    path = Path(path)
    archive = open_fmu(path, path.name)
    state_units(archive.description, units, path.stem)
    chosen = _interface_of(archive.description, path, interface)
    try:
        archive.demand_this_platform(chosen)
    except NotAnFmuError as error:
        raise FmuLoadError(f"{path.name}: {error}") from error
    here, folder = Path.cwd(), unpack(archive)
    make: Any = make_slave if chosen == CO_SIMULATION else make_model
    face: Any = CoSimulationModel if chosen == CO_SIMULATION else ExchangeModel
    more: dict[str, Any] = {"states": states, "outputs": outputs, "inputs": inputs, "parameters": parameters}
    try:
        model: SealedModel = face(make(folder, archive.description, path.stem), folder, str(path), **more)
    except SlaveError as error:
        shutil.rmtree(folder, ignore_errors=True)
        raise FmuLoadError(f"{path}: {error}.") from error
    finally:
        os.chdir(here)  # fmpy changes it while it loads
    return model


def _interface_of(description: ModelDescription, path: Path, interface: Interface | None) -> str:
    """The interface asked for, or the first one that an FMU offers, in the words of its description.

    Raises:
        FmuModelError: it has no such interface, or is of FMI 1.0.
    """
    if fmi_version(description) == 1:
        raise FmuModelError(f"{path}: FMI 1.0 has no way to reset or to set states. Export it as FMI 2.0 or 3.0.")
    offered = [kind for kind in STEPPED.values() if getattr(description, kind) is not None]
    chosen = STEPPED[interface] if interface is not None else next(iter(offered), CO_SIMULATION)
    if chosen not in offered:
        instead = ", ".join(offered) or "scheduled execution only, in which no time passes by itself"
        raise FmuModelError(f"{path}: it has no {interface or 'co-simulation'}; it offers: {instead}.")
    return chosen
