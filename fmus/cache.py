"""Cache: FMUs that were built once are not built again.

An FMU is kept under a digest of all that decides its bytes: the equations, the model description, the runtime, the
generator and the compiler. There is nothing to invalidate and nothing to lock: two processes that build the same FMU at the
same time write the same bytes, each in one move.
"""

from __future__ import annotations

import hashlib
import os
import sys
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any
from weakref import WeakKeyDictionary

import casadi as ca

from fmu_observer.description import FmiVersion
from fmus.build import Plan, plan_fmu, runtime_sources, write_fmu
from fmus.compile import FLAGS, Compiler, find_compiler
from plant_models.hybrid import HybridSystem

_known: WeakKeyDictionary[HybridSystem, dict[Any, Path]] = WeakKeyDictionary()


def cached_fmu(system: HybridSystem, fmi_version: FmiVersion = 3, preset: str | None = None) -> Path:
    """The FMU of a system from the user's cache, built on the first call.

    Args:
        system: the hybrid system.
        fmi_version: 2 or 3.
        preset: preset whose values become the start values; None for the system's default.

    Returns:
        Path of the FMU; do not change the file.

    Raises:
        ValueError: the FMI version, the preset or the system does not allow it.
        CompilerMissing: no C compiler was found.
        CompilationError: the compiler refused the sources.
    """
    folder = cache_folder()
    by_request = _known.setdefault(system, {})
    request = (fmi_version, preset, folder, os.environ.get("CC"))
    known = by_request.get(request)  # a system does not change once it is built, so within one process this is enough
    if known is not None and known.exists():
        return known
    plan, compiler = plan_fmu(system, fmi_version, preset), find_compiler()
    target = folder / content_key(plan, compiler) / f"{system.name}.fmu"
    if not target.exists():
        write_fmu(plan, compiler, target)
    by_request[request] = target
    return target


def content_key(plan: Plan, compiler: Compiler) -> str:
    """Digest of all that decides the bytes of an FMU. The equations go in as CasADi's graph, of which the C follows."""
    digest = hashlib.sha256()
    parts = [
        plan.equations.digest(),
        plan.description_xml(),
        repr(plan.system.start_state(plan.preset).tolist()),
        repr(plan.system.start_parameters(plan.preset).tolist()),
        _tool_digest(),
        " ".join((*compiler.command, compiler.version, *FLAGS)),
    ]
    for part in parts:
        digest.update(part.encode() + b"\0")
    return digest.hexdigest()[:32]


def cache_folder() -> Path:
    """Where cached FMUs lie: ``$FMU_OBSERVER_CACHE``, else the folder the platform keeps for caches."""
    chosen = os.environ.get("FMU_OBSERVER_CACHE")
    if chosen:
        return Path(chosen)
    if sys.platform == "win32":
        return Path(os.environ.get("LOCALAPPDATA") or Path.home() / "AppData" / "Local") / "fmu-observer" / "Cache"
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "fmu-observer"


@cache
def _tool_digest() -> str:
    """Of the runtime in C, of this package's own code, and of CasADi's version."""
    digest = hashlib.sha256(f"{ca.CasadiMeta.version()} {sys.platform}".encode())
    own = {entry.name: entry.read_bytes() for entry in files("fmus").iterdir() if entry.name.endswith(".py")}
    for name, text in sorted((own | runtime_sources()).items()):
        digest.update(name.encode() + b"\0" + text + b"\0")
    return digest.hexdigest()
