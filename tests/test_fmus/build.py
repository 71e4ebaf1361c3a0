"""Builds the test FMUs: a C source of ``c/``, a generated ``config.h`` and a model description become an ``.fmu``.

    from test_fmus.build import linear_fmu
    fmu = linear_fmu(tmp_path, "mass", [[0, 1], [0, 0]], [[0], [1]], [[1, 0]], [[0]], version=2, inputs=["force"],
    outputs=["x"])

A library is compiled once for each content and machine; it is kept in the system's folder for temporary files.
"""

from __future__ import annotations

import getpass
import hashlib
import os
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
from test_fmus.description import Model, Variable, Version, description_xml

from fmus.pack import pack_fmu
from fmus.toolchain.compile import compile_library, find_compiler, library_name
from fmus.toolchain.platforms import host_platform

SOURCES = Path(__file__).parent / "c"
CATEGORIES = ("logEvents", "logStatusWarning", "logStatusDiscard", "logStatusError", "logAll")
TIME = Variable("time", 0, "independent")

Matrix = Sequence[Sequence[float]] | np.ndarray
Define = str | int | float | bool | Sequence[float]


def linear_fmu(
    folder: Path,
    name: str,
    A: Matrix,
    B: Matrix,
    C: Matrix,
    D: Matrix,
    *,
    version: Version = 3,
    inputs: Sequence[str] | None = None,
    outputs: Sequence[str] | None = None,
    x0: Sequence[float] | None = None,
    u0: Sequence[float] | None = None,
    units: Mapping[str, str] | None = None,
    state: bool = True,
    variable_step: bool = True,
    input_derivatives: bool = False,
    output_derivatives: bool = False,
    directional: bool = False,
    inner_instants: int = 0,
    inner_linear: bool = False,
    early: bool = False,
    frozen_outputs: bool = False,
    strict: bool = False,
    closed: bool = False,
    declare_dependencies: bool = True,
    once_per_process: bool = False,
    needs_tool: bool = False,
) -> Path:
    """A co-simulation FMU of ``x' = A x + B u``, ``y = C x + D u``, exact for inputs that are held over a step (or
    linear).

    Variables: the inputs and outputs by name (default ``u1, u2, ...`` and ``y1, y2, ...``), parameters ``x0[1]``, ...
    with the start values of the states, locals ``x[1]``, ... with the states. Value references: 0 time, inputs,
    outputs, x0, x. An output depends directly on the inputs where D is not zero, and the model description says exactly
    that.

    Args:
        folder: where ``<name>.fmu`` goes. name: model identifier. A, B, C, D: shapes (n, n), (n, m), (p, n), (p, m).
        version: of FMI. x0, u0: start values. units: by variable name, for example ``{"force": "N"}``.
        state: states can be saved, restored and serialized (FMI 2.0, 3.0). variable_step: declared, and true.
        input_derivatives: FMI 1.0 and 2.0, ``canInterpolateInputs``: first derivatives of the inputs are taken, kept
            until set anew, and the input itself moves along during a step.
        output_derivatives: of first order. directional: directional derivatives of outputs by inputs (and by x0 until
            the end of initialisation).
        inner_instants: FMI 3.0: inside a step the FMU asks so often for its inputs, at equidistant instants: strictly
            inside, the inputs held from then on; with `inner_linear` up to and with the end of the step, the inputs
            linear in between.
        early: FMI 3.0: it may return early at an inner instant where the importer asks for it.
        frozen_outputs: outputs do not follow inputs that are set between steps, as the standard permits.
        strict: between steps it refuses to be read after an input was set (FMI 2.0.5, 4.2.4), and is lost then.
        closed: it refuses to be read in Initialization Mode.
        declare_dependencies: False: nothing is said of direct dependencies.
        once_per_process, needs_tool: declared only.
    """
    a, b, c, d = _shaped(A, B, C, D)
    n, m, p = len(a), d.shape[1], len(d)
    inputs = list(inputs) if inputs is not None else [f"u{i + 1}" for i in range(m)]
    outputs = list(outputs) if outputs is not None else [f"y{i + 1}" for i in range(p)]
    x0 = [float(v) for v in (x0 if x0 is not None else np.zeros(n))]
    u0 = [float(v) for v in (u0 if u0 is not None else np.zeros(m))]
    if (len(inputs), len(outputs), len(x0), len(u0)) != (m, p, n, m):
        raise ValueError(
            f"{name}: A {a.shape}, B {b.shape}, C {c.shape}, D {d.shape} do not fit the names and start values."
        )
    units = units or {}
    asked = {"intermediateUpdate": "true"} if inner_instants and version == 3 else {}
    variables = [TIME]
    variables += [
        Variable(v, 1 + j, "input", start=u0[j], unit=units.get(v), further=asked) for j, v in enumerate(inputs)
    ]
    for i, v in enumerate(outputs):
        depends = [inputs[j] for j in range(m) if d[i, j] != 0.0] if declare_dependencies else None
        variables.append(Variable(v, 1 + m + i, "output", unit=units.get(v), depends=depends, further=asked))
    variables += [Variable(f"x0[{i + 1}]", 1 + m + p + i, "parameter", start=x0[i]) for i in range(n)]
    variables += [Variable(f"x[{i + 1}]", 1 + m + p + n + i, "local") for i in range(n)]
    flags = capability_flags(
        version,
        state=state,
        variable_step=variable_step,
        input_derivatives=input_derivatives,
        output_derivatives=output_derivatives,
        directional=directional,
        intermediate=inner_instants > 0,
        early=early,
        once_per_process=once_per_process,
        needs_tool=needs_tool,
    )
    defines: dict[str, Define] = {
        "NX": n,
        "NU": m,
        "NY": p,
        "INNER_INSTANTS": inner_instants if version == 3 else 0,
        "INNER_LINEAR": inner_linear,
        "CAN_RETURN_EARLY": early,
        "HAS_INPUT_DERIVATIVES": input_derivatives and version < 3,
        "HAS_OUTPUT_DERIVATIVES": output_derivatives,
        "HAS_DIRECTIONAL": directional and version > 1,
        "FROZEN_OUTPUTS": frozen_outputs,
        "REFUSES_GET_AFTER_SET": strict,
        "REFUSES_GET_AT_START": closed,
        "CAN_SAVE": state,
        "A": a.ravel().tolist(),
        "B": b.ravel().tolist(),
        "C": c.ravel().tolist(),
        "D": d.ravel().tolist(),
        "X0": x0,
        "U0": u0,
    }
    return build_fmu(folder, name, "linear.c", version, variables, flags, defines)


def _shaped(A: Matrix, B: Matrix, C: Matrix, D: Matrix) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    d = np.atleast_2d(np.asarray(D, dtype=float))
    p, m = d.shape
    a = np.asarray(A, dtype=float)
    n = round(float(np.sqrt(a.size)))
    shapes = ((n, n), (n, m), (p, n))
    a, b, c = (np.asarray(M, dtype=float).reshape(shape) for M, shape in zip((A, B, C), shapes, strict=True))
    return a, b, c, d


def capability_flags(
    version: Version,
    *,
    state: bool = True,
    variable_step: bool = True,
    input_derivatives: bool = False,
    output_derivatives: bool = False,
    directional: bool = False,
    intermediate: bool = False,
    early: bool = False,
    event_mode: bool = False,
    might_return_early: bool = False,
    once_per_process: bool = False,
    needs_tool: bool = False,
) -> dict[str, str]:
    """Capabilities as attributes, in the words of the FMI version; what it has no word for is left out."""
    by_version: dict[int, dict[str, bool]] = {
        1: {
            "canHandleVariableCommunicationStepSize": variable_step,
            "canHandleEvents": False,
            "canRejectSteps": False,
            "canInterpolateInputs": input_derivatives,
            "canBeInstantiatedOnlyOncePerProcess": once_per_process,
            "canNotUseMemoryManagementFunctions": True,
        },
        2: {
            "canHandleVariableCommunicationStepSize": variable_step,
            "canInterpolateInputs": input_derivatives,
            "canGetAndSetFMUstate": state,
            "canSerializeFMUstate": state,
            "providesDirectionalDerivative": directional,
            "canBeInstantiatedOnlyOncePerProcess": once_per_process,
            "needsExecutionTool": needs_tool,
            "canNotUseMemoryManagementFunctions": True,
        },
        3: {
            "canHandleVariableCommunicationStepSize": variable_step,
            "canGetAndSetFMUState": state,
            "canSerializeFMUState": state,
            "providesDirectionalDerivatives": directional,
            "providesIntermediateUpdate": intermediate,
            "canReturnEarlyAfterIntermediateUpdate": early,
            "mightReturnEarlyFromDoStep": might_return_early,
            "hasEventMode": event_mode,
            "canBeInstantiatedOnlyOncePerProcess": once_per_process,
            "needsExecutionTool": needs_tool,
        },
    }
    flags = {name: "true" for name, value in by_version[version].items() if value}
    return flags | ({"maxOutputDerivativeOrder": "1"} if output_derivatives else {})


DEFAULTS: dict[str, Define] = {
    "CAN_SAVE": True,
    "HAS_EVENT_MODE": False,
    "HAS_INPUT_DERIVATIVES": False,
    "HAS_OUTPUT_DERIVATIVES": False,
    "HAS_DIRECTIONAL": False,
    "FROZEN_OUTPUTS": False,
    "HIDES_LAST_TIME": False,
    "REFUSES_GET_AFTER_SET": False,
    "REFUSES_GET_AT_START": False,
    "MIGHT_RETURN_EARLY": True,
    "TAKES_TOLERANCE": False,
}
"""Of every model, unless it says otherwise."""


def build_fmu(
    folder: Path,
    name: str,
    source: str,
    version: Version,
    variables: Sequence[Variable],
    flags: Mapping[str, str],
    defines: Mapping[str, Define],
    enumerations: Mapping[str, Sequence[str]] | None = None,
    categories: Sequence[str] = CATEGORIES,
    beside: Path | None = None,
    tolerance: float | None = None,
) -> Path:
    """An FMU of one of the C sources.

    Args:
        folder: where ``<name>.fmu`` goes. name: model identifier. source: file in ``test_fmus/c``. version: of FMI.
        variables: the time first. flags: see `capability_flags`. defines: macros of ``config.h``; sequences become
            arrays of double. enumerations: items by type name. categories: log categories.
        beside: a shared library, named ``lib....so``, that it is linked to and brings along.
        tolerance: of the default experiment.
    """
    token = hashlib.sha256(f"{name} {source} {version} {variables!r} {sorted(flags.items())}".encode()).hexdigest()[:32]
    defines = DEFAULTS | dict(defines)
    if tuple(categories) != CATEGORIES:
        defines["LOG_CATEGORIES"] = ", ".join(f'"{text}"' for text in categories)
    config = config_header(defines, version, name, token)
    linked = (
        ()
        if beside is None
        else (f"-L{beside.parent}", "-Wl,--no-as-needed", f"-l:{beside.name}", "-Wl,-rpath,$ORIGIN")
    )
    library = compiled(source, config, name, linked)
    platform = host_platform()
    place = platform.fmi2_folder if version < 3 else platform.name
    model = Model(name, token, variables, flags, enumerations or {}, categories, tolerance)
    content = {
        "modelDescription.xml": description_xml(model, version).encode(),
        f"binaries/{place}/{library_name(name)}": library,
    } | ({} if beside is None else {f"binaries/{place}/{beside.name}": beside.read_bytes()})
    return pack_fmu(content, Path(folder) / f"{name}.fmu")


def config_header(defines: Mapping[str, Define], version: Version, name: str, token: str) -> str:
    """The text of ``config.h``."""
    lines = [f"#define FMI_VERSION {version}", f"#define MODEL_IDENTIFIER {name}", f'#define TOKEN "{token}"']
    for key, value in defines.items():
        if isinstance(value, str | int | float):
            lines.append(f"#define {key} {int(value) if isinstance(value, bool) else value}")
        else:
            numbers = ", ".join(float(v).hex() for v in value)
            lines.append(f"__attribute__((unused)) static const double {key}[] = {{{numbers or '0.0'}}};")
    return "\n".join(lines) + "\n"


def compiled(source: str, config: str, name: str, linked: Sequence[str] = ()) -> bytes:
    """The shared library of a source with its ``config.h``, from the cache or compiled now."""
    compiler = find_compiler()
    compiler = replace(compiler, flags=(*compiler.flags, *linked))
    if source != "linear.c":  # the one that benchmarks use; the others compile three times faster so
        compiler = replace(compiler, flags=(*compiler.flags, "-O0"))
    digest = hashlib.sha256(
        "\0".join((compiler.identity(), source, config, name, _source_text())).encode()
    ).hexdigest()[:32]
    kept = _cache() / f"{digest}.library"
    if not kept.exists():
        with tempfile.TemporaryDirectory(prefix="test_fmus-") as scratch:
            folder = Path(scratch)
            for file, text in _source_files().items():
                (folder / file).write_text(text)
            (folder / "config.h").write_text(config)
            library = compile_library(compiler, folder, [source], library_name(name))
            draft = kept.with_suffix(f".{os.getpid()}")
            draft.write_bytes(library.read_bytes())
            draft.replace(kept)  # two processes write the same bytes, each in one move
    return kept.read_bytes()


@cache
def _source_files() -> dict[str, str]:
    return {path.name: path.read_text() for path in sorted(SOURCES.iterdir()) if path.suffix in (".c", ".h")}


@cache
def _source_text() -> str:
    return "\0".join(f"{name}\0{text}" for name, text in _source_files().items())


@cache
def _cache() -> Path:
    """Of this user alone, among the temporary files of the machine."""
    folder = (
        Path(tempfile.gettempdir())
        / f"fmu-observer-test_fmus-{os.getuid() if hasattr(os, 'getuid') else getpass.getuser()}"
    )
    folder.mkdir(mode=0o700, exist_ok=True)
    return folder
