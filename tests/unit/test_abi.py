# SPDX-License-Identifier: GPL-3.0-or-later
"""The binding against the header and the library: addon/native/abi.py is what build/generate_abi makes, every structure has the
compiler's size and offsets, every call is there.

    test_abi.py LIBRARY
"""

import ctypes
import importlib.util
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.dont_write_bytecode = True
sys.path.append(str(ROOT / "build"))
import effects  # noqa: E402


def load():
    """abi.py alone: the package around it asks for numpy."""
    spec = importlib.util.spec_from_file_location("abi", ROOT / "addon/native/abi.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


abi = load()
LIBRARY = ""


def c_name(name: str) -> str:
    return "patina" + "".join(f"_{letter.lower()}" if letter.isupper() else letter for letter in name)


class Abi(unittest.TestCase):
    def test_is_what_the_header_says(self) -> None:
        done = subprocess.run([ROOT / "build/generate_abi", "--check"], capture_output=True, text=True, check=False)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)

    def test_sizes_and_offsets(self) -> None:
        structures = {name: value for name, value in vars(abi).items()
                      if isinstance(value, type) and issubclass(value, ctypes.Structure) and hasattr(value, "_fields_")}
        self.assertGreater(len(structures), 20)
        expected, lines = [], []
        for name, structure in structures.items():
            lines.append(f'printf("{name} %zu\\n", sizeof({c_name(name)}));')
            expected.append(f"{name} {ctypes.sizeof(structure)}")
            for field, *_ in structure._fields_:
                lines.append(f'printf("{name}.{field} %zu\\n", offsetof({c_name(name)}, {field.removesuffix("_")}));')
                expected.append(f"{name}.{field} {getattr(structure, field).offset}")
        with tempfile.TemporaryDirectory() as folder:
            source, program = Path(folder) / "sizes.c", Path(folder) / "sizes"
            source.write_text("#include <patina/patina.h>\n#include <stdio.h>\nint main(void)\n{\n" + "\n".join(lines) + "\n}\n")
            subprocess.run(["gcc", "-std=c11", f"-I{ROOT}/native/include", source, "-o", program], check=True)
            told = subprocess.run([program], capture_output=True, text=True, check=True).stdout.split("\n")
        self.assertEqual([line for line in told if line], expected)

    def test_every_call_is_there(self) -> None:
        library = ctypes.CDLL(LIBRARY)
        missing = [name for name in abi.CALLS if not hasattr(library, name)]
        self.assertEqual(missing, [])
        exported = subprocess.run(["nm", "-D", "--defined-only", LIBRARY], capture_output=True, text=True, check=True).stdout.split()
        self.assertEqual(sorted(name for name in exported if name.startswith("patina_")), sorted(abi.CALLS))
        self.assertLessEqual(set(abi.RESULTS), set(abi.CALLS))

    def test_the_library_gives_the_sizes(self) -> None:
        """patina_struct_size gives the compiler's size of each structure of the headers, and 0 for other names."""
        size_of = ctypes.CDLL(LIBRARY).patina_struct_size
        size_of.argtypes, size_of.restype = abi.CALLS["patina_struct_size"], abi.RESULTS["patina_struct_size"]
        structures = {c_name(name): ctypes.sizeof(value) for name, value in vars(abi).items()
                      if isinstance(value, type) and issubclass(value, ctypes.Structure) and hasattr(value, "_fields_")}
        self.assertEqual({name: size_of(name.encode()) for name in structures}, structures)
        self.assertEqual([size_of(name) for name in (None, b"", b"camera", b"patina_none")], [0, 0, 0, 0])

    def test_effects_are_the_table_s(self) -> None:
        """Every row of effects.def is a field of the structure, in its order; ranges hold what Blender begins with."""
        fields = [field for effect in abi.EFFECTS for field in effect["fields"]]
        self.assertEqual(["exact"] + [field["name"] for field in fields], [name for name, *_ in abi.Effects._fields_[1:]])
        self.assertEqual(len({field["property"] for field in fields}), len(fields))
        for effect in abi.EFFECTS:
            self.assertTrue(any(field["when"] == "STRENGTH" for field in effect["fields"]), effect["name"])
        for field in fields:
            on, _, word = field["when"].partition("=")
            known = {each["name"]: [name for name, *_ in each.get("items", ())] for each in fields}
            self.assertTrue(on in ("STRENGTH", "PART") or (on in known and (not word or word in known[on])), field["name"])
            if field["kind"] in ("NUMBER", "COUNT"):
                self.assertTrue(field["start"] == 0 or field["least"] <= field["start"], field["name"])
                self.assertLessEqual(field["low"], field["start"], field["name"])

    def test_mistakes_in_the_table_are_told(self) -> None:
        text = effects.LIST.read_text(encoding="utf-8")
        for old, new, told in (("[,toon_softness\"", "[,toon_softnes\"", "effects.def: toon: --toon takes toon_softnes, which is none of its fields"),
                               ("fog_color+fog_fixed", "fog_color+fog_fix", "effects.def: fog: --fog takes fog_fix,"),
                               ("\"Toon\", DRAWING", "\"Toon\", DRAWINGS", "effects.def: toon: panel DRAWINGS is none of CUES, "),
                               ("1.4f, PIXELS", "1.4f, PIXEL", "effects.def: edl: edl_radius: unit PIXEL is none of "),
                               ("PATINA_EFFECT_COUNT(toon", "PATINA_EFFECT_COUNTS(toon", "effects.def: PATINA_EFFECT_COUNTS is not known")):
            self.assertEqual(text.count(old), 1, old)
            with self.assertRaises(ValueError) as said:
                effects.parse(text.replace(old, new))
            self.assertTrue(str(said.exception).startswith(told), said.exception)
        with self.assertRaises(ValueError) as said:
            effects.parse(text + '\nPATINA_EFFECT_SWITCH(odd, PART, "odd", "Odd", "Odd")\n')
        self.assertIn("padding", str(said.exception))

    def test_constants(self) -> None:
        self.assertEqual(abi.PASSES["COMBINED"], (0, 4))
        self.assertEqual(abi.ERROR["ERROR_CANCELLED"], -7)
        self.assertEqual(abi.SHADOW_OFF["NO_SELF"], 4)
        self.assertEqual(abi.LIGHT_TYPE, {"SUN": 1, "POINT": 2, "SPOT": 3, "AREA": 4})


if __name__ == "__main__":
    LIBRARY = str(Path(sys.argv.pop(1)).resolve())
    result = unittest.main(exit=False).result
    bad = len(result.failures) + len(result.errors)
    print(f"{result.testsRun - bad} passed, {bad} failed, 0 skipped")
    sys.exit(1 if bad else 0)
