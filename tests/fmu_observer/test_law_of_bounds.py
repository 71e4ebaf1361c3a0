"""Law: a number that is called a bound is never exceeded, neither in a run nor by what is known exactly."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from functools import cache
from typing import Any

import numpy as np
import pytest
from observer_runner import SystemRunner
from shipped import shipped

from fmu_observer import OBSERVERS
from fmu_observer.certificates.bounds.worst_case import worst_case
from fmu_observer.observers.evaluated_observer import GapCertified

STEP = 0.01  # [s] for which the effort is held
ROUGH = 2e-3  # [m/s2]: what a held effort leaves, the drag's slope 0.05 1/s times 1.7 m/s2 times the step
SECONDS = 6.0
PREFIX = "Bound of the "


def batched(found: Iterable[Any]) -> Iterator[tuple[Any, ...]]:
    """Findings in threes: as printed, sufficient, exact."""
    one = iter(found)
    return zip(one, one, one, strict=True)


def bounds_of(name: str) -> dict[str, str]:
    """Outputs that are called bounds of an error, and the output that is in error."""
    reported = {s.name: s.description for s in shipped(name).outputs if "bound" in s.name and s.unit in ("m", "m/s")}
    assert all(text.startswith(PREFIX) for text in reported.values()), f"{name}: of what are these bounds? {reported}"
    return {bound: text.removeprefix(PREFIX).split()[0] for bound, text in reported.items()}


CASES = [(name, preset) for name in OBSERVERS if bounds_of(name) for preset in shipped(name).presets]


def random_motion(seed: int, rate: float) -> Callable[[float], float]:
    """An acceleration that jumps between its limits after random times [m/s2]."""
    generator = np.random.default_rng(seed)
    ends = np.cumsum(generator.uniform(0.05, 2.0, 200))
    signs = generator.choice([-1.0, 1.0], 201)
    return lambda t: float(rate * signs[np.searchsorted(ends, t)])


@cache
def worst_motion(name: str, preset: str) -> Callable[[float], float]:
    """The acceleration that hurts most just before the last sample of a run [m/s2]."""
    bounds = OBSERVERS[name]().error_bounds(None, preset)
    worst = worst_case(bounds.drifts[0], bounds.gains[0], bounds.rate, bounds.period)
    return lambda t: float(worst.acceleration(SECONDS - t))


def run(name: str, preset: str, acceleration: Callable[[float], float]) -> dict[str, float]:
    """The largest share that an error takes of each bound, in a run from true estimates of the start."""
    observer: Any = OBSERVERS[name]()
    reported = {"unknown_acceleration": ROUGH, "start_position_error": 0.0}
    runner = SystemRunner(observer, preset=preset, **reported)
    p = observer.unpack_parameters(runner.runtime.p)
    speed, position = 24.0, 0.0
    runner.runtime.x[1] = speed
    shares = dict.fromkeys(bounds_of(name), 0.0)
    period = round(float(p.odometer_period) / STEP)
    for k in range(round(SECONDS / STEP)):
        rate = acceleration((k + 0.5) * STEP)
        if not 6.0 < speed < 40.0:  # turns round, within what the observers know of
            rate = abs(rate) if speed < 20.0 else -abs(rate)
        middle = speed + 0.5 * rate * STEP
        effort = float(p.mass) * (rate + (p.davis_a + p.davis_b * middle + p.davis_c * middle**2) / float(p.mass))
        runner.set("u", {"effort": effort, "odometer": speed})
        if k == 0:
            runner.runtime.start(0.0)
        position += speed * STEP + 0.5 * rate * STEP**2
        speed += rate * STEP
        if (k + 1) % period == 0:
            runner.set("u", {"odometer": speed})  # what is sampled at the end of the step
        runner.runtime.advance((k + 1) * STEP)
        found = runner.outputs()
        for bound, of in bounds_of(name).items():
            error = abs(found[of] - {"speed": speed, "position": position}[of])
            # the observer's own integration: fourth order at 5 ms
            shares[bound] = max(shares[bound], (error - 1e-6) / found[bound])
    return shares


@pytest.mark.parametrize(("name", "preset"), CASES)
def test_no_run_exceeds_what_is_called_a_bound(name: str, preset: str) -> None:
    for acceleration in (worst_motion(name, preset), random_motion(7, 1.7)):
        shares = run(name, preset, acceleration)
        assert max(shares.values()) <= 1.0, shares
        assert max(shares.values()) > 0.3  # no tame run


@pytest.mark.parametrize(("name", "preset"), CASES)
def test_no_table_of_bounds_is_below_what_can_happen(name: str, preset: str) -> None:
    bounds: Any = OBSERVERS[name]().error_bounds(None, preset)
    rows = list(batched(bounds.findings(missing=6)))
    assert len(rows) == 7
    for printed, carried, exact in rows:
        assert (printed.kind, carried.kind, exact.kind) == ("as printed", "sufficient", "exact")
        assert carried.value >= exact.value


# those whose limits are their certificate's alone have nothing printed
CERTIFIED = GapCertified.limit_findings
PRINTED = [name for name, made in OBSERVERS.items() if getattr(made, "limit_findings", CERTIFIED) is not CERTIFIED]


@pytest.mark.parametrize("name", PRINTED)
def test_no_printed_limit_is_beyond_the_exact_one(name: str) -> None:
    observer: Any = OBSERVERS[name]()
    for preset in observer.presets or (None,):
        found = [limit for limit in observer.findings(preset=preset) if limit.unit == "s"]
        exact = {limit.what: limit.limit for limit in found if limit.kind in ("exact", "not found up to")}
        for printed in found:
            if printed.kind == "as printed":
                assert printed.value <= exact[printed.what], (preset, printed)
