"""Score the test recordings, assess the reported windows, judge every detector."""

from collections.abc import Mapping, Sequence

import pandas as pd

from odisar.artifacts import Workspace, write_json, write_table
from odisar.capability.assessment import assessments_json
from odisar.config.loader import ConfigView
from odisar.stages.assessing import Job, evaluate_member
from odisar.stages.members import pipeline_members
from odisar.stages.parallel import run_jobs
from odisar.stages.result_tables import result_tables
from odisar.tracking import TrackedRun

PARAMS = ("seed", "pipeline", "setups", "cases", "capability", "evaluation")


#: Metrics, by detector, that a change of parameters is compared by.
_HEADLINE = {
    "odisar": ("auroc", "tnr_at_tpr95", "f1_ood", "false_alarms_per_hour", "events_detected"),
    "rmse": ("auroc",),
}


def run(config: ConfigView, workspace: Workspace, tracked: TrackedRun) -> None:
    """Run the stage."""
    setups = config.pipeline.setups
    jobs = [
        Job(config, workspace.root, member, number % config.pipeline.workers)
        for number, member in enumerate(pipeline_members(config))
    ]
    done = run_jobs(evaluate_member, jobs, config.pipeline.workers)
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
