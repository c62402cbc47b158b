# SPDX-License-Identifier: GPL-3.0-or-later
"""Images for people: sRGB and PNG."""

from __future__ import annotations

import os
import struct
import tempfile
import zlib
from pathlib import Path

import numpy as np


def to_srgb(image: np.ndarray) -> np.ndarray:
    """(h, w, 4) uint8, sRGB with straight alpha, of (h, w, 4) floats, linear and premultiplied. Values above 1 are clipped."""
    pixels = np.asarray(image, np.float32)
    if pixels.ndim != 3 or pixels.shape[2] != 4:
        raise ValueError(f"the image has the shape {pixels.shape}; (height, width, 4) is needed")
    alpha = np.clip(pixels[..., 3:], 0.0, 1.0)
    linear = np.clip(np.divide(pixels[..., :3], alpha, out=np.zeros_like(pixels[..., :3]), where=alpha > 0.0), 0.0, 1.0)
    coded = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * np.power(linear, 1 / 2.4) - 0.055)
    return np.rint(255.0 * np.concatenate([coded, alpha], axis=2)).astype(np.uint8)


def write_png(path: str | os.PathLike, image: np.ndarray, overwrite: bool = False) -> None:
    """Writes an image of `render`, (h, w, 4) floats, or of `to_srgb`, (h, w, 4) uint8, as an 8-bit PNG. The file is written whole or not at
    all. Raises FileExistsError unless overwrite is set."""
    path = Path(path)
    pixels = np.asarray(image)
    pixels = pixels if pixels.dtype == np.uint8 else to_srgb(pixels)
    if pixels.ndim != 3 or pixels.shape[2] != 4 or not pixels.size:
        raise ValueError(f"the image has the shape {pixels.shape}; (height, width, 4) is needed")
    if path.exists() and not overwrite:
        raise FileExistsError(f"{path} exists. Pass overwrite=True to replace it")
    height, width = pixels.shape[:2]
    rows = np.concatenate([np.zeros((height, 1), np.uint8), pixels.reshape(height, 4 * width)], axis=1)  # each begins with its filter: none
    head = struct.pack(">IIBBBBB", width, height, 8, 6, 0, 0, 0)
    data = b"\x89PNG\r\n\x1a\n" + b"".join(_chunk(kind, body) for kind, body in
                                           ((b"IHDR", head), (b"IDAT", zlib.compress(rows.tobytes())), (b"IEND", b"")))
    handle, beside = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(data)
        os.chmod(beside, 0o644)
        os.replace(beside, path)
    except BaseException:
        os.unlink(beside)
        raise


def _chunk(kind: bytes, body: bytes) -> bytes:
    return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))
