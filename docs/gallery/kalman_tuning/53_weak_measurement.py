"""Extended and unscented Kalman filter on a falling pendulum whose angle is hardly measured, over many seeds."""

from __future__ import annotations

from pendulums import Cell, compare
from shared.sheet import Sheet

NAME = "cart_pendulum"
CELLS = {
    "10 ms, free fall, angle all but unmeasured": (Cell(NAME, 0.01, 1e-6, (1e-2, 10.0), 100), 0.757),
}


def main() -> None:
    """Ratios of the mean squared errors over all states."""
    sheet = Sheet(
        __file__,
        "One pendulum, its angle hardly measured: mean squared error of the unscented over the extended filter",
        "Allaoui 2024, section IV.2.1; the case is ours",
    )
    compare(sheet, CELLS, "remarkably below 1, in words", 1.8)


if __name__ == "__main__":
    main()
