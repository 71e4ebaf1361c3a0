"""Benchmark: what a filter over a sealed FMU costs beside its FMI calls alone.

``python tests/benchmarks/fmu_filters.py`` runs each filter over the FMU of the locomotive at 10 Hz, notes every call of
the library with its values, makes the same calls again with nothing around them, in turn with the filter, and prints
microseconds of the processor a sample: the least of each, and the least, median and largest of the ratios of both.
Particles are left out: the states that they free cannot be freed again. Nothing is asserted.
"""

from __future__ import annotations

import ctypes
import time
from collections.abc import Callable
from functools import partial
from statistics import median
from typing import Any

from cosim.fmu_filter.component import FmuFilterModel
from cosim.fmu_filter.settings import FilterTable
from fmus import cached_fmu
from plant_models import PLANTS

STEP, SAMPLES, REPEATS = 0.1, 20, 11
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
    print(
        f"{'filter':<10}{'calls':>8}{'calls [us]':>12}{'filter [us]':>13}{'ratio: least':>14}{'median':>8}{'most':>8}"
    )
    for kind, more in SETTINGS.items():
        table = FilterTable.model_validate({"kind": kind, "measurements": {"wheel_speed": 0.05}, "members": 50} | more)
        filter_ = FmuFilterModel(path, table, START)
        advance(filter_, 0, 2)
        state = filter_.get_state()
        calls = recorded(filter_, state)
        pairs = [(timed(partial(made, calls)), timed(partial(again, filter_, state))) for _ in range(REPEATS)]
        alone, whole = (1e6 / SAMPLES * min(column) for column in zip(*pairs, strict=True))
        ratios = sorted(whole / alone for alone, whole in pairs)
        print(
            f"{kind:<10}{len(calls) // SAMPLES:>8}{alone:>12.0f}{whole:>13.0f}"
            f"{ratios[0]:>13.2f}{median(ratios):>8.2f}{ratios[-1]:>8.2f}",
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
            calls.append((function, kept(arguments)))
            return function(*arguments)

        for attribute in ("argnames", "argtypes", "restype"):
            setattr(noting, attribute, getattr(function, attribute))
        slave._functions[name] = noting
    again(filter_, state)
    slave._functions.update(functions)
    return calls


def kept(arguments: tuple[Any, ...]) -> tuple[Any, ...]:
    """Arguments with the values as they are now: the filter writes others into the same memory later."""
    held = list(arguments)
    for i, argument in enumerate(arguments):
        if isinstance(argument, ctypes.POINTER(ctypes.c_double)):
            count = arguments[i + 1] if i + 1 < len(arguments) else 1  # FMI 3 tells how many follow
            held[i] = (ctypes.c_double * count)(*argument[:count])
    return tuple(held)


def made(calls: list[tuple[Any, tuple[Any, ...]]]) -> None:
    """The calls and nothing else."""
    for function, arguments in calls:
        function(*arguments)


if __name__ == "__main__":
    main()
