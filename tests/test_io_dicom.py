"""Folders: DICOM series written by SimpleITK, with what is wrong with them in practice; stacks of pictures."""

import locale

import numpy as np
import pytest

import autostereo as aus
from autostereo.transforms import rotation
from volume_files import ORIGIN, SHAPE, SPACING, TURN, check_phantom, load_one, phantom, refused

sitk = pytest.importorskip("SimpleITK")

SERIES = "1.2.826.0.1.3680043.2.1125.1."


@pytest.fixture(autouse=True)
def same_locale():
    """SimpleITK sets the locale to C when it writes DICOM, and other tests would decode text as ASCII."""
    before = locale.setlocale(locale.LC_ALL)
    yield
    locale.setlocale(locale.LC_ALL, before)


def test_reading_leaves_the_locale_alone(tmp_path):
    before = locale.setlocale(locale.LC_ALL)
    write_series(tmp_path)
    locale.setlocale(locale.LC_ALL, before)
    load_one(tmp_path)
    assert locale.setlocale(locale.LC_ALL) == before


def write_slice(path, plane, position, turn=TURN, spacing=SPACING, series="1", number=1, **tags):
    """Write one CT slice (ny, nx): `position` of its first pixel; columns of `turn` are the axes."""
    image = sitk.GetImageFromArray(plane[None] if plane.ndim == 2 else plane)
    image.SetSpacing(spacing)
    image.SetOrigin(tuple(map(float, position)))
    image.SetDirection(np.ravel(turn))
    for key, value in {
        "0008|0060": "CT",
        "0008|0018": f"{SERIES}9.{series}.{number}",
        "0020|000d": f"{SERIES}7",
        "0020|000e": f"{SERIES}{series}",
        "0020|0013": str(number),
        "0020|0032": "\\".join(f"{x:.9f}" for x in position),
        "0020|0037": "\\".join(f"{x:.12f}" for x in np.ravel(turn[:, :2].T)),
        "0028|0030": f"{spacing[1]}\\{spacing[0]}",
        "0018|0050": str(spacing[2]),
        **{key.replace("_", "|"): value for key, value in tags.items()},
    }.items():
        image.SetMetaData(key, value)
    writer = sitk.ImageFileWriter()
    writer.KeepOriginalImageUIDOn()
    writer.SetFileName(str(path))
    writer.Execute(image)


def write_series(folder, values=None, turn=TURN, series="1", step=None, shuffle=True, **more):
    """Write a series as files whose names and numbers do not follow the positions; returns slice → file."""
    values = phantom() if values is None else values
    step = turn[:, 2] * SPACING[2] if step is None else step
    order = np.random.default_rng(3).permutation(len(values)) if shuffle else np.arange(len(values))
    files = {}
    for name, k in enumerate(order):
        files[int(k)] = folder / f"{series}_{name:03}.dcm"
        write_slice(files[int(k)], values[k], np.array(ORIGIN) + k * step, turn, series=series, number=name + 1, **more)
    return files


def test_phantom(tmp_path, capfd):
    write_series(tmp_path)
    volume = load_one(tmp_path)
    check_phantom(volume, direction=TURN)
    assert volume.anatomical
    assert capfd.readouterr() == ("", "")


def test_a_series_against_its_normal_comes_out_the_same(tmp_path):
    """Slices stored from the last to the first are sorted along the normal."""
    write_series(tmp_path, phantom()[::-1], step=-TURN[:, 2] * SPACING[2])
    volume = load_one(tmp_path)
    first = np.array(ORIGIN) - 4 * SPACING[2] * TURN[:, 2]
    check_phantom(volume, origin=first, direction=TURN)


def test_a_tilted_gantry_shears_the_volume(tmp_path):
    step = TURN @ (0.0, 1.0, 3.0)
    write_series(tmp_path, step=step)
    gap = np.linalg.norm(step)
    direction = np.column_stack([TURN[:, :2], step / gap])
    check_phantom(load_one(tmp_path), spacing=(*SPACING[:2], gap), direction=direction)


def test_hounsfield_units(tmp_path):
    """Stored numbers are rescaled by slope and intercept."""
    write_series(tmp_path, phantom("int16") - 1024)
    assert load_one(tmp_path).value_range == (-1024, 100 - 1024)


def test_the_longest_series_is_read(tmp_path):
    write_series(tmp_path)
    write_series(tmp_path, phantom()[:3] * 7, series="2")
    with pytest.warns(UserWarning, match="holds 2 series of 5, 3 slices; the longest is read"):
        check_phantom(load_one(tmp_path), direction=TURN)


def test_frames_of_a_series(tmp_path):
    """Two times at every position, in the order of their instance numbers."""
    for time in (0, 1):
        for k, plane in enumerate(phantom() * (time + 1)):
            position = np.array(ORIGIN) + k * SPACING[2] * TURN[:, 2]
            write_slice(tmp_path / f"{time}_{k}.dcm", plane, position, number=1 + 5 * time + k)
    for time in (0, 1):
        check_phantom(load_one(tmp_path, frame=time), direction=TURN, value=100 * (time + 1))
    refused(tmp_path, "holds 2 frames; choose one")
    (tmp_path / "0_2.dcm").unlink()
    refused(tmp_path, "slices are missing: 2 share a position, but only 1")


def test_missing_slices(tmp_path):
    files = write_series(tmp_path)
    files[2].unlink()
    position = ORIGIN @ TURN[:, 2] + SPACING[2]
    refused(tmp_path, f"slices are missing: after {position:g}", "is 6 away, usual are 3")
    files[3].unlink()
    files[4].unlink()
    check = load_one(tmp_path)  # the two that are left do not show that others were there
    assert check.shape == (9, 7, 2)
    files[1].unlink()
    refused(tmp_path, "one DICOM slice")


def test_mixed_orientations(tmp_path):
    write_series(tmp_path)
    write_slice(tmp_path / "scout.dcm", phantom()[0], ORIGIN, TURN @ rotation((0, 1, 0), 90)[:3, :3], number=9)
    refused(tmp_path, "mixed orientations")


def test_mixed_sizes_and_spacings(tmp_path):
    write_series(tmp_path)
    position = np.array(ORIGIN) + 5 * SPACING[2] * TURN[:, 2]
    write_slice(tmp_path / "x.dcm", np.zeros((7, 8), np.int16), position, number=9)
    refused(tmp_path, "differ in size", "9×7", "8×7")
    write_slice(tmp_path / "x.dcm", phantom()[0], position, spacing=(0.6, 2, 3), number=9)
    refused(tmp_path, "differ in spacing")


def test_one_position(tmp_path):
    for k in range(3):
        write_slice(tmp_path / f"{k}.dcm", phantom()[k], ORIGIN, number=k + 1)
    refused(tmp_path, "its 3 slices all lie at one position")


@pytest.mark.parametrize("share", [0.98, 0.7])
def test_truncated_slice(tmp_path, capfd, share):
    values = np.random.default_rng(0).integers(0, 999, (4, 50, 60)).astype(np.int16)
    files = write_series(tmp_path, values)
    data = files[2].read_bytes()
    files[2].write_bytes(data[: int(len(data) * share)])
    lost = f"({files[2].name} is left out: no picture, damaged or truncated)"
    refused(tmp_path, "slices are missing", "the next one is 6 away, usual are 3", lost)
    files[3].unlink()  # at the end nothing shows that a slice is missing
    with pytest.warns(UserWarning, match="left out"):
        assert np.array_equal(load_one(tmp_path).values, values[:2])
    assert capfd.readouterr() == ("", "")


def shortened(file, lost=40):
    """Take pixels away from the end of a file, whose header stays consistent in itself."""
    data = file.read_bytes()
    at = data.rindex(b"\xe0\x7f\x10\x00") + 4
    at += 4 * data[at:].startswith((b"OW", b"OB"))
    length = int.from_bytes(data[at : at + 4], "little") - lost
    file.write_bytes(data[:at] + length.to_bytes(4, "little") + data[at + 4 : -lost])


def test_fewer_pixels_than_announced(tmp_path):
    """The missing ones would be whatever lay in memory."""
    files = write_series(tmp_path)
    shortened(files[2])
    refused(tmp_path, f"{files[2].name}: is damaged or truncated: 126 bytes of pixels expected, found 86")
    path = tmp_path / "a.dcm"
    sitk.WriteImage(sitk.GetImageFromArray(phantom("uint8")), str(path))
    shortened(path)
    refused(path, "a.dcm: is damaged or truncated: 315 bytes of pixels expected, found 276")


def test_files_by_name_only(tmp_path):
    files = write_series(tmp_path)
    files[2].write_bytes(b"")
    refused(tmp_path, "slices are missing", f"({files[2].name} is left out: no picture, damaged or truncated)")
    for file in files.values():
        file.write_bytes(file.read_bytes()[:140])
    refused(tmp_path, "has no DICOM series that can be read (1_000.dcm and 4 more are left out")


@pytest.mark.parametrize(
    ("name", "old", "new"),
    [
        ("PixelSpacing", b"2\\.5", b"0\\.5"),
        ("PixelSpacing", b"2\\.5", b"nan "),
        ("ImageOrientationPatient", b"1\\0\\0\\0\\1\\0", b"0\\0\\0\\0\\0\\0"),
        ("ImagePositionPatient", b"10\\-20\\", b"nan\\20\\"),
        ("RescaleSlope", b"\x28\0\x53\x10\2\0\0\0" + b"1", b"\x28\0\x53\x10\2\0\0\0" + b"0"),
        ("RescaleIntercept", b"\x28\0\x52\x10\2\0\0\0" + b"0", b"\x28\0\x52\x10\2\0\0\0" + b"x"),
    ],
)
def test_places_without_sense(tmp_path, name, old, new):
    files = write_series(tmp_path, turn=np.eye(3))
    data = files[1].read_bytes()
    assert old in data and len(old) == len(new), data
    files[1].write_bytes(data.replace(old, new))
    refused(tmp_path, f"{files[1].name}: cannot use its {name}")


def without(file, tag):
    """Turn an element of a file into one that nobody knows."""
    data = file.read_bytes()
    assert tag in data
    file.write_bytes(data.replace(tag, tag[:2] + bytes([tag[2] + 2]) + tag[3:]))


def test_places_that_are_not_told(tmp_path):
    files = write_series(tmp_path, turn=np.eye(3))
    for file in files.values():
        without(file, b"\x28\0\x30\0")
    with pytest.warns(UserWarning, match="dcm has no PixelSpacing; 1 is taken"):
        assert load_one(tmp_path).spacing == (1, 1, 3)
    without(files[3], b"\x20\0\x32\0")
    refused(tmp_path, f"{files[3].name} does not say where it lies (ImagePositionPatient)")


def test_other_files_in_the_folder_do_not_matter(tmp_path):
    write_series(tmp_path)
    (tmp_path / "README.txt").write_text("hello")
    (tmp_path / "empty").touch()
    (tmp_path / "deeper").mkdir()
    check_phantom(load_one(tmp_path), direction=TURN)


def test_colours(tmp_path):
    for k in range(3):
        image = sitk.Compose(*[sitk.GetImageFromArray(phantom("uint8")[k][None])] * 3)
        for key, value in (("0020|000e", SERIES + "5"), ("0020|0032", f"0\\0\\{k}"), ("0020|0037", "1\\0\\0\\0\\1\\0")):
            image.SetMetaData(key, value)
        writer = sitk.ImageFileWriter()
        writer.KeepOriginalImageUIDOn()
        image.SetOrigin((0, 0, k))
        writer.SetFileName(str(tmp_path / f"{k}.dcm"))
        writer.Execute(image)
    refused(tmp_path, "one number a pixel")


def test_a_single_file_is_no_volume(tmp_path):
    write_slice(tmp_path / "a.dcm", phantom()[0], ORIGIN)
    refused(tmp_path / "a.dcm", "is one DICOM slice, give the folder of its series")


def test_a_file_of_several_frames(tmp_path):
    """SimpleITK writes a volume as one multi-frame secondary capture."""
    image = sitk.GetImageFromArray(phantom("uint8"))
    image.SetSpacing(SPACING)
    path = tmp_path / "a.dcm"
    sitk.WriteImage(image, str(path))
    volume = load_one(path)
    assert volume.shape == SHAPE and np.array_equal(volume.values, phantom("uint8"))
    assert np.allclose(volume.spacing[:2], SPACING[:2])
    assert np.array_equal(load_one(tmp_path).values, volume.values)


# --- pictures ------------------------------------------------------------------------------------------------------
@pytest.mark.parametrize("suffix", [".png", ".tif"])
def test_pictures_in_the_order_of_their_numbers(tmp_path, suffix):
    values = np.zeros((12, 7, 9), np.uint8)
    values[10, 2, 3] = 255
    for k, plane in enumerate(values):
        sitk.WriteImage(sitk.GetImageFromArray(plane), str(tmp_path / f"slice{k}{suffix}"))
    volume = load_one(tmp_path, spacing=SPACING)
    assert np.array_equal(volume.values, values) and volume.spacing == SPACING


def test_pictures_that_do_not_fit_together(tmp_path):
    for k in range(3):
        sitk.WriteImage(sitk.GetImageFromArray(np.zeros((7, 9), np.uint8)), str(tmp_path / f"{k}.png"))
    odd = sitk.GetImageFromArray(np.zeros((7, 8), np.uint8))
    sitk.WriteImage(odd, str(tmp_path / "2.png"))
    with pytest.raises(aus.FileError, match=r"2\.png: is 8×7, but 0.png 9×7"):
        aus.load(tmp_path)
    sitk.WriteImage(sitk.Compose(odd, odd, odd), str(tmp_path / "0.png"))
    with pytest.raises(aus.FileError, match=r"0\.png: expected a grey picture"):
        aus.load(tmp_path)
    (tmp_path / "0.png").write_bytes(b"junk")
    with pytest.raises(aus.FileError, match=r"0\.png: cannot be read"):
        aus.load(tmp_path)


def test_folders_of_nothing(tmp_path):
    refused(tmp_path, "is a folder, an empty one")
    (tmp_path / "a.txt").write_text("x")
    refused(tmp_path, "is a folder without a DICOM series or a stack of pictures")
