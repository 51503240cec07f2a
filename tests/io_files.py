"""What the tests of readers share."""

from pathlib import Path

import pytest

from autostereo import FileError
from autostereo.io import load

DATA = Path(__file__).resolve().parents[2] / "shared" / "data"
needs_data = pytest.mark.skipif(not DATA.is_dir(), reason=f"no test data at {DATA}")


def only(path):
    """The only object of a file."""
    (mesh,) = load(path).objects
    return mesh


def refused(path, *words):
    """Loading must fail with one sentence that names the file (or one beside it) and holds the words."""
    with pytest.raises(FileError) as caught:
        load(path)
    message = str(caught.value)
    assert str(Path(path).with_suffix("")) in message and "\n" not in message
    for word in words:
        assert word in message, message
