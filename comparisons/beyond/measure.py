"""What is measured beyond the thesis."""

from __future__ import annotations

from math import comb
from typing import Any

import numpy as np
from numpy.typing import NDArray

from comparisons.measured import Measured, rate_in
from quadcurv import QuadGrid, QuadMesh, mean_curvature
from quadcurv.refinement import fitted_rate
from quadcurv.schemes import SCHEMES, Laplacian, cotan
from quadcurv.stencils import grid_faces
from quadcurv.surfaces import (
    Surface,
    catenoid,
    cubed_ellipsoid,
    cubed_sphere,
    cylinder,
    elliptic_paraboloid,
    sphere,
    tanh_sheet,
    torus,
)

Array = NDArray[Any]

FV = "finite_volume"
SIZES = np.array([16, 32, 64, 128, 256])


# Boundaries

TREATMENTS = {"none": None, "quadratic ghosts": 2, "cubic ghosts": 3, "quartic ghosts": 4}
BORDERED = (tanh_sheet(), catenoid())


def with_ghosts(grid: QuadGrid, degree: int) -> QuadGrid:
    """Grid with one layer of ghosts by extrapolation of that degree, in the index, on each open side."""
    weights = np.array([(-1) ** k * comb(degree + 1, k + 1) for k in range(degree + 1)], float)
    points = grid.points
    for axis in (0, 1):
        if not grid.wrap[axis]:
            before = np.tensordot(weights, points.take(range(degree + 1), axis), (0, axis))
            after = np.tensordot(weights, points.take(range(-1, -degree - 2, -1), axis), (0, axis))
            points = np.concatenate((np.expand_dims(before, axis), points, np.expand_dims(after, axis)), axis)
    return QuadGrid(points, grid.wrap)


def border_curvature(grid: QuadGrid, degree: int | None) -> Array:
    """H by the finite-volume scheme with ghosts of that degree; without any, of open rings as they are."""
    if degree is not None:
        inner = tuple(slice(None) if wraps else slice(1, -1) for wraps in grid.wrap)
        return mean_curvature(with_ghosts(grid, degree), FV, boundary="nan")[inner]
    stencils, scheme = grid.stencils(), SCHEMES[FV]
    assert isinstance(scheme, Laplacian)
    stiffness, area = scheme.assemble(stencils)
    normal = stencils.ring_areas / np.linalg.norm(stencils.ring_areas, axis=1, keepdims=True)
    H = np.einsum("ix,ix->i", stiffness @ stencils.points, normal) / (2 * area)
    return np.asarray(H.reshape(grid.shape))


def border_errors(surface: Surface, n: int) -> dict[str, float]:
    """Largest error of H on the border by treatment, with the package's own, and inside."""
    grid, xi, eta = surface.sample((n, n))
    exact = surface.mean_curvature(xi, eta)
    border = ~grid.stencils().closed.reshape(grid.shape)
    found = {name: border_curvature(grid, degree) for name, degree in TREATMENTS.items()}
    found["package"] = mean_curvature(grid, FV)
    errors = {name: float(np.abs(H - exact)[border].max()) for name, H in found.items()}
    return errors | {"inside": float(np.abs(found["package"] - exact)[~border].max())}


def boundaries(into: Measured) -> None:
    """Error on the border by treatment, on the hyperbolic-tangent sheet and the catenoid."""
    names = (*TREATMENTS, "package", "inside")
    table: dict[str, Any] = {"n": SIZES}
    for surface in BORDERED:
        found = [border_errors(surface, n) for n in SIZES]
        table |= {f"{surface.name}: {name}": [e[name] for e in found] for name in names}
    columns = into.add("beyond_boundaries", table)
    for surface in BORDERED:
        for name in names:
            key = f"{surface.name}: {name}"
            into.numbers[f"border, {key}, at 256"] = columns.at(256, key)
            into.numbers[f"border, {key}, rate"] = rate_in(columns, key, 64)


# Extraordinary vertices

RINGS = ("valence 3, largest", "valence 4, largest", "valence 5, largest", "all, mean")
RING_SCHEMES = ("finite_volume", "liu", "cotan-6")


def icosahedral_sphere(n: int) -> QuadMesh:
    """Each triangle of an icosahedron cut into three quads of n x n, projected to the unit sphere."""
    import trimesh

    solid = trimesh.creation.icosahedron()
    corners = np.array(solid.vertices)[np.array(solid.faces)]  # (20, 3, 3)
    a = np.concatenate([np.roll(corners, -k, axis=1) for k in range(3)])
    first, middle, last = (a[:, 0] + a[:, 1]) / 2, a.mean(axis=1), (a[:, 0] + a[:, 2]) / 2
    s, t = np.meshgrid(*(np.linspace(0, 1, n + 1),) * 2, indexing="ij")
    weights = np.stack(((1 - s) * (1 - t), s * (1 - t), s * t, (1 - s) * t)).reshape(4, -1)
    points = np.einsum("cp,qcx->qpx", weights, np.stack((a[:, 0], first, middle, last), axis=1))
    points = points.reshape(-1, 3) / np.linalg.norm(points.reshape(-1, 3), axis=1, keepdims=True)
    one = grid_faces(np.arange((n + 1) ** 2, dtype=np.int32).reshape(n + 1, n + 1))
    faces = np.concatenate([one + k * (n + 1) ** 2 for k in range(len(a))])
    _, kept, label = np.unique(np.round(points, 9) + 0.0, axis=0, return_index=True, return_inverse=True)
    return QuadMesh(points[kept], label.ravel()[faces])


def cubed(surface: Surface, n: int) -> tuple[QuadMesh, Array]:
    """Welded mesh of a cubed surface and its exact H."""
    mesh, xi, eta = surface.sample((n, n), "faces")
    assert isinstance(mesh, QuadMesh)
    return mesh, surface.mean_curvature(xi, eta)


SOLIDS = {
    "cubed sphere": lambda n: cubed(cubed_sphere(), n),
    "cubed ellipsoid": lambda n: cubed(cubed_ellipsoid(), n),
    "icosahedral sphere": lambda n: (icosahedral_sphere(n), np.ones(1)),
}


def extraordinary(into: Measured) -> None:
    """Errors by valence where 3 or 5 quads meet."""
    sizes = SIZES[:-1] // 4
    table: dict[str, Any] = {"n": sizes}
    for solid, build in SOLIDS.items():
        for n in sizes:
            mesh, exact = build(n)
            valence = mesh.stencils().valence
            for scheme in RING_SCHEMES:
                e = np.abs(mean_curvature(mesh, scheme) - exact)
                groups = {f"valence {v}, largest": e[valence == v].max() for v in np.unique(valence)}
                for group, value in (groups | {"all, mean": e.mean()}).items():
                    table.setdefault(f"{solid}, {scheme}: {group}", []).append(float(value))
    columns = into.add("beyond_extraordinary", table)
    for key in columns:
        if key != "n":
            into.numbers[f"{key}, at 32"] = columns.at(32, key)
            into.numbers[f"{key}, rate"] = rate_in(columns, key, float(sizes[1]))


# Grids that are not smooth

JITTERS = (0.0, 0.05, 0.1, 0.2)
JITTERED = ("finite_volume", "liu", "cotan-4", "cotan-6", "cotan-8", "jet-2", "jet")


def jittered_torus(n: int, jitter: float) -> tuple[QuadGrid, Array]:
    """Torus whose points are moved within it by up to jitter times the spacing, and its exact H."""
    t = -np.pi + 2 * np.pi / n * np.arange(n)
    move = jitter * 2 * np.pi / n * np.random.default_rng(n).uniform(-1, 1, (2, n, n))
    xi, eta = np.meshgrid(t, t, indexing="ij") + move
    return QuadGrid(torus().mapping(xi, eta), (True, True)), torus().mean_curvature(xi, eta)


def not_smooth(into: Measured) -> None:
    """Schemes on a torus with 0, 5, 10 and 20 % of jitter."""
    sizes = SIZES[:-1]
    table: dict[str, Any] = {"n": sizes}
    for jitter in JITTERS:
        for n in sizes:
            grid, exact = jittered_torus(n, jitter)
            for scheme in JITTERED:
                e = np.abs(mean_curvature(grid, scheme) - exact)
                key = f"jitter {100 * jitter:.0f} %, {scheme}"
                table.setdefault(f"{key}: one-norm", []).append(float(e.mean()))
                table.setdefault(f"{key}: inf-norm", []).append(float(e.max()))
    columns = into.add("beyond_jitter", table)
    for key in columns:
        if key != "n":
            into.numbers[f"{key}, at 128"] = columns.at(128, key)
            into.numbers[f"{key}, rate"] = rate_in(columns, key, 32)


# Valence 8 and 4

AREA_SCHEMES = ("cotan-4", "cotan-8", "cotan-4-voronoi", "cotan-8-voronoi")
AREA_SURFACES = (cylinder(), torus(), sphere(), elliptic_paraboloid())


def valence_areas(into: Measured) -> None:
    """Cotan with barycentric and with Voronoi areas, on orthogonal grids and on another."""
    sizes = SIZES // 2
    table: dict[str, Any] = {"n": sizes}
    for surface in AREA_SURFACES:
        for layout in ("grid", "staggered"):
            for n in sizes:
                mesh, xi, eta = surface.sample((n, n), layout)
                exact = surface.mean_curvature(xi, eta)
                for scheme in AREA_SCHEMES:
                    e = np.abs(mean_curvature(mesh, scheme) - exact)
                    table.setdefault(f"{surface.name}, {layout}, {scheme}", []).append(float(e.mean()))
    columns = into.add("beyond_valence_8", table)
    for key in columns:
        if key != "n":
            into.numbers[f"areas, {key}: at 128"] = columns.at(128, key)
            into.numbers[f"areas, {key}: rate"] = fitted_rate(sizes[2:], columns[key][2:])
    stencils = cylinder().sample((64, 64))[0].stencils()
    for valence in (4, 8):
        third, dual = (cotan(valence, area).assemble(stencils)[1] for area in ("barycentric", "voronoi"))
        ratio = float((third / dual)[stencils.closed].mean())
        into.numbers[f"areas: barycentric over Voronoi, valence {valence}"] = ratio


STEPS = {
    "boundaries": boundaries,
    "extraordinary vertices": extraordinary,
    "grids that are not smooth": not_smooth,
    "areas of valence 4 and 8": valence_areas,
}
