"""A sealed FMU as what is calibrated: runs in processes of their own, in which it stays loaded."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from cosim.calibration.fmu_run import FmuRun, ReadSignals, SealedFmu
from cosim.calibration.job_runs import JobRuns
from cosim.calibration.recorded_signals import CalibrationError, RecordedSignals
from cosim.components.stated_units import stated_units
from cosim.runs.executors import make_executor
from cosim.runs.journal import Journal
from fmus.fmi.standard import Interface
from fmus.fmi.units import NamedUnit

CALL_TIMEOUT = 60.0
"""How long a call of an FMU may last [s], unless somebody says otherwise."""


class FmuRuns(JobRuns):
    """Runs of an FMU of either interface type: reset, parameters set, driven by the recorded inputs. An FMU that
    crashes or hangs takes its process along, which is replaced, and one run has failed.

    Args:
        path: the ``.fmu`` file. names: parameters to fit, or start values of states.
        fixed: other start values by name. guesses: first guesses by name, where the FMU's own are not wanted.
        interface: ``co-simulation`` or ``model-exchange``; None for co-simulation where the FMU has it.
        step: longest communication step [s]; None for the sampling of the recording.
        call_timeout: how long a call of the FMU may last [s]; inf for any time, None for ten minutes.
        workers, scheduler: where it is run, see `make_executor`.
        journal: that runs are written to and taken over from; None for none.
        units: what is known of the variables of the FMU and not declared, as in a scenario file.

    Raises:
        CosimError: a parameter does not exist or cannot be set, or the FMU cannot be opened.
        RunError: the cluster cannot be used.
    """

    def __init__(
        self,
        path: str | Path,
        names: Sequence[str],
        *,
        fixed: Mapping[str, float] | None = None,
        guesses: Mapping[str, float] | None = None,
        interface: Interface | None = None,
        step: float | None = None,
        call_timeout: float | None = CALL_TIMEOUT,
        workers: int = 1,
        scheduler: str | None = None,
        journal: Journal | None = None,
        units: Mapping[str, Any] | None = None,
    ) -> None:
        if call_timeout is not None and not call_timeout > 0.0:
            raise CalibrationError(f"call_timeout {call_timeout!r}: expected seconds above 0.")
        super().__init__(str(path), make_executor(workers, scheduler, apart=True), journal)
        self._step = step
        everything = dict.fromkeys(names, 0.0) | dict(guesses or {}) | dict(fixed or {})
        stated = tuple(stated_units(units or {}).items())
        self._fmu = SealedFmu(str(path), interface, tuple(everything.items()), call_timeout, stated)
        try:
            self._signals = self.row_of(ReadSignals(self._fmu, dict.fromkeys(names, 0.0)))
        except BaseException:
            self.close()
            raise
        self.outputs, self.inputs, self.discrete = self._signals.outputs, self._signals.inputs, self._signals.discrete
        self.start, self.bounds = (
            {n: (guesses or {}).get(n, v) for n, v in self._signals.start.items()},
            self._signals.bounds,
        )

    def unit(self, name: str) -> str:
        """Unit of an output, input or parameter as the FMU names it, empty where it names none.

        Args:
            name: of it.
        """
        unit = self._signals.units[name]
        return "" if unit is None else unit.name

    def named_unit(self, name: str) -> NamedUnit | None:
        """What the unit of a signal is, by the definitions of the FMU; see `Runs.named_unit`."""
        unit: NamedUnit | None = self._signals.units[name]
        return unit

    def job(self, values: Mapping[str, float], recorded: RecordedSignals) -> FmuRun:
        """A run of the FMU, see `JobRuns.job`."""
        driving = replace(recorded, measured=dict.fromkeys(recorded.measured, np.zeros(0)))
        return FmuRun(self._fmu, values, driving, self._step)
