"""Faces one by one, each added to its vertices: for all that no pass over rows or rings knows."""

import numpy as np

from quadcurv.kernels.compiled import flat, kernel
from quadcurv.kernels.formulas import formula, root, where
from quadcurv.kernels.vector import (
    LEAST,
    apart,
    cross,
    dot,
    known_square,
    middle,
    place,
    plus,
    rounding,
    times,
    triple,
    unless_zero,
)


def add(sums, v, a):
    """Add a triple to that of vertex v."""
    for x in range(3):
        sums[3 * v + x] += a[x]


def vertices(faces, f, sides=4):
    """Of face f."""
    return [faces[4 * f + s] for s in range(sides)]


def edge(points, a, b):
    """From vertex a to vertex b."""
    return apart(points, 3 * b, points, 3 * a, 1)


def half_over_length(n, u, v, point, coarse):
    """1 / (2 |n|) of n = u x v about a point, NaN where n is zero but for rounding."""
    return unless_zero(0.5 / root(dot(n, n)), known_square(n, u, v, point, coarse))


@formula
def add_quad(points, faces, f, coarse, flux, area):
    """Half fluxes and a quarter of the area of a quad."""
    h, i, j, k = vertices(faces, f)
    u, v = edge(points, h, j), edge(points, i, k)
    n = cross(u, v)
    point = middle(*(triple(points, 3 * c, 1) for c in (h, j, i, k)))
    scale = half_over_length(n, u, v, point, coarse)
    first, second = times(cross(v, n), scale), times(cross(n, u), scale)
    add(flux, h, first)
    add(flux, i, second)
    add(flux, j, times(first, -1))
    add(flux, k, times(second, -1))
    for c in (h, i, j, k):
        area[c] += 0.125 * root(dot(n, n))


@formula
def add_flap(points, corners, t, origin, coarse, flux):
    """Half flux of a corner (c, a, d, b) into c."""
    c, a, d, b = vertices(corners, t)
    u, v = edge(points, c, d), edge(points, a, b)
    n, point = cross(u, v), plus(triple(points, 3 * c, 1), triple(origin, 0, 1))
    add(flux, c, times(cross(v, n), half_over_length(n, u, v, point, coarse)))


@formula
def add_triangle(points, faces, f, coarse, flux, area):
    """Cotan fluxes and a third of the area of a triangle."""
    corners = vertices(faces, f, 3)
    u, v = edge(points, corners[0], corners[1]), edge(points, corners[0], corners[2])
    n = cross(u, v)
    scale = half_over_length(n, u, v, triple(points, 3 * corners[0], 1), coarse)
    for s, c in enumerate(corners):
        # Cotan weights at c sum to the opposite edge, turned by 90 degrees into the triangle, halved.
        opposite = edge(points, corners[s - 2], corners[s - 1])
        add(flux, c, times(cross(opposite, n), scale))
        area[c] += root(dot(n, n)) / 6


def add_corners(points, corners, sums):
    """A quarter of (a - c) x (b - c) of each corner c of a face, and the squares of these factors."""
    for s, c in enumerate(corners):
        u, v = edge(points, c, corners[s + 1 - len(corners)]), edge(points, c, corners[s - 1])
        n = times(cross(u, v), 0.25)
        for x, more in enumerate((*n, dot(u, u) + dot(v, v))):
            sums[4 * c + x] += more


@formula
def add_quad_corners(points, faces, f, sums):
    """As `add_corners`, of a quad."""
    add_corners(points, vertices(faces, f), sums)


@formula
def add_triangle_corners(points, faces, f, sums):
    """As `add_corners`, of a triangle."""
    add_corners(points, vertices(faces, f, 3), sums)


@kernel
def _quad_fluxes(points, faces, coarse, flux, area):
    for f in range(faces.size // 4):
        if faces[4 * f + 3] >= 0:
            add_quad(points, faces, f, coarse, flux, area)


def quad_fluxes(points, faces, flux, area, coarse=1.0):
    """Add each quad's half fluxes (p, 3) and a quarter of its area (p,) to its vertices.

    For `coarse`, here and below, see `vector.rounding`.
    """
    _quad_fluxes(flat(points), flat(faces, np.int32), coarse, flux.ravel(), area)


@kernel
def _flap_fluxes(points, corners, origin, coarse, flux):
    for t in range(corners.size // 4):
        add_flap(points, corners, t, origin, coarse, flux)


def flap_fluxes(points, corners, origin, flux, coarse=1.0):
    """Add to each corner's centre the half flux of (c, a, d, b), to no other vertex.

    Points are relative to `origin` (3,).
    """
    _flap_fluxes(flat(points), flat(corners, np.int32), flat(origin), coarse, flux.ravel())


@kernel
def _triangle_fluxes(points, faces, coarse, flux, area):
    for f in range(faces.size // 4):
        if faces[4 * f + 3] < 0:
            add_triangle(points, faces, f, coarse, flux, area)


def triangle_fluxes(points, faces, flux, area, coarse=1.0):
    """Add each triangle's cotan fluxes and a third of its area to its vertices."""
    _triangle_fluxes(flat(points), flat(faces, np.int32), coarse, flux.ravel(), area)


@kernel
def _ring_normals(points, faces, sums):
    for f in range(faces.size // 4):
        if faces[4 * f + 3] >= 0:
            add_quad_corners(points, faces, f, sums)
        else:
            add_triangle_corners(points, faces, f, sums)


def ring_normals(points, faces, sums):
    """Add to each vertex half the vector area of its ring polygon, corner by corner (a - c) x (b - c).

    The fourth of the `sums` (p, 4) is that of the squares of all these factors.
    """
    _ring_normals(flat(points), flat(faces, np.int32), sums.ravel())


@formula
def put_area(points, sums, v, coarse, areas):
    """Write a vector area, zero where there is none but for rounding."""
    n, point = [sums[4 * v + x] for x in range(3)], triple(points, 3 * v, 1)
    square = 16.0 * dot(n, n)
    known = (square > coarse * rounding(sums[4 * v + 3], dot(point, point))) & (square > LEAST)
    place(areas, 3 * v, 1, [where(known, x, 0.0) for x in n])


@kernel
def _known_areas(points, sums, coarse, areas):
    for v in range(areas.size // 3):
        put_area(points, sums, v, coarse, areas)


def known_areas(points, sums, coarse=1.0):
    """Half the vector areas (n, 3) of ring polygons from their `ring_normals` (n, 4)."""
    areas = np.empty((len(sums), 3))
    _known_areas(flat(points), flat(sums), coarse, areas.reshape(-1))
    return areas
