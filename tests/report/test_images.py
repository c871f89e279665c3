"""Pixels in and out of the page's packing."""

from __future__ import annotations

import base64
import zlib

import numpy as np
import OpenEXR
import pytest

from voroquad.report.images import LARGEST, ZERO_BITS, pack, read_exr


def unpacked(text, shape):
    """What the page's script makes of it: low bytes, high bytes, by channel, of float16."""
    low, high = np.frombuffer(zlib.decompress(base64.b64decode(text)), np.uint8).reshape(2, -1).astype(np.uint16)
    height, width = shape[:2]
    return np.moveaxis((low | high << 8).view(np.float16).reshape(3, height, width), 0, -1).astype(np.float64)


@pytest.fixture
def pixels():
    """Both signs, nine decades."""
    rng = np.random.default_rng(5)
    return (rng.choice([-1, 1], (30, 40, 3)) * 10 ** rng.uniform(-4, 4, (30, 40, 3))).astype(np.float32)


def test_packing_keeps_the_digits_of_a_float16(pixels):
    np.testing.assert_array_equal(unpacked(pack(pixels), pixels.shape), pixels.astype(np.float16))


def test_rounded_bits_cost_what_they_should(pixels):
    found = unpacked(pack(pixels, ZERO_BITS), pixels.shape)
    error = np.abs(found / pixels - 1)
    assert 2.0 ** (ZERO_BITS - 12) < error.max() < 2.0 ** (ZERO_BITS - 11) + 2.0**-11
    assert abs((found / pixels - 1).mean()) < error.max() / 10  # rounded, not cut
    assert not (found.astype(np.float16).view(np.uint16) % (1 << ZERO_BITS)).any()


@pytest.mark.parametrize("zero_bits", [0, ZERO_BITS, 4])
def test_the_brightest_pixels_stay_finite(zero_bits):
    pixels = np.array([[[65504, 1e30, np.inf]], [[-65504, -1e30, -np.inf]]], dtype=np.float32)
    np.testing.assert_array_equal(np.abs(unpacked(pack(pixels, zero_bits), pixels.shape)), LARGEST)


def test_what_is_not_a_number_stays_so():
    assert np.isnan(unpacked(pack(np.full((1, 1, 3), np.nan, np.float32), ZERO_BITS), (1, 1))).all()


@pytest.mark.parametrize("name", ["RGB", "RGBA", "Y"])
@pytest.mark.parametrize("kind", [np.float32, np.float16])
def test_colours_of_any_exr(tmp_path, name, kind):
    shape = (4, 5) if name == "Y" else (4, 5, len(name))
    values = np.random.default_rng(1).random(shape).astype(kind)
    OpenEXR.File({"type": OpenEXR.scanlineimage}, {name: values}).write(str(tmp_path / "a.exr"))
    expected = np.repeat(values[..., None], 3, -1) if name == "Y" else values[..., :3]
    np.testing.assert_array_equal(read_exr(tmp_path / "a.exr"), expected)


def test_other_files_are_refused(tmp_path):
    (tmp_path / "a.exr").write_bytes(b"no image")
    with pytest.raises(ValueError, match=r"a\.exr is no readable EXR image"):
        read_exr(tmp_path / "a.exr")
    OpenEXR.File({"type": OpenEXR.scanlineimage}, {"depth": np.zeros((2, 2), np.float32)}).write(
        str(tmp_path / "b.exr")
    )
    with pytest.raises(ValueError, match="has no colours, but the channels depth"):
        read_exr(tmp_path / "b.exr")
