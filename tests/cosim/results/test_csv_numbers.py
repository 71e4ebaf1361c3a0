"""The compiled writer of numbers: the bytes of Python's repr, for every double, and without it the same file."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

from cosim.results.formats import csv_file, csv_numbers
from cosim.results.formats.csv_file import CsvFormat, write_csv
from cosim.results.table_layout import table_dtype

RNG = np.random.default_rng(14)
EDGES = [
    0.0,
    -0.0,
    0.1,
    1e15,
    1e16,
    1e22,
    1e23,
    9007199254740993.0,
    5e-324,
    1.5e-323,
    2.2250738585072014e-308,
    1e-4,
    1e-5,
]
POWERS = [2.0**e for e in range(-1074, 1024)]
NUMBERS = {
    "edges": [*EDGES, 1.7976931348623157e308, 2.0**53 + 2, 1 / 3, 4.35, 123456789.0, np.inf, -np.inf, np.nan],
    "powers of two": POWERS,
    "beside powers of two": [np.nextafter(power, to) for power in POWERS for to in (0.0, np.inf)],
    "short decimals": [float(f"{digits}e{e}") for e in range(-324, 309) for digits in ("1", "2.5", "9.99")],
    "grid": np.arange(20_000) * 0.01,
    "any": RNG.integers(0, 2**64, 100_000, dtype=np.uint64).view(np.float64),
    "usual": -RNG.normal(size=50_000) * 10.0 ** RNG.integers(-8, 8, 50_000),
}


@pytest.mark.compiler
@pytest.mark.parametrize("kind", NUMBERS)
def test_numbers_are_those_of_repr(kind: str) -> None:
    rows = csv_numbers.native_rows()
    assert rows is not None
    numbers = np.asarray(NUMBERS[kind], dtype=float)
    written = rows(numbers[:, np.newaxis]).decode().split("\n")
    assert written == [*map(repr, numbers.tolist()), ""]


def test_powers_of_ten_are_rounded_up() -> None:
    for k, (upper, lower) in zip(csv_numbers.POWERS, csv_numbers._powers_of_ten().tolist(), strict=True):
        bits, power = (upper << 64) + lower, Fraction(10) ** k
        scale = Fraction(2) ** (bits.bit_length() - 1 - floor_log2(power))
        assert bits.bit_length() == 128
        assert bits - 1 < power * scale <= bits


def floor_log2(number: Fraction) -> int:
    guess = number.numerator.bit_length() - number.denominator.bit_length()
    return guess if Fraction(2) ** guess <= number else guess - 1


@pytest.mark.compiler
def test_a_long_table_has_the_bytes_of_python(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    table = np.zeros(9_000, table_dtype(["time", "a.x", "a.y"]))  # more than one chunk
    for name in table.dtype.names:
        table[name] = RNG.normal(size=len(table))
    write_csv(tmp_path / "python.csv", table)
    monkeypatch.setattr(csv_file, "MANY", 0)
    monkeypatch.setattr(csv_file, "_rows_in_python", None)
    write_csv(tmp_path / "native.csv", table)
    write_csv(tmp_path / "every_other.csv", table[::2])
    write_csv(tmp_path / "empty.csv", table[:0])
    assert (tmp_path / "native.csv").read_bytes() == (tmp_path / "python.csv").read_bytes()
    assert CsvFormat.read(tmp_path / "every_other.csv").table.tobytes() == table[::2].tobytes()
    assert (tmp_path / "empty.csv").read_text() == '"time","a.x","a.y"\n'


def test_without_a_compiler_python_writes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(csv_file, "MANY", 0)
    monkeypatch.setenv("CC", "no-such-compiler")
    csv_numbers.native_rows.cache_clear()
    try:
        write_csv(tmp_path / "t.csv", np.zeros(3, table_dtype(["time"])))
        assert csv_numbers.native_rows() is None
    finally:
        csv_numbers.native_rows.cache_clear()
    assert (tmp_path / "t.csv").read_text() == '"time"\n0.0\n0.0\n0.0\n'
