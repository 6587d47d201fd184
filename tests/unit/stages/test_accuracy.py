"""Which forecasts of a member are judged, and on what."""

from dataclasses import replace

import numpy as np
import pandas as pd
import torch

from odisar.stages.accuracy import TWIN, accuracy_table, member_accuracy
from odisar.stages.members import MemberData
from odisar.windows.scaling import Scaler
from small_bundle import small_case
from small_system import SPEC, make_recording

from ..evaluation.evaluation_cases import CONFIG

STATES = ("Speed", "Turn Rate")
CHEAP = {"persistence", "constant-velocity", "closed-form"}


class Twin:
    """Forecasts the mean of training, and keeps the widths of known futures it was given."""

    def __init__(self):
        self.known = set()

    def forecast_windows(self, context, known):
        self.known.add(known.shape[-1])
        return torch.zeros(len(context), SPEC.horizon_steps, len(STATES))


def member(spec=SPEC, test=None):
    splits = {
        split: [make_recording(f"{split}-{i}", 120) for i in range(3)]
        for split in ("train", "validation", "test")
    }
    if test is not None:
        splits["test"] = test
    return MemberData(small_case(), splits, Scaler.fit(splits["train"], spec), spec)


def judged(data):
    twin = Twin()
    found = {part.commands: set(part.squares) for part in member_accuracy(data, twin)}
    return found, twin.known


def test_the_twin_stands_among_forecasters_that_know_as_much_as_it():
    found, known = judged(member())
    assert found == {"unknown": CHEAP | {TWIN}, "known-ahead": CHEAP}
    assert known == {0}
    found, known = judged(member(replace(SPEC, known_ahead=(0,))))
    assert found == {"unknown": CHEAP, "known-ahead": CHEAP | {TWIN}}
    assert known == {1}


def test_without_commands_there_is_nothing_to_know():
    found, _ = judged(member(replace(SPEC, commands=())))
    assert found == {"unknown": CHEAP | {TWIN}}


def test_only_undisturbed_recordings_that_hold_a_window_are_judged():
    clean, pushed = make_recording("test-0", 120), make_recording("pushed", 120, push=0.2)
    (alone,) = member_accuracy(member(replace(SPEC, commands=()), [clean, pushed]), Twin())
    assert alone.clusters == ("test-0",)
    assert member_accuracy(member(test=[pushed]), Twin()) == []
    assert member_accuracy(member(test=[make_recording("short", 20)]), Twin()) == []


def test_members_of_a_set_up_are_pooled_and_one_without_recordings_says_nothing():
    one = member_accuracy(member(), Twin())
    table = accuracy_table("system", [one, [], one], STATES, CONFIG, 1)
    assert set(table.recordings) == {6}
    assert set(table.commands) == {"unknown", "known-ahead"}
    whole = table[(table.state == "all") & (table.step == 0)].set_index(["commands", "forecaster"])
    assert whole.skill["known-ahead", "closed-form"] > whole.skill["unknown", "closed-form"] > 0
    nothing = accuracy_table("system", [[]], STATES, CONFIG, 1)
    assert nothing.empty
    # Below another set-up's, numbers stay numbers.
    assert (pd.concat([nothing, table]).dtypes == table.dtypes).all()
    assert table.rmse.dtype == np.float64


def test_a_short_context_is_looked_at_whole():
    spec = replace(SPEC, context_steps=5)
    found, _ = judged(member(spec))
    assert found["unknown"] == CHEAP | {TWIN}
