"""Shortest paths that keep away from walls, smoothed as an elastic band.

Sources: E. W. Dijkstra, "A note on two problems in connexion with graphs", 1959; S. Quinlan and
O. Khatib, "Elastic bands: connecting path planning and control", ICRA 1993.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import connected_components, dijkstra

from odisar.config.robot import PlannerConfig
from odisar.simulators.robot.grid import Array, Grid

#: Half of the sixteen directions to a neighbour (rows, columns); the others are their reverse.
_NEIGHBOURS = ((0, 1), (1, 0), (1, 1), (1, -1), (1, 2), (2, 1), (1, -2), (2, -1))
_NO_NODE = -1
#: How far a point of the band moves towards its neighbours' middle, and away from a wall.
_PULL, _PUSH = 0.5, 0.3
#: Points of the band are pushed where they're closer to a wall than this [m].
_PUSHED_BELOW_M = 0.7


class Planner:
    """Plans over the nodes of a coarse grid that keep ``clearance_m``.

    ``nodes`` (node, 2) are the points [m] that can all be reached from one another;
    ``clearance_m`` (node,) is the clearance there.
    """

    def __init__(self, grid: Grid, config: PlannerConfig) -> None:
        self._grid = grid
        self._config = config
        numbers, nodes = self._lay_nodes()
        graph = self._connect(numbers, nodes)
        _, labels = connected_components(graph, directed=False)
        kept = np.flatnonzero(labels == np.bincount(labels).argmax())
        self._graph = graph[kept][:, kept]
        self.nodes: Array = nodes[kept]
        self.clearance_m: Array = grid.clearance_at(self.nodes[:, 0], self.nodes[:, 1])

    def path(self, start: Array, goal: Array) -> Array:
        """Return a smoothed path (point, 2) [m] between two points that lie near nodes."""
        first, last = self._node_at(start), self._node_at(goal)
        _, before = dijkstra(self._graph, indices=[last], return_predecessors=True)
        corners = [start, self.nodes[first]]
        node = first
        while node != last:
            node = int(before[0, node])
            corners.append(self.nodes[node])
        corners.append(goal)
        return self._smooth(np.asarray(corners))

    def reaches(self, point: Array) -> bool:
        """Return whether a point lies within a cell or so of a node."""
        nearest = self.nodes[self._node_at(point)]
        return float(np.hypot(*(nearest - point))) <= 2.0 * self._config.cell_m

    def _node_at(self, point: Array) -> int:
        return int(np.argmin(((self.nodes - point) ** 2).sum(axis=1)))

    def _lay_nodes(self) -> tuple[NDArray[np.int64], Array]:
        """Return node numbers (row, column) of the coarse grid, and the nodes' points."""
        cell, extent = self._config.cell_m, np.array(self._grid.occupied.shape)
        rows, columns = (int(n * self._grid.resolution_m / cell) for n in extent)
        y, x = np.meshgrid(
            (np.arange(rows) + 0.5) * cell, (np.arange(columns) + 0.5) * cell, indexing="ij"
        )
        allowed = self._grid.clearance_at(x, y) >= self._config.clearance_m
        numbers = np.full((rows, columns), _NO_NODE, dtype=np.int64)
        numbers[allowed] = np.arange(np.count_nonzero(allowed))
        return numbers, np.stack([x[allowed], y[allowed]], axis=1)

    def _connect(self, numbers: NDArray[np.int64], nodes: Array) -> csr_matrix:
        sources, targets = [], []
        for down, right in _NEIGHBOURS:
            here, there = _shifted(numbers, down, right)
            both = (here != _NO_NODE) & (there != _NO_NODE)
            sources.append(here[both])
            targets.append(there[both])
        source, target = np.concatenate(sources), np.concatenate(targets)
        middle = 0.5 * (nodes[source] + nodes[target])
        clearance = self._grid.clearance_at(middle[:, 0], middle[:, 1])
        free = clearance >= self._config.clearance_m
        source, target, clearance = source[free], target[free], clearance[free]
        lengths = np.hypot(*(nodes[target] - nodes[source]).T)
        closeness = np.clip(1.0 - clearance / self._config.comfort_m, 0.0, 1.0)
        costs = lengths * (1.0 + self._config.closeness_cost * closeness**2)
        return csr_matrix(
            (
                np.concatenate([costs, costs]),
                (np.concatenate([source, target]), np.concatenate([target, source])),
            ),
            shape=(len(nodes), len(nodes)),
        )

    def _smooth(self, corners: Array) -> Array:
        band = resampled(corners, self._config.point_m)
        for _ in range(self._config.smoothing_rounds):
            inner = band[1:-1]
            inner = inner + _PULL * (0.5 * (band[:-2] + band[2:]) - inner)
            x, y = inner.T
            lack = np.maximum(_PUSHED_BELOW_M - self._grid.clearance_at(x, y), 0.0)
            away_x, away_y = self._grid.away_at(x, y)
            band[1:-1] = inner + _PUSH * lack[:, None] * np.stack([away_x, away_y], axis=1)
        return resampled(band, self._config.point_m)


def resampled(corners: Array, point_m: float) -> Array:
    """Return points (point, 2) along a line through ``corners``, evenly and about so far apart."""
    along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(corners, axis=0).T))])
    count = max(int(np.ceil(along[-1] / point_m)), 2)
    at = np.linspace(0.0, along[-1], count + 1)
    return np.stack([np.interp(at, along, corners[:, i]) for i in range(2)], axis=1)


def _shifted(
    numbers: NDArray[np.int64], down: int, right: int
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return a grid's cells beside the cells so many rows and columns further."""
    rows, columns = numbers.shape
    here = numbers[: rows - down, max(-right, 0) : columns - max(right, 0)]
    there = numbers[down:, max(right, 0) : columns + min(right, 0)]
    return here, there
