# SPDX-License-Identifier: GPL-3.0-or-later
"""The file dialog of exports whose format and file name decide each other."""

from __future__ import annotations

from pathlib import Path

from bpy.props import BoolProperty
from bpy.types import Context, Event
from bpy_extras.io_utils import ExportHelper


class ExportDialog(ExportHelper):
    """Beside bpy.types.Operator, one with the property kind: the format of the file."""

    overwrite: BoolProperty(name="Overwrite", default=False, options={'HIDDEN', 'SKIP_SAVE'},
                            description="Replace an existing file of the same name. The file dialog asks first")
    filename_ext = ""
    _seen = ""  # the format when the dialog last looked

    def kind_of(self, path: Path) -> str:
        """The format that a name stands for, or ""."""
        raise NotImplementedError

    def ending_of(self, kind: str) -> str:
        """Of a format's file names, without the dot."""
        return kind.lower()

    def invoke(self, context: Context, event: Event) -> set[str]:
        self._seen = self.kind
        self.overwrite = True  # the file dialog marks a name that exists in red, and asks
        return super().invoke(context, event)

    def check(self, _context: Context) -> bool:
        """Of format and name the one that was changed decides."""
        path = Path(self.filepath)
        named = self.kind_of(path)
        if named not in {"", self.kind} and self.kind == self._seen:
            self.kind = self._seen = named
            return True
        self._seen = self.kind
        if named == self.kind:
            return False
        bare = self.filepath[:-len(self.ending_of(named)) - 1] if named else str(path.with_suffix(""))
        self.filepath = f"{bare}.{self.ending_of(self.kind)}"
        return True
