"""How files of recordings are read: what a CSV file looks like, what to take from a ROS 2 bag."""

from typing import Annotated, Final, Literal, Self

from pydantic import Field, model_validator

from odisar.config.base import Section

#: ``/topic:field.path``; elements of arrays by number, as in ``/joint_states:position[0]``.
FieldPath = Annotated[
    str, Field(pattern=r"^/[\w/]+:[A-Za-z]\w*(\[\d+\])?(\.[A-Za-z]\w*(\[\d+\])?)*$")
]


#: The character between two fields, by the name of the separator.
SEPARATORS: Final = {"comma": ",", "semicolon": ";", "tab": "\t", "bar": "|", "space": " "}


class CsvFormat(Section):
    """Separator of fields and decimal sign of a case's CSV files.

    ``space`` is any run of spaces and tabs.
    The tables ``recordings.csv`` and ``labels.csv`` are always written with commas and points.
    """

    separator: Literal["comma", "semicolon", "tab", "bar", "space"]
    decimal: Literal["point", "comma"]

    @model_validator(mode="after")
    def _check(self) -> Self:
        if self.separator == "comma" and self.decimal == "comma":
            raise ValueError("separator and decimal can't both be a comma")
        return self

    @property
    def separator_sign(self) -> str:
        """The character between two fields."""
        return SEPARATORS[self.separator]

    @property
    def decimal_sign(self) -> str:
        """The character between whole and fraction."""
        return "." if self.decimal == "point" else ","


class BagFormat(Section):
    """What a ROS 2 bag holds for the channels of a case.

    A message of ``stamp_topic`` makes a sample; its time is that of the message's header
    (``stamp: header``) or of its arrival (``received``). ``fields`` says, by channel, which field
    of which topic's messages is its value. A channel of another topic takes the last value at or
    before the sample, no older than ``max_age_s``.

    With ``stamp: header`` "before" goes by the stamps: a sample takes a value that was measured
    before it, which a live monitor may get only later. Use ``received`` for samples of what had
    arrived by then.
    """

    stamp_topic: Annotated[str, Field(pattern=r"^/[\w/]+$")]
    stamp: Literal["header", "received"]
    max_age_s: Annotated[float, Field(gt=0)]
    fields: dict[str, FieldPath]
