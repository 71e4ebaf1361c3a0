"""Cache: FMUs that were built once are not built again.

An FMU is kept under a digest of all that decides its bytes: the equations, the model description, the runtime, the
generator and the compiler. There is nothing to invalidate and nothing to lock: two processes that build the same FMU at
the same time write the same bytes, each in one move. Which digest a request leads to is kept as well, so that a system
need not be traced to find its FMU; code that changed without changing the equations finds the same FMU again.
"""

from __future__ import annotations

import logging
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any
from weakref import WeakKeyDictionary

from fmu_observer.event_protocol import EventProtocol
from fmus.toolchain.platforms import Platform
from fmus.toolchain.targets import choose_targets
from plant_models.disk_cache.entries import keep, recall
from plant_models.disk_cache.files import is_sealed, seal
from plant_models.disk_cache.folder import cache_folder
from plant_models.disk_cache.identity import identity
from plant_models.hybrid import HybridSystem

if TYPE_CHECKING:
    from fmu_observer.description import FmiVersion
    from fmus.build import BuildDraft

LOG = logging.getLogger("fmus")
_known: WeakKeyDictionary[HybridSystem, dict[str, str]] = WeakKeyDictionary()
_keys: WeakKeyDictionary[HybridSystem, dict[str, str | None]] = WeakKeyDictionary()


def cached_fmu(
    system: HybridSystem, fmi_version: FmiVersion = 3, preset: str | None = None, protocol: EventProtocol | None = None
) -> Path:
    """The FMU of a system from the user's cache, built on the first call.

    Args:
        system: the hybrid system.
        fmi_version: 2 or 3.
        preset: preset whose values become the start values; None for the system's default.
        protocol: how it is notified of triggered events, see `build_fmu`.

    Returns:
        Path of the FMU; do not change the file.

    Raises:
        ValueError: the FMI version, the preset, the protocol or the system does not allow it.
        CompilerMissing: no C compiler was found.
        CompilationError: the compiler refused the sources.
    """
    entry = cache_entry(system, fmi_version, preset, protocol)
    if entry.draft is not None:
        entry.pack(entry.draft.compile())
    return entry.path


@dataclass(frozen=True)
class CacheEntry:
    """Where an FMU is kept, and what is to be compiled and packed there: nothing where it was built before.

    Args:
        path: of the file. draft: of an FMU that is still to be built.
    """

    path: Path
    draft: BuildDraft | None = None

    def pack(self, libraries: dict[Platform, bytes]) -> None:
        """Write the file, and the seal by which it is known to be whole.

        Args:
            libraries: what `BuildDraft.compile` returned.

        Raises:
            OSError: it cannot be written.
        """
        assert self.draft is not None
        seal(self.draft.pack(libraries, self.path))


def cache_entry(
    system: HybridSystem, fmi_version: FmiVersion = 3, preset: str | None = None, protocol: EventProtocol | None = None
) -> CacheEntry:
    """`cached_fmu` up to the compiler, for those who build several FMUs at a time.

    A system with an identity is traced only where its FMU was never asked for with this code and compiler.

    Args:
        system: the hybrid system. fmi_version: 2 or 3. preset: its preset; None for the default.
        protocol: how it is notified of triggered events; None for the default.

    Returns:
        The place of the FMU, with a draft where it is not there, or not whole.

    Raises:
        ValueError, CompilerMissing: as `cached_fmu`.
    """
    targets = choose_targets()
    request = fmi_version, preset, protocol, [f"{t.platform.name} {t.compiler.identity()}" for t in targets]
    key = _key(system, request)
    known = _known_content(system, key, repr(request))
    if known is not None:
        path = _place(system, known)
        if is_sealed(path):
            return CacheEntry(path)
    from fmus.build import BuildDraft, plan_fmu  # noqa: PLC0415 - CasADi only for those who trace
    from fmus.content_key import content_key  # noqa: PLC0415

    plan = plan_fmu(system, fmi_version, preset, protocol)
    content = content_key(plan, targets)
    _keep_content(system, key, repr(request), content)
    path = _place(system, content)
    return CacheEntry(path, None if _is_whole(path) else BuildDraft.of(plan, targets))


def _is_whole(path: Path) -> bool:
    """Whether an FMU is there and the one that was put there; another one is reported in the log."""
    whole = is_sealed(path)
    if not whole and path.is_file():
        LOG.warning("The cached FMU %s is not the one that was put there; it is built again.", path)
    return whole


def _key(system: HybridSystem, request: tuple[Any, ...]) -> str | None:
    """Identity of a request; a system does not change once it is built, so it is described once in a process."""
    keys = _keys.setdefault(system, {})
    text = repr(request)
    if text not in keys:
        keys[text] = identity(system, request, code=("fmus",))
    return keys[text]


def _place(system: HybridSystem, content: str) -> Path:
    return cache_folder() / content / f"{system.name}.fmu"


def _known_content(system: HybridSystem, key: str | None, request: str) -> str | None:
    """The content key of a request that was met before: ever, or for a system without identity in this process."""
    if key is None:
        return _known.get(system, {}).get(request)
    found = recall("fmu", key)
    return found if isinstance(found, str) else None


def _keep_content(system: HybridSystem, key: str | None, request: str, content: str) -> None:
    if key is None:  # a system does not change once it is built, so within one process this is enough
        _known.setdefault(system, {})[request] = content
    else:
        keep("fmu", key, content)
