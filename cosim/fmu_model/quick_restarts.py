"""Quick restarts: the calls of a native co-simulation slave that lead through a reset and initialisation, their
arguments allocated once. A filter makes them many times a sample. Touches one slave.
"""

from __future__ import annotations

import ctypes
from typing import Any

from fmus.fmi.native_calls import prepared_call


def quicken_restarts(slave: Any, fmi_version: int) -> None:
    """Prepare reset, set-up and both ends of initialisation of an instantiated native slave.

    Arguments and results are those of fmpy's methods.

    Args:
        slave: with fmpy's call surface. fmi_version: 2 or 3.
    """
    prefix, held = f"fmi{fmi_version}", slave.component
    start, stop, size = ctypes.c_double(), ctypes.c_double(), ctypes.c_double()
    flag = ctypes.c_bool if fmi_version == 3 else ctypes.c_int  # how fmpy declares a truth value
    with_tolerance, with_stop = flag(0), flag(1)
    name = f"{prefix}EnterInitializationMode" if fmi_version == 3 else f"{prefix}SetupExperiment"
    begin = prepared_call(slave, name, held, with_tolerance, size, start, with_stop, stop)

    def set_up(tolerance: float | None = None, startTime: float = 0.0, stopTime: float | None = None) -> None:
        with_tolerance.value, size.value = tolerance is not None, tolerance or 0.0
        start.value, with_stop.value, stop.value = startTime, stopTime is not None, stopTime or 0.0
        begin()

    slave.reset = prepared_call(slave, f"{prefix}Reset", held)
    slave.exitInitializationMode = prepared_call(slave, f"{prefix}ExitInitializationMode", held)
    if fmi_version == 3:
        slave.enterInitializationMode = set_up
    else:
        slave.setupExperiment = set_up
        slave.enterInitializationMode = prepared_call(slave, f"{prefix}EnterInitializationMode", held)
