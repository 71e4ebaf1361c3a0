"""What the commands that take a scenario share: loading with overrides, settings, a progress bar."""

from __future__ import annotations

import argparse
import tomllib
from collections.abc import Sequence
from typing import Any

from cosim.components.recording_data import Chosen, Interpolation
from cosim.errors import ScenarioError
from cosim.scenario.override import CASE
from cosim.simulation.scenario import Scenario
from fmus.cli.parsers import no_number
from fmus.cli.progress import SIMULATED_TIME, ProgressBar
from plant_models.meant_number import meant_number


def load_scenario(options: argparse.Namespace, loaded: Scenario | None = None) -> Scenario:
    """The scenario that the arguments name, with its overrides.

    Args:
        options: of the command line. loaded: to be changed in place of the one that is named; None for that.

    Raises:
        ScenarioError: there is none, or an override is not ``NAME=VALUE``.
    """
    scenario = loaded or Scenario.load(
        options.scenario, strict=getattr(options, "strict", False), trust=getattr(options, "trust", False)
    )
    stated = [parse_setting(setting) for setting in options.settings]
    # what is said by name wins over a case
    return scenario.with_settings(dict(sorted(stated, key=lambda entry: entry[0] != CASE)))


def simulated_time_bar(*, silent: bool) -> ProgressBar:
    """A progress bar in simulated seconds.

    Args:
        silent: whether it stays away in any case.
    """
    return ProgressBar("simulated second", silent=silent, shape=SIMULATED_TIME)


def parse_setting(text: str) -> tuple[str, Any]:
    """``name=value`` with the value read as a TOML value where it is one, else as text.

    Raises:
        ScenarioError: there is no ``=``.
    """
    name, sign, value = text.partition("=")
    if not sign or not name.strip():
        raise ScenarioError(f"--set {text!r}: expected NAME=VALUE, for instance --set locomotive.mass=80e3.")
    try:
        return name.strip(), tomllib.loads(f"value = {value.strip()}")["value"]
    except tomllib.TOMLDecodeError:
        return name.strip(), value.strip()


def read_setting(option: str, text: str) -> tuple[str, Any]:
    """``name=value`` as `parse_setting` reads it, where a value that means a number is one.

    Args:
        option: in which it was typed, for messages. text: as it was typed.

    Raises:
        ScenarioError: there is no ``=``, or a number has a decimal comma or a unit.
    """
    name, value = parse_setting(text)
    if isinstance(value, str) and meant_number(value):
        raise ScenarioError(f"{option} {name}: {no_number(value)}.")
    return name, value


def between_samples(texts: Sequence[str]) -> Chosen:
    """What ``--between`` says: of all inputs, or of some.

    Args:
        texts: ``hold``, ``linear``, or ``name=hold``.

    Raises:
        ScenarioError: a text is none of these.
    """
    said: dict[str, Interpolation] = {}
    for text in texts:
        name, sign, kind = text.rpartition("=")
        if kind not in ("hold", "linear") or (not sign and len(texts) > 1):
            raise ScenarioError(f"--between {text}: expected hold or linear for all inputs, or NAME=hold for each.")
        if not sign:
            return kind  # type: ignore[return-value] # one of the two
        said[name] = kind  # type: ignore[assignment] # one of the two
    return said or None


def setting_number(option: str, name: str, value: Any) -> float:
    """The value of a setting as a number.

    Args:
        option: in which it was given. name: of the setting. value: as `parse_setting` read it.

    Raises:
        ScenarioError: it is none.
    """
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise ScenarioError(f"{option} {name}: {no_number(str(value))}.")
    return float(value)
