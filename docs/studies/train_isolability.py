"""Which faults can be distinguished at all: structural analysis of a train's sensors by faultdiagnosistoolbox.

``python docs/studies/train_isolability.py`` prints the table of docs/theses/train_diagnosis.md, with ``--write`` it
writes it. The structural model says which variable and which fault stands in which equation, and nothing of sizes,
noise and time.
"""

from __future__ import annotations

import sys
from pathlib import Path

import faultdiagnosistoolbox as fdt
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent))

from page_tables import print_tables

from fmu_observer.detection.train_isolation import SENSORS, isolability

PAGE = Path(__file__).resolve().parents[1] / "theses" / "train_diagnosis.md"
SETS: dict[str, tuple[str, ...]] = {
    "all": SENSORS,
    "no second odometer": ("odometer_1", "radar", "gps", "balise", "pressure_sensor"),
    "no radar": ("odometer_1", "odometer_2", "gps", "balise", "pressure_sensor"),
    "no satellites": ("odometer_1", "odometer_2", "radar", "balise", "pressure_sensor"),
    "no brake pressure": ("odometer_1", "odometer_2", "radar", "gps", "balise"),
    "odometers and balises": ("odometer_1", "odometer_2", "balise"),
    "one odometer and balises": ("odometer_1", "balise"),
    "one odometer": ("odometer_1",),
}
READS = {
    "odometer_1": "w1",
    "odometer_2": "w2",
    "radar": "v",
    "gps": "p",
    "balise": "p",
    "pressure_sensor": "pc",
}


def structural_model(fitted: tuple[str, ...]) -> fdt.DiagnosisModel:
    """Equations of motion, brake and sensors: which variable and which fault stands in which.

    Args:
        fitted: names from `SENSORS`.
    """
    states = ["p", "dp", "v", "dv", "w1", "w2", "slip", "traction_force", "brake_force", "pc", "dpc"]
    relations: list[list[str]] = [
        ["dp", "v"],
        ["dv", "v", "traction_force", "brake_force", "gradient_force"],
        ["slip", "adhesion"],
        ["w1", "v", "slip", "wheel_1"],
        ["w2", "v", "slip", "wheel_2"],
        ["traction_force", "effort", "traction"],
        ["brake_force", "pc", "friction"],
        ["dpc", "pc", "demand", "cylinder"],
        *([f"y_{name}", READS[name], name] for name in fitted),
    ]
    faults = ["adhesion", "wheel_1", "wheel_2", "traction", "friction", "cylinder", *fitted]
    known = ["effort", "demand", "gradient_force", *(f"y_{name}" for name in fitted)]
    differential = [fdt.DiffConstraint(f"d{name}", name) for name in ("p", "v", "pc")]
    definition = {"type": "VarStruc", "x": states, "f": faults, "z": known, "rels": [*relations, *differential]}
    return fdt.DiagnosisModel(definition, name="Train")


def structural(fitted: tuple[str, ...]) -> dict[str, tuple[str, ...] | None]:
    """What the structure allows, by fault: None where it is not detectable, else those it cannot be told apart from.

    Args:
        fitted: names from `SENSORS`.
    """
    model = structural_model(fitted)
    detectable, _ = model.DetectabilityAnalysis()
    matrix = np.asarray(model.IsolabilityAnalysis(permute=False))
    faults = list(model.f)
    return {
        fault: tuple(other for j, other in enumerate(faults) if j != i and matrix[i, j] and other in detectable)
        if fault in detectable
        else None
        for i, fault in enumerate(faults)
    }


def comparison_table() -> str:
    """Our table and the structure, for sets of sensors."""
    lines = ["| sensors | fault | ours | structure allows |", "|---|---|---|---|"]
    for title, fitted in SETS.items():
        ours, theirs = isolability(fitted), structural(fitted)
        for fault, said in ours.items():
            allowed = theirs[fault]
            if said == () and allowed is not None and not set(allowed) - {"wheel_1", "wheel_2"}:
                continue  # isolated, and rightly
            lines.append(f"| {title} | {_words(fault)} | {_reported(said)} | {_reported(allowed)} |")
    return "\n".join(lines)


def _words(name: str) -> str:
    return name.replace("_", " ")


def _reported(others: tuple[str, ...] | None) -> str:
    if others is None:
        return "not detected"
    return "isolated" if not others else "one of it, " + ", ".join(_words(o) for o in others)


def main() -> None:
    """Print the table, or write it into the page."""
    print_tables(PAGE, {"isolability": comparison_table()})


if __name__ == "__main__":
    main()
