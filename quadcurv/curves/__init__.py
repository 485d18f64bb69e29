"""Curvature and torsion of curves in the plane and in space by the finite-volume scheme.

Chapter 2 of J. T. Hutchins, *Computing Curvature and Curvature Normals on Smooth Logically
Cartesian Surface Meshes* (Boise State University, 2013), whose equations are cited by number.
The curvature normal of a cell is the jump of the unit tangent over the cell's length,

    H_j = (t_{j+1/2} - t_{j-1/2}) / L_j,    t_{j+1/2} = (X_{j+1} - X_j) / |X_{j+1} - X_j|.   (2.22)

Open curves are continued over both ends by two ghost points on the quintic in chord length through
the six nearest points, so that one formula serves every point. (The weights 6 -15 20 -15 6 -1 of an
even parameter settle sooner on even spacing, and on any other give a straight line curved ends.)
"""

from __future__ import annotations

from quadcurv.curves.catalogue import Curve, circle, ellipse, euler_spiral, helix, line
from quadcurv.curves.finite_volumes import (
    FrenetFrame,
    curvature,
    curvature_normal,
    frenet_frame,
    staggered,
    torsion,
)

__all__ = [
    "Curve",
    "FrenetFrame",
    "circle",
    "curvature",
    "curvature_normal",
    "ellipse",
    "euler_spiral",
    "frenet_frame",
    "helix",
    "line",
    "staggered",
    "torsion",
]
