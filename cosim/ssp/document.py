"""Documents: the XML files of SSP, parsed, checked against the schemas of the standard, and every fault with file and
line.

Touches lxml and the schema files beside it, nothing else of the package. The schemas are those of the standard
(Modelica Association Project SSP, BSD 2-clause; each holds its licence).
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from functools import cache
from pathlib import Path
from typing import Any, NoReturn

from lxml import etree

from cosim.errors import ScenarioError

VERSIONS = ("1.0", "2.0")
SCHEMAS = Path(__file__).parent / "schema"
NAMESPACES = {
    "ssc": "http://ssp-standard.org/SSP1/SystemStructureCommon",
    "ssd": "http://ssp-standard.org/SSP1/SystemStructureDescription",
    "ssv": "http://ssp-standard.org/SSP1/SystemStructureParameterValues",
    "ssm": "http://ssp-standard.org/SSP1/SystemStructureParameterMapping",
    "ssb": "http://ssp-standard.org/SSP1/SystemStructureSignalDictionary",
}
"""By the usual prefix; versions 1.0 and 2.0 share them."""
_ROOTS = {
    "ssd": "SystemStructureDescription",
    "ssv": "ParameterSet",
    "ssm": "ParameterMapping",
    "ssb": "SignalDictionary",
}
FILES = {
    "ssd": "SystemStructureDescription",
    "ssv": "SystemStructureParameterValues",
    "ssm": "SystemStructureParameterMapping",
    "ssb": "SystemStructureSignalDictionary",
}
_FAULTS_SHOWN = 3
_UNDECLARED = re.compile(r"Namespace prefix (\S+) (?:on|for) .* is not defined")
"""What libxml2 says of a prefix without declaration."""
_FIRST_ELEMENT = re.compile(rb"<[A-Za-z_][\w:.-]*")
Node = Any
"""An element of lxml; its `base` is the name of the file it stands in."""


def parse(text: bytes, file: str, kind: str, undeclared: Callable[[str, str], None] | None = None) -> Node:
    """The root of a file of SSP, valid against the schema of its version.

    Args:
        text: its content. file: its name for messages. kind: ``ssd``, ``ssv``, ``ssm`` or ``ssb``.
        undeclared: receives each prefix that is used and not declared, and of the namespace that is taken for it;
            without it such a file is refused.

    Raises:
        ScenarioError: it is not XML, of another kind or version, or not as the schema wants it; with the line.
    """
    parser = etree.XMLParser(
        resolve_entities=False, no_network=True, load_dtd=False, remove_comments=True, remove_pis=True
    )
    try:
        root = etree.fromstring(text, parser, base_url=file)
    except etree.XMLSyntaxError as error:
        prefixes = _undeclared(parser.error_log)
        if prefixes and undeclared is not None:
            for prefix in prefixes:
                undeclared(prefix, _namespace_of(prefix))
            return parse(_declared(text, prefixes), file, kind)
        raise ScenarioError(f"{file}, line {error.lineno}: not readable as XML: {error.msg}.") from error
    if root.getroottree().docinfo.doctype:
        raise ScenarioError(
            f"{file}: holds a document type declaration; files of SSP have none, and it may hide anything."
        )
    return validated(root, file, kind)


def validated(root: Node, file: str, kind: str) -> Node:
    """An element that is to be the root of a part of SSP, also where it stands inline in another file.

    Args:
        kind: of the document.

    Raises:
        ScenarioError: it is another element, of an unknown version, or not as the schema wants it; with the line.
    """
    expected = f"{{{NAMESPACES[kind]}}}{_ROOTS[kind]}"
    if root.tag != expected:
        raise ScenarioError(
            f"{file}, line {root.sourceline}: element {short(root.tag)!r} of namespace {_namespace(root.tag)!r}, "
            f"expected {_ROOTS[kind]!r} of namespace {NAMESPACES[kind]!r}."
        )
    version = root.get("version")
    if version not in VERSIONS:
        known = " and ".join(VERSIONS)
        raise ScenarioError(f"{file}, line {root.sourceline}: version {version!r} of SSP is not known; {known} are.")
    schema = _schema(version, kind)
    if not schema.validate(root):
        faults = list(schema.error_log)
        lines = [f"{file}, line {fault.line}: {_plain(fault.message)}" for fault in faults[:_FAULTS_SHOWN]]
        more = [f"{file}: and {len(faults) - _FAULTS_SHOWN} more."] if len(faults) > _FAULTS_SHOWN else []
        raise ScenarioError("\n".join([*lines, *more]))
    return root


def _namespace_of(prefix: str) -> str:
    """The namespace that a prefix usually stands for; one of its own where none is known."""
    return NAMESPACES.get(prefix, f"urn:undeclared:{prefix}")


def find(node: Node, path: str) -> Node:
    """The first descendant at a path such as ``ssd:Elements/ssd:Component``, or None.

    Args:
        node: element of the document.
    """
    return node.find(path, NAMESPACES)


def find_all(node: Node | None, path: str) -> list[Node]:
    """All descendants at a path; none of a node that is missing."""
    return [] if node is None else list(node.findall(path, NAMESPACES))


def short(tag: str) -> str:
    """The name of an element without its namespace.

    Args:
        tag: name with its namespace.
    """
    return tag.rpartition("}")[2]


def place(node: Node) -> str:
    """Where an element stands: file and line.

    Args:
        node: element of the document.
    """
    return f"{node.base}, line {node.sourceline}"


def fail(node: Node, message: str) -> NoReturn:
    """Refuse what stands at an element.

    Args:
        node: element of the document. message: what is wrong.

    Raises:
        ScenarioError: always.
    """
    raise ScenarioError(f"{place(node)}: {message}")


def flag(node: Node, name: str) -> bool:
    """An attribute of type xs:boolean, false where it is missing.

    Args:
        node: element of the document. name: of the attribute.
    """
    return node.get(name, "false").strip() in ("true", "1")


@cache
def _schema(version: str, kind: str) -> Any:
    return etree.XMLSchema(file=str(SCHEMAS / version / f"{FILES[kind]}.xsd"))


def _undeclared(faults: Iterable[Any]) -> list[str]:
    """The prefixes without declaration, where nothing else is wrong with a text; in the order in which they are met."""
    found = [_UNDECLARED.match(entry.message) for entry in faults]
    return list(dict.fromkeys(match[1] for match in found if match)) if all(found) else []


def _declared(text: bytes, prefixes: Iterable[str]) -> bytes:
    """The text with declarations of prefixes in its first element."""
    added = "".join(f' xmlns:{prefix}="{_namespace_of(prefix)}"' for prefix in prefixes)
    return _FIRST_ELEMENT.sub(lambda match: match[0] + added.encode(), text, count=1)


def _namespace(tag: str) -> str:
    return tag[1:].partition("}")[0] if tag.startswith("{") else ""


def _plain(message: str) -> str:
    return re.sub(r"\{http[^{}]*\}", "", message)
