"""Building: a hybrid system becomes an FMU file. Puts generation, XML, compilation and packing in a row."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from pathlib import Path

from fmpy.model_description import ModelDescription

from fmu_observer.description import FmiVersion, describe
from fmus.compile import Compiler, binaries_folder, compile_library, find_compiler, library_name
from fmus.generate import Equations, generate_model, trace_equations
from fmus.pack import pack_fmu
from fmus.xml import build_description_xml, model_description_xml
from plant_models.hybrid import HybridSystem

MAIN_SOURCE = "all.c"
"""The one file to compile; it includes the others."""

FACES = {2: "fmi2.c", 3: "fmi3.c"}


@dataclass(frozen=True)
class Plan:
    """What an FMU will be made of; all that decides its content except the compiler.

    Args:
        system: the hybrid system. equations: its traced functions. description: its model description.
        fmi_version: 2 or 3. preset: preset of the start values.
    """

    system: HybridSystem
    equations: Equations
    description: ModelDescription
    fmi_version: FmiVersion
    preset: str | None

    @property
    def sources(self) -> list[str]:
        """Names of the C files to compile."""
        return [MAIN_SOURCE]

    def source_files(self) -> dict[str, bytes]:
        """All that the FMU carries in ``sources/``, by name: the runtime with the face of this FMI version, and the model."""
        others = {name for version, name in FACES.items() if version != self.fmi_version}
        files = {name: text for name, text in runtime_sources().items() if name not in others}
        files["model.c"] = generate_model(self.system, self.equations, self.description, self.preset).encode()
        return files

    def description_xml(self) -> str:
        """The text of modelDescription.xml."""
        return model_description_xml(self.description, self.sources)


def plan_fmu(system: HybridSystem, fmi_version: FmiVersion = 3, preset: str | None = None) -> Plan:
    """Trace and describe a system.

    Raises:
        ValueError: the FMI version is not 2 or 3, the preset is unknown, or the system cannot become C.
    """
    if fmi_version not in FACES:
        raise ValueError(f"FMI version {fmi_version!r} cannot be exported; choose 2 or 3.")
    equations = trace_equations(system)
    return Plan(system, equations, describe(system, fmi_version, preset=preset), fmi_version, preset)


def build_fmu(system: HybridSystem, target: Path | str, fmi_version: FmiVersion = 3, preset: str | None = None) -> Path:
    """Export a hybrid system as a native co-simulation FMU, with its sources.

    Args:
        system: the hybrid system.
        target: path of the FMU file (ending in ``.fmu``), or a folder that gets ``<name>.fmu``.
        fmi_version: 2 or 3.
        preset: preset whose values become the start values; None for the system's default.

    Returns:
        Path of the FMU. The same system gives the same bytes; a failed build leaves nothing behind.

    Raises:
        ValueError: the FMI version, the preset or the system does not allow it.
        CompilerMissing: no C compiler was found.
        CompilationError: the compiler refused the sources.
    """
    plan = plan_fmu(system, fmi_version, preset)
    compiler = find_compiler()
    path = Path(target)
    return write_fmu(plan, compiler, path if path.suffix.lower() == ".fmu" else path / f"{system.name}.fmu")


def write_fmu(plan: Plan, compiler: Compiler, target: Path) -> Path:
    """Carry out a plan: generate, compile, pack.

    Raises:
        CompilationError: the compiler refused the sources.
    """
    sources = plan.source_files()
    library = library_name(plan.system.name)
    with tempfile.TemporaryDirectory(prefix="fmus-") as name:
        folder = Path(name)
        for source, text in sources.items():
            (folder / source).write_bytes(text)
        binary = compile_library(compiler, folder, plan.sources, library).read_bytes()
    content = {f"sources/{source}": text for source, text in sources.items()}
    content[f"{binaries_folder(plan.fmi_version)}/{library}"] = binary
    content["modelDescription.xml"] = plan.description_xml().encode()
    if plan.fmi_version == 3:
        content["sources/buildDescription.xml"] = build_description_xml(plan.system.name, plan.sources).encode()
    return pack_fmu(content, target)


@cache
def runtime_sources() -> dict[str, bytes]:
    """The C files of the runtime that ships with this package, by name."""
    folder = files("fmus") / "runtime"
    return {entry.name: entry.read_bytes() for entry in folder.iterdir() if entry.name.endswith((".c", ".h"))}
