"""XML: an fmpy `ModelDescription` is written as modelDescription.xml for FMI 2.0 and 3.0.

A transcription: every name, value reference, start and dependency comes from `fmu_observer.description`. Touches no files.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from xml.etree.ElementTree import Element, SubElement, indent, tostring

from fmpy.model_description import BaseUnit, ModelDescription, ModelVariable, Unit, Unknown

LOG_CATEGORIES = {
    "logStatusError": "Calls that were refused, and why",
    "logStatusWarning": "Events that came too late or were lost",
    "logEvents": "Events that were applied",
}

_CAPABILITIES_2 = {
    "canHandleVariableCommunicationStepSize": "canHandleVariableCommunicationStepSize",
    "canGetAndSetFMUstate": "canGetAndSetFMUstate",
    "canSerializeFMUstate": "canSerializeFMUstate",
    "providesDirectionalDerivative": "providesDirectionalDerivative",
}
_CAPABILITIES_3 = {
    "canHandleVariableCommunicationStepSize": "canHandleVariableCommunicationStepSize",
    "canGetAndSetFMUstate": "canGetAndSetFMUState",
    "canSerializeFMUstate": "canSerializeFMUState",
    "providesDirectionalDerivative": "providesDirectionalDerivatives",
    "hasEventMode": "hasEventMode",
}


def model_description_xml(description: ModelDescription, sources: Sequence[str] = ()) -> str:
    """The text of modelDescription.xml.

    Args:
        description: what `fmu_observer.description.describe` returns, for FMI 2.0 or 3.0.
        sources: names of the C files in ``sources/`` (FMI 2.0 lists them here, FMI 3.0 in buildDescription.xml).
    """
    root = _head(description)
    _interface(root, description, sources)
    _units(root, description.unitDefinitions)
    categories = SubElement(root, "LogCategories")
    for name, text in LOG_CATEGORIES.items():
        SubElement(categories, "Category", name=name, description=text)
    experiment = description.defaultExperiment
    if experiment is not None:
        names = ("startTime", "stopTime", "tolerance", "stepSize")
        _element(root, "DefaultExperiment", {name: getattr(experiment, name) for name in names})
    variables = SubElement(root, "ModelVariables")
    for variable in description.modelVariables:
        (_variable_2 if _is_2(description) else _variable_3)(variables, variable)
    (_structure_2 if _is_2(description) else _structure_3)(root, description)
    return _document(root)


def build_description_xml(identifier: str, sources: Sequence[str]) -> str:
    """The text of sources/buildDescription.xml (FMI 3.0).

    Args:
        identifier: model identifier.
        sources: names of the C files in ``sources/``.
    """
    root = Element("fmiBuildDescription", fmiVersion="3.0")
    configuration = SubElement(root, "BuildConfiguration", modelIdentifier=identifier)
    files = SubElement(configuration, "SourceFileSet", language="C11")
    for name in sources:
        SubElement(files, "SourceFile", name=name)
    return _document(root)


# -- head ---------------------------------------------------------------------------------------------------------------


def _is_2(description: ModelDescription) -> bool:
    return str(description.fmiVersion).startswith("2")


def _head(description: ModelDescription) -> Element:
    token = "guid" if _is_2(description) else "instantiationToken"
    names = ("description", "author", "version", "copyright", "license", "generationTool", "variableNamingConvention")
    attributes = {"fmiVersion": description.fmiVersion, "modelName": description.modelName, token: description.instantiationToken}
    attributes |= {name: getattr(description, name) for name in names}
    root = Element("fmiModelDescription")
    _set(root, attributes)
    return root


def _interface(root: Element, description: ModelDescription, sources: Sequence[str]) -> None:
    cosimulation = description.coSimulation
    assert cosimulation is not None
    names = _CAPABILITIES_2 if _is_2(description) else _CAPABILITIES_3
    attributes = {"modelIdentifier": cosimulation.modelIdentifier}
    attributes |= {written: "true" for held, written in names.items() if getattr(cosimulation, held)}
    if _is_2(description):
        attributes["canNotUseMemoryManagementFunctions"] = "true"  # the runtime allocates for itself, once
    element = _element(root, "CoSimulation", attributes)
    if _is_2(description) and sources:
        files = SubElement(element, "SourceFiles")
        for name in sources:
            SubElement(files, "File", name=name)


def _units(root: Element, units: Sequence[Unit]) -> None:
    if not units:
        return
    definitions = SubElement(root, "UnitDefinitions")
    for unit in units:
        element = SubElement(definitions, "Unit", name=unit.name)
        if unit.baseUnit is not None:
            _element(element, "BaseUnit", _base_unit(unit.baseUnit))
        for display in unit.displayUnits:
            attributes = {"name": display.name, "factor": repr(float(display.factor)), "offset": repr(float(display.offset))}
            _element(element, "DisplayUnit", attributes)


def _base_unit(unit: BaseUnit) -> dict[str, str | None]:
    powers = {symbol: getattr(unit, symbol) for symbol in ("kg", "m", "s", "A", "K", "mol", "cd", "rad")}
    attributes: dict[str, str | None] = {symbol: str(power) for symbol, power in powers.items() if power}
    if unit.factor != 1.0:
        attributes["factor"] = repr(float(unit.factor))
    if unit.offset != 0.0:
        attributes["offset"] = repr(float(unit.offset))
    return attributes


# -- variables ----------------------------------------------------------------------------------------------------------


def _variable_2(parent: Element, variable: ModelVariable) -> None:
    names = ("name", "valueReference", "description", "causality", "variability", "initial")
    element = _element(parent, "ScalarVariable", {name: getattr(variable, name) for name in names})
    _element(element, variable.type, {name: getattr(variable, name) for name in _value_attributes(variable)})


def _variable_3(parent: Element, variable: ModelVariable) -> None:
    names = ["name", "valueReference", "description", "causality", "variability"]
    attributes = {name: getattr(variable, name) for name in names}
    if variable.clocks:
        attributes["clocks"] = " ".join(map(str, variable.clocks))
    if variable.type == "Clock":
        attributes["intervalVariability"] = variable.intervalVariability
    else:
        attributes |= {name: getattr(variable, name) for name in ("initial", *_value_attributes(variable))}
    _element(parent, variable.type, attributes)


def _value_attributes(variable: ModelVariable) -> tuple[str, ...]:
    return ("min", "max", "start") if variable.type == "Integer" else ("unit", "displayUnit", "min", "max", "nominal", "start")


# -- structure ----------------------------------------------------------------------------------------------------------


def _structure_2(root: Element, description: ModelDescription) -> None:
    position = {id(v): i + 1 for i, v in enumerate(description.modelVariables)}
    structure = SubElement(root, "ModelStructure")
    groups = (
        ("Outputs", description.outputs),
        ("Derivatives", description.derivatives),
        ("InitialUnknowns", description.initialUnknowns),
    )
    for group, unknowns in groups:
        if unknowns:
            element = SubElement(structure, group)
            for unknown in unknowns:
                known = None if unknown.dependencies is None else [position[id(v)] for v in unknown.dependencies]
                _unknown(element, "Unknown", {"index": position[id(unknown.variable)]}, unknown, known)


def _structure_3(root: Element, description: ModelDescription) -> None:
    structure = SubElement(root, "ModelStructure")
    groups = (
        ("Output", description.outputs),
        ("ContinuousStateDerivative", description.derivatives),
        ("InitialUnknown", description.initialUnknowns),
    )
    for group, unknowns in groups:
        for unknown in unknowns:
            known = None if unknown.dependencies is None else [v.valueReference for v in unknown.dependencies]
            _unknown(structure, group, {"valueReference": unknown.variable.valueReference}, unknown, known)


def _unknown(parent: Element, tag: str, key: dict[str, int], unknown: Unknown, known: Iterable[int] | None) -> None:
    attributes: dict[str, object] = dict(key)
    if known is not None:
        attributes["dependencies"] = " ".join(map(str, known))
        attributes["dependenciesKind"] = " ".join(unknown.dependenciesKind or [])
    _element(parent, tag, attributes)


# -- elements -----------------------------------------------------------------------------------------------------------


def _element(parent: Element, tag: str, attributes: dict[str, object] | dict[str, str | None]) -> Element:
    element = SubElement(parent, tag)
    _set(element, attributes)
    return element


def _set(element: Element, attributes: dict[str, object] | dict[str, str | None]) -> None:
    for name, value in attributes.items():
        if value is not None:
            element.set(name, str(value))


def _document(root: Element) -> str:
    indent(root)
    text: str = tostring(root, encoding="unicode")
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{text}\n'
