# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads PDFs of drawings with pypdf for cli_sheets.py: paths on standard input as a JSON list, what their first pages hold on
standard output. Lengths are in millimeters of paper, from the lower left corner."""

import hashlib
import json
import sys

import pypdf
from pypdf.generic import ContentStream

MM = 25.4 / 72


def times(a, b):
    """Of two transforms as PDF writes them: first a, then b."""
    return (a[0] * b[0] + a[1] * b[2], a[0] * b[1] + a[1] * b[3], a[2] * b[0] + a[3] * b[2], a[2] * b[1] + a[3] * b[3],
            a[4] * b[0] + a[5] * b[2] + b[4], a[4] * b[1] + a[5] * b[3] + b[5])


def describe(path):
    reader = pypdf.PdfReader(path, strict=True)
    (page,) = reader.pages
    layers = {key: str(value.get_object()["/Name"]) for key, value in page["/Resources"]["/Properties"].items()}
    told = {"size": [float(value) * MM for value in page.mediabox], "title": reader.metadata.title, "paths": [], "image": None}
    transform, stack, layer, width, points = (MM, 0, 0, MM, 0, 0), [], None, 1.0, []
    for operands, operator in ContentStream(page.get_contents(), reader).operations:
        operator = operator.decode()
        numbers = [float(value) for value in operands if isinstance(value, (int, float))]
        if operator == "q":
            stack.append(transform)
        elif operator == "Q":
            transform = stack.pop()
        elif operator == "cm":
            transform = times(numbers, transform)
        elif operator == "w":
            width = numbers[0] * transform[0]
        elif operator == "BDC":
            layer = layers[operands[1]]
        elif operator in "ml":
            x, y = numbers
            points.append([transform[0] * x + transform[2] * y + transform[4], transform[1] * x + transform[3] * y + transform[5]])
        elif operator in "sSf":
            told["paths"].append({"layer": layer, "width": width, "closed": operator != "S", "filled": operator == "f", "points": points})
            points = []
        elif operator == "Do":
            image = page["/Resources"]["/XObject"][operands[0]].get_object()
            pixels = image.get_data()
            told["image"] = {"corner": transform[4:], "size": [transform[0], transform[3]], "pixels": [image["/Width"], image["/Height"]],
                             "digest": hashlib.sha256(pixels).hexdigest(), "bytes": pixels.hex()}
    return told


print(json.dumps([describe(path) for path in json.load(sys.stdin)]))
