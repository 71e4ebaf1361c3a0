"""The C types of the functions of FMI, derived once for all libraries, are those that fmpy derives."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Literal

import pytest
from fmpy import extract, read_model_description
from test_fmus.build import linear_fmu

from fmus.fmi.library import FACES, load
from fmus.fmi.standard import CO_SIMULATION


def types(slave: Any) -> dict[str, tuple[Any, ...]]:
    return {name: (f.argnames, f.argtypes, f.restype) for name, f in slave._functions.items()}


@pytest.mark.parametrize("version", [1, 2, 3])
def test_functions_have_the_types_of_fmpy(tmp_path: Path, version: Literal[1, 2, 3]) -> None:
    path = linear_fmu(tmp_path, "lag", [[-1.0]], [[1.0]], [[1.0]], [[0.0]], version=version, x0=[1.0])
    description = read_model_description(str(path))
    folder = extract(str(path))
    face: Any = FACES[version, CO_SIMULATION]
    of_fmpy = face(guid=description.guid, modelIdentifier="lag", unzipDirectory=folder, instanceName="a")
    ours = [load(Path(folder), description, CO_SIMULATION, name, complete=True) for name in ("b", "c")]
    assert len(types(of_fmpy)) > 20
    assert [list(types(slave).items()) for slave in ours] == [list(types(of_fmpy).items())] * 2
    c_names = [{name: f.__name__ for name, f in slave._functions.items()} for slave in (of_fmpy, *ours)]
    assert c_names[0] == c_names[1] == c_names[2]
