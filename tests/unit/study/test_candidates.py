"""The rule that chose the score: means of means, and candidates that are what their names say."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from odisar.capability.scoring import Scorer
from odisar.config.loader import load_config
from odisar.stages.members import MemberData
from odisar.study.candidates import MARGINS, NOISE, RELEASES, SHIFT, candidates, shipped
from odisar.study.development import cells_of_first, ranked
from odisar.study.fitted_statistics import fit_statistics
from small_bundle import small_case
from small_system import make_recording

MEAN, SIZE, REBUILT = "T2 of mean over 10", "log NIS over 5", "reconstruction"
RECENT = "T2 of mean over 3"
ALONE = "mean over 20, size over 5, reconstruction; recent 5 (0.3)"
WHOLE = f"{ALONE}; closed form; consistency, recent 1 (0.4)"
FREE = "no twin: mean over 20, size over 5; recent 5 (0.3); consistency, recent 1 (0.4)"
MEANS, SCATTERED = np.array([6.5, 16.9 / 3, 21.7 / 3]), np.array([0.75, 0.5, 0.0])


def judged(*rows):
    """Return cells of (candidate, set-up, AUROC, TNR@TPR95, F1), all to choose from but `free`."""
    names = ["candidate", "setup", "auroc", "tnr_at_tpr95", "f1_ood"]
    cells = pd.DataFrame(rows, columns=names).assign(parts=3, kind="all", strength=1.0)
    return cells.assign(can_be_chosen=cells.candidate != "free", ships=cells.candidate == "low")


def test_the_mean_is_over_the_cells_of_a_set_up_and_ranks_are_its_own():
    table = ranked(
        judged(
            ("even", "x", 0.6, 0.4, 0.5),
            ("even", "x", 0.6, 0.4, 0.5),
            ("wide", "x", 0.8, 0.6, 0.4),
            ("wide", "x", 1.0, 0.8, 0.6),
            ("wide", "y", 0.5, 0.3, 0.1),
            ("even", "y", 0.9, 0.7, 0.5),
        )
    )
    assert table.setup.tolist() == ["x", "x", "y", "y"]
    assert table.candidate.tolist() == ["wide", "even", "even", "wide"]
    assert table["rank"].tolist() == [1, 2, 1, 2]
    assert table.rule_mean.tolist() == pytest.approx([0.8, 0.5, 0.8, 0.4])
    assert table.auroc.tolist() == pytest.approx([0.9, 0.6, 0.9, 0.5])
    assert table.tnr_at_tpr95.tolist() == pytest.approx([0.7, 0.4, 0.7, 0.3])
    assert table.f1_ood.tolist() == pytest.approx([0.5, 0.5, 0.5, 0.1])


def test_of_those_that_are_level_with_the_highest_the_first_has_the_highest_f1():
    rows = [
        ("highest", "x", 0.9, 0.8, 0.3),
        ("level", "x", 0.8995, 0.8, 0.5),
        ("as-level", "x", 0.8994, 0.8, 0.5),
        ("below", "x", 0.8988, 0.8, 0.9),
        ("lower", "x", 0.7, 0.8, 1.0),
        ("free", "x", 0.9004, 0.9, 1.0),
    ]
    table = ranked(judged(*rows))
    expected = ["level", "as-level", "highest", "below", "lower", "free"]
    assert table.candidate.tolist() == expected
    assert table["rank"].tolist()[:5] == [1, 2, 3, 4, 5]


def test_what_cannot_be_chosen_is_compared_and_not_ranked():
    rows = [("free", "x", 1.0, 1.0, 1.0), ("low", "x", 0.5, 0.5, 0.5), ("high", "x", 0.6, 0.6, 0.6)]
    table = ranked(judged(*rows))
    assert table.candidate.tolist() == ["high", "low", "free"]
    assert table["rank"].dropna().tolist() == [1, 2]
    assert table.rule_mean.tolist() == pytest.approx([0.6, 0.5, 1.0])
    free = [one for one in candidates() if not one.uses_twin]
    assert {one.parts for one in free} == {1, 6, 7}
    for one in free:
        assert one.name.startswith(("no twin", "closed form's", "parity residuals'"))


def test_cells_are_kept_of_the_first_of_what_ships_and_of_the_best_beside_them():
    names = [f"c{number}" for number in range(7)] + ["low", "free", "other"]
    rows = [(name, "x", 1 - 0.05 * at, 0.5, 0.5) for at, name in enumerate(names)]
    rows += [(name, "y", 0.4 + 0.05 * at, 0.5, 0.5) for at, name in enumerate(names)]
    cells = judged(*rows, *rows)
    cells.loc[cells.candidate == "other", "can_be_chosen"] = False
    kept = cells_of_first(cells, ranked(cells))
    for setup, expected, ranks in (
        ("x", ["c0", "c1", "c2", "c3", "c4", "low", "free"], [1, 2, 3, 4, 5, 8]),
        ("y", ["low", "c6", "c5", "c4", "c3", "other"], [1, 2, 3, 4, 5]),
    ):
        own = kept[kept.setup == setup]
        assert own.candidate.tolist() == [name for name in expected for _ in range(2)]
        assert own["rank"].dropna().tolist() == [rank for rank in ranks for _ in range(2)]
        origin = cells[cells.setup == setup].set_index("candidate").auroc
        assert own.auroc.tolist() == [origin[name].iloc[0] for name in own.candidate]


def test_the_best_beside_them_is_the_first_of_equals_and_known():
    rows = [("c", "x", 0.9), ("free", "x", 0.7), ("as-free", "x", 0.7), ("unknown", "x", np.nan)]
    cells = judged(*((*row, 0.5, 0.5) for row in rows))
    cells["can_be_chosen"] = cells.candidate == "c"
    assert cells_of_first(cells, ranked(cells)).candidate.tolist() == ["c", "free"]


def test_only_what_uses_the_twin_and_has_noise_and_shift_beside_can_be_chosen():
    for one in candidates():
        beside = "; noise " in one.name
        assert one.can_be_chosen == beside == (one.margins is not None)
        assert one.uses_twin or not beside
        if beside:
            said = one.name.partition("; noise ")[2].partition(";")[0]
            assert tuple(float(part) for part in said.split(", shift ")) == one.margins
    margins = [one.margins for one in candidates() if one.can_be_chosen]
    assert set(margins) == set(MARGINS)


def test_what_has_them_beside_stands_in_the_table_without_them_too():
    every = {one.name: one for one in candidates()}
    for one in every.values():
        if one.can_be_chosen:
            alone = every[one.name.partition("; noise ")[0]]
            assert (alone.parts, alone.can_be_chosen) == (one.parts - 4, False)
            assert alone.of is one.of


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


def test_what_studied_cases_ship_is_offered(request):
    config = load_config(request.config.rootpath)
    offered = {one.name for one in candidates() if one.can_be_chosen}
    for setup in config.study.setups:
        assert shipped(config.case_of(setup).score) in offered


@pytest.mark.parametrize("names", [("b", "c", "a", "d"), ("d", "a", "c", "b")])
def test_of_equals_the_first_in_the_table_comes_first(names):
    rows = [(name, "x", 1.0 if name == "c" else 0.5, 0.5, 0.5) for name in names]
    others = [name for name in names if name != "c"]
    assert ranked(judged(*rows)).candidate.tolist() == ["c", *others]


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
        ("largest of mean, size, reconstruction; larger recent (.7, .3)", 5, [5.4, 6.5, 9.3]),
        ("larger of mean and size of one state", 2, [4, 5, 2]),
        # .7 times the largest of what is held to newer halves, and .3 times the recent mean.
        (ALONE, 4, [0.7 * 11.5 + 1.5, 0.7 * 6.5 + 1.5, 0.7 * 9 + 1.5]),
        # (9.55 + .7 * 5.5 + .3 * 4) / 2 and so on.
        (f"{ALONE}; closed form", 7, [7.3, 7.25, 8.3]),
        # (9.55 + 5.05 + .6 * 7.5 + .4 * 1) / 3 and so on.
        (WHOLE, 10, MEANS),
        (WHOLE.replace("(0.4)", "(0.6)"), 10, [18.2 / 3, 16.1 / 3, 20 / 3]),
        (WHOLE.replace("recent 1", "recent 2"), 10, [19.9 / 3, 17.3 / 3, 21.7 / 3]),
        (FREE, 6, [4.975, 5.425, 6.95]),
        # .55 times the mean and .45 times (.5 + 1) / 2, (1 + 0) / 2, (-1 + 1) / 2.
        (f"{WHOLE}; scatter over 60 (0.45)", 12, 0.55 * MEANS + 0.45 * SCATTERED),
        (f"{WHOLE}; scatter over 60 (0.3)", 12, 0.7 * MEANS + 0.3 * SCATTERED),
        (
            f"{FREE}; scatter over 60 (0.3)",
            7,
            [0.7 * 4.975 + 0.3, 0.7 * 5.425, 0.7 * 6.95 + 0.3],
        ),
        # Both are held against the mean where all are on one scale (see test_development).
        (f"{WHOLE}; noise 0.3, shift 0.5", 14, MEANS),
        (
            f"{WHOLE}; scatter over 60 (0.45); noise 0.75, shift 1",
            16,
            0.55 * MEANS + 0.45 * SCATTERED,
        ),
    ],
)
def test_statistics_are_put_together_as_the_name_says(name, parts, expected):
    statistics = invented() | {
        MEAN: np.array([1.0, 5.0, 2.0]),
        SIZE: np.array([3.0, 1.0, 1.0]),
        REBUILT: np.array([2.0, 2.0, 9.0]),
        RECENT: np.full(3, 10.0),
        "T2 of limited mean over 20": np.array([1.0, 7.0, 2.0]),
        "T2 of limited mean over 10": np.array([9.0, 6.0, 9.0]),
        "size of one state over 5": np.array([12.0, 1.0, 1.0]),
        "size of one state over 3": np.array([11.0, 9.0, 9.0]),
        "T2 of mean over 5": np.full(3, 5.0),
        "closed form's T2 of limited mean over 20": np.array([6.0, 1.0, 2.0]),
        "closed form's T2 of limited mean over 10": np.array([5.0, 9.0, 9.0]),
        "closed form's size of one state over 5": np.array([3.0, 8.0, 8.0]),
        "closed form's size of one state over 3": np.array([9.0, 7.0, 9.0]),
        "closed form's T2 of mean over 5": np.array([4.0, 32 / 3, 32 / 3]),
        "parity residuals' T2 of limited mean over 10": np.array([9.0, 2.0, 0.0]),
        "parity residuals' T2 of limited mean over 5": np.array([7.0, 9.0, 9.0]),
        "parity residuals' size of one state over 10": np.array([3.0, 4.0, 10.0]),
        "parity residuals' size of one state over 5": np.array([9.0, 9.0, 8.0]),
        "parity residuals' T2 of mean over 1": np.array([1.0, 0.0, 0.0]),
        "parity residuals' T2 of mean over 2": np.array([2.0, 1.0, 0.0]),
        "size of one state over 10": np.array([4.0, 1.0, 1.0]),
        "size of one state over 60": np.array([0.5, 2.0, -1.0]),
        "closed form's size of one state over 60": np.array([4.0, 0.0, 1.0]),
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
