"""The keywords of `cosim.Scenario` with their types, from the tables of scenario files: see docs/keyword_types.py."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Literal, TypedDict

import numpy as np

class StatedUnitKeywords(TypedDict, total=False):
    """What is known of a variable: ``value as usual = sign * value of the FMU + offset``, in the unit."""

    unit: str | None
    sign: Literal["1", "-1"]
    offset: float
    meaning: str | None
    instead_of: str | None

class FilterKeywords(TypedDict, total=False):
    """A filter over the FMU of its component."""

    kind: Literal["ekf", "ukf", "ensemble", "particle"]
    interface: Literal["co-simulation", "model-exchange"] | None
    states: Sequence[str] | None
    outputs: Sequence[str] | None
    measurements: Mapping[str, float]
    sample_period: float | None
    process_noise: Mapping[str, float]
    input_noise: Mapping[str, float]
    start_deviation: Mapping[str, float]
    balise: str | None
    balise_deviation: float
    horizon: float
    alpha: float
    members: int
    seed: int

class LimitsKeywords(TypedDict, total=False):
    """What the process of an isolated FMU may take."""

    processes: int
    memory: int
    files: int
    file_bytes: int
    output_bytes: int

class ComponentKeywords(TypedDict, total=False):
    """One component: an FMU by path, or a shipped plant, sensor, driver or observer by name."""

    fmu: str | Path | None
    model: Any | None
    observer: Any | None
    recording: str | Path | None
    component: str | None
    interpolation: Literal["linear", "hold"] | Mapping[str, Literal["linear", "hold"]] | None
    backend: Literal["fmu3", "fmu2", "block3", "block2"] | None
    preset: str | None
    options: Mapping[str, Any]
    parameters: Mapping[str, Any]
    units: Mapping[str, Any]
    tolerance: float | Literal["none"] | None
    interface: Literal["co-simulation", "model-exchange"] | None
    solver: Literal["cvode"]
    method: Literal["bdf", "adams"]
    late_policy: Literal["replay", "reject", "late"]
    replay_horizon: float
    record: Sequence[str]
    can_be_missing: Sequence[str]
    log: Literal["all", "errors", "none"] | Sequence[str] | None
    label: str | None
    every: int
    substeps: int
    filter: FilterKeywords | None
    isolate: Literal["no", "component"] | None
    limits: LimitsKeywords | None

class FalseTelegramKeywords(TypedDict, total=False):
    """A telegram without a balise."""

    time: float
    offset: float

class BalisesKeywords(TypedDict, total=False):
    """Balises: where they are, how the crossings are found, what happens to the telegrams."""

    position: str | None
    speed: str | None
    odometer: str | None
    layout: Literal["spacing", "positions", "csv", "instants", "aperiodic", "recorded"]
    spacing: float | None
    first: float | None
    positions: Sequence[float] | np.ndarray | None
    file: str | Path | None
    instants: Sequence[float] | np.ndarray | None
    seed: int
    min_gap: float
    max_gap: float
    dropout_after: float
    dropout_fraction: float
    dropout_stretch: float
    track_start: float
    track_end: float | None
    expected_speed: float | None
    location_accuracy: float
    method: Literal["auto", "early-return", "dense-output", "rollback", "predict", "interpolate"]
    clock: str | None
    jerk_bound: float
    timing: Literal["exact", "stale"]
    receivers: Sequence[str] | None
    latency: float
    latency_jitter: float
    missed_fraction: float
    missed: Sequence[str]
    position_noise: float
    false_telegrams: Sequence[FalseTelegramKeywords]

class NetworkKeywords(TypedDict, total=False):
    """The network over which measurements travel: its nodes, when they send, and what happens to the packets."""

    preset: str | None
    nodes: Mapping[str, Sequence[str]]
    protocol: Literal["round-robin", "periodic", "try-once-discard", "quadratic"]
    order: Sequence[str] | None
    weights: Mapping[str, Sequence[Sequence[float] | np.ndarray]] | None
    scales: Mapping[str, float]
    period: float | None
    cycle: float | None
    offset: float
    jitter: float
    delay_model: Literal["constant", "uniform", "recorded", "correlated"]
    delay: float
    delay_spread: float
    delay_correlation: float
    delay_file: str | Path | None
    equalise: float
    loss_fraction: float
    loss_burst: float | None
    duplicate_fraction: float
    sequence: Literal["checked", "ignored"]
    receivers: Sequence[str] | None
    seed: int

class IterationKeywords(TypedDict, total=False):
    """How loops are iterated within a communication step."""

    method: Literal["fixed-point", "aitken", "newton"]
    max_iterations: int
    relative_tolerance: float
    absolute_tolerance: float
    relaxation: float

class MasterKeywords(TypedDict, total=False):
    """How the components are stepped."""

    algorithm: Literal["auto", "gauss-seidel", "jacobi", "iterate"]
    threads: int
    iteration: IterationKeywords
    inputs: Literal["hold", "interpolate", "extrapolate"]
    control: Literal["fixed", "doubling"]
    tolerance: float
    smallest_step: float | None
    events: Literal["propagate", "local"]
    stepper: Literal["auto", "python", "compiled"]
    log_calls: bool
    call_timeout: float | None
    isolate: Literal["no", "run", "component"] | None
    record_every: int
    record_memory: float

class PhaseKeywords(TypedDict, total=False):
    """A part of the run to be judged on its own."""

    name: str
    start: float
    end: float

class MeasureKeywords(TypedDict, total=False):
    """A column of the printed table of a sweep."""

    measure: str
    label: str | None
    factor: float
    unit: str | None

class ReportKeywords(TypedDict, total=False):
    """Roles of signals in the report, and the numbers to print beside the measured ones."""

    true_position: str | None
    true_speed: str | None
    true_slip: str | None
    true_adhesion_force: str | None
    true_fault: str | None
    odometer: str | None
    speed_reference: str | None
    observers: Sequence[str] | None
    other_trains: Sequence[str]
    phases: Sequence[PhaseKeywords]
    zones: Sequence[tuple[float, float]]
    evaluate_after: float
    detection: str
    delay_limit: float | None
    published: Mapping[str, Mapping[str, float]]
    independent: Mapping[str, Mapping[str, float]]
    notes: Sequence[str]
    measures: Sequence[Any]
    tables: Sequence[str]
    si: bool

class VariedKeywords(TypedDict, total=False):
    """What one setting is drawn from."""

    uniform: tuple[float, float] | None
    log: tuple[float, float] | None
    whole: tuple[int, int] | None
    normal: tuple[float, float] | None
    low: float | None
    high: float | None
    triangular: tuple[float, float, float] | None
    choose: Sequence[Any] | None
    weights: Sequence[float] | np.ndarray | None
    unit: str | None

class KeepKeywords(TypedDict, total=False):
    """Runs whose whole results are kept beside the table."""

    failures: int
    worst: int
    of: Sequence[str]
    sample: int

class CampaignKeywords(TypedDict, total=False):
    """Many runs of the scenario: what varies, how points are laid, what is kept."""

    runs: int | None
    method: Literal["random", "latin", "sobol", "grid", "zip"]
    seed: int
    vary: Mapping[str, Sequence[Any] | VariedKeywords]
    faults: bool | Sequence[str]
    correlate: Sequence[tuple[str, str, float]]
    where: Sequence[str]
    design: Mapping[str, Sequence[Any]]
    keep: KeepKeywords

class ScenarioKeywords(TypedDict, total=False):
    """A whole scenario."""

    title: str
    description: str
    source: str
    start: float
    stop: float
    step: float
    seed: int
    tolerance: float | Literal["none"] | None
    certificates: Literal["warn", "require", "ignore"]
    components: Mapping[str, ComponentKeywords]
    connections: Sequence[str | Mapping[str, Any]]
    balises: BalisesKeywords | None
    network: NetworkKeywords | None
    master: MasterKeywords
    report: ReportKeywords
    cases: Mapping[str, Mapping[str, Any]]
    campaign: CampaignKeywords | None
    expect: Sequence[Mapping[str, Any]]

class ConnectionKeywords(TypedDict, total=False):
    """A connection that does something to the number on its way."""

    factor: float
    offset: float
    units: Literal["convert", "ignore"]
    values: Sequence[tuple[float, float]]

class ExpectationKeywords(TypedDict, total=False):
    """An expectation: the keys of all kinds together."""

    name: str | None
    start: float | None
    end: float | None
    signal: str
    reference: str
    bound: str
    of: str | Sequence[str] | None
    max: float | None
    rms: float | None
    threshold: float | None
    before: float
    min: float | None
    final: tuple[float, float] | None
    missed: int | None
    false: int | None
    rejected: int | None
    ignored: int | None
    doubted: int | None
    late: int | None
    undelivered: int | None
    used: int | None
    at_most: int

CheckName = Literal[
    "bound",
    "certificate",
    "difference",
    "speed_error",
    "position_error",
    "slip_error",
    "adhesion_force_error",
    "off",
    "on",
    "signal",
    "telegrams",
    "warnings",
]
