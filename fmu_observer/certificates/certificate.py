"""The certificate: what was asked, what was found, and in plain words what it means. A value."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from math import isfinite, isinf
from typing import Any


@dataclass(frozen=True)
class Certificate:
    """Answer to: is this observer, with these gains, stable for balise gaps up to `max_gap`?

    Attributes:
        max_gap: longest gap asked for [s].
        horizon: longest gap searched for the two limits [s]; inf where what is found holds for every gap.
        constant_limit: first constant gap at which the error grows from balise to balise [s]; inf if none up to the
        horizon.
        aperiodic_limit: longest gap such that one common quadratic Lyapunov function covers every mixture of gaps up to
            it [s]; inf if all up to the horizon are covered, 0 if none that was tried. Between the two limits mixtures
            of gaps may make the error grow.
        spectral_radius: largest factor per balise at the constant gap `max_gap` [1].
        quadratic_margin: smallest relative decrease of the Lyapunov function over all gaps up to `max_gap`, recomputed
            on a grid much finer than the one it was found on, less a bound for what lies between [1]; positive when
            certified, -inf when there is no candidate at all.
        holds: the aperiodic certificate stands at `max_gap`, and so do the further conditions in `notes`.
        error_model: the error equations used, and what they leave out.
        observer: model name. preset: preset started from. parameters: the values that decide stability.
        notes: further conditions checked.
        event: what the gaps lie between, for the words.
        lyapunov_matrix: P of the Lyapunov function ``e' P e`` at `max_gap`, rows of shape (n, n); empty when there is
        none.
    """

    max_gap: float
    horizon: float
    constant_limit: float
    aperiodic_limit: float
    spectral_radius: float
    quadratic_margin: float
    holds: bool
    error_model: str
    observer: str = ""
    preset: str = ""
    parameters: tuple[tuple[str, float], ...] = ()
    notes: tuple[str, ...] = ()
    event: str = "balise"
    lyapunov_matrix: tuple[tuple[float, ...], ...] = ()

    @property
    def certified_up_to(self) -> float:
        """Longest gap that is covered as far as was looked [s]: the end of a search is no limit, nor a proof."""
        return min(self.aperiodic_limit, self.horizon)

    def explain(self) -> str:
        """One to three plain sentences for the user, the error model included."""
        who = f"{self.observer} ({self.preset})" if self.observer else "The observer"
        notes = f" Also checked: {'; '.join(self.notes)}." if self.notes else ""
        return f"{who}: {self._verdict()}.{notes} Checked on the {self.error_model}."

    def to_dict(self) -> dict[str, Any]:
        """Plain data for a result file: names to numbers, strings and lists; infinite ones as None."""
        data = asdict(self) | {"certified_up_to": self.certified_up_to}
        for name in (
            "certified_up_to",
            "horizon",
            "constant_limit",
            "aperiodic_limit",
            "spectral_radius",
            "quadratic_margin",
        ):
            data[name] = data[name] if isfinite(data[name]) else None
        data["parameters"] = dict(self.parameters)
        data["notes"] = list(self.notes)
        data["lyapunov_matrix"] = [list(row) for row in self.lyapunov_matrix]
        return data

    def _verdict(self) -> str:
        gap = f"{self.max_gap:.4g} s"
        if self.holds:
            return (
                f"stable for every sequence of {self.event} gaps up to {gap} (limit "
                f"{self._limit(self.aperiodic_limit)})"
            )
        if self.spectral_radius >= 1.0:
            return (
                f"UNSTABLE at a constant {self.event} gap of {gap}: the error grows {self.spectral_radius:.4g} times "
                f"from "
                f"{self.event} to {self.event}; constant gaps are stable below: {self._limit(self.constant_limit)}; "
                f"mixed gaps are certified up to: {self._limit(self.aperiodic_limit)}"
            )
        return (
            f"NOT CERTIFIED for mixed {self.event} gaps up to {gap}: that constant gap is stable, but sequences of "
            f"different "
            f"gaps are certified only up to: {self._limit(self.aperiodic_limit)}"
        )

    def _limit(self, limit: float) -> str:
        if limit == 0.0:
            return "no gap at all" if self.constant_limit == 0.0 else "no gap that was tried"
        if isinf(limit):
            return "none" if isinf(self.horizon) else f"none found up to {self.horizon:.4g} s"
        return f"{limit:.4g} s"
