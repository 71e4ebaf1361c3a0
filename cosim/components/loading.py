"""Loading: an FMU file, a shipped model or a hybrid system becomes a component."""

from __future__ import annotations

import ctypes
import hashlib
import os
import shutil
import struct
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, Literal

import fmpy
from fmpy.model_description import ModelDescription

from cosim.components.component import Component
from cosim.components.description import demand_steppable, open_fmu, read_description
from cosim.components.fmi3 import FMI3Component
from cosim.components.stated_units import NONE_STATED, StatedUnit, state_units
from cosim.components.unpacking import unpack
from cosim.errors import CouplingError, FmuLoadError, ScenarioError
from cosim.process.exit_guard import guard_exit
from cosim.process.last_call import LAST_CALL
from fmu_observer.description import describe
from fmus.exchange.description import as_stepped
from fmus.exchange.slave import TOLERANCE, as_slave
from fmus.fmi.archive import Archive, NotAnFmuError
from fmus.fmi.binaries import platform_folder
from fmus.fmi.description import negated_aliases
from fmus.fmi.fmi1 import FMI1Slave
from fmus.fmi.fmi2 import FMI2Slave
from fmus.fmi.library import load
from fmus.fmi.standard import CO_SIMULATION, Interface, Method, fmi_version
from fmus.fmi.surroundings import Surroundings
from fmus.isolation.crashes import note_crash
from fmus.isolation.library import load_isolated
from fmus.isolation.limits import OwnProcess
from plant_models.disk_cache.files import file_digest
from plant_models.hybrid import HybridSystem, TracingError

_LINK_MAP = 2  # dlinfo: RTLD_DI_LINKMAP
_brought: dict[str, tuple[Path, str]] = {}
"""For every library that an FMU brought into this process, by its path: the FMU, and the digest of the library."""

_MAGIC = b"\x7fELF"
_DYNAMIC, _LOAD = 2, 1  # types of segments
_END, _NEEDED, _STRINGS, _SONAME = 0, 1, 5, 14  # entries of the dynamic section


@dataclass(frozen=True)
class _Linkage:
    """What the dynamic linker goes by.

    Args:
        soname: of the library itself, empty where it has none. needed: of the libraries it asks for.
    """

    soname: str = ""
    needed: tuple[str, ...] = ()


def _read_linkage(path: Path) -> _Linkage | None:
    """The linkage of a 64-bit little-endian ELF file; None of any other file, and of a damaged one."""
    try:
        content = path.read_bytes()
        return _linkage(content) if content[:6] == _MAGIC + b"\x02\x01" else None
    except (OSError, struct.error, ValueError):
        return None


def _linkage(content: bytes) -> _Linkage:
    start, size, count = struct.unpack_from("<32xQ14x2H", content)  # e_phoff, e_phentsize, e_phnum
    segments = [struct.unpack_from("<2I4Q", content, start + k * size) for k in range(count)]
    entries = [
        struct.unpack_from("<2Q", content, offset + at)
        for kind, _, offset, _, _, length in segments
        if kind == _DYNAMIC
        for at in range(0, length, 16)
    ]
    entries = entries[: next((k for k, (tag, _) in enumerate(entries) if tag == _END), len(entries))]
    address = next((value for tag, value in entries if tag == _STRINGS), 0)
    loads = [(begin, offset, length) for kind, _, offset, begin, _, length in segments if kind == _LOAD]
    strings = next(
        (offset + address - begin for begin, offset, length in loads if begin <= address < begin + length), 0
    )

    def text(value: int) -> str:
        return content[strings + value : content.index(b"\0", strings + value)].decode("utf-8", "replace")

    soname = next((text(value) for tag, value in entries if tag == _SONAME), "")
    return _Linkage(soname, tuple(text(value) for tag, value in entries if tag == _NEEDED))


class _LinkMap(ctypes.Structure):
    _fields_ = (("address", ctypes.c_void_p), ("name", ctypes.c_char_p))


def _refuse_foreign_libraries(library: Path, fmu: Path, name: str) -> None:
    """Make sure that what an FMU brings for itself is what it would get."""
    if sys.platform != "linux":
        return
    for soname, path in _own_needs(library).items():
        loaded = _loaded(soname)
        digest = hashlib.sha256(path.read_bytes()).hexdigest()
        if loaded is None or loaded not in _brought:
            _brought[str(path)] = fmu, digest
            continue
        other, its_digest = _brought[loaded]
        if its_digest != digest:
            raise FmuLoadError(
                f"{name}: {fmu} and {other} each bring a library {soname}, and these differ; in one process both would "
                f"use that "
                f"of {other.name}, and one of them compute wrong numbers. Have one of them built with the library "
                f"linked into it "
                "(static), or under another name; or run the FMUs in programs of their own."
            )


def _own_needs(library: Path) -> dict[str, Path]:
    """The libraries that one needs, directly or not, and that lie in the FMU itself: by the name they are asked for."""
    folder = library.parent
    if not library.is_file():
        return {}  # which loading it will say
    files = {path.name: path for path in folder.iterdir() if path.is_file() and path != library}
    files |= {
        linkage.soname: path
        for path in files.values()
        if (linkage := _read_linkage(path)) is not None and linkage.soname
    }
    found: dict[str, Path] = {}
    waiting = [library]
    while waiting:
        linkage = _read_linkage(waiting.pop())
        for needed in () if linkage is None else linkage.needed:
            if needed in files and needed not in found:
                found[needed] = files[needed]
                waiting.append(files[needed])
    return found


def _loaded(soname: str) -> str | None:
    """Path of the library of this name that is in the process; None where there is none."""
    import _ctypes  # noqa: PLC0415 - where ctypes itself opens libraries

    with suppress(OSError, AttributeError):
        handle = _ctypes.dlopen(soname, os.RTLD_LAZY | os.RTLD_NOLOAD)
        try:
            found = ctypes.POINTER(_LinkMap)()
            if ctypes.CDLL(None).dlinfo(ctypes.c_void_p(handle), _LINK_MAP, ctypes.byref(found)) == 0:
                return os.fsdecode(found.contents.name or b"")
        finally:
            _ctypes.dlclose(handle)
    return None


class FMI1Component(Component, FMI1Slave):
    """An FMI 1.0 co-simulation slave.

    Args:
        name: name in the scenario.
        slave: object with fmpy's slave call surface.
        description: its model description.
        negated: names of variables with ``alias="negatedAlias"``: the slave holds the value with the other sign.
        more: further arguments of `Component`.

    Raises:
        CouplingError: a declared start value is none of its variable's type.
    """

    def __init__(
        self,
        name: str,
        slave: Any,
        description: ModelDescription,
        *,
        negated: frozenset[str] = frozenset(),
        **more: Any,
    ) -> None:
        super().__init__(name, slave, description, **more)
        self.negated = negated
        self._forget()

    def _forget(self) -> None:
        try:
            super()._forget()
        except ValueError as error:
            raise CouplingError(str(error)) from error

    def set_start(self, name: str, value: Any) -> None:  # noqa: D102 - see Component
        super().set_start(name, value)
        self._hold(name, value)


class FMI2Component(Component, FMI2Slave):
    """An FMI 2.0 co-simulation slave. Arguments as for `Component`."""

    def _says_why(self) -> bool:
        return bool(self.messages) or self.kind == "block"


COMPONENTS: dict[int, Any] = {1: FMI1Component, 2: FMI2Component, 3: FMI3Component}


def load_fmu(
    path: str | Path,
    name: str,
    tolerance: float | str | None = None,
    units: Mapping[str, StatedUnit] = NONE_STATED,
    interface: Interface | None = None,
    method: Method = "bdf",
    isolation: OwnProcess | None = None,
) -> Component:
    """Unpack an FMU and prepare an instance of it.

    Args:
        path: the ``.fmu`` file.
        name: name of the component.
        tolerance: relative, for its solver, or ``none``; where not given the declared one.
        units: what the scenario states of its variables, by name.
        interface: which one is stepped; None for co-simulation, and model exchange where there is nothing else.
        method: of the solver that moves a model exchange FMU.
        isolation: of an FMU that gets a process of its own; None for one in this process.

    Raises:
        FmuLoadError: the file is missing or broken, has no such interface, or no library for this platform.
        CouplingError: the stated units do not fit it.
    """
    path = Path(path)
    archive = open_fmu(path, name)
    kind = demand_steppable(archive.description, f"{name}: {path}", interface)
    state_units(archive.description, units, name)
    description = as_stepped(archive.description, interface)
    try:
        archive.demand_this_platform(kind)
    except NotAnFmuError as error:
        raise FmuLoadError(f"{name}: {error}") from error
    guard_exit()
    if isolation is None:
        LAST_CALL.state_content(name, file_digest(path))
    folder, slave, changed = _loaded_in_peace(archive, path, name, kind, isolation)
    more = {"negated": negated_aliases(folder)} if fmi_version(description) == 1 else {}
    component: Component = COMPONENTS[fmi_version(description)](
        name,
        slave if kind == CO_SIMULATION else as_slave(slave, description, method),
        description,
        source=str(path),
        kind="FMU",
        release_files=partial(_put_away, folder, path, slave),
        **more,
    )
    component.trespasses |= dict.fromkeys(changed, "loading its library")
    component.choose_tolerance(tolerance)
    if kind != CO_SIMULATION:  # the solver is here, for FMI 1 too, and needs one
        component.tolerance = component.tolerance or (tolerance if isinstance(tolerance, float) else TOLERANCE)
    return component


def _put_away(folder: Path, path: Path, slave: Any) -> None:
    """Remove what was unpacked; an FMU that ended its own process is remembered."""
    shutil.rmtree(folder, ignore_errors=True)
    if getattr(slave, "apart", False) and slave.dll.reason and not slave.dll.interrupted:
        with suppress(OSError):
            note_crash(file_digest(path), slave.dll.reason)


def _loaded_in_peace(
    archive: Archive, path: Path, name: str, kind: str, isolation: OwnProcess | None
) -> tuple[Path, Any, Sequence[str]]:
    """As `_unpacked_and_loaded`, and what the library changed for the whole process when it was loaded; it is put back.

    Args:
        kind: interface type that is stepped.
    """
    here, before = Path.cwd(), Surroundings()
    changed: Sequence[str] = ()
    try:
        folder, slave = _unpacked_and_loaded(archive, path, name, kind, isolation)
    finally:
        os.chdir(here)  # fmpy changes it while it loads, and leaves it so when it fails
        changed = before.put_back()
    return folder, slave, changed


def _unpacked_and_loaded(
    archive: Archive, path: Path, name: str, kind: str, isolation: OwnProcess | None
) -> tuple[Path, Any]:
    """The folder into which an FMU is unpacked, and fmpy's slave with its library loaded; no folder is left on failure.

    Args:
        kind: interface type that is stepped.

    Raises:
        FmuLoadError: there is no such library, or it cannot be loaded.
    """
    folder: Path | None = None
    try:
        folder = unpack(archive)
        if isolation is None:
            _refuse_foreign_libraries(_library(folder, archive.description, kind), path, name)
        with LAST_CALL.making(name, "loading its library"):
            if isolation is not None:
                limit = LAST_CALL.limit_address
                return folder, load_isolated(folder, archive.description, kind, name, isolation, limit)
            return folder, load(folder, archive.description, kind, name, complete=True)
    except Exception as error:
        if folder is not None:
            shutil.rmtree(folder, ignore_errors=True)
        if isinstance(error, FmuLoadError):
            raise
        missing = isinstance(error, AttributeError)
        lacks = "its library lacks a function that FMI demands of every FMU: " if missing else ""
        raise FmuLoadError(f"{name}: cannot load {path}: {lacks}{error}") from error


def describe_fmu(
    path: str | Path,
    name: str,
    units: Mapping[str, StatedUnit] = NONE_STATED,
    interface: Interface | None = None,
) -> Component:
    """A component of an FMU file that can be asked for its variables and not stepped: nothing is unpacked or loaded.

    Args:
        path: the ``.fmu`` file.
        name: of the component.
        units: what the scenario states of its variables, by name.
        interface: as for `load_fmu`.

    Raises:
        FmuLoadError: as for `read_description`. CouplingError: the stated units do not fit it.
    """
    description = as_stepped(read_description(path, name), interface)
    state_units(description, units, name)
    more = {"negated": negated_aliases(Path(path))} if fmi_version(description) == 1 else {}
    component: Component = COMPONENTS[fmi_version(description)](name, None, description, source=str(path), **more)
    return component


def load_block(system: HybridSystem, name: str, fmi_version: Literal[2, 3] = 3, **arguments: Any) -> Component:
    """A Python block as a component; further arguments as for `fmu_observer.block.FMIInterface`.

    Args:
        system: what the block runs.
        name: of the component.
        fmi_version: of its call surface.

    Raises:
        ScenarioError: its equations cannot be traced, although it does not declare so.
    """
    from fmu_observer.block import make_block  # noqa: PLC0415 - CasADi only for those who run in Python

    with _traced(name):
        block = make_block(system, fmi_version, instance_name=name, **arguments)
    source = system.source or type(system).__qualname__
    face = COMPONENTS[fmi_version]
    component: Component = face(name, block, block.model_description, source=source, kind="block")
    return component


def describe_system(
    system: HybridSystem, name: str, fmi_version: Literal[2, 3] = 3, preset: str | None = None
) -> Component:
    """A component of a system that can be asked for its variables and not stepped: its equations are not prepared.

    Args:
        system: the hybrid system. name: of the component. fmi_version: of its interface.
        preset: whose values become the start values; None for the default.

    Raises:
        ValueError: the preset is unknown. ScenarioError: as for `load_block`.
    """
    with _traced(name):
        description = describe(system, fmi_version, preset=preset)
    source = system.source or type(system).__qualname__
    component: Component = COMPONENTS[fmi_version](name, None, description, source=source, kind="block")
    return component


@contextmanager
def _traced(name: str) -> Iterator[None]:
    try:
        yield
    except TracingError as error:
        misspelt = isinstance(error.__cause__, (AttributeError, NameError, LookupError))
        way_out = (
            ""
            if misspelt
            else " Where it is right as it is, declare traceable = False in the class: it then runs in Python, which "
            "is slower."
        )
        raise ScenarioError(f"Component {name!r}: {error}{way_out}") from error


def _library(folder: Path, description: ModelDescription, kind: str) -> Path:
    name = f"{getattr(description, kind).modelIdentifier}{fmpy.sharedLibraryExtension}"
    return folder / "binaries" / platform_folder(description) / name
