"""`tune`: parameters of an observer, an FMU or a scenario, searched over training seeds and validated with others."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from cosim.errors import ScenarioError
from cosim.results.results_folder import check_writable
from cosim.run.described_components import describe_component
from cosim.run.outcome import Outcome
from cosim.simulation.scenario import Scenario
from cosim.tuning.costs import Cost, make_cost
from cosim.tuning.evaluation import Evaluator
from cosim.tuning.parameters import Bounds, Tunable, tunable
from cosim.tuning.seeded_scenarios import Seeded, seeded, why_whole, with_observer
from cosim.tuning.shifted_seeds import drawn, with_seed
from cosim.tuning.study import Study
from cosim.tuning.tuning_files import write_tuning
from cosim.tuning.tuning_result import Tuning
from fmus.cli.progress import Progress, reported
from plant_models.left_behind import owned


def tune(
    scenario: Scenario,
    parameters: Mapping[str, Bounds],
    *,
    observer: str | None = None,
    method: str = "bbo",
    cost: str | Cost | Callable[[Outcome], float] = "state",
    seeds: Sequence[int] = (0,),
    validate: Sequence[int] = (),
    iterations: int = 20,
    searches: int = 1,
    options: Mapping[str, Any] | None = None,
    workers: int = 1,
    directory: str | Path | None = None,
    resume: bool = False,
    retry: bool = False,
    scheduler: str | None = None,
    whole_runs: bool = False,
    progress: Progress = None,
) -> Tuning:
    """Search a scenario's parameters for the smallest mean cost over training seeds, and validate the best with others.

    All candidates see the same seeds (common random numbers). An observer that only listens runs beside a recording of
    the plant side of each seed.

    Args:
        scenario: to be tuned. parameters: by name (low, high), or (low, high, True) for a search in the logarithm:
            ``component.parameter``, or one of `observer`; ``process_covariance[1,1]`` for an entry of a diagonal.
        observer: component that is tuned, or a shipped observer that joins the scenario for it. method: one of
            `OPTIMISERS`, such as ``bbo`` or ``cma``. cost: see `cosim.tuning.costs.make_cost`.
        seeds: for training; each moves the seed of the scenario by so much, 0 is the scenario as it is.
        validate: seeds that compare before and after at the end.
        iterations: populations after the first one. options: of the optimiser, such as ``{"population": 30}``.
        searches: how many times it is searched, with optimiser seeds 0, 1, ...; the best counts, all are reported.
        workers: processes at a time; a script whose own classes run in them needs ``if __name__ == "__main__":``.
        scheduler: address of a scheduler of `dask.distributed` whose workers do the runs: ``tcp://host:8786``.
        directory: where history and results are written as they come; None writes nothing.
        resume: take over the evaluations of an earlier search there, as far as they are of this one. retry: with
            `resume`, run all again that failed.
        whole_runs: run the whole scenario for each candidate, also where a recording would do.
        progress: called with runs done, runs in all as far as known, and what is done; by default a bar, where it lasts
            and somebody can see it; False for none.

    Returns:
        What was found; when interrupted, what was found until then.

    Raises:
        ScenarioError: something asked for cannot be. RunError: the plant side fails. KeyboardInterrupt: nothing found.
    """
    if observer is not None:
        scenario, observer = with_observer(scenario, observer)
    asked, (training, validation) = tunable(scenario, observer, parameters), _seeds(seeds, validate)
    weighed_by = make_cost(cost, observer, _outputs(scenario, observer))
    with _folder(directory, resume) as folder, reported(progress, "run") as report:
        by_seed, how = _by_seed(scenario, observer, asked, (*training, *validation), whole_runs)
        where: dict[str, Any] = {"workers": workers, "scheduler": scheduler, "resume": resume, "retry": retry}
        more: dict[str, Any] = {"options": options or {}, "iterations": iterations, "progress": report}
        with Evaluator(by_seed, asked, weighed_by, folder, observer=observer, **where) as evaluator:
            study = Study(scenario, asked, evaluator, training, validation, method=method, **more)
            found = study.run(searches, how)
        if directory is not None:
            write_tuning(found, asked.settings(found.best), folder)
        return found


def _by_seed(
    scenario: Scenario,
    observer: str | None,
    asked: Tunable,
    seeds: Sequence[int],
    whole_runs: bool,
) -> tuple[dict[int, Seeded], str]:
    """What candidates run with each seed, and in words how they do."""
    heads = sorted({name.partition(".")[0] for name in asked.space.names})
    if len(seeds) > 1 and not drawn(scenario):
        raise ScenarioError(
            f"{scenario.where}: nothing in this scenario draws from its seed; leave out the seeds of components, or "
            "give one training seed only."
        )
    found = {seed: seeded(with_seed(scenario, seed), seed, observer, heads, whole_runs) for seed in seeds}
    if found[seeds[0]].parts is not None:
        return found, "each beside the recorded plant side of its seed"
    return found, f"of the whole scenario: {'as asked for' if whole_runs else why_whole(scenario, observer, heads)}"


def _seeds(seeds: Sequence[int], validate: Sequence[int]) -> tuple[list[int], list[int]]:
    training, validation = list(dict.fromkeys(seeds)), list(dict.fromkeys(validate))
    if not training:
        raise ScenarioError("There are no training seeds; give at least one.")
    if both := sorted(set(training) & set(validation)):
        raise ScenarioError(
            f"Seeds {', '.join(map(str, both))} stand among training and validation seeds; what was learnt by heart "
            "cannot be validated by them. State others."
        )
    if min(training + validation) < 0:
        raise ScenarioError("Seeds are whole numbers from 0.")
    return training, validation


def _outputs(scenario: Scenario, observer: str | None) -> list[str]:
    """Names of the outputs of the observer that is tuned; none where none is named."""
    if observer is None:
        return []
    table = scenario.table().components[observer]
    described = describe_component(observer, table, scenario.folder, f"{scenario.where}: components.{observer}")
    return list(described.names("output"))


@contextmanager
def _folder(directory: str | Path | None, resume: bool) -> Iterator[Path]:
    """The folder of history and results; one that is thrown away where none is wanted."""
    if resume and directory is None:
        raise ScenarioError("A search is resumed from its folder: give directory=...")
    if directory is not None:
        yield check_writable(Path(directory)).absolute()
        return
    with TemporaryDirectory(prefix=owned("tuning-")) as folder:
        yield Path(folder)
