import numpy as np
import pytest

from odisar.config.loader import load_config
from odisar.recordings.schema import Recording, RecordingInfo
from odisar.report import examples
from odisar.report.examples import choose_examples, recordings_table

from .invented import ROOT


@pytest.fixture
def case():
    return load_config(ROOT).cases["vessel"]


def judged(name: str, **info: object) -> examples.Tested:
    known = RecordingInfo(case="vessel", split="test", maneuver="turning", **info)
    samples = np.zeros((200, 6))
    return examples.Tested(
        "vessel-all", "vessel-all", Recording(name, known, np.arange(200.0), samples)
    )


def test_the_strongest_that_counts_overall_is_chosen_with_a_clean_one(case):
    given = [
        judged("a", disturbance="case-1", components="all", strength=0.5),
        judged("b", disturbance="case-1", components="wind", strength=1.0),
        judged("c"),
    ]
    disturbed, clean = choose_examples(given, case, "not there")
    assert (disturbed.name, clean.name) == ("a", "c")
    table = recordings_table(given, {"vessel-all": case})
    assert list(table.is_overall) == [True, False, False]
    assert choose_examples(given, case, "b")[0].name == "b"


def test_without_a_disturbed_recording_a_clean_one_is_shown_once(case):
    first, second = choose_examples([judged("a"), judged("b")], case, "")
    assert {first.name, second.name} == {"a", "b"}
    assert choose_examples([judged("a")], case, "")[1] is None
