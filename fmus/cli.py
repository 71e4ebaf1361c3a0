"""Command line: ``fmus list``, ``fmus build NAME``, ``fmus info FILE``.

Exit codes: 0 done, 1 the FMU has problems, 2 a mistake of the user or a build that failed.
"""

from __future__ import annotations

import argparse
import ast
import sys
from collections.abc import Sequence
from importlib import import_module
from pathlib import Path
from typing import Any

OK, PROBLEMS, FAILED = 0, 1, 2


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line.

    Args:
        arguments: words after the program's name; those of the process by default.

    Returns:
        The exit code.
    """
    options = _parser().parse_args(arguments)
    try:
        code: int = options.run(options)
    except (ValueError, LookupError, OSError, RuntimeError, TypeError) as error:
        print(f"fmus: {error}", file=sys.stderr)
        return FAILED
    return code


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="fmus", description="Export train models and observers as FMUs.")
    commands = parser.add_subparsers(required=True, metavar="COMMAND")
    listing = commands.add_parser("list", help="models that can be exported, with their presets and options")
    listing.set_defaults(run=_list)
    build = commands.add_parser("build", help="export a model as a native FMU")
    build.add_argument("name", metavar="NAME", help="model name, see 'fmus list'")
    build.add_argument("--fmi", type=int, choices=(2, 3), default=3, help="FMI version (default 3)")
    build.add_argument("-o", "--output", type=Path, default=Path(), metavar="DIR", help="folder or .fmu file (default: here)")
    build.add_argument("--preset", metavar="P", help="preset whose values become the start values")
    build.add_argument("--option", action="append", default=[], metavar="K=V", help="option of the model; may be repeated")
    build.set_defaults(run=_build)
    info = commands.add_parser("info", help="what an FMU says about itself, and whether it is valid")
    info.add_argument("file", type=Path, metavar="FILE")
    info.set_defaults(run=_info)
    return parser


# -- list ---------------------------------------------------------------------------------------------------------------


def _list(_options: argparse.Namespace) -> int:
    recipes = import_module("fmus.recipes")
    for name, cls in recipes.RECIPES.items():
        print(f"{name:24} {_first_line(cls.description)}")
        if cls.presets:
            print(
                f"{'':24}   presets: {', '.join(cls.presets)}"
                + (f" (default {cls.default_preset})" if cls.default_preset else "")
            )
        for option, default in recipes.recipe_options(name).items():
            print(f"{'':24}   option {option} = {default}{_legal(cls.option_choices.get(option))}")
    return OK


def _legal(choices: Sequence[Any] | None) -> str:
    if not choices:
        return ""
    if isinstance(choices, range):
        return f", {choices[0]} to {choices[-1]}"
    return f", one of {', '.join(map(str, choices))}"


def _first_line(text: str) -> str:
    lines = text.strip().splitlines()
    return lines[0] if lines else ""


# -- build --------------------------------------------------------------------------------------------------------------


def _build(options: argparse.Namespace) -> int:
    recipes, building = import_module("fmus.recipes"), import_module("fmus.build")
    chosen = dict(_option(text, recipes, options.name) for text in options.option)
    system = recipes.recipe(options.name, **chosen)
    print(building.build_fmu(system, options.output, options.fmi, options.preset))
    return OK


def _option(text: str, recipes: Any, name: str) -> tuple[str, Any]:
    key, equals, value = text.partition("=")
    if not equals or not key:
        raise ValueError(f"--option {text!r}: write it as name=value, e.g. --option premise=live.")
    choices = recipes.RECIPES[name].option_choices.get(key, ()) if name in recipes.RECIPES else ()
    for choice in choices:
        if str(choice) == value:
            return key, choice
    if choices:
        raise ValueError(f"--option {text!r} is not legal: {key}{_legal(choices)}.")
    return key, _literal(value)


def _literal(text: str) -> Any:
    """A Python number, truth value or tuple where it is one, else the text itself."""
    try:
        return ast.literal_eval(text)
    except (ValueError, SyntaxError):
        return text


# -- info ---------------------------------------------------------------------------------------------------------------


def _info(options: argparse.Namespace) -> int:
    report = import_module("fmus.report")
    if not options.file.is_file():
        raise FileNotFoundError(f"{options.file} does not exist; give the path of an FMU.")
    print("\n".join(report.describe_file(options.file)))
    problems = report.problems_of(options.file)
    for problem in problems:
        print(f"problem: {problem}")
    return PROBLEMS if problems else OK


if __name__ == "__main__":
    sys.exit(main())
