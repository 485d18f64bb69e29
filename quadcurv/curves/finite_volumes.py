"""The finite-volume formulas, and the ghosts that continue open curves."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
Function = Callable[[Array], Array]

_STENCIL = 6  # points that a ghost is extrapolated from


class FrenetFrame(NamedTuple):
    """Unit tangent, normal and binormal at every point of a curve.

    Examples
    --------
    >>> import numpy as np, quadcurv as qc
    >>> line = qc.curves.line().mapping(np.linspace(0, 1, 8))
    >>> qc.curves.frenet_frame(line).tangent[0].round(12)
    array([0.8, 0.6])
    """

    tangent: Array
    normal: Array
    binormal: Array


def curvature(points: ArrayLike, closed: bool = False, dual: ArrayLike | None = None) -> Array:
    """Curvature kappa = |H| >= 0 at every point of a curve, in 1/length (2.24, 2.32).

    It has no sign, in the plane either: there, ``frenet_frame(points).binormal[:, 2]`` times it is
    the signed curvature, positive where the curve turns left.

    Parameters
    ----------
    points, closed, dual
        As for `curvature_normal`.

    Returns
    -------
    ndarray, shape (n,)
        Never NaN; 0 up to rounding where the curve is straight.

    Raises
    ------
    ValueError
        As `curvature_normal`.

    Notes
    -----
    Evenly sampled circles are exact. The error is of second order where the spacing is even or
    varies smoothly, of first order, (h_{j+1} - h_j) kappa'/3, where it jumps from edge to edge: 256
    points of ``ellipse(5, 2)`` give 8e-4 of kappa on even steps of the parameter and 2e-2 on steps
    that vary by up to half. Rounding of the coordinates X adds eps |X| / h^2.

    Examples
    --------
    >>> import numpy as np, quadcurv as qc
    >>> t = np.linspace(0, 2 * np.pi, 60, endpoint=False)
    >>> circle = np.column_stack([2 * np.cos(t), 2 * np.sin(t)])
    >>> qc.curves.curvature(circle, closed=True).round(12)[:3]
    array([0.5, 0.5, 0.5])
    """
    return _norm(curvature_normal(points, closed, dual))


def curvature_normal(points: ArrayLike, closed: bool = False, dual: ArrayLike | None = None) -> Array:
    """Curvature normal H = kappa n at every point of a curve, in 1/length (2.22).

    Parameters
    ----------
    points : array_like, shape (n, 2) or (n, 3)
        Successive points of the curve, n >= 6, or n >= 3 where it is closed.
    closed : bool
        Whether the last point is followed by the first one, which is not repeated.
    dual : array_like, shape (n - 1, d), or (n, d) where closed, optional
        Cell edges: ``dual[j]`` is a point of the curve between ``points[j]`` and ``points[j + 1]``.
        The length of a cell is then |dual[j] - dual[j - 1]| (2.30); without them, and in the two
        cells at the ends of an open curve, it is half the sum of the two edges at the point.

    Returns
    -------
    ndarray, shape (n, 2) or (n, 3)
        H, pointing to the centre of curvature. Never NaN.

    Raises
    ------
    ValueError
        For a wrong shape, too few points, points that are not finite, and successive points that
        coincide to rounding, the first and last of a closed curve included.

    See Also
    --------
    staggered : points and dual points from a mapping.

    Examples
    --------
    >>> import numpy as np, quadcurv as qc
    >>> t = np.linspace(0, 2 * np.pi, 60, endpoint=False)
    >>> circle = np.column_stack([2 * np.cos(t), 2 * np.sin(t)])
    >>> qc.curves.curvature_normal(circle, closed=True).round(12)[0] + 0.0
    array([-0.5,  0. ])
    """
    position, _ = _positions("points", points, closed)
    tangent, length, _ = _edges(position, closed)
    cell = (length[1:-2] + length[2:-1]) / 2
    if dual is not None:
        edge, _ = _positions("dual", dual, closed, like=position)
        if closed:
            cell = _norm(edge - np.roll(edge, 1, axis=0))
        else:
            cell[1:-1] = _norm(np.diff(edge, axis=0))
    normal: Array = np.diff(tangent[1:-1], axis=0) / cell[:, None]
    return normal


def frenet_frame(points: ArrayLike, closed: bool = False) -> FrenetFrame:
    """Frenet frame at every point of a curve (1.2; the normal by 2.23 in place of 2.31).

    Tangent and normal bisect the two edges at a point, so that the frame is orthonormal; the normal
    has the direction of `curvature_normal`.

    Parameters
    ----------
    points, closed
        As for `curvature_normal`.

    Returns
    -------
    tangent, normal : ndarray, shape (n, 2) or (n, 3)
        The normal points to the centre of curvature and is NaN where the curve is straight to
        rounding: where it turns by less than the rounding of the largest coordinate over the length
        of the edges. The tangent is NaN where the curve folds back on itself.
    binormal : ndarray, shape (n, 3)
        tangent x normal, NaN with them. In the plane it is (0, 0, 1) where the curve turns left and
        (0, 0, -1) where it turns right.

    Raises
    ------
    ValueError
        As `curvature_normal`.

    Examples
    --------
    >>> import numpy as np, quadcurv as qc
    >>> helix = qc.curves.helix()
    >>> frame = qc.curves.frenet_frame(helix.mapping(np.linspace(0, 4 * np.pi, 200)))
    >>> bool(np.abs(np.einsum("ij,ij->i", frame.tangent, frame.normal)).max() < 1e-12)
    True
    """
    position, eps = _positions("points", points, closed)
    edge, _, rounding = _edges(position, closed, eps)
    before, after = edge[1:-2], edge[2:-1]
    tangent = _unit(before + after, rounding[1:-1])
    normal = _unit(after - before, rounding[1:-1])
    return FrenetFrame(tangent, normal, np.cross(_in_space(tangent), _in_space(normal)))


def torsion(points: ArrayLike, closed: bool = False) -> Array:
    """Torsion tau at every point of a curve, in 1/length, positive on a right-handed helix.

    Each edge has dn/ds, the difference of its two points' normals over a step s, and of
    tau b = dn/ds + kappa t (2.55) the part along its binormal b = t x n; a point takes the mean of its
    two edges. s is a third of the three edges around. On even spacing that is the primal spacing
    |t_(1)|, by which (2.54) should divide, and the result is the thesis's own, with a sign.

    Parameters
    ----------
    points, closed
        As for `curvature_normal`. A plane curve has torsion 0.

    Returns
    -------
    ndarray, shape (n,)
        NaN at points whose normal, or a neighbour's, is NaN (see `frenet_frame`): torsion is not
        defined on a straight line. Within two points of an inflection, where the normal turns over, it
        is not to be trusted.

    Raises
    ------
    ValueError
        As `curvature_normal`.

    Notes
    -----
    Of second order where the spacing is even or varies smoothly, of first order where it jumps.
    Rounding of the coordinates X adds eps |X| / (kappa h^3).

    256 points of ``helix()`` give an error of 2.4e-5 (tau = 0.4) on even steps and of 7e-5 on steps that
    vary by up to half. Dividing by the edge alone, as (2.54) does once its slip is mended, gives the same
    on even steps, less than half the error where steps vary slowly (1.9e-5 against 4.4e-5 on the twisted
    cubic), and does not converge where they jump: 0.2 off. The triple product t.(n_j x n_{j+1})/s has
    four times the error on even steps.

    Examples
    --------
    >>> import numpy as np, quadcurv as qc
    >>> helix = qc.curves.helix(radius=1.0, rise=0.5)
    >>> tau = qc.curves.torsion(helix.mapping(np.linspace(0, 4 * np.pi, 400)))
    >>> round(float(tau[200]), 3)
    0.4
    """
    position, eps = _positions("points", points, closed)
    tangent, length, rounding = _edges(position, closed, eps)
    normal = _in_space(_unit(np.diff(tangent, axis=0), rounding))
    before, after = normal[:-1], normal[1:]
    # turns back a normal that an inflection reversed
    after = np.copysign(1, _dot(before, after))[:, None] * after
    binormal = np.cross(_in_space(tangent[1:-1]), before + after)
    binormal = _unit(binormal, np.zeros(len(binormal)))
    tau = 3 * _dot(after - before, binormal) / (length[:-2] + length[1:-1] + length[2:])
    mean: Array = (tau[:-1] + tau[1:]) / 2
    return mean


def staggered(mapping: Function, parameters: ArrayLike, period: float | None = None) -> tuple[Array, Array]:
    """Primal points at the given parameters and dual points halfway between them.

    Parameters
    ----------
    mapping : callable
        From parameters of shape (m,) to points of shape (m, 2) or (m, 3).
    parameters : array_like, shape (n,)
        Increasing parameters of the primal points.
    period : float, optional
        Of the parameter on a closed curve, where one more dual point lies between the last primal
        point and the first.

    Returns
    -------
    points, dual : ndarray
        Arguments of `curvature` and `curvature_normal`.

    Raises
    ------
    ValueError
        For parameters that are not one-dimensional, finite and increasing, or longer than a period.

    Notes
    -----
    The circle is exact for any spacing with dual points halfway between primal ones, which is what
    (2.48) needs. The thesis puts primal points halfway between dual ones instead: the same on even
    spacing, but elsewhere exact only where cell widths grow linearly, and not consistent where they
    jump.

    Examples
    --------
    >>> import numpy as np, quadcurv as qc
    >>> ellipse = qc.curves.ellipse()
    >>> t = np.linspace(-np.pi, np.pi, 64, endpoint=False)
    >>> points, dual = qc.curves.staggered(ellipse.mapping, t, period=2 * np.pi)
    >>> qc.curves.curvature(points, closed=True, dual=dual).shape
    (64,)
    """
    t = np.asarray(parameters, dtype=float)
    if t.ndim != 1 or not np.isfinite(t).all() or not (np.diff(t) > 0).all():
        raise ValueError("parameters must be one-dimensional, finite and increasing")
    if period is not None:
        if not t[0] + period > t[-1]:
            raise ValueError(f"parameters must lie within one period of {period:g}")
        t = np.append(t, t[0] + period)
    dual = mapping((t[1:] + t[:-1]) / 2)
    return mapping(t if period is None else t[:-1]), dual


def _positions(name: str, points: ArrayLike, closed: bool, like: Array | None = None) -> tuple[Array, float]:
    """Copy points to float64, checked, and find the rounding unit of the type they came in."""
    try:
        given = np.asarray(points)
        position = given.astype(float, casting="same_kind")
    except (TypeError, ValueError) as error:
        raise ValueError(f"{name} must be an array of real numbers") from error
    if like is not None:
        expected = (len(like) if closed else len(like) - 1, like.shape[1])
        if position.shape != expected:
            raise ValueError(f"{name} must have shape {expected}, got {position.shape}")
    if position.ndim != 2 or position.shape[1] not in (2, 3):
        raise ValueError(f"{name} must have shape (n, 2) or (n, 3), got {position.shape}")
    least = 3 if closed else _STENCIL
    if like is None and len(position) < least:
        kind = "a closed" if closed else "an open"
        raise ValueError(f"{name}: {kind} curve needs at least {least} points, got {len(position)}")
    _refuse(name, ~np.isfinite(position).all(axis=1), "not finite")
    eps = float(np.finfo(given.dtype if given.dtype.kind == "f" else float).eps)
    length = _norm(np.diff(position, axis=0, append=position[:1]))
    coincident = length <= 4 * eps * np.abs(position).max()
    if closed and coincident[-1]:
        raise ValueError(f"{name}: the first point of a closed curve is repeated at the end")
    _refuse(name, coincident[: None if closed else -1], "at the place of the next one")
    return position, eps


def _refuse(name: str, bad: NDArray[np.bool_], what: str) -> None:
    if bad.any():
        raise ValueError(
            f"{name}: {bad.sum()} of {len(bad)} points {what}, the first is point {bad.argmax()}"
        )


def _edges(position: Array, closed: bool, eps: float = 0.0) -> tuple[Array, Array, Array]:
    """Continue the curve by two points at each end: its own where it is closed, else ghosts.

    Returns unit tangents and lengths of the n + 3 edges, and the rounding of the turn of the tangent at
    the n + 2 points between them.
    """
    if closed:
        before, after = position[-2:], position[:2]
        gain = np.ones(len(position) + 4)
    else:
        (before, first), (after, last) = _ghosts(position), _ghosts(position[::-1])
        before = before[::-1]
        gain = np.concatenate([first[::-1], np.ones(len(position)), last])
    edge = np.diff(np.concatenate([before, position, after]), axis=0)
    length = _norm(edge)
    rounding = 2 * eps * np.abs(position).max() * (gain[:-1] + gain[1:]) / length
    return edge / length[:, None], length, rounding[:-1] + rounding[1:]


def _ghosts(position: Array) -> tuple[Array, Array]:
    """Extrapolate two points before the first one; also the factors by which rounding grows.

    Lagrange's formula in chord length s, at steps that go on growing as the first two do.
    """
    position = position[:_STENCIL]
    s = np.append(0, np.cumsum(_norm(np.diff(position, axis=0))))
    growth = np.clip(s[1] / (s[2] - s[1]), 0.8, 1.25)
    others = [np.delete(s, j) for j in range(len(s))]
    weights = np.array(
        [
            [np.prod((ghost - o) / (node - o)) for node, o in zip(s, others, strict=True)]
            for ghost in -s[1] * np.array([growth, growth + growth**2])
        ]
    )
    return position[0] + weights @ (position - position[0]), np.abs(weights).sum(axis=1)


def _norm(vectors: Array) -> Array:
    norm: Array = np.hypot.reduce(vectors, axis=-1)  # neither overflows nor underflows
    return norm


def _unit(vectors: Array, tolerance: Array) -> Array:
    norm = _norm(vectors)[:, None]
    return np.divide(vectors, norm, out=np.full_like(vectors, np.nan), where=norm > tolerance[:, None])


def _dot(a: Array, b: Array) -> Array:
    product: Array = np.einsum("ij,ij->i", a, b)
    return product


def _in_space(vectors: Array) -> Array:
    return np.pad(vectors, ((0, 0), (0, 3 - vectors.shape[1])))
