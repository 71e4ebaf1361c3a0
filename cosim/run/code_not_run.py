"""A component whose class is code that is not run, as far as texts say what it is: the file of the class and the
connections of the scenario. Reads files, runs none.
"""

from __future__ import annotations

import ast
from collections.abc import Iterable, Iterator, Mapping
from inspect import Parameter, Signature
from pathlib import Path
from typing import Any

from cosim.components.python import PythonComponent
from cosim.components.python_model import UNKNOWN_UNIT, PythonModel
from cosim.coupling.connection import Link
from cosim.errors import CosimError
from cosim.scenario.scenario_tables import ComponentTable
from plant_models.hybrid.units import UnitError, parse_unit
from plant_models.user_file import CodeNotRunError, names_a_file, split_name

NOT_RUN = "code, not run"
"""Kind of such a component."""

_PORTS = ("inputs", "outputs")
_BALISE = "balise"


class _CodeComponent(PythonComponent):
    """A component that can be asked and not stepped.

    Args:
        name: in the scenario. model: what is known of it. source: its class, as the scenario names it.
    """

    def __init__(self, name: str, model: PythonModel, source: str) -> None:
        super().__init__(name, model, source)
        self.kind = NOT_RUN


def is_code_not_run(error: BaseException | None) -> bool:
    """Whether an error goes back to code that was not run.

    Args:
        error: as it was raised.
    """
    while error is not None and not isinstance(error, CodeNotRunError):
        error = error.__cause__ or error.__context__
    return error is not None


def code_component(name: str, table: ComponentTable, links: Iterable[Link], where: str) -> PythonComponent:
    """What is known of a component whose code is not run.

    Args:
        name: of the component. table: its table. links: connections of the scenario. where: place for messages.

    Raises:
        CosimError: what the texts say of it contradicts itself.
    """
    model = table.model or table.observer or f"a filter over {table.fmu}"
    ports = _declared(str(model), table)
    for text, port in _connected(name, links):
        known = set(ports["inputs"]) | set(ports["outputs"])
        variable, bracket, index = text.partition("[")
        if variable not in known and text not in known:
            ports[port][variable if bracket and "," not in index else text] = UNKNOWN_UNIT
    members = {**ports, "__signature__": _signature(table), "step": _step, "__doc__": str(model)}
    stand_in = type(str(model).rpartition(":")[2] or "Code", (), members)
    try:
        return _CodeComponent(name, PythonModel(stand_in, {}, where), str(model))
    except CosimError as error:
        raise type(error)(f"{error} {model} was not run; --trust runs it.") from error


def code_warnings(components: Mapping[str, Any]) -> list[str]:
    """What has to be said of components whose code was not run.

    Args:
        components: by name.
    """
    return [
        f"{name}: {one.source} is code and was not run: what is shown of it stands in its text and in the connections; "
        "--trust runs it."
        for name, one in components.items()
        if one.kind == NOT_RUN
    ]


def _step(_self: Any, _t: float, _inputs: Any, _dt: float) -> None:
    """Nothing: nobody steps it."""


def _balise(_self: Any, stamp: float, position: float, location_accuracy: float, odometer_reading: float) -> None:
    """Nothing: nobody notifies it."""


def _signature(table: ComponentTable) -> Signature:
    """A constructor that takes the parameters of the scenario."""
    numbers = {name: value for name, value in table.parameters.items() if name.isidentifier()}
    return Signature([Parameter(name, Parameter.KEYWORD_ONLY, default=value) for name, value in numbers.items()])


def _connected(name: str, links: Iterable[Link]) -> Iterator[tuple[str, str]]:
    """The variables of a component that connections name, and whether as inputs or outputs."""
    for source, target, *_ in links:
        for end, port in ((source, "outputs"), (target, "inputs")):
            owner, _, variable = end.partition(".")
            if owner == name:
                yield variable, port


def _declared(model: str, table: ComponentTable) -> dict[str, Any]:
    """What the text of the class declares: of inputs and outputs unit, or unit and size, by name, and whether it speaks
    of balises; nothing where it is not found, or computes its declarations.
    """
    found: dict[str, Any] = {port: {} for port in _PORTS}
    if table.filter is not None and table.filter.balise is not None:
        found[_BALISE] = _balise
    if not names_a_file(model):
        return found
    text, wanted = split_name(model)
    name = table.model or table.observer
    try:
        parsed = ast.parse(Path(name.folder if name is not None else ".", text).read_bytes())
    except (OSError, ValueError, SyntaxError, RecursionError, MemoryError):
        return found
    classes = [node for node in parsed.body if isinstance(node, ast.ClassDef) and wanted in ("", node.name)]
    for node in classes[:1] if wanted or len(classes) == 1 else ():
        found |= {_BALISE: _balise} if _BALISE in ast.dump(node) else {}
        for assigned in node.body:
            names = [assigned.target] if isinstance(assigned, ast.AnnAssign) else getattr(assigned, "targets", [])
            for port in (target.id for target in names if isinstance(target, ast.Name) and target.id in _PORTS):
                found[port] |= dict(_signals(assigned.value))  # type: ignore[attr-defined] # of an assignment
    return found


def _signals(stated: ast.expr | None) -> Iterator[tuple[str, Any]]:
    """Names of signals with their units, and sizes, in ``{"speed": "m/s"}`` or ``(output_signal("speed", "m/s"),)``."""
    if isinstance(stated, ast.Dict):
        pairs = [(key, value) for key, value in zip(stated.keys, stated.values, strict=True) if key is not None]
    else:
        elements = stated.elts if isinstance(stated, ast.Tuple | ast.List) else []
        calls = [e for e in elements if isinstance(e, ast.Call) and len(e.args) > 1]
        pairs = [(e, ast.Constant(UNKNOWN_UNIT)) for e in elements if isinstance(e, ast.Constant)]
        pairs += [(e.args[0], _with_size(e)) for e in calls]
    for key, value in pairs:
        try:
            name, unit = ast.literal_eval(key), ast.literal_eval(value)
            parse_unit(unit[0] if isinstance(unit, tuple) else unit)
        except (ValueError, TypeError, LookupError, UnitError):
            continue
        if isinstance(name, str):
            yield name, unit


def _with_size(call: ast.Call) -> ast.expr:
    """The unit of ``input_signal("speed", "m/s", size=3)``, with its size."""
    size = next((keyword.value for keyword in call.keywords if keyword.arg == "size"), None)
    return call.args[1] if size is None else ast.Tuple([call.args[1], size])
