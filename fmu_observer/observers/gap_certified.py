"""What every observer corrected by samples answers: whether its gains are stable for gaps up to a given length.

It knows hybrid systems and certificates, and nothing of models or of how an observer corrects itself.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from dataclasses import replace
from math import isfinite
from typing import Any

import numpy as np

from fmu_observer.certificates.certificate import Certificate
from fmu_observer.certificates.observer_limits import Limit
from fmu_observer.observers.innovation_gate import GATE_PARAMETERS
from fmu_observer.observers.parameter_values import Value, parameter_values
from plant_models.hybrid import HybridSystem, Signal

_ASKED_GAP = 1.0  # [s] of the certificate behind `limits`, which looks much further than that


class GapCertified(HybridSystem):
    """A hybrid system with a certificate for sampling gaps; a subclass writes `error_certificate`."""

    def sampled_events(self, p: Any) -> tuple[str, ...]:
        """Events between which the gaps lie that the certificate is about: all that are told from outside."""
        return tuple(event.name for event in self.triggered_events)

    @abstractmethod
    def error_certificate(self, max_gap: float, p: Any) -> Certificate:
        """Certificate of the estimation error for gaps up to `max_gap` [s], gains from the named tuple `p`."""

    def certify(
        self, max_gap: float, parameters: Mapping[str, Value] | None = None, preset: str | None = None
    ) -> Certificate:
        """Exact stability check of the gains in use for sampling gaps up to `max_gap`.

        Args:
            max_gap: longest expected time between two samples [s].
            parameters: values by name that replace those of the preset, scalars or whole vectors (``theta``,
                ``high_gain[1]``, ``high_gain``).
            preset: preset to start from; by default the observer's own default.

        Returns:
            The certificate; ask its `holds` and `explain()`.

        Raises:
            ValueError: the gap is not positive and finite, a parameter is unknown, not finite or of another size, or
            the preset
                is unknown.
        """
        if not (isfinite(max_gap) and max_gap > 0.0):
            raise ValueError(f"{self.name}: max_gap must be positive and finite [s], got {max_gap!r}.")
        values = self.unpack_parameters(parameter_values(self, parameters, preset))
        certificate = self.error_certificate(float(max_gap), values)
        chosen = preset or self.default_preset or "declared starts"
        event = next((e.name for e in self.triggered_events if len(self.triggered_events) == 1), "sample")
        deciding = self._deciding_values(values)
        return replace(certificate, observer=self.name, preset=chosen, parameters=deciding, event=event)

    def limits(self, parameters: Mapping[str, Value] | None = None, preset: str | None = None) -> tuple[Limit, ...]:
        """Gaps by the certificate: first constant one that is unstable, and up to which every mixture is covered.

        Args:
            parameters: values by name that replace those of the preset. preset: to start from; None for the default.

        Raises:
            ValueError: as `certify`.
        """
        return _limits_of(self.certify(_ASKED_GAP, parameters, preset))

    def deciding_parameters(self) -> tuple[Signal, ...]:
        """What the certificate names as the values it judged: all parameters but the timing, unless a subclass knows
        better.
        """
        return tuple(s for s in self.parameters if s.name != "sample_period" and not _is_gate_parameter(s))

    def _deciding_values(self, values: Any) -> tuple[tuple[str, float], ...]:
        return tuple(
            (name, float(value))
            for signal in self.deciding_parameters()
            for name, value in zip(signal.scalar_names, np.atleast_1d(getattr(values, signal.name)), strict=True)
        )


def _limits_of(certificate: Certificate) -> tuple[Limit, ...]:
    """The limits that a certificate found on its way.

    Args:
        certificate: of an observer.
    """
    about = f"gaps up to {certificate.horizon:.4g} s; {certificate.error_model}"
    return (
        Limit(
            f"constant gap between {certificate.event}s",
            exact=certificate.constant_limit,
            searched_to=certificate.horizon,
            exact_test=f"certificate, first gap at which the error grows, {about}",
        ),
        Limit(
            f"mixed gaps between {certificate.event}s",
            exact=certificate.aperiodic_limit,
            searched_to=certificate.horizon,
            exact_test="certificate, longest gap up to which one Lyapunov function covers every mixture",
        ),
    )


def _is_gate_parameter(signal: Signal) -> bool:
    """Whether a parameter is one of the gate, which no question of stability depends on."""
    return signal.name in {s.name for s in GATE_PARAMETERS}
