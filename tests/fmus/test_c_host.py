"""The whole loop in a plain C program that knows nothing but the functions of FMI, against this package's own
master.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from balise_loop import TRAIN, balise_loop
from c_hosts import Unpacked, Wiring, compile_host, run

import cosim
from fmu_observer.event_protocol import EventProtocol
from fmus import build_fmu, cached_fmu, recipe

pytestmark = pytest.mark.compiler

STOP, STEP = 60.0, 0.01
FACES = {"fmi2": (2, "counts"), "fmi3-clocks": (3, "clocks"), "fmi3-counts": (3, "counts")}
OBSERVED = ("observer.position", "observer.speed", "observer.adhesion_force", "observer.innovation")


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("c_host")


@pytest.fixture(scope="module")
def loop(place: Path) -> Path:
    """The host program."""
    return compile_host("loop", place)


@pytest.fixture(scope="module")
def model(place: Path, own_cache: Path) -> Callable[..., Unpacked]:  # noqa: ARG001 - the cache of the session
    """``model(name, version, announcement, preset)`` -> the FMU, unpacked."""
    made: dict[tuple[Any, ...], Unpacked] = {}

    def make(name: str, version: int, announcement: str = "clocks", preset: str | None = None) -> Unpacked:
        key = (name, version, announcement if version == 3 else "counts", preset)
        if key not in made:
            folder = place / f"{len(made)}_{name}"
            fmu = _counting(name, folder) if key[1:3] == (3, "counts") and name not in PLAIN else None
            made[key] = Unpacked.of(fmu or cached_fmu(recipe(name), version, preset), folder)  # type: ignore[arg-type]
        return made[key]

    return make


PLAIN = {"locomotive", "odometer", "driver", "balise_reader"}  # have no triggered events, so nothing to announce


def _counting(name: str, folder: Path) -> Path:
    """An FMI 3 FMU that is told of events by counts."""
    return build_fmu(recipe(name), folder.with_suffix(".fmu"), 3, protocol=EventProtocol("counts"))


def with_driver(w: Wiring, model: Callable[..., Unpacked], version: int) -> Wiring:
    """The driver comes last: train and observers are given the same effort, that of the start of the step."""
    w.slave("driver", model("driver", version))
    return w.connect("driver.effort -> train.effort", "odometer.reading -> driver.odometer")


def wire(
    model: Callable[..., Unpacked],
    interface: str,
    observers: dict[str, tuple[str, dict[str, float]]],
    driver: bool = True,
) -> Wiring:
    """Train, odometer, reader, observers by name (model and parameters) and driver."""
    version, announcement = FACES[interface]
    w = Wiring()
    w.slave("train", model("locomotive", version, preset="chapter_3_four_axles"))
    w.slave("odometer", model("odometer", version))
    w.slave("reader", model("balise_reader", version), first_balise=5.0, balise_spacing=5.0)
    for name, (kind, values) in observers.items():
        w.slave(name, model(kind, version, announcement), version == 3 and announcement == "clocks", **values)
    if driver:
        with_driver(w, model, version)
    w.connect(
        "train.wheel_speed -> odometer.wheel_speed", "train.position -> reader.position", "train.speed -> reader.speed"
    )
    for name in observers:
        w.connect(f"driver.effort -> {name}.effort", f"odometer.reading -> {name}.odometer")
        payload = {f"{name}.balise_{x}": f"reader.balise_{x}" for x in ("time", "position")}
        if announcement == "clocks":
            w.event("reader.balise_count", f"{name}.balise", payload)
        else:
            w.connect(*(f"{source} -> {target}" for target, source in payload.items()))
            w.connect(f"reader.balise_count -> {name}.balise_count")
    w.record("train.position", "train.speed", "reader.balise_count", "reader.balise_time", "reader.balise_position")
    w.record("reader.lost_count")
    return w.record(
        *(f"{name}.{x}" for name in observers for x in ("position", "speed", "adhesion_force", "innovation"))
    )


S2 = {"observer": ("takagi_sugeno_cdo", TRAIN)}


def carried_out(
    loop: Path, wiring: Wiring, folder: Path, name: str = "run", steps: int = int(STOP / STEP)
) -> np.ndarray:
    file = wiring.write(folder / f"{name}.txt", 0.0, STEP, steps)
    run([str(loop), str(file), str(folder / f"{name}.csv")])
    return wiring.read(folder / f"{name}.csv")


@pytest.fixture(scope="module")
def master() -> Callable[[str], cosim.Outcome]:
    """The same loop in the package's own master, by the method that localises the balises."""
    outcomes: dict[str, cosim.Outcome] = {}

    def ran(method: str) -> cosim.Outcome:
        if method not in outcomes:
            outcomes[method] = balise_loop(STOP, STEP, 5.0, method).run()
            assert outcomes[method].failure is None
        return outcomes[method]

    return ran


def announced(table: np.ndarray) -> np.ndarray:
    """Rows in which the reader announced a balise."""
    return np.flatnonzero(np.diff(table["reader.balise_count"]) > 0) + 1


def at_points(outcome: cosim.Outcome, name: str, times: np.ndarray) -> np.ndarray:
    """Values of the master's run at the communication points, after the events there."""
    rows = np.searchsorted(np.asarray(outcome["time"]), times + 1e-6) - 1
    return np.asarray(outcome[name])[rows]


@pytest.mark.parametrize("interface", FACES)
def test_the_loop_in_c_is_the_loop_of_the_master(
    interface: str, loop: Path, model: Callable[..., Unpacked], master: Callable[[str], cosim.Outcome], tmp_path: Path
) -> None:
    table = carried_out(loop, wire(model, interface, S2), tmp_path)
    rows = announced(table)
    assert len(rows) > 130
    assert table["reader.lost_count"].max() == 0.0
    equal, exact = master("interpolate"), master("rollback")
    for outcome in (equal, exact):
        np.testing.assert_array_equal(table["train.position"], at_points(outcome, "train.position", table["time"]))
        np.testing.assert_array_equal(
            table["reader.balise_position"][rows], [e.position for e in outcome.result.events]
        )

    # The same cubic, solved twice: two roundings of a time of 60 s (7e-15) are all that can differ, and what they do to
    # the observer, which corrects its speed by about 20 1/s of the position that the train ran in between.
    stamps = table["reader.balise_time"][rows]
    np.testing.assert_allclose(stamps, [e.stamp for e in equal.result.events], rtol=0.0, atol=1e-13)
    for name in OBSERVED:
        np.testing.assert_allclose(table[name], at_points(equal, name, table["time"]), rtol=1e-12, atol=1e-11)

    # Against the plant's own crossing by root search on re-done steps what differs is the cubic: h^4/384 times the
    # fourth derivative of the position over the speed. The jerk of this train changes by its own size within some 50 ms
    # (the driver's corrections of each odometer reading): 3e-10 s was measured, and 20 1/s * 14 m/s times that in the
    # observer's speed.
    np.testing.assert_allclose(stamps, [e.stamp for e in exact.result.events], rtol=0.0, atol=1e-9)
    for name, atol in (("observer.position", 3e-8), ("observer.speed", 1e-7)):
        np.testing.assert_allclose(table[name], at_points(exact, name, table["time"]), rtol=0.0, atol=atol)


def test_observers_beside_each_other_are_what_each_is_alone(
    loop: Path, model: Callable[..., Unpacked], tmp_path: Path
) -> None:
    """Two instances of one FMU with other parameters, and another FMU of ours, in one process."""
    observers: dict[str, tuple[str, dict[str, float]]] = {
        "first": ("takagi_sugeno_cdo", TRAIN),
        "second": ("takagi_sugeno_cdo", {**TRAIN, "mass": 95e3}),
        "cascade": ("multirate_cdo", {}),
    }
    for interface in ("fmi2", "fmi3-clocks"):
        together = carried_out(loop, wire(model, interface, observers), tmp_path, "together", 2500)
        for name, observer in observers.items():
            alone = carried_out(loop, wire(model, interface, {name: observer}), tmp_path, name, 2500)
            for column in alone.dtype.names or ():
                np.testing.assert_array_equal(together[column], alone[column], err_msg=f"{interface} {column}")
        assert np.abs(together["first.speed"] - together["second.speed"]).max() > 1e-3


def test_a_thread_each_gives_equal_bytes(loop: Path, model: Callable[..., Unpacked], tmp_path: Path) -> None:
    interfaces = ("fmi2", "fmi3-clocks", "fmi2")
    files = [
        wire(model, interface, S2).write(tmp_path / f"{i}.txt", 0.0, STEP, 3000)
        for i, interface in enumerate(interfaces)
    ]
    arguments: list[str] = []
    for i, file in enumerate(files):
        run([str(loop), str(file), str(tmp_path / f"alone_{i}.csv")])
        arguments += [str(file), str(tmp_path / f"thread_{i}.csv")]
    run([str(loop), *arguments])
    for i in range(len(interfaces)):
        assert (tmp_path / f"thread_{i}.csv").read_bytes() == (tmp_path / f"alone_{i}.csv").read_bytes()


def test_versions_may_be_mixed(loop: Path, model: Callable[..., Unpacked], tmp_path: Path) -> None:
    """The plant as FMI 2, the observer as FMI 3 with clocks: the same numbers, which are those of the one runtime."""
    pure = carried_out(loop, wire(model, "fmi2", S2), tmp_path, "pure", 2500)
    mixed = wire(model, "fmi2", {}, driver=False)
    mixed.slave("observer", model("takagi_sugeno_cdo", 3), True, **TRAIN)
    with_driver(mixed, model, 2).connect("driver.effort -> observer.effort", "odometer.reading -> observer.odometer")
    payload = {f"observer.balise_{x}": f"reader.balise_{x}" for x in ("time", "position")}
    mixed.event("reader.balise_count", "observer.balise", payload).record(*OBSERVED)
    table = carried_out(loop, mixed, tmp_path, "mixed", 2500)
    for name in OBSERVED:
        np.testing.assert_array_equal(table[name], pure[name])
