"""The condition of an observer with some parameters replaced, and gains that it advises, for tests."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from fmu_observer.certificates.finding import Finding
from fmu_observer.observers.evaluated_observer import OTHER_GAINS
from fmu_observer.observers.parameter_values import parameter_values


def own_condition(observer: Any, parameters: Mapping[str, Any] | None = None, preset: str | None = None) -> Finding:
    """Its `condition_of` for the values in use."""
    p = observer.unpack_parameters(parameter_values(observer, parameters, preset))
    found: Finding = observer.condition_of(p)
    return found


def other_gains(observer: Any, gap: float, parameters: Mapping[str, Any] | None = None) -> str:
    """What it advises in place of gains that are not certified."""
    found = observer.findings(gap, parameters)
    assert not next(found).holds
    advice: Finding = next(found)
    assert (advice.what, advice.holds) == (OTHER_GAINS, True)
    return advice.statement
