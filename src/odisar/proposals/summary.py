"""What `odisar new-case` says beside the proposal: what it saw, doubts, and what to run next."""

import textwrap
from collections.abc import Sequence
from pathlib import Path

from odisar.proposals.conversion import quoted
from odisar.proposals.inspection import counts_of, plural
from odisar.proposals.new_case import Proposal, gap_free_hours, unsure_of
from odisar.proposals.samples import names
from odisar.proposals.tables import WIDTH, printable, shortened
from odisar.recordings.quality import Finding

_LISTED = 12


def summary(proposal: Proposal, folder: Path, *, written: bool) -> str:
    """Return the summary of a proposal, a few short lists."""
    result, case = proposal.result, proposal.case
    hours = gap_free_hours(result.recordings)
    overview = (
        f"{plural(proposal.files, 'recording')}, {len(result.recordings)} of them sound, "
        f"{hours:.2g} h, at {case.rate_hz:g} Hz; {plural(len(case.channels), 'channel')}, "
        f"{len(case.output_names)} of them forecast"
    )
    parts = [
        overview,
        _list("Seen", proposal.remarks),
        _list("Not sure of", unsure_of(proposal.text), every=True),
        _quality(proposal),
        _next(proposal, folder, written=written),
    ]
    return "\n\n".join(part for part in parts if part)


def _list(title: str, items: Sequence[str], *, every: bool = False) -> str:
    if not items:
        return ""
    shown = list(items if every else items[:_LISTED])
    if len(items) > len(shown):
        shown.append(f"and {len(items) - len(shown)} more")
    lines = [textwrap.fill(printable(item), WIDTH, initial_indent="  - ", subsequent_indent="    ")
             for item in shown]  # fmt: skip
    return "\n".join([f"{title}:", *lines])


def _quality(proposal: Proposal) -> str:
    left_out = {*proposal.left_out}
    findings = [item for item in proposal.result.findings if item.column not in left_out]
    if not findings:
        return "Quality check: no findings."
    counts = counts_of(findings)
    kinds: dict[tuple[str, str, str], list[Finding]] = {}
    for finding in sorted(findings, key=lambda item: item.severity):
        kinds.setdefault((finding.severity, finding.column, finding.problem), []).append(finding)
    return _list(f"Quality check: {counts}", [_kind(group) for group in kinds.values()])


def _kind(group: Sequence[Finding]) -> str:
    first = group[0]
    place = Path(first.file).name + (f", row {first.row}" if first.row is not None else "")
    place += f", {first.column}" if first.column else ""
    entries = [item.value for item in group if item.value and not item.column]
    if first.row is None and entries:  # about an entry of the folder, or why a bag can't be read
        place += f", {names([shortened(entry, 60) for entry in entries], 4)}"
    files = len({finding.file for finding in group})
    more = f" (in {files} files)" if files > 1 else ""
    return printable(f"{first.severity}: {place}: {first.problem}{more}; {first.remedy}")


def _next(proposal: Proposal, folder: Path, *, written: bool) -> str:
    where = printable(quoted(folder))
    steps = []
    if written:
        steps.append(f"edit the lines marked `# ?` in params.yaml (profiles.{proposal.name})")
    else:
        steps.append(
            f"odisar new-case {where} --name {proposal.name} --write   (puts it into params.yaml)"
        )
        steps.append("edit the lines marked `# ?` there")
    steps.append(f"odisar inspect {where} --profile {proposal.name}")
    steps.append(f"odisar profile {proposal.name}")
    lines = [f"  {number}. {step}" for number, step in enumerate(steps, start=1)]
    return "\n".join(["Next:", *lines])
