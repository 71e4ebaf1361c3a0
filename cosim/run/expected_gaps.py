"""Gaps before the run: how long each observer must expect to wait for a sample, whatever brings it samples."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from math import inf
from typing import Any

import numpy as np

from cosim.balises.layout import InstantLayout
from cosim.balises.recorded import RecordedLayout
from cosim.components.component import Component
from cosim.components.recording import RecordingComponent
from cosim.coupling.connection import Link
from cosim.network.intervals import longest_interval, sends_in_turn
from cosim.network.service import PacketListener
from cosim.network.settings import NetworkSettings
from cosim.run.balise_service import BALISE_EVENT
from cosim.run.component_models import make_system, values_in_use
from cosim.run.layouts import Layout
from cosim.run.network import Network, is_wired
from cosim.run.network_connections import READINGS, ROUNDING
from cosim.scenario.scenario_tables import BalisesTable, ComponentTable
from cosim.scenario.schema import ScenarioTable


@dataclass(frozen=True)
class ExpectedGap:
    """The longest time between two samples that an observer must expect.

    Args:
        seconds: [s], or None where it cannot be known before the run.
        reason: where the number comes from.
        distance: longest way to a balise, from another one or from the start of the track [m]; None where time decides.
        spacings: shortest and longest way between two balises [m]; None where time decides, or there is but one.
        never: no sample comes in the whole run.
    """

    seconds: float | None
    reason: str
    distance: float | None = None
    spacings: tuple[float, float] | None = None
    never: bool = False


_NO_BALISES = ExpectedGap(None, "no balise instant lies within the run")
UNKNOWN = ExpectedGap(None, "nothing is known about gaps")
_AT_ITS_PERIOD = "it reads its measurements at this period"


@dataclass(frozen=True)
class Sources:
    """Where the observers of a scenario have their samples from.

    Args:
        table: of the scenario. components: by name. links: its connections. layout: of the balises, None without.
        receivers: names of those that take telegrams. network: None without. where: the scenario, for messages.
    """

    table: ScenarioTable
    components: Mapping[str, Component]
    links: Sequence[Link]
    layout: Layout | None
    receivers: Collection[str]
    network: Network | None
    where: str

    def gaps(self) -> dict[str, ExpectedGap]:
        """The longest gap by component: of all that are notified of samples, and of all with a finding about gaps."""
        balises = None
        if self.layout is not None and self.table.balises is not None:
            balises = expected_gap(self.layout, self.table.balises, self.table.start)
        found = {}
        for name, table in self.table.components.items():
            notified = {} if balises is None or name not in self.receivers else {BALISE_EVENT: balises}
            packets = [] if self.network is None else [x for x in self.network.listeners if x.component == name]
            estimates = table.observer is not None or (table.fmu is not None and packets)
            if not estimates and not notified:
                continue
            system: Any = make_system(table, self.where)
            if hasattr(system, "sampled_events"):
                notified |= {x.event: self._of_packets(x, table, system) for x in packets}
                found[name] = _longest(
                    [*self._of_events(name, table, system, notified), *self._of_readings(name, system)]
                )
            elif notified or packets:
                found[name] = balises if notified and balises is not None else UNKNOWN
        return found

    def _of_packets(self, listener: PacketListener, table: ComponentTable, system: Any) -> ExpectedGap:
        """Of an event that packets bring."""
        assert self.network is not None
        settings = self.network.settings
        reason = _not_as_certified(listener, settings, system) or _late(settings, table, system)
        if reason:
            return ExpectedGap(None, reason)
        seconds, reason = longest_interval(settings, listener.nodes)
        shortest, longest = settings.delay_range
        waits = longest - shortest if seconds is not None and table.late_policy == "late" else 0.0
        return ExpectedGap(None if seconds is None else seconds + waits, reason)

    def _of_events(
        self, name: str, table: ComponentTable, system: Any, notified: Mapping[str, ExpectedGap]
    ) -> list[ExpectedGap]:
        """Of all events that the finding of a component is about."""
        values = values_in_use(table, system)
        sampled, periods = system.sampled_events(values), _periods(values, system)
        found = [gap for event, gap in notified.items()]
        for event in sampled:
            if event in periods:
                found.append(ExpectedGap(periods[event], _AT_ITS_PERIOD))
            elif is_wired(self.links, name, event):
                found.append(self._of_trigger(name, event))
            elif event not in notified:
                whole = self.table.stop - self.table.start
                found.append(ExpectedGap(whole, f"nothing triggers its event '{event}' in this run", never=True))
        if not sampled:
            found.append(ExpectedGap(max(periods.values()), _AT_ITS_PERIOD))
        return found

    def _of_trigger(self, name: str, event: str) -> ExpectedGap:
        """Of an event that another component triggers: its period where it says that its count is periodic, which is
        held against the run afterwards.
        """
        sources = [source for source, target, *_ in self.links if target == f"{name}.{event}_count"]
        for source, count in [s.split(".", 1) for s in sources if not self._travels(s, name)]:
            table = self.table.components[source]
            system: Any = make_system(table, self.where)
            for periodic in () if system is None else system.periodic_events:
                if periodic.counted_by == count:
                    period = _periods(values_in_use(table, system), system)[periodic.name]
                    return ExpectedGap(period, f"{source} triggers its event '{event}' at this period")
        return ExpectedGap(None, f"another component triggers its event '{event}', at instants of its own")

    def _of_readings(self, name: str, system: Any) -> list[ExpectedGap]:
        """Of measured inputs that stay as they are for longer than it takes to read them; none where they do not."""
        found = []
        inputs = [f"{name}.{s.name}" for s in system.inputs if s.name.startswith(READINGS)]
        for source, target, *_ in self.links:
            if target in inputs and self._travels(source, name):
                text = f"{target} arrives by packets: between two of them it is missing, or is read more than once"
                found.append(ExpectedGap(None, text))
            component = self.components.get(source.partition(".")[0])
            if target in inputs and isinstance(component, RecordingComponent):
                found += self._of_rows(component, target)
        return found

    def _of_rows(self, component: RecordingComponent, target: str) -> list[ExpectedGap]:
        """Of a recorded measurement that is held from row to row."""
        name = target.partition(".")[0]
        if self.table.components[component.name].interpolation != "hold":
            return []
        rows = float(np.diff(component.recording.time).max(initial=0.0))
        system: Any = make_system(self.table.components[name], self.where)
        table = self.table.components[name]
        periods = _periods(values_in_use(table, system), system)
        if rows <= min(periods.values(), default=0.0) * (1.0 + ROUNDING):
            return []
        reason = f"{target} is held over the rows of {component.name}, up to {rows:g} s, so it is read more than once"
        return [ExpectedGap(None, reason)]

    def _travels(self, source: str, name: str) -> bool:
        if self.network is None or self.table.network is None:
            return False
        receivers = self.table.network.receivers
        return source in self.network.settings.signals and (receivers is None or name in receivers)


def _periods(values: Any, system: Any) -> dict[str, float]:
    """Periods of the periodic events of a system [s], by event."""
    return {event.name: float(getattr(values, event.period)) for event in system.periodic_events}


def _longest(gaps: Sequence[ExpectedGap]) -> ExpectedGap:
    """The one that decides: the first of those that are not known, before all one of which no distance is known either,
    since a certificate may speak of a distance; else the longest.
    """
    return max(gaps, key=lambda gap: (inf, gap.distance is None) if gap.seconds is None else (gap.seconds, False))


def _not_as_certified(listener: PacketListener, settings: NetworkSettings, system: Any) -> str:
    """Why packets are not what the certificate of their receiver is about; empty where they are."""
    event, numbers = listener.event, settings.node_of
    fields = {part.name: numbers[part.signal] for part in listener.fields}
    if f"{event}_node" not in {s.name for e in system.triggered_events for s in e.payload}:
        several = sorted(settings.nodes[i].name for i in listener.nodes)
        text = f"'{event}' takes fields of several nodes ({', '.join(several)}), of which each packet renews one"
        return text if len(several) > 1 else ""
    wanted = dict(zip((s.name for s in system.model.measurements), system.node_of, strict=True))
    for field, number in fields.items():
        if number + 1 != wanted.get(field, number + 1):
            return (
                f"'{event}': {field} is sent by node {number + 1} of the network, and the observer takes it from "
                f"node {wanted[field]}"
            )
    turns = sorted(set(fields.values()))
    if len(turns) > 1 and not sends_in_turn(settings, turns):
        return f"its certificate is about nodes that send in turn, which protocol '{settings.protocol}' here does not"
    return ""


def _late(settings: NetworkSettings, table: ComponentTable, system: Any) -> str:
    """Why late packets are not used as the certificate takes them; empty where they are."""
    shortest, longest = settings.delay_range
    if longest == 0.0:
        return ""
    if table.late_policy == "reject":
        return "late packets are rejected, and all of them are late"
    if table.late_policy == "replay":
        text = f"packets take up to {longest:g} s, and what is older than {table.replay_horizon:g} s is rejected"
        return text if longest > table.replay_horizon else ""
    if "delay" not in {s.name for s in system.parameter_signals}:
        return f"packets of up to {longest:g} s ago are taken as new ones, which its certificate leaves out"
    overtaken = longest - shortest >= settings.period - settings.jitter
    return f"packets take {shortest:g} to {longest:g} s, so some overtake others; equalise them" if overtaken else ""


def expected_gap(layout: Layout, table: BalisesTable, start: float) -> ExpectedGap:
    """The longest gap between the stamps of two balises, as far as layout and scenario say before the run.

    A constant latency does not count: what arrives late is used at its stamp.

    Args:
        table: of the scenario. start: begin of the run [s].
    """
    if isinstance(layout, RecordedLayout):
        gaps = np.diff([start, *layout.instants[layout.instants > start]])
        return (
            ExpectedGap(float(gaps.max()), "longest gap between the recorded telegrams") if len(gaps) else _NO_BALISES
        )
    if table.missed_fraction > 0.0 or table.missed:
        return ExpectedGap(None, "balises are missed by chance or by name, so a gap may be of any length")
    if isinstance(layout, InstantLayout):
        gaps = np.diff([start, *layout.instants[layout.instants > start]])
        return ExpectedGap(float(gaps.max()), "longest gap between the balise instants") if len(gaps) else _NO_BALISES
    positions = layout.positions
    if "track_start" in table.model_fields_set:  # a train that begins there does not meet what lies before
        positions = positions[positions >= table.track_start]
    if not len(positions):
        return ExpectedGap(None, f"no balise lies behind the start of the track at {table.track_start:g} m")
    between = np.diff(positions)
    spacings = (float(between.min()), float(between.max())) if len(between) else None
    distance = float(np.diff([min(table.track_start, positions[0]), *positions]).max())
    if table.expected_speed is None:
        reason = "balises are laid by position; give balises.expected_speed to check"
        return ExpectedGap(None, reason, distance, spacings)
    reason = f"up to {distance:g} m between balises or to the first one, at the expected {table.expected_speed:g} m/s"
    return ExpectedGap(distance / table.expected_speed, reason, distance, spacings)
