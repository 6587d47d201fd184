"""What the table of candidates says of development recordings, noise of one sensor included."""

from dataclasses import replace
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
from odisar.study.development import fit_statistics
from small_bundle import small_case
from small_system import SPEC, make_recording

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
def table(data, trained_twin, tmp_path, monkeypatch) -> pd.DataFrame:
    """Return the table of one set-up."""
    config = prepare(monkeypatch, data, trained_twin)
    workspace = Workspace(tmp_path)
    development.run(config, workspace)
    return pd.read_csv(workspace.study_results / "development.csv")


def prepare(monkeypatch, data: MemberData, twin) -> SimpleNamespace:
    """Make the study see these recordings and this twin; return its configuration."""
    monkeypatch.setattr(development, "load_member", lambda *_: data)
    monkeypatch.setattr(development, "read_twin", lambda _: twin)
    monkeypatch.setattr(development, "candidates", chosen)
    return SimpleNamespace(
        study=SimpleNamespace(setups=["small"]),
        pipeline=SimpleNamespace(accelerator="cpu"),
        capability=SimpleNamespace(scoring_batch=64),
    )


def chosen() -> list:
    """Return a single statistic, and a few candidates that have every part."""
    return [
        one
        for one in candidates()
        if one.name == SINGLE
        or (
            one.name.startswith("largest of limited mean over 20, size of one state over 3")
            and "recent mean over 3 (.7, .3); mean with closed form and" in one.name
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


def test_a_cell_is_a_part_of_the_weather_and_its_strength(table):
    cells = table.groupby(["kind", "strength"]).recordings.first()
    assert cells.to_dict() == {("waves", 0.05): 2, ("wind", 0.05): 1}


def test_only_candidates_with_noise_and_shift_are_ranked(table):
    ranks = table.groupby("candidate", sort=False)["rank"].first()
    assert ranks.notna().tolist() == ["; or noise of one sensor" in name for name in ranks.index]
    assert sorted(ranks.dropna()) == list(range(1, int(ranks.notna().sum()) + 1))
    assert pd.isna(ranks[SINGLE])


def test_noise_and_shift_less_their_margins_count_where_they_are_rarer_than_the_mean(
    table, data, scorer, makers
):
    held_out = data.splits["validation"]

    def made(item):
        scores = scorer.score(item, short_lead_steps=3)
        return scores, {name: make(item, scores) for name, make in makers.items()}

    usual = [made(item)[1] for item in held_out]
    (wind,) = (item for item in data.splits["development"] if item.info.components == "wind")
    scores, statistics = made(wind)
    times = wind.time_s[scores.positions]
    labels = (times >= wind.intervals[0].start_s) & (times < wind.intervals[0].end_s)
    judged = table[table.kind == "wind"].set_index("candidate")
    counted = moved = let_go = 0
    for one in chosen():
        mean = one.of(statistics)
        if one.margins is not None:
            scale = LogScale.fit(np.exp(np.concatenate([one.of(item) for item in usual])))
            noise, shift = statistics[NOISE] - one.margins[0], statistics[SHIFT] - one.margins[1]
            mean = (mean - scale.usual) / (scale.rare - scale.usual)
            counted += np.count_nonzero(noise > mean)
            mean = np.maximum(mean, noise)
            moved += np.count_nonzero(shift > mean)
            mean = np.maximum(mean, np.nan_to_num(shift, nan=-np.inf))
            if one.release is not None:
                runs = [one.release.of(mean[start:stop]) for start, stop in scores.runs]
                kept, mean = mean, np.concatenate(runs)
                let_go += np.count_nonzero(mean < kept)
        known = np.isfinite(mean) & (np.arange(len(mean)) >= SPEC.horizon_steps)
        assert judged.auroc[one.name] == pytest.approx(auroc(mean[known], labels[known]))
        wanted = tnr_at_tpr95(mean[known], labels[known])
        assert judged.tnr_at_tpr95[one.name] == pytest.approx(wanted)
    assert counted > 0
    assert moved > 0
    assert let_go > 0


def test_without_disturbed_development_recordings_nothing_is_chosen(
    data, trained_twin, tmp_path, monkeypatch
):
    calm = replace(data, splits={**data.splits, "development": [make_recording("clean")]})
    config = prepare(monkeypatch, calm, trained_twin)
    with pytest.raises(OdisarError, match="hold no disturbance to choose a score by"):
        development.run(config, Workspace(tmp_path))
