"""Find a planar pose among channels by their names: x, y and a heading."""

import re
from collections.abc import Sequence
from dataclasses import dataclass

from odisar.proposals.columns import Column
from odisar.proposals.guesses import Guess
from odisar.proposals.units import words

_PLACE_WORDS = frozenset({"position", "pos", "pose", "odom", "odometry", "loc", "location", "robot",
                          "base", "p", "global", "map", "true", "gt", "est"})  # fmt: skip
_HEADING_WORDS = frozenset({"yaw", "heading", "theta", "psi", "hdg"})
_QUATERNION = re.compile(r"(^|_)(q|orientation_?|quat_?|quaternion_?|rotation_?)([zw])$")
_UNIT_WORDS = frozenset({"m", "mm", "rad", "deg", "cm"})
_FULL_TURN_RAD = 6.4


@dataclass(frozen=True)
class PoseGuess:
    """Channels of a pose; ``heading_unit`` replaces that of an angle whose unit is unknown."""

    x: str
    y: str
    heading: tuple[str, ...]
    heading_unit: str | None
    doubts: tuple[str, ...]

    @property
    def channels(self) -> tuple[str, ...]:
        """Names of all channels of the pose."""
        return (self.x, self.y, *self.heading)


def guess_pose(guesses: Sequence[Guess], columns: Sequence[Column]) -> PoseGuess | None:
    """Return a pose if x, y and a heading can be told by their names."""
    states = [guess for guess in guesses if guess.role == "state"]
    x, y = _named_place(states, "x", "easting"), _named_place(states, "y", "northing")
    if x is None or y is None:
        return None
    quaternion = {_quaternion_part(guess.name): guess.name for guess in states}
    if "z" in quaternion and "w" in quaternion:
        return PoseGuess(x, y, (quaternion["z"], quaternion["w"]), None, ())
    heading = next((item for item in states if _is_heading(item.name)), None)
    if heading is None:
        return None
    by_name = {column.name: column for column in columns}
    unit = heading.unit.casefold()
    doubts = ["a heading counts counter-clockwise from x; a compass heading doesn't"]
    if unit.startswith(("rad", "deg", "°")):
        return PoseGuess(x, y, (heading.name,), None, tuple(doubts))
    column = by_name[heading.name]
    in_rad = max(abs(column.low), abs(column.high)) <= _FULL_TURN_RAD
    return PoseGuess(x, y, (heading.name,), "rad" if in_rad else "deg", tuple(doubts))


def _plain_words(name: str) -> list[str]:
    return [word for word in words(name) if word not in _UNIT_WORDS]


def _named_place(states: Sequence[Guess], axis: str, other: str) -> str | None:
    """Return the state that is a coordinate of a place, not of a velocity or an acceleration."""
    for guess in states:
        parts = _plain_words(guess.name)
        if parts in ([axis], [other], [f"pos{axis}"], [f"p{axis}"]):
            return guess.name
        if len(parts) > 1 and parts[-1] == axis and set(parts[:-1]) <= _PLACE_WORDS:
            return guess.name
    return None


def _quaternion_part(name: str) -> str | None:
    found = _QUATERNION.search("_".join(_plain_words(name)))
    return found[3] if found else None


def _is_heading(name: str) -> bool:
    parts = _plain_words(name)
    return bool(parts) and parts[-1] in _HEADING_WORDS and set(parts[:-1]) <= _PLACE_WORDS
