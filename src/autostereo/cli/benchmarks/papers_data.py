"""What ``bench papers`` draws: the papers' own data if the data folder has them, else stand-ins; said in words."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ...io import load
from ...scene import samples
from ...scene.mesh import Mesh
from ...scene.scene import Scene
from ...scene.shapes import displaced_sphere, uv_sphere
from ...scene.volume import Volume
from . import workloads
from .papers_published import BUCKY, BUNNY, DRAGON, ENGINE, HYDROGEN, NEGHIP, SKULL
from .suite import BenchOptions

VOLUMES: dict[str, tuple[str, int, Callable[[int], Volume]]] = {  # file in DIR/volumes, voxels a side, stand-in
    BUCKY: ("Bucky.raw", 32, samples.c60_density),
    NEGHIP: ("neghip_64x64x64_uint8.raw", 64, samples.shells),
    HYDROGEN: ("hydrogen.vti", 128, samples.hydrogen_orbital),
    ENGINE: ("engine.nii.gz", 256, samples.engine_part),
    SKULL: ("bonsai.nii.gz", 256, samples.shells),
}
MESHES = {BUNNY: ("bun_zipper.ply", 264), DRAGON: ("dragon.ply", 318)}  # file in DIR/meshes, columns of a like sphere


class Subject(NamedTuple):
    """A scene, and which data it is."""

    scene: Scene
    words: str

    @classmethod
    def of_mesh(cls, mesh: Mesh, source: str) -> Subject:
        """A mesh, by what made it."""
        return cls(Scene((mesh,)), f"data: {source}, {len(mesh.faces)} triangles")


def volume(options: BenchOptions, name: str) -> Subject:
    """A volume that 2007a names."""
    file, side, stand_in = VOLUMES[name]
    path = _file(options, "volumes", file)
    if path is None:
        voxels = max(32, side // options.divisor)
        return Subject(Scene((stand_in(voxels),)), f"data: stand-in {stand_in.__name__}({voxels})")
    hints: dict[str, Any] = {"shape": (side,) * 3, "dtype": "uint8"} if path.suffix == ".raw" else {}
    scene = load(path, **hints)
    shape = "×".join(str(n) for item in scene.objects if isinstance(item, Volume) for n in item.shape)
    return Subject(scene, f"data: {path.name}, {shape} voxels")  # not always of the size that the paper names


def stanford(options: BenchOptions, name: str) -> Subject:
    """A mesh of the Stanford repository, which 2007b thanks for its data; or a sphere of as many triangles."""
    file, columns = MESHES[name]
    path = _file(options, "meshes", file)
    if path is None:
        return globe(options, columns, columns // 2)
    return Subject.of_mesh(workloads.the_mesh(load(path)), path.name)


def globe(options: BenchOptions, columns: int, rows: int) -> Subject:
    """A sphere of 2 · columns · (rows − 1) triangles, with texture coordinates; a small one if quick."""
    if options.quick:
        columns, rows = 16, max(8, 16 * rows // columns)
    return Subject.of_mesh(uv_sphere(columns, rows), f"stand-in uv_sphere({columns}, {rows})")


def sphere(options: BenchOptions, subdivisions: int) -> Subject:
    """A mesh in place of those that the papers do not name: 20·4^subdivisions triangles; a small one if quick."""
    subdivisions = 2 if options.quick else subdivisions
    return Subject.of_mesh(displaced_sphere(subdivisions), f"stand-in displaced_sphere({subdivisions})")


def unindexed(scene: Scene) -> Scene:
    """The same mesh, each triangle with vertices of its own."""
    mesh = workloads.the_mesh(scene)
    corners, colors = mesh.faces.ravel(), mesh.colors
    own = Mesh(
        mesh.vertices[corners],
        np.arange(len(corners)).reshape(-1, 3),
        normals=mesh.shading_normals[corners],
        colors=None if colors is None else colors[corners],
        material=replace(mesh.material, two_sided=mesh.two_sided),  # that of a closed surface cannot be seen any more
    )
    return Scene((own,))


def surfels(options: BenchOptions, count: int) -> Subject:
    """Points in place of those that 2007b does not name; few if quick."""
    count = 400 if options.quick else count
    return Subject(workloads.surfel_scene(count), f"data: stand-in surfel_cloud({count})")


def _file(options: BenchOptions, kind: str, name: str) -> Path | None:
    if options.data is None or options.quick:
        return None
    path = options.data / kind / name
    return path if path.is_file() else None
