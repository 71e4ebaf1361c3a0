"""XML: an fmpy `ModelDescription` is written as modelDescription.xml for FMI 2.0 and 3.0.

A transcription: every name, value reference, start and dependency comes from `fmu_observer.description`. Writes no
files.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from xml.etree.ElementTree import Element, SubElement, indent, tostring

from fmpy.model_description import BaseUnit, ModelDescription, ModelVariable, Unit, Unknown

from fmu_observer.annotated_variable import MARKS, AnnotatedVariable
from plant_models.hybrid.signal import ANNOTATION, ELEMENT

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
    "mightReturnEarlyFromDoStep": "mightReturnEarlyFromDoStep",
}
_EXCHANGE_2 = (
    "canGetAndSetFMUstate",
    "canSerializeFMUstate",
    "providesDirectionalDerivative",
    "completedIntegratorStepNotNeeded",
)


def model_description_xml(description: ModelDescription, sources: Sequence[str] = ()) -> str:
    """The text of modelDescription.xml.

    Args:
        description: what `fmu_observer.description.describe` returns, for FMI 2.0 or 3.0.
        sources: names of the C files in ``sources/`` (FMI 2.0 lists them here, FMI 3.0 in buildDescription.xml).

    Raises:
        TextRefusedError: a name or a description holds a character that XML forbids.
    """
    root = _head(description)
    _interfaces(root, description, sources)
    _units(root, description.unitDefinitions)
    _types(root, description)
    categories = SubElement(root, "LogCategories")
    for category in description.logCategories:
        _element(categories, "Category", {"name": category.name, "description": category.description})
    experiment = description.defaultExperiment
    if experiment is not None:
        names = ("startTime", "stopTime", "tolerance", "stepSize")
        _element(root, "DefaultExperiment", {name: getattr(experiment, name) for name in names})
    variables = SubElement(root, "ModelVariables")
    write = _variable_2 if _is_2(description) else _variable_3
    for variable in description.modelVariables:
        write(variables, variable, description.modelExchange is not None)
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


# -- head -------------------------------------------------------------------------------------------------------------


def _is_2(description: ModelDescription) -> bool:
    return str(description.fmiVersion).startswith("2")


def _head(description: ModelDescription) -> Element:
    token = "guid" if _is_2(description) else "instantiationToken"
    names = ("description", "author", "version", "copyright", "license", "generationTool", "variableNamingConvention")
    attributes = {
        "fmiVersion": description.fmiVersion,
        "modelName": description.modelName,
        token: description.instantiationToken,
    }
    attributes |= {name: getattr(description, name) for name in names}
    if _is_2(description) and description.modelExchange is not None:
        attributes["numberOfEventIndicators"] = description.numberOfEventIndicators
    root = Element("fmiModelDescription")
    _set(root, attributes)
    return root


def _interfaces(root: Element, description: ModelDescription, sources: Sequence[str]) -> None:
    """Model exchange, then co-simulation: FMI 3 wants this order."""
    cosimulation, exchange, is_2 = description.coSimulation, description.modelExchange, _is_2(description)
    renamed = _CAPABILITIES_2 if is_2 else _CAPABILITIES_3
    groups = (
        (exchange, "ModelExchange", {name: renamed.get(name, name) for name in _EXCHANGE_2 if is_2 or name in renamed}),
        (cosimulation, "CoSimulation", renamed),
    )
    for interface, tag, names in groups:
        if interface is None:
            continue
        attributes = {"modelIdentifier": interface.modelIdentifier}
        attributes |= {written: "true" for held, written in names.items() if getattr(interface, held)}
        if is_2:
            attributes["canNotUseMemoryManagementFunctions"] = "true"  # the runtime allocates for itself, once
        element = _element(root, tag, attributes)
        if is_2 and sources:
            files = SubElement(element, "SourceFiles")
            for name in sources:
                SubElement(files, "File", name=name)


def _types(root: Element, description: ModelDescription) -> None:
    """The enumerations; no other type is declared."""
    if not description.typeDefinitions:
        return
    definitions = SubElement(root, "TypeDefinitions")
    for kind in description.typeDefinitions:
        attributes = {"name": kind.name, "description": kind.description}
        if _is_2(description):
            element = SubElement(_element(definitions, "SimpleType", attributes), "Enumeration")
        else:
            element = _element(definitions, "EnumerationType", attributes)
        for item in kind.items:
            _element(element, "Item", {"name": item.name, "value": item.value, "description": item.description})


def _units(root: Element, units: Sequence[Unit]) -> None:
    if not units:
        return
    definitions = SubElement(root, "UnitDefinitions")
    for unit in units:
        element = SubElement(definitions, "Unit", name=unit.name)
        if unit.baseUnit is not None:
            _element(element, "BaseUnit", _base_unit(unit.baseUnit))
        for display in unit.displayUnits:
            attributes = {
                "name": display.name,
                "factor": number_text(display.factor),
                "offset": number_text(display.offset),
            }
            _element(element, "DisplayUnit", attributes)


def _base_unit(unit: BaseUnit) -> dict[str, str | None]:
    powers = {symbol: getattr(unit, symbol) for symbol in ("kg", "m", "s", "A", "K", "mol", "cd", "rad")}
    attributes: dict[str, str | None] = {symbol: str(power) for symbol, power in powers.items() if power}
    if unit.factor != 1.0:
        attributes["factor"] = number_text(unit.factor)
    if unit.offset != 0.0:
        attributes["offset"] = number_text(unit.offset)
    return attributes


# -- variables --------------------------------------------------------------------------------------------------------


def _variable_2(parent: Element, variable: ModelVariable, exchanged: bool) -> None:
    names = ("name", "valueReference", "description", "causality", "variability", "initial")
    element = _element(parent, "ScalarVariable", {name: getattr(variable, name) for name in names})
    # its index, see FIRST_REFERENCE
    derivative = None if variable.derivative is None else variable.derivative.valueReference
    _element(element, variable.type, _values(variable, exchanged) | {"derivative": derivative})
    _annotations(element, variable, "Tool", "name")


def _variable_3(parent: Element, variable: ModelVariable, exchanged: bool) -> None:
    names = ["name", "valueReference", "description", "causality", "variability"]
    attributes = {name: getattr(variable, name) for name in names}
    if variable.clocks:
        attributes["clocks"] = " ".join(map(str, variable.clocks))
    if variable.type == "Clock":
        attributes["intervalVariability"] = variable.intervalVariability
    else:
        derivative = None if variable.derivative is None else variable.derivative.valueReference
        attributes |= {"initial": variable.initial, **_values(variable, exchanged), "derivative": derivative}
    element = _element(parent, variable.type, attributes)
    _annotations(element, variable, "Annotation", "type")


def _annotations(element: Element, variable: ModelVariable, tag: str, key: str) -> None:
    """What an output warns of, and the marks; `tag` and `key`: how the version of FMI names who says it."""
    if not isinstance(variable, AnnotatedVariable):
        return
    annotations = SubElement(element, "Annotations")
    for name, mark in (MARKS[mark] for mark in MARKS if mark in variable.marks):
        SubElement(SubElement(annotations, tag, {key: name}), mark)
    warning = variable.warning
    if warning is not None:
        _check_text(warning.text, f"modelDescription.xml: the warning of {variable.name!r}")
        attributes = {
            "shows": " ".join(warning.shows) or None,
            "atEnd": "true" if warning.at_end else None,
            "reaches": None if warning.reaches is None else repr(float(warning.reaches)),
        }
        _element(SubElement(annotations, tag, {key: ANNOTATION}), ELEMENT, attributes).text = warning.text


def _values(variable: ModelVariable, exchanged: bool) -> dict[str, object]:
    """Attributes of the value; `exchanged`: in a model exchange FMU, where states may be set anew at events."""
    kinds = {"Integer": ("min", "max", "start"), "Int32": ("min", "max", "start"), "Enumeration": ("start",)}
    names = kinds.get(variable.type, ("unit", "displayUnit", "min", "max", "nominal", "start"))
    values: dict[str, object] = {name: getattr(variable, name) for name in names}
    if variable.declaredType is not None:
        values["declaredType"] = variable.declaredType.name
    if exchanged and variable.reinit:
        values["reinit"] = "true"
    return values


# -- structure --------------------------------------------------------------------------------------------------------


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
        ("EventIndicator", description.eventIndicators),
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


# -- elements ---------------------------------------------------------------------------------------------------------


def _element(parent: Element, tag: str, attributes: Mapping[str, object]) -> Element:
    element = SubElement(parent, tag)
    _set(element, attributes)
    return element


def _set(element: Element, attributes: Mapping[str, object]) -> None:
    owner = attributes.get("name", attributes.get("modelName", ""))
    for name, value in attributes.items():
        if value is not None:
            text = str(value)
            _check_text(text, f"modelDescription.xml: the {name} of {element.tag} {owner!r}")
            element.set(name, text)


def _document(root: Element) -> str:
    indent(root)
    text: str = tostring(root, encoding="unicode")
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{text}\n'


# -- what a text may hold, and how a number is written ----------------------------------------------------------------


_FORBIDDEN = re.compile("[^\t\n\r\u0020-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
"""All but `Char` of XML 1.0, section 2.2."""

DIGITS = 12
"""Significant decimal digits of a number that is taken for meant; a conversion factor such as 3.6 has few."""


class TextRefusedError(ValueError):
    """A text that XML cannot hold; the message says whose it is and which character is the matter."""


def _check_text(text: str, whose: str) -> None:
    """Refuse characters that XML 1.0 forbids: an XML file cannot hold them in any way, not even escaped.

    Args:
        text: what is to be written. whose: what it is, for the message.

    Raises:
        TextRefusedError: there is such a character.
    """
    found = _FORBIDDEN.search(text)
    if found:
        what = f"the character U+{ord(found[0]):04X} at position {found.start() + 1}"
        raise TextRefusedError(f"{whose} holds {what}, which XML 1.0 forbids; remove it.")


def number_text(value: float) -> str:
    """A number as text: the decimal of few digits that is next to it where there is one (3.6, not 3.5999999999999996),
    else all.

    A quotient such as ``1 / (1 / 3.6)`` is one rounding away from the number that is meant; so is what is written here
    at most.

    Args:
        value: a finite number.
    """
    neat = float(f"{value:.{DIGITS}g}")
    return repr(neat if abs(neat - value) <= math.ulp(value) else float(value))
