"""How to build an FMU's library again from its sources, and how to link it statically."""

from __future__ import annotations

from fmpy.model_description import ModelDescription

COMMANDS = {
    "Linux": "cc -std=c11 -O2 -ffp-contract=off -shared -fPIC all.c -o {name}.so -lm",
    "macOS": "cc -std=c11 -O2 -ffp-contract=off -shared all.c -o {name}.dylib",
    "Windows": "gcc -std=c11 -O2 -ffp-contract=off -shared -static-libgcc all.c -o {name}.dll",
}


def rebuild_commands(identifier: str) -> dict[str, str]:
    """One command for each system, to be given in ``sources/``.

    Args:
        identifier: model identifier.
    """
    return {system: command.format(name=identifier) for system, command in COMMANDS.items()}


def rebuild_text(description: ModelDescription) -> str:
    """The text of ``documentation/staticLinking.txt``.

    Args:
        description: model description of the FMU.
    """
    interface = description.coSimulation or description.modelExchange
    name, version = interface.modelIdentifier, str(description.fmiVersion)[0]
    shared = "\n".join(f"    {system}:\n        {command}" for system, command in rebuild_commands(name).items())
    return f"""Building this FMU again

sources/ holds all that is needed, the headers of FMI included. One file is compiled, all.c; it includes the others.

A shared library, in sources/:

{shared}

A part of a larger program: every function of FMI gets a prefix, and nothing else is visible outside, so that several FMUs can
be linked into one program:

    cc -std=c11 -O2 -ffp-contract=off -DFMI{version}_FUNCTION_PREFIX={name}_ -c all.c -o {name}.o

    {name}_fmi{version}{"Instantiate" if version == "2" else "InstantiateCoSimulation"}(...);

It needs the C library and its mathematical functions, and nothing else.
"""  # noqa: E501
