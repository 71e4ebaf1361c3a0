"""Benchmark: a train with traction motors at one rate and at two, and candidates replayed over a recording of a drive.

``python tests/benchmarks/traction.py``. Nothing is asserted. Times are CPU seconds of this process.
"""

from __future__ import annotations

import numpy as np
from cpu_time import seconds

from cosim import Scenario
from cosim.studies.replay import Replay

HABITATS, ITERATIONS = 20, 20


def main() -> None:
    for name, every in (("rates of their own", 100), ("one rate", 1)):
        scenario = Scenario.load("train_with_traction_motors").set("expect", [])
        for component in ("locomotive", "driver", "reader", "observer"):
            scenario.set(f"{component}.every", every)
        scenario.set("stop", 0.1).run()  # builds
        scenario.set("stop", 3.0)
        spent = seconds(scenario.run)
        print(f"train with traction motors, {name}: {spent / 3.0:.3f} s for a second", flush=True)
    recording = Scenario.load("traction_drive").run()
    replay = Replay(recording, "filter")
    drawn = np.random.default_rng(0).uniform(1e-6, 1.0, (HABITATS, 6))

    def generation() -> None:
        parameters = {"process_variance": drawn[:, :4], "measurement_variance": drawn[:, 4:]}
        replay.run(["current_d", "current_q"], parameters)

    generation()
    spent = seconds(generation)
    samples = HABITATS * len(recording.result.time)
    print(f"{HABITATS} candidates over {len(recording.result.time)} samples: {1e6 * spent / samples:.3f} us a sample")
    print(f"  {HABITATS} habitats, {ITERATIONS} iterations: {ITERATIONS * spent:.2f} s")


if __name__ == "__main__":
    main()
