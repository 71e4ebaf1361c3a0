"""modelDescription.xml read back is the description that was written; no compiler needed."""

from __future__ import annotations

import math
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any
from xml.etree.ElementTree import ParseError, fromstring

import numpy as np
import pytest
from fmpy import read_model_description
from fmpy.model_description import ModelDescription, ModelVariable, Unknown, read_build_description
from hypothesis import given
from hypothesis import strategies as st

from fmu_observer.description import LOG_CATEGORIES, can_exchange, describe
from fmus import recipe
from fmus.build import MAIN_SOURCE
from fmus.content.xml import TextRefusedError, build_description_xml, model_description_xml, number_text
from plant_models.hybrid import HybridSystem

EPS = float(np.finfo(float).eps)
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


@cache
def _description(system: HybridSystem, version: Any) -> ModelDescription:
    return describe(system, version, model_exchange=can_exchange(system))


@cache
def _both(system: HybridSystem, version: Any) -> tuple[ModelDescription, ModelDescription]:
    written = _description(system, version)
    with TemporaryDirectory() as folder:
        file = Path(folder, "modelDescription.xml")
        file.write_text(model_description_xml(written, [MAIN_SOURCE]), encoding="utf-8")
        return written, read_model_description(
            str(file), validate=True, validate_variable_names=True, validate_model_structure=True
        )


@pytest.fixture
def both(system: HybridSystem, version: Any) -> tuple[ModelDescription, ModelDescription]:
    """A description, and what fmpy reads from its XML (validated against the schema)."""
    return _both(system, version)


def test_head_and_capabilities(both: tuple[ModelDescription, ModelDescription]) -> None:
    written, read = both
    for name in ("fmiVersion", "modelName", "guid", "generationTool", "variableNamingConvention"):
        assert getattr(read, name) == getattr(written, name), name
    assert read.coSimulation.modelIdentifier == written.coSimulation.modelIdentifier
    for name in (
        "canHandleVariableCommunicationStepSize",
        "canGetAndSetFMUstate",
        "canSerializeFMUstate",
        "hasEventMode",
    ):
        assert getattr(read.coSimulation, name) == getattr(written.coSimulation, name), name
    assert (read.modelExchange is None) == (written.modelExchange is None)
    if read.modelExchange is not None:
        for name in ("modelIdentifier", "canGetAndSetFMUstate", "canSerializeFMUstate"):
            assert getattr(read.modelExchange, name) == getattr(written.modelExchange, name), name
    if read.fmiMajorVersion == 3 or written.modelExchange is not None:  # FMI 2 tells of them for model exchange only
        assert read.numberOfEventIndicators == written.numberOfEventIndicators
    assert {c.name for c in read.logCategories} == set(LOG_CATEGORIES)
    assert read.defaultExperiment.stepSize == written.defaultExperiment.stepSize


def test_what_fmpy_does_not_read(system: HybridSystem, version: Any) -> None:
    """Directional derivatives (FMI 3 spells them in the plural) and `reinit`, from the XML itself."""
    root = fromstring(model_description_xml(_description(system, version), [MAIN_SOURCE]))
    flag = "providesDirectionalDerivative" + ("s" if version == 3 else "")
    kinds = ("ModelExchange", "CoSimulation") if can_exchange(system) else ("CoSimulation",)
    assert [root.find(tag).get(flag) for tag in kinds] == ["true"] * len(kinds)  # type: ignore[union-attr]
    jumping = can_exchange(system) and bool(system.events or system.frictions)
    holders = root.iterfind("ModelVariables/ScalarVariable/Real" if version == 2 else "ModelVariables/Float64")
    assert len([e for e in holders if e.get("reinit") == "true"]) == (system.continuous_count if jumping else 0)
    plain = fromstring(model_description_xml(describe(system, version), [MAIN_SOURCE]))
    assert not any(e.get("reinit") for e in plain.iter())


def test_variables(both: tuple[ModelDescription, ModelDescription]) -> None:
    written, read = both
    assert len(read.modelVariables) == len(written.modelVariables)
    for got, wanted in zip(read.modelVariables, written.modelVariables, strict=True):
        for name in VARIABLE:
            assert getattr(got, name) == getattr(wanted, name), (wanted.name, name)
        assert [_reference(clock) for clock in got.clocks or []] == list(wanted.clocks)
        assert got.intervalVariability == wanted.intervalVariability
        assert getattr(got.derivative, "name", None) == getattr(wanted.derivative, "name", None)
        assert getattr(got.declaredType, "name", None) == getattr(wanted.declaredType, "name", None)


def test_enumerations(both: tuple[ModelDescription, ModelDescription]) -> None:
    got, wanted = ([(t.name, [(i.name, i.value) for i in t.items]) for t in d.typeDefinitions] for d in both)
    assert got == wanted


def test_units(both: tuple[ModelDescription, ModelDescription]) -> None:
    written, read = both
    got, wanted = ([_unit(u) for u in d.unitDefinitions] for d in (read, written))
    assert got == wanted


def test_structure(both: tuple[ModelDescription, ModelDescription]) -> None:
    written, read = both
    for name in (
        "outputs",
        "derivatives",
        "initialUnknowns",
        *(["eventIndicators"] if read.fmiMajorVersion == 3 else []),
    ):
        got, wanted = ([_unknown(u) for u in getattr(d, name)] for d in (read, written))
        assert got == wanted


def test_build_description_lists_the_sources(tmp_path: Path) -> None:
    (tmp_path / "sources").mkdir()
    file = tmp_path / "sources" / "buildDescription.xml"
    file.write_text(build_description_xml("tracker", ["model.c", "fmi3.c"]), encoding="utf-8")
    (configuration,) = read_build_description(str(tmp_path), validate=True)
    assert configuration.modelIdentifier == "tracker"
    assert configuration.sourceFileSets[0].sourceFiles == ["model.c", "fmi3.c"]


@pytest.mark.parametrize(
    ("value", "text"), [(1.0 / (1.0 / 3.6), "3.6"), (1000.0, "1000.0"), (-273.15, "-273.15"), (0.0, "0.0")]
)
def test_a_number_that_is_next_to_a_short_decimal_is_written_as_that(value: float, text: str) -> None:
    assert number_text(value) == text


@pytest.mark.parametrize("value", [180.0 / math.pi, 1.0 / 3.6, 3.6 * (1.0 + 4.0 * EPS)])
def test_other_numbers_keep_all_digits(value: float) -> None:
    assert float(number_text(value)) == value


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_a_number_as_text_is_the_number_to_rounding(value: float) -> None:
    assert abs(float(number_text(value)) - value) <= math.ulp(value)


def test_kilometres_per_hour_convert_as_they_should(version: Any) -> None:
    description = describe(recipe("locomotive"), version)
    root = fromstring(model_description_xml(description, [MAIN_SOURCE]))
    (factor,) = {e.get("factor") for e in root.iter("DisplayUnit") if e.get("name") == "km/h"}
    assert factor == "3.6"
    assert 25.0 * float(str(factor)) == 90.0  # exactly


@pytest.mark.parametrize("character", ["\x01", "\x00", "\x1f", "\ufffe", "\ud800"])
def test_characters_that_xml_forbids_are_refused(character: str, version: Any) -> None:
    described = describe(recipe("odometer"), version)
    variable = next(v for v in described.modelVariables if v.name == "reading")
    variable.description = f"Reading{character}"
    with pytest.raises(
        TextRefusedError, match=rf"description of \w+ 'reading' .* U\+{ord(character):04X} at position 8, which"
    ):
        model_description_xml(described)
    variable.description, described.description = "Reading", f"{character}odometer"
    with pytest.raises(TextRefusedError, match=r"description of fmiModelDescription 'odometer' .* at position 1,"):
        model_description_xml(described)


@given(st.text(st.characters(exclude_categories=("Cs",))))
def test_what_is_accepted_is_read_back(text: str) -> None:
    """Against an XML parser: it takes what is accepted, and what is refused has a character that it does not take."""
    described = describe(recipe("odometer"), 3)
    described.description = text
    try:
        written = model_description_xml(described)
    except TextRefusedError:
        escaped = "".join(f"&#{ord(c)};" for c in text)
        with pytest.raises(ParseError):
            fromstring(f'<a b="{escaped}"/>')
    else:
        assert fromstring(written.encode()).get("description") == text


def _reference(clock: ModelVariable | int) -> int:
    return clock if isinstance(clock, int) else int(clock.valueReference)


def _unit(unit: Any) -> tuple[Any, ...]:
    base = tuple(
        float(getattr(unit.baseUnit, n)) for n in ("kg", "m", "s", "A", "K", "mol", "cd", "rad", "factor", "offset")
    )
    return unit.name, _neat(*base), [(d.name, *_neat(float(d.factor), float(d.offset))) for d in unit.displayUnits]


def _neat(*values: float) -> tuple[Any, ...]:
    """A factor may be written as the decimal that is next to it: one unit in the last place, which `approx` takes with
    room.
    """
    return tuple(pytest.approx(value, rel=4.0 * EPS, abs=0.0) for value in values)


def _unknown(unknown: Unknown) -> tuple[Any, ...]:
    known = None if unknown.dependencies is None else [v.name for v in unknown.dependencies]
    return unknown.variable.name, known, unknown.dependenciesKind
