"""Cost of tuning the motor's Kalman filter: candidates as members of a batch, and the likelihood with its gradient.

``python tests/benchmarks/tuning.py``. Target: BBO with 20 habitats and 20 iterations over 10 000 samples in at most
5 s of CPU time on one core.
"""

from __future__ import annotations

import numpy as np
from cpu_time import seconds

from cosim import Scenario
from cosim.studies.replay import Replay
from fmu_observer.design.likelihood import AccumulatedOutput
from fmu_observer.design.optimisers.known_optimisers import find_optimiser
from fmu_observer.design.optimisers.optimiser_search import minimise

CURRENTS = ["current_d", "current_q"]
NAMES = [*(f"process_variance[{i}]" for i in range(1, 5)), "measurement_variance[1]", "measurement_variance[2]"]


def main() -> None:
    """Print the times."""
    outcome = Scenario.load("traction_drive").set("expect", []).run(warn=lambda _text: None)
    replay = Replay(outcome, "filter")
    true = np.stack([outcome[f"motor.{name}"] for name in CURRENTS], axis=1)

    def cost(candidates: np.ndarray) -> np.ndarray:
        stated = {"process_variance": candidates[:, :4], "measurement_variance": candidates[:, 4:]}
        found = replay.run(CURRENTS, stated, members=len(candidates))
        return np.asarray((((found - true)[:, 1:]) ** 2).mean(axis=1).sum(axis=1))

    for name in ("bbo", "pso", "cma"):
        optimiser = find_optimiser(name)([1e-6] * 6, [20.0] * 6)
        took = seconds(lambda optimiser=optimiser: minimise(optimiser, cost, 20))  # type: ignore[misc]
        each = 1e3 * took / optimiser.evaluations
        print(f"{name}: {optimiser.evaluations} candidates over {len(true)} samples {took:.2f} s, {each:.1f} ms each")
    output = AccumulatedOutput(replay.system, replay.inputs(), NAMES)
    print(
        f"likelihood and its gradient over {len(true)} samples: {seconds(lambda: output([1e-3] * 4 + [0.1] * 2)):.3f} s"
    )


if __name__ == "__main__":
    main()
