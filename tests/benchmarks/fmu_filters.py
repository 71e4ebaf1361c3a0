"""Benchmark: what a filter over a sealed FMU costs beside its FMI calls alone.

``python tests/benchmarks/fmu_filters.py`` runs each filter over the FMU of the locomotive at 10 Hz, notes every call of
the library, makes the same calls again with nothing around them, and prints both in microseconds a sample. Particles
are left out: the states that they free cannot be freed again. Nothing is asserted.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

from cosim.fmu_filter.component import FmuFilterModel
from cosim.fmu_filter.settings import FilterTable
from fmus import cached_fmu
from plant_models import PLANTS

STEP, SAMPLES, REPEATS = 0.1, 20, 5
START = {"train_speed": 11.0, "wheel_rate": 11.0 / 0.575, "effort": 5e4}
STATES = ("train_position", "train_speed", "wheel_rate")
SETTINGS: dict[str, dict[str, Any]] = {
    "ekf": {"process_noise": dict.fromkeys(STATES, 0.05), "start_deviation": dict.fromkeys(STATES, 0.5)},
    "ukf": {"process_noise": dict.fromkeys(STATES, 0.05), "start_deviation": dict.fromkeys(STATES, 0.5)},
    "ensemble": {"process_noise": dict.fromkeys(STATES, 0.05), "start_deviation": dict.fromkeys(STATES, 0.5)},
}


def main() -> None:
    """Print a line for each filter."""
    path = cached_fmu(PLANTS["locomotive"](), fmi_version=3)
    print(f"{'filter':<10}{'calls':>8}{'calls [us]':>12}{'filter [us]':>13}{'ratio':>8}")
    for kind, more in SETTINGS.items():
        table = FilterTable.model_validate({"kind": kind, "measurements": {"wheel_speed": 0.05}, "members": 50} | more)
        filter_ = FmuFilterModel(path, table, START)
        advance(filter_, 0, 2)
        state = filter_.get_state()
        whole = min(timed(lambda f=filter_, s=state: again(f, s)) for _ in range(REPEATS))
        calls = recorded(filter_, state)
        alone = min(timed(lambda c=calls: made(c)) for _ in range(REPEATS))
        per = 1e6 / SAMPLES
        print(
            f"{kind:<10}{len(calls) // SAMPLES:>8}{per * alone:>12.0f}{per * whole:>13.0f}{whole / alone:>8.2f}",
            flush=True,
        )


def advance(filter_: FmuFilterModel, begin: int, count: int) -> None:
    """Samples of the filter."""
    for k in range(begin, begin + count):
        filter_.step(k * STEP, {"effort": 5e4, "measured_wheel_speed": 11.0 + 0.05 * k}, STEP)


def again(filter_: FmuFilterModel, state: Any) -> None:
    """The samples that are timed, always from the same state."""
    filter_.set_state(state)
    advance(filter_, 2, SAMPLES)


def timed(call: Callable[[], None]) -> float:
    """Seconds of the processor."""
    began = time.process_time()
    call()
    return time.process_time() - began


def recorded(filter_: FmuFilterModel, state: Any) -> list[tuple[Any, tuple[Any, ...]]]:
    """Every call of the library that the samples make, with its arguments."""
    slave, calls = filter_._model.instance.slave, []
    functions = dict(slave._functions)
    for name, function in functions.items():

        def noting(*arguments: Any, function: Any = function) -> Any:
            calls.append((function, arguments))
            return function(*arguments)

        for attribute in ("argnames", "argtypes", "restype"):
            setattr(noting, attribute, getattr(function, attribute))
        slave._functions[name] = noting
    again(filter_, state)
    slave._functions.update(functions)
    return calls


def made(calls: list[tuple[Any, tuple[Any, ...]]]) -> None:
    """The calls and nothing else."""
    for function, arguments in calls:
        function(*arguments)


if __name__ == "__main__":
    main()
