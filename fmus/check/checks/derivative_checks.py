"""The check of directional derivatives in co-simulation: outputs along inputs, where the slave stands between two
steps.
"""

from __future__ import annotations

import numpy as np

from fmus.check.check import DERIVATIVES, LIMIT, Check
from fmus.check.checks.life_checks import real_names
from fmus.check.context import Context
from fmus.check.findings import CheckOutcome, skipped
from fmus.check.finite_differences import compare, nominal_of
from fmus.check.runner import WARM_UP_STEPS


class DirectionalDerivativesCheck(
    Check, failing=LIMIT, advice="do not use its derivatives", place=18, declares=DERIVATIVES
):
    """Directional derivatives of the outputs along the inputs between two steps."""

    name = "directional derivatives"

    @staticmethod
    def run(context: Context) -> CheckOutcome:
        runner = context.runner
        runner.begin()
        runner.steps((runner.h,) * WARM_UP_STEPS)
        slave = runner.component
        inputs, outputs = real_names(slave, "input"), real_names(slave, "output")
        if not inputs or not outputs:
            return skipped("has no pair of a continuous input and a continuous output")
        values = dict(zip(inputs, slave.read(inputs).tolist(), strict=True))

        def evaluate(name: str, value: float) -> np.ndarray:
            write, buffer = slave.writer(inputs)
            buffer[:] = [value if n == name else v for n, v in values.items()]
            write()
            return slave.read(outputs)

        nominal = {n: nominal_of(slave.variables[n]) for n in inputs}
        try:
            return compare(
                evaluate, lambda n: slave.directional_derivative(outputs, [n], [1.0]), values, outputs, nominal
            )
        finally:
            evaluate(inputs[0], values[inputs[0]])
