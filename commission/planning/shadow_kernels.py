"""Compiled kernels of line of sight to many reflectors: shadow maps, and which points each reflector is seen from.

A shadow map answers most pairs by one comparison and says itself which pairs it cannot answer; those are cast as rays.
So the answer is that of the ray for every pair. What is a reflector, a scanner or a lattice is defined elsewhere.

Why a wedge of a shadow map can be trusted, with c the center and e, e' the free ranges along its two edges:

- A wedge is as many bins wide as keep it narrower than a cell at the range of its hits, so an occupied cell cannot hide
  between the edges: one that meets the wedge meets an edge, at most a cell's diagonal farther out. Up to min(e, e')
  minus a diagonal all is free. Only a cell that meets the edge underneath the reflector's own disc escapes; bins with
  such cells are marked in advance.
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
from commission.geometry.ray_kernels import RayTables, cast_ray, is_occupied

# Ranges of a shadow map are rounded to float32 (7 digits: 0.01 mm at 100 m); this much is left to the exact test.
ROUNDING = 1e-4
# Directions this close to the edge of a bin, in bins, go to the exact test, since rounding may pick the wrong bin.
EDGE = 1e-6
# Cells of a chain that is followed to link two hits; a wall seen at a grazing angle needs a few dozen.
LONGEST_CHAIN = 64

# Bins of the widest wedge; the number of bins is a multiple of it. Extremes over such blocks make whole discs cheap.
BLOCK = 64
ALL_HIDDEN, ALL_CLEAR, MIXED = 0, 1, 2

BitMask = NDArray[np.uint64]
"""(N, ceil(M / 64)): bit m of row n says that point n sees reflector m."""


class Targets(NamedTuple):
    """Reflectors as the kernels see them; M reflectors, K bins of direction."""

    centers: FloatArray
    """(M, 2) [m], map frame."""
    radii: FloatArray
    """(M,) a ray that comes this close to the center has arrived [m]."""
    normals: FloatArray
    """(M, 2) direction a plate faces; 0, 0 for a cylinder, and for a plate that may face any."""
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
    clear_blocks: NDArray[np.float32]
    """(M, K / BLOCK) smallest `clear` of each block of bins."""
    hidden_blocks: NDArray[np.float32]
    """(M, K / BLOCK) largest `hidden` of each block of bins."""


@compiled
def direction_bin(dx: float, dy: float, bins: int) -> float:
    """Direction as a real number in [0, bins): monotonic in the angle, without an arctangent.

    Parameters
    ----------
    dx, dy : direction of any length but 0.
    bins : of a full turn.

    Notes
    -----
    bins / 4 times t = dy / (|dx| + |dy|) where dx, dy >= 0, 2 - t where dx < 0, else 4 + t: the diamond angle, by
    definition.
    """
    t = dy / (abs(dx) + abs(dy))
    if dx < 0.0:
        t = 2.0 - t
    elif dy < 0.0:
        t += 4.0
    return min(t * (0.25 * bins), bins * (1.0 - 1e-16))


@compiled
def bin_edge(index: int, bins: int) -> tuple[float, float]:
    """Unit vector along the lower edge of a bin: the inverse of `direction_bin`."""
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
def trusted_range(cell: float, sine_yaw: float, cosine_yaw: float, bins: int) -> float:
    """Range up to which a bin is narrower than a cell, seen from any side, with 5 % to spare [m].

    Parameters
    ----------
    cell : edge of a cell [m].
    sine_yaw, cosine_yaw : of the grid's yaw in the map.
    bins : of a full turn.

    Notes
    -----
    0.95 cell bins / 8, derived: the widest bins, on the diagonals of the map, measure 8 / bins radians. In a grid along
    the map's axes a cell seen diagonally is wider too, by sqrt(2).
    """
    is_aligned = abs(sine_yaw * cosine_yaw) < 1e-9
    return 0.95 * cell * bins / (8.0 / math.sqrt(2.0) if is_aligned else 8.0)


@compiled
def chain_reach(  # noqa: PLR0917 - two cells and a point, number by number
    tables: RayTables, x: float, y: float, row: int, column: int, last_row: int, last_column: int
) -> float:
    """Largest distance from a point of a chain of occupied cells between two occupied ones; inf without one [cells].

    Parameters
    ----------
    tables : of a `RayCaster`.
    x, y : the point [cells], grid frame.
    row, column, last_row, last_column : the two cells.

    Notes
    -----
    max over the chain of |cell center - point| + sqrt(1/2): no point of a cell is farther from its center. The chain is
    followed along shared sides; why one hides what is behind it, is derived at the top of the module.
    """
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
    """Mark the bins in which an occupied cell lies across the rim of a disc.

    Parameters
    ----------
    tables : of a `RayCaster`.
    x, y : center of the disc [m], map frame.
    radius : of the disc [m].
    unclear : (K,) output, by bin of direction.

    Notes
    -----
    No formula: a cell lies across the rim when its nearest point is inside and its farthest corner outside the disc.
    """
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
def shadow_between(  # noqa: PLR0917 - two hits and a point, number by number
    tables: RayTables, grid_x: float, grid_y: float, hits: FloatArray, cells: IntArray, one: int, other: int
) -> float:
    """Distance from the center beyond which all is hidden between two rays; inf if none is certain [m].

    Parameters
    ----------
    tables : of a `RayCaster`.
    grid_x, grid_y : the center [cells], grid frame.
    hits, cells : (K,) distance [m] and (K, 2) cell of the hit of each edge; row -1: none.
    one, other : the two edges.

    Notes
    -----
    min(chain_reach, max of the two hits) in a straight row of cells, which is convex, else chain_reach: derived at the
    top of the module.
    """
    if cells[one, 0] < 0 or cells[other, 0] < 0:
        return math.inf
    row, column, last_row, last_column = cells[one, 0], cells[one, 1], cells[other, 0], cells[other, 1]
    shadow = tables.resolution * chain_reach(tables, grid_x, grid_y, row, column, last_row, last_column)
    if shadow < math.inf and (row == last_row or column == last_column):
        # A straight row of cells is convex: it contains the line between the two hits.
        return min(shadow, max(hits[one], hits[other]))
    return shadow


@compiled
def cast_shadow(tables: RayTables, targets: Targets, m: int) -> None:
    """Fill the shadow map of one reflector: halve each wedge until it can be trusted as a whole.

    Parameters
    ----------
    tables : of a `RayCaster`.
    targets : reflectors; the row of `clear` and `hidden` and of their blocks is filled.
    m : which reflector.

    Notes
    -----
    clear = (min(e, e') - diagonal)^2, hidden = `shadow_between`^2, e and e' the free ranges along the two edges:
    derived at the top of the module.
    """
    clear, hidden, radius, farthest = targets.clear[m], targets.hidden[m], targets.radii[m], targets.farthest[m]
    x, y, bins = targets.centers[m, 0], targets.centers[m, 1], len(clear)
    cosine, sine, cell = tables.origin_cos, tables.origin_sin, tables.resolution
    grid_x = (cosine * (x - tables.origin_x) + sine * (y - tables.origin_y)) / cell
    grid_y = (cosine * (y - tables.origin_y) - sine * (x - tables.origin_x)) / cell
    diagonal, trusted = math.sqrt(2.0) * cell, trusted_range(cell, sine, cosine, bins)
    unclear = np.zeros(bins, dtype=np.bool_)
    mark_cells_under(tables, x, y, radius, unclear)
    # Of each edge: distance from the center to the hit, negative before it is cast; and the cell that is hit.
    hits, cells = np.full(bins, -1.0), np.empty((bins, 2), dtype=np.int64)
    k, size = 0, BLOCK
    while k < bins:
        end = (k + size) % bins
        for edge in (k, end):
            if hits[edge] < 0.0:
                dir_x, dir_y = bin_edge(edge, bins)
                reach = farthest + 3.0 * cell
                hit = cast_ray(tables, x + radius * dir_x, y + radius * dir_y, dir_x, dir_y, reach)
                hits[edge], cells[edge, 0], cells[edge, 1] = radius + hit[0], hit[1], hit[2]
        near, far, shadow = min(hits[k], hits[end]), max(hits[k], hits[end]), math.inf
        # Between hits at very different ranges little would be decided, although that little could be trusted.
        if size == 1 or (far - near < diagonal and far + diagonal <= trusted / size):
            shadow = shadow_between(tables, grid_x, grid_y, hits, cells, k, end)
        if size > 1 and shadow == math.inf:
            size //= 2
            continue
        free = min(near, farthest + diagonal) - diagonal - ROUNDING
        for i in range(k, k + size):
            clear[i] = -1.0 if unclear[i] or free <= 0.0 else free * free
            hidden[i] = (shadow + ROUNDING) ** 2
        k += size
        size = BLOCK
        while k % size != 0:
            size //= 2
    for block in range(bins // BLOCK):
        targets.clear_blocks[m, block] = clear[block * BLOCK : (block + 1) * BLOCK].min()
        targets.hidden_blocks[m, block] = hidden[block * BLOCK : (block + 1) * BLOCK].max()


@compiled
def cast_shadows(tables: RayTables, targets: Targets) -> None:
    """Fill the shadow maps of all reflectors: `cast_shadow` for each."""
    for m in range(len(targets.radii)):
        cast_shadow(tables, targets, m)


@compiled
def see_points(  # noqa: PLR0917 - one reflector, many points
    tables: RayTables, targets: Targets, m: int, points: FloatArray, members: IntArray, seen: BoolArray
) -> None:
    """Fill whether a scanner that looks all around sees one reflector from each of the chosen points.

    What belongs to the reflector is fetched once: fetched for every point it would cost ten times the comparison.

    Parameters
    ----------
    tables : of a `RayCaster`.
    targets, m : reflectors with their shadow maps, and which of them.
    points : (N, 2) array [m], map frame.
    members : (n,) rows of `points`.
    seen : (n,) output.

    Notes
    -----
    nearest <= distance <= farthest and `cast_ray` free up to the radius; a plate also within the angle of incidence and
    up to promised cos(incidence): equation 3 of Sobreira et al. 2016 for the width that it shows.
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
def sight_of_disc(targets: Targets, m: int, dx: float, dy: float, spread: float) -> int:
    """Whether a disc is all out of a reflector's sight, all in its sight, or neither is certain.

    Parameters
    ----------
    targets, m : reflectors with their shadow maps, and which of them.
    dx, dy : middle of the disc from the reflector's center [m], map axes.
    spread : radius of the disc [m].

    Returns
    -------
    sight : ALL_HIDDEN, ALL_CLEAR or MIXED.

    Notes
    -----
    ALL_HIDDEN if max hidden <= (distance - spread)^2, ALL_CLEAR if min clear >= (distance + spread)^2, over the bins
    within asin(spread / distance) of the direction: derived from what the two columns of a shadow map mean.
    """
    distance = math.sqrt(dx * dx + dy * dy)
    near, far = distance - spread, distance + spread
    if near <= 0.01 * spread + targets.radii[m]:
        return MIXED
    is_plate = targets.normals[m, 0] != 0.0 or targets.normals[m, 1] != 0.0
    can_be_clear = not is_plate and far <= targets.farthest[m] and near >= targets.nearest[m]
    clear, hidden = targets.clear[m], targets.hidden[m]
    clear_blocks, hidden_blocks = targets.clear_blocks[m], targets.hidden_blocks[m]
    bins = len(clear)
    sine = spread / distance
    cosine = math.sqrt(1.0 - sine * sine)
    k = int(direction_bin(cosine * dx + sine * dy, cosine * dy - sine * dx, bins)) - 1
    last = int(direction_bin(cosine * dx - sine * dy, cosine * dy + sine * dx, bins)) + 1
    last += bins if last < k else 0
    largest_hidden, smallest_clear = np.float32(0.0), np.float32(math.inf)
    while k <= last:
        at = k % bins
        # A block that lies in the interval as a whole is one look; at the ends bins are looked at one by one.
        if at % BLOCK == 0 and k + BLOCK - 1 <= last:
            largest_hidden = max(largest_hidden, hidden_blocks[at // BLOCK])
            smallest_clear = min(smallest_clear, clear_blocks[at // BLOCK])
            k += BLOCK
        else:
            largest_hidden, smallest_clear = max(largest_hidden, hidden[at]), min(smallest_clear, clear[at])
            k += 1
        if largest_hidden > near * near and (not can_be_clear or smallest_clear < far * far):
            return MIXED
    return ALL_HIDDEN if largest_hidden <= near * near else ALL_CLEAR


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

    Notes
    -----
    No formula: buckets that are ALL_HIDDEN or ALL_CLEAR by `sight_of_disc` as a whole, the others point by point.
    """
    seen = np.empty(len(order), dtype=np.bool_)
    centers, farthest = targets.centers, targets.farthest
    for b in range(len(starts) - 1):
        members = order[starts[b] : starts[b + 1]]
        low_x, high_x, low_y, high_y = math.inf, -math.inf, math.inf, -math.inf
        for n in members:
            low_x, high_x = min(low_x, points[n, 0]), max(high_x, points[n, 0])
            low_y, high_y = min(low_y, points[n, 1]), max(high_y, points[n, 1])
        spread = 0.5 * math.hypot(high_x - low_x, high_y - low_y) + 1e-9
        middle_x, middle_y = 0.5 * (low_x + high_x), 0.5 * (low_y + high_y)
        for m in range(len(farthest)):
            dx, dy = middle_x - centers[m, 0], middle_y - centers[m, 1]
            # Most reflectors are too far away; this is said here, where it costs the least.
            if dx * dx + dy * dy > (farthest[m] + spread) ** 2:
                continue
            sight = sight_of_disc(targets, m, dx, dy, spread)
            if sight == ALL_HIDDEN:
                continue
            if sight == ALL_CLEAR:
                seen[: len(members)] = True
            else:
                see_points(tables, targets, m, points, members, seen)
            word, bit = m >> 6, np.uint64(1) << np.uint64(m & 63)
            for i in range(len(members)):
                if seen[i]:
                    mask[members[i], word] |= bit
