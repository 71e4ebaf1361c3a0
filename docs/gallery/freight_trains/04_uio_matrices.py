"""The discrete matrices of the unknown-input observer, as printed and as they follow from the printed model:
(3.89)-(3.91).
"""

from __future__ import annotations

import numpy as np
from shared.sheet import Sheet

from fmu_observer.design.uio_design import discretise, uio_matrices

MASS, SPEED, PERIOD = 90e3, 50.0 / 3.6, 0.1
PRINTED = np.array(
    [
        [1, 0.1, 0.1, 0.005, 0.005, 0.0002],
        [0, 0.9999, 0, 0.1, 0, 0.005],
        [0, 0, 1, 0, 0.1, 0],
        [0, 0, 0, 1, 0, 0.1],
        [0, 0, 0, 0, 1, 0],
        [0, 0, 0, 0, 0, 1],
    ]
)
WRONG_COLUMN = "printed with the disturbance in column 3; in column 4 the printed A_d comes out, to its rounding"


def main() -> None:
    """Largest difference to the print and the rank of observability, for both readings."""
    sheet = Sheet(__file__, "Matrices of the unknown-input observer", "Bouchama 2024, (3.88)-(3.91)")
    A, B = uio_matrices(MASS, (32.4 + 1.65287 * SPEED) / MASS)
    printed = A.copy()
    printed[1, 2], printed[1, 3] = 1.0, 0.0
    C = np.eye(2, 6)
    for reading, matrix in {"repaired": A, "as printed": printed}.items():
        A_d, B_d = discretise(matrix, B, PERIOD)
        rank = np.linalg.matrix_rank(np.vstack([C @ np.linalg.matrix_power(A_d, k) for k in range(6)]))
        sheet.add(
            f"largest difference of A_d to the print, {reading}",
            "1",
            0.0,
            float(np.abs(A_d - PRINTED).max()),
            WRONG_COLUMN,
        )
        sheet.add(f"rank of observability, {reading}", "1", 6.0, float(rank), WRONG_COLUMN)
        if reading == "repaired":
            sheet.add("second entry of B_d", "1e-5", 0.1111, 1e5 * B_d[1])
    sheet.finish()


if __name__ == "__main__":
    main()
