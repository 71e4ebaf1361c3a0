"""Writes ``cosim/simulation/keywords.pyi``: the keywords of `cosim.Scenario` with their types, for completion and type
checkers, from the tables of scenario files: ``python docs/keyword_types.py``. A test compares the file with what this
script would write.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, Literal, get_args, get_origin

from pydantic import BaseModel, BeforeValidator

from cosim.expectations.expectation import Expectation
from cosim.expectations.registry import shipped_expectations
from cosim.scenario.campaign_table import CampaignTable
from cosim.scenario.model_name import ModelName
from cosim.scenario.network_table import NetworkTable
from cosim.scenario.paths import BALISE_PATHS, COMPONENT_PATHS, NETWORK_PATHS
from cosim.scenario.scenario_tables import BalisesTable, ComponentTable, ConnectionTable, MasterTable, ReportTable
from cosim.scenario.schema import ScenarioTable

STUB = Path(__file__).parents[1] / "cosim" / "simulation" / "keywords.pyi"
TABLES: tuple[type[BaseModel], ...] = (
    ScenarioTable,
    ComponentTable,
    ConnectionTable,
    BalisesTable,
    NetworkTable,
    MasterTable,
    ReportTable,
    CampaignTable,
)
LEFT_OUT: dict[Any, tuple[str, ...]] = {ConnectionTable: ("source", "target")}
"""Keys that `Scenario.connect` takes in another way."""
PATHS = {*COMPONENT_PATHS, *BALISE_PATHS, *NETWORK_PATHS}
HEAD = '''\
"""The keywords of `cosim.Scenario` with their types, from the tables of scenario files: see docs/keyword_types.py."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Literal, TypedDict

import numpy as np
'''
TABLE = "Mapping[str, Any]"


def main() -> None:
    """Rewrite the stub."""
    STUB.write_text(stub(), encoding="utf-8")


def stub() -> str:
    """The text of the stub; tables within tables stand before those that hold them."""
    classes: dict[str, str] = {}
    for table in TABLES:
        _write(table, classes)
    return "\n".join([HEAD, *classes.values(), *_expectations()])


def _expectations() -> list[str]:
    """The names of the checks that ship, and a class with the keys of all of them."""
    kinds = shipped_expectations()
    types: dict[str, list[str]] = {}
    for kind in dict.fromkeys(kinds.values()):
        for name, info in kind.model_fields.items():
            types.setdefault(name, []).extend(_type(info.annotation, name, {}).split(" | "))
    del types["check"]
    lines = [f"    {name}: {' | '.join(dict.fromkeys(found))}" for name, found in types.items()]
    doc = '    """An expectation: the keys of all kinds together."""'
    names = "".join(f'    "{name}",\n' for name in kinds)
    keys = ["class ExpectationKeywords(TypedDict, total=False):", doc, "", *lines, ""]
    return ["\n".join(keys), f"CheckName = Literal[\n{names}]\n"]


def _write(table: type[BaseModel], classes: dict[str, str]) -> str:
    """The name of the class of a table, which is among the classes afterwards."""
    name = table.__name__.removesuffix("Table") + "Keywords"
    if name not in classes:
        fields = {n: info for n, info in table.model_fields.items() if n not in LEFT_OUT.get(table, ())}
        lines = [f"    {n}: {_type(info.annotation, n, classes)}" for n, info in fields.items()]
        doc = " ".join((table.__doc__ or "").split("\n\n")[0].split())
        classes[name] = "\n".join([f"class {name}(TypedDict, total=False):", f'    """{doc}"""', "", *lines, ""])
    return name


def _type(annotation: Any, name: str, classes: dict[str, str]) -> str:
    """A type as a script may give it: any sequence for a list, any mapping for a table, a path for a text that is
    one.
    """
    origin, arguments = get_origin(annotation), get_args(annotation)
    texts = [] if origin in (None, Literal) else [_type(a, name, classes) for a in arguments if not _is_check(a)]
    if annotation in (ModelName, Any) or any(isinstance(a, BeforeValidator) for a in arguments):
        text = "Any"
    elif annotation in LEFT_OUT or annotation is Expectation:
        text = TABLE
    elif isinstance(annotation, type) and issubclass(annotation, BaseModel):
        text = _write(annotation, classes)
    elif origin in (list, dict, tuple):
        kind = {list: "Sequence", dict: "Mapping", tuple: "tuple"}[origin]
        text = f"{kind}[{', '.join(texts)}]" + (" | np.ndarray" if (kind, texts) == ("Sequence", ["float"]) else "")
    elif origin is Literal:
        text = "Literal[" + ", ".join(f'"{a}"' for a in arguments) + "]"
    elif origin is None:
        plain = "None" if annotation is type(None) else annotation.__name__
        text = "str | Path" if plain == "str" and name in PATHS else plain
    else:  # a union, or a type with checks
        text = " | ".join(dict.fromkeys(texts))
    return text


def _is_check(argument: Any) -> bool:
    """Whether an argument of ``Annotated`` is no type."""
    return not (isinstance(argument, type) or get_origin(argument) is not None or argument is Any)


if __name__ == "__main__":
    main()
