"""FMUs that demand what the standard allows them to demand: steps of one length to the last bit, and no get between a
set and the next step.
"""

from __future__ import annotations

import re
import zipfile
from functools import partial
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pytest
from coupled_runs import prepare
from hypothesis import example, given
from hypothesis import strategies as st
from mock_slaves import Mock, component
from test_fmus.build import linear_fmu
from test_fmus.events import awkward_fmu

from cosim.compiled.choice import choose_stepper
from cosim.components.loading import load_fmu
from cosim.components.recording import RecordingComponent
from cosim.components.recording_data import Recording
from cosim.errors import RunError
from cosim.master.axis import TimeAxis
from cosim.master.control.multirate import set_rates
from cosim.master.interpolation.attach import attach_interpolators
from cosim.master.master import close
from cosim.results.result import SignalInfo

pytestmark = pytest.mark.compiler
STEPPERS = ("python", "compiled")
KINDS = ("mute", "declared", "direct")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """FMUs ``exact1`` to ``exact3``; and of each kind a ``strict_``, a ``closed_`` and a ``lenient_`` one with
    ``x' = u - x`` and ``y = x + d u``: ``mute`` about its dependencies, ``direct`` with d = 0.5, which it declares.
    """
    place = tmp_path_factory.mktemp("strict")
    for version in (1, 2, 3):
        awkward_fmu(place, "exact-steps", f"exact{version}", version=version)  # type: ignore[arg-type]
    for kind in KINDS:
        for manner in ("strict", "closed", "lenient"):
            d = 0.5 if kind == "direct" else 0.0
            name, how = f"{manner}_{kind}", {"strict": manner == "strict", "closed": manner == "closed"}
            declares = kind != "mute"
            linear_fmu(
                place, name, -1, 1, 1, d, version=2, declare_dependencies=declares, inputs=["u"],
                outputs=["y"], x0=[0.5], **how,
            )  # fmt: skip
    return place


def rows_of(
    parts: list[Any], pairs: list[tuple[str, str]], h: float, count: int, stepper: str, **how: Any
) -> np.ndarray:
    """All rows of a run; `how` as for `prepare`, rates too."""
    every, substeps = how.pop("every", {}), how.pop("substeps", {})
    master = prepare(parts, pairs, h, count, stepper=partial(choose_stepper, stepper), **how)
    attach_interpolators(master.plan, "hold")
    set_rates(master.plan, master.axis, every, substeps, {})
    try:
        master.run()
    finally:
        close(master.plan)
    return master.recorder.table()


@given(
    step=st.floats(1e-5, 10.0),
    start=st.sampled_from([0.0, 1e4, -3.0]) | st.floats(-1e5, 1e5),
    count=st.integers(1, 12),
    rate=st.sampled_from([(1, 1), (1, 1), (3, 1), (1, 3)]),
    version=st.integers(1, 3),
)
def test_every_step_is_a_whole_multiple_of_the_step_to_the_last_bit(
    folder: Path, step: float, start: float, count: int, rate: tuple[int, int], version: int
) -> None:
    """At stored times that are those of the axis, and the same numbers by both steppers."""
    tables = []
    for stepper in STEPPERS if rate == (1, 1) else STEPPERS[:1]:
        fmu = load_fmu(folder / f"exact{version}.fmu", "fmu")
        every, substeps = rate
        how: dict[str, Any] = {"every": {"fmu": every}, "substeps": {"fmu": substeps}}
        own = {"fmu": {"u": step / substeps}}
        tables.append(rows_of([fmu], [], step, count, stepper, start=start, starts=own, **how))
    assert tables[0]["time"].tolist() == [start + k * step for k in range(count + 1)]
    assert all(table.tobytes() == tables[0].tobytes() for table in tables)


@given(
    kinds=st.lists(st.sampled_from(KINDS), min_size=1, max_size=3),
    sources=st.lists(st.integers(0, 3), min_size=3, max_size=3),
    order=st.permutations(range(3)),
)
def test_a_strict_fmu_runs_in_every_coupling_with_the_numbers_of_a_lenient_one(
    folder: Path, kinds: list[str], sources: list[int], order: list[int]
) -> None:
    """Inputs from each other, from itself, from a table, or from nowhere, by both steppers."""
    names = [f"part{i}" for i in range(len(kinds))]
    tables = []
    manners = ("strict", "closed")
    for manner, stepper in [("lenient", "python"), *((m, s) for m in manners for s in STEPPERS)]:
        parts: list[Any] = [load_fmu(folder / f"{manner}_{k}.fmu", n) for k, n in zip(kinds, names, strict=True)]
        pairs = []
        for name, source in zip(names, sources, strict=False):
            if source < len(names):
                pairs.append((f"{names[source]}.y", f"{name}.u"))
            elif source == 3:
                pairs.append(("table.w", f"{name}.u"))
        if any(source == "table.w" for source, _ in pairs):
            parts.append(table_of_a_wave())
        shuffled = [parts[i] for i in order if i < len(parts)] + parts[3:]
        tables.append(rows_of(shuffled, pairs, 0.1, 5, stepper))
    lenient, *strict = tables
    for table in strict:
        for name in lenient.dtype.names:
            assert table[name].tobytes() == lenient[name].tobytes()


def table_of_a_wave() -> RecordingComponent:
    time = np.linspace(0.0, 1.0, 21)
    wave, line = np.sin(3.0 * time)[:, np.newaxis], np.zeros(1, dtype=bool)
    recorded = Recording("a wave", time, (SignalInfo("w"),), wave, line, np.zeros(0), lines=frozenset({"w"}))
    return RecordingComponent("table", recorded)


def acting_on_its_derivative(fmu: Path, name: str) -> Path:
    """The same FMU, which declares that its input acts on a derivative."""
    described, place = "modelDescription.xml", fmu.with_name(f"{name}.fmu")
    with zipfile.ZipFile(fmu) as source, zipfile.ZipFile(place, "w") as target:
        for entry in source.namelist():
            text = source.read(entry)
            if entry == described:
                names = re.findall(r'<ScalarVariable name="([^"]+)"', text.decode())
                u, x = names.index("u") + 1, names.index("x[1]") + 1
                derivatives = f'<Derivatives><Unknown index="{x}" dependencies="{u}"/></Derivatives>'
                text = text.replace(b"</Outputs>", f"</Outputs>{derivatives}".encode())
            target.writestr(entry, text)
    return place


@pytest.mark.parametrize("stepper", STEPPERS)
def test_a_strict_fmu_gets_the_mean_of_a_line_and_is_not_read_after_the_value_at_its_end(
    folder: Path, stepper: str
) -> None:
    """The state is that of a lenient one; the output that shows the input shows its mean, which is said."""
    tables, said = {}, {}
    for manner in ("lenient", "strict"):
        path = acting_on_its_derivative(folder / f"{manner}_direct.fmu", f"{manner}_acting")
        fmu = load_fmu(path, "fmu")
        pairs = [("table.w", "fmu.u")]
        tables[manner] = rows_of([table_of_a_wave(), fmu], pairs, 0.1, 5, stepper, extra={"fmu": ["x[1]"]})
        said[manner] = fmu.messages.reason if fmu.messages else ""
    strict, lenient = tables["strict"], tables["lenient"]
    assert strict["fmu.x[1]"].tolist() == lenient["fmu.x[1]"].tolist()
    w = table_of_a_wave().recording
    means = [w.mean(0.1 * k, 0.1 * (k + 1))[0] for k in range(5)]
    np.testing.assert_allclose(strict["fmu.y"][1:] - strict["fmu.x[1]"][1:], 0.5 * np.array(means), rtol=1e-12)
    np.testing.assert_allclose(lenient["fmu.y"] - lenient["fmu.x[1]"], 0.5 * lenient["table.w"], rtol=1e-12, atol=1e-15)
    assert "refuses to be read between a set and its next step" in said["strict"]
    assert said["lenient"] == ""


class Late(Mock):
    """Its output becomes 1 as initialisation ends."""

    outputs: ClassVar[dict[str, Any]] = {"y": 0.0}

    def exitInitializationMode(self) -> None:
        self.x = {"x": 1.0}

    def compute(self) -> None:
        self.v["y"] = self.x.get("x", 0.0)


class Shown(Mock):
    """``y = u + p``, and refuses to be read between a set and the next step where `refuses`."""

    inputs: ClassVar[dict[str, Any]] = {"u": 0.0}
    outputs: ClassVar[dict[str, Any]] = {"y": 0.0}
    parameters: ClassVar[dict[str, Any]] = {"p": 3.0}
    feedthrough: ClassVar[dict[str, list[str]]] = {"y": ["u"]}
    memory = ("v", "x", "time", "mode")
    refuses, resets = True, True

    def begin(self) -> None:
        self.x, self.mode = {}, "before"

    def exitInitializationMode(self) -> None:
        self.mode = "read"

    def compute(self) -> None:
        if self.mode == "lost" or (self.mode == "set" and self.refuses):
            self.mode = "lost"
            raise RuntimeError("get after set")
        self.v["y"] = self.v["u"] + self.v["p"]

    def _set(self, *arguments: Any) -> None:
        if self.mode == "lost":
            raise RuntimeError("lost")
        super()._set(*arguments)
        self.mode = "set" if self.mode == "read" else self.mode

    setFloat64 = _set

    def reset(self) -> None:
        if not self.resets:
            raise RuntimeError("no reset")
        super().reset()

    def move(self, t: float, h: float) -> None:
        assert self.mode != "lost"
        self.mode = "read"


def ran_behind_a_jump(kind: type[Shown]) -> np.ndarray:
    parts = [component(kind(), "shown"), component(Late(), "late")]
    return rows_of(
        parts, [("late.y", "shown.u")], 0.1, 3, "python", order=["shown", "late"], starts={"shown": {"p": 5.0}}
    )


def test_one_that_refuses_to_be_read_after_a_jump_at_the_start_is_initialised_again_with_it() -> None:
    """With its start values, and the numbers of one that may be read."""

    class Lenient(Shown):
        refuses = False

    strict, lenient = ran_behind_a_jump(Shown), ran_behind_a_jump(Lenient)
    assert strict.tobytes() == lenient.tobytes()
    assert strict["shown.y"].tolist() == [6.0] * 4


def test_one_that_cannot_be_initialised_again_fails_with_its_own_words() -> None:
    class Final(Shown):
        resets = False

    with pytest.raises(RunError, match="reading y failed: get after set"):
        ran_behind_a_jump(Final)


class _EndsInTime(Mock):
    """Refuses a step that leads behind the end that was announced, by its own step of 1e-7 s and its own rounding."""

    outputs: ClassVar[dict[str, Any]] = {"y": 0.0}
    end = 0.0

    def enterInitializationMode(self, startTime: float | None = None, stopTime: float | None = None) -> None:
        self.end = stopTime or 0.0
        super().enterInitializationMode(startTime, stopTime)

    def move(self, t: float, h: float) -> None:
        assert t + 1e-7 <= self.end


@given(step=st.floats(1e-7, 10.0), start=st.sampled_from([0.0, 1e4]) | st.floats(-1e5, 1e5), count=st.integers(1, 400))
@example(step=1e-7, start=0.0, count=100)
def test_no_step_leads_behind_the_end_that_was_announced(step: float, start: float, count: int) -> None:
    axis = TimeAxis(start, step, count)
    last, end = axis[count - 1], axis.announced_stop
    assert max(last + step, axis.stop) == end
    assert end - axis.stop <= 2.0 * np.spacing(max(abs(start), abs(end)))


def test_an_fmu_that_refuses_steps_behind_the_end_comes_to_it() -> None:
    rows = rows_of([component(_EndsInTime(), "m")], [], 1e-7, 100, "python")
    assert len(rows) == 101
