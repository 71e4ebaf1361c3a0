"""The table of isolation of a train's sensors claims nothing that the structure of the equations forbids."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from types import ModuleType

import pytest

from fmu_observer.detection.train_isolation import isolability

pytestmark = pytest.mark.foreign

pytest.importorskip("faultdiagnosistoolbox")
STUDY = Path(__file__).parents[2] / "docs" / "studies" / "train_isolability.py"
# One of them acts at a time, which a structure does not know.
BY_MODE = {"traction": {"friction", "cylinder"}, "friction": {"traction"}, "cylinder": {"traction"}}


def study() -> ModuleType:
    """The study as a module."""
    spec = importlib.util.spec_from_file_location("train_isolability", STUDY)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize("sensors", ["all", "odometers and balises"])
def test_what_the_structure_cannot_isolate_neither_do_we(sensors: str) -> None:
    module = study()
    fitted = module.SETS[sensors]
    structure = module.structural(fitted)
    for fault, others in isolability(fitted).items():
        if others is None:
            continue
        assert structure[fault] is not None, fault
        forbidden = set(structure[fault]) - {"wheel_1", "wheel_2"} - BY_MODE.get(fault, set())
        assert forbidden <= set(others), fault
    assert "odometer_1" in structure["wheel_1"]  # wheel and sensor: never by structure
