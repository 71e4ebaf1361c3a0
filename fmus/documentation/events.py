"""How an FMU is told of its events, from its model description."""

from __future__ import annotations

from html import escape

from fmpy.model_description import ModelDescription, ModelVariable

from fmu_observer.event_protocol import LATE_POLICIES, OUTCOME_VARIABLES
from plant_models.hybrid import HybridSystem, TriggeredEvent

LATE = {
    "replay": "it goes back to the stamp, jumps, and integrates forward again with the inputs it had, as far back as "
    "<code>replay_horizon</code>",
    "reject": "the event has no effect but a warning",
    "late": "it jumps when it is told; for comparison only",
}


def event_section(system: HybridSystem, description: ModelDescription) -> str:
    """Triggered events with their protocol, periodic events with their period; empty where there are none.

    Args:
        system: the system in the FMU. description: model description of the FMU.
    """
    by_name = {v.name: v for v in description.modelVariables}
    parts = [_triggered(event, by_name) for event in system.triggered_events]
    if parts:
        parts.append(_exactness(by_name))
    if system.periodic_events:
        parts.append(_periodic(system))
    return "\n".join(parts)


def _triggered(event: TriggeredEvent, by_name: dict[str, ModelVariable]) -> str:
    count, stamp = event.implied_names
    payload = [name for signal in event.payload for name in signal.scalar_names]
    inputs = ", ".join(f"<code>{escape(name)}</code>" for name in [*payload, stamp])
    title = f"<h3>{escape(event.name)}</h3>" + (f"<p>{escape(event.description)}.</p>" if event.description else "")
    if count in by_name:
        return (
            f"{title}<p>Set {inputs}, raise <code>{escape(count)}</code> by one and step; raised by more, it is one "
            f"event.</p>"
        )
    return (
        f"{title}<p>The triggered input clock <code>{escape(event.name)}</code>: enter event mode, set the clock and "
        f"{inputs}, "
        "call <code>fmi3UpdateDiscreteStates</code>, enter step mode.</p>"
    )


def _exactness(by_name: dict[str, ModelVariable]) -> str:
    text = (
        "<p>A stamp within the coming step is hit exactly: the FMU integrates to it, jumps, and integrates on. A stamp "
        "that is "
        "not set means now."
    )
    policy = by_name.get("late_policy")
    if policy is not None:
        name = LATE_POLICIES[int(policy.start) - 1]
        text += (
            f" A stamp before the current time goes by <code>late_policy</code>, here <code>{name}</code>: "
            f"{LATE[name]}."
        )
    counts = ", ".join(f"<code>{count}</code>" for count in OUTCOME_VARIABLES if count in by_name)
    return text + (f" What became of the events is counted in {counts}." if counts else "") + "</p>"


def _periodic(system: HybridSystem) -> str:
    items = []
    for event in system.periodic_events:
        offset = f", first after <code>{escape(event.offset)}</code>" if event.offset else ""
        what = f" {escape(event.description)}" if event.description else ""
        items.append(
            f"<li><code>{escape(event.name)}</code>: every <code>{escape(event.period)}</code>{offset}.{what}</li>"
        )
    return (
        "<h3>Periodic events</h3><p>They happen inside, at their own instants, between communication points too.</p>"
        + (f"<ul>{''.join(items)}</ul>")
    )
