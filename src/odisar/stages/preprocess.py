"""Read and check every recording of the active cases; store the good ones; show the splits."""

from collections.abc import Sequence

import pandas as pd

from odisar.artifacts import Workspace, write_table
from odisar.config.cases import Case
from odisar.config.loader import ConfigView
from odisar.config.score import FEWEST_KNOWN
from odisar.errors import OdisarError
from odisar.recordings.faults import FAULT_COLUMNS
from odisar.recordings.quality import (
    Finding,
    quality_table,
    raise_on_errors,
    write_findings,
    write_quality_table,
)
from odisar.recordings.reader import read_case
from odisar.recordings.recipe import check_recipe
from odisar.recordings.schema import INDEX_COLUMNS, Recording
from odisar.recordings.store import write_store
from odisar.stages.members import MemberData, hours, load_member, pipeline_members
from odisar.tracking import TrackedRun

PARAMS = ("seed", "pipeline", "setups", "cases", "simulators")


def run(config: ConfigView, workspace: Workspace, tracked: TrackedRun) -> None:
    """Run the stage; every error in any file of any case is named before it stops."""
    findings: list[Finding] = []
    recordings: dict[str, list[Recording]] = {}
    tables: list[pd.DataFrame] = []
    for name in config.active_cases:
        check_recipe(workspace.root, name, config.recipe_of(name))
        result = read_case(name, config.cases[name], workspace.root)
        findings.extend(result.findings)
        recordings[name] = result.recordings
        tables.append(
            quality_table(result.findings, result.recordings, result.files).assign(case=name)
        )
    raise_on_errors(findings)
    quality = pd.concat(tables, ignore_index=True)
    for name, group in recordings.items():
        write_store(workspace.recordings(name), group, config.cases[name].channel_names)
    write_quality_table(workspace.preprocess / "quality.csv", quality)
    write_findings(workspace.preprocess / "findings.json", findings)
    for name, group in recordings.items():
        require_columns(config.cases[name], group)
    splits = split_overview(config, workspace)
    require_disturbed(splits)
    write_table(workspace.preprocess / "splits.csv", splits)
    print_warnings(findings)
    tracked.metrics({"recordings": len(quality), "warnings": len(findings)})
    tracked.artifact(workspace.preprocess / "quality.csv")
    tracked.artifact(workspace.preprocess / "splits.csv")


def split_overview(config: ConfigView, workspace: Workspace) -> pd.DataFrame:
    """Return recordings, hours and windows of every split of every member."""
    rows = []
    for member in pipeline_members(config):
        data = load_member(config, workspace, member)
        require_scores(config.setups[member.setup].case, data)
        for split, group in data.splits.items():
            rows.append(
                {
                    "setup": member.setup,
                    "fold": member.fold,
                    "split": split,
                    "recordings": len(group),
                    "disturbed": sum(recording.info.is_disturbed for recording in group),
                    "overall": sum(_counts_overall(recording, data.case) for recording in group),
                    "hours": hours(group, data.case),
                    "windows": len(data.windows(split)) if group else 0,
                }
            )
    return pd.DataFrame(rows).astype({"fold": "Int64"})


def _counts_overall(recording: Recording, case: Case) -> bool:
    return recording.info.is_disturbed and all(
        recording.info.column(column) in allowed for column, allowed in case.groups.overall.items()
    )


def require_columns(case: Case, recordings: Sequence[Recording]) -> None:
    """Raise OdisarError where ``groups`` names a metadata column that no recording has."""
    known = set(INDEX_COLUMNS) | {column for item in recordings for column in item.info.extra}
    known |= set(FAULT_COLUMNS) if case.faults else set()
    groups = case.groups
    for column in [*groups.overall, *groups.group_by, *groups.apart]:
        if column not in known:
            raise OdisarError(
                f"case {case.title!r}: groups names the metadata column {column!r}, which no "
                f"recording has; known are {', '.join(sorted(known))}"
            )


def require_scores(case_name: str, data: MemberData) -> None:
    """Raise OdisarError where validation recordings are too short for the windows of the score.

    Before any training, as what is usual is learnt from them after it.
    """
    spec, longest = data.spec, data.case.score.longest_steps
    ahead = spec.horizon_steps if spec.known_ahead else 0
    segments = [segment for item in data.splits["validation"] for segment in item.segments]
    forecasts = [len(spec.issue_positions(segment, 1, horizon_steps=ahead)) for segment in segments]
    known = sum(max(0, count - longest) for count in forecasts)
    if known < FEWEST_KNOWN:
        raise OdisarError(
            f"cases.{case_name}.score: {known} samples of validation recordings lie behind a "
            f"context of {spec.context_steps} and the score's longest window of {longest}, and "
            f"at least {FEWEST_KNOWN} must, or nobody knows what is usual; shorten the windows, or "
            "add longer validation recordings"
        )


def require_disturbed(splits: pd.DataFrame) -> None:
    """Raise OdisarError for a set-up that nothing disturbed would test."""
    test = splits[splits.split == "test"].groupby("setup")[["disturbed", "overall"]].sum()
    for setup in test.index[test.disturbed == 0]:
        raise OdisarError(
            f"set-up {setup!r}: no test recording holds a disturbance, so no detector could be "
            "judged; label disturbed intervals in labels.csv, or declare `faults` for the case"
        )
    for setup in test.index[test.overall == 0]:
        raise OdisarError(
            f"set-up {setup!r}: no disturbed test recording is selected by the case's "
            "groups.overall; widen it, or leave it empty to take them all"
        )


def print_warnings(findings: list[Finding]) -> None:
    """Say what was found but did not stop the run, once a kind; the report shows each."""
    files: dict[tuple[str, str, str], list[str]] = {}
    for finding in findings:
        kind = (finding.column, finding.problem, finding.remedy)
        files.setdefault(kind, []).append(finding.file)
    for (column, problem, remedy), named in files.items():
        others = len(set(named)) - 1
        more = f" and {others} other file{'s' if others > 1 else ''}" if others else ""
        place = f"{named[0]}{more}" + (f", {column}" if column else "")
        print(f"warning: {place}: {problem}; {remedy}")  # noqa: T201
