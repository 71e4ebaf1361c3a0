"""The header of a baseline as plain data: to JSON and back, with every fault named. Knows no files."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, fields, replace
from pathlib import Path
from typing import Any

from cosim.baselines.baseline import Header
from cosim.baselines.delivery import DeliveredFmu
from cosim.baselines.model_identity import Identity
from cosim.baselines.recipe import Recipe
from cosim.comparison.tolerance import Tolerances
from cosim.errors import BaselineError, ComparisonError
from cosim.results.result import SignalInfo

FORMAT = "fmu-observer baseline"
VERSION = "1.1"
"""Of the layout: a file with another number before the point is refused, with a higher one behind it is read."""
DEFAULTS: Mapping[str, Any] = {
    "parameters": {},
    "options": {},
    "preset": None,
    "file": "",
    "sha256": "",
    "display_unit": None,
    "declared_unit": None,
    "description": "",
    "delivery": None,
}


def header_data(header: Header, folder: Path) -> dict[str, Any]:
    """Plain data of a header for a file in `folder`; no absolute paths, no time of day.

    Args:
        header: what a baseline says of itself.
    """
    return {
        "format": FORMAT,
        "version": header.version,
        "title": header.title,
        "run": header.recipe.to_data(folder),
        "span": dict(header.span),
        "components": [_component_data(component) for component in header.components],
        "signals": [_short(asdict(signal)) for signal in header.signals],
        "tolerances": _tolerances_data(header.tolerances),
        "selection": None if header.selection is None else list(header.selection),
        "every": header.every,
        "rows": header.rows,
        "events": header.events,
        "digest": header.digest,
        "versions": dict(header.versions),
    }


def _component_data(component: Identity) -> dict[str, Any]:
    delivery = None if component.delivery is None else component.delivery.to_data()
    return _short({**asdict(replace(component, delivery=None)), "delivery": delivery})


def _short(data: dict[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in data.items() if key not in DEFAULTS or value != DEFAULTS[key]}


def _tolerances_data(tolerances: Tolerances) -> dict[str, Any]:
    """Plain data of tolerances."""
    return {
        "default": asdict(tolerances.default),
        "signals": {name: asdict(tolerance) for name, tolerance in tolerances.by_signal.items()},
        "ignore": list(tolerances.ignore),
    }


def _tolerances_from(data: Mapping[str, Any]) -> Tolerances:
    """Tolerances from plain data.

    Raises:
        ComparisonError: they cannot be.
    """
    return Tolerances.of(data.get("default"), data.get("signals"), data.get("ignore", ()))


def header_from(data: Any, folder: Path) -> Header:
    """The header that `header_data` made plain.

    Args:
        data: plain data, as from a JSON file.
        folder: folder of the file; paths are relative to it.

    Raises:
        BaselineError: it is none, of another version, or something is missing; without the name of the file.
    """
    if not isinstance(data, Mapping) or data.get("format") != FORMAT:
        raise BaselineError(f'not a baseline: expected a JSON object with "format": "{FORMAT}".')
    version = str(data.get("version"))
    if version.partition(".")[0] != VERSION.partition(".")[0]:
        raise BaselineError(
            f"version {version} of the layout; this package reads version {VERSION}. "
            "Use the package that wrote it, or make the baseline again."
        )
    try:
        return _header(data, folder, version)
    except KeyError as error:
        raise BaselineError(f"the key {error} is missing.") from error
    except (TypeError, ValueError, AttributeError) as error:
        if isinstance(error, BaselineError | ComparisonError):
            raise BaselineError(str(error)) from error
        raise BaselineError(f"an entry is not what it should be: {error}.") from error


def _header(data: Mapping[str, Any], folder: Path, version: str) -> Header:
    return Header(
        title=str(data["title"]),
        recipe=Recipe.from_data(data["run"], folder),
        span={key: float(data["span"][key]) for key in ("start", "stop", "step")},
        components=[_component(entry) for entry in data["components"]],
        signals=[_known(SignalInfo, entry) for entry in data["signals"]],
        tolerances=_tolerances_from(data["tolerances"]),
        selection=None if data.get("selection") is None else [str(pattern) for pattern in data["selection"]],
        every=data.get("every"),
        rows=int(data["rows"]),
        events=data.get("events"),
        digest=str(data["digest"]),
        versions=dict(data.get("versions", {})),
        version=version,
    )


def _component(entry: Mapping[str, Any]) -> Identity:
    found: Identity = _known(Identity, entry)
    stated = entry.get("delivery")
    return found if stated is None else replace(found, delivery=DeliveredFmu.from_data(stated))


def _known(kind: Any, entry: Mapping[str, Any]) -> Any:
    """An entry, without keys that a newer version may have added."""
    names = {field.name for field in fields(kind)}
    return kind(**{key: value for key, value in entry.items() if key in names})


def is_newer(version: str) -> bool:
    """Whether a header was written by a newer version of the same layout.

    Args:
        version: of the layout that the header names.
    """
    return _numbers(version) > _numbers(VERSION)


def _numbers(version: str) -> tuple[int, ...]:
    return tuple(int(part) if part.isdigit() else 0 for part in version.split("."))
