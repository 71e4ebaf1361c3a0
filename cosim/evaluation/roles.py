"""Signals by the role they play: what a report asks of a result, None where it was not recorded. Imports NumPy only."""

from __future__ import annotations

from typing import Literal

import numpy as np

from cosim.evaluation.spec import Phase, ReportSpec
from cosim.results.result import Result
from plant_models.hybrid.units import UnitError, conversion, parse_unit

Quantity = Literal["speed", "position"]

UNITS = {"speed": "m/s", "position": "m"}


def recorded(result: Result, name: str | None) -> np.ndarray | None:
    """Values of a signal, shape (rows,), or None where `name` is None or was not recorded.

    Args:
        result: the run.
    """
    return result[name] if name is not None and name in (result.table.dtype.names or ()) else None


def estimate(result: Result, observer: str, signal: str) -> np.ndarray | None:
    """What an observer said of a quantity, shape (rows,), or None where it was not recorded or is of another kind: the
    ``speed`` of a motor in rad/s is no speed of a train.

    Args:
        result: the run.
        observer: name of its component.
        signal: the quantity, as the outputs of observers are called.
    """
    name = f"{observer}.{signal}"
    return None if _of_another_kind(result, name, UNITS.get(signal)) else recorded(result, name)


def _of_another_kind(result: Result, name: str, wanted: str | None) -> bool:
    """Whether a recorded signal has a unit, and none that is convertible to the wanted one."""
    unit = next((s.unit for s in result.signals if s.name == name), "1")
    if wanted is None or unit == "1":
        return False
    try:
        conversion(parse_unit(unit), parse_unit(wanted))
    except UnitError:
        return True
    return False


def estimation_error(result: Result, spec: ReportSpec, observer: str, quantity: Quantity) -> np.ndarray | None:
    """Estimate minus true value: speed [m/s] or position [m], shape (rows,), or None where one of them was not
    recorded.

    Args:
        result: the run.
        spec: roles of the signals, labels, phases and zones.
        observer: name of its component.
        quantity: ``speed`` or ``position``.
    """
    true = recorded(result, spec.true_speed if quantity == "speed" else spec.true_position)
    believed = estimate(result, observer, quantity)
    if true is None or believed is None:
        return None
    with np.errstate(invalid="ignore", over="ignore"):  # inf - inf: the caller treats NaN as diverged
        return np.asarray(believed - true)


def coupler_force(result: Result, signal: str | None) -> np.ndarray | None:
    """Force in the first coupler beside a signal of the same component [N], shape (rows,), or None where there is none.

    Args:
        result: the run. signal: any signal of the component, ``component.signal``.
    """
    component = "" if signal is None else signal.rpartition(".")[0]
    name = f"{component}.coupler_force"
    first = recorded(result, name)
    return recorded(result, f"{name}[1]") if first is None else first


def label(spec: ReportSpec, observer: str) -> str:
    """Text to show for an observer.

    Args:
        spec: labels.
        observer: name of its component.
    """
    return spec.labels.get(observer, observer)


def phases(result: Result, spec: ReportSpec) -> list[Phase]:
    """The phases to be judged; the whole run where the specification names none.

    Args:
        result: the run.
        spec: roles of the signals, labels, phases and zones.
    """
    if spec.phases or not len(result.time):
        return list(spec.phases)
    return [Phase("whole run", float(result.time[0]), float(result.time[-1]))]
