"""A budget of moments, and the references that neural detectors are fitted on in tests."""

from dataclasses import replace

from odisar.baselines.interface import Reference
from odisar.baselines.neural.registry import NOT_DEPLOYABLE, neural_detectors
from odisar.fitting import FitBudget
from odisar.recordings.schema import Recording
from odisar.windows.scaling import Scaler
from small_reference import drive_reference, system_reference

BUDGET = FitBudget(steps=40, batch_size=32, learning_rate=3.0e-3, gradient_clip=1.0, validations=4)
REFERENCES = {"system": system_reference, "drive": drive_reference}
DEPLOYABLE = tuple(name for name in neural_detectors(BUDGET) if name not in NOT_DEPLOYABLE)


def with_equal_lengths(reference: Reference) -> Reference:
    """Return the reference with a horizon as long as its context, as published."""
    spec = replace(reference.spec, horizon_steps=reference.spec.context_steps)
    return replace(reference, spec=spec, scaler=Scaler.fit(reference.train, spec))


def cut(
    recording: Recording, samples: int, segments: tuple[tuple[int, int], ...] = ()
) -> Recording:
    """Return the first samples of a recording."""
    return Recording(
        recording.name,
        recording.info,
        recording.time_s[:samples],
        recording.values[:samples],
        segments=segments,
    )
