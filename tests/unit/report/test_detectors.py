from itertools import combinations

import pytest

from odisar.baselines.neural.registry import NOT_DEPLOYABLE as LEAKY
from odisar.baselines.neural.registry import neural_detectors
from odisar.baselines.registry import cheap_detectors, optional_detectors
from odisar.capability.scoring import DETECTORS
from odisar.config.loader import load_config
from odisar.fitting import FitBudget
from odisar.report.detectors import (
    CHEAP,
    DETECTOR_NAMES,
    MONITOR,
    NEURAL,
    NOT_DEPLOYABLE,
    ORACLE,
    TWIN_SCORES,
    WITHOUT_TRANSFORMER,
    alternatives,
    detector_look,
)
from odisar.study.alternatives import DROPOUT_VARIANCE

from .invented import ROOT

BUDGET = FitBudget(**load_config(ROOT).study.detectors.model_dump())


def test_every_detector_of_the_project_has_a_name_and_a_place():
    cases = load_config(ROOT).cases.values()
    cheap = {name for case in cases for name in cheap_detectors(case)} | set(optional_detectors())
    assert cheap == set(CHEAP)
    assert {*neural_detectors(BUDGET), DROPOUT_VARIANCE} == set(NEURAL)
    assert set(DETECTORS) == set(TWIN_SCORES)
    assert {*CHEAP, *NEURAL, *TWIN_SCORES, ORACLE} == set(DETECTOR_NAMES)
    assert len(set(DETECTOR_NAMES.values())) == len(DETECTOR_NAMES)


def test_what_cannot_be_deployed_says_so():
    assert set(NOT_DEPLOYABLE) == set(LEAKY)
    for name, told in DETECTOR_NAMES.items():
        assert ("not deployable" in told) == (name in LEAKY)


@pytest.mark.parametrize(
    "drawn",
    [
        (*TWIN_SCORES, ORACLE),
        (MONITOR, *CHEAP, "rpm-rule"),
        (MONITOR, *NEURAL),
        # The best cheap one stands beside the twin's scores.
        *((WITHOUT_TRANSFORMER, cheap) for cheap in CHEAP),
    ],
)
def test_detectors_of_one_figure_differ_in_colour_and_in_marker(drawn):
    looks = [detector_look(name, drawn) for name in drawn]
    for one, other in combinations(looks, 2):
        assert one.colour != other.colour
        assert one.marker != other.marker


def test_a_detector_looks_the_same_in_every_figure():
    assert detector_look("rmse", ["rmse"]) == detector_look("rmse", ["odisar", "mine", "rmse"])


def test_alternatives_are_the_cheap_ones_and_a_cases_own_rules():
    given = ["odisar", "rmse", "stuck", "rpm-rule", "mahalanobis", "codit", "oracle"]
    assert alternatives(given) == ["mahalanobis", "stuck", "rpm-rule"]
