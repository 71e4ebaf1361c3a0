"""The run of the mutation study: the shipped locomotive under a given effort, and balises on its way.

Beside the locomotive there are two small helpers: what commands the effort, and what is told of balises. All three are
native FMUs, so the compiled stepper runs them.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

import numpy as np

import fmus
import plant_models
from cosim import Result, Scenario
from plant_models.hybrid import HybridSystem, TriggeredEvent, input_signal, memory, output_signal, parameter
from plant_models.railway.vehicle.locomotive import Locomotive

STOP, STEP = 12.0, 0.01  # [s]; the FMU's own step is 0.5 ms
SPEED = 8.0  # [m/s] at start
INSTANTS = (0.0, 1.0, 3.0, 4.5, 6.0, 8.0)  # [s] at which the effort steps; on the grids of 5, 10 and 20 ms
EFFORTS = (40e3, 90e3, 0.0, -40e3, 60e3, -100e3)  # [N]
BALISES = (15.0, 40.0, 70.0, 75.0)  # [m]
TRACK = {
    "zone_from": [1.5, 8.5, 70.0],  # [s]; the third zone and the last gradient point are never reached
    "zone_to": [2.5, 10.0, 80.0],
    "gradient_position": [0.0, 20.0, 50.0, 1e9],  # [m]
    "gradient": [0.002, 0.004, -0.003, 0.001],
}
PARAMETERS: Mapping[str, Any] = {"train_speed": SPEED, "wheel_rate": SPEED / 0.575, **TRACK}


class EffortProfile(HybridSystem):
    """An effort that steps at given instants and is constant between them."""

    name = "effort_profile"
    description = "Effort in steps"
    source = "the mutation study"
    internal_step = STEP
    inputs = (input_signal("unused", "1"),)
    outputs = (output_signal("effort", "N", "Effort at the wheel rim"),)
    parameters = (
        parameter("instant", "s", INSTANTS, "Instants of the steps, ascending", size=len(INSTANTS)),
        parameter("level", "N", EFFORTS, "Effort from each instant on", size=len(EFFORTS)),
    )

    def output(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        rise = [p.level[k] - (p.level[k - 1] if k else 0.0) for k in range(len(INSTANTS))]
        return {"effort": sum(np.where(t > p.instant[k] - 1e-6, rise[k], 0.0) for k in range(len(INSTANTS)))}


class BaliseRegister(HybridSystem):
    """Keeps the position told by the last balise."""

    name = "balise_register"
    description = "Position of the last balise"
    source = "the mutation study"
    internal_step = STEP
    states = (memory("last_position", "m", 0.0, "Position told last"),)
    inputs = (input_signal("unused", "1"),)
    outputs = (output_signal("last_balise", "m", "Position told last", variability="discrete"),)
    events = (TriggeredEvent("balise", (input_signal("balise_position", "m", variability="discrete"),)),)

    def jump(self, event: str, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"last_position": u.balise_position}

    def output(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"last_balise": x.last_position}


HELPERS: Mapping[str, HybridSystem] = {"profile": EffortProfile(), "register": BaliseRegister()}
ORDER = ("profile", "train", "register")
LOCOMOTIVE = Locomotive()


@dataclass(frozen=True)
class Conditions:
    """How the run is made; the defaults are those of the baseline.

    Args:
        train: the plant. parameters: its start values that are other than in the baseline. instants: of the effort [s].
        balises: positions [m]. telegrams: further keys of the balises. step: communication step [s]. order: of the
        components.
        fmi_version: 2 or 3. backend: ``fmu`` or ``block``. stepper: ``auto``, ``python`` or ``compiled``.
    """

    train: HybridSystem = LOCOMOTIVE
    parameters: Mapping[str, Any] = field(default_factory=dict)
    instants: Sequence[float] = INSTANTS
    balises: Sequence[float] = BALISES
    telegrams: Mapping[str, Any] = field(default_factory=dict)
    step: float = STEP
    order: Sequence[str] = ORDER
    fmi_version: int = 3
    backend: str = "fmu"
    stepper: str = "auto"

    def run(self) -> Result:
        """Run, without a word.

        Raises:
            RuntimeError: the run failed.
        """
        systems = {**HELPERS, "train": self.train}
        with _known(systems.values()):
            result = self._scenario(systems).run(warn=_silent).result
        if result.failure is not None:
            raise RuntimeError(result.failure)
        return result

    def _scenario(self, systems: Mapping[str, HybridSystem]) -> Scenario:
        parameters = {
            "profile": {"instant": list(self.instants)},
            "train": {**PARAMETERS, **self.parameters},
            "register": {},
        }
        made = Scenario(stop=STOP, step=self.step)
        for name in self.order:
            made.add(name, **self._table(systems[name]), parameters=parameters[name])
        made.connect("profile.effort -> train.effort")
        made.balises(
            position="train.position",
            speed="train.speed",
            layout="positions",
            positions=list(self.balises),
            **self.telegrams,
        )
        # Jacobi: an effort counts from its own instant on. In sequence it would count from one communication step
        # before.
        return made.master(algorithm="jacobi", stepper=self.stepper)

    def _table(self, system: HybridSystem) -> dict[str, Any]:
        if self.backend == "fmu":
            return {"fmu": str(fmus.cached_fmu(system, 2 if self.fmi_version == 2 else 3))}
        return {"model": system.name, "as": f"block{self.fmi_version}"}


@contextmanager
def _known(systems: Iterable[HybridSystem]) -> Iterator[None]:
    """Let scenarios find the systems by name, as blocks."""
    plant_models.PLANTS.update({system.name: type(system) for system in systems})
    try:
        yield
    finally:
        for system in systems:
            del plant_models.PLANTS[system.name]


def _silent(_warning: str) -> None:
    """Warnings are no part of the study."""
