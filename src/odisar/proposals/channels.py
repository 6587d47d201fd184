"""Guess what a column is to the twin: state or command, forecast or not, and its limits."""

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import replace

from odisar.proposals.bag_fields import Field
from odisar.proposals.columns import Column
from odisar.proposals.guesses import Guess, align_siblings, stem_of
from odisar.proposals.units import unit_of, words

MAX_CHANNELS = 16
_MAX_OUTPUTS = 8
_HELD = 0.9

_COMMAND_WORDS = frozenset({
    "cmd", "command", "commands", "commanded", "setpoint", "sp", "setpt", "reference", "ref",
    "desired", "target", "demand", "demanded", "order", "ordered", "rudder", "throttle", "azimuth",
    "steer", "steering", "thrust", "pwm", "duty", "ctrl", "control", "joy", "joystick", "brake",
    "pedal", "aileron", "elevator", "flap", "valve", "rpm", "propeller", "thruster", "voltage",
    "helm", "sollwert", "soll", "motor", "servo", "esc", "ventil",
})  # fmt: skip
_SURE_COMMANDS = frozenset({"cmd", "command", "commanded", "setpoint", "desired", "ordered",
                            "soll", "sollwert"})  # fmt: skip
_COMPOUND = re.compile(r"^(soll|setpoint|ventil)|(soll|setpoint|ventil)$")
_SEEN = frozenset({"measured", "meas", "actual", "feedback", "fb", "ist", "istwert"})
_MEASURED = _SEEN | {"battery", "state", "temperature", "temp", "soc", "fuel", "pressure",
                     "status"}  # fmt: skip
# A motor's own name is its command; a quantity of it is measured.
_OF_A_MOTOR = frozenset({"current", "speed", "velocity", "torque", "power", "vibration", "load",
                         "position", "angle", "strom", "drehzahl", "drehmoment"})  # fmt: skip
_ONE_SIDED = frozenset({
    "rpm", "pressure", "depth", "range", "distance", "soc", "battery", "fuel", "level", "current",
    "voltage", "power", "flow", "humidity", "throttle", "temperature", "altitude", "count",
    "percent", "pct", "pwm", "duty", "druck", "durchfluss", "spannung", "drehzahl",
})  # fmt: skip
_ONE_SIDED_UNITS = frozenset({"%", "RPM", "bar", "mbar", "Pa", "kPa", "hPa", "l/min", "V", "mV",
                              "K", "Hz", "kg"})  # fmt: skip
_HEADINGS = frozenset({"yaw", "heading", "hdg", "course", "cog", "psi", "theta"})
_CHANGES = frozenset({"rate", "speed", "velocity", "vel", "acc", "acceleration", "error", "err"})

# Directions that reach the border where an angle starts anew: from, to, within, unit.
_TURNS = (
    (-160.0, 160.0, 180.5, "deg"), (0.0, 330.0, 360.5, "deg"),
    (-2.8, 2.8, 3.16, "rad"), (0.0, 5.8, 6.3, "rad"),
)  # fmt: skip
_QUATERNION = re.compile(
    r"(^|[_\s.])(q[xyzw]|(orientation|quat(ernion)?|rotation)[_\s.]*[xyzw])\W*$", re.IGNORECASE
)

# Greatest angles by unit: directions (whichever way they count), tilts, places on the globe.
_ANGLES: tuple[tuple[frozenset[str], Mapping[str, float]], ...] = (
    (
        frozenset({"yaw", "heading", "theta", "psi", "course", "cog", "hdg", "azimuth"}),
        {"rad": 6.3, "deg": 360.0},
    ),
    (frozenset({"roll", "pitch", "heel", "trim", "phi"}), {"rad": 1.6, "deg": 90.0}),
    (frozenset({"lat", "latitude"}), {"deg": 90.0, "1": 90.0}),
    (frozenset({"lon", "long", "longitude"}), {"deg": 180.0, "1": 180.0}),
)


def guess_channels(
    columns: Sequence[Column], units: Mapping[str, str], fields: Sequence[Field] = ()
) -> list[Guess]:
    """Return a guess for each column; ``units`` are those that stand below the header.

    ``fields`` are those of a bag's messages, by channel, where there is a bag.
    """
    by_channel = {field.channel: field for field in fields}
    guesses = [
        _guess(item, units.get(item.name, ""), by_channel.get(item.name)) for item in columns
    ]
    guesses = align_siblings(guesses)
    if not any(guess.output for guess in guesses):  # better a doubtful forecast than none
        guesses = [replace(guess, output=guess.role == "state") for guess in guesses]
    if guesses and not any(guess.output for guess in guesses):
        busiest = min(range(len(columns)), key=lambda i: columns[i].held)
        doubt = "state, because something must be forecast"
        guesses[busiest] = replace(guesses[busiest], role="state", output=True, doubts=(doubt,))
    return _cap_outputs(guesses)


def pick_columns(columns: Sequence[Column]) -> tuple[list[Column], list[str]]:
    """Return the columns that become channels, and the names of those that are too many.

    Those that hold still for longest are left out first; the order stays.
    """
    if len(columns) <= MAX_CHANNELS:
        return list(columns), []
    lively = sorted(columns, key=lambda column: round(column.held, 1))[:MAX_CHANNELS]
    kept = {column.name for column in lively}
    return (
        [column for column in columns if column.name in kept],
        [column.name for column in columns if column.name not in kept],
    )


def _guess(column: Column, below: str, field: Field | None) -> Guess:
    doubts: list[str] = []
    unit, sure = (field.unit, True) if field and field.unit else unit_of(column.name, below)
    if unit == "1" and not sure and _QUATERNION.search(column.name):
        sure = True
    turn = "" if sure else _turn_unit(column)
    if turn:
        unit = turn
        doubts.append("unit guessed from the range")
    elif not sure:
        doubts.append("unit unknown" if unit == "1" else "unit guessed")
    role, why = _role(column, field)
    if why:
        doubts.append(f"{role}: {why}")
    output = role == "state"
    why_not = _no_forecast(column, unit) if output else ""
    if why_not:
        output = False
        doubts.append(f"not forecast: {why_not}")
    if column.sentinels:
        shown = ", ".join(f"{value:g}" for value in column.sentinels)
        doubts.append(f"holds {shown}: nothing measured?")
    low, high, known = _limits(column, unit)
    if not known:  # the last of the doubts: it is about the end of the line
        doubts.append(f"limits: seen {column.low:.4g} to {column.high:.4g}")
    return Guess(column.name, unit, role, output, low, high, tuple(doubts))


def _role(column: Column, field: Field | None) -> tuple[str, str]:
    """Return state or command, and why that is no more than a guess; empty if it is sure."""
    if field is not None:
        return ("command", "its topic's name") if field.is_command else ("state", "")
    parts = _parts(column.name)
    if parts & _SURE_COMMANDS and not parts & _SEEN:
        return "command", ""
    if _is_command_word(parts) and not parts & _MEASURED:
        return "command", "its name"
    if column.held > _HELD and not parts & _MEASURED:
        return "command", f"held still in {100 * column.held:.0f} % of the steps"
    return "state", ""


def _parts(name: str) -> set[str]:
    """Return the words of a name, also without numbers at their ends: "motor1" has motor."""
    parts = words(name)
    return {*parts, *(part.rstrip("0123456789") for part in parts)} - {""}


def _is_command_word(parts: set[str]) -> bool:
    if any(_COMPOUND.search(part) for part in parts):
        return True
    found = parts & _COMMAND_WORDS
    return bool(found - {"motor"}) or ("motor" in found and not parts & _OF_A_MOTOR)


def _turn_unit(column: Column) -> str:
    """Return the unit of a direction that is seen to go all around; empty where it isn't."""
    parts = _parts(column.name)
    if not parts & _HEADINGS or parts & _CHANGES:
        return ""
    for low, high, most, unit in _TURNS:
        least = low <= column.low if low == 0 else -most <= column.low <= low
        if least and high <= column.high <= most:
            return unit
    return ""


def _no_forecast(column: Column, unit: str) -> str:
    """Say why a state isn't forecast; empty if it is."""
    if column.wraps:
        return "an angle that jumps at its border"
    if _QUATERNION.search(column.name) and unit in ("1", ""):
        return "part of a quaternion"
    if column.held > _HELD:
        return f"held still in {100 * column.held:.0f} % of the steps"
    if column.rises:
        return "it only rises or only falls"
    if column.levels < 5:
        return f"only {column.levels} different values"
    return ""


def _cap_outputs(guesses: list[Guess]) -> list[Guess]:
    """Return the guesses with no more than so many forecasts, the first ones."""
    forecast = [guess.name for guess in guesses if guess.output]
    kept: list[str] = []
    for stem in dict.fromkeys(map(stem_of, forecast)):  # siblings stay together
        group = [name for name in forecast if stem_of(name) == stem]
        if not kept or len(kept) + len(group) <= _MAX_OUTPUTS:
            kept += group[:_MAX_OUTPUTS]
    surplus = set(forecast) - set(kept)
    doubt = f"not forecast: {len(kept)} others are"
    return [
        replace(guess, output=False, doubts=(doubt, *guess.doubts))
        if guess.name in surplus
        else guess
        for guess in guesses
    ]


def _limits(column: Column, unit: str) -> tuple[float, float, bool]:
    """Return physical limits, and whether they are those of the quantity, not of what was seen."""
    usual = _usual_limits(column, unit)
    if usual and usual[0] <= column.low and column.high <= usual[1]:
        return *usual, True
    most = _outward(2 * max(abs(column.low), abs(column.high), 1e-9))
    is_amount = unit in _ONE_SIDED_UNITS or bool(_parts(column.name) & _ONE_SIDED)
    return (0.0 if is_amount and column.low >= 0 else -most), most, False


def _usual_limits(column: Column, unit: str) -> tuple[float, float] | None:
    """Return the limits of a quantity that its name tells, whatever was seen."""
    parts = set(words(column.name))
    if _QUATERNION.search(column.name) and max(abs(column.low), abs(column.high)) < 1.001:
        return -1.001, 1.001
    if unit == "%" and column.low >= 0:
        return 0.0, 100.0
    for named, limits in _ANGLES:
        if parts & named and unit in limits:
            return -limits[unit], limits[unit]
    return None


def heading_limit(unit: str) -> float:
    """Return the greatest angle of a heading in rad or deg: a full turn, whichever way."""
    return 6.3 if unit.casefold().startswith("rad") else 360.0


def _outward(value: float) -> float:
    """Return the next number above a positive one with two digits, the second of them 0 or 5."""
    step = 10.0 ** (math.floor(math.log10(value)) - 1) * 5
    return float(f"{math.ceil(value / step) * step:.6g}")
