"""fmpy's slave of FMI 1.0, with what is wrong in fmpy 0.3.32 put right.

There the status of doStep and of some other calls is declared to be a text: a status other than OK is then read as an
address, and the process dies. And setRealInputDerivatives calls fmiInitializeSlave.
"""

from __future__ import annotations

import ctypes
from functools import wraps
from typing import Any

from fmpy.fmi1 import FMU1Slave

RETURN_A_STATUS = (
    "fmi1InitializeSlave",
    "fmi1DoStep",
    "fmi1CancelStep",
    "fmi1SetRealInputDerivatives",
    "fmi1GetRealOutputDerivatives",
    "fmi1GetStatus",
    "fmi1GetRealStatus",
    "fmi1GetIntegerStatus",
    "fmi1GetBooleanStatus",
    "fmi1GetStringStatus",
)


class FMU1SlaveRepaired(FMU1Slave):
    """A slave of FMI 1.0; arguments as for fmpy's `FMU1Slave`. fmpy goes by the first letters of the class's name."""

    def _loadFunctions(self) -> None:
        super()._loadFunctions()
        for name in RETURN_A_STATUS:
            self._functions[name].restype = ctypes.c_int

    # fmpy takes the types of the arguments from the signature
    @wraps(FMU1Slave.fmi1SetRealInputDerivatives, assigned=())
    def fmi1SetRealInputDerivatives(self, *arguments: Any) -> Any:
        """The call that this name says.

        Args:
            arguments: as for the function of FMI: c, the instance; vr, value references of the inputs; nvr, how many;
                order of each derivative; value of each.
        """
        return self._call("fmi1SetRealInputDerivatives", *arguments)

    def getRealStatus(self, kind: int) -> float:
        """The value itself, as the slaves of the other versions give it.

        Args:
            kind: of status, in the numbers of FMI.
        """
        return float(super().getRealStatus(kind).value)
