"""The moderngl peer alone: time of V passes, and one view as a picture. See peers/README.md."""

from __future__ import annotations

from loop import main

from autostereo.cli.benchmarks.peers_moderngl import ModernGLLoop, shared_context

if __name__ == "__main__":
    main(
        lambda scene, rig, size, switches: ModernGLLoop(
            shared_context(), scene, rig, size, switches.lighting, switches.plain
        )
    )
