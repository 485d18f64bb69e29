"""Cholesky factors of normal equations, WIDTH at once, and rows of their inverses.

Row i of the normal equations belongs to a term, the last one to the right-hand side; `table` has the row of
the moments `mu` of every entry. `A` is filled with the factor, inverses on its diagonal, and `diagonal` with
what is left of the terms' squares; its last row is that of the squares of z.
"""

from functools import cache

import numpy as np

from quadcurv.kernels.compiled import flat
from quadcurv.kernels.formulas import Carried, root, span, where
from quadcurv.kernels.moments import (
    LEAST,
    LEFT,
    LESS,
    moments_degree,
    moments_of,
    put_row,
    row,
    step,
    terms_of,
)

TALL = 8  # rows that are done at once


@cache
def table_of(degree):
    """Moments of the entries for the terms of every second degree up to this one, and where each begins.

    Returns
    -------
    table : (sum of (T + 1 + TALL) (T + 1),) int32
        Rows of `mu`; rows of the entries beyond the right-hand side are done, too, and never looked at.
    starts : (degree // 2 + 1,) int32
    """
    moments, tables, starts = moments_of(moments_degree(degree)), [], [0]
    for d in range(degree % 2, degree + 1, 2):
        terms = terms_of(d)
        T = len(terms)
        table = np.zeros((T + 1 + TALL, T + 1), np.int32)
        for i, (a, b) in enumerate(terms):
            for j, (p, q) in enumerate(terms):
                table[i, j] = moments.index((a + p, b + q, 0))
            table[T, i] = moments.index((a, b, 1))
        table[T, T] = moments.index((0, 0, 2))
        tables.append(table.reshape(-1))
        starts.append(starts[-1] + table.size)
    return flat(np.concatenate(tables)), flat(starts[:-1], np.int32)


def column(A, diagonal, mu, table, first, T, i, j, count):
    """Entries of column j in some rows from i on, and what they explain of the squares of these."""
    entries = Carried(tuple(row(mu, table[first + (i + r) * (T + 1) + j]) for r in range(count)))
    for k in span(0, j):
        x, left = row(A, j * T + k), entries.get()
        entries.set(tuple(s - row(A, (i + r) * T + k) * x for r, s in enumerate(left)))
    inverse = row(A, j * T + j)
    for r, x in enumerate(entries.get()):
        x = x * inverse
        put_row(A, (i + r) * T + j, x)
        put_row(diagonal, i + r, row(diagonal, i + r) - x * x)


@step()
def factor(A, diagonal, mu, table, first, T, lane):
    """Eliminate all of T terms, whose table begins at `first`."""
    for i in span(0, T + 1):
        put_row(diagonal, i, row(mu, table[first + i * (T + 1) + i]))
    for j in span(0, T):
        # How much of the term's square is left, of 1; the inverse of its root.
        left, least = row(diagonal, j), row(lane, LEAST)
        share = left / row(mu, table[first + j * (T + 1) + j])
        put_row(lane, LEAST, where(share < least, share, least))
        put_row(A, j * T + j, 1.0 / root(left))
        # The rows below, the right-hand side last: what is left of them by half as many.
        whole = (T - j + TALL // 2 - 1) >> 3
        for t in span(0, whole):
            column(A, diagonal, mu, table, first, T, j + 1 + TALL * t, j, TALL)
        for _ in span(0, where(TALL * whole < T - j, 1, 0)):
            column(A, diagonal, mu, table, first, T, j + 1 + TALL * whole, j, TALL // 2)
    put_row(lane, LESS, row(lane, LEFT))
    put_row(lane, LEFT, row(diagonal, T))


@step()
def last_rows(A, G, T):
    """The inverse of the normal equations, without the term 1, in the rows of the three terms before it."""
    for k in span(0, 3 * T):
        put_row(G, k, 0.0)
    for j in range(3):  # first of the factor
        for i in range(3):
            if i < j:
                put_row(G, j * T + T - 4 + i, 0.0)
                continue
            x = row(A, (T - 4 + i) * T + T - 4 + i)
            if i > j:
                x = -x * sum(
                    row(A, (T - 4 + i) * T + T - 4 + k) * row(G, j * T + T - 4 + k) for k in range(j, i)
                )
            put_row(G, j * T + T - 4 + i, x)
    for t in span(2 - T, 1):
        i = -1 * t
        entries = Carried(tuple(row(G, j * T + i) for j in range(3)))
        for k in span(i + 1, T - 1):
            x = row(A, k * T + i)
            entries.set(tuple(s - x * row(G, j * T + k) for j, s in enumerate(entries.get())))
        for j, x in enumerate(entries.get()):
            put_row(G, j * T + i, x * row(A, i * T + i))
