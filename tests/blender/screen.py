# SPDX-License-Identifier: GPL-3.0-or-later
"""What the X server shows, without asking Blender: its own screenshots draw the window once more first."""

import ctypes
from ctypes import POINTER, Structure, c_char_p, c_int, c_uint, c_ulong, c_void_p

import numpy as np

_Z_PIXMAP = 2


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
