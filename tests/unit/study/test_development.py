"""What the table of candidates says of development recordings, noise of one sensor included."""

from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from odisar.artifacts import Workspace
from odisar.capability.combined import ODISAR
from odisar.capability.innovations import LogScale
from odisar.capability.scoring import Scorer
from odisar.errors import OdisarError
from odisar.evaluation.metrics import auroc, tnr_at_tpr95
from odisar.recordings.schema import Recording
from odisar.stages.detectors import fit_innovation_scores
from odisar.stages.members import MemberData
from odisar.study import development
from odisar.study.candidates import NOISE, SHIFT, candidates
from odisar.study.fitted_statistics import fit_statistics
from small_bundle import small_case
from small_system import SPEC, make_recording

SIGMAS = 2.0
SINGLE = "T2 of mean over 10"
SPLITS = {"train": ["train-0", "train-1"], "validation": ["held-out-0", "held-out-1"]}


def disturbed(name: str, components: str, push: float) -> Recording:
    made = make_recording(name, push=push)
    return replace(made, info=replace(made.info, components=components, strength=push))


@pytest.fixture(scope="module")
def data(trained_twin) -> MemberData:
    splits = {split: [make_recording(name) for name in names] for split, names in SPLITS.items()}
    wind = disturbed("wind", "wind", 0.05)
    splits["development"] = [
        # A gap soon after the wind is over: what follows knows nothing of its peak.
        replace(wind, segments=((0, 210), (210, 300))),
        disturbed("waves", "waves", 0.05),
        disturbed("more-waves", "waves", 0.05),
        make_recording("clean"),
    ]
    return MemberData(small_case(), splits, trained_twin.scaler, trained_twin.spec)


@pytest.fixture(scope="module")
def scorer(trained_twin) -> Scorer:
    return Scorer(trained_twin, 64, "cpu")


@pytest.fixture(scope="module")
def makers(data, scorer):
    held_out = [
        (item, scorer.score(item, short_lead_steps=3)) for item in data.splits["validation"]
    ]
    return fit_statistics(data, scorer, held_out)


@pytest.fixture
def folder(data, trained_twin, tmp_path, monkeypatch) -> Path:
    """Return the folder of the tables of one set-up."""
    config = prepare(monkeypatch, data, trained_twin)
    workspace = Workspace(tmp_path)
    monkeypatch.setattr(development, "_FIRST", 10_000)
    development.run(config, workspace)
    return workspace.study_results


@pytest.fixture
def table(folder) -> pd.DataFrame:
    return pd.read_csv(folder / "development.csv")


@pytest.fixture
def cells(folder) -> pd.DataFrame:
    return pd.read_csv(folder / "development-cells.csv")


def prepare(monkeypatch, data: MemberData, twin) -> SimpleNamespace:
    """Make the study see these recordings and this twin; return its configuration."""
    monkeypatch.setattr(development, "load_member", lambda *_: data)
    monkeypatch.setattr(development, "read_twin", lambda _: twin)
    monkeypatch.setattr(development, "candidates", chosen)
    return SimpleNamespace(
        study=SimpleNamespace(setups=["small"]),
        pipeline=SimpleNamespace(accelerator="cpu"),
        capability=SimpleNamespace(scoring_batch=64, threshold_sigmas=SIGMAS),
    )


def chosen(share_holding: float) -> list:
    """Return a single statistic, and a few candidates that have every part."""
    return [
        one
        for one in candidates(share_holding)
        if one.name == SINGLE
        or (
            one.name.startswith("mean over 20, size over 5, reconstruction; recent 3 (0.3)")
            and "; consistency, recent 1 (0.4)" in one.name
            and "scatter over 60" not in one.name
        )
    ]


def test_noise_and_shift_are_the_monitors_own_without_their_margins(data, scorer, makers):
    fitted = fit_innovation_scores(scorer, data)
    assert (fitted.noise.steps.margin, fitted.shift.steps.margin) > (0, 0)
    item = make_recording("fresh", 120)
    scores = scorer.score(item, short_lead_steps=3)
    (run,) = scorer.runs(item, scores)
    noise = fitted.noise.score(run.outliers(fitted.parts.closed_form.size.precision))
    for name, said, margin in (
        (NOISE, noise, fitted.noise.steps.margin),
        (SHIFT, fitted.shifts(run)[ODISAR], fitted.shift.steps.margin),
    ):
        found = makers[name](item, scores)
        np.testing.assert_allclose(found, said + margin)
        assert np.isfinite(found[fitted.known_after_steps :]).all()


def test_where_no_shift_is_sought_none_is_heard(data, scorer):
    case = data.case.model_copy(
        update={"score": data.case.score.model_copy(update={"shift": None})}
    )
    deaf = replace(data, case=case)
    held_out = [(i, scorer.score(i, short_lead_steps=3)) for i in data.splits["validation"]]
    item = make_recording("fresh", 120)
    scores = scorer.score(item, short_lead_steps=3)
    found = fit_statistics(deaf, scorer, held_out)[SHIFT](item, scores)
    assert np.isnan(found).all()
    assert len(found) == len(scores.positions)


def test_noise_begins_anew_after_a_gap(scorer, makers):
    item = replace(make_recording("gap", 160), segments=((0, 80), (80, 160)))
    scores = scorer.score(item, short_lead_steps=3)
    found = makers[NOISE](item, scores)
    assert len(found) == len(scores.positions)
    unknown = np.flatnonzero(np.isnan(found))
    (_, first), (second, _) = scores.runs
    assert first == second
    assert unknown.tolist() == [*range(7), *range(second, second + 7)]


def test_a_cell_is_a_part_of_the_weather_and_its_strength(cells):
    counted = cells.groupby(["kind", "strength"]).recordings.first()
    assert counted.to_dict() == {("waves", 0.05): 2, ("wind", 0.05): 1}


def test_only_candidates_with_noise_and_shift_are_ranked(table):
    ranks = table.set_index("candidate")["rank"]
    assert ranks.notna().tolist() == ["; noise " in name for name in ranks.index]
    assert sorted(ranks.dropna()) == list(range(1, int(ranks.notna().sum()) + 1))
    assert pd.isna(ranks[SINGLE])


def steps_of(one, scale, scores, statistics) -> list[np.ndarray]:
    """Return the mean of a candidate, with noise beside, with a shift beside, and let go."""
    noise, shift = statistics[NOISE] - one.margins[0], statistics[SHIFT] - one.margins[1]
    found = [(one.of(statistics) - scale.usual) / (scale.rare - scale.usual)]
    found.append(np.maximum(found[0], noise))
    found.append(np.maximum(found[1], np.nan_to_num(shift, nan=-np.inf)))
    if one.release is not None:
        runs = [one.release.of(found[2][start:stop]) for start, stop in scores.runs]
        return [*found, np.concatenate(runs)]
    return [*found, found[2]]


def test_the_candidate_that_ships_is_marked(data, trained_twin, tmp_path, monkeypatch):
    config = prepare(monkeypatch, data, trained_twin)
    (name, *_), case = [one.name for one in chosen(1.0) if one.can_be_chosen], data.case.score
    asked = []
    monkeypatch.setattr(development, "shipped", lambda score: asked.append(score) or name)
    development.run(config, Workspace(tmp_path))
    for table in ("development", "development-cells"):
        rows = pd.read_csv(tmp_path / f"reports/study/{table}.csv")
        assert set(rows[rows.ships].candidate) == {name}
    assert asked == [case]


def test_noise_and_shift_less_their_margins_count_where_they_are_rarer_than_the_mean(
    cells, data, scorer, makers
):
    def made(item):
        scores = scorer.score(item, short_lead_steps=3)
        return scores, {name: make(item, scores) for name, make in makers.items()}

    usual = [made(item) for item in data.splits["validation"]]
    (wind,) = (item for item in data.splits["development"] if item.info.components == "wind")
    scores, statistics = made(wind)
    times = wind.time_s[scores.positions]
    labels = (times >= wind.intervals[0].start_s) & (times < wind.intervals[0].end_s)
    judged = cells[cells.kind == "wind"].set_index("candidate")
    changed = np.zeros(3, dtype=int)
    # No relation holds between the small system's states.
    for one in (one for one in chosen(0.0) if one.can_be_chosen):
        scale = LogScale.fit(np.exp(np.concatenate([one.of(item) for _, item in usual])))
        found = steps_of(one, scale, scores, statistics)
        changed += [np.count_nonzero(a != b) for a, b in pairwise(np.nan_to_num(found))]
        known = np.isfinite(found[-1]) & (np.arange(len(labels)) >= SPEC.horizon_steps)
        score, active = found[-1][known], labels[known]
        assert judged.auroc[one.name] == pytest.approx(auroc(score, active))
        assert judged.tnr_at_tpr95[one.name] == pytest.approx(tnr_at_tpr95(score, active))
        calm = np.exp(np.concatenate([steps_of(one, scale, *item)[-1] for item in usual]))
        flags = np.exp(score) > np.nanmean(calm) + SIGMAS * np.nanstd(calm)
        wanted = 2 * np.sum(flags & active) / (flags.sum() + active.sum())
        assert judged.f1_ood[one.name] == pytest.approx(wanted)
        assert 0 < wanted < 1
    assert (changed > 0).all()


def test_without_disturbed_development_recordings_nothing_is_chosen(
    data, trained_twin, tmp_path, monkeypatch
):
    calm = replace(data, splits={**data.splits, "development": [make_recording("clean")]})
    config = prepare(monkeypatch, calm, trained_twin)
    with pytest.raises(OdisarError, match="hold no disturbance to choose a score by"):
        development.run(config, Workspace(tmp_path))
