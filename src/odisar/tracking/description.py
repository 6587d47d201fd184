"""What a registered version says about itself, in Markdown; and what it needs to be loaded."""

from importlib.metadata import version

from odisar.deployment.deployed import Deployed
from odisar.deployment.development import DevelopmentScore
from odisar.deployment.samples import RECORDING_COLUMN

_TEXT = """\
# {title}

ODiSAR set-up `{setup}`, twin `{member}`{of_many}. It notices that the system leaves what the twin
knows, from samples up to now alone.

## Load it

```python
from pathlib import Path
from odisar.tracking.registry import load_model

model = load_model(Path("."), "{model}", "{number}")  # or "champion"
assessments = model.predict(table)
```

`load_model` holds every file against the tags of this version before it runs any.
`mlflow.pyfunc.load_model("models:/{model}/{number}")` holds the bundle against its own manifest
only. Nothing is pickled.

## What it takes

A table of samples at {rate_hz:g} Hz, {needed} to {max_rows} rows, each recording in the order of
time:

| column | unit | min | max |
|---|---|---|---|
{columns}

`{recording}` is optional and tells recordings apart. A table with anything missing, infinite,
outside its range or surplus is refused. The signature names no inputs, as MLflow would then drop
surplus columns and convert types before the model sees them.

## What it says

An assessment every {stride} samples, as the bundle's `assessment.schema.json` describes it: OOD
above a reconstruction error of {reconstruction:.6g}, uncertain above a variance of {variance:.6g}
(mean + {sigmas:g} standard deviations over {hours:.1f} h of calibration recordings).

## What was measured

{measured}

{decision}.
"""

_NEEDED = (
    "jsonschema",
    "mlflow",
    "numpy",
    "pandas",
    "pyarrow",
    "pydantic",
    "safetensors",
    "scipy",
    "torch",
)


def pip_requirements() -> list[str]:
    """Return what the served model imports, pinned to what is installed here.

    ``2.13.0+cpu`` is pinned as ``2.13.0``: package indexes do not offer local builds.
    """
    return [f"{name}=={version(name).partition('+')[0]}" for name in _NEEDED]


def describe_input(deployed: Deployed) -> list[dict[str, object]]:
    """Return the columns of the input: name, type, unit, range, whether it is required."""
    time_column = deployed.case.source.time_column
    columns: list[dict[str, object]] = [
        {"name": time_column, "type": "double", "unit": "s", "required": True}
    ]
    for c in deployed.case.channels:
        column = {"name": c.name, "type": "double", "unit": c.unit, "min": c.min, "max": c.max}
        columns.append({**column, "required": True})
    return [*columns, {"name": RECORDING_COLUMN, "type": "string", "required": False}]


def describe_version(
    deployed: Deployed, model: str, number: str, score: DevelopmentScore, decision: str
) -> str:
    """Return the description of a version, in Markdown."""
    origin, case, settings = deployed.manifest.origin, deployed.case, deployed.settings
    columns = [
        f"| {c['name']} | {c.get('unit', 'text')} | {c.get('min', '')} | {c.get('max', '')} |"
        for c in describe_input(deployed)
    ]
    return _TEXT.format(
        title=case.title,
        setup=origin.setup,
        member=origin.member,
        of_many=f", one of {origin.members} of the set-up" if origin.members > 1 else "",
        model=model,
        number=number,
        rate_hz=case.rate_hz,
        needed=case.window.context_steps + case.window.horizon_steps,
        max_rows=settings.max_rows,
        columns="\n".join(columns),
        recording=RECORDING_COLUMN,
        stride=settings.report_stride_steps,
        reconstruction=settings.thresholds.reconstruction,
        variance=settings.thresholds.variance,
        sigmas=settings.threshold_sigmas,
        hours=settings.calibration_hours,
        measured=_measured(score),
        decision=decision,
    )


def _measured(score: DevelopmentScore) -> str:
    if score.auroc is None:
        return "Nothing: there are no disturbed development recordings."
    interval = ""
    if score.ci_low is not None and score.ci_high is not None:
        interval = f" [{score.ci_low:.3f}, {score.ci_high:.3f}]"
    return (
        f"AUROC {score.auroc:.3f}{interval} under protocol P2 on {score.recordings} development "
        f"recordings ({score.windows} windows, all strengths pooled). Test recordings have no "
        "part in it; the report has their results."
    )
