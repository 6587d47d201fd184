"""A channel as it is guessed, and what numbered siblings have in common."""

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace


@dataclass(frozen=True)
class Guess:
    """A channel as it is proposed, and what its user must check."""

    name: str
    unit: str
    role: str
    output: bool
    low: float
    high: float
    doubts: tuple[str, ...]


def stem_of(name: str) -> str:
    """Return what numbered siblings share: "motor_1" and "motor_2" have "motor_#"."""
    return re.sub(r"\d+", "#", name)


def align_siblings(guesses: Sequence[Guess]) -> list[Guess]:
    """Return guesses in which motor_1 to motor_4 have the role and output of most of them."""
    groups: dict[str, list[Guess]] = {}
    for guess in guesses:
        groups.setdefault(stem_of(guess.name), []).append(guess)
    models = {
        stem: _usual(group) for stem, group in groups.items() if "#" in stem and len(group) > 1
    }
    return [_like(guess, models.get(stem_of(guess.name), guess)) for guess in guesses]


def _usual(group: Sequence[Guess]) -> Guess:
    """Return the first of a group that is what most of them are."""
    role, output = Counter((guess.role, guess.output) for guess in group).most_common(1)[0][0]
    return next(guess for guess in group if (guess.role, guess.output) == (role, output))


def _like(guess: Guess, model: Guess) -> Guess:
    if (guess.role, guess.output) == (model.role, model.output):
        return guess
    kept = (doubt for doubt in guess.doubts if not doubt.startswith(("command:", "not forecast:")))
    what = "forecast" if model.output else model.role
    doubts = (f"{what} like {model.name}", *kept)
    return replace(guess, role=model.role, output=model.output, doubts=doubts)
