"""Names of packages: ``system.ssp``, or ``system.ssp#Variant``. Standard library only."""

from __future__ import annotations

from pathlib import Path


def split_variant(name: str) -> tuple[str, str]:
    """A file name such as ``system.ssp#Variant`` as path and variant; the variant is empty where none is named."""
    path, _, variant = name.partition("#")
    return path, variant


def is_package(name: str | Path) -> bool:
    """Whether a file name is that of an SSP, with a variant or without."""
    return split_variant(str(name))[0].lower().endswith(".ssp")


def stem(name: str) -> str:
    """A name for results: the file without its ending, and the variant where one is named."""
    if not is_package(name):
        return Path(name).stem
    path, variant = split_variant(name)
    return Path(path).stem + (f"_{variant.removesuffix('.ssd')}" if variant else "")
