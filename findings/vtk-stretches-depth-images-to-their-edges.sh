#!/usr/bin/env bash
# vtk 9.7.2's `vtkDepthImageToPointCloud` lays the first and the last pixel of a row on the two edges of the camera's view, and so
# the first and the last row, although a depth buffer holds what is seen through the middles of its pixels. The cloud is stretched aside
# by W / (W - 1) and up by H / (H - 1), not ahead: of 640 pixels by 1.6 mm in a metre, of 64 by 16 mm.
#
# Guess before it was run: of a depth buffer, the points of the surface, to rounding (noted after a first look at the edges).
# For whom it matters: whoever simulates a camera or a scan by rendering and takes the cloud for the truth of a registration: at the
# edge of the view each point is half a pixel off, two cameras' clouds of one room fit no single pose, and an estimated scale
# is not 1. Multiply x by (W - 1) / W and y by (H - 1) / H in the camera's frame.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "vtk==9.7.2" "numpy<2.5"
"$folder/env/bin/python" - <<'PYTHON'
import numpy as np
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkVersion
from vtkmodules.vtkCommonDataModel import vtkImageData
from vtkmodules.vtkRenderingCore import vtkCamera
from vtkmodules.vtkRenderingImage import vtkDepthImageToPointCloud

NEAR, FAR, ANGLE = 0.5, 50.0, 60.0
camera = vtkCamera()  # at the origin, looks along -z, y up
camera.SetPosition(0.0, 0.0, 0.0)
camera.SetFocalPoint(0.0, 0.0, -1.0)
camera.SetViewUp(0.0, 1.0, 0.0)
camera.SetViewAngle(ANGLE)
camera.SetClippingRange(NEAR, FAR)
print("vtk", vtkVersion.GetVTKVersion(), "numpy", np.__version__)
for width, height in ((64, 48), (640, 480)):
    row, column = np.mgrid[:height, :width] + 0.5  # the middles; row 0 is the lowest
    up = np.tan(np.radians(ANGLE / 2.0))
    rays = np.stack([(2.0 * column / width - 1.0) * up * width / height, (2.0 * row / height - 1.0) * up, -np.ones_like(row)], -1)
    middle = np.array([1.0, 0.5, -6.0])  # a ball of 1 m before a wall 8 m away
    a, b = np.einsum("ijk,ijk->ij", rays, rays), rays @ middle
    inside = b**2 - a * (middle @ middle - 1.0)
    ahead = np.where(inside > 0.0, (b - np.sqrt(np.maximum(inside, 0.0))) / a, 8.0)
    seen = ahead[..., None] * rays
    buffer = (1.0 / NEAR - 1.0 / ahead) / (1.0 / NEAR - 1.0 / FAR)
    image = vtkImageData()
    image.SetDimensions(width, height, 1)
    image.GetPointData().SetScalars(numpy_to_vtk(buffer.ravel(), deep=True))
    made = vtkDepthImageToPointCloud()
    made.SetInputData(image)
    made.SetCamera(camera)
    made.SetProduceColorScalars(False)
    made.Update()
    points = vtk_to_numpy(made.GetOutput().GetPoints().GetData()).reshape(seen.shape)
    off = np.linalg.norm(points - seen, axis=-1)
    undone = points * [(width - 1) / width, (height - 1) / height, 1.0]
    left = np.abs(undone - seen).max()
    print(f"  {width} x {height}: up to {1000.0 * off.max():.0f} mm off; with x and y shrunk, {1000.0 * left:.2f} mm")
    assert left < 1e-4, "vtk no longer does this"
    assert off.max() > 4.0 / width, "vtk no longer does this"
print("the outermost pixels lie on the edges of the view")
PYTHON
