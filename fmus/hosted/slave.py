"""The Python end of a hosted FMU. This file is copied into the FMU under a name of its own and run by pythonfmu's
library there.

It may import pythonfmu, which lies beside it, and the standard library; `fmu-observer` only after the check that it is
there. Nothing here may raise: pythonfmu would be left with broken references. A failure is a message with status error
in the log queue, which the front (the C files in front/) turns into fmi2Error.
"""

from __future__ import annotations

import json
import os
import site
import sys
import threading
from collections.abc import Callable
from contextlib import suppress
from importlib.util import find_spec
from math import nan
from pathlib import Path
from typing import Any, ClassVar

from pythonfmu.enums import Fmi2Status
from pythonfmu.fmi2slave import Fmi2Slave

DISCARD = 2
HELD: list[dict[str, Any]] = []


def hold(names: dict[str, Any]) -> None:
    """Keep a reference to the names of the entry module, which pythonfmu's library runs anew at every instantiation.

    Each time, pythonfmu 0.7 gives up a reference to these names that it does not own; without this they would be freed.
    """
    HELD.append(names)


def _text(value: Any) -> str:
    return value.decode() if isinstance(value, bytes) else str(value)


def _getter(method: str, cast: Callable[[Any], Any], missing: Any) -> Callable[[Any, list[int]], list[Any]]:
    """A getter of FMI, by the block's method for it; `missing` stands for each value where that fails."""

    def get(self: Any, vrs: list[int]) -> list[Any]:
        """Values of variables.

        Args:
            vrs: value references.
        """
        return list(map(cast, self._hand_on(method, [missing] * len(vrs), vrs)))

    return get


def _setter(method: str) -> Callable[[Any, list[int], list[Any]], None]:
    """A setter of FMI, by the block's method for it."""

    def set_values(self: Any, vrs: list[int], values: list[Any]) -> None:
        """Set variables.

        Args:
            vrs: value references. values: one for each reference.
        """
        self._hand_on(method, None, vrs, values)

    return set_values


class Hosted(Fmi2Slave):
    """The object that pythonfmu's library calls; hands every call on to `fmus.hosted.host.Host`.

    Args:
        kwargs: what pythonfmu's library gives: `instance_name`, `resources`, `visible`.
    """

    host_of_class: ClassVar[Any] = None
    problems: ClassVar[dict[int, str]] = {}  # of calls that pythonfmu makes without an instance, by thread

    def __init__(self, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        self.host: Any = None
        resources = str(kwargs["resources"])
        with suppress(ValueError):
            sys.path.remove(resources)  # pythonfmu put it there to find this file
        self._guard("fmi2Instantiate", lambda: self._open(Path(resources)))

    def _open(self, resources: Path) -> None:
        recipe = json.loads((resources / "hosted.json").read_text(encoding="utf-8"))
        _check_python(recipe)
        from fmus.hosted.host import Host  # noqa: PLC0415 - only now is it known to be there

        self.host = type(self).host_of_class = Host(recipe, resources, self.instance_name)

    # -- life -------------------------------------------------------------------------------------------------------

    def setup_experiment(
        self, start_time: float, stop_time: float | None = None, tolerance: float | None = None
    ) -> None:
        """fmi2SetupExperiment.

        Args:
            start_time: [s]. stop_time: [s], without effect. tolerance: without effect.
        """
        self._hand_on("setupExperiment", None, tolerance, start_time, stop_time)

    def enter_initialization_mode(self) -> None:
        """fmi2EnterInitializationMode."""
        self._hand_on("enterInitializationMode")

    def exit_initialization_mode(self) -> None:
        """fmi2ExitInitializationMode."""
        self._hand_on("exitInitializationMode")

    def terminate(self) -> None:
        """fmi2Terminate."""
        self._hand_on("terminate")

    def do_step(self, current_time: float, step_size: float) -> bool:
        """fmi2DoStep; False is fmi2Discard.

        Args:
            current_time: start of the step [s]. step_size: its length [s].
        """
        done = self._guard("fmi2DoStep", lambda: self.host.block.doStep(current_time, step_size), current_time)
        return bool(done != DISCARD)

    # -- values -----------------------------------------------------------------------------------------------------

    get_real, set_real = _getter("getReal", float, nan), _setter("setReal")
    get_boolean, set_boolean = _getter("getBoolean", bool, False), _setter("setBoolean")
    get_string, set_string = _getter("getString", _text, ""), _setter("setString")
    set_integer = _setter("setInteger")

    def get_integer(self, vrs: list[int]) -> list[int]:
        """fmi2GetInteger; without value references it only reports what else went wrong.

        Args:
            vrs: value references.
        """
        problem = self.problems.pop(threading.get_ident(), None)
        if problem is not None:
            self._report(problem)
        return list(map(int, self._hand_on("getInteger", [0] * len(vrs), vrs))) if vrs else []

    # -- state: all of it, not the registered variables that pythonfmu would save --------------------------------------

    def _get_fmu_state(self) -> Any:
        return self._hand_on("getFMUstate")

    def _set_fmu_state(self, state: Any) -> None:
        self._hand_on("setFMUstate", None, state)

    @staticmethod
    def _fmu_state_to_bytes(state: Any) -> bytes:
        content: bytes = _without_instance(
            "fmi2SerializeFMUstate", b"", lambda host: host.block.serializeFMUstate(state)
        )
        return content

    @staticmethod
    def _fmu_state_from_bytes(state: bytes) -> Any:
        return _without_instance("fmi2DeSerializeFMUstate", None, lambda host: host.block.deSerializeFMUstate(state))

    # -- failures ---------------------------------------------------------------------------------------------------

    def _hand_on(self, method: str, otherwise: Any = None, *arguments: Any) -> Any:
        """Call the block's method; `otherwise` where it fails, which is then reported."""
        name = f"fmi2{method[0].upper()}{method[1:]}"
        return self._guard(name, lambda: getattr(self.host.block, method)(*arguments), otherwise=otherwise)

    def _guard(self, function: str, call: Callable[[], Any], t: float | None = None, otherwise: Any = None) -> Any:
        try:
            if self.host is None and function != "fmi2Instantiate":
                raise RuntimeError("the instance could not be made; see the message of fmi2Instantiate")
            return call()
        except BaseException as error:  # SystemExit and KeyboardInterrupt would break pythonfmu just the same
            if (
                getattr(error, "status", None) == DISCARD and error.__cause__ is None
            ):  # the block's own; where Python raised, it is an error
                self.log(str(error), Fmi2Status.discard, "logStatusDiscard")
                return DISCARD
            self._report(describe_failure(self.host, function, error, t))
            return otherwise

    def _report(self, text: str) -> None:
        self.log(text.replace("\0", " "), Fmi2Status.error, "logStatusError")


def _without_instance(function: str, otherwise: Any, call: Callable[[Any], Any]) -> Any:
    host = Hosted.host_of_class
    try:
        return call(host)
    except BaseException as error:
        Hosted.problems[threading.get_ident()] = describe_failure(host, function, error, None)
        return otherwise


def describe_failure(host: Any, function: str, error: BaseException, t: float | None) -> str:
    """What to log: the call, the error and, where it came from the model's own files, function, line and time.

    Args:
        host: the Python host of the instance. t: time at which it happened [s].
    """
    if host is None:
        return f"{function}: {error}" if isinstance(error, Missing) else f"{function}: {type(error).__name__}: {error}"
    text: str = host.describe_failure(function, error, t)
    return text


# -- what must be installed -------------------------------------------------------------------------------------------


class Missing(RuntimeError):  # noqa: N818 - says what is the matter better than with a suffix
    """The Python in this process lacks something; the message says what, and how to get it."""


def _check_python(recipe: dict[str, Any]) -> None:
    """Refuse a Python that is too old or lacks `fmu-observer`.

    Raises:
        Missing: with what is needed and what was found.
    """
    needed, here = recipe["python"], ".".join(map(str, sys.version_info[:3]))
    if sys.version_info[:2] < tuple(needed):
        raise Missing(
            f"this FMU needs Python {'.'.join(map(str, needed))} or later; the Python in this process is {here}."
        )
    _enter_virtual_environment()
    missing = _missing()
    if missing:
        raise Missing(
            f"this FMU needs the Python package fmu-observer {recipe['package']} in the Python of this process "
            f"({here} in {sys.prefix}); missing: {', '.join(missing)}. Install it there (pip install fmu-observer), "
            "or set PYTHONPATH to where it is installed."
        )


def _missing() -> list[str]:
    return [name for name in ("plant_models", "fmu_observer", "fmus", "numpy", "fmpy") if find_spec(name) is None]


def _enter_virtual_environment() -> None:
    """In a program that is not Python nobody has read the activated environment yet."""
    folder = os.environ.get("VIRTUAL_ENV")
    if folder and _missing():
        version = f"python{sys.version_info[0]}.{sys.version_info[1]}"
        for packages in (Path(folder, "lib", version, "site-packages"), Path(folder, "Lib", "site-packages")):
            if packages.is_dir():
                site.addsitedir(str(packages))
