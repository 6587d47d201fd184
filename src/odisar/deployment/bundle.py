"""A bundle on disk: a trained twin, its calibration, its case, an example, and the manifest."""

import shutil
from pathlib import Path
from typing import TypeVar

import torch
from pydantic import ValidationError

from odisar.capability.assessment import assessment_schema
from odisar.config.base import Section
from odisar.config.cases import Case
from odisar.deployment.deployed import CapabilitySettings, Deployed, Example
from odisar.deployment.manifest import (
    MANIFEST_FILE,
    Origin,
    first_problem,
    read_json_object,
    read_manifest,
    write_json_object,
    write_manifest,
)
from odisar.errors import OdisarError
from odisar.forecasters.closed_form import design_width
from odisar.twin.bundle import TrainedTwin, read_twin, write_twin
from odisar.windows.coordinates import pose_channels

CAPABILITY_FILE, CASE_FILE = "capability.json", "case.json"
SCHEMA_FILE, EXAMPLE_FILE = "assessment.schema.json", "example.json"

Model = TypeVar("Model", bound=Section)


def write_bundle(
    folder: Path,
    twin: TrainedTwin,
    case: Case,
    settings: CapabilitySettings,
    origin: Origin,
    example: Example,
) -> None:
    """Write a bundle into a folder, in place of a bundle that is there; equal input, equal bytes.

    Raises OdisarError where the folder holds something else.
    """
    if folder.exists():
        if any(folder.iterdir()) and not (folder / MANIFEST_FILE).is_file():
            raise OdisarError(f"{folder} holds files that are no bundle; name another folder")
        shutil.rmtree(folder)
    write_twin(folder, twin)
    write_json_object(folder / CAPABILITY_FILE, settings.model_dump())
    write_json_object(folder / CASE_FILE, case.model_dump())
    write_json_object(folder / SCHEMA_FILE, assessment_schema())
    write_json_object(folder / EXAMPLE_FILE, example.model_dump())
    write_manifest(folder, origin)
    for path in folder.iterdir():
        path.chmod(0o644)  # safetensors would keep others from reading it


def read_bundle(folder: Path) -> Deployed:
    """Read a bundle and return what it deploys.

    Nothing is unpickled or executed. Raises OdisarError, naming the file and the way out, where
    the manifest or a file is not as written, the parts do not fit each other, or the example is
    not assessed.
    """
    manifest = read_manifest(folder)
    settings = _read(folder / CAPABILITY_FILE, CapabilitySettings)
    case = _read(folder / CASE_FILE, Case)
    example = _read(folder / EXAMPLE_FILE, Example)
    if read_json_object(folder / SCHEMA_FILE) != assessment_schema():
        raise OdisarError(
            f"{folder / SCHEMA_FILE} is not the schema of odisar's assessments here; use odisar "
            f"{manifest.odisar}, which wrote the bundle"
        )
    twin = _read_twin(folder)
    _check_fit(folder, twin, case)
    _check_innovation(folder, twin, settings)
    deployed = Deployed(twin, case, settings, manifest, example)
    _check_example(folder, deployed)
    return deployed


def _read(path: Path, kind: type[Model]) -> Model:
    content = read_json_object(path)
    try:
        return kind.model_validate(content)
    except ValidationError as error:
        raise OdisarError(
            f"{path}: {first_problem(error)}; write the bundle again with this odisar"
        ) from error
    except ArithmeticError as error:
        raise OdisarError(
            f"{path}: a number is too large ({error}); write the bundle again"
        ) from error


def _read_twin(folder: Path) -> TrainedTwin:
    try:
        return read_twin(folder)
    except OdisarError as error:
        # What read_twin advises is for the pipeline's own folders.
        reason = str(error).partition("; run the train stage")[0]
        raise OdisarError(f"{reason}; write the bundle again") from error


def _check_fit(folder: Path, twin: TrainedTwin, case: Case) -> None:
    """Raise where twin and case do not belong together, or the weights hold what is no number."""
    for what, of_twin, of_case in (
        ("channels", list(twin.channel_names), case.channel_names),
        ("outputs", list(twin.spec.outputs), case.output_indices),
        ("commands", list(twin.spec.commands), case.command_indices),
        ("pose", twin.spec.pose, pose_channels(case)),
        ("known_ahead", list(twin.spec.known_ahead), case.known_ahead_indices),
        ("context_steps", twin.spec.context_steps, case.window.context_steps),
        ("horizon_steps", twin.spec.horizon_steps, case.window.horizon_steps),
    ):
        if of_twin != of_case:
            raise OdisarError(
                f"{folder}: twin.json and {CASE_FILE} differ in {what}: {of_twin} and {of_case}; "
                "write the bundle again from one run of the pipeline"
            )
    if not all(bool(torch.isfinite(part).all()) for part in twin.network.state_dict().values()):
        raise OdisarError(f"{folder}: weights.safetensors holds NaN or infinity; train it again")


def _check_innovation(folder: Path, twin: TrainedTwin, settings: CapabilitySettings) -> None:
    """Raise where the fitted score is not of this twin's states."""
    states = len(twin.network.state_features)
    if settings.innovation.states != {states}:
        raise OdisarError(
            f"{folder / CAPABILITY_FILE}: innovation has covariances of "
            f"{sorted(settings.innovation.states)} states, the twin {states}; write the bundle "
            "again from one run of the pipeline"
        )
    tied, regressors = settings.innovation.relations, design_width(len(twin.scaler.mean), 1)
    if tuple(tied.states) != tuple(twin.network.state_features) or any(
        len(row) != regressors for row in tied.weights
    ):
        raise OdisarError(
            f"{folder / CAPABILITY_FILE}: innovation.relations are not of the twin's {states} "
            f"states with {regressors} weights each; write the bundle again from one run of the "
            "pipeline"
        )


def _check_example(folder: Path, deployed: Deployed) -> None:
    """Raise where the bundle cannot assess its own example."""
    try:
        said = deployed.assess(deployed.example)
    except (OdisarError, ValueError, ArithmeticError, RuntimeError) as error:
        raise OdisarError(
            f"{folder / EXAMPLE_FILE} is not assessed: {error}; write the bundle again"
        ) from error
    if said.empty:
        raise OdisarError(
            f"{folder / EXAMPLE_FILE} is shorter than a window; write the bundle again"
        )
