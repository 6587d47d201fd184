"""The monitor's score fitted on random numbers: no twin has a part in it."""

from functools import partial

import numpy as np

from odisar.capability.combined import (
    ODISAR,
    WITHOUT_TRANSFORMER,
    InnovationScores,
    Run,
    ScoreSteps,
)
from odisar.capability.consistency import Consistency
from odisar.capability.innovations import InnovationSteps, conditional_squares, squared_distance
from odisar.capability.outliers import NoiseSteps
from odisar.capability.release import Release
from odisar.capability.shifts import ShiftSteps
from odisar.seeding import generator

STATES = (0, 1)
#: Detectors that listen to single sensors.
HEARING = (ODISAR, WITHOUT_TRANSFORMER)
STEPS = ScoreSteps(
    innovation=InnovationSteps(mean=6, size=4, recent=2, recent_share=0.25),
    consistency=InnovationSteps(mean=8, size=4, recent=2, recent_share=0.25),
    scatter=7,
    scatter_share=0.15,
    noise=NoiseSteps(lasting=5, recent=2, recent_share=0.4, margin=0.3),
    shift=ShiftSteps(memory=9, margin=0.25),
    release=Release(steps=8, share=0.5),
)


def invented_run(stream: str, samples: int = 200) -> Run:
    """Return a run of two states and a command, which says one of them."""
    random = generator(5, stream)
    innovations, closed_form, wrong = random.normal(size=(3, samples, len(STATES)))
    # One that stands out, so that the limit counts.
    innovations[50:51] *= 20
    innovations[0] = closed_form[0] = wrong[:2] = np.nan
    seen = random.normal(size=(samples, len(STATES) + 1)).astype(np.float32)
    seen[:, 1] += 4 * seen[:, 2]
    errors = np.exp(random.normal(size=samples))
    wrongly = partial(conditional_squares, wrong)
    return Run(innovations, closed_form, seen, errors, wrongly, invented_ratios)


def invented_ratios(innovations: np.ndarray, precision: np.ndarray, memory: int) -> np.ndarray:
    """Return ratios of shifts that depend on all that they may: none but these."""
    return squared_distance(innovations, precision) / memory


def invented_scores(steps: ScoreSteps = STEPS) -> InnovationScores:
    """Return scores fitted on two runs; one relation of two holds."""
    runs = [invented_run("values"), invented_run("more", 150)]
    relations = Consistency.fit(np.concatenate([run.samples for run in runs]), STATES)
    return InnovationScores.fit(runs, relations, steps)


def noise_of(scores: InnovationScores, run: Run) -> np.ndarray:
    """Return what the noise of one sensor says along a run."""
    return scores.noise.score(run.outliers(scores.parts.closed_form.size.precision))


def shift_of(scores: InnovationScores, run: Run, name: str) -> np.ndarray:
    """Return what its shift says to a detector, put together from its parts."""
    parts, memory = scores.parts, scores.shift.steps.memory
    closed = run.shifts(run.closed_form, parts.closed_form.size.precision, memory)
    twin = run.shifts(run.innovations, parts.twin.size.precision, memory)
    tied = parts.consistency.parts(parts.relations.residuals(run.samples)).max(axis=0)
    return scores.shift.score(twin if name == ODISAR else None, closed, tied)
