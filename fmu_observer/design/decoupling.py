"""Decoupling of unknown inputs: when it is possible, the projection that does it, and gains for what is left free.

For ``dx = A x + B u + H d``, ``y = C x``. Plain NumPy and SciPy; nothing of it is needed at run time.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fmu_observer.certificates.finding import Finding, condition_found
from fmu_observer.design.pole_placement import observer_gain
from fmu_observer.models.observer_model import ObserverModel
from fmu_observer.models.suitability import require_linear
from fmu_observer.observability import MeasuredSystem, require_detectable, unobservable_modes
from fmu_observer.observability.modes import unobservable_subspace

_STATEMENT = "rank(C H) = rank(H), and the invariant zeros of (A, H, C) lie in the left half plane"
SOURCE = "Aguiar Cota 2019, (2.12); Darouach 1994"


@dataclass(frozen=True, eq=False)
class Decoupling:
    """``z = P x`` does not feel d, and ``x = z - M y`` exactly: the matrices of the observer (2.12).

    Attributes:
        M: shape (n, q). P: ``I + M C`` with ``P H = 0``, shape (n, n).
        free: ``P A``, whose pair with C is what gains can act on, shape (n, n).
        fixed: invariant zeros of (A, H, C) [1/s], shape (k,): poles of the error that no gain moves.
    """

    M: np.ndarray
    P: np.ndarray
    free: np.ndarray
    fixed: np.ndarray


def decoupling(A: np.ndarray, H: np.ndarray, C: np.ndarray) -> Decoupling:
    """The projection along the unknown inputs, ``M = -H (C H)^+``; it decouples exactly where rank(C H) = rank(H).

    Args:
        A: shape (n, n) [1/s]. H: shape (n, nd). C: shape (q, n).
    """
    M = -H @ np.linalg.pinv(C @ H)
    P = np.eye(len(A)) + M @ C
    free = P @ A
    fixed = [mode.eigenvalue for mode in unobservable_modes(MeasuredSystem(free, C))]
    pairs = [value.conjugate() for value in fixed if value.imag]
    return Decoupling(M, P, free, np.array([*fixed, *pairs], dtype=complex))


def _decoupling_ranks(H: np.ndarray, C: np.ndarray) -> tuple[int, int]:
    """rank(C H) and rank(H).

    Args:
        H: shape (n, nd). C: shape (q, n).
    """
    scale = np.linalg.norm(H, 2) * np.linalg.norm(C, 2)
    seen = np.linalg.svd(C @ H)[1]
    return int(np.sum(seen > len(C) * np.finfo(float).eps * 100.0 * scale)), int(np.linalg.matrix_rank(H))


def decoupling_condition(model: ObserverModel) -> Finding:
    """Whether a decoupling observer of a model exists: ranks, and the invariant zeros, which stay poles of its error.

    Args:
        model: a linear model with unknown inputs.

    Returns:
        ``rank_CH``, ``rank_H``; where these are equal ``invariant_zeros``, their number, and if there are any
        ``rightmost_zero``, their largest real part [1/s].

    Raises:
        ValueError: the model is nonlinear or declares no unknown inputs.
    """
    _require_unknown_inputs(model, "Decoupling")
    H = np.asarray(model.H)
    seen, whole = _decoupling_ranks(H, model.C)
    values: dict[str, float] = {"rank_CH": seen, "rank_H": whole}
    if seen < whole:
        return condition_found(False, values, _STATEMENT, SOURCE)
    fixed = decoupling(model.A, H, model.C).fixed.real
    values["invariant_zeros"] = len(fixed)
    if len(fixed):
        values["rightmost_zero [1/s]"] = float(fixed.max())
    return condition_found(bool(np.all(fixed < 0.0)), values, _STATEMENT, SOURCE)


def require_decoupling(model: ObserverModel, observer: str) -> None:
    """Refuse a model for which no decoupling observer exists.

    Args:
        model: a linear model with unknown inputs. observer: name of the observer, for the message.

    Raises:
        UnobservableError: an invariant zero does not decay; the message says in which states it lies.
        ValueError: the model is nonlinear, declares no unknown inputs, or the measurements do not show them at once.
    """
    _require_unknown_inputs(model, observer)
    H = np.asarray(model.H)
    seen, whole = _decoupling_ranks(H, model.C)
    if seen < whole:
        names = ", ".join(s.name for s in model.unknown_inputs)
        shown = ", ".join(s.name for s in model.measurements)
        raise ValueError(
            f"{observer}: model {model.name!r}: the measurements ({shown}) do not show every unknown input ({names}) "
            f"at once: rank(C H) = {seen}, expected rank(H) = {whole}. Measure a state on which it acts directly, "
            f"or use 'proportional_integral_uio', which estimates it instead."
        )
    name = f"{observer} of {model.name}, free of its unknown inputs"
    free = decoupling(model.A, H, model.C).free
    require_detectable(MeasuredSystem(free, model.C, states=tuple(s.name for s in model.states), name=name))


def decoupled_gain(model: ObserverModel, poles: Sequence[float] | np.ndarray) -> np.ndarray:
    """Gain K such that ``P A - K C`` has the given poles, beside the invariant zeros, which stay.

    Args:
        model: a linear model with unknown inputs. poles: as many as n less the number of invariant zeros [1/s], real or
            in conjugate pairs, none repeated more often than C has rank; or more of them, of which the first are used.

    Returns:
        K of shape (n, q).

    Raises:
        UnobservableError: an invariant zero does not decay. ValueError: the model does not suit, or there are too few
            poles.
    """
    require_decoupling(model, "Decoupling")
    free, C = decoupling(model.A, np.asarray(model.H), model.C).free, model.C
    hidden = unobservable_subspace(free, C).basis
    seen = np.linalg.svd(hidden)[0][:, hidden.shape[1] :] if hidden.shape[1] else np.eye(len(free))
    if len(poles) < seen.shape[1]:
        raise ValueError(f"Decoupling: got {len(poles)} poles, expected {seen.shape[1]}, one for each mode to place.")
    return np.asarray(seen @ observer_gain(seen.T @ free @ seen, C @ seen, np.asarray(poles)[: seen.shape[1]]))


def _require_unknown_inputs(model: ObserverModel, observer: str) -> None:
    """The model is linear and declares unknown inputs."""
    require_linear(model, observer, "thau")
    if not model.unknown_inputs:
        raise ValueError(
            f"{observer}: model {model.name!r} declares no unknown inputs. Use 'luenberger', or give an ObserverModel "
            f"with unknown_inputs and the matrix H by which they act."
        )
