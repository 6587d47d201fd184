"""Recordings of someone with other habits, and the commands that look at them."""

import numpy as np
import pandas as pd

from odisar.cli import main


def rover(seed, samples=700, rate_hz=4.0):
    """A rover that turns as it is steered, logged by someone with other habits."""
    random = np.random.default_rng(seed)
    command = np.repeat(random.uniform(-30, 30, samples // 24 + 1), 24)[:samples]
    turn = np.convolve(command, np.exp(-np.arange(20) / 4) / 4)[:samples]
    return pd.DataFrame(
        {
            "Nr": np.arange(samples),
            "Zeit [s]": np.arange(samples) / rate_hz,
            "Lenkwinkel Soll [°]": command,
            "v [m/s]": 1.5 - abs(turn) / 80 + 0.02 * random.normal(size=samples),
            "yaw rate [deg/s]": turn + 0.5 * random.normal(size=samples),
            "mode": "AUTO",
        }
    )


def write_rovers(folder, files=12, **options):
    for seed in range(files):
        rover(seed).to_csv(
            folder / f"Fahrt {seed}.csv", sep=";", decimal=",", index=False, **options
        )


def run(*arguments):
    return main([str(argument) for argument in arguments])
