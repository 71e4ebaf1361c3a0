"""Benchmark: how cost grows with components and with steps, and that memory does not grow with steps.

Run it with ``python tests/benchmarks/scaling.py [SECTION ...]``; sections: ``components``, ``steps``. Without one, all
of them. Trivial FMUs (`lag.c`) in a chain. Growth is the exponent p of a fit ``cost = c * n**p``: 1 is linear. Nothing
is asserted.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
import threading
from collections.abc import Callable, Sequence
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np
from cpu_time import run_sections
from lag_fmus import Chain, H, make_chain
from masters import c_loop

from cosim import Scenario
from cosim.coupling.connection import connect
from cosim.coupling.graph import execution_groups
from cosim.coupling.plan import make_plan
from cosim.run.outcome import Outcome

COUNTS = (2, 10, 30, 100)
STEPS = {"compiled": (10**5, 10**6, 10**7), "python": (10**4, 10**5, 10**6)}
FEW, MANY = 1_000, 50_000  # steps of a measurement in Python, and compiled
REPETITIONS = 5
MEMORY = 64.0  # MB of rows in memory
SAMPLING = 0.02  # of the memory [s]


def scenario(chain: Chain, steps: int, stepper: str) -> Scenario:
    """The chain as a scenario."""
    made = Scenario(stop=steps * H, step=H, master={"stepper": stepper, "record_memory": MEMORY})
    for name, fmu in zip(chain.names, chain.fmus, strict=True):
        made.add(name, fmu=str(fmu))
    return made.connect(*(f"{source}.y -> {target}.u" for source, target in chain.links))


def run(chain: Chain, steps: int, stepper: str) -> Outcome:
    """A run that must not fail."""
    outcome = scenario(chain, steps, stepper).run(warn=lambda _text: None)
    assert outcome.failure is None, outcome.failure
    return outcome


def exponent(sizes: Sequence[float], costs: Sequence[float]) -> float:
    """Growth of the cost, by least squares on logarithms over the larger half of the sizes: small ones hold what is
    constant.
    """
    half = len(sizes) // 2
    return float(np.polyfit(np.log(sizes[half:]), np.log(costs[half:]), 1)[0])


# -- components -----------------------------------------------------------------------------------------------------


def components() -> None:
    """Set-up and cost of a step by number of components; the least of some repetitions."""
    rows: dict[str, list[float]] = {}
    for count in COUNTS:
        with tempfile.TemporaryDirectory(prefix="scaling-") as folder:
            chain = make_chain(Path(folder), count)
            for _ in range(REPETITIONS):
                for name, value in _measure(chain).items():
                    rows.setdefault(name, []).append(value)
    print(f"{'components':<44} {' '.join(f'{count:>9}' for count in COUNTS)}   growth")
    for name, values in rows.items():
        least = [min(values[i * REPETITIONS : (i + 1) * REPETITIONS]) for i in range(len(COUNTS))]
        print(f"{name:<44} {' '.join(f'{value:9.3f}' for value in least)}   {exponent(COUNTS, least):6.2f}")


def _measure(chain: Chain) -> dict[str, float]:
    python, compiled = run(chain, FEW, "python"), run(chain, MANY, "compiled")
    return {
        "set-up of a scenario [ms]": 1e3 * python.result.summary["setup_seconds"],
        **_parts(chain),
        "step, Python stepper [us]": 1e6 * python.result.summary["wall_seconds"] / FEW,
        "step, compiled stepper [us]": 1e6 * compiled.result.summary["wall_seconds"] / MANY,
        "step, C written for these FMUs [us]": 1e6 * c_loop(chain, MANY, chain.fmus[0].parent)[0] / MANY,
    }


def _parts(chain: Chain) -> dict[str, float]:
    """What belongs to the coupling in the set-up, on its own."""
    from cosim.components.loading import load_fmu

    loaded = {name: load_fmu(fmu, name) for name, fmu in zip(chain.names, chain.fmus, strict=True)}
    times: dict[str, float] = {}

    def timed(name: str, call: Callable[[], Any]) -> Any:
        begin = perf_counter()
        made = call()
        times[name] = 1e3 * (perf_counter() - begin)
        return made

    try:
        for component in loaded.values():
            component.instantiate()
        pairs = [(f"{source}.y", f"{target}.u") for source, target in chain.links]
        connections = timed("  connecting [ms]", lambda: connect(pairs, loaded))
        groups = timed("  order of execution [ms]", lambda: execution_groups(loaded, connections))
        timed("  plan [ms]", lambda: make_plan(loaded, connections, [name for group in groups for name in group.names]))
    finally:
        for component in loaded.values():
            component.free()
    return times


# -- steps ----------------------------------------------------------------------------------------------------------


def steps() -> None:
    """Time and memory by number of steps, each run in a process of its own."""
    print(
        f"{'steps of a pair':<22} {'us/step':>9} {'rows [MB]':>10} {'memory before':>14} {'most':>8} {'after [MB]':>11}"
    )
    with tempfile.TemporaryDirectory(prefix="scaling-") as folder:
        for stepper, numbers in STEPS.items():
            seconds = [_alone(folder, stepper, number) for number in numbers]
            print(f"  growth, {stepper}: {exponent(numbers, seconds):.2f}")


def _alone(folder: str, stepper: str, number: int) -> float:
    command = [sys.executable, __file__, "alone", folder, stepper, str(number)]
    found = json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)
    print(
        f"  {stepper:<9} {number:>9,}  {1e6 * found['seconds'] / number:9.3f} {found['bytes'] / 1e6:10.1f} "
        f"{found['before']:14.1f} {found['most']:8.1f} {found['after']:11.1f}",
        flush=True,
    )
    return float(found["seconds"])


def alone(folder: str, stepper: str, number: str) -> None:
    """One run with its memory watched; prints JSON."""
    chain = make_chain(Path(folder), 2)
    run(chain, 1000, stepper)  # everything is loaded
    watch = MemoryWatch()
    outcome = run(chain, int(number), stepper)
    most, after = watch.stop(), own_memory()
    data = {"seconds": outcome.result.summary["wall_seconds"], "bytes": outcome.result.table.nbytes}
    print(json.dumps(data | {"before": watch.before, "most": most, "after": after}))


def own_memory() -> float:
    """Memory of this process without pages of files, which the system takes back when it likes [MB]."""
    lines = Path("/proc/self/status").read_text(encoding="utf-8").splitlines()
    return next(float(line.split()[1]) / 1e3 for line in lines if line.startswith("RssAnon"))


class MemoryWatch:
    """Looks at the memory now and then until it is stopped."""

    def __init__(self) -> None:
        self.before = self._most = own_memory()
        self._done = threading.Event()
        self._thread = threading.Thread(target=self._view)
        self._thread.start()

    def _view(self) -> None:
        while not self._done.wait(SAMPLING):
            self._most = max(self._most, own_memory())

    def stop(self) -> float:
        """The most that was seen [MB]."""
        self._done.set()
        self._thread.join()
        return max(self._most, own_memory())


SECTIONS: dict[str, Callable[[], None]] = {"components": components, "steps": steps}


def main() -> None:
    """Run the sections named on the command line, or all."""
    if sys.argv[1:2] == ["alone"]:
        alone(*sys.argv[2:5])
        return
    run_sections(SECTIONS)


if __name__ == "__main__":
    main()
