"""Faces one by one, each added to its vertices: for all that no pass over rows or rings knows."""

import numpy as np

from quadcurv.kernels.compiled import kernel
from quadcurv.kernels.vector import cross, difference, dot, norm


@kernel
def quad_fluxes(points, faces, flux, area):
    """Add each quad's half fluxes (p, 3) and a quarter of its area (p,) to its vertices."""
    for f in range(faces.shape[0]):
        h, i, j, k = faces[f, 0], faces[f, 1], faces[f, 2], faces[f, 3]
        if k < 0:
            continue
        u, v = difference(points, j, h), difference(points, k, i)
        n = cross(u, v)
        length = norm(n)
        g, e = cross(v, n), cross(n, u)
        scale = 0.5 / length
        for x in range(3):
            flux[h, x] += scale * g[x]
            flux[i, x] += scale * e[x]
            flux[j, x] -= scale * g[x]
            flux[k, x] -= scale * e[x]
        for s in range(4):
            area[faces[f, s]] += 0.125 * length


@kernel
def flap_fluxes(points, corners, flux):
    """Add to each corner's centre the half flux of (c, a, d, b), to no other vertex."""
    for t in range(corners.shape[0]):
        c = corners[t, 0]
        u = difference(points, corners[t, 2], c)
        v = difference(points, corners[t, 3], corners[t, 1])
        n = cross(u, v)
        g = cross(v, n)
        scale = 0.5 / norm(n)
        for x in range(3):
            flux[c, x] += scale * g[x]


@kernel
def triangle_fluxes(points, faces, flux, area):
    """Add each triangle's cotan fluxes and a third of its area to its vertices."""
    for f in range(faces.shape[0]):
        if faces[f, 3] >= 0:
            continue
        n = cross(
            difference(points, faces[f, 1], faces[f, 0]),
            difference(points, faces[f, 2], faces[f, 0]),
        )
        length = norm(n)
        for s in range(3):
            c, a, b = faces[f, s], faces[f, (s + 1) % 3], faces[f, (s + 2) % 3]
            # Cotan weights at c sum to the opposite edge, turned by 90 degrees into the triangle, halved.
            g = cross(difference(points, b, a), n)
            for x in range(3):
                flux[c, x] += 0.5 / length * g[x]
            area[c] += length / 6


@kernel
def ring_normals(points, faces, normal):
    """Add to each vertex half the vector area of its ring polygon, corner by corner (a - c) x (b - c)."""
    for f in range(faces.shape[0]):
        sides = 3 if faces[f, 3] < 0 else 4
        for s in range(sides):
            c = faces[f, s]
            n = cross(
                difference(points, faces[f, (s + 1) % sides], c),
                difference(points, faces[f, (s + sides - 1) % sides], c),
            )
            for x in range(3):
                normal[c, x] += 0.25 * n[x]


@kernel
def conductances(points, quads):
    """K (m, 2, 2) with half fluxes K (u, v) into a quad's first two vertices."""
    K = np.empty((quads.shape[0], 2, 2))
    for f in range(quads.shape[0]):
        u = difference(points, quads[f, 2], quads[f, 0])
        v = difference(points, quads[f, 3], quads[f, 1])
        n = cross(u, v)
        scale = 0.5 / norm(n)
        K[f, 0, 0] = scale * dot(v, v)
        K[f, 0, 1] = K[f, 1, 0] = -scale * dot(u, v)
        K[f, 1, 1] = scale * dot(u, u)
    return K
