"""Hybrid systems as python-control objects: the whole continuous part, or its linearisation at an operating point."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from plant_models.hybrid import HybridSystem
from plant_models.interop.continuous_part import ContinuousPart, Values

if TYPE_CHECKING:
    import control


def to_nonlinear_io(
    system: HybridSystem,
    preset: str | None = None,
    parameters: Mapping[str, float] | None = None,
    memory: Mapping[str, float] | None = None,
) -> control.NonlinearIOSystem:
    """The continuous part of a hybrid system, names kept, parameters adjustable through python-control's ``params``.

    Events do not occur (`left_out` names them): discrete states keep the values in `memory`, payloads and noises their
    starts. Dry friction is resolved: a state at exactly zero is held while the flow is smaller than the friction.
    Solvers with step-size control seldom meet zero exactly, so they chatter at a standstill, where `Runtime` stops.

    Args:
        system: the hybrid system. preset: its preset; None for the default one. parameters: values that replace the
            preset's.
        memory: values at which discrete states are held; by default their starts.

    Returns:
        A continuous-time system. Its start state is not part of it: see `HybridSystem.start_state`.

    Raises:
        ValueError: nothing in the system is continuous, or a name is unknown.
    """
    import control  # noqa: PLC0415 - a second to import; only for those who convert

    part = ContinuousPart(system, preset, parameters, memory)
    params = dict(part.parameters)
    return control.NonlinearIOSystem(
        part.derivative, part.output, params=params, name=system.name, dt=0, **_labels(part)
    )


def to_state_space(
    system: HybridSystem,
    x0: Values | None = None,
    u0: Values | None = None,
    *,
    preset: str | None = None,
    parameters: Mapping[str, float] | None = None,
    memory: Mapping[str, float] | None = None,
    t: float = 0.0,
) -> control.StateSpace:
    """Linearisation ``d dx = A dx + B du``, ``dy = C dx + D du`` about a point, by the exact traced Jacobians.

    The point need not be an equilibrium; `operating_point` finds one. A state with dry friction keeps the direction it
    has in `x0`: one at rest that the friction holds stays at rest, so its row of A and B is zero. Events are left out.

    Args:
        system: a traceable hybrid system. x0, u0: continuous states and inputs. t: time of the linearisation [s].
        preset, parameters, memory: see `to_nonlinear_io`.

    Returns:
        A continuous-time system in deviations from the point, names kept.

    Raises:
        ValueError: nothing in the system is continuous, it has no inputs or outputs, or a name or a number is wrong.
        TracingError: the system cannot be traced; ``control.linearize`` of `to_nonlinear_io` works on differences.
    """
    import control  # noqa: PLC0415

    part = ContinuousPart(system, preset, parameters, memory)
    labels = _labels(part)
    lacking = [what for what, names in labels.items() if not names]
    if lacking:
        advice = "and a StateSpace needs some; convert it with to_nonlinear_io"
        raise ValueError(f"{system.name}: it has no {lacking[0]}, {advice}.")
    return control.StateSpace(*jacobians(part, *part.point(x0, u0), t), 0, name=system.name, **labels)


def _labels(part: ContinuousPart) -> dict[str, Any]:
    """Names of signals, as python-control takes them."""
    return {"states": list(part.states), "inputs": list(part.inputs), "outputs": list(part.outputs)}


def jacobians(
    part: ContinuousPart, x: np.ndarray, u: np.ndarray, t: float = 0.0
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Exact A, B, C, D of a continuous part at states `x` of shape (nc,) and inputs `u` of shape (m,)."""
    system = part.system
    state, inputs, p = part.whole(x, u, part.parameters)
    signs = np.sign(state[system.friction_indices()])
    if system.switchings:
        sides = system.switch_vector(t, state, inputs, p)
        signs = np.concatenate([signs, np.ravel(sides)])
    tangent, q = part.traced.tangent, len(part.outputs)
    still = [np.zeros(1), np.zeros(len(state)), np.zeros(len(inputs)), np.zeros(len(p))]

    def columns(group: int, count: int) -> np.ndarray:
        found = np.zeros((q + len(x), count))
        for i in range(count):
            seeds = [seed.copy() for seed in still]
            seeds[group][i] = 1.0
            found[:, i] = np.asarray(tangent(t, state, inputs, p, signs, *seeds)).ravel()
        return found

    by_x, by_u = columns(1, len(x)), columns(2, len(u))
    return by_x[q:], by_u[q:], by_x[:q], by_u[:q]
