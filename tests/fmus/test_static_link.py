"""Several FMUs in one program: their sources, linked statically with a prefix each, do not meet, and both run."""

from __future__ import annotations

import subprocess
from pathlib import Path

import fmpy
import numpy as np
import pytest
from fmpy import extract, read_model_description

from fmus import build_fmu, cached_fmu, recipe
from fmus.documentation.page import _rebuild_commands
from fmus.toolchain.compile import find_compiler

pytestmark = pytest.mark.compiler

MAIN = {
    2: """
#include <stdio.h>
#include "fmi2FunctionTypes.h"
#define DECLARE(prefix) \\
    fmi2InstantiateTYPE prefix##fmi2Instantiate; fmi2SetupExperimentTYPE prefix##fmi2SetupExperiment; \\
    fmi2EnterInitializationModeTYPE prefix##fmi2EnterInitializationMode; fmi2FreeInstanceTYPE prefix##fmi2FreeInstance; \\
    fmi2ExitInitializationModeTYPE prefix##fmi2ExitInitializationMode; fmi2DoStepTYPE prefix##fmi2DoStep; \\
    fmi2GetRealTYPE prefix##fmi2GetReal; fmi2SetRealTYPE prefix##fmi2SetReal;
DECLARE(first_)
DECLARE(second_)
DECLARE(third_)
#define RUN(prefix, token, input, value, output) do { \\
    fmi2CallbackFunctions callbacks = {0}; \\
    void *c = prefix##fmi2Instantiate("one", fmi2CoSimulation, token, "", &callbacks, 0, 0); \\
    fmi2ValueReference in = input, out = output; double u = value, y = 0.0; \\
    prefix##fmi2SetupExperiment(c, 0, 0.0, 0.0, 0, 0.0); \\
    prefix##fmi2EnterInitializationMode(c); prefix##fmi2ExitInitializationMode(c); \\
    for (int i = 0; i < 100; i++) { prefix##fmi2SetReal(c, &in, 1, &u); prefix##fmi2DoStep(c, 0.01 * i, 0.01, 1); } \\
    prefix##fmi2GetReal(c, &out, 1, &y); printf("%.17g\\n", y); prefix##fmi2FreeInstance(c); } while (0)
""",  # noqa: E501
    3: """
#include <stdio.h>
#include "fmi3FunctionTypes.h"
#define DECLARE(prefix) \\
    fmi3InstantiateCoSimulationTYPE prefix##fmi3InstantiateCoSimulation; fmi3FreeInstanceTYPE prefix##fmi3FreeInstance; \\
    fmi3EnterInitializationModeTYPE prefix##fmi3EnterInitializationMode; fmi3DoStepTYPE prefix##fmi3DoStep; \\
    fmi3ExitInitializationModeTYPE prefix##fmi3ExitInitializationMode; \\
    fmi3GetFloat64TYPE prefix##fmi3GetFloat64; fmi3SetFloat64TYPE prefix##fmi3SetFloat64;
DECLARE(first_)
DECLARE(second_)
DECLARE(third_)
#define RUN(prefix, token, input, value, output) do { \\
    fmi3Instance c = prefix##fmi3InstantiateCoSimulation("one", token, "", 0, 0, 0, 0, NULL, 0, NULL, NULL, NULL); \\
    fmi3ValueReference in = input, out = output; double u = value, y = 0.0, last; bool a, b, d; \\
    prefix##fmi3EnterInitializationMode(c, 0, 0.0, 0.0, 0, 0.0); prefix##fmi3ExitInitializationMode(c); \\
    for (int i = 0; i < 100; i++) { \\
        prefix##fmi3SetFloat64(c, &in, 1, &u, 1); prefix##fmi3DoStep(c, 0.01 * i, 0.01, 1, &a, &b, &d, &last); } \\
    prefix##fmi3GetFloat64(c, &out, 1, &y, 1); printf("%.17g\\n", y); prefix##fmi3FreeInstance(c); } while (0)
""",  # noqa: E501
}
MODELS = {
    "first_": ("locomotive", "effort", 5e4, "speed"),
    "second_": ("takagi_sugeno_cdo", "odometer", 7.0, "position"),
    "third_": ("takagi_sugeno_cdo", "effort", 6e4, "speed"),  # the same model twice
}


def run(command: list[str], folder: Path) -> str:
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


def constant_input(version: int, model: str, name: str, value: float, output: str) -> float:
    """The last output of the same FMU as a shared library, stepped by fmpy with the same input."""
    fmu = str(cached_fmu(recipe(model), version))  # type: ignore[arg-type]
    signal = np.array([(0.0, value), (2.0, value)], [("time", float), (name, float)])
    run = {
        "stop_time": 1.0,
        "step_size": 0.01,
        "output_interval": 0.01,
        "fmi_type": "CoSimulation",
        "use_event_mode": False,
    }
    return float(fmpy.simulate_fmu(fmu, input=signal, output=[output], **run)[output][-1])


def test_three_models_in_one_program(version: int, tmp_path: Path) -> None:
    calls, objects = [], []
    for prefix, (model, name, value, output) in MODELS.items():
        folder = Path(extract(str(cached_fmu(recipe(model), version)), str(tmp_path / prefix)))  # type: ignore[arg-type]
        by_name = {v.name: v for v in read_model_description(str(folder)).modelVariables}
        token = read_model_description(str(folder)).guid
        calls.append(
            f'RUN({prefix}, "{token}", {by_name[name].valueReference}, {value}, {by_name[output].valueReference});'
        )
        objects.append(str(folder / "sources" / "model.o"))
        command = [
            *find_compiler().command,
            "-std=c11",
            "-O2",
            "-ffp-contract=off",
            f"-DFMI{version}_FUNCTION_PREFIX={prefix}",
        ]
        run([*command, "-c", "all.c", "-o", "model.o"], folder / "sources")
    (tmp_path / "main.c").write_text(MAIN[version] + f"int main(void) {{ {' '.join(calls)} return 0; }}\n")
    command = [
        *find_compiler().command,
        "-std=c11",
        "-I",
        str(folder / "sources"),
        "main.c",
        *objects,
        "-o",
        "program",
        "-lm",
    ]
    run(command, tmp_path)
    numbers = [float(line) for line in run([str(tmp_path / "program")], tmp_path).split()]
    assert numbers == [constant_input(version, *model) for model in MODELS.values()]


def test_the_sources_alone_give_a_library(version: int, tmp_path: Path) -> None:
    """The plain command that the documentation prints, in a copy of ``sources/`` and nothing else: the same numbers."""
    fmu = build_fmu(recipe("locomotive"), tmp_path / "built.fmu", version)  # type: ignore[arg-type]
    folder = Path(extract(str(fmu), str(tmp_path / "unpacked")))
    (library,) = (folder / "binaries").rglob("locomotive.*")
    library.unlink()
    system = {"linux": "Linux", "darwin": "macOS", "windows": "Windows"}[fmpy.system]
    _, *rest = _rebuild_commands("locomotive")[system].split()
    (folder / "sources").rename(tmp_path / "alone")
    run([*find_compiler().command, *rest], tmp_path / "alone")
    (tmp_path / "alone" / library.name).rename(library)
    effort = np.array([(0.0, 8e4), (3.0, -8e4)], [("time", float), ("effort", float)])
    results = [
        fmpy.simulate_fmu(
            str(where), stop_time=3.0, step_size=0.01, output_interval=0.01, input=effort, fmi_type="CoSimulation"
        )
        for where in (fmu, folder)
    ]
    assert np.array_equal(results[0], results[1])
    assert np.ptp(results[0]["speed"]) > 0.5
