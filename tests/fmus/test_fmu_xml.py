"""modelDescription.xml read back is the description that was written; no compiler needed."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from fmpy import read_model_description
from fmpy.model_description import ModelDescription, ModelVariable, Unknown, read_build_description

from fmu_observer.description import describe
from fmus.build import MAIN_SOURCE
from fmus.xml import LOG_CATEGORIES, build_description_xml, model_description_xml
from plant_models.hybrid import HybridSystem

VARIABLE = (
    "name",
    "valueReference",
    "type",
    "description",
    "causality",
    "variability",
    "unit",
    "displayUnit",
    "start",
    "min",
    "max",
)


@pytest.fixture
def both(system: HybridSystem, version: Any, tmp_path: Path) -> tuple[ModelDescription, ModelDescription]:
    """A description, and what fmpy reads from its XML (validated against the schema)."""
    written = describe(system, version)
    file = tmp_path / "modelDescription.xml"
    file.write_text(model_description_xml(written, [MAIN_SOURCE]), encoding="utf-8")
    return written, read_model_description(str(file), validate=True, validate_variable_names=True, validate_model_structure=True)


def test_head_and_capabilities(both: tuple[ModelDescription, ModelDescription]) -> None:
    written, read = both
    for name in ("fmiVersion", "modelName", "guid", "generationTool", "variableNamingConvention"):
        assert getattr(read, name) == getattr(written, name), name
    assert read.coSimulation.modelIdentifier == written.coSimulation.modelIdentifier
    for name in ("canHandleVariableCommunicationStepSize", "canGetAndSetFMUstate", "canSerializeFMUstate", "hasEventMode"):
        assert getattr(read.coSimulation, name) == getattr(written.coSimulation, name), name
    assert {c.name for c in read.logCategories} == set(LOG_CATEGORIES)
    assert read.defaultExperiment.stepSize == written.defaultExperiment.stepSize


def test_variables(both: tuple[ModelDescription, ModelDescription]) -> None:
    written, read = both
    assert len(read.modelVariables) == len(written.modelVariables)
    for got, wanted in zip(read.modelVariables, written.modelVariables, strict=True):
        for name in VARIABLE:
            assert getattr(got, name) == getattr(wanted, name), (wanted.name, name)
        assert [_reference(clock) for clock in got.clocks or []] == list(wanted.clocks)
        assert got.intervalVariability == wanted.intervalVariability


def test_units(both: tuple[ModelDescription, ModelDescription]) -> None:
    written, read = both
    got, wanted = ([_unit(u) for u in d.unitDefinitions] for d in (read, written))
    assert got == wanted


def test_structure(both: tuple[ModelDescription, ModelDescription]) -> None:
    written, read = both
    for name in ("outputs", "initialUnknowns"):
        got, wanted = ([_unknown(u) for u in getattr(d, name)] for d in (read, written))
        assert got == wanted


def test_build_description_lists_the_sources(tmp_path: Path) -> None:
    (tmp_path / "sources").mkdir()
    file = tmp_path / "sources" / "buildDescription.xml"
    file.write_text(build_description_xml("tracker", ["model.c", "fmi3.c"]), encoding="utf-8")
    (configuration,) = read_build_description(str(tmp_path), validate=True)
    assert configuration.modelIdentifier == "tracker"
    assert configuration.sourceFileSets[0].sourceFiles == ["model.c", "fmi3.c"]


def _reference(clock: ModelVariable | int) -> int:
    return clock if isinstance(clock, int) else int(clock.valueReference)


def _unit(unit: Any) -> tuple[Any, ...]:
    base = tuple(float(getattr(unit.baseUnit, n)) for n in ("kg", "m", "s", "A", "K", "mol", "cd", "rad", "factor", "offset"))
    return unit.name, base, [(d.name, float(d.factor), float(d.offset)) for d in unit.displayUnits]


def _unknown(unknown: Unknown) -> tuple[Any, ...]:
    known = None if unknown.dependencies is None else [v.name for v in unknown.dependencies]
    return unknown.variable.name, known, unknown.dependenciesKind
