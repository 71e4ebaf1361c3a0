"""Exact gradients of the likelihood cost: by the traced equations of the filter over its inputs, where that is
possible; else the reason why differences take their place.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from cosim.studies.replay import Replay
from cosim.tuning.costs import Cost, LikelihoodCost
from cosim.tuning.parameters import Tunable
from cosim.tuning.replays import Replays
from fmu_observer.design.likelihood import LIKELIHOOD, AccumulatedOutput
from fmu_observer.design.optimisers.search_space import SearchSpace
from plant_models.hybrid import PeriodicEvent

Array = np.ndarray
EQUAL_WITHIN = 1e-9
"""Relative: how far the traced value may be from that of the run, the same operations in another order."""
INSTANT = 1e-9
"""Instants within this are one [s]."""


class NoSlopesError(ValueError):
    """There are no exact gradients; the message says why, to stand behind a colon."""


class LikelihoodSlopes:
    """Gradients of the mean negative log-likelihood over training seeds.

    Args:
        replays: the filter beside the recording of each training seed. asked: what is tuned. cost: that is minimised.

    Raises:
        NoSlopesError: the cost is no likelihood, the filter is not ours or cannot be traced, or its traced value is not
            that of the run.
    """

    def __init__(self, replays: Sequence[Replays], asked: Tunable, cost: Cost) -> None:
        if type(cost) is not LikelihoodCost:
            raise NoSlopesError("the cost is not the likelihood")
        if not replays:
            raise NoSlopesError("candidates are not run as members of a batch over the inputs of the observer")
        self._names = asked.space.names
        self._seeds = [_accumulated(found, asked) for found in replays]

    def of(self, space: SearchSpace, values: Mapping[str, float]) -> Array:
        """Gradient of the cost in search coordinates, shape (d,).

        Args:
            space: of the search, perhaps without some of the parameters. values: of all parameters, by name.
        """
        point = np.array([values[name] for name in self._names])
        found = -np.mean([seed(point)[1] for seed in self._seeds], axis=0)
        scale = np.array([values[p.name] if p.log else 1.0 for p in space.parameters])  # dq / d log q = q
        return np.asarray(found[[self._names.index(name) for name in space.names]] * scale)


def _accumulated(found: Replays, asked: Tunable) -> AccumulatedOutput:
    """The log-likelihood over one recording as a function of all parameters that are tuned."""
    replay, before = found.replay, f"{found.observer}."
    values = replay.parameters()
    for name, stated in asked.settings(asked.start).items():  # a matrix whose other entries are zero in all candidates
        bare = name.removeprefix(before)
        values |= {bare: stated} if bare in values else {f"{bare}[{i + 1}]": v for i, v in enumerate(stated)}
    names = []
    for name in asked.space.names:
        entry = asked.entries.get(name)
        names.append((f"{entry.whole}[{entry.place + 1}]" if entry else name).removeprefix(before))
    try:
        made = AccumulatedOutput(replay.system, _samples(replay, values), names, parameters=values)
        traced, slopes = made([values[name] for name in names])
    except (ValueError, KeyError) as error:  # of what cannot be traced, too
        raise NoSlopesError(f"{replay.system.name} cannot be differentiated ({error})") from error
    run = next(found.outcomes([asked.settings(asked.start)]))
    expected = float(run[f"{before}{LIKELIHOOD}"][-1]) if not isinstance(run, str) else np.nan
    if not (abs(traced - expected) <= EQUAL_WITHIN * max(abs(expected), 1.0) and np.isfinite(slopes).all()):
        raise NoSlopesError(f"the traced likelihood at the start is {traced:.9g}, that of the run {expected:.9g}")
    return made


def _samples(replay: Replay, values: Mapping[str, float]) -> Array:
    """Inputs at the samples of a filter, shape (k, inputs).

    Raises:
        NoSlopesError: it has no samples, draws noise, or is sampled between communication points.
    """
    periodic = [event for event in replay.system.events if isinstance(event, PeriodicEvent)]
    if len(periodic) != 1 or periodic[0].noises:
        raise NoSlopesError(f"{replay.system.name} is not sampled by one periodic event without random numbers")
    (event,) = periodic
    instants, inputs = replay.instants, replay.inputs()
    first = instants[0] + (values[event.offset] if event.offset else 0.0)
    count = int(np.floor((instants[-1] - first) / values[event.period] + INSTANT)) + 1
    wanted = first + values[event.period] * np.arange(count)
    places = np.clip(np.searchsorted(instants, wanted - INSTANT), 0, len(instants) - 1)
    if np.abs(instants[places] - wanted).max() > INSTANT:
        raise NoSlopesError(f"{replay.system.name} is sampled between communication points")
    return np.asarray(inputs[places])
