"""Writes the generated parts of these pages, and the README's picture: ``python docs/generate.py``.

A generated part stands between ``<!-- generated: NAME -->`` and ``<!-- end -->``. The tests compare the parts with what
this script would write, so that no table can drift from the code. It touches the pages of ``docs`` and
the picture only.
"""

from __future__ import annotations

import re
import sys
import tomllib
from collections.abc import Callable, Mapping
from functools import cache
from math import isfinite
from pathlib import Path
from typing import Any, get_args, get_origin

from annotated_types import Ge, Gt, Le
from pydantic.fields import FieldInfo

import fmu_observer
from cosim import Outcome, Scenario
from cosim.evaluation.error_table import error_table
from cosim.evaluation.metrics import phase_metrics
from cosim.expectations.registry import EXPECTATIONS
from cosim.fmu_filter.settings import FilterTable
from cosim.report.figures.main_picture import main_picture
from cosim.scenario import campaign_table, network_table, schema
from cosim.scenario import scenario_tables as tables
from cosim.scenario.model_name import ModelName
from fmu_observer.certificates.gap_findings import CONSTANT_GAP

DOCS = Path(__file__).parent
sys.path.append(str(DOCS / "gallery"))

import figure_index  # noqa: E402 - stands in a folder of scripts
import small_picture  # noqa: E402

ROOT = DOCS.parent
FIRST_RUN = "docs/guide/first_run.md"
WORDS = DOCS / "scenario_keys.toml"
PICTURE = DOCS / "images" / "main_picture.png"
PART = r"(<!-- generated: {name} -->\n)(.*?)(<!-- end -->)"
RUN_REQUIREMENTS = DOCS / "ci" / "requirements-run.txt"
LEFT_OUT = ("casadi", "clarabel", "control", "matplotlib")  # tracing, certificates by a solver, conversions, figures
OF_FMPY = ("attrs", "lark")  # of what FMPy names, all that it loads to read, check and step an FMU
SHORTENED = ("traction zone", "braking zone", "whole run")


def main() -> None:
    """Rewrite every generated part."""
    for (file, name), make in PARTS.items():
        path = ROOT / file
        text = path.read_text(encoding="utf-8")
        path.write_text(replace_part(text, name, make()), encoding="utf-8")
        print(f"{file}: {name}")
    RUN_REQUIREMENTS.write_text(run_requirements(), encoding="utf-8")
    write_picture()
    print(PICTURE.relative_to(ROOT))


def run_requirements() -> str:
    """What running and comparing FMUs needs beside FMPy and this project, installed without what these name."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    kept = [text for text in project["dependencies"] if text.partition(">")[0] not in (*LEFT_OUT, "fmpy")]
    kept += [text for text in project["optional-dependencies"]["test"] if text.startswith("pytest>")]
    lines = [
        "# For running, comparing and testing FMUs: docs/guide/regression_tests.md. Written by docs/generate.py.",
        "# Behind it: pip install --no-deps 'fmpy>=0.3.32' fmu-observer",
        *sorted([*kept, *OF_FMPY]),
    ]
    return "\n".join(lines) + "\n"


def part(text: str, name: str) -> str:
    """The present content of a generated part.

    Raises:
        ValueError: the text has no such part.
    """
    found = re.search(PART.format(name=re.escape(name)), text, re.DOTALL)
    if found is None:
        raise ValueError(f"no part '<!-- generated: {name} -->' ... '<!-- end -->'")
    return found.group(2)


def replace_part(text: str, name: str, content: str) -> str:
    """The text with new content in a generated part."""
    part(text, name)
    return re.sub(PART.format(name=re.escape(name)), lambda m: m[1] + content + m[3], text, flags=re.DOTALL)


# -- the run of the README ------------------------------------------------------------------------------------------


@cache
def default_run() -> Outcome:
    """The run of the README's first command.

    Raises:
        RuntimeError: the run failed.
    """
    outcome = Scenario.load("freight_profile_d").run(warn=_said_by_the_command)
    if outcome.failure is not None:
        raise RuntimeError(outcome.failure)
    return outcome


def _said_by_the_command(_warning: str) -> None:
    """The page says what the run warns about; here it would only be noise."""


def write_picture() -> None:
    """The main picture of the default run, for the README."""
    outcome = default_run()
    small_picture.save_small(main_picture(outcome.result, outcome.spec), PICTURE)


def printed_table() -> str:
    """The table of the default run, two phases and the whole of it, as ``cosim run`` prints it."""
    outcome = default_run()
    head, rule, *rows = error_table(phase_metrics(outcome.result, outcome.spec), outcome.spec).text().splitlines()
    chosen = [row for row in rows if any(f"  {phase}  " in row for phase in SHORTENED)]
    return "\n".join(["```text", head, rule, *chosen, "```", ""])


# -- certificates ---------------------------------------------------------------------------------------------------

NUMBERS = {"S1": "differentiator_cdo", "S2": "takagi_sugeno_cdo", "S4": "multirate_cdo", "S5": "discrete_uio"}


def certificate_table() -> str:
    """Shipped observers and presets with their source and their certified gaps, default parameters."""
    rows = [
        "| | observer | what it is | Bouchama 2024 | preset | mixed gaps certified up to | constant gap unstable from "
        "|",
        "|---|---|---|---|---|---|---|",
    ]
    for number, name in NUMBERS.items():
        system: Any = fmu_observer.OBSERVERS[name]()
        source = system.source.removeprefix("Bouchama 2024, ")
        for preset in list(system.presets) or [None]:
            certificate = next(system.findings(0.1, preset=preset))
            limits = [
                f"{part.value:.3g} s" if isfinite(part.limit) else f"> {part.value:g} s"
                for part in (certificate, certificate.condition(CONSTANT_GAP))
            ]
            preset_cell = _preset(system, preset)
            rows.append(
                f"| {number} | `{name}` | {system.description} | {source} | {preset_cell} | {limits[0]} | {limits[1]} |"
            )
    return "\n".join([*rows, ""])


def _preset(system: Any, preset: str | None) -> str:
    if preset is None:
        return "(none)"
    return f"`{preset}`" + (" (default)" if preset == system.default_preset else "")


# -- the keys of a scenario -----------------------------------------------------------------------------------------


def schema_page(table: str) -> Callable[[], str]:
    """A function that writes the key table of one table of the schema."""
    return lambda: key_table(table)


def key_table(table: str) -> str:
    """Keys of one table of the schema, types and defaults from the code, units and meanings from
    ``scenario_keys.toml`` or the descriptions of the fields.

    Raises:
        ValueError: the code has a key without words, or there are words without a key.
    """
    model = (schema_tables() | expectation_tables())[table]
    every = tomllib.loads(WORDS.read_text(encoding="utf-8"))
    fields: Mapping[str, FieldInfo] = {info.alias or name: info for name, info in model.model_fields.items()}
    described = {name: ("", info.description) for name, info in fields.items() if info.description}
    shared = every["expect"] if table.startswith("expect_") else {}
    words = {name: shared[name] for name in shared if name in fields} | described | every.get(table, {})
    if set(fields) != set(words):
        bare, extra = sorted(set(fields) - set(words)), sorted(set(words) - set(fields))
        raise ValueError(
            f"{table}: keys without words {bare}, words without key {extra}; write Field(description=...) in the "
            f"class, or a line in {WORDS.name}"
        )
    rows = ["| key | type | default | unit | meaning |", "|---|---|---|---|---|"]
    for key, info in fields.items():
        unit, meaning = words[key]
        rows.append(f"| `{key}` | {_type(info)} | {_default(info)} | {unit or '-'} | {meaning} |")
    return "\n".join([*rows, ""])


def schema_tables() -> dict[str, Any]:
    """The tables of the schema by the name they have on the page."""
    return {
        "scenario": schema.ScenarioTable,
        "component": tables.ComponentTable,
        "filter": FilterTable,
        "limits": tables.LimitsTable,
        "connection": tables.ConnectionTable,
        "master": tables.MasterTable,
        "iteration": tables.IterationTable,
        "balises": tables.BalisesTable,
        "false_telegram": tables.FalseTelegramTable,
        "network": network_table.NetworkTable,
        "campaign": campaign_table.CampaignTable,
        "variable": campaign_table.VariedTable,
        "keep": campaign_table.KeepTable,
        "report": tables.ReportTable,
        "phase": tables.PhaseTable,
        "measure": tables.MeasureTable,
    }


def expectation_tables() -> dict[str, Any]:
    """The tables of expectations by the name they have on their page."""
    return {f"expect_{'error' if name.endswith('_error') else name}": table for name, table in EXPECTATIONS.items()}


def on_page(table: str) -> bool:
    """Whether the page of expectations has a place for this table; those of later kinds stand at its end."""
    return f"<!-- generated: {table} -->" in (ROOT / "docs/reference/expectations.md").read_text(encoding="utf-8")


def all_expectations() -> str:
    """All kinds with what they demand, and the keys of those that have no place of their own on the page."""
    rows = ["| `check` | demands |", "|---|---|"]
    for name, kind in sorted(EXPECTATIONS.items()):
        rows.append(f"| `{name}` | {' '.join(str(kind.__doc__).split())} |")
    others = [f"\nKeys of `{name[7:]}`:\n\n{key_table(name)}" for name in expectation_tables() if not on_page(name)]
    return "\n".join([*rows, "", *others])


def _default(info: FieldInfo) -> str:
    if info.is_required():
        return "**required**"
    value = info.default
    if value is None:
        return "-"
    if isinstance(value, str):
        return f'`"{value}"`'
    if isinstance(value, bool):
        return f"`{str(value).lower()}`"
    return f"`{value}`" if isinstance(value, int | float) else "empty"


def _type(info: FieldInfo) -> str:
    limits = [_limit(bound) for bound in info.metadata if isinstance(bound, Gt | Ge | Le)]
    return ", ".join([_kind(info.annotation), *limits])


def _limit(bound: Gt | Ge | Le) -> str:
    if isinstance(bound, Gt):
        return f"> {bound.gt:g}"  # type: ignore[str-format]
    return f">= {bound.ge:g}" if isinstance(bound, Ge) else f"<= {bound.le:g}"  # type: ignore[str-format]


SIMPLE = {float: "number", int: "whole number", str: "text", ModelName: "text", bool: "true or false", Any: "values"}


def _kind(annotation: Any) -> str:
    """A type in the words of TOML."""
    origin, arguments = get_origin(annotation), [a for a in get_args(annotation) if a is not type(None)]
    if annotation in SIMPLE:
        text = SIMPLE[annotation]
    elif hasattr(annotation, "__metadata__"):
        text = _type(FieldInfo.from_annotation(annotation))
    elif origin is list:
        entry = _kind(arguments[0])
        text = f"list of {entry}" if entry.endswith("s") else f"list of {entry}s"
    elif origin is tuple:
        text = f"groups of {len(arguments)} numbers"
    elif origin is dict:
        text = f"table of {_kind(arguments[1])}"
    elif isinstance(annotation, type):
        text = "table"
    elif all(isinstance(a, str) for a in arguments):
        text = ", ".join(f'`"{a}"`' for a in arguments)
    else:
        text = " or ".join(dict.fromkeys(_kind(a) for a in arguments))
    return text


PARTS: dict[tuple[str, str], Callable[[], str]] = {
    (FIRST_RUN, "printed table"): printed_table,
    ("docs/reference/certificates.md", "observers"): certificate_table,
    ("docs/theses/gallery.md", "figures"): figure_index.figures,
    ("docs/theses/gallery.md", "studies"): figure_index.studies,
    **{("docs/reference/scenario_files.md", name): schema_page(name) for name in schema_tables()},
    **{("docs/reference/expectations.md", name): schema_page(name) for name in expectation_tables() if on_page(name)},
    ("docs/reference/expectations.md", "expectations"): all_expectations,
}

if __name__ == "__main__":
    main()
