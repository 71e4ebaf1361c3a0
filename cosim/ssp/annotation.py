"""What stands beside a structure: parameter sets and mappings, read, and our annotation, read and written.

The annotation holds what a scenario says and SSP has no word for. Other tools may ignore it; nothing in it is needed to
run. One annotation on the structure holds the step, balises, report and master settings, one on a component where its
FMU came from. The content is JSON, in the words of a scenario file.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from lxml import etree

from cosim.ssp.common import UnitTable, read_type
from cosim.ssp.document import NAMESPACES, Node, fail, find, find_all
from cosim.ssp.lapses import Lapses
from cosim.ssp.package_data import Parameter

_TYPE = "fmu-observer.scenario"
NAMESPACE = "urn:fmu-observer:scenario:1"
DIGEST = "fmu_sha256"
"""Key of a component's annotation: digest of the FMU that it speaks of."""


LISTS = ("String", "Enumeration", "Binary")
"""Types whose values may hold spaces: an array of them is written as Value elements."""


def read_parameter_set(root: Node, prefix: str, lapses: Lapses) -> tuple[Parameter, ...]:
    """The parameters of a valid ParameterSet.

    Args:
        root: its element. prefix: put before every name. lapses: receives units that are not defined.

    Raises:
        ScenarioError: a name is given twice, or the number of values is not that of the dimensions.
    """
    units = UnitTable(root, "ssv", lapses)
    parameters: dict[str, Parameter] = {}
    for node in find_all(root, "ssv:Parameters/ssv:Parameter"):
        parameter = _parameter(node, units, prefix)
        if parameter.name in parameters:
            fail(node, f"parameter {node.get('name')!r} is given twice in this set.")
        parameters[parameter.name] = parameter
    return tuple(parameters.values())


def _parameter(node: Node, units: UnitTable, prefix: str) -> Parameter:
    kind = read_type(node, units, "ssv")
    assert kind is not None, "the schema demands a type"
    holder = find(node, f"ssv:{kind.name}")
    sizes = [dimension.get("size") for dimension in find_all(node, "ssc:Dimension")]
    values = _texts(holder, kind.name)
    count = 1
    for size in sizes:
        if size is None:
            fail(node, f"parameter {node.get('name')!r}: a dimension of a parameter needs its size.")
        count *= int(size)
    if len(values) != count:
        fail(node, f"parameter {node.get('name')!r} has {len(values)} values where its dimensions ask for {count}.")
    return Parameter(prefix + node.get("name"), kind, values, bool(sizes), node)


def _texts(holder: Node, kind: str) -> tuple[str, ...]:
    value = holder.get("value")
    if kind not in LISTS:
        return tuple(value.split())
    items = tuple(item.get("value") for item in find_all(holder, "ssv:Value"))
    if value is not None and items:
        fail(holder, "has both an attribute 'value' and Value elements; give one of them.")
    return items or (() if value is None else (value,))


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
