"""What a regression test reports of a changed delivery, for docs/guide/regression_tests.md.

    python docs/studies/changed_deliveries.py

The locomotive is the first delivery; each other one has one thing changed. Seven have other outputs, three have not.
All are FMUs that state a tool and a date, run alone for ten seconds of traction, and held against the baseline of the
first.
"""

from __future__ import annotations

import tempfile
import zipfile
from dataclasses import dataclass, replace
from pathlib import Path

import deliveries
from page_tables import write_table

import fmus
from cosim import Scenario
from cosim.baselines import Regression, check, read_baseline, write_baseline
from cosim.baselines.recipe import Recipe
from cosim.baselines.subject import run_again
from cosim.comparison.comparison_text import comparison_text
from plant_models.hybrid import HybridSystem
from plant_models.railway.vehicle.locomotive import Locomotive

PAGE = Path(__file__).parents[1] / "guide" / "regression_tests.md"
OWN_TOOL = 'generationTool="fmu-observer"'
OLD = 'generationTool="Modeller R2021b" generationDateAndTime="2026-03-02T08:00:00Z"'
NEW = 'generationTool="Modeller R2023a" generationDateAndTime="2026-11-20T08:00:00Z"'
FILE = "vendor.fmu"


@dataclass(frozen=True)
class Changed:
    """A delivery with one thing changed.

    Args:
        what: the change, in words. system: what is delivered. stated: tool and date. differs: whether outputs do.
    """

    what: str
    system: type[HybridSystem]
    stated: str = OLD
    differs: bool = True


CHANGES = (
    Changed("the default of a parameter", deliveries.OtherDefault, NEW),
    Changed("the unit of an output: the same numbers as km/h", deliveries.WrongUnit),
    Changed("the name of an output", deliveries.Renamed),
    Changed("the step of the solver inside, twenty times as long", deliveries.CoarseStep),
    Changed("the gain of all outputs", deliveries.Gain),
    Changed("two outputs a step late", deliveries.OneSampleLate),
    Changed("the sign of an output", deliveries.SignOfOutput),
    Changed("tool and date alone", Locomotive, NEW, differs=False),
    Changed("half the step of the solver inside", deliveries.HalfStep, NEW, differs=False),
    Changed("one output more", deliveries.Added, differs=False),
)


def deliver(system: HybridSystem, stated: str, folder: Path) -> Path:
    """An FMU of a system that states a tool and a date.

    Args:
        system: what is delivered. stated: attributes of the model description. folder: where the FMU goes.
    """
    built = fmus.build_fmu(system, folder / "built.fmu", fmi_version=2)
    with zipfile.ZipFile(built) as source, zipfile.ZipFile(folder / FILE, "w") as target:
        for name in source.namelist():
            content = source.read(name)
            if name == "modelDescription.xml":
                content = content.replace(OWN_TOOL.encode(), stated.encode())
            target.writestr(name, content)
    return folder / FILE


def first_delivery(folder: Path) -> Path:
    """The baseline of the first delivery, in this folder.

    Args:
        folder: where FMU and baseline go.
    """
    fmu = deliver(Locomotive(), OLD, folder)
    run = {"stop": 10.0, "step": 0.01, "inputs": {"effort": 6e4}}
    outcome = Scenario.fmu(fmu, **run).run(warn=lambda _: None)
    write_baseline(outcome.result, folder / "traction.json", recipe=Recipe("fmu", str(fmu.resolve()), **run))
    return folder / "traction.json"


def held_against(baseline: Path, changed: Changed) -> Regression:
    """What a check reports of a changed delivery.

    Args:
        baseline: of the first one. changed: the other one.
    """
    with tempfile.TemporaryDirectory() as folder:
        fmu = deliver(changed.system(), changed.stated, Path(folder))
        kept = read_baseline(baseline)
        return check(run_again(kept, fmu).result, kept, label=FILE)


def section(changed: Changed, found: Regression) -> str:
    """The part of the page about one change, without the GUIDs."""
    shown = replace(found, notes=[note for note in found.notes if "GUID" not in note])
    return f"\n### Changed: {changed.what}\n\n```text\n{comparison_text(shown)}\n```\n"


def page() -> str:
    """All parts, those that differ first."""
    with tempfile.TemporaryDirectory() as folder:
        baseline = first_delivery(Path(folder))
        return "".join(section(changed, held_against(baseline, changed)) for changed in CHANGES)


if __name__ == "__main__":
    write_table(PAGE, "deliveries", page())
