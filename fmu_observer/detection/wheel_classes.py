"""Classes of a rolling wheel's record, trained: how the odometer's reading changes when its wheel begins to be wrong.

The numbers come from `docs/gallery/moving_horizon/wheel_records.py`; a test trains them again.
"""

from __future__ import annotations

import numpy as np

from fmu_observer.formulas.signatures.classification import Plane, SearchStage, SignatureClassifier
from fmu_observer.formulas.signatures.clouds import Coordinate, Separation

STEADY, DROP, RISE = "steady", "drop", "rise"
CHANGES = 4
"""Changes from reading to reading in a record."""

_PLANE_1 = Plane(
    (
        Coordinate(2, "max_eta", 10.0, "norm"),
        Coordinate(2, "range_xi", 0.1, "norm"),
    ),
    np.array([0.48824321, 9.35163292e-05]),
    np.array([1.94450841, 68.2743576]),
)
_PLANE_2 = Plane(
    (
        Coordinate(2, "min_eta", 10.0, "literal"),
        Coordinate(2, "min_eta", 1.0, "norm"),
    ),
    np.array([-1.39895177, -13.9128048]),
    np.array([1.9117224, 14.5279604]),
)
WHEEL_CLASSES = SignatureClassifier(
    (
        SearchStage(
            DROP,
            _PLANE_1,
            {
                STEADY: Separation(0.00672659163, 0.00610860294, np.array([0.996194698, -0.0871557427]), 0.0173349324),
                RISE: Separation(0.00988674917, 0.00922705105, np.array([0.99756405, -0.0697564737]), 0.0161031639),
            },
            0.00672659163,
        ),
        SearchStage(
            STEADY,
            _PLANE_2,
            {
                RISE: Separation(0.00579823116, 0.00303093431, np.array([0.906307787, -0.422618262]), 0.474184313),
            },
            0.00579823116,
        ),
    ),
    RISE,
    (STEADY, DROP, RISE),
)
"""Decisions of `wheel_signature`: at 5 Hz and 0.05 m/s of noise, faults of at least 0.6 m/s."""
