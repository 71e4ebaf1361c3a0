"""Estimated Davis coefficients with their intervals, as numbers, in words and as a table of parameters."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fmu_observer.identification.acceleration_run import Array


class IdentificationError(ValueError):
    """A run from which nothing can be identified, or numbers that cannot be; says what would do."""


@dataclass(frozen=True)
class Coefficient:
    """One estimated number.

    Args:
        name: of the parameter. unit: of it. value: the estimate. low, high: the ends of its confidence interval.
        meaning: what it is.
        weight: what one unit of it changes in the acceleration at the highest speed of the run.
        identified: whether the interval is narrow enough to be of use, see `DavisEstimate.resolution`.
    """

    name: str
    unit: str
    value: float
    low: float
    high: float
    meaning: str
    weight: float
    identified: bool

    @property
    def half_width(self) -> float:
        """Half of the interval, in the unit of the coefficient."""
        return 0.5 * (self.high - self.low)

    @property
    def uncertainty(self) -> float:
        """What half of the interval stands for: a change of the acceleration at the highest speed [m/s2]."""
        return self.half_width * self.weight


@dataclass(frozen=True)
class DavisEstimate:
    """What an acceleration run tells of the running resistance w0 + w1 v + w2 v^2.

    Args:
        net_acceleration: effort less w0, by mass [m/s2]: always identifiable.
        davis_a: w0; None where the effort is not known.
        davis_b: w1. davis_c: w2. Units are those of the parameters of a plant: N, N.s/m and N.s2/m2 with a mass, m/s2,
            1/s and 1/m without.
        mass: [kg], rotating parts included; None for coefficients by mass.
        level: of the intervals. resolution: an interval that changes the acceleration at the highest speed of the run
            by more than this is called not identified [m/s2].
        noise: standard deviation of the residuals [m/s], or of the acceleration [m/s2] in a regression.
        points: samples used. speeds: lowest and highest speed of the fit [m/s]. duration: of the part used [s].
        condition: condition number of the scaled sensitivities. confusion: correlation of the estimates of w1 and w2.
        correlation: of neighbouring residuals.
        remarks: what the user has to know, in words.
        time: of the samples used [s], shape (n,); speeds of them in a regression on given accelerations.
        measured: what was measured there [m/s], shape (n,). residuals: measured less fitted, shape (n,).
    """

    net_acceleration: Coefficient
    davis_a: Coefficient | None
    davis_b: Coefficient
    davis_c: Coefficient
    mass: float | None
    level: float
    resolution: float
    noise: float
    points: int
    speeds: tuple[float, float]
    duration: float
    condition: float
    confusion: float
    correlation: float
    remarks: tuple[str, ...]
    time: Array
    measured: Array
    residuals: Array

    @property
    def coefficients(self) -> tuple[Coefficient, ...]:
        """All estimates, the net acceleration first; without davis_a where the effort is not known."""
        found = (self.net_acceleration, self.davis_a, self.davis_b, self.davis_c)
        return tuple(coefficient for coefficient in found if coefficient is not None)

    @property
    def identified(self) -> bool:
        """Whether all of them are identified."""
        return all(coefficient.identified for coefficient in self.coefficients)

    def resistance(self, speed: Array) -> Array:
        """The running resistance at given speeds, without w0 where the effort is not known.

        Args:
            speed: [m/s], any shape.

        Returns:
            In N with a mass, in m/s2 without, the shape of `speed`.
        """
        constant = 0.0 if self.davis_a is None else self.davis_a.value
        return np.asarray(constant + self.davis_b.value * speed + self.davis_c.value * speed**2)

    def toml(self) -> str:
        """Parameters of a plant or an observer, to be pasted into a scenario below ``[components.NAME]``."""
        lines = ["parameters.mass = 1.0" if self.mass is None else f"parameters.mass = {self.mass!r}"]
        if self.davis_a is None:
            lines.append("# davis_a: not identifiable without the effort")
        for coefficient in self.coefficients[1:]:
            interval = f"{coefficient.low:.4g} to {coefficient.high:.4g} {coefficient.unit}"
            comment = interval if coefficient.identified else f"not identified: {interval}"
            lines.append(f"parameters.{coefficient.name} = {coefficient.value:.6g}  # {comment}")
        return "\n".join(lines) + "\n"
