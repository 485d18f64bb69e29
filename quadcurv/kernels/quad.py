"""Finite-volume and Liu's operators: one diamond flux, two dual areas.

With a quad's diagonals u and v and its unit normal n, along u x v, the finite-volume flux into its first
vertex is v x n and into its second n x u; the opposite vertices get the same with the other sign. This is
twice Liu's alpha (a - c) + beta (b - c) + gamma (d - c) at every corner, and
(a^11 t1 + a^12 t2) / |t^(1)| |t2| of the finite-volume scheme with t1 = d - c, t2 = b - a.
|u x v| rather than the Gram determinant (thesis, eq. 3.27): no cancellation.

A ring polygon's diagonals give its normal in the same way. The curvature normal is the sum of fluxes times
`ring_scale` in the finite-volume scheme, times `quads_scale` in Liu's formula.

The loops that use this, over grids and over rings, are written for the compiler to vectorise and the
processor to overlap:

* Coordinates are first de-interleaved into x, y and z planes that a loop only reads.
* Loops over what only they see go on to the end of a stretch of fixed length, wanted or not: they have no
  remainder, which would have to be compiled, and run, apart.
* On grids the fluxes of the quad before are carried from one turn of the loop to the next instead of
  stored, which the compiler knows how to shift along its vectors.
* Normals, roots and fluxes have loops of their own. (A processor keeps about a hundred operations that
  wait for others. A turn of one loop that did it all would be a chain of 150 cycles, of which hardly two
  overlapped.) The loops follow each other on short stretches of a row: what one leaves for the next stays
  near, and memory is read and written evenly, ahead of its use.
* Roots are Newton's rather than the processor's, which take five cycles a number whatever else is done.

What has no area but for rounding, a quad or a ring, has a square of 0 (`known_square`): its normal is NaN.

Every vertex sums its quads in the same order however the work is cut: results are bitwise the same.
"""

from quadcurv.kernels.vector import (
    cross,
    dot,
    fused_cross,
    known_square,
    quotient,
    reciprocal_root,
    unless_zero,
)


def fluxes(u, v, n):
    """Fluxes into a quad's first and second vertex from its diagonals and its unit normal."""
    return fused_cross(v, n), fused_cross(n, u)


def ring_scale(square):
    """1 / (2 A), A a quarter of the root of the square of a ring's normal, over 2: the area of its polygon.

    It also gives the normal length one.
    """
    return unless_zero(reciprocal_root(square), square)


def ring_area(square):
    """The dual area of the finite-volume scheme from the square of a ring's normal."""
    return 0.25 * square * reciprocal_root(square)


def quads_scale(lengths):
    """1 / (2 A) in Liu's formula, from the sum of the lengths of the normals of a ring's quads."""
    return quotient(2.0, lengths)


def quads_area(lengths):
    """The dual area of Liu's formula."""
    return 0.125 * lengths


def conductance(u, v, point, coarse):
    """K_00 and K_01 of a quad: K (u, v) are the half fluxes into its first two vertices."""
    n = cross(u, v)
    scale = 0.5 * unless_zero(reciprocal_root(dot(n, n)), known_square(n, u, v, point, coarse))
    return scale * dot(v, v), -scale * dot(u, v)
