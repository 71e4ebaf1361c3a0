"""A baseline written into a copy of its FMU, so that whoever receives the FMU can check that it runs there as it did
here.
"""

from __future__ import annotations

import csv
import io
import json
import zipfile
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from cosim.baselines.baseline import Baseline
from cosim.baselines.header_data import header_data
from cosim.baselines.references.manifest import (
    CSV,
    EXPERIMENTS,
    FOLDER,
    JSON,
    MANIFEST,
    SSV,
    Experiment,
    Related,
    experiments_text,
    in_units_of,
    manifest_text,
    prefix,
)
from cosim.baselines.table_text import number_text
from cosim.components.component import Component
from cosim.components.loading import describe_fmu
from cosim.components.stated_units import stated_units
from cosim.errors import BaselineError, OutputError
from cosim.ssp.elements_of_data import add_parameter, child, root_of, text_of
from fmus.tables.plain_data import jsonable
from plant_models.disk_cache.entries import whole_file

STAMP = (1980, 1, 1, 0, 0, 0)
"""Of the files added: the earliest a zip file can hold, so that the same content gives the same bytes."""


def embed_baseline(baseline: Baseline, fmu: str | Path, target: str | Path, name: str | None = None) -> Path:
    """Write a copy of an FMU that holds a baseline as a reference of FMI-LS-REF.

    Args:
        baseline: of this FMU alone. fmu: the FMU; all its files are kept as they are, but for the manifest of the
            standard.
        target: path of the copy; may be the FMU itself. name: of the reference; None for that of the baseline.

    Returns:
        The path of the copy.

    Raises:
        FmuLoadError: it is not an FMU.
        BaselineError: the baseline is of a scenario, or of another model.
        OutputError: the copy cannot be written; a former file there is still whole.
    """
    source, target = Path(fmu), Path(target)
    if target.suffix.lower() != ".fmu":
        raise OutputError(f"{target} must end in .fmu.")
    component = _demand_own(baseline, source)
    files = _files(baseline, name or baseline.path.stem, component)
    _rewrite(source, target, files)
    return target


def _demand_own(baseline: Baseline, fmu: Path) -> Component:
    if baseline.header.recipe.kind != "fmu" or len(baseline.header.components) == 0:
        raise BaselineError(f"{baseline.path.name} is not a baseline of an FMU alone, so it cannot be put into one.")
    identity = next(entry for entry in baseline.header.components if entry.kind == "FMU")
    component = describe_fmu(fmu, identity.name, stated_units(baseline.header.recipe.units))
    if component.description.modelName != identity.model:
        raise BaselineError(
            f"{baseline.path.name} is a baseline of the model '{identity.model}' (GUID {identity.guid}); {fmu.name} is "
            f"the model '{component.description.modelName}' (GUID {component.description.guid})."
        )
    return component


def _files(baseline: Baseline, name: str, component: Component) -> dict[str, bytes | Related]:
    """What is added: bytes by path in the archive; the entry of the manifest under ``manifest:path``."""
    recipe, title = baseline.header.recipe, baseline.header.title
    paths = {kind: f"{FOLDER}/{name}{ending}" for kind, ending in ENDINGS.items()}
    content: dict[str, bytes] = {"out": _outputs(baseline, component)}
    stimuli = _stimuli(baseline)
    if stimuli:
        content["in"] = stimuli
    if recipe.parameters:
        content["ssv"] = _parameter_set(name, recipe.parameters, component)
    span = baseline.header.span
    files = [paths[kind] if kind in content else "" for kind in ("ssv", "in", "out")]
    experiment = Experiment(name, title, span["start"], span["stop"], span["step"], *files)
    content["exp"] = experiments_text(experiment)
    own = replace(recipe, source="", inputs={} if isinstance(recipe.inputs, str) else recipe.inputs)
    data = header_data(replace(baseline.header, recipe=own), baseline.path.parent)
    content["json"] = (json.dumps(jsonable(data), indent=2, allow_nan=False) + "\n").encode()
    roles = {"out": ("result", CSV), "in": ("other", CSV), "ssv": ("parameter", SSV), "json": ("other", JSON)}
    roles["exp"] = ("experiment", EXPERIMENTS)
    found: dict[str, bytes | Related] = {paths[kind]: text for kind, text in content.items()}
    for kind in content:
        role, mime = roles[kind]
        found[f"manifest:{paths[kind]}"] = Related(paths[kind], role, mime, f"{name}: {WORDS[kind]}")
    return found


ENDINGS = {"out": "_out.csv", "in": "_in.csv", "ssv": ".ssv", "exp": ".exp", "json": ".json"}
WORDS = {
    "out": "outputs that were found right",
    "in": "inputs of the run",
    "ssv": "parameters of the run",
    "exp": "the run, to be repeated",
    "json": "tolerances, versions and units",
}


def _outputs(baseline: Baseline, component: Component) -> bytes:
    """The rows in the units of the FMU, as any tool may read them."""
    result = in_units_of(baseline.result, component)
    whole = [info.name for info in result.signals if info.name.startswith(prefix(component.name))]
    names = [name.removeprefix(prefix(component.name)) for name in whole]
    return _csv(["time", *names], [result.table[name] for name in ("time", *whole)])


def _stimuli(baseline: Baseline) -> bytes:
    recipe = baseline.header.recipe
    if stored := baseline.more.get("stimuli"):
        return bytes(stored)
    if isinstance(recipe.inputs, str):
        try:
            return Path(recipe.inputs).read_bytes()
        except OSError as error:
            raise BaselineError(
                f"The inputs of {baseline.path.name}, {recipe.inputs}, cannot be read: {error.strerror}."
            ) from error
    held = {name: value for name, value in recipe.inputs.items() if isinstance(value, int | float)}
    if not held:
        return b""
    times = np.array([baseline.header.span["start"], baseline.header.span["stop"]])
    return _csv(["time", *held], [times, *(np.full(2, float(value)) for value in held.values())])


def _csv(names: list[str], columns: list[np.ndarray]) -> bytes:
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerow(names)
    for row in zip(*(column.tolist() for column in columns), strict=True):
        text.write(",".join(number_text(value, None) for value in row) + "\n")
    return text.getvalue().encode()


def _parameter_set(name: str, parameters: Mapping[str, Any], component: Component) -> bytes:
    root = root_of("ssv", "ParameterSet", "2.0" if component.fmi_version == 3 else "1.0", name=name)
    holder = child(root, "ssv", "Parameters")
    for key, value in parameters.items():
        variable = component.variable(key)
        values = value if isinstance(value, list | tuple) else [value]
        shape = tuple(variable.shape or ()) if isinstance(value, list | tuple) else ()
        add_parameter(holder, key, str(variable.type), values, shape)
    return text_of(root)


def _rewrite(source: Path, target: Path, files: Mapping[str, bytes | Related]) -> None:
    """The archive with more files in it; what it held keeps its bytes, order, dates and rights."""
    added = {path: content for path, content in files.items() if isinstance(content, bytes)}
    related = [content for content in files.values() if isinstance(content, Related)]
    try:
        with (
            whole_file(target, 0o644) as stream,
            zipfile.ZipFile(source) as former,
            zipfile.ZipFile(stream, "w") as archive,
        ):
            entries = former.infolist()
            names = {entry.filename for entry in entries}
            added[MANIFEST] = manifest_text(related, former.read(MANIFEST) if MANIFEST in names else None)
            for entry in entries:
                if entry.filename not in added:
                    archive.writestr(entry, former.read(entry), compress_type=entry.compress_type)
            for path in sorted(added):
                fresh = zipfile.ZipInfo(path, STAMP)
                fresh.compress_type, fresh.external_attr = zipfile.ZIP_DEFLATED, 0o644 << 16
                archive.writestr(fresh, added[path])
    except OSError as error:
        raise OutputError(f"{target} could not be written: {error.strerror or error}.") from error
