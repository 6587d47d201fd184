"""What is measured on development recordings is protocol P2, on the judged ones, in intervals."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from odisar.config.judging import EvaluationConfig, Judging
from odisar.deployment import development
from odisar.deployment.development import judged_recordings, measure
from odisar.errors import OdisarError
from odisar.evaluation.metrics import auroc
from odisar.evaluation.protocols import take_samples
from odisar.evaluation.scored import ScoredRecording
from odisar.stages.bundle import measure_again
from small_bundle import pushed, small_case, small_settings
from small_innovations import small_scorer
from small_system import make_recording

JUDGING = EvaluationConfig.model_validate(
    {
        "consequence_s": 6.0,
        "bootstrap_draws": 100,
        "bootstrap_bins": 200,
        "confidence": 0.95,
        "operating_point": {
            "promised_per_hour": 1.0,
            "set_to_share_of_promise": 0.5,
            "pool_below_hours": 6.0,
        },
    }
)


@pytest.fixture(scope="module")
def recordings():
    return [pushed(f"dev-{i}", 200) for i in range(4)]


@pytest.fixture(scope="module")
def scorer(trained_twin):
    return small_scorer(trained_twin)


def measured(scorer, recordings, stride_steps=1, case=None):
    case = small_case() if case is None else case
    return measure(scorer, case, recordings, JUDGING, stride_steps=stride_steps, seed=3)


def test_without_a_stride_it_is_the_auroc_of_protocol_p2(scorer, recordings, trained_twin):
    scores, labels = [], []
    for item in recordings:
        said = scorer.score(item, short_lead_steps=3)
        settings = small_settings(trained_twin)
        scored = ScoredRecording(
            name=item.name,
            info=item.info,
            intervals=item.intervals,
            time_s=item.time_s[said.positions],
            scores={name: values.astype(np.float64) for name, values in said.scores.items()},
            thresholds=settings.sigma,
            operating_thresholds=settings.operating,
            first_consequence_s=None,
            horizon_steps=10,
            context_steps=20,
            step_s=1.0,
        )
        samples = take_samples(scored, "P2", Judging.of(JUDGING, small_case()))
        scores.append(samples.scores["odisar"])
        labels.append(samples.labels)
    score = measured(scorer, recordings)
    assert score.auroc == pytest.approx(auroc(np.concatenate(scores), np.concatenate(labels)))
    assert score.windows == sum(map(len, labels))
    assert score.recordings == 4
    assert score.ci_low <= score.auroc <= score.ci_high


def test_a_stride_takes_fewer_windows_and_says_so_in_the_hash(scorer, recordings):
    all_of_them, some = measured(scorer, recordings), measured(scorer, recordings, 5)
    assert some.windows == pytest.approx(all_of_them.windows / 5, abs=4)
    assert some.auroc == pytest.approx(all_of_them.auroc, abs=0.1)
    assert some.measured_on != all_of_them.measured_on


def test_the_hash_is_that_of_the_recordings_in_any_order(scorer, recordings):
    score = measured(scorer, recordings)
    assert measured(scorer, recordings[::-1]) == score
    changed = recordings[0].values.copy()
    changed[5, 1] += 1e-9
    other = [replace(recordings[0], values=changed), *recordings[1:]]
    assert measured(scorer, other).measured_on != score.measured_on


@pytest.mark.parametrize("changes", [{"context_steps": 25}, {"horizon_steps": 15}])
def test_scores_at_other_positions_are_not_compared(scorer, recordings, changes, monkeypatch):
    before = measured(scorer, recordings).measured_on
    assert measured(scorer, recordings).measured_on == before
    monkeypatch.setattr(
        development, "_score", lambda *_: (np.array([0.1, 0.2]), np.array([0, 1]) > 0)
    )
    assert measured(scorer, recordings).measured_on == before
    spec = replace(scorer.twin.spec, **changes)
    twin = SimpleNamespace(spec=spec)
    other = SimpleNamespace(twin=twin, innovation_scores=scorer.innovation_scores)
    assert measured(other, recordings).measured_on != before


@pytest.mark.parametrize("splits", [[], [make_recording("clean")]])
def test_without_a_disturbed_recording_nothing_is_measured(scorer, splits):
    score = measured(scorer, splits)
    assert (score.auroc, score.ci_low, score.ci_high) == (None, None, None)
    assert score.recordings == 0


def test_one_recording_has_no_interval(scorer, recordings):
    score = measured(scorer, recordings[:1])
    assert score.auroc is not None
    assert score.ci_low is None


def test_only_recordings_of_the_overall_group_are_judged(recordings):
    groups = {**small_case().groups.model_dump(), "overall": {"disturbance": ["storm"]}}
    assert judged_recordings(recordings, small_case(groups=groups)) == []
    assert len(judged_recordings(recordings, small_case())) == 4


def dumped():
    return [channel.model_dump() for channel in small_case().channels]


def in_degrees(channels):
    channels[2]["unit"] = "deg/s"
    return {"channels": channels}


def with_pose(coordinates, channels):
    for channel in channels:
        channel.update(role="state", unit="rad")
    pose = {"x": "Speed", "y": "Turn Rate", "heading": ["Command"], "coordinates": coordinates}
    return {"channels": channels, "pose": pose}


@pytest.mark.parametrize(
    ("then", "now", "complaint"),
    [
        ({"rate_hz": 2.0}, {}, "its rate_hz is 2.0, today's 1.0"),
        (in_degrees(dumped()), {}, "its units are m/s, m/s, deg/s, today's m/s, m/s, m/s"),
        (
            with_pose("relative", dumped()),
            with_pose("absolute", dumped()),
            "its pose is Speed, Turn Rate, Command (relative), today's Speed",
        ),
    ],
)
def test_a_champion_of_another_rate_unit_or_pose_is_not_measured(then, now, complaint):
    config = SimpleNamespace(case_of=lambda _: small_case(**now))
    with pytest.raises(OdisarError) as caught:
        measure_again(config, None, "small", SimpleNamespace(case=small_case(**then)))
    assert complaint in str(caught.value)
