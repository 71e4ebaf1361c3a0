"""Files that something went wrong with: texts, tables, archives and folders, changed in one or a few places by chance
that a seed decides.
"""

from __future__ import annotations

import json
import re
import shutil
import zipfile
from collections.abc import Callable
from pathlib import Path
from random import Random
from typing import Any

NUMBERS = ("nan", "inf", "-1", "0", "1e308", "-1e308", "1e-320", "99999999999999999999", "0x10", "1_0", "3,5", "1 m")
WORDS = (
    "",
    "..",
    "../../x",
    "/dev/null",
    "/proc/self/mem",
    "x" * 20_000,
    "\u202eabc",
    "a.b.c",
    "train",
    "none.py:X",
    "é",
)
BYTES = (
    b"\0",
    b"\x1b[31m",
    b"\xff\xfe",
    b"\xef\xbb\xbf",
    b'"',
    b"'",
    b"[",
    b"]",
    b"{",
    b"=",
    b"<",
    b"&",
    b"\r",
    b"\n\n",
    b",",
)
VALUES: tuple[Any, ...] = (
    *(None, True, -1, 0, 10**30, 1e308, float("nan"), float("inf"), [], {}, [[]], [1, "x"], {"a": {"b": []}}),
    *WORDS,
)
ENTITY = (
    b'<!DOCTYPE x [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;&a;&a;&a;"><!ENTITY c SYSTEM "file:///etc/passwd">]>'
)

OUTSIDE = ("../escaped", "/escaped", "a\\..\\..\\escaped", "x" * 300, "con")

Change = Callable[[bytes, Random], bytes]


def cut_off(content: bytes, chance: Random) -> bytes:
    return content[: chance.randrange(len(content) + 1)]


def without_span(content: bytes, chance: Random) -> bytes:
    start = chance.randrange(len(content) + 1)
    return content[:start] + content[start + chance.choice((1, 2, 10, 100)) :]


def with_bytes(content: bytes, chance: Random) -> bytes:
    start = chance.randrange(len(content) + 1)
    return content[:start] + chance.choice(BYTES) + content[start:]


def other_bytes(content: bytes, chance: Random) -> bytes:
    changed = bytearray(content)
    for _ in range(min(len(changed), chance.choice((1, 3, 30)))):
        changed[chance.randrange(len(changed))] = chance.randrange(256)
    return bytes(changed)


def other_lines(content: bytes, chance: Random) -> bytes:
    lines = content.split(b"\n")
    i, j = chance.randrange(len(lines)), chance.randrange(len(lines))
    kind = chance.randrange(3)
    if kind == 0:
        del lines[i]
    elif kind == 1:
        lines.insert(j, lines[i])
    else:
        lines[i], lines[j] = lines[j], lines[i]
    return b"\n".join(lines)


def other_number(content: bytes, chance: Random) -> bytes:
    return _other_match(rb"-?\d+(?:\.\d*)?(?:e-?\d+)?", [word.encode() for word in NUMBERS], content, chance)


def other_word(content: bytes, chance: Random) -> bytes:
    known = re.findall(rb"[A-Za-z_.]{3,}", content)
    return _other_match(rb"[A-Za-z_.]{3,}", [*(word.encode() for word in WORDS), *known[:200]], content, chance)


def with_entities(content: bytes, chance: Random) -> bytes:
    changed = other_word(content, chance)
    return changed.replace(b"?>", b"?>" + ENTITY, 1).replace(b'="', chance.choice((b'="&b;', b'="&c;')), 3)


def other_table(content: bytes, chance: Random) -> bytes:
    """JSON with another value, key or depth somewhere."""
    data = json.loads(content)
    holder = data
    while True:
        keys = (
            list(holder) if isinstance(holder, dict) else list(range(len(holder))) if isinstance(holder, list) else []
        )
        if not keys:
            return json.dumps(chance.choice(VALUES)).encode()
        key = chance.choice(keys)
        below = holder[key]
        if isinstance(below, dict | list) and below and chance.random() < 0.8:
            holder = below
            continue
        kind = chance.randrange(4)
        if kind == 0:
            del holder[key]
        elif kind == 1 and isinstance(holder, dict):
            holder[chance.choice(WORDS)] = holder.pop(key)
        elif kind == 2:
            for _ in range(3000):
                below = [below]
            holder[key] = json.loads("1") if chance.random() < 0.5 else below[0][0]
        else:
            holder[key] = chance.choice(VALUES)
        return json.dumps(data).encode()


TEXT: tuple[Change, ...] = (
    *(cut_off, without_span, with_bytes, other_bytes, other_lines),
    *(other_number, other_number, other_number, other_word, other_word, other_word),
)
CHANGES: dict[str, tuple[Change, ...]] = {
    ".json": (*TEXT, other_table, other_table, other_table, other_table),
    ".xml": (*TEXT, with_entities),
    ".ssd": (*TEXT, with_entities),
}


def mutant(content: bytes, suffix: str, chance: Random) -> bytes:
    """A content with a few changes."""
    for _ in range(chance.choice((1, 1, 1, 2, 4))):
        change = chance.choice(CHANGES.get(suffix, TEXT))
        try:
            content = change(content, chance)
        except (ValueError, IndexError, RecursionError):  # changed so far that it is no table any more
            content = other_bytes(content, chance)
    return content


def change_file(path: Path, chance: Random) -> None:
    """A file becomes a mutant of itself."""
    path.write_bytes(mutant(path.read_bytes(), path.suffix, chance))


def change_archive(path: Path, chance: Random, suffixes: tuple[str, ...]) -> None:
    """An archive with another member, with one less, under another name, or damaged itself."""
    kind = chance.random()
    if kind < 0.15:
        path.write_bytes(chance.choice((cut_off, other_bytes, without_span))(path.read_bytes(), chance))
        return
    with zipfile.ZipFile(path) as archive:
        members = {name: archive.read(name) for name in archive.namelist()}
    name = chance.choice([member for member in members if member.endswith(suffixes)])
    if kind < 0.22:
        del members[chance.choice(list(members))]
    elif kind < 0.3:
        members[chance.choice(("../escaped", "/escaped", "a\\..\\..\\escaped", "x" * 300, "con"))] = members.pop(name)
    else:
        members[name] = mutant(members[name], Path(name).suffix, chance)
    with zipfile.ZipFile(path, "w") as archive:
        for member, content in members.items():
            archive.writestr(member, content)


def change_folder(folder: Path, chance: Random) -> Path:
    """A folder in which a file is a mutant, gone, a folder, or a link to itself; which file."""
    path = chance.choice(sorted(p for p in folder.rglob("*") if p.is_file()))
    kind = chance.random()
    if kind < 0.8:
        change_file(path, chance)
        return path
    path.unlink()
    if kind < 0.88:
        path.mkdir()
    elif kind < 0.94:
        path.symlink_to(path.name)
    return path


def copied(source: Path, target: Path) -> Path:
    """A fresh copy of a folder."""
    shutil.rmtree(target, ignore_errors=True)
    return Path(shutil.copytree(source, target, symlinks=True))


def _other_match(pattern: bytes, others: list[bytes], content: bytes, chance: Random) -> bytes:
    found = list(re.finditer(pattern, content))
    if not found:
        return content
    match = chance.choice(found)
    return content[: match.start()] + chance.choice(others) + content[match.end() :]
