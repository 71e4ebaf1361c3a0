"""The host programs in C: compiled once, fed with wirings, read back. Knows the folder ``hosts`` and nothing of the
tests.
"""

from __future__ import annotations

import subprocess
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from fmpy import extract, read_model_description
from fmpy.model_description import ModelDescription

from fmus.toolchain.compile import find_compiler, header_folder

HOSTS = Path(__file__).parent / "hosts"
SHARED = ("wiring.c", "slave.c", "slave_fmi2.c", "slave_fmi3.c")
SANITIZE = ("-fsanitize=address,undefined", "-fno-sanitize-recover=all", "-fno-omit-frame-pointer")
WARNINGS = ("-Wall", "-Wextra", "-Wconversion", "-Wno-sign-conversion", "-Wshadow", "-Werror")


def compile_host(name: str, folder: Path, extra: Sequence[str] = ()) -> Path:
    """One of the programs of the folder ``hosts``."""
    target = folder / name
    own = (f"{name}.c", *(part.name for part in sorted(HOSTS.glob(f"{name}_*.c"))))
    sources = [str(HOSTS / source) for source in (*own, *SHARED)]
    flags = ["-std=c11", "-D_POSIX_C_SOURCE=200809L", "-g", "-O1", *WARNINGS, *extra, f"-I{header_folder()}"]
    run([*find_compiler().command, *flags, *sources, "-o", str(target), "-ldl", "-lm", "-lpthread"])
    return target


def run(command: Sequence[str], expected: int = 0) -> str:
    """Run a program to its end; what it printed."""
    done = subprocess.run(list(command), capture_output=True, text=True, check=False)
    assert done.returncode == expected, f"{' '.join(command)}: {done.returncode}\n{done.stdout}\n{done.stderr}"
    assert "Sanitizer" not in done.stderr, done.stderr
    return done.stdout


@dataclass
class Unpacked:
    """An FMU as a host program needs it: library, token, resources, value references by name."""

    description: ModelDescription
    folder: Path
    library: Path

    @classmethod
    def of(cls, fmu: Path, folder: Path, library: Path | None = None) -> Unpacked:
        """Unpack an FMU; `library` replaces its own."""
        place = Path(extract(str(fmu), str(folder)))
        description = read_model_description(str(place), validate=False)
        tuples = {"2.0": "linux64", "3.0": "x86_64-linux"}
        own = place / "binaries" / tuples[description.fmiVersion] / f"{description.coSimulation.modelIdentifier}.so"
        return cls(description, place, library or own)

    @property
    def version(self) -> int:
        """2 or 3."""
        return int(description_version(self.description))

    @property
    def resources(self) -> str:
        """The folder of resources as the FMI version names it: a URI or a path."""
        place = self.folder / "resources"
        return place.as_uri() if self.version == 2 else f"{place}/"

    def reference(self, variable: str) -> int:
        """Value reference of a variable."""
        return int(next(v.valueReference for v in self.description.modelVariables if v.name == variable))

    def is_integer(self, variable: str) -> bool:
        """Whether a variable is an Integer (FMI 2) or Int32 (FMI 3)."""
        return next(v.type for v in self.description.modelVariables if v.name == variable) in ("Integer", "Int32")


def description_version(description: ModelDescription) -> str:
    """``2`` or ``3``."""
    return str(description.fmiVersion)[0]


@dataclass
class Wiring:
    """Text of a wiring, see ``hosts/wiring.h``; slaves are named, variables too."""

    slaves: dict[str, Unpacked] = field(default_factory=dict)
    lines: list[str] = field(default_factory=list)
    recorded: list[str] = field(default_factory=list)

    def slave(self, name: str, fmu: Unpacked, event_mode: bool = False, **starts: float) -> Wiring:
        """Add a slave, to be stepped after those before it."""
        self.slaves[name] = fmu
        token = fmu.description.instantiationToken or fmu.description.guid
        self._line("slave", fmu.version, int(event_mode), name, fmu.library, token, fmu.resources)
        for variable, value in starts.items():
            self._line("real", self._number(name), fmu.reference(variable), repr(float(value)))
        return self

    def starts(self, name: str, values: Mapping[str, float]) -> Wiring:
        """Start values by names that are no Python identifiers."""
        for variable, value in values.items():
            self._line("real", self._number(name), self.slaves[name].reference(variable), repr(float(value)))
        return self

    def connect(self, *connections: str) -> Wiring:
        """``a.x -> b.y``."""
        for text in connections:
            source, target = (end.strip() for end in text.split("->"))
            kind = "integer" if self._variable(source)[0].is_integer(source.split(".", 1)[1]) else "real"
            self._line("connect", kind, *self._place(source), *self._place(target))
        return self

    def event(self, count: str, clock: str, payload: Mapping[str, str]) -> Wiring:
        """A clock that ticks when a count has changed, with what arrives at it: source by target."""
        self._line("event", *self._place(count), *self._place(clock))
        for target, source in payload.items():
            self._line("payload", *self._place(source), self._place(target)[1])
        return self

    def record(self, *variables: str) -> Wiring:
        """Columns of the result."""
        for variable in variables:
            fmu, name = self._variable(variable)
            self._line("record", "integer" if fmu.is_integer(name) else "real", *self._place(variable))
            self.recorded.append(variable)
        return self

    def write(self, path: Path, start: float = 0.0, step: float = 0.01, steps: int = 1) -> Path:
        """The file that the host programs read."""
        self_run = f"run\t{start!r}\t{step!r}\t{steps}"
        path.write_text("\n".join([*self.lines, self_run, ""]), encoding="utf-8")
        return path

    def read(self, path: Path) -> np.ndarray:
        """A result as a structured array: ``time``, then what was recorded."""
        rows = np.loadtxt(path, delimiter=",", ndmin=2)
        table = np.zeros(len(rows), dtype=[(name, float) for name in ("time", *self.recorded)])
        for i, name in enumerate(table.dtype.names or ()):
            table[name] = rows[:, i]
        return table

    def _number(self, name: str) -> int:
        return list(self.slaves).index(name)

    def _variable(self, text: str) -> tuple[Unpacked, str]:
        name, variable = text.split(".", 1)
        return self.slaves[name], variable

    def _place(self, text: str) -> tuple[int, int]:
        fmu, variable = self._variable(text)
        return self._number(text.split(".", 1)[0]), fmu.reference(variable)

    def _line(self, *fields: object) -> None:
        self.lines.append("\t".join(map(str, fields)))
