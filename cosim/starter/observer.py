"""The starter of an observer: the FMU beside the shipped locomotive, with driver, odometer and balises."""

from __future__ import annotations

from typing import Any

from cosim.starter.guess import Guess
from cosim.starter.look import Look
from cosim.starter.starter_roles import ObserverRoles
from cosim.starter.toml_lines import GuessedLink, guessed, one_line
from cosim.starter.train_starter import train_times


def observer_beside(look: Look, roles: ObserverRoles) -> dict[str, Any]:
    """What the template of this starter inserts.

    Args:
        look: what the FMU says.
        roles: what its inputs were guessed to be.

    Returns:
        Values by name.
    """
    stop, step, source = train_times(look)
    links = [
        GuessedLink("driver.effort", ["plant.effort"]),
        GuessedLink("plant.wheel_speed", ["odometer.wheel_speed"]),
        GuessedLink("odometer.reading", ["driver.odometer"]),
        *_told("driver.effort", roles.effort),
        *_told("odometer.reading", roles.odometer),
    ]
    title = f"{one_line(look.path.name)} beside the shipped locomotive"
    return {"title": title, "stop": stop, "step": step, "source": source, "links": links}


def _told(source: str, found: Guess | None) -> list[GuessedLink]:
    if found is None:
        return []
    factor = None if found.signal.readable else 1.0
    return [GuessedLink(source, [f"observer.{found.signal.name}"], guessed(found), factor)]
