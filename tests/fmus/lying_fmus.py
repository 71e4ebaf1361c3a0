"""Builds FMUs from lying_fmu.c: one library for each lie, and the model description that goes with it."""

from __future__ import annotations

import subprocess
import zipfile
from collections.abc import Mapping
from pathlib import Path

import fmpy

from fmus.toolchain.compile import find_compiler

SOURCE = Path(__file__).parent / "lying_fmu.c"
HEADERS = Path(fmpy.__file__).parent / "c-code"
STATES = {"canGetAndSetFMUstate": "true", "canSerializeFMUstate": "true", "providesDirectionalDerivative": "true"}
SLAVE = {"canHandleVariableCommunicationStepSize": "true"} | STATES


def description(slave: Mapping[str, str] | None = SLAVE, model: Mapping[str, str] | None = None) -> str:
    """modelDescription.xml; the attributes of each interface, or None to leave it out."""
    interfaces = {"ModelExchange": model, "CoSimulation": slave}
    elements = "".join(
        f'<{tag} modelIdentifier="liar" {" ".join(f"{k}={v!r}" for k, v in attributes.items())}/>'.replace("'", '"')
        for tag, attributes in interfaces.items()
        if attributes is not None
    )
    return f"""<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="liar" guid="1" numberOfEventIndicators="0">
  {elements}
  <DefaultExperiment startTime="0" stopTime="10" stepSize="0.01"/>
  <ModelVariables>
    <ScalarVariable name="force" valueReference="1" causality="input" variability="continuous"><Real start="0"/></ScalarVariable>
    <ScalarVariable name="position" valueReference="2" causality="output" variability="continuous" initial="exact">
      <Real start="0"/></ScalarVariable>
    <ScalarVariable name="speed" valueReference="3" causality="output" variability="continuous" initial="exact">
      <Real start="1"/></ScalarVariable>
    <ScalarVariable name="rate" valueReference="4" causality="local" variability="continuous" initial="calculated">
      <Real derivative="3"/></ScalarVariable>
    <ScalarVariable name="velocity" valueReference="3" causality="local" variability="continuous" initial="calculated">
      <Real derivative="2"/></ScalarVariable>
    <ScalarVariable name="pulse_time" valueReference="5" causality="input" variability="discrete">
      <Real start="0"/></ScalarVariable>
    <ScalarVariable name="pulse_count" valueReference="6" causality="input" variability="discrete">
      <Integer start="0"/></ScalarVariable>
  </ModelVariables>
  <ModelStructure>
    <Outputs><Unknown index="2"/><Unknown index="3"/></Outputs>
    <Derivatives><Unknown index="5"/><Unknown index="4"/></Derivatives>
    <InitialUnknowns><Unknown index="4"/><Unknown index="5"/></InitialUnknowns>
  </ModelStructure>
</fmiModelDescription>
"""  # noqa: E501


def build(folder: Path, *lies: str, xml: str | None = None) -> Path:
    """An FMU that tells these lies, and no others.

    Args:
        folder: where it goes. lies: names of LIE_... macros without the prefix. xml: model description.
    """
    folder.mkdir(parents=True, exist_ok=True)
    library = folder / f"liar{fmpy.sharedLibraryExtension}"
    macros = [f"-DLIE_{lie}" for lie in lies]
    flags = ["-shared", "-fPIC", "-w", f"-I{HEADERS}", *macros]
    command = [*find_compiler().command, *flags, str(SOURCE), "-o", str(library), "-lm"]
    subprocess.run(command, check=True, capture_output=True)
    path = folder / "liar.fmu"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("modelDescription.xml", xml or description())
        archive.write(library, f"binaries/{fmpy.platform}/{library.name}")
    return path
