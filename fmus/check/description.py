"""Model descriptions: as fmpy reads them, with what fmpy leaves out of FMI 3.0 added."""

from __future__ import annotations

import zipfile
from pathlib import Path
from xml.etree import ElementTree

from fmpy import read_model_description
from fmpy.model_description import ModelDescription

FILE = "modelDescription.xml"
LEFT_OUT = {
    "providesDirectionalDerivatives": "providesDirectionalDerivative",
    "providesAdjointDerivatives": "providesAdjointDerivatives",
}
"""Attributes of FMI 3.0 by their name in fmpy 0.3.32, which looks for the name of FMI 2.0 and finds nothing."""

ELEMENTS = {"CoSimulation": "coSimulation", "ModelExchange": "modelExchange"}
TRUE = {"true", "1"}


def read_description(source: Path) -> ModelDescription:
    """The model description of an FMU file or of the folder it was unpacked into; not validated.

    Raises:
        Exception: whatever a broken file makes the parsers throw.
    """
    description = read_model_description(str(source), validate=False)
    if str(description.fmiVersion).startswith("3"):
        root = ElementTree.fromstring(_text(source))
        for tag, held in ELEMENTS.items():
            element, interface = root.find(tag), getattr(description, held)
            if element is not None and interface is not None:
                for written, name in LEFT_OUT.items():
                    setattr(interface, name, element.get(written) in TRUE)
    return description


def _text(source: Path) -> bytes:
    if source.is_dir():
        return (source / FILE).read_bytes()
    with zipfile.ZipFile(source) as archive:
        return archive.read(FILE)
