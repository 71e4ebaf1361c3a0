"""Observers that say under which condition they exist or are stable, as numbers, for the gains in use."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from typing import Any

from fmu_observer.certificates.condition import Condition
from fmu_observer.observers.parameter_values import Value, parameter_values
from plant_models.hybrid import HybridSystem


class JudgedObserver(HybridSystem):
    """A hybrid system with a condition; a subclass writes `condition_of`."""

    @abstractmethod
    def condition_of(self, p: Any) -> Condition:
        """The condition for the gains in the named tuple `p` of all parameters."""

    def condition(self, parameters: Mapping[str, Value] | None = None, preset: str | None = None) -> Condition:
        """Existence or stability condition, as numbers, for the gains of a preset with some replaced.

        Args:
            parameters: values by name that replace those of the preset. preset: to start from; None for the default.

        Raises:
            ValueError: a parameter is unknown, not finite or of another size, or the preset is unknown.
        """
        return self.condition_of(self.unpack_parameters(parameter_values(self, parameters, preset, "to judge")))
