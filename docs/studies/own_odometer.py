"""Train observers beside the odometer that they use: how far each is off, and how much worse than the odometer.

``python docs/studies/own_odometer.py`` prints the table of docs/theses/own_odometer.md, with ``--write`` it puts it
there; that takes half a minute of CPU. Each situation is one run with all observers in it.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent))

from page_tables import write_table
from turned_faults import turned

from cosim import Scenario
from fmu_observer import OBSERVERS
from plant_models.hybrid import HybridSystem

PAGE = Path(__file__).parents[1] / "theses" / "own_odometer.md"
RESET = "odometer_reset"
PERIOD = 0.1  # between two readings [s]
TOP = 20.0  # speed of the journeys [m/s]
JOURNEY = ((0.0, 50.0, 120.0, 150.0, 190.0, 240.0, 290.0, 320.0), (0.0, TOP, TOP, 0.0, 0.0, TOP, TOP, 0.0))
STOP = 330.0  # [s]

MARGIN = 0.5 * TOP * PERIOD
"""What the age of a reading may cost, half a period at the top speed [m]: less is no difference between observers."""

# observers by label: name and preset; train observers that are not named here stand with their own preset
_LABELLED: Mapping[str, tuple[str, str | None]] = {
    "odometer_reset": (RESET, None),
    "balise_odometer_ekf": ("balise_odometer_ekf", None),
    "ekf_tuned": ("balise_odometer_ekf", "tuned"),
    "quasi_lpv_uio": ("quasi_lpv_uio", None),
    "discrete_measurement": ("discrete_measurement_observer", None),
    "continuous_discrete": ("continuous_discrete_observer", None),
    "sugeno_long_gaps": ("takagi_sugeno_cdo", "long_gaps"),
    "augmented_trusted": ("augmented_takagi_sugeno_cdo", "odometer_trusted"),
    "wheel_radius": ("adaptive_wheel_radius", None),
    "davis": ("adaptive_davis", None),
    "moving_horizon": ("balise_moving_horizon", None),
    "decaying_holes": ("decaying_innovation_cdo", "balise_holes"),
    "dynamic_holes": ("dynamic_gain_cdo", "balise_holes"),
    "adaptive_gain": ("adaptive_gain_cdo", None),
    "discrete_uio": ("discrete_uio", None),
    "sugeno_repaired": ("takagi_sugeno_cdo", "repaired"),
    "multirate": ("multirate_cdo", None),
    "differentiator": ("differentiator_cdo", None),
}
EXCEPT: Mapping[str, str] = {
    "davis": "believes its effort and learns the resistance: a slope and a wrong mass are none",
    "ekf_tuned": "made for wheels that creep by a tenth of the speed: it takes a wrong mass for creep",
    "decaying_holes": "follows the effort: a wrong mass and a slope are its error until the next balise",
    "dynamic_holes": "follows the effort: a wrong mass and a slope are its error until the next balise",
    "adaptive_gain": "follows the effort and its balises, whose gaps must be those expected",
    "discrete_uio": "gains for balises every half second",
    "sugeno_repaired": "gains for balises every half second",
    "multirate": "gains for balises every half second",
    "differentiator": "gains for balises every half second",
    "interval_odometry": "its middle lies between all that is possible, as far for the wheel that creeps as for none",
}
"""Observers that cannot be as good as their odometer by what they are, with the reason."""
NOT_HERE: Mapping[str, str] = {
    "delayed_train_observer": "hears packets of a network and no odometer",
    "augmented_high_gain_cdo": "its wheel observer gives a force, no speed; gains for balises every half second",
    "stopping_uio": "hears a speed every 1 to 2 ms",
}
"""Train observers that stand in no run of this study, with the reason."""
_NAMED = {*NOT_HERE, *(name for name, _ in _LABELLED.values())}
EVALUATED: Mapping[str, tuple[str, str | None]] = {
    **_LABELLED,
    **{name: (name, None) for name in OBSERVERS if OBSERVERS.room(name).endswith(".train") and name not in _NAMED},
}


@dataclass(frozen=True)
class Situation:
    """A journey.

    Attributes:
        name: of the row. right: whether the odometer is right. mass: of the train [kg]. reported: share of the mass
            that observers believe. drag: share of the resistance that they believe. spacing: of balises [m]. slope: its
            sections, position [m] and gradient. noise: of a reading [m/s]. loss: share of readings that is lost.
        faults: onset [s], length [s], depth, kind (-1 jam, 1 skid). turned: whether they act with the other sign.
    """

    name: str
    right: bool = True
    mass: float = 400e3
    reported: float = 1.0
    drag: float = 1.0
    spacing: float = 500.0
    slope: Sequence[tuple[float, float]] = field(default=((0.0, 0.0),))
    noise: float = 0.0
    loss: float = 0.0
    faults: Sequence[tuple[float, float, float, float]] = ()
    turned: bool = False


UP, DOWN = ((0.0, 0.0), (1000.0, 0.006)), ((0.0, 0.0), (1000.0, -0.006))
HILLS = ((0.0, 0.0), (800.0, 0.008), (2000.0, -0.008), (3000.0, 0.004))
FAULTS = ((125.0, 3.0, 1.0, -1.0), (210.0, 3.0, 0.3, 1.0), (295.0, 2.0, 0.5, -1.0))
SITUATIONS = (
    Situation("60 t, balises every 300 m", mass=60e3, spacing=300.0),
    Situation("400 t, level"),
    Situation("400 t, 6 per mille up", slope=UP),
    Situation("400 t, 6 per mille down", slope=DOWN),
    Situation("400 t, told 20 % more mass", reported=1.2),
    Situation("400 t, told 20 % less mass", reported=0.8),
    Situation("400 t, 6 per mille up, told 20 % more", reported=1.2, slope=UP),
    Situation("400 t, told half of the resistance", drag=0.5),
    Situation("2000 t, hills of 8 per mille", mass=2000e3, slope=HILLS),
    Situation("balises every 0.3 s", spacing=6.0),
    Situation("no balise for 199 s", spacing=1e4),
    Situation("noise of 0.05 m/s", noise=0.05),
    Situation("noise of 0.1 m/s, hills, told 10 % less", noise=0.1, reported=0.9, slope=HILLS),
    Situation("three readings in ten lost", right=False, loss=0.3),
    Situation("jams and skids", right=False, faults=FAULTS),
    Situation("the same of the other sign", right=False, faults=FAULTS, turned=True),
)


def scenario_of(s: Situation, labels: Iterable[str]) -> Scenario:
    """One run: train, driver, odometer and all observers.

    Args:
        s: the situation. labels: of the observers.
    """
    made = Scenario(stop=STOP, step=PERIOD, certificates="ignore")
    made.set("master.events", "local")
    davis = {"davis_a": 0.02 * s.mass, "davis_b": 6e-4 * s.mass, "davis_c": 1.2e-5 * s.mass}
    ends = [(1e9 + i, 0.0) for i in range(4 - len(s.slope))]
    places, gradients = zip(*s.slope, *ends, strict=True)
    own = {"traction_coefficient": 1.0, "brake_coefficient": 1.0, "fitted_to": 200.0}
    track = {"gradient_position": list(places), "gradient": list(gradients)}
    made.add("train", model="longitudinal_train", parameters={"mass": s.mass, **davis, **own, **track})
    follows = {"effort_limit": s.mass, "power_limit": 20.0 * s.mass, "holding_effort": 0.7 * s.mass}
    gains = {"proportional_gain": 0.8 * s.mass, "integral_gain": 0.1 * s.mass}
    profile = {"profile_time": list(JOURNEY[0]), "profile_speed": list(JOURNEY[1])}
    made.add("driver", model="driver", parameters={**follows, **gains, **profile})
    made.connect("driver.effort -> train.effort", "train.speed -> driver.odometer")
    made.add("odometer", model="odometer", parameters={"sample_period": PERIOD, "noise_std": s.noise})
    if s.faults:
        onset, length, depth, kind = (list(column) for column in zip(*s.faults, strict=True))
        stated = {"fault_onset": onset, "fault_length": length, "fault_depth": depth, "fault_kind": kind}
        made.add(
            "wheel", model="wheel_fault", options={"cause": "stated", "fault_count": len(onset)}, parameters=stated
        )
        made.connect("driver.effort -> wheel.effort", "train.wheel_speed -> wheel.speed")
    made.connect(f"{'wheel' if s.faults else 'train'}.wheel_speed -> odometer.wheel_speed")
    if s.loss:
        made.network(nodes={"odometer": ["odometer.reading"]}, period=PERIOD, loss_fraction=s.loss)
    for label in labels:
        _add_observer(made, label, s, davis)
    place = {"position": "train.position", "speed": "train.speed", "odometer": "odometer.reading"}
    made.balises(layout="spacing", spacing=s.spacing, track_start=0.0, track_end=1e5, **place)
    return turned(made) if s.turned else made


def _add_observer(made: Scenario, label: str, s: Situation, davis: Mapping[str, float]) -> None:
    name, preset = EVALUATED[label]
    system: HybridSystem = OBSERVERS[name]()
    reported = {"mass": s.reported * s.mass, "odometer_period": PERIOD, "estimated_speed": 0.0, "odometer_speed": 0.0}
    reported |= {key: s.drag * value for key, value in davis.items()}
    known = {signal.name for signal in (*system.parameter_signals, *system.states)}
    chosen: dict[str, Any] = {} if preset is None else {"preset": preset}
    made.add(label, observer=name, parameters={k: v for k, v in reported.items() if k in known}, **chosen)
    made.connect(f"odometer.reading -> {label}.odometer")
    if any(signal.name == "effort" for signal in system.inputs):
        made.connect(f"driver.effort -> {label}.effort")


def errors(s: Situation, labels: Sequence[str] = tuple(EVALUATED)) -> dict[str, float]:
    """Largest position error by observer [m].

    Args:
        s: the situation. labels: of the observers.
    """
    run = scenario_of(s, labels).run(warn=lambda _text: None)
    with np.errstate(all="ignore"):
        return {label: float(np.abs(run[f"{label}.position"] - run["train.position"]).max()) for label in labels}


def table() -> str:
    """The table: the odometer's own error, and that of the others as a multiple of it."""
    heading = ["", f"`{RESET}` [m]", *(f"`{label}`" for label in EVALUATED if label != RESET)]
    lines = ["| " + " | ".join(heading) + " |", "|" + " --- |" * len(heading)]
    for situation in SITUATIONS:
        found = errors(situation)
        own = found.pop(RESET)
        cells = [f"{value / own:.2f}" if value < 1e3 * own else "diverges" for value in found.values()]
        lines.append("| " + " | ".join([situation.name, f"{own:.2f}", *cells]) + " |")
        print(lines[-1], flush=True)
    return "\n".join(lines)


def main(words: Sequence[str]) -> None:
    """Print the table; with ``--write`` put it on the page.

    Args:
        words: of the command line.
    """
    made = table()
    if "--write" in words:
        write_table(PAGE, "ratios", made)


if __name__ == "__main__":
    main(sys.argv[1:])
