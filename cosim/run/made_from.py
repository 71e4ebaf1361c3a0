"""Writing ``made_from``: the scenario, the files it uses and the manifest. Touches only the results folder it is
given.
"""

from __future__ import annotations

import json
import shutil
import tempfile
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from datetime import UTC, datetime
from importlib.machinery import all_suffixes
from pathlib import Path
from typing import Any

import tomli_w

from cosim.errors import OutputError
from cosim.results.results_folder import check_writable
from cosim.run.results_manifest import FILES, FORMAT, MADE_FROM, MANIFEST, SCENARIO, sha256
from cosim.scenario.origin import ForeignFile, Origin, stamp
from cosim.scenario.paths import map_paths
from cosim.scenario.toml_values import plain
from fmus.tables.plain_data import jsonable
from fmus.versions import versions
from plant_models.code_trust import remember
from plant_models.hybrid.noise import RUN_SEED
from plant_models.left_behind import owned
from plant_models.user_file import names_code

_FILES_UP_TO = 50e6
"""Files of others up to this size are copied into the results [bytes]."""

HEADER = (
    "# The scenario of these results, with what it included and what was overridden. cosim rerun runs it again.\n\n"
)
_UNHASHED = ("summary", "messages", "report", "calls")
_Seal = Callable[[Mapping[str, Path], Mapping[str, Any]], None]


@contextmanager
def renewed(directory: str | Path, origin: Origin | None, files_up_to: float = _FILES_UP_TO) -> Iterator[_Seal]:
    """``made_from`` is exchanged with the results: prepared before, put in place after, the former one back on a
    failure.

    Args:
        directory: the results folder. origin: of the results; None where it is not known: a former ``made_from`` goes.
        files_up_to: files of others up to this size are copied [bytes].

    Yields:
        A function to be called once the results are written, with their paths by kind and their summary.

    Raises:
        OutputError: the folder cannot be written.
    """
    folder = check_writable(directory)
    place = folder / MADE_FROM
    if place.exists() and not (place / MANIFEST).is_file():
        what = f"its {MADE_FROM} is not that of a run"
        raise OutputError(f"Results cannot be written to {folder}: {what}. Choose another output folder.")
    try:
        with tempfile.TemporaryDirectory(dir=folder, prefix=owned(f".{MADE_FROM}-", folder)) as scratch:
            new, former = Path(scratch) / "new", Path(scratch) / "former"
            manifest = None if origin is None else _prepare(origin, new, files_up_to)
            if place.exists():
                place.rename(former)
            try:
                yield lambda paths, summary: None if manifest is None else _seal(manifest, new, paths, summary)
                if manifest is not None:
                    new.rename(place)
            except BaseException:
                if former.exists():
                    former.rename(place)
                raise
    except OutputError:
        raise
    except OSError as error:
        raise OutputError(
            f"Results could not be written to {folder}: {error.strerror or error} ({error.filename})."
        ) from error


def _prepare(origin: Origin, new: Path, files_up_to: float) -> dict[str, Any]:
    """Scenario and files; what is known of them before the results are."""
    new.mkdir()
    copies: dict[str, str] = {}
    files = [_keep(foreign, origin, new, files_up_to, copies) for foreign in origin.files]
    data = plain(origin.table.model_dump(by_alias=True, exclude_unset=True))
    data = map_paths(
        data, lambda path: copies.get(str((origin.folder / path).resolve()), str((origin.folder / path).resolve()))
    )
    (new / SCENARIO).write_text(HEADER + tomli_w.dumps(data), encoding="utf-8")
    remember(file for file in new.rglob("*") if file.name.endswith(tuple(all_suffixes())))  # it has just run here
    return {
        "format": FORMAT,
        "scenario": {"name": origin.name, "from": origin.where, "file": SCENARIO, "sha256": sha256(new / SCENARIO)},
        "asked_by": "script" if origin.command is None else origin.command,
        "seeds": _seeds(data),
        "files": files,
        "objects": _objects(origin),
    }


def _objects(origin: Origin) -> dict[str, dict[str, Any]]:
    """What is kept of classes and instances that a script gave, by component."""
    described = {}
    for name, table in origin.table.components.items():
        model = table.model or table.observer
        stated = None if model is None else model.stated
        if model is None or stated is None or (names_code(model) and isinstance(stated, type)):
            continue
        if not names_code(model):
            text = f"{name}: the class {model} stands in no file, or within a function, so nothing of it was kept."
        else:
            values = {**table.options, **table.parameters}
            kept = ", ".join(f"{key} = {value}" for key, value in values.items()) or "none"
            text = f"{name}: of the instance of {model} were kept its class and its settings ({kept}), nothing else."
        described[name] = {"class": names_code(model), "text": text}
    return described


def _keep(
    foreign: ForeignFile, origin: Origin, new: Path, files_up_to: float, copies: dict[str, str]
) -> dict[str, Any]:
    """Copy the parts of a file that are small enough; one that was copied already is named again."""
    name = f"{FILES}/{foreign.owner}" + (f"/{foreign.path.name}" if foreign.path.is_dir() else "")
    entry: dict[str, Any] = {"key": foreign.key, "path": str(foreign.path), "parts": []}
    parts = foreign.parts if foreign.path.exists() else [foreign.path]
    known = copies.get(str(foreign.path))
    folder = name if known is None else known if foreign.path.is_dir() else known.rpartition("/")[0]
    root = foreign.path if foreign.path.is_dir() else foreign.path.parent
    entry["parts"] = [
        _keep_part(path, f"{folder}/{path.relative_to(root).as_posix()}", origin, new, files_up_to) for path in parts
    ]
    if all(part["copy"] is not None for part in entry["parts"]):
        copies[str(foreign.path)] = folder if foreign.path.is_dir() else f"{folder}/{foreign.path.name}"
    else:  # all of it or nothing
        why = next(part["why"] for part in entry["parts"] if part["copy"] is None)
        entry["parts"] = [part | {"copy": None, "why": part["why"] or why} for part in entry["parts"]]
    return entry


def _keep_part(path: Path, copy: str, origin: Origin, new: Path, files_up_to: float) -> dict[str, Any]:
    part: dict[str, Any] = {"path": str(path), "copy": None, "sha256": None, "size": None, "why": None}
    try:
        seen = stamp(path)
        part |= {"size": seen[0]}
        if origin.stamps.get(str(path), seen) != seen:
            part["note"] = "it was changed after the run had begun"
        if seen[0] > files_up_to:
            return part | {
                "sha256": sha256(path),
                "why": f"{seen[0] / 1e6:.3g} MB are more than {files_up_to / 1e6:.3g} MB",
            }
        target = new / copy
        if not target.exists():
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(path, target)
        return part | {"sha256": sha256(target), "copy": copy}
    except OSError as error:  # the results matter more than where they come from
        (new / copy).unlink(missing_ok=True)
        return part | {"why": f"{error.strerror or error}"}


def _seal(manifest: dict[str, Any], new: Path, paths: Mapping[str, Path], summary: Mapping[str, Any]) -> None:
    """Add what is known of the results and write the manifest."""
    results = {p.name: {"sha256": sha256(p), "size": p.stat().st_size} for k, p in paths.items() if k not in _UNHASHED}
    components = [
        {k: c.get(k) for k in ("name", "kind", "model", "fmi_version", "guid")} for c in summary.get("components", ())
    ]
    content = manifest | {
        "written": datetime.now(UTC).isoformat(timespec="seconds"),
        "versions": summary.get("versions") or versions(),
        "components": components,
        "results": results,
    }
    text = json.dumps(jsonable(content), indent=2, ensure_ascii=False, allow_nan=False)
    (new / MANIFEST).write_text(text + "\n", encoding="utf-8")


def _seeds(data: Mapping[str, Any]) -> dict[str, Any]:
    """The seed of the run, from which all chance follows, and those that the scenario gives beside it."""
    seeds = {"seed": data.get("seed", RUN_SEED)}
    tables = [(key, data.get(key, {})) for key in ("balises", "network")]
    for name, component in data["components"].items():
        tables += [(name, component.get("parameters", {})), (f"{name}.filter", component.get("filter", {}))]
    return seeds | {f"{name}.{k}": v for name, table in tables for k, v in table.items() if "seed" in k}
