"""The page ``documentation/index.html`` of an FMU: one file, no network, no scripts, readable on a phone."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import isinf
from typing import Any
from weakref import WeakKeyDictionary

from fmpy.model_description import ModelDescription, ModelVariable

from fmu_observer.certificates.finding import Finding
from fmu_observer.certificates.gap_findings import CONSTANT_GAP
from fmu_observer.event_protocol import LATE_POLICIES, OUTCOME_VARIABLES
from fmus.documentation.licences import licence_files, model_terms
from fmus.documentation.prose import blocks, pieces
from fmus.fmi.standard import INTERFACES
from fmus.templates import environment
from fmus.toolchain.targets import Target
from plant_models.hybrid import HybridSystem
from plant_models.installed import installed_version

CAUSALITIES = ("input", "output", "parameter")
PAGES = environment("fmus.documentation")
PAGES.filters["pieces"] = pieces


def documentation_files(
    system: HybridSystem, description: ModelDescription, preset: str | None, targets: Sequence[Target]
) -> dict[str, bytes]:
    """The files under ``documentation/``, by name inside the FMU.

    Args:
        system: the hybrid system. description: its model description. preset: preset of the start values.
        targets: platforms of the libraries and the compilers that built them.
    """
    texts = {
        "index.html": page(system, description, preset, targets),
        "staticLinking.txt": _rebuild_text(description),  # the name that FMI 3.0 gives it
        **licence_files(system),
    }
    return {f"documentation/{name}": text.encode() for name, text in texts.items()}


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
        presets=_preset_rows(system),
        checked=_certificate_rows(system),
        commands=_rebuild_commands(system.name),
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
    rows = {f"{causality}s": _variable_rows(description, causality) for causality in CAUSALITIES}
    return PAGES.get_template(template).render(description=description, **rows, **values)


def _equations(system: HybridSystem) -> list[Any]:
    """The docstring of the system, and the first paragraphs of those it inherits from."""
    classes = type(system).__mro__[: type(system).__mro__.index(HybridSystem)]
    return [blocks(cls.__doc__) if cls is type(system) else blocks(cls.__doc__)[:1] for cls in classes if cls.__doc__]


def _tool() -> str:
    version = installed_version("fmu-observer")
    return "fmu-observer" if version is None else f"fmu-observer {version}"


# -- what the tables hold: variables, presets, certificates, as data --------------------------------------------------


_UNITS_OF_TYPES = {"Clock": "clock", "Integer": "whole number", "Int32": "whole number", "Enumeration": "choice"}


@dataclass(frozen=True, slots=True)
class _VariableRow:
    """A variable in words.

    Args:
        name: of the variable.
        unit: with the unit in which it is to be shown, if any.
        start: its start value; empty without one.
        range: from its least to its largest value; empty without bounds.
        meaning: its description.
        has_start: whether it has a start value.
    """

    name: str
    unit: str
    start: str
    range: str
    meaning: str
    has_start: bool


@dataclass(frozen=True, slots=True)
class _CertificateRow:
    """What the stability check says of a preset.

    Args:
        preset: its name.
        aperiodic: up to which mixed gaps it is certified, in words.
        constant: from which constant gap on it is unstable, in words.
        text: what was checked.
        event: the event that gaps lie between; empty where the check failed.
    """

    preset: str
    aperiodic: str
    constant: str
    text: str
    event: str


_known: WeakKeyDictionary[HybridSystem, list[_CertificateRow]] = WeakKeyDictionary()


def _variable_rows(description: ModelDescription, causality: str) -> list[_VariableRow]:
    """The variables of one causality.

    Args:
        description: of the FMU.
        causality: ``input``, ``output`` or ``parameter``.
    """
    return [_variable(v) for v in description.modelVariables if v.causality == causality]


def _variable(variable: ModelVariable) -> _VariableRow:
    unit = variable.unit or _UNITS_OF_TYPES.get(str(variable.type), "1")
    shown = f"{unit} ({variable.displayUnit})" if variable.displayUnit else unit
    has_start = variable.start is not None
    return _VariableRow(variable.name, shown, _start(variable), _range(variable), variable.description or "", has_start)


def _start(variable: ModelVariable) -> str:
    items = variable.declaredType.items if variable.type == "Enumeration" and variable.declaredType else ()
    names = [item.name for item in items if str(item.value) == str(variable.start)]
    return _number(variable.start) + (f" ({names[0]})" if names else "")


def _number(value: object) -> str:
    try:
        return f"{float(str(value)):.12g}"
    except ValueError:
        return "" if value is None else str(value)


def _range(variable: ModelVariable) -> str:
    low, high = variable.min, variable.max
    if low is None and high is None:
        return ""
    return f"{'…' if low is None else _number(low)} to {'…' if high is None else _number(high)}"


def _preset_rows(system: HybridSystem) -> list[list[str]]:
    """Name and unit of each parameter that a preset sets, and its value in every preset."""
    values = {name: system.preset_values(name) for name in system.presets}
    signals = (*system.parameter_signals, *system.states)
    starts = {name: start for s in signals for name, start in zip(s.scalar_names, s.start_values, strict=True)}
    units = {name: s.unit for s in signals for name in s.scalar_names}
    names = dict.fromkeys(name for preset in values.values() for name in preset)
    return [
        [name, units[name], *(_number(preset.get(name, starts[name])) for preset in values.values())] for name in names
    ]


def _certificate_rows(system: HybridSystem) -> list[_CertificateRow] | None:
    """What the stability check says of each preset; None where the system has none.

    A certificate is found with the values of the preset; whoever changes a gain in the FMU asks again.

    Args:
        system: the hybrid system.
    """
    if not hasattr(system, "sampled_events"):
        return None
    if system not in _known:  # it takes up to half a second; FMI 2 and FMI 3 say the same
        _known[system] = [_certificate(system, preset) for preset in (*system.presets,) or (None,)]
    return _known[system]


def _certificate(system: Any, preset: str | None) -> _CertificateRow:
    name = preset or "declared starts"
    try:
        found = next(iter(system.findings(preset=preset)))
        notes = f" Also checked: {'; '.join(found.remarks)}." if found.remarks else ""
        event = found.what.removeprefix("mixed ").removesuffix(" gaps")
        words = f"Checked on the {found.source}.{notes}", event
        return _CertificateRow(name, _limit(found), _limit(found.condition(CONSTANT_GAP)), *words)
    except Exception as error:  # a user's own check may fail in any way; the FMU is none the worse
        return _CertificateRow(name, "unknown", "unknown", f"The check failed: {error}", "")


def _limit(found: Finding) -> str:
    reach = "none" if isinf(found.value) else f"none up to {found.value:g} s"
    return reach if isinf(found.limit) else f"{found.value:.3g} s"


# -- how a library is built again from its sources, and linked statically ---------------------------------------------


COMMANDS = {
    "Linux": "cc -std=c11 -O2 -ffp-contract=off -shared -fPIC all.c -o {name}.so -lm",
    "macOS": "cc -std=c11 -O2 -ffp-contract=off -shared all.c -o {name}.dylib",
    "Windows": "gcc -std=c11 -O2 -ffp-contract=off -shared -static-libgcc all.c -o {name}.dll",
}


def _rebuild_commands(identifier: str) -> dict[str, str]:
    """One command for each system, to be given in ``sources/``.

    Args:
        identifier: model identifier.

    Returns:
        Commands by name of the system.
    """
    return {system: command.format(name=identifier) for system, command in COMMANDS.items()}


def _rebuild_text(description: ModelDescription) -> str:
    """The text of ``documentation/staticLinking.txt``.

    Args:
        description: of the FMU.
    """
    interface = description.coSimulation or description.modelExchange
    name, version = interface.modelIdentifier, str(description.fmiVersion)[0]
    template = environment("fmus.documentation").get_template("staticLinking.txt.j2")
    return template.render(name=name, version=version, commands=_rebuild_commands(name))
