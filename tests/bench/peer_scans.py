# SPDX-License-Identifier: GPL-3.0-or-later
"""VTK draws a virtual scan: python3 peer_scans.py IN.npz OUT_FOLDER MODE... Run by scans.py in Debian's own Python.

IN: position (n, 3) float32, color (n, 3) sRGB bytes, matrix (views, 4, 4) world from camera, fov degrees, width, height, near,
far, sky (3,) sRGB. MODE: "3" for points of 3 pixels, "3 EDL" with eye-dome lighting. OUT_FOLDER/MODE-VIEW.npz: rgb sRGB bytes,
depth float32, inf where nothing is; row 0 at the bottom. Prints {"MODE": [milliseconds a view], "MODE work": [the processor's]} as JSON."""

from __future__ import annotations

import json
import sys
import time
from pathlib import Path

import numpy as np
import vtk
from vtk.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray, vtk_to_numpy


def actor(data: dict[str, np.ndarray]) -> vtk.vtkActor:
    cloud, points, cells = vtk.vtkPolyData(), vtk.vtkPoints(), vtk.vtkCellArray()
    count = len(data["position"])
    points.SetData(numpy_to_vtk(data["position"], deep=True))
    cloud.SetPoints(points)
    cells.SetCells(count, numpy_to_vtkIdTypeArray(
        np.column_stack([np.ones(count, np.int64), np.arange(count)]).ravel(), deep=True))
    cloud.SetVerts(cells)
    cloud.GetPointData().SetScalars(numpy_to_vtk(data["color"], deep=True))
    mapper = vtk.vtkPolyDataMapper()
    mapper.SetInputData(cloud)
    mapper.SetColorModeToDirectScalars()
    result = vtk.vtkActor()
    result.SetMapper(mapper)
    result.GetProperty().SetLighting(False)
    return result


def main() -> None:
    source, target, *modes = sys.argv[1:]
    data = dict(np.load(source))
    width, height = int(data["width"]), int(data["height"])
    renderer, window = vtk.vtkRenderer(), vtk.vtkRenderWindow()
    window.SetOffScreenRendering(1)
    window.SetMultiSamples(0)
    window.SetSize(width, height)
    window.AddRenderer(renderer)
    renderer.SetBackground(*data["sky"])
    shown = actor(data)
    renderer.AddActor(shown)
    camera = renderer.GetActiveCamera()
    near, far = float(data["near"]), float(data["far"])
    times: dict[str, list[float]] = {}
    for mode in modes:
        shown.GetProperty().SetPointSize(float(mode.split()[0]))
        edl = None
        if mode.endswith("EDL"):
            edl = vtk.vtkEDLShading()
            edl.SetDelegatePass(vtk.vtkRenderStepsPass())
        renderer.SetPass(edl)
        for index, matrix in enumerate(data["matrix"]):
            eye, back, up = matrix[:3, 3], matrix[:3, 2], matrix[:3, 1]
            camera.SetPosition(*eye)
            camera.SetFocalPoint(*(eye - back))
            camera.SetViewUp(*up)
            camera.SetViewAngle(float(data["fov"]))
            camera.SetClippingRange(near, far)
            for _ in range(1 if index else 2):  # the first picture of a mode uploads
                start, worked = time.perf_counter(), time.process_time()
                window.Render()
                window.WaitForCompletion()
                window.GetRGBACharPixelData(0, 0, 0, 0, 0, vtk.vtkUnsignedCharArray())  # nothing is done before it is read
                spent, work = 1e3 * (time.perf_counter() - start), 1e3 * (time.process_time() - worked)
            times.setdefault(mode, []).append(spent)
            times.setdefault(f"{mode} work", []).append(work)
            colors, depths = vtk.vtkUnsignedCharArray(), vtk.vtkFloatArray()
            window.GetPixelData(0, 0, width - 1, height - 1, 0, colors, 0)
            window.GetZbufferData(0, 0, width - 1, height - 1, depths)
            hyperbolic = vtk_to_numpy(depths).reshape(height, width).astype(np.float64)
            with np.errstate(divide="ignore"):
                depth = np.where(hyperbolic < 1.0, near * far / (far - hyperbolic * (far - near)), np.inf)
            np.savez(Path(target) / f"{mode.replace(' ', '_')}-{index}.npz", rgb=vtk_to_numpy(colors).reshape(height, width, 3),
                     depth=depth.astype(np.float32))
    print(json.dumps(times))


if __name__ == "__main__":
    main()
