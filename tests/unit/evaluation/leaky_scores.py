"""Scores that leak, each in one way, and one that does not; and how tests probe them."""

import numpy as np

from odisar.evaluation.leakage import probe_leakage
from odisar.windows.scaling import channel_std
from small_system import make_recording

STATES = (1, 2)
RECORDINGS = [
    make_recording("calm", 120),
    make_recording("pushed", 150, push=0.05),
    make_recording("third", 110),
]
STD = channel_std(RECORDINGS)
EXTREME = 20.0


def level(recording):
    """Return a score of what is known at each sample: a mean over three samples."""
    distance = np.abs(recording.values).sum(axis=1)
    return np.convolve(distance, np.ones(3) / 3)[: len(distance)]


def next_values(recording):
    """Return the values one sample ahead; the last sample stands for its own successor."""
    return np.vstack([recording.values[1:], recording.values[-1:]])


def of_each(score):
    """Return the scorer that gives every recording this score."""
    return lambda recordings: [score(recording) for recording in recordings]


honest = of_each(level)


def peeks(recording):
    return level(recording) + np.abs(next_values(recording)).sum(axis=1)


def flinches(recording):
    """Know of the next sample only if it is extreme."""
    return level(recording) + (np.abs(next_values(recording)).max(axis=1) > EXTREME)


def vanishes(recording):
    """Have no score where the next sample is extreme."""
    extreme = np.abs(next_values(recording)).max(axis=1) > EXTREME
    return np.where(extreme, np.nan, level(recording))


def follows_the_plan(recording):
    """Know of the next command, unless the states are extreme as well."""
    command, speed, turn = np.abs(next_values(recording)).T
    return level(recording) + (command > EXTREME) * (np.maximum(speed, turn) < EXTREME)


def standardises(recording):
    return level(recording) / recording.values.std()


def knows_the_length(recording):
    return level(recording) * (1 + 1 / len(recording.time_s))


def reads_labels(recording):
    return level(recording) + bool(recording.intervals)


def reads_the_disturbance(recording):
    return level(recording) + recording.info.is_disturbed


def attends_across(recordings):
    """Add what the recordings of a call have at the same sample, on average over them."""
    common = min(len(recording.time_s) for recording in recordings)
    mean = np.mean([level(recording)[:common] for recording in recordings], axis=0)
    if len(recordings) == 1:
        return honest(recordings)
    return [level(r) + np.append(mean, np.zeros(len(r.time_s) - common)) for r in recordings]


def numbers_them(recordings):
    """Add how many recordings of the call came before."""
    return [level(recording) + i for i, recording in enumerate(recordings)]


def is_constant(recording):
    return np.ones(len(recording.time_s))


def sees_commands_only(recording):
    return 1 + np.abs(recording.values[:, 0])


def probe(score, recordings=RECORDINGS, *, seed=3, **options):
    return probe_leakage(
        "mine", score, recordings, std=STD, seed=seed, **{"states": STATES, **options}
    )
