"""Model descriptions: as fmpy reads them, with what fmpy leaves out of FMI 1.0 and 3.0 added."""

from __future__ import annotations

import zipfile
from io import BytesIO
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from fmpy import read_model_description
from fmpy.model_description import ModelDescription, ModelVariable, Unknown

from fmu_observer.annotated_variable import MARKS, AnnotatedVariable
from fmus.fmi.standard import OWN_TOOL
from plant_models.hybrid.signal import ANNOTATION, ELEMENT, OutputWarning

FILE = "modelDescription.xml"
LEFT_OUT = {
    "providesDirectionalDerivatives": "providesDirectionalDerivative",
    "providesAdjointDerivatives": "providesAdjointDerivatives",
}
"""Attributes of FMI 3.0 by their name in fmpy 0.3.32, which expects the name of FMI 2.0 and finds nothing."""

ELEMENTS = {"CoSimulation": "coSimulation", "ModelExchange": "modelExchange"}
TRUE = {"true", "1"}
CLOCK_ATTRIBUTES: dict[str, Any] = {
    "priority": int,
    "intervalDecimal": float,
    "shiftDecimal": float,
    "resolution": int,
    "intervalCounter": int,
    "shiftCounter": int,
    "supportsFraction": TRUE.__contains__,
    "canBeDeactivated": TRUE.__contains__,
}

FLAGS_OF_FMI_1 = (
    "canHandleVariableCommunicationStepSize",
    "canInterpolateInputs",
    "canRunAsynchronuously",
    "canBeInstantiatedOnlyOncePerProcess",
    "canNotUseMemoryManagementFunctions",
)


def read_description(source: Path) -> ModelDescription:
    """The model description of an FMU file or of the folder it was unpacked into; not validated.

    Args:
        source: the user's file.

    Raises:
        Exception: whatever a broken file makes the parsers throw.
    """
    description = _read(source)
    version = str(description.fmiVersion)
    if version.startswith("1"):
        _complete_fmi_1(description, ElementTree.fromstring(_text(source)))
    if version.startswith("3"):
        root = ElementTree.fromstring(_text(source))
        for tag, held in ELEMENTS.items():
            element, interface = root.find(tag), getattr(description, held)
            if element is not None and interface is not None:
                for written, name in LEFT_OUT.items():
                    setattr(interface, name, element.get(written) in TRUE)
        variables = {v.name: v for v in description.modelVariables}
        for entry in root.iterfind("ModelVariables/*[@intermediateUpdate]"):
            variables[entry.get("name")].intermediateUpdate = entry.get("intermediateUpdate") in TRUE
        for entry in root.iterfind("ModelVariables/Clock"):
            _complete_clock(variables[entry.get("name")], entry)
        _leave_out_reciprocals(description, root)
    if description.generationTool == OWN_TOOL:
        _complete_annotations(description, ElementTree.fromstring(_text(source)))
    return description


def _read(source: Path) -> ModelDescription:
    """The description as fmpy reads it. An archive is opened and closed here: fmpy leaves the member that it reads
    open, and with it the file where a description is broken.
    """
    if source.is_dir() or source.suffix.lower() == ".xml":
        return read_model_description(str(source), validate=False)
    try:
        with source.open("rb") as file:
            return read_model_description(file, validate=False)
    except Exception:  # perhaps of buildDescription.xml, which nobody needs who has a library
        return read_model_description(_alone(source), validate=False)


def _alone(source: Path) -> BytesIO:
    """An archive with nothing but the model description of an FMU file."""
    alone = BytesIO()
    with zipfile.ZipFile(source) as archive, zipfile.ZipFile(alone, "w") as copy:
        copy.writestr(FILE, archive.read(FILE))
    return alone


def _leave_out_reciprocals(description: ModelDescription, root: ElementTree.Element) -> None:
    """Display units that are ``factor / value`` (``inverse`` of FMI 3.0), which fmpy takes for ``factor * value``."""
    for entry in root.iterfind("UnitDefinitions/Unit"):
        left_out = {display.get("name") for display in entry.iterfind("DisplayUnit") if display.get("inverse") in TRUE}
        for unit in description.unitDefinitions if left_out else ():
            if unit.name == entry.get("name"):
                unit.displayUnits = [display for display in unit.displayUnits if display.name not in left_out]


def _complete_clock(clock: ModelVariable, entry: ElementTree.Element) -> None:
    """The attributes of a clock, which fmpy 0.3.32 knows and does not read."""
    for name, convert in CLOCK_ATTRIBUTES.items():
        text = entry.get(name)
        if text is not None:
            setattr(clock, name, convert(text))


def _complete_annotations(description: ModelDescription, root: ElementTree.Element) -> None:
    """What outputs warn of and how variables are marked, which the FMUs of this package say in annotations."""
    made = {}
    entries = {entry.get("name"): entry for entry in root.iterfind("ModelVariables/*")}
    for variable in description.modelVariables:
        entry = entries[variable.name]
        said = _annotation(entry, ANNOTATION, ELEMENT)
        marks = [mark for mark, names in MARKS.items() if _annotation(entry, *names) is not None]
        warning = None
        if said is not None and said.text:
            reaches = said.get("reaches")
            warning = OutputWarning(
                said.text,
                tuple(said.get("shows", "").split()),
                said.get("atEnd") in TRUE,
                None if reaches is None else float(reaches),
            )
        if warning is not None or marks:
            made[variable.name] = AnnotatedVariable.of(variable, warning, marks)
    description.modelVariables = [made.get(v.name, v) for v in description.modelVariables]
    for unknown in (*description.outputs, *description.derivatives, *description.initialUnknowns):
        unknown.variable = made.get(unknown.variable.name, unknown.variable)
        unknown.dependencies = [made.get(v.name, v) for v in unknown.dependencies or ()] or unknown.dependencies


def _annotation(entry: ElementTree.Element, name: str, element: str) -> ElementTree.Element | None:
    """An annotation of a variable as FMI 2 or FMI 3 writes it."""
    places = (f"Tool[@name='{name}']", f"Annotation[@type='{name}']")
    return next((f for p in places if (f := entry.find(f"Annotations/{p}/{element}")) is not None), None)


def negated_aliases(source: Path) -> frozenset[str]:
    """Names of the variables of an FMI 1.0 FMU whose slave holds the value with the other sign; fmpy does not read
    it.

    Args:
        source: the user's file.
    """
    root = ElementTree.fromstring(_text(source))
    entries = root.iterfind("ModelVariables/ScalarVariable")
    return frozenset(entry.get("name", "") for entry in entries if entry.get("alias") == "negatedAlias")


def _complete_fmi_1(description: ModelDescription, root: ElementTree.Element) -> None:
    """Capabilities and direct dependencies of FMI 1.0 co-simulation, which fmpy leaves out."""
    interface = description.coSimulation
    found = root.find("Implementation/*/Capabilities")
    if interface is not None:
        interface.needsExecutionTool = root.find("Implementation/CoSimulation_Tool") is not None
        if found is not None:
            for name in FLAGS_OF_FMI_1:
                setattr(interface, name, found.get(name) in TRUE)
            interface.maxOutputDerivativeOrder = int(found.get("maxOutputDerivativeOrder", "0"))
    entries = {entry.get("name"): entry for entry in root.iterfind("ModelVariables/ScalarVariable")}
    by_name: dict[Any, ModelVariable] = {v.name: v for v in description.modelVariables}
    description.outputs = [
        Unknown(index=i, variable=v, dependencies=_direct(entries[v.name], by_name), sourceline=v.sourceline)
        for i, v in enumerate(description.modelVariables, 1)
        if v.causality == "output"
    ]


def _direct(entry: ElementTree.Element, variables: dict[Any, ModelVariable]) -> list[ModelVariable] | None:
    """The inputs an output of FMI 1.0 depends on directly, None where it does not say."""
    element = entry.find("DirectDependency")
    if element is None:
        return None
    names = [(name.text or "").strip() for name in element.iterfind("Name")]
    return [variables[name] for name in names if name in variables]


def _text(source: Path) -> bytes:
    if source.is_dir():
        return (source / FILE).read_bytes()
    with zipfile.ZipFile(source) as archive:
        return archive.read(FILE)
