"""Export: a scenario becomes a system structure package that other tools can read, and this one reads back to the same
run.
"""

from __future__ import annotations

import logging
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fmpy.model_description import ModelDescription

from cosim.balises.layout import TrackLayout
from cosim.components.loading import describe_fmu
from cosim.components.start_values import start_values
from cosim.errors import CosimError, CouplingError, OutputError, ScenarioError, nearest
from cosim.run.backends import NATIVE
from cosim.run.component_models import LATE_PARAMETERS, OWN_PACKAGES, make_system, native_fmu
from cosim.run.connections import parse_connections
from cosim.run.layouts import make_layout
from cosim.run.run_seeds import component_seed, with_seeds
from cosim.scenario.scenario_tables import ComponentTable
from cosim.scenario.schema import ScenarioTable
from cosim.ssp.annotation import DIGEST, digest, write_extras
from cosim.ssp.common import FAMILIES, INTEGER, REAL
from cosim.ssp.document import VERSIONS, Node
from cosim.ssp.elements_of_data import TOOL, Definitions, add_connector, add_parameter, child, root_of, text_of
from cosim.ssp.interfaces import Interface
from cosim.ssp.package import DEFAULT_VARIANT
from cosim.ssp.reader import READS_BALISES, Reader, is_notified_by_counts, make_reader
from fmu_observer.event_protocol import EventProtocol
from fmus.pack import check_target, pack_fmu
from plant_models.hybrid.noise import RUN_SEED
from plant_models.railway.sensors.balise_reader import BaliseReader

_ELEMENT_OF_ARRAY = re.compile(r"(.+)\[(\d+(?:,\d+)*)\]")
_BALISES_FILE = "resources/balises.csv"
_MOST_BALISES = max(BaliseReader.option_choices["balise_capacity"])
MADE_FROM = frozenset({"model", "observer", "backend", "preset", "options"})
LOG = logging.getLogger("cosim")


@dataclass(frozen=True)
class _ExportedPart:
    """A component on its way into a package.

    Args:
        table: of the scenario. fmu: its FMU. member: name of that in the package. interface: what it says of its
            variables. left_out: keys of the table that mean nothing elsewhere: what it was made from, where that is
            code of the user's; its FMU stands for it.
    """

    table: ComponentTable
    fmu: Path
    member: str
    interface: Interface
    left_out: frozenset[str] = frozenset()


def export_package(table: ScenarioTable, name: str, folder: Path, where: str, path: Path, version: str) -> Path:
    """Write a scenario as an SSP.

    Args:
        table: validated scenario. name: its name. folder: start of relative paths. where: place for messages.
        path: of the package. version: of SSP.

    Raises:
        CosimError: an FMU cannot be read or built, or the scenario says what SSP has no words for.
        OutputError: the file cannot be written.
    """
    if version not in VERSIONS:
        raise ScenarioError(f"{where}: SSP {version!r} cannot be written; {' and '.join(VERSIONS)} can.")
    if path.suffix.lower() != ".ssp":
        raise OutputError(f"{path}: the name of a system structure package ends in .ssp.")
    try:
        check_target(path)
        exporter = _Exporter(table, name, folder, where, version)
        exporter.build()
        return pack_fmu(exporter.files, path)
    except CosimError:
        raise
    except OSError as error:
        raise OutputError(f"{path} cannot be written: {error}") from error
    except ValueError as error:  # of the XML library, for texts that XML cannot hold
        raise ScenarioError(f"{where}: cannot be written as XML: {error}") from error


class _Exporter:
    """Collects the files of one package."""

    def __init__(self, table: ScenarioTable, name: str, folder: Path, where: str, version: str) -> None:
        self.table, self.name, self.folder, self.where, self.version = table, name, folder, where, version
        self.files: dict[str, bytes] = {}
        self.definitions = Definitions()
        self.parts: dict[str, _ExportedPart] = {}
        self.seeds: dict[str, dict[str, int]] = {}

    def build(self) -> None:
        """All files."""
        if self.table.network is not None:
            raise ScenarioError(
                f"{self.where}: network: SSP knows of no network; put the block 'network_protocol' between the "
                f"components, which is exported with them."
            )
        if self.table.balises is not None and self.table.balises.layout == "recorded":
            raise ScenarioError(
                f"{self.where}: balises: recorded telegrams cannot be exported; lay the balises by 'positions' or "
                f"'instants'."
            )
        for name, component in self.table.components.items():
            self.parts[name] = self.part(name, component)
        reader = self.reader()
        if reader is not None:
            self.parts[reader.name] = self.part(reader.name, reader.table)
        root = root_of(
            "ssd",
            "SystemStructureDescription",
            self.version,
            name=self.table.title,
            description=self.table.description.strip(),
            generationTool=TOOL,
        )
        system = child(root, "ssd", "System", name=self.name)
        elements = child(system, "ssd", "Elements")
        for name, part in self.parts.items():
            self.add_component(elements, name, part, {READS_BALISES: True} if reader and name == reader.name else {})
        self.add_connections(system, [*self.table.connections, *(reader.links if reader else ())])
        self.definitions.write(root, "ssd")
        child(root, "ssd", "DefaultExperiment", startTime=repr(self.table.start), stopTime=repr(self.table.stop))
        root.append(write_extras(self.extras()))
        self.files[DEFAULT_VARIANT] = text_of(root)

    def reader(self) -> Reader | None:
        """The component that notifies the others of balises in a tool that has none, where one is needed and can be
        made.
        """
        balises = with_seeds(self.table).balises
        if balises is None:
            return None
        layout = make_layout(balises, self.table.start, self.table.stop, self.folder, self.where)
        listed = isinstance(layout, TrackLayout) and (
            balises.layout == "spacing" or len(layout.positions) <= _MOST_BALISES
        )
        if not isinstance(layout, TrackLayout) or not listed:
            why = f"layout '{balises.layout}' says when balises are passed and not where"
            if isinstance(layout, TrackLayout):
                why = f"a reader holds at most {_MOST_BALISES} balises and there are {len(layout.positions)}"
            LOG.warning(
                "%s: other tools will notify the observers of no balises, for no reader could be added: %s.",
                self.where,
                why,
            )
            return None
        interfaces = {name: part.interface for name, part in self.parts.items()}
        taken = {link[1] for link in parse_connections(self.table.connections, self.where)}
        newest = max(
            (
                3
                for interface in interfaces.values()
                if is_notified_by_counts(interface) and interface.description.fmiVersion[0] == "3"
            ),
            default=2,
        )
        return make_reader(balises, layout, interfaces, taken, newest)

    def part(self, name: str, component: ComponentTable) -> _ExportedPart:
        """A component with its FMU, which is built where it is a model of this package."""
        place = f"{self.where}: components.{name}"
        if component.recording is not None:
            raise ScenarioError(
                f"{place}: a recording is no FMU, and a system structure package holds FMUs; export the scenario with "
                "the plant that was recorded, or leave the recording out and connect its signals in the other tool."
            )
        if component.filter is not None:
            raise ScenarioError(
                f"{place}: a filter over an FMU is no FMU itself, and a system structure package holds FMUs."
            )
        system = make_system(component, place)
        if system is None and component.fmu is None:
            raise ScenarioError(f"{place}: plain Python is no FMU, and a system structure package holds FMUs.")
        if system is None:
            fmu = (self.folder / str(component.fmu)).resolve()
        else:
            version = 2 if self.version == "1.0" else int((component.backend or NATIVE)[-1])
            # A master that knows no event mode can notify an FMU of events by counts only.
            counts = None if self.table.balises is None else EventProtocol("counts")
            fmu = native_fmu(system, version, component.preset, place, counts if system.triggered_events else None)
        interface = Interface(self.checked(fmu, name, component), f"component {name!r}")
        if self.version == "1.0" and interface.description.fmiVersion.startswith("3"):
            raise ScenarioError(
                f"{place}: {fmu.name} is an FMU of FMI 3.0, which SSP 1.0 does not know; export with version 2.0."
            )
        content = fmu.read_bytes()
        member = next((m for m, known in self.files.items() if known == content), f"resources/{name}.fmu")
        self.files[member] = content
        foreign = system is not None and type(system).__module__.partition(".")[0] not in OWN_PACKAGES
        return _ExportedPart(component, fmu, member, interface, MADE_FROM if foreign else frozenset())

    def checked(self, fmu: Path, name: str, table: ComponentTable) -> ModelDescription:
        """The description of an FMU, arrays as its structural parameters make them, once its parameters fit."""
        try:
            component = describe_fmu(fmu, name, table.units, table.interface)
            seed = component_seed(component, table.parameters, self.table.seed)
            start_values(component, table.parameters | seed)
            self.seeds[name] = {} if self.table.seed == RUN_SEED else seed  # else the FMU finds the same by its name
        except CouplingError as error:
            raise ScenarioError(f"{self.where}: {error}") from error
        return component.description

    def add_component(self, parent: Node, name: str, part: _ExportedPart, more: Mapping[str, Any]) -> None:
        """A component with its connectors, parameters and origin, and what else its annotation says."""
        node = child(parent, "ssd", "Component", name=name, type="application/x-fmu-sharedlibrary", source=part.member)
        if part.table.interface is not None:
            node.set("implementation", {"co-simulation": "CoSimulation"}.get(part.table.interface, "ModelExchange"))
        variables = [v for v in part.interface.variables.values() if v.causality in ("input", "output")]
        if variables:
            connectors = child(node, "ssd", "Connectors")
            for variable in variables:
                unit, items = part.interface.unit(variable.name), part.interface.items(variable.name)
                add_connector(connectors, variable, self.definitions, unit, items)
        values = self.parameter_file(name, part)
        if values is not None:
            self.files[f"resources/{name}.ssv"] = values
            child(child(node, "ssd", "ParameterBindings"), "ssd", "ParameterBinding", source=f"resources/{name}.ssv")
        own = part.table.model_dump(
            mode="json", by_alias=True, exclude_unset=True, exclude={"fmu", "parameters", *part.left_out}
        )
        node.append(write_extras(own | {DIGEST: digest(part.fmu), **more}))

    def parameter_file(self, name: str, part: _ExportedPart) -> bytes | None:
        """The parameter set of a component, or None where it has none."""
        late = {k: getattr(part.table, k) for k in sorted(part.table.model_fields_set & LATE_PARAMETERS)}
        stated = {k: v for k, v in late.items() if k in part.interface.variables} | part.table.parameters
        stated |= self.seeds[name]
        if not stated:
            return None
        root = root_of("ssv", "ParameterSet", self.version, name=name, generationTool=TOOL)
        parameters = child(root, "ssv", "Parameters")
        for key, value in stated.items():
            for variable, values, shape in self.assignments(name, part.interface, key, value):
                self.add_parameter(parameters, part.interface, variable, values, shape)
        return text_of(root)

    def assignments(
        self, name: str, interface: Interface, key: str, value: Any
    ) -> list[tuple[str, list[Any], list[int]]]:
        """Variables with values and shape that one key of `parameters` stands for."""
        shape: list[int] = []
        values = [value]
        while values and isinstance(values[0], list):
            shape.append(len(values[0]))
            values = [v for row in values for v in row]
        split = [v for v in interface.variables if v.startswith(f"{key}[")]
        if key in interface.variables:
            return [(key, values, shape)]
        if key.rpartition("[")[0] in interface.variables:
            what = "an element of an array; SSP sets whole arrays only, so give all values"
            raise ScenarioError(f"{self.where}: components.{name}.parameters: {key!r} is {what}.")
        if not split:
            hint = nearest(key, interface.variables)
            raise ScenarioError(f"{self.where}: components.{name}.parameters: {name} has no variable {key!r}; {hint}")
        if not shape:
            return [(v, values, []) for v in split]
        return [(f"{key}[{i}]", [v], []) for i, v in enumerate(values, start=1)]

    def add_parameter(
        self, parent: Node, interface: Interface, name: str, values: list[Any], shape: Sequence[int]
    ) -> None:
        """One parameter in the words of SSP: a number, an item by its name.

        Numbers are in the unit of the variable, which the standard takes where none is written; a Float64 with a unit
        is not read by OMSimulator (November 2025).
        """
        if name not in interface.variables:
            raise ScenarioError(
                f"{self.where}: {interface.what} has no variable {name!r}; {nearest(name, interface.variables)}"
            )
        kind = str(interface.variables[name].type)
        if kind == "Enumeration" and not interface.items(name):
            kind = "Integer"
        elif kind == "Enumeration":
            names = {number: item for item, number in interface.items(name).items()}
            values = [v if isinstance(v, str) else names.get(int(v), v) for v in values]
        if shape and self.version == "1.0":
            raise ScenarioError(
                f"{self.where}: {interface.what}: {name} is an array, which SSP 1.0 does not know; use version 2.0."
            )
        add_parameter(parent, name, kind, values, shape)

    def add_connections(self, system: Node, written: Sequence[Any]) -> None:
        """The connections of the root system, as a scenario writes them."""
        links = parse_connections(written, self.where)
        holder = child(system, "ssd", "Connections") if links else None
        for source, target, *stated in links:
            ends = [self.end(name, causality) for name, causality in ((source, "output"), (target, "input"))]
            attributes = {
                f"{side}{key}": text for side, end in zip(("start", "end"), ends, strict=True) for key, text in end
            }
            transformation = stated[0] if stated else None
            if transformation is not None and not transformation.convert_units:
                attributes["suppressUnitConversion"] = "true"
            node = child(holder, "ssd", "Connection", **attributes)
            if transformation is not None:
                self.add_transformation(node, source, target, transformation)

    def end(self, name: str, causality: str) -> list[tuple[str, str]]:
        """The attributes of one end of a connection."""
        component, _, signal = name.partition(".")
        if component not in self.parts:
            raise ScenarioError(
                f"{self.where}: connections: no component {component!r}; {nearest(component, self.parts)}"
            )
        variables = self.parts[component].interface.variables
        known = [v for v, variable in variables.items() if variable.causality == causality]
        found = _ELEMENT_OF_ARRAY.fullmatch(signal)
        if signal in known:
            return [("Element", component), ("Connector", signal)]
        if found is None or found[1] not in known:
            hint = nearest(signal, known)
            raise ScenarioError(f"{self.where}: connections: {component} has no {causality} {signal!r}; {hint}")
        if self.version == "1.0":
            raise ScenarioError(
                f"{self.where}: connections: {name} is an element of an array, which SSP 1.0 does not know."
            )
        return [("Element", component), ("Connector", found[1]), ("Indices", found[2].replace(",", " "))]

    def add_transformation(self, node: Node, source: str, target: str, stated: Any) -> None:
        """What a connection does to its values: linear on real numbers, tables on the others."""
        component, _, signal = target.partition(".")
        interface = self.parts[component].interface
        name = signal if signal in interface.variables else signal.rpartition("[")[0]
        family, values = FAMILIES[interface.variables[name].type], dict(stated.table)
        if family == REAL:
            if (stated.factor, stated.offset) != (1.0, 0.0):
                child(node, "ssc", "LinearTransformation", factor=repr(stated.factor), offset=repr(stated.offset))
            return
        if (stated.factor, stated.offset) != (1.0, 0.0):
            domain = {"Boolean": [0.0, 1.0], "Enumeration": self.item_numbers(source)}.get(family)
            if domain is None:
                raise ScenarioError(
                    f"{self.where}: connection to {target}: SSP knows no factor for type {family}; use 'values'."
                )
            values = {value: stated.factor * value + stated.offset for value in domain}
        if values:
            kind = "Boolean" if family == "Boolean" else INTEGER
            holder = child(node, "ssc", f"{kind}MappingTransformation")
            for first, second in values.items():
                texts = [str(bool(v)).lower() if kind == "Boolean" else str(int(v)) for v in (first, second)]
                child(holder, "ssc", "MapEntry", source=texts[0], target=texts[1])

    def item_numbers(self, name: str) -> list[float]:
        """Numbers of the items that an enumeration can have."""
        component, _, signal = name.partition(".")
        return [float(number) for number in self.parts[component].interface.items(signal).values()]

    def extras(self) -> Mapping[str, Any]:
        """What SSP has no words for, and a file that goes with it."""
        own: dict[str, Any] = self.table.model_dump(
            mode="json", by_alias=True, exclude_unset=True, exclude={"components", "connections", "start", "stop"}
        )
        balises = self.table.balises
        if balises is not None and balises.file is not None:
            try:
                self.files[_BALISES_FILE] = (self.folder / balises.file).read_bytes()
            except OSError as error:
                raise ScenarioError(
                    f"{self.where}: balises.file: {balises.file} cannot be read: {error.strerror}."
                ) from error
            own["balises"] = own["balises"] | {"file": _BALISES_FILE}
        return own
