"""Tolerances on the command line: the options that the commands share, and what they ask for. Reads a tolerance
file.
"""

from __future__ import annotations

import argparse
import tomllib
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from cosim.comparison.tolerance import KEYS, Tolerance, Tolerances, tolerance
from cosim.errors import ComparisonError, nearest
from cosim.scenario.toml_file import read_toml
from fmus.cli.commands import argument, repeated
from fmus.cli.parsers import no_number
from plant_models.meant_number import meant_number

Asked = tuple[dict[str, Any], dict[str, Any], list[str]]
"""Keys of the default tolerance, tolerances by signal or pattern, and what to ignore."""
_FILE_TABLES = ("default", "signals", "ignore")
_BY_SIGNAL_EXAMPLE = "'train.*=1e-3', or 'train.speed={absolute = 0.01}'"


TOLERANCES = (
    argument("--rtol", type=float, metavar="SHARE", help="in value, a share of the range of the reference"),
    argument("--atol", type=float, metavar="SIZE", help="in value, in the SI unit of each signal"),
    argument("--ttol", type=float, metavar="SECONDS", help="in time [s]"),
    argument("--tolerances", metavar="FILE", help="tolerances by signal, a TOML file (end of 'cosim compare --help')"),
    repeated(
        "--set-tolerance",
        "SIGNAL=VALUE",
        f"of one signal or pattern: {_BY_SIGNAL_EXAMPLE}",
        dest="tolerance_settings",
    ),
    repeated("--ignore", "PATTERN", "signals not to compare"),
)
"""Arguments of tolerances."""


def asked_tolerances(options: argparse.Namespace) -> Asked:
    """What the command line asks for: keys of the default, tolerances by signal, patterns to ignore.

    Args:
        options: of the command line.

    Raises:
        ComparisonError: a tolerance that cannot be, or a file that cannot be read.
    """
    default, by_signal, ignore = _read_file(Path(options.tolerances)) if options.tolerances else ({}, {}, [])
    stated = {"relative": options.rtol, "absolute": options.atol, "time": options.ttol}
    default |= {key: value for key, value in stated.items() if value is not None}
    settings = dict(map(_setting, options.tolerance_settings))
    by_signal = settings | {name: value for name, value in by_signal.items() if name not in settings}
    base = tolerance(default, Tolerance())
    for name, value in by_signal.items():
        _checked(name, value, base)
    return default, by_signal, [*options.ignore, *ignore]


def chosen_tolerances(options: argparse.Namespace, asked: Asked, stored: Tolerances) -> Tolerances:
    """What is asked for, over what is stored with a baseline; new defaults replace its tolerances by signal in the same
    keys.

    Args:
        options: of the command. asked: from `asked_tolerances`. stored: of the baseline, or the usual ones.
    """
    default, by_signal, ignore = asked
    base = tolerance(default, stored.default)
    changed = {key: default[key] for key in ("relative", "absolute", "time") if _stated(options, key)}
    kept = {name: replace(old, **changed) for name, old in stored.by_signal.items() if name not in by_signal}
    return Tolerances(
        base, {name: tolerance(v, base) for name, v in by_signal.items()} | kept, (*ignore, *stored.ignore)
    )


def _stated(options: argparse.Namespace, key: str) -> bool:
    return {"relative": options.rtol, "absolute": options.atol, "time": options.ttol}[key] is not None


def _checked(name: str, value: Any, base: Tolerance) -> Tolerance:
    try:
        return tolerance(value, base)
    except (ComparisonError, TypeError) as error:
        raise ComparisonError(
            f"Tolerance of {name!r}: {error} Give a number, or a table of {', '.join(KEYS)}."
        ) from error


def _setting(text: str) -> tuple[str, Any]:
    """``pattern=value``, the value a number or a table of TOML."""
    name, sign, value = text.partition("=")
    try:
        if sign and name.strip():
            return name.strip(), tomllib.loads(f"value = {value.strip()}")["value"]
    except tomllib.TOMLDecodeError:
        pass
    if name.strip() and meant_number(value):
        raise ComparisonError(f"--set-tolerance {name.strip()}: {no_number(value.strip())}.")
    raise ComparisonError(f"--set-tolerance {text!r}: expected SIGNAL=VALUE, for instance {_BY_SIGNAL_EXAMPLE}.")


def _read_file(path: Path) -> tuple[dict[str, Any], dict[str, Any], list[str]]:
    """Default, tolerances by signal, and patterns to ignore of a tolerance file."""
    try:
        data = read_toml(path)
    except OSError as error:
        raise ComparisonError(f"Tolerance file {path} cannot be read: {error.strerror or error}.") from error
    except ValueError as error:
        raise ComparisonError(f"{path}: not readable as TOML: {error}") from error
    for key in data:
        if key not in _FILE_TABLES:
            raise ComparisonError(f"{path}: unknown key {key!r}; {nearest(key, _FILE_TABLES)}")
    default, signals, ignore = data.get("default", {}), data.get("signals", {}), data.get("ignore", [])
    if not isinstance(default, Mapping) or not isinstance(signals, Mapping):
        raise ComparisonError(f"{path}: 'default' and 'signals' are tables, [default] and [signals.\"train.*\"].")
    if not isinstance(ignore, list) or not all(isinstance(entry, str) for entry in ignore):
        raise ComparisonError(f"{path}: 'ignore' is a list of names and patterns.")
    return dict(default), dict(signals), ignore
