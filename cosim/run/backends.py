"""Backends: which shipped models run as native FMUs and which as Python blocks, and the FMUs, built where they were
not yet.

FMU and block give the same numbers, bit for bit; the FMU is quicker. Touches the cache of FMUs.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from concurrent.futures import Future, ThreadPoolExecutor, as_completed
from dataclasses import dataclass, field
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Any

from cosim.errors import FmuLoadError
from cosim.scenario.scenario_tables import Backend, ComponentTable
from fmus.cache import CacheEntry, cache_entry
from fmus.toolchain.compile import CompilerMissing, find_compiler
from fmus.toolchain.platforms import Platform
from plant_models.hybrid import HybridSystem, TracingError
from plant_models.missing_package import installation, is_installed

if TYPE_CHECKING:
    from fmus.build import BuildDraft

NATIVE: Backend = "fmu3"
_IN_PYTHON: Backend = "block3"
_AT_A_TIME = 2
"""Compilers that work at once; each takes a processor and some hundred megabytes for seconds."""

FAULTS = (OSError, RuntimeError, ValueError, TracingError)
"""What building raises: no compiler, a compiler that refuses, a system that cannot be traced, a cache that cannot be
written.
"""

Notify = Callable[[str], None]


@dataclass(frozen=True)
class Request:
    """A shipped model in a scenario.

    Args:
        table: of the component. system: its hybrid system. where: place for messages.
    """

    table: ComponentTable
    system: HybridSystem
    where: str


@dataclass
class Realised:
    """How the shipped models run.

    Args:
        kinds: by component. files: FMUs of those that are native. notes: why others are not that could have been.
    """

    kinds: dict[str, Backend] = field(default_factory=dict)
    files: dict[str, Path] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)


def intended(table: ComponentTable, system: HybridSystem) -> Backend:
    """How a shipped model will run, as far as that is known before its FMU is built.

    Args:
        table: of the component. system: the system of the component.
    """
    if table.backend is not None:
        return table.backend
    return NATIVE if system.traceable and _missing_tool() is None else _IN_PYTHON


def realise(requests: Mapping[str, Request], notify: Notify) -> Realised:
    """Decide, and build the FMUs that are not in the cache, `_AT_A_TIME` at once.

    Args:
        requests: by component. notify: called for each FMU that is built, and how long that took.

    Raises:
        FmuLoadError: an FMU that the scenario asks for by ``as`` cannot be built; where it does not ask, the model is a
        block.
    """
    made = Realised({name: intended(request.table, request.system) for name, request in requests.items()})
    native = {name: request for name, request in requests.items() if made.kinds[name].startswith("fmu")}
    found, faults = _build(native, made.kinds, notify)
    made.files |= found
    for name, fault in faults.items():
        if requests[name].table.backend is not None:
            raise cannot_build(requests[name].where, requests[name].system, fault) from fault
        made.kinds[name] = _IN_PYTHON
    _note(requests, made, faults)
    return made


def cannot_build(where: str, system: HybridSystem, fault: Exception) -> FmuLoadError:
    """The error for an FMU that cannot be built; `where` is the place for the message.

    Args:
        system: the system of the component. fault: why it was not built.
    """
    return FmuLoadError(f"{where}: cannot build the FMU of {system.name}: {fault}")


# -- deciding
# -----------------------------------------------------------------------------------------------------------


def _missing_tool() -> str | None:
    """Which tool that native FMUs are built with is missing, and what to do, or None."""
    if not is_installed("casadi"):
        return f"Tracing them needs the package casadi; {installation('casadi')}."
    try:
        find_compiler()
    except CompilerMissing as error:
        return str(error)
    return None


def _note(requests: Mapping[str, Request], made: Realised, faults: Mapping[str, Exception]) -> None:
    """Say why models are blocks that nobody asked to be blocks, and why all blocks are slow without CasADi."""
    if not is_installed("casadi"):
        python = [name for name, kind in made.kinds.items() if kind.startswith("block")]
        if python:
            made.notes.append(f"Run in plain NumPy, many times slower: {', '.join(python)}. {_missing_tool()}")
        return
    blocks = [name for name, kind in made.kinds.items() if kind == _IN_PYTHON and requests[name].table.backend is None]
    opaque = [name for name in blocks if not requests[name].system.traceable]
    if opaque:
        made.notes.append(f"Cannot be traced, so they run as Python blocks: {', '.join(opaque)}.")
    for name, fault in faults.items():
        made.notes.append(f"{name} runs as a Python block, as its FMU cannot be built: {fault}")
    others = [name for name in blocks if name not in opaque and name not in faults]
    if others:
        made.notes.append(f"Run as Python blocks, which is slower: {', '.join(others)}. {_missing_tool()}")


# -- building
# -----------------------------------------------------------------------------------------------------------


def _build(
    requests: Mapping[str, Request], kinds: Mapping[str, Backend], notify: Notify
) -> tuple[dict[str, Path], dict[str, Exception]]:
    """The FMUs by component, and what went wrong with the others. Systems are traced here, one after the other, while
    compilers work on those that were traced before.
    """
    entries: dict[str, CacheEntry] = {}
    faults: dict[str, Exception] = {}
    with ThreadPoolExecutor(_AT_A_TIME) as pool:
        building = _Building(pool, notify)
        try:
            for name, request in requests.items():
                version: Any = int(kinds[name][-1])
                try:
                    entries[name] = cache_entry(request.system, version, request.table.preset)
                except FAULTS as error:
                    faults[name] = error
                else:
                    building.begin(entries[name])
            wrong = building.finish()
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)  # interrupted: what waits is not begun
            raise
    faults |= {name: wrong[entry.path] for name, entry in entries.items() if entry.path in wrong}
    return {name: entry.path for name, entry in entries.items() if name not in faults}, faults


class _Building:
    """FMUs that are being compiled, each once."""

    def __init__(self, pool: ThreadPoolExecutor, notify: Notify) -> None:
        self._pool, self._notify = pool, notify
        self._working: dict[Path, tuple[CacheEntry, Future[tuple[dict[Platform, bytes], float]]]] = {}

    def begin(self, entry: CacheEntry) -> None:
        """Let a compiler work on an FMU that is not there."""
        if entry.draft is None or entry.path in self._working:
            return
        if not self._working:
            self._notify("building FMUs of shipped models, kept for later runs")
        self._working[entry.path] = entry, self._pool.submit(_timed, entry.draft)

    def finish(self) -> dict[Path, Exception]:
        """Pack each as soon as it is compiled; what went wrong, by path."""
        faults: dict[Path, Exception] = {}
        entries = {working: entry for entry, working in self._working.values()}
        for done in as_completed(entries):
            entry = entries[done]
            try:
                libraries, seconds = done.result()
                entry.pack(libraries)
            except FAULTS as error:
                faults[entry.path] = error
            else:
                self._notify(f"building {entry.path.stem} ... {seconds:.1f} s")
        return faults


def _timed(draft: BuildDraft) -> tuple[dict[Platform, bytes], float]:
    begin = perf_counter()
    return draft.compile(), perf_counter() - begin
