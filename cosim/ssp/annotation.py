"""Our annotation: what a scenario says and SSP has no word for. Other tools may ignore it; nothing in it is needed to
run.

One annotation on the structure holds the step, balises, report and master settings, one on a component where its FMU
came from. The content is JSON, in the words of a scenario file.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from lxml import etree

from cosim.ssp.document import NAMESPACES, Node, fail, find_all

_TYPE = "fmu-observer.scenario"
NAMESPACE = "urn:fmu-observer:scenario:1"
DIGEST = "fmu_sha256"
"""Key of a component's annotation: digest of the FMU that it speaks of."""


def read_extras(node: Node) -> dict[str, Any]:
    """What our annotation on an element says; nothing where it has none.

    Args:
        node: element of the document.

    Raises:
        ScenarioError: the annotation is not what this package writes.
    """
    for annotation in find_all(node, "ssd:Annotations/ssc:Annotation"):
        if annotation.get("type") == _TYPE:
            holder = annotation.find(f"{{{NAMESPACE}}}extras")
            try:
                extras = json.loads("" if holder is None else holder.text or "")
            except json.JSONDecodeError as error:
                fail(annotation, f"the annotation {_TYPE!r} is not JSON: {error}.")
            if not isinstance(extras, dict):
                fail(annotation, f"the annotation {_TYPE!r} is not a table of keys.")
            return extras
    return {}


def write_extras(extras: Mapping[str, Any]) -> Node:
    """An ``ssd:Annotations`` element with our annotation.

    Args:
        extras: what the standard has no place for.
    """
    outer = etree.Element(f"{{{NAMESPACES['ssd']}}}Annotations")
    annotation = etree.SubElement(outer, f"{{{NAMESPACES['ssc']}}}Annotation", type=_TYPE)
    holder = etree.SubElement(annotation, f"{{{NAMESPACE}}}extras", nsmap={None: NAMESPACE})
    holder.text = json.dumps(extras, indent=1)
    return outer


def digest(path: Path) -> str:
    """SHA-256 of a file.

    Args:
        path: of the file.
    """
    return hashlib.sha256(path.read_bytes()).hexdigest()
