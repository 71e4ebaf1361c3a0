"""Benchmark: what a step of a model exchange FMU costs as a component, against fmpy's own simulation of it.

Sections: ``steps`` (a communication step of 10 ms of the locomotive, FMI 2 and 3, inputs held and inputs that jump at
every step, against fmpy's CVode under the same inputs and the same FMU's co-simulation), ``beside`` (a run with an
observer, by each stepper), ``own`` (instructions of a step whose input jumps, by the compiled stepper: of the FMU's own
calls, of the solver, and of all else, by valgrind; some minutes).

Run it with ``python tests/benchmarks/exchange.py [SECTION ...]``; without a section, all of them. Nothing is asserted.
A further section is a function in `SECTIONS` that prints.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from time import process_time
from typing import Literal

import fmpy
import numpy as np
from cpu_time import run_sections

from cosim import Scenario
from cosim.components.loading import load_fmu
from fmus import build_fmu
from fmus.fmi.standard import Interface
from plant_models import Locomotive

STEP, COUNT, TOLERANCE = 0.01, 2000, 1e-6
STARTS = {"train_speed": 1.0, "wheel_rate": 1.0 / 0.575}


def stepped(path: Path, interface: Interface, *, jumps: bool) -> float:
    """Processor time of a communication step [s]."""
    component = load_fmu(path, "plant", TOLERANCE, interface=interface)
    component.instantiate()
    for name, value in STARTS.items():
        component.set_start(name, value)
    component.enter_initialization(0.0, COUNT * STEP)
    write, effort = component.writer(["effort"])
    effort[0] = 50e3
    write()
    component.exit_initialization()
    begin = process_time()
    for k in range(COUNT):
        effort[0] += 1.0 if jumps else 0.0
        write()
        component.advance(k * STEP, (k + 1) * STEP)
    spent = process_time() - begin
    component.terminate()
    component.free()
    return spent / COUNT


def simulated(path: Path, *, jumps: bool) -> float:
    """The same by fmpy's CVode [s]."""
    given = np.zeros(2 * COUNT, dtype=[("time", float), ("effort", float)])  # two rows at an instant: it jumps there
    instants, efforts = STEP * np.arange(COUNT + 1), 50e3 + np.arange(1, COUNT + 1)
    given["time"][::2], given["time"][1::2] = instants[:-1], instants[1:]
    given["effort"][::2] = given["effort"][1::2] = efforts
    folder = fmpy.extract(str(path))
    begin = process_time()
    fmpy.simulate_fmu(
        folder,
        model_description=fmpy.read_model_description(folder),
        input=given if jumps else None,
        output=["position"],
        record_events=False,
        fmi_type="ModelExchange",
        solver="CVode",
        relative_tolerance=TOLERANCE,
        stop_time=COUNT * STEP,
        output_interval=STEP,
        start_values=STARTS | {"effort": 50e3},
    )
    return (process_time() - begin) / COUNT


def steps() -> None:
    """A communication step, and its ratio to fmpy's."""
    with tempfile.TemporaryDirectory() as folder:
        versions: tuple[Literal[2, 3], ...] = (2, 3)
        for version in versions:
            path = build_fmu(Locomotive(), Path(folder) / f"locomotive{version}.fmu", fmi_version=version)
            references = {jumps: simulated(path, jumps=jumps) for jumps in (False, True)}
            for jumps, reference in references.items():
                print(f"FMI {version}: fmpy, inputs {_word(jumps)}: {1e6 * reference:.0f} us a step")
            for interface, jumps in (("model-exchange", False), ("model-exchange", True), ("co-simulation", True)):
                spent = stepped(path, interface, jumps=jumps)  # type: ignore[arg-type]
                share = f"{spent / references[jumps]:.2f} of fmpy"
                print(f"  {interface}, inputs {_word(jumps)}: {1e6 * spent:.0f} us, {share}")


def _word(jumps: bool) -> str:
    return "jump at each step" if jumps else "held"


def beside() -> None:
    """A run with an observer, by each stepper."""
    with tempfile.TemporaryDirectory() as folder:
        path = build_fmu(Locomotive(), Path(folder) / "locomotive.fmu", fmi_version=2)
        for stepper in ("python", "compiled"):
            for interface in ("model-exchange", "co-simulation"):
                s = Scenario(stop=20.0, step=STEP).add("train", fmu=str(path), interface=interface, parameters=STARTS)
                s = s.add("observer", observer="odometer_reset").connect("train.wheel_speed -> observer.odometer")
                s = s.set("master.stepper", stepper)
                begin = process_time()
                s.run()
                print(f"{stepper}, {interface}: {process_time() - begin:.2f} s for 20 s")


def driven(path: Path, count: int) -> None:
    """Steps of the compiled stepper in which the effort jumps, as a recording says."""
    rows = "".join(f"{STEP * k!r},{50e3 + k}\n" for k in range(count + 1))
    efforts = path.with_suffix(".csv")
    efforts.write_text(f"time [s],effort [N]\n{rows}")
    s = Scenario(stop=count * STEP, step=STEP).add("source", recording=str(efforts), interpolation="hold")
    s = s.add("train", fmu=str(path), interface="model-exchange", tolerance=TOLERANCE, parameters=STARTS)
    s = s.connect("source.effort -> train.effort").set("master.stepper", "compiled").set("master.events", "local")
    print(s.run(progress=False).result.summary["components"][1]["solver"])


def instructions(path: Path, count: int) -> Counter[str]:
    """Of so many steps and all before them, by the name of the library."""
    out = path.with_suffix(f".{count}")
    valgrind = ["valgrind", "--tool=callgrind", f"--callgrind-out-file={out}", "--compress-strings=no"]
    code = f"import exchange, pathlib; exchange.driven(pathlib.Path({str(path)!r}), {count})"
    subprocess.run([*valgrind, "--compress-pos=no", sys.executable, "-c", code], check=True, cwd=Path(__file__).parent)
    found, library, inclusive = Counter[str](), "", False
    for line in out.read_text(errors="replace").splitlines():
        if line.startswith("ob="):
            library = Path(line[3:]).name
        elif line[:1].isdigit():  # a line of source and its instructions, behind a call those of what is called
            found[library] += 0 if inclusive else int(line.split()[1])
        inclusive = line.startswith("calls=")
    return found


def own() -> None:
    """What a step costs the FMU, the solver and all else, from the difference of a long run and a short one."""
    with tempfile.TemporaryDirectory() as folder:
        path = build_fmu(Locomotive(), Path(folder) / "locomotive.fmu", fmi_version=2)
        few, many = instructions(path, 500), instructions(path, 2500)
    spent = {name: (many[name] - few[name]) / 2000 for name in many}
    fmu = spent.pop("locomotive.so") + spent.pop("libm.so.6")
    solver = sum(spent.pop(name) for name in [*spent] if name.startswith("sundials_"))
    ideal = fmu + solver
    print(f"the FMU's own calls {fmu:.0f} instructions a step, the solver {solver:.0f}")
    for name in ("exchange.so", "stepper.so"):
        print(f"{name}: {spent[name]:.0f}, {spent[name] / ideal:.3f} of both")
    print(f"all: {(ideal + sum(spent.values())) / ideal:.3f} of both")


SECTIONS: dict[str, Callable[[], None]] = {"steps": steps, "beside": beside, "own": own}


if __name__ == "__main__":
    run_sections(SECTIONS)
