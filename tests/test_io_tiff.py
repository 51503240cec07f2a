"""TIFF stacks: order of axes, spacing, frames; pages that are missing, of other sizes, or written one by one."""

import numpy as np
import pytest

from volume_files import SPACING, check_phantom, load_one, phantom, refused

tifffile = pytest.importorskip("tifffile")


@pytest.mark.parametrize("compression", [None, "zlib"])
def test_tiff_stack(tmp_path, compression):
    path = tmp_path / "a.tif"
    tifffile.imwrite(path, phantom("uint16"), compression=compression, photometric="minisblack")
    check_phantom(load_one(path), spacing=(1, 1, 1), origin=(0, 0, 0))
    check_phantom(load_one(path, spacing=SPACING), origin=(0, 0, 0))


def test_tiff_of_imagej(tmp_path):
    path = tmp_path / "a.tif"
    meta = {"spacing": SPACING[2], "unit": "um", "axes": "ZYX"}
    tifffile.imwrite(path, phantom("uint16"), imagej=True, resolution=(1 / SPACING[0], 1 / SPACING[1]), metadata=meta)
    check_phantom(load_one(path), origin=(0, 0, 0))


def test_tiff_hyperstacks_have_frames(tmp_path):
    path = tmp_path / "a.ome.tif"
    stack = np.stack([np.stack([phantom("uint16") * (1 + c + 2 * t) for c in (0, 1)]) for t in (0, 1, 2)])
    meta = {"axes": "TCZYX", **{f"PhysicalSize{axis}": s for axis, s in zip("XYZ", SPACING, strict=True)}}
    tifffile.imwrite(path, stack, metadata=meta)
    for frame in range(6):
        check_phantom(load_one(path, frame=frame), origin=(0, 0, 0), value=100 * (1 + frame))
    refused(path, "holds 6 frames")


def test_tiffs_that_are_no_stack(tmp_path):
    path = tmp_path / "a.tif"
    tifffile.imwrite(path, phantom("uint8")[0])
    refused(path, "one picture of 9×7", "expected a stack")
    tifffile.imwrite(path, np.zeros((5, 7, 9, 3), np.uint8), photometric="rgb")
    refused(path, "colour")


def one_by_one(path, pages, **more):
    """Write pages that do not know of each other."""
    with tifffile.TiffWriter(path) as writer:
        for page in pages:
            writer.write(page, contiguous=False, photometric="minisblack", **more)


@pytest.mark.parametrize("metadata", [None, {}])
def test_pages_one_by_one(tmp_path, metadata):
    path = tmp_path / "a.tif"
    one_by_one(path, phantom("uint16"), metadata=metadata)
    check_phantom(load_one(path), spacing=(1, 1, 1), origin=(0, 0, 0))
    one_by_one(path, [*phantom("uint16"), np.zeros((5, 6), np.uint16)], metadata=metadata)
    refused(path, "holds pictures of other sizes beside 9×7: 6×5, expected a stack")
    one_by_one(path, [*phantom("uint16"), np.zeros((7, 9), np.uint8)], metadata=metadata)
    refused(path, "holds pictures of other sizes or types, expected a stack")


@pytest.mark.parametrize("metadata", [None, {}])
@pytest.mark.parametrize("compression", [None, "zlib"])
@pytest.mark.parametrize("share", [0.4, 0.6, 0.8])
def test_lost_pages(tmp_path, metadata, compression, share):
    """The pages that are left would make a stack too."""
    path = tmp_path / "a.tif"
    one_by_one(path, phantom("uint16"), metadata=metadata, compression=compression)
    data = path.read_bytes()
    path.write_bytes(data[: int(share * len(data))])
    refused(path, "damaged")


def test_several_series(tmp_path):
    path = tmp_path / "a.ome.tif"
    with tifffile.TiffWriter(path) as writer:
        writer.write(phantom("uint16"), metadata={"axes": "ZYX"}, photometric="minisblack")
        writer.write(phantom("uint16")[:3], metadata={"axes": "ZYX"}, photometric="minisblack")
    with pytest.warns(UserWarning, match="holds 2 series; the first is read"):
        check_phantom(load_one(path), spacing=(1, 1, 1), origin=(0, 0, 0))
