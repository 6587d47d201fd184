import numpy as np
import pytest

from odisar.config.loader import load_config
from odisar.recordings.schema import Interval, Recording, RecordingInfo
from odisar.stages.consequence import first_consequence

ONSET_S, LASTING_S = 20.0, 6.0
LIMIT = 2.0


@pytest.fixture(scope="module")
def case(request):
    """The shipped ferry: 1 Hz, a command and five states."""
    return load_config(request.config.rootpath).cases["vessel"]


@pytest.fixture
def limits(case):
    return {
        "state_low": dict.fromkeys(case.output_names, -LIMIT),
        "state_high": dict.fromkeys(case.output_names, LIMIT),
    }


def recording(case, outside=(), channel="Roll Angle", sign=1.0, gap_at=None, *, event=True):
    """Return 60 samples at 1 Hz, beyond the limit at the samples ``outside``."""
    time_s, values = np.arange(60.0), np.zeros((60, len(case.channels)))
    values[list(outside), case.channel_names.index(channel)] = sign * (LIMIT + 0.1)
    if gap_at is not None:
        time_s[gap_at:] += 10.0
    segments = () if gap_at is None else ((0, gap_at), (gap_at, 60))
    intervals = (Interval(ONSET_S, 40.0, "gale"),) if event else ()
    return Recording("r", RecordingInfo("vessel"), time_s, values, intervals, segments)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_lasting_excursion_counts_from_when_it_has_lasted(case, limits, sign):
    storm = recording(case, range(25, 40), sign=sign)
    assert first_consequence(storm, case, limits, LASTING_S) == 30.0


def test_an_excursion_that_does_not_last_is_none(case, limits):
    brief = recording(case, [*range(25, 30), *range(31, 36)])
    assert first_consequence(brief, case, limits, LASTING_S) is None


def test_two_states_taking_turns_are_no_lasting_excursion(case, limits):
    storm = recording(case, range(25, 29))
    storm.values[29:33, case.channel_names.index("Yaw Rate")] = 2 * LIMIT
    assert first_consequence(storm, case, limits, LASTING_S) is None


def test_what_was_outside_before_the_onset_does_not_count(case, limits):
    early = recording(case, range(5, 23))
    assert first_consequence(early, case, limits, LASTING_S) is None
    lasting = recording(case, range(5, 40))
    assert first_consequence(lasting, case, limits, LASTING_S) == ONSET_S + LASTING_S - 1


def test_an_excursion_does_not_last_across_a_gap(case, limits):
    broken = recording(case, range(25, 31), gap_at=28)
    assert first_consequence(broken, case, limits, LASTING_S) is None
    after = recording(case, range(25, 40), gap_at=28)
    assert first_consequence(after, case, limits, LASTING_S) == 28 + 10 + LASTING_S - 1


def test_the_limit_itself_is_inside(case, limits):
    calm = recording(case)
    calm.values[25:, case.channel_names.index("Roll Angle")] = LIMIT
    assert first_consequence(calm, case, limits, LASTING_S) is None


def test_a_command_has_no_consequence(case, limits):
    steered = recording(case, range(25, 40), channel="Rudder Angle")
    assert first_consequence(steered, case, limits, LASTING_S) is None


def test_an_undisturbed_recording_has_none(case, limits):
    undisturbed = recording(case, range(25, 40), event=False)
    assert first_consequence(undisturbed, case, limits, LASTING_S) is None
