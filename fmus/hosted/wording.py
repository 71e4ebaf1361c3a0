"""The words in a hosted FMU: its description, and the page in ``documentation/``. Text in, text out."""

from __future__ import annotations

from html import escape

from fmpy.model_description import ModelDescription

from fmus.documentation.tables import variable_table

OVERHEAD = (
    "a step costs about 10 us more than the block's own Python, which takes 10 us to more than 100 us where "
    "native C takes 1 us"
)
"""Measured, see docs/hosted_export.md."""


def needs(package: str, oldest: tuple[int, int]) -> str:
    """What must be there, in one sentence without full stop.

    Args:
        package: version of fmu-observer. oldest: of Python.
    """
    return f"Python {oldest[0]}.{oldest[1]} or later with the package fmu-observer {package}"


def description_text(own: str, package: str, oldest: tuple[int, int], platform: str) -> str:
    """The attribute `description` of modelDescription.xml: the limits first, then what the model says of itself.

    Args:
        own: the model's own description. package, oldest: see `needs`. platform: in the words of FMI 2.0.
    """
    return (
        f"NEEDS PYTHON: this FMU runs Python code and needs {needs(package, oldest)} on the machine that runs it. "
        f"Slow ({OVERHEAD}); not for real-time targets. Only for {platform}; loads into Python processes such as fmpy, "
        f"and into "
        f"other programs if they find Python's library (see documentation/index.html). {own}"
    ).strip()


def page(description: ModelDescription, source: str, package: str, oldest: tuple[int, int], built_minor: int) -> str:
    """The page documentation/index.html.

    Args:
        description: of the FMU. source: the model in words. package, oldest: see `needs`.
        built_minor: of the Python 3 it was built with.
    """
    tables = "".join(
        f"<h2>{causality.capitalize()}s</h2>{variable_table(description, causality)}"
        for causality in ("input", "output", "parameter")
    )
    return f"""<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><title>{escape(description.modelName)}</title></head><body>
<h1>{escape(description.modelName)}</h1>
<p>{escape(description.description or "")}</p>
<h2>What it needs</h2>
<ul>
<li>{escape(needs(package, oldest))} in the process that loads it, and all that the model imports.</li>
<li>The model: {escape(source)}.</li>
<li>In a program that is not Python: the library of Python. The FMU takes the one that is loaded already,
else the one that the environment variable FMU_OBSERVER_LIBPYTHON names,
else libpython3.{built_minor}.so.1.0 or another version where the system finds it.
Set PYTHONPATH to the folder in which fmu-observer is installed, or VIRTUAL_ENV to the environment.</li>
</ul>
<h2>Limits</h2>
<ul>
<li>FMI 2.0 co-simulation only; no model exchange, no directional derivatives. Events come
by count, time stamp and payload.</li>
<li>Slow: {escape(OVERHEAD)}. Instances share one Python: two threads do not run at the same time.
Not for real-time targets.</li>
<li>An FMU state is complete. Serialised states can be read by the same FMU with the same version of fmu-observer.</li>
<li>What the model prints, reads and imports happens in the process that loads the FMU.</li>
<li>In a program that is not Python, make the first instance before others are made in parallel threads.</li>
</ul>
{tables}</body></html>
"""
