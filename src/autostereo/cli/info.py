"""autostereo info: what a scene holds, and whether its depth suits a display."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields
from typing import TYPE_CHECKING, Any

from ..wording import counted
from . import common

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from ..display.display import Display
    from ..display.rig import Rig
    from ..scene.mesh import Mesh
    from ..scene.points import Points
    from ..scene.scene import Scene, SceneObject
    from ..scene.volume import Volume

SHOWN = 20  # objects
BARS, BAR_WIDTH = 16, 40  # of a histogram


def info(
    inputs: common.Inputs,
    display: common.OptionalDisplayName = None,
    camera: common.Camera = None,
    views: common.ViewCount = None,
    shape: common.Shape = None,
    dtype: common.VoxelType = None,
    frame: common.Frame = None,
    spacing: common.Spacing = None,
    transfer: common.Transfer = None,
    mode: common.Mode = None,
    iso: common.Iso = None,
) -> None:
    """Describe scene files and their depth on a display.

    Of a volume it shows a histogram of the values and the transfer function that will be used: without --transfer,
    one that suits the histogram. With --display it prints the depth budget: how far apart adjacent views are, and
    what the display can carry.

    Examples:
      autostereo info bunny.ply
      autostereo info bunny.ply --display looking-glass-portrait
      autostereo info bunny.ply -d visual.json --camera rig.json
      autostereo info head.nii.gz
      autostereo info engine.raw --shape 256x256x128 --dtype uint8
    """
    volumes = common.VolumeOptions(shape, dtype, frame, spacing, transfer, mode, iso)
    where = None if display is None else common.load_display(display, None, False, views)
    rig = common.load_camera(camera)
    scene = common.load_scene(inputs, None, volumes)
    for label, value in describe(scene):
        print(f"{label:<12} {value}")
    if where is not None:
        for label, value in describe_depth(scene, where, rig):
            print(f"{label:<12} {value}")


def describe(scene: Scene) -> list[tuple[str, str]]:
    """Return (label, value) lines about a scene."""
    low, high = scene.bounds
    lines = [("objects", str(len(scene.objects)))]
    for k, item in enumerate(scene.objects[:SHOWN]):
        first, *rest = DESCRIPTIONS[type(item).__name__](item)
        lines += [(f"  {k}", first), *(("", line) for line in rest)]
    if len(scene.objects) > SHOWN:
        lines.append(("  …", f"{len(scene.objects) - SHOWN} more"))
    return [
        *lines,
        ("total", _total(scene)),
        ("bounds", f"({_triple(low)}) to ({_triple(high)})"),
        ("size", " × ".join(f"{side:.4g}" for side in high - low)),
        ("lights", "along the view" if scene.lights is None else str(len(scene.lights))),
        ("memory", f"{sum(_bytes(item) for item in scene.objects) / 1e6:.1f} MB"),
    ]


def _triple(point: object) -> str:
    return ", ".join(f"{value:.5g}" for value in point)  # type: ignore[attr-defined]


def _bytes(item: SceneObject) -> int:
    return sum(getattr(value, "nbytes", 0) for value in (getattr(item, field.name) for field in fields(item)))


def _total(scene: Scene) -> str:
    """How much there is of what, over all objects."""
    counts: dict[str, int] = {}
    for item in scene.objects:
        for noun, field in (("triangles", "faces"), ("vertices", "vertices"), ("points", "positions")):
            counts[noun] = counts.get(noun, 0) + len(getattr(item, field, ()))
        counts["voxels"] = counts.get("voxels", 0) + getattr(getattr(item, "values", None), "size", 0)
    return ", ".join(f"{count:,} {noun}" for noun, count in counts.items() if count)


def _describe_mesh(mesh: Mesh) -> list[str]:
    parts = [f"{len(mesh.faces):,} triangles, {len(mesh.vertices):,} vertices"]
    parts.append("watertight" if mesh.is_closed else "open")
    parts.append("two-sided" if mesh.two_sided else "one-sided")
    parts.append("normals computed" if mesh.normals is None else "with normals")
    if mesh.colors is not None:
        parts.append("vertex colours")
    if mesh.texture is not None:
        parts.append(f"texture {mesh.texture.shape[1]}×{mesh.texture.shape[0]}")
    return [", ".join(parts)]


def _describe_points(points: Points) -> list[str]:
    low, high = points.radii.min(), points.radii.max()
    normals = "without normals" if points.normals is None else "with normals"
    return [f"{len(points):,} points {normals}, radii {low:.4g}" + (f"…{high:.4g}" if high > low else "")]


def _describe_volume(volume: Volume) -> list[str]:
    """Size, spacing, histogram of the values, and the transfer function."""
    low, high = volume.value_range
    shown = volume.mode if volume.iso is None else f"{volume.mode} at {volume.iso:.5g}"
    return [
        f"{'×'.join(map(str, volume.shape))} voxels of {volume.values.dtype}, shown by {shown}",
        f"spacing {' × '.join(f'{x:.5g}' for x in volume.spacing)}, first voxel at ({_triple(volume.origin)})",
        f"values {low:.5g}…{high:.5g}",
        *_histogram(volume),
        "transfer function: value, colour, opacity (extinction per unit of length)",
        *(_transfer_line(point) for point in volume.transfer.points),
    ]


def _histogram(volume: Volume) -> list[str]:
    """Bars whose length goes with the logarithm of the count: one value often outnumbers all others."""
    import numpy as np

    counts, edges = volume.histogram(BARS)
    length = np.log1p(counts) / np.log1p(counts.max()) * BAR_WIDTH
    return [
        f"{start:>10.5g} {'█' * round(bar):<{BAR_WIDTH}} {100 * count / counts.sum():6.2f} %"
        for start, bar, count in zip(edges[:-1], length, counts, strict=True)
    ]


def _transfer_line(point: NDArray[np.float64]) -> str:
    color = "#" + "".join(f"{int(255 * part + 0.5):02x}" for part in point[1:4])
    return f"{point[0]:>10.5g} {color} {point[4]:.4g}"


DESCRIPTIONS: dict[str, Callable[[Any], list[str]]] = {
    "Mesh": _describe_mesh,
    "Points": _describe_points,
    "Volume": _describe_volume,
}


def describe_depth(scene: Scene, display: Display, rig: Rig | None) -> list[tuple[str, str]]:
    """Return (label, value) lines about the depth budget (displays.md 3.4) of a scene on a display."""
    from ..display.framing import depth_budget

    budget = depth_budget(scene, display, rig)
    near, far = budget.comfortable
    verdict = "fits" if budget.fits else "too deep: reduce the baseline, or move the focal plane into the scene"
    return [
        ("display", f"{display.name}, {counted(display.views, 'view')}"),
        ("cameras", f"baseline {budget.baseline:.4g}, focal distance {budget.focal_distance:.4g} (scene units)"),
        ("depth", f"{budget.nearest:.4g} to {budget.farthest:.4g} in front of the cameras"),
        ("disparity", f"{budget.disparity_near:+.2f} px nearest, {budget.disparity_far:+.2f} px farthest, per view"),
        ("comfort", f"{budget.comfort:g} px, reached at depths {near:.4g} and {far:.4g}"),
        ("verdict", verdict),
    ]
