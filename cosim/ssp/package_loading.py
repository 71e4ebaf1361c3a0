"""Loading: an SSP becomes the tables of a scenario, nested systems flattened, FMUs unpacked."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path as FilePath
from typing import Any

from cosim.coupling.transformation import as_affine
from cosim.errors import ScenarioError, nearest
from cosim.run.component_models import LATE_PARAMETERS
from cosim.scenario.package_names import split_variant
from cosim.ssp.annotation import DIGEST, digest
from cosim.ssp.bindings import start_values
from cosim.ssp.common import ValueMap
from cosim.ssp.document import Node, fail
from cosim.ssp.lapses import Lapses
from cosim.ssp.nets import Chain, Nets, Path
from cosim.ssp.package import DEFAULT_VARIANT, Package, Unpacked
from cosim.ssp.package_data import ComponentElement, SsdStructure
from cosim.ssp.pipe import Pipe, numeric
from cosim.ssp.reader import READS_BALISES
from cosim.ssp.system_structure import read_structure
from plant_models.user_file import names_code

ORIGIN = ("model", "observer", "as", "preset", "options", "late_policy", "replay_horizon")
"""Keys of a component that say where its FMU came from and how it treats late events."""
_DEFAULT_STEPS = 1000
"""Communication steps of a run where nothing says how long one should be."""


@dataclass
class Loaded:
    """A scenario out of an SSP.

    Args:
        tables: as in a scenario file; paths are absolute.
        warnings: what was not as it should be, and could be read all the same.
        unpacked: the folder of the FMUs, to be kept as long as they are needed.
    """

    tables: dict[str, Any]
    unpacked: Unpacked
    warnings: list[str] = field(default_factory=list)


def load_package(name: str, strict: bool = False) -> Loaded:
    """The scenario in an SSP.

    Args:
        name: path of the file, with ``#VARIANT`` for another structure than ``SystemStructure.ssd``.
        strict: whether form that is not as the standard wants it refuses the package; else it is a doubt.

    Raises:
        CosimError: something in it is missing, broken or cannot be carried out; with file and line.
    """
    path, variant = split_variant(name)
    unpacked = Unpacked()
    package = Package(FilePath(path), path, unpacked, Lapses(strict))
    return load_structure(read_structure(package, find_variant(package, variant)), package)


def list_variants(name: str) -> dict[str, str]:
    """The structures in an SSP: their names as ``#NAME`` takes them, the default one first, and the titles within them.

    Args:
        name: of the member.

    Raises:
        CosimError: one of them cannot be read.
    """
    path, _ = split_variant(name)
    package = Package(FilePath(path), path, Unpacked(), Lapses())
    return {member.removesuffix(".ssd"): read_structure(package, member).name for member in package.variants}


def find_variant(package: Package, variant: str) -> str:
    """The member that a variant's name means: its file name, with its ending or without, or the name written within it.

    Args:
        package: the open package.

    Raises:
        ScenarioError: there is none.
    """
    if not variant:
        return DEFAULT_VARIANT
    for member in package.variants:
        if variant in (member, member.removesuffix(".ssd")):
            return member
    for member in package.variants:
        if read_structure(package, member).name == variant:
            return member
    known = [member.removesuffix(".ssd") for member in package.variants]
    raise ScenarioError(f"{package.title} has no variant {variant!r}; {nearest(variant, known)}")


def load_structure(structure: SsdStructure, package: Package) -> Loaded:
    """The scenario of one system structure.

    Args:
        package: the open package.

    Raises:
        CosimError: something in it cannot be carried out.
    """
    nets = Nets(structure.system, package.lapses)
    if not nets.interfaces:
        fail(structure.system.node, "the system holds no component; there is nothing to run.")
    starts = start_values(nets, package.lapses)
    loaded = Loaded({}, package.unpacked)
    names = _flat_names([path for path in nets.interfaces if not _takes_our_place(nets, path, structure)])
    tables = loaded.tables
    tables |= {"title": structure.name, "description": structure.description}
    if not structure.extras:
        step = "" if structure.step is None else f"; communication step of {structure.step:g} s by its annotation"
        tables["source"] = f"SSP {structure.version}: {package.title}{step}"
    tables |= {key: value for key, value in structure.extras.items() if key not in ("components", "connections")}
    _localise_files(tables, package)
    tables |= _experiment(structure, nets, tables)
    tables["components"] = {names[path]: _component(nets, path, starts.get(path, {}), package.lapses) for path in names}
    tables["connections"] = [line for chain in nets.chains if (line := _connection(chain, nets, names)) is not None]
    loaded.warnings = package.lapses.lines()
    return loaded


def _component(nets: Nets, path: Path, parameters: Mapping[str, Any], lapses: Lapses) -> dict[str, Any]:
    element = nets.elements[path]
    assert isinstance(element, ComponentElement)
    extras = {key: value for key, value in element.extras.items() if key != READS_BALISES}
    made = extras.pop(DIGEST, None)
    if made is not None and made != digest(element.fmu):
        lapses.note(
            element.node, f"{element.member} is not the FMU that the annotation speaks of; it is used as it is."
        )
        extras = {key: value for key, value in extras.items() if key not in ORIGIN}
    code = [text for text in _named(extras) if names_code(text)]
    if code:
        lapses.note(element.node, f"the annotation names {code[0]}, code that no package holds; its FMU is used.")
        extras = {key: value for key, value in extras.items() if key not in ORIGIN}
    if "model" not in extras and "observer" not in extras:
        extras["fmu"] = str(element.fmu)
        extras |= {} if element.interface is None else {"interface": element.interface}
    own = {name: value for name, value in parameters.items() if name not in LATE_PARAMETERS & extras.keys()}
    return extras | ({"parameters": own} if own else {})


def _named(extras: Mapping[str, Any]) -> list[str]:
    """Texts that may name what an FMU was made from: model, observer, options."""
    options = extras.get("options")
    stated = [extras.get("model"), extras.get("observer"), *(options.values() if isinstance(options, dict) else ())]
    return [text for text in stated if isinstance(text, str)]


def _takes_our_place(nets: Nets, path: Path, structure: SsdStructure) -> bool:
    """Whether a component is a balise reader that was added for other tools; the balises of the structure's annotation
    do it.
    """
    element = nets.elements[path]
    assert isinstance(element, ComponentElement)
    added = element.extras.get(READS_BALISES) is True and "balises" in structure.extras
    return added and element.extras.get(DIGEST) == digest(element.fmu)


def _experiment(structure: SsdStructure, nets: Nets, tables: Mapping[str, Any]) -> dict[str, float]:
    """Start, stop and step, as far as they are known: from the structure, from annotations, or else from the FMUs."""
    experiments = [interface.description.defaultExperiment for interface in nets.interfaces.values()]
    times = {
        k: [t for e in experiments if (t := _finite(getattr(e, k, None))) is not None] for k in ("stopTime", "stepSize")
    }
    start = 0.0 if structure.start is None else structure.start
    stop = structure.stop if structure.stop is not None else max(times["stopTime"], default=None)
    known = {"start": start} | ({} if stop is None else {"stop": stop})
    if "step" in tables:
        return known
    if stop is None or not stop > start or not math.isfinite(stop):
        return known | ({} if structure.step is None else {"step": structure.step})
    wanted = structure.step or min((s for s in times["stepSize"] if s > 0.0), default=(stop - start) / _DEFAULT_STEPS)
    return known | {"step": (stop - start) / max(1, math.ceil((stop - start) / wanted - 1e-9))}


def _finite(text: str | None) -> float | None:
    """A time of an FMU's default experiment [s]; None where it says nothing that could be used."""
    try:
        time = math.nan if text is None else float(text)
    except ValueError:
        return None
    return time if math.isfinite(time) else None


def _connection(chain: Chain, nets: Nets, names: Mapping[Path, str]) -> str | dict[str, Any] | None:
    """A connection of the scenario, or None where no component drives the input."""
    root, sink, last = chain.root, chain.sink, chain.hops[-1].node
    if root.path not in names or sink.path not in names:
        return None
    if nets.kind(root) not in ("output", "inout"):
        fail(chain.hops[0].node, f"{root} is of kind {nets.kind(root)!r}; only outputs can drive inputs here.")
    source = f"{names[root.path]}.{root.name}{root.suffix}"
    target = f"{names[sink.path]}.{sink.name}{sink.suffix}"
    if not any(hop.suppress or hop.step is not None for hop in chain.hops) and _shows_own_units(chain, nets):
        return f"{source} -> {target}"
    own = nets.interfaces[root.path].unit(root.name)
    pipe = Pipe(own).through(nets.unit(root), False, None, chain.hops[0].node)
    for hop in chain.hops:
        pipe = pipe.through(nets.unit(hop.target), hop.suppress, hop.step, hop.node)
    pipe = pipe.through(nets.interfaces[sink.path].unit(sink.name), False, None, last)
    return {"from": source, "to": target, "units": "ignore"} | _effect(pipe, chain, nets)


def _shows_own_units(chain: Chain, nets: Nets) -> bool:
    """Whether both ends are in the units of their FMUs, so that the connection converts as any other does."""
    ends = (
        (point, nets.interfaces[point.path].unit(point.name), nets.unit(point)) for point in (chain.root, chain.sink)
    )
    return all((own is None and shown is None) or (own and shown and own.unit == shown.unit) for _, own, shown in ends)


def _effect(pipe: Pipe, chain: Chain, nets: Nets) -> dict[str, Any]:
    """What a pipe does, in the words of a connection's table."""
    if not pipe.maps:
        return {"factor": pipe.factor, "offset": pipe.offset}
    node, kinds = chain.hops[-1].node, {step.kind for step in pipe.maps}
    source, target = (nets.interfaces[point.path].items(point.name) for point in (chain.root, chain.sink))
    if kinds == {"Enumeration"}:
        table = _by_items(pipe.maps, source, target, node)
        domain = frozenset(map(float, source.values()))
    else:
        table = numeric(pipe.maps, node)
        domain = frozenset((0.0, 1.0)) if kinds == {"Boolean"} else frozenset(map(float, source.values()))
    simple = _simplest(table, domain)
    if len(simple) == 2 and not isinstance(simple[0], tuple):
        return {"factor": simple[0], "offset": simple[1]}
    return {"values": [list(entry) for entry in simple]}


def _localise_files(tables: dict[str, Any], package: Package) -> None:
    """Files that our annotation names become paths of unpacked ones."""
    balises = tables.get("balises")
    if isinstance(balises, dict) and balises.get("file") in package.sizes:
        tables["balises"] = balises | {"file": str(package.file(balises["file"]))}


def _by_items(
    maps: tuple[ValueMap, ...], source: Mapping[str, int], target: Mapping[str, int], node: Node
) -> dict[float, float]:
    """Tables of item names in a row as one of numbers; an item without an entry keeps its name, or else its number."""
    table: dict[float, float] = {}
    for first, value in source.items():
        name = first
        for step in maps:
            name = step.entries.get(name, name)
        if name != first and name not in target:
            fail(node, f"item {first!r} is mapped to {name!r}, which is no item of the target; {nearest(name, target)}")
        table[float(value)] = float(target.get(name, value))
    return table


def _simplest(
    table: Mapping[float, float], domain: frozenset[float]
) -> tuple[float, float] | tuple[tuple[float, float], ...]:
    """A table as ``(factor, offset)`` where that does the same on its domain, else as its entries that change
    something.
    """
    affine = as_affine(table, domain)
    if affine is not None:
        return affine
    return tuple((source, target) for source, target in sorted(table.items()) if source != target)


def _flat_names(paths: Iterable[Path]) -> dict[Path, str]:
    """A legal, unique component name for each path: its parts joined by ``__``, other characters than letters, digits
    and ``_`` replaced.
    """
    names: dict[Path, str] = {}
    for path in paths:
        parts = ["".join(c if c.isascii() and (c.isalnum() or c == "_") else "_" for c in part) for part in path]
        name = "__".join(parts)
        name = f"_{name}" if name[:1].isdigit() else name
        base, number = name, 2
        while name in names.values():
            name, number = f"{base}_{number}", number + 1
        names[path] = name
    return names
