"""Builds FMUs from exchange.c: model exchange only, of FMI 1, 2 and 3, and the descriptions that go with them."""

from __future__ import annotations

import re
from pathlib import Path

from test_fmus.build import compiled

from fmus.pack import pack_fmu
from fmus.toolchain.compile import library_name
from fmus.toolchain.platforms import host_platform

STATES = {"DECAY": 1, "BALL": 2, "TRAIN": 2, "STAIR": 0, "STEPS": 1, "CHATTERS": 0, "UNSETTLED": 0, "ESCAPES": 2}
STATES |= {"REFUSES": 1, "OSCILLATES": 2, "REACTION": 2, "REMEMBERS": 1}
SLOPES = ("OSCILLATES", "REACTION")
"""Those that have directional derivatives."""
INDICATORS = {"BALL": 1}
NAMES = ("position", "speed")
COUNT = (
    '<ScalarVariable name="count" valueReference="6" causality="output" variability="discrete"><Integer/>'
    "</ScalarVariable>"
)
COUNT_3 = '<Int32 name="count" valueReference="6" causality="output"/>'
UNITS = (
    '<UnitDefinitions><Unit name="m"><BaseUnit m="1"/></Unit><Unit name="m/s"><BaseUnit m="1" s="-1"/></Unit>'
    "</UnitDefinitions>"
)


def exchange_fmu(
    folder: Path,
    model: str,
    version: int = 2,
    *,
    saves: bool = True,
    units: bool = False,
    lie: str = "",
    counts: bool = True,
    arrays: bool = False,
) -> Path:
    """A model exchange FMU.

    Args:
        folder: where it goes. model: a MODEL_... macro without the prefix. version: of FMI.
        saves: whether it declares that its state can be saved. units: whether its variables have units.
        lie: a LIE_... macro without the prefix. counts: whether the description has the count, which is discrete.
        arrays: of FMI 3: whether its two states are one array, ``position``.
    """
    folder.mkdir(parents=True, exist_ok=True)
    config = f"#define VERSION {version}\n#define MODEL_{model}\n#define LIE_{lie}\n"
    library = compiled("exchange.c", config + ("#define ARRAYS\n" if arrays else ""), "fmu")
    platform, text = host_platform(), _described(model, version, saves, units, counts)
    content = {
        "modelDescription.xml": (_in_arrays(text) if arrays else text).encode(),
        f"binaries/{platform.fmi2_folder if version < 3 else platform.name}/{library_name('fmu')}": library,
    }
    return pack_fmu(content, folder / f"{model.lower()}{version}.fmu")


def _described(model: str, version: int, saves: bool, units: bool, counts: bool) -> str:
    """The description; without the count the variables behind it have other places."""
    text = _DESCRIPTIONS[version](model, saves, units)
    if counts:
        return text
    n = STATES[model]
    for dropped in (COUNT, f'<Unknown index="{n + 2}"/>', COUNT_3, '<Output valueReference="6"/>'):
        text = text.replace(dropped, "")
    for i in range(n):
        text = text.replace(f'<Unknown index="{n + 3 + i}"/>', f'<Unknown index="{n + 2 + i}"/>')
    return text


def _in_arrays(text: str) -> str:
    """The description of two states in FMI 3 with one array for both, and one for their derivatives."""
    for dropped in ("<Float64 name=.speed.[^>]*/>", "<Float64 name=.der.speed.. [^>]*/>"):
        text = re.sub(dropped, "", text)
    for dropped in ('<Output valueReference="2"/>', '<ContinuousStateDerivative valueReference="5"/>'):
        text = text.replace(dropped, "")
    wide = r'\1><Dimension start="2"/></Float64>'
    return re.sub(r'(<Float64 name="(?:position|der\(position\))"[^>]*)/>', wide, text)


def _unit(index: int, units: bool) -> str:
    return f' unit="{("m", "m/s")[index]}"' if units else ""


def _first(model: str, _saves: bool, units: bool) -> str:
    outputs = "".join(
        f'<ScalarVariable name="{NAMES[i]}" valueReference="{i + 1}" causality="output"><Real{_unit(i, units)}/>'
        "</ScalarVariable>"
        for i in range(STATES[model])
    )
    return f"""<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="1.0" modelName="{model}" modelIdentifier="fmu" guid="1"
  numberOfContinuousStates="{STATES[model]}" numberOfEventIndicators="{INDICATORS.get(model, 0)}">
  <DefaultExperiment startTime="0" stopTime="3"/>
  <ModelVariables>{outputs}
    <ScalarVariable name="input" valueReference="3" causality="input"><Real start="0"/></ScalarVariable>
    {COUNT}
  </ModelVariables>
</fmiModelDescription>"""


def _second(model: str, saves: bool, units: bool) -> str:
    n = STATES[model]
    outputs = "".join(
        f'<ScalarVariable name="{NAMES[i]}" valueReference="{i + 1}" causality="output"><Real{_unit(i, units)}/>'
        "</ScalarVariable>"
        for i in range(n)
    )
    rates = "".join(
        f'<ScalarVariable name="der({NAMES[i]})" valueReference="{i + 4}" causality="local">'
        f'<Real derivative="{i + 1}"/></ScalarVariable>'
        for i in range(n)
    )
    listed = "".join(f'<Unknown index="{n + 3 + i}"/>' for i in range(n))
    read = "".join(f'<Unknown index="{i + 1}"/>' for i in range(n))
    return f"""<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="{model}" guid="1" numberOfEventIndicators="{INDICATORS.get(model, 0)}">
  <ModelExchange modelIdentifier="fmu" canGetAndSetFMUstate="{str(saves).lower()}"
    providesDirectionalDerivative="{str(model in SLOPES).lower()}"/>{UNITS if units else ""}
  <DefaultExperiment startTime="0" stopTime="3"/>
  <ModelVariables>{outputs}
    <ScalarVariable name="input" valueReference="3" causality="input"><Real start="0"/></ScalarVariable>
    {COUNT}
    {rates}
  </ModelVariables>
  <ModelStructure><Outputs>{read}<Unknown index="{n + 2}"/></Outputs>
    <Derivatives>{listed}</Derivatives></ModelStructure>
</fmiModelDescription>"""


def _third(model: str, saves: bool, units: bool) -> str:
    n = STATES[model]
    outputs = "".join(
        f'<Float64 name="{NAMES[i]}" valueReference="{i + 1}" causality="output"{_unit(i, units)}/>' for i in range(n)
    )
    rates = "".join(
        f'<Float64 name="der({NAMES[i]})" valueReference="{i + 4}" derivative="{i + 1}"/>' for i in range(n)
    )
    listed = "".join(f'<ContinuousStateDerivative valueReference="{i + 4}"/>' for i in range(n))
    indicators = '<EventIndicator valueReference="1"/>' if model in INDICATORS else ""
    return f"""<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="3.0" modelName="{model}" instantiationToken="1">
  <ModelExchange modelIdentifier="fmu" canGetAndSetFMUState="{str(saves).lower()}" needsCompletedIntegratorStep="true"
    providesDirectionalDerivatives="{str(model in SLOPES).lower()}"/>
  {UNITS if units else ""}
  <DefaultExperiment startTime="0" stopTime="3"/>
  <ModelVariables><Float64 name="time" valueReference="99" causality="independent" variability="continuous"/>{outputs}
    <Float64 name="input" valueReference="3" causality="input" start="0"/>
    {COUNT_3}{rates}
  </ModelVariables>
  <ModelStructure>{"".join(f'<Output valueReference="{i + 1}"/>' for i in range(n))}<Output valueReference="6"/>
    {listed}{indicators}</ModelStructure>
</fmiModelDescription>"""


_DESCRIPTIONS = {1: _first, 2: _second, 3: _third}
