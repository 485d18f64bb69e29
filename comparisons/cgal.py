"""CGAL's jets by a small program, compiled where a compiler, CGAL's and Eigen's headers are (libcgal-dev)."""

from __future__ import annotations

import hashlib
import os
import shutil
import subprocess
import tempfile
from functools import lru_cache
from pathlib import Path

import numpy as np
import scipy.sparse
from numpy.typing import NDArray

from quadcurv import QuadMesh, vertex_normals

SOURCE = Path(__file__).with_name("monge.cpp")
FLAGS = (
    "-O2",
    "-DNDEBUG",
    "-DCGAL_EIGEN3_ENABLED",
    "-DCGAL_DISABLE_GMP",
    "-DCGAL_DISABLE_MPFR",
    "-I/usr/include/eigen3",
)


@lru_cache(maxsize=1)
def program(cache: Path) -> tuple[Path | None, str]:
    """The compiled program, kept in a folder under a name of its source; or nothing and why."""
    compiler = os.environ.get("CXX") or shutil.which("g++") or shutil.which("c++")
    if not compiler:
        return None, "no C++ compiler"
    digest = hashlib.sha256(SOURCE.read_bytes() + " ".join(FLAGS).encode()).hexdigest()[:12]
    target = cache / f"monge-{digest}"
    if not target.exists():
        cache.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=cache) as folder:
            made = Path(folder, "monge")
            done = subprocess.run(
                [compiler, *FLAGS, str(SOURCE), "-o", str(made)], capture_output=True, text=True, check=False
            )
            if done.returncode:
                errors = [line for line in done.stderr.splitlines() if "error" in line]
                return None, f"does not compile: {(errors or ['no message'])[0]}"
            made.replace(target)
    return target, ""


def neighbourhoods(mesh: QuadMesh, rings: int) -> scipy.sparse.csr_array:
    """Vertices of so many rings of faces around each, itself left out."""
    faces = mesh.faces
    known = faces >= 0
    n = len(mesh.points)
    row = np.broadcast_to(np.arange(len(faces))[:, None], faces.shape)[known]
    corner = scipy.sparse.csr_array((np.ones(row.size), (row, faces[known])), shape=(len(faces), n))
    beside = (corner.T @ corner).astype(bool).astype(float)
    reached = beside
    for _ in range(rings - 1):
        reached = (reached @ beside).astype(bool).astype(float)
    reached = scipy.sparse.csr_array(reached - scipy.sparse.diags_array(reached.diagonal()))
    reached.eliminate_zeros()
    return reached


def principal(mesh: QuadMesh, degree: int, rings: int, cache: Path) -> NDArray[np.float64]:
    """(n, 2) k1 and k2."""
    path, why = program(cache)
    if path is None:
        raise ImportError(why)
    around = neighbourhoods(mesh, rings)
    sizes = np.array([len(mesh.points), around.nnz, degree])
    arrays = (
        sizes.astype(np.int64),
        np.asarray(mesh.points, np.float64),
        np.nan_to_num(vertex_normals(mesh)),
        around.indptr.astype(np.int64),
        around.indices.astype(np.int64),
    )
    with tempfile.TemporaryDirectory() as folder:
        given, found = Path(folder, "in"), Path(folder, "out")
        given.write_bytes(b"".join(a.tobytes() for a in arrays))
        subprocess.run([path, given, found], check=True)
        return np.fromfile(found).reshape(-1, 2)
