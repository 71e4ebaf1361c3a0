"""Every public module, class, function, method and property of the four packages has a docstring that names every
parameter, and full annotations.
"""

from __future__ import annotations

import inspect
import pkgutil
import re
from collections.abc import Iterator
from importlib import import_module
from types import FunctionType, ModuleType
from typing import Any, Protocol

import pytest
from pages import PACKAGES

MODULES = [
    name
    for package in PACKAGES
    for name in (package, *(m.name for m in pkgutil.walk_packages(import_module(package).__path__, f"{package}.")))
    if not name.endswith("__main__")  # importing it runs the program
]

CONTRACT = {"self", "cls", "t", "x", "u", "p", "vr"}
"""Parameters that mean everywhere what they mean in `HybridSystem.flow` and in FMI; said where they mean more."""


def room_of(module: str) -> str:
    return ".".join(module.split(".")[:2])


def public(module: ModuleType) -> Iterator[tuple[str, Any]]:
    """Public classes and functions defined in a module, with their own public members."""
    for name, thing in vars(module).items():
        if name.startswith("_") or getattr(thing, "__module__", None) != module.__name__:
            continue
        if inspect.isclass(thing):
            yield name, thing
            yield from members(thing)
        elif isinstance(inspect.unwrap(thing) if callable(thing) else thing, FunctionType):
            yield name, thing


def members(cls: type) -> Iterator[tuple[str, Any]]:
    for name, member in vars(cls).items():
        if not name.startswith("_"):
            inner = member.__func__ if isinstance(member, classmethod | staticmethod) else member
            inner = getattr(inner, "func", inner) if type(inner).__name__ == "cached_property" else inner
            if isinstance(inner, FunctionType | property):
                yield f"{cls.__name__}.{name}", (cls, name, inner)


def protocols(cls: type) -> list[type]:
    """Protocols of the same module that the class fulfils: what they document is documented."""
    offered = [c for c in vars(import_module(cls.__module__)).values() if is_protocol(c)]
    calls = {
        p: [n for n, m in vars(p).items() if isinstance(m, FunctionType) and not n.startswith("_")] for p in offered
    }
    return [p for p in offered if all(hasattr(cls, n) for n in calls[p])]


def is_protocol(thing: Any) -> bool:
    return bool(getattr(thing, "_is_protocol", False)) and thing is not Protocol


def documented(thing: Any) -> bool:
    if isinstance(thing, tuple):
        cls, name, _ = thing
        return any(getattr(vars(base).get(name), "__doc__", None) for base in (*cls.__mro__, *protocols(cls)))
    text = thing.__dict__.get("__doc__") if inspect.isclass(thing) else inspect.getdoc(thing)
    # what a dataclass writes by itself
    generated = inspect.isclass(thing) and str(text).startswith(f"{thing.__name__}(")
    return bool(text) and not generated


def bare(thing: Any) -> list[str]:
    """Names of parameters without annotation, and ``return``."""
    if inspect.isclass(thing):
        init = vars(thing).get("__init__")
        generated = hasattr(thing, "__dataclass_fields__") or is_protocol(thing)
        return bare(init) if isinstance(init, FunctionType) and not generated else []
    function = thing[2] if isinstance(thing, tuple) else thing
    function = inspect.unwrap(function.fget if isinstance(function, property) else function)
    signature = inspect.signature(function)
    missing = [n for n, p in signature.parameters.items() if p.annotation is p.empty and n not in ("self", "cls")]
    return missing + (["return"] if signature.return_annotation is signature.empty else [])


def unnamed(thing: Any) -> list[str]:
    """Names of parameters that no docstring names: the function's, its class's, or that of the method it overrides."""
    if inspect.isclass(thing):
        init = vars(thing).get("__init__")
        generated = hasattr(thing, "__dataclass_fields__") or is_protocol(thing)
        texts, function = [inspect.getdoc(thing)], init if isinstance(init, FunctionType) and not generated else None
    elif isinstance(thing, tuple):
        cls, name, function = thing
        bases = (*cls.__mro__, *protocols(cls))
        texts = [t for base in bases for t in (getattr(vars(base).get(name), "__doc__", None), base.__doc__)]
    else:
        function, texts = inspect.unwrap(thing), [inspect.getdoc(thing)]
    if not isinstance(function, FunctionType):
        return []
    said = "\n".join(text for text in texts if text)
    if texts and texts[0] and inspect.cleandoc(texts[0]).startswith("See `"):  # documented there
        return []
    names = [n for n in inspect.signature(function).parameters if n not in CONTRACT and not n.startswith("_")]
    return [n for n in names if not re.search(rf"(?<![A-Za-z_]){n}\b", said)]


@pytest.mark.parametrize("room", sorted({room_of(name) for name in MODULES}))
def test_modules_have_docstrings_and_annotations(room: str) -> None:
    modules = {name: import_module(name) for name in MODULES if room_of(name) == room}
    assert [name for name, module in modules.items() if not module.__doc__] == [], "without docstring"
    things = [(f"{name}: {n}", thing) for name, module in modules.items() for n, thing in public(module)]
    assert [n for n, thing in things if not documented(thing)] == [], "without docstring"
    assert {n: bare(thing) for n, thing in things if bare(thing)} == {}, "without annotation"
    assert {n: unnamed(thing) for n, thing in things if unnamed(thing)} == {}


def test_the_walk_finds_what_is_known() -> None:
    found = {n for n, _ in public(import_module("cosim.simulation.scenario"))}
    assert {"Scenario", "Scenario.load", "Scenario.name", "Scenario.run"} <= found
    assert "shipped_scenarios" in {n for n, _ in public(import_module("cosim.scenario.shipped"))}


def test_the_law_can_fail() -> None:
    def undocumented(a, b: int):  # type: ignore[no-untyped-def]
        return a + b

    assert not documented(undocumented)
    assert bare(undocumented) == ["a", "return"]
    assert unnamed(undocumented) == ["a", "b"]


@pytest.mark.parametrize("package", PACKAGES)
def test_what_a_package_offers_exists(package: str) -> None:
    module = import_module(package)
    assert [n for n in getattr(module, "__all__", ()) if not hasattr(module, n)] == []
