"""Loops in generated C: written out again, they are the statements that CasADi wrote."""

from __future__ import annotations

import re

import casadi as ca
import pytest

from fmus.content.rolled_loops import DECLARED, rolled_loops


def written(size: int) -> str:
    """The C of a function that selects and reverses vectors, and calls another one with them."""
    inner = ca.MX.sym("inner", size)
    called = ca.Function("called", [inner], [2.0 * inner], {"never_inline": True})
    x, y = ca.SX.sym("x", size), ca.SX.sym("y", size)
    chosen = ca.if_else(x[0] > 0.5, called(x), y)
    generator = ca.CodeGenerator("generated", {"casadi_int": "int"})
    generator.add(ca.Function("f", [x, y], [ca.vertcat(chosen, x[::-1] * y, y[::2], x[3])]))
    return str(generator.dump())


def unrolled(source: str) -> list[str]:
    """Statements with every loop written out, elements as the variables that they were; no declarations."""

    def written_out(match: re.Match[str]) -> str:
        bodies = []
        for i in range(int(match[1])):
            index = re.compile(r"\[(\d+)([+-]\d+)\*i\]")
            bodies.append(index.sub(lambda m, i=i: f"[{int(m[1]) + int(m[2]) * i}]", match[2]))
        return "".join(bodies)

    flat = re.sub(r"  for \(casadi_int i = 0; i < (\d+); \+\+i\) \{\n((?:    .*\n)+)  \}\n", written_out, source)
    flat = DECLARED.sub("", re.sub(r"  casadi_real a\[\d+\];\n", "", flat))
    return [
        re.sub(r"\ba(?:\[(\d+)\]|0*(\d+)\b)", lambda m: f"a{m[1] or m[2]}", line.strip()) for line in flat.split("\n")
    ]


@pytest.mark.parametrize("size", [60, 300])
def test_loops_are_equal_statements_in_equal_order(size: int) -> None:
    source = written(size)
    rolled = rolled_loops(source)
    assert unrolled(rolled) == unrolled(source)
    assert rolled.count("\n") < 0.6 * source.count("\n") or size < 100


def test_a_small_function_is_left_alone() -> None:
    source = written(5)
    assert rolled_loops(source) == source
