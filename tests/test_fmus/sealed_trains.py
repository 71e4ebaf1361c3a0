"""Trains as vendors seal them: no unit is declared, names say little, some numbers count the other way."""

from __future__ import annotations

import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

import fmus
from plant_models.hybrid import HybridSystem, input_signal, output_signal, parameter, state
from plant_models.hybrid.units import BASE_SYMBOLS, parse_unit


class _Sealed(HybridSystem):
    """``(1.08 m) dv = F - R(v)``; what goes in and out is named and scaled by `NAMES` and `SCALES`."""

    description = "sealed"
    source = "an example"
    states = (state("zz1", "1"), state("zz2", "1"))
    NAMES: Mapping[str, str]
    SCALES: Mapping[str, float]

    def _motion(self, x: Any, u: Any, p: Any) -> tuple[Any, Any]:
        mass = getattr(p, self.NAMES["mass"]) * self.SCALES["mass"]
        v = x.zz2
        resistance = mass * (0.01 * np.tanh(v / 0.01) + 3.6e-4 * v + 1.8e-5 * v * abs(v))
        return v, (getattr(u, self.NAMES["effort"]) * self.SCALES["effort"] - resistance) / (1.08 * mass)

    def flow(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        v, acceleration = self._motion(x, u, p)
        return {"zz1": v, "zz2": acceleration}

    def output(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        v, acceleration = self._motion(x, u, p)
        known = {"position": x.zz1, "speed": v, "wheel": v, "acceleration": acceleration}
        return {name: self.SCALES[what] * known[what] for what, name in self.NAMES.items() if what in known}


def sealed(title: str, names: Mapping[str, str], scales: Mapping[str, float], mass: float) -> HybridSystem:
    outputs = [name for what, name in names.items() if what not in ("effort", "mass")]
    declared = {
        "name": title,
        "NAMES": names,
        "SCALES": scales,
        "inputs": (input_signal(names["effort"], "1", 0.0),),
        "outputs": tuple(output_signal(name, "1", "") for name in outputs),
        "parameters": (parameter(names["mass"], "1", mass),),
    }
    made: HybridSystem = type(title, (_Sealed,), declared)()
    return made


GERMAN = sealed(
    "zug",
    {"effort": "Fsoll", "position": "sIst", "speed": "vIst", "wheel": "vRad", "acceleration": "aIst", "mass": "m_ges"},
    {"effort": 1e3, "position": 1.0, "speed": 3.6, "wheel": 3.6, "acceleration": 1.0, "mass": 1e3},
    84.0,
)
CRYPTIC = sealed(
    "box",
    {"effort": "u1", "acceleration": "y4", "wheel": "y2", "position": "y3", "speed": "y1", "mass": "p1"},
    {"effort": -1e3, "position": 1.0, "speed": 3.6, "wheel": 1.0 / 0.46, "acceleration": 1.0, "mass": 1e3},
    120.0,
)
TURNED = sealed(
    "channels",
    {"effort": "AO_001", "position": "AI_018", "speed": "AI_017", "acceleration": "AI_019", "mass": "K1"},
    {"effort": 1.0, "position": -1e-3, "speed": -1.0, "acceleration": -1.0, "mass": 1.0},
    80e3,
)


def declaring(system: HybridSystem, units: Mapping[str, tuple[int, str]], path: Path) -> Path:
    """The FMU (2.0) of a sealed train, which declares units.

    Args:
        system: of it. units: sign and unit by name of the variable. path: of the file.
    """
    with zipfile.ZipFile(fmus.cached_fmu(system, fmi_version=2)) as source, zipfile.ZipFile(path, "w") as target:
        for name in source.namelist():
            content = source.read(name)
            if name == "modelDescription.xml":
                content = _with_units(content.decode(), units).encode()
            target.writestr(name, content)
    return path


def _with_units(text: str, units: Mapping[str, tuple[int, str]]) -> str:
    definitions: dict[str, str] = {}
    for name, (sign, unit) in units.items():
        meant, own = parse_unit(unit), unit if sign > 0 else f"-{unit}"
        powers = "".join(f' {s}="{e}"' for s, e in zip(BASE_SYMBOLS, meant.exponents, strict=True))
        definitions[own] = f'<Unit name="{own}"><BaseUnit{powers} factor="{sign * meant.factor!r}"/></Unit>'
        before, variable, rest = text.partition(f'<ScalarVariable name="{name}" ')
        assert variable
        text = before + variable + rest.replace("<Real", f'<Real unit="{own}"', 1)
    return text.replace("</UnitDefinitions>", f"{''.join(definitions.values())}</UnitDefinitions>")
