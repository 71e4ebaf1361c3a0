"""Parameter values (SSV) and parameter mappings (SSM): from elements to plain data. Reads elements only."""

from __future__ import annotations

from cosim.ssp.common import UnitTable, read_transformation, read_type
from cosim.ssp.document import Node, fail, find, find_all, flag
from cosim.ssp.lapses import Lapses
from cosim.ssp.package_data import Parameter, SsdEntry

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


def read_mapping(root: Node) -> tuple[SsdEntry, ...]:
    """The entries of a valid ParameterMapping.

    Args:
        root: element of the document.

    Raises:
        ScenarioError: two entries have one target.
    """
    entries: dict[str, SsdEntry] = {}
    for node in find_all(root, "ssm:MappingEntry"):
        source, target = node.get("source"), node.get("target")
        if target in entries:
            fail(node, f"two parameters are mapped to {target!r}; map one.")
        entries[target] = SsdEntry(
            source, target, flag(node, "suppressUnitConversion"), read_transformation(node), node
        )
    return tuple(entries.values())


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
