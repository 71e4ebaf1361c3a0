"""Values as a script gives them, classes and paths among them, made such as a scenario file holds them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from cosim.scenario.model_name import named, settings_of
from cosim.scenario.paths import COMPONENT_PATHS, MODEL_KEYS, absolute, move_file, move_option_files
from cosim.scenario.saving import plain


def given_component(table: Mapping[str, Any]) -> Any:
    """The table of a component; settings that a model instance brings stand behind those given beside it.

    Args:
        table: its keys, with classes and instances in place of names.
    """
    models = {key: named(table[key]) for key in MODEL_KEYS if key in table}
    found = dict(table)
    for model in models.values():
        for key, settings in settings_of(getattr(model, "given", "")).items():
            found[key] = {**settings, **found.get(key, {})}
    return plain(found | models)


def given_value(name: str, value: Any) -> Any:
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
