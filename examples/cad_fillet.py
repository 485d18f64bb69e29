"""
A fillet
========

Where a CAD program rounds an edge, a flat side, a quarter of a cylinder and another flat side meet with one
tangent but different curvatures: 0, 1 / (2 r) and 0.
"""

import numpy as np

import quadcurv as qc
from quadcurv.viewing import Style, maps

RADIUS = 5.0  # millimetres
side, around = np.linspace(20, 0, 14, endpoint=False), np.linspace(0, np.pi / 2, 13)
flat = np.stack([side, np.zeros_like(side)], axis=-1)
arc = RADIUS * np.stack([-np.sin(around), np.cos(around) - 1], axis=-1)
rest = np.stack([np.full_like(side, -RADIUS), -RADIUS - side[::-1]], axis=-1)
profile = np.concatenate([flat, arc, rest])
along = np.linspace(30, 0, 22)
x, z = (np.repeat(profile[:, [k]], along.size, axis=1) for k in (0, 1))
part = qc.QuadGrid(np.stack([x, np.broadcast_to(along, x.shape), z], axis=-1))

# %%
# Finite volumes look at one ring of quads, and so see the jump between two vertices; jets look further, and
# ring on both sides of it.
found = qc.compare(part, ["finite_volume", "jet-2", "jet"])
maps(found, "mean_curvature", Style(camera=(-1, -1, 0.9)))


# %%
# In the middle of the arc all agree with 1 / (2 r).
def main() -> float:
    """Return 2 r |H| in the middle of the arc, by finite volumes."""
    row = np.argmin(np.abs(np.arctan2(-profile[:, 0], profile[:, 1] + RADIUS) - np.pi / 4))
    return float(2 * RADIUS * np.abs(found.mean_curvature["finite_volume"][row]).max())


print(main())
