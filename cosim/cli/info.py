"""``cosim info FILE.fmu``: what an FMU says about itself, and whether it can run here."""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

from cosim.components.loading import read_description


def register(commands: Any) -> None:
    """Add the command to the parser."""
    parser = commands.add_parser(
        "info", help="describe an FMU file", description="Interfaces, platforms and variables of an FMU."
    )
    parser.add_argument("file", type=Path)
    parser.add_argument("--json", action="store_true", help="print JSON")
    parser.set_defaults(execute=execute)


def execute(options: argparse.Namespace) -> int:
    """Print the description."""
    data = describe_file(options.file)
    if options.json:
        print(json.dumps(data, indent=2))
        return 0
    variables = data.pop("variables")
    width = max(map(len, data))
    for key, value in data.items():
        print(f"{key:<{width}}  {', '.join(map(str, value)) if isinstance(value, list) else value}")
    for causality in ("input", "output", "parameter", "local"):
        chosen = [v for v in variables if v["causality"] == causality]
        print(f"{causality}s ({len(chosen)}):")
        for v in chosen:
            start = "" if v["start"] is None else f" = {v['start']}"
            kind = " ".join(filter(None, (v["type"], v["variability"])))
            print(f"  {v['name']}{start} [{v['unit'] or '-'}] {kind}  {v['description'] or ''}".rstrip())
    return 0


def describe_file(path: Path) -> dict[str, Any]:
    """The description of an FMU file as plain data.

    Raises:
        FmuLoadError: the file is missing or not an FMU.
    """
    import fmpy  # noqa: PLC0415 - only here

    description = read_description(path, "info")
    slave = description.coSimulation
    platforms = list(fmpy.supported_platforms(str(path)))
    capabilities = ["canHandleVariableCommunicationStepSize", "canGetAndSetFMUstate", "canSerializeFMUstate", "hasEventMode"]
    interfaces = {"coSimulation": "co-simulation", "modelExchange": "model exchange", "scheduledExecution": "scheduled execution"}
    return {
        "file": str(path),
        "model": description.modelName,
        "description": description.description or "",
        "FMI version": description.fmiVersion,
        "interfaces": [text for name, text in interfaces.items() if getattr(description, name) is not None],
        "platforms": platforms,
        "runs here": "yes" if {fmpy.platform, fmpy.platform_tuple} & set(platforms) else f"no (this is {fmpy.platform_tuple})",
        "tool": description.generationTool or "",
        "declares": [name for name in capabilities if slave is not None and getattr(slave, name)],
        "variables": [
            {"name": v.name, "causality": v.causality or "local", "variability": v.variability, "type": v.type,
             "unit": v.unit, "start": v.start, "description": v.description}
            for v in description.modelVariables
        ],
    }  # fmt: skip
