"""What a user wants a baseline of: an FMU, a scenario, an outcome or a result; run here where it is not one already."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from cosim.baselines.baseline import Baseline
from cosim.baselines.baseline_files import read_baseline
from cosim.baselines.delivery import DeliveredFmu
from cosim.baselines.recipe import Recipe
from cosim.components.description import read_description
from cosim.errors import BaselineError, CosimError, ScenarioError
from cosim.results.result import Result
from cosim.run.outcome import Outcome
from cosim.scenario.fmu_alone import FmuAlone
from cosim.simulation.scenario import Scenario
from plant_models.left_behind import owned

LOG = logging.getLogger("cosim")
Progress = Callable[[float, float], None]


@dataclass(frozen=True)
class Subject:
    """Something with a result.

    Args:
        recipe: how to run it again. outcome: of the run; None where only a result was given. result: of the run.
    """

    recipe: Recipe
    result: Result
    outcome: Outcome | None = None


def _run_recipe(recipe: Recipe, progress: Progress | None = None) -> Subject:
    """Run what a recipe says.

    Args:
        recipe: of an FMU alone or of a scenario. progress: as for `Scenario.run`.

    Raises:
        BaselineError: it cannot be run again.
        CosimError: it cannot be set up.
    """
    if recipe.kind == "result":
        raise BaselineError(
            "This baseline was made from a result, not from an FMU or a scenario file, so it cannot be run again from "
            "here; give the result to be checked: --against DIR."
        )
    if recipe.kind == "fmu":
        scenario = Scenario.fmu(recipe.source, **{f.name: getattr(recipe, f.name) for f in fields(FmuAlone)})
        outcome = scenario.run(progress=progress, warn=_about_inputs(recipe))
    else:
        outcome = Scenario.load(recipe.source).run(progress=progress, overrides=recipe.overrides)
    return Subject(recipe, outcome.result, outcome)


def run_again(
    baseline: Baseline,
    fmu: str | Path | None = None,
    progress: Progress | None = None,
) -> Subject:
    """Run what a baseline was made of.

    Args:
        baseline: the baseline; inputs that came with it out of an FMU are played back.
        fmu: another FMU in place of its own, a new delivery, say. progress: as for `Scenario.run`.

    Raises:
        BaselineError: it cannot be run again.
        CosimError: it cannot be set up.
    """
    recipe = baseline.header.recipe if fmu is None else baseline.header.recipe.of(fmu)
    stimuli = baseline.more.get("stimuli")
    if stimuli is None or recipe.inputs:
        with after_its_delivery(baseline.path, recipe.source):
            return _run_recipe(recipe, progress)
    with TemporaryDirectory(prefix=owned("fmu-reference-")) as folder:
        table = Path(folder) / "inputs.csv"
        table.write_bytes(stimuli)
        return _run_recipe(replace(recipe, inputs=str(table)), progress)


@contextmanager
def after_its_delivery(path: Path, what: Any, folder: Path = Path()) -> Iterator[None]:
    """What cannot be run is explained by what its delivery changed, if anything.

    Args:
        path: of the baseline; there may be none yet. what: the FMU that is run. folder: where its relative path starts.

    Raises:
        BaselineError: something cannot be run, and the description of the FMU is not that of the baseline.
        CosimError: something cannot be run.
    """
    try:
        yield
    except CosimError as error:
        if changes := _delivered_changes(path, what, folder):
            raise BaselineError(f"{', '.join(changes)}\n{error}") from error
        raise


def _delivered_changes(path: Path, what: Any, folder: Path) -> list[str]:
    """What the description of an FMU alone states otherwise than that of its baseline; nothing where either is not
    known.
    """
    if not isinstance(what, str | Path) or Path(what).suffix.lower() != ".fmu" or not path.is_file():
        return []
    try:
        former = next((c.delivery for c in read_baseline(path).header.components if c.delivery), None)
        return former.changes_to(DeliveredFmu.of(read_description(folder / what))) if former else []
    except CosimError:
        return []


def make_subject(
    what: Any,
    folder: Path,
    *,
    overrides: Mapping[str, Any] | None = None,
    progress: Progress | None = None,
    **run: Any,
) -> Subject:
    """Run what a user named.

    Args:
        what: path of an FMU; name or path of a scenario; a `Scenario`; an `Outcome` or `Result` of a run made already.
        folder: where relative paths start.
        overrides: of a scenario, as for `Scenario.set`.
        progress: as for `Scenario.run`.
        run: start, stop and step of the run [s]; of an FMU alone all that `FmuAlone` holds.

    Raises:
        BaselineError: what was given does not go together.
        CosimError: it cannot be set up.
    """
    stated = asdict(FmuAlone(**run))
    times = {key: stated.pop(key) for key in ("start", "stop", "step") if stated[key] is not None}
    of_fmu = {key: value for key, value in stated.items() if value}
    changed = {"overrides": overrides} if overrides else {}
    if isinstance(what, Outcome | Result):
        _refuse("a result of a run made already", times | of_fmu | changed)
        return Subject(Recipe(), what, None) if isinstance(what, Result) else Subject(Recipe(), what.result, what)
    if isinstance(what, str | Path) and Path(what).suffix.lower() == ".fmu":
        _refuse("an FMU alone", changed)
        return _run_recipe(_fmu_recipe(what, folder, times, of_fmu), progress)
    _refuse("a scenario", of_fmu)
    return _scenario_subject(what, folder, {**times, **(overrides or {})}, progress)


def _fmu_recipe(what: str | Path, folder: Path, times: Mapping[str, Any], chosen: Mapping[str, Any]) -> Recipe:
    """How an FMU alone is run."""
    inputs = chosen.get("inputs", {})
    table = str((folder / inputs).resolve()) if isinstance(inputs, str | Path) else dict(inputs)
    return Recipe(
        "fmu",
        str((folder / what).resolve()),
        **times,
        inputs=table,
        parameters=dict(chosen.get("parameters", {})),
        record=tuple(chosen.get("record", ())),
        interpolation=chosen.get("interpolation"),
        units=dict(chosen.get("units", {})),
    )


def _scenario_subject(
    what: Any,
    folder: Path,
    changes: Mapping[str, Any],
    progress: Progress | None,
) -> Subject:
    """A scenario, run."""
    if isinstance(what, Scenario):
        outcome = what.run(progress=progress, overrides=changes)
        return Subject(Recipe(), outcome.result, outcome)
    if isinstance(what, str | Path):
        return _run_recipe(Recipe("scenario", _scenario_source(what, folder), overrides=dict(changes)), progress)
    raise BaselineError(
        "Expected the path of an FMU, the name or path of a scenario, a Scenario, an Outcome or a Result; "
        f"got {type(what).__name__}."
    )


def _scenario_source(what: str | Path, folder: Path) -> str:
    """A scenario file beside the user's own as an absolute path, or the name of a shipped scenario.

    Args:
        what: file or name.
        folder: folder of the user's own file.

    Raises:
        ScenarioError: there is neither.
    """
    file, _, variant = str(what).partition("#")
    path = folder / file
    if path.is_file():
        return str(path.resolve()) + (f"#{variant}" if variant else "")
    if path.suffix in (".toml", ".ssp"):
        raise ScenarioError(f"Scenario file {path} does not exist.")
    return str(what)


def _refuse(what: str, settings: Mapping[str, Any]) -> None:
    if settings:
        hint = "set values with overrides={'component.parameter': value}" if what == "a scenario" else "leave them out"
        raise BaselineError(f"{what} takes no {', '.join(settings)}; {hint}.")


def _about_inputs(recipe: Recipe) -> Callable[[str], None]:
    """Warnings of an FMU alone: that inputs keep their start values is no news where constants were given for them."""

    def warn_of(text: str) -> None:
        if not (recipe.inputs and text.startswith("Unconnected inputs")):
            LOG.warning(text)

    return warn_of
