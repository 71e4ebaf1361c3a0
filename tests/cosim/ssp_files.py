"""SSP files by hand for tests: packages from texts, small linear FMUs, and FMUs that are a model description only."""

from __future__ import annotations

import zipfile
from collections.abc import Mapping
from pathlib import Path

from test_fmus.build import linear_fmu
from test_fmus.description import Version

HEADER = (
    '<ssd:SystemStructureDescription xmlns:ssd="http://ssp-standard.org/SSP1/SystemStructureDescription" '
    'xmlns:ssc="http://ssp-standard.org/SSP1/SystemStructureCommon" '
    'xmlns:ssv="http://ssp-standard.org/SSP1/SystemStructureParameterValues" '
    'xmlns:ssm="http://ssp-standard.org/SSP1/SystemStructureParameterMapping" '
    'xmlns:ssb="http://ssp-standard.org/SSP1/SystemStructureSignalDictionary" '
)
UNITS = """
<ssd:Units>
  <ssc:Unit name="m/s"><ssc:BaseUnit m="1" s="-1"/></ssc:Unit>
  <ssc:Unit name="km/h"><ssc:BaseUnit m="1" s="-1" factor="0.2777777777777778"/></ssc:Unit>
  <ssc:Unit name="kg"><ssc:BaseUnit kg="1"/></ssc:Unit>
</ssd:Units>"""
EXPERIMENT = '<ssd:DefaultExperiment startTime="0" stopTime="1"/>'


def ssd(system: str, *, version: str = "1.0", name: str = "by hand", tail: str = UNITS + EXPERIMENT) -> str:
    """A system structure description around the elements of its root system."""
    root = f'<ssd:System name="root">\n{system}\n</ssd:System>'
    return f'{HEADER}version="{version}" name="{name}">\n{root}{tail}\n</ssd:SystemStructureDescription>'


def ssv(parameters: str, units: str = "", version: str = "1.0") -> str:
    """A parameter set; `units` as in the SSD."""
    space = 'xmlns:ssv="http://ssp-standard.org/SSP1/SystemStructureParameterValues"'
    common = 'xmlns:ssc="http://ssp-standard.org/SSP1/SystemStructureCommon"'
    body = f"<ssv:Parameters>{parameters}</ssv:Parameters>{units.replace('ssd:', 'ssv:')}"
    return f'<ssv:ParameterSet {space} {common} version="{version}" name="set">{body}</ssv:ParameterSet>'


def ssm(entries: str) -> str:
    """A parameter mapping."""
    space = 'xmlns:ssm="http://ssp-standard.org/SSP1/SystemStructureParameterMapping"'
    common = 'xmlns:ssc="http://ssp-standard.org/SSP1/SystemStructureCommon"'
    return f'<ssm:ParameterMapping {space} {common} version="1.0">{entries}</ssm:ParameterMapping>'


def real(name: str, value: str, unit: str = "") -> str:
    """A real parameter."""
    attribute = f' unit="{unit}"' if unit else ""
    return f'<ssv:Parameter name="{name}"><ssv:Real value="{value}"{attribute}/></ssv:Parameter>'


def connector(name: str, kind: str, unit: str = "", type_: str = "Real") -> str:
    """A connector."""
    attribute = f' unit="{unit}"' if unit else ""
    return f'<ssd:Connector name="{name}" kind="{kind}"><ssc:{type_}{attribute}/></ssd:Connector>'


def wire(start: str, end: str, inner: str = "", **attributes: str) -> str:
    """A connection between ``element.connector`` or ``connector`` names."""
    ends = ""
    for side, text in (("start", start), ("end", end)):
        element, _, name = text.rpartition(".")
        ends += f' {side}Element="{element}"' if element else ""
        ends += f' {side}Connector="{name}"'
    more = "".join(f' {key}="{value}"' for key, value in attributes.items())
    return f"<ssd:Connection{ends}{more}>{inner}</ssd:Connection>"


def package(path: Path, files: Mapping[str, str | bytes | Path]) -> Path:
    """An ``.ssp`` with these members; an SSD goes by its text, an FMU by its path."""
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in files.items():
            archive.writestr(name, content.read_bytes() if isinstance(content, Path) else content)
    return path


def ramp_fmu(folder: Path, version: Version = 2) -> Path:
    """``speed = 10 + 2 t`` [m/s]; parameter ``x0[1]`` is its start."""
    return linear_fmu(
        folder,
        "ramp",
        [[0, 1], [0, 0]],
        [[], []],
        [[1, 0]],
        [[]],
        version=version,
        outputs=["speed"],
        x0=[10.0, 2.0],
        units={"speed": "m/s"},
    )


def sum_fmu(folder: Path, version: Version = 2) -> Path:
    """``y = 2 u + w``, all [m/s], without states."""
    return linear_fmu(
        folder,
        "sum",
        [],
        [],
        [],
        [[2, 1]],
        version=version,
        inputs=["u", "w"],
        outputs=["y"],
        units={"u": "m/s", "w": "m/s", "y": "m/s"},
    )


def described_fmu(folder: Path, name: str, variables: str, types: str = "") -> Path:
    """An FMI 2.0 FMU that can be read and not loaded: a model description with these variables."""
    text = f"""<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="{name}" guid="{name}">
<CoSimulation modelIdentifier="{name}"/>{types}
<ModelVariables>{variables}</ModelVariables><ModelStructure/></fmiModelDescription>"""
    return package(folder / f"{name}.fmu", {"modelDescription.xml": text})


def array_fmu(folder: Path, name: str, causality: str, size: int) -> Path:
    """An FMI 3.0 FMU that can be read and not loaded: one array of real numbers, `x`."""
    start = f' start="{" ".join(["0"] * size)}"' if causality == "input" else ""
    text = f"""<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="3.0" modelName="{name}" instantiationToken="{name}">
<CoSimulation modelIdentifier="{name}"/><ModelVariables>
<Float64 name="time" valueReference="0" causality="independent"/>
<Float64 name="x" valueReference="1" causality="{causality}"{start}><Dimension start="{size}"/></Float64>
</ModelVariables><ModelStructure/></fmiModelDescription>"""
    return package(folder / f"{name}.fmu", {"modelDescription.xml": text})
