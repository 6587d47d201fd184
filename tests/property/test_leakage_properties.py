"""Any filter of the past passes the leakage probes; the same filter moved ahead does not."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from odisar.evaluation.leakage import probe_leakage
from odisar.evaluation.leakage_probes import CONTROL, FUTURE
from small_system import make_recording

RECORDINGS = [make_recording("one", 60), make_recording("two", 45)]
TAPS = st.lists(st.floats(0.1, 2.0), min_size=1, max_size=8)


def filtered(taps, ahead):
    """Return the scorer that weights the last samples, ``ahead`` samples too early."""

    def score(recordings):
        scores = []
        for recording in recordings:
            distance = np.abs(recording.values).sum(axis=1)
            past = np.zeros(len(distance))
            for lag, tap in enumerate(taps[: len(distance)]):
                past[lag:] += tap * distance[: len(distance) - lag]
            scores.append(np.append(past, np.full(ahead, np.nan))[ahead:])
        return scores

    return score


def probe(score, seed):
    return probe_leakage(
        "filter", score, RECORDINGS, std=None, seed=seed, states=(1, 2), positions_per_recording=1
    )


@settings(max_examples=25, deadline=None)
@given(taps=TAPS, seed=st.integers(0, 2**32))
def test_any_filter_of_the_past_passes(taps, seed):
    assert probe(filtered(taps, ahead=0), seed).passed


@settings(max_examples=25, deadline=None)
@given(taps=TAPS, ahead=st.integers(1, 10), seed=st.integers(0, 2**32))
def test_the_same_filter_moved_ahead_is_caught_wherever_it_is_probed(taps, ahead, seed):
    finding = probe(filtered(taps, ahead), seed).finding(FUTURE)
    caught = {c.recording: c.moved for c in finding.comparisons if "all" in c.change}
    assert caught == {"one": True, "two": True}


@settings(max_examples=25, deadline=None)
@given(delay=st.integers(0, 6), allowed=st.integers(0, 6), seed=st.integers(0, 2**32))
def test_a_delay_passes_the_control_if_and_only_if_it_is_allowed(delay, allowed, seed):
    report = probe_leakage(
        "delayed",
        filtered([0.0] * delay + [1.0], ahead=0),
        RECORDINGS,
        std=None,
        seed=seed,
        states=(1, 2),
        control_delay_steps=allowed,
    )
    assert report.finding(CONTROL).passed == (delay <= allowed)
