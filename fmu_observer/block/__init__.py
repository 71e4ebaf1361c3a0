"""The FMU-style block: any hybrid system with the interface of an FMI 2 or FMI 3 co-simulation FMU."""

from typing import Any, Literal

from fmu_observer.block.block_variables import BlockError
from fmu_observer.block.fmi2_block import FMI2Block
from fmu_observer.block.fmi3_block import FMI3Block
from fmu_observer.block.interface import BlockCallError, FMIInterface
from fmu_observer.event_protocol import LATE_POLICIES, LatePolicy
from plant_models.hybrid import HybridSystem

__all__ = [
    "LATE_POLICIES",
    "BlockCallError",
    "BlockError",
    "FMI2Block",
    "FMI3Block",
    "FMIInterface",
    "LatePolicy",
    "make_block",
]


FACES: dict[int, type[FMI2Block] | type[FMI3Block]] = {2: FMI2Block, 3: FMI3Block}


def make_block(system: HybridSystem, fmi_version: Literal[2, 3] = 3, **arguments: Any) -> FMI2Block | FMI3Block:
    """A block with the FMI 2 or FMI 3 interface; further arguments as for `FMIInterface`.

    Args:
        system: the hybrid system. fmi_version: 2 or 3.

    Raises:
        ValueError: the version is neither 2 nor 3, or an argument is one that `FMIInterface` refuses.
    """
    if fmi_version not in FACES:
        raise ValueError(f"{system.name}: FMI version {fmi_version!r} is unknown; use 2 or 3.")
    return FACES[fmi_version](system, **arguments)
