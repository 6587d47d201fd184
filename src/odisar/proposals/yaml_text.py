"""Write parameters as a person would: flow mappings on a line, a remark behind what is doubtful."""

import json
import re

_PLAIN = re.compile(r"[A-Za-z_°µ/][\w ./°%µ²()-]*")
_RESERVED = frozenset({"true", "false", "null", "yes", "no", "on", "off", "y", "n", "~"})
_REMARK_AT = 28


def scalar(value: object) -> str:
    """Return a value as YAML: text quoted where it must be, numbers so that 1.2 and 1.1 agree."""
    if value is None:
        return "null"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int):
        return str(value)
    if isinstance(value, float):
        return _number(value)
    text = str(value)
    is_plain = _PLAIN.fullmatch(text) and text.casefold() not in _RESERVED
    return text if is_plain and text == text.strip() else json.dumps(text, ensure_ascii=False)


def _number(value: float) -> str:
    text = f"{value:.10g}"
    if "e" in text:
        mantissa, _, exponent = text.partition("e")
        return f"{mantissa if '.' in mantissa else mantissa + '.0'}e{exponent}"
    return text if "." in text else f"{text}.0"


def limit(value: float) -> str:
    """Return a limit; whole numbers without a fraction, as limits are written in the file."""
    return str(int(value)) if value == int(value) and abs(value) < 1e9 else _number(value)


def flow(**items: object) -> str:
    """Return a mapping on one line."""
    return "{" + ", ".join(f"{key}: {_flow_value(value)}" for key, value in items.items()) + "}"


def _flow_value(value: object) -> str:
    if isinstance(value, dict):
        return flow(**value)
    if isinstance(value, list | tuple):
        return "[" + ", ".join(_flow_value(item) for item in value) + "]"
    return scalar(value)


def line(indent: int, text: str, *doubts: str, note: str = "") -> str:
    """Return a line of the file; a ``note`` stands behind it, or ``doubts`` as ``# ? ...``."""
    body = " " * indent + text
    told = "; ".join(doubt for doubt in doubts if doubt)
    if not told and not note:
        return body
    return f"{body.ljust(_REMARK_AT)}  # {_one_line(f'? {told}' if told else note)}"


def _one_line(text: str) -> str:
    return "".join(sign if sign.isprintable() else "?" for sign in text)
