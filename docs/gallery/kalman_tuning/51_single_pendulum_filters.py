"""Extended and unscented Kalman filter on the cart with one pendulum: Figs 4.4 to 4.8 show curves and no number."""

from __future__ import annotations

from pendulums import Cell, compare
from shared.sheet import Sheet

NAME = "cart_pendulum"
CELLS = {
    "1 ms, held upright": (Cell(NAME, 1e-3, 1e-6, 1e-2, 2, held=True), 0.997),
    "1 ms, free fall": (Cell(NAME, 1e-3, 1e-6, 1e-2, 2), 1.001),
    "50 ms, free fall, q 1e-4, r 0.1": (Cell(NAME, 0.05, 1e-4, 0.1, 40), 0.924),
    "50 ms, free fall, q 1e-3, r 0.1": (Cell(NAME, 0.05, 1e-3, 0.1, 40), 0.966),
}


def main() -> None:
    """Ratios of the mean squared errors over all states."""
    sheet = Sheet(
        __file__,
        "One pendulum: mean squared error of the unscented over the extended filter",
        "Allaoui 2024, section IV.2.1, Figs 4.4 to 4.8",
    )
    compare(sheet, CELLS, "remarkably below 1, in words")


if __name__ == "__main__":
    main()
