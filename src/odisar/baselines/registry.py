"""Which of these detectors there are for a case, in the order in which tables list them."""

from collections.abc import Mapping

from odisar.baselines.interface import Detector, Reference
from odisar.baselines.mahalanobis import Mahalanobis
from odisar.baselines.outlyingness import Ecod, IsolationForest
from odisar.baselines.pca import PcaSpe, PcaT2
from odisar.baselines.physics_checks import PoseVelocity, RateOfChange, Stuck
from odisar.baselines.velocities import NoVelocityError, has_velocity_candidates
from odisar.config.cases import Case


def cheap_detectors(case: Case) -> dict[str, Detector]:
    """Return, by name, unfitted detectors that take seconds and need nothing else installed.

    ``pose-velocity`` stands for cases with a relative pose and states besides; whether one of them
    is a velocity shows when it is fitted (see ``fit_existing``). Others have ``rate-of-change``.
    """
    detectors: dict[str, Detector] = {
        "mahalanobis": Mahalanobis(),
        "pca-t2": PcaT2(),
        "pca-spe": PcaSpe(),
    }
    if has_velocity_candidates(case):
        detectors["pose-velocity"] = PoseVelocity()
    else:
        detectors["rate-of-change"] = RateOfChange()
    return detectors | {"stuck": Stuck()}


def optional_detectors() -> dict[str, Detector]:
    """Return, by name, unfitted detectors of the full study; the first one needs PyOD."""
    return {"isolation-forest": IsolationForest(), "ecod": Ecod()}


def fit_existing(detectors: Mapping[str, Detector], reference: Reference) -> dict[str, Detector]:
    """Fit detectors and return those that exist for the reference, in their order.

    Left out is a comparison with velocities where no channel turns out to be one.
    """
    fitted = {}
    for name, detector in detectors.items():
        try:
            detector.fit(reference)
        except NoVelocityError:
            continue
        fitted[name] = detector
    return fitted
