"""The schema of a scenario: what may stand in a scenario file, with types, ranges and defaults.

Unknown keys, wrong types and values out of range are refused with the place and the nearest legal name.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping
from difflib import get_close_matches
from functools import cache
from math import ulp
from pathlib import Path
from typing import Annotated, Any, Literal, get_args

from pydantic import (
    AfterValidator,
    Field,
    PlainValidator,
    SerializeAsAny,
    TypeAdapter,
    ValidationError,
    create_model,
    model_validator,
)

from cosim.errors import ScenarioError, nearest
from cosim.expectations.expectation import Expectation
from cosim.expectations.registry import EXPECTATIONS
from cosim.scenario.campaign_table import CampaignTable
from cosim.scenario.network_table import NetworkTable
from cosim.scenario.scenario_tables import (
    LINE,
    TABLE,
    BalisesTable,
    ComponentTable,
    ConnectionItem,
    MasterTable,
    ReportTable,
    Tolerance,
)
from cosim.scenario.wrong_values import wrong_value
from cosim.toml_table import Name, Seed, TomlTable
from fmus.fmi.standard import TIME_TOLERANCE
from plant_models.hybrid.noise import RUN_SEED


def _expectation(stated: Any) -> Expectation:
    """An expectation by its ``check``, of those that are registered when the scenario is read."""
    if isinstance(stated, Expectation):
        return stated
    check = stated.get("check") if isinstance(stated, dict) else None
    if not isinstance(check, str):
        raise ValueError(f"expected a table with the key 'check', which is one of: {', '.join(EXPECTATIONS)}")
    if check not in EXPECTATIONS:
        raise ValueError(f"unknown check {check!r}; {nearest(check, EXPECTATIONS)}")
    return _adapter(EXPECTATIONS[check]).validate_python({check: stated})[check]


@cache
def _adapter(kind: type[Expectation]) -> TypeAdapter[dict[str, Expectation]]:
    """Validates under the name of the check, so that errors are placed there."""
    return TypeAdapter(dict[str, kind])  # type: ignore[valid-type]


_ExpectationItem = Annotated[SerializeAsAny[Expectation], PlainValidator(_expectation)]


def _step(value: float) -> float:
    if not value > 0.0:
        raise ValueError(f"step must be positive, got {value!r} s")
    return value


class ScenarioTable(TomlTable):
    """A whole scenario."""

    title: str = "Co-simulation"
    description: str = ""
    source: str = ""
    start: float = 0.0
    stop: float
    step: Annotated[float, AfterValidator(_step)]
    seed: Seed = RUN_SEED
    tolerance: Tolerance | None = None
    certificates: Literal["warn", "require", "ignore"] = "warn"
    components: dict[Name, ComponentTable]
    connections: list[ConnectionItem] = Field(default_factory=list)
    balises: BalisesTable | None = None
    network: NetworkTable | None = None
    master: MasterTable = MasterTable()
    report: ReportTable = ReportTable()
    cases: dict[str, dict[str, Any]] = Field(default_factory=dict)
    campaign: CampaignTable | None = None
    expect: list[_ExpectationItem] = Field(default_factory=list)

    @model_validator(mode="after")
    def _times(self) -> ScenarioTable:
        step_count(self.start, self.stop, self.step)
        if not self.components:
            raise ValueError("a scenario needs at least one component")
        for name, component in self.components.items():
            if component.substeps > 1:
                _check_resolution(
                    f"components.{name}: one of {component.substeps} substeps,",
                    self.step / component.substeps,
                    self.start,
                    self.stop,
                )
        if self.network is not None:
            _check_resolution("network: the time between two transmissions,", self.network.slot, self.start, self.stop)
        if self.master.smallest_step is not None:
            _check_resolution("master.smallest_step", self.master.smallest_step, self.start, self.stop)
        return self


_MAX_STEPS = 1e12
"""Communication steps of a run at most: days with the fastest stepper, and times are still distinct."""


def step_count(start: float, stop: float, step: float) -> int:
    """Number of communication steps.

    Args:
        start: begin of the run [s]. stop: end of the run [s].

    Raises:
        ValueError: the step is not positive, the horizon is empty, or the step does not divide it.
    """
    if not step > 0.0:
        raise ValueError(f"step must be positive, got {step!r} s")
    if not stop > start:
        raise ValueError(f"stop ({stop!r} s) must lie behind start ({start!r} s)")
    if (stop - start) / step > _MAX_STEPS:
        raise ValueError(
            f"step {step!r} s from {start!r} s to {stop!r} s: more than {_MAX_STEPS:g} steps; use a larger step"
        )
    _check_resolution("step", step, start, stop)
    count = round((stop - start) / step)
    if count < 1 or abs(start + count * step - stop) > 1e-9 * max(1.0, abs(stop)):
        below = int((stop - start) / step)
        proposals = f"stop = {start + below * step:g} or {start + (below + 1) * step:g}"
        raise ValueError(f"step {step!r} s does not divide the horizon from {start!r} s to {stop!r} s; use {proposals}")
    return count


_APART = 10.0
"""A step is at least so many times the distance at which two times are still distinct: a grid of fewer is uneven."""


def _check_resolution(what: str, step: float, start: float, stop: float) -> None:
    """A step must be longer than the resolution of time: that of the numbers, and `TIME_TOLERANCE`.

    Args:
        what: name of the step, for the message. step: [s]. start, stop: of the run [s].

    Raises:
        ValueError: it is too short.
    """
    largest = max(abs(start), abs(stop))
    distance = max(ulp(largest), TIME_TOLERANCE)
    if step < _APART * distance:
        why = f"times near {largest:g} s are distinct from {distance:.2g} s on"
        least = f"a step must be {_APART:g} times that; use {_APART * distance:.2g} s or more"
        raise ValueError(f"{what} {step!r} s is too short: {why}, and {least}")


def parse_scenario(data: dict[str, Any], where: str, folder: Path | None = None) -> ScenarioTable:
    """A validated scenario.

    Args:
        data: as read from TOML or built by a script.
        where: file name or 'script', for messages.
        folder: start of relative paths; None for the working folder.

    Raises:
        ScenarioError: with one line for each thing that is wrong.
    """
    try:
        return ScenarioTable.model_validate(data, context={"folder": folder})
    except ValidationError as error:  # its own account would stand above the words in a script
        if not data.get("components") and not _REQUIRED & data.keys():
            expected = "expected stop = 60.0, step = 0.01, and a table [components.NAME] for each component"
            raise ScenarioError(f"{where} holds no scenario; {expected}.") from None
        raise ScenarioError(_in_words(error, where)) from None


def parse_part(data: Mapping[str, Any], where: str, folder: Path | None = None, at: tuple[str | int, ...] = ()) -> Any:
    """Some keys of a scenario by themselves, validated by the same declarations as the whole.

    Args:
        data: the keys. where, folder: as for `parse_scenario`.
        at: path of keys; faults elsewhere are not reported. All are by default.

    Returns:
        An object with these keys as attributes; None where a fault lies elsewhere.

    Raises:
        ScenarioError: with one line for each thing that is wrong.
    """
    known = tuple(name for name in ScenarioTable.model_fields if name in data)
    try:
        return _part(known).model_validate(dict(data), context={"folder": folder})
    except ValidationError as error:
        text = _in_words(error, where, at)
        if text:
            raise ScenarioError(text) from None
    return None


@cache
def _part(names: tuple[str, ...]) -> type[TomlTable]:
    """A table with these fields of a scenario alone."""
    infos = ScenarioTable.model_fields
    fields: dict[str, Any] = {name: (infos[name].annotation, infos[name]) for name in names}
    return create_model("ScenarioPart", __base__=TomlTable, **fields)


def _in_words(error: ValidationError, where: str, at: tuple[str | int, ...] = ()) -> str:
    """What is wrong at a place of a scenario, or below it, a line each; empty where all of it lies elsewhere."""
    items: list[dict[str, Any]] = [dict(item) for item in error.errors() if item["loc"][: len(at)] == at]
    items = [item for item in items if not _of_another_form(item)]
    misplaced = {item["loc"][-1] for item in items if _is_misplaced(item)}
    shown = [item for item in items if (item["type"], item["loc"][-1:]) not in _missing(misplaced)]
    misspelt = {near for item in shown if item["type"] == "extra_forbidden" for near in _near_keys(item["loc"])}
    shown = [item for item in shown if item["type"] != "missing" or item["loc"] not in misspelt]
    return "\n".join(f"{where}: {_explain(item)}" for item in shown)


_REQUIRED = frozenset({"stop", "step"})


def _missing(keys: Iterable[str]) -> set[tuple[str, tuple[str, ...]]]:
    """Kind and place of the errors that keys of the whole scenario are missing."""
    return {("missing", (key,)) for key in keys}


def _is_misplaced(item: dict[str, Any]) -> bool:
    """Whether a key of the whole scenario stands in one of its tables, as it does below the head of one."""
    return item["type"] == "extra_forbidden" and len(item["loc"]) > 1 and item["loc"][-1] in ScenarioTable.model_fields


EXPECTED = {
    "log": "expected 'all', 'errors', 'none', or a list of log categories",
    "interpolation": "expected 'linear' or 'hold', or a table of these by column",
    "can_be_missing": "expected a list of names, such as ['effort']",
}
"""Of a component: keys that have several forms, or one that is easily missed."""


def _of_another_form(item: dict[str, Any]) -> bool:
    """Whether an error is that a value has not one of several forms, where another of them is nearer to it."""
    form = str((item["loc"] or ("",))[-1])
    if form.startswith("literal[") and isinstance(item.get("input"), dict):
        return True
    return form in ("list[float]", "list[str]") or form.startswith("dict[")


def _explain(item: dict[str, Any]) -> str:
    place = _place(item["loc"])
    if item["type"] == "extra_forbidden":
        return f"{place}: unknown key; {_hint(item)}"
    if item["type"] == "missing":
        return f"{place}: is missing"
    stated = item.get("input")
    if item["type"] == "value_error" or isinstance(stated, dict):
        return f"{place}: {str(item['msg']).removeprefix('Value error, ')}"
    message = wrong_value(item)
    if item["loc"][-1:] == ("float",) and message == "expected a number":
        message = "expected a number, or a list of numbers for a vector"
    key = str(item["loc"][2]) if item["loc"][:1] == ("components",) and len(item["loc"]) > 2 else ""
    message = EXPECTED.get(key, message)
    return f"{place}: {message} (got {json.dumps(stated, default=str)})"


def _near_keys(location: tuple[Any, ...]) -> list[tuple[Any, ...]]:
    """Where the keys stand that an unknown one may be meant for."""
    return [(*location[:-1], key) for key in get_close_matches(str(location[-1]), _known_keys(location))]


def _hint(item: dict[str, Any]) -> str:
    """Where a key belongs that is unknown where it stands."""
    location, key = item["loc"], str(item["loc"][-1])
    if _is_misplaced(item):
        return f"{key} is a key of the whole scenario and stands above the first [table]"
    hint = nearest(key, _known_keys(location))
    if location[0] != "components" or len(location) != 3 or hint.startswith(f"did you mean '{key[:1]}"):
        return hint
    return f"a parameter of the model stands in [components.{location[1]}.parameters]"


def _place(location: tuple[Any, ...]) -> str:
    """Where in the scenario; expectations are counted from 1 and named by what they check."""
    if location[0:1] == ("expect",) and len(location) > 1:
        check = f", '{location[2]}'" if len(location) > 2 else ""
        return f"expect, number {location[1] + 1}{check}" + "".join(f", {part}" for part in location[3:4])
    return ".".join(str(p) for p in location if not _is_form(str(p))) or "scenario"


def _is_form(place: str) -> bool:
    """Whether part of a place names one of several forms a value may have, which says nothing to the user."""
    return place in ("float", "constrained-str", LINE, TABLE) or place.startswith(("list[", "literal[", "dict["))


def _known_keys(location: tuple[Any, ...]) -> list[str]:
    """The keys of the table in which a place lies."""
    if location[0] == "expect" and len(location) > 3:
        table: Any = EXPECTATIONS[str(location[2])]
    else:
        table = ScenarioTable
        for part in location[:-1]:
            field = table.model_fields.get(part)
            inner = next(_tables(field.annotation), None) if field is not None else None
            table = inner or table
    return [field.alias or name for name, field in table.model_fields.items()]


def _tables(annotation: Any) -> Iterator[type[TomlTable]]:
    """The tables that a value of a type may hold."""
    if isinstance(annotation, type) and issubclass(annotation, TomlTable):
        yield annotation
    for part in get_args(annotation):
        yield from _tables(part)
