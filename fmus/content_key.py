"""The key of an FMU's content: a digest of all that decides its bytes. Reads the files of this package."""

from __future__ import annotations

import hashlib
import inspect
import sys
from collections.abc import Sequence
from functools import cache
from importlib.resources import files

from fmus.build import BuildPlan, runtime_sources, standard_headers
from fmus.toolchain.targets import Target
from plant_models.hybrid.casadi_package import ca


def content_key(plan: BuildPlan, targets: Sequence[Target]) -> str:
    """Digest of all that decides the bytes of an FMU. The equations go in as CasADi's graph, of which the C follows.

    Args:
        plan: of the FMU, see `plan_fmu`. targets: platforms, each with its compiler.
    """
    digest = hashlib.sha256()
    parts = [
        plan.equations.digest(),
        plan.description_xml(),
        repr(plan.system.start_state(plan.preset).tolist()),
        repr(plan.system.start_parameters(plan.preset).tolist()),
        *(inspect.getdoc(cls) or "" for cls in type(plan.system).__mro__),  # the documentation repeats them
        plan.system.source,
        repr(plan.system.presets),
        repr(plan.system.resources),
        _tool_digest(),
        *(f"{target.platform.name} {target.compiler.identity()}" for target in targets),
    ]
    for part in parts:
        digest.update(part.encode() + b"\0")
    return digest.hexdigest()[:32]


@cache
def _tool_digest() -> str:
    """Of the runtime in C, the headers of FMI, this package's own code, and CasADi's version."""
    digest = hashlib.sha256(f"{ca.CasadiMeta.version()} {sys.platform}".encode())
    for name, text in sorted((_own_files() | runtime_sources() | standard_headers(2) | standard_headers(3)).items()):
        digest.update(name.encode() + b"\0" + text + b"\0")
    return digest.hexdigest()


def _own_files() -> dict[str, bytes]:
    """What writes the FMU, and what checks the gains that its documentation reports."""
    rooms = ("content", "toolchain", "documentation", "documentation/templates", "licenses")
    kinds = (".py", ".txt", ".j2", ".css")
    folders = (files("fmus"), *(files("fmus") / room for room in rooms), files("fmu_observer") / "certificates")
    entries = [(folder, entry) for folder in folders for entry in folder.iterdir() if entry.name.endswith(kinds)]
    return {f"{folder.name}/{entry.name}": entry.read_bytes() for folder, entry in entries}
