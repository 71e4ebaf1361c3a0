"""Building: a hybrid system becomes an FMU file. Puts generation, XML, compilation, documentation and packing in a
row.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from pathlib import Path

from fmpy.model_description import ModelDescription

from fmu_observer.description import FmiVersion, can_exchange, describe
from fmu_observer.event_protocol import EventProtocol
from fmus.content.generate import Equations, generate_model, trace_equations
from fmus.content.names import check_names
from fmus.content.resources import resource_files
from fmus.content.xml import build_description_xml, model_description_xml
from fmus.documentation.page import documentation_files
from fmus.pack import check_target, fmu_path, pack_fmu
from fmus.toolchain.compile import header_folder
from fmus.toolchain.platforms import HOST, Platform, binary_files
from fmus.toolchain.targets import Progress, Target, choose_targets, compile_targets
from plant_models.hybrid import HybridSystem

MAIN_SOURCE = "all.c"
"""The one file to compile; it includes the others."""

FACES = {2: {"fmi2.c", "fmi2_prefix.h"}, 3: {"fmi3.c"}}


@dataclass(frozen=True)
class BuildPlan:
    """What an FMU will be made of; all that decides its content except the compilers.

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
        """Our files in ``sources/``, by name: the runtime with the interface of this FMI version, and the model."""
        others = set().union(*(names for version, names in FACES.items() if version != self.fmi_version))
        files = {name: text for name, text in runtime_sources().items() if name not in others}
        files["model.c"] = generate_model(self.system, self.equations, self.description, self.preset).encode()
        return files

    def header_files(self) -> dict[str, bytes]:
        """The headers of the FMI standard in ``sources/``, by name."""
        return standard_headers(self.fmi_version)

    def description_xml(self) -> str:
        """The text of modelDescription.xml."""
        return model_description_xml(self.description, self.sources)


def plan_fmu(
    system: HybridSystem, fmi_version: FmiVersion = 3, preset: str | None = None, protocol: EventProtocol | None = None
) -> BuildPlan:
    """Trace and describe a system.

    Args:
        fmi_version: 2 or 3.

    Raises:
        ValueError: the FMI version is not 2 or 3, the preset is unknown, a name is not legal, the protocol is none of
        this
            version, or the system cannot become C.
    """
    if fmi_version not in FACES:
        raise ValueError(f"FMI version {fmi_version!r} cannot be exported; choose 2 or 3.")
    check_names(system)
    equations = trace_equations(system)
    description = describe(system, fmi_version, preset=preset, protocol=protocol, model_exchange=can_exchange(system))
    return BuildPlan(system, equations, description, fmi_version, preset)


def build_fmu(
    system: HybridSystem,
    target: Path | str,
    fmi_version: FmiVersion = 3,
    preset: str | None = None,
    *,
    platforms: str | Sequence[str] = HOST,
    protocol: EventProtocol | None = None,
    progress: Progress | None = None,
) -> Path:
    """Export a hybrid system as a native FMU, with its sources and documentation.

    Args:
        system: the hybrid system.
        target: path of the FMU file (ending in ``.fmu``), or a folder that gets ``<name>.fmu``.
        fmi_version: 2 or 3.
        preset: preset whose values become the start values; None for the system's default.
        platforms: ``host`` (built by the system's compiler), ``all``, or platform tuples such as ``x86_64-windows``
            (built by the cross compiler of the extra ``cross``), as a sequence or separated by commas.
        protocol: how it is notified of triggered events, and what it does with late ones; by default clocks in FMI 3
            and counts in FMI 2, and late events are replayed.
        progress: called with the name of each platform whose library is done, from any thread.

    Returns:
        Path of the FMU. The same system gives the same bytes; a failed build leaves nothing behind.

    Raises:
        ValueError: the FMI version, the preset, a platform, the protocol, a name or the system does not allow it.
        TracingError: a function of the system cannot be traced.
        CompilerMissing: no C compiler was found, or ``ziglang`` is not installed.
        CompilationError: the compiler refused the sources.
        OSError: the target cannot be written.
    """
    path = fmu_path(system.name, target)
    check_names(system)
    check_target(path)
    targets = choose_targets(platforms)
    draft = BuildDraft.of(plan_fmu(system, fmi_version, preset, protocol), targets)
    return draft.pack(draft.compile(progress), path)


@dataclass(frozen=True)
class BuildDraft:
    """An FMU of which all but the libraries is written.

    Only `compile` may be called in another thread: CasADi is at work everywhere else.

    Args:
        plan: what it will be made of. targets: who compiles. description: modelDescription.xml.
        sources: C files and headers by name.
    """

    plan: BuildPlan
    targets: Sequence[Target]
    description: bytes
    sources: dict[str, bytes]

    @classmethod
    def of(cls, plan: BuildPlan, targets: Sequence[Target]) -> BuildDraft:
        """Generate the text of an FMU.

        Raises:
            TextRefusedError: a name or a description holds a character that XML forbids.
        """
        # first: a text that XML cannot hold is refused before anything is compiled
        description = plan.description_xml().encode()
        return cls(plan, targets, description, plan.source_files() | plan.header_files())

    def compile(self, progress: Progress | None = None) -> dict[Platform, bytes]:
        """The libraries.

        Args:
            progress: called with what is being done.

        Raises:
            CompilationError: a compiler refused the sources.
        """
        return compile_targets(self.targets, self.sources, self.plan.sources, self.plan.system.name, progress)

    def pack(self, libraries: dict[Platform, bytes], path: Path) -> Path:
        """Write the file.

        Args:
            path: of the FMU.

        Raises:
            OSError: it cannot be written.
        """
        plan = self.plan
        content = {f"sources/{name}": text for name, text in self.sources.items()}
        content["modelDescription.xml"] = self.description
        if plan.fmi_version == 3:
            content["sources/buildDescription.xml"] = build_description_xml(plan.system.name, plan.sources).encode()
        content |= resource_files(plan.system, plan.preset)
        content |= binary_files(plan.fmi_version, plan.system.name, libraries)
        content |= documentation_files(plan.system, plan.description, plan.preset, self.targets)
        return pack_fmu(content, path)


@cache
def runtime_sources() -> dict[str, bytes]:
    """The C files of the runtime that ships with this package, by name."""
    folder = files("fmus") / "runtime"
    return {entry.name: entry.read_bytes() for entry in folder.iterdir() if entry.name.endswith((".c", ".h"))}


@cache
def standard_headers(fmi_version: int) -> dict[str, bytes]:
    """The headers of the FMI standard, by name, as fmpy carries them.

    Args:
        fmi_version: 2 or 3.
    """
    return {path.name: path.read_bytes() for path in sorted(header_folder().glob(f"fmi{fmi_version}*.h"))}
