"""Observers whose existence and stability can be evaluated: what holds for the gains in use, as findings.

They know hybrid systems and findings, and nothing of models or of how an observer corrects itself.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from math import isfinite
from typing import Any

import numpy as np

from fmu_observer.certificates.finding import Finding
from fmu_observer.certificates.gap_findings import CONSTANT_GAP, explained_gaps
from fmu_observer.observers.innovation_gate import GATE_PARAMETERS
from fmu_observer.observers.parameter_values import Value, parameter_values, replaced_parameters
from plant_models.hybrid import HybridSystem, Signal

OTHER_GAINS = "gains that are certified"
"""What a finding is of that says what to change."""

Evaluate = Callable[[Mapping[str, Value]], Finding]


class EvaluatedObserver(HybridSystem):
    """A hybrid system with findings; a subclass writes `condition_of`, or is a `GapCertified`."""

    def condition_of(self, p: Any) -> Finding | None:
        """Existence or stability condition for the gains in the named tuple `p` of all parameters; None for none."""
        return None

    def findings(
        self, gap: float | None = None, parameters: Mapping[str, Value] | None = None, preset: str | None = None
    ) -> Iterator[Finding]:
        """What is known of existence and stability with the gains in use; the finding that decides comes first.

        They are found one by one as they are asked for: ``next(observer.findings(0.5)).holds``.

        Args:
            gap: longest time between two samples to be held against [s]; None for limits only.
            parameters: values by name that replace those of the preset, scalars or whole vectors (``theta``,
                ``high_gain[1]``, ``high_gain``).
            preset: to start from; None for the observer's own default.

        Raises:
            ValueError: the gap is not positive and finite, a parameter is unknown, not finite or of another size, or
                the preset is unknown.
        """
        if gap is not None and not (isfinite(gap) and gap > 0.0):
            raise ValueError(f"{self.name}: gap must be positive and finite [s], got {gap!r}.")
        values = parameter_values(self, parameters, preset)
        return self._found(gap, values, preset)

    def limit_findings(self, values: np.ndarray) -> Iterator[Finding]:
        """Limits beside the finding that decides: bounds as printed, exact ones, and those that runs are to find.

        Args:
            values: of all parameters, shape (k,).
        """
        return iter(())

    def _found(self, gap: float | None, values: np.ndarray, preset: str | None) -> Iterator[Finding]:
        condition = self.condition_of(self.unpack_parameters(values))
        if condition is not None:
            yield condition
        yield from self.limit_findings(values)


class GapCertified(EvaluatedObserver):
    """An observer with a finding about sampling gaps, which decides; a subclass writes `gap_finding`."""

    @property
    def usual_gap(self) -> float:
        """Held against where no gap is asked for [s]; limits are searched for much further than that."""
        return 1.0

    def sampled_events(self, p: Any) -> tuple[str, ...]:
        """Events between which the gaps lie: all that come from outside."""
        return tuple(event.name for event in self.triggered_events)

    @abstractmethod
    def gap_finding(self, gap: float, p: Any) -> Finding:
        """What is found about the estimation error for gaps up to `gap` [s], gains from the named tuple `p`."""

    def alternative(self, gap: float, p: Any, evaluate: Evaluate) -> str | None:
        """Clause that names certified gains for a gap [s], such as ``theta at most 3.91 is certified for 1.02 s``.

        Args:
            gap: longest one [s]. evaluate: changes to the values in use.

        Returns:
            The clause; None where none are known.
        """
        return None

    def limit_findings(self, values: np.ndarray) -> Iterator[Finding]:
        """The first constant gap at which the error grows."""
        constant = self._of_gaps(self.usual_gap, values).condition(CONSTANT_GAP)
        yield replace(constant, what=f"constant {self._gap_event(values)} gap")

    def deciding_parameters(self) -> tuple[Signal, ...]:
        """Those that decide stability: all but the timing, unless a subclass knows better."""
        others = {"sample_period", *(s.name for s in GATE_PARAMETERS)}
        return tuple(s for s in self.parameters if s.name not in others)

    def deciding_values(
        self, parameters: Mapping[str, Value] | None = None, preset: str | None = None
    ) -> dict[str, float]:
        """Values that decide stability, by scalar name.

        Args:
            parameters: values by name that replace those of the preset. preset: to start from; None for the default.

        Raises:
            ValueError: a parameter or the preset is unknown or not legal.
        """
        values = self.unpack_parameters(parameter_values(self, parameters, preset))
        return {
            name: float(value)
            for signal in self.deciding_parameters()
            for name, value in zip(signal.scalar_names, np.atleast_1d(getattr(values, signal.name)), strict=True)
        }

    def _gap_event(self, values: np.ndarray) -> str:
        """What the gaps lie between."""
        events = self.sampled_events(self.unpack_parameters(values))
        return events[0] if len(events) == 1 else "sample"

    def _found(self, gap: float | None, values: np.ndarray, preset: str | None) -> Iterator[Finding]:
        found = self._of_gaps(self.usual_gap if gap is None else gap, values)
        event = self._gap_event(values)
        found = replace(found, what=f"mixed {event} gaps")
        if gap is None:
            yield replace(found, holds=None, demand=None)
        else:
            who = f"{self.name} ({preset or self.default_preset or 'declared starts'})"
            yield replace(found, explanation=explained_gaps(found, who, event))
            if not found.holds:
                yield from self._other_gains(gap, values)
        yield from super()._found(gap, values, preset)

    def _other_gains(self, gap: float, values: np.ndarray) -> Iterator[Finding]:
        def evaluate(gains: Mapping[str, Value]) -> Finding:
            return self._of_gaps(gap, replaced_parameters(self, values, gains))

        clause = self.alternative(gap, self.unpack_parameters(values), evaluate)
        if clause is not None:
            yield Finding(OTHER_GAINS, gap, "s", "sufficient", "the same search", True, clause)

    def _of_gaps(self, gap: float, values: np.ndarray) -> Finding:
        return self.gap_finding(float(gap), self.unpack_parameters(values))
