"""A full disk under an HDF5 file: an error in words, where HDF5 alone ends the process."""

from __future__ import annotations

import resource
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from cosim.errors import OutputError
from cosim.results.formats.hdf5_file import _GuardedFile
from cosim.results.result import Result, SignalInfo
from cosim.results.save import save_result


@pytest.fixture
def small_disk() -> Iterator[None]:
    """No file grows beyond 64 kB."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (1 << 16, hard))
    yield
    resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


@pytest.mark.usefixtures("small_disk")
def test_a_full_disk_is_reported_and_leaves_nothing(tmp_path: Path) -> None:
    table = np.zeros(20_000, dtype=[("time", float), ("a.x", float)])
    table["time"], table["a.x"] = np.arange(20_000), np.random.default_rng(0).random(20_000)
    with pytest.raises(OutputError, match="cannot be written: File too large"):
        save_result(Result(table, [SignalInfo("a.x")], [], {}), tmp_path / "a.h5")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.usefixtures("small_disk")
def test_what_the_disk_refuses_reads_as_zeros_and_is_raised_at_the_end(tmp_path: Path) -> None:
    with pytest.raises(OSError, match="File too large"), _GuardedFile(tmp_path / "a") as file:  # noqa: PT012 - raised by its end
        assert file.write(b"x" * 100_000) == 100_000
        assert file.tell() == 100_000
        file.seek(65_534)
        buffer = bytearray(4)
        assert file.readinto(buffer) == 4
        assert bytes(buffer) == b"xx\0\0"
