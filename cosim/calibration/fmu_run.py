"""A run of a sealed FMU as a job. The FMU stays loaded in the process that does it, for the runs that follow."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cached_property
from hashlib import sha256
from itertools import pairwise
from math import ceil, inf
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from cosim.calibration.recorded_signals import CalibrationError, RecordedSignals
from cosim.components.stated_units import StatedUnit
from cosim.fmu_model.opening import open_model
from cosim.fmu_model.sealed import SealedModel
from cosim.process.exit_guard import limited_calls
from cosim.process.last_call import LAST_CALL, READ, STEP, WRITE
from cosim.runs.job import Job
from cosim.runs.keys import digest, version_text
from cosim.scenario.origin import ForeignFile
from fmus.fmi.standard import Interface
from fmus.fmi.types import is_continuous, why_not_set
from fmus.fmi.units import NamedUnit, Units
from plant_models.disk_cache.files import file_digest

Array = NDArray[np.float64]


@dataclass(frozen=True)
class SealedFmu:
    """An FMU and how it is opened.

    Args:
        path: of the file. interface: None for co-simulation where the FMU has it. parameters: start values by name, in
            an order. call_timeout: how long a call of it may last [s]; inf for any time, None for ten minutes.
        units: what is stated of its variables, by name.
    """

    path: str
    interface: Interface | None
    parameters: tuple[tuple[str, float], ...]
    call_timeout: float | None
    units: tuple[tuple[str, StatedUnit], ...] = ()

    @property
    def name(self) -> str:
        """What it is called in words about its calls."""
        return Path(self.path).stem

    @contextmanager
    def opened(self) -> Iterator[SealedModel]:
        """It as a model, which stays open in this process until another one is opened, or something goes wrong."""
        with limited_calls(self.call_timeout):
            if self not in _open:
                _close()
                with LAST_CALL.making(self.name, "loading, instantiate or initialisation"):
                    known: dict[str, Any] = {"parameters": dict(self.parameters), "units": dict(self.units)}
                    _open[self] = open_model(self.path, self.interface, states=(), **known)
            try:
                yield _open[self]
            except BaseException:  # perhaps it can do nothing any more
                _close()
                raise
            finally:
                LAST_CALL.call[0] = 0


_open: dict[SealedFmu, SealedModel] = {}
"""The one that this process has open."""


def _close() -> None:
    while _open:
        _open.popitem()[1].close()


class Signals(NamedTuple):
    """What a calibration needs to know of an FMU.

    Attributes:
        outputs: names. inputs: names. discrete: inputs that are no continuous ones. units: of outputs, inputs
            and parameters by name. start: of the parameters by name. bounds: lowest and highest value of the
            parameters by name.
    """

    outputs: tuple[str, ...]
    inputs: tuple[str, ...]
    discrete: tuple[str, ...]
    units: Mapping[str, NamedUnit | None]
    start: Mapping[str, float]
    bounds: Mapping[str, tuple[float, float]]


@dataclass(frozen=True, eq=False)
class _FmuJob(Job):
    """A job of an FMU.

    Args:
        fmu: of which. settings: parameters by name.
    """

    fmu: SealedFmu
    settings: Mapping[str, float]

    @property
    def key(self) -> str:
        """Digest of the contents of the FMU, of how it is opened, and of the versions, with the settings."""
        opened = repr(
            (self.fmu.name, self.fmu.interface, self.fmu.parameters, self.fmu.units, sorted(self.settings.items()))
        )
        return digest(file_digest(Path(self.fmu.path)), opened, version_text())

    def files(self) -> Sequence[ForeignFile]:
        """The FMU."""
        return [ForeignFile("fmu", Path(self.fmu.path).resolve())]

    def moved(self, places: Mapping[str, str]) -> Job:
        """The same job of the FMU at another place."""
        return replace(self, fmu=replace(self.fmu, path=places["fmu"]))


class ReadSignals(_FmuJob):
    """What the description of an FMU says of its signals and of the parameters in the settings, as `Signals`; arguments
    as for its base.
    """

    def do(self) -> Signals:
        """Raises: CalibrationError: a parameter cannot be set. FmuLoadError, FmuModelError: as `open_model`."""
        with self.fmu.opened() as model:
            variables, units = model.instance.variables, Units(model.instance.description)
            for name in self.settings:
                self._demand_settable(name, variables[name])
            return Signals(
                model.outputs,
                model.inputs,
                tuple(name for name in model.inputs if not is_continuous(variables[name])),
                {name: units.named(variables[name]) for name in (*model.outputs, *model.inputs, *self.settings)},
                {name: _number(variables[name].start, 0.0) for name in self.settings},
                {n: (_number(variables[n].min, -inf), _number(variables[n].max, inf)) for n in self.settings},
            )

    def _demand_settable(self, name: str, variable: Any) -> None:
        if objection := why_not_set(variable):
            raise CalibrationError(
                f"{name!r} cannot be set: it {objection}; expected a parameter or the start value of a state."
            )


@dataclass(frozen=True, eq=False)
class FmuRun(_FmuJob):
    """A run: reset, parameters set, driven by recorded inputs. Its row is the measured signals at the instants, shape
    (q, n).

    Args:
        recorded: instants, inputs and names of the signals; what was measured does not count.
        step: longest communication step [s]; None for the sampling of the recording.
    """

    recorded: RecordedSignals
    step: float | None = None

    @property
    def key(self) -> str:
        """That of the FMU with its parameters, and of the recording and the step."""
        return digest(super().key, self._driving, repr(self.step))

    @cached_property
    def _driving(self) -> str:
        """Digest of instants, inputs and names of the signals."""
        recorded = self.recorded
        series = [recorded.time, *recorded.inputs.values(), *recorded.ends.values()]
        names = repr((list(recorded.measured), list(recorded.inputs), list(recorded.ends)))
        return digest(names, *(sha256(np.ascontiguousarray(values).tobytes()).hexdigest() for values in series))

    def do(self) -> Array:
        """Simulate."""
        with self.fmu.opened() as model:
            model.set_parameters(self.settings)
            return self._simulated(model)

    def _simulated(self, model: SealedModel) -> Array:
        """The signals of the model, whose parameters are set."""
        time, call, now = self.recorded.time.tolist(), LAST_CALL.call, LAST_CALL.time
        write, read, step = (LAST_CALL.numbers(self.fmu.name) + what for what in (WRITE, READ, STEP))
        places = [model.outputs.index(name) for name in self.recorded.measured]
        found = np.empty((len(time), len(places)))
        start, first, last = self._inputs(model)
        moves = (first != last).any(axis=1).tolist()
        LAST_CALL.begin(self.fmu.name, "reset and initialisation", time[0])
        model.restart(time[0], np.zeros(0), start)
        found[0] = model.read()[1][places]
        for k, (begin, end) in enumerate(pairwise(time)):
            span = end - begin
            parts = 1 if self.step is None else max(1, ceil(span / self.step - 1e-9))
            for i in range(parts):
                call[0], now[0] = write, begin + span * i / parts
                model.set_inputs(first[k] + (last[k] - first[k]) * ((i + 0.5) / parts))
                call[0] = step
                model.advance(begin + span * i / parts, span / parts)
            now[0] = end
            if moves[k]:
                call[0] = write
                model.set_inputs(last[k])
            call[0] = read
            found[k + 1] = model.read()[1][places]
        return found.T

    def _inputs(self, model: SealedModel) -> tuple[Array, Array, Array]:
        """Inputs at the start, shape (m,), and at begin and end of each interval, shape (n - 1, m) each."""
        recorded = self.recorded
        held = np.tile(model.start_inputs, (len(recorded.time), 1))
        for name, series in recorded.inputs.items():
            held[:, model.inputs.index(name)] = series
        first, last = held[:-1].copy(), held[:-1].copy()
        for name, (begins, ends) in recorded.ends.items():
            place = model.inputs.index(name)
            first[:, place], last[:, place] = begins, ends
        return held[0], first, last


def _number(text: object, otherwise: float) -> float:
    try:
        return float(str(text))
    except ValueError:
        return otherwise
