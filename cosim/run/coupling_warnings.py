"""Remarks: what a user should know about a coupled system before it runs, in words. Changes nothing."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from cosim.components.component import Component
from cosim.components.recording import RecordingComponent
from cosim.coupling.connection import Connection, local_sources, unconnected_inputs
from cosim.coupling.graph import undeclared
from cosim.run.component_models import make_system, values_in_use
from cosim.run.loaded_components import names_with_starts
from cosim.scenario.scenario_tables import BalisesTable, ComponentTable
from cosim.scenario.schema import ScenarioTable

ROUNDING = 1e-9  # of a period over a step
CARRIED = {
    "derivatives": "value and slope to",
    "intermediate": "set within the step of",
    "mean": "mean over the step to",
    "held": "held, because discrete, for",
}


def coupling_warnings(
    table: ScenarioTable, components: Mapping[str, Component], connections: Sequence[Connection]
) -> tuple[list[str], list[str]]:
    """Doubts and notes about what is connected, and what is not.

    Args:
        table: the scenario. components: by name. connections: checked.

    Returns:
        Texts that warn, and texts that only explain.
    """
    free = unconnected_inputs(connections, components.values(), names_with_starts(table))
    doubts = [f"Unconnected inputs keep their start values: {', '.join(free)}."] if free else []
    deaf = [
        name for name, of in table.components.items() if of.tolerance is not None and components[name].fmi_version == 1
    ]
    if deaf:
        doubts.append(
            f"FMI 1.0 co-simulation has no call that takes a tolerance; it does nothing for {', '.join(deaf)}."
        )
    doubts += _counted_too_late(table, connections)
    notes = []
    hidden = [
        f"{name}.{signal}" for name, signals in local_sources(connections, components).items() for signal in signals
    ]
    if hidden:
        notes.append(
            f"Local variables that others read; no FMU declares what acts on them at once: {', '.join(hidden)}."
        )
    silent = undeclared(components.values())
    if silent:
        notes.append(f"Declare no dependencies, algebraic loops through them assumed absent: {', '.join(silent)}.")
    return doubts, notes


def _counted_too_late(table: ScenarioTable, connections: Sequence[Connection]) -> list[str]:
    """Outputs that are the difference of an input over a period which ends between two communication points: there a
    held input is that of the point before, and the reading is wrong by the way since.
    """
    targets, sources = {c.target for c in connections}, {c.source for c in connections}
    doubts = []
    for name, of in table.components.items():
        system = make_system(of, name) if of.model is not None and table.master.inputs == "hold" else None
        differences = getattr(system, "differences", {})
        read = {output for output in differences if (name, output) in sources} or set([*differences][:1])
        for output in (output for output in differences if output in read):
            signal, period = differences[output]
            seconds = float(getattr(values_in_use(of, system), period))
            steps = seconds / table.step
            if (name, signal) in targets and (abs(steps - round(steps)) > ROUNDING * steps or round(steps) < 1):
                doubts.append(
                    f"{name}: {output} counts {signal} every {seconds:g} s ({period}), no whole number of steps of "
                    f"{table.step:g} s; between communication points its input is that of the point before, so it is "
                    f"off by up to {100.0 / steps:.2g} % of the speed. Take a step that divides the period."
                )
    return doubts


def interpolation_note(interpolators: Mapping[str, str], inputs: str) -> str:
    """How components are told of inputs that follow a line.

    Args:
        interpolators: name of the interpolator of each component. inputs: what the scenario asks for.
    """
    by_interpolator: dict[str, list[str]] = {}
    for name, interpolator in interpolators.items():
        by_interpolator.setdefault(interpolator, []).append(name)
    said = "; ".join(f"{CARRIED[interpolator]}: {', '.join(names)}" for interpolator, names in by_interpolator.items())
    return f"Inputs between communication points ({inputs}): {said or 'none are connected'}."


def recording_notes(components: Mapping[str, Component], tables: Mapping[str, ComponentTable]) -> list[str]:
    """Which columns of tables are held and which are lines, where the scenario leaves that to the targets.

    Args:
        components: by name. tables: of them.
    """
    notes = []
    for name, component in components.items():
        if not isinstance(component, RecordingComponent) or component.recording.of_run:
            continue
        if tables[name].interpolation is not None:
            continue
        held, lines = sorted(component.held_outputs), sorted(component.line_outputs)
        said = [f"held from row to row: {', '.join(held)}"] if held else []
        said += [f"on lines between rows: {', '.join(lines)}"] if lines else []
        if said:
            notes.append(f"{name}: {'; '.join(said)}. Where that is wrong say so by 'interpolation'.")
    return notes


def late_telegram_warnings(
    table: BalisesTable, components: Mapping[str, Component], receivers: Sequence[str]
) -> list[str]:
    """A block replays what arrives late, and so does an FMU with the parameter `late_policy`; another one may not.

    Args:
        table: of the scenario. components: by name. receivers: components that take telegrams.
    """
    delay = table.latency + table.latency_jitter
    sealed = [n for n in receivers if components[n].kind == "FMU" and "late_policy" not in components[n].variables]
    if not sealed or delay <= 0.0:
        return []
    return [
        f"Telegrams arrive up to {delay:g} s late; {', '.join(sealed)}: a sealed FMU without a parameter late_policy "
        f"does not "
        "say what it does with late stamps."
    ]
