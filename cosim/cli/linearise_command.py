"""``cosim linearise FMU|MODEL``: matrices A, B, C, D at a point, with eigenvalues and what is seen and reached."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from pathlib import Path

import fmu_observer
import plant_models
from cosim.cli.arguments import positive_number, settings_argument
from cosim.cli.model_info import in_own_words
from cosim.cli.scenarios import parse_setting, setting_number
from cosim.cli.stated_units import UNIT, stated_of
from cosim.components.loading import describe_fmu
from cosim.components.stated_units import StatedUnit
from cosim.errors import ScenarioError, nearest
from cosim.fmu_model.exact import linearise_system
from cosim.fmu_model.linearisation import Linearisation
from cosim.fmu_model.linearise import linearise_fmu
from cosim.fmu_model.sealed import declared_states
from cosim.run.component_models import make_declared
from cosim.scenario.scenario_tables import ComponentTable
from fmus.cli.commands import argument
from fmus.cli.output import Output
from fmus.near_files import what_it_is
from plant_models.hybrid import HybridSystem
from plant_models.user_file import names_code

GROUP = "Models and files"
PLACE = 5
HELP = "linearise an FMU or a model at a point"
LOOKS = False
EXAMPLES = (
    "cosim linearise locomotive",
    "cosim linearise vendor.fmu",
)
PARSER = {
    "description": (
        "Linearise an FMU, a plant or an observer at a point. Model exchange and models of ours give matrices of "
        "continuous time, an FMU with co-simulation only those from one communication step to the next. Events, "
        "such as samples, are left out, and said."
    ),
    "epilog": "Exit codes: 0 done, 2 error.",
}
ARGUMENTS = (
    argument("model", metavar="FMU|MODEL", help="an .fmu file; or a plant or observer by name, file.py:Class"),
    argument(
        "--at",
        type=float,
        default=0.0,
        metavar="SECONDS",
        help="instant; an FMU is run up to it (default: 0, its start)",
    ),
    settings_argument("a state, an input or a parameter; a state that is set is not taken from the run"),
    argument(
        "--states",
        nargs="+",
        metavar="NAME",
        help="of an FMU that declares no continuous states: the variables that hold its state",
    ),
    argument("--preset", metavar="NAME", help="of a model of ours: values to start from"),
    argument("--inputs", nargs="+", metavar="NAME", help="inputs of B and D (default: all)"),
    argument("--outputs", nargs="+", metavar="NAME", help="outputs of C and D (default: all)"),
    argument(
        "--interface",
        choices=("model-exchange", "co-simulation"),
        help="of an FMU that has both (default: model exchange)",
    ),
    argument(
        "--step",
        type=positive_number,
        default=0.01,
        metavar="SECONDS",
        help="communication step of a co-simulation (default: 0.01)",
    ),
    UNIT,
    argument("-o", "--output", type=Path, metavar="FILE", help="write .json, .npz or .mat"),
)


def execute(options: argparse.Namespace) -> Output:
    """The linearisation, written where the options ask for it.

    Raises:
        CosimError: the model cannot be linearised, or the file cannot be written.
    """
    if not options.at >= 0.0:
        raise ScenarioError(f"--at {options.at:g}: expected an instant from 0 s on.")
    settings = {name: setting_number("--set", name, value) for name, value in map(parse_setting, options.settings)}
    is_file = str(options.model).lower().endswith(".fmu")
    stated = stated_of(options.model, options.unit)
    found = _of_fmu(options, settings, stated) if is_file else _of_model(options, settings)
    if options.output is not None:
        found.save(options.output)
    return Output(found.parts(), found.to_dict())


def _of_fmu(options: argparse.Namespace, settings: dict[str, float], stated: Mapping[str, StatedUnit]) -> Linearisation:
    if options.preset is not None:
        raise ScenarioError("--preset belongs to models of ours; set the parameters of an FMU by --set NAME=VALUE.")
    described = describe_fmu(options.model, Path(options.model).stem)
    states = set(options.states or declared_states(described))
    inputs = set(described.names("input"))
    return linearise_fmu(
        options.model,
        t=options.at,
        states={name: value for name, value in settings.items() if name in states},
        inputs={name: value for name, value in settings.items() if name in inputs},
        parameters={name: value for name, value in settings.items() if name not in states | inputs},
        state_names=options.states,
        by_inputs=options.inputs,
        outputs=options.outputs,
        interface=options.interface,
        step=options.step,
        units=stated,
    )


def _of_model(options: argparse.Namespace, settings: dict[str, float]) -> Linearisation:
    name, rooms = options.model, {"model": plant_models.PLANTS, "observer": fmu_observer.OBSERVERS}
    kind = next((kind for kind, room in rooms.items() if name in room), "model" if names_code(name) else None)
    if kind is None and (is_what := what_it_is(Path(name))):
        raise ScenarioError(f"{name} is {is_what}; expected an .fmu file, or a plant or observer by name.")
    if kind is None:
        known = [*plant_models.PLANTS, *fmu_observer.OBSERVERS]
        raise ScenarioError(f"There is no plant or observer {name!r}, and it is no .fmu file; {nearest(name, known)}")
    system = make_declared(ComponentTable.model_validate({kind: name}), "linearise")
    if not isinstance(system, HybridSystem):
        raise ScenarioError(f"{name}: plain Python has no equations that could be linearised.")
    states = {n for signal in system.states for n in signal.scalar_names}
    inputs = {n for signal in system.inputs for n in signal.scalar_names}
    if options.states:
        raise ScenarioError("--states belongs to FMUs; a model of ours declares its own.")
    with in_own_words(name, f"{name} at t = {options.at:g} s"):
        found = linearise_system(
            system,
            t=options.at,
            states={n: value for n, value in settings.items() if n in states},
            inputs={n: value for n, value in settings.items() if n in inputs},
            parameters={n: value for n, value in settings.items() if n not in states | inputs},
            preset=options.preset,
        )
    return found.part(options.inputs, options.outputs)
