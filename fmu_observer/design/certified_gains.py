"""The largest member of a family of gains that a finding covers. Knows findings, no observer and no track."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from fmu_observer.certificates.finding import Finding

Gains = dict[str, float]

_LIMIT = 4.0  # theta times gap certified for every mixture of gaps with K = (2, 1) and no drag
_TRIALS = 6
RATIOS = (2.5, 2.0, 1.5)  # of an adapting gain: theta times expected gap, largest first
SHARES = (3.0, 2.0, 1.2)  # of an adapting gain: theta_min times longest gap, largest first


def certified_gains(
    gap: float, family: Callable[[float], Gains], evaluate: Callable[[Mapping[str, float]], Finding]
) -> Gains | None:
    """Gains of a family with the largest theta up to ``LIMIT / gap``, to three digits, certified for a gap.

    The limit goes as 1 / theta but for the drag, so the limit at one theta gives the next. What the drag would allow
    beyond ``LIMIT / gap`` is not sought.

    Args:
        gap: longest gap to certify [s]. family: gains by theta [1/s]. evaluate: gains, for that gap.

    Returns:
        The gains, or None where none were found.
    """
    theta = _LIMIT / gap
    for _ in range(_TRIALS):
        candidate = family(rounded_down(theta))
        found = evaluate(candidate)
        if found.holds:
            return candidate
        theta = min(theta * found.limit / gap, 0.99 * theta)
        if not theta > 0.0:
            break
    return None


def balise_family(theta: float) -> Gains:
    """T-S gains that do what the high gain theta [1/s] does: ``K_1 = (2 theta, theta^2)``, decay ``2 theta``, no
    odometer.
    """
    return {
        "innovation_decay": 2.0 * theta,
        "balise_gain_position": 2.0 * theta,
        "balise_gain_speed": theta**2,
        "odometer_gain_position": 0.0,
        "odometer_gain_speed": 0.0,
    }


def rounded_down(value: float, digits: int = 3) -> float:
    """The value to a few digits, not above it, so that what is said is what was certified."""
    text = f"{value:.{digits - 1}e}"
    rounded = float(text)
    unit = 10.0 ** (int(text.partition("e")[2]) - digits + 1)
    return rounded if rounded <= value else float(f"{rounded - unit:.{digits - 1}e}")
