"""Finite-volume and Liu's fluxes over quads: one diamond flux, two areas.

With a quad's diagonals u and v, n = u x v and |n| twice its area, half the finite-volume flux into its
first vertex is (v x n) / (2 |n|) and into its second (n x u) / (2 |n|); the opposite vertices get the
same with the other sign. This is Liu's alpha (a - c) + beta (b - c) + gamma (d - c) at every corner, and
(a^11 t1 + a^12 t2) / |t^(1)| |t2| / 2 of the finite-volume scheme with t1 = d - c, t2 = b - a.
|n| rather than the Gram determinant (thesis, eq. 3.27): no cancellation.
"""

import numpy as np
from numba import njit


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def cross(a, b):
    """Cross product of two triples."""
    return (
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    )


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def difference(points, i, j):
    """points[i] - points[j] as a triple."""
    return (
        points[i, 0] - points[j, 0],
        points[i, 1] - points[j, 1],
        points[i, 2] - points[j, 2],
    )


@njit(cache=True, nogil=True, error_model="numpy")
def quads(points, faces, flux, area):
    """Add each quad's half fluxes (p, 3) and a quarter of its area (p,) to its vertices."""
    for f in range(faces.shape[0]):
        h, i, j, k = faces[f, 0], faces[f, 1], faces[f, 2], faces[f, 3]
        if k < 0:
            continue
        u, v = difference(points, j, h), difference(points, k, i)
        n = cross(u, v)
        length = np.sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2])
        g, e = cross(v, n), cross(n, u)
        scale = 0.5 / length
        for x in range(3):
            flux[h, x] += scale * g[x]
            flux[i, x] += scale * e[x]
            flux[j, x] -= scale * g[x]
            flux[k, x] -= scale * e[x]
        for s in range(4):
            area[faces[f, s]] += 0.125 * length


@njit(cache=True, nogil=True, error_model="numpy")
def flaps(points, corners, flux):
    """Add to each corner's centre the half flux of (c, a, d, b), to no other vertex."""
    for t in range(corners.shape[0]):
        c = corners[t, 0]
        u = difference(points, corners[t, 2], c)
        v = difference(points, corners[t, 3], corners[t, 1])
        n = cross(u, v)
        g = cross(v, n)
        scale = 0.5 / np.sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2])
        for x in range(3):
            flux[c, x] += scale * g[x]


@njit(cache=True, nogil=True, error_model="numpy")
def triangles(points, faces, flux, area):
    """Add each triangle's cotan fluxes and a third of its area to its vertices."""
    for f in range(faces.shape[0]):
        if faces[f, 3] >= 0:
            continue
        n = cross(
            difference(points, faces[f, 1], faces[f, 0]),
            difference(points, faces[f, 2], faces[f, 0]),
        )
        length = np.sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2])
        for s in range(3):
            c, a, b = faces[f, s], faces[f, (s + 1) % 3], faces[f, (s + 2) % 3]
            # Cotan weights at c sum to the opposite edge, turned by 90 degrees into the triangle, halved.
            g = cross(difference(points, b, a), n)
            for x in range(3):
                flux[c, x] += 0.5 / length * g[x]
            area[c] += length / 6


@njit(cache=True, nogil=True, error_model="numpy")
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


@njit(cache=True, nogil=True, error_model="numpy")
def conductances(points, quads):
    """K (m, 2, 2) with half fluxes K (u, v) into a quad's first two vertices."""
    K = np.empty((quads.shape[0], 2, 2))
    for f in range(quads.shape[0]):
        u = difference(points, quads[f, 2], quads[f, 0])
        v = difference(points, quads[f, 3], quads[f, 1])
        n = cross(u, v)
        scale = 0.5 / np.sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2])
        K[f, 0, 0] = scale * (v[0] * v[0] + v[1] * v[1] + v[2] * v[2])
        K[f, 0, 1] = K[f, 1, 0] = -scale * (u[0] * v[0] + u[1] * v[1] + u[2] * v[2])
        K[f, 1, 1] = scale * (u[0] * u[0] + u[1] * u[1] + u[2] * u[2])
    return K
