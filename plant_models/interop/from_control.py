"""python-control objects as hybrid systems: linear or nonlinear, continuous or sampled."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from keyword import iskeyword
from typing import TYPE_CHECKING, Any

import numpy as np

from plant_models.hybrid import Array, HybridSystem, PeriodicEvent, TracedSystem, TracingError, vector
from plant_models.hybrid.arrays import of_length
from plant_models.hybrid.declaration_checks import RESERVED_NAMES
from plant_models.hybrid.declarations import Method
from plant_models.hybrid.signal import Signal, Variability, input_signal, memory, output_signal, parameter, state
from plant_models.interop.continuous_part import Values, filled, known

if TYPE_CHECKING:
    import control

# (t, x, u, params) -> values, as python-control calls it
Function = Callable[[Array, Array, Array, Mapping[str, Any]], Any]

SAMPLING = PeriodicEvent(
    "sampling", "sample_period", "sample_offset", description="The discrete-time system takes one step"
)
_TIMING = ("sample_period", "sample_offset", "sampling")


class ControlSystem(HybridSystem):
    """A python-control system as a hybrid system; made by `from_state_space` and `from_nonlinear_io`.

    A continuous one flows. A discrete one steps at ``start + sample_offset + k * sample_period``: there it reads its
    inputs, puts out ``y[k]``, which is held until the next instant, and moves on to ``x[k+1]``, which is what its
    states then hold.

    Args:
        update, read: state and output equations as functions of `t`, `x`, `u`, `params`.
        name, description, source: of the system. states, inputs, outputs, parameters: its signals.
        constants: parameters that are no numbers and are passed as they are.
        sample_period: [s], 0 for a continuous system. method: of integration. internal_step: [s].
    """

    def __init__(
        self,
        update: Function,
        read: Function,
        *,
        name: str,
        description: str,
        source: str,
        states: Sequence[Signal],
        inputs: Sequence[Signal],
        outputs: Sequence[Signal],
        parameters: Mapping[str, Signal],
        constants: Mapping[str, Any],
        sample_period: float,
        method: Method,
        internal_step: float,
    ) -> None:
        self._update, self._read, self._constants = update, read, dict(constants)
        self._parameter_fields = {key: signal.name for key, signal in parameters.items()}
        self._sampled = sample_period > 0.0
        self.name, self.description, self.source = name, description, source
        self.inputs, self.outputs = tuple(inputs), tuple(outputs)
        self.method, self.internal_step = method, internal_step
        self.states, self.parameters = tuple(states), tuple(parameters.values())
        self._own = [s.name for s in states]
        if self._sampled:
            held = [memory(f"held_{s.name}", s.unit, 0.0, f"{s.name} since the last instant") for s in outputs]
            self.states = (*states, *held)
            self.parameters = (*self.parameters, *_timing(sample_period))
            self.events = (SAMPLING,)
        super().__init__()

    def flow(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        return {} if self._sampled or not self.states else self._moved("flow()", t, x, u, p)

    def jump(self, event: str, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        """One step of a discrete system: its next state, and the outputs held from now on."""
        held = {f"held_{name}": value for name, value in self._reported(t, x, u, p).items()}
        return self._moved("jump('sampling')", t, x, u, p) | held

    def output(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        """Outputs, of a discrete system those of the last instant."""
        if self._sampled:
            return {s.name: getattr(x, f"held_{s.name}") for s in self.outputs}
        return self._reported(t, x, u, p)

    def _moved(self, what: str, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        """Derivatives, or the next states."""
        values = of_length(self._called(self._update, t, x, u, p), len(self._own), f"{self.name}: {what}")
        return dict(zip(self._own, values, strict=True))

    def _reported(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        """Outputs now."""
        values = self._called(self._read, t, x, u, p)
        return {s.name: values[i] for i, s in enumerate(self.outputs)}

    def _called(self, function: Function, t: Array, x: Any, u: Any, p: Any) -> Array:
        """What an equation gives for states and inputs as vectors, shape (n,)."""
        state, inputs = _together(x, self._own), _together(u, [s.name for s in self.inputs])
        return _flat(function(t, state, inputs, self._params(p)))

    def _params(self, p: Any) -> dict[str, Any]:
        return self._constants | {key: getattr(p, field) for key, field in self._parameter_fields.items()}


def from_state_space(
    sys: control.StateSpace,
    x0: Values | None = None,
    *,
    name: str | None = None,
    description: str = "A linear system from python-control",
    units: Mapping[str, str] | None = None,
    sample_period: float | None = None,
    method: Method = "rk4",
    internal_step: float = 1e-3,
) -> HybridSystem:
    """A linear system ``dx = A x + B u`` or ``x[k+1] = A x[k] + B u[k]``, ``y = C x + D u``, as a hybrid system.

    Names are kept where they are legal and unique: ``x[0]`` becomes ``x_0``; a state, output or parameter whose name is
    taken gets the ending ``_state``, ``_output`` or ``_parameter``.

    Args:
        sys: a ``control.StateSpace``, or what ``control.ss`` can turn into one.
        x0: start of the states, by name or in order; zero by default.
        name, description: of the hybrid system; by default the name of `sys`.
        units: units of states, inputs, outputs and parameters by their name in `sys`; ``1`` where none is given.
        sample_period: of a discrete system whose time base is unspecified (``dt=True``) [s].
        method, internal_step: of the integrator.

    Raises:
        ValueError: a name is unknown, or the sample period is missing.
    """
    import control  # noqa: PLC0415 - a second to import; only for those who convert

    linear = sys if isinstance(sys, control.StateSpace) else control.ss(sys)
    A, B, C, D = (np.array(getattr(linear, key), dtype=float) for key in "ABCD")
    how: dict[str, Any] = {"method": method, "internal_step": internal_step}
    return _made(linear, _product(A, B), _product(C, D), x0, name, description, units, sample_period, how)


def from_nonlinear_io(
    sys: control.NonlinearIOSystem,
    x0: Values | None = None,
    *,
    name: str | None = None,
    description: str = "A nonlinear system from python-control",
    units: Mapping[str, str] | None = None,
    sample_period: float | None = None,
    method: Method = "rk4",
    internal_step: float = 1e-3,
) -> HybridSystem:
    """A nonlinear input/output system of python-control as a hybrid system.

    Its functions are traced where they can be: plain NumPy without branching on values, results as a tuple, a list or
    ``plant_models.hybrid.vector``. Where they cannot (``np.array([...])`` of several values, ``if``, ``math``, an
    interconnected system), the hybrid system says ``traceable = False`` and runs as Python. Numbers and vectors in
    ``params`` become parameters; anything else there stays as it is.

    Args:
        sys: the system; its numbers of states, inputs and outputs must be known.
        x0, name, description, units, sample_period, method, internal_step: see `from_state_space`; ``rosenbrock`` needs
            a system that can be traced.

    Raises:
        ValueError: a number of signals or the sample period is missing, a name is unknown, or the method needs tracing.
    """
    import control  # noqa: PLC0415

    how: dict[str, Any] = {"method": method, "internal_step": internal_step}
    if isinstance(sys, control.StateSpace):
        named: dict[str, Any] = {"name": name, "description": description, "units": units}
        return from_state_space(sys, x0, sample_period=sample_period, **named, **how)
    update, read = _functions(sys, type(sys) is control.NonlinearIOSystem)
    return _usable(_made(sys, update, read, x0, name, description, units, sample_period, how))


def _usable(system: ControlSystem) -> ControlSystem:
    """The system, with what is found out: whether its functions can be traced."""
    system.traceable = _can_be_traced(system)
    if not system.traceable and system.method == "rosenbrock":
        raise ValueError(
            f"{system.name}: method 'rosenbrock' needs functions that can be traced, and these cannot; use 'rk4'."
        )
    return system


def _made(
    sys: Any,
    update: Function,
    read: Function,
    x0: Values | None,
    name: str | None,
    description: str,
    units: Mapping[str, str] | None,
    sample_period: float | None,
    how: Mapping[str, Any],
) -> ControlSystem:
    period = _period(sys, sample_period)
    params = getattr(sys, "params", {})
    numbers = {key: value for key, value in params.items() if _is_number(value)}
    return ControlSystem(
        update,
        read,
        name=_identifier(name or sys.name),
        description=description,
        source=f"python-control, {type(sys).__name__} {sys.name}",
        constants={key: value for key, value in params.items() if key not in numbers},
        sample_period=period,
        **_signals(sys, numbers, x0, dict(units or {}), period > 0.0),
        **how,
    )


def _signals(
    sys: Any, numbers: Mapping[str, Any], x0: Values | None, unit: Mapping[str, str], sampled: bool
) -> dict[str, Any]:
    """States, inputs, outputs and parameters, under legal names.

    Args:
        numbers: parameters by name. x0: start of the states. unit: by name. sampled: whether the system is discrete.
    """
    labels = {"input": sys.input_labels, "output": sys.output_labels, "state": sys.state_labels}
    labels["parameter"] = list(numbers)
    for label in unit:
        known(label, [entry for group in labels.values() for entry in group], f"{sys.name}: signal")
    fields = _legal(labels, _TIMING if sampled else ())
    start = map(float, filled(dict.fromkeys(labels["state"], 0.0), x0, f"{sys.name}: state"))
    make_state = memory if sampled else state
    variability: Variability = "discrete" if sampled else "continuous"

    def of(kind: str) -> list[tuple[str, str, str]]:
        return [(fields[kind][n], unit.get(n, "1"), n) for n in labels[kind]]

    return {
        "states": [make_state(f, unit, next(start), f"State {n}") for f, unit, n in of("state")],
        "inputs": [input_signal(f, unit, 0.0, f"Input {n}") for f, unit, n in of("input")],
        "outputs": [output_signal(f, unit, f"Output {n}", variability=variability) for f, unit, n in of("output")],
        "parameters": {n: _parameter(f, unit, n, numbers[n]) for f, unit, n in of("parameter")},
    }


def _period(sys: Any, stated: float | None) -> float:
    """Sample period [s], 0 for a continuous system."""
    if not sys.dt:  # 0, or None, which python-control takes for either
        if stated is not None:
            raise ValueError(f"{sys.name}: it is continuous, so a sample_period of {stated!r} s has no meaning for it.")
        return 0.0
    if sys.dt is True and stated is None:
        raise ValueError(f"{sys.name}: its time base is discrete but unspecified (dt=True); give sample_period [s].")
    if stated is not None and sys.dt is not True and stated != sys.dt:
        raise ValueError(f"{sys.name}: its sample period is {sys.dt!r} s, not {stated!r} s; leave sample_period out.")
    period = float(sys.dt if stated is None else stated)
    if not 0.0 < period < np.inf:
        raise ValueError(f"{sys.name}: a sample period must be positive and finite [s], got {period!r}.")
    return period


def _timing(period: float) -> tuple[Signal, ...]:
    return (
        parameter("sample_period", "s", period, "Time between two steps of the discrete system", min=1e-9),
        parameter("sample_offset", "s", 0.0, "Time of its first step after the start", min=0.0),
    )


def _product(by_state: np.ndarray, by_input: np.ndarray) -> Function:
    """The function ``by_state x + by_input u``, where either may be empty."""

    def product(_t: Array, x: Array, u: Array, _params: Mapping[str, Any]) -> Array:
        if not by_state.size:
            return by_input @ u if by_input.size else np.zeros((len(by_state), *x.shape[1:]))
        return by_state @ x + by_input @ u if by_input.size else by_state @ x

    return product


def _functions(sys: Any, plain: bool) -> tuple[Function, Function]:
    """Update and output functions, of a `plain` system those that it was made of."""
    for what in ("nstates", "ninputs", "noutputs"):
        if getattr(sys, what) is None:
            raise ValueError(f"{sys.name}: its {what} is not known; give states, inputs and outputs when you make it.")
    if not plain:
        return sys.dynamics, sys.output
    return sys.updfcn, sys.outfcn or (lambda _t, x, _u, _params: x[: sys.noutputs])


def _can_be_traced(system: HybridSystem) -> bool:
    traced = TracedSystem(system)
    try:
        _ = (traced.flow, traced.output, *(traced.jump(event.name) for event in system.events))
    except TracingError:
        return False
    return True


def _together(values: Any, names: Sequence[str]) -> Array:
    """Scalars of these names as a vector, shape (n,)."""
    return vector(*(getattr(values, name) for name in names)) if names else np.zeros(0)


def _flat(values: Any) -> Array:
    """Whatever an update or output function returns, as a vector."""
    if isinstance(values, list | tuple):
        return vector(*values) if values else np.zeros(0)
    return values if values.ndim else vector(values)


def _is_number(value: Any) -> bool:
    if isinstance(value, bool | str) or value is None:
        return False
    array = np.asarray(value)
    return array.dtype.kind in "if" and array.ndim <= 1 and array.size > 0


def _parameter(field: str, unit: str, key: str, value: Any) -> Signal:
    if np.ndim(value) == 0:
        return parameter(field, unit, float(value), f"Parameter {key}")
    return parameter(field, unit, tuple(float(v) for v in value), f"Parameter {key}", size=len(value))


def _legal(groups: Mapping[str, Sequence[str]], taken: Sequence[str]) -> dict[str, dict[str, str]]:
    """Legal and unique names of inputs, outputs, states and parameters, in this order of precedence."""
    used = {*RESERVED_NAMES, *taken}
    fields: dict[str, dict[str, str]] = {}
    for kind, labels in groups.items():
        fields[kind] = {}
        for label in labels:
            name = _identifier(label)
            if name in used:
                name = f"{name}_{kind}"
            while name in used:
                name = f"{name}_"
            used |= {name, f"held_{name}"}
            fields[kind][label] = name
    return fields


def _identifier(label: str) -> str:
    name = re.sub(r"\W+", "_", label).strip("_")
    return f"v_{name}" if not name or name[0].isdigit() or iskeyword(name) else name
