"""The VTK peer alone: time of V passes, and one view as a picture. See peers/README.md."""

from __future__ import annotations

from loop import main

from autostereo.cli.benchmarks.peers_vtk import VTKLoop, shared_window

if __name__ == "__main__":
    main(
        lambda scene, rig, size, lighting: VTKLoop(
            shared_window(), scene, rig, size, "prelit" if lighting == "vertex" else "tuned"
        )
    )
