"""autostereo's volumes against V passes and VTK; the same as ``autostereo bench volume``, with every switch."""

from __future__ import annotations

from switches import main

if __name__ == "__main__":
    main("volume", __doc__)
