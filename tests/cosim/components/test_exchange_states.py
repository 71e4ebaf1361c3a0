"""States of model exchange FMUs that save none: put back by continuous states where these are all, or refused."""

from __future__ import annotations

import zipfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from test_fmus.exchange import exchange_fmu
from test_fmus.stepped import Stepped

import fmus
from cosim.components.loading import load_fmu
from cosim.errors import RunError
from plant_models import PLANTS

VERSIONS = (2, 3)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("states")


@pytest.fixture
def made() -> Iterator[list[Stepped]]:
    found: list[Stepped] = []
    yield found
    for one in found:
        one.free()


def stateless(folder: Path, model: str, version: int) -> Stepped:
    """One that declares no saved states, and nothing discrete."""
    return Stepped(exchange_fmu(folder, model, version, saves=False, counts=False), 1e-8)


@pytest.mark.parametrize("model", ["DECAY", "TRAIN", "REACTION"])
@pytest.mark.parametrize("version", VERSIONS)
@given(
    cut=st.floats(0.01, 0.09),
    steps=st.lists(st.floats(0.02, 0.3), min_size=1, max_size=4),
    u=st.floats(-3.0, 3.0),
)
def test_what_follows_a_state_that_was_put_back_is_identical(
    folder: Path, model: str, version: int, cut: float, steps: list[float], u: float
) -> None:
    fmu = stateless(folder, model, version)
    try:
        assert fmu.component.can_save
        fmu.to(cut, u)
        state = fmu.component.save()
        runs = []
        for other in (u, 0.5 * u):  # on from the save, then back from elsewhere, where another input was
            if runs:
                fmu.component.restore(state)
            fmu.time = cut
            runs.append([fmu.to(cut + sum(steps[: k + 1]), u).tolist() for k in range(len(steps))])
            fmu.to(fmu.time + 0.1, other + 1.0)
        assert runs[0] == runs[1]
        fmu.component.release(state)
    finally:
        fmu.free()


@pytest.mark.parametrize("version", VERSIONS)
def test_what_a_save_looks_at_leaves_no_trace(folder: Path, made: list[Stepped], version: int) -> None:
    looked, plain = (stateless(folder, "TRAIN", version) for _ in range(2))
    made += [looked, plain]
    for one in (looked, plain):
        one.to(0.1, 1.0)
    looked.component.save()
    for one in (looked, plain):
        one.to(0.2, 2.0)  # an input that jumps begins anew in both
    assert looked.to(0.7).tolist() == plain.to(0.7).tolist()


@pytest.mark.parametrize("version", VERSIONS)
def test_a_state_that_is_hidden_is_seen_at_the_first_save(folder: Path, made: list[Stepped], version: int) -> None:
    fmu = stateless(folder, "REMEMBERS", version)
    made.append(fmu)
    fmu.to(0.1, 2.0)
    with pytest.raises(RunError, match=r"not all of its state: a step from the same ends with state 'position' at"):
        fmu.component.save()


@pytest.mark.parametrize("version", VERSIONS)
def test_nothing_leads_back_before_an_event(folder: Path, made: list[Stepped], version: int) -> None:
    fmu = stateless(folder, "STEPS", version)
    made.append(fmu)
    fmu.to(0.3)
    before = fmu.component.save()
    fmu.to(0.4)
    fmu.component.restore(before)
    fmu.time = 0.3
    fmu.to(1.0)  # on the way it jumps
    with pytest.raises(RunError, match=r"an event happened since t = 0\.3 s, .* cannot be put back before it"):
        fmu.component.restore(before)
    after = fmu.component.save()
    end = fmu.to(1.2).tolist()
    fmu.component.restore(after)
    fmu.time = 1.0
    assert fmu.to(1.2).tolist() == end


@pytest.mark.parametrize("version", VERSIONS)
def test_one_that_is_strict_about_its_modes_is_put_back_as_it_puts_itself(tmp_path: Path, version: int) -> None:
    """The pendulum saves its states; the same FMU that does not say so goes on with the same bits."""
    rows = []
    for saves in (True, False):
        component = load_fmu(pendulum(tmp_path, version, saves), "pendulum", 1e-8, interface="model-exchange")
        component.instantiate()
        component.set_start("pendulum_angle", 0.3)
        component.enter_initialization(0.0, 10.0)
        values, names = np.zeros(1), component.names("input")
        write, inputs = component.writer(names)
        write()
        component.exit_initialization()
        read = component.reader(["angle"], values)
        seen = []
        state = component.save()
        for t in (0.0, 0.1, 0.2, 0.3):
            inputs[:] = 1.0 + t
            write()
            component.advance(t, t + 0.1)
            if t == 0.1:
                state = component.save()
        component.restore(state)
        for t in (0.2, 0.3):
            inputs[:] = 2.0 + t
            write()
            component.advance(t, t + 0.1)
            read()
            seen.append(values.tolist())
        rows.append(seen)
        component.terminate()
        component.free()
    assert rows[0] == rows[1]


def pendulum(folder: Path, version: int, saves: bool) -> Path:
    """Ours, which says that its states are saved, or that they are not."""
    whole = fmus.cached_fmu(PLANTS["pendulum"](), fmi_version=version)  # type: ignore[arg-type]
    path, word = (
        folder / f"pendulum{saves}.fmu",
        b'canGetAndSetFMUstate="' if version == 2 else b'canGetAndSetFMUState="',
    )
    with zipfile.ZipFile(whole) as source, zipfile.ZipFile(path, "w") as target:
        for entry in source.namelist():
            content = source.read(entry)
            if entry == "modelDescription.xml" and not saves:
                assert word + b"true" in content
                content = content.replace(word + b"true", word + b"false")
            target.writestr(entry, content)
    return path


@pytest.mark.parametrize("version", VERSIONS)
@pytest.mark.parametrize("model", ["BALL", "STAIR"])
def test_one_with_indicators_or_discrete_values_is_not_saved(folder: Path, model: str, version: int) -> None:
    path = exchange_fmu(folder, model, version, saves=False, counts=model == "STAIR")
    assert not load_fmu(path, "plant").can_save


@pytest.mark.parametrize("version", VERSIONS)
def test_bytes_of_a_state_lead_back_in_another_instance_too(version: int) -> None:
    path = fmus.cached_fmu(PLANTS["locomotive"](), fmi_version=version)  # type: ignore[arg-type]
    ends = []
    first, second = (load_fmu(path, "train", 1e-8, interface="model-exchange") for _ in range(2))
    for one in (first, second):
        one.instantiate()
        one.set_start("train_speed", 10.0)
        one.set_start("wheel_rate", 10.0 / 0.575)
        one.enter_initialization(0.0, 10.0)
        one.exit_initialization()
    write, effort = first.writer(["effort"])
    effort[0] = 4e4
    write()
    first.advance(0.0, 0.3)
    state = first.save()
    content = first.serialize(state)
    for one in (first, second):
        values = np.zeros(2)
        read = one.reader(["position", "speed"], values)
        one.restore(one.deserialize(content))
        one.advance(0.3, 0.9)
        read()
        ends.append(values.tolist())
    assert ends[0] == ends[1]
    assert ends[0][1] > 10.1
    first.restore(state)
    first.advance(0.3, 0.9)
    for one in (first, second):
        one.terminate()
        one.free()
