"""The locomotive's internal step against SciPy's Radau at 1e-10 on the same equations.

The bounds are two to four times what was measured at a step of 1 ms, twice the default, on the worse of the two curves;
they fail when the integrator loses its order.
"""

from __future__ import annotations

import numpy as np
import pytest
from railway_reference import solve
from railway_runs import NO_ZONES, parameters, rolling, started

from plant_models import Locomotive
from plant_models.hybrid import Runtime

RADIUS = 0.575
ZONE = {**NO_ZONES, "zone_from[1]": 2.0, "zone_to[1]": 4.0}
WET = {**NO_ZONES, "zone_from[1]": -1.0, "zone_to[1]": 99.0}
# name: (phases [(end s, effort N)], start speed m/s, parameters, bounds on position m, speed m/s, wheel speed m/s)
RUNS = {
    "traction": ([(8.0, 60e3)], 1.0, NO_ZONES, (1e-7, 1e-9, 1e-8)),
    "from rest": ([(8.0, 60e3)], 0.0, NO_ZONES, (4e-3, 5e-4, 6e-4)),  # the step that lets go is of first order
    "zone": ([(8.0, 60e3)], 5.0, ZONE, (1e-6, 1.5e-6, 2e-4)),  # its edges are exact events
    "braking to a stop": ([(16.0, -60e3)], 10.0, NO_ZONES, (2e-7, 1e-8, 1e-6)),
    "lock": ([(12.0, -250e3)], 10.0, WET, (4e-3, 1e-3, 8e-2)),
    "lock to a stop": ([(9.0, -250e3)], 4.0, WET, (4e-3, 1.5e-3, 8e-2)),
    "lock and release": ([(2.0, -250e3), (4.0, 0.0)], 10.0, WET, (2e-3, 4e-4, 4e-2)),
    "spin and release": ([(4.0, 300e3), (6.0, 0.0)], 0.0, WET, (5e-3, 1e-3, 0.4)),  # of a wheel at 400 m/s
    "roll away": ([(6.0, 0.0)], 0.0, {**NO_ZONES, "gradient[1]": 0.008}, (4e-6, 6e-7, 6e-7)),
    "brake on a hill": ([(12.0, -20e3), (15.0, -3e3)], 2.0, {**NO_ZONES, "gradient[1]": 0.008}, (3e-4, 1e-4, 1e-4)),
}


def _run(runtime: Runtime, phases: list[tuple[float, float]], times: np.ndarray) -> np.ndarray:
    rows = [runtime.x.copy()]
    remaining = list(phases)
    for t in times[1:]:
        if t > remaining[0][0] + 1e-9:
            remaining.pop(0)
        runtime.u[0] = remaining[0][1]
        runtime.advance(float(t))
        rows.append(runtime.x.copy())
    return np.array(rows)


def _errors(train: Locomotive, run: str, internal_step: float) -> np.ndarray:
    phases, speed, changes, _ = RUNS[run]
    times = np.round(np.arange(0.0, phases[-1][0] + 1e-9, 0.01), 10)
    truth = solve(train, np.array(rolling(speed)), parameters(train, **changes), _cut(phases, changes), times)
    found = _run(started(train, x0=rolling(speed), internal_step=internal_step, **changes), phases, times)
    return np.abs(found - truth).max(axis=0) * [1.0, 1.0, RADIUS]


def _cut(phases: list[tuple[float, float]], changes: dict[str, float]) -> list[tuple[float, float]]:
    """The phases, cut at the edges of the zones too, so that the reference never steps over one."""
    edges = {t for name, t in changes.items() if name.startswith("zone") and 0.0 < t < phases[-1][0]} | {
        end for end, _ in phases
    }
    return [(edge, next(effort for end, effort in phases if edge <= end)) for edge in sorted(edges)]


@pytest.mark.parametrize("adhesion", ["burckhardt", "polach"])
@pytest.mark.parametrize("run", RUNS)
def test_the_default_step_is_accurate(run: str, adhesion: str) -> None:
    errors = _errors(Locomotive(adhesion=adhesion), run, 1e-3)  # type: ignore[arg-type]
    print(run, adhesion, errors)
    assert (errors < RUNS[run][3]).all(), errors


@pytest.mark.parametrize("run", ["lock", "lock and release"])
def test_halving_the_step_quarters_the_error_through_a_lock(run: str) -> None:
    coarse, fine = (_errors(Locomotive(), run, h) for h in (1e-3, 5e-4))
    assert np.log2(coarse / fine) == pytest.approx([2.0] * 3, abs=0.3)
