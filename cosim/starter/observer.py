"""The starter of an observer: the FMU beside the shipped locomotive, with driver, odometer and balises."""

from __future__ import annotations

from cosim.starter.guess import Guess
from cosim.starter.look import Look
from cosim.starter.roles import ObserverRoles
from cosim.starter.toml_lines import Link, entry, guessed, one_line
from cosim.starter.train import OBSERVER, expectations, train_times


def observer_beside(look: Look, fmu: str, roles: ObserverRoles) -> list[str]:
    """The lines of the scenario.

    Args:
        look: what the FMU says. fmu: its path in the file. roles: what its inputs were guessed to be.
    """
    stop, step, source = train_times(look)
    links = [
        Link("driver.effort", ["plant.effort"]),
        Link("plant.wheel_speed", ["odometer.wheel_speed"]),
        Link("odometer.reading", ["driver.odometer"]),
        *_told("driver.effort", roles.effort),
        *_told("odometer.reading", roles.odometer),
    ]
    return [
        entry("title", f"{one_line(look.path.name)} beside the shipped locomotive"),
        f"{entry('stop', stop)}  # [s]",
        f"{entry('step', step)}  # [s] {source}",
        "",
        "connections = [",
        *(line for link in links for line in link.lines()),
        "]",
        "",
        "[components.plant]",
        'model = "locomotive"',
        "",
        "[components.driver]",
        'model = "driver"',
        "",
        "[components.odometer]",
        'model = "odometer"',
        "",
        f"[components.{OBSERVER}]",
        entry("fmu", fmu),
        "",
        "[balises]",
        'position = "plant.position"',
        'speed = "plant.speed"',
        'odometer = "odometer.reading"',
        'layout = "aperiodic"',
        "min_gap = 0.1  # [s]",
        "max_gap = 0.5  # [s]",
        "dropout_fraction = 0.0",
        "",
        "[report]",
        f'observers = ["{OBSERVER}"]',
        'true_position = "plant.position"',
        'true_speed = "plant.speed"',
        'true_slip = "plant.slip"',
        'true_adhesion_force = "plant.adhesion_force"',
        'odometer = "odometer.reading"',
        'speed_reference = "driver.speed_reference"',
        "evaluate_after = 5.0  # [s] errors count from here on",
        "",
        *expectations(),
    ]


def _told(source: str, found: Guess | None) -> list[Link]:
    if found is None:
        return []
    factor = None if found.signal.readable else 1.0
    return [Link(source, [f"{OBSERVER}.{found.signal.name}"], guessed(found), factor)]
