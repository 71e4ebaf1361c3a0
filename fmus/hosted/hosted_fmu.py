"""Building a hosted FMU: the user's Python, the Python end, pythonfmu and the front are put into one file.

Everything is assembled in a folder first and tried there in a process of its own, so that what is packed is what was
tried.
"""

from __future__ import annotations

import copy
import hashlib
import json
import subprocess
import sys
import tempfile
from collections.abc import Iterable, Mapping
from importlib.resources import files
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from fmpy.model_description import Category, CoSimulation, ModelDescription

from fmu_observer.description import LOG_CATEGORIES
from fmus.content.xml import model_description_xml
from fmus.documentation.page import render
from fmus.hosted.host import HostError, make_hosted_block, package_version
from fmus.hosted.hosted_licences import hosted_licences
from fmus.hosted.source import HostedExportError, Model, Source, find_source
from fmus.pack import check_target, fmu_path, pack_fmu
from fmus.toolchain.compile import compile_library, find_compiler, library_name
from fmus.toolchain.platforms import Platform, host_platform
from plant_models.left_behind import owned
from plant_models.missing_package import installation

__all__ = ["HostedExportError", "build_hosted_fmu"]

_OLDEST_PYTHON = (3, 11)
LIBRARIES = {"x86_64-linux": "linux64/libpythonfmu-export.so"}
"""Of pythonfmu's libraries, those that the front has been tried with, by platform tuple."""

MAIN_SOURCE = "all.c"
"""The one file of the front to compile; it includes the others."""

ENTRY = "from {0} import Hosted, hold\n\nhold(globals())\n"

CHECK = """
import importlib, json, sys
resources, module = sys.argv[1:]
sys.path.insert(0, resources)
slave = importlib.import_module(module).Hosted(instance_name="check", resources=resources, visible=0)
print("\\n" + json.dumps([message.msg for message in slave.log_queue]))
"""
_CHECK_SECONDS = 120.0


def build_hosted_fmu(
    model: Model,
    target: Path | str,
    *,
    options: Mapping[str, Any] | None = None,
    preset: str | None = None,
    extra_files: Iterable[Path | str] = (),
    **block_arguments: Any,
) -> Path:
    """Export a block that cannot be traced as an FMI 2.0 co-simulation FMU that runs it in Python.

    Args:
        model: ``path/to/file.py:Class`` or ``package.module:Class``, a class or function, or a hybrid system. It makes
            a hybrid system, or an object with the calls of `fmu_observer.block.FMI2Block` and a `model_description`.
        target: path of the FMU file (ending in ``.fmu``), or a folder that gets ``<name>.fmu``.
        options: arguments of the class; numbers, text and lists of them. None for those that a hybrid system has.
        preset: preset whose values become the start values; None for the system's default.
        extra_files: files and folders that a loose model file imports or reads; they lie beside it in the FMU.
        block_arguments: as for `fmu_observer.block.make_block`, such as `late_policy`.

    Returns:
        Path of the FMU. The same model gives the same bytes; a failed build leaves nothing behind.

    Raises:
        HostedExportError: pythonfmu is missing or has no library for this platform, or the model does not run by
        itself.
        CompilerMissing: no C compiler was found. CompilationError: the compiler refused the front.
        OSError: the target cannot be written.
    """
    library = _pythonfmu_library(host_platform())
    source = find_source(model, options, extra_files)
    recipe = _recipe(source, preset, block_arguments)
    slave = f"hosted_{_digest(source, recipe)[:16]}"
    recipe["module"] = recipe["module"] if source.file is None else f"{slave}_model"
    resources = _resources(source, recipe, slave, library)
    description = _tried(resources, recipe, slave, _digest(source, recipe))
    path = fmu_path(description.coSimulation.modelIdentifier, target)
    check_target(path)
    content = {f"resources/{inner}": text for inner, text in resources.items()}
    content |= _papers(description, source)  # first: a text that XML cannot hold is refused before anything is compiled
    return pack_fmu(content | _front(description), path)


def _tried(resources: Mapping[str, bytes], recipe: Mapping[str, Any], slave: str, digest: str) -> ModelDescription:
    """The description of a model that has run in a process of its own, from the files that go into the FMU."""
    with tempfile.TemporaryDirectory(prefix=owned("fmus-hosted-")) as name:
        folder = Path(name)
        _write(resources, folder)
        description = _describe(recipe, folder, digest)
        _try_alone(folder, slave)
    return description


# -- parts of the file ------------------------------------------------------------------------------------------------


def _pythonfmu_library(platform: Platform) -> bytes:
    if find_spec("pythonfmu") is None:
        raise HostedExportError(f"Python-hosted export needs the package pythonfmu; run: {installation('pythonfmu')}.")
    if platform.name not in LIBRARIES:
        raise HostedExportError(
            f"Python-hosted export is for {', '.join(LIBRARIES)} only; this machine is {platform.name}."
        )
    return (files("pythonfmu") / "resources" / "binaries" / LIBRARIES[platform.name]).read_bytes()


def _recipe(source: Source, preset: str | None, block_arguments: Mapping[str, Any]) -> dict[str, Any]:
    recipe = {
        "module": source.module,
        "class": source.name,
        "file": source.file,
        "options": dict(source.options),
        "preset": preset,
        "arguments": dict(block_arguments),
        "python": list(_OLDEST_PYTHON),
        "package": package_version(),
    }
    try:
        json.dumps(recipe)
    except TypeError as error:
        raise HostedExportError(
            f"options of {source.name} cannot be written into the FMU ({error}); use numbers, text, lists."
        ) from error
    return recipe


def _resources(source: Source, recipe: Mapping[str, Any], slave: str, library: bytes) -> dict[str, bytes]:
    python = {f"pythonfmu/{p.name}": p.read_bytes() for p in files("pythonfmu").iterdir() if p.name.endswith(".py")}
    return {
        "slavemodule.txt": f"{slave}_entry".encode(),
        f"{slave}_entry.py": ENTRY.format(slave).encode(),
        f"{slave}.py": (files("fmus.hosted") / "slave.py").read_bytes(),
        "hosted.json": json.dumps(recipe, indent=1).encode(),
        _library_file(): library,
        **python,
        **{f"model/{name}": text for name, text in source.files.items()},
    }


def _front(description: ModelDescription) -> dict[str, bytes]:
    """The shared library of the FMU."""
    identifier = description.coSimulation.modelIdentifier
    header = {
        "HOSTED_NAME": json.dumps(identifier),
        "HOSTED_GUID": json.dumps(description.instantiationToken),
        "HOSTED_LIBRARY": json.dumps(_library_file()),
        "HOSTED_BUILT_MINOR": str(sys.version_info[1]),
        "HOSTED_OLDEST_MINOR": str(_OLDEST_PYTHON[1]),
    }
    name = library_name(identifier)
    with tempfile.TemporaryDirectory(prefix=owned("fmus-hosted-")) as place:
        folder = Path(place)
        _write({entry.name: entry.read_bytes() for entry in (files("fmus.hosted") / "front").iterdir()}, folder)
        (folder / "hosted_model.h").write_text("".join(f"#define {key} {value}\n" for key, value in header.items()))
        binary = compile_library(find_compiler(), folder, [MAIN_SOURCE], name).read_bytes()
    return {f"binaries/{host_platform().fmi2_folder}/{name}": binary}


def _papers(description: ModelDescription, source: Source) -> dict[str, bytes]:
    text = (
        f"the file resources/model/{source.file}"
        if source.file
        else f"imported from the installed module {source.module}"
    )
    html = _page(description, f"{source.name}, {text}", package_version(), _OLDEST_PYTHON, sys.version_info[1])
    return {
        "modelDescription.xml": _xml(description).encode(),
        "documentation/index.html": html.encode(),
        **{f"documentation/licenses/{name}": text.encode() for name, text in hosted_licences(source).items()},
    }


def _library_file() -> str:
    return "pythonfmu-export" + host_platform().extension


def _write(content: Mapping[str, bytes], folder: Path) -> None:
    for name, text in content.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(text)


def _digest(source: Source, recipe: Mapping[str, Any]) -> str:
    digest = hashlib.sha256(json.dumps({**recipe, "module": source.module}, sort_keys=True).encode())
    for name in sorted(source.files):
        digest.update(name.encode() + b"\0" + source.files[name])
    digest.update((files("fmus.hosted") / "slave.py").read_bytes())
    return digest.hexdigest()


# -- description ------------------------------------------------------------------------------------------------------


def _describe(recipe: Mapping[str, Any], resources: Path, digest: str) -> ModelDescription:
    """The block's own description, with the limits of this kind of FMU and a GUID that names the Python code too."""
    known = set(sys.modules)
    try:
        block = make_hosted_block(recipe, resources)
    except HostError as error:
        raise HostedExportError(str(error)) from error
    except Exception as error:
        raise HostedExportError(f"{recipe['class']} cannot be made: {type(error).__name__}: {error}") from error
    finally:
        for name in set(sys.modules) - known:
            if name == recipe["module"]:
                del sys.modules[name]
    description = copy.copy(block.model_description)
    own = hashlib.sha256(f"{description.instantiationToken}{digest}".encode()).hexdigest()
    description.instantiationToken = f"{{{own[:8]}-{own[8:12]}-{own[12:16]}-{own[16:20]}-{own[20:32]}}}"
    text = _description_text(
        description.description or "", package_version(), _OLDEST_PYTHON, host_platform().fmi2_folder
    )
    description.description, description.modelExchange = text, None
    description.coSimulation = _interface(description.coSimulation)
    description.logCategories = [Category(name=name, description=text) for name, text in LOG_CATEGORIES.items()]
    return description


def _interface(own: CoSimulation) -> CoSimulation:
    return CoSimulation(
        modelIdentifier=own.modelIdentifier,
        needsExecutionTool=True,
        canHandleVariableCommunicationStepSize=own.canHandleVariableCommunicationStepSize,
        canGetAndSetFMUstate=own.canGetAndSetFMUstate,
        canSerializeFMUstate=own.canSerializeFMUstate,
    )


def _xml(description: ModelDescription) -> str:
    """modelDescription.xml; that it needs Python outside the FMU is `needsExecutionTool` in FMI's words."""
    return model_description_xml(description).replace("<CoSimulation ", '<CoSimulation needsExecutionTool="true" ', 1)


# -- trial ------------------------------------------------------------------------------------------------------------


def _try_alone(resources: Path, slave: str) -> None:
    """Make one instance in a fresh process, as an importer will: a file that was forgotten shows here and not at the
    user's.

    Raises:
        HostedExportError: it cannot be made there; with what it said.
    """
    command = [sys.executable, "-c", CHECK, str(resources), slave]
    try:
        done = subprocess.run(
            command, cwd=resources, capture_output=True, text=True, check=False, timeout=_CHECK_SECONDS
        )
    except subprocess.TimeoutExpired as error:
        raise HostedExportError(
            f"making the model in a process of its own took more than {_CHECK_SECONDS:g} s."
        ) from error
    if done.returncode != 0:
        raise HostedExportError(f"the model does not run in a process of its own: {done.stderr.strip()[-2000:]}")
    messages = json.loads(done.stdout.splitlines()[-1])
    if messages:
        raise HostedExportError(f"the model does not run in a process of its own: {'; '.join(messages)}")


# -- the words in it: its description, and the page in ``documentation/`` ---------------------------------------------


_OVERHEAD = (
    "a step costs about 10 us more than the block's own Python, which takes 10 us to more than 100 us where "
    "native C takes 1 us"
)
"""Measured, see docs/reference/hosted_export.md."""


def _needs(package: str, oldest: tuple[int, int]) -> str:
    """What must be there, in one sentence without full stop."""
    return f"Python {oldest[0]}.{oldest[1]} or later with the package fmu-observer {package}"


def _description_text(own: str, package: str, oldest: tuple[int, int], platform: str) -> str:
    """The attribute `description` of modelDescription.xml: the limits first, then what the model says of itself."""
    return (
        f"NEEDS PYTHON: this FMU runs Python code and needs {_needs(package, oldest)} on the machine that runs it. "
        f"Slow ({_OVERHEAD}); not for real-time targets. Only for {platform}; loads into Python processes such as "
        f"fmpy, and into other programs if they find Python's library (see documentation/index.html). {own}"
    ).strip()


def _page(description: ModelDescription, source: str, package: str, oldest: tuple[int, int], built_minor: int) -> str:
    """The page documentation/index.html.

    Args:
        description: of the FMU.
        source: the model in words.
        package: version of fmu-observer.
        oldest: version of Python that suffices, major and minor.
        built_minor: of the Python 3 it was built with.

    Returns:
        HTML.
    """
    return render(
        "hosted.html.j2",
        description,
        needs=_needs(package, oldest),
        source=source,
        overhead=_OVERHEAD,
        built_minor=built_minor,
    )
