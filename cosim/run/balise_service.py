"""The balise service of a run: who is watched, how crossings are found, who is notified."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from cosim.balises.delivery import Receiver
from cosim.balises.localise import Localiser, Method, choose, make_localiser
from cosim.balises.plant_monitor import PlantError, PlantMonitor
from cosim.balises.recorded import RecordedChannel, RecordedLayout, RecordedLocaliser
from cosim.balises.service import BaliseService
from cosim.balises.telegram import Channel, FalseTelegram
from cosim.components.component import Component
from cosim.components.recording import KIND as RECORDING
from cosim.coupling.connection import SOURCES, split_name
from cosim.coupling.plan import Plan
from cosim.errors import CouplingError, ScenarioError
from cosim.run.layouts import Layout
from cosim.scenario.scenario_tables import BalisesTable
from fmus.check.probe import ProbeReport, probe
from fmus.exchange.slave import solver_of
from plant_models.disk_cache.entries import keep, recall
from plant_models.disk_cache.identity import identity
from plant_models.hybrid.units import UnitError, conversion, parse_unit

BALISE_EVENT = "balise"
_ASKED_FOR = "asked for in the scenario"
_AS_RECORDED = "they are delivered as they were in an earlier run"
_PROBING = ("fmus", "cosim/components")
"""The code by which plants are probed."""
_NO_ERROR = PlantError()
_UNTOUCHED = ("early-return", "interpolate")
"""Methods that neither cut nor redo the steps of the plant."""
_PLAYED_BACK = "the plant is a recording, which goes to any time and back"


@dataclass(frozen=True)
class LocatingChoice:
    """The localisation method of a run.

    Args:
        method: its name. reason: why it was chosen. probe: what the plant was seen to do, where it was probed.
        warnings: what speaks against it. error: what the plant itself adds to the error of the instants found.
    """

    method: Method
    reason: str
    probe: ProbeReport | None = None
    warnings: Sequence[str] = ()
    error: PlantError = _NO_ERROR

    def to_dict(self) -> dict[str, str]:
        """For the summary."""
        return {"method": self.method, "reason": self.reason} | (
            {} if self.method == "recorded" else {"bound": self.error.words()}
        )


@dataclass(frozen=True)
class BaliseRoles:
    """Who has to do with balises.

    Args:
        plant: component that passes them; empty without balises. receivers: components that take telegrams.
    """

    plant: str = ""
    receivers: Sequence[str] = ()


def balise_roles(table: BalisesTable | None, components: Mapping[str, Component], where: str) -> BaliseRoles:
    """Who passes the balises of a scenario, and who takes telegrams.

    Args:
        table: of the balises, None without. components: by name. where: name of the scenario, for messages.

    Raises:
        ScenarioError: a signal or a receiver that cannot be.
    """
    if table is None:
        return BaliseRoles()
    plant = _watched_plant(table, components, where)
    return BaliseRoles(plant, _receivers(table, components, plant, where))


def _receivers(table: BalisesTable, components: Mapping[str, Component], plant: str, where: str) -> list[str]:
    """Names of the components that are notified of balises: those listed, or all but the plant that declare the event.

    Args:
        table: of the balises. where: name of the scenario, for messages.

    Raises:
        ScenarioError: one that is listed does not declare the event.
    """
    able = [name for name, component in components.items() if BALISE_EVENT in component.events and name != plant]
    if table.receivers is None:
        return able
    for name in table.receivers:
        if name not in able:
            raise ScenarioError(
                f"{where}: balises.receivers: {name!r} declares no event '{BALISE_EVENT}'; these do: "
                f"{', '.join(able) or 'none'}."
            )
    return table.receivers


def _watched_plant(table: BalisesTable, components: Mapping[str, Component], where: str) -> str:
    """Name of the component whose position finds the balises; of recorded telegrams, for which none is needed, of a
    recording.

    Args:
        table: of the balises. components: by name. where: name of the scenario, for messages.

    Raises:
        ScenarioError: position and speed are not of one component, are neither outputs nor locals, or can be missing.
    """
    if table.position is None or table.speed is None:
        plant = next((name for name, component in components.items() if component.kind == RECORDING), "")
        if not plant:
            raise ScenarioError(
                f"{where}: balises: no component is a recording; say with 'position' and 'speed' what the plant is."
            )
        return _checked(table, plant, components, where, "odometer")
    plant, _ = split_name(table.position, components, f"{where}: balises.position")
    other, _ = split_name(table.speed, components, f"{where}: balises.speed")
    if plant != other:
        raise ScenarioError(
            f"{where}: balises.position and balises.speed must be of one component, got {plant} and {other}."
        )
    return _checked(table, plant, components, where, "position", "speed", "odometer")


def _checked(table: BalisesTable, plant: str, components: Mapping[str, Component], where: str, *keys: str) -> str:
    """The plant, once the signals that these keys name are known to exist."""
    for key in keys:
        name = getattr(table, key)
        if name is not None:
            component, signal = split_name(name, components, f"{where}: balises.{key}")
            components[component].variable(signal, *SOURCES)
            if components[component].can_be_missing(signal):
                raise ScenarioError(
                    f"{where}: balises.{key}: {name} can be missing (NaN), and neither a passing nor a telegram leaves "
                    "that out; name a signal that is always there."
                )
    return plant


def choose_method(
    table: BalisesTable,
    component: Component,
    make: Callable[[], Component],
    starts: Mapping[str, Any],
    start: float,
    step: float,
) -> LocatingChoice:
    """The localisation method: asked for, or the best that the probed plant allows.

    Args:
        table: balise table. component: the watched plant. make: makes a fresh one to probe. starts: its start values.
        start: start of the run [s]. step: communication step [s].
    """
    if table.layout == "recorded":
        return LocatingChoice("recorded", _AS_RECORDED)
    asked: Method | None = None if table.method == "auto" else table.method
    # a tolerance means a solver: it is examined
    if asked is not None and asked in _UNTOUCHED and component.tolerance is None:
        return LocatingChoice(asked, _ASKED_FOR, error=_plant_error(table, asked, component, start))
    if component.kind == RECORDING:
        return LocatingChoice("rollback", _PLAYED_BACK) if asked is None else LocatingChoice(asked, _ASKED_FOR)
    report = _known_probe(make, starts, start, step)
    chosen, reason = choose(
        report.honest_step, report.restores, table.clock, solved=solver_of(component.slave) is not None
    )
    method, why = (chosen, reason) if asked is None else (asked, _ASKED_FOR)
    error = _plant_error(table, method, component, start, report)
    warnings = []
    if asked is not None and error.unknown:
        warnings.append(
            f"balises.method = '{asked}' although the probe of '{component.name}' advises '{chosen}': {reason}. How "
            f"far the instants are off is unknown (time_bound = nan): {error.unknown}."
        )
    return LocatingChoice(method, why, report, tuple(warnings), error)


def _known_probe(make: Callable[[], Component], starts: Mapping[str, Any], start: float, step: float) -> ProbeReport:
    """The report of a probe, from the cache where the same plant was probed in the same way before."""
    key = identity(make, starts, start, step, code=_PROBING)
    known = None if key is None else recall("probe", key)
    if known is not None:
        return ProbeReport(**known | {"remarks": tuple(known["remarks"])})
    report = probe(make, starts, start, step)
    if key is not None and report.excited:  # else the FMU may lack something today, a licence say
        keep("probe", key, asdict(report))
    return report


def _plant_error(
    table: BalisesTable, method: Method, component: Component, start: float, report: ProbeReport | None = None
) -> PlantError:
    """What the plant itself adds to the error of the instants that a method finds.

    Args:
        table: balise table. method: in use. component: the watched plant. start: of the run [s].
        report: of the probe, where it was probed.
    """
    tolerance, signal = component.tolerance or 0.0, (table.position or "").partition(".")[2]
    unknown = _why_unknown(method, report, signal, tolerance)
    if unknown or report is None:
        return PlantError(tolerance=tolerance, unknown=unknown)
    scale = abs(_conversion(component, str(table.position), "m")[0])
    spread, drift = (scale * seen.get(signal, 0.0) for seen in (report.spread, report.drift))
    if signal in report.spread and spread == 0.0 and solver_of(component.slave) is None:
        tolerance = 0.0  # a solver here errs by it, however its steps lie
    return PlantError(0.0 if method in _UNTOUCHED else spread, tolerance, drift, start, unknown)


def _why_unknown(method: Method, report: ProbeReport | None, position: str, tolerance: float) -> str:
    """Why nothing can be said of the plant's own error, if so; arguments as for `_plant_error`, the position by its own
    name.
    """
    if method == "early-return" and not tolerance:
        return "the plant itself says when it passed, and knows of no tolerance"
    if report is None or method in _UNTOUCHED:
        return ""
    if not report.honest_step:
        return "the probe saw steps of other lengths go wrong"
    if method == "rollback" and report.restores == "no":
        return "the probe saw states that are not restored"
    seen = position in report.spread or tolerance > 0.0
    return "" if seen else "the position is no output, and the probe looks at outputs only"


def make_service(
    table: BalisesTable, layout: Layout, plan: Plan, roles: BaliseRoles, choice: LocatingChoice
) -> BaliseService:
    """Everything about balises for the master.

    Args:
        table: of the scenario. layout: of the balises. plan: prepared, components instantiated.
        roles: who passes them and who takes telegrams. choice: how crossings are found, and why.
    """
    planned = plan.find(roles.plant)
    first = planned.columns.start
    watch = PlantMonitor(planned, 0, 0)  # where telegrams are recorded nobody looks at them
    if table.position is not None and table.speed is not None:
        position, speed = (plan.column(name) - first for name in (table.position, table.speed))
        units = [_conversion(planned.component, n, unit) for n, unit in ((table.position, "m"), (table.speed, "m/s"))]
        watch = PlantMonitor(planned, position, speed, *units)
    watch.error = choice.error
    localiser, channel = _sources(table, layout, watch, choice.method)
    receivers = [Receiver(plan.find(name), BALISE_EVENT, table.timing) for name in roles.receivers]
    odometer = None if table.odometer is None else plan.column(table.odometer)
    return BaliseService(localiser, channel, receivers, odometer, first + watch.position_column)


def _sources(table: BalisesTable, layout: Layout, watch: PlantMonitor, method: Method) -> tuple[Localiser, Channel]:
    """Who finds the crossings, and what happens to the telegrams."""
    if isinstance(layout, RecordedLayout):
        return RecordedLocaliser(watch, layout), RecordedChannel(records=layout.records)
    channel = Channel(
        latency=table.latency,
        latency_jitter=table.latency_jitter,
        missed_fraction=table.missed_fraction,
        missed=frozenset(table.missed),
        position_noise=table.position_noise,
        false_telegrams=tuple(FalseTelegram(f.time, f.offset) for f in table.false_telegrams),
        seed=table.seed,
    )
    return make_localiser(method, watch, layout, table.clock, table.jerk_bound), channel


def _conversion(component: Component, name: str, unit: str) -> tuple[float, float]:
    """Factor and offset from the plant's own unit to [m] or [m/s]; 1 and 0 where it declares none."""
    try:
        declared = component.unit(name.partition(".")[2])
        return (1.0, 0.0) if declared is None else conversion(declared, parse_unit(unit))
    except UnitError as error:
        raise CouplingError(f"{name} cannot be read in {unit} to find balises: {error}.") from error
