"""The manifest and the experiments of FMI-LS-REF as plain data. Reads and writes XML text, no files.

FMI-LS-REF (Modelica Association, https://github.com/modelica/fmi-ls-ref, 1.0.0-alpha.1 and -beta.1 of 2025 and 2026)
keeps files that belong to an FMU under ``extra/org.fmi-standard.fmi-ls-ref/``. Its manifest names them with a role; a
``result`` is a table of outputs, as the Reference FMUs of the Modelica Association ship it (``NAME_out.csv``); an
``experiment`` names parameters (SSV), stimuli and references of a run. The format of experiments is that of the
appendix of alpha.1; from beta.1 on it is a document of its own, of which the elements are read by their names whatever
their namespace.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from posixpath import join, normpath
from typing import Any
from urllib.parse import quote, unquote, urlsplit

import numpy as np
from lxml import etree

from cosim.components.component import Component
from cosim.errors import BaselineError
from cosim.results.result import Result, SignalInfo
from cosim.results.si import in_si
from cosim.results.table_layout import table_dtype
from plant_models.hybrid.units import Unit

FOLDER = "extra/org.fmi-standard.fmi-ls-ref"
MANIFEST = f"{FOLDER}/fmi-ls-manifest.xml"
NAMESPACE = "http://fmi-standard.org/fmi-ls-manifest"
NAME = "org.fmi-standard.fmi-ls-ref"
VERSION = "1.0.0-alpha.1"
DESCRIPTION = "Layered Standard providing information on related files included in an FMU."
CSV, SSV, EXPERIMENTS, JSON = (
    "text/csv",
    "application/x-ssp-parameter-set",
    "application/x-ma-ls-experiments",
    "application/json",
)
TIMES = ("startTime", "stopTime", "stepSize")


_REALS = ("Real", "Float64", "Float32")


def prefix(component: str) -> str:
    """What stands before the name of a variable in a table of a run.

    Args:
        component: name of the component.
    """
    return f"{component}."


def as_of_a_run(result: Result, component: Component) -> Result:
    """A table of the FMU's variables as a run would give it: named by component, in SI, with what the FMU says of
    them.

    Args:
        result: the table, in the units of the FMU.
        component: the component of the FMU.
    """
    names = [info.name for info in result.signals]
    table = np.empty(len(result.table), table_dtype(["time", *(prefix(component.name) + name for name in names)]))
    table["time"] = result.time
    for name in names:
        table[prefix(component.name) + name] = result.table[name]
    table, signals = in_si(
        table, [_info(info, component) for info in result.signals], lambda name: _unit(name, component)
    )
    return replace(result, table=table, signals=signals)


def in_units_of(result: Result, component: Component) -> Result:
    """A table of a run in the units of the FMU's variables; names stay.

    Args:
        result: the table of a run, in SI.
        component: the component of the FMU.
    """
    table = np.array(result.table)
    for info in result.signals:
        unit = _unit(info.name, component)
        if unit is not None and (unit.factor, unit.offset) != (1.0, 0.0):
            table[info.name] = (table[info.name] - unit.offset) / unit.factor
    return replace(result, table=table)


def _unit(name: str, component: Component) -> Unit | None:
    short = name.removeprefix(prefix(component.name))
    return component.unit(short) if short in component.variables else None


def _info(info: SignalInfo, component: Component) -> SignalInfo:
    whole = prefix(component.name) + info.name
    if info.name not in component.variables:
        return replace(info, name=whole)
    variable = component.variables[info.name]
    held = variable.variability not in ("continuous", None) or variable.type not in _REALS
    unit = component.unit_name(info.name) or info.unit
    return SignalInfo(whole, unit, None, "discrete" if held else "continuous", variable.description or "")


@dataclass(frozen=True)
class Related:
    """A file that the manifest names.

    Args:
        member: its path in the archive. role: ``result``, ``experiment``, ... type: MIME type. description: for people.
    """

    member: str
    role: str
    type: str = "application/octet-stream"
    description: str = ""


@dataclass(frozen=True)
class Experiment:
    """A run that can be repeated.

    Args:
        name, description: for people. start, stop, step: [s]; None for those of the FMU.
        parameters, stimuli, references: paths in the archive; empty where there is none.
    """

    name: str
    description: str = ""
    start: float | None = None
    stop: float | None = None
    step: float | None = None
    parameters: str = ""
    stimuli: str = ""
    references: str = ""


def parse(text: bytes, file: str) -> Any:
    """The root element of a file.

    Args:
        text: content of the file.
        file: its name, for messages.

    Raises:
        BaselineError: it is not XML, or declares a document type.
    """
    parser = etree.XMLParser(
        resolve_entities=False, no_network=True, load_dtd=False, remove_comments=True, remove_pis=True
    )
    try:
        root = etree.fromstring(text, parser)
    except etree.XMLSyntaxError as error:
        raise BaselineError(f"{file}, line {error.lineno}: not readable as XML: {error.msg}.") from error
    if root.getroottree().docinfo.doctype:
        raise BaselineError(f"{file}: holds a document type declaration, which may hide anything; refused.")
    return root


def read_manifest(text: bytes, file: str) -> list[Related]:
    """The files a manifest names.

    Args:
        text: content of the file.
        file: its name, for messages.

    Raises:
        BaselineError: it is not a manifest of FMI-LS-REF.
    """
    root = parse(text, file)
    if _local(root) != "fmiReferences":
        raise BaselineError(f"{file}: expected the element fmiReferences of FMI-LS-REF, got {_local(root)}.")
    return [
        Related(
            _member(node.get("source"), MANIFEST),
            node.get("role", "other"),
            node.get("type", ""),
            node.get("description", ""),
        )
        for node in root
        if _local(node) == "Related" and node.get("source")
    ]


def read_experiments(text: bytes, member: str) -> list[Experiment]:
    """The experiments in a file of the archive.

    Args:
        text: content of the file.
        member: its name in the archive; the files it names stand beside it.

    Raises:
        BaselineError: it is not a file of experiments.
    """
    root = parse(text, member)
    if _local(root) != "Experiments":
        raise BaselineError(f"{member}: expected the element Experiments, got {_local(root)}.")
    return [_experiment(node, member) for node in root if _local(node) == "Experiment"]


def _experiment(node: Any, member: str) -> Experiment:
    sources = {_local(child): _member(child.get("source", ""), member) for child in node}
    try:
        times = [None if node.get(key) is None else float(node.get(key)) for key in TIMES]
    except ValueError as error:
        raise BaselineError(f"{member}: experiment {node.get('name')!r}: {error}.") from error
    files = [sources.get(key, "") for key in ("Parameters", "Stimuli", "References")]
    return Experiment(node.get("name", ""), node.get("description", ""), times[0], times[1], times[2], *files)


def _local(node: Any) -> str:
    return str(etree.QName(node).localname)


def _member(source: str, beside: str) -> str:
    """Path in the archive of a relative URI; empty for what lies outside of it."""
    parts = urlsplit(source)
    if parts.scheme or parts.netloc or not parts.path or parts.path.startswith("/"):
        return ""
    path = normpath(join(beside.rpartition("/")[0], unquote(parts.path)))
    return "" if path.startswith("..") else path


def manifest_text(related: list[Related], former: bytes | None) -> bytes:
    """A manifest with these files beside those it named before.

    Args:
        related: files in the folder of the standard. former: the manifest to be added to; None for a new one.
    """
    if former is None:
        root = etree.Element("fmiReferences", nsmap={"fmi-ls": NAMESPACE})
        for key, value in (("name", NAME), ("version", VERSION), ("description", DESCRIPTION)):
            root.set(f"{{{NAMESPACE}}}fmi-ls-{key}", value)
    else:
        root = parse(former, MANIFEST)
        ours = {entry.member for entry in related}
        for node in [n for n in root if _local(n) == "Related" and _member(n.get("source", ""), MANIFEST) in ours]:
            root.remove(node)
    place = next((k for k, node in enumerate(root) if _local(node) == "Annotations"), len(root))
    for offset, entry in enumerate(related):
        source = quote(entry.member.removeprefix(f"{FOLDER}/"))
        node = etree.Element("Related", type=entry.type, source=source, role=entry.role, description=entry.description)
        root.insert(place + offset, node)
    return _bytes(root)


def experiments_text(experiment: Experiment) -> bytes:
    """A file with one experiment, whose files stand beside it.

    Args:
        experiment: with the names of its files.
    """
    root = etree.Element("Experiments", name=experiment.name, description=experiment.description)
    times = (experiment.start, experiment.stop, experiment.step)
    instants = {key: repr(value) for key, value in zip(TIMES, times, strict=True) if value is not None}
    node = etree.SubElement(root, "Experiment", name=experiment.name, description=experiment.description, **instants)
    files = (experiment.parameters, experiment.stimuli, experiment.references)
    for tag, member in zip(("Parameters", "Stimuli", "References"), files, strict=True):
        if member:
            etree.SubElement(node, tag, source=quote(member.rpartition("/")[2]))
    return _bytes(root)


def _bytes(root: Any) -> bytes:
    etree.indent(root, space="  ")
    return bytes(etree.tostring(root, xml_declaration=True, encoding="UTF-8", pretty_print=True))
