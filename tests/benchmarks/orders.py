"""Table: error, observed order and energy error of the algorithms and input methods, on two coupled masses with a
closed form.

Run it with ``python tests/benchmarks/orders.py``. The components are exact for the inputs they are told, so that the
coupling is the only error. Lines as in docs/reference/algorithms.md come out.
"""

from __future__ import annotations

import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

sys.path[:0] = [str(Path(__file__).parents[1]), str(Path(__file__).parents[1] / "cosim")]

from linear_runs import LinearRun, run_cut  # noqa: E402 - the tests' own modules
from test_fmus.masses import Chain, Cut, cuts  # noqa: E402

from cosim.coupling.plan import Plan  # noqa: E402
from cosim.master.algorithms.algorithm import IterationSettings  # noqa: E402
from cosim.master.algorithms.gauss_seidel import GaussSeidel  # noqa: E402
from cosim.master.algorithms.iterate import Iterate  # noqa: E402
from cosim.master.algorithms.jacobi import Jacobi  # noqa: E402

CHAIN = Chain.two()  # undamped: its energy is constant
DURATION = 2.0
COUNTS = (100, 200)
REPORTED: dict[str, dict[str, Any]] = {"mean": {}, "value and slope": {"input_derivatives": True}}


def iterate(plan: Plan) -> Iterate:
    """Everything in one loop."""
    return Iterate(plan, [[s.component.name for s in plan.steps]], IterationSettings())


ALGORITHMS: dict[str, Any] = {"Jacobi": Jacobi, "Gauss-Seidel": GaussSeidel, "iterate": iterate}


def line(cut: Cut, folder: Path, algorithm: str, inputs: str, reported: str) -> str:
    """One row of the table."""
    runs: list[LinearRun] = [
        run_cut(
            cut,
            CHAIN,
            folder,
            DURATION / n,
            n,
            algorithm=ALGORITHMS[algorithm],
            inputs=inputs,
            capabilities=REPORTED.get(reported, {}),
        )
        for n in COUNTS
    ]
    order = np.log2(runs[0].error / runs[1].error)
    sizes = " | ".join(f"{run.error:.1e}" for run in runs)
    return f"| {cut.name} | {algorithm} | {inputs} | {reported} | {sizes} | {order:.2f} | {runs[1].energy_error:.1e} |"


def main() -> None:
    """Print the table."""
    steps = " | ".join(f"error at {1e3 * DURATION / n:g} ms" for n in COUNTS)
    print(
        f"| cut | algorithm | inputs | told as | {steps} | order | energy error at {1e3 * DURATION / COUNTS[1]:g} ms |"
    )
    print("|---|---|---|---|---|---|---|---|")
    with TemporaryDirectory() as folder:
        for name in ("displacement-displacement", "force-displacement", "force-force"):
            for algorithm in ALGORITHMS:
                for inputs, reported in (("hold", "-"), *(("extrapolate", reported) for reported in REPORTED)):
                    kind = "interpolate" if algorithm == "iterate" and inputs != "hold" else inputs
                    print(line(cuts(CHAIN)[name], Path(folder), algorithm, kind, reported), flush=True)


if __name__ == "__main__":
    main()
