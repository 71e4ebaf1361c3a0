"""The network of a scenario: from its table to its nodes, and to the service for the master."""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np

from cosim.components.component import Component
from cosim.coupling.connection import Link
from cosim.coupling.plan import Plan
from cosim.errors import ScenarioError, nearest
from cosim.network.outputs import NAME, NetworkOutputs
from cosim.network.service import NetworkService, PacketListener
from cosim.network.settings import PRESETS, NetworkSettings, Node
from cosim.scenario.network_table import NetworkTable
from cosim.scenario.schema import ScenarioTable
from plant_models.railway.network.protocols import try_once_discard


@dataclass(frozen=True, slots=True)
class NetworkReading:
    """A connection over the network to an input that its component reads.

    Args:
        source: ``component.signal`` that travels. component, name: of the input.
        leaves_out: whether the component leaves out a reading that is missing.
        samples: period and offset [s] at which it reads; None where it does not stop at samples, or nobody knows.
        repeats: whether samples may find nothing new of a signal that is not lost.
        of_event: whether it is a field of an event that another component notifies of: read when that occurs.
    """

    source: str
    component: str
    name: str
    leaves_out: bool
    samples: tuple[float, float] | None
    repeats: bool
    of_event: bool

    @property
    def target(self) -> str:
        """``component.input``."""
        return f"{self.component}.{self.name}"


@dataclass(frozen=True)
class Network:
    """What a scenario's network does to its connections.

    Args:
        settings: of the network. outputs: its face among the components.
        listeners: who is notified by events. readings: who reads what arrived last.
    """

    settings: NetworkSettings
    outputs: NetworkOutputs
    listeners: Sequence[PacketListener] = ()
    readings: Sequence[NetworkReading] = ()

    @property
    def loses(self) -> bool:
        """Whether packets are lost."""
        return self.settings.loss_fraction > 0.0

    @property
    def held(self) -> dict[str, list[str]]:
        """Components that hold what arrived last, by signal."""
        found: dict[str, list[str]] = {}
        for reading in self.readings:
            found.setdefault(reading.source, []).append(reading.component)
        return found

    def service(self, plan: Plan, start: float) -> NetworkService:
        """The network for the master.

        Args:
            plan: with the network's outputs behind those of the components. start: of the run [s].
        """
        columns = np.array([plan.column(name) for name in self.settings.signals], dtype=np.intp)
        first = plan.column(f"{NAME}.{self.settings.signals[0]}")
        return NetworkService(self.settings, start, columns, first, self.listeners, self.held, self.outputs.readers)

    def notes(self) -> list[str]:
        """What is done where a packet is lost, and at samples between two packets."""
        again = [r for r in self.readings if r.repeats or (r.leaves_out and r.samples is None)]
        read_once = [r.target for r in again if r.leaves_out and r.repeats]
        lossy = [r for r in self.readings if self.loses and not r.of_event]
        texts = (
            (read_once, "A reading is read once, and missing and left out until the next packet arrives, at"),
            (
                [r.target for r in again if not (r.leaves_out and r.repeats)],
                "Samples between two packets take the last reading for a new one, at",
            ),
            (
                [r.target for r in lossy if r.leaves_out],
                "A reading whose packet is lost is missing, and left out, at",
            ),
            (
                [r.target for r in lossy if not r.leaves_out],
                "Where a packet is lost the last reading stays, and is taken for a new one, at",
            ),
        )
        return [f"{text} {', '.join(names)}." for names, text in texts if names]

    def hidden(self, components: Mapping[str, Component]) -> dict[str, list[str]]:
        """Local variables that it measures, by component: they are read though no connection asks for them.

        Args:
            components: by name.
        """
        found: dict[str, list[str]] = {}
        for component, signal in self.outputs.sources:
            if components[component].variable(signal).causality == "local":
                found.setdefault(component, []).append(signal)
        return found


def make_network(table: ScenarioTable, components: Mapping[str, Component], folder: Path, where: str) -> Network | None:
    """The network of a scenario, before its connections are known; None where it has none.

    Args:
        table: the scenario. components: by name. folder: start of relative paths. where: name of the scenario, for
            messages.

    Raises:
        ScenarioError, CouplingError: a signal or receiver does not exist; delays that cannot be.
    """
    if table.network is None:
        return None
    if NAME in components:
        raise ScenarioError(f"{where}: a component cannot be called {NAME!r} where there is a network; rename it.")
    for name in table.network.receivers or ():
        if name not in components:
            raise ScenarioError(f"{where}: network.receivers: no component {name!r}; {nearest(name, components)}")
    settings = _network_settings(table.network, folder, where)
    return Network(settings, NetworkOutputs(settings, components))


def is_wired(pairs: Sequence[Link], component: str, event: str) -> bool:
    """Whether somebody else notifies of an event: its count or clock has a source.

    Args:
        pairs: connections of the scenario. component: whose event. event: its name.
    """
    return any(pair[1] in (f"{component}.{event}", f"{component}.{event}_count") for pair in pairs)


def _network_settings(table: NetworkTable, folder: Path, where: str) -> NetworkSettings:
    """The settings of a network; what the table does not say is that of its preset."""
    names, preset = list(table.nodes), {} if table.preset is None else dict(PRESETS[table.preset])
    keys = ("delay_model", "delay", "delay_spread")
    delays = {k: preset[k] if k in preset and k not in table.model_fields_set else getattr(table, k) for k in keys}
    sizes = [len(signals) for signals in table.nodes.values()]
    weights = None
    if table.protocol == "try-once-discard":
        weights = try_once_discard(sizes, [table.scales.get(signal, 1.0) for signal in table.signals])
    elif table.protocol == "quadratic":
        weights = np.array([(table.weights or {})[name] for name in names])
    file = None if table.delay_file is None else (folder / table.delay_file).resolve()
    as_written = {f.name: getattr(table, f.name) for f in fields(NetworkSettings) if hasattr(table, f.name)}
    return NetworkSettings(
        **as_written
        | delays
        | {
            "nodes": tuple(Node(name, tuple(signals)) for name, signals in table.nodes.items()),
            "order": tuple(names.index(name) for name in table.order or ()),
            "weights": weights,
            "period": table.slot,
            "delays": () if file is None else _read_delays(file, f"{where}: network.delay_file"),
        }
    )


def _read_delays(path: Path, where: str) -> list[float]:
    """Recorded delays [s] from a CSV file with the column ``delay``."""
    try:
        with path.open(newline="", encoding="utf-8-sig") as stream:
            reader = csv.DictReader(stream, skipinitialspace=True)
            if "delay" not in (reader.fieldnames or []):
                raise ScenarioError(f"{where}: {path} has no column 'delay' in the header {reader.fieldnames}.")
            rows = [(reader.line_num, row["delay"]) for row in reader]
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise ScenarioError(f"{where}: {path} cannot be read: {error}.") from error
    delays = []
    for line, text in rows:
        try:
            delay = float(text)
        except (TypeError, ValueError):
            raise ScenarioError(f"{where}: {path}, line {line}: {text!r} is no number.") from None
        if not 0.0 <= delay < float("inf"):
            raise ScenarioError(
                f"{where}: {path}, line {line}: delay {delay:g} s; a packet does not arrive before it is sent, "
                f"and a lost one is left to 'loss_fraction'."
            )
        delays.append(delay)
    if not delays:
        raise ScenarioError(f"{where}: {path} holds no delays.")
    return delays
