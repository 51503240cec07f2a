"""Transfer functions: values, means and tables against closed forms and fine numeric integration; files."""

import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import autostereo as aus
from autostereo import TransferFunction

# a step in colour and opacity at 0.5, an opaque end, a transparent stretch
STEPPED = [
    (0.0, 0.0, 0.0, 1.0, 0.0),
    (0.2, 1.0, 0.0, 0.0, 3.0),
    (0.5, 0.0, 1.0, 0.0, 0.0),
    (0.5, 1.0, 1.0, 0.0, 8.0),
    (0.7, 0.0, 0.0, 1.0, 1.0),
    (1.0, 1.0, 1.0, 1.0, 20.0),
]


def integrate(transfer, front, back, length, samples=20_000):
    """Emission, alpha, means of the path front → back by the midpoint rule, each sample a homogeneous slab."""
    t = (np.arange(samples) + 0.5) / samples
    y = transfer.evaluate(front + (back - front) * t)
    depth = y[:, 3] * (length / samples)
    before = np.cumsum(depth) - depth
    emission = (y[:, :3] * (np.exp(-before) * -np.expm1(-depth))[:, None]).sum(axis=0)
    tau = y[:, 3].mean()
    color = (y[:, :3] * y[:, 3:]).mean(axis=0) / tau if tau > 0 else y[:, :3].mean(axis=0)
    return emission, -np.expm1(-depth.sum()), np.append(color, tau)


@st.composite
def transfers(draw):
    """Transfer functions of 1…6 points in 0…1, steps among them."""
    values = sorted(draw(st.lists(st.sampled_from(np.linspace(0, 1, 9).tolist()), min_size=1, max_size=6)))
    values = [v for k, v in enumerate(values) if k < 2 or values[k - 2] != v]
    part = st.floats(0, 1)
    return TransferFunction([(v, *draw(st.tuples(part, part, part)), draw(st.floats(0, 30))) for v in values])


# --- evaluation ----------------------------------------------------------------------------------------------------
def test_evaluate_is_piecewise_linear_and_constant_beyond_the_ends():
    transfer = TransferFunction([(1, 0, 0.5, 1, 2), (3, 1, 0.5, 0, 6)])
    expected = [(0, 0.5, 1, 2), (0, 0.5, 1, 2), (0.25, 0.5, 0.75, 3), (0.5, 0.5, 0.5, 4), (1, 0.5, 0, 6)]
    assert np.array_equal(transfer.evaluate([-9, 1, 1.5, 2, 3]), expected)
    assert np.array_equal(transfer.evaluate(9), expected[-1])
    assert transfer.evaluate(2.0).shape == (4,)
    assert transfer.evaluate(np.zeros((2, 0, 3))).shape == (2, 0, 3, 4)


def test_at_a_step_the_second_point_holds():
    transfer = TransferFunction(STEPPED)
    assert np.array_equal(transfer.evaluate(0.5), (1, 1, 0, 8))
    assert np.array_equal(transfer.limit(0.5, "left"), (0, 1, 0, 0))
    assert np.allclose(transfer.evaluate(0.5 - 1e-9), (0, 1, 0, 0), atol=1e-7)
    first = TransferFunction([(0, 1, 0, 0, 1), (0, 0, 1, 0, 2)])
    assert np.array_equal(first.evaluate([-1e-300, 0.0]), [(1, 0, 0, 1), (0, 1, 0, 2)])


def test_evaluate_agrees_with_numpy_interpolation():
    transfer = TransferFunction([(v, *row) for v, row in zip((-2, 0.5, 7), np.eye(4)[:3], strict=True)])
    s = np.linspace(-5, 9, 1001)
    for c in range(4):
        assert np.allclose(transfer.evaluate(s)[:, c], np.interp(s, (-2, 0.5, 7), np.eye(4)[:3, c]), atol=1e-15)


# --- means ---------------------------------------------------------------------------------------------------------
def test_mean_of_a_ramp_is_closed():
    """Extinction s, red s over 0…1: mean extinction (f + b)/2, mean red ∫s²/∫s."""
    transfer = TransferFunction([(0, 0, 1, 0.5, 0), (1, 1, 1, 0.5, 1)])
    f, b = 0.2, 0.8
    red = (b**3 - f**3) / 3 / ((b**2 - f**2) / 2)
    assert np.allclose(transfer.mean(f, b), (red, 1, 0.5, 0.5), atol=1e-15)
    assert np.allclose(transfer.mean(0, 3), (((1 / 3) + 2) / 2.5, 1, 0.5, 2.5 / 3), atol=1e-15)
    assert np.allclose(transfer.mean(-2, 0.5), (2 / 3 * 0.5, 1, 0.5, 0.125 / 2.5), atol=1e-15)


def test_mean_over_a_step_is_exact():
    transfer = TransferFunction([(0.3, 1, 0, 0, 0), (0.3, 0, 0, 1, 10)])
    assert np.allclose(transfer.mean(0, 1), (0, 0, 1, 7), atol=1e-15)
    assert np.array_equal(transfer.mean(0, 0.3), (1, 0, 0, 0))  # ends where the step begins
    assert np.allclose(transfer.mean(0.3, 0.4), (0, 0, 1, 10), atol=1e-15)


def test_mean_colour_of_transparent_paths_is_the_plain_mean():
    transfer = TransferFunction([(0, 0, 1, 0, 0), (1, 1, 0, 0.5, 0), (2, 1, 0, 0.5, 4)])
    assert np.allclose(transfer.mean(0, 1), (0.5, 0.5, 0.25, 0))
    assert np.allclose(transfer.mean(0.4, 0.4), (0.4, 0.6, 0.2, 0))


@settings(max_examples=60, deadline=None)
@given(transfers(), st.floats(-0.5, 1.5), st.floats(-0.5, 1.5))
def test_mean_is_numeric_integration(transfer, front, back):
    found = transfer.mean(front, back)
    _, _, expected = integrate(transfer, front, back, 1.0)
    assert found[3] == pytest.approx(expected[3], abs=0.004)  # the midpoint rule misses a step by a sample
    if expected[3] > 0.5:
        assert np.abs(found[:3] - expected[:3]).max() < 0.02
    assert np.array_equal(found, transfer.mean(back, front))


@settings(max_examples=100, deadline=None)
@given(transfers(), st.floats(-0.5, 1.5), st.floats(-0.5, 1.5), st.floats(0, 1))
def test_a_path_is_the_sum_of_its_parts(transfer, front, back, part):
    """Sampling-rate independence: optical depth and τ-weighted colour of halves add up."""
    middle = front + part * (back - front)
    parts = [(transfer.mean(front, middle), part), (transfer.mean(middle, back), 1 - part)]
    whole = transfer.mean(front, back)
    assert whole[3] == pytest.approx(sum(m[3] * w for m, w in parts), abs=1e-6)
    if abs(back - front) > 1e-6:
        weighted = sum(m[:3] * m[3] * w for m, w in parts)
        assert np.allclose(whole[:3] * whole[3], weighted, atol=1e-6)


@given(transfers(), st.floats(-0.5, 1.5), st.floats(-1e-12, 1e-12))
def test_mean_of_a_short_path_stays_within_its_ends(transfer, s, step):
    found = transfer.mean(s, s + step)
    ends = np.stack([transfer.limit(x, side) for x in (s, s + step) for side in ("left", "right")])
    assert (found >= ends.min(axis=0) - 1e-4).all() and (found <= ends.max(axis=0) + 1e-4).all()


def test_mean_broadcasts():
    transfer = TransferFunction(STEPPED)
    s = np.linspace(-0.1, 1.1, 17)
    table = transfer.mean(s[:, None], s[None, :])
    assert table.shape == (17, 17, 4)
    assert np.array_equal(table, table.transpose(1, 0, 2))
    assert np.array_equal(table[np.arange(17), np.arange(17)], transfer.evaluate(s))
    assert np.array_equal(table[3, 11], transfer.mean(s[3], s[11]))


# --- tables --------------------------------------------------------------------------------------------------------
@pytest.mark.parametrize("length", [0.01, 1.0, 6.0])
def test_table_is_numeric_integration(length):
    transfer = TransferFunction(STEPPED)
    table = transfer.table(-0.1, 1.2, 256, length)
    assert table.shape == (256, 256, 4) and table.dtype == np.float32
    s = np.linspace(-0.1, 1.2, 256)
    rng = np.random.default_rng(4)
    pairs = [*rng.integers(0, 256, (150, 2)), *([k, k + 1] for k in range(0, 255, 9)), (255, 0), (0, 255), (7, 7)]
    for i, j in pairs:
        emission, alpha, _ = integrate(transfer, s[i], s[j], length)
        found = -np.expm1(-float(table[i, j, 3]) * length)
        assert found == pytest.approx(alpha, abs=1e-3)
        assert np.abs(table[i, j, :3] * found - emission).max() < 1e-3


@settings(max_examples=25, deadline=None)
@given(transfers(), st.floats(0.0, 5.0), st.integers(2, 40))
def test_tables_of_any_function(transfer, length, size):
    table = transfer.table(0.0, 1.0, size, length)
    s = np.linspace(0, 1, size)
    assert np.allclose(table[..., 3], transfer.mean(s[:, None], s)[..., 3], rtol=1e-5, atol=1e-6)
    assert (table[..., :3] >= 0).all() and (table[..., :3] <= 1).all()
    for i, j in ((0, size - 1), (size - 1, 0), (0, 1), (size // 2, size - 1)):
        emission, _, _ = integrate(transfer, s[i], s[j], length)
        alpha = -np.expm1(-float(table[i, j, 3]) * length)
        assert np.abs(table[i, j, :3] * alpha - emission).max() < 3e-3


def test_two_slabs_are_one():
    """Sampling-rate independence: halves of a slab, each from a table of half the length, compose to the whole."""
    transfer = TransferFunction(STEPPED)
    length, size = 2.0, 129
    whole, half = transfer.table(0, 1, size, length), transfer.table(0, 1, size, length / 2)
    for i, j in ((0, 128), (128, 0), (10, 100), (90, 20), (64, 64)):
        m = (i + j) // 2
        alpha = [-np.expm1(-float(t[..., 3]) * x) for t, x in (
            (half[i, m], length / 2), (half[m, j], length / 2), (whole[i, j], length)
        )]  # fmt: skip
        composed = half[i, m, :3] * alpha[0] + (1 - alpha[0]) * half[m, j, :3] * alpha[1]
        assert np.allclose(composed, whole[i, j, :3] * alpha[2], atol=2e-5)
        assert 1 - (1 - alpha[0]) * (1 - alpha[1]) == pytest.approx(alpha[2], abs=1e-6)


def test_table_of_no_length_holds_the_means():
    transfer = TransferFunction(STEPPED)
    s = np.linspace(0, 1, 33)
    assert np.allclose(transfer.table(0, 1, 33, 0.0), transfer.mean(s[:, None], s), atol=1e-6)


def test_table_of_one_value_is_constant():
    table = TransferFunction(STEPPED).table(0.1, 0.1, 5, 2.0)
    assert np.allclose(table, TransferFunction(STEPPED).evaluate(0.1))


def test_the_nearer_half_hides_the_other_in_an_opaque_slab():
    transfer = TransferFunction([(0, 1, 0, 0, 1e6), (0.5, 1, 0, 0, 1e6), (0.5, 0, 0, 1, 1e6), (1, 0, 0, 1, 1e6)])
    table = transfer.table(0, 1, 64, 1.0)
    assert np.allclose(table[0, 63, :3], (1, 0, 0), atol=1e-5)
    assert np.allclose(table[63, 0, :3], (0, 0, 1), atol=1e-5)


@pytest.mark.parametrize("arguments", [(1, 0), (0, 1, 1), (0, 1, 2.5), (0, 1, 8, -1.0), (np.nan, 1), (0, 1, True)])
def test_tables_of_nothing_are_refused(arguments):
    with pytest.raises(aus.InputError, match="table"):
        TransferFunction(STEPPED).table(*arguments)


# --- construction --------------------------------------------------------------------------------------------------
@pytest.mark.parametrize(
    ("points", "words"),
    [
        ([], "rows"),
        ([(0, 0, 0, 0)], r"got shape \(1, 4\)"),
        ("x", "five numbers"),
        ([(0, 0, 0, 0, 1), (1, 2)], "five numbers"),
        ([(1, 0, 0, 0, 0), (0, 0, 0, 0, 0)], "ascending values, found 1 before 0"),
        ([(1, 0, 0, 0, 0)] * 3, "at most two points of one value.* at 1"),
        ([(0, 0, 1.5, 0, 0)], "colours 0…1, found 0…1.5"),
        ([(0, 0, 0, 0, -1)], "opacities ≥ 0, found -1"),
        ([(0, 0, np.nan, 0, 1)], "NaN"),
        ([(np.inf, 0, 0, 0, 1)], "infinity"),
        ([(1e31, 0, 0, 0, 1)], r"within ±1e\+30, found ±1e\+31"),
    ],
)
def test_bad_points_are_refused(points, words):
    with pytest.raises(aus.InputError, match=words):
        TransferFunction(points)


def test_points_are_copied():
    points = np.array(STEPPED)
    transfer = TransferFunction(points)
    points[:] = 0
    assert np.array_equal(transfer.points, STEPPED)


def test_scaled_and_greatest_opacity():
    transfer = TransferFunction(STEPPED)
    assert transfer.max_opacity == 20
    assert np.array_equal(transfer.scaled(0.5).points[:, 4], np.array(STEPPED)[:, 4] / 2)
    assert np.array_equal(transfer.scaled(0.5).points[:, :4], np.array(STEPPED)[:, :4])
    with pytest.raises(aus.InputError):
        transfer.scaled(-1)


# --- files ---------------------------------------------------------------------------------------------------------
@given(transfers())
def test_json_round_trip_is_exact(tmp_path_factory, transfer):
    path = tmp_path_factory.mktemp("tf") / "a.json"
    assert transfer.save(path) == path
    assert np.array_equal(TransferFunction.load(path).points, transfer.points)


def test_json_is_plain(tmp_path):
    path = TransferFunction(STEPPED).save(tmp_path / "a.json")
    assert json.loads(path.read_text())["points"] == [list(map(float, row)) for row in STEPPED]
    path.write_text(json.dumps(STEPPED))  # the rows alone will do
    assert np.array_equal(TransferFunction.load(path).points, STEPPED)


@pytest.mark.parametrize(
    ("text", "words"),
    [("", "not JSON"), ("{", "not JSON"), ("3", "points"), ("{}", "points"), ('{"points": 3}', "points"),
     ('{"points": [[0, 0, 0, 0]]}', r"got shape \(1, 4\)"), ('{"points": [[0, 0, 0, 0, "x"]]}', "five numbers"),
     ('{"points": [[0, 0, 0, 0, "1"]]}', "five numbers"), ('{"points": [[0, 0, 0, 0, true]]}', "five numbers"),
     ('{"points": [[0, 0, 0, 0, [1]]]}', "five numbers"), ('{"points": [[0, 0, 0, 0, %s]]}' % ("9" * 400), "five numb"),
     ('{"points": [[0, 0, 0, 0, %s]]}' % ("9" * 5000), "not JSON"), ("[" * 50_000, "not JSON"),
     ('{"points": [[0, 0, 0, 0, 1]], "zzz": 1}', "unknown fields zzz"),
     ('{"points": [[0, 0, 0, 0, 1]], "type": 5}', "expected the type 'autostereo transfer function', found '5'")],
)  # fmt: skip
def test_bad_files_are_refused(tmp_path, text, words):
    path = tmp_path / "a.json"
    path.write_text(text)
    with pytest.raises(aus.FileError, match=words) as caught:
        TransferFunction.load(path)
    assert str(path) in str(caught.value)


def test_missing_files_are_refused(tmp_path):
    with pytest.raises(aus.FileError, match="no such file"):
        TransferFunction.load(tmp_path / "a.json")
    with pytest.raises(aus.FileError, match="cannot be read"):
        TransferFunction.load(tmp_path)
    with pytest.raises(aus.FileError, match="does not exist"):
        TransferFunction(STEPPED).save(tmp_path / "none" / "a.json")
