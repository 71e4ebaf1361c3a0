"""``cosim list``: observers to begin with; scenarios, plants and observers that ship, hold a word or fit an FMU or a
scenario; or the variants in an SSP file.
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path
from typing import Any

from cosim import ssp, starter
from cosim.cli.arguments import TRUST_CODE
from cosim.errors import ScenarioError
from cosim.scenario.package_names import is_package
from cosim.scenario.shipped import shipped_scenarios, shipped_tables
from fmu_observer import OBSERVERS
from fmu_observer.recommended import EXHIBITS, RECOMMENDED
from fmus.catalogue import CatalogueEntry, catalogue
from fmus.cli.commands import argument
from fmus.cli.list_command import COLUMNS, model_data, model_tables, summary
from fmus.cli.output import Output
from fmus.tables.table import Parts, Table, pairs_table
from plant_models import PLANTS

KINDS = ("scenarios", "models", "observers")
ALL = "all"

GROUP = "Models and files"
PLACE = 1
HELP = "list scenarios, plants and observers; those that hold a word; those that fit an FMU"
LOOKS = True
EXAMPLES = (
    "cosim list",
    "cosim list observers",
    "cosim list balise",
    "cosim list models wheel --all",
    "cosim list --for vendor.fmu",
)
PARSER = {
    "description": "Observers to begin with; or scenarios, plants and observers, all or those that hold the words.",
    "epilog": "Exit codes: 0 done, 2 nothing holds the words.",
}
ARGUMENTS = (
    argument(
        "words",
        nargs="*",
        metavar="WHAT",
        help=f"{', '.join((*KINDS, ALL))}, words to search for, or an .ssp file for its variants",
    ),
    argument("--all", action="store_true", help="all of them, with sources, presets and options"),
    argument(
        "--for",
        dest="target",
        metavar="FILE",
        type=Path,
        help="observers whose inputs this FMU (.fmu) or scenario (.toml, .ssp) can give",
    ),
    TRUST_CODE,
)


@dataclass(frozen=True)
class _Found:
    """What is listed.

    Args:
        scenarios: title and source by name. models, observers: of the catalogue.
    """

    scenarios: Mapping[str, Mapping[str, str]]
    models: Sequence[CatalogueEntry]
    observers: Sequence[CatalogueEntry]

    def data(self, kinds: Sequence[str]) -> dict[str, Any]:
        """All that is known of them, by kind."""
        data = {"scenarios": dict(self.scenarios), "models": model_data(self.models)}
        data["observers"] = model_data(self.observers)
        return {kind: data[kind] for kind in kinds}


def execute(options: argparse.Namespace) -> Output:
    """The lists that the options ask for.

    Raises:
        ScenarioError: nothing holds the words.
    """
    if options.target is not None:
        return _fitting(options.target)
    if options.words and is_package(options.words[0]):
        variants = ssp.list_variants(options.words[0])
        return Output(["variants:", pairs_table("variants", variants)], {"variants": variants})
    kinds = [kind for kind in KINDS if kind in options.words] or list(KINDS)
    words = [word.lower() for word in options.words if word not in (*KINDS, ALL)]
    found = _found(kinds, words)
    brief = not options.all and ALL not in options.words
    if brief and not words and "observers" in kinds:
        return _first_screen(found, kinds)
    return Output(_parts(found, brief=brief), found.data(kinds))


def _found(kinds: Sequence[str], words: Sequence[str]) -> _Found:
    """What holds all the words, of these kinds."""
    known = catalogue()
    scenarios = {name: _scenario(name) for name in (shipped_scenarios() if "scenarios" in kinds else ())}
    entries = {
        kind: [known[name] for name in registry if kind in kinds and _holds(known[name].text, words)]
        for kind, registry in (("models", PLANTS), ("observers", OBSERVERS))
    }
    fitting = {n: s for n, s in scenarios.items() if _holds(" ".join([n, *s.values()]).lower(), words)}
    if words and not (fitting or entries["models"] or entries["observers"]):
        near = get_close_matches(words[0], [*KINDS, *known, *scenarios], 3, 0.65)
        hint = f"did you mean {', '.join(map(repr, near))}?" if near else "'cosim list --all' lists everything."
        raise ScenarioError(f"Nothing that ships holds {' and '.join(map(repr, words))}; {hint}")
    return _Found(fitting, entries["models"], entries["observers"])


def _holds(text: str, words: Sequence[str]) -> bool:
    return all(word in text for word in words)


def _scenario(name: str) -> dict[str, str]:
    tables = shipped_tables(name)
    return {"description": tables.get("title", ""), "source": tables.get("source", "")}


def _first_screen(found: _Found, kinds: Sequence[str]) -> Output:
    """The observers to begin with, and how to see the others."""
    others = len(found.observers) - len(RECOMMENDED)
    more = [
        "What fits your train: cosim list --for vendor.fmu; which is best there: cosim choose vendor.fmu.",
        f"{others} more: cosim list observers --all.",
    ]
    if len(kinds) == len(KINDS):
        plants = f"{len(found.models)} plants and sensors: cosim list models"
        more += [f"{len(found.scenarios)} scenarios: cosim list scenarios; {plants}. By a word: cosim list balise."]
    table = Table("recommended", COLUMNS, list(RECOMMENDED.items()))
    parts: Parts = ["observers to begin with:", table, "\n".join(more)]
    return Output(parts, {"recommended": dict(RECOMMENDED)} | found.data(kinds))


def _parts(found: _Found, *, brief: bool) -> list[Table | str]:
    """Tables of what was found, a line each where they are brief."""
    rows = [
        [name, s["description"] if brief else f"{s['description']}\n[{s['source']}]"]
        for name, s in found.scenarios.items()
    ]
    parts: list[Table | str] = ["scenarios:", Table("scenarios", COLUMNS, rows)] if rows else []
    for kind, entries in (("models", found.models), ("observers", found.observers)):
        if entries:
            parts += [f"{kind}:", *model_tables(kind, entries, brief=brief)]
    names = {entry.name for entry in found.observers}
    shown = [f"{row}, {purpose}" for row, purpose in EXHIBITS.items() if row.partition(":")[0] in names]
    if shown:
        parts += [f"exhibits, close to the best observer nowhere that was tried: {'; '.join(shown)}."]
    return parts


def _fitting(target: Path) -> Output:
    """The observers that an FMU or a scenario can drive."""
    known = catalogue()
    found = starter.find_fitting(target, known)
    read = {name for observer in OBSERVERS for name in (*known[observer].inputs, *known[observer].events)}
    said = [f"{target} has: {', '.join(sorted(found.available & read)) or 'nothing that an observer reads'}."]
    said += ["observers that fit:" if found.names else "No observer fits."]
    rows = [[name, RECOMMENDED.get(name) or summary(known[name])] for name in found.names]
    end = f"{len(found.misfits)} others need what is not there; --json names it. Which is best: cosim choose {target}."
    data = {"available": sorted(found.available), "observers": found.names, "misfits": found.misfits}
    return Output([*said, Table("observers", COLUMNS, rows), end], data)
