"""The master of a scenario: from its tables to order, algorithm, step control and master."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial

from cosim.balises.service import BaliseService
from cosim.compiled.choice import choose_stepper
from cosim.components.component import Component
from cosim.coupling.connection import Connection
from cosim.coupling.graph import Group, execution_groups
from cosim.coupling.instants import recorded_order
from cosim.coupling.plan import Plan
from cosim.coupling.strong import topological
from cosim.errors import CouplingError
from cosim.master.algorithms.algorithm import Algorithm
from cosim.master.algorithms.choose import AlgorithmChoice
from cosim.master.algorithms.gauss_seidel import GaussSeidel
from cosim.master.algorithms.iterate import Iterate
from cosim.master.algorithms.jacobi import Jacobi
from cosim.master.algorithms.settings import IterationSettings
from cosim.master.axis import TimeAxis
from cosim.master.control.control import StepControl
from cosim.master.control.doubling import DoublingStep
from cosim.master.control.fixed import FixedStep
from cosim.master.control.multirate import set_rates
from cosim.master.master import Master
from cosim.master.system import System
from cosim.network.service import NetworkService
from cosim.results.recorder import Recorder
from cosim.results.result_data import SignalInfo
from cosim.results.stream import Stream
from cosim.run.signal_roles import switching_signals
from cosim.scenario.scenario_tables import MasterTable
from cosim.scenario.schema import ScenarioTable


def make_master(
    table: ScenarioTable,
    plan: Plan,
    axis: TimeAxis,
    balises: BaliseService | None,
    progress: Callable[[float], None] | None,
    choice: AlgorithmChoice,
    network: NetworkService | None = None,
) -> Master:
    """The master that a scenario asks for.

    Args:
        table: the scenario. plan: prepared, components instantiated. axis: communication points.
        balises: balise service, or None. progress: called now and then with the time reached [s].
        choice: the algorithm, and what it iterates. network: over which measurements travel, or None.

    Raises:
        CouplingError: the components cannot do what is asked for; they are named.
    """
    master = Master(
        plan,
        axis,
        balises,
        progress,
        algorithm=lambda plan: make_algorithm(table.master, plan, choice),
        control=_control(table.master),
        stepper=partial(choose_stepper, table.master.stepper),
        recorder=partial(make_recorder, table),
        events=table.master.events,
        network=network,
    )
    _check_rates(table, choice)
    _set_rates(table, plan, axis, balises, network)
    master.choose_stepper()
    return master


def make_recorder(
    table: ScenarioTable, signals: Sequence[SignalInfo], expected_rows: int, stream: Stream | None = None
) -> Recorder:
    """The recorder that keeps the rows which a scenario asks for.

    Args:
        table: of the scenario, with its roles. signals: that are recorded. expected_rows: room made at once.
        stream: where rows are to appear as they come, or None.
    """
    return Recorder(
        signals,
        expected_rows,
        memory=1e6 * table.master.record_memory,
        every=table.master.record_every,
        switching=switching_signals(table, [signal.name for signal in signals]),
        stream=stream,
    )


def make_algorithm(table: MasterTable, plan: Plan, choice: AlgorithmChoice) -> Algorithm:
    """The algorithm that was chosen.

    Args:
        table: threads and iteration. plan: prepared. choice: what it is to be.
    """
    algorithm: Algorithm
    if choice.algorithm == "iterate":
        algorithm = Iterate(plan, choice.iterated, IterationSettings(**table.iteration.model_dump()))
    elif choice.algorithm == "jacobi":
        algorithm = Jacobi(plan, table.threads)
    else:
        algorithm = GaussSeidel(plan)
    algorithm.choice = choice
    return algorithm


def stepping_groups(
    table: ScenarioTable,
    components: Mapping[str, Component],
    connections: Sequence[Connection],
    plant: str,
    receivers: Iterable[str],
) -> list[Group]:
    """The components in the groups and the order in which a scenario steps them.

    Before the receivers of telegrams must come the plant, and the odometer whose reading the telegrams carry; what was
    fresh in a run of which a part is played back stays so. First
    where that is free comes the train: the watched plant, else what the report holds observers against; last come those
    with `every`, so that they find the newest inputs.

    Args:
        table: the scenario. components: by name. connections: checked. plant: watched for balises, or empty.
        receivers: of telegrams.

    Raises:
        CouplingError: as for `execution_groups`.
    """
    odometer = None if table.balises is None else table.balises.odometer
    sources = {plant} | (set() if odometer is None else {odometer.partition(".")[0]})
    before = [(source, name) for source in sorted(sources) for name in receivers if source != name]
    recorded = recorded_order(components, connections)
    if topological(list(components), {*before, *recorded}) is not None:
        before += recorded  # else it contradicts what must be: this is not the run that was recorded
    truth = (table.report.true_position or table.report.true_speed or "").partition(".")[0]
    train = [name for name in (plant or truth,) if name in components]
    slow = [name for name, component in table.components.items() if component.every > 1]
    return execution_groups(components, connections, before, train, slow)


def idle_settings(table: MasterTable) -> list[str]:
    """What the user set that has no effect beside the other settings, in words.

    Args:
        table: of the scenario.
    """
    needs = {
        "threads": ("algorithm", "jacobi", table.algorithm == "jacobi" or table.threads == 1),
        "tolerance": ("control", "doubling", table.control == "doubling"),
        "smallest_step": ("control", "doubling", table.control == "doubling"),
    }
    return [
        f"master.{key} has no effect without master.{other} = '{value}'."
        for key, (other, value, works) in needs.items()
        if key in table.model_fields_set and not works
    ]


def _check_rates(table: ScenarioTable, choice: AlgorithmChoice) -> None:
    for name in (name for loop in choice.iterated for name in loop):
        if table.components[name].every != 1:
            raise CouplingError(
                f"{name}: every = {table.components[name].every} is not possible: it is part of a loop that is "
                f"iterated, whose "
                "components take the same steps."
            )


def _set_rates(
    table: ScenarioTable, plan: Plan, axis: TimeAxis, balises: BaliseService | None, network: NetworkService | None
) -> None:
    every = {name: component.every for name, component in table.components.items() if component.every != 1}
    substeps = {name: component.substeps for name, component in table.components.items() if component.substeps != 1}
    if every and table.master.control != "fixed":
        raise CouplingError(
            f"every = {max(every.values())} needs communication steps that are fixed; set master.control = 'fixed'."
        )
    taken = {name: "its clocks are connected" for wire in plan.clocks for name in (wire.source[0], wire.target[0])}
    taken |= {} if balises is None else {r.planned.component.name: "it is told of balises" for r in balises.receivers}
    if network is not None:
        taken |= {listener.component: "it is told of packets" for listener in network.listeners}
    if balises is not None:
        taken[balises.plant] = "it is watched for balises"
    set_rates(plan, axis, every, substeps, taken)


def _control(table: MasterTable) -> Callable[[System], StepControl]:
    if table.control == "fixed":
        return FixedStep
    second_order = table.inputs == "extrapolate" or (table.inputs == "interpolate" and table.algorithm == "iterate")
    return lambda system: DoublingStep(system, table.tolerance, 3 if second_order else 2, table.smallest_step)
