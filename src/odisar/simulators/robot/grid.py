"""An occupancy grid and how far each of its cells is from what's in the way."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Grid:
    """``occupied`` (row, column) from the map's lower left corner; rows go with y.

    Everything outside of the map is taken for its border, which a map should have walled.
    """

    occupied: NDArray[np.bool_]
    resolution_m: float

    @cached_property
    def clearance_m(self) -> Array:
        """Distance (row, column) from a cell's centre to the face of the nearest occupied cell."""
        distance = distance_transform_edt(~self.occupied) * self.resolution_m
        return np.asarray(distance - 0.5 * self.resolution_m, dtype=np.float64)

    @cached_property
    def _uphill(self) -> tuple[Array, Array]:
        rows, columns = np.gradient(self.clearance_m, self.resolution_m)
        return np.asarray(columns), np.asarray(rows)

    def clearance_at(self, x: Array, y: Array) -> Array:
        """Return the clearance [m] at points [m] of any shape, of the cell that they lie in."""
        return np.asarray(self.clearance_m[self._cells(x, y)])

    def away_at(self, x: Array, y: Array) -> tuple[Array, Array]:
        """Return the gradient of the clearance along x and y at points: away from what's near."""
        cells = self._cells(x, y)
        along_x, along_y = self._uphill
        return np.asarray(along_x[cells]), np.asarray(along_y[cells])

    def is_occupied(self, x: Array, y: Array) -> NDArray[np.bool_]:
        """Return whether points [m] lie in occupied cells."""
        return np.asarray(self.occupied[self._cells(x, y)])

    def with_box(self, centre: Array, heading: float, half_sides: tuple[float, float]) -> "Grid":
        """Return a copy with a box in it: half its length along ``heading``, half across it."""
        rows, columns = np.indices(self.occupied.shape)
        x = (columns + 0.5) * self.resolution_m - centre[0]
        y = (rows + 0.5) * self.resolution_m - centre[1]
        cos, sin = np.cos(heading), np.sin(heading)
        inside = (np.abs(x * cos + y * sin) <= half_sides[0]) & (
            np.abs(y * cos - x * sin) <= half_sides[1]
        )
        return Grid(self.occupied | inside, self.resolution_m)

    def _cells(self, x: Array, y: Array) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        rows, columns = self.occupied.shape
        row = np.clip((y / self.resolution_m).astype(np.intp), 0, rows - 1)
        column = np.clip((x / self.resolution_m).astype(np.intp), 0, columns - 1)
        return row, column
