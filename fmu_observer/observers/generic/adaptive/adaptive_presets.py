"""Presets of the adaptive observers: as published, and with a limit of the adaptation gain. Data only."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

ADAPTIVE_PRESETS: Mapping[str, Mapping[str, Any]] = {
    "as_published": {"mu": 10.0, "forgetting": 1.0, "gain_floor": 0.0, "least_excitation": 0.0},
    # sin and cos of amplitude one through the observer at mu = 10 give 8e-4 and 2e-6
    "repaired": {"mu": 10.0, "forgetting": 1.0, "gain_floor": 1e-7, "least_excitation": 1e-7},
}
