"""Quick calls: the calls of a native slave around an event, with their arguments allocated once.

A telegram costs four such calls in every receiver, and states of the plant are saved and restored around it. fmpy's own
stay in the class and do what is not prepared here.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Sequence
from typing import Any

from fmus.fmi.native_calls import prepared_call

Discrete = tuple[bool, bool, bool, bool, bool, float]


def quicken(slave: Any, version: int, states: Sequence[str]) -> None:
    """Prepare the calls of an instantiated native slave that save, restore and free a state, and notify of an event.

    Arguments and results are those of fmpy's methods.

    Args:
        slave: fmpy's. version: of FMI, 2 or 3. states: names of its methods that save, restore and free a state.
    """
    for name, make in zip(states, (_getter, _restorer, _releaser), strict=True):
        setattr(slave, name, make(slave, f"fmi{version}{name[0].upper()}{name[1:]}"))
    if version == 2:
        slave.setReal = _setter(slave, "fmi2SetReal", type(slave).setReal, ctypes.c_double, counted=False)
        slave.setInteger = _setter(slave, "fmi2SetInteger", type(slave).setInteger, ctypes.c_int, counted=False)
        return
    slave.enterEventMode = prepared_call(slave, "fmi3EnterEventMode", slave.component)
    slave.enterStepMode = prepared_call(slave, "fmi3EnterStepMode", slave.component)
    slave.updateDiscreteStates = _update(slave)
    slave.setClock = _setter(slave, "fmi3SetClock", type(slave).setClock, ctypes.c_bool, counted=False)
    slave.setFloat64 = _setter(slave, "fmi3SetFloat64", type(slave).setFloat64, ctypes.c_double, counted=True)


def _update(slave: Any) -> Callable[[], Discrete]:
    flags = again, terminate, nominals, values, defined = tuple(ctypes.c_bool() for _ in range(5))
    time = ctypes.c_double()
    call = prepared_call(
        slave, "fmi3UpdateDiscreteStates", slave.component, *map(ctypes.byref, flags), ctypes.byref(time)
    )

    def update() -> Discrete:
        for flag in flags:  # a slave may leave out what it has nothing to say of
            flag.value = False
        call()
        return again.value, terminate.value, nominals.value, values.value, defined.value, time.value

    return update


def _setter(
    slave: Any, name: str, slowly: Callable[..., None], kind: Any, *, counted: bool
) -> Callable[[Sequence[int], Sequence[Any]], None]:
    """A setter that prepares a call for each list of variables it meets; `slowly` is fmpy's own."""
    function = slave._functions[name]
    prepared: dict[tuple[int, ...], tuple[Callable[[], None], Any]] = {}

    def set_values(references: Sequence[int], values: Sequence[Any]) -> None:
        if slave._functions[name] is not function:  # somebody stands in for the library
            slowly(slave, references, values)
            return
        key = tuple(references)
        if key not in prepared:
            buffer = (kind * len(values))()
            more = (len(values),) if counted else ()
            arguments = ((ctypes.c_uint32 * len(key))(*key), len(key), buffer, *more)
            prepared[key] = prepared_call(slave, name, slave.component, *arguments), buffer
        call, buffer = prepared[key]
        buffer[:] = values
        call()

    return set_values


def _getter(slave: Any, name: str) -> Callable[[], ctypes.c_void_p]:
    held = ctypes.c_void_p()
    call = prepared_call(slave, name, slave.component, ctypes.byref(held))

    def get() -> ctypes.c_void_p:
        held.value = None  # a new state, and not one that is written over
        call()
        return ctypes.c_void_p(held.value)

    return get


def _restorer(slave: Any, name: str) -> Callable[[Any], None]:
    held = ctypes.c_void_p()
    call = prepared_call(slave, name, slave.component, held)

    def restore(state: Any) -> None:
        held.value = state.value if isinstance(state, ctypes.c_void_p) else state
        call()

    return restore


def _releaser(slave: Any, name: str) -> Callable[[ctypes.c_void_p], None]:
    held = ctypes.c_void_p()
    call = prepared_call(slave, name, slave.component, ctypes.byref(held))

    def release(state: ctypes.c_void_p) -> None:
        held.value = state.value
        call()
        state.value = held.value

    return release
