"""A user's plain Python object as a model: what it declares, and its calls with what they give checked.

The class has ``step(t, inputs, dt)``, perhaps ``balise(stamp, position, ...)``, and says its ``inputs`` and
``outputs``; the arguments of its constructor are its parameters. Knows no FMI and no master.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from copy import deepcopy
from dataclasses import replace
from hashlib import sha256
from inspect import Parameter, Signature, getattr_static, getsourcefile, signature
from pathlib import Path
from typing import Any

import numpy as np

from cosim.errors import ScenarioError, nearest
from plant_models.explained_error import explained
from plant_models.hybrid.signal import Causality, Signal
from plant_models.hybrid.units import parse_unit
from plant_models.local_files import files_digest
from plant_models.user_file import UserFileError, make

TELEGRAM = ("stamp", "position", "location_accuracy", "odometer_reading", "delivered_at")
"""What ``balise`` may take, by these names; times in [s], lengths in [m], speed in [m/s]."""

UNKNOWN_UNIT = ""


class _PythonModelError(RuntimeError):
    """The object raised, or gave something that cannot be; the message names the call and the signal."""


class NamedInputs(dict[str, Any]):
    """Values of the inputs by name, ``inputs["odometer"]`` or ``inputs.odometer``: a number, or an array of shape (n,)
    for a vector.
    """

    def __getattr__(self, name: str) -> Any:
        try:
            return self[name]
        except KeyError:
            raise AttributeError(f"no input {name!r}; declared are: {', '.join(self) or 'none'}") from None


class PythonModel:
    """An object of the user's, made anew for each run.

    Args:
        stated: the class, or an instance, of which each run has a copy.
        options: arguments of the constructor that are no parameters. where: place for messages.

    Raises:
        ScenarioError: its declarations cannot be, or it cannot be made or copied.
    """

    def __init__(self, stated: Any, options: Mapping[str, Any], where: str) -> None:
        self.stated, self.options, self.where = stated, dict(options), where
        self.cls: type = stated if isinstance(stated, type) else type(stated)
        self.inputs = self._declared("inputs", "input")
        self.outputs = self._declared("outputs", "output")
        self.kinds: dict[str, type] = {}  # of the parameters, by name
        self.parameter_signals = self._parameters()
        self.telegram = self._telegram()
        self._check_step()
        self.direct = self._direct()
        names = Counter(s.name for s in (*self.inputs, *self.outputs, *self.parameter_signals))
        doubled = [name for name, count in names.items() if count > 1]
        if doubled:
            raise self._refused(
                f"the name {doubled[0]!r} is taken twice; inputs, outputs and arguments of the constructor need names "
                f"of their own: start_{doubled[0]}, say"
            )
        try:
            self.file = getsourcefile(self.cls)
        except (TypeError, OSError):
            self.file = None

    @property
    def identity(self) -> str:
        """A digest of the class, of its file and of what this imports beside it."""
        files = files_digest(Path(self.file)) if self.file is not None else ""
        return sha256(f"{self.cls.__qualname__} {files}".encode()).hexdigest()

    # -- what it declares -------------------------------------------------------------------------------------------

    def _declared(self, attribute: str, causality: Causality) -> tuple[Signal, ...]:
        """Signals out of ``{"speed": "m/s"}``, ``{"estimate": ("m", 3)}``, ``["speed"]`` or signals."""
        declared = getattr(self.stated, attribute, ())
        try:
            if isinstance(declared, str | bytes):
                raise TypeError("it is a text")
            if isinstance(declared, Mapping):
                return tuple(_signal(name, stated, causality) for name, stated in declared.items())
            return tuple(s if isinstance(s, Signal) else Signal(s, UNKNOWN_UNIT, causality) for s in declared)
        except (TypeError, ValueError, AttributeError) as error:
            raise self._refused(
                f"{attribute} = {declared!r} cannot be ({error}); write {attribute} = {{'name': 'unit'}}, or "
                "{'name': ('unit', size)} for a vector"
            ) from error

    def declare_missing(self, names: Sequence[str]) -> None:
        """Say of outputs that NaN stands for a missing value.

        Args:
            names: of them, or of elements; others are left alone.
        """
        whole = {name.partition("[")[0] for name in names}
        self.outputs = tuple(replace(s, can_be_missing=s.can_be_missing or s.name in whole) for s in self.outputs)

    def _parameters(self) -> tuple[Signal, ...]:
        """The arguments of the constructor whose defaults are numbers; of an instance its attributes of these names."""
        found = []
        for argument in self._arguments(self.cls, "its constructor"):
            held = argument.default if self.stated is self.cls else getattr(self.stated, argument.name, None)
            value = np.asarray(held if held is not None else "")
            if argument.name not in self.options and value.dtype.kind in "fiub" and value.ndim <= 1:
                start = float(value) if value.ndim == 0 else tuple(map(float, value))
                size = None if value.ndim == 0 else len(value)
                found.append(Signal(argument.name, UNKNOWN_UNIT, "parameter", "fixed", start, size=size))
                self.kinds[argument.name] = {"b": bool, "f": float}.get(value.dtype.kind, int)
        return tuple(found)

    def as_stated(self, signal: Signal, values: np.ndarray) -> Any:
        """The value of a parameter in the type of its default: a whole number stays one where it can.

        Args:
            signal: the parameter. values: shape (size of the parameter,).
        """
        if signal.size is not None:
            return values.copy()
        value, kind = float(values[0]), self.kinds[signal.name]
        return kind(value) if kind is bool or (kind is int and value.is_integer()) else value

    def _direct(self) -> dict[str, list[str]]:
        """Which outputs follow which inputs at once: ``direct = {"speed": ["odometer"]}``; by default none does."""
        declared = getattr(self.stated, "direct", {})
        inputs, outputs = ([s.name for s in signals] for signals in (self.inputs, self.outputs))
        for output, sources in declared.items() if isinstance(declared, Mapping) else [("direct", [])]:
            if output not in outputs or isinstance(sources, str) or not set(sources) <= set(inputs):
                raise self._refused(f"direct = {declared!r} cannot be; write direct = {{'output': ['input']}}")
        return {output: list(sources) for output, sources in declared.items()}

    def _check_step(self) -> None:
        bound = self.stated is not self.cls or isinstance(getattr_static(self.cls, "step"), staticmethod)
        try:
            arguments = signature(self.stated.step)
        except (TypeError, ValueError):  # of compiled code, say
            return
        try:
            arguments.bind(*(("t", "inputs", "dt") if bound else ("self", "t", "inputs", "dt")))
        except TypeError as error:
            raise self._refused(f"step{arguments} cannot be called as step(t, inputs, dt)") from error

    def _telegram(self) -> tuple[str, ...] | None:
        """What ``balise`` takes; None where there is no such method."""
        call = getattr(self.stated, "balise", None)
        if not callable(call):
            return None
        bound = self.stated is not self.cls or isinstance(getattr_static(self.cls, "balise"), staticmethod)
        named = self._arguments(call, "balise")[0 if bound else 1 :]
        unknown = [a.name for a in named if a.name not in TELEGRAM and a.default is Parameter.empty]
        if unknown:
            raise self._refused(f"balise takes {unknown[0]!r}; of a telegram is known: {', '.join(TELEGRAM)}")
        return tuple(a.name for a in named if a.name in TELEGRAM)

    def _arguments(self, call: Callable[..., Any], what: str) -> list[Parameter]:
        try:
            arguments: Signature = signature(call)
        except (TypeError, ValueError) as error:
            raise self._refused(f"the arguments of {what} cannot be known: {error}") from error
        named = (Parameter.POSITIONAL_OR_KEYWORD, Parameter.KEYWORD_ONLY)
        return [argument for argument in arguments.parameters.values() if argument.kind in named]

    def _refused(self, why: str) -> ScenarioError:
        return ScenarioError(f"{self.where}: {self.cls.__name__}: {why}.")

    # -- an object, and its calls -----------------------------------------------------------------------------------

    def make(self, values: Mapping[str, Any]) -> Any:
        """A fresh object.

        Args:
            values: of parameters that are not at their defaults.

        Raises:
            PythonModelError: it cannot be made, or the given instance cannot be copied.
        """
        if self.stated is self.cls:
            try:
                return make(self.cls, {**self.options, **values})
            except UserFileError as error:
                raise _PythonModelError(str(error)) from error
        try:
            copy = deepcopy(self.stated)
        except Exception as error:
            raise _PythonModelError(
                f"the given instance cannot be copied for a run: {explained(error)}; give the class in its place"
            ) from error
        for name, value in values.items():
            setattr(copy, name, value)
        return copy

    def step(self, made: Any, t: float, inputs: NamedInputs, dt: float) -> Any:
        """Call ``step(t, inputs, dt)``.

        Args:
            made: the object. t: time [s]. inputs: their values. dt: length of the step [s].
        """
        return self._called("step", made.step, t, inputs, dt)

    def balise(self, made: Any, telegram: Mapping[str, float]) -> Any:
        """Call ``balise`` with what it takes of a telegram.

        Args:
            made: the object. telegram: by the names in `TELEGRAM`.
        """
        return self._called("balise", made.balise, **{name: telegram[name] for name in self.telegram or ()})

    def _called(self, what: str, call: Callable[..., Any], *arguments: Any, **named: Any) -> Any:
        try:
            return call(*arguments, **named)
        except (Exception, SystemExit) as error:
            raise _PythonModelError(f"{what} raised {explained(error, self.file)}") from error

    def output_values(self, made: Any, stated: Any, call: str, held: np.ndarray | None = None) -> np.ndarray:
        """The outputs after a call: out of the mapping that it returned, else attributes of their names.

        Args:
            made: the object. stated: what the call returned. call: its name, for messages; empty before the first step.
            held: values of the outputs that are to stay where nothing is said of them, shape (q,); None for none.

        Returns:
            Values of all outputs one after the other, shape (q,).

        Raises:
            PythonModelError: an output is missing, of a wrong shape, or no finite number.
        """
        if stated is not None and not isinstance(stated, Mapping):
            raise _PythonModelError(
                f"{call} returned a {type(stated).__name__}, expected a dict of outputs or, with attributes, None"
            )
        known = [signal.name for signal in self.outputs]
        for name in stated or ():
            if name not in known:
                raise _PythonModelError(f"{call} returned {name!r}, which is no output; {nearest(str(name), known)}")
        places = slices(self.outputs)
        values = np.zeros(sum(signal.width for signal in self.outputs)) if held is None else held.copy()
        for signal in self.outputs:
            value = self._value(signal, made, stated or {}, call, held is None and call != "")
            if value is not None:
                values[places[signal.name]] = value
        return values

    def _value(
        self, signal: Signal, made: Any, stated: Mapping[str, Any], call: str, demanded: bool
    ) -> np.ndarray | None:
        """One output; None where nothing is said of it, which is refused where it is demanded."""
        if signal.name not in stated and not hasattr(made, signal.name):
            if not demanded:
                return None
            raise _PythonModelError(
                f"no output {signal.name!r}: return it from {call} in a dict, or keep it as self.{signal.name}"
            )
        found = stated[signal.name] if signal.name in stated else getattr(made, signal.name)
        try:
            value = np.asarray(found)
        except Exception as error:  # of a tensor that belongs to a graph, say
            raise _PythonModelError(f"output {signal.name!r} is no number: {explained(error)}") from error
        expected = () if signal.size is None else (signal.size,)
        after = f" after {call}" if call else " before the first step"
        if value.dtype.kind not in "fiub":
            raise _PythonModelError(f"output {signal.name!r} is no number{after}: {found!r}")
        if value.shape != expected:
            wanted = "one number, shape ()" if expected == () else f"shape {expected}"
            raise _PythonModelError(f"output {signal.name!r} has shape {value.shape}{after}, expected {wanted}")
        if not (np.isfinite(value) | (signal.can_be_missing & np.isnan(value))).all():
            raise _PythonModelError(f"output {signal.name!r} is {value}{after}, expected finite numbers")
        return value

    def save(self, made: Any) -> Any:
        """A copy of the object's state, by its ``get_state`` where it has one.

        Args:
            made: the object.

        Raises:
            PythonModelError: it cannot be copied.
        """
        try:
            return deepcopy(made.get_state() if hasattr(made, "get_state") else made)
        except Exception as error:
            raise _PythonModelError(self._not_copied(made, error)) from error

    def restore(self, made: Any, state: Any) -> Any:
        """The object in a saved state, which stays as it is.

        Args:
            made: the object. state: from `save`.
        """
        if not hasattr(made, "get_state"):
            return deepcopy(state)
        self._called("set_state", made.set_state, deepcopy(state))
        return made

    def _not_copied(self, made: Any, error: Exception) -> str:
        if hasattr(made, "get_state"):
            return f"what get_state returns cannot be copied: {explained(error, self.file)}"
        culprits = [name for name, value in getattr(made, "__dict__", {}).items() if not _copies(value)]
        which = f"self.{culprits[0]}" if culprits else "it"
        return f"{which} cannot be copied ({error}); write get_state() and set_state(state), which leave it out"


def _copies(value: Any) -> bool:
    try:
        deepcopy(value)
    except Exception:  # whatever a copy of it raises
        return False
    return True


def _signal(name: str, stated: Any, causality: Causality) -> Signal:
    if isinstance(stated, Signal):
        return stated
    unit, size = stated if isinstance(stated, tuple) else (stated, None)
    if not isinstance(unit, str | None) or not (size is None or (isinstance(size, int) and size > 0)):
        raise TypeError(f"{name!r} has {stated!r}")
    if unit:
        parse_unit(unit)  # refuses what is none
    return Signal(name, unit or UNKNOWN_UNIT, causality, size=size)


def is_python_model(found: Any) -> bool:
    """Whether an object, or the instances of a class, can be stepped by ``step(t, inputs, dt)``.

    Args:
        found: the object or the class.
    """
    return callable(getattr(found, "step", None))


def slices(signals: Sequence[Signal]) -> dict[str, slice]:
    """Where each signal lies in an array of all of them.

    Args:
        signals: in order.
    """
    ends = np.cumsum([signal.width for signal in signals])
    return {s.name: slice(int(end) - s.width, int(end)) for s, end in zip(signals, ends, strict=True)}
