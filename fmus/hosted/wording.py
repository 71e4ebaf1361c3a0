"""The words in a hosted FMU: its description, and the page in ``documentation/``. Text in, text out."""

from __future__ import annotations

from fmpy.model_description import ModelDescription

from fmus.documentation.page import render

_OVERHEAD = (
    "a step costs about 10 us more than the block's own Python, which takes 10 us to more than 100 us where "
    "native C takes 1 us"
)
"""Measured, see docs/hosted_export.md."""


def needs(package: str, oldest: tuple[int, int]) -> str:
    """What must be there, in one sentence without full stop.

    Args:
        package: version of fmu-observer.
        oldest: version of Python that suffices, major and minor.
    """
    return f"Python {oldest[0]}.{oldest[1]} or later with the package fmu-observer {package}"


def description_text(own: str, package: str, oldest: tuple[int, int], platform: str) -> str:
    """The attribute `description` of modelDescription.xml: the limits first, then what the model says of itself.

    Args:
        own: the model's own description.
        package: version of fmu-observer.
        oldest: version of Python that suffices, major and minor.
        platform: in the words of FMI 2.0.
    """
    return (
        f"NEEDS PYTHON: this FMU runs Python code and needs {needs(package, oldest)} on the machine that runs it. "
        f"Slow ({_OVERHEAD}); not for real-time targets. Only for {platform}; loads into Python processes such as "
        f"fmpy, and into other programs if they find Python's library (see documentation/index.html). {own}"
    ).strip()


def page(description: ModelDescription, source: str, package: str, oldest: tuple[int, int], built_minor: int) -> str:
    """The page documentation/index.html.

    Args:
        description: of the FMU.
        source: the model in words.
        package: version of fmu-observer.
        oldest: version of Python that suffices, major and minor.
        built_minor: of the Python 3 it was built with.

    Returns:
        HTML.
    """
    return render(
        "hosted.html.j2",
        description,
        needs=needs(package, oldest),
        source=source,
        overhead=_OVERHEAD,
        built_minor=built_minor,
    )
