"""Results are read once: what is kept is what the files say, at every moment."""

from __future__ import annotations

import os
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cosim import Scenario
from cosim.results import read_once as room
from cosim.results.read_once import read_once

SETTLED = "plant_models.disk_cache.files.SETTLED"


class Reader:
    """Counts how often it reads."""

    def __init__(self) -> None:
        self.count = 0

    def __call__(self, path: Path) -> str:
        self.count += 1
        parts = sorted(path.iterdir()) if path.is_dir() else [path]
        return " ".join(f"{part.name}:{part.read_text()}" for part in parts)


@settings(max_examples=30)
@given(data=st.data(), folder=st.booleans())
def test_what_is_kept_is_what_a_reader_would_find(data: Any, folder: bool) -> None:
    with TemporaryDirectory() as place, pytest.MonkeyPatch.context() as patched:
        patched.setattr(SETTLED, -1.0)  # as if each moment were long after the one before
        written = Path(place) / "results" / "table.csv"
        written.parent.mkdir()
        read, path = Reader(), written.parent if folder else written
        for moment in range(data.draw(st.integers(1, 6))):
            if moment == 0 or data.draw(st.booleans()):
                written.write_text(data.draw(st.sampled_from("abc")))
                os.utime(written, ns=(moment, moment + 10**9))
            assert read_once(read, path) == Reader()(path)


def test_what_changed_just_now_is_read_again_and_what_did_not_is_not(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "table.csv").write_text("a")
    read = Reader()
    for _ in range(3):
        read_once(read, tmp_path)
    assert read.count == 3  # it may change again without a trace
    monkeypatch.setattr(SETTLED, -1.0)
    for _ in range(3):
        read_once(read, tmp_path)
    assert read.count == 4
    (tmp_path / "other.csv").write_text("b")
    assert "other" in read_once(read, tmp_path)
    monkeypatch.setattr(room, "settled_stamp", lambda path: None if path.name == "other.csv" else (0, 0, 1, 0, 0))
    for _ in range(2):
        read_once(read, tmp_path)
    assert read.count == 7  # one file of the folder is young


def test_what_is_large_is_not_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "table.csv").write_text(50 * "a")
    monkeypatch.setattr(SETTLED, -1.0)
    read = Reader()
    for largest, count in ((1e6, 1), (10.0, 3)):
        monkeypatch.setattr(room, "_LARGEST", largest)
        for _ in range(2):
            read_once(read, tmp_path / "table.csv")
        assert read.count == count


def test_the_components_of_one_recording_read_it_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    plant = Scenario(stop=0.2, step=0.1).add(
        "train", model="locomotive", **{"as": "block3"}, parameters={"effort": 5e4}
    )
    plant.add("other", model="locomotive", **{"as": "block3"})
    first = plant.run()
    first.write(tmp_path / "run", report=False)
    monkeypatch.setattr(SETTLED, -1.0)
    monkeypatch.setattr(room, "_read", room.OrderedDict())
    played = Scenario(stop=0.2, step=0.1)
    for name in ("train", "other"):
        played.add(name, recording=str(tmp_path / "run"))
    for _ in range(2):
        assert (played.run()["train.speed"] == first["train.speed"]).all()
    assert len(room._read) == 1
