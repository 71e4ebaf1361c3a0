"""Tables of the page: variables, presets, certificates."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape
from math import isinf
from typing import Any
from weakref import WeakKeyDictionary

from fmpy.model_description import ModelDescription, ModelVariable

from fmus.documentation.prose import inline
from plant_models.hybrid import HybridSystem

UNITS_OF_TYPES = {"Clock": "clock", "Integer": "whole number", "Int32": "whole number", "Enumeration": "choice"}

_known: WeakKeyDictionary[HybridSystem, tuple[tuple[str, tuple[str, str], str, str], ...]] = WeakKeyDictionary()


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """An HTML table that scrolls sideways on a small screen.

    Args:
        head: column titles, plain text.
        rows: cells, already HTML.
    """
    titles = "".join(f"<th>{escape(title)}</th>" for title in head)
    body = "\n".join("<tr>" + "".join(f"<td>{cell}</td>" for cell in row) + "</tr>" for row in rows)
    return f'<div class="wide"><table>\n<thead><tr>{titles}</tr></thead>\n<tbody>\n{body}\n</tbody></table></div>'


def variable_table(description: ModelDescription, causality: str) -> str:
    """The variables of one causality; empty where there are none.

    Args:
        description: model description of the FMU.
    """
    chosen = [v for v in description.modelVariables if v.causality == causality]
    if not chosen:
        return ""
    with_start = any(v.start is not None for v in chosen)
    head = ["name", "unit", *(["start", "range"] if with_start else []), "meaning"]
    return table(head, (_variable(v, with_start) for v in chosen))


def _variable(variable: ModelVariable, with_start: bool) -> list[str]:
    unit = variable.unit or UNITS_OF_TYPES.get(str(variable.type), "1")
    shown = f"{unit} ({variable.displayUnit})" if variable.displayUnit else unit
    middle = [_start(variable), _range(variable)] if with_start else []
    return [f"<code>{escape(variable.name)}</code>", escape(shown), *middle, inline(variable.description or "")]


def _start(variable: ModelVariable) -> str:
    items = variable.declaredType.items if variable.type == "Enumeration" and variable.declaredType else ()
    names = [item.name for item in items if str(item.value) == str(variable.start)]
    return _number(variable.start) + (f" ({escape(names[0])})" if names else "")


def _number(value: object) -> str:
    try:
        return f"{float(str(value)):.12g}"
    except ValueError:
        return "" if value is None else escape(str(value))


def _range(variable: ModelVariable) -> str:
    low, high = variable.min, variable.max
    if low is None and high is None:
        return ""
    return escape(f"{'…' if low is None else _number(low)} to {'…' if high is None else _number(high)}")


def preset_table(system: HybridSystem, chosen: str | None) -> str:
    """Values of all presets, and those of this FMU marked; empty for a system without presets.

    Args:
        chosen: preset that the FMU has as its start values.
    """
    if not system.presets:
        return ""
    values = {name: system.preset_values(name) for name in system.presets}
    names = dict.fromkeys(name for preset in values.values() for name in preset)
    signals = (*system.parameter_signals, *system.states)
    starts = {name: start for s in signals for name, start in zip(s.scalar_names, s.start_values, strict=True)}
    units = {name: s.unit for s in signals for name in s.scalar_names}
    head = ["parameter", "unit", *(f"{name} (this FMU)" if name == chosen else name for name in system.presets)]
    rows = (
        [
            f"<code>{escape(name)}</code>",
            escape(units[name]),
            *(_number(preset.get(name, starts[name])) for preset in values.values()),
        ]
        for name in names
    )
    return table(head, rows)


def certificate_section(system: HybridSystem) -> str:
    """What the stability check says of each preset; empty where the system has none.

    A certificate is found with the values of the preset; whoever changes a gain in the FMU asks again.
    """
    certify = getattr(system, "certify", None)
    if certify is None:
        return ""
    if system not in _known:  # it takes up to half a second; FMI 2 and FMI 3 say the same
        _known[system] = _certificates(system)
    found = _known[system]
    rows = [[f"<code>{escape(name)}</code>", *limits] for name, limits, *_ in found]
    event = next((event for *_, event in found if event), "sample")
    head = ["preset", f"mixed {event} gaps certified up to", "constant gap unstable from"]
    texts = "".join(f"<p>{inline(text)}</p>" for text in dict.fromkeys(text for _, _, text, _ in found))
    return table(head, rows) + texts


def _certificates(system: HybridSystem) -> tuple[tuple[str, tuple[str, str], str, str], ...]:
    """Preset, its two limits, what was checked, and the event that gaps lie between."""
    found = []
    for preset in (*system.presets,) or (None,):
        try:
            certificate = system.certify(0.1, preset=preset)  # type: ignore[attr-defined] # the limits do not depend on the gap asked for
            limits = (_limit(certificate.aperiodic_limit, certificate), _limit(certificate.constant_limit, certificate))
            notes = f" Also checked: {'; '.join(certificate.notes)}." if certificate.notes else ""
            text, event = f"Checked on the {certificate.error_model}.{notes}", certificate.event
        except Exception as error:  # a user's own check may fail in any way; the FMU is none the worse
            limits, text, event = ("unknown", "unknown"), f"The check failed: {error}", ""
        found.append((preset or "declared starts", limits, text, event))
    return tuple(found)


def _limit(limit: float, certificate: Any) -> str:
    return f"none up to {certificate.horizon:g} s" if isinf(limit) else f"{limit:.3g} s"
