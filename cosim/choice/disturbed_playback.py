"""A disturbance in a scenario that plays a recording back: fault blocks between the recording and the observers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from cosim.choice.candidates import BenchmarkCandidate
from cosim.choice.disturbances import GRAVITY, Disturbance, OdometerFault
from cosim.choice.known_parameters import MASS, Known
from cosim.choice.playback import ScenarioParts, connection
from cosim.coupling.connection import Link
from cosim.coupling.transformation import Transformation
from cosim.errors import CosimError
from cosim.run.component_models import make_system, values_in_use
from cosim.run.connections import parse_connections, recorded_link, transformation
from cosim.scenario.scenario_tables import ConnectionTable
from cosim.starter.inspected_fmu import inspect_fmu
from cosim.starter.train_starter import DAVIS

_EFFORT, _WHEEL, _ODOMETER = "disturbed_effort", "disturbed_wheel", "disturbed_odometer"


@dataclass(frozen=True)
class _DisturbedChannel:
    """What a signal passes between the recording and the observers.

    Args:
        link: from the recording, as observers hear it without a disturbance: what is disturbed is in their units.
        output: what observers hear in its place. components: tables by name.
        connections: from the source to the output.
    """

    link: Link
    output: str
    components: Mapping[str, Mapping[str, Any]]
    connections: Sequence[Any]

    def moved(self, line: str | dict[str, Any]) -> str | dict[str, Any]:
        """A connection from the output in place of the recorded signal."""
        (link,) = parse_connections([line if isinstance(line, str) else ConnectionTable.model_validate(line)], "")
        left = transformation(link).instead_of(transformation(self.link))
        return connection((self.output, link[1]) if left == Transformation() else (self.output, link[1], left), link[1])


def channels(disturbance: Disturbance, parts: ScenarioParts, known: Known) -> list[_DisturbedChannel]:
    """The disturbed channels: effort and odometer, as far as there are such signals and something is wrong with them.

    Args:
        disturbance: what is wrong. parts: of the scenario. known: of the train.
    """
    found = []
    if disturbance.slopes and "effort" in parts.template:
        mass = known[MASS][0] if MASS in known else 1.0
        found.append(
            _effort_channel(recorded_link(parts.template["effort"], parts.table, parts.folder), disturbance, mass)
        )
    if "odometer" in parts.template and (disturbance.faults or disturbance.noise or disturbance.wheel != 1.0):
        period = known["odometer_period"][0] if "odometer_period" in known else parts.table.step
        found.append(
            _odometer_channel(recorded_link(parts.template["odometer"], parts.table, parts.folder), disturbance, period)
        )
    return found


def _effort_channel(link: Link, disturbance: Disturbance, mass: float) -> _DisturbedChannel:
    """On a slope a train of the same motion needs ``m g i`` more."""
    slopes = disturbance.slopes
    stated = {
        "fault_onset": [slope.onset for slope in slopes],
        "fault_length": [slope.length for slope in slopes],
        "fault_offset": [mass * GRAVITY * slope.gradient for slope in slopes],
    }
    options = {"fault_count": len(slopes), "unit": "N"}
    table = {"model": "signal_fault", "options": options, "parameters": stated}
    line = connection(link, f"{_EFFORT}.healthy")
    return _DisturbedChannel(link, f"{_EFFORT}.reading", {_EFFORT: table}, [line])


def _odometer_channel(link: Link, disturbance: Disturbance, period: float) -> _DisturbedChannel:
    """A wheel that jams and skids, and an odometer that is worn and noisy."""
    faults = disturbance.faults or (OdometerFault(0.0, 0.0, 0.0, -1.0),)
    drawn = {f"fault_{key}": [getattr(fault, key) for fault in faults] for key in ("onset", "length", "depth", "kind")}
    wheel = {"model": "wheel_fault", "options": {"cause": "stated", "fault_count": len(faults)}, "parameters": drawn}
    odometer = {"model": "odometer", "parameters": {"sample_period": period, "noise_std": disturbance.noise}}
    stated = transformation(link)
    worn = replace(stated, factor=disturbance.wheel * stated.factor, offset=disturbance.wheel * stated.offset)
    lines = [
        connection((link[0], "", worn), f"{_WHEEL}.speed"),
        f"{_WHEEL}.wheel_speed -> {_ODOMETER}.wheel_speed",
    ]
    return _DisturbedChannel(link, f"{_ODOMETER}.reading", {_WHEEL: wheel, _ODOMETER: odometer}, lines)


def disturbed(data: dict[str, Any], found: Sequence[_DisturbedChannel], disturbance: Disturbance) -> dict[str, Any]:
    """The tables of a scenario with the channels in it.

    Args:
        data: tables that play a recording back. found: the channels. disturbance: what is wrong.
    """
    sources = {_source(line) for line in data["connections"]}
    by_source = {channel.link[0]: channel for channel in found if channel.link[0] in sources}
    changed = dict(data)
    tables = {name: dict(table) for channel in by_source.values() for name, table in channel.components.items()}
    changed["components"] = data["components"] | tables
    changed["connections"] = [
        *(
            by_source[source].moved(line) if (source := _source(line)) in by_source else line
            for line in data["connections"]
        ),
        *(line for channel in by_source.values() for line in channel.connections),
    ]
    if "network" in data:
        changed["network"] = _disturbed_network(data["network"], by_source, disturbance)
    return changed


def _disturbed_network(
    network: dict[str, Any], found: Mapping[str, _DisturbedChannel], disturbance: Disturbance
) -> dict[str, Any]:
    """The network table with the outputs of the channels in place of the signals, and more packets lost."""
    outputs = {source: channel.output for source, channel in found.items()}
    nodes = {node: [outputs.get(name, name) for name in names] for node, names in network["nodes"].items()}
    scales = {
        outputs.get(name, name): value * (transformation(found[name].link).factor if name in found else 1.0)
        for name, value in network.get("scales", {}).items()
    }
    loss = min(network.get("loss_fraction", 0.0) + disturbance.loss, 0.9)
    return network | {"nodes": nodes, "scales": scales, "loss_fraction": loss}


def _source(line: str | dict[str, Any]) -> str:
    """Where a connection comes from."""
    return str(line["from"]) if isinstance(line, dict) else line.partition(" -> ")[0]


def believing(candidate: BenchmarkCandidate, disturbance: Disturbance, folder: Path) -> BenchmarkCandidate:
    """An observer that believes in another mass and resistance; one that knows neither as it is.

    Args:
        candidate: the observer. disturbance: what it believes wrongly. folder: of the scenario, for paths of FMUs.
    """
    table = candidate.table
    try:
        known = _believed(candidate, folder)
    except (ValueError, CosimError):  # it refuses what is known of the train, and its run says so
        return candidate
    shares = {MASS: disturbance.mass, **dict.fromkeys(DAVIS, disturbance.resistance)}
    changed = {
        n: share * known[n] for n, share in shares.items() if share != 1.0 and isinstance(known.get(n), int | float)
    }
    parameters = {**table.parameters, **changed}
    return replace(candidate, table=table.model_copy(update={"parameters": parameters}))


def _believed(candidate: BenchmarkCandidate, folder: Path) -> Mapping[str, Any]:
    """What an observer is set to, or what it is as it stands, of mass and resistance among others.

    Raises:
        ValueError: it refuses a value. CosimError: its FMU cannot be read.
    """
    table = candidate.table
    if table.fmu is not None:
        signals = inspect_fmu((folder / table.fmu).resolve()).parameters
        return {s.name: s.start for s in signals if s.name in (MASS, *DAVIS)} | table.parameters
    system = None if table.observer is None else make_system(table, candidate.name)
    if system is None:
        return table.parameters
    scalars = {signal.name for signal in system.parameter_signals if signal.size is None}
    values = values_in_use(table, system)
    return {name: float(getattr(values, name)) for name in (MASS, *DAVIS) if name in scalars}
