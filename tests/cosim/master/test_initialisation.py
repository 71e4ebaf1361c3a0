"""The exchange in Initialization Mode, against the solution of the coupled equations."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
import pytest
from coupled_runs import block, prepare, run
from mock_slaves import Counter, Mock, component
from scipy.optimize import brentq

from cosim.errors import RunError
from cosim.master.algorithms.gauss_seidel import GaussSeidel
from cosim.master.algorithms.jacobi import Jacobi
from cosim.master.exchange import ExchangeAtInstant
from cosim.master.initialisation import MAX_ROUNDS, initialise
from plant_models.hybrid import HybridSystem, PeriodicEvent
from plant_models.hybrid.signal import input_signal, memory, output_signal, parameter, state

STIFFNESS, DAMPING, MASS = 3.0, 0.5, 2.0


class Mass(HybridSystem):
    """``m x'' = force``; feeds its acceleration through."""

    name = "mass"
    states = (state("x", "m", 1.0), state("v", "m/s", 0.3))
    inputs = (input_signal("force", "N"),)
    outputs = (output_signal("position", "m"), output_signal("speed", "m/s"), output_signal("acceleration", "m/s2"))
    internal_step = 1e-3

    def flow(self, t, x, u, p):
        return {"x": x.v, "v": u.force / MASS}

    def output(self, t, x, u, p):
        return {"position": x.x, "speed": x.v, "acceleration": u.force / MASS}


class Spring(HybridSystem):
    """``force = -k x - d v``: nothing but feedthrough."""

    name = "spring"
    inputs = (input_signal("position", "m"), input_signal("speed", "m/s"))
    outputs = (output_signal("force", "N"),)

    def output(self, t, x, u, p):
        return {"force": -STIFFNESS * u.position - DAMPING * u.speed}


class Sampler(HybridSystem):
    """Samples at the start time and every 0.5 s."""

    name = "sampler"
    states = (memory("kept", "m", -7.0),)
    inputs = (input_signal("signal", "m"),)
    outputs = (output_signal("sample", "m", variability="discrete"),)
    parameters = (parameter("period", "s", 0.5),)
    events = (PeriodicEvent("tick", "period"),)

    def output(self, t, x, u, p):
        return {"sample": x.kept}

    def jump(self, event, t, x, u, p):
        return {"kept": u.signal}


PAIRS = [("spring.force", "mass.force"), ("mass.position", "spring.position"), ("mass.speed", "spring.speed")]


@pytest.mark.parametrize("listing", [("mass", "spring"), ("spring", "mass")])
@pytest.mark.parametrize("version", [2, 3])
def test_a_mass_on_a_spring_starts_with_the_right_force(listing: tuple[str, str], version: int) -> None:
    parts = {"mass": Mass(), "spring": Spring()}
    ran = run([block(parts[n], n, version) for n in listing], PAIRS, 0.01, 3)
    force = -STIFFNESS * 1.0 - DAMPING * 0.3
    assert ran["spring.force"][0] == pytest.approx(force, rel=1e-15)
    assert ran["mass.acceleration"][0] == pytest.approx(force / MASS, rel=1e-15)
    assert ran.master.exchange_rounds >= 2


def test_without_the_exchange_the_first_step_would_be_wrong() -> None:
    """The first step uses the force at the start: to first order v(h) = v(0) + h F / m, and not v(0)."""
    h = 0.01
    ran = run([block(Mass(), "mass"), block(Spring(), "spring")], PAIRS, h, 1)
    force = -STIFFNESS * 1.0 - DAMPING * 0.3
    assert ran["mass.speed"][1] == pytest.approx(0.3 + h * force / MASS, rel=1e-12)


def test_what_is_sampled_at_the_start_time_is_in_the_first_row() -> None:
    """The sample is taken when initialisation ends, after the mass, which comes first in the loop, has ended its
    own.
    """
    parts = [block(Mass(), "mass"), block(Sampler(), "sampler"), block(Spring(), "spring")]
    pairs = [("mass.position", "sampler.signal"), ("sampler.sample", "spring.position"), ("spring.force", "mass.force")]
    ran = run(parts, pairs, 0.1, 2)
    assert [s.component.name for s in ran.plan.steps] == ["mass", "sampler", "spring"]
    assert ran["sampler.sample"][0] == 1.0
    assert ran["spring.force"][0] == -STIFFNESS
    assert ran["mass.acceleration"][0] == -STIFFNESS / MASS


class Gain(Mock):
    """``y = gain u + 1``: with ``u = y`` it settles on ``1 / (1 - gain)``, by plain exchange where the gain is below
    1.
    """

    inputs: ClassVar[dict[str, Any]] = {"u": 0.0}
    outputs: ClassVar[dict[str, Any]] = {"y": 0.0, "steady": 5.0}
    parameters: ClassVar[dict[str, Any]] = {"gain": 0.5}

    def compute(self) -> None:
        self.v["y"] = self.v["gain"] * self.v["u"] + 1.0


@pytest.mark.parametrize("gain", [1e-3, 0.5, -1.0, -4.0, 7.0])
def test_a_loop_with_a_solution_settles_on_it(gain: float) -> None:
    """Undeclared feedthrough; the plain exchange alone would need 40 rounds for a gain of 1/2 and diverges from 1
    on.
    """
    ran = run([component(Gain(), "a")], [("a.y", "a.u")], 0.1, 1, starts={"a": {"gain": gain}})
    # settled within 1e-12, and once more passed on
    assert ran["a.y"][0] == pytest.approx(1.0 / (1.0 - gain), rel=1e-11)
    assert ran.master.exchange_rounds < 20


def test_what_settles_plainly_is_the_plain_exchange_bit_for_bit() -> None:
    """Few rounds, and the numbers of repeated substitution: no search where none is needed."""
    ran = run([component(Gain(), "a")], [("a.y", "a.u")], 0.1, 1, starts={"a": {"gain": 1e-3}})
    y = 0.0
    for _ in range(ran.master.exchange_rounds + 2):
        y = 1e-3 * y + 1.0
    assert ran["a.y"][0] == y
    assert ran.master.exchange_rounds <= 7


def test_a_nonlinear_loop_is_found_where_plain_exchange_explodes() -> None:
    """``y = 3 - u^3`` has one solution, with a slope of -4.4; plain exchange would overflow in its eighth round."""

    class Bent(Gain):
        def compute(self) -> None:
            self.v["y"] = 3.0 - self.v["u"] ** 3

    ran = run([component(Bent(), "a")], [("a.y", "a.u")], 0.1, 1)
    solution = brentq(lambda u: u + u**3 - 3.0, 1.0, 1.5, xtol=1e-15)
    assert ran["a.y"][0] == pytest.approx(solution, rel=1e-11)  # 1e-12 times the slope


def test_a_loop_that_jumps_when_initialisation_ends_settles_again() -> None:
    """``y = -4 u + x``, and x becomes 1 on leaving Initialization Mode: the first row holds 1/5."""

    class Jumps(Gain):
        feedthrough: ClassVar[dict[str, list[str]]] = {"y": ["u"]}

        def begin(self) -> None:
            self.x = {"x": 0.0}

        def compute(self) -> None:
            self.v["y"] = -4.0 * self.v["u"] + self.x["x"]

        def exitInitializationMode(self) -> None:
            self.x["x"] = 1.0

    ran = run([component(Jumps(), "a")], [("a.y", "a.u")], 0.1, 1)
    assert ran["a.y"][0] == pytest.approx(0.2, rel=1e-11)


def test_an_exchange_that_does_not_settle_names_the_signals() -> None:
    """``y = u + 1`` with ``u = y`` has no solution."""
    calm = component(Counter(), "calm")
    master = prepare([component(Gain(), "a"), calm], [("a.y", "a.u")], 0.1, 3, start=2.0, starts={"a": {"gain": 1.0}})
    with pytest.raises(
        RunError, match=rf"t = 2 s does not settle after {MAX_ROUNDS} exchanges; still changing: a\.y\."
    ) as error:
        master.run()
    assert "Relative changes of what is fed back: " in str(error.value)
    assert error.value.time == 2.0
    assert master.recorder.count == 0


def test_an_output_that_changes_with_every_read_is_named_with_two_values() -> None:
    """Nothing is fed back here, and no start value helps."""

    class Restless(Mock):
        outputs: ClassVar[dict[str, Any]] = {"calm": 0.0, "y": 0.0}

        def compute(self) -> None:
            self.v["y"] += 0.25

    master = prepare([component(Counter(), "calm"), component(Restless(), "odd")], [], 0.1, 3)
    with pytest.raises(RunError, match=r"'odd' at t = 0 s: output odd\.y has another value .* read: [\d.]+, then") as e:
        master.run()
    values = str(e.value).partition("read: ")[2].partition(", at one instant")[0]
    first, second = map(float, values.split(", then "))
    assert second == first + 0.25
    assert "fed back" not in str(e.value)


class Strict(Mock):
    """``x' = u - x``; refuses to be read between a set and the next step, as FMI 2.0 allows. Becomes 1 as it starts."""

    inputs: ClassVar[dict[str, Any]] = {"u": 0.0}
    outputs: ClassVar[dict[str, Any]] = {"y": 0.0}
    memory = ("v", "x", "time", "stepping", "unread")

    def begin(self) -> None:
        self.x, self.stepping, self.unread = {"x": 0.0}, False, False

    def exitInitializationMode(self) -> None:
        self.x, self.stepping, self.unread = {"x": 1.0}, True, False

    def compute(self) -> None:
        assert not self.unread, "get after set without a step"
        self.v["y"] = self.x["x"]

    def _set(self, *arguments: Any) -> None:
        super()._set(*arguments)
        self.unread = self.stepping

    setFloat64 = _set

    def move(self, t: float, h: float) -> None:
        self.unread = False
        self.x = {"x": self.x["x"] + h * (self.v["u"] - self.x["x"])}


class Lenient(Strict):
    """The same, readable at any time."""

    def _set(self, *arguments: Any) -> None:
        super()._set(*arguments)
        self.unread = False

    setFloat64 = _set


class Open(Mock):
    """``x' = u - x`` and ``y = x + u / 2``, readable at any time."""

    inputs: ClassVar[dict[str, Any]] = {"u": 0.0}
    outputs: ClassVar[dict[str, Any]] = {"y": 0.0}
    memory = ("v", "x", "time", "stepping")
    closed = False

    def begin(self) -> None:
        self.x, self.stepping = {"x": 1.0}, False

    def exitInitializationMode(self) -> None:
        self.stepping = True

    def compute(self) -> None:
        assert self.stepping or not self.closed, "get before the end of initialisation"
        self.v["y"] = self.x["x"] + 0.5 * self.v["u"]

    def move(self, t: float, h: float) -> None:
        self.x = {"x": self.x["x"] + h * (self.v["u"] - self.x["x"])}


class Closed(Open):
    """The same, which refuses to be read in Initialization Mode, as FMUs of ControlBuild do."""

    closed = True


@pytest.mark.parametrize("kinds", [(Closed, Open), (Open, Closed), (Closed, Closed)])
@pytest.mark.parametrize("names", [("a", "b"), ("b", "a")])
def test_what_cannot_be_read_in_initialization_mode_has_the_numbers_of_what_can(
    names: tuple[str, str], kinds: tuple[type[Open], type[Open]]
) -> None:
    """Each acts on the other at once: ``y = 1 + y' / 2`` of both is 2 at the start."""
    pairs = [("a.y", "b.u"), ("b.y", "a.u")]
    parts = [component(kind(), name) for kind, name in zip(kinds, names, strict=True)]
    closed = run(parts, pairs, 0.1, 5)
    opened = run([component(Open(), name) for name in names], pairs, 0.1, 5)
    for name in names:
        assert closed[f"{name}.y"][0] == pytest.approx(2.0, abs=1e-11)
        assert closed[f"{name}.y"].tolist() == opened[f"{name}.y"].tolist()
    for part, kind in zip(parts, kinds, strict=True):
        assert ("refuses to be read in Initialization Mode" in part.messages.reason) == kind.closed


@pytest.mark.parametrize("algorithm", [GaussSeidel, Jacobi])
@pytest.mark.parametrize("names", [("a", "b"), ("b", "a")])
def test_what_no_input_acts_on_at_once_is_not_read_after_it_was_set(algorithm: Any, names: tuple[str, str]) -> None:
    """Both start with a jump, so that what is fed back has to be passed on; same numbers as where all may be read."""
    pairs = [("a.y", "b.u"), ("b.y", "a.u")]
    strict, lenient = (
        run([component(kind(), name) for name in names], pairs, 0.1, 5, algorithm=algorithm)
        for kind in (Strict, Lenient)
    )
    assert strict["a.y"][0] == 1.0
    for name in names:
        assert strict[f"{name}.y"].tolist() == lenient[f"{name}.y"].tolist()
        assert len(strict[f"{name}.y"]) == 6


def test_what_its_inputs_act_on_is_not_read_again_where_they_stayed_as_they_were() -> None:
    """Direct feedthrough that is declared; its source jumped as initialisation ended, before its own ended."""

    class Feeding(Strict):
        feedthrough: ClassVar[dict[str, list[str]]] = {"y": ["u"]}

        def compute(self) -> None:
            super().compute()
            self.v["y"] = self.v["u"] + 1.0

    ran = run([component(Strict(), "a"), component(Feeding(), "b")], [("a.y", "b.u")], 0.1, 3)
    assert ran["b.y"][0] == 2.0


def test_a_value_that_was_tried_for_what_is_fed_back_does_not_stay_where_nothing_is_read() -> None:
    plan = prepare([component(Strict(), "a"), component(Strict(), "b")], [("a.y", "b.u"), ("b.y", "a.u")], 0.1, 1).plan
    initialise(plan, 0.0, 0.1)
    exchange = ExchangeAtInstant(plan, 0.0, 0.1)
    plan.values[:] = 99.0
    exchange()
    assert plan.values.tolist() == [1.0, 1.0]


def test_infinite_and_missing_values_do_not_hide_as_unsettled() -> None:
    class Odd(Mock):
        outputs: ClassVar[dict[str, Any]] = {"y": 0.0}

        def compute(self) -> None:
            self.v["y"] = np.inf

    master = prepare([component(Odd(), "odd")], [], 0.1, 3)
    with pytest.raises(RunError, match=r"Component 'odd' at t = 0 s: output odd.y is inf"):
        master.run()
