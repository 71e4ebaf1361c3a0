"""The validation campaign over twenty seeds, and its thresholds: the tables of docs/theses/validation_campaign.md.

``python docs/studies/validation_campaign.py`` writes them into the page (5 minutes on one core). Published numbers are
Tables 5.2 to 5.7 of Aguiar Cota 2019.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from cosim import Scenario
from cosim.statistics.spread import Spread
from cosim.studies.groups import grouped
from fmus.tables.numbers import number

PAGE = Path(__file__).parents[1] / "theses" / "validation_campaign.md"
PART = r"(<!-- study: {name} -->\n)(.*?)(<!-- end -->)"
SEEDS, FEW_SEEDS = range(20), range(4)
OBSERVER, SENSOR, COACH = "quasi_lpv_uio", "odometer_reset", 30.0
THRESHOLDS = tuple(float(f"{value:.3g}") for value in np.geomspace(0.1, 51.2, 16))  # [m/s]
COLUMNS = {
    "Dt_ds [s]": (f"{OBSERVER}.detection_delay", 1.0),
    "Dt_de [s]": (f"{OBSERVER}.recovery_delay", 1.0),
    "UFR": (f"{OBSERVER}.missed_share", 1.0),
    "FAR": (f"{OBSERVER}.false_share", 1.0),
    "e_p [30 m]": (f"{SENSOR}.balise_error_max", 1.0 / COACH),
    "ê_p [30 m]": (f"{OBSERVER}.balise_error_max", 1.0 / COACH),
}
PUBLISHED: Mapping[str, tuple[float | None, ...]] = {  # in the order of COLUMNS
    "HS LoA": (0.4, 0.17, 0.0, 0.0, 0.126, 0.113),
    "HS BaA": (0.19, 0.41, 0.0, 0.0, 0.123, 0.106),
    "HS EBA": (0.22, 0.3, 0.0, 0.0, 0.193, 0.115),
    "AS LoA": (0.1, 0.2, 0.0, 0.0, 0.14, 0.11),
    "AS BaA": (0.56, 0.16, 0.0, 0.0, 0.16, 0.14),
    "AS EBA": (0.2, 0.2, 0.0, 0.0, 0.58, 0.19),
    "LS LoA": (None, None, None, None, 0.06, 0.03),
    "LS BaA": (0.2, 0.2, 0.0, 0.0, 0.15, 0.13),
    "LS EBA": (0.14, 0.2, 0.0, 0.0, 0.18, 0.13),
    "HS pneumatic": (0.4, 0.2, 0.0, 0.0, 0.53, 0.35),
    "AS pneumatic": (0.2, 0.2, 0.0, 0.0, 0.66, 0.15),
    "LS pneumatic": (0.2, 0.2, 0.2, 0.0, 0.96, 0.13),
    "AS BaA micro-jams": (None,) * 6,  # section 5.3.3.2 tells of them without numbers
}
RANGES: Mapping[str, tuple[float, float, float]] = {  # smallest, largest and chosen threshold
    "HS LoA": (0.58, 1.12, 0.65),
    "HS BaA": (0.59, 1.8, 0.65),
    "HS EBA": (0.55, 3.1, 0.65),
    "AS LoA": (0.61, 1.51, 0.62),
    "AS BaA": (0.51, 2.3, 0.62),
    "AS EBA": (0.45, 13.0, 0.62),
    "LS LoA": (0.2, 1.0, 0.4),
    "LS BaA": (0.3, 1.8, 0.4),
    "LS EBA": (0.25, 2.0, 0.4),
    "HS pneumatic": (1.0, 14.0, 1.5),
    "AS pneumatic": (1.2, 18.0, 1.5),
    "LS pneumatic": (1.2, 20.0, 1.5),
}


def main() -> None:
    """Run both sweeps and rewrite the page."""
    write("campaign", campaign_table(measured(SEEDS)))
    write("thresholds", threshold_table(*threshold_shares()))


def measured(seeds: Iterable[int], cases: Iterable[str] = tuple(PUBLISHED)) -> dict[Any, dict[str, Spread]]:
    """Spreads of all measures by case, over drawings of the jams."""
    sweep = Scenario.load("validation_campaign").vary({"case": list(cases), "seed": list(seeds)})
    return grouped(sweep.run(keep=False), "case")


def campaign_table(found: Mapping[str, Mapping[str, Spread]]) -> str:
    """A row a case: published, then ours with its interval."""
    rows = [f"| case | {' | '.join(COLUMNS)} |", "|---|" + "---|" * len(COLUMNS)]
    for case, published in PUBLISHED.items():
        ours = [found[case][measure].text(factor, 2) for measure, factor in COLUMNS.values()]
        cells = [
            f"{number(printed, 3)} · **{own.replace(' (', '** (')}"
            for printed, own in zip(published, ours, strict=True)
        ]
        cells = [cell if cell.count("**") == 2 else f"{cell}**" for cell in cells]
        rows.append(f"| {case} | {' | '.join(cells)} |")
    return "\n".join([*rows, ""])


def threshold_shares(
    cases: Iterable[str] = tuple(RANGES), seeds: Iterable[int] = FEW_SEEDS
) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
    """Shares of missed faults and of false detections at `THRESHOLDS`, by case, each shape (thresholds,)."""
    missed, false = ({case: np.full(len(THRESHOLDS), np.nan) for case in cases} for _ in range(2))
    for k, threshold in enumerate(THRESHOLDS):
        values = {"case": list(cases), f"{OBSERVER}.threshold": [threshold], "seed": list(seeds)}
        found = grouped(Scenario.load("validation_campaign").vary(values).run(keep=False), "case")
        for case, spreads in found.items():
            missed[case][k] = spreads[f"{OBSERVER}.missed_share"].value
            false[case][k] = spreads[f"{OBSERVER}.false_share"].value
    return missed, false


def threshold_table(missed: Mapping[str, np.ndarray], false: Mapping[str, np.ndarray]) -> str:
    """A row a case: thresholds as printed, and where our campaign has them."""
    rows = ["| case | chosen | least printed | half of the detections false, ours | most printed | 99 % missed, ours |"]
    rows.append("|---|---|---|---|---|---|")
    for case, (low, high, chosen) in RANGES.items():
        least, most = ends(missed[case], false[case], chosen)
        cells = (
            "none" if least is None else f"{least:.2g}",
            f"> {THRESHOLDS[-1]:g}" if most is None else f"{most:.2g}",
        )
        rows.append(f"| {case} | {chosen} | {low} | {cells[0]} | {high} | {cells[1]} |")
    return "\n".join([*rows, ""])


def ends(missed: np.ndarray, false: np.ndarray, chosen: float) -> tuple[float | None, float | None]:
    """The largest threshold below the chosen one at which half of the detections are false, and the smallest above it
    at which 99 % are missed.
    """
    noisy = [t for t, share in zip(THRESHOLDS, false, strict=True) if share >= 0.5 and t < chosen]
    blind = [t for t, share in zip(THRESHOLDS, missed, strict=True) if share >= 0.99 and t > chosen]
    return (max(noisy) if noisy else None), (min(blind) if blind else None)


def write(name: str, content: str) -> None:
    """Replace a part of the page."""
    text = PAGE.read_text(encoding="utf-8")
    pattern = PART.format(name=re.escape(name))
    PAGE.write_text(re.sub(pattern, lambda m: m[1] + content + m[3], text, flags=re.DOTALL), encoding="utf-8")
    print(content)


if __name__ == "__main__":
    main()
