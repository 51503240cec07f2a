"""The papers' tables beside their printed figures; the same as ``autostereo bench papers``, with every switch."""

from __future__ import annotations

from switches import main

if __name__ == "__main__":
    main("papers", __doc__)
