"""Slaves whose calls are logged: native ones at the place where fmpy calls the library, others through a proxy."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from cosim.components.component import Component
from cosim.diagnostics.call_log import CallLog, Names, describe_native, describe_prepared, describe_python
from fmus.fmi.ports import is_native
from fmus.fmi.types import REAL_TYPE


def log_calls(component: Component, log: CallLog) -> None:
    """Log all further calls of a component; before `instantiate`.

    Args:
        component: made and not instantiated yet. log: where to.
    """
    names = Names(component.description)
    if is_native(component.slave):
        component.slave._call = _logged_native(component, log, names)
        component.slave.fmiCallLogger = _ignore  # prepared calls and the compiled stepper make way for a logger
        component.slave._log_fmi_args = _ignore
    else:
        component.slave = _LoggedSlave(component, log, names)


def _logged_native(component: Component, log: CallLog, names: Names) -> Callable[..., Any]:
    slave = component.slave
    inner = slave._call

    def call(function: str, *arguments: Any) -> Any:
        argument_names: Sequence[str] = slave._functions[function].argnames
        described = describe_native(names, function, argument_names, arguments)
        return log.call(component.time, component.name, described, lambda: inner(function, *arguments))

    return call


def _ignore(*_arguments: Any) -> None:
    """fmpy's own logging of calls, which knows no time and writes after the call."""


class _LoggedSlave:
    """A slave in Python whose methods are logged; everything else is the slave's own.

    Args:
        component: whose slave is to be wrapped. log: where to. names: of its variables.
    """

    def __init__(self, component: Component, log: CallLog, names: Names) -> None:
        self._wrapped, self._component, self._log, self._names = component.slave, component, log, names

    def __getattr__(self, name: str) -> Any:
        found = getattr(self._wrapped, name)
        if name.startswith("_") or not callable(found):
            return found
        if name in ("prepared_get", "prepared_set"):
            return self._prepared(name.removeprefix("prepared_"), found)

        def call(*arguments: Any, **named: Any) -> Any:
            described = describe_python(self._names, name, arguments, named)
            return self._log.call(
                self._component.time, self._component.name, described, lambda: found(*arguments, **named)
            )

        return call

    def _prepared(self, verb: str, prepare: Callable[..., Callable[[], None]]) -> Callable[..., Callable[[], None]]:
        component, kind = self._component, REAL_TYPE[self._component.fmi_version]

        def prepared(references: Sequence[int], values: Any) -> Callable[[], None]:
            inner = prepare(references, values)

            def call() -> None:
                described = describe_prepared(self._names, verb, kind, references, values)
                self._log.call(component.time, component.name, described, inner)

            return call

        return prepared
