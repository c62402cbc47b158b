# SPDX-License-Identifier: GPL-3.0-or-later
"""What the X server shows. Blender's own screenshots are not used: they draw the window once more first, and with software
OpenGL they are black in Blender 4.3 and 5.2."""

import ctypes
import struct
import time
import zlib
from ctypes import POINTER, Structure, c_char_p, c_int, c_uint, c_ulong, c_void_p

import numpy as np

_Z_PIXMAP = 2
LOOK = 0.02  # seconds between two looks that must be equal
LOOKS = 50  # at most, if something on the screen always moves


class _Image(Structure):
    """XImage, as far as it is read here."""

    _fields_ = [("width", c_int), ("height", c_int), ("xoffset", c_int), ("format", c_int), ("data", c_void_p),
                ("byte_order", c_int), ("bitmap_unit", c_int), ("bitmap_bit_order", c_int), ("bitmap_pad", c_int), ("depth", c_int),
                ("bytes_per_line", c_int), ("bits_per_pixel", c_int)]


def _library():
    x11 = ctypes.CDLL("libX11.so.6")
    for name, result, arguments in (
            ("XOpenDisplay", c_void_p, (c_char_p,)), ("XDefaultRootWindow", c_ulong, (c_void_p,)),
            ("XCloseDisplay", c_int, (c_void_p,)), ("XFree", c_int, (c_void_p,)),
            ("XGetImage", POINTER(_Image), (c_void_p, c_ulong, c_int, c_int, c_uint, c_uint, c_ulong, c_int)),
            ("XDisplayWidth", c_int, (c_void_p, c_int)), ("XDisplayHeight", c_int, (c_void_p, c_int))):
        call = getattr(x11, name)
        call.restype, call.argtypes = result, arguments
    return x11


def pixels():
    """(height, width, 3) uint8 of the whole screen, row 0 at the bottom as Blender counts."""
    x11 = _library()
    display = x11.XOpenDisplay(None)
    try:
        width, height = x11.XDisplayWidth(display, 0), x11.XDisplayHeight(display, 0)
        image = x11.XGetImage(display, x11.XDefaultRootWindow(display), 0, 0, width, height, c_ulong(-1).value, _Z_PIXMAP)
        held = image.contents
        assert held.bits_per_pixel == 32, f"{held.bits_per_pixel} bits a pixel"
        rows = np.ctypeslib.as_array(ctypes.cast(held.data, POINTER(ctypes.c_uint8)), (height, held.bytes_per_line)).copy()
        x11.XFree(held.data)
        x11.XFree(image)
    finally:
        x11.XCloseDisplay(display)
    return rows[::-1, :4 * width].reshape(height, width, 4)[..., 2::-1]


def settled_pixels():
    """The same, once two looks in a row are equal: what Blender has drawn reaches the screen a moment later."""
    last = pixels()
    for _ in range(LOOKS):
        time.sleep(LOOK)
        now = pixels()
        if np.array_equal(now, last):
            break
        last = now
    return now


def write_png(path, picture):
    """(height, width, 3) uint8, row 0 at the bottom."""
    height, width = picture.shape[:2]
    rows = np.zeros((height, 1 + 3 * width), np.uint8)
    rows[:, 1:] = picture[::-1].reshape(height, 3 * width)
    with open(path, "wb") as file:
        file.write(b"\x89PNG\r\n\x1a\n")
        for kind, data in ((b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)), (b"IDAT", zlib.compress(rows.tobytes(), 1)),
                           (b"IEND", b"")):
            file.write(struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data)))
