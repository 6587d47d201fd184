"""What leakage probes found about a detector, as a table and in a sentence for each probe."""

from collections.abc import Iterable
from dataclasses import dataclass

import pandas as pd

from odisar.evaluation.leakage_probes import (
    BATCH,
    CONTROL,
    FUTURE,
    LABELS,
    REPEAT,
    TRUNCATION,
    Comparison,
)

LEAKAGE_COLUMNS = ("detector", "probe", "moved", "largest_change", "share_of_iqr", "positions")

_WHAT_CHANGED = {
    REPEAT: "asking again about the same recording",
    FUTURE: "changing all samples after one",
    TRUNCATION: "ending the recording at a sample",
    BATCH: "changing the other recordings of the call",
    LABELS: "changing the labels",
    CONTROL: "changing the states at a sample by one sigma",
}


@dataclass(frozen=True)
class Finding:
    """What one probe found: all its comparisons, of a score with interquartile range ``iqr``."""

    probe: str
    comparisons: tuple[Comparison, ...]
    iqr: float

    @property
    def tried(self) -> int:
        """How many changes were tried."""
        return len(self.comparisons)

    @property
    def moved(self) -> int:
        """How many of them moved the score."""
        return sum(comparison.moved for comparison in self.comparisons)

    @property
    def passed(self) -> bool:
        """Whether none moved the score; of the control, whether all did."""
        return self.moved == (self.tried if self.probe == CONTROL else 0)

    @property
    def largest(self) -> Comparison:
        """The comparison with the largest change of the score: what, by how much and where."""
        return max(self.comparisons, key=lambda comparison: comparison.largest_change)

    @property
    def share_of_iqr(self) -> float:
        """The largest change as a share of the score's interquartile range; inf of a zero range."""
        change = self.largest.largest_change
        if change == 0:
            return 0.0
        return change / self.iqr if self.iqr > 0 else float("inf")


@dataclass(frozen=True)
class LeakageReport:
    """What the probes found about one detector, in the order of ``leakage_probes.PROBES``.

    ``control_delay_steps`` is how long the control waited for the score to move, and
    ``tolerated_share`` the share of the score's interquartile range that was no move.
    """

    detector: str
    findings: tuple[Finding, ...]
    control_delay_steps: int
    tolerated_share: float

    @property
    def passed(self) -> bool:
        """Whether every probe passed, the control included."""
        return not self.failed_probes

    @property
    def failed_probes(self) -> tuple[str, ...]:
        """Names of the probes that didn't pass."""
        return tuple(finding.probe for finding in self.findings if not finding.passed)

    def finding(self, probe: str) -> Finding:
        """Return what the probe of this name found."""
        return next(finding for finding in self.findings if finding.probe == probe)

    def table(self) -> pd.DataFrame:
        """Return a row for each probe, with the columns ``LEAKAGE_COLUMNS``.

        ``positions`` counts the changes that were tried, ``moved`` those that moved the score: 0
        is right for every probe but the control, which must move it every time.
        """
        rows = [
            (
                self.detector,
                finding.probe,
                finding.moved,
                finding.largest.largest_change,
                finding.share_of_iqr,
                finding.tried,
            )
            for finding in self.findings
        ]
        return pd.DataFrame(rows, columns=list(LEAKAGE_COLUMNS))

    def sentences(self) -> tuple[str, ...]:
        """Return a sentence for each probe."""
        return tuple(
            f"{self.detector}, {finding.probe}: {_WHAT_CHANGED[finding.probe]} "
            f"{self._outcome(finding)}."
            for finding in self.findings
        )

    def _outcome(self, finding: Finding) -> str:
        if finding.probe == CONTROL:
            return _control_outcome(finding, self.control_delay_steps)
        share = self.tolerated_share
        limit = f" by more than {share:g} of its interquartile range" if share else ""
        which = "score up to it" if finding.probe in (FUTURE, TRUNCATION) else "score"
        outcome = f"moved a {which}{limit} in {finding.moved} of {finding.tried} tries"
        if finding.passed:
            return outcome
        largest = finding.largest
        after = "" if largest.sample is None else f" {largest.sample}"
        return (
            f"{outcome}, most at sample {largest.at_sample} of {largest.recording!r} "
            f"({largest.change}{after}): by {largest.largest_change:.3g}, "
            f"{finding.share_of_iqr:.3g} of its interquartile range"
        )


def leakage_table(reports: Iterable[LeakageReport]) -> pd.DataFrame:
    """Return the tables of several detectors (at least one) below one another."""
    return pd.concat([report.table() for report in reports], ignore_index=True)


def _control_outcome(finding: Finding, delay_steps: int) -> str:
    when = f"within {delay_steps} samples" if delay_steps else "at that sample"
    outcome = f"moved the score {when} in {finding.moved} of {finding.tried} tries"
    if finding.passed:
        waits = [comparison.waited_steps or 0 for comparison in finding.comparisons]
        return f"{outcome}, after {max(waits)} at the latest" if delay_steps else outcome
    still = next(comparison for comparison in finding.comparisons if not comparison.moved)
    waited = still.waited_steps
    then = "never moved" if waited is None else f"moved first {waited} samples later"
    return f"{outcome}; at sample {still.sample} of {still.recording!r} it {then}"
