"""The study of the choice on two trains of its own: what is chosen is right where its rules never looked."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from types import ModuleType

import pytest

from cosim.choice.candidates import shipped_rows
from fmu_observer.recommended import EXHIBITS, RECOMMENDED

STUDY = Path(__file__).resolve().parents[3] / "docs" / "studies" / "choosing.py"


def _study() -> ModuleType:
    spec = importlib.util.spec_from_file_location("choosing", STUDY)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


study = _study()


@pytest.mark.parametrize("seed", [1000, 1003])
def test_what_is_chosen_is_close_to_the_best_and_safe(seed: int) -> None:
    found = study.evaluated(study.Train.drawn(seed))
    assert found.chosen.close
    assert found.chosen.safe
    assert len(found.truth) > 30


def test_exhibits_are_close_nowhere_on_the_page_and_recommended_to_nobody() -> None:
    text = (STUDY.parents[1] / "guide" / "choosing_an_observer.md").read_text(encoding="utf-8")
    nowhere = text.partition("<!-- study: exhibits -->")[2].partition("<!-- end -->")[0]
    shipped = {":".join(filter(None, row)) for row in shipped_rows()}
    close_nowhere = {row for row in shipped if f"`{row}`" in nowhere}
    assert close_nowhere
    assert EXHIBITS.keys() == {row for row in close_nowhere if row.partition(":")[0] not in RECOMMENDED}


def test_a_train_is_that_of_its_seed_and_its_faults_are_apart() -> None:
    train = study.Train.drawn(7)
    assert train == study.Train.drawn(7)
    assert 60e3 <= train.mass <= 2000e3
    assert 0.3 <= train.gap <= 199.0
    wheel = train.truth(0).table().components["wheel"].parameters
    ends = [(a, a + b) for a, b in zip(wheel["fault_onset"], wheel["fault_length"], strict=True) if b > 0.0]
    assert ends == sorted(ends)
