"""The table ``[network]`` of a scenario: what may stand in it, and the settings that follow."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from cosim.errors import nearest
from cosim.network.settings import PRESETS
from cosim.toml_table import Name, OwnSeed, TomlTable
from plant_models.hybrid.noise import FROM_NAME
from plant_models.railway.network.protocols import silent_nodes

CYCLE, PERIOD = "cycle", "period"


class NetworkTable(TomlTable):
    """The network over which measurements travel: its nodes, when they send, and what happens to the packets."""

    preset: str | None = None
    nodes: dict[Name, list[str]]
    protocol: Literal["round-robin", "periodic", "try-once-discard", "quadratic"] = "round-robin"
    order: list[Name] | None = None
    weights: dict[Name, list[list[float]]] | None = None
    scales: dict[str, Annotated[float, Field(gt=0.0)]] = Field(default_factory=dict)
    period: Annotated[float, Field(gt=0.0)] | None = None
    cycle: Annotated[float, Field(gt=0.0)] | None = None
    offset: Annotated[float, Field(ge=0.0)] = 0.0
    jitter: Annotated[float, Field(ge=0.0)] = 0.0
    delay_model: Literal["constant", "uniform", "recorded", "correlated"] = "constant"
    delay: Annotated[float, Field(ge=0.0)] = 0.0
    delay_spread: Annotated[float, Field(ge=0.0)] = 0.0
    delay_correlation: Annotated[float, Field(ge=0.0, lt=1.0)] = 0.0
    delay_file: str | None = None
    equalise: Annotated[float, Field(ge=0.0)] = 0.0
    loss_fraction: Annotated[float, Field(ge=0.0, le=1.0)] = 0.0
    loss_burst: Annotated[float, Field(ge=1.0)] | None = None
    duplicate_fraction: Annotated[float, Field(ge=0.0, le=1.0)] = 0.0
    sequence: Literal["checked", "ignored"] = "checked"
    receivers: list[Name] | None = None
    seed: OwnSeed = FROM_NAME

    @model_validator(mode="after")
    def _complete(self) -> NetworkTable:
        if self.preset is not None and self.preset not in PRESETS:
            raise ValueError(f"unknown preset {self.preset!r}; {nearest(self.preset, PRESETS)}")
        self._check_nodes()
        self._check_protocol()
        timed = [key for key in (PERIOD, CYCLE) if getattr(self, key) is not None]
        if len(timed) != 1 and not (not timed and self.preset is not None):
            raise ValueError(
                "give either 'period', from transmission to transmission, or 'cycle', in which all nodes send"
            )
        if self.delay_model == "recorded" and self.delay_file is None:
            raise ValueError("delay_model 'recorded' needs 'delay_file', a CSV with the column 'delay' [s]")
        if self.slot <= self.jitter:
            raise ValueError(
                f"jitter ({self.jitter:g} s) must be shorter than the time between two transmissions ({self.slot:g} s)"
            )
        if self.loss_burst is not None and 0.0 < self.loss_fraction < 1.0:
            least = 1.0 / (1.0 - self.loss_fraction)
            if self.loss_burst < self.loss_fraction * least:
                raise ValueError(f"loss_burst must be at least {self.loss_fraction * least:g} for this loss_fraction")
        return self

    @property
    def slot(self) -> float:
        """Time between two transmissions [s]."""
        if self.period is not None:
            return self.period
        cycle = self.cycle if self.cycle is not None else PRESETS[str(self.preset)][CYCLE]
        turns = len(self.order or self.nodes)
        return float(cycle) / turns  # type: ignore[arg-type] # presets hold numbers

    @property
    def signals(self) -> list[str]:
        """All signals, node by node."""
        return [signal for signals in self.nodes.values() for signal in signals]

    def _check_nodes(self) -> None:
        if not self.nodes:
            raise ValueError("'nodes' is empty; a network needs at least one node, with the signals that it owns")
        owners: dict[str, str] = {}
        for node, signals in self.nodes.items():
            if not signals:
                raise ValueError(f"node {node!r} owns no signal, so it would send nothing")
            for signal in signals:
                if signal in owners:
                    both = "twice by" if owners[signal] == node else f"by {owners[signal]!r} and"
                    raise ValueError(f"signal {signal!r} is owned {both} {node!r}; one node owns a signal, once")
                owners[signal] = node
        for signal in self.scales:
            if signal not in owners:
                raise ValueError(f"'scales' names {signal!r}, a signal without a node; {nearest(signal, owners)}")

    def _check_protocol(self) -> None:
        names = list(self.nodes)
        if (self.order is not None) != (self.protocol == "periodic"):
            raise ValueError("'order' belongs to protocol 'periodic', which needs it")
        if (self.weights is not None) != (self.protocol == "quadratic"):
            raise ValueError("'weights' belongs to protocol 'quadratic', which needs it")
        for name in (*(self.order or ()), *(self.weights or ())):
            if name not in names:
                raise ValueError(f"there is no node {name!r}; {nearest(name, names)}")
        if self.order is not None:
            silent = silent_nodes([names.index(name) for name in self.order], len(names))
            if silent:
                raise ValueError(f"node {names[silent[0]]!r} never sends: it does not occur in 'order'")
        if self.weights is not None:
            self._check_weights(names)

    def _check_weights(self, names: list[str]) -> None:
        count, weights = len(self.signals), self.weights or {}
        lacking = [name for name in names if name not in weights]
        if lacking:
            raise ValueError(f"'weights' lacks the matrix of node {lacking[0]!r}")
        for name, rows in weights.items():
            if len(rows) != count or any(len(row) != count for row in rows):
                raise ValueError(
                    f"the matrix of node {name!r} in 'weights' must be {count} x {count}, as many as signals"
                )
