"""Observers of a train to begin with, and when to take which: declared here alone. Standard library only."""

from __future__ import annotations

from collections.abc import Mapping

RECOMMENDED: Mapping[str, str] = {
    "quasi_lpv_uio": "effort, an odometer whose wheel may jam or spin, balises at any distance; mass and Davis "
    "coefficients known",
    "differentiator_cdo": "effort, a fast odometer, a balise every half second at all times: slip does not bias the "
    "speed",
    "odometer_reset": "an odometer that can be trusted and balises, no effort: what any observer has to beat",
    "balise_odometer_ekf": "effort, an odometer and balises; it says how uncertain position and speed are",
    "takagi_sugeno_cdo": "effort, an odometer and balises; preset long_gaps is stable at any gap",
}
"""By name, in the order in which they are tried: what one has who takes it. See docs/guide/choosing_an_observer.md."""

EXHIBITS: Mapping[str, str] = {
    "augmented_high_gain_cdo:gps": "as published, for satellite positions and a gradient that is known",
}
"""Presets of observers of a train that are close to the best nowhere in docs/studies/choosing.py, and what each is for;
those to begin with are for trains that the study does not have.
"""
