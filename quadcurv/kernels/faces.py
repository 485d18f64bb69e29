"""Faces one by one, each added to its vertices: for all that no pass over rows or rings knows."""

import numpy as np

from quadcurv.kernels.compiled import flat, kernel
from quadcurv.kernels.formulas import formula, root
from quadcurv.kernels.vector import apart, cross, dot, times


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


@formula
def add_quad(points, faces, f, flux, area):
    """Half fluxes and a quarter of the area of a quad."""
    h, i, j, k = vertices(faces, f)
    u, v = edge(points, h, j), edge(points, i, k)
    n = cross(u, v)
    length = root(dot(n, n))
    scale = 0.5 / length
    first, second = times(cross(v, n), scale), times(cross(n, u), scale)
    add(flux, h, first)
    add(flux, i, second)
    add(flux, j, times(first, -1))
    add(flux, k, times(second, -1))
    for c in (h, i, j, k):
        area[c] += 0.125 * length


@formula
def add_flap(points, corners, t, flux):
    """Half flux of a corner (c, a, d, b) into c."""
    c, a, d, b = vertices(corners, t)
    u, v = edge(points, c, d), edge(points, a, b)
    n = cross(u, v)
    add(flux, c, times(cross(v, n), 0.5 / root(dot(n, n))))


@formula
def add_triangle(points, faces, f, flux, area):
    """Cotan fluxes and a third of the area of a triangle."""
    corners = vertices(faces, f, 3)
    n = cross(edge(points, corners[0], corners[1]), edge(points, corners[0], corners[2]))
    length = root(dot(n, n))
    for s, c in enumerate(corners):
        # Cotan weights at c sum to the opposite edge, turned by 90 degrees into the triangle, halved.
        opposite = edge(points, corners[s - 2], corners[s - 1])
        add(flux, c, times(cross(opposite, n), 0.5 / length))
        area[c] += length / 6


def add_corners(points, corners, normal):
    """A quarter of (a - c) x (b - c) of each corner c of a face."""
    for s, c in enumerate(corners):
        n = cross(edge(points, c, corners[s + 1 - len(corners)]), edge(points, c, corners[s - 1]))
        add(normal, c, times(n, 0.25))


@formula
def add_quad_corners(points, faces, f, normal):
    """As `add_corners`, of a quad."""
    add_corners(points, vertices(faces, f), normal)


@formula
def add_triangle_corners(points, faces, f, normal):
    """As `add_corners`, of a triangle."""
    add_corners(points, vertices(faces, f, 3), normal)


@formula
def quad_conductance(points, quads, f, conductance):
    """Entries of K."""
    h, i, j, k = vertices(quads, f)
    u, v = edge(points, h, j), edge(points, i, k)
    n = cross(u, v)
    scale = 0.5 / root(dot(n, n))
    conductance[4 * f] = scale * dot(v, v)
    conductance[4 * f + 1] = conductance[4 * f + 2] = -scale * dot(u, v)
    conductance[4 * f + 3] = scale * dot(u, u)


@kernel
def _quad_fluxes(points, faces, flux, area):
    for f in range(faces.size // 4):
        if faces[4 * f + 3] >= 0:
            add_quad(points, faces, f, flux, area)


def quad_fluxes(points, faces, flux, area):
    """Add each quad's half fluxes (p, 3) and a quarter of its area (p,) to its vertices."""
    _quad_fluxes(flat(points), flat(faces, np.int32), flux.ravel(), area)


@kernel
def _flap_fluxes(points, corners, flux):
    for t in range(corners.size // 4):
        add_flap(points, corners, t, flux)


def flap_fluxes(points, corners, flux):
    """Add to each corner's centre the half flux of (c, a, d, b), to no other vertex."""
    _flap_fluxes(flat(points), flat(corners, np.int32), flux.ravel())


@kernel
def _triangle_fluxes(points, faces, flux, area):
    for f in range(faces.size // 4):
        if faces[4 * f + 3] < 0:
            add_triangle(points, faces, f, flux, area)


def triangle_fluxes(points, faces, flux, area):
    """Add each triangle's cotan fluxes and a third of its area to its vertices."""
    _triangle_fluxes(flat(points), flat(faces, np.int32), flux.ravel(), area)


@kernel
def _ring_normals(points, faces, normal):
    for f in range(faces.size // 4):
        if faces[4 * f + 3] >= 0:
            add_quad_corners(points, faces, f, normal)
        else:
            add_triangle_corners(points, faces, f, normal)


def ring_normals(points, faces, normal):
    """Add to each vertex half the vector area of its ring polygon, corner by corner (a - c) x (b - c)."""
    _ring_normals(flat(points), flat(faces, np.int32), normal.ravel())


@kernel
def _conductances(points, quads, found):
    for f in range(quads.size // 4):
        quad_conductance(points, quads, f, found)


def conductances(points, quads):
    """K (m, 2, 2) with half fluxes K (u, v) into a quad's first two vertices."""
    found = np.empty((len(quads), 2, 2))
    _conductances(flat(points), flat(quads, np.int32), found.ravel())
    return found
