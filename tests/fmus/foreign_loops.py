"""The loop of train, odometer, driver, reader and observer in masters that know nothing of this package, and a fine
solution.

`container` is the FMU container of fmu-manipulation-toolbox, itself an FMU; `libcosim` the master of the Open
Simulation Platform, `program` the one in C beside the tests. All step FMI 2.0 with events by counts, and know nothing
of events.
"""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.sax.saxutils import quoteattr

import numpy as np
from balise_loop import PLANT_PRESET, TRAIN
from c_hosts import Unpacked, Wiring, compile_host, run
from fmpy import read_model_description, simulate_fmu

from fmu_observer import OBSERVERS
from fmus import cached_fmu, recipe
from plant_models import Locomotive
from plant_models.hybrid import HybridSystem, Runtime, scalar_names

STEP, STEPS = 0.01, 4000
SPACING = 5.0

MODELS: dict[str, tuple[str, str | None, dict[str, float]]] = {
    "train": ("locomotive", PLANT_PRESET, {}),
    "odometer": ("odometer", None, {}),
    "reader": ("balise_reader", None, {"first_balise": SPACING, "balise_spacing": SPACING}),
    "observer": ("takagi_sugeno_cdo", None, TRAIN),
    "driver": ("driver", None, {}),  # last: train and observer are given the same effort, that of the start of the step
}
LINKS = (
    ("driver.effort", "train.effort"),
    ("driver.effort", "observer.effort"),
    ("train.wheel_speed", "odometer.wheel_speed"),
    ("odometer.reading", "driver.odometer"),
    ("odometer.reading", "observer.odometer"),
    ("train.position", "reader.position"),
    ("train.speed", "reader.speed"),
    ("reader.balise_count", "observer.balise_count"),
    ("reader.balise_time", "observer.balise_time"),
    ("reader.balise_position", "observer.balise_position"),
)
RECORDED = (
    "train.position",
    "train.speed",
    "driver.effort",
    "odometer.reading",
    "reader.balise_count",
    "reader.balise_time",
    "reader.balise_position",
    "reader.lost_count",
    "observer.position",
    "observer.speed",
    "observer.adhesion_force",
)


def starts(input_instant: int) -> Iterator[tuple[str, str, float]]:
    """Component, parameter, value."""
    for name, (_, _, values) in MODELS.items():
        for parameter, value in (
            values | ({"input_instant": float(input_instant)} if name == "reader" else {})
        ).items():
            yield name, parameter, value


def fmus_in(folder: Path) -> dict[str, Path]:
    """The FMUs of the loop under the names of its components."""
    return {
        name: Path(shutil.copy(cached_fmu(recipe(model), 2, preset), folder / f"{name}.fmu"))
        for name, (model, preset, _) in MODELS.items()
    }


def empty_table(rows: int) -> np.ndarray:
    return np.zeros(rows, dtype=[(name, float) for name in ("time", *RECORDED)])


def container(folder: Path, sequential: bool, input_instant: int) -> np.ndarray:
    """The loop as one container FMU, run by fmpy; components in the order listed when sequential, else in parallel."""
    from fmu_manipulation_toolbox.container import FMUContainer

    fmus_in(folder)
    made = FMUContainer("loop", folder, fmi_version=2)
    for name in MODELS:
        made.get_fmu(f"{name}.fmu")
    for source, target in LINKS:
        made.add_link(*_file_and_port(source), *_file_and_port(target))
    for name in RECORDED:
        made.add_output(*_file_and_port(name), f"out_{name.replace('.', '_')}")  # a link already has the plain name
    for name, parameter, value in starts(input_instant):
        made.add_start_value(f"{name}.fmu", parameter, repr(value))
    made.make_fmu("loop.fmu", step_size=STEP, sequential=sequential)
    result = simulate_fmu(
        str(folder / "loop.fmu"),
        stop_time=STEPS * STEP,
        step_size=STEP,
        output_interval=STEP,
        output=[f"out_{name.replace('.', '_')}" for name in RECORDED],
    )
    table = empty_table(len(result))
    table["time"] = np.arange(len(result)) * STEP
    for name in RECORDED:
        table[name] = result[f"out_{name.replace('.', '_')}"]
    return table


def _file_and_port(variable: str) -> tuple[str, str]:
    name, port = variable.split(".")
    return f"{name}.fmu", port


def libcosim(folder: Path, input_instant: int) -> np.ndarray:
    """The loop in libcosim's fixed-step algorithm: all components step at once, then outputs are handed on (Jacobi).

    The system goes in as a file: `connect_integer_variables` of libcosimpy 0.0.6 fails with an AttributeError.
    """
    from libcosimpy.CosimExecution import CosimExecution
    from libcosimpy.CosimLogging import CosimLogLevel, log_output_level
    from libcosimpy.CosimObserver import CosimObserver

    files = fmus_in(folder)
    log_output_level(CosimLogLevel.FATAL)
    (folder / "OspSystemStructure.xml").write_text(_system_structure(input_instant), encoding="utf-8")
    execution = CosimExecution.from_osp_config_file(str(folder))
    observer = CosimObserver.create_last_value()
    execution.add_observer(observer)
    places = {name: _place(execution, files, name) for name in RECORDED}
    table = empty_table(STEPS + 1)
    for k in range(1, STEPS + 1):
        assert execution.step(1)
        table["time"][k] = k * STEP
        for name, (slave, reference, integer) in places.items():
            read = observer.last_integer_values if integer else observer.last_real_values
            (table[name][k],) = read(slave, [reference])
    return table


def _place(execution: Any, files: dict[str, Path], variable: str) -> tuple[int, int, bool]:
    name, port = variable.split(".")
    description = read_model_description(str(files[name]), validate=False)
    found = next(v for v in description.modelVariables if v.name == port)
    return execution.slave_index_from_instance_name(name), int(found.valueReference), found.type == "Integer"


def _system_structure(input_instant: int) -> str:
    values: dict[str, list[str]] = {name: [] for name in MODELS}
    for name, parameter, value in starts(input_instant):
        values[name].append(f'<InitialValue variable={quoteattr(parameter)}><Real value="{value!r}"/></InitialValue>')
    lines = ['<OspSystemStructure xmlns="http://opensimulationplatform.com/MSMI/OSPSystemStructure" version="0.1">']
    lines += ["<StartTime>0.0</StartTime>", f"<BaseStepSize>{STEP}</BaseStepSize>", "<Algorithm>fixedStep</Algorithm>"]
    lines += ["<Simulators>"]
    for name, stated in values.items():
        initial = f"<InitialValues>{''.join(stated)}</InitialValues>" if stated else ""
        lines += [f'<Simulator name="{name}" source="{name}.fmu" stepSize="{STEP}">{initial}</Simulator>']
    lines += ["</Simulators>", "<Connections>"]
    for link in LINKS:
        ends = "".join('<Variable simulator="{}" name="{}"/>'.format(*end.split(".")) for end in link)
        lines += [f"<VariableConnection>{ends}</VariableConnection>"]
    return "\n".join([*lines, "</Connections>", "</OspSystemStructure>", ""])


def program(folder: Path, input_instant: int) -> np.ndarray:
    """The loop in the program in C of the folder ``hosts``, which steps the components in the order listed."""
    wiring = Wiring()
    for name, file in fmus_in(folder).items():
        values = {parameter: value for owner, parameter, value in starts(input_instant) if owner == name}
        wiring.slave(name, Unpacked.of(file, folder / name), **values)
    wiring.connect(*(f"{source} -> {target}" for source, target in LINKS)).record(*RECORDED)
    file, result = wiring.write(folder / "loop.txt", 0.0, STEP, STEPS), folder / "loop.csv"
    run([str(compile_host("loop", folder)), str(file), str(result)])
    return wiring.read(result)


# -- the masters ----------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Master:
    """A master that knows nothing of this package.

    Args:
        package: what it needs. lag: whether its inputs are a step old: 0 in sequence, 1 in parallel.
    """

    package: str
    lag: int


MASTERS = {
    "container-sequential": Master("fmu_manipulation_toolbox", 0),
    "container-parallel": Master("fmu_manipulation_toolbox", 1),
    "libcosim-parallel": Master("libcosimpy", 1),
    "program-sequential": Master("fmpy", 0),
}


def run_master(name: str, input_instant: int, folder: Path) -> np.ndarray:
    """The loop in one of `MASTERS`."""
    tool, _, order = name.partition("-")
    if tool == "container":
        return container(folder, order == "sequential", input_instant)
    return {"libcosim": libcosim, "program": program}[tool](folder, input_instant)


@dataclass(frozen=True)
class Accuracy:
    """Largest errors of a run: of stamps [s], and of observed position [m] and speed [m/s] at the rows it has been told
    at.
    """

    stamps: float
    position: float
    speed: float


def accuracy(table: np.ndarray, lag: int) -> Accuracy:
    """Stamps against the plant's own crossings, the observer against one that is told at these instants."""
    instants, _ = fine_crossings(table)
    exact, reported = exact_observer(table, instants, lag), in_time(table, instants, lag)
    errors = {name: np.abs(table[f"observer.{name}"] - exact[name])[reported].max() for name in ("position", "speed")}
    return Accuracy(
        float(np.abs(Crossings.of(table).stamps - instants).max()), float(errors["position"]), float(errors["speed"])
    )


# -- the fine solution ----------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Crossings:
    """What the reader announced: row of the announcement, stamp [s], place [m]."""

    rows: np.ndarray
    stamps: np.ndarray
    places: np.ndarray

    @classmethod
    def of(cls, table: np.ndarray) -> Crossings:
        """The crossings in a result."""
        rows = np.flatnonzero(np.diff(table["reader.balise_count"]) > 0) + 1
        return cls(rows, table["reader.balise_time"][rows], table["reader.balise_position"][rows])


def _runtime(system: HybridSystem, preset: str | None = None, **values: float) -> Runtime:
    runtime = Runtime(system)
    runtime.p[:] = system.start_parameters(preset)
    runtime.x[:] = system.start_state(preset)
    names = scalar_names(system.parameter_signals)
    for name, value in values.items():
        runtime.p[names.index(name)] = value
    return runtime


def fine_crossings(table: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The plant alone, driven by the recorded effort, halved down to its crossings: instants [s], positions at the rows
    [m].
    """
    plant = _runtime(Locomotive(), PLANT_PRESET)
    plant.u[:] = table["driver.effort"][0]
    plant.start(0.0)
    instants, positions, next_place = [], [0.0], SPACING
    for k in range(len(table) - 1):
        plant.u[:] = table["driver.effort"][k]
        before = plant.snapshot()
        plant.advance((k + 1) * STEP)
        positions.append(float(plant.x[0]))
        if plant.x[0] >= next_place:
            after = plant.snapshot()
            instants.append(_halved(plant, before, k * STEP, (k + 1) * STEP, next_place))
            plant.restore(after)
            next_place += SPACING
    return np.array(instants), np.array(positions)


def _halved(plant: Runtime, before: Any, low: float, high: float, place: float) -> float:
    start = low
    while low < (middle := 0.5 * (low + high)) < high:
        plant.restore(before)
        if middle - start > 1e-12:  # closer than this is on the point itself
            plant.advance(middle)
        low, high = (low, middle) if plant.x[0] >= place else (middle, high)
    return high


def exact_observer(table: np.ndarray, instants: np.ndarray, lag: int) -> dict[str, np.ndarray]:
    """The observer told of each crossing at its own instant, with the recorded inputs: the effort of the start of each
    step, which the train was given too, and the odometer of its end, or, with a `lag` of 1, of its start. Position [m]
    and speed [m/s]."""
    system = OBSERVERS["takagi_sugeno_cdo"]()
    observer = _runtime(system, None, **TRAIN)
    names = scalar_names(system.input_signals)
    effort, odometer, place = (names.index(name) for name in ("effort", "odometer", "balise_position"))
    columns = [scalar_names(system.outputs).index(name) for name in ("position", "speed")]
    rows, reported = np.zeros((len(table), 2)), 0
    observer.start(0.0)
    rows[0] = observer.update_outputs()[columns]
    for k in range(len(table) - 1):
        row = k + 1 - lag
        observer.u[[effort, odometer]] = table["driver.effort"][k], table["odometer.reading"][row]
        while reported < len(instants) and instants[reported] <= (k + 1) * STEP:
            observer.advance(float(instants[reported]))
            observer.u[place] = SPACING * (reported + 1)
            observer.trigger("balise")
            reported += 1
        observer.advance((k + 1) * STEP)
        rows[k + 1] = observer.update_outputs()[columns]
    return {"position": rows[:, 0], "speed": rows[:, 1]}


def in_time(table: np.ndarray, instants: np.ndarray, lag: int) -> np.ndarray:
    """Rows at which the observer has been told of every crossing so far: all but those between a crossing and its
    telegram, and the first, which not every master records."""
    crossings = Crossings.of(table)
    known = np.ones(len(table), dtype=bool)
    known[0] = False
    for row, instant in zip(crossings.rows, instants, strict=True):
        known[int(np.ceil(instant / STEP - 1e-9)) : row + lag] = False
    return known
