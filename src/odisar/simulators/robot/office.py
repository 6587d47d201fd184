"""The office: two long corridors, cross corridors, rooms with doors, and furniture."""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from odisar.config.ranges import Range
from odisar.config.robot import FurnitureConfig, OfficeConfig
from odisar.seeding import generator
from odisar.simulators.robot.grid import Array, Grid

_PIECE_TRIES = 30


@dataclass(frozen=True)
class _Box:
    """A rectangle [m] along the axes."""

    left: float
    bottom: float
    right: float
    top: float

    def distance_to(self, x: float, y: float) -> float:
        return float(
            np.hypot(
                max(self.left - x, x - self.right, 0.0), max(self.bottom - y, y - self.top, 0.0)
            )
        )

    def gap_to(self, other: "_Box") -> float:
        return float(
            np.hypot(
                max(self.left - other.right, other.left - self.right, 0.0),
                max(self.bottom - other.top, other.bottom - self.top, 0.0),
            )
        )


def build_office(config: OfficeConfig, base_seed: int) -> Grid:
    """Return the office's map. The same configuration and seed give the same office."""
    return _Builder(config, generator(base_seed, "simulators", "robot", "office")).build()


def draw(stream: np.random.Generator, limits: Range) -> float:
    """Return a number drawn evenly between two."""
    return limits.low + (limits.high - limits.low) * float(stream.random())


class _Builder:
    """Draws walls first, then opens doors, then furnishes."""

    def __init__(self, config: OfficeConfig, stream: np.random.Generator) -> None:
        self._config = config
        self._stream = stream
        shape = (
            round(config.height_m / config.resolution_m),
            round(config.width_m / config.resolution_m),
        )
        self._occupied = np.zeros(shape, dtype=np.bool_)
        self._doors: list[tuple[float, float]] = []
        self._rooms: list[_Box] = []

    def build(self) -> Grid:
        config = self._config
        width, height, wall = config.width_m, config.height_m, config.wall_m
        for left, bottom, right, top in (
            (0.0, 0.0, width, wall),
            (0.0, height - wall, width, height),
            (0.0, 0.0, wall, height),
            (width - wall, 0.0, width, height),
        ):
            self._fill(_Box(left, bottom, right, top), free=False)
        low, high = config.side_room_depth_m, height - config.side_room_depth_m
        inner_low, inner_high = low + config.corridor_m, high - config.corridor_m
        self._row_of_rooms(0.0, width, (wall, low), (low,))
        self._row_of_rooms(0.0, width, (high, height - wall), (high,))
        for left, right in self._blocks():
            self._row_of_rooms(
                left, right, (inner_low, inner_high), (inner_low, inner_high), closed=True
            )
        for room in self._rooms:
            self._furnish(room)
        return Grid(self._occupied, config.resolution_m)

    def _blocks(self) -> Iterator[tuple[float, float]]:
        """Yield where the blocks of rooms between the cross corridors begin and end."""
        config = self._config
        count = config.cross_corridors + 1
        length = (config.width_m - config.cross_corridors * config.corridor_m) / count
        for i in range(count):
            left = i * (length + config.corridor_m)
            yield left, left + length

    def _row_of_rooms(
        self,
        left: float,
        right: float,
        depth: tuple[float, float],
        door_walls: tuple[float, ...],
        *,
        closed: bool = False,
    ) -> None:
        """Build rooms side by side over ``depth`` (y), with doors in walls at ``door_walls``."""
        wall = self._config.wall_m
        for y in door_walls:
            self._fill(_Box(left, y - 0.5 * wall, right, y + 0.5 * wall), free=False)
        borders = self._borders(left, right)
        for x in borders if closed else borders[1:-1]:
            self._fill(_Box(x - 0.5 * wall, depth[0], x + 0.5 * wall, depth[1]), free=False)
        for first, last in pairwise(borders.tolist()):
            self._rooms.append(_Box(first + wall, depth[0] + wall, last - wall, depth[1] - wall))
            for y in door_walls:
                self._door_along_x(first, last, y)
        for x in borders[1:-1]:
            if self._stream.random() < self._config.inner_door_share:
                self._door_along_y(x, *depth)

    def _borders(self, left: float, right: float) -> Array:
        widths = self._config.room_width_m
        length = right - left
        fewest = int(np.ceil(length / widths.high))
        most = max(int(length / widths.low), fewest)
        count = int(self._stream.integers(fewest, most + 1))
        shares = 1.0 + 0.2 * (2.0 * self._stream.random(count) - 1.0)
        return np.asarray(left + length * np.concatenate([[0.0], np.cumsum(shares) / shares.sum()]))

    def _door_along_x(self, left: float, right: float, y: float) -> None:
        width, wall = draw(self._stream, self._config.door_m), self._config.wall_m
        x = self._door_place(left, right, width)
        self._fill(_Box(x - 0.5 * width, y - wall, x + 0.5 * width, y + wall), free=True)
        self._doors.append((x, y))

    def _door_along_y(self, x: float, bottom: float, top: float) -> None:
        width, wall = draw(self._stream, self._config.door_m), self._config.wall_m
        y = self._door_place(bottom, top, width)
        self._fill(_Box(x - wall, y - 0.5 * width, x + wall, y + 0.5 * width), free=True)
        self._doors.append((x, y))

    def _door_place(self, low: float, high: float, width: float) -> float:
        margin = 0.5 * width + 2.0 * self._config.wall_m + 0.2
        return draw(self._stream, Range(low=low + margin, high=high - margin))

    def _furnish(self, room: _Box) -> None:
        furniture = self._config.furniture
        pieces: list[_Box] = []
        for _ in range(round(draw(self._stream, furniture.per_room))):
            for _ in range(_PIECE_TRIES):
                piece = self._draw_piece(room, furniture)
                if self._fits(piece, pieces, furniture):
                    pieces.append(piece)
                    self._fill(piece, free=False)
                    break

    def _draw_piece(self, room: _Box, furniture: FurnitureConfig) -> _Box:
        """Draw a piece that touches a wall (three of four) or stands in the room."""
        stream = self._stream
        long, deep = draw(stream, furniture.length_m), draw(stream, furniture.depth_m)
        side, along, across = int(stream.integers(4)), stream.random(), stream.random()
        wide, tall = (deep, long) if side == 1 else (long, deep)
        x = room.left + along * (room.right - room.left - wide)
        y = room.bottom + across * (room.top - room.bottom - tall)
        if side == 0:
            y = room.bottom - 0.5 * self._config.wall_m
        elif side == 1:
            x = room.left - 0.5 * self._config.wall_m
        elif side == 2:
            y = room.top - tall + 0.5 * self._config.wall_m
        else:
            gap = furniture.gap_m
            x = min(max(x, room.left + gap), room.right - wide - gap)
            y = min(max(y, room.bottom + gap), room.top - tall - gap)
        return _Box(x, y, x + wide, y + tall)

    def _fits(self, piece: _Box, pieces: list[_Box], furniture: FurnitureConfig) -> bool:
        return all(piece.distance_to(x, y) >= furniture.door_gap_m for x, y in self._doors) and all(
            piece.gap_to(other) >= furniture.gap_m for other in pieces
        )

    def _fill(self, box: _Box, *, free: bool) -> None:
        scale = 1.0 / self._config.resolution_m
        rows = slice(max(round(box.bottom * scale), 0), max(round(box.top * scale), 0))
        columns = slice(max(round(box.left * scale), 0), max(round(box.right * scale), 0))
        self._occupied[rows, columns] = not free
