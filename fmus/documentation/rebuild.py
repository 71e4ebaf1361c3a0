"""How to build an FMU's library again from its sources, and how to link it statically."""

from __future__ import annotations

from fmpy.model_description import ModelDescription

from fmus.templates import environment

COMMANDS = {
    "Linux": "cc -std=c11 -O2 -ffp-contract=off -shared -fPIC all.c -o {name}.so -lm",
    "macOS": "cc -std=c11 -O2 -ffp-contract=off -shared all.c -o {name}.dylib",
    "Windows": "gcc -std=c11 -O2 -ffp-contract=off -shared -static-libgcc all.c -o {name}.dll",
}


def rebuild_commands(identifier: str) -> dict[str, str]:
    """One command for each system, to be given in ``sources/``.

    Args:
        identifier: model identifier.

    Returns:
        Commands by name of the system.
    """
    return {system: command.format(name=identifier) for system, command in COMMANDS.items()}


def rebuild_text(description: ModelDescription) -> str:
    """The text of ``documentation/staticLinking.txt``.

    Args:
        description: of the FMU.
    """
    interface = description.coSimulation or description.modelExchange
    name, version = interface.modelIdentifier, str(description.fmiVersion)[0]
    template = environment("fmus.documentation").get_template("staticLinking.txt.j2")
    return template.render(name=name, version=version, commands=rebuild_commands(name))
