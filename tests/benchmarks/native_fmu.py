"""Benchmark: what native FMUs cost and how exact they are in other masters.

Sections: ``build`` (time to compile and size, by platform), ``step`` (see `native_step`), ``foreign`` (see
`native_foreign`).

Run it with ``python tests/benchmarks/native_fmu.py [SECTION ...]``; without a section, all of them. Nothing is
asserted. A further section is a function in `SECTIONS` that prints.
"""

from __future__ import annotations

import statistics
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from cpu_time import run_sections
from native_foreign import foreign
from native_step import step

from fmus import build_fmu, recipe
from fmus.build import BuildPlan, plan_fmu
from fmus.toolchain.platforms import HOST, PLATFORMS
from fmus.toolchain.targets import choose_targets, compile_targets

MODELS = ("takagi_sugeno_cdo", "locomotive")
REPETITIONS = 5


def build() -> None:
    """Time to compile one library and its size by platform; the C libraries of the targets are built before it is
    measured.
    """
    with tempfile.TemporaryDirectory(prefix="native-fmu-") as folder:
        build_everything(Path(folder))
    for model in MODELS:
        for version in (2, 3):
            plan = plan_fmu(recipe(model), version)  # type: ignore[arg-type]
            print(f"{model}, FMI {version}")
            for name in (HOST, *PLATFORMS):
                print(f"  {name:<16} {measure(plan, name)}")


def measure(plan: BuildPlan, platform: str) -> str:
    """Time to compile for one platform, and the size of the library."""
    targets, files, seconds = choose_targets(platform), plan.source_files() | plan.header_files(), []
    for _ in range(REPETITIONS):
        start = time.perf_counter()
        (library,) = compile_targets(targets, files, plan.sources, plan.system.name).values()
        seconds.append(time.perf_counter() - start)
    return f"median {statistics.median(seconds):5.2f} s   min {min(seconds):5.2f} s   {len(library) / 1000:6.1f} kB"


def build_everything(folder: Path) -> None:
    """The whole FMU for all platforms: the first time compiles the C libraries of the targets, unless they are in the
    cache.
    """
    for attempt in ("first", "second"):
        start = time.perf_counter()
        fmu = build_fmu(recipe(MODELS[0]), folder / f"{attempt}.fmu", platforms="all")
        seconds = time.perf_counter() - start
        print(
            f"{MODELS[0]}, FMI 3, all platforms, {attempt} time: {seconds:.1f} s, FMU of "
            f"{fmu.stat().st_size / 1000:.0f} kB"
        )


SECTIONS: dict[str, Callable[[], None]] = {"build": build, "step": step, "foreign": foreign}


def main() -> None:
    """Run the sections named on the command line, or all."""
    run_sections(SECTIONS)


if __name__ == "__main__":
    main()
