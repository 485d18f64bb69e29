"""What a scheme is: a stiffness matrix and a dual area at every vertex."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from scipy import sparse

from quadcurv.mesh import Floats, Stencils


@dataclass(frozen=True)
class Scheme:
    """A discrete Laplace-Beltrami operator, local to the corners of quads and triangles.

    With stiffness S and dual areas A the mean curvature normal is H n = -(S x) / (2 A) and the
    Laplace-Beltrami operator of f is -(S f) / A.

    Attributes
    ----------
    name : str
        Key in ``SCHEMES`` and label in tables and figures.
    order : int
        Order of convergence of H on smooth meshes of regular vertices; 0 where it does not converge.
    reference : str
        Where the formula stands.
    assemble : callable
        Stencils -> (S, A): csr_array (n, p) and float64 (n,).
    apply : callable
        Stencils -> (-S x, A): float64 (n, 3) and (n,), without building S where that can be avoided.
    """

    name: str
    order: int
    reference: str
    assemble: Callable[[Stencils], tuple[sparse.csr_array, Floats]]
    apply: Callable[[Stencils], tuple[Floats, Floats]]
