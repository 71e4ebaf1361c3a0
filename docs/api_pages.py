"""The pages of the API reference: what the packages offer (`__all__`) and what these pages import, from its docstrings.

`conf.py` writes them into `docs/reference/api` before Sphinx reads the pages. Nothing is listed by hand: a name joins
by being offered by its room, or by being used in a page.
"""

from __future__ import annotations

import inspect
import pkgutil
import re
from collections import defaultdict
from importlib import import_module
from pathlib import Path
from typing import Any

DOCS = Path(__file__).parent
PACKAGES = ("cosim", "fmus", "fmu_observer", "plant_models")
IMPORT = re.compile(r"^from ((?:cosim|fmus|fmu_observer|plant_models)[\w.]*) import ([\w, ]+)$", re.MULTILINE)


def rooms() -> list[str]:
    """The packages and their rooms."""
    return [
        name
        for package in PACKAGES
        for name in (
            package,
            *(
                m.name
                for m in pkgutil.walk_packages(import_module(package).__path__, f"{package}.")
                if m.ispkg and "pytest_plugin" not in m.name
            ),
        )
    ]


def offered() -> dict[str, Any]:
    """Classes and functions by full name, at the place where they are defined; of a class the bases in its room too,
    where some of its methods stand.
    """
    named = [(room, name) for room in rooms() for name in getattr(import_module(room), "__all__", ())]
    for page in (DOCS.parent / "README.md", *DOCS.rglob("*.md")):
        for module, names in IMPORT.findall(page.read_text(encoding="utf-8")):
            named += [(module, name.strip().split(" as ")[0]) for name in names.split(",") if name.strip()]
    things: dict[str, Any] = {}
    for module, name in named:
        thing = inspect.unwrap(getattr(import_module(module), name, None))  # type: ignore[arg-type]
        home = getattr(thing, "__module__", "") or ""
        if (inspect.isclass(thing) or inspect.isfunction(thing)) and home.split(".")[0] in PACKAGES:
            things[f"{home}.{thing.__qualname__}"] = thing
            for base in inspect.getmro(thing) if inspect.isclass(thing) else ():
                if room_of(base.__module__) == room_of(home) and base.__doc__:
                    things[f"{base.__module__}.{base.__qualname__}"] = base
    return things


def pages() -> dict[str, str]:
    """Markdown of each page, by its name."""
    by_room: dict[str, list[str]] = defaultdict(list)
    things = offered()
    for name in sorted(things):
        by_room[room_of(things[name].__module__)].append(name)
    texts = {}
    for package in PACKAGES:
        lines = [f"# `{package}`", "", summary(package), ""]
        for room in sorted(r for r in by_room if r.split(".")[0] == package):
            lines += [] if room == package else [f"## `{room}`", "", summary(room), ""]
            for name in by_room[room]:
                kind = "autoclass" if inspect.isclass(things[name]) else "autofunction"
                members = ["   :members:", "   :show-inheritance:"] if kind == "autoclass" else []
                lines += ["```{eval-rst}", f".. {kind}:: {name}", *members, "```", ""]
        texts[package] = "\n".join(lines)
    return texts


def room_of(module: str) -> str:
    """The room a module stands in: a package and one folder of it, or the package."""
    parts = module.split(".")
    return ".".join(parts[:2]) if hasattr(import_module(".".join(parts[:2])), "__path__") else parts[0]


def summary(room: str) -> str:
    """The first sentence of a room's docstring."""
    return " ".join((import_module(room).__doc__ or "").split("\n\n")[0].split())


def write(folder: Path) -> None:
    """Write the pages; those that say the same already stay as they are, so that Sphinx does not read them again."""
    folder.mkdir(exist_ok=True)
    for name, text in pages().items():
        page = folder / f"{name}.md"
        if not page.exists() or page.read_text(encoding="utf-8") != text:
            page.write_text(text, encoding="utf-8")
