"""The schema of a scenario: what may stand in a scenario file, with types, ranges and defaults.

Unknown keys, wrong types and values out of range are refused with the place and the nearest legal name.
"""

from __future__ import annotations

import json
import math
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Discriminator, Field, PlainValidator, Tag, ValidationError, model_validator

from cosim.errors import ScenarioError, nearest
from fmu_observer.block import LatePolicy

Name = Annotated[str, Field(pattern=r"^[A-Za-z_][A-Za-z0-9_]*$")]


def _start(value: Any) -> Any:
    if isinstance(value, list | tuple):
        return [_start(entry) for entry in value]
    if isinstance(value, bool | int | str) or (isinstance(value, float) and math.isfinite(value)):
        return value
    raise ValueError(f"expected a finite number, true or false, a text, or a list of them (got {value!r})")


Start = Annotated[Any, PlainValidator(_start)]
"""A number, truth value, text or item of an enumeration, bytes in hexadecimal; a list of them for a vector, nested for arrays."""
Realisation = Literal["fmu3", "fmu2", "block3", "block2"]


class Table(BaseModel):
    """A table of a scenario file."""

    model_config = ConfigDict(extra="forbid", frozen=True, populate_by_name=True, allow_inf_nan=False)


class ComponentTable(Table):
    """One component: an FMU by path, or a shipped plant, sensor, driver or observer by name."""

    fmu: str | None = None
    model: str | None = None
    observer: str | None = None
    realisation: Realisation | None = Field(default=None, alias="as")
    preset: str | None = None
    options: dict[str, str | int | float | bool] = {}
    parameters: dict[str, Start] = {}
    late_policy: LatePolicy = "replay"
    replay_horizon: Annotated[float, Field(gt=0.0)] = 10.0
    record: list[str] = []
    log: Literal["all", "errors", "none"] | list[str] | None = None
    label: str | None = None
    every: Annotated[int, Field(ge=1)] = 1
    substeps: Annotated[int, Field(ge=1)] = 1

    @model_validator(mode="after")
    def _one_origin(self) -> ComponentTable:
        given = [k for k in ("fmu", "model", "observer") if getattr(self, k) is not None]
        if len(given) != 1:
            raise ValueError("give exactly one of 'fmu' (a path), 'model' (a shipped plant) or 'observer' (a shipped observer)")
        if given == ["fmu"] and (self.preset or self.options or self.realisation):
            raise ValueError("'preset', 'options' and 'as' belong to shipped models; an FMU takes 'parameters' only")
        return self


class FalseTelegramTable(Table):
    """A telegram without a balise."""

    time: float
    offset: float


class BalisesTable(Table):
    """Balises: where they are, how the passings are found, what happens to the telegrams."""

    position: str
    speed: str
    odometer: str | None = None
    layout: Literal["spacing", "positions", "csv", "instants", "aperiodic"]
    spacing: Annotated[float, Field(gt=0.0)] | None = None
    first: float | None = None
    positions: list[float] | None = None
    file: str | None = None
    instants: list[float] | None = None
    seed: Annotated[int, Field(ge=0)] = 0
    min_gap: Annotated[float, Field(gt=0.0)] = 0.1
    max_gap: Annotated[float, Field(gt=0.0)] = 0.5
    dropout_after: float = 7.9
    dropout_fraction: Annotated[float, Field(ge=0.0, le=1.0)] = 0.15
    dropout_stretch: Annotated[float, Field(ge=1.2)] = 2.5
    track_start: float = 0.0
    track_end: float | None = None
    expected_speed: Annotated[float, Field(gt=0.0)] | None = None
    location_accuracy: Annotated[float, Field(ge=0.0, le=63.0)] = 0.0
    method: Literal["auto", "early-return", "rollback", "predict", "interpolate"] = "auto"
    clock: str | None = None
    jerk_bound: Annotated[float, Field(gt=0.0)] = 10.0
    timing: Literal["exact", "stale"] = "exact"
    receivers: list[Name] | None = None
    latency: Annotated[float, Field(ge=0.0)] = 0.0
    latency_jitter: Annotated[float, Field(ge=0.0)] = 0.0
    missed_fraction: Annotated[float, Field(ge=0.0, le=1.0)] = 0.0
    missed: list[str] = []
    position_noise: Annotated[float, Field(ge=0.0)] = 0.0
    false_telegrams: list[FalseTelegramTable] = []

    @model_validator(mode="after")
    def _layout_complete(self) -> BalisesTable:
        needed = {"spacing": "spacing", "positions": "positions", "csv": "file", "instants": "instants"}.get(self.layout)
        if needed is not None and getattr(self, needed) is None:
            raise ValueError(f"layout '{self.layout}' needs '{needed}'")
        if self.layout == "spacing" and self.track_end is None:
            raise ValueError("layout 'spacing' needs 'track_end', the end of the track [m]")
        return self


class IterationTable(Table):
    """How loops are iterated within a communication step."""

    method: Literal["fixed-point", "aitken", "newton"] = "newton"
    max_iterations: Annotated[int, Field(ge=1)] = 50
    relative_tolerance: Annotated[float, Field(gt=0.0)] = 1e-9
    absolute_tolerance: Annotated[float, Field(gt=0.0)] = 1e-12
    relaxation: Annotated[float, Field(gt=0.0, le=1.0)] = 1.0


class MasterTable(Table):
    """How the components are stepped."""

    algorithm: Literal["auto", "gauss-seidel", "jacobi", "iterate"] = "auto"
    threads: Annotated[int, Field(ge=1)] = 1
    iteration: IterationTable = IterationTable()
    inputs: Literal["hold", "interpolate", "extrapolate"] = "hold"
    control: Literal["fixed", "doubling"] = "fixed"
    tolerance: Annotated[float, Field(gt=0.0)] = 1e-6
    smallest_step: Annotated[float, Field(gt=0.0)] | None = None
    events: Literal["propagate", "local"] = "propagate"
    stepper: Literal["auto", "python", "compiled"] = "auto"
    log_calls: bool = False
    record_every: Annotated[int, Field(ge=1)] = 1
    record_memory: Annotated[float, Field(gt=0.0)] = 256.0


class ConnectionTable(Table):
    """A connection that does something to the number on its way."""

    source: str = Field(alias="from")
    target: str = Field(alias="to")
    factor: float = 1.0
    offset: float = 0.0
    units: Literal["convert", "ignore"] = "convert"
    values: list[tuple[float, float]] = []

    @model_validator(mode="after")
    def _one_transformation(self) -> ConnectionTable:
        if self.values and (self.factor, self.offset) != (1.0, 0.0):
            raise ValueError("give either 'factor' and 'offset', or 'values', not both")
        sources = [source for source, _ in self.values]
        if len(set(sources)) < len(sources):
            raise ValueError("'values' gives two targets for one source")
        return self

    def __str__(self) -> str:
        what = f"{self.factor:g} * {self.source} + {self.offset:g}" if not self.values else f"values of {self.source}"
        return f"{what} -> {self.target}" + ("" if self.units == "convert" else " (units ignored)")


LINE, TABLE = "connection line", "connection table"
"""Tags of the two forms of a connection; left out of messages."""
ConnectionItem = Annotated[
    Annotated[str, Tag(LINE)] | Annotated[ConnectionTable, Tag(TABLE)],
    Discriminator(lambda given: TABLE if isinstance(given, dict | ConnectionTable) else LINE),
]


class PhaseTable(Table):
    """A part of the run to be judged on its own."""

    name: str
    start: float
    end: float


class ReportTable(Table):
    """Roles of signals in the report, and the numbers to print beside the measured ones."""

    true_position: str | None = None
    true_speed: str | None = None
    true_slip: str | None = None
    true_adhesion_force: str | None = None
    odometer: str | None = None
    speed_reference: str | None = None
    observers: list[Name] | None = None
    phases: list[PhaseTable] = []
    zones: list[tuple[float, float]] = []
    evaluate_after: float = 0.0
    published: dict[str, dict[str, float]] = {}
    independent: dict[str, dict[str, float]] = {}
    notes: list[str] = []
    tables: list[Literal["csv", "mat", "npy"]] = ["csv", "mat"]


class ScenarioTable(Table):
    """A whole scenario."""

    title: str = "Co-simulation"
    description: str = ""
    source: str = ""
    start: float = 0.0
    stop: float
    step: float
    certificates: Literal["warn", "require", "ignore"] = "warn"
    components: dict[Name, ComponentTable]
    connections: list[ConnectionItem] = []
    balises: BalisesTable | None = None
    master: MasterTable = MasterTable()
    report: ReportTable = ReportTable()

    @model_validator(mode="after")
    def _times(self) -> ScenarioTable:
        step_count(self.start, self.stop, self.step)
        if not self.components:
            raise ValueError("a scenario needs at least one component")
        return self


MAX_STEPS = 1e12
"""Communication steps of a run at most: days with the fastest stepper, and times are still told apart."""


def step_count(start: float, stop: float, step: float) -> int:
    """Number of communication steps.

    Raises:
        ValueError: the step is not positive, the horizon is empty, or the step does not divide it.
    """
    if not step > 0.0:
        raise ValueError(f"step must be positive, got {step!r} s")
    if not stop > start:
        raise ValueError(f"stop ({stop!r} s) must lie behind start ({start!r} s)")
    if (stop - start) / step > MAX_STEPS:
        raise ValueError(f"step {step!r} s from {start!r} s to {stop!r} s: more than {MAX_STEPS:g} steps; use a larger step")
    count = round((stop - start) / step)
    if count < 1 or abs(start + count * step - stop) > 1e-9 * max(1.0, abs(stop)):
        below = int((stop - start) / step)
        proposals = f"stop = {start + below * step:g} or {start + (below + 1) * step:g}"
        raise ValueError(f"step {step!r} s does not divide the horizon from {start!r} s to {stop!r} s; use {proposals}")
    return count


def parse_scenario(data: dict[str, Any], where: str) -> ScenarioTable:
    """A validated scenario.

    Args:
        data: as read from TOML or built by a script.
        where: file name or 'script', for messages.

    Raises:
        ScenarioError: with one line for each thing that is wrong.
    """
    try:
        return ScenarioTable.model_validate(data)
    except ValidationError as error:
        lines = [_explain(dict(item)) for item in error.errors() if item["loc"][-1:] not in (("list[float]",), ("list[str]",))]
        raise ScenarioError(f"{where}: " + f"\n{where}: ".join(lines)) from error


def _explain(item: dict[str, Any]) -> str:
    place = ".".join(str(p) for p in item["loc"] if not _is_form(str(p))) or "scenario"
    message = str(item["msg"]).removeprefix("Value error, ")
    if item["type"] == "extra_forbidden":
        key = str(item["loc"][-1])
        return f"{place}: unknown key; {nearest(key, _known_keys(item['loc']))}"
    given = item.get("input")
    if item["type"] == "value_error" or isinstance(given, dict):
        return f"{place}: {message}"
    if item["loc"][-1:] == ("float",):
        message = "expected a number, or a list of numbers for a vector"
    if item["loc"][-2:-1] == ("log",) and str(item["loc"][-1]).startswith("literal["):
        message = "expected 'all', 'errors', 'none', or a list of log categories"
    return f"{place}: {message} (got {json.dumps(given, default=str)})"


def _is_form(place: str) -> bool:
    """Whether part of a place names one of several forms a value may have, which says nothing to the user."""
    return place in ("float", "constrained-str", LINE, TABLE) or place.startswith(("list[", "literal["))


def _known_keys(location: tuple[Any, ...]) -> list[str]:
    table: type[Table] = ScenarioTable
    tables: dict[str, type[Table]] = {
        "components": ComponentTable,
        "connections": ConnectionTable,
        "balises": BalisesTable,
        "master": MasterTable,
        "report": ReportTable,
    }
    if len(location) > 1:
        table = tables.get(str(location[0]), ScenarioTable)
    if location[:2] == ("master", "iteration"):
        table = IterationTable
    return [field.alias or name for name, field in table.model_fields.items()]
