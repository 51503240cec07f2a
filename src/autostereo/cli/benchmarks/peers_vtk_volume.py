"""Peer for volumes: vtkFixedPointVolumeRayCastMapper, VTK's ray caster on the CPU, one view after another.

Full image sampling, one sample a voxel, shading, as many threads as there are cores, one render and one RGBA read-back
a view. It is as fast as VTK lets it be: adaptive sampling (which would lower the quality) and the intermixing of
geometry (which reads the depth buffer back for every view) are off, and the window is that of the tuned mesh peer.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ...display.rig import Rig
from ...errors import DependencyError, UnsupportedError
from ...scene.scene import Scene
from ...scene.volume import Volume
from .peers_vtk import ViewLoop
from .workloads import Size


class VTKVolumeLoop(ViewLoop):
    """V passes over one volume.

    Parameters
    ----------
    window : vtkEGLRenderWindow
        From `peers_vtk.shared_window`.
    scene : Scene
        One composite volume of uint8 or uint16, the default light.
    rig : Rig
    size : (int, int)
        Width and height of one view in pixels.
    threads : int

    Raises
    ------
    DependencyError
        This VTK has no volume rendering.
    UnsupportedError
        The scene is another.
    """

    def __init__(self, window: Any, scene: Scene, rig: Rig, size: Size, threads: int) -> None:
        (volume,) = scene.objects
        clipped = isinstance(volume, Volume) and (volume.clip_box is not None or volume.clip_plane is not None)
        if not isinstance(volume, Volume) or volume.mode != "composite" or clipped:
            raise UnsupportedError("VTK volume peer: expected one composite volume that is not clipped")
        if volume.values.dtype not in (np.uint8, np.uint16):
            raise UnsupportedError(f"VTK volume peer: expected values of uint8 or uint16, got {volume.values.dtype}")
        ahead = rig.eye_from_world[2, :3] @ volume.corners.T + rig.eye_from_world[2, 3]
        self.far_depth = 2 * float(ahead.max())  # the mapper ends its rays there: it cannot be infinite
        super().__init__(window, _prop(volume, threads), scene.background, rig, size)


def _prop(volume: Volume, threads: int) -> Any:
    try:
        import vtkmodules.vtkRenderingVolumeOpenGL2  # noqa: F401  # what brings the mapper's picture to the window
        from vtkmodules.vtkCommonMath import vtkMatrix4x4
        from vtkmodules.vtkRenderingCore import vtkVolume
        from vtkmodules.vtkRenderingVolume import vtkFixedPointVolumeRayCastMapper
    except ImportError:
        raise DependencyError("VTK without volume rendering is installed (pip install autostereo[bench])") from None
    step = float(volume.voxel_size.min())
    mapper = vtkFixedPointVolumeRayCastMapper()
    mapper.SetInputData(_image(volume))
    mapper.SetAutoAdjustSampleDistances(False)
    mapper.SetImageSampleDistance(1.0)
    mapper.SetSampleDistance(step)
    mapper.SetInteractiveSampleDistance(step)
    mapper.SetIntermixIntersectingGeometry(False)
    mapper.SetNumberOfThreads(threads)
    prop = vtkVolume()
    prop.SetMapper(mapper)
    prop.SetProperty(_property(volume, step))
    # all but the voxels' size: the mapper overlooks an image's orientation, and a prop's scale when it takes distances
    place = volume.world_from_index.copy()
    place[:3, :3] /= volume.voxel_size
    matrix = vtkMatrix4x4()
    matrix.DeepCopy(place.ravel().tolist())
    prop.SetUserMatrix(matrix)
    return prop


def _image(volume: Volume) -> Any:
    """The values with their distances in the world, the first voxel at the origin."""
    from vtkmodules.util.numpy_support import numpy_to_vtk
    from vtkmodules.vtkCommonDataModel import vtkImageData

    image = vtkImageData()
    image.SetDimensions(*volume.shape)
    image.SetSpacing(*volume.voxel_size)
    image.GetPointData().SetScalars(numpy_to_vtk(volume.values.ravel(), deep=True))
    return image


def _property(volume: Volume, step: float) -> Any:
    """The transfer function and the material.

    VTK takes opacities of a unit distance, here of one step, and is linear between points where extinction should be:
    therefore as many points as its tables have values.
    """
    from vtkmodules.vtkCommonDataModel import vtkPiecewiseFunction
    from vtkmodules.vtkRenderingCore import vtkColorTransferFunction, vtkVolumeProperty

    greatest = np.iinfo(volume.values.dtype).max
    value = np.linspace(0, greatest, min(greatest + 1, 4096))
    colors, opacities = vtkColorTransferFunction(), vtkPiecewiseFunction()
    for s, (r, g, b, extinction) in zip(value, volume.transfer.evaluate(value), strict=True):
        colors.AddRGBPoint(s, r, g, b)
        opacities.AddPoint(s, -np.expm1(-extinction * step))
    look = vtkVolumeProperty()
    look.SetColor(colors)
    look.SetScalarOpacity(opacities)
    look.SetScalarOpacityUnitDistance(step)
    look.SetInterpolationTypeToLinear()
    look.SetShade(volume.shade)
    look.SetAmbient(volume.material.ambient)
    look.SetDiffuse(volume.material.diffuse)
    look.SetSpecular(volume.material.specular)
    look.SetSpecularPower(volume.material.shininess)
    return look
