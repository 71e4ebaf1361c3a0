"""Benchmark: the wind turbine over 4400 s in 440 000 steps, by the compiled stepper, and what each part of it costs.

``python tests/benchmarks/wind_turbine.py``. Nothing is asserted. Times are seconds by the clock and CPU seconds of
this process, after a run that builds the FMUs; the turbine alone has wind and controller beside it and no faults.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

from cosim import Scenario

STOP = 4400.0
FAULTS = (
    "rotor_speed_sensors",
    "generator_speed_sensors",
    "pitch_sensors",
    "converter",
    "efficiency",
    "pitch_frequency",
    "pitch_damping",
)
DIAGNOSIS = "diagnosis"


def main() -> None:
    whole = scenario()
    parts = [name for name in (DIAGNOSIS,) if name in whole.table().components]
    variants = {"wind, turbine, controller": (*FAULTS, *parts)}
    if parts:
        variants["the same and blocks of faults"] = tuple(parts)
    variants["the whole scenario"] = ()
    for name, left_out in variants.items():
        chosen = without(left_out)
        chosen.set("stop", 1.0).run()  # builds
        chosen.set("stop", STOP)
        spent, outcome = seconds(chosen.run)
        stepper = outcome.result.summary["master"]["stepper"]
        steps = stepper["steps_compiled"]
        print(f"{name:32s}{spent:6.2f} s, {1e6 * spent / max(steps, 1):5.2f} us a step, {stepper['name']}", flush=True)


def scenario() -> Scenario:
    """The shipped scenario without its expectations and its report."""
    made = Scenario.load("wind_turbine").set("expect", [])
    made._data.pop("report", None)
    return made


def without(names: tuple[str, ...]) -> Scenario:
    """The scenario with some components left out; the controller then reads the turbine's own sensor.

    Args:
        names: components.
    """
    chosen = scenario()
    for name in names:
        chosen._data["components"].pop(name)
    kept = []
    for line in chosen._data["connections"]:
        text = line if isinstance(line, str) else f"{line['from']} -> {line['to']}"
        source, targets = text.split("->")
        ends = [end for end in targets.split(",") if end.split(".")[0].strip() not in names]
        if source.split(".")[0].strip() not in names and ends:
            kept.append(f"{source.strip()} -> {','.join(ends).strip()}")
    if "generator_speed_sensors" in names:
        kept.append("turbine.measured_generator_speed[1] -> controller.generator_speed")
    chosen._data["connections"] = kept
    return chosen


def seconds(call: Callable[[], Any]) -> tuple[float, Any]:
    """CPU seconds of a call, and what it returns."""
    started, begun = time.process_time(), time.perf_counter()
    made = call()
    print(f"{'by the clock':32s}{time.perf_counter() - begun:6.2f} s")
    return time.process_time() - started, made


if __name__ == "__main__":
    main()
