"""Benchmark: what a communication step of small FMUs costs with the Python stepper, the compiled stepper, and in plain
C.

Run it with ``python tests/benchmarks/stepper.py [REPETITIONS]`` from the root of the project. All three step the same
libraries with exchange and recording in memory, in turn within one process, so that their ratios hold on a noisy
machine; nothing is asserted. The plain C loop is written for this one ring, as fast as it can be.
"""

from __future__ import annotations

import ctypes
import subprocess
import sys
import tempfile
from functools import partial
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).parent.parent))

from test_fmus.build import linear_fmu

from cosim.compiled.choice import choose_stepper
from cosim.components.loading import load_fmu
from cosim.coupling.connection import connect
from cosim.coupling.plan import Plan, make_plan
from cosim.master.axis import TimeAxis
from cosim.master.master import Master, close
from fmus.toolchain.compile import find_compiler

STEP = 1e-3
LOOP = r"""
#include <stddef.h>
#include <stdint.h>
#include <string.h>
typedef int (*Set)(void *, const uint32_t *, size_t, const double *);
typedef int (*Get)(void *, const uint32_t *, size_t, double *);
typedef int (*Step)(void *, double, double, int);
void plain(long count, int n, void **m, Set *set, Get *get, Step *step, double h, double *values, double *rows) {
    const uint32_t u = 1, y = 2;
    for (long k = 0; k < count; k++) {
        double t = (double)k * h;
        for (int i = 0; i < n; i++) {
            double x = values[i == 0 ? n - 1 : i - 1];
            set[i](m[i], &u, 1, &x);
            step[i](m[i], t, h, 0);
            get[i](m[i], &y, 1, &values[i]);
        }
        rows[0] = t + h;
        memcpy(rows + 1, values, (size_t)n * sizeof(double));
        rows += n + 1;
    }
}
"""


def chain(folder: Path, count: int) -> Plan:
    """A ring of `count` FMI 2 FMUs, each a first-order lag of the one before, initialised."""
    fmu = linear_fmu(folder, "lag", [[-1.0]], [[1.0]], [[1.0]], [[0.0]], version=2, x0=[1.0])
    components = {f"c{i}": load_fmu(fmu, f"c{i}") for i in range(count)}
    names = list(components)
    pairs = [(f"{a}.y1", f"{b}.u1") for a, b in zip([names[-1], *names], names, strict=False)]
    for component in components.values():
        component.instantiate()
    return make_plan(components, connect(pairs, components), names)


def by_master(folder: Path, count: int, steps: int, stepper: Any) -> float:
    """Seconds per communication step."""
    plan = chain(folder, count)
    master = Master(plan, TimeAxis(0.0, STEP, steps), stepper=partial(choose_stepper, stepper))
    try:
        master.run()
    finally:
        close(plan)
    timing = master.timing
    return (timing.stepping + timing.recording) / steps


def by_plain_c(folder: Path, count: int, steps: int) -> float:
    """Seconds per communication step."""
    source, library = folder / "loop.c", folder / "loop.so"
    source.write_text(LOOP)
    subprocess.run([*find_compiler().command, "-O2", "-shared", "-fPIC", str(source), "-o", str(library)], check=True)
    run = ctypes.CDLL(str(library)).plain
    plan = chain(folder, count)
    Master(plan, TimeAxis(0.0, STEP, 1)).run()  # one step, to be initialised
    rows = np.zeros((steps, count + 1))
    slaves = [step.component.slave for step in plan.steps]
    functions = [[s._functions[f"fmi2{name}"] for s in slaves] for name in ("SetReal", "GetReal", "DoStep")]
    groups = [[s.component for s in slaves], *functions]
    pointers = [(ctypes.c_void_p * count)(*map(_address, group)) for group in groups]
    rows[:] = 0.0  # no page is touched for the first time in the loop
    begin = perf_counter()
    run(
        ctypes.c_long(steps),
        ctypes.c_int(count),
        *pointers,
        ctypes.c_double(STEP),
        ctypes.c_void_p(plan.values.ctypes.data),
        ctypes.c_void_p(rows.ctypes.data),
    )
    seconds = perf_counter() - begin
    close(plan)
    return seconds / steps


def _address(pointer: Any) -> int:
    return int(pointer if isinstance(pointer, int) else ctypes.cast(pointer, ctypes.c_void_p).value or 0)


def main() -> None:
    """Run all in turn and print the smallest times."""
    repetitions = int(sys.argv[1]) if len(sys.argv) > 1 else 7
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        for count in (2, 10):
            times: dict[str, list[float]] = {"Python stepper": [], "compiled stepper": [], "plain C": []}
            for _ in range(repetitions):
                times["Python stepper"].append(by_master(folder, count, 20_000, "python"))
                times["compiled stepper"].append(by_master(folder, count, 500_000, "compiled"))
                times["plain C"].append(by_plain_c(folder, count, 500_000))
            print(f"{count} FMUs, microseconds per communication step with recording in memory")
            for name, values in times.items():
                print(
                    f"  {name:<17} min {min(values) * 1e6:8.3f}   median {sorted(values)[len(values) // 2] * 1e6:8.3f}"
                )


if __name__ == "__main__":
    main()
