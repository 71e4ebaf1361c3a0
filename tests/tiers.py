"""The tier of a test follows from the processor time that was measured for it, and what a change of the product runs of
the second tier from the content of its files.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from functools import cache
from hashlib import sha256
from itertools import accumulate
from pathlib import Path
from typing import Any
from zlib import crc32

from plant_models.disk_cache.files import file_digest
from plant_models.disk_cache.identity import OWN_PACKAGES

ROOT = Path(__file__).parents[1]
TIMES = Path(__file__).with_name("measured_times.json")
FOLLOWS = Path(__file__).with_name("measured_follows.json")
"""Of each sheet, page and tutorial the digest of what it followed from when it last ran, and what that is, by its place
among the names that stand first.
"""
FOLLOWS_FROM = "follows from"
"""Property of a test that repeats something: folders of modules and files of the project that it loaded."""
LIMIT = 0.3
"""Processor time of a law in the first tier [s]: its cases are taken from the quickest on."""
BUDGET = 250.0
"""Processor time of all tests of the first tier together [s]."""

Cases = Mapping[str, float]
"""Of a law the times [s] of its cases, by what stands in brackets behind its name, brackets included."""


@cache
def measured() -> Mapping[str, Mapping[str, Cases]]:
    """By file and law; laws within `LIMIT` stand together as one of no name."""
    return _read(TIMES)


def left(cases: Cases) -> set[str]:
    """Cases of a law that are left to the second tier."""
    order = sorted(cases, key=cases.__getitem__)
    return {case for case, spent in zip(order, accumulate(cases[c] for c in order), strict=True) if spent > LIMIT}


@cache
def _left(file: str, law: str) -> set[str]:
    return left(measured().get(file, {}).get(law, {}))


def parts(name: str) -> tuple[str, str, str]:
    """File, law and case of the name of a test."""
    file, _, rest = name.partition("::")
    law, bracket, case = rest.partition("[")
    return file, law, bracket + case


def is_dear(name: str) -> bool:
    """Whether a test is left to the second tier for its time; one that was not measured is not."""
    file, law, case = parts(name)
    return case in _left(file, law)


def write_times(spent: Mapping[str, float]) -> None:
    """Put what a run measured [s] in the place of what was known of its files, and forget files that are gone."""
    found: dict[str, dict[str, dict[str, float]]] = {}
    for name, seconds in sorted(spent.items()):
        file, law, case = parts(name)
        found.setdefault(file, {}).setdefault(law, {})[case] = seconds
    for file, laws in found.items():
        listed = {law: cases for law, cases in laws.items() if sum(cases.values()) > LIMIT}
        rest = sum(sum(cases.values()) for law, cases in laws.items() if law not in listed)
        kept = {law: {c: round(s, 2) for c, s in cases.items() if s >= 0.01} for law, cases in listed.items()}
        found[file] = {"": {"": round(rest, 2)}, **kept}
    known = {file: laws for file, laws in measured().items() if (ROOT / file).exists()}
    _write(TIMES, known | found)


def write_follows(entries: Mapping[str, Iterable[str]]) -> None:
    """Note for tests what they followed from: see `has_changed`."""
    found = _follows() | {name: (digest(sorted(set(what))), sorted(set(what))) for name, what in entries.items()}
    names = sorted({name for _, what in found.values() for name in what})
    place = {name: k for k, name in enumerate(names)}
    _write(FOLLOWS, {"": names} | {name: [seen, *(place[w] for w in what)] for name, (seen, what) in found.items()})


def _read(path: Path) -> dict[str, Any]:
    return json.loads(path.read_text(encoding="utf-8")) if path.exists() else {}  # type: ignore[no-any-return]


def _write(path: Path, content: Mapping[str, object]) -> None:
    lines = ",\n".join(f"{json.dumps(name)}: {json.dumps(content[name])}" for name in sorted(content))
    path.write_text(f"{{\n{lines}\n}}\n", encoding="utf-8")


@cache
def _follows() -> dict[str, tuple[str, list[str]]]:
    content = _read(FOLLOWS)
    names = content.pop("", [])
    return {name: (seen, [names[k] for k in places]) for name, (seen, *places) in content.items()}


def has_changed(name: str) -> bool:
    """Whether what a test follows from is no longer what it was when the test last ran, or is not known."""
    seen, what = _follows().get(name, ("", []))
    return seen != digest(what)


def digest(names: Iterable[str]) -> str:
    """Digest of files, and of folders of modules with the files beside them."""
    return sha256("\n".join(map(_digest, names)).encode()).hexdigest()[:16]


@cache
def _digest(name: str) -> str:
    path = ROOT / name
    files = [path] if path.is_file() else sorted(_belonging(path))
    return " ".join(f"{file.relative_to(ROOT)} {file_digest(file)}" for file in files)


def _belonging(folder: Path) -> Iterable[Path]:
    """Files of a folder of modules and of folders in it that hold none, such as templates and C."""
    for path in folder.iterdir() if folder.is_dir() else ():
        if path.is_file():
            yield path
        elif path.name != "__pycache__" and not (path / "__init__.py").exists():
            yield from _belonging(path)


def change() -> str:
    """Digest of the product: it draws samples, the same ones wherever the same change is tested."""
    return digest(product())


def product() -> list[str]:
    """All folders of modules of the product."""
    folders = {path.parent for package in OWN_PACKAGES for path in (ROOT / package).rglob("__init__.py")}
    return sorted(folder.relative_to(ROOT).as_posix() for folder in folders)


def is_drawn(name: str, seed: str, share: int) -> bool:
    """Whether a name is among the one in so many that a seed draws."""
    return crc32(f"{seed} {name}".encode()) % share == 0
