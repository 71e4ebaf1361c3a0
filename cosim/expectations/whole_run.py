"""Judges of what holds for a run as a whole: certificates and warnings. Standard library only."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from cosim.evaluation.facts import list_entry, mapping_entry, number_entry
from cosim.expectations.judged import Judged
from cosim.expectations.run import NotRecordedError, Run

if TYPE_CHECKING:
    from cosim.scenario.expectation_tables import CertificateExpectation, WarningsExpectation

WARNINGS_SHOWN = 3


def judge_certificate(item: CertificateExpectation, run: Run) -> list[Judged]:
    """Certified for the longest gap that was expected, where that was known, and for the longest that occurred."""
    certificates = mapping_entry(run.result, "certificates")
    names = list(certificates) if item.of is None else [item.of] if isinstance(item.of, str) else list(item.of)
    if not names:
        raise NotRecordedError("nothing to judge: no observer of this run has a certificate")
    return [_certificate(name, certificates.get(name), run) for name in names]


def _certificate(observer: str, entry: Any, run: Run) -> Judged:
    name = f"certificate of {observer}"
    if not isinstance(entry, Mapping):
        return Judged(name, "certificate", passed=False, unit="s", text="nothing to judge: it has no certificate")
    limit, seen = number_entry(entry, "aperiodic_limit"), number_entry(entry, "largest_gap_seen")
    expected, bound = number_entry(entry, "max_gap"), "any gap" if limit is None else f"gaps up to {limit:.4g} s"
    wanted = "longer gaps" if expected is None else f"gaps of {expected:.4g} s"
    values: dict[str, Any] = {"limit": float("inf") if limit is None else limit, "unit": "s"}
    if entry.get("holds") is False:
        text = f"certified for {bound}, expected were {wanted}"
        return Judged(
            name,
            "certificate",
            passed=False,
            measured=float("nan") if expected is None else expected,
            text=text,
            **values,
        )
    before = f"expected were {wanted}" if expected is not None else "what to expect was not known before the run"
    if seen is None:
        return Judged(
            name, "certificate", passed=False, text=f"certified for {bound}, {before}; no gap was seen", **values
        )
    passed = (limit is None or seen <= limit) and run.result.failure is None
    text = f"certified for {bound}, {before}, {seen:.4g} s occurred"
    text += "; not reached: the run ended early" if run.result.failure is not None else ""
    return Judged(name, "certificate", passed=passed, measured=seen, text=text, **values)


def judge_warnings(item: WarningsExpectation, run: Run) -> list[Judged]:
    """The number of warnings of the run."""
    warnings = [str(text) for text in list_entry(run.result, "warnings")]
    passed = len(warnings) <= item.at_most
    text = f"{len(warnings)}, expected at most {item.at_most}"
    if not passed:
        text += ": " + " | ".join(warnings[:WARNINGS_SHOWN]) + (" | ..." if len(warnings) > WARNINGS_SHOWN else "")
    if run.result.failure is not None:
        text += "; not reached: the run ended early" if passed else ""
        passed = False
    return [Judged("warnings", "warnings", passed, float(len(warnings)), float(item.at_most), text=text)]
