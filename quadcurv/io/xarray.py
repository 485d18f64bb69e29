"""Labelled arrays of xarray as grids, and results with their labels."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from quadcurv.extras import need
from quadcurv.io.base import Library, no_mesh, register
from quadcurv.mesh import ChunkedGrid
from quadcurv.types import MeshError

# Powers of length that results have as units; others have none, or those of what was given.
_POWERS = {
    "mean_curvature": -1, "mean_curvature_normal": -1, "gaussian_curvature": -2, "k1": -1, "k2": -1,
    "dual_areas": 2, "noise": 1,
}  # fmt: skip
_NAMES = {
    "mean_curvature": "mean curvature (k1 + k2) / 2",
    "mean_curvature_normal": "mean curvature normal",
    "gaussian_curvature": "Gaussian curvature k1 k2",
    "k1": "larger principal curvature",
    "k2": "smaller principal curvature",
    "vertex_normals": "unit normal",
    "dual_areas": "area of a vertex",
    "laplace_beltrami": "Laplace-Beltrami operator",
}
_VECTORS = {"mean_curvature_normal", "vertex_normals", "direction1", "direction2", "normal"}


def from_xarray(
    points: Any, dims: Sequence[str], wrap: Sequence[bool] = (False, False), mask: Any = None
) -> ChunkedGrid:
    """Make a grid of a DataArray; what verbs give of it are DataArrays, too.

    Parameters
    ----------
    points : xarray.DataArray or xarray.Dataset
        Positions; of a Dataset its three variables x, y, z of the same dimensions, in that order. Of chunked
        ones (dask) results are lazy.
    dims : (str, str, str) or (str, str)
        Names of the dimensions of rows, of columns, and of the three coordinates; the last one is not
        named of a Dataset. The order of the first two decides the sign of H, see
        :class:`quadcurv.QuadGrid`: hence they have to be named. All other dimensions, such as time, are
        kept: each of their entries is a grid.
    wrap : (bool, bool)
        Whether rows, or columns, are closed.
    mask : DataArray of bool or "nan", optional
        See :class:`quadcurv.ChunkedGrid`.

    Returns
    -------
    ChunkedGrid
        Results keep dimensions, coordinates and their order; ``units`` of positions become those of the
        result ("m" becomes "m-1" of H and "m-2" of K).

    Raises
    ------
    ImportError
        xarray is not installed.
    MeshError
        A ValueError: dimensions that are not there, or not three coordinates.
    TypeError
        Neither a DataArray nor a Dataset.

    Examples
    --------
    >>> import numpy as np, xarray as xr, quadcurv as qc
    >>> ball = qc.surfaces.torus().sample((32, 24))[0]
    >>> points = xr.DataArray(ball.points, dims=("u", "v", "xyz"), attrs={"units": "mm"})
    >>> H = qc.mean_curvature(qc.from_xarray(points, ("u", "v", "xyz"), ball.wrap), "liu")
    >>> H.dims, H.attrs["units"], H.name
    (('u', 'v'), 'mm-1', 'mean_curvature')
    """
    need("xarray")
    import xarray

    names = [dims] if isinstance(dims, str) else list(dims)
    if isinstance(points, xarray.Dataset):
        points, names = _joined(points, xarray), [*names, "xyz"] if len(names) == 2 else names
    elif not isinstance(points, xarray.DataArray):
        raise TypeError(f"points: expected a DataArray or a Dataset, got {type(points).__name__}")
    if len(names) != 3 or len(set(names)) != 3 or not set(names) <= set(points.dims):
        raise MeshError(
            f"dims: expected names of rows, columns and coordinates among {points.dims}, got {dims}"
        )
    if points.sizes[names[2]] != 3:
        raise MeshError(f"dims: {names[2]} has {points.sizes[names[2]]} entries, expected x, y and z")
    in_order = points.transpose(..., *names)
    if isinstance(mask, xarray.DataArray):
        lead = [d for d in in_order.dims[:-3] if d in mask.dims]
        mask = mask.transpose(*lead, *names[:2]).data
    grid = ChunkedGrid(in_order.data, wrap, mask)

    def label(values: Any, name: str) -> Any:
        return _labelled(values, name, points, in_order, names)

    return grid.replaced(label=label)


def _joined(points: Any, xarray: Any) -> Any:
    """Three variables as one, with their units if they agree."""
    if len(points.data_vars) != 3:
        raise MeshError(f"points: a Dataset of {list(points.data_vars)}, expected three variables x, y and z")
    units = {variable.attrs.get("units") for variable in points.data_vars.values()}
    if len(units) > 1:
        raise MeshError(f"points: coordinates in different units: {sorted(map(str, units))}")
    joined = points.to_dataarray("xyz")
    unit = units.pop()
    return joined.assign_attrs({} if unit is None else {"units": unit})


def _labelled(values: Any, name: str, points: Any, in_order: Any, names: list[str]) -> Any:
    import xarray

    dims, vector = list(in_order.dims[:-1]), names[2]
    more = values.ndim - len(dims)
    if more:
        other = "quantity" if name in ("standard_error", "interval") else "function"
        dims.append(vector if name in _VECTORS else other)
    kept = [d for d in points.dims if d in dims]
    coordinates = {key: own for key, own in points.coords.items() if set(own.dims) <= set(dims)}
    attributes = {"long_name": _NAMES.get(name, name.replace("_", " "))}
    if (unit := points.attrs.get("units")) and name in _POWERS:
        power = _POWERS[name]
        base = unit if str(unit).isalpha() else f"({unit})"
        attributes["units"] = unit if power == 1 else f"{base}{power}"
    found = xarray.DataArray(values, dims=dims, coords=coordinates, name=name, attrs=attributes)
    return found.transpose(*kept, *[d for d in dims if d not in kept])


def _needs_names(array: Any) -> bool:
    raise TypeError(
        f"mesh: a {type(array).__name__} of xarray; qc.from_xarray(points, (rows, columns, coordinates)) "
        "names its dimensions, whose order decides the sign of H"
    )


register(Library(("xarray",), no_mesh, is_array=_needs_names))
