"""How often ``fmus check`` is wrong: with an FMU in C that lies in one way at a time, and with FMUs of others.

``python docs/studies/check_errors.py [FOLDER ...] --write`` (two minutes, and three seconds for each FMU in the
folders) compiles tests/fmus/lying_fmu.c once for each lie, checks the results, checks the co-simulation FMUs of FMI 2.0
and 3.0 in the folders that have a library for this platform, each content once, and writes both tables into
docs/reference/checking.md. What was checked is kept in ``check_errors.jsonl`` and not checked again.
"""

from __future__ import annotations

import json
import re
import sys
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from hashlib import sha256
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from page_tables import print_tables

from fmus.check import CheckReport, Class, Verdict, check_fmu
from fmus.fmi.archive import NotAnFmuError, open_archive
from fmus.fmi.standard import CO_SIMULATION

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests" / "fmus"))
from lying_fmus import SLAVE, SOURCE, STATES, build, description  # noqa: E402 - the folder of the tests

PAGE, KEPT = ROOT / "docs" / "reference" / "checking.md", Path("check_errors.jsonl")
TIMEOUT = 10.0
HARMLESS = {
    "PRINTS",
    "WARNS",
    "ACCEPTS_ANYTHING",
    "REFUSES_END",
    "READS_ENVIRONMENT",
    "LOCALISES",
    "STRICT_END",
    "LEAKS_LITTLE",
    "LATCHES",
}
"""No lies that a run of this package meets: they must be used as they are."""

IN_MODEL_EXCHANGE = {"DERIVATIVE", "STATES_NOT_SET", "DERIVATIVES_DRIFT", "NAN_DERIVATIVE"}
TOOLS = (
    "Dymola",
    "OpenModelica",
    "Reference FMUs",
    "20-sim",
    "HOPSAN",
    "Simulink",
    "Overture",
    "PythonFMU",
    "JModelica",
)
REFUSED = "not judged here"


def lies() -> list[str]:
    """The names of the lies that the source knows."""
    return sorted(set(re.findall(r"LIE_([A-Z_]+)", SOURCE.read_text(encoding="utf-8"))))


def checked_lies() -> Iterator[tuple[str, CheckReport]]:
    """Each lie with what is found; the honest FMU is the lie of no name."""
    with TemporaryDirectory() as folder:
        for lie in ["", *lies()]:
            slave = None if lie in IN_MODEL_EXCHANGE else SLAVE
            fmu = build(Path(folder) / (lie or "honest"), *filter(None, [lie]), xml=description(slave, STATES))
            yield lie, check_fmu(fmu, timeout=TIMEOUT)


def table_of_lies() -> str:
    """Lie, verdict, what found it."""
    rows, missed, accused, count = [], [], [], 0
    for lie, report in checked_lies():
        honest = not lie or lie in HARMLESS
        count += not honest
        if honest and report.verdict is not Class.USE:
            accused.append(lie or "honest")
        if not honest and report.verdict is Class.USE:
            missed.append(lie)
        found = [f.check for f in report.findings if f.verdict in (Verdict.NOTE, Verdict.LIMIT, Verdict.DISTRUST)]
        name = lie.lower().replace("_", " ") or "(none)"
        rows.append(f"| {name} | {'no' if honest else 'yes'} | {report.verdict} | {', '.join(found) or '-'} |")
    head = "| what it does | a lie | verdict | found by |\n|---|---|---|---|"
    summary = (
        f"Missed: {len(missed)} of {count} lies{listed(missed)}. "
        f"Accused: {len(accused)} of {len(rows) - count} that tell none{listed(accused)}."
    )
    return "\n".join([summary, "", head, *rows])


def listed(names: Sequence[str]) -> str:
    """The names behind a number, where there are some."""
    return f" ({', '.join(names)})" if names else ""


def checked_files(folders: Sequence[Path]) -> list[dict[str, Any]]:
    """What was found of the FMUs in folders, each content once; lines of `KEPT`."""
    kept = [json.loads(line) for line in KEPT.read_text(encoding="utf-8").splitlines()] if KEPT.exists() else []
    known = {line["sha"] for line in kept}
    for path in sorted(file for folder in folders for file in folder.rglob("*.fmu")):
        sha = sha256(path.read_bytes()).hexdigest()[:16]
        if sha not in known and (found := checked_file(path)) is not None:
            known.add(sha)
            kept.append({"sha": sha, "path": str(path)} | found)
            with KEPT.open("a", encoding="utf-8") as file:
                file.write(json.dumps(kept[-1]) + "\n")
    return kept


def checked_file(path: Path) -> dict[str, Any] | None:
    """What was found of an FMU; None where there is nothing to check on this platform."""
    try:
        archive = open_archive(path)
        archive.demand_this_platform()
    except (NotAnFmuError, OSError):
        return None
    if CO_SIMULATION not in archive.interfaces:
        return None
    tool = str(archive.description.generationTool or "")
    try:
        report = check_fmu(path, timeout=TIMEOUT)
    except NotAnFmuError as error:
        return {"tool": tool, "verdict": REFUSED, "why": str(error)}
    return {"tool": tool, "verdict": str(report.verdict), "findings": [f.to_dict() for f in report.findings]}


def table_of_tools(found: Sequence[Mapping[str, Any]]) -> str:
    """How many FMUs of each tool got which verdict, and what the limits were."""
    by_tool: dict[str, list[Mapping[str, Any]]] = {}
    for one in found:
        named = (tool for tool in TOOLS if tool.lower() in one["tool"].lower())
        by_tool.setdefault(next(named, "others, or unnamed"), []).append(one)
    rows = ["| tool | use as it is | with limits | do not trust | not judged | most limits (FMUs) |"]
    rows.append("|---|---|---|---|---|---|")
    for tool, members in sorted(by_tool.items(), key=lambda item: -len(item[1])):
        verdicts = Counter(one["verdict"] for one in members)
        limits = Counter(f["check"] for one in members for f in one.get("findings", ()) if f["verdict"] == "limit")
        most = ", ".join(f"{check} ({count})" for check, count in limits.most_common(3))
        counts = [verdicts[kind] for kind in (Class.USE, Class.LIMITS, Class.DISTRUST)]
        rows.append(f"| {tool} | {' | '.join(map(str, counts))} | {len(members) - sum(counts)} | {most or '-'} |")
    return "\n".join(rows)


if __name__ == "__main__":
    folders = [Path(word) for word in sys.argv[1:] if not word.startswith("-")]
    tables = {"lies": table_of_lies()}
    if folders:
        tables["tools"] = table_of_tools(checked_files(folders))
    print_tables(PAGE, tables)
