"""Who takes part in a comparison of observers: those of the scenario, shipped ones, those of a script; and what each
knows of the train. Runs nothing.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import fmu_observer
from cosim.choice.known_parameters import SHARED_PARAMETERS, Known, settable, stated_parameters
from cosim.choice.playback import Listener, ScenarioParts, connection, train_observers
from cosim.errors import ScenarioError, nearest
from cosim.run.balise_service import BALISE_EVENT
from cosim.run.component_models import make_declared
from cosim.scenario.model_name import ModelName, settings_of
from cosim.scenario.paths import absolute, move_file
from cosim.scenario.scenario_tables import ComponentTable
from cosim.scenario.schema import ScenarioTable
from cosim.simulation.scenario import Scenario
from plant_models.user_file import names_code

Observers = Sequence[Any] | Mapping[str, Any] | None
"""Who is asked for, in their order or by the names that they are to have; None for all."""


@dataclass(frozen=True)
class BenchmarkCandidate(Listener):
    """An observer to be evaluated.

    Args:
        name: in the benchmark. table: how it is made. sources: where its inputs come from.
        origin: ``scenario`` or ``defaults``. settings: what was assumed, in words. misfit: why it cannot be coupled, or
            empty.
    """

    origin: str
    settings: tuple[str, ...] = ()
    misfit: str = ""

    @property
    def model(self) -> str:
        """Shipped observer or FMU."""
        return str(self.table.observer or self.table.model or self.table.fmu)

    @property
    def asked(self) -> Any:
        """What names it for another run."""
        model = self.table.observer
        if self.origin == "scenario" or model is None:
            return self.name
        return model if model.stated is not None else str(self.table.label)


def find_candidates(
    scenario: Scenario, parts: ScenarioParts, names: Observers, known: Known | None = None
) -> tuple[list[BenchmarkCandidate], list[str]]:
    """The observers to be evaluated, those that cannot listen here among them, and notes on what was assumed.

    Args:
        scenario: for messages. parts: of it.
        names: those asked for, with a preset as ``name:preset``, perhaps by names of their own; None for those of the
            scenario and every preset of all shipped train observers.
        known: of the train; None for what the scenario says.

    Raises:
        ScenarioError: a name is neither an observer of the scenario nor a shipped one.
    """
    found = stated_parameters(scenario, parts) if known is None else known
    if isinstance(names, Mapping):
        named = [replace(_named(scenario, parts, asked, found), name=name) for name, asked in names.items()]
        return named, [f"{c.name}: {text}" for c in named for text in c.settings]
    if names is not None:
        asked = {name if isinstance(name, str) else id(name): name for name in names}
        named = _distinct([_named(scenario, parts, name, found) for name in asked.values()])
        return named, [f"{c.name}: {text}" for c in named for text in c.settings]
    own = [_own(parts, name) for name in parts.observers]
    used = {(table.observer, _preset(table)) for c in own if not (table := c.table).options}
    others = [_shipped(parts, name, found, preset) for name, preset in shipped_rows() if (name, preset) not in used]
    every = [*own, *others]
    return every, [f"{c.name}: {text}" for c in every if not c.misfit for text in c.settings]


def shipped_rows() -> list[tuple[str, str | None]]:
    """Name and preset of all shipped train observers; None as the preset of one that stands as it is."""
    rows: list[tuple[str, str | None]] = []
    for name, kind in train_observers().items():
        system = kind()
        own = None if system.default_preset is None else str(system.default_preset)
        rows += [(name, preset) for preset in dict.fromkeys((own, *system.presets))]
    return rows


def _preset(table: ComponentTable) -> str | None:
    """The preset that an observer has here, also where it is its own default."""
    system = make_declared(table, "")
    own = getattr(system, "default_preset", None)
    return table.preset or (None if own is None else str(own))


def _distinct(candidates: Sequence[BenchmarkCandidate]) -> list[BenchmarkCandidate]:
    """Candidates of which no two have one name: two instances of a class, say."""
    names, labels = [c.name for c in candidates], [c.table.label for c in candidates]
    found = []
    for place, one in enumerate(candidates):
        name, label = names[:place].count(one.name), labels[:place].count(one.table.label)
        table = one.table.model_copy(update={"label": f"{one.table.label} ({label + 1})"}) if label else one.table
        found.append(replace(one, name=f"{one.name}_{name + 1}" if name else one.name, table=table))
    return found


def _named(scenario: Scenario, parts: ScenarioParts, stated: Any, known: Known) -> BenchmarkCandidate:
    """An observer of the scenario, or one by the name of its model, or a class or an instance from a script."""
    if isinstance(stated, str) and stated in parts.observers:
        return _own(parts, stated)
    try:
        name = ModelName.of(stated)
    except ValueError as error:
        raise ScenarioError(f"{scenario.where}: {error}") from error
    model, _, preset = name.partition(":")
    if name.stated is None and preset and model in fmu_observer.OBSERVERS:
        return _shipped(parts, model, known, preset)
    if name.stated is None and name.lower().endswith(".fmu"):
        raise ScenarioError(
            f"{scenario.where}: {name} is an FMU, and nothing says what it is connected to. Make it a component of the "
            f"scenario and connect it (cosim new {name} shows how); all of the scenario's observers take part."
        )
    if name.stated is None and not names_code(name) and name not in fmu_observer.OBSERVERS:
        others = [*parts.observers, *(n for n in train_observers() if n not in parts.observers)]
        raise ScenarioError(f"{scenario.where}: unknown observer {name!r}; {nearest(name, others)}")
    if name.stated is None:
        name = ModelName.of(move_file(name, lambda path: absolute(path, ".")))
    return _shipped(parts, name, known)


def _own(parts: ScenarioParts, name: str) -> BenchmarkCandidate:
    return BenchmarkCandidate(name, parts.table.components[name], parts.sources(name), "scenario")


def _shipped(parts: ScenarioParts, model: str, known: Known, preset: str | None = None) -> BenchmarkCandidate:
    """An observer with its own defaults or a preset, and what is known of the train."""
    own = settings_of(getattr(model, "stated", None))  # what an instance says of the train stands
    chosen = {} if preset is None else {"preset": preset}
    table = ComponentTable.model_validate({"observer": model, **chosen, **own})
    system = make_declared(table, model)
    default = preset is None or preset == getattr(system, "default_preset", None)
    name = model.rpartition(":")[2].replace(".", "_") + ("" if default else f"_{preset}")
    wanted = {s.name for s in settable(system) if s.name in SHARED_PARAMETERS}
    shared = {n: v for n, v in known.items() if n in wanted and n not in table.parameters}
    values = {name: value for name, (value, _) in shared.items()}
    label = model if preset is None else f"{model}:{preset}"
    table = table.model_copy(update={"parameters": {**table.parameters, **values}, "label": label})
    sources = {s.name: parts.template[s.name] for s in system.inputs if s.name in parts.template}
    unique = name if name not in parts.table.components else f"{name}_with_defaults"
    settings = (_assumed(system, shared),) if wanted else ()
    return BenchmarkCandidate(unique, table, sources, "defaults", settings, _misfit(parts, system, sources))


def _assumed(system: Any, shared: Known) -> str:
    stated = ", ".join(f"{name} = {value:g} ({why})" for name, (value, why) in shared.items())
    units = {s.name: (s.start, s.unit) for s in settable(system)}
    rest = ", ".join(
        f"{f} = {units[f][0]:g}" + (f" {units[f][1]}" if units[f][1] != "1" else "")
        for f in SHARED_PARAMETERS
        if f in units and f not in shared
    )
    return (
        f"not set in the scenario, gains at their defaults; from the scenario: {stated or 'nothing of the train'}; "
        f"assumed: {rest or 'nothing'}."
    )


def _misfit(parts: ScenarioParts, system: Any, sources: Iterable[str]) -> str:
    """Why an observer cannot listen here, or an empty text."""
    triggered = getattr(system, "triggered_events", ())  # plain Python says with its `balise` what it takes
    payload = {s.name for event in triggered for s in event.payload}
    missing = [s.name for s in system.inputs if not s.optional and s.name not in {*sources, *payload}]
    if missing:
        return f"nothing in this scenario gives its input{'s' if len(missing) > 1 else ''} {', '.join(missing)}"
    if BALISE_EVENT in [event.name for event in triggered] and parts.table.balises is None:
        return "it is corrected by balises, and this scenario has none"
    return ""


def named_receivers(table: ScenarioTable) -> list[str]:
    """Who is notified of balises where the scenario names them; nobody where all that can be are.

    Args:
        table: the scenario.
    """
    return [] if table.balises is None else list(table.balises.receivers or [])


def with_candidate(scenario: Scenario, candidate: BenchmarkCandidate) -> Scenario:
    """The scenario with an observer as it was played, on which its report is.

    Args:
        scenario: the scenario. candidate: the observer; one of the scenario's own is there already.

    Raises:
        ScenarioError: the observer cannot listen here.
    """
    if candidate.misfit:
        raise ScenarioError(f"{candidate.name} cannot be coupled: {candidate.misfit}")
    changed = scenario.copy()
    if candidate.name not in changed.table().components:
        changed.add(candidate.name, **candidate.table.model_dump(by_alias=True, exclude_unset=True))
        lines = [connection(link, f"{candidate.name}.{signal}") for signal, link in candidate.sources.items()]
        changed.connect(*lines)
        if receivers := named_receivers(scenario.table()):
            changed.balises(receivers=[*receivers, candidate.name])
    return changed.report(observers=[candidate.name])
