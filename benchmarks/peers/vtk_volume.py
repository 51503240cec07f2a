"""VTK's ray caster alone: time of V passes over a volume, and one view as a picture. See peers/README.md."""

from __future__ import annotations

from loop import main

from autostereo.cli.benchmarks import workloads
from autostereo.cli.benchmarks.harness import cores
from autostereo.cli.benchmarks.peers_vtk import shared_window
from autostereo.cli.benchmarks.peers_vtk_volume import VTKVolumeLoop

if __name__ == "__main__":
    main(
        lambda scene, rig, size, switches: VTKVolumeLoop(shared_window(), scene, rig, size, cores()),
        lambda: workloads.shells_scene(128),
        views=3,
    )
