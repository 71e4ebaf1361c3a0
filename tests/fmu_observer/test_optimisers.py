"""Optimisers: their operators against the printed equations, states that go on bit by bit, what they refuse."""

from __future__ import annotations

import json
from collections.abc import Callable

import cma
import numpy as np
import pytest
import scipy

from fmu_observer.design.optimisers.known_optimisers import OPTIMISERS, SHORT_NAMES, find_optimiser
from fmu_observer.design.optimisers.methods.biogeography import Biogeography
from fmu_observer.design.optimisers.methods.biogeography_printed import BiogeographyPrinted
from fmu_observer.design.optimisers.methods.cma_es import CovarianceMatrixAdaptation
from fmu_observer.design.optimisers.methods.genetic import Genetic
from fmu_observer.design.optimisers.methods.likelihood_gradient import LikelihoodGradient
from fmu_observer.design.optimisers.methods.particle_swarm import ParticleSwarm
from fmu_observer.design.optimisers.optimiser import Optimiser
from fmu_observer.design.optimisers.optimiser_search import minimise
from fmu_observer.design.optimisers.search_space import Bounded, SearchSpace

LOW, HIGH = np.array([-1.0, -1.0, -1.0]), np.array([1.0, 2.0, 3.0])
CENTRE, WEIGHTS = np.array([0.3, -0.2, 0.7]), np.array([1.0, 10.0, 100.0])


def bowl(points: np.ndarray) -> np.ndarray:
    """A quadratic cost; its minimum is 0."""
    return np.asarray(((points - CENTRE) ** 2 * WEIGHTS).sum(axis=1))


def made(name: str, seed: int = 1) -> Optimiser:
    return OPTIMISERS[name](LOW, HIGH, seed=seed)


@pytest.mark.parametrize("name", list(OPTIMISERS))
def test_a_saved_state_goes_on_bit_by_bit(name: str) -> None:
    """Saved between asking and telling, through JSON; one cost is infinite."""
    going, new = made(name), made(name)
    for _ in range(4):
        candidates = going.ask()
        costs = bowl(candidates)
        costs[-1] = np.inf if len(costs) > 1 else costs[-1]
        going.tell(candidates, costs)
    going.ask()
    new.restore(json.loads(json.dumps(going.state())))
    for _ in range(3):
        np.testing.assert_array_equal(going.ask(), new.ask())
        assert (going.ask() >= LOW).all()
        assert (going.ask() <= HIGH).all()
        for optimiser in (going, new):
            optimiser.tell(optimiser.ask(), bowl(optimiser.ask()))
    assert (going.best_cost, going.evaluations, going.iteration) == (new.best_cost, new.evaluations, new.iteration)


@pytest.mark.parametrize("name", list(OPTIMISERS))
def test_each_finds_a_minimum_and_never_loses_its_best(name: str) -> None:
    """The best of the first population is at 5 in the median; 60 iterations bring each below a hundredth of that, but
    for the printed algorithms, which only draw new values.
    """
    found = minimise(made(name), bowl, 60)
    assert found.cost <= (1.0 if name == "biogeography_printed" else 0.05)
    assert (np.diff(found.costs) <= 0.0).all()
    assert found.cost == bowl(found.best[np.newaxis])[0]


def test_a_particle_moves_as_printed() -> None:
    """(3.4) and (3.5), with the same random numbers, on the first two moves."""
    swarm, random = ParticleSwarm(LOW, HIGH, seed=5, population=4), np.random.default_rng(5)
    X = random.uniform(LOW, HIGH, (4, 3))
    V = random.uniform(-0.2 * (HIGH - LOW), 0.2 * (HIGH - LOW), (4, 3))
    best = X
    for _ in range(2):
        np.testing.assert_array_equal(swarm.ask(), X)
        swarm.tell(X, bowl(X))
        best = np.where((bowl(X) < bowl(best))[:, np.newaxis], X, best)
        r1, r2 = random.random((2, 4, 3))
        V = 0.8 * V + 1.0 * r1 * (best - X) + 1.5 * r2 * (best[bowl(best).argmin()] - X)
        X = np.clip(X + V, LOW, HIGH)
    np.testing.assert_allclose(swarm.ask(), X, rtol=1e-15)


def population(kind: Callable[..., Optimiser], **options: float) -> tuple[np.ndarray, np.ndarray]:
    """First and second population of an optimiser, the first sorted by cost."""
    optimiser = kind(LOW, HIGH, seed=2, **options)
    first = optimiser.ask()
    optimiser.tell(first, bowl(first))
    return first[np.argsort(bowl(first))], optimiser.ask()


def test_habitats_move_nine_tenths_of_the_way_to_others() -> None:
    first, second = population(Biogeography, mutation=0.0)
    assert np.array_equal(second[0], first[0])  # the best takes from nobody
    moved = second != first
    assert moved[-1].all()  # the worst takes everything
    for i, k in zip(*np.nonzero(moved), strict=True):
        targets = first[i, k] + 0.9 * (first[:, k] - first[i, k])
        assert np.abs(np.delete(targets, i) - second[i, k]).min() < 1e-14  # rounding


def test_whole_values_migrate_as_printed_and_the_best_is_put_back() -> None:
    first, second = population(BiogeographyPrinted, mutation=0.0)
    assert all(second[i, k] in first[:, k] for i in range(20) for k in range(3))
    assert np.array_equal(second[0], first[0])
    optimiser = BiogeographyPrinted(LOW, HIGH, seed=2)
    optimiser.tell(optimiser.ask(), bowl(optimiser.ask()))
    best = optimiser.best
    optimiser.tell(optimiser.ask(), np.full(20, 1e9))
    assert best is not None
    assert (optimiser._habitats == best).all(axis=1).any()  # type: ignore[attr-defined]


def test_genes_come_from_two_parents_before_and_behind_a_point() -> None:
    first, second = population(Genetic, mutation=0.0)
    assert second.shape == (98, 3)  # the best two survive and are not evaluated again
    heirs = np.array([[np.flatnonzero(first[:, k] == child[k])[0] for k in range(3)] for child in second])
    changes = (np.diff(heirs, axis=1) != 0).sum(axis=1)
    assert changes.max() == 1
    assert 0.6 < (changes == 1).mean() <= 0.9  # crossover 0.8; a few have one parent twice
    assert heirs.mean() < 45.0  # fitter parents are taken more often: 50 without
    start = Genetic(LOW, HIGH, seed=2, start=(0.0, 0.1)).ask()
    assert start.min() >= 0.0
    assert start.max() <= 0.1


def test_cma_es_is_that_of_its_package() -> None:
    """Driven by hand with the same normal numbers."""
    ours, random = CovarianceMatrixAdaptation(LOW, HIGH, seed=3), np.random.default_rng(3)
    settings = {"bounds": [0, 1], "randn": lambda *n: random.standard_normal(n), "seed": np.nan, "verbose": -9}
    theirs = cma.CMAEvolutionStrategy([0.5] * 3, 0.3, settings | {"verb_log": 0})
    for _ in range(3):
        units = theirs.ask()
        points = LOW + np.array(units) * (HIGH - LOW)
        np.testing.assert_array_equal(ours.ask(), points)
        theirs.tell(units, bowl(points).tolist())
        ours.tell(ours.ask(), bowl(points))


def test_cma_es_takes_a_single_coordinate() -> None:
    """Its package fails where the only deviation grows beyond a third of the bounds."""
    search = CovarianceMatrixAdaptation([-3.0], [0.0])
    for _ in range(30):
        points = search.ask()
        search.tell(points, (points[:, 0] + 0.01) ** 2)
    assert search.best == pytest.approx([-0.01], abs=1e-3)


def test_the_descent_is_that_of_scipy() -> None:
    start, width = np.array([-0.5, 1.0, 2.0]), HIGH - LOW
    optimiser = LikelihoodGradient(LOW, HIGH, start=start, gradients=True)
    while len(candidates := optimiser.ask()):
        optimiser.tell(candidates, bowl(candidates), 2.0 * WEIGHTS * (candidates - CENTRE))

    def cost(unit: np.ndarray) -> tuple[float, np.ndarray]:
        point = LOW + unit * width
        return float(bowl(point[np.newaxis])[0]), 2.0 * WEIGHTS * (point - CENTRE) * width

    theirs = scipy.optimize.minimize(cost, (start - LOW) / width, jac=True, method="L-BFGS-B", bounds=[(0, 1)] * 3)
    assert optimiser.evaluations == theirs.nfev
    assert optimiser.best_cost == pytest.approx(theirs.fun, abs=1e-20)


def test_what_they_refuse() -> None:
    for low, high in (([0.0], [np.inf]), ([1.0], [1.0]), ([0.0, 0.0], [1.0]), ([], []), ([np.nan], [1.0])):
        with pytest.raises(ValueError, match="bound"):
            ParticleSwarm(low, high)
    swarm = made("particle_swarm")
    with pytest.raises(ValueError, match="did not ask for"):
        swarm.tell(np.zeros((20, 3)), np.zeros(20))
    with pytest.raises(ValueError, match="expected 20 costs"):
        swarm.tell(swarm.ask(), [1.0])
    with pytest.raises(ValueError, match="none of 20"):
        minimise(swarm, lambda points: np.full(len(points), np.nan), 0)
    with pytest.raises(ValueError, match="the state is of"):
        made("genetic").restore(swarm.state())
    with pytest.raises(ValueError, match="did you mean particle_swarm"):
        find_optimiser("particle_swam")
    assert {find_optimiser(short).name for short in SHORT_NAMES} < set(OPTIMISERS)


def test_logarithmic_coordinates_go_forth_and_back() -> None:
    space = SearchSpace([Bounded("q", 1e-6, 20.0, True), Bounded("k", -1.0, 3.0)])
    values = np.array([[1e-6, -1.0], [0.3, 0.0], [20.0, 3.0]])
    np.testing.assert_allclose(space.values(space.coordinates(values)), values, rtol=1e-14)
    assert space.named(space.upper) == pytest.approx({"q": 20.0, "k": 3.0}, rel=1e-14)
    assert (space.values(space.coordinates([30.0, 4.0])) == [20.0, 3.0]).all()  # rounding never leaves the bounds
    assert space.without({"q": 1.0}).names == ["k"]
    with pytest.raises(ValueError, match="above zero"):
        Bounded("q", 0.0, 1.0, True)
    with pytest.raises(ValueError, match="different names"):
        SearchSpace([Bounded("q", 0.0, 1.0)] * 2)


def test_a_fifth_of_the_habitats_stays_where_all_new_ones_are_worse() -> None:
    searching = Biogeography(LOW, HIGH, seed=3, absorption=0.0, mutation=1.0)
    first = searching.ask()
    searching.tell(first, bowl(first))
    second = searching.ask()
    assert not np.isin(second, first).any()
    searching.tell(second, 1e6 + bowl(second))
    searching.mutation = 0.0  # what is proposed now are the habitats themselves
    best = first[np.argsort(bowl(first))[:4]]
    np.testing.assert_array_equal(searching.ask()[:4], best)


def test_parents_are_drawn_by_the_root_of_their_rank() -> None:
    """Without crossover and mutation children are copies: 400 draws against the sum of the chances."""
    searching = Genetic(LOW[:1], HIGH[:1], seed=3, population=400, crossover=0.0, mutation=0.0, elite=0)
    first = searching.ask()
    searching.tell(first, first[:, 0])
    chances = 1.0 / np.sqrt(np.arange(1, 401))
    expected = chances[:100].sum() / chances.sum()
    share = np.mean(searching.ask()[:, 0] <= np.sort(first[:, 0])[99])
    assert share == pytest.approx(expected, abs=4.0 * np.sqrt(expected * (1.0 - expected) / 400))
