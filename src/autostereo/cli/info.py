"""autostereo info: what a scene holds, and whether its depth suits a display."""

from __future__ import annotations

from typing import TYPE_CHECKING

from . import common

if TYPE_CHECKING:
    from ..display.display import Display
    from ..display.rig import Rig
    from ..scene.mesh import Mesh
    from ..scene.scene import Scene


def info(
    inputs: common.Inputs,
    display: common.OptionalDisplayName = None,
    camera: common.Camera = None,
    views: common.ViewCount = None,
) -> None:
    """Describe scene files and their depth on a display.

    With --display it prints the depth budget: how far apart adjacent views are, and what the display can carry.

    Examples:
      autostereo info bunny.ply
      autostereo info bunny.ply --display looking-glass-portrait
      autostereo info bunny.ply -d visual.json --camera rig.json
    """
    where = None if display is None else common.load_display(display, None, False, views)
    rig = common.load_camera(camera)
    scene = common.load_scene(inputs, None)
    for label, value in describe(scene):
        print(f"{label:<12} {value}")
    if where is not None:
        for label, value in describe_depth(scene, where, rig):
            print(f"{label:<12} {value}")


def describe(scene: Scene) -> list[tuple[str, str]]:
    """Return (label, value) lines about a scene."""
    low, high = scene.bounds
    lines = [("objects", str(len(scene.objects)))]
    lines += [(f"  {k}", _describe_mesh(mesh)) for k, mesh in enumerate(scene.objects[:20])]
    if len(scene.objects) > 20:
        lines.append(("  …", f"{len(scene.objects) - 20} more"))
    faces = sum(len(mesh.faces) for mesh in scene.objects)
    vertices = sum(len(mesh.vertices) for mesh in scene.objects)
    lines += [
        ("total", f"{faces:,} triangles, {vertices:,} vertices"),
        ("bounds", f"({_triple(low)}) to ({_triple(high)})"),
        ("size", " × ".join(f"{side:.4g}" for side in high - low)),
        ("lights", "along the view" if scene.lights is None else str(len(scene.lights))),
        ("memory", f"{sum(_bytes(mesh) for mesh in scene.objects) / 1e6:.1f} MB"),
    ]
    return lines


def _triple(point: object) -> str:
    return ", ".join(f"{value:.5g}" for value in point)  # type: ignore[attr-defined]


def _bytes(mesh: Mesh) -> int:
    arrays = (mesh.vertices, mesh.faces, mesh.normals, mesh.colors, mesh.uv, mesh.texture)
    return sum(array.nbytes for array in arrays if array is not None)


def _describe_mesh(mesh: Mesh) -> str:
    parts = [f"{len(mesh.faces):,} triangles, {len(mesh.vertices):,} vertices"]
    parts.append("watertight" if mesh.is_closed else "open")
    parts.append("two-sided" if mesh.two_sided else "one-sided")
    parts.append("normals given" if mesh.normals is not None else "normals computed")
    if mesh.colors is not None:
        parts.append("vertex colours")
    if mesh.texture is not None:
        parts.append(f"texture {mesh.texture.shape[1]}×{mesh.texture.shape[0]}")
    return ", ".join(parts)


def describe_depth(scene: Scene, display: Display, rig: Rig | None) -> list[tuple[str, str]]:
    """Return (label, value) lines about the depth budget (displays.md 3.4) of a scene on a display."""
    from ..display.framing import depth_budget

    budget = depth_budget(scene, display, rig)
    near, far = budget.comfortable
    verdict = "fits" if budget.fits else "too deep: reduce the baseline, or move the focal plane into the scene"
    return [
        ("display", f"{display.name}, {display.views} views"),
        ("cameras", f"baseline {budget.baseline:.4g}, focal distance {budget.focal_distance:.4g} (scene units)"),
        ("depth", f"{budget.nearest:.4g} to {budget.farthest:.4g} in front of the cameras"),
        ("disparity", f"{budget.disparity_near:+.2f} px nearest, {budget.disparity_far:+.2f} px farthest, per view"),
        ("comfort", f"{budget.comfort:g} px, reached at depths {near:.4g} and {far:.4g}"),
        ("verdict", verdict),
    ]
