"""modelDescription.xml of a test FMU in FMI 1.0, 2.0 or 3.0, from one list of variables. Knows no C."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal
from xml.sax.saxutils import quoteattr

from plant_models.hybrid.units import BASE_SYMBOLS, parse_unit

Version = Literal[1, 2, 3]

OLD_TYPES = {
    "Float64": "Real",
    "Int32": "Integer",
    "Boolean": "Boolean",
    "String": "String",
    "Enumeration": "Enumeration",
}
"""The types of FMI 1.0 and 2.0 under their names in FMI 3.0."""


@dataclass(frozen=True)
class Variable:
    """One variable.

    Args:
        name: its name. reference: value reference. causality: in the words of FMI 2.0 and 3.0. type: in those of FMI
        3.0.
        variability: by default ``continuous`` for Float64 inputs, outputs and locals, else as FMI 3.0 has it.
        start: start value; arrays row by row, binaries as hexadecimal text.
        unit: of a Float64. depends: names of the inputs an output depends on directly; None where nothing is declared.
        shape: of an array: numbers, or value references of structural parameters as text. clocks: value references.
        declared_type: name of an enumeration type. alias: ``alias`` or ``negatedAlias``, FMI 1.0 only.
        further: other attributes of the element in FMI 3.0.
    """

    name: str
    reference: int
    causality: str
    type: str = "Float64"
    variability: str = ""
    start: Any = None
    unit: str | None = None
    depends: Sequence[str] | None = ()
    shape: Sequence[int | str] = ()
    clocks: Sequence[int] = ()
    declared_type: str | None = None
    alias: str | None = None
    further: Mapping[str, str] = field(default_factory=dict)

    @property
    def changes(self) -> str:
        """The variability."""
        if self.variability:
            return self.variability
        if self.causality in ("parameter", "structuralParameter"):
            return "fixed"
        return "continuous" if self.type in ("Float64", "Float32") else "discrete"

    @property
    def is_start(self) -> bool:
        """Whether it has a start value in the file."""
        return self.start is not None


@dataclass(frozen=True)
class Model:
    """A model without its numbers.

    Args:
        name: model identifier. token: GUID or instantiation token. variables: all of them; the time first, reference 0,
            which appears in FMI 3.0 only. flags: capabilities as attributes of the interface. enumerations: items by
            type name.
        categories: log categories. tolerance: of the default experiment.
    """

    name: str
    token: str
    variables: Sequence[Variable]
    flags: Mapping[str, str]
    enumerations: Mapping[str, Sequence[str]] = field(default_factory=dict)
    categories: Sequence[str] = ()
    tolerance: float | None = None


def description_xml(model: Model, version: Version) -> str:
    """The text of modelDescription.xml."""
    return {1: _fmi1, 2: _fmi2, 3: _fmi3}[version](model)


def attributes(**stated: Any) -> str:
    """Attributes of an element; None is left out."""
    return "".join(f" {key}={quoteattr(_text(value))}" for key, value in stated.items() if value is not None)


def _text(value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, float):
        return repr(value)
    if isinstance(value, list | tuple):
        return " ".join(_text(v) for v in value)
    return str(value)


def _units(model: Model) -> list[str]:
    return sorted({v.unit for v in model.variables if v.unit is not None})


def _unit_definitions(model: Model) -> str:
    lines = []
    for name in _units(model):
        unit = parse_unit(name)
        powers = {symbol: power for symbol, power in zip(BASE_SYMBOLS, unit.exponents, strict=True) if power}
        factor = unit.factor if unit.factor != 1.0 else None
        base = attributes(**powers, factor=factor, offset=unit.offset or None)
        lines.append(f"    <Unit{attributes(name=name)}><BaseUnit{base}/></Unit>\n")
    return f"  <UnitDefinitions>\n{''.join(lines)}  </UnitDefinitions>\n" if lines else ""


def _categories(model: Model) -> str:
    items = "".join(f"<Category{attributes(name=name)}/>" for name in model.categories)
    return f"  <LogCategories>{items}</LogCategories>\n" if items else ""


def _references(names: Iterable[str], number: Mapping[str, int]) -> str:
    return " ".join(str(number[name]) for name in names)


def _initial(v: Variable) -> str | None:
    return "exact" if v.causality in ("output", "local") and v.is_start else None


def _structure(number: Mapping[str, int], key: str, variables: Sequence[Variable]) -> tuple[list[str], list[str]]:
    """The attributes of the outputs, and of the initial unknowns."""
    outputs = [v for v in variables if v.causality == "output"]
    entries = []
    for v in outputs:
        depends = None if v.depends is None else _references(v.depends, number)
        entries.append(attributes(**{key: number[v.name]}, dependencies=depends))
    unknowns = [attributes(**{key: number[v.name]}) for v in outputs if _initial(v) is None and not v.clocks]
    return entries, unknowns


# -- FMI 1.0
# --------------------------------------------------------------------------------------------------------------


def _fmi1(model: Model) -> str:
    units = "".join(f"    <BaseUnit{attributes(unit=name)}/>\n" for name in _units(model))
    types = "".join(
        f"    "
        f"<Type{attributes(name=name)}><EnumerationType>{''.join(f'<Item{attributes(name=item)}/>' for item in items)}"
        "</EnumerationType></Type>\n"
        for name, items in model.enumerations.items()
    )
    variables = "".join(_fmi1_variable(v) for v in model.variables if v.causality != "independent")
    flags = attributes(**model.flags)
    return (
        '<?xml version="1.0" encoding="UTF-8"?>\n'
        f"<fmiModelDescription "
        f'fmiVersion="1.0"{attributes(modelName=model.name, modelIdentifier=model.name, guid=model.token)}'
        ' variableNamingConvention="structured" numberOfContinuousStates="0" numberOfEventIndicators="0">\n'
        + (f"  <UnitDefinitions>\n{units}  </UnitDefinitions>\n" if units else "")
        + (f"  <TypeDefinitions>\n{types}  </TypeDefinitions>\n" if types else "")
        + f'  <DefaultExperiment startTime="0.0" stopTime="1.0"{attributes(tolerance=model.tolerance)}/>\n'
        + f"  <ModelVariables>\n{variables}  </ModelVariables>\n"
        + f"  "
        f"<Implementation><CoSimulation_StandAlone><Capabilities{flags}/></CoSimulation_StandAlone></Implementation>\n"
        + "</fmiModelDescription>\n"
    )


def _fmi1_variable(v: Variable) -> str:
    parameter = v.causality == "parameter"
    causality = v.causality if v.causality in ("input", "output") else "internal"
    head = attributes(name=v.name, valueReference=v.reference, variability="parameter" if parameter else v.changes)
    head += attributes(causality=causality, alias=v.alias)
    value = attributes(declaredType=v.declared_type, unit=v.unit, start=v.start)
    depends = ""
    if v.causality == "output" and v.depends is not None:
        depends = f"<DirectDependency>{''.join(f'<Name>{name}</Name>' for name in v.depends)}</DirectDependency>"
    return f"    <ScalarVariable{head}><{OLD_TYPES[v.type]}{value}/>{depends}</ScalarVariable>\n"


# -- FMI 2.0
# --------------------------------------------------------------------------------------------------------------


def _types(model: Model, begin: str, end: str) -> str:
    """The enumerations of a model; `begin` has a place for the attributes."""
    return "".join(
        f"    {begin.format(attributes(name=name))}"
        + "".join(f"<Item{attributes(name=item, value=i)}/>" for i, item in enumerate(items, start=1))
        + f"{end}\n"
        for name, items in model.enumerations.items()
    )


def _document(model: Model, head: str, types: str, variables: str, structure: str) -> str:
    """The text of FMI 2.0 and 3.0 from its parts."""
    return (
        '<?xml version="1.0" encoding="UTF-8"?>\n'
        f'<fmiModelDescription{head} variableNamingConvention="structured">\n'
        f"  <CoSimulation{attributes(modelIdentifier=model.name, **model.flags)}/>\n"
        + _unit_definitions(model)
        + (f"  <TypeDefinitions>\n{types}  </TypeDefinitions>\n" if types else "")
        + _categories(model)
        + f'  <DefaultExperiment startTime="0.0" stopTime="1.0"{attributes(tolerance=model.tolerance)}/>\n'
        + f"  <ModelVariables>\n{variables}  </ModelVariables>\n"
        + f"  <ModelStructure>\n{structure}  </ModelStructure>\n</fmiModelDescription>\n"
    )


def _fmi2(model: Model) -> str:
    kept = [v for v in model.variables if v.causality != "independent"]
    number = {v.name: i for i, v in enumerate(kept, start=1)}
    entries, unknowns = _structure(number, "index", kept)
    outputs = "".join(f"<Unknown{entry}/>" for entry in entries)
    initial = "".join(f"<Unknown{entry}/>" for entry in unknowns)
    types = _types(model, "<SimpleType{}><Enumeration>", "</Enumeration></SimpleType>")
    variables = "".join(map(_fmi2_variable, kept))
    structure = f"    <Outputs>{outputs}</Outputs>\n" if outputs else ""
    structure += f"    <InitialUnknowns>{initial}</InitialUnknowns>\n" if initial else ""
    return _document(
        model, attributes(fmiVersion="2.0", modelName=model.name, guid=model.token), types, variables, structure
    )


def _fmi2_variable(v: Variable) -> str:
    head = attributes(
        name=v.name, valueReference=v.reference, causality=v.causality, variability=v.changes, initial=_initial(v)
    )
    value = attributes(declaredType=v.declared_type, unit=v.unit, start=v.start)
    return f"    <ScalarVariable{head}><{OLD_TYPES[v.type]}{value}/></ScalarVariable>\n"


# -- FMI 3.0
# --------------------------------------------------------------------------------------------------------------


def _fmi3(model: Model) -> str:
    number = {v.name: v.reference for v in model.variables}
    entries, unknowns = _structure(number, "valueReference", model.variables)
    structure = "".join(f"    <Output{entry}/>\n" for entry in entries)
    structure += "".join(f"    <InitialUnknown{entry}/>\n" for entry in unknowns)
    types = _types(model, "<EnumerationType{}>", "</EnumerationType>")
    variables = "".join(map(_fmi3_variable, model.variables))
    head = attributes(fmiVersion="3.0", modelName=model.name, instantiationToken=model.token)
    return _document(model, head, types, variables, structure)


def _fmi3_variable(v: Variable) -> str:
    by_element = v.type in ("String", "Binary")
    head = attributes(
        name=v.name,
        valueReference=v.reference,
        causality=v.causality,
        variability=v.changes if v.type != "Clock" else None,
        initial=_initial(v),
        declaredType=v.declared_type,
        unit=v.unit,
        start=None if by_element else v.start,
        clocks=" ".join(map(str, v.clocks)) or None,
        **v.further,
    )
    inner = "".join(
        f"<Dimension{attributes(**({'start': d} if isinstance(d, int) else {'valueReference': d}))}/>" for d in v.shape
    )
    if by_element and v.start is not None:
        starts = v.start if isinstance(v.start, list | tuple) else [v.start]
        inner += "".join(f"<Start{attributes(value=text)}/>" for text in starts)
    return f"    <{v.type}{head}>{inner}</{v.type}>\n" if inner else f"    <{v.type}{head}/>\n"
