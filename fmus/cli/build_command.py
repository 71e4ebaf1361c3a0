"""Command line: ``fmus build NAME ...``. Asks for models by name, builds them, and says what was written."""

from __future__ import annotations

import argparse
import ast
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import count
from pathlib import Path
from typing import Any, Literal

from fmu_observer import OBSERVERS
from fmu_observer.event_protocol import LATE_POLICIES, EventProtocol
from fmus.build import build_fmu
from fmus.cli.commands import argument, repeated
from fmus.cli.failures import EXPECTED
from fmus.cli.output import Output
from fmus.cli.progress import ProgressBar
from fmus.fmi.archive import open_archive
from fmus.hosted import build_hosted_fmu
from fmus.pack import check_target, fmu_path
from fmus.recipes import RECIPES, SYSTEM, legal_values, recipe
from fmus.toolchain.targets import choose_targets
from plant_models import PLANTS
from plant_models.hybrid.casadi_package import demand_casadi
from plant_models.repeated_names import repeated_names
from plant_models.user_file import load_class, make, names_a_file, names_code

Version = Literal[2, 3]
VERSIONS: dict[str, tuple[Version, ...]] = {"2": (2,), "3": (3,), "both": (2, 3)}


@dataclass(frozen=True)
class _BuildJob:
    """One FMU to build: what, for which version of FMI, and where to."""

    system: Any
    fmi_version: Version
    target: Path


GROUP = "Models"
PLACE = 2
HELP = "export models as native FMUs"
LOOKS = False
EXAMPLES = (
    "fmus build quasi_lpv_uio",
    "fmus build takagi_sugeno_cdo --fmi 3 --platform all -o out/",
    "fmus build locomotive odometer driver --fmi both -o out/",
    "fmus build my_model.py:Trolley --platform host,x86_64-windows",
    "fmus build my_model.py:Classifier --hosted",
)
PARSER: dict[str, Any] = {}
ARGUMENTS = (
    argument("names", nargs="*", metavar="NAME", help="model name, see 'fmus list', or path/to/file.py:ClassName"),
    argument("--all", action="store_true", help="all models that 'fmus list' shows"),
    argument(
        "--fmi", choices=tuple(VERSIONS), default="3", help="FMI version (default 3); both: folders fmi2 and fmi3"
    ),
    argument(
        "--platform",
        default="host",
        metavar="P",
        help="host (default), all, or names separated by commas, "
        "e.g. x86_64-linux,win64; named ones need the extra 'cross'",
    ),
    argument("-o", "--output", type=Path, default=Path(), metavar="DIR", help="folder or .fmu file (default: here)"),
    argument("--preset", metavar="P", help="preset whose values become the start values"),
    repeated("--option", "K=V", "option of the model"),
    argument(
        "--events",
        choices=("clocks", "counts"),
        help="how an FMI 3 FMU is notified of events: by clocks, in event "
        "mode (default), or by counts, for tools without event mode",
    ),
    argument(
        "--late-policy",
        choices=LATE_POLICIES,
        help="what to do with late events; start value of the parameter late_policy (default: as the model declares, "
        "usually replay)",
    ),
    argument("--hosted", action="store_true", help="FMI 2.0 with Python inside, for a model that cannot be traced"),
)


def execute(options: argparse.Namespace) -> Output:
    """Build what the options ask for; the paths go to standard output, everything else to standard error.

    Raises:
        ValueError, LookupError, OSError, RuntimeError, TypeError: a mistake of the user.
    """
    if options.hosted:
        return _all_built(lambda: _hosted(options))
    jobs, protocol = _jobs(options), EventProtocol(options.events, options.late_policy)
    for job in jobs:
        protocol.counts(job.fmi_version)  # refuses clocks in FMI 2 before anything is built
        check_target(fmu_path(job.system.name, job.target))
    return _all_built(lambda: _native(jobs, protocol, options))


def _all_built(build: Callable[[], Iterator[Path]]) -> Output:
    """The paths of what was built, also where a later one could not be."""
    paths: list[Path] = []
    failure: BaseException | None = None
    try:
        paths.extend(build())
    except (*EXPECTED, KeyboardInterrupt) as error:
        failure = error
    return Output(["\n".join(map(str, paths))], {"built": paths}, error=failure)


def _native(jobs: Sequence[_BuildJob], protocol: EventProtocol, options: argparse.Namespace) -> Iterator[Path]:
    """Build one after the other, with a bar over the libraries of all."""
    libraries = len(choose_targets(options.platform)) * len(jobs)
    number = count(1)
    with ProgressBar("library", silent=libraries < 2) as bar:
        for job in jobs:

            def progress(platform: str, job: _BuildJob = job) -> None:
                bar(next(number), libraries, f"{job.system.name} {platform}")

            settings: dict[str, Any] = {"platforms": options.platform, "protocol": protocol, "progress": progress}
            path = build_fmu(job.system, job.target, job.fmi_version, options.preset, **settings)
            bar.clear()
            print(_summary(job, path), file=sys.stderr, flush=True)
            yield path


def _hosted(options: argparse.Namespace) -> Iterator[Path]:
    """FMUs with Python inside, see `fmus.hosted`; a file of the user's goes into them."""
    if options.platform != "host":
        raise ValueError("--hosted builds for this machine only; leave --platform out.")
    for name in _names(options):
        model = _system(name, options.option)
        if names_a_file(name):
            chosen = dict(_option(text, type(model).option_choices) for text in options.option)
            place = f"{name.rpartition('.py')[0]}.py:{type(model).__name__}"
            path = build_hosted_fmu(place, options.output, options=chosen, preset=options.preset)
        else:
            path = build_hosted_fmu(model, options.output, preset=options.preset)
        size = f"{path.stat().st_size / 1000:.0f} kB"
        print(f"{model.name}: FMI 2.0, {size}, runs in Python", file=sys.stderr, flush=True)
        yield path


def _summary(job: _BuildJob, path: Path) -> str:
    platforms = open_archive(path).platforms
    return f"{job.system.name}: FMI {job.fmi_version}.0, {path.stat().st_size / 1000:.0f} kB, {', '.join(platforms)}"


# -- what to build ----------------------------------------------------------------------------------------------------


def _jobs(options: argparse.Namespace) -> list[_BuildJob]:
    names, versions = _names(options), VERSIONS[options.fmi]
    if len(names) > 1 and (options.preset or options.option):
        raise ValueError("--preset and --option belong to one model; build the models one by one.")
    several = len(names) * len(versions) > 1
    if several and options.output.suffix.lower() == ".fmu":
        raise ValueError(f"-o {options.output} is one file, but several FMUs were asked for; give a folder.")
    systems = [_system(name, options.option) for name in names]
    if twice := repeated_names(system.name for system in systems):
        raise ValueError(f"Several models have the name {', '.join(twice)} and would overwrite each other.")
    folders = {
        version: options.output / f"fmi{version}" if len(versions) > 1 else options.output for version in versions
    }
    return [_BuildJob(system, version, folders[version]) for version in versions for system in systems]


def _names(options: argparse.Namespace) -> list[str]:
    if options.all == bool(options.names):
        raise ValueError("Give the names of models, see 'fmus list', or --all.")
    if not options.all:
        return list(options.names)
    demand_casadi()
    return [name for registry in (PLANTS, OBSERVERS) for name, cls in registry.usable().items() if cls.traceable]


def _system(name: str, words: Sequence[str]) -> Any:
    if name not in RECIPES and names_code(name):
        cls = load_class(name, SYSTEM)
        return make(cls, dict(_option(text, cls.option_choices) for text in words))
    choices = RECIPES[name].option_choices if name in RECIPES else {}
    return recipe(name, **dict(_option(text, choices) for text in words))


def _option(text: str, known: Mapping[str, Sequence[Any]]) -> tuple[str, Any]:
    key, equals, value = text.partition("=")
    if not equals or not key:
        raise ValueError(f"--option {text!r}: write it as name=value, e.g. --option premise=live.")
    choices = known.get(key, ())
    for choice in choices:
        if str(choice) == value:
            return key, choice
    if value in choices:  # a class of the user's
        return key, value
    if choices:
        raise ValueError(f"--option {text!r} is not legal: {key}{legal_values(choices)}.")
    return key, _literal(value)


def _literal(text: str) -> Any:
    """A Python number, truth value or tuple where it is one, else the text itself."""
    try:
        return ast.literal_eval(text)
    except (ValueError, SyntaxError):
        return text
