"""Peer B: a VTK loop that renders the V views one after another, headless through EGL, in three variants.

``tuned``
    As far as VTK lets one go: no multisampling, no blit to a second framebuffer, no cullers, no coincident-topology
    pass, static pipeline, back-face culling where the mesh is closed, one render and one RGBA read-back into a
    kept array a view.
``plain``
    What a careful user writes: VTK's defaults without multisampling, one render and one vtkWindowToImageFilter a view.
``prelit``
    ``tuned``, but vertices are lit before the measurement and drawn with lighting off: for vertex-lit surfaces the
    least work that yields the picture. (VTK itself lights every fragment of a mesh that has normals, whatever
    SetInterpolation says.)

All use an explicit off-axis projection for each camera. VTK's highlight is Phong's (reflected ray), not Blinn's.
"""

from __future__ import annotations

import subprocess
import sys
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...display.rig import Rig
from ...errors import DependencyError
from ...scene.appearance import Material, Vector
from ...scene.scene import Scene
from .workloads import Size, clip_from_centre, eyes, the_mesh, world_arrays

# in a process of its own: SupportsOpenGL ends the EGL display in passing, and without a display VTK may crash
_PROBE = """
from vtkmodules.vtkRenderingOpenGL2 import vtkEGLRenderWindow
raise SystemExit(0 if vtkEGLRenderWindow().SupportsOpenGL() else 1)
"""


@cache
def shared_window() -> Any:
    """Headless window, one per process: finalising one would end the EGL display of all others too.

    Raises
    ------
    DependencyError
        VTK or a headless OpenGL through EGL is missing.
    """
    try:
        from vtkmodules.vtkRenderingOpenGL2 import vtkEGLRenderWindow
    except ImportError:
        raise DependencyError("VTK with EGL is not installed (pip install autostereo[bench])") from None
    probe = subprocess.run([sys.executable, "-c", _PROBE], capture_output=True, check=False)
    if probe.returncode:
        raise DependencyError("VTK finds no headless OpenGL through EGL")
    window = vtkEGLRenderWindow()
    window.SetOffScreenRendering(True)
    window.SetShowWindow(False)
    window.SetMultiSamples(0)
    window.SwapBuffersOff()
    window.Initialize()
    return window


class ViewLoop:
    """V passes over one prop.

    Parameters
    ----------
    window : vtkEGLRenderWindow
        From `shared_window`.
    prop : vtkProp3D
        What is drawn.
    background : (3,) float
    rig : Rig
    size : (int, int)
        Width and height of one view in pixels.
    """

    plain = False
    """VTK's defaults and its filter for pictures of windows, or what is faster."""
    far_depth: float | None = None
    """Depth of a far plane, if there must be one."""

    def __init__(self, window: Any, prop: Any, background: Vector, rig: Rig, size: Size) -> None:
        from vtkmodules.vtkCommonCore import vtkUnsignedCharArray
        from vtkmodules.vtkRenderingCore import vtkRenderer, vtkWindowToImageFilter

        forward = rig.eye_from_world[2, :3]
        self._size = size
        self._pixels = vtkUnsignedCharArray()
        self._renderer = renderer = vtkRenderer()
        renderer.SetBackground(*background)
        if not self.plain:
            renderer.GetCullers().RemoveAllItems()
        renderer.SetAutomaticLightCreation(False)
        renderer.AddLight(_light(forward))
        renderer.AddViewProp(prop)
        self._window = window
        self._filter = vtkWindowToImageFilter()
        self._filter.SetInput(window)
        self._filter.ReadFrontBufferOff()
        self._filter.ShouldRerenderOff()
        self._camera = camera = renderer.GetActiveCamera()
        camera.SetViewUp(*rig.up)
        camera.SetClippingRange(rig.near_depth, self.far_depth or 1e4 * rig.near_depth)
        camera.SetUseExplicitProjectionTransformMatrix(True)
        self._eyes = eyes(rig)
        self._targets = self._eyes + forward * rig.focal
        self._projections = [_projection(rig, size, view, self.far_depth) for view in range(rig.views)]

    def enter(self) -> None:
        """Make the window's context current and this loop its content."""
        window = self._window
        window.MakeCurrent()
        if not window.HasRenderer(self._renderer):
            for other in list(window.GetRenderers()):
                window.RemoveRenderer(other)
            if self.plain:
                window.SetFrameBlitModeToBlitToHardware()
            else:
                window.SetFrameBlitModeToNoBlit()
            window.SetSize(*self._size)
            window.AddRenderer(self._renderer)

    def frame(self) -> None:
        """Draw and read back every view once."""
        for view in range(len(self._projections)):
            self._draw(view)

    def finish(self) -> None:
        """Nothing is left to wait for: every view was read back."""

    def _draw(self, view: int) -> None:
        camera = self._camera
        camera.SetPosition(self._eyes[view])
        camera.SetFocalPoint(self._targets[view])
        camera.SetExplicitProjectionTransformMatrix(self._projections[view])
        self._window.Render()
        if self.plain:
            self._filter.Modified()
            self._filter.Update()
            return
        width, height = self._size
        self._window.GetRGBACharPixelData(0, 0, width - 1, height - 1, 0, self._pixels)

    def picture(self, view: int) -> NDArray[np.uint8]:
        """Draw one view, (H, W, 3) uint8, rows from the top. For checks, not for timing."""
        from vtkmodules.util.numpy_support import vtk_to_numpy

        self.enter()
        self._draw(view)
        data = self._filter.GetOutput().GetPointData().GetScalars() if self.plain else self._pixels
        pixels = vtk_to_numpy(data).reshape(self._size[1], self._size[0], -1)
        return pixels[::-1, :, :3].copy()

    def release(self) -> None:
        """Free the buffers of this loop; the window stays."""
        self._window.MakeCurrent()
        self._renderer.ReleaseGraphicsResources(self._window)
        self._window.RemoveRenderer(self._renderer)


class VTKLoop(ViewLoop):
    """V passes over one mesh.

    Parameters
    ----------
    window : vtkEGLRenderWindow
        From `shared_window`.
    scene : Scene
        One mesh, no texture, the default light.
    rig : Rig
    size : (int, int)
        Width and height of one view in pixels.
    variant : {"tuned", "plain", "prelit"}
    """

    def __init__(self, window: Any, scene: Scene, rig: Rig, size: Size, variant: str = "tuned") -> None:
        self.plain = variant == "plain"
        actor = _actor(scene, variant, -rig.eye_from_world[2, :3])
        super().__init__(window, actor, scene.background, rig, size)


def _projection(rig: Rig, size: Size, view: int, far: float | None) -> Any:
    """Explicit off-axis projection of one camera, without or with a far plane."""
    from vtkmodules.vtkCommonMath import vtkMatrix4x4

    clip, near = clip_from_centre(rig, size)[view], rig.near_depth
    clip[:, 3] += clip[:, 0] * rig.camera_offsets[view] + clip[:, 1] * rig.offset_y  # from this camera, not the centre
    if far is not None:
        clip[2, 2:] = (far + near) / (far - near), -2 * far * near / (far - near)
    clip[:, 2] *= -1  # VTK's camera looks along −z
    matrix = vtkMatrix4x4()
    matrix.DeepCopy(clip.ravel().tolist())
    return matrix


def _light(forward: NDArray[np.float64]) -> Any:
    """White directional light that travels along `forward` (3,)."""
    from vtkmodules.vtkRenderingCore import vtkLight

    light = vtkLight()
    light.SetLightTypeToSceneLight()
    light.SetPositional(False)
    light.SetPosition(*(-forward))
    light.SetFocalPoint(0.0, 0.0, 0.0)
    light.SetAmbientColor(1.0, 1.0, 1.0)  # volumes take their ambient light from it, surfaces do not
    return light


def _actor(scene: Scene, variant: str, to_light: NDArray[np.float64]) -> Any:
    from vtkmodules.vtkRenderingCore import vtkActor, vtkPolyDataMapper

    mesh = the_mesh(scene)
    material = mesh.material or Material()
    mapper = vtkPolyDataMapper()
    mapper.SetInputData(_polydata(scene, variant, to_light))
    actor = vtkActor()
    actor.SetMapper(mapper)
    surface = actor.GetProperty()
    surface.SetInterpolationToPhong()
    surface.SetAmbient(material.ambient)
    surface.SetDiffuse(material.diffuse)
    surface.SetSpecular(material.specular)
    surface.SetSpecularPower(material.shininess)
    if variant != "plain":
        mapper.SetResolveCoincidentTopologyToOff()
        mapper.StaticOn()
        actor.ForceOpaqueOn()
        surface.SetBackfaceCulling(not mesh.two_sided)
    if variant == "prelit":
        surface.LightingOff()
    return actor


def _polydata(scene: Scene, variant: str, to_light: NDArray[np.float64]) -> Any:
    """Triangles with normals and colours, or with lit colours and no normals."""
    from vtkmodules.util.numpy_support import numpy_to_vtk
    from vtkmodules.vtkCommonCore import vtkPoints
    from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPolyData

    mesh = the_mesh(scene)
    positions, normals, colors = world_arrays(scene)
    data = vtkPolyData()
    points, triangles = vtkPoints(), vtkCellArray()
    points.SetData(numpy_to_vtk(positions.astype(np.float32), deep=True))
    triangles.SetData(3, numpy_to_vtk(np.ascontiguousarray(mesh.faces.ravel(), dtype=np.int32), deep=True))
    data.SetPoints(points)
    data.SetPolys(triangles)
    if variant == "prelit":
        material, facing = mesh.material or Material(), np.maximum(normals @ to_light, 0.0)[:, None]
        colors = np.clip(colors * (material.ambient + material.diffuse * facing), 0.0, 1.0)
    else:
        data.GetPointData().SetNormals(numpy_to_vtk(normals.astype(np.float32), deep=True))
    rgb = np.floor(255 * colors + 0.5).astype(np.uint8)
    data.GetPointData().SetScalars(numpy_to_vtk(np.ascontiguousarray(rgb), deep=True))
    return data
