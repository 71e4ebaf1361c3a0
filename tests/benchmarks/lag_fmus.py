"""Chains of the trivial FMU of lag.c, for benchmarks of masters: the FMUs, their links, and the C loop that is the
floor.
"""

from __future__ import annotations

import subprocess
import zipfile
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import fmpy

from fmus.toolchain.compile import find_compiler, header_folder

HERE = Path(__file__).parent
H = 1e-5  # so short that 2e5 steps end far from the steady state: results can be compared
DESCRIPTION = """<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="lag" guid="lag">
  <CoSimulation modelIdentifier="lag" canHandleVariableCommunicationStepSize="true" canGetAndSetFMUstate="true"/>
  <DefaultExperiment startTime="0" stopTime="10" stepSize="0.01"/>
  <ModelVariables>
    <ScalarVariable name="u" valueReference="0" causality="input" variability="continuous"><Real start="0"/></ScalarVariable>
    <ScalarVariable name="y" valueReference="1" causality="output" variability="continuous" initial="exact">
      <Real start="0"/></ScalarVariable>
  </ModelVariables>
  <ModelStructure><Outputs><Unknown index="2" dependencies=""/></Outputs></ModelStructure>
</fmiModelDescription>
"""  # noqa: E501


@dataclass(frozen=True)
class Chain:
    """FMUs of which each is fed by its forerunner.

    Args:
        fmus: files; component i is ``c0``, ``c1``, ... closed: whether the first is fed by the last.
        libraries: the same, unpacked.
    """

    fmus: tuple[Path, ...]
    libraries: tuple[Path, ...]
    closed: bool

    @property
    def names(self) -> list[str]:
        """Names of the components."""
        return [f"c{i}" for i in range(len(self.fmus))]

    @property
    def links(self) -> list[tuple[str, str]]:
        """Components (source, target): output ``y`` to input ``u``."""
        names = self.names
        return [*pairwise(names), *([(names[-1], names[0])] if self.closed else [])]


def make_chain(folder: Path, count: int, closed: bool = False) -> Chain:
    """A chain of `count` FMUs in a folder, each with a library of its own."""
    folder.mkdir(parents=True, exist_ok=True)
    built = folder / f"lag{fmpy.sharedLibraryExtension}"
    compile_c("lag.c", built, "-shared", "-fPIC")
    fmus, libraries = [], []
    for i in range(count):
        library, fmu = folder / f"lag{i}{fmpy.sharedLibraryExtension}", folder / f"c{i}.fmu"
        library.write_bytes(built.read_bytes())
        with zipfile.ZipFile(fmu, "w") as archive:
            archive.writestr("modelDescription.xml", DESCRIPTION)
            archive.write(built, f"binaries/{fmpy.platform}/{built.name}")
        fmus.append(fmu)
        libraries.append(library)
    return Chain(tuple(fmus), tuple(libraries), closed)


def compile_c(source: str, target: Path, *flags: str) -> Path:
    """Compile a C file of this folder."""
    options = ["-std=c11", "-O2", "-ffp-contract=off", f"-I{header_folder()}"]
    subprocess.run(
        [*find_compiler().command, *options, *flags, str(HERE / source), "-o", str(target), "-ldl"], check=True
    )
    return target
