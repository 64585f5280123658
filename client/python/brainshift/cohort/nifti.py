# SPDX-License-Identifier: Apache-2.0
"""Voxels and affine of a NIfTI-1 image (.nii, .nii.gz); masks on the grid of an image.

What a case needs of an image before brainshiftd reads it: where the brain lies. Formulas: the
NIfTI-1 header (nifti1.h), sform before qform.
"""
from __future__ import annotations

import gzip
import struct
import zlib
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from .files import Path, Refused, write

TYPES = {2: "u1", 4: "i2", 8: "i4", 16: "f4", 64: "f8", 256: "i1", 512: "u2", 768: "u4", 1024: "i8", 1280: "u8"}


@dataclass
class Image:
    values: npt.NDArray[Any]            # (i, j, k), scaled
    affine: npt.NDArray[np.float64]     # 4 x 4, voxel to mm RAS
    header: bytes                       # 348 bytes
    order: str                          # "<" or ">"

    def points(self, where: npt.NDArray[Any]) -> npt.NDArray[np.float64]:
        """(n, 3), mm RAS: the voxels where the array is true."""
        found: npt.NDArray[np.float64] = np.argwhere(where) @ self.affine[:3, :3].T + self.affine[:3, 3]
        return found


def content(path: Path) -> bytes:
    """The file's bytes, unpacked. Refuses what is not there, with the reason."""
    if path.is_symlink() and not path.exists():
        raise Refused(f"{path.name} is a link to content that is not here (git annex or datalad get)")
    try:
        raw = path.read_bytes()
        if not raw:
            raise Refused(f"{path.name} is empty (0 bytes)")
        return gzip.decompress(raw) if raw[:2] == b"\x1f\x8b" else raw
    except (OSError, EOFError, zlib.error) as error:
        raise Refused(f"{path.name}: {error}") from None


def affine_of(header: bytes, order: str) -> npt.NDArray[np.float64]:
    affine = np.eye(4)
    qform, sform = struct.unpack_from(order + "2h", header, 252)
    pixdim = struct.unpack_from(order + "8f", header, 76)
    if sform > 0:
        affine[:3] = np.reshape(struct.unpack_from(order + "12f", header, 280), (3, 4))
    elif qform > 0:
        b, c, d, *offset = struct.unpack_from(order + "6f", header, 256)
        a = np.sqrt(max(0.0, 1.0 - b * b - c * c - d * d))
        rotation = np.array([[a * a + b * b - c * c - d * d, 2 * (b * c - a * d), 2 * (b * d + a * c)],
                             [2 * (b * c + a * d), a * a + c * c - b * b - d * d, 2 * (c * d - a * b)],
                             [2 * (b * d - a * c), 2 * (c * d + a * b), a * a + d * d - b * b - c * c]])
        affine[:3, :3] = rotation * np.array([pixdim[1], pixdim[2], pixdim[3] * (-1.0 if pixdim[0] < 0 else 1.0)])
        affine[:3, 3] = offset
    else:
        raise Refused("has neither sform nor qform: nothing says where its voxels lie")
    return affine


def read(path: Path) -> Image:
    raw = content(path)
    sizes = {struct.unpack_from(order + "i", raw)[0]: order for order in "<>"} if len(raw) >= 348 else {}
    if 540 in sizes:
        raise Refused(f"{path.name} is NIfTI-2; NIfTI-1 is read")
    if 348 not in sizes or raw[344:348] != b"n+1\0":
        raise Refused(f"{path.name} is no NIfTI-1 file")
    order = sizes[348]
    rank, *size = struct.unpack_from(order + "8h", raw, 40)
    if rank < 3 or min(size[:3]) < 1 or any(n > 1 for n in size[3:rank]):
        raise Refused(f"{path.name} has {rank} dimensions of sizes {size[:max(rank, 0)]} instead of one volume")
    code = struct.unpack_from(order + "h", raw, 70)[0]
    if code not in TYPES:
        raise Refused(f"{path.name} has voxels of type {code}, which is not read")
    start = int(struct.unpack_from(order + "f", raw, 108)[0])
    count, dtype = size[0] * size[1] * size[2], np.dtype(order + TYPES[code])
    if len(raw) < start + count * dtype.itemsize:
        raise Refused(f"{path.name} ends after {len(raw)} of {start + count * dtype.itemsize} bytes")
    values = np.frombuffer(raw, dtype, count, start).reshape(size[:3], order="F")
    slope, intercept = struct.unpack_from(order + "2f", raw, 112)
    if slope not in (0.0, 1.0) or (slope == 1.0 and intercept):
        values = values * slope + intercept
    try:
        affine = affine_of(raw, order)
    except Refused as refused:
        raise Refused(f"{path.name} {refused}") from None
    if not np.isfinite(affine).all() or abs(np.linalg.det(affine)) < 1e-9:
        raise Refused(f"{path.name} has an affine that has no inverse: {affine[:3].round(3).tolist()}")
    return Image(values, affine, raw[:348], order)


def write_mask(path: Path, mask: npt.NDArray[np.bool_], like: Image) -> None:
    """The mask as 0 and 1 on the grid of an image. The same bytes for the same mask."""
    header = bytearray(like.header)
    struct.pack_into(like.order + "8h", header, 40, 3, *mask.shape, 1, 1, 1, 1)
    struct.pack_into(like.order + "2h", header, 70, 2, 8)
    struct.pack_into(like.order + "3f", header, 108, 352.0, 1.0, 0.0)
    voxels = mask.astype("u1").tobytes(order="F")
    write(path, gzip.compress(bytes(header) + bytes(4) + voxels, 4, mtime=0))
