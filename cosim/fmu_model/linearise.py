"""Linearising: an FMU at a point, by its directional derivatives where they are right, else by central differences."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from itertools import pairwise
from math import inf, isfinite
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cosim.components.stated_units import NONE_STATED, StatedUnit
from cosim.errors import nearest
from cosim.fmu_model.exchange import ExchangeModel
from cosim.fmu_model.linearisation import Linearisation, Method
from cosim.fmu_model.opening import open_model
from cosim.fmu_model.sealed import FmuModelError, SealedModel
from cosim.fmu_model.trust import check_states
from fmus.check.findings import Verdict
from fmus.check.finite_differences import RELATIVE_STEP, compare
from fmus.fmi.standard import Interface

Array = NDArray[np.float64]
_HELD_TYPES = ("Real", "Float64", "Float32")
_LENGTHS = (1.0, 1e2, 1e4)
"""Of differences over a step of co-simulation, in shortest ones."""
_AGREE = 1e-2
"""Share of the largest slope of a column by which slopes over two lengths may differ: more is a solver's noise."""
MOST_NAMED = 6
"""Names of held variables in a sentence."""
Function = Callable[[Array, Array], tuple[Array, Array]]  # (states, inputs) -> (rates or next states, outputs)


def linearise_fmu(
    path: str | Path,
    *,
    t: float = 0.0,
    states: Mapping[str, float] | None = None,
    inputs: Mapping[str, float] | None = None,
    parameters: Mapping[str, float] | None = None,
    state_names: list[str] | None = None,
    simulate: bool = True,
    by_inputs: list[str] | None = None,
    outputs: list[str] | None = None,
    interface: Interface | None = None,
    step: float = 0.01,
    units: Mapping[str, StatedUnit] = NONE_STATED,
) -> Linearisation:
    """Matrices A, B, C, D of an FMU at a point.

    A model exchange FMU gives those of continuous time. An FMU with co-simulation only gives those from one
    communication step to the next: its derivatives are not to be had.

    Args:
        path: the ``.fmu`` file. t: instant [s].
        states: values by name; those left out are where a run from time zero arrives at `t`, or at their starts.
        inputs: values by name; those left out at their starts. Held during the run to `t`.
        parameters: start values by name.
        state_names: of a co-simulation that declares no continuous states: the variables that hold its state.
        simulate: whether states come from a run to `t`; else from their starts.
        by_inputs: inputs of B and D; None for all real ones. outputs: those of C and D; None for all real ones.
        interface: ``model-exchange`` or ``co-simulation``; None for model exchange where the FMU has it.
        step: communication step of a co-simulation [s].
        units: what is stated of its variables, by name; numbers stay those of the FMU itself.

    Returns:
        The linearisation.

    Raises:
        FmuLoadError: the FMU cannot be opened. FmuModelError: it has no states, or a name is unknown.
    """
    model = _opened(path, interface, states=state_names, outputs=outputs, parameters=parameters, units=units)
    try:
        u = _filled(model, "input", model.inputs, model.start_inputs, inputs or {})
        x = model.start.copy()
        if simulate and t > 0.0 and set(states or {}) != set(model.states):
            x = _simulated(model, t, u, step)
        x = _filled(model, "state", model.states, x, states or {})
        return _linearise_model(model, t, x, u, step).part(by_inputs, None)
    finally:
        model.close()


def _linearise_model(model: SealedModel, t: float, x: Array, u: Array, step: float) -> Linearisation:
    """Matrices of an open model at a point.

    Args:
        model: the FMU. t: instant [s]. x: states, shape (n,). u: inputs, shape (m,).
        step: of a co-simulation [s].

    Returns:
        The linearisation.

    Raises:
        FmuModelError: the FMU refuses the point.
    """
    n, exchange = len(model.states), isinstance(model, ExchangeModel)
    if isinstance(model, ExchangeModel):
        model.restart(t, x, u)
        remarks = _held_between_events(model)
        function = _continuous(model, t)
    else:
        remarks = _held_between_events(model)
        function = _sampled(model, t, step)
        remarks += _objections(model, step)
    rates, y = function(x, u)
    if not (np.isfinite(rates).all() and np.isfinite(y).all()):
        raise FmuModelError(f"{model.path}: at this point it gives values that are no finite numbers. Choose another.")
    whole, method, more = _jacobian(model, function, x, u)
    names = (*model.states, *model.inputs, *model.outputs)
    return Linearisation(
        Path(model.path).stem,
        *(whole[:n, :n], whole[:n, n:], whole[n:, :n], whole[n:, n:]),
        states=model.states,
        inputs=model.inputs,
        outputs=model.outputs,
        units={name: model.unit(name) for name in names},
        t=t,
        x=x,
        u=u,
        y=y,
        rates=rates,
        step=0.0 if exchange else step,
        method=method,
        remarks=(*remarks, *more),
    )


def right_slopes(model: ExchangeModel) -> bool:
    """Whether an FMU has directional derivatives that agree with differences at its start.

    Args:
        model: the FMU.
    """
    if not model.directional:
        return False
    model.restart(0.0, model.start, model.start_inputs)
    found, _ = _directional(model, _continuous(model, 0.0), model.start, model.start_inputs)
    return found is not None


def _opened(path: str | Path, interface: Interface | None, **named: Any) -> SealedModel:
    """The model by the interface asked for; model exchange where there is a choice."""
    if interface is not None:
        return open_model(path, interface, **named)
    try:
        return open_model(path, "model-exchange", **named)
    except FmuModelError as error:
        if "it has no model-exchange" not in str(error):
            raise
    return open_model(path, "co-simulation", **named)


def _continuous(model: ExchangeModel, t: float) -> Function:
    def function(x: Array, u: Array) -> tuple[Array, Array]:
        model.move(t, x, u)
        return model.derivatives(), model.read()[1]

    return function


def _sampled(model: SealedModel, t: float, step: float) -> Function:
    """The states a step later, and the outputs before it.

    Each from a restart of its own: an FMU may forget states that were set when it is read before the step.
    """

    def function(x: Array, u: Array) -> tuple[Array, Array]:
        _, y = model.values_at(t, x, u)
        return model.transition(t, step, x, u)[0], y

    return function


def _held_between_events(model: SealedModel) -> list[str]:
    """What the matrices leave out of an FMU with samples of its own: values and clocks that only an event changes."""
    variables = model.instance.description.modelVariables
    held = [
        v.name
        for v in variables
        if v.type in _HELD_TYPES
        and v.variability == "discrete"
        and v.name not in model.states
        and v.causality in ("output", "local")
    ]
    clocks = [v.name for v in variables if v.type == "Clock"]
    announced = getattr(model.instance, "next_event", inf)
    if not held and not clocks and not isfinite(announced):
        return []
    found = [f"it holds {_some(held)} between events"] if held else []
    found += [f"it has clocks ({_some(clocks)})"] if clocks else []
    found += [f"it announces an event at t = {announced:.9g} s"] if isfinite(announced) else []
    if isinstance(model, ExchangeModel):
        advice = (
            "What an event does is not in these matrices. For a sampled signal take A and B over one sampling period, "
            "and C of the signal before it is sampled."
        )
    else:
        advice = (
            "A and B hold what falls into this one step, C and D what is held at its begin: a sample or a quantiser "
            "has no slope. Where the FMU has model exchange, --interface model-exchange gives what lies between events."
        )
    return [f"The FMU has events of its own: {', '.join(found)}. {advice}"]


def _some(names: list[str]) -> str:
    return ", ".join(names[:MOST_NAMED]) + (f" and {len(names) - MOST_NAMED} more" if len(names) > MOST_NAMED else "")


def _objections(model: SealedModel, step: float) -> list[str]:
    """What stands against the states of a co-simulation, and where they are set, if that is unusual."""
    found = []
    if model.way == "step mode":
        found.append("Its states have no start values; they are set in Step Mode, after a restart, which it takes.")
    try:
        check_states(model, step)
    except FmuModelError as error:
        found.append(f"Do not rely on A and B before this is settled: {str(error).removeprefix(f'{model.path}: ')}")
    return found


def _jacobian(model: SealedModel, function: Function, x: Array, u: Array) -> tuple[Array, Method, list[str]]:
    """Jacobian of rates and outputs by states and inputs, shape (n + q, n + m), by the best method, and remarks."""
    remarks = list[str]()
    if isinstance(model, ExchangeModel):
        model.demand_moved(x)
        if model.directional:
            whole, objection = _directional(model, function, x, u)
            if whole is not None:
                return whole, "directional derivatives", []
            remarks.append(objection)
    whole, more = _differences(model, function, x, u)
    return whole, "central differences", remarks + more


def _differences(model: SealedModel, function: Function, x: Array, u: Array) -> tuple[Array, list[str]]:
    """Jacobian of rates and outputs by states and inputs, shape (n + q, n + m), and remarks.

    A solver in the FMU may not resolve a short difference: there slopes over longer ones are compared, and the shortest
    is taken that the next one confirms.
    """
    at, n = np.concatenate([x, u]), len(x)
    lengths = (1.0,) if isinstance(model, ExchangeModel) else _LENGTHS
    columns, coarse = [], []
    for i, name in enumerate((*model.states, *model.inputs)):
        shortest = RELATIVE_STEP * max(abs(at[i]), model.nominal(name))
        slopes = [_slope(function, at, i, n, length * shortest) for length in lengths]
        found = next((one for one, next_one in pairwise(slopes) if _resolved(one, next_one, slopes[-1])), slopes[-1])
        coarse += [name] if found is slopes[-1] and len(slopes) > 1 else []
        columns.append(found)
    function(x, u)
    remarks = [
        f"Central differences with steps of {RELATIVE_STEP:g} of the value or the nominal size, the larger of both."
    ]
    if coarse:
        remarks.append(
            f"Slopes along {_some(coarse)} depend on the length of the difference: the FMU's own solver is too coarse, "
            "or it has a kink here. Do not rely on these columns; set a finer tolerance, or try a point beside it."
        )
    return np.array(columns).T.reshape(n + len(model.outputs), len(at)), remarks


def _resolved(slope: Array, longer: Array, longest: Array) -> bool:
    """Whether slopes over a longer difference agree, and none is zero only because nothing so short is seen."""
    most = _AGREE * np.abs(longest).max(initial=0.0)
    return bool(((np.abs(longer - slope) <= most) & ((slope != 0.0) | (np.abs(longest) <= most))).all())


def _slope(function: Function, at: Array, i: int, n: int, size: float) -> Array:
    """Central difference of rates and outputs along one of states and inputs, shape (n + q,)."""
    above, below = at.copy(), at.copy()
    above[i] += size
    below[i] -= size
    ends = [np.concatenate(function(z[:n], z[n:])) for z in (above, below)]
    return np.asarray((ends[0] - ends[1]) / (above[i] - below[i]))


def _directional(model: ExchangeModel, function: Function, x: Array, u: Array) -> tuple[Array | None, str]:
    """The Jacobian that the FMU gives, shape (n + q, n + m), and what stands against it in words."""
    knowns, unknowns = (*model.states, *model.inputs), (*model.derivative_names, *model.outputs)
    values, at, n = dict(zip(knowns, np.concatenate([x, u]).tolist(), strict=True)), np.concatenate([x, u]), len(x)

    def evaluate(name: str, value: float) -> Array:
        z = at.copy()
        z[knowns.index(name)] = value
        return np.concatenate(function(z[:n], z[n:]))

    columns: dict[str, Array] = {}

    def directional(name: str) -> Array:
        function(x, u)
        columns[name] = model.instance.directional_derivative(list(unknowns), [name], [1.0])
        return columns[name]

    try:
        outcome = compare(evaluate, directional, values, unknowns, {name: model.nominal(name) for name in knowns})
    except RuntimeError as error:
        return None, f"Its directional derivatives are not used: {error}."
    if outcome.verdict is not Verdict.PASS:
        return None, (
            f"Its directional derivatives are not used: {outcome.detail}. They are wrong, or the model has a kink here "
            "(a train that stands or switches), where there is no slope: try a point beside it."
        )
    return np.array([columns[name] for name in knowns]).T, ""


def _simulated(model: SealedModel, t: float, u: Array, step: float) -> Array:
    """States at an instant [s] after a run from zero under held inputs."""
    model.restart(0.0, model.start, u)
    count = max(1, round(t / step))
    for k in range(count):
        model.advance(k * t / count, t / count)
    return model.read()[0]


def _filled(model: SealedModel, what: str, names: tuple[str, ...], values: Array, stated: Mapping[str, float]) -> Array:
    found = dict(zip(names, values.tolist(), strict=True))
    for name, value in stated.items():
        if name not in found:
            raise FmuModelError(f"{model.path}: no {what} {name!r}; {nearest(name, found)}")
        found[name] = float(value)
    return np.array(list(found.values()), dtype=float)
