"""Single changes of the product's own code: where one can be made, and what the line says after it.

A change replaces one operator, number, condition or statement, as a slip of the keyboard or of the mind would: ``<`` by
``<=``, ``+`` by ``-``, ``and`` by ``or``, a number by another, a condition by its opposite, a call or a refusal by
nothing. Texts and declarations of types are left alone.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from random import Random

PACKAGES = ("plant_models", "fmu_observer", "fmus", "cosim")
EACH = 3
"""Changes that each room gets at least; the rest goes by the number of places."""

SWAPPED: Mapping[type[ast.AST], tuple[str, str]] = {
    ast.Lt: ("<", "<="),
    ast.LtE: ("<=", "<"),
    ast.Gt: (">", ">="),
    ast.GtE: (">=", ">"),
    ast.Eq: ("==", "!="),
    ast.NotEq: ("!=", "=="),
    ast.Is: ("is", "is not"),
    ast.IsNot: ("is not", "is"),
    ast.In: ("in", "not in"),
    ast.NotIn: ("not in", "in"),
    ast.Add: ("+", "-"),
    ast.Sub: ("-", "+"),
    ast.Mult: ("*", "/"),
    ast.Div: ("/", "*"),
    ast.Pow: ("**", "*"),
    ast.FloorDiv: ("//", "/"),
    ast.Mod: ("%", "*"),
    ast.And: ("and", "or"),
    ast.Or: ("or", "and"),
}
IN_C: Sequence[tuple[str, str]] = (
    (r"(?<![<>=!-])<(?![<=])", "<="),
    (r"<=", "<"),
    (r"(?<![<>=!-])>(?![>=])", ">="),
    (r">=", ">"),
    (r"==", "!="),
    (r"!=", "=="),
    (r"&&", "||"),
    (r"\|\|", "&&"),
    (r"(?<= )\+(?= )", "-"),
    (r"(?<= )-(?= )", "+"),
    (r"(?<= )\*(?= )", "/"),
    (r"(?<![\w.])\d+(?:\.\d+)?(?![\w.])", "1+{}"),
)


@dataclass(frozen=True)
class Change:
    """One change.

    Args:
        file: of the project. line: its number. old, new: what is replaced, and by what. start, end: places in the file.
        function: first line of the function around it; 0 where there is none (declarations, C).
    """

    file: str
    line: int
    old: str
    new: str
    start: int
    end: int
    function: int

    @property
    def room(self) -> str:
        """Folder of the file, two deep; the C of a room is a room of its own."""
        parts = Path(self.file).parent.parts[:2]
        return "/".join(parts) + (" (C)" if not self.file.endswith(".py") else "")

    def applied(self, text: str) -> str:
        """The file after the change."""
        assert text[self.start : self.end] == self.old, self
        return text[: self.start] + self.new + text[self.end :]


def choose(root: Path, count: int, seed: int) -> list[Change]:
    """So many changes over all rooms, at random and in random order: what is done of them is a sample too."""
    by_room: dict[str, list[Change]] = {}
    for change in all_changes(root):
        by_room.setdefault(change.room, []).append(change)
    total = sum(map(len, by_room.values()))
    random = Random(seed)
    fallback = count - EACH * len(by_room)
    wanted = {room: EACH + round(fallback * len(places) / total) for room, places in sorted(by_room.items())}
    chosen = [one for room, n in wanted.items() for one in random.sample(by_room[room], min(n, len(by_room[room])))]
    return random.sample(chosen, len(chosen))


def all_changes(root: Path) -> Iterator[Change]:
    """Every change that can be made in the four packages."""
    for package in PACKAGES:
        for path in sorted((root / package).rglob("*")):
            if path.suffix in {".py", ".c"}:
                of_file = _of_python if path.suffix == ".py" else _of_c
                yield from of_file(path.relative_to(root).as_posix(), path.read_text(encoding="utf-8"))


def _of_c(file: str, text: str) -> Iterator[Change]:
    commentless = re.sub(
        r"/\*.*?\*/|//[^\n]*|\"[^\"\n]*\"", lambda m: re.sub(r"[^\n]", "\0", m[0]), text, flags=re.DOTALL
    )
    start = 0
    for number, line in enumerate(commentless.splitlines(keepends=True), start=1):
        if not line.startswith("#") and line[:1].isspace():  # inside functions
            for pattern, new in IN_C:
                for found in re.finditer(pattern, line):
                    place = start + found.start()
                    yield Change(file, number, found[0], new.format(found[0]), place, place + len(found[0]), 0)
        start += len(line)


class _Places(ast.NodeVisitor):
    """Collects changes with the function that they are in."""

    def __init__(self, file: str, text: str) -> None:
        self.file, self.text, self.function, self.found = file, text, 0, []
        self.lines = [0]
        for line in text.encode().splitlines(keepends=True):
            self.lines.append(self.lines[-1] + len(line))
        self.bytes = text.encode()

    def place(self, line: int, column: int) -> int:
        return len(self.bytes[: self.lines[line - 1] + column].decode())

    def add(self, node: ast.expr | ast.stmt, new: str) -> None:
        start, end = self.place(node.lineno, node.col_offset), self.place(node.end_lineno, node.end_col_offset)
        self.found.append(Change(self.file, node.lineno, self.text[start:end], new, start, end, self.function))

    def between(self, left: ast.expr, right: ast.expr, operator: ast.AST) -> None:
        old, new = SWAPPED.get(type(operator), ("", ""))
        start, end = self.place(left.end_lineno, left.end_col_offset), self.place(right.lineno, right.col_offset)
        found = re.search(rf"(?<![*/<>=!]){re.escape(old)}(?![*/=<>])", self.text[start:end]) if old else None
        if found and "#" not in self.text[start:end]:
            line = left.end_lineno + self.text[start : start + found.start()].count("\n")
            self.found.append(
                Change(self.file, line, old, new, start + found.start(), start + found.end(), self.function)
            )

    def visit_FunctionDef(self, node: ast.FunctionDef) -> None:
        around, self.function = self.function, min([node.lineno, *(d.lineno for d in node.decorator_list)])
        for part in (*node.args.defaults, *node.args.kw_defaults, *node.body):
            if part is not None:
                self.visit(part)
        self.function = around

    def visit_AnnAssign(self, node: ast.AnnAssign) -> None:
        if node.value is not None:
            self.visit(node.value)

    def visit_If(self, node: ast.If) -> None:
        if "TYPE_CHECKING" not in ast.dump(node.test):
            self.add(node.test, f"not ({ast.get_source_segment(self.text, node.test)})")
            self.generic_visit(node)

    def visit_Compare(self, node: ast.Compare) -> None:
        for left, operator, right in zip((node.left, *node.comparators), node.ops, node.comparators, strict=False):
            self.between(left, right, operator)
        self.generic_visit(node)

    def visit_BinOp(self, node: ast.BinOp) -> None:
        if not _is_text(node.left) and not _is_text(node.right):
            self.between(node.left, node.right, node.op)
        self.generic_visit(node)

    def visit_BoolOp(self, node: ast.BoolOp) -> None:
        self.between(node.values[0], node.values[1], node.op)
        self.generic_visit(node)

    def visit_UnaryOp(self, node: ast.UnaryOp) -> None:
        if isinstance(node.op, ast.USub | ast.Not):
            self.add(node, f"({ast.get_source_segment(self.text, node.operand)})")
        self.generic_visit(node)

    def visit_Constant(self, node: ast.Constant) -> None:
        if isinstance(node.value, bool):
            self.add(node, str(not node.value))
        elif isinstance(node.value, int):
            self.add(node, str(node.value + 1))
        elif isinstance(node.value, float):
            self.add(node, repr(1.25 * node.value or 1.0))

    def visit_JoinedStr(self, node: ast.JoinedStr) -> None:
        """Numbers and operators inside texts are layout."""

    def visit_Raise(self, node: ast.Raise) -> None:
        self.add(node, "pass")

    def visit_Expr(self, node: ast.Expr) -> None:
        if isinstance(node.value, ast.Call):
            self.add(node, "pass")
        if not isinstance(node.value, ast.Constant):
            self.generic_visit(node)

    def visit_Return(self, node: ast.Return) -> None:
        if node.value is not None and not isinstance(node.value, ast.Constant):
            self.add(node, "return None")
            self.generic_visit(node)


def _of_python(file: str, text: str) -> list[Change]:
    places = _Places(file, text)
    places.visit(ast.parse(text))
    return places.found


def _is_text(node: ast.expr) -> bool:
    return isinstance(node, ast.JoinedStr) or (isinstance(node, ast.Constant) and isinstance(node.value, str))
