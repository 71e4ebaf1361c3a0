"""The changes of the mutation study, one at a time: of parameters, of conditions, of the FMU, and of rows."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import deliveries
import numpy as np
from manoeuvre import BALISES, INSTANTS, LOCOMOTIVE, PARAMETERS, STEP, Conditions

from cosim import Result
from cosim.results.load_result import load_result
from plant_models.hybrid import HybridSystem

Make = Callable[[Result, str], Result]
"""From the unchanged result, and how new deliveries are realised (``fmu`` or ``block``), to the changed result."""


@dataclass(frozen=True)
class Mutation:
    """One change.

    Args:
        group: what kind of change. change: in a few words. make: does it. why: it is not caught by default, where it is
        not.
        harmless: whether it should pass.
    """

    group: str
    change: str
    make: Make
    why: str = ""
    harmless: bool = False


# -- parameters and conditions --------------------------------------------------------------------------------------

UNREACHED = "the run ends before"
SMALL = "moves no signal by more than its tolerance"
WITHOUT_INFLUENCE: Mapping[str, str] = {
    "slip_floor": "only below 0.5 m/s, and the train is never so slow",
    "zone_from[3]": UNREACHED,
    "zone_to[3]": UNREACHED,
    "gradient[4]": UNREACHED,
    "gradient_position[4]": UNREACHED,
    "gradient_position[1]": "it is 0, and so is every share of it",
}


def parameter_mutations(share: float) -> Iterator[Mutation]:
    """Every number among the parameters of the locomotive, larger by a share; smaller where it is as large as it may
    be.
    """
    for signal in LOCOMOTIVE.parameters:
        stated = PARAMETERS.get(signal.name, signal.start)
        values = np.atleast_1d(np.asarray(stated, dtype=float))
        for k in range(values.size):
            name = signal.name if signal.size is None else f"{signal.name}[{k + 1}]"
            at_most = signal.max is not None and values[k] * (1.0 + share) > signal.max
            factor = 1.0 - share if at_most else 1.0 + share
            value = (values * np.where(np.arange(values.size) == k, factor, 1.0)).tolist()
            changed = {signal.name: value[0] if signal.size is None else value}
            group, reported = f"parameters, {100.0 * share:g} %", f"`{name}` {100.0 * (factor - 1.0):+g} %"
            yield Mutation(group, reported, _under(parameters=changed), WITHOUT_INFLUENCE.get(name, SMALL))


def condition_mutations() -> Iterator[Mutation]:
    """Other starts, and events at other instants or places."""
    group = "conditions and events"
    late = [*INSTANTS[:2], INSTANTS[2] + STEP, *INSTANTS[3:]]
    yield Mutation(group, "initial speed +1 %", _under(parameters={"train_speed": 1.01 * PARAMETERS["train_speed"]}))
    yield Mutation(
        group, "initial speed of the wheel +1 %", _under(parameters={"wheel_rate": 1.01 * PARAMETERS["wheel_rate"]})
    )
    yield Mutation(group, "one step of the effort one sample late", _under(instants=late))
    for end in ("zone_from", "zone_to"):
        moved = [PARAMETERS[end][0] + STEP, *PARAMETERS[end][1:]]
        where = "begin" if end == "zone_from" else "end"
        yield Mutation(group, f"{where} of the low-adhesion zone one sample late", _under(parameters={end: moved}))
    for metres in (1.0, 0.01):
        moved = [BALISES[0], BALISES[1] + metres, *BALISES[2:]]
        yield Mutation(group, f"a balise {metres:g} m farther", _under(balises=moved))
    yield Mutation(group, "telegrams delivered one sample late", _under(telegrams={"latency": STEP}))
    yield Mutation(group, "one balise missed", _under(telegrams={"missed": ["B2"]}))
    false = {"false_telegrams": [{"time": 5.0, "offset": 10.0}]}
    yield Mutation(group, "one false telegram", _under(telegrams=false))


def _under(**conditions: Any) -> Make:
    return lambda _reference, _backend: Conditions(**conditions).run()


# -- new deliveries -------------------------------------------------------------------------------------------------


def delivery_mutations() -> Iterator[Mutation]:
    """FMUs built anew with one thing changed."""
    group = "new delivery"
    yield Mutation(group, "default of mass +1 %", _delivery(deliveries.OtherDefault))
    yield Mutation(group, "sign of an output", _delivery(deliveries.SignOfOutput))
    yield Mutation(group, "sign of the input", _delivery(deliveries.SignOfInput))
    yield Mutation(group, "unit km/h declared, numbers in m/s", _delivery(deliveries.WrongUnit))
    yield Mutation(group, "unit m/s declared, numbers in km/h", _delivery(deliveries.WrongNumbers))
    yield Mutation(group, "unit m/s dropped", _delivery(deliveries.NoUnit))
    yield Mutation(group, "output renamed", _delivery(deliveries.Renamed))
    yield Mutation(group, "output dropped", _delivery(deliveries.Dropped))
    yield Mutation(group, "two outputs swapped", _delivery(deliveries.Swapped))
    yield Mutation(group, "output added", _delivery(deliveries.Added), harmless=True)
    yield Mutation(group, "unit km/h declared, numbers in km/h", _delivery(deliveries.OtherUnit), harmless=True)
    yield Mutation(group, "half the internal step", _delivery(deliveries.HalfStep))
    yield Mutation(group, "twice the internal step", _delivery(deliveries.DoubleStep))


def _delivery(kind: type[HybridSystem]) -> Make:
    return lambda _reference, backend: Conditions(train=kind(), backend=backend).run()


# -- rows -----------------------------------------------------------------------------------------------------------

SIGNAL = "train.speed"
MIDDLE = 600  # a row on the way
ON_A_LINE = "the straight line over the gap is within, and no jump is near"
SEED = 6


def row_mutations() -> Iterator[Mutation]:
    """What a logger, a file or a converter does to rows."""
    group = "rows"
    yield Mutation(group, "last row dropped", _rows(lambda t: t[:-1]))
    yield Mutation(group, "first row dropped", _rows(lambda t: t[1:]))
    yield Mutation(group, "a row in the middle dropped", _rows(lambda t: np.delete(t, MIDDLE)), ON_A_LINE)
    yield Mutation(group, "20 rows in the middle dropped", _rows(lambda t: np.delete(t, slice(MIDDLE, MIDDLE + 20))))
    yield Mutation(group, "a row doubled", _rows(lambda t: np.insert(t, MIDDLE, t[MIDDLE])), harmless=True)
    yield Mutation(group, "rows before and after an event exchanged", _rows(_exchanged))
    yield Mutation(group, "NaN in one row", _column(_with_nan))
    yield Mutation(group, "frozen after half the run", _column(lambda v: np.where(_second_half(v), v[len(v) // 2], v)))
    yield Mutation(group, "one sample late", _column(lambda v: np.append(v[:1], v[:-1])))
    yield Mutation(group, "0/1 signal switches one sample late", _column(_late_switch, "train.adhesion_degraded"))
    for share in (1e-3, 1e-4, 1e-5, 1e-6):
        yield Mutation(group, f"noise, {share:g} of the range (rms)", _column(_noise(share)), _below(share))
    for share in (1e-3, 2e-4, 5e-5):
        yield Mutation(group, f"offset of {share:g} of the range", _column(_offset(share)), _below(share))
    for share in (1e-4, 1e-5):
        yield Mutation(group, f"gain {1.0 + share:g}", _column(lambda v, s=share: v * (1.0 + s)), _below(share))
    yield Mutation(group, "times half a sample late", _rows(_shifted(0.5 * STEP)))
    yield Mutation(group, "times 1 ms late", _rows(_shifted(1e-3)))
    yield Mutation(group, "times 1 ns late", _rows(_shifted(1e-9)), harmless=True)
    yield Mutation(group, "stamp of a telegram one sample late", _late_stamp)
    yield Mutation(group, "rounded to float32", _rows(_as_float32), harmless=True)
    yield Mutation(group, "CSV with 6 significant digits, times in full", _through_csv("%.12g"), harmless=True)
    yield Mutation(group, "CSV with 6 significant digits, times too", _through_csv("%.6g"))


def _below(share: float) -> str:
    return "below the tolerance" if share < 1e-4 else ""


def _rows(change: Callable[[np.ndarray], np.ndarray]) -> Make:
    return lambda reference, _backend: replace(reference, table=change(reference.table))


def _column(change: Callable[..., np.ndarray], name: str = SIGNAL) -> Make:
    def make(reference: Result, _backend: str) -> Result:
        table = reference.table.copy()
        table[name] = change(table[name])
        return replace(reference, table=table)

    return make


def _exchanged(table: np.ndarray) -> np.ndarray:
    row = int(np.flatnonzero((np.diff(table["time"]) == 0.0) & (np.diff(table["register.last_balise"]) != 0.0))[0])
    changed = table.copy()
    changed[[row, row + 1]] = table[[row + 1, row]]
    return changed


def _with_nan(values: np.ndarray) -> np.ndarray:
    return np.where(np.arange(len(values)) == MIDDLE, np.nan, values)


def _second_half(values: np.ndarray) -> np.ndarray:
    return np.arange(len(values)) >= len(values) // 2


def _late_switch(values: np.ndarray) -> np.ndarray:
    row = int(np.flatnonzero(np.diff(values))[0])
    return np.where(np.arange(len(values)) == row + 1, values[row], values)


def _noise(share: float) -> Callable[[np.ndarray], np.ndarray]:
    return lambda v: v + share * np.ptp(v) * np.random.default_rng(SEED).standard_normal(len(v))


def _offset(share: float) -> Callable[[np.ndarray], np.ndarray]:
    return lambda v: v + share * np.ptp(v)


def _shifted(seconds: float) -> Callable[[np.ndarray], np.ndarray]:
    def change(table: np.ndarray) -> np.ndarray:
        moved = table.copy()
        moved["time"] += seconds
        return moved

    return change


def _late_stamp(reference: Result, _backend: str) -> Result:
    first, *others = reference.events
    return replace(reference, events=[replace(first, stamp=first.stamp + STEP), *others])


def _as_float32(table: np.ndarray) -> np.ndarray:
    rounded = table.copy()
    for name in table.dtype.names or ():
        rounded[name] = table[name].astype(np.float32)
    return rounded


def _through_csv(times: str) -> Make:
    """Written as other tools do, with units in the headings, and read again; a table keeps no telegrams."""

    def make(reference: Result, _backend: str) -> Result:
        units = {info.name: info.unit for info in reference.signals}
        names = list(reference.table.dtype.names or ())
        headings = [f"{name} [{units.get(name, 's')}]" for name in names]
        with TemporaryDirectory() as folder:
            path = Path(folder) / "table.csv"
            columns = np.column_stack([reference.table[name] for name in names])
            formats = [times] + ["%.6g"] * (len(names) - 1)
            np.savetxt(path, columns, fmt=formats, delimiter=",", header=",".join(headings), comments="")
            return load_result(path)

    return make


def all_mutations() -> list[Mutation]:
    """All of them, in the order of the page."""
    return [
        *parameter_mutations(0.01),
        *parameter_mutations(0.001),
        *condition_mutations(),
        *delivery_mutations(),
        *row_mutations(),
    ]
