"""Finite-volume and Liu's operators: one diamond flux, two dual areas.

With a quad's diagonals u and v and its unit normal n, along u x v, the finite-volume flux into its first
vertex is v x n and into its second n x u; the opposite vertices get the same with the other sign. This is
twice Liu's alpha (a - c) + beta (b - c) + gamma (d - c) at every corner, and
(a^11 t1 + a^12 t2) / |t^(1)| |t2| of the finite-volume scheme with t1 = d - c, t2 = b - a.
|u x v| rather than the Gram determinant (thesis, eq. 3.27): no cancellation.

The loops that use this, over grids and over rings, are written for the compiler to vectorise and the
processor to overlap:

* Coordinates are first de-interleaved into x, y and z planes that a loop only reads. What it writes is in
  few other arrays, so that there is little to prove about what overlaps.
* All indices are unsigned and the distances between planes constant. (A signed index may count from the
  end of an array and becomes a gather.)
* On grids the fluxes of the quad before are carried from one turn of the loop to the next instead of
  stored, which the compiler knows how to shift along its vectors.
* Normals, roots and fluxes have loops of their own. (A processor keeps about a hundred operations that
  wait for others. A turn of one loop that did it all would be a chain of 150 cycles, of which hardly two
  overlapped.) The loops follow each other on short stretches of a row: what one leaves for the next stays
  near, and memory is read and written evenly, ahead of its use.
* Roots are Newton's rather than the processor's, which take five cycles a number whatever else is done.

Every vertex sums its quads in the same order however the work is cut: results are bitwise the same.
"""

from math import nan

from quadcurv.kernels.compiled import inlined
from quadcurv.kernels.vector import (
    ONE,
    THREE,
    cross,
    dot,
    fused_cross,
    place,
    quotient,
    reciprocal_root,
    times,
    triple,
    unless_zero,
)


@inlined
def fluxes(u, v, n):
    """Fluxes into a quad's first and second vertex from its diagonals and its unit normal."""
    return fused_cross(v, n), fused_cross(n, u)


@inlined
def ring_normal(ring, i, plane, a, b, liu, H, normal):
    """Keep n = a x b of the diagonals of a vertex's ring polygon, as far as it is wanted, and n . n."""
    if liu is None or H is not None or normal is not None:
        n = cross(a, b)
        ring[i + THREE * plane] = dot(n, n)
        if H is not None or normal is not None:
            place(ring, i, plane, n)


@inlined
def flux_scale(ring, i, plane, lengths, liu, H, normal, area, k):
    """What the sum of fluxes is multiplied by, in the fourth plane; write normal and area of vertex k.

    `ring` holds what `ring_normal` left there before. The dual area is a quarter of the length of n, in
    Liu's formula lengths / 8. What is not wanted is None.
    """
    scale = nan
    if liu is None or H is not None or normal is not None:
        square = ring[i + THREE * plane]
        scale = reciprocal_root(square)
        if liu is None and area is not None:
            area[k] = 0.25 * square * scale
        scale = unless_zero(scale, square)
        if H is not None or normal is not None:
            n = times(triple(ring, i, plane), scale)
            place(ring, i, plane, n)
        if normal is not None:
            place(normal, THREE * k, ONE, n)
    if liu is not None:
        scale = quotient(2, lengths)
        if area is not None:
            area[k] = 0.125 * lengths
    ring[i + THREE * plane] = scale


@inlined
def store_curvature(t, ring, i, plane, Hn, H, k):
    """Write the curvatures of vertex k from the sum t of its fluxes and what `flux_scale` left at place i."""
    scale = ring[i + THREE * plane]
    h = times(t, scale)
    if Hn is not None:
        place(Hn, THREE * k, ONE, h)
    if H is not None:
        H[k] = -dot(h, triple(ring, i, plane))


@inlined
def conductance(u, v):
    """K_00 and K_01 of a quad: K (u, v) are the half fluxes into its first two vertices."""
    n = cross(u, v)
    square = dot(n, n)
    scale = 0.5 * unless_zero(reciprocal_root(square), square)
    return scale * dot(v, v), -scale * dot(u, v)
