"""Compiled kernels of line of sight to many reflectors: shadow maps, and which points each reflector is seen from.

A shadow map answers most pairs by one comparison and says itself which pairs it cannot answer; those are cast as rays.
So the answer is that of the ray for every pair. What is a reflector, a scanner or a lattice is defined elsewhere.

Why a wedge of a shadow map can be trusted, with c the center and e, e' the free ranges along its two edges:

- Bins are narrower than a cell at any range in use, so an occupied cell cannot hide between the edges: one that meets
  the wedge meets an edge, at most a cell's diagonal farther out. Up to min(e, e') minus a diagonal all is free. Only a
  cell that meets the edge underneath the reflector's own disc escapes; bins with such cells are marked in advance.
- Where the two cells that stop the edges are linked by a chain of occupied cells that share sides, every ray between
  the edges crosses the chain. Beyond the chain all is hidden.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from commission.compiled import compiled
from commission.geometry.arrays import BoolArray, FloatArray, IntArray
from commission.geometry.ray_kernels import RayTables, cast_ray

# Ranges of a shadow map are rounded to float32 (7 digits: 0.01 mm at 100 m); this much is left to the exact test.
ROUNDING = 1e-4
# Directions this close to the edge of a bin, in bins, go to the exact test, since rounding may pick the wrong bin.
EDGE = 1e-6
# Cells of a chain that is followed to link two hits; a wall seen at a grazing angle needs a few dozen.
LONGEST_CHAIN = 64

BitMask = NDArray[np.uint64]
"""(N, ceil(M / 64)): bit m of row n says that point n sees reflector m."""


class Targets(NamedTuple):
    """Reflectors as the kernels see them; M reflectors, K bins of direction."""

    centers: FloatArray
    """(M, 2) [m], map frame."""
    radii: FloatArray
    """(M,) a ray that comes this close to the center has arrived [m]."""
    normals: FloatArray
    """(M, 2) direction a plate faces; 0, 0 for a cylinder."""
    nearest: FloatArray
    """(M,) smallest distance from scanner to center [m]."""
    farthest: FloatArray
    """(M,) largest distance from scanner to center [m]."""
    promised: FloatArray
    """(M,) distance up to which a plate that is faced squarely gets enough beams [m]; unused for cylinders."""
    cosine_limit: float
    """Cosine of the largest angle of incidence on a plate."""
    clear: NDArray[np.float32]
    """(M, K) squared distance up to which the whole bin is free [m^2]."""
    hidden: NDArray[np.float32]
    """(M, K) squared distance from which the whole bin is in shadow [m^2]."""


@compiled
def direction_bin(dx: float, dy: float, bins: int) -> float:
    """Direction as a real number in [0, bins): its diamond angle, monotonic in the angle and without an arctangent."""
    t = dy / (abs(dx) + abs(dy))
    if dx < 0.0:
        t = 2.0 - t
    elif dy < 0.0:
        t += 4.0
    return min(t * (0.25 * bins), bins * (1.0 - 1e-16))


@compiled
def bin_edge(index: int, bins: int) -> tuple[float, float]:
    """Unit vector along the lower edge of a bin."""
    quarter = bins // 4
    side, t = (index // quarter) % 4, (index % quarter) / quarter
    x, y = 1.0 - t, t
    if side == 1:
        x, y = -y, x
    elif side == 2:
        x, y = -x, -y
    elif side == 3:
        x, y = y, -x
    scale = 1.0 / math.sqrt(x * x + y * y)
    return x * scale, y * scale


@compiled
def is_occupied(tables: RayTables, row: int, column: int) -> bool:
    """Whether a cell stops rays; cells outside the grid do not."""
    if row < 0 or row >= tables.rows or column < 0 or column >= tables.columns:
        return False
    tile = (row >> 3) * tables.tile_columns + (column >> 3)
    return tables.squares[(tile << 6) + ((row & 7) << 3) + (column & 7)] == 0


@compiled
def chain_reach(  # noqa: PLR0917 - two cells and a point, number by number
    tables: RayTables, x: float, y: float, row: int, column: int, last_row: int, last_column: int
) -> float:
    """Largest distance [cells] from (x, y) of a chain of occupied cells between two occupied ones; inf without one."""
    down, up = min(row, last_row), max(row, last_row) + 1
    left, right = min(column, last_column), max(column, last_column) + 1
    # A chain around the center could link the hits the wrong way round.
    if (left <= x <= right and down <= y <= up) or (up - down) + (right - left) > LONGEST_CHAIN:
        return math.inf
    reach = 0.0
    while True:
        reach = max(reach, math.hypot(column + 0.5 - x, row + 0.5 - y))
        if row == last_row and column == last_column:
            return reach + math.sqrt(0.5)
        next_row = row + (1 if last_row > row else -1)
        next_column = column + (1 if last_column > column else -1)
        if row != last_row and is_occupied(tables, next_row, column):
            row = next_row
        elif column != last_column and is_occupied(tables, row, next_column):
            column = next_column
        else:
            return math.inf


@compiled
def mark_cells_under(tables: RayTables, x: float, y: float, radius: float, unclear: BoolArray) -> None:
    """Mark the bins in which an occupied cell lies across the rim of the disc around (x, y) [m, map frame]."""
    bins = len(unclear)
    c, s, cell = tables.origin_cos, tables.origin_sin, tables.resolution
    gx = (c * (x - tables.origin_x) + s * (y - tables.origin_y)) / cell
    gy = (c * (y - tables.origin_y) - s * (x - tables.origin_x)) / cell
    rim = radius / cell
    for row in range(math.floor(gy - rim) - 1, math.floor(gy + rim) + 2):
        for column in range(math.floor(gx - rim) - 1, math.floor(gx + rim) + 2):
            if not is_occupied(tables, row, column):
                continue
            closest = math.hypot(max(column - gx, 0.0, gx - column - 1), max(row - gy, 0.0, gy - row - 1))
            farthest = math.hypot(max(gx - column, column + 1 - gx), max(gy - row, row + 1 - gy))
            if closest > rim + 1e-6 or farthest < rim - 1e-6:
                continue
            contains = column < gx < column + 1 and row < gy < row + 1
            middle = math.atan2(row + 0.5 - gy, column + 0.5 - gx)
            low, high = 0.0, 0.0
            for corner in range(4):
                corner_x, corner_y = column + (corner & 1) - gx, row + (corner >> 1) - gy
                if contains:
                    # Its sides are met by the edges themselves; only a corner can stick out between two of them.
                    at = int(direction_bin(c * corner_x - s * corner_y, s * corner_x + c * corner_y, bins))
                    for k in range(at - 1, at + 2):
                        unclear[k % bins] = True
                elif corner_x != 0.0 or corner_y != 0.0:
                    turn = math.atan2(corner_y, corner_x) - middle
                    turn -= 2.0 * math.pi * math.floor((turn + math.pi) / (2.0 * math.pi))
                    low, high = min(low, turn), max(high, turn)
            if not contains:
                yaw = math.atan2(s, c)
                first = int(direction_bin(math.cos(middle + yaw + low), math.sin(middle + yaw + low), bins)) - 1
                last = int(direction_bin(math.cos(middle + yaw + high), math.sin(middle + yaw + high), bins)) + 1
                for k in range(first, last + 1 if last >= first else last + bins + 1):
                    unclear[k % bins] = True


@compiled
def cast_shadow(  # noqa: PLR0917 - one reflector, number by number
    tables: RayTables,
    x: float,
    y: float,
    radius: float,
    farthest: float,
    clear: NDArray[np.float32],
    hidden: NDArray[np.float32],
) -> None:
    """Fill one reflector's rows of `Targets.clear` and `Targets.hidden`."""
    bins = len(clear)
    c, s, cell = tables.origin_cos, tables.origin_sin, tables.resolution
    gx = (c * (x - tables.origin_x) + s * (y - tables.origin_y)) / cell
    gy = (c * (y - tables.origin_y) - s * (x - tables.origin_x)) / cell
    diagonal = math.sqrt(2.0) * cell
    unclear = np.zeros(bins, dtype=np.bool_)
    mark_cells_under(tables, x, y, radius, unclear)
    reach = farthest + 2.0 * diagonal
    dir_x, dir_y = bin_edge(0, bins)
    first = cast_ray(tables, x + radius * dir_x, y + radius * dir_y, dir_x, dir_y, reach)
    here = first
    for k in range(bins):
        following = first
        if k + 1 < bins:
            dir_x, dir_y = bin_edge(k + 1, bins)
            following = cast_ray(tables, x + radius * dir_x, y + radius * dir_y, dir_x, dir_y, reach)
        free = radius + min(here[0], following[0]) - diagonal - ROUNDING
        clear[k] = -1.0 if unclear[k] or free <= 0.0 else min(free, reach) ** 2
        hidden[k] = math.inf
        if here[1] >= 0 and following[1] >= 0:
            shadow = chain_reach(tables, gx, gy, here[1], here[2], following[1], following[2]) * cell
            if here[1] == following[1] or here[2] == following[2]:
                # A straight row of cells is convex: it contains the line between the two hits.
                shadow = min(shadow, radius + max(here[0], following[0])) if math.isfinite(shadow) else shadow
            hidden[k] = (max(shadow, radius) + ROUNDING) ** 2
        here = following


@compiled
def cast_shadows(tables: RayTables, targets: Targets) -> None:
    """Fill the shadow maps of all reflectors."""
    for m in range(len(targets.radii)):
        x, y = targets.centers[m, 0], targets.centers[m, 1]
        cast_shadow(tables, x, y, targets.radii[m], targets.farthest[m], targets.clear[m], targets.hidden[m])


@compiled
def see_points(  # noqa: PLR0917 - one reflector, many points
    tables: RayTables, targets: Targets, m: int, points: FloatArray, members: IntArray, seen: BoolArray
) -> None:
    """Fill `seen`: whether a scanner that looks all around sees reflector m from each of the chosen points.

    What belongs to the reflector is fetched once: fetched for every point it would cost ten times the comparison.
    """
    x, y, radius = targets.centers[m, 0], targets.centers[m, 1], targets.radii[m]
    nearest, farthest = targets.nearest[m] ** 2, targets.farthest[m] ** 2
    facing_x, facing_y, promised = targets.normals[m, 0], targets.normals[m, 1], targets.promised[m]
    cosine_squared, is_plate = targets.cosine_limit**2, facing_x != 0.0 or facing_y != 0.0
    clear, hidden = targets.clear[m], targets.hidden[m]
    bins = len(clear)
    for i in range(len(members)):
        point_x, point_y = points[members[i], 0], points[members[i], 1]
        dx, dy = point_x - x, point_y - y
        squared = dx * dx + dy * dy
        seen[i] = False
        if squared > farthest or squared < nearest:
            continue
        if is_plate:
            along = dx * facing_x + dy * facing_y
            # Seen at an angle a plate is narrower by the cosine, so it gets its beams up to a shorter range.
            if along <= 0.0 or along * along < cosine_squared * squared or squared > promised * along:
                continue
        if squared <= radius * radius:
            seen[i] = True
            continue
        where = direction_bin(dx, dy, bins)
        k = int(where)
        if EDGE < where - k < 1.0 - EDGE:
            if squared <= clear[k]:
                seen[i] = True
                continue
            if squared >= hidden[k]:
                continue
        distance = math.sqrt(squared)
        hit = cast_ray(tables, point_x, point_y, -dx / distance, -dy / distance, distance - radius)
        seen[i] = hit[1] < 0


@compiled
def in_shadow(targets: Targets, m: int, x: float, y: float, spread: float) -> bool:
    """Whether all of the disc of radius `spread` around (x, y) is certainly out of sight of reflector m."""
    dx, dy = x - targets.centers[m, 0], y - targets.centers[m, 1]
    distance = math.hypot(dx, dy)
    if distance - spread > targets.farthest[m]:
        return True
    if distance <= 1.01 * spread + targets.radii[m]:
        return False
    bins = targets.clear.shape[1]
    sine = spread / distance
    cosine = math.sqrt(1.0 - sine * sine)
    first = int(direction_bin(cosine * dx + sine * dy, cosine * dy - sine * dx, bins)) - 1
    last = int(direction_bin(cosine * dx - sine * dy, cosine * dy + sine * dx, bins)) + 1
    nearest_squared = (distance - spread) ** 2
    for k in range(first, last + 1 if last >= first else last + bins + 1):
        if targets.hidden[m, k % bins] > nearest_squared:
            return False
    return True


@compiled
def visible_mask(  # noqa: PLR0917 - points grouped by buckets
    tables: RayTables, targets: Targets, points: FloatArray, order: IntArray, starts: IntArray, mask: BitMask
) -> None:
    """Set the bits of all reflectors that each point sees.

    Parameters
    ----------
    tables : of the map's `RayCaster`.
    targets : M reflectors.
    points : (N, 2) array [m], map frame.
    order : (N,) indices of the points, bucket by bucket.
    starts : (B + 1,) where each bucket begins in `order`.
    mask : (N, ceil(M / 64)) array, zero on entry.
    """
    seen = np.empty(len(order), dtype=np.bool_)
    for b in range(len(starts) - 1):
        members = order[starts[b] : starts[b + 1]]
        low_x, high_x, low_y, high_y = math.inf, -math.inf, math.inf, -math.inf
        for n in members:
            low_x, high_x = min(low_x, points[n, 0]), max(high_x, points[n, 0])
            low_y, high_y = min(low_y, points[n, 1]), max(high_y, points[n, 1])
        spread = 0.5 * math.hypot(high_x - low_x, high_y - low_y) + 1e-9
        for m in range(len(targets.radii)):
            if in_shadow(targets, m, 0.5 * (low_x + high_x), 0.5 * (low_y + high_y), spread):
                continue
            see_points(tables, targets, m, points, members, seen)
            word, bit = m >> 6, np.uint64(1) << np.uint64(m & 63)
            for i in range(len(members)):
                if seen[i]:
                    mask[members[i], word] |= bit
