"""Davis coefficients that were published per unit mass, each with the speeds in which it holds.

Numbers only; the forces stand in `resistance`.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class DavisSet:
    """Coefficients of ``w(v) = a + b v + c v^2`` of a train of unit mass.

    Args:
        a: constant part [m/s2]. b: viscous part [1/s]. c: aerodynamic part [1/m]; negative in a fit to a short range.
        fitted_from: lowest speed of the fit [m/s]. fitted_to: highest speed of the fit [m/s].
        origin: where the set stands, and who states its range.
        effort_coefficient: factor b_T = b_B between relative effort and force [1].
        adhesion_level: share of the dry adhesion on the rails on which it was measured [1].
    """

    a: float
    b: float
    c: float
    fitted_from: float
    fitted_to: float
    origin: str
    effort_coefficient: float = 1.0
    adhesion_level: float = 1.0

    def resistance(self, speed: float) -> float:
        """``w(v)`` [m/s2] for a speed [m/s] that is not negative.

        Args:
            speed: of the train [m/s].
        """
        return self.a + self.b * speed + self.c * speed * speed

    @property
    def zero_crossing(self) -> float | None:
        """The speed [m/s] above which the set pulls the train; None where it never does."""
        if self.c >= 0.0:
            return None
        root = (self.b * self.b - 4.0 * self.a * self.c) ** 0.5
        return float((-self.b - root) / (2.0 * self.c))


ADHESION_LEVELS = {"dry": 1.0, "LoA": 0.5, "BaA": 0.3, "EBA": 0.1}
"""Share of the dry adhesion [1] at low (rain), bad (rain and leaves) and extremely bad adhesion. The thesis names the
levels and gives no numbers; these are ours."""

DAVIS_SETS = {
    "set_a": DavisSet(0.01, 0.1, 0.001, 0.0, 50.0, "section 3.2.3, stopping control; range ours", 0.1),
    "set_b": DavisSet(0.02, 0.003, -0.00024, 0.0, 17.0, "section 3.3.4, plant; range ours, up to where it pulls"),
    "set_b_observer": DavisSet(
        0.016, 0.0024, -0.000192, 0.0, 17.0, "section 3.3.4, what the observer believes, 20 % less; range ours"
    ),
    "set_c": DavisSet(0.0852, 0.04, -5e-5, 0.0, 50.0, "section 4.3.4; range ours"),
    "set_d": DavisSet(
        0.46, 5.7e-3, -2.4e-4, 5.0, 50.0, "Table 5.1, low adhesion LoA", adhesion_level=ADHESION_LEVELS["LoA"]
    ),
    "set_e": DavisSet(
        0.35, 3e-3, -1e-4, 5.0, 50.0, "Table 5.1, bad adhesion BaA", adhesion_level=ADHESION_LEVELS["BaA"]
    ),
    "set_f": DavisSet(
        0.25, 5e-3, -2e-4, 5.0, 50.0, "Table 5.1, extremely bad adhesion EBA", adhesion_level=ADHESION_LEVELS["EBA"]
    ),
}
"""Sets by the name of their preset. Source: Aguiar Cota 2019, sections 3.2.3, 3.3.4, 4.3.4 and Table 5.1."""
