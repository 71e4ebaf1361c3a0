"""Checks of model exchange: start, derivatives, continuous states, saved states, reset, directional derivatives."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

from fmus.check.check import DERIVATIVES, DISTRUST, LIMIT, STATES, Check
from fmus.check.checks.life_checks import ExportedSymbolsCheck, LoadingCheck, by, listed, not_finite, real_names
from fmus.check.context import Context
from fmus.check.exchange_model import FmuModel
from fmus.check.findings import CheckOutcome, failed, passed, skipped
from fmus.check.finite_differences import compare, nominal_of
from fmus.fmi.standard import MODEL_EXCHANGE

_NO_STATES = "has no continuous states"
SHIFT = 0.01
"""States are moved by this share, so that derivatives are not evaluated at a start at rest, where friction has its
kink.
"""


@contextmanager
def started(context: Context) -> Iterator[FmuModel]:
    """An instance in continuous-time mode, freed at the end.

    Args:
        context: what is checked.
    """
    model = context.model()
    try:
        model.instantiate()
        _start(model, context)
        yield model
    finally:
        model.terminate()
        model.free()


def _start(model: FmuModel, context: Context) -> None:
    for name, value in context.starts.items():
        model.set_start(name, value)
    model.initialize(context.start_time)


def _moved(x: np.ndarray) -> np.ndarray:
    moved: np.ndarray = x + SHIFT * np.maximum(1.0, np.abs(x))
    return moved


def _path(model: FmuModel, context: Context) -> np.ndarray:
    """Derivatives along a few forward Euler steps that stay near the start, shape (steps, n)."""
    t, x, rows = context.start_time, model.states(), []
    for _ in range(5):
        rate = model.derivatives()
        rows.append(rate)
        t += context.step
        size = SHIFT * np.maximum(1.0, np.abs(x))
        x += np.clip(np.nan_to_num(context.step * rate), -size, size)
        model.set_time(t)
        model.set_states(x)
    return np.array(rows)


def _compared(first: np.ndarray, second: np.ndarray, when: str, good: str) -> CheckOutcome:
    """Whether two paths have the identical derivatives, each of shape (steps, n)."""
    equal = np.array_equal(first, second, equal_nan=True)
    return by("" if equal else f"{when} the same states have other derivatives", good)


def _numbered(count: int) -> list[str]:
    return [f"[{k}]" for k in range(1, count + 1)]


class ModelExchangeLoadingCheck(LoadingCheck, interface=MODEL_EXCHANGE):
    """The same for model exchange."""

    name = "model exchange: loading"


class ModelExchangeExportedSymbolsCheck(ExportedSymbolsCheck, interface=MODEL_EXCHANGE):
    """The same for model exchange."""

    name = "model exchange: exported symbols"


class ModelExchangeInitialiseCheck(
    Check, failing=DISTRUST, advice="give start values, if it needs some", basis=True, interface=MODEL_EXCHANGE, place=3
):
    """Instantiate, initialise, reach continuous-time mode, terminate, free."""

    name = "model exchange: initialise"

    @staticmethod
    def run(context: Context) -> CheckOutcome:
        with started(context) as model:
            return passed(f"reaches continuous-time mode; {model.state_count} continuous states")


class ModelExchangeValuesAtStartCheck(
    Check, failing=DISTRUST, advice="give start values", interface=MODEL_EXCHANGE, place=4
):
    """Outputs, derivatives and event indicators are finite at the start."""

    name = "model exchange: values at start"

    @staticmethod
    def run(context: Context) -> CheckOutcome:
        with started(context) as model:
            outputs = model.names("output")
            values = {
                "outputs": not_finite(outputs, model.read(outputs)),
                "derivatives": not_finite(_numbered(model.state_count), model.derivatives())
                if model.state_count
                else [],
                "event indicators": not_finite(_numbered(model.indicator_count), model.indicators())
                if model.indicator_count
                else [],
            }
        bad = {what: names for what, names in values.items() if names}
        if bad:
            return failed(
                "not finite at the start: " + "; ".join(f"{what} {listed(names)}" for what, names in bad.items())
            )
        return passed("outputs, derivatives and event indicators are finite at the start")


class ModelExchangeStatesCheck(Check, failing=DISTRUST, interface=MODEL_EXCHANGE, place=5):
    """States that are set are read back, and derivatives depend on nothing else."""

    name = "model exchange: states"

    @staticmethod
    def run(context: Context) -> CheckOutcome:
        with started(context) as model:
            if not model.state_count:
                return skipped(_NO_STATES)
            x = model.states()
            before = model.derivatives()
            moved = _moved(x)
            model.set_states(moved)
            if not np.array_equal(model.states(), moved):
                return failed("continuous states that were set are not what is read back")
            model.derivatives()
            model.set_states(x)
            if not np.array_equal(model.derivatives(), before, equal_nan=True):
                return failed("the derivatives at the same states differ after a visit elsewhere")
        return passed("states are read back, derivatives at the same states are identical")


class ModelExchangeResetAndReRunCheck(
    Check, failing=LIMIT, advice="make a new instance for each run", interface=MODEL_EXCHANGE, place=6
):
    """After a reset the same path has the identical derivatives."""

    name = "model exchange: reset and re-run"

    @staticmethod
    def run(context: Context) -> CheckOutcome:
        with started(context) as model:
            if not model.state_count:
                return skipped(_NO_STATES)
            first = _path(model, context)
            model.terminate()
            model.reset()
            _start(model, context)
            second = _path(model, context)
        return _compared(first, second, "after a reset", "the same after a reset is identical")


class ModelExchangeStateRoundTripCheck(
    Check,
    failing=LIMIT,
    advice="do not rely on saved states",
    interface=MODEL_EXCHANGE,
    place=7,
    declares=STATES,
):
    """Save, integrate on, restore, integrate again: bit-identical."""

    name = "model exchange: state round trip"

    @staticmethod
    def run(context: Context) -> CheckOutcome:
        with started(context) as model:
            if not model.state_count:
                return skipped(_NO_STATES)
            state = model.save()
            try:
                first = _path(model, context)
                model.restore(state)
                second = _path(model, context)
            finally:
                model.release(state)
        return _compared(first, second, "after a restored state", "what follows is identical")


class ModelExchangeDirectionalDerivativesCheck(
    Check,
    failing=LIMIT,
    advice="do not use its derivatives",
    interface=MODEL_EXCHANGE,
    place=8,
    declares=DERIVATIVES,
):
    """Directional derivatives of derivatives and outputs along states and inputs."""

    name = "model exchange: directional derivatives"

    @staticmethod
    def run(context: Context) -> CheckOutcome:
        with started(context) as model:
            found = [(u.variable, getattr(u.variable, "derivative", None)) for u in model.description.derivatives]
            scalar = [(rate.name, of.name) for rate, of in found if of is not None and not rate.shape]
            inputs, outputs = real_names(model, "input"), real_names(model, "output")
            unknowns, state_names = [*(r for r, _ in scalar), *outputs], [s for _, s in scalar]
            if len(scalar) != model.state_count or not unknowns or not (state_names or inputs):
                return skipped("has no pair of a scalar unknown and a scalar known")
            x = _moved(model.states())
            u = model.read(inputs)
            values = dict(zip([*state_names, *inputs], [*x.tolist(), *u.tolist()], strict=True))
            write, buffer = model.writer(inputs)

            def evaluate(name: str, value: float) -> np.ndarray:
                point = [value if n == name else v for n, v in values.items()]
                model.set_states(np.array(point[: len(x)]))
                buffer[:] = point[len(x) :]
                write()
                return model.read(unknowns)

            evaluate("", 0.0)

            def said(name: str) -> np.ndarray:
                evaluate("", 0.0)
                return model.directional_derivative(unknowns, [name], [1.0])

            return compare(evaluate, said, values, unknowns, {n: nominal_of(model.variables[n]) for n in values})
