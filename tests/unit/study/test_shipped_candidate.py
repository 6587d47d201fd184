"""What the study calls the shipped score is the monitor's own, number by number."""

from dataclasses import replace

import numpy as np
import pytest

from odisar.capability.combined import ODISAR
from odisar.capability.consistency import Consistency
from odisar.capability.scoring import Scorer
from odisar.config.loader import load_config
from odisar.config.score import ReleaseConfig, ScoreConfig
from odisar.seeding import generator
from odisar.stages.detectors import fit_innovation_scores
from odisar.stages.members import MemberData
from odisar.study.candidates import candidates, shipped
from odisar.study.development import Offered, Seen
from odisar.study.fitted_statistics import fit_statistics
from small_bundle import small_case
from small_system import make_recording


@pytest.fixture(scope="module")
def score(request) -> ScoreConfig:
    """Return the ferry's settings."""
    return load_config(request.config.rootpath).cases["vessel"].score


@pytest.mark.parametrize("share", [0.0, 0.5, 1.0])
def test_the_shipped_candidate_scores_as_the_monitor_does(trained_twin, score, share, monkeypatch):
    case = small_case().model_copy(update={"score": score})
    splits = {
        "train": [make_recording("train-0"), make_recording("train-1")],
        "validation": [make_recording("held-out-0"), make_recording("held-out-1")],
    }
    data = MemberData(case, splits, trained_twin.scaler, trained_twin.spec)
    scorer = Scorer(trained_twin, 64, "cpu")
    # A relation that holds for half of the states, and one that does for all, as on both machines.
    monkeypatch.setattr(Consistency, "share_holding", lambda *_: share)
    monitor = Scorer(trained_twin, 64, "cpu", fit_innovation_scores(scorer, data))
    held_out = [(i, scorer.score(i, short_lead_steps=3)) for i in splits["validation"]]
    makers = fit_statistics(data, scorer, held_out)

    def seen(item, scores) -> Seen:
        made = {name: make(item, scores) for name, make in makers.items()}
        return Seen(made, np.zeros(len(scores.positions), dtype=bool), scores.runs)

    (one,) = (one for one in candidates(share) if one.name == shipped(score))
    offered = Offered.fit(one, [seen(*pair) for pair in held_out], 3.0)
    # Pushed, then a sensor that reads too high, then a noisy one.
    item = make_recording("fresh", push=0.05)
    values = item.values.copy()
    values[220:250, 1] += 0.3
    values[260:290, 2] += generator(4, "noise").normal(scale=0.3, size=30)
    item = replace(item, values=values, segments=((0, 210), (210, 300)))
    said = offered.said(seen(item, scorer.score(item, short_lead_steps=3)))
    wanted = monitor.score(item, short_lead_steps=3).scores[ODISAR]
    known = np.isfinite(wanted)
    assert known.sum() > 80
    np.testing.assert_array_equal(np.isfinite(said), known)
    np.testing.assert_allclose(said[known], np.log(wanted[known]), rtol=0, atol=1e-5)


def test_a_score_is_called_by_its_settings(score):
    assert shipped(score) == (
        "mean over 20, size over 5, reconstruction; recent 3 (0.3); closed form; "
        "consistency, recent 2 (0.4); scatter over 60 (0.45); noise 1, shift 1; "
        "release over 60 (1)"
    )
    bare = score.model_copy(
        update={
            "scatter": score.scatter.model_copy(update={"share": 0.0}),
            "consistency": score.consistency.model_copy(update={"recent_share": 0.6}),
            "release": ReleaseConfig(steps=10, share=0.0),
        }
    )
    assert shipped(bare) == (
        "mean over 20, size over 5, reconstruction; recent 3 (0.3); closed form; "
        "consistency, recent 2 (0.6); noise 1, shift 1"
    )


def test_what_cannot_be_a_candidate_is_called_by_no_name(score):
    assert shipped(score.model_copy(update={"shift": None})) is None
    for steps in ("mean_steps", "size_steps"):
        tied = score.consistency.model_copy(update={steps: 12})
        assert shipped(score.model_copy(update={"consistency": tied})) is None
