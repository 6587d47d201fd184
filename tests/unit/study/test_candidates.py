"""The rule that chose the score: means of means, and candidates that are what their names say."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from odisar.capability.scoring import Scorer
from odisar.config.loader import load_config
from odisar.stages.detectors import score_steps
from odisar.stages.members import MemberData
from odisar.study.candidates import MARGINS, NOISE, RELEASES, SHIFT, candidates
from odisar.study.development import fit_statistics, ranked
from small_bundle import small_case
from small_system import make_recording

MEAN, SIZE, REBUILT = "T2 of mean over 10", "log NIS over 5", "reconstruction"
RECENT = "T2 of mean over 3"
WHOLE = (
    "largest of limited mean over 20, size of one state over 3, reconstruction; "
    "recent mean over 5 (.7, .3); mean with closed form and consistency (size over 10)"
)
QUIETEST = "; or noise of one sensor, 0, or its shift, 0.25"
WITH_SCATTER = [11.605 / 3 + 0.3375, 8.36 / 3 + 0.44 + 0.225, 9.13 / 3 + 1.1]


def judged(*rows):
    """Return a table of (candidate, set-up, AUROC, TNR@TPR95), all to choose from but `free`."""
    table = pd.DataFrame(rows, columns=["candidate", "setup", "auroc", "tnr_at_tpr95"])
    return table.assign(can_be_chosen=table.candidate != "free")


def test_the_mean_is_over_the_cells_of_a_set_up_and_ranks_are_its_own():
    table = ranked(
        judged(
            ("wide", "x", 0.8, 0.6),
            ("wide", "x", 1.0, 0.8),
            ("wide", "y", 0.5, 0.3),
            ("even", "x", 0.6, 0.4),
            ("even", "x", 0.6, 0.4),
            ("even", "y", 0.9, 0.7),
        )
    )
    means = table.groupby(["setup", "candidate"]).rule_mean.first()
    assert means["x"].to_dict() == pytest.approx({"wide": 0.8, "even": 0.5})
    assert means["y"].to_dict() == pytest.approx({"wide": 0.4, "even": 0.8})
    assert table["rank"].tolist() == [1, 1, 2, 2, 2, 1]
    assert table.candidate.tolist() == ["wide"] * 3 + ["even"] * 3


def test_what_does_not_use_the_twin_is_compared_and_not_ranked():
    table = ranked(judged(("free", "x", 1.0, 1.0), ("low", "x", 0.5, 0.5), ("high", "x", 0.6, 0.6)))
    assert table.set_index("candidate")["rank"].dropna().to_dict() == {"high": 1, "low": 2}
    assert table.set_index("candidate").rule_mean["free"] == 1.0
    free = [one for one in candidates() if not one.uses_twin]
    assert {one.parts for one in free} == {1, 6, 7}
    for one in free:
        assert one.name.startswith(("no twin", "closed form's", "parity residuals'"))


def test_only_what_uses_the_twin_and_has_noise_and_shift_beside_can_be_chosen():
    for one in candidates():
        beside = "; or noise of one sensor, " in one.name
        assert one.can_be_chosen == beside == (one.margins is not None)
        assert one.uses_twin or not beside
        if beside:
            said = one.name.partition("; or noise of one sensor, ")[2].partition(";")[0]
            assert tuple(float(part) for part in said.split(", or its shift, ")) == one.margins
    margins = [one.margins for one in candidates() if one.can_be_chosen]
    assert set(margins) == set(MARGINS)


def test_what_has_them_beside_stands_in_the_table_without_them_too():
    every = {one.name: one for one in candidates()}
    for one in every.values():
        if one.can_be_chosen:
            alone = every[one.name.partition("; or noise")[0]]
            assert (alone.parts, alone.can_be_chosen) == (one.parts - 4, False)
            np.testing.assert_array_equal(alone.of(invented()), one.of(invented()))


def test_each_of_those_is_offered_with_every_way_of_letting_go_and_without():
    chosen = {one.name: one for one in candidates() if one.can_be_chosen}
    kept = [one for one in chosen.values() if one.release is None]
    assert len(chosen) == len(kept) * (len(RELEASES) + 1)
    for one in kept:
        for release in RELEASES:
            name = f"{one.name}; release over {release.steps} ({release.share:g})"
            assert chosen[name].release == release
            assert (chosen[name].parts, chosen[name].of) == (one.parts, one.of)
            assert chosen[name].margins == one.margins


def test_shipped_cases_let_go_and_hear_sensors_in_ways_that_are_offered(request):
    for case in load_config(request.config.rootpath).cases.values():
        steps = score_steps(case.score)
        assert steps.release in RELEASES
        assert (steps.noise.margin, steps.shift.margin) in MARGINS


@pytest.mark.parametrize("names", [("b", "c", "a", "d"), ("d", "a", "c", "b")])
def test_of_equals_the_first_in_the_table_comes_first(names):
    rows = [(name, "x", 1.0 if name == "c" else 0.5, 0.5) for name in names]
    place = ranked(judged(*rows)).set_index("candidate")["rank"]
    others = [name for name in names if name != "c"]
    assert place["c"] == 1
    assert [place[name] for name in others] == [2, 3, 4]


def invented():
    """Return a constant for the statistic of every candidate that is one."""
    singles = [one.name for one in candidates() if one.parts == 1]
    return {name: np.full(3, float(number)) for number, name in enumerate(singles)}


def test_a_single_statistic_is_a_candidate_as_it_is():
    statistics = invented()
    for one in candidates():
        if one.parts == 1:
            np.testing.assert_array_equal(one.of(statistics), statistics[one.name])


@pytest.mark.parametrize(
    ("name", "parts", "expected"),
    [
        ("larger of mean and size", 2, [3, 5, 2]),
        ("largest of mean, size, reconstruction", 3, [3, 5, 9]),
        ("largest of mean, size, reconstruction; recent mean (.7, .3)", 4, [5.1, 6.5, 9.3]),
        ("largest of mean, size, reconstruction; recent mean (.5, .5)", 4, [6.5, 7.5, 9.5]),
        ("largest of mean, size, reconstruction; larger recent (.7, .3)", 5, [5.7, 6.5, 9.3]),
        ("larger of mean and size of one state", 2, [4, 5, 2]),
        (
            (
                "largest of limited mean over 20, size of one state over 3, reconstruction; "
                "recent mean over 5 (.7, .3)"
            ),
            4,
            [9.9, 6.4, 7.8],
        ),
        (
            (
                "largest of limited mean over 20, size of one state over 3, reconstruction; "
                "recent mean over 5 (.7, .3); mean with closed form"
            ),
            7,
            # (9.9 + .7 * 6 + .3 * 4) / 2 and so on.
            [7.65, 7.6, 8.3],
        ),
        (
            WHOLE,
            10,
            # (9.9 + 5.4 + .6 * 9 + .4 * 1) / 3 and so on.
            [21.1 / 3, 15.2 / 3 + 0.8, 16.6 / 3 + 2.0],
        ),
        (
            (
                "no twin: closed form's limited mean over 20, size of one state over 3; "
                "recent mean over 5 (.7, .3); mean with consistency (size over 10)"
            ),
            6,
            [5.6, 5.6, 7.4],
        ),
        # .55 times the mean and .45 times (.5 + 1) / 2, (1 + 0) / 2, (-1 + 1) / 2.
        (f"{WHOLE}; scatter over 60 (0.45)", 12, WITH_SCATTER),
        # .8 times and .2 times the same.
        (
            f"{WHOLE}; scatter over 20 (0.2)",
            12,
            [16.88 / 3 + 0.15, 12.16 / 3 + 0.64 + 0.1, 13.28 / 3 + 1.6],
        ),
        # Both are held against the mean where all are on one scale (see test_development).
        (
            f"{WHOLE}; or noise of one sensor, 0.3, or its shift, 0.5",
            14,
            [21.1 / 3, 15.2 / 3 + 0.8, 16.6 / 3 + 2.0],
        ),
        (f"{WHOLE}; scatter over 60 (0.45){QUIETEST}", 16, WITH_SCATTER),
    ],
)
def test_statistics_are_put_together_as_the_name_says(name, parts, expected):
    statistics = invented() | {
        MEAN: np.array([1.0, 5.0, 2.0]),
        SIZE: np.array([3.0, 1.0, 1.0]),
        REBUILT: np.array([2.0, 2.0, 9.0]),
        RECENT: np.full(3, 10.0),
        "T2 of limited mean over 20": np.array([1.0, 7.0, 2.0]),
        "T2 of mean over 5": np.full(3, 5.0),
        "closed form's T2 of limited mean over 20": np.array([6.0, 1.0, 2.0]),
        "closed form's size of one state over 3": np.array([3.0, 8.0, 8.0]),
        "closed form's T2 of mean over 5": np.array([4.0, 32 / 3, 32 / 3]),
        "parity residuals' T2 of limited mean over 10": np.array([9.0, 2.0, 0.0]),
        "parity residuals' size of one state over 10": np.array([3.0, 4.0, 10.0]),
        "parity residuals' T2 of mean over 1": np.array([1.0, 0.0, 0.0]),
        "size of one state over 3": np.array([12.0, 1.0, 1.0]),
        "size of one state over 10": np.array([4.0, 1.0, 1.0]),
        "size of one state over 60": np.array([0.5, 2.0, -1.0]),
        "closed form's size of one state over 60": np.array([4.0, 0.0, 1.0]),
        "size of one state over 20": np.array([0.5, 2.0, -1.0]),
        "closed form's size of one state over 20": np.array([4.0, 0.0, 1.0]),
    }
    one = next(one for one in candidates() if one.name == name)
    assert one.parts == parts
    np.testing.assert_allclose(one.of(statistics), expected)


def test_no_two_candidates_have_a_name():
    names = [one.name for one in candidates()]
    assert len(set(names)) == len(names)


def test_what_is_not_known_yet_leaves_the_whole_unknown():
    statistics = invented() | {RECENT: np.array([np.nan, 1.0, 1.0])}
    whole = next(one for one in candidates() if "recent mean (.7" in one.name).of(statistics)
    np.testing.assert_array_equal(np.isnan(whole), [True, False, False])


def test_every_statistic_is_made_and_none_knows_what_comes_later(relative_twin):
    splits = {"train": [make_recording("train-0")]}
    data = MemberData(small_case(), splits, relative_twin.scaler, relative_twin.spec)
    scorer = Scorer(relative_twin, 64, "cpu")

    def score(item):
        return item, scorer.score(item, short_lead_steps=3)

    held_out = [score(make_recording(f"held-out-{i}", 200)) for i in range(2)]
    makers = fit_statistics(data, scorer, held_out)
    assert set(makers) == {NOISE, SHIFT} | {one.name for one in candidates() if one.parts == 1}
    whole = make_recording("test", 160)
    ended = replace(whole, time_s=whole.time_s[:120], values=whole.values[:120], segments=())
    for name, make in makers.items():
        long, short = make(*score(whole)), make(*score(ended))
        known = np.isfinite(short)
        # Of the windows the first has no innovation; at most 60 are averaged.
        assert known[60:].all(), name
        assert known.size == 100
        np.testing.assert_allclose(long[: len(short)], short, atol=1e-3, err_msg=name)


def test_statistics_of_the_closed_form_are_of_its_innovations(trained_twin):
    splits = {"train": [make_recording("train-0")]}
    data = MemberData(small_case(), splits, trained_twin.scaler, trained_twin.spec)
    scorer = Scorer(trained_twin, 64, "cpu")
    held_out = [
        (item, scorer.score(item, short_lead_steps=3))
        for item in (make_recording(f"held-out-{i}", 200) for i in range(2))
    ]
    makers = fit_statistics(data, scorer, held_out)
    item, scores = held_out[0]
    swapped = replace(
        scores,
        innovations=scores.closed_form_innovations,
        closed_form_innovations=scores.innovations,
    )
    for name in ("T2 of limited mean over 20", "size of one state over 3", "T2 of mean over 5"):
        own, closed = makers[name], makers[f"closed form's {name}"]
        moved = closed(item, replace(scores, innovations=scores.innovations + 1))
        np.testing.assert_array_equal(closed(item, scores), moved)
        assert not np.allclose(own(item, scores), closed(item, scores), equal_nan=True)
        assert not np.allclose(closed(item, scores), closed(item, swapped), equal_nan=True)
        tied = makers[f"parity residuals' {name}"]
        np.testing.assert_array_equal(tied(item, scores), tied(item, swapped))
        shifted = replace(scores, samples=scores.samples + np.float32([0, 1, 0]))
        assert not np.allclose(tied(item, scores), tied(item, shifted), equal_nan=True)
