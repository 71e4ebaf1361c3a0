"""The face of a network in a run: a component that is never stepped, whose outputs are what was last received."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import floor, inf
from typing import Any

from fmpy.model_description import ModelVariable

from cosim.components.component import Component
from cosim.components.description import description_of_outputs
from cosim.components.fmi3 import FMI3Component
from cosim.coupling.connection import split_name
from cosim.errors import ScenarioError
from cosim.network.settings import NetworkSettings
from fmu_observer.annotated_variable import CAN_BE_MISSING, AnnotatedVariable
from fmus.fmi.standard import TIME_TOLERANCE
from fmus.fmi.types import FLOATING_TYPES, NUMERIC_TYPES

NAME = "network"
"""Of the network among the components."""
KIND = "network"
SENDER = "sender"


@dataclass(frozen=True)
class PacketReader:
    """An input that leaves out what is missing: a reading that it has sampled is missing until the next one arrives.

    Args:
        target: ``component.input``. signal: number of the signal that it reads.
        period, offset: of its samples, the offset after the start of the run [s]; None where nobody knows them, and
            what it received stays until a packet is lost.
    """

    target: str
    signal: int
    period: float | None = None
    offset: float = 0.0

    def next_sample(self, t: float, start: float) -> float:
        """Its first sample after `t` [s], of a run that starts at `start` [s]; infinite where nobody knows.

        One at `t` itself has read what was delivered before.
        """
        if self.period is None:
            return inf
        passed = max(floor((t + TIME_TOLERANCE - start - self.offset) / self.period) + 1, 0)
        return start + self.offset + passed * self.period


class NetworkOutputs(FMI3Component):
    """What was last received of each signal, ``network.component.signal``, and by whom and when it was sent.

    Args:
        settings: of the network. components: by name, for what the signals are.
        readers: inputs that take what arrives, and leave out what is missing.

    Raises:
        ScenarioError, CouplingError: a signal does not exist, or is no number.
    """

    def __init__(
        self, settings: NetworkSettings, components: Mapping[str, Component], readers: Sequence[PacketReader] = ()
    ) -> None:
        self.settings, self.readers = settings, tuple(readers)
        self.sources = [_source(name, node.name, components) for node in settings.nodes for name in node.signals]
        variables = _outputs(settings, self.sources, components, self.readers)
        description = description_of_outputs(
            KIND, KIND, "A network", variables, modelIdentifier=KIND, canHandleVariableCommunicationStepSize=True
        )
        super().__init__(NAME, None, description, source="the network of the scenario", kind=KIND)


def _error_name(signal: str) -> str:
    """Output with the network error of a signal."""
    return f"error.{signal}"


def arrived_name(target: str) -> str:
    """Output with what arrived for an input and was not yet read, NaN where nothing did.

    Args:
        target: ``component.input``.
    """
    return f"arrived.{target}"


def _stamp_name(node: str) -> str:
    """Output with the stamp of what was last received of a node."""
    return f"stamp.{node}"


def _source(name: str, node: str, components: Mapping[str, Component]) -> tuple[str, str]:
    where = f"network.nodes.{node}"
    component, signal = split_name(name, components, where)
    variable = components[component].variable(signal, "output", "local")
    if variable.type not in NUMERIC_TYPES:
        raise ScenarioError(f"{where}: {name} is a {variable.type}; a packet carries numbers.")
    elements = components[component].elements(signal)
    if len(elements) != 1:
        names = [f"{component}.{element.name}" for element in elements]
        raise ScenarioError(f"{where}: {name} is an array; name its elements: {', '.join(names[:3])}, ...")
    return component, signal


def _outputs(
    settings: NetworkSettings,
    sources: Sequence[tuple[str, str]],
    components: Mapping[str, Component],
    readers: Sequence[PacketReader],
) -> list[ModelVariable]:
    variables: list[ModelVariable] = []

    def add(name: str, description: str, **more: Any) -> None:
        kind: dict[str, Any] = {"type": "Float64", "causality": "output", "variability": "discrete"}
        number = len(variables) + 1
        variables.append(AnnotatedVariable(name=name, valueReference=number, description=description, **kind, **more))

    for kind in ("received", "error"):
        for name, (component, signal) in zip(settings.signals, sources, strict=True):
            units = _units(components[component], signal)
            if kind == "received":
                marks = [CAN_BE_MISSING] if components[component].can_be_missing(signal) else []
                add(name, f"Last received value of {name}", marks=marks, **units)
            else:
                add(_error_name(name), f"Last sent minus true value of {name} before the last transmission", **units)
    add(SENDER, "Number of the node that sent last, from 1; 0 before")
    for node in settings.nodes:
        add(_stamp_name(node.name), f"When what was last received of node {node.name} was measured", unit="s")
    for reader in readers:
        component, signal = sources[reader.signal]
        text = f"What arrived of {component}.{signal} for {reader.target}, NaN where it is lost or was read"
        add(arrived_name(reader.target), text, marks=[CAN_BE_MISSING], **_units(components[component], signal))
    return variables


def _units(component: Component, signal: str) -> dict[str, Any]:
    variable = component.variables[signal]
    if variable.type not in FLOATING_TYPES:
        return {}
    return {"unit": component.unit_name(signal), "displayUnit": variable.displayUnit}
