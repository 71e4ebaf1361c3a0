"""Law over all train observers: none is worse than its own odometer where the odometer is right."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from types import ModuleType

import pytest
from shipped import shipped

from fmu_observer import OBSERVERS

STUDY = Path(__file__).resolve().parents[3] / "docs" / "studies" / "own_odometer.py"


def _study() -> ModuleType:
    spec = importlib.util.spec_from_file_location("own_odometer", STUDY)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


study = _study()
HELD = [label for label in study.EVALUATED if label not in study.EXCEPT]


def test_every_train_observer_is_evaluated_or_named_with_the_reason() -> None:
    room = {name for name in OBSERVERS if ".observers.train." in type(shipped(name)).__module__}
    evaluated = {name for name, _ in study.EVALUATED.values()}
    assert evaluated | set(study.NOT_HERE) == room  # who adds one adds no line: it stands with its own preset
    assert not evaluated & set(study.NOT_HERE)
    assert set(study.EXCEPT) < set(study.EVALUATED)
    assert all(study.EXCEPT.values())
    assert len(HELD) >= 8


@pytest.mark.parametrize("situation", [s for s in study.SITUATIONS if s.right], ids=lambda s: s.name)
def test_no_observer_is_worse_than_its_own_odometer(situation: object) -> None:
    found = study.errors(situation, HELD)
    own = found[study.RESET]
    worse = {label: error for label, error in found.items() if not error <= own + study.MARGIN}
    assert not worse, f"own odometer {own:.2f} m"
