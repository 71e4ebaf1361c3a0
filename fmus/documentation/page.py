"""The page ``documentation/index.html`` of an FMU: one file, no network, no scripts, readable on a phone."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from fmpy.model_description import ModelDescription

from fmu_observer.event_protocol import LATE_POLICIES, OUTCOME_VARIABLES
from fmus.documentation.licences import model_terms
from fmus.documentation.prose import blocks, pieces
from fmus.documentation.rebuild import rebuild_commands
from fmus.documentation.variable_tables import certificate_rows, preset_rows, variable_rows
from fmus.fmi.standard import INTERFACES
from fmus.templates import environment
from fmus.toolchain.targets import Target
from plant_models.hybrid import HybridSystem
from plant_models.installed import installed_version

CAUSALITIES = ("input", "output", "parameter")
PAGES = environment("fmus.documentation")
PAGES.filters["pieces"] = pieces


def page(system: HybridSystem, description: ModelDescription, preset: str | None, targets: Sequence[Target]) -> str:
    """The whole page.

    Args:
        system: the hybrid system.
        description: its model description.
        preset: preset of the start values; None for the system's default.
        targets: platforms of the libraries and the compilers that built them.

    Returns:
        HTML that is well-formed XML too.
    """
    by_name = {v.name: v for v in description.modelVariables}
    policy = by_name.get("late_policy")
    return render(
        "index.html.j2",
        description,
        system=system,
        preset=preset if preset is not None else system.default_preset,
        targets=targets,
        interfaces=[text for name, text in INTERFACES.items() if getattr(description, name) is not None],
        equations=_equations(system),
        names=by_name.keys(),
        late=LATE_POLICIES[int(policy.start) - 1] if policy is not None else None,
        counts=[name for name in OUTCOME_VARIABLES if name in by_name],
        presets=preset_rows(system),
        checked=certificate_rows(system),
        commands=rebuild_commands(system.name),
        tool=_tool(),
        terms=model_terms(system),
    )


def render(template: str, description: ModelDescription, **values: Any) -> str:
    """A page of an FMU from its template.

    Args:
        template: its file among the templates of this room.
        description: of the FMU; its inputs, outputs and parameters are known to the template.
        values: what else the template inserts, by name.

    Returns:
        The page.
    """
    rows = {f"{causality}s": variable_rows(description, causality) for causality in CAUSALITIES}
    return PAGES.get_template(template).render(description=description, **rows, **values)


def _equations(system: HybridSystem) -> list[Any]:
    """The docstring of the system, and the first paragraphs of those it inherits from."""
    classes = type(system).__mro__[: type(system).__mro__.index(HybridSystem)]
    return [blocks(cls.__doc__) if cls is type(system) else blocks(cls.__doc__)[:1] for cls in classes if cls.__doc__]


def _tool() -> str:
    version = installed_version("fmu-observer")
    return "fmu-observer" if version is None else f"fmu-observer {version}"
