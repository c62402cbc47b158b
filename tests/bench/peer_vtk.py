# SPDX-License-Identifier: GPL-3.0-or-later
"""VTK draws a cloud: peer_vtk.py MODE IN.npz OUT.npz. Run by peers.py with the system's Python, which has python3-vtk9.

IN: position, normal, color (linear, float32), matrix (frames, 4, 4) world from camera, fov, near, far, size, towards,
power, world, spacing. OUT: rgba, depth of the first camera. Prints the times of the frames as JSON.

vtkShadowMapBakerPass draws its maps anew when the time stamp of a light or of an actor says that it changed, and else
keeps them: "shadow map" lets the light be, "shadow map, moving light" turns it with each frame."""

from __future__ import annotations

import json
import resource
import sys
import time

import numpy as np
import vtk
from vtk.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray, vtk_to_numpy

MODES = ("points 1 px", "points 3 px", "points 5 px", "points 3 px + EDL", "gaussian", "points 3 px + 6 peels",
         "points 3 px + shadow map", "points 3 px + shadow map, moving light")
TURN = 1.0  # degrees a frame that a moving light turns around z


def cloud(data: dict[str, np.ndarray]) -> vtk.vtkPolyData:
    result, points, cells = vtk.vtkPolyData(), vtk.vtkPoints(), vtk.vtkCellArray()
    count = len(data["position"])
    points.SetData(numpy_to_vtk(data["position"], deep=True))
    result.SetPoints(points)
    pairs = np.column_stack([np.ones(count, np.int64), np.arange(count)]).ravel()
    cells.SetCells(count, numpy_to_vtkIdTypeArray(pairs, deep=True))
    result.SetVerts(cells)
    result.GetPointData().SetNormals(numpy_to_vtk(data["normal"], deep=True))
    colors = numpy_to_vtk(np.rint(255.0 * data["color"]).astype(np.uint8), deep=True)  # linear, as VTK lights them
    result.GetPointData().SetScalars(colors)
    return result


def actor(mode: str, data: dict[str, np.ndarray]) -> vtk.vtkActor:
    if mode == "gaussian":
        mapper = vtk.vtkPointGaussianMapper()
        mapper.SetScaleFactor(float(data["spacing"]) * 0.7)
        mapper.EmissiveOff()
    else:
        mapper = vtk.vtkPolyDataMapper()
    mapper.SetInputData(cloud(data))
    mapper.SetColorModeToDirectScalars()
    result = vtk.vtkActor()
    result.SetMapper(mapper)
    look = result.GetProperty()
    look.SetAmbient(float(data["world"]))
    look.SetDiffuse(1.0)
    look.SetSpecular(0.0)
    if mode.startswith("points"):
        look.SetPointSize(float(mode.split()[1]))
        look.SetLighting(True)
        look.SetInterpolationToPhong()
    return result


def aim(camera: vtk.vtkCamera, matrix: np.ndarray, data: dict[str, np.ndarray]) -> None:
    eye, back, up = matrix[:3, 3], matrix[:3, 2], matrix[:3, 1]
    camera.SetPosition(*eye)
    camera.SetFocalPoint(*(eye - back))
    camera.SetViewUp(*up)
    camera.SetViewAngle(float(data["fov"]))
    camera.SetClippingRange(1.0, 10.0)


def place(light: vtk.vtkLight, towards: np.ndarray, degrees: float) -> None:
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    x, y, z = towards
    light.SetPosition(10.0 * (c * x - s * y), 10.0 * (s * x + c * y), 10.0 * z)


def main() -> None:
    mode, source, target = sys.argv[1:4]
    data = dict(np.load(source))
    size = int(data["size"])
    renderer, window = vtk.vtkRenderer(), vtk.vtkRenderWindow()
    window.SetOffScreenRendering(1)
    window.SetMultiSamples(0)
    window.SetAlphaBitPlanes(1)
    window.SetSize(size, size)
    window.AddRenderer(renderer)
    renderer.SetBackground(0.0, 0.0, 0.0)
    renderer.SetBackgroundAlpha(0.0)
    renderer.AutomaticLightCreationOff()
    light = vtk.vtkLight()
    light.SetLightTypeToSceneLight()
    light.SetPositional(False)
    place(light, data["towards"], 0.0)
    light.SetFocalPoint(0.0, 0.0, 0.0)
    light.SetIntensity(float(data["power"]) / np.pi)
    renderer.AddLight(light)
    renderer.SetAmbient(1.0, 1.0, 1.0)
    renderer.AddActor(actor(mode, data))
    if mode.endswith("EDL"):
        steps = vtk.vtkRenderStepsPass()
        edl = vtk.vtkEDLShading()
        edl.SetDelegatePass(steps)
        renderer.SetPass(edl)
    if mode.endswith("6 peels"):  # of half transparent points
        renderer.GetActors().GetLastActor().GetProperty().SetOpacity(0.5)
        renderer.SetUseDepthPeeling(1)
        renderer.SetMaximumNumberOfPeels(6)
        renderer.SetOcclusionRatio(0.0)
    if "shadow map" in mode:
        light.SetPositional(True)  # VTK fits the map of a light to its cone
        light.SetConeAngle(20.0)
        baker, shadows, steps = vtk.vtkShadowMapBakerPass(), vtk.vtkShadowMapPass(), vtk.vtkSequencePass()
        baker.SetResolution(1024)
        shadows.SetShadowMapBakerPass(baker)
        passes = vtk.vtkRenderPassCollection()
        for one in (baker, shadows):
            passes.AddItem(one)
        steps.SetPasses(passes)
        camera = vtk.vtkCameraPass()
        camera.SetDelegatePass(steps)
        renderer.SetPass(camera)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    times = []
    for index, matrix in enumerate(data["matrix"]):
        aim(renderer.GetActiveCamera(), matrix, data)
        if mode.endswith("moving light"):
            place(light, data["towards"], index * TURN)
        start = time.perf_counter()
        window.Render()
        window.WaitForCompletion()
        window.GetRGBACharPixelData(0, 0, 0, 0, 0, vtk.vtkUnsignedCharArray())  # nothing is done before it is read
        if index >= 2:
            times.append(1e3 * (time.perf_counter() - start))
    aim(renderer.GetActiveCamera(), data["matrix"][0], data)
    place(light, data["towards"], 0.0)
    window.Render()
    colors, depths = vtk.vtkUnsignedCharArray(), vtk.vtkFloatArray()
    window.GetRGBACharPixelData(0, 0, size - 1, size - 1, 0, colors)
    window.GetZbufferData(0, 0, size - 1, size - 1, depths)
    rgba = vtk_to_numpy(colors).reshape(size, size, 4).astype(np.float32) / 255.0
    hyperbolic = vtk_to_numpy(depths).reshape(size, size).astype(np.float64)
    near, far = renderer.GetActiveCamera().GetClippingRange()
    depth = np.where(hyperbolic < 1.0, near * far / (far - hyperbolic * (far - near)), np.inf)
    np.savez(target, rgba=rgba, depth=depth.astype(np.float32))
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before
    renderer_name = window.ReportCapabilities().split("renderer string:")[-1].splitlines()[0].strip()
    print(json.dumps({"times": {"moving camera": times}, "peak_mb": peak / 1024.0, "note": renderer_name}))


if __name__ == "__main__":
    main()
