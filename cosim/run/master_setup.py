"""From plan and services to the master that a scenario asks for: algorithm, step control, rates, stepper, recorder."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from functools import partial

from cosim.compiled.choice import choose_stepper
from cosim.coupling.plan import Plan
from cosim.errors import CouplingError
from cosim.master.algorithms.algorithm import Algorithm, IterationSettings
from cosim.master.algorithms.choose import AlgorithmChoice
from cosim.master.algorithms.gauss_seidel import GaussSeidel
from cosim.master.algorithms.iterate import Iterate
from cosim.master.algorithms.jacobi import Jacobi
from cosim.master.axis import TimeAxis
from cosim.master.control.control import StepControl
from cosim.master.control.doubling import DoublingStep
from cosim.master.control.fixed import FixedStep
from cosim.master.control.multirate import set_rates
from cosim.master.master import Master
from cosim.master.system import System
from cosim.results.recorder import Recorder
from cosim.results.result_data import SignalInfo
from cosim.results.stream import Stream
from cosim.run.services import Services
from cosim.run.signal_roles import report_spec
from cosim.run.task import RunTask
from cosim.scenario.scenario_tables import MasterTable
from cosim.scenario.schema import ScenarioTable


def make_master(
    task: RunTask,
    plan: Plan,
    services: Services,
    choice: AlgorithmChoice,
    progress: Callable[[float, float], None] | None,
) -> Master:
    """The master that a scenario asks for.

    Args:
        task: of the run. plan: prepared, components instantiated. services: of the run.
        choice: the algorithm, and what it iterates. progress: called now and then with the time reached and the end
            [s].

    Raises:
        CouplingError: the components cannot do what is asked for; they are named.
    """
    table, axis = task.table, task.axis
    master = Master(
        plan,
        axis,
        services.balises,
        None if progress is None else lambda t: progress(t, axis.stop),
        algorithm=lambda plan: _make_algorithm(table.master, plan, choice),
        control=_control(table.master),
        stepper=partial(choose_stepper, table.master.stepper),
        recorder=partial(make_recorder, table),
        events=table.master.events,
        network=services.packets,
    )
    _check_rates(table, choice)
    _set_rates(table, plan, axis, services)
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
        switching=_switching_signals(table, [signal.name for signal in signals]),
        stream=stream,
    )


def _make_algorithm(table: MasterTable, plan: Plan, choice: AlgorithmChoice) -> Algorithm:
    """The algorithm that was chosen."""
    algorithm: Algorithm
    if choice.algorithm == "iterate":
        algorithm = Iterate(plan, choice.iterated, IterationSettings(**table.iteration.model_dump()))
    elif choice.algorithm == "jacobi":
        algorithm = Jacobi(plan, table.threads)
    else:
        algorithm = GaussSeidel(plan)
    algorithm.choice = choice
    return algorithm


def _check_rates(table: ScenarioTable, choice: AlgorithmChoice) -> None:
    for name in (name for loop in choice.iterated for name in loop):
        if table.components[name].every != 1:
            raise CouplingError(
                f"{name}: every = {table.components[name].every} is not possible: it is part of a loop that is "
                f"iterated, whose "
                "components take the same steps."
            )


def _set_rates(table: ScenarioTable, plan: Plan, axis: TimeAxis, services: Services) -> None:
    balises, network = services.balises, services.packets
    every = {name: component.every for name, component in table.components.items() if component.every != 1}
    substeps = {name: component.substeps for name, component in table.components.items() if component.substeps != 1}
    if every and table.master.control != "fixed":
        raise CouplingError(
            f"every = {max(every.values())} needs communication steps that are fixed; set master.control = 'fixed'."
        )
    taken = {name: "its clocks are connected" for wire in plan.clocks for name in (wire.source[0], wire.target[0])}
    taken |= {} if balises is None else {r.planned.component.name: "it receives balises" for r in balises.receivers}
    if network is not None:
        taken |= {listener.component: "it receives packets" for listener in network.listeners}
    if balises is not None:
        taken[balises.plant] = "it is watched for balises"
    set_rates(plan, axis, every, substeps, taken)


def _control(table: MasterTable) -> Callable[[System], StepControl]:
    if table.control == "fixed":
        return FixedStep
    second_order = table.inputs == "extrapolate" or (table.inputs == "interpolate" and table.algorithm == "iterate")
    return lambda system: DoublingStep(system, table.tolerance, 3 if second_order else 2, table.smallest_step)


def _switching_signals(table: ScenarioTable, recorded: Iterable[str]) -> list[int]:
    """Which signals are judged by when they turn from zero to another number, or back: true fault, detection, and what
    expectations look at.
    """
    spec = report_spec(table)
    evaluated = {spec.true_fault, *(f"{observer}.{spec.detection}" for observer in spec.observers)}
    evaluated |= {getattr(item, "signal", None) for item in table.expect}
    return [place for place, name in enumerate(recorded) if name in evaluated]
