"""Overrides: one value of a scenario's tables set by its name, as ``--set``, ``[overrides]`` and `Scenario.set` do."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from cosim.errors import ScenarioError, nearest
from cosim.scenario.merging import BETWEEN_TARGETS
from cosim.scenario.model_name import named, settings_of
from cosim.scenario.paths import COMPONENT_PATHS, MODEL_KEYS, absolute, move_file, move_option_files
from cosim.scenario.scenario_tables import ComponentTable, ConnectionTable
from cosim.scenario.toml_values import plain
from cosim.toml_table import TomlTable

TABLES = ("balises", "network", "master", "report", "campaign")
COMPONENT_KEYS = {field.alias or name for name, field in ComponentTable.model_fields.items()}
INNER = ("options", "parameters")
CASE = "case"
"""Name under which a case of a scenario is chosen: it stands for all the values of the case."""


def component_from_script(table: Mapping[str, Any]) -> Any:
    """The table of a component; settings that a model instance brings stand behind those given beside it.

    Args:
        table: its keys, with classes and instances in place of names.
    """
    found = by_alias(ComponentTable, table)
    models = {key: named(found[key]) for key in MODEL_KEYS if key in found}
    for model in models.values():
        for key, settings in settings_of(getattr(model, "stated", "")).items():
            found[key] = {**settings, **found.get(key, {})}
    return plain(found | models)


def connection_from_script(line: str | Mapping[str, Any], transformation: Mapping[str, Any]) -> list[Any]:
    """A connection as items of a file: a line as it is, or a table for each of its targets where the number changes.

    Args:
        line: ``source -> target, target``, or a table. transformation: keys of a table, of those that are not stated.
    """
    if not isinstance(line, str):
        return [{**plain(transformation), **plain(by_alias(ConnectionTable, line))}]
    if not transformation:
        return [line]
    source, arrow, targets = line.partition("->")
    names = BETWEEN_TARGETS.split(targets) if arrow else [""]
    return [{"from": source.strip(), "to": name.strip(), **plain(transformation)} for name in names]


def by_alias(table: type[TomlTable], values: Mapping[str, Any]) -> dict[str, Any]:
    """Values under the keys of a file; a script says ``backend`` where a file says ``as``, which Python keeps for
    itself.

    Args:
        table: whose keys they are. values: by the name of the key or of the field.
    """
    aliases = {name: info.alias for name, info in table.model_fields.items() if info.alias is not None}
    return {aliases.get(name, name): value for name, value in values.items()}


def value_from_script(name: str, value: Any) -> Any:
    """A value to be set; paths are relative to where the user stands.

    Args:
        name: as for `Scenario.set`. value: what it becomes.
    """
    key = name.rpartition(".")[2] if name.count(".") == 1 else ""
    value = named(value) if key in MODEL_KEYS else plain(value)
    if key in COMPONENT_PATHS:
        value = absolute(str(value), ".")
    if key in MODEL_KEYS and isinstance(value, str):
        value = move_file(value, lambda path: absolute(path, "."))
    _, _, below = name.partition(".")
    if below == "options" or below.startswith("options."):
        options = value if isinstance(value, Mapping) else {below: value}
        moved = move_option_files(options, lambda path: absolute(path, "."))
        value = moved if isinstance(value, Mapping) else moved[below]
    return value


def override(tables: dict[str, Any], name: str, value: Any) -> tuple[str, ...]:
    """Set one value.

    Args:
        tables: keys of a scenario, changed in place; the tables below are replaced.
        name: ``component.parameter``, ``component.key``, ``component.options.name``, ``balises.key``,
            ``network.key``, ``master.key``, ``report.key``, a top-level key such as ``stop``, or ``case``, which sets
            all that the case of that name says.
        value: what it becomes.

    Returns:
        The path of keys to the value.

    Raises:
        ScenarioError: there is no such component, table or case.
    """
    if name == CASE:
        for key, entry in case_values(tables, value).items():
            override(tables, key, entry)
        return (name,)
    if "." not in name:
        if name in (tables.get("components") or {}):
            raise ScenarioError(f"{name!r} is a component; set one of its keys or parameters, such as {name}.preset.")
        tables[name] = value
        return (name,)
    keys = _keys(tables, name)
    node = tables
    for key in keys[:-1]:
        below = node.get(key, {})
        if not isinstance(below, dict):
            raise ScenarioError(f"cannot set {name!r}: {key!r} is no table.")
        node[key] = dict(below)
        node = node[key]
    node[keys[-1]] = value
    return keys


def _keys(tables: Mapping[str, Any], name: str) -> tuple[str, ...]:
    """The path of keys that a name with a dot means."""
    head, _, rest = name.partition(".")
    components = tables.get("components")
    if isinstance(components, dict) and head in components:
        return ("components", head, *_component_key(rest))
    if head in TABLES:
        return (head, *rest.split("."))
    known = [*(components or ()), *TABLES]
    raise ScenarioError(f"cannot set {name!r}: no component {head!r}; {nearest(head, known)}")


def case_values(tables: Mapping[str, Any], case: Any) -> dict[str, Any]:
    """What a case of a scenario sets, by the names of `override`.

    Args:
        tables: keys of a scenario. case: name of the case.

    Raises:
        ScenarioError: the scenario has no such case, or it is no table.
    """
    cases = tables.get("cases") or {}
    if not isinstance(cases, Mapping) or not cases:
        raise ScenarioError(f"cannot set 'case' to {case!r}: the scenario has no cases; expected tables [cases.NAME].")
    if case not in cases:
        raise ScenarioError(f"no case {case!r}; {nearest(str(case), list(cases))}")
    values = cases[case]
    if not isinstance(values, Mapping):
        raise ScenarioError(f"case {case!r}: expected a table with lines such as 'plant.mass = 80e3'.")
    return {name: value for name, value in flat(values) if name != CASE}


def _component_key(rest: str) -> tuple[str, ...]:
    """Where a name below a component leads: to a key of its table, or to a parameter, whose name may have dots."""
    if rest in COMPONENT_KEYS:
        return (rest,)
    table, dot, name = rest.partition(".")
    return (table, name) if dot and table in INNER else ("parameters", rest)


def flat(tables: Mapping[str, Any], before: str = "") -> Iterator[tuple[str, Any]]:
    """Names and values of nested tables: ``[overrides]`` takes ``"plant.mass" = 1.0`` and ``plant.mass = 1.0``
    alike.

    Args:
        before: keys that lead to it.
    """
    for name, value in tables.items():
        if isinstance(value, Mapping):
            yield from flat(value, f"{before}{name}.")
        else:
            yield before + name, value
