"""Reference results inside an FMU (FMI-LS-REF): written into a copy, read back, run again; and those that others put
there.
"""

from __future__ import annotations

import shutil
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fmpy import simulate_fmu
from fmpy.validation import validate_fmu
from lxml import etree

import fmus
import plant_models
from cosim.baselines import Recipe, check, read_baseline, write_baseline
from cosim.baselines.references import embed_baseline, extract_reference, find_references, read_reference
from cosim.baselines.references.manifest import FOLDER, MANIFEST, read_experiments, read_manifest
from cosim.baselines.subject import make_subject, run_again
from cosim.errors import BaselineError

pytestmark = pytest.mark.compiler


@pytest.fixture(scope="module")
def vendor(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("vendor") / "vendor.fmu"
    return Path(shutil.copy(fmus.cached_fmu(plant_models.Locomotive(), 3), path))


@pytest.fixture(scope="module")
def embedded(vendor: Path) -> Path:
    """A copy of the vendor's FMU with two references: constant inputs and parameters, and inputs from a table."""
    folder = vendor.parent
    (folder / "ramp_inputs.csv").write_text("time,effort\n0,0\n0.5,100000\n1,20000\n", encoding="utf-8")
    runs: dict[str, dict[str, Any]] = {
        "start": {"inputs": {"effort": 1e5}, "parameters": {"mass": 75e3}},
        "ramp": {"inputs": "ramp_inputs.csv"},
    }

    target = folder / "with.fmu"
    for name, arguments in runs.items():
        subject = make_subject("vendor.fmu", folder, stop=1.0, step=0.01, **arguments)
        write_baseline(subject.result, folder / f"{name}.json", recipe=subject.recipe)
        embed_baseline(read_baseline(folder / f"{name}.json"), target if target.exists() else vendor, target)
    return target


def content(path: Path) -> dict[str, bytes]:
    with zipfile.ZipFile(path) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def with_files(vendor: Path, target: Path, files: dict[str, str]) -> Path:
    """A copy of an FMU with files in the folder of the standard, as another tool would put them there."""
    shutil.copy(vendor, target)
    with zipfile.ZipFile(target, "a") as archive:
        for name, text in files.items():
            archive.writestr(f"{FOLDER}/{name}", text)
    return target


def test_what_was_in_the_fmu_stays_as_it_was_and_the_copy_is_valid(
    vendor: Path, embedded: Path, tmp_path: Path
) -> None:
    before, after = content(vendor), content(embedded)
    assert {name: after[name] for name in before} == before
    assert {name.rpartition("/")[0] for name in set(after) - set(before)} == {FOLDER}
    assert validate_fmu(str(embedded)) == []
    for name in ("once", "twice"):
        embed_baseline(read_baseline(vendor.parent / "start.json"), vendor, tmp_path / f"{name}.fmu", "start")
    assert (tmp_path / "once.fmu").read_bytes() == (tmp_path / "twice.fmu").read_bytes()
    embed_baseline(read_baseline(vendor.parent / "start.json"), tmp_path / "once.fmu", tmp_path / "once.fmu", "start")
    assert content(tmp_path / "once.fmu") == content(tmp_path / "twice.fmu")  # replaced, not added again


def test_the_layout_is_that_of_the_standard(embedded: Path) -> None:
    files = content(embedded)
    root = etree.fromstring(files[MANIFEST])
    assert root.tag == "fmiReferences"
    assert root.get("{http://fmi-standard.org/fmi-ls-manifest}fmi-ls-name") == "org.fmi-standard.fmi-ls-ref"
    roles = {entry.member.removeprefix(f"{FOLDER}/"): entry.role for entry in read_manifest(files[MANIFEST], MANIFEST)}
    assert roles["start_out.csv"] == "result"
    assert roles["start.exp"] == "experiment"
    assert roles["start.ssv"] == "parameter"
    (experiment,) = read_experiments(files[f"{FOLDER}/start.exp"], f"{FOLDER}/start.exp")
    assert (experiment.start, experiment.stop, experiment.step) == (0.0, 1.0, 0.01)
    assert {experiment.parameters, experiment.stimuli, experiment.references} <= set(files)


def test_another_tool_finds_the_stimuli_and_outputs_it_needs(embedded: Path, tmp_path: Path) -> None:
    files = content(embedded)
    for name in ("ramp_in.csv", "ramp_out.csv"):
        (tmp_path / name).write_bytes(files[f"{FOLDER}/{name}"])
    stimuli, outputs = (
        np.genfromtxt(tmp_path / f"ramp_{what}.csv", delimiter=",", names=True) for what in ("in", "out")
    )
    assert outputs.dtype.names[0] == "time"
    result = simulate_fmu(
        str(embedded), stop_time=1.0, output_interval=0.01, step_size=0.01, input=stimuli, output=["speed"]
    )
    # fmpy feeds the inputs of the end of a step where this master holds those of its beginning: half a step of a ramp
    # of
    # 2e5 N/s on 80 t, 1.25 mm/s for each of the steps so far at most; measured 1.3e-2 m/s
    assert np.abs(np.interp(outputs["time"], result["time"], result["speed"]) - outputs["speed"]).max() < 0.02
    assert outputs["speed"][-1] > 0.5


@pytest.mark.parametrize("name", ["start", "ramp"])
def test_references_run_again_and_come_out_as_baselines(name: str, embedded: Path, tmp_path: Path) -> None:
    assert [reference.name for reference in find_references(embedded)] == ["start", "ramp"]
    inside = read_reference(embedded, name)
    assert check(run_again(inside).outcome, inside).equal  # type: ignore[arg-type]
    extract_reference(embedded, tmp_path / "out.json", name)
    outside, before = read_baseline(tmp_path / "out.json"), read_baseline(embedded.parent / f"{name}.json")
    names = [info.name for info in before.result.signals if info.name.startswith("fmu.")]
    assert all(np.array_equal(outside.result[signal], before.result[signal]) for signal in names)
    assert outside.tolerances == before.tolerances
    assert check(run_again(outside).outcome, outside).equal  # type: ignore[arg-type]


def test_results_of_others_need_no_experiment(vendor: Path, tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    """As the Reference FMUs of the Modelica Association ship theirs: a manifest, one table of outputs, no
    description.
    """
    manifest = """<?xml version="1.0" encoding="UTF-8"?>
    <fmiReferences xmlns:fmi-ls="http://fmi-standard.org/fmi-ls-manifest" fmi-ls:fmi-ls-version="1.0.0-alpha.1"
        fmi-ls:fmi-ls-name="org.fmi-standard.fmi-ls-ref">
      <Related type="text/csv" source="Loco_out.csv" role="result" description="Output of the default experiment"/>
      <Related type="text/csv" source="gone_out.csv" role="result"/>
      <Related type="text/html" source="https://example.org/a.html" role="document"/>
    </fmiReferences>"""
    outcome = make_subject("vendor.fmu", vendor.parent, stop=1.0, step=0.001, inputs={"effort": 1e5}).result
    assert "Unconnected inputs" not in caplog.text  # it was given a constant
    make_subject("vendor.fmu", vendor.parent, stop=0.01, step=0.01)
    assert "Unconnected inputs keep their start values: fmu.effort." in caplog.text
    rows = [
        f"{t!r},{v!r}" for t, v in zip(outcome.time.tolist()[::50], outcome["fmu.speed"].tolist()[::50], strict=True)
    ]
    table = "\r\n".join(['"time","speed"', *rows]) + "\r\n"
    files = {"fmi-ls-manifest.xml": manifest, "Loco_out.csv": table, "Loco_in.csv": "time,effort\n0,1e5\n1,1e5\n"}
    fmu = with_files(vendor, tmp_path / "loco.fmu", files)
    baseline = read_reference(fmu)
    assert baseline.label == "loco.fmu#Loco"
    assert [(info.name, info.unit) for info in baseline.result.signals] == [("fmu.speed", "m/s")]
    subject = run_again(baseline)
    assert subject.result["fmu.speed"][-1] > 1.0  # the inputs beside it were played
    assert [(s.name, s.status) for s in check(subject.result, baseline).signals] == [("fmu.speed", "within")]


@pytest.mark.parametrize(
    ("files", "says"),
    [
        ({}, "holds no reference results"),
        ({"fmi-ls-manifest.xml": "<fmiReferences"}, "line 1: not readable as XML"),
        ({"fmi-ls-manifest.xml": "<other/>"}, "expected the element fmiReferences"),
        ({"fmi-ls-manifest.xml": '<!DOCTYPE a [<!ENTITY b "c">]><fmiReferences/>'}, "document type"),
        (
            {
                "fmi-ls-manifest.xml": '<fmiReferences><Related role="experiment" source="a.exp"/></fmiReferences>',
                "a.exp": '<Experiments><Experiment name="a"><References '
                'source="../../../x.csv"/></Experiment></Experiments>',
            },
            "holds no reference results",
        ),
        (
            {
                "fmi-ls-manifest.xml": '<fmiReferences><Related role="experiment" source="a.exp"/></fmiReferences>',
                "a.exp": '<Experiments name="a"><Experiment name="a"><References '
                'source="x.csv"/></Experiment></Experiments>',
            },
            "x.csv, which is not in the FMU",
        ),
        (
            {
                "fmi-ls-manifest.xml": '<fmiReferences><Related role="result" source="a_out.csv"/></fmiReferences>',
                "a_out.csv": "time,speed\n0,fast\n",
            },
            "a_out.csv",
        ),
    ],
)
def test_broken_references_are_refused_in_words(files: dict[str, str], says: str, vendor: Path, tmp_path: Path) -> None:
    fmu = with_files(vendor, tmp_path / "broken.fmu", files)
    with pytest.raises(BaselineError) as caught:
        read_reference(fmu)
    assert says in str(caught.value)


def test_only_the_own_model_takes_a_baseline(vendor: Path, embedded: Path, tmp_path: Path) -> None:
    with pytest.raises(BaselineError, match="start, ramp"):
        read_reference(embedded)
    with pytest.raises(BaselineError, match="no reference 'strat'; did you mean 'start'"):
        read_reference(embedded, "strat")
    other = fmus.cached_fmu(plant_models.PLANTS["odometer"](), 3)
    baseline = read_baseline(vendor.parent / "start.json")
    with pytest.raises(BaselineError, match=r"the model 'locomotive'.*the model 'odometer'"):
        embed_baseline(baseline, other, tmp_path / "wrong.fmu")
    write_baseline(baseline.result, tmp_path / "plain.json", recipe=Recipe())
    with pytest.raises(BaselineError, match="not a baseline of an FMU alone"):
        embed_baseline(read_baseline(tmp_path / "plain.json"), vendor, tmp_path / "wrong.fmu")
    assert not (tmp_path / "wrong.fmu").exists()
