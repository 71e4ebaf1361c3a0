"""A study: searches over training seeds, what they cannot see, and the validation of the best with other seeds."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from inspect import signature
from typing import Any

from cosim.errors import ScenarioError, nearest
from cosim.runs.journal import write_line
from cosim.simulation.scenario import Scenario
from cosim.tuning.evaluation import Evaluator
from cosim.tuning.identifiability import Directions, covariances, directions, neighbours
from cosim.tuning.parameters import Tunable
from cosim.tuning.slopes import LikelihoodSlopes, NoSlopesError
from cosim.tuning.tuning_result import Searched, Tuning
from fmu_observer.design.optimisers.known_optimisers import find_optimiser
from fmu_observer.design.optimisers.methods.likelihood_gradient import LikelihoodGradient
from fmu_observer.design.optimisers.optimiser import Optimiser
from fmu_observer.design.optimisers.search_space import SearchSpace

Progress = Callable[[int, int, str], None]
_ITERATIONS = "iterations.jsonl"
_REPLAYED = "as members of a batch over the inputs of the observer"
_NEAR_BOUND = 1e-3
"""Share of the range of a parameter within which a value counts as standing at its end."""
_NOTHING_BETTER = "No candidate is better with the training seeds than the scenario as it is; its values are kept."


class Study:
    """Searches of one scenario.

    Args:
        scenario: that is tuned. asked: what is tuned. evaluator: gives costs. training, validation: seeds.
        method: of the search. options: of the method.
        iterations: populations after the first one. progress: see `tune`.

    Raises:
        ScenarioError: the method or an option of it is unknown.
    """

    def __init__(
        self,
        scenario: Scenario,
        asked: Tunable,
        evaluator: Evaluator,
        training: Sequence[int],
        validation: Sequence[int],
        *,
        method: str,
        options: Mapping[str, Any],
        iterations: int,
        progress: Progress | None,
    ) -> None:
        self.scenario, self.asked, self.evaluator = scenario, asked, evaluator
        self.training, self.validation = training, validation
        self.method, self.iterations = method, iterations
        self.options = {name: value for name, value in options.items() if name != "gradients"}  # found out here
        self.done: list[Searched] = []
        self._bar = _Bar(progress)
        self._slopes: LikelihoodSlopes | None = None
        _make_optimiser(method, asked.space, 0, options)  # refused before anything is run

    def run(self, searches: int, how: str) -> Tuning:
        """Search, and validate the best of all searches.

        Args:
            searches: how many, with optimiser seeds 0, 1, ... how: in what candidates are run, in words.

        Raises:
            ScenarioError: nothing can be tuned, or no cost is finite. KeyboardInterrupt: interrupted before the first
                population was done; later, what was found until then is returned.
        """
        self._bar.text = "before"
        before = self.evaluator.costs([None], self.training, {"search": "before"}, self._bar.step)[0]
        shown = self._directions(self._inside())
        fixed, why = self._held(shown)
        gradients = self._differentiated()
        interrupted = self._search_all(searches, fixed)
        winner = min(self.done, key=lambda search: search.costs[-1])
        better = dict(winner.best) if winner.costs[-1] < before.mean() else None
        validated = self._validated(better, before.tolist(), () if interrupted else self.validation)
        at_best = None if interrupted or better is None else self._directions(better)
        remarks = [_NOTHING_BETTER] if better is None else _at_bounds(self.asked.space, better, why)
        return Tuning(
            scenario=self._tuned(better),
            method=self.method,
            cost=self.evaluator.cost.text,
            searches=self.done,
            start=self.asked.start,
            best=self.asked.start if better is None else better,
            runs=self.evaluator.runs,
            how=(_REPLAYED if self.evaluator.replayed else how) + gradients,
            warnings=[*remarks, *self._warnings(shown, at_best)],
            fixed=why,
            interrupted=interrupted,
            **validated,
        )

    def _search_all(self, searches: int, fixed: Mapping[str, float]) -> bool:
        """Search as often as asked for, or until somebody interrupts; whether somebody did."""
        (self.evaluator.directory / _ITERATIONS).unlink(missing_ok=True)
        try:
            for seed in range(searches):
                self._search(seed, self.asked.space.without(fixed), fixed)
        except KeyboardInterrupt:
            if not self.done:
                raise
            return True
        return False

    def _validated(
        self, better: dict[str, float] | None, before: list[float], validation: Sequence[int]
    ) -> dict[str, Any]:
        """Costs before and after, with training seeds and with those of validation; None where nothing is better."""
        self._bar.text = "validate"
        after = self.evaluator.costs([better], self.training, {"search": "after"}, self._bar.step)[0]
        validated = self.evaluator.costs([None, better], validation, {"search": "validate"}, self._bar.step)
        return {
            "seeds": self.training,
            "validated": validation,
            "before": before,
            "after": after.tolist(),
            "validated_before": validated[0].tolist(),
            "validated_after": validated[1].tolist(),
        }

    def _tuned(self, better: dict[str, float] | None) -> Scenario:
        """The scenario with what was found."""
        tuned = self.scenario.copy()
        for name, value in () if better is None else self.asked.settings(better).items():
            tuned.set(name, value)
        return tuned

    def _search(self, seed: int, space: SearchSpace, fixed: Mapping[str, float]) -> None:
        """One search, from this seed of the optimiser; what is found is kept iteration by iteration."""
        exact = {} if self._slopes is None else {"gradients": True}
        optimiser = _make_optimiser(self.method, space, seed, self.options | exact)
        costs: list[float] = []
        counts: list[int] = []
        self._bar.text = f"search {seed}"
        for iteration in range(self.iterations + 1):
            candidates = optimiser.ask()
            if not len(candidates):
                break
            named = [self._whole(fixed, space.named(candidate)) for candidate in candidates]
            self._bar.expect(len(named) * len(self.training), self.iterations - iteration)
            label = {"search": seed, "iteration": iteration}
            found = self.evaluator.costs(named, self.training, label, self._bar.step)
            slopes = None if self._slopes is None else [self._slopes.of(space, values) for values in named]
            optimiser.tell(candidates, found.mean(axis=1), slopes)
            if optimiser.best is None:
                raise ScenarioError(_never_finite(len(candidates), self.evaluator.failures))
            costs.append(optimiser.best_cost)
            counts.append(optimiser.evaluations)
            best = self._whole(fixed, space.named(optimiser.best))
            entry = label | {"evaluations": optimiser.evaluations, "cost": optimiser.best_cost, "best": best}
            write_line(self.evaluator.directory / _ITERATIONS, entry)
            self.done = [*(s for s in self.done if s.seed != seed), Searched(seed, best, costs, counts)]

    def _differentiated(self) -> str:
        """Exact gradients for a descent where they are possible, and where its gradients come from in words."""
        if find_optimiser(self.method).name != LikelihoodGradient.name:
            return ""
        try:
            self._slopes = LikelihoodSlopes(self.evaluator.replays(self.training), self.asked, self.evaluator.cost)
        except NoSlopesError as error:
            return f"; gradients by central differences: {error}"
        return "; exact gradients of the likelihood, by the equations of the filter"

    def _whole(self, fixed: Mapping[str, float], found: Mapping[str, float]) -> dict[str, float]:
        """All parameters in the order asked for."""
        return {name: fixed[name] if name in fixed else found[name] for name in self.asked.space.names}

    def _inside(self) -> dict[str, float]:
        """The present values as far as they lie within the bounds, else the middle of them."""
        space, start = self.asked.space, self.asked.start
        middle = space.named(0.5 * (space.lower + space.upper))
        return {p.name: start[p.name] if p.low <= start[p.name] <= p.high else middle[p.name] for p in space.parameters}

    def _directions(self, values: Mapping[str, float]) -> Directions | None:
        """What moves what the cost depends on, at a candidate; None where a run fails."""
        effects = self.evaluator.effects(neighbours(self.asked.space, values), self.training[0])
        return directions(self.asked.space, effects)

    def _held(self, shown: Directions | None) -> tuple[dict[str, float], dict[str, str]]:
        """Parameters that are not searched, with the reasons: those that change nothing, and one covariance where only
        ratios matter.

        Raises:
            ScenarioError: none of the parameters changes anything.
        """
        if shown is None:
            return {}, {}
        values = self._inside()
        if set(shown.idle) == set(self.asked.space.names):
            raise ScenarioError(
                f"None of {', '.join(self.asked.space.names)} changes anything that the cost of this run depends on; "
                "there is nothing to tune."
            )
        fixed = {name: values[name] for name in shown.idle}
        why = {name: f"at {value:g}: it changes nothing" for name, value in fixed.items()}
        if shown.scale_invariant:
            last = [name for name in covariances(self.asked.space) if name not in fixed][-1]
            fixed[last] = values[last]
            why[last] = f"at {values[last]:g}: only ratios of the covariances matter"
        return fixed, why

    def _warnings(self, shown: Directions | None, at_best: Directions | None) -> list[str]:
        texts = [*self.asked.notes, *([] if shown is None else shown.warnings())]
        later = [] if at_best is None else at_best.warnings()
        texts += [f"At the best candidate: {text}" for text in later if text not in texts]
        return texts + [f"{len(runs)} runs failed: {why}; {runs[0]}" for why, runs in self.evaluator.failures.items()]


class _Bar:
    """What is to come is known as far as populations have one size.

    Args:
        progress: called with runs done, runs in all as far as known, and what is done; None for nobody.
    """

    def __init__(self, progress: Progress | None) -> None:
        self.text = ""
        self._progress, self._done, self._total = progress, 0, 0

    def expect(self, now: int, later: int) -> None:
        """Before a population.

        Args:
            now: runs of it. later: populations of this search after it.
        """
        self._total = self._done + now * (1 + later)

    def step(self) -> None:
        """A run is done."""
        self._done += 1
        if self._progress is not None:
            self._progress(self._done, max(self._total, self._done), self.text)


def _at_bounds(space: SearchSpace, best: Mapping[str, float], held: Mapping[str, str]) -> list[str]:
    """What is said of values that a search left at the end of their range.

    Args:
        space: names and bounds. best: values found, by name. held: parameters that were not searched.
    """
    texts = []
    point = space.coordinates([best[name] for name in space.names])
    for p, value, low, high in zip(space.parameters, point, space.lower, space.upper, strict=True):
        near = _NEAR_BOUND * (high - low)
        if p.name not in held and (value - low <= near or high - value <= near):
            end = "lower" if value - low <= near else "upper"
            texts.append(
                f"{p.name} ends at its {end} bound, {p.low if end == 'lower' else p.high:g}: the best value may lie "
                "beyond. Widen the bounds, where that makes sense."
            )
    return texts


def _make_optimiser(method: str, space: SearchSpace, seed: int, options: Mapping[str, Any]) -> Optimiser:
    """An optimiser of a search space.

    Raises:
        ScenarioError: there is none of this name, an option is unknown, or its package is not installed.
    """
    _demand_options(method, options)
    try:
        made: Optimiser = find_optimiser(method)(space.lower, space.upper, seed=seed, **options)
    except (ValueError, TypeError, ImportError) as error:
        raise ScenarioError(f"method {method}: {error}") from error
    return made


def _demand_options(method: str, options: Mapping[str, Any]) -> None:
    """Every option is a keyword of the method.

    Raises:
        ScenarioError: one is not; the nearest are named.
    """
    try:
        known = [n for n in signature(find_optimiser(method)).parameters if n not in {"lower", "upper", "seed"}]
    except ValueError as error:
        raise ScenarioError(f"method {method}: {error}") from error
    for name in options:
        if name not in known:
            raise ScenarioError(f"method {method}: no option {name!r}; {nearest(name, known)}")


def _never_finite(count: int, failures: Mapping[str, Sequence[str]]) -> str:
    reasons = "; ".join(f"{why} ({len(runs)} times, first with {runs[0]})" for why, runs in list(failures.items())[:3])
    return (
        f"None of the {count} candidates of the first population has a finite cost: {reasons}. Change the bounds, or "
        "run the scenario with one of these values."
    )
