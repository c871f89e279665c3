"""Uncompressed .npz files whose arrays can be mapped into memory.

NumPy reads an array of an .npz file whole and maps only .npy files. Here each array starts at a multiple of 64 bytes
of the file, so that it can be mapped where it lies. ``numpy.load`` reads these files too.
"""

from __future__ import annotations

import os
import struct
import zipfile
import zlib
from collections.abc import Iterable, Mapping
from typing import IO, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .arrays import Array
from .files import atomic_path

_ALIGNMENT = 64
_LOCAL_HEADER = 30  # bytes of a zip member's local header before its name
_ZIP64_FIELD = 20  # bytes of the extra field that Python writes for members that may exceed 4 GiB
_FIELD_HEADER = 4  # bytes of an extra field before its contents: identifier, size
_PADDING_FIELD = 0xD935  # identifier of the extra field of zero bytes that aligns a member


def write_npz(path: str | os.PathLike[str], members: Mapping[str, ArrayLike]) -> None:
    """Write arrays by name, whole or not at all."""
    with atomic_path(path) as temporary, zipfile.ZipFile(temporary, "w") as archive:
        for name, array in members.items():
            _write_aligned(archive, name + ".npy", np.asarray(array, order="C"))


def map_npz(file: IO[bytes], names: Iterable[str]) -> dict[str, Array]:
    """Map float64 arrays of an open file that :func:`write_npz` wrote, after their checksums are compared.

    Raises ValueError, or what zipfile and NumPy raise, where the file is damaged.
    """
    with zipfile.ZipFile(file) as archive:
        return {name: _map(archive, file, name + ".npy") for name in names}


def _write_aligned(archive: zipfile.ZipFile, name: str, array: NDArray[Any]) -> None:
    """Append `array`, stored as it is, so that its .npy file starts at a multiple of 64 bytes.

    The .npy header is itself a multiple of 64 bytes long, so the data are aligned too.
    """
    assert archive.fp is not None
    start = archive.fp.tell() + _LOCAL_HEADER + len(name) + _ZIP64_FIELD + _FIELD_HEADER
    padding = -start % _ALIGNMENT
    member = zipfile.ZipInfo(name)
    member.extra = struct.pack("<HH", _PADDING_FIELD, padding) + bytes(padding)
    with archive.open(member, "w", force_zip64=True) as file:
        np.lib.format.write_array(file, array, allow_pickle=False)


def _map(archive: zipfile.ZipFile, file: IO[bytes], name: str) -> Array:
    """Map a stored member's array into memory; ValueError where its bytes are not those that were written."""
    member = archive.getinfo(name)
    if member.compress_type != zipfile.ZIP_STORED:
        raise ValueError(f"{name} is compressed")
    file.seek(member.header_offset)
    name_length, extra_length = struct.unpack("<HH", file.read(_LOCAL_HEADER)[26:])
    start = member.header_offset + _LOCAL_HEADER + name_length + extra_length
    if zlib.crc32(np.memmap(file, np.uint8, "r", offset=start, shape=(member.file_size,)).data) != member.CRC:
        raise ValueError(f"the checksum of {name} is wrong")
    file.seek(start)
    version = np.lib.format.read_magic(file)
    if version != (1, 0):
        raise ValueError(f"{name} has version {version} of the .npy format")
    shape, fortran, dtype = np.lib.format.read_array_header_1_0(file)
    if fortran or dtype != np.float64:
        raise ValueError(f"{name} is not a C-ordered float64 array")
    return np.memmap(file, dtype, "r", offset=file.tell(), shape=shape)
