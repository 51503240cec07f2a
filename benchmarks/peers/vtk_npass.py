"""The VTK peer alone: time of V passes, and one view as a picture. See peers/README.md."""

from __future__ import annotations

from argparse import Namespace

from loop import main

from autostereo.cli.benchmarks.peers_vtk import VTKLoop, shared_window


def variant(switches: Namespace) -> str:
    """Which of the variants of VTKLoop."""
    if switches.plain:
        return "plain"
    return "prelit" if switches.lighting == "vertex" else "tuned"


if __name__ == "__main__":
    main(lambda scene, rig, size, switches: VTKLoop(shared_window(), scene, rig, size, variant(switches)))
