import dataclasses

import numpy as np
import pytest

from invented_scores import invented_scores
from odisar.capability.distribution import NoiseFloor
from odisar.capability.innovation_values import InnovationScoreValues
from odisar.capability.recalibration import Recalibration
from odisar.config.loader import ConfigView, load_config
from odisar.evaluation.alarms import calibrate_operating_threshold
from odisar.stages.calibrate import PARAMS, MemberCalibration, setup_thresholds
from odisar.stages.distributions import Distributions

SETUP = "vessel-all"
RULES = ("sigma", "log-sigma", "operating", "conformal")


def read_config(root, rule="sigma"):
    whole = load_config(root)
    capability = whole.capability.model_copy(update={"threshold_rule": rule})
    return ConfigView(whole.model_copy(update={"capability": capability}), PARAMS)


@pytest.fixture(scope="module")
def config(request):
    return read_config(request.config.rootpath)


def calibration(number: int, *, hours: float, sigma: float = 1.0) -> MemberCalibration:
    """Return a fold calibrated on block ``number`` and tested on the block before it.

    Its scores are ``sigma`` times what they would be on the common scale.
    """
    scores = sigma * np.abs(np.random.default_rng(number).normal(size=2000))
    return MemberCalibration(
        innovation=InnovationScoreValues.of(invented_scores()),
        runs={name: [(f"block-{number}", scores)] for name in ("odisar", "reconstruction")},
        sigma={"odisar": sigma, "reconstruction": 2 * sigma},
        log_sigma={"odisar": 1.1 * sigma, "reconstruction": 2.2 * sigma},
        variance=0.1,
        distributions=Distributions(
            NoiseFloor(np.ones((1, 5)), 10), Recalibration(((),), horizon_steps=1, windows=10)
        ),
        state_low=[float(i) for i in range(5)],
        state_high=[float(i) + 10 for i in range(5)],
        hours=hours,
        test_clusters=frozenset({f"block-{number - 1}"}),
    )


def operating_threshold(config, *pool: MemberCalibration) -> float:
    """Return what pooled scores, each in units of its fold's own threshold, should give."""
    case, point = config.case_of(SETUP), config.evaluation.operating_point
    runs = [
        (scores / one.sigma["odisar"], 1 / case.rate_hz)
        for one in pool
        for _, scores in one.runs["odisar"]
    ]
    rate = point.promised_per_hour * point.set_to_share_of_promise
    return calibrate_operating_threshold(runs, rate, case.persistence_s)


def test_a_single_member_keeps_to_its_own_recordings(config):
    only = calibration(1, hours=0.5, sigma=3.0)
    content = setup_thresholds(config, SETUP, {SETUP: only})[SETUP]
    assert content["operating_pooled"] == 0
    assert content["operating_hours"] == content["calibration_hours"] == 0.5
    wanted = 3.0 * operating_threshold(config, only)
    assert content["operating"]["odisar"] == pytest.approx(wanted)
    assert content["thresholds"] == {"score": 3.0, "reconstruction": 6.0, "variance": 0.1}
    assert content["log_sigma"] == only.log_sigma
    assert InnovationScoreValues.model_validate(content["innovation"]) == only.innovation
    assert content["state_high"]["Roll Rate"] == 14.0


def test_a_pool_leaves_out_the_fold_calibrated_on_what_this_one_tests(config):
    folds = {f"fold-{i}": calibration(i, hours=0.5, sigma=float(i)) for i in (1, 2, 3, 4)}
    content = setup_thresholds(config, SETUP, folds)
    assert content["fold-3"]["operating_pooled"] == 1
    assert content["fold-3"]["operating_hours"] == 1.5
    kept = [folds[name] for name in ("fold-1", "fold-3", "fold-4")]  # fold-2 is block-2
    wanted = 3.0 * operating_threshold(config, *kept)
    assert content["fold-3"]["operating"]["odisar"] == pytest.approx(wanted)
    leaky = 3.0 * operating_threshold(config, *folds.values())
    assert content["fold-3"]["operating"]["odisar"] != pytest.approx(leaky)
    assert content["fold-1"]["operating_hours"] == 2.0  # nobody calibrates on block-0


def test_folds_are_pooled_in_units_of_their_own_thresholds(config):
    folds = {f"fold-{i}": calibration(i, hours=0.5) for i in (1, 2, 3)}
    louder = {
        name: dataclasses.replace(
            fold,
            runs={
                name: [(block, 50 * scores) for block, scores in runs]
                for name, runs in fold.runs.items()
            },
            sigma={"odisar": 50.0, "reconstruction": 100.0},
        )
        if name == "fold-2"
        else fold
        for name, fold in folds.items()
    }
    even, uneven = setup_thresholds(config, SETUP, folds), setup_thresholds(config, SETUP, louder)
    for name, factor in (("fold-1", 1), ("fold-2", 50), ("fold-3", 1)):
        wanted = factor * even[name]["operating"]["odisar"]
        assert uneven[name]["operating"]["odisar"] == pytest.approx(wanted)


def test_members_with_hours_enough_are_not_pooled(config):
    enough = config.evaluation.operating_point.pool_below_hours
    folds = {f"fold-{i}": calibration(i, hours=enough) for i in (1, 2)}
    content = setup_thresholds(config, SETUP, folds)
    assert {one["operating_pooled"] for one in content.values()} == {0}
    alone = operating_threshold(config, folds["fold-1"])
    assert content["fold-1"]["operating"]["odisar"] == pytest.approx(alone)


@pytest.mark.parametrize("rule", RULES)
def test_the_rule_that_is_asked_for_sets_the_threshold_of_the_score_alone(request, rule):
    config = read_config(request.config.rootpath, rule)
    only = calibration(1, hours=30.0, sigma=3.0)
    content = setup_thresholds(config, SETUP, {SETUP: only})[SETUP]
    by_rule = {name: content[name.replace("-", "_")]["odisar"] for name in RULES}
    assert content["thresholds"]["score"] == by_rule[rule]
    # Of a single recording, both promises of an alarm rate can only take its highest score.
    assert len(set(by_rule.values())) == len(RULES) - 1
    assert content["thresholds"]["reconstruction"] == 6.0


def test_the_conformal_threshold_comes_with_its_promise(config):
    only = calibration(1, hours=30.0, sigma=3.0)
    content = setup_thresholds(config, SETUP, {SETUP: only})[SETUP]
    assert "of fresh blocks" in content["promise"]
    assert set(content["promised_per_hour"]) == {"odisar", "reconstruction"}
