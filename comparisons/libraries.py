"""Curvature by other libraries, each called as its users would call it.

On triangles where a library knows no quads (each quad cut from its first to its third vertex). Results are
brought to ours: H rather than 2 H, pointwise rather than integrated, positive on a sphere seen from outside.
"""

from __future__ import annotations

import importlib
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from comparisons import cgal
from comparisons.common import OUTPUT
from quadcurv import QuadMesh, curvatures, gaussian_curvature, mean_curvature
from quadcurv.schemes import SCHEMES, Fit

Array = NDArray[np.float64]
Found = dict[str, Array]
OURS = "quadcurv"
QUANTITIES = ("H", "K", "k1", "k2")
CUT = "cut into triangles first"
KEPT = "as they are"


@dataclass(frozen=True)
class Method:
    """One way to curvature.

    Attributes
    ----------
    name, library : str
    call : callable
        QuadMesh -> (n,) arrays by the names of `QUANTITIES`, those that it has, in our sign and factor.
    quads : str
        What becomes of quads.
    note : str
        What was done to the result.
    needs : tuple of str
        Other packages that the call imports.
    """

    name: str
    library: str
    call: Callable[[QuadMesh], Found]
    quads: str = CUT
    note: str = ""
    needs: tuple[str, ...] = ()

    @property
    def missing(self) -> str:
        """Why it cannot be called here; empty if it can. pymeshlab, say, may lack a system library."""
        if self.library == "CGAL":
            return cgal.program(OUTPUT)[1]
        for name in (self.library, *self.needs):
            try:
                with warnings.catch_warnings():
                    warnings.simplefilter("ignore")  # of what they import in their turn
                    importlib.import_module(name)
            except ImportError as error:
                return str(error)
        return ""


def triangles(mesh: QuadMesh) -> NDArray[np.int64]:
    """Triangles of a mesh, quads cut from their first to their third vertex."""
    faces = mesh.faces.astype(np.int64)
    return np.concatenate((faces[:, :3], faces[faces[:, 3] >= 0][:, [2, 3, 0]]))


def from_principal(k1: Array, k2: Array) -> Found:
    """All four of the principal curvatures, in any order."""
    k1, k2 = np.maximum(k1, k2), np.minimum(k1, k2)
    return {"H": (k1 + k2) / 2, "K": k1 * k2, "k1": k1, "k2": k2}


def _from_laplacian(points: Array, cut: Any, laplacian: Any, area: Array) -> Array:
    """H = -(L x / 2 A) . n, L negative semi-definite, n by libigl."""
    import igl

    with np.errstate(divide="ignore", invalid="ignore"):
        Hn = (laplacian @ points) / (2 * area[:, None])
    return -np.einsum("ix,ix->i", Hn, igl.per_vertex_normals(points, cut))


def _igl_cotan(mesh: QuadMesh) -> Found:
    import igl

    points, cut = np.array(mesh.points), triangles(mesh)
    area = igl.massmatrix(points, cut, igl.MASSMATRIX_TYPE_VORONOI).diagonal()
    H = _from_laplacian(points, cut, igl.cotmatrix(points, cut), area)
    return {"H": H, "K": igl.gaussian_curvature(points, cut) / area}


def _igl_bunge(mesh: QuadMesh) -> Found:
    import igl

    sides = np.where(mesh.faces[:, 3] < 0, 3, 4)
    corners = mesh.faces[np.arange(4) < sides[:, None]].astype(np.int64)
    points = np.array(mesh.points)
    L, M, _ = igl.cotmatrix(points, corners, np.concatenate(([0], np.cumsum(sides))))
    return {"H": _from_laplacian(points, triangles(mesh), L, np.asarray(M.sum(axis=1)).ravel())}


def _igl_principal(mesh: QuadMesh, radius: int = 5) -> Found:
    import igl

    _, _, k1, k2, _ = igl.principal_curvature(np.array(mesh.points), triangles(mesh), radius)
    return from_principal(k1, k2)


def _vtk(mesh: QuadMesh) -> Found:
    import pyvista

    cut = triangles(mesh)
    surface = pyvista.PolyData(np.array(mesh.points), np.c_[np.full(len(cut), 3), cut].ravel())
    kinds = {"H": "mean", "K": "gaussian", "k1": "maximum", "k2": "minimum"}
    return {name: np.asarray(surface.curvature(kind)) for name, kind in kinds.items()}


def vtk_quads(mesh: QuadMesh) -> Array:
    """H by VTK of the quads themselves, which it takes for triangles."""
    import pyvista

    quads = mesh.faces[mesh.faces[:, 3] >= 0]
    surface = pyvista.PolyData(np.array(mesh.points), np.c_[np.full(len(quads), 4), quads].ravel())
    return np.asarray(surface.curvature("mean"))


def meshlab(mesh: QuadMesh, filter_name: str, **parameters: Any) -> Array:
    """What a filter of MeshLab leaves at the vertices."""
    import pymeshlab

    meshes = pymeshlab.MeshSet(verbose=False)
    meshes.add_mesh(pymeshlab.Mesh(np.array(mesh.points), triangles(mesh).astype(np.int32)))
    getattr(meshes, filter_name)(**parameters)
    return np.asarray(meshes.current_mesh().vertex_scalar_array())


def _discrete(mesh: QuadMesh) -> Found:
    name = "compute_scalar_by_discrete_curvature_per_vertex"
    H = meshlab(mesh, name, curvaturetype="Mean Curvature")
    return {"H": H, "K": meshlab(mesh, name, curvaturetype="Gaussian Curvature")}


def directions(mesh: QuadMesh, method: str, kind: str = "Mean Curvature") -> Array:
    """One kind of curvature of MeshLab's principal directions."""
    name = "compute_curvature_principal_directions_per_vertex"
    return meshlab(mesh, name, method=method, curvcolormethod=kind, autoclean=False)


def _directions(mesh: QuadMesh, method: str) -> Found:
    kinds = {"H": "Mean Curvature", "K": "Gaussian Curvature", "k1": "Max Curvature", "k2": "Min Curvature"}
    found = {name: directions(mesh, method, kind) for name, kind in kinds.items()}
    k1, k2 = found["k1"], found["k2"]
    return {**found, "k1": np.fmax(k1, k2), "k2": np.fmin(k1, k2)}


def _apss(mesh: QuadMesh) -> Found:
    name = "compute_curvature_and_color_apss_per_vertex"
    H = meshlab(mesh, name, curvaturetype="Mean") / 2
    K = meshlab(mesh, name, curvaturetype="Gauss")
    k1, k2 = (meshlab(mesh, name, curvaturetype=kind) for kind in ("K1", "K2"))
    return {"H": H, "K": K, "k1": np.fmax(k1, k2), "k2": np.fmin(k1, k2)}


def _trimesh(mesh: QuadMesh) -> Found:
    import trimesh

    surface = trimesh.Trimesh(mesh.points, triangles(mesh), process=False)
    radius = 2 * np.median(surface.edges_unique_length)
    H = trimesh.curvature.discrete_mean_curvature_measure(surface, surface.vertices, radius)
    K = trimesh.curvature.discrete_gaussian_curvature_measure(surface, surface.vertices, radius)
    return {"H": H / (np.pi * radius**2), "K": K / (np.pi * radius**2)}


def _robust(mesh: QuadMesh) -> Found:
    robust_laplacian = importlib.import_module("robust_laplacian")
    cut = triangles(mesh)
    L, M = robust_laplacian.mesh_laplacian(np.array(mesh.points), cut)
    return {"H": _from_laplacian(mesh.points, cut, -L, M.diagonal())}


def _potpourri(mesh: QuadMesh) -> Found:
    potpourri3d = importlib.import_module("potpourri3d")
    points, cut = np.array(mesh.points), triangles(mesh)
    areas = potpourri3d.vertex_areas(points, cut)
    return {"H": _from_laplacian(points, cut, -potpourri3d.cotan_laplacian(points, cut), areas)}


def _gpytoolbox(mesh: QuadMesh) -> Found:
    gpytoolbox = importlib.import_module("gpytoolbox")
    points, cut = np.array(mesh.points), triangles(mesh)
    areas = gpytoolbox.massmatrix(points, cut, type="barycentric").diagonal()
    H = _from_laplacian(points, cut, -gpytoolbox.cotangent_laplacian(points, cut), areas)
    return {"H": H, "K": gpytoolbox.angle_defect(points, cut) / areas}


def _pygel(mesh: QuadMesh, quads: bool, principal: bool) -> Found:
    hmesh = importlib.import_module("pygel3d.hmesh")
    if quads:
        made = hmesh.Manifold()
        for face in mesh.faces:
            made.add_face(mesh.points[face[face >= 0]])
        hmesh.stitch(made)
        made.cleanup()
    else:
        made = hmesh.Manifold.from_triangles(mesh.points, triangles(mesh))
    # Its vertices come in an order of their own.
    at = cKDTree(mesh.points).query(np.asarray(made.positions()))[1]

    def gather(values: Sequence[float]) -> Array:
        out = np.full(len(mesh.points), np.nan)
        out[at] = values
        return out

    vertices = list(made.vertices())
    if principal:
        k2, k1 = zip(*(made.principal_curvatures(v)[:2] for v in vertices), strict=True)
        return from_principal(gather(k1), gather(k2))
    H = gather([made.mean_curvature(v) for v in vertices])
    return {"H": H, "K": gather([made.gaussian_curvature(v) for v in vertices])}


def _cgal(mesh: QuadMesh, degree: int, rings: int) -> Found:
    return from_principal(*cgal.principal(mesh, degree, rings, OUTPUT).T)


PEERS = (
    Method("libigl cotan, Voronoi", "igl", _igl_cotan, note="-(L x / 2 M) . n; angle defect / M"),
    Method("libigl Bunge", "igl", _igl_bunge, KEPT, "-(L x / 2 M) . n"),
    *(
        Method(f"libigl principal, radius {r}", "igl", partial(_igl_principal, radius=r), note=note)
        for r, note in ((2, ""), (3, ""), (5, "the default radius"))
    ),
    Method("VTK", "pyvista", _vtk, note="of vtkCurvatures, as it is"),
    Method("MeshLab discrete", "pymeshlab", _discrete, note="as it is"),
    Method("MeshLab Taubin", "pymeshlab", partial(_directions, method="Taubin approximation")),
    Method("MeshLab quadric", "pymeshlab", partial(_directions, method="Quadric Fitting")),
    Method("MeshLab APSS", "pymeshlab", _apss, note="gives 2 H: halved"),
    Method(
        "trimesh",
        "trimesh",
        _trimesh,
        note="integrated over a ball of two edges: over pi r^2",
        needs=("rtree",),
    ),
    Method("robust_laplacian", "robust_laplacian", _robust, note="-(L x / 2 M) . n"),
    Method("potpourri3d", "potpourri3d", _potpourri, note="-(L x / 2 A) . n"),
    Method("gpytoolbox", "gpytoolbox", _gpytoolbox, note="-(L x / 2 M) . n; angle defect / M, barycentric"),
    Method("PyGEL", "pygel3d", partial(_pygel, quads=False, principal=False), note="as it is"),
    Method("PyGEL quadric", "pygel3d", partial(_pygel, quads=False, principal=True)),
    Method("PyGEL quadric on quads", "pygel3d", partial(_pygel, quads=True, principal=True), KEPT),
    *(
        Method(
            f"CGAL jet {degree}, {rings} rings",
            "CGAL",
            partial(_cgal, degree=degree, rings=rings),
            KEPT,
            "rings of faces, outer side by our normals",
        )
        for degree, rings in ((2, 1), (2, 2), (4, 2), (4, 3))
    ),
)


def ours() -> tuple[Method, ...]:
    """Our schemes as methods."""

    def call(mesh: QuadMesh, name: str) -> Found:
        if name == "angle_defect":
            return {"K": gaussian_curvature(mesh, name)}
        if not isinstance(SCHEMES[name], Fit):
            return {"H": mean_curvature(mesh, name)}
        found = curvatures(mesh, name)
        return {"H": found.mean, "K": found.gaussian, "k1": found.k1, "k2": found.k2}

    return tuple(Method(name, OURS, partial(call, name=name), KEPT) for name in (*SCHEMES, "angle_defect"))


UNUSABLE: Mapping[str, str] = {
    "VTK on quads": "vtkCurvatures takes a quad's corners for a triangle's: H = {vtk:.2f} on a unit sphere",
    "libigl on quads": "cotmatrix takes an array of four columns for tetrahedra, principal_curvature reads "
    "three columns of it; neither says so",
    "robust_laplacian, potpourri3d on quads": "raise a ValueError",
    "MeshLab, trimesh on quads": "split quads into triangles on loading",
    "MeshLab principal component analysis": "not a curvature: H = {pca:.0f} on a unit sphere",
    "MeshLab normal cycles": "integrated over an unstated region: H = {cycles:.3f} on a unit sphere",
    "MeshLab scale-dependent quadrics": "end the process (double free) on cells of aspect 20:1",
    "MeshLab RIMLS": "H = {rimls:.2f} on a unit sphere",
    "pmp": "no package of it by name, neither for Python nor in Debian",
    "CGAL's interpolated corrected curvatures": "came with CGAL 6; Debian's package may be older",
}


def quirks(sphere: QuadMesh) -> dict[str, str]:
    """What cannot be used, with the number on a unit sphere that shows it."""
    values = {"vtk": float(np.median(vtk_quads(sphere)))}
    if not next(m for m in PEERS if m.library == "pymeshlab").missing:
        values["pca"] = float(np.median(directions(sphere, "Principal Component Analysis")))
        values["cycles"] = float(np.median(directions(sphere, "Normal Cycles")))
        rimls = "compute_curvature_and_color_rimls_per_vertex"
        values["rimls"] = float(np.median(meshlab(sphere, rimls)))
    return {
        name: why.format(**values)
        for name, why in UNUSABLE.items()
        if "{" not in why or why.split("{")[1].split(":")[0] in values
    }
