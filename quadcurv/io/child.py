"""Reads a file with another library in a process of its own, and sends back plain arrays.

Started as a script by :mod:`quadcurv.io.isolation`; it knows nothing of the rest of the package. What it
sends on its standard output is a line of JSON, ``{"arrays": [[name, dtype, shape], ...], ...}``, and the
bytes of these arrays one after the other, or ``{"error": ...}`` alone.
"""

from __future__ import annotations

import contextlib
import io
import json
import os
import re
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
    if isinstance(reader, vtkIOExodus.vtkExodusIIReader):
        # Every block over all points of the file; no values, which VTK takes from memory never written.
        reader.SetSqueezePoints(False)
    reader.Update()
    data = reader.GetOutputDataObject(0)
    if errors := _errors(said.GetOutput()):
        return {"error": errors}, {}
    blocks = [data]
    if isinstance(reader, vtkIOExodus.vtkExodusIIReader):
        elements = data.GetBlock(0)  # others hold sides and sets of nodes
        blocks = [elements.GetBlock(k) for k in range(elements.GetNumberOfBlocks())]
        blocks = [block for block in blocks if block is not None]
        data = blocks[0] if blocks else None
    meta: dict[str, Any] = {"kind": data.GetClassName() if data is not None else "nothing"}
    if not hasattr(data, "GetPoints"):
        return meta, {}
    points = data.GetPoints()
    arrays = {"points": vtk_to_numpy(points.GetData()) if points is not None else np.empty((0, 3))}
    if data.IsA("vtkStructuredGrid"):
        meta["dimensions"] = [0, 0, 0]
        data.GetDimensions(meta["dimensions"])
    elif data.IsA("vtkPolyData"):
        meta["left_out"] = data.GetNumberOfVerts() + data.GetNumberOfLines()
        meta["strips"] = data.GetNumberOfStrips()
        arrays["offsets"] = vtk_to_numpy(data.GetPolys().GetOffsetsArray())
        arrays["corners"] = vtk_to_numpy(data.GetPolys().GetConnectivityArray())
    else:
        arrays |= _cells(blocks, vtk_to_numpy)
    booleans = data.GetFieldData().GetAbstractArray("_PYVISTA_BITARRAY_POINT_")
    if booleans is not None:
        meta["booleans"] = [booleans.GetValue(k) for k in range(booleans.GetNumberOfValues())]
    point_data = data.GetPointData()
    for k in range(point_data.GetNumberOfArrays()):
        array = point_data.GetArray(k)  # None of strings
        if array is not None and array.GetName():
            arrays[f"value {array.GetName()}"] = vtk_to_numpy(array)
    return meta, arrays


def _errors(said: str) -> str:
    """The first error that VTK tells of, without the places in its code."""
    told = said.partition("ERROR: ")[2].partition("\n\n")[0]
    return " ".join(re.sub(r"^In [^\n]*\n[^\n]*?\(0x[0-9a-f]+\): ", "", told).split())[:300]


def _cells(blocks: list[Any], vtk_to_numpy: Any) -> dict[str, Any]:
    """Cells of unstructured grids over the same points."""
    types, sizes, corners = [np.empty(0, np.uint8)], [np.zeros(1, np.int64)], [np.empty(0, np.int64)]
    for block in blocks:
        if block.GetNumberOfCells():
            types.append(vtk_to_numpy(block.GetCellTypesArray()))
            sizes.append(np.diff(vtk_to_numpy(block.GetCells().GetOffsetsArray())))
            corners.append(vtk_to_numpy(block.GetCells().GetConnectivityArray()))
    offsets = np.cumsum(np.concatenate(sizes))
    return {"types": np.concatenate(types), "offsets": offsets, "corners": np.concatenate(corners)}


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
    if not done or _errors(said.GetOutput()):
        return {"error": _errors(said.GetOutput()) or "nothing was written"}, {}
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
    import meshlane

    abaqus = getattr(meshlane.abaqus._abaqus, "abaqus_to_meshio_type", {})
    for family in ("S", "M3D", "CPS", "CPE", "CAX", "DS", "R3D", "SFM3D"):
        for nodes, name in ((3, "triangle"), (4, "quad"), (6, "triangle6"), (8, "quad8"), (9, "quad9")):
            for more in ("", "R", "I", "H", "T"):
                abaqus.setdefault(f"{family}{nodes}{more}", name)
    limit(memory, seconds)
    with contextlib.redirect_stdout(io.StringIO()) as said, contextlib.redirect_stderr(said):
        mesh = meshlane.read(path)
    notes = [" ".join(line.split()) for line in said.getvalue().splitlines() if line.strip()]
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
    return {"names": names, "notes": notes[:5]}, arrays


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
