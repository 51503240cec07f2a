"""Rig files: what may be null, how they are encoded, what counts as a number."""

from __future__ import annotations

import json

import numpy as np
import pytest

import autostereo as aus


def written(tmp_path, fields, encoding="utf-8"):
    path = tmp_path / "rig.json"
    path.write_text(json.dumps(fields), encoding=encoding)
    return path


@pytest.mark.parametrize("name", ["baseline", "offset_y", "fov_y", "views"])
def test_only_lengths_that_are_optional_may_be_null(tmp_path, name):
    with pytest.raises(aus.FileError, match=rf"rig\.json: rig {name}: expected .*, got None$"):
        aus.Rig.load(written(tmp_path, {name: None}))


def test_optional_fields_may_be_null(tmp_path):
    fields = dict.fromkeys(("focal_distance", "near", "aspect", "offsets"))
    assert aus.Rig.load(written(tmp_path, fields)) == aus.Rig()


def test_a_byte_order_mark_is_no_obstacle(tmp_path):
    assert aus.Rig.load(written(tmp_path, {"views": 5}, "utf-8-sig")).views == 5
    path = tmp_path / "transfer.json"
    path.write_text('{"points": [[0, 0, 0, 0, 1]]}', encoding="utf-8-sig")
    assert aus.TransferFunction.load(path).points.shape == (1, 5)


@pytest.mark.parametrize("name", ["position", "target", "up", "offsets"])
@pytest.mark.parametrize("value", [[True, False, True], [0, True, 2]])
def test_booleans_are_no_numbers(tmp_path, name, value):
    with pytest.raises(aus.FileError, match=rf"rig\.json: rig {name}: expected (three )?numbers, got [(\[].*True"):
        aus.Rig.load(written(tmp_path, {name: value}))
    with pytest.raises(aus.InputError, match=f"rig {name}: expected (three )?numbers, got "):
        aus.Rig(**{name: np.array([True, False, True])})


def test_a_place_of_hundreds_of_digits_is_named(tmp_path):
    with pytest.raises(aus.FileError, match=r"rig position: expected three numbers within ±1e\+30, got \(1000"):
        aus.Rig.load(written(tmp_path, {"position": [10**400, 0, 0]}))
