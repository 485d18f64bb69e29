"""ParaView plugin: the filter "Quad Curvature" on polygons and structured grids.

Load this file in ParaView under Tools, Manage Plugins, Load New, or with ``LoadPlugin`` of pvpython. ParaView
brings a VTK of its own: quadcurv, numpy and the others are found where PYTHONPATH says, which should be an
environment without the wheel of another VTK (``pip install quadcurv``, without extras).
"""

from __future__ import annotations

from typing import Any

import numpy as np
from paraview.util.vtkAlgorithm import smdomain, smhint, smproperty, smproxy
from vtkmodules.numpy_interface import dataset_adapter
from vtkmodules.util.vtkAlgorithm import VTKPythonAlgorithmBase
from vtkmodules.vtkCommonDataModel import vtkDataSet

import quadcurv as qc

_SCHEMES = list(qc.SCHEMES)
_DOMAIN = "".join(f'<Entry value="{i}" text="{name}"/>' for i, name in enumerate(_SCHEMES))


@smproxy.filter(name="QuadCurvature", label="Quad Curvature")
@smhint.xml('<ShowInMenu category="quadcurv"/>')
@smproperty.input(name="Input", port_index=0)
@smdomain.datatype(dataTypes=["vtkPolyData", "vtkStructuredGrid"], composite_data_supported=False)
class QuadCurvature(VTKPythonAlgorithmBase):
    """Curvature of quads as point data: H, and by fits K, k1 and k2 too."""

    def __init__(self) -> None:
        super().__init__(nInputPorts=1, nOutputPorts=1, inputType="vtkDataSet", outputType="vtkDataSet")
        self._scheme = _SCHEMES.index("jet")
        self._boundary = 0
        self._all = 1
        self._bars = 0

    @smproperty.xml(
        '<IntVectorProperty name="Scheme" command="SetScheme" number_of_elements="1" '
        f'default_values="{_SCHEMES.index("jet")}">'
        f'<EnumerationDomain name="enum">{_DOMAIN}</EnumerationDomain>'
        "<Documentation>Operator; the jets give all curvatures, the others H.</Documentation>"
        "</IntVectorProperty>"
    )
    def SetScheme(self, number: int) -> None:
        """Choose the scheme by its place in ``quadcurv.SCHEMES``."""
        self._set("_scheme", number)

    @smproperty.xml(
        '<IntVectorProperty name="Boundary" command="SetBoundary" number_of_elements="1" default_values="0">'
        '<EnumerationDomain name="enum"><Entry value="0" text="extrapolate"/><Entry value="1" text="nan"/>'
        "</EnumerationDomain></IntVectorProperty>"
    )
    def SetBoundary(self, number: int) -> None:
        """Choose between continuing the surface beyond its border and NaN there."""
        self._set("_boundary", number)

    @smproperty.xml(
        '<IntVectorProperty name="AllCurvatures" label="K, k1, k2 too" command="SetAllCurvatures" '
        'number_of_elements="1" default_values="1"><BooleanDomain name="bool"/></IntVectorProperty>'
    )
    def SetAllCurvatures(self, number: int) -> None:
        """Choose whether a jet's K, k1 and k2 are written beside H."""
        self._set("_all", number)

    @smproperty.xml(
        '<IntVectorProperty name="ErrorBars" label="Error Bars" command="SetErrorBars" '
        'number_of_elements="1" default_values="0"><BooleanDomain name="bool"/>'
        "<Documentation>Half widths of 95 % intervals, and creases, by jet.</Documentation>"
        "</IntVectorProperty>"
    )
    def SetErrorBars(self, number: int) -> None:
        """Choose whether half widths of the intervals of "jet", and creases, are written."""
        self._set("_bars", number)

    def _set(self, name: str, number: int) -> None:
        if getattr(self, name) != number:
            setattr(self, name, number)
            self.Modified()

    def FillInputPortInformation(self, port: int, info: Any) -> int:
        """Take polygons and structured grids."""
        info.Set(self.INPUT_REQUIRED_DATA_TYPE(), "vtkPolyData")
        info.Append(self.INPUT_REQUIRED_DATA_TYPE(), "vtkStructuredGrid")
        return 1

    def RequestDataObject(self, request: Any, inputs: Any, outputs: Any) -> int:
        """Make an output of the input's own type."""
        given = vtkDataSet.GetData(inputs[0], 0)
        information = outputs.GetInformationObject(0)
        there = vtkDataSet.GetData(information)
        if there is None or not there.IsA(given.GetClassName()):
            information.Set(vtkDataSet.DATA_OBJECT(), given.NewInstance())
        return 1

    def RequestData(self, request: Any, inputs: Any, outputs: Any) -> int:
        """Compute; what is wrong with the mesh goes to the log, and the data go on without the arrays."""
        given, output = vtkDataSet.GetData(inputs[0], 0), vtkDataSet.GetData(outputs, 0)
        output.ShallowCopy(given)
        try:
            found = self._curvatures(given)
        except (ValueError, TypeError, ImportError) as error:
            from vtkmodules.vtkCommonCore import vtkLogger

            vtkLogger.Log(vtkLogger.VERBOSITY_ERROR, __file__, 0, f"quadcurv: {error}")
            return 0
        for name, values in found.items():
            dataset_adapter.WrapDataObject(output).PointData.append(values, name)
        return 1

    def _curvatures(self, given: Any) -> dict[str, np.ndarray]:
        """Arrays by name, in the order of the points."""
        mesh, in_vtk_order = _mesh(given)
        scheme, boundary = _SCHEMES[self._scheme], ("extrapolate", "nan")[self._boundary]
        if not isinstance(qc.SCHEMES[scheme], qc.Fit):
            by_name = {"H": qc.mean_curvature(mesh, scheme, boundary)}
        else:
            found = qc.curvatures(mesh, scheme, boundary)
            kinds = {"H": "mean", "K": "gaussian", "k1": "k1", "k2": "k2"} if self._all else {"H": "mean"}
            by_name = {name: getattr(found, kind) for name, kind in kinds.items()}
            if self._bars and found.interval is not None and found.feature is not None:
                by_name |= {f"{name} interval": getattr(found.interval, kind) for name, kind in kinds.items()}
                by_name["crease"] = found.feature.astype(np.int32)
        return {name: in_vtk_order(values) for name, values in by_name.items()}


def _mesh(given: Any) -> tuple[Any, Any]:
    """A mesh of a dataset of VTK, without pyvista, and how its results are put in the order of the points."""
    data = dataset_adapter.WrapDataObject(given)
    points = np.array(data.Points)
    if given.IsA("vtkStructuredGrid"):
        size = [0, 0, 0]
        given.GetDimensions(size)
        if size.count(1) != 1:
            raise ValueError(f"a structured grid of {size} points, expected one layer")
        c, r = (n for n in size if n != 1)
        return qc.QuadGrid(points.reshape(r, c, 3).swapaxes(0, 1)), lambda values: values.T.ravel()
    cells = given.GetPolys()
    offsets = dataset_adapter.numpy_support.vtk_to_numpy(cells.GetOffsetsArray())
    corners = dataset_adapter.numpy_support.vtk_to_numpy(cells.GetConnectivityArray())
    faces = [part.tolist() for part in np.split(corners, offsets[1:-1])] if len(offsets) > 1 else []
    return qc.QuadMesh(points, faces), lambda values: values
