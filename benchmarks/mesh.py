"""autostereo's mesh rendering against its peers; the same as ``autostereo bench mesh``, with every switch."""

from __future__ import annotations

from switches import main

if __name__ == "__main__":
    main("mesh", __doc__)
