"""Identity: digests of what a result follows from, without computing anything: values, code, versions.

A system is its class and what its constructor made of the options. A class counts by all files of its package, so no
import has to be followed; a class of another package cannot be known so, and has no identity.
"""

from __future__ import annotations

import hashlib
import os
import platform
import sys
import time
from functools import cache
from importlib.util import find_spec
from io import FileIO
from pathlib import Path
from typing import Any

import numpy as np

from plant_models.disk_cache.description import NUMERICAL_PACKAGES, OWN_PACKAGES, Description, NoIdentityError
from plant_models.installed import installed_version

LOADED_AT = time.time()


def identity(*values: Any, code: tuple[str, ...] = ()) -> str | None:
    """Digest of all that a result follows from.

    Args:
        values: what it is computed from, see `plant_models.disk_cache.description.Description.text`. The packages of
            all classes and functions among them count by their files, and so do the floors below.
        code: what else computes the result: a package of this project, with the floors below (``fmus``), or a folder or
            a file alone (``cosim/run/certificates.py``).

    Returns:
        64 hexadecimal digits; None where one of the values is not known by its content, such as a system of a class of
        the user's, or where the code on disk may not be the code that was loaded.
    """
    description = Description()
    try:
        parts = [description.text(values), _surroundings()]
        parts += [folder_digest(name) for name in _with_floors_below({"plant_models", *description.packages, *code})]
    except (NoIdentityError, OSError):
        return None
    return hashlib.sha256("\n".join(parts).encode()).hexdigest()


def _with_floors_below(names: set[str]) -> list[str]:
    highest = max(floor for floor, package in enumerate(OWN_PACKAGES) if package in names)
    return sorted({*names, *OWN_PACKAGES[:highest]})


@cache
def folder_digest(name: str) -> str:
    """Digest of the files of a package of this project, or of one of its folders or files; read once in a process.

    Args:
        name: ``plant_models``, ``fmus/check`` or ``cosim/run/certificates.py``.

    Returns:
        The name and 64 hexadecimal digits.

    Raises:
        NoIdentityError: the files are not on disk, or were changed since this process began: what was loaded may be
            older.
        OSError: one of them cannot be read.
    """
    package, _, rest = name.partition("/")
    spec = find_spec(package)
    if spec is None or not spec.submodule_search_locations:
        raise NoIdentityError(f"The files of {name} are not on disk.")
    root = Path(next(iter(spec.submodule_search_locations)), rest)
    digest, length = hashlib.sha256(), len(str(root))
    for path in [str(root)] if root.is_file() else _files(str(root)):
        with FileIO(path) as file:
            if os.fstat(file.fileno()).st_mtime > LOADED_AT:
                raise NoIdentityError(f"{path} was changed after it was loaded.")
            content = file.read()
        digest.update(f"{path[length:]} {len(content)}\0".encode() + content)
    return f"{name} {digest.hexdigest()}"


def _files(folder: str) -> list[str]:
    """All files in a folder and those in it, without byte code, in an order of their own."""
    walk = os.walk(folder)
    return sorted([f"{at}{os.sep}{name}" for at, _, names in walk if "__pycache__" not in at for name in names])


@cache
def _surroundings() -> str:
    """What computes beside this project: Python, the machine, and the numerical packages."""
    versions = [f"{name} {_version(name)}" for name in NUMERICAL_PACKAGES]
    core = getattr(np, "_core", None)
    processor = getattr(getattr(core, "_multiarray_umath", None), "__cpu_features__", {})  # BLAS chooses its code by it
    features = " ".join(name for name, present in processor.items() if present)
    return "; ".join([sys.version, sys.platform, platform.machine(), features, *versions])


def _version(name: str) -> str:
    version = installed_version(name)
    if version is None:
        raise NoIdentityError(f"The version of {name} is not known.")
    return version
