"""Kernels that grow areas of a map from its wide places to its narrow ones."""

from __future__ import annotations

from heapq import heappop, heappush

from stack.kernel_cache import njit


@njit(cache=True, nogil=True)
def grow_rooms(clearance, rooms):  # type: ignore[no-untyped-def]
    """Grow numbered areas over the free cells, the widest cells first.

    Args:
        clearance: (rows, columns) metres, 0 where a cell is not free.
        rooms: (rows, columns) number of the room of a cell, 0 for none; filled in place.
    """
    rows, columns = clearance.shape
    queue = [(0.0, 0, 0) for _ in range(0)]
    for cell in range(rows * columns):
        row, column = cell // columns, cell % columns
        if rooms[row, column] > 0:
            _reach(clearance, rooms, row, column, queue)
    while len(queue) > 0:
        _, cell, room = heappop(queue)
        row, column = cell // columns, cell % columns
        if rooms[row, column] == 0:
            rooms[row, column] = room
            _reach(clearance, rooms, row, column, queue)


@njit(cache=True, nogil=True)
def _reach(clearance, rooms, row, column, queue):  # type: ignore[no-untyped-def]
    rows, columns = clearance.shape
    for down, right in ((0, 1), (1, 0), (0, -1), (-1, 0)):
        r, c = row + down, column + right
        if 0 <= r < rows and 0 <= c < columns and rooms[r, c] == 0 and clearance[r, c] > 0.0:
            heappush(queue, (-clearance[r, c], r * columns + c, rooms[row, column]))


@njit(cache=True, nogil=True)
def grow_widest(clearance, start, widest, narrowest_at):  # type: ignore[no-untyped-def]
    """Find the path to each cell whose narrowest point is widest (Dijkstra's algorithm).

    Args:
        clearance: as for `grow_rooms`.
        start: flat index of a free cell.
        widest: (rows, columns) zeros; filled with the clearance of the narrowest point.
        narrowest_at: (rows, columns); filled with its flat index.
    """
    rows, columns = clearance.shape
    widest[start // columns, start % columns] = clearance[start // columns, start % columns]
    narrowest_at[start // columns, start % columns] = start
    queue = [(-clearance[start // columns, start % columns], start)]
    while len(queue) > 0:
        negative, cell = heappop(queue)
        row, column = cell // columns, cell % columns
        if -negative < widest[row, column]:
            continue
        for down, right in ((0, 1), (1, 0), (0, -1), (-1, 0)):
            r, c = row + down, column + right
            if not (0 <= r < rows and 0 <= c < columns):
                continue
            through = min(widest[row, column], clearance[r, c])
            if through > widest[r, c]:
                widest[r, c] = through
                narrower = clearance[r, c] < widest[row, column]
                narrowest_at[r, c] = r * columns + c if narrower else narrowest_at[row, column]
                heappush(queue, (-through, r * columns + c))
