"""Benchmark: what a communication step in which two observers receive a balise telegram costs in Python.

Run it with ``python tests/benchmarks/telegrams.py [REPETITIONS]`` from the root of the project. A locomotive passes
balises 100 m apart; two observers receive each telegram. Blocks and FMUs, Python and compiled stepper, telegrams on
time and late (replayed). Printed are Python calls of a step, calls that lead into another file, and CPU time, each the
median over steps with telegrams and without; of the compiled stepper, which leaves Python only where it must, all calls
while stepping, a telegram. ``--files`` also prints in which functions the calls of a step with a telegram are.
"""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from statistics import median
from time import process_time
from types import FrameType
from typing import Any

from cosim import Scenario
from cosim.master.master import Master
from cosim.master.system import System

OBSERVERS = ("balise_odometer_ekf", "quasi_lpv_uio")
STOP, STEP = 60.0, 0.02


@dataclass
class Steps:
    """What was counted of steps, those with telegrams apart.

    Attributes:
        calls: Python calls of each step. switches: of them into another file. seconds: CPU time of each [s].
        functions: calls by file and function, of the steps with telegrams.
    """

    calls: dict[bool, list[int]] = field(default_factory=lambda: {False: [], True: []})
    switches: dict[bool, list[int]] = field(default_factory=lambda: {False: [], True: []})
    seconds: dict[bool, list[float]] = field(default_factory=lambda: {False: [], True: []})
    functions: Counter[tuple[str, str]] = field(default_factory=Counter)

    def count(self, called: Sequence[tuple[str, str, str]], *, telegram: bool) -> None:
        """Add a step.

        Args:
            called: file of the caller, file and name of the function, of each call. telegram: whether one came.
        """
        self.calls[telegram].append(len(called))
        self.switches[telegram].append(sum(caller != file for caller, file, _ in called))
        if telegram:
            self.functions.update((file, name) for _, file, name in called)


def scenario(kind: str, stepper: str, latency: float, stop: float) -> Scenario:
    """The scenario.

    Args:
        kind: ``block3`` or ``fmu3`` and the like. stepper: of the master.
        latency: of telegrams [s]. stop: of the run [s].
    """
    made = Scenario(stop=stop, step=STEP, certificates="ignore")
    made.add("train", model="longitudinal_train", preset="scenario_3_3_4", backend=kind)
    made.add("odometer", model="odometer", backend=kind, parameters={"sample_period": STEP})
    made.connect("train.wheel_speed -> odometer.wheel_speed")
    for name in OBSERVERS:
        made.add(name, observer=name, backend=kind, parameters={"odometer_period": STEP})
        made.connect(f"odometer.reading -> {name}.odometer")
    made.balises(
        position="train.position",
        speed="train.speed",
        odometer="odometer.reading",
        layout="spacing",
        spacing=100.0,
        track_end=2000.0,
        latency=latency,
    )
    made.master(stepper=stepper)
    return made


def run(kind: str, stepper: str, latency: float, *, counted: bool, stop: float = STOP) -> Steps:
    """One run whose steps are watched from outside.

    Args:
        kind: ``block3`` or ``fmu3`` and the like. stepper: of the master. latency: of telegrams [s].
        counted: count the calls, which takes time; else take the CPU time. stop: of the run [s].
    """
    found = Steps()
    name, step = ("move", System.move) if stepper == "python" else ("_step_all", Master._step_all)
    owner: Any = System if stepper == "python" else Master

    def watched(self: Any, *stated: float) -> Any:
        balises = self.balises
        logged, called, begin = len(balises.mailbox.log), list[tuple[str, str, str]](), process_time()

        def profile(frame: FrameType, event: str, _: Any) -> None:
            if event == "call":
                code, caller = frame.f_code, frame.f_back
                source = "" if caller is None else caller.f_code.co_filename
                called.append((source, code.co_filename, code.co_qualname))

        sys.setprofile(profile if counted else None)
        try:
            return step(self, *stated)
        finally:
            sys.setprofile(None)
            telegram = len(balises.mailbox.log) > logged
            found.seconds[telegram].append(process_time() - begin)
            if counted:
                found.count(called[1:], telegram=telegram)  # the first one is the step itself

    setattr(owner, name, watched)
    try:
        result = scenario(kind, stepper, latency, stop).run(warn=lambda _: None, progress=False).result
    finally:
        setattr(owner, name, step)
    if stepper != "python":  # all steps at once
        telegrams = max(len(result.events), 1)
        found.calls[True] = [n // telegrams for n in found.calls[True]]
        found.switches[True] = [n // telegrams for n in found.switches[True]]
        found.seconds[True] = [s / telegrams for s in found.seconds[True]]
        found.functions = Counter({f: n // telegrams for f, n in found.functions.items()})
    return found


def _middle(values: Sequence[float]) -> float:
    return median(values) if values else 0.0


def _print_functions(found: Steps) -> None:
    steps = len(found.calls[True])
    for (file, name), count in found.functions.most_common():
        print(f"      {count / steps:6.1f}  {'/'.join(file.split('/')[-3:])}  {name}")


def main() -> None:
    """Run all variants and print them."""
    numbers = [int(a) for a in sys.argv[1:] if a.isdigit()]
    repetitions = numbers[0] if numbers else 3
    print("a step with a telegram to two observers: Python calls, into another file, [us] CPU; and without")
    for kind in ("block3", "fmu3", "block2", "fmu2"):
        for stepper in ("python", "compiled"):
            if kind.startswith("block") and stepper == "compiled":
                continue  # blocks are stepped in Python
            for latency in (0.0, 0.25):
                found = run(kind, stepper, latency, counted=True)
                times = [run(kind, stepper, latency, counted=False).seconds for _ in range(repetitions)]
                seconds = [min(_middle(t[telegram]) for t in times) * 1e6 for telegram in (True, False)]
                counts = [f"{_middle(found.calls[b]):7.0f} {_middle(found.switches[b]):7.0f}" for b in (True, False)]
                print(
                    f"  {kind:6s} {stepper:9s} {latency:5.2f} s late  {counts[0]} {seconds[0]:8.0f}"
                    f"   without {counts[1]} {seconds[1]:8.0f}"
                )
                if "--files" in sys.argv:
                    _print_functions(found)


if __name__ == "__main__":
    main()
