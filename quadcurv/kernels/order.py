"""An order of the vertices of a face list that keeps neighbours close in memory."""

import numpy as np

from quadcurv.kernels.compiled import flat, helper, kernel
from quadcurv.kernels.formulas import formula, span, where
from quadcurv.kernels.vector import place, triple

PATCH = 65536  # vertices: one step of breadth-first order through them stays in the first-level cache


@helper
def free_neighbour(ring, v, placed):
    """A neighbour of a regular vertex that has no place yet, -1 if there is none."""
    if ring[8 * v] >= 0:
        for k in range(8 * v, 8 * v + 8, 2):
            if not placed[ring[k]]:
                return ring[k]
    return -1


@kernel
def _nearby_order(ring, order, placed):
    n, size, beside = order.size, 0, 0
    for root in range(n):
        start = -1 if placed[root] else root
        while start >= 0:
            order[size], placed[start] = start, True
            head, end = size, min(size + PATCH, n)
            size += 1
            while head < size < end:
                x = free_neighbour(ring, order[head], placed)
                if x < 0:
                    head += 1
                else:
                    order[size], placed[x] = x, True
                    size += 1
            start = -1
            while beside < size and start < 0:
                start = free_neighbour(ring, order[beside], placed)
                beside += start < 0


def nearby_order(ring):
    """Vertices patch by patch, each of PATCH neighbours along the edges of regular vertices.

    A patch is a vertex and what comes next in breadth-first order; it begins beside an earlier one.
    """
    order, placed = np.empty(len(ring), np.int32), np.zeros(len(ring), bool)
    _nearby_order(flat(ring), order, placed)
    return order


@formula
def renumbered_ring(ring, order, place, k, moved):
    """The ring of the k-th vertex of an order."""
    v = order[k]
    regular = ring[8 * v] >= 0
    for j in range(8):
        moved[8 * k + j] = where(regular, place[where(regular, ring[8 * v + j], 0)], -1)


@kernel
def _renumbered(ring, order, place, moved):
    for k in range(order.size):
        place[order[k]] = k
    for k in range(order.size):
        renumbered_ring(ring, order, place, k, moved)


def renumbered(ring, order):
    """Rings in another order, their vertices numbered by place in it; and the places."""
    place, moved = np.empty(order.size, np.int32), np.empty_like(ring)
    _renumbered(flat(ring), flat(order), place, moved.reshape(-1))
    return moved, place


@formula
def gather_numbers(values, order, ordered, start, stop):
    """Numbers."""
    for k in span(start, stop):
        ordered[k] = values[order[k]]


@formula
def gather_triples(values, order, ordered, start, stop):
    """Triples."""
    for k in span(start, stop):
        place(ordered, 3 * k, 1, triple(values, 3 * order[k], 1))


@kernel
def _gather(values, order, ordered, start, stop):
    if values.size == order.size:
        gather_numbers(values, order, ordered, start, stop)
    else:
        gather_triples(values, order, ordered, start, stop)


def gather(values, order, ordered, start, stop):
    """Triples (3 n,) or numbers (n,) in another order: the k-th is number order[k], for start <= k < stop."""
    _gather(flat(values), flat(order), ordered, start, stop)
