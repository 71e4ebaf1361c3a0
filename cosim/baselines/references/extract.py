"""A reference taken out of an FMU: a baseline like any other, its inputs in a table beside it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from cosim.baselines.baseline import Baseline
from cosim.baselines.baseline_files import baseline_path, write_draft
from cosim.baselines.draft import make_draft
from cosim.baselines.references.read import read_reference
from cosim.errors import OutputError


def extract_reference(fmu: str | Path, path: str | Path, name: str | None = None) -> Path:
    """Write a reference in an FMU as a baseline; its inputs become ``NAME.inputs.csv``.

    Args:
        fmu: the FMU. path: of the baseline. name: of the reference; None where there is one only.

    Returns:
        The path of the baseline.

    Raises:
        FmuLoadError, BaselineError: as for `read_reference`.
        OutputError: the files cannot be written.
    """
    path = baseline_path(path)
    baseline = read_reference(fmu, name)
    recipe = baseline.header.recipe
    if not recipe.inputs and baseline.more.get("stimuli"):
        recipe = replace(recipe, inputs=str(_write_inputs(baseline, path).resolve()))
    draft = make_draft(baseline.result, baseline.tolerances, recipe=recipe, every=0.0)
    header = replace(
        draft.header,
        title=baseline.header.title,
        span=baseline.header.span,
        components=baseline.header.components,
        selection=baseline.header.selection,
        versions=baseline.header.versions,
        every=None,
    )
    write_draft(replace(draft, header=header), path)
    return path


def _write_inputs(baseline: Baseline, path: Path) -> Path:
    table = path.with_suffix(".inputs.csv")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        table.write_bytes(baseline.more["stimuli"])
    except OSError as error:
        raise OutputError(f"{table} could not be written: {error.strerror or error}.") from error
    return table
