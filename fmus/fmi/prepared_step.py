"""doStep of FMI 1.0 and 2.0 with its arguments allocated once."""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from typing import Any

from fmus.fmi.native_calls import prepared_call
from fmus.fmi.ports import is_native


def make_step(slave: Any, name: str, last: Any) -> Callable[[float, float], None]:
    """The slave's doStep from a time by a length, both in [s].

    Args:
        slave: instantiated, with fmpy's call surface.
        name: of the function in fmpy's words.
        last: the last argument, always the same.
    """
    if not is_native(slave):
        return lambda t, h: slave.doStep(t, h, last)
    start, length = ctypes.c_double(), ctypes.c_double()
    call = prepared_call(slave, name, slave.component, start, length, last)

    def do_step(t: float, h: float) -> None:
        start.value, length.value = t, h
        call()

    return do_step
