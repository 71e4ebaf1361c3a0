"""Extended and unscented Kalman filter on the double pendulum: Figs 4.11 to 4.17 show curves and no number."""

from __future__ import annotations

from pendulums import Cell, compare
from shared.sheet import Sheet

NAME, FALLING = "cart_double_pendulum", (0.3, -0.2)
CELLS = {
    "1 ms, held upright": (Cell(NAME, 1e-3, 1e-6, 1e-2, 2, held=True, start=(0.05, -0.03), length=1.0), 1.001),
    "1 ms, free fall": (Cell(NAME, 1e-3, 1e-6, 1e-2, 2, start=FALLING, length=2.0), 1.003),
    "10 ms, free fall, q 1e-3, r 0.1": (Cell(NAME, 0.01, 1e-3, 0.1, 10, start=FALLING, length=3.0), 0.961),
}


def main() -> None:
    """Ratios of the mean squared errors over all states."""
    sheet = Sheet(
        __file__,
        "Double pendulum: mean squared error of the unscented over the extended filter",
        "Allaoui 2024, section IV.2.2, Figs 4.11 to 4.17",
    )
    compare(sheet, CELLS, "slightly below 1, in words")


if __name__ == "__main__":
    main()
