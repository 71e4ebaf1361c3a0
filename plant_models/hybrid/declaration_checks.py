"""Whether what a hybrid system declares fits together: names, lists, events, warnings, resources, presets."""

from __future__ import annotations

from plant_models.hybrid.declarations import Declarations
from plant_models.repeated_names import repeated_names

RESERVED_NAMES = frozenset({"time", "internal_step", "seed", "late_policy", "replay_horizon", "held_switches"})


def check_declarations(system: Declarations) -> None:
    """Refuse a system whose declarations contradict one another.

    Args:
        system: whose signals, events, resources and presets are declared.

    Raises:
        ValueError: a name is not legal, used twice or unknown, or a signal stands in the wrong list; the message says
            which.
    """
    where = f"{type(system).__name__} ({system.name!r})"
    if not system.name.isidentifier():
        raise ValueError(f"{where}: the system's name must be a legal identifier.")
    _check_names(system, where)
    _check_causalities(system, where)
    _check_event_prefixes(system, where)
    _check_order_of_states(system, where)
    _check_warnings(system, where)
    _check_references(system, where)
    _check_presets(system, where)


def _check_names(system: Declarations, where: str) -> None:
    names = [s.name for s in (*system.states, *system.input_signals, *system.outputs, *system.parameters)]
    names += [e.name for e in system.events]
    names += [name for e in system.triggered_events for name in e.implied_names]
    refused = sorted({*repeated_names(names)} | (RESERVED_NAMES & set(names)))
    if refused:
        raise ValueError(f"{where}: names used twice or reserved: {', '.join(refused)}.")


def _check_order_of_states(system: Declarations, where: str) -> None:
    unknown_stiff = sorted(set(system.stiff) - {s.name for s in system.states if s.variability == "continuous"})
    if unknown_stiff:
        raise ValueError(f"{where}: stiff names {unknown_stiff}; expected names of continuous states.")
    variabilities = [s.variability for s in system.states]
    if variabilities != sorted(variabilities):  # "continuous" sorts before "discrete"
        raise ValueError(f"{where}: list continuous states before memory.")


def _check_references(system: Declarations, where: str) -> None:
    """Periods, offsets and resources are those of parameters."""
    scalars = {s.name for s in system.parameters if s.size is None}
    for event in system.periodic_events:
        for reference in filter(None, (event.period, event.offset)):
            if reference not in scalars:
                raise ValueError(
                    f"{where}: event {event.name!r} refers to unknown parameter {reference!r}; expected a scalar one."
                )
        if event.counted_by and event.counted_by not in {s.name for s in system.outputs}:
            raise ValueError(f"{where}: event {event.name!r} is counted by {event.counted_by!r}; expected an output.")
    vectors = {s.name for s in system.parameters if s.size is not None}
    for resource in system.resources:
        if resource.parameter not in vectors:
            raise ValueError(f"{where}: {resource.file} is to set {resource.parameter!r}; expected a vector parameter.")


def _check_presets(system: Declarations, where: str) -> None:
    known = {s.name for s in (*system.parameter_signals, *system.states)}
    for preset, values in system.presets.items():
        unknown = sorted(set(values) - known)
        if unknown:
            raise ValueError(f"{where}: preset {preset!r} sets unknown parameters {unknown}.")


def _check_causalities(system: Declarations, where: str) -> None:
    lists = (("states", "local"), ("inputs", "input"), ("outputs", "output"), ("parameters", "parameter"))
    for attribute, causality in lists:
        for signal in getattr(system, attribute):
            if signal.causality != causality:
                raise ValueError(
                    f"{where}: {signal.name!r} is listed in {attribute} but has causality {signal.causality!r}, "
                    f"expected {causality!r}."
                )


def _check_warnings(system: Declarations, where: str) -> None:
    outputs = {s.name for s in system.outputs if s.size is None}
    for signal in system.outputs:
        unknown = [] if signal.warning is None else sorted(set(signal.warning.shows) - outputs)
        if unknown:
            raise ValueError(
                f"{where}: the warning of {signal.name!r} is to show {', '.join(unknown)}; expected scalar outputs."
            )


def _check_event_prefixes(system: Declarations, where: str) -> None:
    """A master finds the payload of an event by its prefix; nothing else that it sees may begin so."""
    for event in system.triggered_events:
        payload = {s.name for s in event.payload}
        others = [s.name for s in system.inputs] + [e.name for e in system.triggered_events]
        others += [s.name for e in system.triggered_events for s in e.payload if s.name not in payload]
        confusing = [name for name in others if name.startswith(f"{event.name}_")]
        if confusing:
            raise ValueError(
                f"{where}: {', '.join(confusing)} would be taken for payload of event {event.name!r}; rename."
            )
