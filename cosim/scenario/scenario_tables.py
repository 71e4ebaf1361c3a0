"""The tables of a scenario file but for the whole one: types, ranges and defaults of every key."""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BeforeValidator, Discriminator, Field, PlainValidator, Tag, model_validator

from cosim.components.recording_data import Interpolation
from cosim.components.stated_units import Stated
from cosim.errors import nearest
from cosim.fmu_filter.settings import FilterTable
from cosim.results.formats.known_formats import FORMATS
from cosim.scenario.model_name import Model
from cosim.toml_table import Name, OwnSeed, TomlTable
from fmu_observer.event_protocol import LatePolicy
from fmus.fmi.standard import Interface, Method
from plant_models.hybrid.noise import FROM_NAME, OWN_SEED_EXPECTED
from plant_models.meant_number import meant_number


class _Seed(float):
    """A number that was given as a seed."""


def _start(value: Any) -> Any:
    if isinstance(value, list | tuple):
        return [_start(entry) for entry in value]
    if isinstance(value, bool | int | str) or (isinstance(value, float) and math.isfinite(value)):
        return value
    expected = (
        OWN_SEED_EXPECTED if isinstance(value, _Seed) else "a finite number, true or false, a text, or a list of them"
    )
    raise ValueError(f"expected {expected} (got {value!r})")


Start = Annotated[Any, PlainValidator(_start)]
"""A number, truth value, text or item of an enumeration, bytes in hexadecimal; a list of them for a vector, nested for
arrays.
"""


def _option(value: Any) -> Any:
    if isinstance(value, str | int | float) and value == value:  # noqa: PLR0124 # not-a-number is not itself
        return value
    if isinstance(value, list | tuple) and all(isinstance(entry, str) for entry in value):
        return list(value)
    if isinstance(value, dict) and all(isinstance(name, str) and _is_row(row) for name, row in value.items()):
        return {name: list(row) for name, row in value.items()}
    raise ValueError(
        "expected a text, a number, true or false, a list of texts, or a table of lists of finite numbers as in "
        f"{{ x2 = [0.0, 1.0] }} (got {value!r})"
    )


def _is_row(stated: Any) -> bool:
    return isinstance(stated, list | tuple) and all(
        entry is None or (isinstance(entry, int | float) and not isinstance(entry, bool) and math.isfinite(entry))
        for entry in stated
    )


Option = Annotated[Any, PlainValidator(_option)]
"""A number, truth value, text or list of texts; or lists of numbers by name, bounds of states say."""


def _tolerance(value: Any) -> float | str:
    if value == "none":
        return str(value)
    if isinstance(value, int | float) and not isinstance(value, bool) and 0.0 < value < math.inf:
        return float(value)
    meant = meant_number(value) if isinstance(value, str) else ""
    raise ValueError(f"expected a relative tolerance, a number above 0, or 'none'{meant} (got {value!r})")


Tolerance = Annotated[float | Literal["none"], PlainValidator(_tolerance)]
"""Relative tolerance of the solvers in FMUs."""
Backend = Literal["fmu3", "fmu2", "block3", "block2"]


def _starts(stated: Any) -> Any:
    """Start values, of which a seed that is no number says that it is one."""
    seed = stated.get("seed") if isinstance(stated, dict) else None
    return {**stated, "seed": _Seed(seed)} if isinstance(seed, float) and not math.isfinite(seed) else stated


Isolate = Literal["no", "run", "component"]
"""What runs in a process of its own: nothing, the whole run, each FMU by path."""


class LimitsTable(TomlTable):
    """What the process of an isolated FMU may take."""

    processes: Annotated[int, Field(ge=1)] = 32
    memory: Annotated[int, Field(ge=1)] = 4 * 1024**3
    files: Annotated[int, Field(ge=1)] = 1024
    file_bytes: Annotated[int, Field(ge=1)] = 1024**3
    output_bytes: Annotated[int, Field(ge=1)] = 64 * 1024


_SOLVING = frozenset({"interface", "solver", "method"})
"""Keys of an FMU that say how it is stepped."""


class ComponentTable(TomlTable):
    """One component: an FMU by path, or a shipped plant, sensor, driver or observer by name."""

    fmu: str | None = None
    model: Model | None = None
    observer: Model | None = None
    recording: str | None = None
    component: str | None = None
    interpolation: Interpolation | dict[str, Interpolation] | None = None
    backend: Backend | None = Field(default=None, alias="as")
    preset: str | None = None
    options: dict[str, Option] = {}
    parameters: Annotated[dict[str, Start], BeforeValidator(_starts)] = {}
    units: dict[str, Stated] = {}
    tolerance: Tolerance | None = None
    interface: Interface | None = None
    solver: Literal["cvode"] = "cvode"
    method: Method = "bdf"
    late_policy: LatePolicy = "replay"
    replay_horizon: Annotated[float, Field(gt=0.0)] = 10.0
    record: list[str] = []
    can_be_missing: list[str] = []
    log: Literal["all", "errors", "none"] | list[str] | None = None
    label: str | None = None
    every: Annotated[int, Field(ge=1)] = 1
    substeps: Annotated[int, Field(ge=1)] = 1
    filter: FilterTable | None = None
    isolate: Literal["no", "component"] | None = None
    limits: LimitsTable | None = None

    @model_validator(mode="after")
    def _one_origin(self) -> ComponentTable:
        stated = [k for k in ("fmu", "model", "observer", "recording") if getattr(self, k) is not None]
        if len(stated) != 1:
            raise ValueError(
                "give exactly one of 'fmu' (a path), 'model' (a plant), 'observer' (an observer; both by name or "
                "file.py:Class) or 'recording' (a results folder or a table)"
            )
        if stated == ["fmu"] and (self.preset or self.options or self.backend):
            raise ValueError("'preset', 'options' and 'as' belong to shipped models; an FMU takes 'parameters' only")
        if stated != ["fmu"] and self.filter is not None:
            raise ValueError("'filter' belongs to an 'fmu', which it takes as its model")
        if stated != ["fmu"] and self.units:
            raise ValueError("'units' belong to an FMU, whose description may lack them")
        if stated != ["fmu"] and self.tolerance is not None:
            raise ValueError("'tolerance' belongs to an FMU; shipped models have the parameter 'internal_step' instead")
        if (apart := {"isolate", "limits"} & self.model_fields_set) and (stated != ["fmu"] or self.filter is not None):
            raise ValueError(f"{min(apart)!r} belongs to an FMU by path that is stepped, of which it is said")
        if (solving := _SOLVING & self.model_fields_set) and stated != ["fmu"]:
            raise ValueError(f"{sorted(solving)[0]!r} belongs to an FMU, which a solver moves in model exchange")
        if stated != ["recording"] and {"component", "interpolation"} & self.model_fields_set:
            raise ValueError("'component' and 'interpolation' belong to a recording")
        if stated == ["recording"] and (self.preset or self.options or self.backend or self.parameters):
            raise ValueError(
                "a recording takes 'component' and 'interpolation', no 'parameters', 'preset', 'options' or 'as'"
            )
        return self


class FalseTelegramTable(TomlTable):
    """A telegram without a balise."""

    time: float
    offset: float


class BalisesTable(TomlTable):
    """Balises: where they are, how the crossings are found, what happens to the telegrams."""

    position: str | None = None
    speed: str | None = None
    odometer: str | None = None
    layout: Literal["spacing", "positions", "csv", "instants", "aperiodic", "recorded"]
    spacing: Annotated[float, Field(gt=0.0)] | None = None
    first: float | None = None
    positions: list[float] | None = None
    file: str | None = None
    instants: list[float] | None = None
    seed: OwnSeed = FROM_NAME
    min_gap: Annotated[float, Field(gt=0.0)] = 0.1
    max_gap: Annotated[float, Field(gt=0.0)] = 0.5
    dropout_after: float = 7.9
    dropout_fraction: Annotated[float, Field(ge=0.0, le=1.0)] = 0.15
    dropout_stretch: Annotated[float, Field(ge=1.2)] = 2.5
    track_start: float = 0.0
    track_end: float | None = None
    expected_speed: Annotated[float, Field(gt=0.0)] | None = None
    location_accuracy: Annotated[float, Field(ge=0.0, le=63.0)] = 0.0
    method: Literal["auto", "early-return", "dense-output", "rollback", "predict", "interpolate"] = "auto"
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
        needed = {
            "spacing": "spacing",
            "positions": "positions",
            "csv": "file",
            "recorded": "file",
            "instants": "instants",
        }.get(self.layout)
        if needed is not None and getattr(self, needed) is None:
            raise ValueError(f"layout '{self.layout}' needs '{needed}'")
        if self.layout == "spacing" and self.track_end is None:
            raise ValueError("layout 'spacing' needs 'track_end', the end of the track [m]")
        lacking = [key for key in ("position", "speed") if getattr(self, key) is None]
        if self.layout != "recorded" and lacking:
            raise ValueError(f"layout '{self.layout}' needs {' and '.join(map(repr, lacking))}, outputs of the plant")
        if len(lacking) == 1:
            raise ValueError(
                f"give both 'position' and 'speed', or with layout 'recorded' neither; {lacking[0]!r} is missing"
            )
        return self


class IterationTable(TomlTable):
    """How loops are iterated within a communication step."""

    method: Literal["fixed-point", "aitken", "newton"] = "newton"
    max_iterations: Annotated[int, Field(ge=1)] = 50
    relative_tolerance: Annotated[float, Field(gt=0.0)] = 1e-9
    absolute_tolerance: Annotated[float, Field(gt=0.0)] = 1e-12
    relaxation: Annotated[float, Field(gt=0.0, le=1.0)] = 1.0


class MasterTable(TomlTable):
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
    call_timeout: Annotated[float, Field(gt=0.0)] | None = None
    isolate: Isolate | None = None
    record_every: Annotated[int, Field(ge=1)] = 1
    record_memory: Annotated[float, Field(gt=0.0)] = 256.0


class ConnectionTable(TomlTable):
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
    Discriminator(lambda stated: TABLE if isinstance(stated, dict | ConnectionTable) else LINE),
]


def _format(name: str) -> str:
    if name not in FORMATS:
        raise ValueError(f"unknown result format {name!r}; {nearest(name, FORMATS)}")
    return name


class PhaseTable(TomlTable):
    """A part of the run to be judged on its own."""

    name: str
    start: float
    end: float


class MeasureTable(TomlTable):
    """A column of the printed table of a sweep."""

    measure: str
    label: str | None = None
    factor: float = 1.0
    unit: str | None = None


_MeasureItem = Annotated[
    MeasureTable, BeforeValidator(lambda stated: {"measure": stated} if isinstance(stated, str) else stated)
]


class ReportTable(TomlTable):
    """Roles of signals in the report, and the numbers to print beside the measured ones."""

    true_position: str | None = None
    true_speed: str | None = None
    true_slip: str | None = None
    true_adhesion_force: str | None = None
    true_fault: str | None = None
    odometer: str | None = None
    speed_reference: str | None = None
    observers: list[Name] | None = None
    other_trains: list[Name] = []
    phases: list[PhaseTable] = []
    zones: list[tuple[float, float]] = []
    evaluate_after: float = 0.0
    detection: str = "odometer_fault"
    delay_limit: Annotated[float, Field(ge=0.0)] | None = None
    published: dict[str, dict[str, float]] = {}
    independent: dict[str, dict[str, float]] = {}
    notes: list[str] = []
    measures: list[_MeasureItem] = []
    tables: list[Annotated[str, AfterValidator(_format)]] = ["csv"]
    si: bool = False
