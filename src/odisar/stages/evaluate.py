"""Score the test recordings, assess the reported windows, judge every detector."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import pandas as pd

from odisar.artifacts import Workspace, read_json, write_json, write_table
from odisar.capability.assessment import (
    Assessment,
    Capability,
    Thresholds,
    assessments_json,
)
from odisar.capability.scoring import Scorer
from odisar.config.judging import Judging
from odisar.config.loader import ConfigView
from odisar.evaluation.cells import metadata_columns
from odisar.evaluation.operating import operating_table
from odisar.evaluation.scored import ScoredRecording
from odisar.evaluation.tables import detection_table
from odisar.evaluation.window_tables import attribution_table, quadrant_table
from odisar.recordings.schema import Recording, label_times
from odisar.seeding import derive_seed
from odisar.stages.consequence import first_consequence
from odisar.stages.detectors import detector_scores
from odisar.stages.members import Member, load_member, pipeline_members
from odisar.stages.parallel import run_jobs, show_progress
from odisar.tracking import TrackedRun
from odisar.twin.bundle import read_twin
from odisar.twin.devices import pick_device, use_one_thread
from odisar.windows.nearness import nearness_table

PARAMS = ("seed", "pipeline", "setups", "cases", "capability", "evaluation")


#: Metrics, by detector, that a change of parameters is compared by.
_HEADLINE = {
    "odisar": ("auroc", "tnr_at_tpr95", "f1_ood", "false_alarms_per_hour", "events_detected"),
    "rmse": ("auroc",),
}


@dataclass(frozen=True)
class _Job:
    config: ConfigView
    root: Path
    member: Member
    position: int


@dataclass(frozen=True)
class _MemberResult:
    scored: list[ScoredRecording]
    scores: pd.DataFrame
    assessments: list[Assessment]
    assessed: pd.DataFrame
    nearness: pd.DataFrame


def run(config: ConfigView, workspace: Workspace, tracked: TrackedRun) -> None:
    """Run the stage."""
    setups = config.pipeline.setups
    jobs = [
        _Job(config, workspace.root, member, number % config.pipeline.workers)
        for number, member in enumerate(pipeline_members(config))
    ]
    done = run_jobs(_evaluate, jobs, config.pipeline.workers)
    results = {
        setup: [r for job, r in zip(jobs, done, strict=True) if job.member.setup == setup]
        for setup in setups
    }
    workspace.evaluate.mkdir(parents=True, exist_ok=True)
    for setup, parts in results.items():
        scores = pd.concat([part.scores for part in parts], ignore_index=True)
        scores.to_parquet(workspace.scores(setup), index=False)
        rows = [row for part in parts for row in part.assessments]
        workspace.assessments(setup).write_text(assessments_json(rows), encoding="utf-8")
        tracked.artifact(workspace.assessments(setup))
    tables = result_tables(config, results)
    for name, table in tables.items():
        write_table(workspace.results / f"{name}.csv", table)
        tracked.artifact(workspace.results / f"{name}.csv", "results")
    tracked.metrics(monitor_metrics(tables["detection"]))
    write_json(workspace.metrics, monitor_metrics(tables["detection"], _HEADLINE))


def result_tables(
    config: ConfigView, results: dict[str, list[_MemberResult]]
) -> dict[str, pd.DataFrame]:
    """Return every result table by file name; cases are judged apart and stacked."""
    tables: dict[str, list[pd.DataFrame]] = {}
    for name in config.active_cases:
        case = config.cases[name]
        mine = {s: parts for s, parts in results.items() if config.setups[s].case == name}
        scored = {s: [r for part in parts for r in part.scored] for s, parts in mine.items()}
        published = {s: config.setups[s].published_as for s in mine}
        assessed = pd.concat([p.assessed for parts in mine.values() for p in parts])
        seed = derive_seed(config.seed, "bootstrap", name)
        judged = (case.groups, Judging.of(config.evaluation, case))
        made = {
            "detection": detection_table(scored, *judged, case.persistence_s, seed, published),
            "operating": operating_table(scored, *judged, case.persistence_s),
            "quadrants": quadrant_table(assessed, *judged, seed, published),
            "attribution": attribution_table(assessed, case.groups),
            "nearness": pd.concat([p.nearness for parts in mine.values() for p in parts]),
        }
        for key, table in made.items():
            tables.setdefault(key, []).append(table)
    return {key: pd.concat(parts, ignore_index=True) for key, parts in tables.items()}


def monitor_metrics(
    detection: pd.DataFrame, only: Mapping[str, Sequence[str]] | None = None
) -> dict[str, float]:
    """Return the overall numbers of protocol P2 by dotted name.

    ``only`` narrows them to some metrics of some detectors: ``dvc metrics`` shows one row.
    """
    rows = detection[(detection.protocol == "P2") & (detection.evaluated_on == "overall")]
    if only is not None:
        wanted = [m in only.get(d, ()) for d, m in zip(rows.detector, rows.metric, strict=True)]
        rows = rows[wanted]
    rows = rows[(rows.detector != "oracle") & rows.value.notna()]
    metrics: dict[str, float] = {}
    for row in rows.to_dict("records"):
        strength = "" if pd.isna(row["strength"]) else f".s{row['strength']:g}"
        name = f"{row['setup']}.{row['detector']}{strength}.{row['metric']}"
        metrics[name] = round(float(row["value"]), 6)
    return metrics


def _evaluate(job: _Job) -> _MemberResult:
    use_one_thread()
    config, workspace, member = job.config, Workspace(job.root), job.member
    data = load_member(config, workspace, member)
    limits = read_json(workspace.thresholds(member.setup))["members"][member.name]
    twin = read_twin(workspace.twin(member.name))
    scorer = Scorer(twin, config.capability.scoring_batch, pick_device(config.pipeline.accelerator))
    capability = Capability(
        scorer,
        Thresholds(**limits["thresholds"]),
        attribution_top=config.capability.attribution_top,
    )
    step_s = 1 / data.case.rate_hz
    scored: list[ScoredRecording] = []
    frames: list[pd.DataFrame] = []
    assessments: list[Assessment] = []
    rows: list[dict[str, object]] = []
    for item in show_progress(data.splits["test"], member.name, job.position):
        scores = scorer.score(item, short_lead_steps=data.case.short_lead_steps)
        by_detector = detector_scores(data.case, item, scores)
        times = item.time_s[scores.positions]
        scored.append(
            ScoredRecording(
                name=item.name,
                info=item.info,
                intervals=item.intervals,
                time_s=times,
                scores=by_detector,
                thresholds=limits["sigma"],
                operating_thresholds=limits["operating"],
                first_consequence_s=first_consequence(
                    item, data.case, limits, config.evaluation.consequence_s
                ),
                horizon_steps=twin.spec.horizon_steps,
                context_steps=twin.spec.context_steps,
                step_s=step_s,
            )
        )
        frames.append(pd.DataFrame({"recording": item.name, "time_s": times, **by_detector}))
        made = capability.assess(item, scores, stride_steps=twin.spec.horizon_steps, step_s=step_s)
        assessments.extend(made)
        columns = metadata_columns(data.case.groups)
        rows.extend(_assessed_row(member.setup, item, columns, one) for one in made)
    return _MemberResult(
        scored,
        pd.concat(frames, ignore_index=True),
        assessments,
        pd.DataFrame(rows),
        nearness_table(member.name, data.splits, data.scaler, data.spec),
    )


def _assessed_row(
    setup: str, item: Recording, columns: list[str], assessment: Assessment
) -> dict[str, object]:
    info = item.info
    states = [*assessment.state_attribution, "", "", ""][:3]
    issued = item.time_s[[assessment.start_time_step - 1]]
    return {
        "setup": setup,
        "recording": item.name,
        "base_seed": info.base_seed or item.name,
        **{column: info.column(column) for column in columns},
        "strength": info.strength,
        "is_disturbed": bool(label_times(issued, item.intervals)[0]),
        "category": assessment.category,
        **{f"state_{i + 1}": state for i, state in enumerate(states)},
    }
