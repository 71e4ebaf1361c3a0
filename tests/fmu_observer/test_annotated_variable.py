"""The variable that warns is copied and kept on disk as any other, with its warning."""

from __future__ import annotations

import copy
import pickle
from collections.abc import Callable
from typing import Any

import pytest

from fmu_observer.annotated_variable import AnnotatedVariable
from plant_models.hybrid.signal import OutputWarning


@pytest.mark.parametrize("again", [copy.copy, copy.deepcopy, lambda v: pickle.loads(pickle.dumps(v))])
def test_a_copy_warns_too(again: Callable[[Any], Any]) -> None:
    made = again(AnnotatedVariable(OutputWarning("leaves its range"), name="outside", valueReference=7))
    assert made.warning == OutputWarning("leaves its range")
    assert (made.name, made.valueReference) == ("outside", 7)
