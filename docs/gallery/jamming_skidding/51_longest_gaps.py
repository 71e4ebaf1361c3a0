"""Amsterdam - Utrecht on wet rails, with jams and skids: position errors at the end of the longest gaps."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from shared.sheet import Sheet

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "studies"))

from turned_faults import turned

from cosim import Scenario
from cosim.drawing.style import new_figure
from cosim.evaluation.balise_gaps import gap_errors, largest
from cosim.report.figures.gap_figure import GapErrorsPanel

JAMS, SKIDS, MICRO_JAMS, LONGEST = "426-418", "426-420", "426-437", "426-391"  # groups at which these gaps begin
WHAT = {
    LONGEST: "874 m at 140 km/h",
    JAMS: "811 m, three jams",
    MICRO_JAMS: "808 m, six micro-jams",
    SKIDS: "786 m, two skids",
}
WHY = (
    "the thesis has 200 m between balises and prints figures only; train, wet rails, jams and skids are ours: "
    "docs/theses/amsterdam_utrecht.md"
)


def main() -> None:
    """Errors in metres and seconds of running time, by gap and observer."""
    sheet = Sheet(
        __file__, "Position at the end of the longest gaps", "Aguiar Cota 2019, chapters 3 to 5; line openETCS"
    )
    outcome = Scenario.load("amsterdam_utrecht").run(warn=lambda _text: None)
    found = gap_errors(outcome.result, outcome.spec)
    place = {gap.origin: i for i, gap in enumerate(found.gaps)}
    for origin, what in WHAT.items():
        for name, errors in found.errors.items():
            sheet.add(f"{what}: {found.labels[name]}", "m", None, errors[place[origin]], WHY, repeats=0.05)
    for name, errors in found.errors.items():
        seconds = found.running_time(name)
        reported = found.labels[name]
        sheet.add(f"largest of {len(found.gaps)} gaps: {reported}", "m", None, largest(errors), WHY, repeats=0.05)
        in_time = largest(seconds[~np.isnan(seconds)])
        sheet.add(f"largest running time: {reported}", "s", None, in_time, WHY, repeats=0.05)
    other = turned(Scenario.load("amsterdam_utrecht")).run(warn=lambda _text: None)
    for name, errors in gap_errors(other.result, other.spec).errors.items():
        what = f"jams and skids turned, largest of {len(found.gaps)} gaps: {found.labels[name]}"
        sheet.add(what, "m", None, largest(errors), WHY, repeats=0.05)
    figure = new_figure((9.0, 4.6))
    GapErrorsPanel.draw(outcome.result, outcome.spec, figure.add_subplot())
    sheet.finish(figure)


if __name__ == "__main__":
    main()
