# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads native/kernels.def, which says how; errors name the line. For build/generate_kernels and build/check_twins."""
from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
LIST = ROOT / "native/kernels.def"
BINDINGS = 12  # storage blocks that a shader may have: what OpenGL 4.3 drivers offer at the least, but for its minimum of 8
UNIFORMS = 12  # uniform blocks that every driver offers a shader; the first is that of lib/srgb.glsl
TILE_LIST = "tile_list"  # in the last binding, whatever the kernel: see lib/tiles.glsl
DOMAINS = ("tiles", "rectangle", "crop", "points", "bins", "triangles")
STAGES = ("points", "ranges", "measured", "filling", "means", "meshes", "shadows", "lines", "effects", "colors", "picture", "balls")
PLACES = ("window", "own", "finer", "coarser", "crop", "tiles", "cloud", "mesh", "plan")
ACCESS = ("r", "w", "rw")


@dataclass
class Buffer:
    """A buffer of a kernel; binding: of its storage block, 0: it has none; unit: index of its buffer texture, -1: none; uniform: of
    its uniform block, 0: it is none."""

    name: str
    formats: list[str]
    access: str
    places: list[str]
    repeats: bool
    optional: bool
    block: bool = False
    shares: str = ""  # its block has the binding of that buffer's
    binding: int = 0
    unit: int = -1
    soft: bool = False  # a texture only in software
    in_uniform: bool = False
    uniform: int = 0


@dataclass
class Kernel:
    """A kernel, or (domain "") another program, which may have a kernel's blocks. scratch: name -> binding of the device's own."""

    name: str
    domain: str = ""
    stage: str = ""
    reach: str = "0"
    buffers: list[Buffer] = field(default_factory=list)
    scratch: dict[str, int] = field(default_factory=dict)
    shares: dict[str, str] = field(default_factory=dict)  # of scratch: whose binding it has
    blocks_of: Kernel | None = None

    @property
    def pointwise(self) -> bool:
        """Whether one body is the kernel, for C and GLSL."""
        return (ROOT / f"shaders/pointwise/{self.name}.h").exists()

    @property
    def fixed(self) -> int:
        """How many buffers do not repeat."""
        return sum(not b.repeats for b in self.buffers)

    @property
    def blocks(self) -> dict[str, int]:
        """Name -> binding of every storage block but the arguments'."""
        if self.blocks_of:
            return self.blocks_of.blocks
        return {**{b.name: b.binding for b in self.buffers if b.block}, **self.scratch}

    @property
    def uniforms(self) -> dict[str, int]:
        """Name -> binding of every uniform block."""
        if self.blocks_of:
            return self.blocks_of.uniforms
        return {"srgb": 0, **{b.name: b.uniform for b in self.buffers if b.in_uniform}}


@dataclass
class Listing:
    """What native/kernels.def says. formats: name -> bytes a pixel; units: name -> (GL format, bytes)."""

    formats: dict[str, int] = field(default_factory=dict)
    units: dict[str, tuple[str, int]] = field(default_factory=dict)
    kernels: list[Kernel] = field(default_factory=list)
    programs: list[Kernel] = field(default_factory=list)


def _buffer(words: list[str], listing: Listing) -> Buffer:
    name, formats, access, places = words[0], words[1].split("|"), words[2], words[3].split("|")
    buffer = Buffer(name.strip("*?"), formats, access, places, name.startswith("*"), name.endswith("?"))
    if not re.fullmatch(r"\w+", buffer.name):
        raise ValueError(f"{name} is no name")
    for value, known in ((formats, listing.formats), ([access], ACCESS), (places, PLACES)):
        for one in value:
            if one not in known:
                raise ValueError(f"{one} is none of {', '.join(known)}")
    for word in words[4:]:
        unit = word[5:] if word.startswith("soft:") else word
        if word.partition("@")[0] == "block":
            buffer.block, buffer.shares = True, word.partition("@")[2]
        elif word == "uniform" and access == "r":
            buffer.in_uniform = True
        elif word == "-" and len(words) == 5:
            pass
        elif unit in listing.units and buffer.unit < 0:
            buffer.unit, buffer.soft = list(listing.units).index(unit), unit != word
        else:
            raise ValueError(f"{word} is neither block, nor uniform of what is only read, nor a unit, nor - alone")
    return buffer


def _add(kernel: Kernel, words: list[str], listing: Listing) -> None:
    if words[0] == "+":
        kernel.scratch.update(dict.fromkeys((word.partition("@")[0] for word in words[1:]), 0))
        kernel.shares.update(word.split("@") for word in words[1:] if "@" in word)
        return
    if not kernel.domain or len(words) < 5:
        raise ValueError("a buffer has a name, a format, access, a place, and what GLSL sees")
    buffer = _buffer(words, listing)
    if kernel.buffers and kernel.buffers[-1].repeats and not buffer.repeats:
        raise ValueError(f"{buffer.name}: buffers that repeat come last")
    if any(b.name == buffer.name for b in kernel.buffers):
        raise ValueError(f"{buffer.name} stands there twice")
    kernel.buffers.append(buffer)


def _number(kernel: Kernel) -> None:
    """Bindings: 0 the arguments, then blocks as they are listed; the list of tiles has the last."""
    if kernel.domain == "tiles":
        kernel.scratch[TILE_LIST] = 0
    binding = 1
    for buffer in kernel.buffers:
        if buffer.shares:
            buffer.binding = next(b.binding for b in kernel.buffers if b.name == buffer.shares)
        elif buffer.block:
            buffer.binding, binding = binding, binding + 1
        elif buffer.in_uniform:
            buffer.uniform = max(kernel.uniforms.values()) + 1
    for name in kernel.scratch:
        if name in kernel.shares:
            kernel.scratch[name] = next(b.binding for b in kernel.buffers if b.name == kernel.shares[name])
        elif name != TILE_LIST:
            kernel.scratch[name], binding = binding, binding + 1
    if TILE_LIST in kernel.scratch:
        kernel.scratch[TILE_LIST] = BINDINGS - 1
    if binding > BINDINGS - (TILE_LIST in kernel.scratch):
        raise ValueError(f"{kernel.name} has {binding} storage blocks: too many")
    if len(kernel.uniforms) > UNIFORMS:
        raise ValueError(f"{kernel.name} has {len(kernel.uniforms)} uniform blocks: too many")
    units = [b.unit for b in kernel.buffers if b.unit >= 0]
    if len(set(units)) != len(units):
        raise ValueError(f"{kernel.name}: two buffers share a texture unit")


def parse(text: str) -> Listing:
    """The list. ValueError: what is wrong in which line."""
    listing = Listing()
    last: Kernel | None = None
    for number, line in enumerate(text.splitlines(), 1):
        words = line.split("//")[0].split()
        try:
            if not words:
                continue
            if line[0].isspace():
                if not last:
                    raise ValueError("a buffer without a kernel")
                _add(last, words, listing)
            elif words[0] == "format":
                listing.formats[words[1]] = int(words[2])
            elif words[0] == "unit":
                listing.units[words[1]] = (words[2], int(words[3]))
            elif words[0] == "kernel":
                last = Kernel(*words[1:])
                if last.domain not in DOMAINS or last.stage not in STAGES:
                    raise ValueError(f"{last.name}: no such domain or stage")
                if any(k.name == last.name for k in listing.kernels):
                    raise ValueError(f"{last.name} is listed twice")
                listing.kernels.append(last)
            elif words[0] == "program":
                last = Kernel(words[1])
                listing.programs.append(last)
                if len(words) > 2:
                    last.blocks_of = next(k for k in listing.kernels if k.name == words[2])
            else:
                raise ValueError(f"{words[0]} is not known")
        except (ValueError, TypeError, IndexError, StopIteration) as error:
            raise ValueError(f"kernels.def:{number}: {error}") from error
    for kernel in listing.kernels + listing.programs:
        _number(kernel)
        if kernel.domain == "tiles" and not any(b.unit == list(listing.units).index("key") for b in kernel.buffers):
            raise ValueError(f"{kernel.name} visits tiles, and reads no keys as a texture that tell which")
        if kernel.domain == "bins" and not any(b.formats == ["bins"] for b in kernel.buffers):
            raise ValueError(f"{kernel.name} reduces tiles, and has no buffer of bins")
        chunks = [i for i, b in enumerate(kernel.buffers) if b.formats == ["chunk"]]
        read = any("position" in b.formats for b in kernel.buffers)
        if chunks and read and "position" not in kernel.buffers[chunks[0] + 1].formats:
            raise ValueError(f"{kernel.name}: positions follow chunks")
    return listing


def read() -> Listing:
    """The project's list."""
    return parse(LIST.read_text(encoding="utf-8"))
