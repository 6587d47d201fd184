"""Neural detectors fitted for moments: enough to hold what they must hold whatever they learnt."""

import pytest

from odisar.baselines.interface import Detector, Reference
from odisar.baselines.neural.registry import neural_detectors

from .neural_cases import BUDGET, DEPLOYABLE, REFERENCES


@pytest.fixture(scope="session")
def references() -> dict[str, Reference]:
    return {name: make() for name, make in REFERENCES.items()}


@pytest.fixture(scope="session")
def fitted(references) -> dict[tuple[str, str], Detector]:
    """Return the deployable detectors by the reference's name and theirs."""
    detectors = {}
    for system, reference in references.items():
        makers = neural_detectors(BUDGET)
        for name in DEPLOYABLE:
            detectors[system, name] = makers[name]()
            detectors[system, name].fit(reference)
    return detectors


@pytest.fixture(params=DEPLOYABLE)
def name(request) -> str:
    return request.param


@pytest.fixture(params=tuple(REFERENCES))
def system(request) -> str:
    return request.param


@pytest.fixture
def reference(references, system) -> Reference:
    return references[system]


@pytest.fixture
def detector(fitted, system, name) -> Detector:
    return fitted[system, name]
