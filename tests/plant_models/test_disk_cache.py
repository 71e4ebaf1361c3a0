"""The cache on disk: what is kept is what was computed, equal things have one name, and damage is told and repaired."""

from __future__ import annotations

import dataclasses
import logging
import os
import sys
import time
from collections import Counter, namedtuple
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path
from types import FrameType
from typing import Any

import numpy as np
import pytest

from fmu_observer import OBSERVERS
from plant_models import PLANTS
from plant_models.disk_cache import files, identity
from plant_models.disk_cache.entries import _entry_path, recall, remembered
from plant_models.disk_cache.identity import _Description, _folder_digest, _NoIdentityError
from plant_models.hybrid import HybridSystem, Signal, kernel, parameter

KEY = "0" * 64


@pytest.fixture(autouse=True)
def _empty_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("FMU_OBSERVER_CACHE", str(tmp_path / "cache"))


def never() -> Any:
    raise AssertionError("computed although it is kept")


# -- entries ----------------------------------------------------------------------------------------------------------


def test_a_value_is_computed_once_and_comes_back_equal() -> None:
    value = {"limit": 0.1 + 0.2, "none": None, "open": float("inf"), "rows": ((1, 2.5), ("a",))}
    first = remembered("trial", KEY, lambda: value)
    assert first == {**value, "rows": [[1, 2.5], ["a"]]}
    assert remembered("trial", KEY, never) == first


def test_nothing_is_kept_without_a_key_or_of_what_fails() -> None:
    assert remembered("trial", None, lambda: (1, 2)) == (1, 2)
    with pytest.raises(ZeroDivisionError):
        remembered("trial", KEY, lambda: 1 / 0)
    assert not _entry_path("trial", KEY).parent.exists()


@pytest.mark.parametrize(
    ("damage", "words"),
    [
        (lambda _: b"", "no head"),
        (lambda _: b"\x00\xff\n{}", "no head"),
        (lambda _: b"[1, 2]\n3", "no head"),
        (lambda text: text[:-4], "content is damaged"),
        (lambda text: text.replace(b"0.5", b"0.6"), "content is damaged"),
        (lambda text: text.replace(b'"trial"', b'"probe"'), "entry of something else"),
        (lambda text: text.replace(KEY.encode(), b"1" * 64), "entry of something else"),
        (lambda text: text.replace(b"cache 1", b"cache 2"), "entry of something else"),
    ],
)
def test_a_damaged_or_foreign_entry_is_reported_and_made_again(
    damage: Any, words: str, caplog: pytest.LogCaptureFixture
) -> None:
    remembered("trial", KEY, lambda: {"gap": 0.5})
    path = _entry_path("trial", KEY)
    path.write_bytes(damage(path.read_bytes()))
    assert remembered("trial", KEY, lambda: {"gap": 0.5}) == {"gap": 0.5}
    assert words in caplog.text
    assert str(path) in caplog.text
    assert recall("trial", KEY) == {"gap": 0.5}


def test_an_entry_that_cannot_be_read_or_written_stops_nobody(caplog: pytest.LogCaptureFixture) -> None:
    _entry_path("trial", KEY).mkdir(parents=True)  # a folder in its place
    with caplog.at_level(logging.INFO, "plant_models"):
        assert remembered("trial", KEY, lambda: 3) == 3
    assert "is not used and made again" in caplog.text
    assert "Nothing is kept" in caplog.text


def test_many_at_once_find_whole_entries() -> None:
    def work(number: int) -> int:
        return sum(len(remembered("trial", f"{(number + i) % 5:064}", lambda: "x" * 50_000)) for i in range(20))

    with ThreadPoolExecutor(8) as pool:
        assert set(pool.map(work, range(8))) == {1_000_000}
    assert not list(_entry_path("trial", KEY).parent.glob(".*"))


# -- seals ------------------------------------------------------------------------------------------------------------


def test_a_file_is_sealed_until_it_is_another(tmp_path: Path) -> None:
    path = tmp_path / "model.fmu"
    assert not files.is_sealed(path)
    path.write_bytes(b"one")
    assert not files.is_sealed(path)
    files.seal(path)
    assert files.is_sealed(path)
    path.write_bytes(b"two")  # of the same size, at once
    assert not files.is_sealed(path)


def test_a_file_is_read_again_only_where_it_changed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "model.fmu"
    path.write_bytes(b"one")
    monkeypatch.setattr(files, "SETTLED", -1.0)
    first = files.file_digest(path)
    monkeypatch.setattr(files.hashlib, "file_digest", never)
    assert files.file_digest(path) == first
    os.utime(path, ns=(1, 1))
    with pytest.raises(TypeError):
        files.file_digest(path)


# -- identity ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", [*PLANTS, *OBSERVERS])
def test_every_shipped_system_has_an_identity(name: str) -> None:
    factory = PLANTS[name] if name in PLANTS else OBSERVERS[name]
    one, other = factory(), factory()
    one.start_parameters()
    _ = one.input_signals  # what follows from the declarations does not count
    assert identity.identity(one) == identity.identity(other) is not None


def test_what_is_not_equal_has_another_identity() -> None:
    signal = PLANTS["odometer"]().parameters[0]
    values = [
        0, 0.0, False, None, "0", b"0", (), [], {}, {0: 0}, (0,), [0], np.zeros(1), np.zeros((1, 1)), np.zeros(2),
        np.zeros(1, int), np.float64(0), signal, dataclasses.replace(signal, description="other"), Signal, parameter,
        partial(parameter, 1), partial(parameter, 2), PLANTS["odometer"](), PLANTS["driver"](),
    ]  # fmt: skip
    texts = [_Description().text(value) for value in values]
    assert len(set(texts)) == len(values)
    options = [{}, {"spacing": "learnt"}] if "spacing" in OBSERVERS["adaptive_gain_cdo"].option_choices else [{}]
    assert len({identity.identity(OBSERVERS["adaptive_gain_cdo"](**o)) for o in options}) == len(options)


def test_an_attribute_more_or_of_another_value_counts() -> None:
    system: Any = PLANTS["driver"]()
    texts = {_Description().text(system)}
    for value in (1, 2, 2.0):
        system.of_this_test = value
        texts.add(_Description().text(system))
    assert len(texts) == 4


def test_describing_a_system_takes_few_calls() -> None:
    system, calls = PLANTS["locomotive"](), Counter[str]()
    _Description().text(system)  # names of attributes are found once for each class

    def count(_frame: FrameType, event: str, _: Any) -> None:
        calls[event] += 1

    sys.setprofile(count)
    try:
        _Description().text(system)
    finally:
        sys.setprofile(None)
    assert calls["call"] < 700  # 425 were counted; with a call for each plain value 1760


def test_a_file_counts_by_its_content(tmp_path: Path) -> None:
    first, second = tmp_path / "a", tmp_path / "b"
    first.write_bytes(b"same")
    second.write_bytes(b"same")
    assert identity.identity(first) == identity.identity(second)
    second.write_bytes(b"other")
    assert identity.identity(first) != identity.identity(second)
    assert identity.identity(tmp_path / "missing") is None


def test_what_is_not_known_by_its_content_has_no_identity() -> None:
    class Own(HybridSystem):
        name = "own"

    circle: list[Any] = []
    circle.append(circle)
    pair = namedtuple("pair", "a b")
    for value in (
        Own(),
        circle,
        pair(1, 2),
        never,
        open,
        object(),
        iter([]),
        np.array([object()]),
        np.random.default_rng(1),
    ):
        assert identity.identity(value) is None
        assert identity.identity({"deep": [value]}) is None


def test_a_class_that_was_replaced_has_no_identity(monkeypatch: pytest.MonkeyPatch) -> None:
    system = PLANTS["odometer"]()
    monkeypatch.setattr(f"{type(system).__module__}.{type(system).__name__}", object)
    assert identity.identity(system) is None


def test_code_counts(monkeypatch: pytest.MonkeyPatch) -> None:
    seen: list[str] = []
    monkeypatch.setattr(identity, "_folder_digest", lambda name: seen.append(name) or name)
    first = identity.identity(OBSERVERS["takagi_sugeno_cdo"](), code=("cosim/run/observer_findings.py",))
    assert seen == ["cosim/run/observer_findings.py", "fmu_observer", "plant_models"]
    monkeypatch.setattr(identity, "_folder_digest", lambda name: f"{name}, edited")
    edited = identity.identity(OBSERVERS["takagi_sugeno_cdo"](), code=("cosim/run/observer_findings.py",))
    assert None not in (first, edited)
    assert first != edited


def test_versions_count(monkeypatch: pytest.MonkeyPatch) -> None:
    first = identity.identity(1)
    monkeypatch.setattr(identity, "installed_version", lambda name: f"other {name}")
    identity._surroundings.cache_clear()
    other = identity.identity(1)
    identity._surroundings.cache_clear()
    assert None not in (first, other)
    assert first != other


def test_code_that_changed_after_it_was_loaded_is_not_trusted(monkeypatch: pytest.MonkeyPatch) -> None:
    _folder_digest.cache_clear()
    monkeypatch.setattr(identity, "LOADED_AT", 0.0)
    assert identity.identity(1) is None
    monkeypatch.setattr(identity, "LOADED_AT", time.time())
    assert identity.identity(1) is not None


# -- kernels ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["locomotive", "takagi_sugeno_cdo"])
def test_a_kernel_from_the_cache_is_the_traced_one(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    make = PLANTS[name] if name in PLANTS else OBSERVERS[name]
    traced = kernel._trace(make())
    kernel.make_kernel(make())
    monkeypatch.setattr(kernel, "_trace", never)
    functions = kernel._traced_functions(make())
    assert {n: f.serialize() for n, f in functions.items()} == traced


@pytest.mark.parametrize("name", ["no_such_package_anywhere", "__future__"])
def test_what_is_no_folder_on_disk_has_no_digest(name: str) -> None:
    with pytest.raises(_NoIdentityError, match=f"files of {name} are not on disk"):
        _folder_digest(name)
