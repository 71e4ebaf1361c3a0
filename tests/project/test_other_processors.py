"""The numerical tests under kernels of BLAS that other processors take: rounding differs there, the verdicts must not.

OpenBLAS chooses its kernels by the processor; `OPENBLAS_CORETYPE` forces one. One that this processor cannot run is
replaced by OpenBLAS itself by the nearest that it can.
"""

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
NUMERICAL = (
    "bounds_formulas",
    "bounds_printed",
    "certificates_*",
    "claims_of_stability",
    "filter_consistency",
    "filtering_formulas",
    "full_convergence",
    "full_solver",
    "gap_design",
    "kalman_filters",
    "least_squares",
    "member_filters",
    "moving_horizon",
    "noise_amplification",
    "observability_*",
    "proposition_4_1",
    "residual_analysis",
    "robust_residual",
    "smoothing",
    "theorem7_design",
)
"""Files of `tests/fmu_observer` whose results come from decompositions, solvers and ranks."""


@pytest.mark.slow
@pytest.mark.parametrize("kernel", ["Prescott", "Sandybridge", "SkylakeX"])
def test_numerical_tests_pass_with_the_kernels_of_other_processors(kernel: str) -> None:
    rooms = ROOT / "tests" / "fmu_observer"
    files = [path for name in NUMERICAL for path in sorted(rooms.glob(f"test_{name}.py"))]
    assert len(files) >= len(NUMERICAL)
    ended = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", *map(str, files)],
        cwd=ROOT,
        env=os.environ | {"OPENBLAS_CORETYPE": kernel},
        capture_output=True,
        text=True,
        check=False,
    )
    assert ended.returncode == 0, ended.stdout[-8000:] + ended.stderr[-2000:]
