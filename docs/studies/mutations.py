"""The mutation study: change one thing at a time, and see whether a comparison with a baseline notices.

    python docs/studies/mutations.py

does all of it (a minute; it builds nineteen FMUs) and rewrites the tables in ``docs/reference/mutation_study.md``. This
folder holds studies of the package itself, whose tables stand in the pages; the tests recompute a part of each and
compare.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from mutants import all_mutations
from repetitions import other_steps, repetitions
from tqdm import tqdm
from verdicts import DEFAULT, RELATIVE, Row, counted, evaluate

PAGE = Path(__file__).parents[1] / "reference" / "mutation_study.md"
PART = r"(<!-- generated: {name} -->\n)(.*?)(<!-- end -->)"
WORDS = {False: "no", True: "yes"}


def main() -> None:
    """Run everything and rewrite the page."""
    with evaluate() as evaluated:
        changes = [evaluated.mutation(mutation) for mutation in tqdm(all_mutations(), desc="changes")]
        beside = evaluated.not_nested()
        equal = [
            row for r in tqdm([*repetitions(), *other_steps()], desc="repetitions") for row in evaluated.repetition(r)
        ]
    text = PAGE.read_text(encoding="utf-8")
    for name, content in parts(changes, equal, beside).items():
        text = re.sub(PART.format(name=name), lambda m, c=content: m[1] + c + m[3], text, flags=re.DOTALL)  # type: ignore[misc]
    PAGE.write_text(text, encoding="utf-8", newline="\n")
    print(f"{PAGE.name}: {counted(r for r in changes if not r.harmless)} caught, {counted(equal)} false alarms")


def parts(changes: Sequence[Row], equal: Sequence[Row], beside: Row) -> Mapping[str, str]:
    """The generated parts of the page by name."""
    harmful, harmless = ([row for row in changes if row.harmless is kind] for kind in (False, True))
    return {
        "summary": summary(harmful, harmless, equal),
        "changes": "".join(f"### {group.capitalize()}\n\n{table(rows)}\n" for group, rows in grouped(harmful).items()),
        "not caught": not_caught(harmful),
        "harmless": table(harmless),
        "same": repeated(equal),
        "not nested": f"{beside.change.capitalize()}: {beside.found or 'nothing found'}, {beside.size}.\n",
    }


def grouped(rows: Iterable[Row]) -> dict[str, list[Row]]:
    """Rows by group, in order."""
    groups: dict[str, list[Row]] = {}
    for row in rows:
        groups.setdefault(row.group, []).append(row)
    return groups


def summary(harmful: Sequence[Row], harmless: Sequence[Row], equal: Sequence[Row]) -> str:
    """How many are caught, at each tolerance."""
    lines = [f"| relative tolerance | {_tolerances()} |", f"|---|{'---|' * len(RELATIVE)}"]
    for group, rows in grouped(harmful).items():
        lines.append(_counts(f"{group}: caught of {len(rows)}", rows))
    lines.append(_counts(f"**all: caught of {len(harmful)}**", harmful))
    lines.append(_counts(f"harmless changes: caught of {len(harmless)}", harmless))
    lines.append(_counts(f"unchanged runs and other steps: false alarms in {len(equal)} comparisons", equal))
    return "\n".join([*lines, ""])


def table(rows: Iterable[Row]) -> str:
    """Verdicts in a table."""
    lines = [f"| change | {_tolerances()} | found | how large | also |", f"|---|{'---|' * len(RELATIVE)}---|---|---|"]
    lines += [f"| {row.change} | {_verdicts(row)} | {row.found} | {row.size} | {row.others} |" for row in rows]
    return "\n".join([*lines, ""])


def not_caught(rows: Iterable[Row]) -> str:
    """What passes at the default tolerance, and why."""
    lines = ["| change | largest difference | why |", "|---|---|---|"]
    lines += [f"| {row.change} | {row.size} | {row.why} |" for row in rows if not row.caught_by_default]
    return "\n".join([*lines, ""])


def repeated(rows: Iterable[Row]) -> str:
    """Repetitions, all of one kind in a line, those with the thinned baseline in a column of their own."""
    columns = f"| run | comparisons | {_tolerances()} | row every 40 ms | largest difference |"
    lines = [columns, f"|---|---|{'---|' * len(RELATIVE)}---|---|"]
    kinds: dict[str, list[Row]] = {}
    for row in rows:
        kinds.setdefault(row.change, []).append(row)
    for what, entries in kinds.items():
        full, thinned = ([r for r in entries if r.group.endswith("thinned") is kind] for kind in (False, True))
        alarms = " | ".join(str(sum(r.caught[k] for r in full)) for k in range(len(RELATIVE)))
        sizes = " / ".join(dict.fromkeys(r.size for r in full))
        lines.append(f"| {what} | {len(full)} | {alarms} | {counted(thinned)[0]} | {sizes} |")
    return "\n".join([*lines, ""])


def _tolerances() -> str:
    return " | ".join(f"**{r:g}**" if r == DEFAULT else f"{r:g}" for r in RELATIVE)


def _verdicts(row: Row) -> str:
    return " | ".join(WORDS[caught] for caught in row.caught)


def _counts(what: str, rows: Sequence[Row]) -> str:
    return f"| {what} | {' | '.join(str(sum(row.caught[k] for row in rows)) for k in range(len(RELATIVE)))} |"


if __name__ == "__main__":
    main()
