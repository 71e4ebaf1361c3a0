"""Command line: ``fmus compile FILE.fmu``: the library of an FMU that brings its sources."""

from __future__ import annotations

import argparse
from pathlib import Path

from fmus.cli.commands import argument
from fmus.cli.output import Output
from fmus.source_build import add_libraries, compile_sources

GROUP = "FMUs"
PLACE = 3
HELP = "compile the C sources of an FMU that has no library for this machine"
LOOKS = False
EXAMPLES = ("fmus compile vendor.fmu", "fmus compile vendor.fmu -o vendor_with_library.fmu")
PARSER = {
    "description": (
        "Compile the sources that an FMU brings with the system's C compiler, or with the one of the extra 'cross'. The"
        " library is kept in the cache folder under the content of the file: from then on the file runs on this machine"
        " in every command. With -o an FMU with the library is written, for other users and tools."
    )
}
ARGUMENTS = (
    argument("file", type=Path, metavar="FILE", help="an FMU with C sources"),
    argument("-o", "--output", type=Path, metavar="FMU", help="also write an FMU that holds the library"),
)


def execute(options: argparse.Namespace) -> Output:
    """Compile the sources of the file of the options.

    Raises:
        ValueError, RuntimeError, OSError: no sources, no compiler, or one that refuses.
    """
    build = compile_sources(options.file)
    done = "had been compiled before" if build.kept else f"compiled with {build.compiler}"
    parts = [f"{', '.join(library.name for library in build.libraries)}: {done}"]
    target = options.file
    if options.output is not None:
        target = add_libraries(options.file, build, options.output)
        parts.append(f"written: {target}")
    data = {"file": str(options.file), "libraries": build.libraries, "compiler": build.compiler, "written": target}
    return Output(parts, data, verdict=f"{target} runs on this machine.", role="good")
