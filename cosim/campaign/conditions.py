"""Conditions between what varies: a small expression over settings, read by Python's grammar and nothing more of
Python.
"""

from __future__ import annotations

import ast
import operator
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from cosim.errors import ScenarioError, nearest

_Value = Callable[[Mapping[str, Any]], Any]
_TWO: Mapping[type, Callable[[Any, Any], Any]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.Lt: operator.lt,
    ast.LtE: operator.le,
    ast.Gt: operator.gt,
    ast.GtE: operator.ge,
    ast.Eq: operator.eq,
    ast.NotEq: operator.ne,
}
_MAY = "expected numbers, names of what is varied, + - * /, comparisons, and, or, not"


class Condition:
    """A condition such as ``"balises.spacing / train.speed < 60 and 'case' != 'wet'"``.

    Args:
        text: names with dots as they are or in quotes; other texts in quotes are values. names: that are varied.

    Raises:
        ScenarioError: it is no such expression, or a name is not varied.
    """

    def __init__(self, text: str, names: Sequence[str]) -> None:
        self.text, self._names = text, names
        try:
            tree = ast.parse(text.strip(), mode="eval").body
        except (SyntaxError, ValueError) as error:
            raise self._refused(f"cannot be read ({getattr(error, 'msg', error)}); {_MAY}") from error
        if not isinstance(tree, ast.Compare | ast.BoolOp) and not self._is_not(tree):
            raise self._refused(f"compares nothing; {_MAY}")
        self._value = self._of(tree)

    def holds(self, settings: Mapping[str, Any]) -> bool:
        """Whether settings meet it; a division by zero does not.

        Args:
            settings: values by name.

        Raises:
            ScenarioError: values are compared that cannot be, such as a text with a number.
        """
        try:
            return bool(self._value(settings))
        except ZeroDivisionError:
            return False
        except TypeError as error:
            raise self._refused(f"cannot be judged: {error}") from error

    def _of(self, node: ast.AST) -> _Value:
        """What a part of the expression comes to."""
        if isinstance(node, ast.BoolOp):
            parts, every = [self._of(part) for part in node.values], isinstance(node.op, ast.And)
            return lambda s: (all if every else any)(part(s) for part in parts)
        if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not | ast.USub):
            inner, is_not = self._of(node.operand), isinstance(node.op, ast.Not)
            return lambda s: not inner(s) if is_not else -inner(s)
        if isinstance(node, ast.BinOp) and type(node.op) in _TWO:
            left, right, apply = self._of(node.left), self._of(node.right), _TWO[type(node.op)]
            return lambda s: apply(left(s), right(s))
        if isinstance(node, ast.Compare) and all(type(op) in _TWO for op in node.ops):
            sides = [self._of(side) for side in (node.left, *node.comparators)]
            steps = list(zip([_TWO[type(op)] for op in node.ops], sides, sides[1:], strict=False))
            return lambda s: all(compare(a(s), b(s)) for compare, a, b in steps)
        return self._leaf(node)

    def _leaf(self, node: ast.AST) -> _Value:
        """A name or a value."""
        if isinstance(node, ast.Constant) and isinstance(value := node.value, int | float | str | bool):
            name = str(value)
            return (lambda s: s[name]) if value in self._names else (lambda _s: value)
        if not isinstance(node, ast.Name | ast.Attribute | ast.Subscript):
            raise self._refused(f"{ast.unparse(node)!r} may not stand in it; {_MAY}")
        name = ast.unparse(node).replace(", ", ",")
        if name not in self._names:
            raise self._refused(f"{name!r} is not varied; {nearest(name, self._names)}")
        return lambda s: s[name]

    @staticmethod
    def _is_not(node: ast.AST) -> bool:
        return isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not)

    def _refused(self, why: str) -> ScenarioError:
        return ScenarioError(f"campaign.where: {self.text!r} {why}.")
