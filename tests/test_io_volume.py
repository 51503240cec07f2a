"""Volume files of SimpleITK, tifffile and NumPy: axis order, handedness and place of a marked voxel; broken files."""

import gzip
import sys

import numpy as np
import pytest

import autostereo as aus
from volume_files import MARK, ORIGIN, SHAPE, SPACING, TURN, check_phantom, load_one, phantom, refused

sitk = pytest.importorskip("SimpleITK")
tifffile = pytest.importorskip("tifffile")

ITK = (".nrrd", ".nhdr", ".nii", ".nii.gz", ".mha", ".mhd")


def write(path, values=None, spacing=SPACING, origin=ORIGIN, direction=TURN, compress=False):
    """Write a volume (nz, ny, nx) by SimpleITK, obliquely unless told otherwise."""
    image = sitk.GetImageFromArray(phantom() if values is None else values)
    image.SetSpacing(spacing)
    image.SetOrigin(origin)
    image.SetDirection(np.ravel(direction))
    sitk.WriteImage(image, str(path), useCompression=compress)
    return path


# --- SimpleITK -----------------------------------------------------------------------------------------------------
@pytest.mark.parametrize("compress", [False, True])
@pytest.mark.parametrize("suffix", ITK)
def test_phantom(tmp_path, suffix, compress):
    check_phantom(load_one(write(tmp_path / f"a{suffix}", compress=compress)), direction=TURN)


@pytest.mark.parametrize("dtype", ["uint8", "int8", "uint16", "int16", "float32"])
def test_types_stay(tmp_path, dtype):
    volume = load_one(write(tmp_path / "a.nrrd", phantom(dtype)))
    assert volume.values.dtype == dtype
    check_phantom(volume, direction=TURN)


def test_wide_types_are_narrowed(tmp_path):
    assert load_one(write(tmp_path / "a.nrrd", phantom("int32"))).values.dtype == np.uint8
    assert load_one(write(tmp_path / "b.nrrd", phantom("float64"))).values.dtype == np.float32
    wide = load_one(write(tmp_path / "c.nrrd", phantom("int32") * 1000))
    assert wide.values.dtype == np.float32
    check_phantom(wide, direction=TURN, value=100_000)


def nifti(matrix, values, slope=1.0, intercept=0.0, datatype=(4, 16)):
    """The bytes of a NIfTI-1 file, by hand: `matrix` (3, 4) leads from index to RAS."""
    header = np.zeros(352, np.uint8)

    def put(at, *numbers, dtype="<f4"):
        raw = np.array(numbers, dtype).view(np.uint8)
        header[at : at + len(raw)] = raw

    put(0, 348, dtype="<i4")
    put(40, values.ndim, *values.shape[::-1], *[1] * (7 - values.ndim), dtype="<i2")
    put(70, *datatype, dtype="<i2")
    put(76, 1.0, *np.linalg.norm(matrix[:, :3], axis=0), *[1.0] * (values.ndim - 3))
    put(108, 352.0, slope, intercept)
    put(254, 1, dtype="<i2")  # sform_code: scanner
    put(280, *np.ravel(matrix))
    header[344:348] = np.frombuffer(b"n+1\0", np.uint8)
    return header.tobytes() + values.tobytes()


def test_nifti_is_ras_and_the_world_is_lps(tmp_path):
    """A file that says: index x to the right, y to anterior, z to superior. In LPS x and y are negated."""
    matrix = np.column_stack([np.diag(SPACING), ORIGIN])
    path = tmp_path / "a.nii"
    path.write_bytes(nifti(matrix, phantom("<i2")))
    lps = np.diag([-1.0, -1.0, 1.0])
    check_phantom(load_one(path), origin=lps @ ORIGIN, direction=lps)


def test_files_that_say_how_the_patient_lay_are_anatomical(tmp_path):
    matrix = np.column_stack([np.diag(SPACING), ORIGIN])
    known = nifti(matrix, phantom("<i2"))
    unknown = known[:254] + bytes(2) + known[256:]  # sform_code 0
    for name, data, expected in (("a.nii", known, True), ("b.nii", unknown, False)):
        (tmp_path / name).write_bytes(data)
        assert load_one(tmp_path / name).anatomical is expected
    assert load_one(write(tmp_path / "c.nrrd", phantom())).anatomical
    assert not load_one(write(tmp_path / "d.mha", phantom())).anatomical
    np.save(tmp_path / "e.npy", phantom())
    assert not load_one(tmp_path / "e.npy").anatomical


def test_scaled_integers_become_float32(tmp_path):
    path = tmp_path / "a.nii"
    path.write_bytes(nifti(np.column_stack([np.eye(3), np.zeros(3)]), phantom("<i2"), slope=2.5, intercept=10))
    volume = load_one(path)
    assert volume.values.dtype == np.float32
    assert np.array_equal(volume.values, phantom("float32") * 2.5 + 10)


def test_nrrd_of_ras_is_turned_to_lps(tmp_path):
    path = tmp_path / "a.nrrd"
    head = "NRRD0004\ntype: int16\ndimension: 3\nspace: right-anterior-superior\nsizes: 9 7 5\n"
    head += "space directions: (0.5,0,0) (0,2,0) (0,0,3)\nspace origin: (10,-20,30)\nendian: little\nencoding: raw\n\n"
    path.write_bytes(head.encode() + phantom("<i2").tobytes())
    check_phantom(load_one(path), origin=(-10, 20, 30), direction=np.diag([-1.0, -1.0, 1.0]))


@pytest.mark.parametrize("encoding", ["raw", "gzip"])
@pytest.mark.parametrize("detached", [False, True])
def test_nrrd_with_a_space_but_spacings_per_axis(tmp_path, detached, encoding):
    """Against the format, but found (VTK's headsq); ITK refuses it."""
    folder = tmp_path / "a folder"
    folder.mkdir()
    head = "NRRD0004\ntype: short\ndimension: 3\nspace: 3D-left-handed\nsizes: 9 7 5\nspacings: 0.5 2 3\n"
    head += f"endian: little\nencoding: {encoding}\n"
    data = phantom("<i2").tobytes()
    data = gzip.compress(data) if encoding == "gzip" else data
    if detached:
        (folder / "data.bin").write_bytes(data)
        path = folder / "a.nhdr"
        path.write_text(head + "data file: data.bin\n")
    else:
        path = folder / "a.nrrd"
        path.write_bytes(head.encode() + b"\n" + data)
    check_phantom(load_one(path), origin=(0, 0, 0))


def test_nrrd_of_axes_that_are_not_independent(tmp_path):
    head = "NRRD0004\ntype: int16\ndimension: 3\nspace: right-anterior-superior\nsizes: 9 7 5\n"
    head += "space directions: (1,0,0) (1,0,0) (0,0,1)\nendian: little\nencoding: raw\n\n"
    path = tmp_path / "a.nrrd"
    path.write_bytes(head.encode() + phantom("<i2").tobytes())
    refused(path, "cannot use the directions of its axes, which are not independent")


def test_nrrd_over_one_file_a_slice(tmp_path):
    for k, plane in enumerate(phantom("<i2")):
        (tmp_path / f"s.{k + 1}").write_bytes(plane.tobytes())
    head = "NRRD0004\ntype: short\ndimension: 3\nspace: 3D-left-handed\nsizes: 9 7 5\nspacings: 0.5 2 3\n"
    (tmp_path / "a.nhdr").write_text(head + "endian: little\nencoding: raw\ndata file: s.%d 1 5 1\n")
    check_phantom(load_one(tmp_path / "a.nhdr"), origin=(0, 0, 0))


@pytest.mark.parametrize("suffix", [".nrrd", ".nii.gz", ".mha"])
def test_frames_of_4d_files(tmp_path, suffix):
    images = [sitk.GetImageFromArray(phantom() * k) for k in (1, 2, 3)]
    for image in images:
        image.SetSpacing(SPACING)
        image.SetOrigin(ORIGIN)
        image.SetDirection(np.ravel(TURN))
    path = tmp_path / f"a{suffix}"
    sitk.WriteImage(sitk.JoinSeries(images), str(path))
    for k in (1, 2, 3):
        check_phantom(load_one(path, frame=k - 1), direction=TURN, value=100 * k)
    refused(path, "holds 3 frames; choose one, --frame 0 … 2")
    refused(path, "no frame 3, it holds 3", frame=3)


def test_spacing_is_replaced(tmp_path):
    path = write(tmp_path / "a.nrrd")
    check_phantom(load_one(path, spacing=(1, 2, 4)), spacing=(1, 2, 4), direction=TURN)
    assert load_one(path, frame=0).shape == SHAPE


# --- broken --------------------------------------------------------------------------------------------------------
@pytest.mark.parametrize("share", [0.999, 0.7, 0.3])
@pytest.mark.parametrize("compress", [False, True])
@pytest.mark.parametrize("suffix", [".nrrd", ".nii", ".nii.gz", ".mha", ".vtk", ".tif", ".vti"])
def test_truncated(tmp_path, capfd, suffix, compress, share):
    values = np.random.default_rng(0).integers(0, 4000, (20, 30, 40)).astype(np.int16)
    path = tmp_path / f"a{suffix}"
    if suffix == ".tif":
        tifffile.imwrite(path, values, compression="zlib" if compress else None)
    elif suffix == ".vti":
        pytest.importorskip("vtk")
        from test_io_vtk import write_vti

        write_vti(path, values, compressor="zlib" if compress else None, mode="appended")
    else:
        write(path, values, compress=compress, direction=np.eye(3))
    assert np.array_equal(load_one(path).values, values)
    data = path.read_bytes()
    path.write_bytes(data[: int(len(data) * share)])
    refused(path)
    assert capfd.readouterr() == ("", "")


def test_a_gzip_of_several_members_is_whole(tmp_path):
    path = write(tmp_path / "a.nii", direction=np.eye(3))
    data = path.read_bytes()
    (tmp_path / "b.nii.gz").write_bytes(gzip.compress(data[:500]) + gzip.compress(data[500:]))
    check_phantom(load_one(tmp_path / "b.nii.gz"))


@pytest.mark.parametrize("dtype", ["<i2", "<f4"])
def test_damaged_nifti_gz(tmp_path, dtype):
    """Its end still tells the right size, and ITK looks at the sum before it in small files only."""
    kind = (4, 16) if dtype == "<i2" else (16, 32)
    values = np.random.default_rng(0).integers(0, 30000, (60, 80, 100)).astype(dtype)
    whole = nifti(np.column_stack([np.eye(3), np.zeros(3)]), values, datatype=kind)
    packed = gzip.compress(whole)
    path = tmp_path / "a.nii.gz"
    path.write_bytes(packed)
    assert np.array_equal(load_one(path).values, values)
    for at in (-7, len(packed) // 2):
        bad = bytearray(packed)
        bad[at] ^= 255
        path.write_bytes(bad)
        refused(path, "damaged")
    # stored without compression, so that nothing but the sum shows it
    bad = bytearray(gzip.compress(whole, compresslevel=0))
    bad[-100] ^= 1
    path.write_bytes(bad)
    refused(path, "is damaged (CRC check failed")


@pytest.mark.parametrize(
    ("at", "number", "message"),
    [
        (80, 0.0, "cannot use its voxels' size (pixdim), 0, 1, 1"),
        (88, np.nan, "cannot use its voxels' size (pixdim), 1, 1, nan"),
        (108, np.nan, "cannot use the place of its voxels (vox_offset), nan"),
        (108, -5.0, "cannot use the place of its voxels (vox_offset), -5"),
    ],
)
@pytest.mark.parametrize("suffix", [".nii", ".nii.gz"])
def test_nifti_headers_without_sense(tmp_path, at, number, message, suffix):
    """ITK takes its defaults for them."""
    data = bytearray(nifti(np.column_stack([np.eye(3), np.zeros(3)]), phantom("<i2")))
    data[at : at + 4] = np.array([number], "<f4").tobytes()
    path = tmp_path / f"a{suffix}"
    path.write_bytes(gzip.compress(bytes(data)) if suffix == ".nii.gz" else data)
    refused(path, message)


@pytest.mark.parametrize("suffix", [".mhd", ".nhdr"])
def test_missing_and_short_data_files(tmp_path, capfd, suffix):
    path = write(tmp_path / f"a{suffix}")
    data = tmp_path / "a.raw"
    whole = data.read_bytes()
    data.write_bytes(whole[:100])
    refused(path)
    data.unlink()
    refused(path, "a.raw")
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("suffix", [*ITK, ".tif", ".vti", ".vtk", ".vol", ".raw", ".dcm", ".npy"])
def test_other_contents_than_the_name_says(tmp_path, capfd, suffix):
    path = tmp_path / f"a{suffix}"
    refused(path, "no such file")
    path.touch()
    refused(path, "is empty")
    path.write_text("<!DOCTYPE html>\n<html><body>404</body></html>")
    refused(path, "web page")
    path.write_text("version https://git-lfs.github.com/spec/v1\noid sha256:1\nsize 12\n")
    refused(path, "Git LFS")
    for seed in range(5):
        path.write_bytes(np.random.default_rng(seed).bytes(3000))
        refused(path)
    path.write_text("NRRD0004\nObjectType = Image\nX: y\n# vtk DataFile Version 3.0\n.\n")
    refused(path)
    assert capfd.readouterr() == ("", "")


def test_colours_pictures_and_single_slices(tmp_path):
    image = sitk.GetImageFromArray(phantom())
    sitk.WriteImage(sitk.Compose(image, image, image), str(tmp_path / "a.nrrd"))
    refused(tmp_path / "a.nrrd", "3 numbers a voxel")
    sitk.WriteImage(image[:, :, 1], str(tmp_path / "b.nii"))
    refused(tmp_path / "b.nii", "picture of 9×7")
    sitk.WriteImage(image[:, :, 1:2], str(tmp_path / "c.nii"))
    refused(tmp_path / "c.nii", "at least 2 voxels along each axis, got (1, 7, 9)")


@pytest.mark.parametrize("suffix", [".nrrd", ".nii", ".nii.gz", ".mha", ".npy", ".tif"])
@pytest.mark.parametrize("dtype", ["float32", "float64"])
def test_nan_voxels_are_counted(tmp_path, suffix, dtype):
    values = phantom(dtype)
    values[1, 1, 1:4] = np.nan, np.inf, -np.inf
    path = tmp_path / f"a{suffix}"
    if suffix == ".npy":
        np.save(path, values)
    elif suffix == ".tif":
        tifffile.imwrite(path, values, photometric="minisblack")
    else:
        write(path, values)
    refused(path, "NaN or infinity in 3 ")


def test_big_endian_nifti_with_nan(tmp_path):
    path = write(tmp_path / "a.nii", phantom("float32"))
    header = bytearray(path.read_bytes()[:352])
    fields = [("i4", 0, 1), ("i4", 32, 1), ("i2", 40, 8), ("f4", 56, 3), ("i2", 68, 4), ("f4", 76, 11), ("i2", 120, 1)]
    fields += [("f4", 124, 4), ("i4", 140, 2), ("i2", 252, 2), ("f4", 256, 18)]
    for kind, at, count in fields:
        size = int(kind[1]) * count
        numbers = np.frombuffer(bytes(header[at : at + size]), "<" + kind)
        header[at : at + size] = numbers.astype(">" + kind).tobytes()
    path.write_bytes(bytes(header) + phantom(">f4").tobytes())
    check_phantom(load_one(path), direction=TURN)
    values = phantom(">f4")
    values[0, 0, :2] = np.nan
    path.write_bytes(bytes(header) + values.tobytes())
    refused(path, "NaN or infinity in 2 voxels")


def test_zero_size_axes(tmp_path):
    head = "NRRD0004\ntype: short\ndimension: 3\nsizes: 9 0 5\nencoding: raw\nendian: little\n\n"
    (tmp_path / "a.nrrd").write_text(head)
    refused(tmp_path / "a.nrrd")
    np.save(tmp_path / "b.npy", np.zeros((3, 0, 4)))
    refused(tmp_path / "b.npy", "at least 2 voxels")
    np.save(tmp_path / "c.npy", np.zeros((0, 3, 3, 4)))
    refused(tmp_path / "c.npy", "no voxels")


@pytest.mark.parametrize(("module", "suffix"), [("SimpleITK", ".nrrd"), ("tifffile", ".tif")])
def test_missing_packages_are_named(tmp_path, monkeypatch, module, suffix):
    path = tmp_path / f"a{suffix}"
    path.write_bytes(b"II*\0" + bytes(100))
    monkeypatch.setitem(sys.modules, module, None)
    refused(path, module, "pip install autostereo[volumes]", error=aus.DependencyError)


# --- NumPy ---------------------------------------------------------------------------------------------------------
def test_npy_and_npz(tmp_path):
    np.save(tmp_path / "a.npy", phantom())
    np.savez(tmp_path / "b.npz", phantom())
    np.save(tmp_path / "c.npy", np.stack([phantom(), phantom() * 2]))
    for name in ("a.npy", "b.npz"):
        check_phantom(load_one(tmp_path / name, spacing=SPACING), origin=(0, 0, 0))
    check_phantom(load_one(tmp_path / "c.npy", frame=1), (1, 1, 1), (0, 0, 0), value=200)
    refused(tmp_path / "c.npy", "holds 2 frames")


def test_several_files_share_one_scene(tmp_path):
    np.save(tmp_path / "a.npy", phantom())
    scene = aus.load(tmp_path / "a.npy", write(tmp_path / "b.nrrd"))
    assert [type(item) for item in scene.objects] == [aus.Volume, aus.Volume]
    assert scene.objects[0].values[MARK[::-1]] == 100


def test_hints_that_no_file_wants(tmp_path):
    np.save(tmp_path / "a.npy", phantom())
    with pytest.raises(aus.InputError, match=r"shape: only .raw files"):
        aus.load(tmp_path / "a.npy", shape=SHAPE)
    (tmp_path / "a.off").write_text("OFF 3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n")
    with pytest.raises(aus.InputError, match="only files of volumes"):
        aus.load(tmp_path / "a.off", frame=0)
    bad = [{"shape": (1, 2)}, {"shape": (1, 2, 0)}, {"dtype": "x"}, {"frame": -1}, {"frame": 1.5}]
    for hints in (*bad, {"spacing": (1, 0, 1)}):
        with pytest.raises(aus.InputError, match=next(iter(hints))):
            aus.load(tmp_path / "a.npy", **hints)
