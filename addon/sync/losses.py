# SPDX-License-Identifier: GPL-3.0-or-later
"""Notices that tell of something missing in the picture: with `--patina-strict` a frame that has one fails."""

from __future__ import annotations

from collections.abc import Iterable

from .. import native, options


class Loss(str):
    """A notice of what a picture was to show and does not."""


def check(notices: Iterable[str]) -> None:
    """PatinaError where the command line asks for whole pictures only, and this one lacks something."""
    lost = [notice for notice in notices if isinstance(notice, Loss)]
    if lost and options.read().get("strict"):
        raise native.PatinaError("; ".join(lost))
