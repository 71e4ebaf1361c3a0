"""The page ``documentation/index.html`` of an FMU: one file, no network, no scripts, readable on a phone."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from importlib.metadata import PackageNotFoundError, version

from fmpy.model_description import ModelDescription

from fmus.documentation.events import event_section
from fmus.documentation.licences import model_terms
from fmus.documentation.prose import first_paragraph, prose
from fmus.documentation.rebuild import rebuild_commands
from fmus.documentation.tables import certificate_section, preset_table, variable_table
from fmus.toolchain.targets import Target
from plant_models.hybrid import HybridSystem

STYLE = """
body { font: 16px/1.5 system-ui, sans-serif; color: #222; background: #fff;
       max-width: 60rem; margin: 0 auto; padding: 1rem; }
h1, h2, h3 { line-height: 1.2; } h2 { margin-top: 2rem; border-bottom: 1px solid #ccc; }
code { font-size: 0.95em; background: #f3f3f3; padding: 0 0.2em; overflow-wrap: anywhere; }
code.formula { background: #eef4fb; }
pre { background: #f3f3f3; padding: 0.5rem; overflow-x: auto; }
.wide { overflow-x: auto; } table { border-collapse: collapse; }
th, td { text-align: left; vertical-align: top; padding: 0.2rem 0.6rem; border-bottom: 1px solid #ddd; }
dt { font-weight: bold; }
"""
INTERFACES = (("coSimulation", "co-simulation"), ("modelExchange", "model exchange"))


def page(system: HybridSystem, description: ModelDescription, preset: str | None, targets: Sequence[Target]) -> str:
    """The whole page.

    Args:
        system: the hybrid system. description: its model description. preset: preset of the start values.
        targets: platforms of the libraries and the compilers that built them.
    """
    chosen = preset if preset is not None else system.default_preset
    sections = {
        "Equations": _equations(system),
        "Inputs": variable_table(description, "input"),
        "Outputs": variable_table(description, "output"),
        "Parameters": variable_table(description, "parameter"),
        "Events": event_section(system, description),
        "Presets": preset_table(system, chosen),
        "Certificates": certificate_section(system),
        "Limits": _list(_limits(system, targets)),
        "Platforms": _platforms(targets) + _rebuild(system),
        "Source and licence": _origin(system),
    }
    body = "\n".join(f"<h2>{escape(title)}</h2>\n{content}" for title, content in sections.items() if content)
    return f"""<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8"/>
<meta name="viewport" content="width=device-width, initial-scale=1"/>
<title>{escape(description.modelName)}</title>
<style>{STYLE}</style>
</head>
<body>
<h1>{escape(description.modelName)}</h1>
{_head(description, chosen)}
{body}
</body>
</html>
"""


def _head(description: ModelDescription, preset: str | None) -> str:
    interfaces = " and ".join(text for name, text in INTERFACES if getattr(description, name) is not None)
    values = f" Start values: preset <code>{escape(preset)}</code>." if preset else ""
    words = f"<p>{escape(description.description)}</p>" if description.description else ""
    return f"{words}\n<p>FMI {escape(description.fmiVersion)}, {interfaces}.{values}</p>"


def _equations(system: HybridSystem) -> str:
    classes = type(system).__mro__[: type(system).__mro__.index(HybridSystem)]
    texts = [
        prose(cls.__doc__) if cls is type(system) else first_paragraph(cls.__doc__) for cls in classes if cls.__doc__
    ]
    options = ", ".join(f"<code>{escape(name)} = {escape(str(value))}</code>" for name, value in system.options.items())
    texts += [f"<p>This FMU was built with {options}.</p>"] if options else []
    return "\n".join(texts) or "<p>The author of the model gave no description of its equations.</p>"


def _limits(system: HybridSystem, targets: Sequence[Target]) -> list[str]:
    limits = [
        f"Between events it integrates with the method <code>{escape(system.method)}</code> on the fixed grid "
        "<code>start + k * internal_step</code>; splitting a communication step changes nothing there."
    ]
    if system.noises:
        limits.append(
            "Its noise is a function of <code>seed</code>, signal and index: the same numbers in every run, whatever "
            "was saved, "
            "restored or repeated. Two instances with the same seed have the same noise."
        )
    if len(targets) > 1:
        limits.append("Results on different platforms may differ in the last digits: their mathematical libraries do.")
    if hasattr(system, "certify"):
        limits.append(
            "The certificates are those of the presets; other values of the parameters are not covered by them."
        )
    return limits


def _platforms(targets: Sequence[Target]) -> str:
    items = []
    for target in targets:
        needs = f"; needs {escape(target.platform.needs)}" if target.platform.needs and target.compiler.zig else ""
        items.append(
            f"<code>{escape(target.platform.name)}</code>, compiled by {escape(target.compiler.version)}{needs}"
        )
    return _list(items)


def _rebuild(system: HybridSystem) -> str:
    commands = "".join(
        f"{escape(f'# {name}')}\n{escape(line)}\n" for name, line in rebuild_commands(system.name).items()
    )
    return (
        "<p>On any other platform one command in the folder <code>sources</code> builds it again; how to link it "
        "statically says "
        f"<code>staticLinking.txt</code>.</p>\n<pre>{commands}</pre>"
    )


def _origin(system: HybridSystem) -> str:
    source = f"<p>Source: {escape(system.source)}.</p>" if system.source else ""
    return (
        f"{source}\n<p>Built by {escape(_tool())}.</p>\n<p>{escape(model_terms(system))} All licences are in the "
        f"folder "
        "<code>licenses</code>.</p>"
    )


def _tool() -> str:
    try:
        return f"fmu-observer {version('fmu-observer')}"
    except PackageNotFoundError:
        return "fmu-observer"


def _list(items: Sequence[str]) -> str:
    return f"<ul>{''.join(f'<li>{item}</li>' for item in items)}</ul>"
