"""Digests of the equations and FMI names of all systems that ship, to show that a change of form changes no number.

``python docs/studies/system_digests.py > before.txt`` in one checkout, ``> after.txt`` in another one, then ``diff``. A
line is a system with one of its options, and the digests of its names and of what its functions give at 20 random
points. With ``--runs`` a line is a shipped scenario, and the digest of its table and events. Digests of two processors
or versions of NumPy are not comparable.
"""

from __future__ import annotations

import hashlib
import sys
import warnings
from collections.abc import Iterator
from typing import Any

import numpy as np

from cosim import Scenario
from cosim.errors import CosimError
from cosim.scenario.shipped import shipped_scenarios
from fmu_observer import OBSERVERS
from plant_models import PLANTS
from plant_models.hybrid import HybridSystem, scalar_names

POINTS = 20
MOST = 6  # values of an option: some are counts up to hundreds


def systems() -> Iterator[tuple[str, HybridSystem]]:
    """Every system as it ships, then with the first legal values of each listed option in turn."""
    for registry in (PLANTS, OBSERVERS):
        for name in registry:
            kind: Any = registry[name]
            yield name, kind()
            for option, choices in kind.option_choices.items():
                for value in list(choices)[:MOST]:
                    try:
                        yield f"{name} {option}={value}", kind(**{option: value})
                    except (ValueError, TypeError):  # legal only together with another option
                        continue


def digest_of(system: HybridSystem) -> str:
    """Digest of all that the functions of a system give at random points around the start.

    Args:
        system: any.
    """
    draw = np.random.default_rng(1)
    x0, u0, p0 = system.start_state(), system.start_inputs(), system.start_parameters()
    found = hashlib.sha256()
    for point in range(POINTS):
        spread = (0.0, 1e-3, 0.1, 1.0)[point % 4]
        x = x0 + spread * (1.0 + np.abs(x0)) * draw.standard_normal(len(x0))
        u = u0 + spread * (1.0 + np.abs(u0)) * draw.standard_normal(len(u0))
        t = spread * draw.uniform(0.0, 10.0)
        held = system.held_vector(t, x, u, p0)
        switches = held[len(system.frictions) :] if system.switchings else None
        results = [system.output_vector(t, x, u, p0), system.requirement_vector(x, p0), held]
        results += [system.state_derivative(t, x, u, p0, switches)] if system.continuous_count else []
        results += [system.friction_vector(t, x, u, p0, switches)] if system.frictions else []
        results += [system.jump_vector(event.name, t, x, u, p0) for event in system.events]
        for result in results:
            # -0.0 and 0.0 are one number, and so are all NaN
            values = np.asarray(result, dtype=float) + 0.0
            found.update(np.where(np.isnan(values), np.nan, values).tobytes())
    return found.hexdigest()[:16]


def names_of(system: HybridSystem) -> str:
    """Digest of the FMI names, units and starts.

    Args:
        system: any.
    """
    signals = (*system.states, *system.input_signals, *system.outputs, *system.parameter_signals)
    reported = [(s.scalar_names, s.unit, s.causality, s.variability, s.start_values, s.description) for s in signals]
    return hashlib.sha256(repr((scalar_names(signals), reported)).encode()).hexdigest()[:16]


def runs() -> Iterator[tuple[str, str]]:
    """Every shipped scenario, and the digest of what a run of it gives."""
    for name in shipped_scenarios():
        try:
            outcome = Scenario.load(name).run(warn=lambda _text: None)
        except CosimError as error:  # one needs a file of the user's
            yield name, type(error).__name__
            continue
        found = hashlib.sha256(repr(outcome.result.table.dtype.names).encode())
        found.update(np.ascontiguousarray(outcome.result.table).tobytes())
        found.update(repr(outcome.result.events).encode())
        yield name, found.hexdigest()[:16]


def main() -> None:
    """Print a line a system, or a scenario."""
    warnings.simplefilter("ignore")
    np.seterr(all="ignore")
    if sys.argv[1:] == ["--runs"]:
        for name, digest in runs():
            print(digest, name, flush=True)
        return
    for name, system in systems():
        try:
            print(names_of(system), digest_of(system), name)
        except Exception as error:
            print(names_of(system), type(error).__name__, name)


if __name__ == "__main__":
    main()
