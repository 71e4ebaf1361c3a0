"""Quick restarts: the calls of a native co-simulation slave that lead through a reset and initialisation, their
arguments allocated once. A filter makes them many times a sample. Touches one slave.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fmus.fmi.native_calls import prepared_call

Array = NDArray[np.float64]


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


def prepared_restart(
    instance: Any, write: Callable[[Array, Array], None], far: float
) -> Callable[[float, Array, Array], None]:
    """Reset, values and initialisation in one call, with the words of an error told only where there is one.

    Args:
        instance: native co-simulation without event mode, its slave quickened.
        write: writes states, shape (n,), and inputs, shape (m,), before initialisation; guarded by itself.
        far: time from a restart to the end that is announced [s].

    Returns:
        The call, of an instant [s], states and inputs.
    """
    slave, mistakes = instance.slave, instance.mistakes
    reset, leave = slave.reset, slave.exitInitializationMode
    more, words = instance.tolerance_argument()
    three = instance.fmi_version == 3
    set_up = slave.enterInitializationMode if three else slave.setupExperiment
    enter = None if three else slave.enterInitializationMode

    began = ("enterInitializationMode" if three else "setupExperiment") + words

    def restart(t: float, x: Array, u: Array) -> None:
        what = "reset"
        try:
            reset()
            instance.note_reset(t)
            write(x, u)
            what = began
            set_up(startTime=t, stopTime=t + far, **more)
            if enter is not None:
                what = "enterInitializationMode"
                enter()
            what = "exitInitializationMode"
            leave()
        except mistakes:
            raise
        except Exception as error:
            raise instance.explained(what, error) from error
        instance.note_initialised()

    return restart
