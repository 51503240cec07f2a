"""autostereo's surfels against V passes; the same as ``autostereo bench points``, with every switch."""

from __future__ import annotations

from switches import main

if __name__ == "__main__":
    main("points", __doc__)
