"""Reads a file with another library in a process of its own, and sends back plain arrays.

Started as a script by :mod:`quadcurv.io.isolation`; it knows nothing of the rest of the package. What it
sends on its standard output is a line of JSON, ``{"arrays": [[name, dtype, shape], ...], ...}``, and the
bytes of these arrays one after the other, or ``{"error": ...}`` alone.
"""

from __future__ import annotations

import json
import os
import sys
from typing import Any

import numpy as np

Answer = tuple[dict[str, Any], dict[str, Any]]


def limit(memory: int, seconds: int) -> None:
    """No more memory and processor time from here on, where the system knows such limits."""
    try:
        import resource
    except ImportError:  # Windows
        return
    used = sum(resource.getrusage(resource.RUSAGE_SELF)[:2])
    resource.setrlimit(resource.RLIMIT_CPU, (int(used) + seconds + 1,) * 2)
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    if os.path.exists("/proc/self/statm"):
        with open("/proc/self/statm") as file:
            taken = int(file.read().split()[0]) * resource.getpagesize()
        resource.setrlimit(resource.RLIMIT_AS, (taken + memory,) * 2)


def read_vtk(path: str, memory: int, seconds: int) -> Answer:
    """Points, cells and point data of a dataset of VTK."""
    from vtkmodules import vtkIOExodus, vtkIOHDF, vtkIOLegacy, vtkIOXML
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkCommonCore import vtkOutputWindow, vtkStringOutputWindow

    said = vtkStringOutputWindow()
    vtkOutputWindow.SetInstance(said)
    reader: Any = {
        ".vtp": vtkIOXML.vtkXMLPolyDataReader,
        ".vtu": vtkIOXML.vtkXMLUnstructuredGridReader,
        ".vts": vtkIOXML.vtkXMLStructuredGridReader,
        ".vtk": vtkIOLegacy.vtkGenericDataObjectReader,
        ".vtkhdf": vtkIOHDF.vtkHDFReader,
    }.get(os.path.splitext(path)[1].lower(), vtkIOExodus.vtkExodusIIReader)()
    limit(memory, seconds)
    reader.SetFileName(path)
    reader.Update()
    data = reader.GetOutputDataObject(0)
    if isinstance(reader, vtkIOExodus.vtkExodusIIReader):
        data = data.GetBlock(0)  # of the element blocks; others hold sides and sets of nodes
        if data.GetNumberOfBlocks() != 1:
            return {"error": f"{data.GetNumberOfBlocks()} blocks of elements, expected one"}, {}
        data = data.GetBlock(0)
    errors = [line for line in said.GetOutput().splitlines() if "error" in line.lower()]
    if errors:
        return {"error": said.GetOutput().strip().splitlines()[-1]}, {}
    meta: dict[str, Any] = {"kind": data.GetClassName() if data is not None else "nothing"}
    if not hasattr(data, "GetPoints"):
        return meta, {}
    arrays: dict[str, Any] = {}
    points = data.GetPoints()
    arrays["points"] = vtk_to_numpy(points.GetData()) if points is not None else np.empty((0, 3))
    if data.IsA("vtkStructuredGrid"):
        meta["dimensions"] = [0, 0, 0]
        data.GetDimensions(meta["dimensions"])
    elif data.IsA("vtkPolyData"):
        meta["left_out"] = data.GetNumberOfVerts() + data.GetNumberOfLines()
        meta["strips"] = data.GetNumberOfStrips()
        cells = data.GetPolys()
    else:
        cells = data.GetCells()
        types = data.GetCellTypesArray() if data.GetNumberOfCells() else None
        arrays["types"] = np.empty(0, np.uint8) if types is None else vtk_to_numpy(types)
    if not data.IsA("vtkStructuredGrid"):
        arrays["offsets"] = vtk_to_numpy(cells.GetOffsetsArray())
        arrays["corners"] = vtk_to_numpy(cells.GetConnectivityArray())
    booleans = data.GetFieldData().GetAbstractArray("_PYVISTA_BITARRAY_POINT_")
    if booleans is not None:
        meta["booleans"] = [booleans.GetValue(k) for k in range(booleans.GetNumberOfValues())]
    point_data = data.GetPointData()
    for k in range(point_data.GetNumberOfArrays()):
        array = point_data.GetArray(k)  # None of strings
        if array is not None and array.GetName():
            arrays[f"value {array.GetName()}"] = vtk_to_numpy(array)
    return meta, arrays


def write_vtkhdf(path: str, memory: int, seconds: int) -> Answer:
    """Write a .vtp file beside as .vtkhdf; their names differ in the suffix alone."""
    from vtkmodules import vtkIOHDF, vtkIOXML
    from vtkmodules.vtkCommonCore import vtkOutputWindow, vtkStringOutputWindow

    said = vtkStringOutputWindow()
    vtkOutputWindow.SetInstance(said)
    reader, writer = vtkIOXML.vtkXMLPolyDataReader(), vtkIOHDF.vtkHDFWriter()
    limit(memory, seconds)
    reader.SetFileName(path)
    writer.SetFileName(os.path.splitext(path)[0] + ".vtkhdf")
    writer.SetInputConnection(reader.GetOutputPort())
    done = writer.Write()
    if said.GetOutput().strip() or not done:
        return {"error": (said.GetOutput().strip().splitlines() or ["nothing was written"])[-1]}, {}
    return {}, {}


def read_trimesh(path: str, memory: int, seconds: int) -> Answer:
    """The meshes of a scene where they stand in it."""
    import trimesh

    limit(memory, seconds)
    scene = trimesh.load_scene(path, process=False, skip_materials=True)
    arrays: dict[str, Any] = {}
    kinds = []
    for node in scene.graph.nodes_geometry:
        transform, name = scene.graph[node]
        mesh = scene.geometry[name]
        kinds.append(type(mesh).__name__)
        if not isinstance(mesh, trimesh.Trimesh):
            continue
        mesh = mesh.copy().apply_transform(transform)
        k = len(kinds) - 1
        arrays[f"{k} points"], arrays[f"{k} triangles"] = np.asarray(mesh.vertices), np.asarray(mesh.faces)
        for key, values in mesh.vertex_attributes.items():
            arrays[f"{k} value {key}"] = np.asarray(values)
    return {"kinds": kinds}, arrays


def read_meshlane(path: str, memory: int, seconds: int) -> Answer:
    """Points, blocks of cells and point data."""
    try:
        import meshlane
    except ImportError:
        return {"missing": "meshlane"}, {}
    limit(memory, seconds)
    mesh = meshlane.read(path)
    arrays: dict[str, Any] = {"points": np.asarray(mesh.points)}
    names = []
    for k, block in enumerate(mesh.cells):
        names.append(block.type)
        sizes = np.array([len(cell) for cell in block.data], np.int64)
        cells = [np.asarray(cell) for cell in block.data]
        arrays[f"{k} sizes"] = sizes
        arrays[f"{k} corners"] = np.concatenate(cells) if cells else np.empty(0, np.int64)
    for name, values in mesh.point_data.items():
        arrays[f"value {name}"] = np.asarray(values)
    return {"names": names}, arrays


JOBS = {f.__name__: f for f in (read_vtk, write_vtkhdf, read_trimesh, read_meshlane)}


def main(job: str, path: str, memory: str, seconds: str) -> None:
    """Do one job and send what it gives."""
    answer = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what libraries print must not mix with the answer
    try:
        meta, arrays = JOBS[job](path, int(memory), int(seconds))
    except BaseException as error:  # SystemExit too
        meta, arrays = {"error": f"{type(error).__name__}: {error}"}, {}
    sent = {name: np.ascontiguousarray(array) for name, array in arrays.items() if array.dtype.kind in "biuf"}
    meta["arrays"] = [[name, array.dtype.str, array.shape] for name, array in sent.items()]
    answer.write(json.dumps(meta).encode() + b"\n")
    for array in sent.values():
        answer.write(array.data if array.size else b"")
    answer.flush()
    os._exit(0)  # libraries that were handed a damaged file may die when they are taken down


if __name__ == "__main__":
    main(*sys.argv[1:])
