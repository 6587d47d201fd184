"""Guess a channel's unit from its name."""

import re
from collections.abc import Mapping

_BRACKETS = re.compile(r"[\[(<{]\s*([^\[\](){}<>]{1,12}?)\s*[\])>}]\s*$")

#: Units as they are written in names, and as they are written in ``params.yaml``.
_WRITTEN: Mapping[str, str] = {
    "mps": "m/s", "m_s": "m/s", "ms-1": "m/s", "m/sec": "m/s", "mps2": "m/s2", "m_s2": "m/s2",
    "m/s^2": "m/s2", "m/s²": "m/s2", "mss": "m/s2", "kn": "kn", "kt": "kn", "kts": "kn",
    "knot": "kn", "knots": "kn", "kmh": "km/h", "kph": "km/h", "km_h": "km/h", "mph": "mph",
    "deg": "deg", "degree": "deg", "degrees": "deg", "°": "deg", "grad": "deg", "dps": "deg/s",
    "deg_s": "deg/s", "degps": "deg/s", "degs": "deg/s", "°/s": "deg/s", "deg/sec": "deg/s",
    "rad": "rad", "radian": "rad", "radians": "rad", "radps": "rad/s", "rads": "rad/s",
    "rad_s": "rad/s", "rad/sec": "rad/s", "rpm": "RPM", "1/min": "RPM", "pct": "%",
    "percent": "%", "hz": "Hz", "mm": "mm", "cm": "cm", "km": "km", "meter": "m", "meters": "m",
    "metres": "m", "metre": "m", "nm": "Nm", "kn_force": "kN", "degc": "°C", "celsius": "°C",
    "kelvin": "K", "pa": "Pa", "kpa": "kPa", "hpa": "hPa", "bar": "bar", "mbar": "mbar",
    "kw": "kW", "watt": "W", "watts": "W", "volt": "V", "volts": "V", "mv": "mV", "amp": "A",
    "amps": "A", "ampere": "A", "ma": "mA", "kg": "kg", "newton": "N", "gauss": "G", "ut": "µT",
    "lpm": "l/min", "°c": "°C", "°f": "°F", "%": "%", "prozent": "%", "grad/s": "deg/s",
}  # fmt: skip

# Single letters are units only where an underscore sets them apart: "x_m", "speed_m_s".
_LETTERS: Mapping[str, str] = {"m": "m", "v": "V", "a": "A", "w": "W", "n": "N", "g": "g"}

#: Suffixes that make a letter before them a unit: "_m_s", "_deg_s", "_m_s2", "_rad_s".
_PAIRS = re.compile(r"[_\s.]((?:m|km|deg|rad)_(?:s2|s|h))$", re.IGNORECASE)


# Signs that are units wherever a name ends in them: "Temp °C", "Ventil%".
_SIGNS = re.compile(r"(°C|°F|°/s|°|%)\s*$", re.IGNORECASE)


def unit_of(name: str, below: str = "") -> tuple[str, bool]:
    """Return the unit that a column's name (or the line ``below`` the header) tells, if known.

    The second value says whether it is sure: a unit in brackets is, an ending of the name hardly.
    Without any hint the unit is "1".
    """
    if below:
        return _known(below) or below, True
    bracketed = _BRACKETS.search(name)
    if bracketed and not bracketed[1].isdigit():
        return _known(bracketed[1]) or bracketed[1], True
    pair = _PAIRS.search(name)
    if pair:
        return _known(pair[1]) or "1", True
    return _ending(name)


def _ending(name: str) -> tuple[str, bool]:
    """Return the unit at the end of a name, and whether it is sure to be one."""
    sign = _SIGNS.search(name)
    if sign:
        return _WRITTEN[sign[1].casefold()], True
    parts = re.split(r"[_\s./-]", name.strip())
    last = parts[-1].casefold()
    if len(parts) == 1:
        return ("RPM", True) if last == "rpm" else ("1", False)
    if last in _WRITTEN:
        return _WRITTEN[last], True
    if last in _LETTERS and re.search(r"_[A-Za-z]$", name):
        return _LETTERS[last], last == "m"
    return "1", False


def bare_name(name: str) -> str:
    """Return a name without the unit in brackets at its end."""
    return _BRACKETS.sub("", name).strip() or name


def words(name: str) -> list[str]:
    """Return the words of a name, in small letters: "Position X [m]" has position and x."""
    split = re.sub(r"(?<=[a-z0-9])(?=[A-Z])", " ", bare_name(name))
    return [word for word in re.split(r"[^a-z0-9]+", split.casefold()) if word]


def _known(text: str) -> str | None:
    return _WRITTEN.get(text.strip().casefold())
