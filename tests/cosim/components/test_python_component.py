"""Plain Python as a component: 15 lines are enough, and what is wrong is told with component, signal and time."""

from __future__ import annotations

import threading
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pytest

from cosim.errors import ScenarioError
from cosim.simulation.scenario import Scenario

PLACES = [0.7, 4.0, 4.05, 13.0]


class Trolley:
    """A mass without drag that starts at 10 m/s."""

    inputs: ClassVar[dict[str, Any]] = {"effort": "N"}
    outputs: ClassVar[dict[str, Any]] = {"position": "m", "speed": "m/s"}

    def __init__(self, mass: float = 1000.0, start_speed: float = 10.0) -> None:
        self.mass, self.speed, self.position = mass, start_speed, 0.0

    def step(self, t: float, inputs: Any, dt: float) -> None:
        acceleration = inputs.effort / self.mass
        self.position += dt * self.speed + 0.5 * dt**2 * acceleration
        self.speed += dt * acceleration


class DeadReckoning:
    """Integrates a speed, and takes the position of each balise."""

    inputs: ClassVar[list[str]] = ["odometer"]
    outputs: ClassVar[list[str]] = ["position", "count"]

    def __init__(self, offset: float = 0.0) -> None:
        self.offset, self.where, self.stamps = offset, 0.0, []

    def step(self, t: float, inputs: Any, dt: float) -> dict[str, float]:
        self.where += dt * (inputs["odometer"] + self.offset)
        return {"position": self.where, "count": len(self.stamps)}

    def balise(self, stamp: float, position: float, location_accuracy: float = 0.0) -> dict[str, float] | bool:
        if position > 12.0:
            return False
        self.where = position
        self.stamps = [*self.stamps, stamp]
        return {"position": position, "count": len(self.stamps)}


class Saved(DeadReckoning):
    """With a lock, which cannot be copied, and a state without it."""

    def __init__(self, offset: float = 0.0) -> None:
        super().__init__(offset)
        self.lock = threading.Lock()

    def get_state(self) -> Any:
        return self.where, self.stamps

    def set_state(self, state: Any) -> None:
        self.where, self.stamps = state


def scenario(observer: Any = DeadReckoning, plant: Any = Trolley, step: float = 0.1, **balises: Any) -> Scenario:
    s = Scenario(stop=2.0, step=step, certificates="ignore")
    s.add("plant", model=plant).add("observer", observer=observer).connect("plant.speed -> observer.odometer")
    places = {"layout": "positions", "positions": PLACES, "method": "rollback"} | balises
    return s.balises(position="plant.position", speed="plant.speed", **places)


@pytest.mark.parametrize("observer", [DeadReckoning, DeadReckoning(), Saved], ids=["class", "instance", "get_state"])
def test_telegrams_between_communication_points_are_delivered_at_their_instants(observer: Any) -> None:
    outcome = scenario(observer).run(warn=lambda _: None)
    assert outcome.failure is None
    assert [e.stamp for e in outcome.result.events] == pytest.approx([p / 10.0 for p in PLACES], abs=1e-9)
    assert [e.outcomes["observer"] for e in outcome.result.events] == ["accepted"] * 3 + ["ignored"]
    assert abs(outcome["observer.position"] - outcome["plant.position"])[-1] < 1e-6
    assert outcome["observer.count"][-1] == 3.0


def test_what_comes_out_does_not_depend_on_the_step_nor_on_earlier_runs() -> None:
    stated = DeadReckoning(offset=0.25)
    s = scenario(stated)
    first, again, fine = s.run(warn=lambda _: None), s.run(warn=lambda _: None), s.set("step", 0.01).run()
    assert stated.where == 0.0, "each run has a copy"
    assert np.array_equal(first.result.table, again.result.table)
    assert first["observer.position"][-1] == pytest.approx(fine["observer.position"][-1], abs=1e-9)


def test_parameters_are_the_arguments_of_the_constructor() -> None:
    s = scenario()
    runs = s.vary({"observer.offset": [0.0, 0.5]}).run().runs
    ends = [run.outcome["observer.position"][-1] for run in runs]
    assert ends[1] - ends[0] == pytest.approx(0.5 * (2.0 - 0.405), abs=1e-9)
    assert scenario(DeadReckoning(0.5)).run()["observer.position"][-1] == ends[1]


class Follower:
    """Effort against the speed of this very instant."""

    inputs: ClassVar[dict[str, Any]] = {"speed": "m/s"}
    outputs: ClassVar[dict[str, Any]] = {"effort": ("N", 2)}
    direct: ClassVar[dict[str, Any]] = {"effort": ["speed"]}

    def __init__(self, gains: Any = (100.0, 3.0)) -> None:
        self.gains, self.effort = np.array(gains), np.zeros(2)

    def step(self, t: float, inputs: Any, dt: float) -> None:
        self.effort = -self.gains * inputs.speed


def test_vectors_and_iteration_with_rollback() -> None:
    s = Scenario(stop=1.0, step=0.1, master={"algorithm": "iterate"})
    s.add("plant", model=Trolley).add("control", model=Follower, parameters={"gains": [200.0, 1.0]})
    s.connect("plant.speed -> control.speed", "control.effort[1] -> plant.effort")
    outcome = s.run()
    assert outcome.failure is None
    assert outcome["control.effort[2]"] == pytest.approx(-outcome["plant.speed"] * (outcome.result.time > 0.0))
    speed = outcome["plant.speed"]
    assert speed[1:] == pytest.approx(speed[:-1] / (1.0 + 0.02), rel=1e-6), "the effort is that of the end of the step"


class Broken(DeadReckoning):
    """Gives something else from 1 s on."""

    gives: ClassVar[Any] = None

    def step(self, t: float, inputs: Any, dt: float) -> Any:
        good = super().step(t, inputs, dt)
        return good if t < 0.95 else self.gives(good)


@pytest.mark.parametrize(
    ("gives", "words"),
    [
        (lambda good: good | {"position": float("nan")}, "output 'position' is nan after step, expected finite"),
        (lambda good: good | {"position": np.float64("nan")}, "output 'position' is nan after step, expected finite"),
        (lambda good: good | {"position": np.zeros(3)}, r"output 'position' has shape \(3,\) after step, expected one"),
        (lambda good: good | {"position": "far"}, "output 'position' is no number after step: 'far'"),
        (lambda _: {"count": 1.0}, "no output 'position': return it from step in a dict, or keep it as self.posi"),
        (lambda good: good | {"postion": 1.0}, "step returned 'postion', which is no output; did you mean 'position'"),
        (lambda _: [1.0, 2.0], "step returned a list, expected a dict of outputs"),
        (lambda _: 1 / 0, r"step raised ZeroDivisionError: division by zero \(.*test_python_component.py:\d+\)"),
    ],
)
def test_what_a_step_gives_is_checked(gives: Any, words: str) -> None:
    class Wrong(Broken):
        pass

    Wrong.gives = staticmethod(gives)
    outcome = scenario(Wrong).run(warn=lambda _: None)
    assert outcome.failure is not None
    assert outcome.result.time[-1] == pytest.approx(1.0), "what was computed is kept"
    assert "Component 'observer' at t = 1 s" in outcome.failure
    with pytest.raises(AssertionError, match=words):
        raise AssertionError(outcome.failure)


class Uncopied(DeadReckoning):
    """Holds what cannot be copied."""

    def __init__(self) -> None:
        super().__init__()
        self.lock = threading.Lock()


def test_what_cannot_be_copied_is_reported() -> None:
    s = Scenario(stop=1.0, step=0.1).add("plant", model=Uncopied())
    failure = s.run(warn=lambda _: None).failure
    assert failure is not None
    assert "Component 'plant'" in failure
    assert "the given instance cannot be copied for a run" in failure

    class Plant(Trolley):
        def __init__(self) -> None:
            super().__init__()
            self.lock = threading.Lock()

    with pytest.raises(Exception, match=r"self.lock cannot be copied .*write get_state\(\) and set_state\(state\)"):
        raise AssertionError(scenario(plant=Plant).run(warn=lambda _: None).failure)


def declared(**attributes: Any) -> type:
    return type("Odd", (DeadReckoning,), attributes)


@pytest.mark.parametrize(
    ("cls", "words"),
    [
        (declared(outputs="position"), "outputs = 'position' cannot be"),
        (declared(outputs={"position": 3}), r"outputs = \{'position': 3\} cannot be"),
        (
            declared(outputs={"position": "mps"}),
            r"cannot be \(unknown unit symbol 'mps' .* known: %, .*\); write",
        ),
        (declared(outputs=["odometer"]), "the name 'odometer' is taken twice"),
        (declared(direct={"position": "odometer"}), "write direct = "),
        (declared(balise=lambda _, place: place), "balise takes 'place'; of a telegram is known: stamp, position"),
        (declared(step=lambda _, t: t), r"step\(_, t\) cannot be called as step\(t, inputs, dt\)"),
        (declared(outputs=["no name"]), "'no name' is not a legal identifier"),
    ],
)
def test_declarations_that_cannot_be(cls: type, words: str) -> None:
    with pytest.raises(ScenarioError, match=rf"components.observer: Odd: .*{words}"):
        scenario(cls).run()


def test_an_unknown_parameter_and_an_option_of_hybrid_systems_are_refused() -> None:
    with pytest.raises(Exception, match="no variable 'offst'; did you mean 'offset'"):
        scenario().set("observer.offst", 1.0).run()
    with pytest.raises(ScenarioError, match="'preset' and 'as' belong to hybrid systems"):
        scenario().set("observer.as", "fmu3").run()


def test_results_say_how_they_were_made(tmp_path: Path) -> None:
    s = scenario(DeadReckoning(0.5))
    assert f'observer = "{Path(__file__).resolve()}:DeadReckoning"' in s.to_toml()
    assert "offset = 0.5" in s.to_toml()
    s.save(tmp_path / "s.toml")
    assert np.array_equal(Scenario.load(tmp_path / "s.toml").run().result.table, s.run().result.table)
