"""Laws: a certificate or a probe from the cache is the one that is computed, and is asked for by all it depends on."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any

import pytest

from cosim.components.loading import load_block
from cosim.run import balise_service, observer_findings
from cosim.run.expected_gaps import ExpectedGap
from cosim.run.observer_findings import evaluate_observers
from cosim.scenario.scenario_tables import ComponentTable
from fmu_observer import OBSERVERS
from fmus.check.probe import ProbeReport
from plant_models import PLANTS

GAP = ExpectedGap(0.4, "chosen", 6.0, (4.0, 6.0))


@pytest.fixture(autouse=True)
def _empty_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("FMU_OBSERVER_CACHE", str(tmp_path))


def never(*_: Any) -> Any:
    raise AssertionError("computed although it is kept")


def table(name: str, **keys: Any) -> ComponentTable:
    return ComponentTable(observer=name, **keys)


@pytest.mark.parametrize("name", ["takagi_sugeno_cdo", "differentiator_cdo"])
def test_a_certificate_from_the_cache_is_the_computed_one(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    found, warnings = observer_findings._evaluated("it", table(name), OBSERVERS[name](), GAP)
    computed = evaluate_observers({"it": table(name)}, {"it": GAP}, "warn", "here")
    monkeypatch.setattr(observer_findings, "_evaluated", never)
    kept = evaluate_observers({"it": table(name)}, {"it": GAP}, "warn", "here")
    assert kept == computed
    assert observer_findings.evaluated("it", table(name), OBSERVERS[name](), GAP) == (found, warnings)
    assert kept[1][: len(warnings)] == warnings


def test_a_certificate_is_asked_for_by_all_it_depends_on(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[Any] = []
    monkeypatch.setattr(observer_findings, "_evaluated", lambda *all_of_it: (asked.append(all_of_it), []))
    name = "takagi_sugeno_cdo"
    presets = list(OBSERVERS[name]().presets)
    parameter = OBSERVERS[name]().parameters[0].scalar_names[0]
    questions = [
        ("it", table(name), GAP),
        ("other", table(name), GAP),
        ("it", table(name, preset=presets[-1]), GAP),
        ("it", table(name, preset=presets[0]), GAP),
        ("it", table(name, parameters={parameter: 3.25}), GAP),
        ("it", table("takagi_sugeno_periodic"), GAP),
        ("it", table(name), ExpectedGap(0.5, "chosen", 6.0, (4.0, 6.0))),
        ("it", table(name), ExpectedGap(0.4, "known", 6.0, (4.0, 6.0))),
        ("it", table(name), ExpectedGap(None, "chosen", 6.0, (4.0, 6.0))),
    ]
    for _ in range(2):
        for component, keys, gap in questions:
            evaluate_observers({component: keys}, {component: gap}, "warn", "here")
    assert len(asked) == len(questions)


def plant(name: str = "plant", **options: Any) -> Any:
    return partial(load_block, PLANTS["locomotive"](**options), name)


def test_a_probe_from_the_cache_is_the_one_that_was_made(monkeypatch: pytest.MonkeyPatch) -> None:
    seen = balise_service.probe(plant(), {}, 0.0, 0.01)
    assert balise_service._known_probe(plant(), {}, 0.0, 0.01) == seen
    made: list[float] = []
    monkeypatch.setattr(balise_service, "probe", lambda *arguments: made.append(arguments[-1]) or seen)
    assert balise_service._known_probe(plant(), {}, 0.0, 0.01) == seen
    assert made == []
    for make, starts, start, step in (
        (plant(), {"mass": 80e3}, 0.0, 0.01),
        (plant(), {}, 1.0, 0.01),
        (plant(), {}, 0.0, 0.02),
        (plant("other"), {}, 0.0, 0.01),
        (partial(load_block, PLANTS["driver"](), "plant"), {}, 0.0, 0.01),
    ):
        balise_service._known_probe(make, starts, start, step)
    assert len(made) == 5


def test_a_probe_that_saw_nothing_is_made_again(monkeypatch: pytest.MonkeyPatch) -> None:
    nothing = ProbeReport("plant", True, True, False, "no", None, repeatable=False, excited=False)
    made: list[float] = []
    monkeypatch.setattr(balise_service, "probe", lambda *arguments: made.append(arguments[-1]) or nothing)
    for _ in range(2):
        assert balise_service._known_probe(plant(), {}, 0.0, 0.01) is nothing
    assert len(made) == 2


def test_a_detector_is_not_asked_for_a_certificate() -> None:
    assert evaluate_observers({"it": table("train_diagnosis")}, {"it": GAP}, "require", "here") == ({}, [])
