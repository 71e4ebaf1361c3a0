"""Reference results in an FMU as baselines. Reads the archive, runs nothing."""

from __future__ import annotations

import json
import tempfile
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from cosim.baselines.baseline import Baseline, Header
from cosim.baselines.baseline_files import summary_of
from cosim.baselines.delivery import DeliveredFmu
from cosim.baselines.header_data import VERSION, header_from
from cosim.baselines.model_identity import Identity
from cosim.baselines.recipe import Recipe
from cosim.baselines.references.manifest import (
    FOLDER,
    MANIFEST,
    Experiment,
    Related,
    as_of_a_run,
    prefix,
    read_experiments,
    read_manifest,
)
from cosim.comparison.tolerance import Tolerances
from cosim.components.component import Component
from cosim.components.description import read_description
from cosim.components.loading import describe_fmu
from cosim.components.stated_units import stated_units
from cosim.errors import BaselineError, CosimError, nearest
from cosim.results.load_result import load_result
from cosim.results.result import Result
from cosim.scenario.fmu_alone import run_times
from cosim.ssp.annotation import read_parameter_set
from cosim.ssp.document import parse
from cosim.ssp.lapses import Lapses
from plant_models.left_behind import owned

COMPONENT = "fmu"
"""What the component of an FMU alone is called, see `Scenario.fmu`."""
ENDINGS = ("_out", "_ref", "-out", "-ref")


@dataclass(frozen=True)
class Reference:
    """A reference in an FMU.

    Args:
        fmu: the file. experiment: what to run and with what it is compared.
    """

    fmu: Path
    experiment: Experiment

    @property
    def name(self) -> str:
        """Its name."""
        return self.experiment.name


def find_references(fmu: str | Path) -> list[Reference]:
    """All references in an FMU, in the order of the manifest: experiments first, then results that none of them names.

    Args:
        fmu: path of the FMU.

    Raises:
        FmuLoadError: it is not an FMU.
        BaselineError: a file of the standard in it cannot be read.
    """
    path = Path(fmu)
    read_description(path, path.name)  # refuses what is broken or dangerous
    with zipfile.ZipFile(path) as archive:
        members = set(archive.namelist())
        if MANIFEST not in members:
            return []
        related = read_manifest(archive.read(MANIFEST), MANIFEST)
        experiments = [
            experiment
            for entry in related
            if entry.role.partition("/")[0] == "experiment" and entry.member in members
            for experiment in read_experiments(archive.read(entry.member), entry.member)
            if experiment.references
        ]
    named = {experiment.references for experiment in experiments}
    experiments += [
        _lone(entry, members) for entry in related if _is_table(entry, members) and entry.member not in named
    ]
    return [Reference(path, experiment) for experiment in experiments]


def _is_table(entry: Related, members: set[str]) -> bool:
    return entry.role == "result" and entry.member in members and entry.member.endswith(".csv")


def _lone(entry: Related, members: set[str]) -> Experiment:
    """A result without an experiment: the FMU's own one, with the inputs that stand beside it."""
    stem = entry.member.removesuffix(".csv")
    name = next((stem.removesuffix(ending) for ending in ENDINGS if stem.endswith(ending)), stem)
    stimuli = next((f for f in (f"{name}_in.csv", f"{name}-in.csv") if f in members), "")
    return Experiment(name.rpartition("/")[2], entry.description, stimuli=stimuli, references=entry.member)


def read_reference(fmu: str | Path, name: str | None = None) -> Baseline:
    """A reference in an FMU as a baseline.

    Args:
        fmu: the file. name: of the reference; None where there is one only.

    Raises:
        FmuLoadError: it is not an FMU.
        BaselineError: it holds no reference of this name, or one that cannot be read.
    """
    found = find_references(fmu)
    if not found:
        raise BaselineError(
            f"{fmu} holds no reference results: no experiment and no result in {MANIFEST} (FMI-LS-REF)."
        )
    names = [reference.name for reference in found]
    if name is None and len(found) > 1:
        raise BaselineError(f"{fmu} holds {len(found)} references; name one of them: {', '.join(names)}.")
    if name is not None and name not in names:
        raise BaselineError(f"{fmu} holds no reference {name!r}; {nearest(name, names)}")
    return _baseline(found[0 if name is None else names.index(name)])


def _baseline(reference: Reference) -> Baseline:
    experiment, path = reference.experiment, reference.fmu
    with zipfile.ZipFile(path) as archive:
        members = archive.namelist()
        texts = {}
        for member in filter(None, (experiment.parameters, experiment.stimuli, experiment.references)):
            if member not in members:
                raise BaselineError(
                    f"{path}: the experiment {experiment.name!r} names {member}, which is not in the FMU."
                )
            texts[member] = archive.read(member)
        own = f"{FOLDER}/{experiment.name}.json"
        written = archive.read(own) if own in members else b""
    component = describe_fmu(path, COMPONENT, stated_units(_units(written)))
    table = as_of_a_run(_load(texts[experiment.references], f"{path}, {experiment.references}"), component)
    header = _header(reference, component, table, texts)
    if written:
        header = _with_own(header, written, path)
    signals = {info.name: info for info in header.signals}
    table = replace(table, signals=[signals.get(info.name, info) for info in table.signals], summary=summary_of(header))
    return Baseline(header, table, path, (), {"stimuli": texts.get(experiment.stimuli), "name": experiment.name})


def _load(text: bytes, where: str) -> Result:
    with tempfile.TemporaryDirectory(prefix=owned("fmu-reference-")) as folder:
        file = Path(folder) / "reference.csv"
        file.write_bytes(text)
        try:
            result = load_result(file)
        except CosimError as error:
            raise BaselineError(f"{where}: {str(error).replace(str(file), 'the table')}") from error
        return replace(result, table=np.array(result.table))


def _header(reference: Reference, component: Component, table: Result, texts: Mapping[str, bytes]) -> Header:
    experiment, path = reference.experiment, reference.fmu
    parameters = _parameters(texts[experiment.parameters], experiment.parameters) if experiment.parameters else {}
    start = experiment.start if experiment.start is not None else float(table.time[0])
    stop = experiment.stop if experiment.stop is not None else float(table.time[-1])
    begin, end, step = run_times(component.description, start, stop, experiment.step, path.name)
    outputs = {v.name for v in component.description.modelVariables if v.causality == "output"}
    names = [info.name.removeprefix(prefix(COMPONENT)) for info in table.signals]
    record = tuple(name for name in names if name.partition("[")[0] not in outputs and name in component.variables)
    description = component.description
    identity = Identity(
        COMPONENT,
        "FMU",
        str(description.modelName),
        str(description.fmiVersion),
        str(description.guid),
        path.name,
        parameters=parameters,
        delivery=DeliveredFmu.of(description),
    )
    return Header(
        title=experiment.description or f"{experiment.name} of {path.name}",
        recipe=Recipe("fmu", str(path.resolve()), begin, end, step, {}, parameters, record),
        span={"start": begin, "stop": end, "step": step},
        components=[identity],
        signals=tuple(table.signals),
        tolerances=Tolerances(),
        selection=tuple(info.name for info in table.signals),
        every=None,
        rows=len(table.table),
        events=0,
        digest="",
        versions={},
        version=VERSION,
    )


def _parameters(text: bytes, member: str) -> dict[str, Any]:
    """The values of a parameter set (SSV); in the units of the FMU, in which nearly all sets are."""
    values: dict[str, Any] = {}
    for parameter in read_parameter_set(parse(text, member, "ssv"), "", Lapses()):
        items = [_value(item, parameter.type.family) for item in parameter.values]
        values[parameter.name] = items if parameter.array else items[0]
    return values


def _value(text: str, family: str) -> float | int | bool | str:
    if family == "Real":
        return float(text)
    if family == "Integer":
        return int(text)
    return text in ("true", "1") if family == "Boolean" else text


def _units(text: bytes) -> dict[str, Any]:
    """What was stated of the variables when the reference was made; `_with_own` says what is wrong with the text."""
    try:
        return dict(json.loads(text)["run"].get("units", {}))
    except (ValueError, LookupError, TypeError, AttributeError):
        return {}


def _with_own(header: Header, text: bytes, path: Path) -> Header:
    """With what this package wrote beside the reference: tolerances, versions, constant inputs."""
    try:
        own = header_from(json.loads(text), path.parent)
    except (BaselineError, ValueError) as error:
        raise BaselineError(f"{path}: the header of the reference {header.title!r}: {error}") from error
    signals = {info.name: info for info in own.signals}
    names = ("inputs", "parameters", "record", "units")
    recipe = replace(header.recipe, **{name: getattr(own.recipe, name) for name in names})
    return replace(
        header,
        recipe=recipe,
        title=own.title,
        tolerances=own.tolerances,
        selection=own.selection,
        versions=own.versions,
        signals=[signals.get(info.name, info) for info in header.signals],
        components=[replace(entry, sha256="") for entry in own.components if entry.name == COMPONENT],
    )
