from dataclasses import replace

import numpy as np
import pytest

from odisar.baselines.interface import at_samples
from odisar.capability.combined import CLOSED_FORM, ODISAR
from odisar.capability.scoring import RECONSTRUCTION, RMSE
from odisar.errors import OdisarError
from odisar.evaluation.leakage import ProbePlan, probe_leakage
from odisar.evaluation.leakage_probes import PROBES, cut_after, score_changes
from odisar.windows.coordinates import PoseChannels, features
from small_innovations import small_scorer

from .leaky_scores import (
    RECORDINGS,
    STD,
    attends_across,
    flinches,
    follows_the_plan,
    honest,
    is_constant,
    knows_the_length,
    level,
    numbers_them,
    of_each,
    peeks,
    probe,
    reads_labels,
    reads_the_disturbance,
    sees_commands_only,
    standardises,
    vanishes,
)


def with_gap(recording, start=60, stop=70):
    keep = np.r_[0:start, stop : len(recording.time_s)]
    segments = ((0, start), (start, len(keep)))
    return replace(
        recording,
        time_s=recording.time_s[keep],
        values=recording.values[keep],
        segments=segments,
    )


def test_an_honest_score_passes_every_probe_to_the_bit():
    report = probe(honest)
    assert report.passed
    assert [finding.probe for finding in report.findings] == list(PROBES)
    assert all(f.largest.largest_change == 0 for f in report.findings if f.probe != "control")


@pytest.mark.parametrize(
    ("score", "failed"),
    [
        (of_each(peeks), {"future", "truncation"}),
        (of_each(flinches), {"future"}),
        (of_each(vanishes), {"future"}),
        (of_each(follows_the_plan), {"future"}),
        (of_each(standardises), {"future", "truncation"}),
        (of_each(knows_the_length), {"truncation"}),
        (attends_across, {"batch"}),
        (numbers_them, {"batch"}),
        (of_each(reads_labels), {"labels"}),
        (of_each(reads_the_disturbance), {"labels"}),
        (of_each(is_constant), {"control"}),
        (of_each(sees_commands_only), {"control"}),
    ],
)
def test_a_leak_is_caught_by_the_probes_that_reach_it_and_no_other(score, failed):
    assert set(probe(score).failed_probes) == failed


@pytest.mark.parametrize("seed", range(5))
def test_a_leak_is_caught_whatever_the_seed(seed):
    assert probe(of_each(peeks), seed=seed, positions_per_recording=1).failed_probes == (
        "future",
        "truncation",
    )


@pytest.mark.parametrize("score", [attends_across, numbers_them])
def test_one_recording_alone_is_given_company_to_find_a_leak_across_the_batch(score):
    assert probe(score, RECORDINGS[:1]).failed_probes == ("batch",)


@pytest.mark.parametrize("recording", RECORDINGS[:2], ids=["undisturbed", "disturbed"])
def test_labels_are_taken_away_and_invented(recording):
    finding = probe(of_each(reads_labels), [recording]).finding("labels")
    assert (finding.tried, finding.moved) == (2, 1)


def test_a_score_that_differs_from_call_to_call_is_told_from_a_leak():
    random = np.random.default_rng(0)
    report = probe(lambda rs: [level(r) + random.random() for r in rs])
    assert "repeat" in report.failed_probes


def test_a_scorer_that_overwrites_its_recordings_is_told_and_does_no_harm():
    def overwrites(recordings):
        for recording in recordings:
            recording.values[:] *= 2
        return honest(recordings)

    before = [recording.values.copy() for recording in RECORDINGS]
    assert probe(overwrites).failed_probes == ("repeat",)
    for recording, values in zip(RECORDINGS, before, strict=True):
        np.testing.assert_array_equal(recording.values, values)


def test_a_scorer_that_fills_one_array_again_and_again_hides_nothing():
    room = np.empty(120)

    def fills(recordings):
        for recording in recordings:
            room[: len(recording.time_s)] = peeks(recording)
        return [room[: len(recording.time_s)] for recording in recordings]

    report = probe(fills, RECORDINGS[:1])
    assert {"future", "truncation"} <= set(report.failed_probes)


def test_the_largest_change_says_what_moved_by_how_much_and_where():
    report = probe(of_each(follows_the_plan))
    finding = report.finding("future")
    assert finding.largest.change == "channel 0 (a command) pushed after"
    assert finding.largest.at_sample == finding.largest.sample
    assert finding.largest.largest_change == pytest.approx(1)
    pooled = np.concatenate([follows_the_plan(recording) for recording in RECORDINGS])
    low, high = np.quantile(pooled, [0.25, 0.75])
    assert finding.share_of_iqr == pytest.approx(1 / (high - low))
    assert finding.moved == 9
    assert finding.tried == 36


def test_a_score_that_comes_or_goes_is_a_change_without_bound():
    finding = probe(of_each(vanishes)).finding("future")
    assert finding.largest.largest_change == np.inf
    assert finding.share_of_iqr == np.inf


def test_a_nan_that_stays_is_no_change_and_one_that_moves_is():
    nan, inf = np.nan, np.inf
    before = np.array([nan, nan, 1.0, inf, inf, 2.0])
    after = np.array([nan, 1.0, nan, inf, -inf, 2.5])
    np.testing.assert_array_equal(score_changes(before, after), [0, inf, inf, 0, inf, 0.5])


def test_a_delayed_score_passes_the_control_only_within_the_stated_delay():
    def delayed(recording):
        return np.concatenate([np.full(4, np.nan), level(recording)[:-4]])

    too_short = probe(of_each(delayed), control_delay_steps=3)
    assert too_short.failed_probes == ("control",)
    assert "moved first 4 samples later" in too_short.sentences()[-1]
    long_enough = probe(of_each(delayed), control_delay_steps=4)
    assert long_enough.passed
    assert long_enough.sentences()[-1] == (
        "mine, control: changing the states at a sample by one sigma moved the score within 4 "
        "samples in 9 of 9 tries, after 4 at the latest."
    )


def test_the_control_fails_where_only_some_samples_move_the_score():
    def half_blind(recording):
        return np.where(recording.time_s < 60, level(recording), 1.0)

    control = probe(of_each(half_blind)).finding("control")
    assert not control.passed
    assert 0 < control.moved < control.tried


def test_a_tolerated_share_lets_pass_what_only_rounds_differently():
    def rounds(recording):
        return level(recording) * (1 + 1e-9 * len(recording.time_s))

    assert probe(of_each(rounds)).failed_probes == ("truncation",)
    tolerant = probe(of_each(rounds), tolerated_share=1e-4)
    assert tolerant.passed
    assert tolerant.finding("truncation").largest.largest_change > 0
    assert "by more than 0.0001 of its interquartile range" in tolerant.sentences()[2]


def test_the_seed_settles_what_is_probed():
    assert probe(honest, seed=1) == probe(honest, seed=1)
    first, second = (probe(honest, seed=seed).finding("truncation") for seed in (1, 2))
    assert [c.sample for c in first.comparisons] != [c.sample for c in second.comparisons]


def test_only_samples_with_a_score_are_probed():
    def sparse(recording):
        scores = np.full(len(recording.time_s), np.nan)
        scores[30::7] = level(recording)[30::7]
        return scores

    report = probe(of_each(sparse), positions_per_recording=5)
    samples = [c.sample for c in report.finding("control").comparisons]
    assert len(samples) == 15
    assert all(sample % 7 == 2 and sample >= 30 for sample in samples)
    assert report.passed


def test_a_cut_recording_ends_at_its_sample_in_every_part():
    cut = cut_after(with_gap(RECORDINGS[0]), 80)
    assert len(cut.time_s) == len(cut.values) == 81
    assert cut.segments == ((0, 60), (60, 81))
    assert cut_after(with_gap(RECORDINGS[0]), 59).segments == ((0, 60),)


@pytest.mark.parametrize("heading", [(2,), (2, 3)], ids=["angle", "quaternion"])
def test_recordings_with_gaps_and_a_relative_pose_are_probed(heading):
    turn = np.cumsum(RECORDINGS[0].values[:, 2]) / 10
    path = np.column_stack([np.cumsum(np.cos(turn)), np.cumsum(np.sin(turn))])
    angles = [np.sin(turn / 2), np.cos(turn / 2)] if len(heading) == 2 else [turn]
    recording = with_gap(replace(RECORDINGS[0], values=np.column_stack([path, *angles])))
    pose = PoseChannels(x=0, y=1, heading=heading, in_degrees=False)

    def speed(given):
        assert all(stop <= len(given.time_s) for _, stop in given.segments)
        return np.linalg.norm(features(given, pose)[:, :3], axis=1)

    report = probe_leakage("speed", of_each(speed), [recording], std=None, seed=4)
    assert report.passed


@pytest.mark.parametrize("name", ["trained_twin", "relative_twin"])
@pytest.mark.parametrize("detector", [ODISAR, CLOSED_FORM, RECONSTRUCTION, RMSE])
def test_a_twins_scores_pass_but_for_rounding(request, name, detector):
    scorer = small_scorer(request.getfixturevalue(name), 32)

    def score(recordings):
        scored = [scorer.score(recording, short_lead_steps=5) for recording in recordings]
        return [
            at_samples(scores.scores[detector], scores.positions, len(recording.time_s))
            for recording, scores in zip(recordings, scored, strict=True)
        ]

    report = probe(
        score, [with_gap(RECORDINGS[1])], positions_per_recording=2, tolerated_share=1e-4
    )
    assert report.passed, report.sentences()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"recordings": []}, "at least one"),
        ({"recordings": RECORDINGS[:1] * 2}, "calm come twice"),
        ({"std": np.ones(2)}, "each of the 3 channels"),
        ({"std": np.array([1.0, 0.0, 1.0])}, "above zero"),
        ({"states": (3,)}, "positions? of the 3 channels"),
        ({"states": ()}, "at least one position"),
        ({"positions_per_recording": 0}, "positions_per_recording=0"),
        ({"control_delay_steps": -1}, "control_delay_steps=-1"),
        ({"tolerated_share": -0.1}, "tolerated_share=-0.1"),
        ({"score": of_each(lambda r: np.full(len(r.time_s), np.nan))}, "give longer recordings"),
        ({"score": of_each(lambda r: level(r)[1:])}, r"'mine', recording 'calm': .*\(119,\)"),
    ],
)
def test_what_can_not_be_probed_is_named_with_the_way_out(change, message):
    asked = {"score": honest, "recordings": RECORDINGS, "std": STD, "seed": 1, **change}
    with pytest.raises(OdisarError, match=message):
        probe_leakage("mine", asked.pop("score"), asked.pop("recordings"), **asked)


def test_recordings_of_two_cases_are_not_probed_together():
    wider = replace(RECORDINGS[1], values=np.ones((150, 4)))
    with pytest.raises(OdisarError, match=r"\[3, 4\] channels"):
        probe(honest, [RECORDINGS[0], wider])


def test_a_plan_holds_one_choice_of_states_for_all_channels_by_default():
    assert ProbePlan().states is None
    report = probe(of_each(sees_commands_only), states=None)
    assert report.passed
    changes = {comparison.change for comparison in report.finding("future").comparisons}
    assert not any("command" in change for change in changes)
