"""What stops a run before anything is trained."""

from dataclasses import replace
from types import SimpleNamespace

import pandas as pd
import pytest

from odisar.capability.scoring import Scorer
from odisar.config.score import FEWEST_KNOWN
from odisar.errors import OdisarError
from odisar.stages import preprocess
from odisar.stages.detectors import fit_innovation_scores
from odisar.stages.members import Member, MemberData
from odisar.stages.preprocess import require_disturbed, require_scores, split_overview
from small_reference import system_case
from small_system import SPEC, make_recording


def splits(*rows: tuple[str, str, int, int]) -> pd.DataFrame:
    return pd.DataFrame(rows, columns=["setup", "split", "disturbed", "overall"])


def test_a_set_up_that_nothing_disturbed_tests_is_named_with_the_way_out():
    overview = splits(("good", "test", 2, 2), ("calm", "test", 0, 0), ("calm", "development", 3, 3))
    with pytest.raises(OdisarError, match=r"'calm'.*labels\.csv.*faults"):
        require_disturbed(overview)


def test_a_set_up_whose_groups_select_nothing_disturbed_is_named_with_the_way_out():
    overview = splits(("good", "test", 2, 1), ("narrow", "test", 2, 0))
    with pytest.raises(OdisarError, match=r"'narrow'.*groups\.overall.*widen"):
        require_disturbed(overview)


def test_one_disturbed_fold_is_enough():
    require_disturbed(splits(("a", "test", 0, 0), ("a", "test", 1, 1), ("a", "train", 0, 0)))


def validated_on(*samples: int) -> MemberData:
    """Return a member whose validation recordings have so many samples."""
    splits = {
        "train": [make_recording(f"train-{i}") for i in range(2)],
        "validation": [make_recording(f"held-out-{i}", n) for i, n in enumerate(samples)],
    }
    return MemberData(system_case(), splits, None, SPEC)


def before_the_first_score() -> int:
    return SPEC.context_steps - 1 + system_case().score.longest_steps


@pytest.mark.parametrize("shares", [(FEWEST_KNOWN,), (5, FEWEST_KNOWN - 5)])
def test_validation_recordings_just_long_enough_for_the_score_pass(shares):
    require_scores("small", validated_on(*(before_the_first_score() + n for n in shares)))


@pytest.mark.parametrize("shares", [(FEWEST_KNOWN - 1,), (5, FEWEST_KNOWN - 6), (-30, 3)])
def test_validation_recordings_too_short_for_the_score_stop_the_run_before_training(shares):
    left = sum(max(0, n) for n in shares)
    data = validated_on(*(before_the_first_score() + n for n in shares))
    with pytest.raises(OdisarError, match=rf"cases\.small\.score: {left} samples .*shorten"):
        require_scores("small", data)


def test_no_window_of_the_score_crosses_a_gap():
    half = before_the_first_score() + 9
    data = validated_on(2 * half)
    (item,) = data.splits["validation"]
    data.splits["validation"] = [replace(item, segments=((0, half), (half, 2 * half)))]
    with pytest.raises(OdisarError, match="18 samples of validation recordings"):
        require_scores("small", data)


def test_where_commands_are_known_ahead_the_last_horizon_has_no_score():
    spec = replace(SPEC, known_ahead=(0,))
    needed = before_the_first_score() + FEWEST_KNOWN + SPEC.horizon_steps
    require_scores("small", replace(validated_on(needed), spec=spec))
    with pytest.raises(OdisarError, match="19 samples of validation recordings"):
        require_scores("small", replace(validated_on(needed - 1), spec=spec))


def test_every_member_is_asked_before_anything_is_trained(monkeypatch):
    members = {"long": validated_on(300), "short": validated_on(before_the_first_score())}
    monkeypatch.setattr(
        preprocess, "pipeline_members", lambda _: [Member(name, None) for name in members]
    )
    monkeypatch.setattr(preprocess, "load_member", lambda *given: members[given[-1].setup])
    monkeypatch.setattr(MemberData, "windows", lambda *_: [])
    setups = {name: SimpleNamespace(case=f"case-of-{name}") for name in members}
    with pytest.raises(OdisarError, match=r"cases\.case-of-short\.score: 0 samples"):
        split_overview(SimpleNamespace(setups=setups), None)


def test_what_passes_can_be_calibrated_and_what_does_not_can_not(trained_twin):
    scorer = Scorer(trained_twin, 64, "cpu")
    data = replace(validated_on(before_the_first_score() + 20), scaler=trained_twin.scaler)
    fitted = fit_innovation_scores(scorer, data)
    assert fitted.known_after_steps == system_case().score.longest_steps
    short = replace(validated_on(before_the_first_score() + 19), scaler=trained_twin.scaler)
    with pytest.raises(OdisarError, match="19 samples of validation recordings"):
        fit_innovation_scores(scorer, short)
