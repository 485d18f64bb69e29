"""Quadrics through a vertex, on meshes so coarse that no polynomial of height goes as far.

With z the height over the tangent plane, z = a x + b y + c x^2 + d x y + e y^2 + f x z + g y z + h z^2 is a
linear least-squares problem like that of a polynomial, and exact on every quadric: spheres, cylinders, cones,
ellipsoids. Of the solutions to too few equations it is the least.
"""

from __future__ import annotations

import numpy as np

from quadcurv.boundary import tangent_frames
from quadcurv.schemes.base import Neighbourhoods
from quadcurv.types import Floats, Indices

TERMS = 8
_RANK = 1e-6  # of the largest singular value: less is no equation


def quadrics(around: Neighbourhoods, vertices: Indices, rings: int) -> Floats:
    """Fits over so many rings, in the columns of `kernels.jet`; NaN where points are no more than terms.

    LOWER is what the five terms of a quadratic polynomial leave of the squares of the heights.
    """
    from quadcurv.kernels import jet as kernel

    out = np.full((vertices.size, kernel.COLUMNS), np.nan)
    positions, normals = around.positions(vertices, rings, ghosts=False)
    apart = positions[:, 1:] - positions[:, :1]
    count = np.isfinite(apart[..., 0]).sum(axis=1)
    apart, length = np.nan_to_num(apart), np.linalg.norm(normals, axis=1)
    size = np.sqrt((apart**2).sum(axis=(1, 2)) / np.maximum(count, 1))
    fitted = np.flatnonzero((count > TERMS) & (size > 0) & (length > 0))  # a normal may be NaN
    if fitted.size == 0:
        return out
    apart, count, size = apart[fitted], count[fitted], size[fitted]
    frames = tangent_frames(normals[fitted] / length[fitted, None])
    x, y, z = np.einsum("kmi,kji->jkm", apart / size[:, None, None], frames)
    terms = np.stack((x, y, x * x, x * y, y * y, x * z, y * z, z * z), axis=-1)
    inverse = np.linalg.pinv(terms, rcond=_RANK)
    coefficients = np.einsum("ktm,km->kt", inverse, z)
    rest = z - np.einsum("kmt,kt->km", terms, coefficients)
    square, freedom = (rest**2).sum(axis=1), count - TERMS
    plain = np.linalg.pinv(terms[..., :5], rcond=_RANK)
    lower = z - np.einsum("kmt,kt->km", terms[..., :5], np.einsum("kts,ks->kt", plain, z))

    a, b, c, d, e, f, g, h = coefficients.T
    gradient = np.stack((-a, -b, np.ones_like(a)), axis=1)
    hessian = -np.stack((2 * c, d, f, d, 2 * e, g, f, g, 2 * h), axis=1).reshape(-1, 3, 3)
    slope = np.linalg.norm(gradient, axis=1)
    basis = tangent_frames(gradient / slope[:, None])
    shape = np.einsum("kij,kjl,kml->kim", basis[:, :2], hessian, basis[:, :2]) / slope[:, None, None]
    curvature, direction = np.linalg.eigh(shape)
    k2, k1 = curvature.T
    # What an error of the heights makes of the second derivatives, in the plane of the neighbourhood.
    bends = -np.stack((2 * inverse[:, 2], inverse[:, 3], 2 * inverse[:, 4]), axis=1)
    tangent = np.einsum("ki,kij->kj", direction[:, :, 1], basis[:, :2])  # of k1, in the frame
    cos, sin = tangent[:, :2].T / np.linalg.norm(tangent[:, :2], axis=1)
    one, none = np.ones_like(k1), np.zeros_like(k1)
    parts = (
        (one / 2, none, one / 2),
        (k1 * sin**2 + k2 * cos**2, 2 * (k2 - k1) * cos * sin, k1 * cos**2 + k2 * sin**2),
        (cos**2, 2 * cos * sin, sin**2),
        (sin**2, -2 * cos * sin, cos**2),
    )
    powers = (1, 2, 1, 1)
    for k, (part, power) in enumerate(zip(parts, powers, strict=True)):
        gain = np.linalg.norm(np.einsum("ik,kim->km", np.array(part), bends), axis=1)
        out[fitted, kernel.GAIN + k] = gain / size ** (power + 1)
    normal = np.einsum("ki,kij->kj", gradient / slope[:, None], frames)
    first = np.einsum("ki,kij->kj", tangent, frames)
    out[fitted, kernel.MEAN] = (k1 + k2) / 2 / size
    out[fitted, kernel.GAUSSIAN] = k1 * k2 / size**2
    out[fitted, kernel.K1], out[fitted, kernel.K2] = k1 / size, k2 / size
    out[fitted, kernel.DIRECTION1], out[fitted, kernel.DIRECTION2] = first, np.cross(normal, first)
    out[fitted, kernel.NORMAL] = normal
    out[fitted, kernel.SQUARE], out[fitted, kernel.LOWER] = square * size**2, (lower**2).sum(axis=1) * size**2
    out[fitted, kernel.SIGMA], out[fitted, kernel.FREEDOM] = np.sqrt(square / freedom) * size, freedom
    return out
