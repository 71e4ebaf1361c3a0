"""The gains of an observer are certified for the gaps that occur."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Literal, Self

from cosim.errors import ScenarioError, nearest
from cosim.evaluation.summary_entries import certified_gap, mapping_entry, number_entry
from cosim.expectations.evaluated import Evaluated
from cosim.expectations.evaluated_run import EvaluatedRun, NotRecordedError
from cosim.expectations.expectation import Expectation
from cosim.toml_table import Name

if TYPE_CHECKING:
    from cosim.expectations.before import Before

SEEN = "largest_gap_seen"
_NEVER_CERTIFIED = 'certificates = "ignore" leaves nothing to evaluate; remove that line'


class CertificateExpectation(Expectation):
    """The gains of an observer are certified for the gaps that were expected and for those that occurred."""

    check: Literal["certificate"]
    of: Name | list[Name] | None = None

    def prepare(self, before: Before) -> Self:
        """There are balises, and certificates are asked for."""
        if before.receivers is None:
            raise ScenarioError("this scenario has no balises, so there are no gaps to be certified for")
        if before.certificates == "ignore":
            raise ScenarioError(_NEVER_CERTIFIED)
        for name in before.named(self.of, before.receivers, "observer"):
            if name not in before.receivers:
                raise ScenarioError(f"{name!r} receives no telegrams; {nearest(name, before.receivers)}")
        return self

    def evaluate(self, run: EvaluatedRun) -> list[Evaluated]:
        """Certified for the longest gap that was expected, where that was known, and for the longest that occurred."""
        certificates = mapping_entry(run.result, "certificates")
        certified = [name for name, entry in certificates.items() if isinstance(entry, Mapping) and SEEN in entry]
        names = certified if self.of is None else [self.of] if isinstance(self.of, str) else list(self.of)
        if not names:
            raise NotRecordedError("nothing to evaluate: no observer of this run has a certificate")
        return [_certificate(name, certificates.get(name), run) for name in names]


def _certificate(observer: str, entry: Any, run: EvaluatedRun) -> Evaluated:
    name = f"certificate of {observer}"
    if not isinstance(entry, Mapping):
        return Evaluated(name, "certificate", passed=False, unit="s", text="nothing to evaluate: it has no certificate")
    limit, seen = certified_gap(entry), number_entry(entry, SEEN)
    expected, bound = number_entry(entry, "max_gap"), "any gap" if limit is None else f"gaps up to {limit:.4g} s"
    wanted = "longer gaps" if expected is None else f"gaps of {expected:.4g} s"
    values: dict[str, Any] = {"limit": float("inf") if limit is None else limit, "unit": "s"}
    if entry.get("holds") is False:
        text = f"certified for {bound}, expected were {wanted}"
        return Evaluated(
            name,
            "certificate",
            passed=False,
            measured=float("nan") if expected is None else expected,
            text=text,
            **values,
        )
    before = f"expected were {wanted}" if expected is not None else "what to expect was not known before the run"
    if seen is None:
        return Evaluated(
            name, "certificate", passed=False, text=f"certified for {bound}, {before}; no gap was seen", **values
        )
    passed = (limit is None or seen <= limit) and run.result.failure is None
    text = f"certified for {bound}, {before}, {seen:.4g} s occurred"
    text += "; not reached: the run ended early" if run.result.failure is not None else ""
    return Evaluated(name, "certificate", passed=passed, measured=seen, text=text, **values)
