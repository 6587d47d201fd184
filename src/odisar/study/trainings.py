"""Other trainings of a set-up's twin: another seed, another dropout rate; calibrated as ever."""

import shutil
from dataclasses import dataclass, replace

from odisar.artifacts import Workspace, read_json
from odisar.capability.scoring import Scorer
from odisar.config.loader import ConfigView
from odisar.seeding import derive_seed
from odisar.stages.detectors import fit_innovation_scores
from odisar.stages.members import Member, MemberData
from odisar.stages.tune import training_plan
from odisar.study.places import study_folder
from odisar.twin.bundle import TrainedTwin, read_twin, write_twin
from odisar.twin.devices import pick_device
from odisar.twin.mc_dropout import draw_masks
from odisar.twin.plan import TrainingPlan
from odisar.twin.training import train_twin
from odisar.twin.tuning import tuned_plan


@dataclass(frozen=True)
class Variant:
    """A training that differs from the default run's: by its seed's name, by its dropout rate.

    ``draws`` is how many dropout masks are stored with the twin, ``epochs_share`` the share of the
    default run's epochs that it gets.
    """

    name: str
    seed: int | None
    dropout: float | None
    draws: int
    epochs_share: float = 1.0


def variant_plan(
    config: ConfigView, workspace: Workspace, setup: str, variant: Variant
) -> TrainingPlan:
    """Return the tuned plan of a set-up with the variant's changes."""
    tuned = read_json(workspace.tuned(setup))["members"][setup]["tuned"]
    plan = tuned_plan(training_plan(config, Member(setup, None)), tuned)
    if variant.seed is not None:
        plan = replace(plan, seed=derive_seed(plan.seed, "study", variant.seed))
    if variant.dropout is not None:
        changed = plan.twin.model_copy(update={"dropout": variant.dropout})
        plan = replace(plan, twin=changed)
    epochs = max(1, round(variant.epochs_share * plan.training.epochs))
    return replace(plan, training=plan.training.model_copy(update={"epochs": epochs}))


def variant_twin(
    config: ConfigView, workspace: Workspace, setup: str, data: MemberData, variant: Variant
) -> TrainedTwin:
    """Train a variant, or read it where an earlier, killed run has finished it."""
    folder = study_folder(workspace) / "twins" / f"{setup}-{variant.name}"
    if (folder / "twin.json").exists():
        return read_twin(folder)
    plan = variant_plan(config, workspace, setup, variant)
    stride = config.training.validation_stride_steps
    validation = data.windows("validation", stride_steps=stride)
    scratch = workspace.scratch / f"study-{setup}-{variant.name}"
    name = f"{setup} {variant.name}"
    trained = train_twin(plan, data.windows("train"), validation, scratch, name=name)
    masks = draw_masks(
        trained.network,
        variant.draws,
        config.monte_carlo.dropout_scope,
        derive_seed(config.seed, "masks", setup, variant.name),
    )
    names = tuple(data.case.channel_names)
    twin = TrainedTwin(trained.network, plan.twin, data.spec, data.scaler, masks, names)
    write_twin(folder, twin)
    shutil.rmtree(scratch, ignore_errors=True)
    return twin


def fitted_scorer(config: ConfigView, data: MemberData, twin: TrainedTwin) -> Scorer:
    """Return a scorer with innovation scores fitted on the validation recordings."""
    batch, device = config.capability.scoring_batch, pick_device(config.pipeline.accelerator)
    fitted = fit_innovation_scores(Scorer(twin, batch, device), data)
    return Scorer(twin, batch, device, fitted)
