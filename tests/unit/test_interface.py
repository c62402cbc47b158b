# SPDX-License-Identifier: GPL-3.0-or-later
"""Every function of patina.h with every argument wrong. The cases are made from the headers and addon/native/abi.py: each pointer NULL; each
number NaN, infinite, 0, -1 and the largest; each field of a descriptor likewise; struct_size too small and too large; and valid calls in
random orders, each call of a handle after each other, and two threads by the header's rule. A call returns a code of patina.h and comes back, and the same call with good arguments works afterwards.

What is not tried is what patina.h asks of its caller and no library can check: counts above what an array has, addresses of nothing, and
handles after their end.

    test_interface.py LIBRARY [FUNCTION...]

Each function is tried in a process of its own, so that a crash is one failure, which names the case.
"""

import ctypes
import os
import shutil
import signal
import sys
import tempfile
import time
from pathlib import Path

sys.dont_write_bytecode = True
sys.path.append(str(Path(__file__).resolve().parents[1]))
from interface_calls import check_result, draw, renew, returns_code, try_call, try_orders, try_pairs, try_threads  # noqa: E402
from interface_stage import DESTROYS, Stage, abi, camel, declarations  # noqa: E402
from names import chosen  # noqa: E402

SECONDS = 300  # that a function may take with all of its cases
FLOATS = (float("nan"), float("inf"), float("-inf"), 0.0, -1.0, 3.4e38, 1e308, -1e308, 5e-324)
COUNTS = {"count", "other_count", "page_count", "vertex_count", "triangle_count", "ramp_count", "station_count", "direction_count", "corners", "room",
          "stride", "width", "height"}  # what arrays of the caller go by


def wrong_numbers(plain: str) -> tuple:
    if plain in ("float", "double"):
        return FLOATS
    bits = {"uint32_t": 32, "uint64_t": 64, "size_t": 64, "int": 32}[plain]
    return (0, 1, (1 << bits - 1) - 1, (1 << bits - 1) if plain != "int" else -1, (1 << bits) - 1 if plain != "int" else -1000)


def wrong_descriptors(good: ctypes.Structure) -> list[tuple[str, object]]:
    """Names of what is wrong, and such descriptors."""
    cases, size = [], ctypes.sizeof(good)
    has_size = good._fields_[0][0] == "struct_size"

    def changed(name: str) -> tuple[ctypes.Structure, object]:
        copy = type(good).from_buffer_copy(bytes(good))
        return copy, getattr(copy, name)

    for told in (0, 1, 8, 9, 12, 16, size - 8, size - 1) if has_size else ():
        copy, _ = changed("struct_size")
        copy.struct_size = told
        cases.append((f"struct_size {told} of {size}", copy))
    for told, tail in ((size + 64, 0), (size + 64, 1), (1 << 30, None), ((1 << 64) - 1, None)) if has_size else ():
        if tail is None:
            continue  # memory behind a descriptor belongs to whoever says that it is part of it
        room = (ctypes.c_uint8 * (size + 64))(*bytes(good), *[tail] * 64)
        ctypes.c_size_t.from_buffer(room).value = told
        cases.append((f"struct_size {told}, {'zeros' if not tail else 'something'} behind", room))
    for name, kind in good._fields_[1 if has_size else 0:]:
        if kind is abi.Array:
            for field, values in (("data", (None,)), ("type", (0, 1, 2, 9, 0xFFFFFFFF)), ("components", (0, 1, 5, 0xFFFFFFFF)),
                                  ("stride", (0, 1, 3))):
                for value in values:
                    copy, array = changed(name)
                    setattr(array, field, value)
                    cases.append((f"{name}.{field} = {value}", copy))
        elif issubclass(kind, ctypes.Array):
            item = kind._type_
            values = FLOATS if item in (ctypes.c_float, ctypes.c_double) else () if item is ctypes.c_char else wrong_numbers("uint32_t")
            for value in values:
                for which in (range(kind._length_), (0,)):
                    copy, array = changed(name)
                    for i in which:
                        array[i] = value
                    cases.append((f"{name}[{'all' if len(which) > 1 else 0}] = {value}", copy))
        elif kind in (ctypes.c_float, ctypes.c_double):
            for value in FLOATS:
                copy, _ = changed(name)
                setattr(copy, name, value)
                cases.append((f"{name} = {value}", copy))
        elif kind in (ctypes.c_uint32, ctypes.c_uint64, ctypes.c_size_t):
            bits = 8 * ctypes.sizeof(kind)
            values = (0, 1) if name in COUNTS else (0, 1, 2, 7, (1 << bits - 1) - 1, (1 << bits) - 1)
            values += ((1 << 63), (1 << 64) - 1) if name == "count" and bits == 64 else ()
            for value in values:
                copy, _ = changed(name)
                setattr(copy, name, value)
                cases.append((f"{name} = {value}", copy))
        elif kind in (ctypes.c_void_p, ctypes.c_char_p):
            copy, _ = changed(name)
            setattr(copy, name, None)
            cases.append((f"{name} = NULL", copy))
    return cases


def cases_of(stage: Stage, function: str, parameters: list[tuple[str, str]]) -> list[tuple[str, int, object]]:
    """What is wrong, of which parameter, and the argument."""
    cases = []
    for i, (kind, name) in enumerate(parameters):
        plain = kind.replace("const", "").replace(" ", "")
        if "*" in plain:
            cases.append((f"{name} = NULL", i, None))
            own = plain.replace("*", "")
            if own == "char" and "const" in kind and plain.count("*") == 1:
                cases += [(f"{name} = {text[:40]!r}", i, text) for text in
                          (b"", b"/nowhere/file", stage.path("folder"), b"/dev/null", b"x" * 5000, b"\xff\xfe", stage.path("ply"))]
            if own.startswith("patina_") and hasattr(abi, camel(own)) and own.removeprefix("patina_") not in DESTROYS:
                cases += [(f"{name}: {what}", i, ctypes.byref(made)) for what, made in wrong_descriptors(stage.descriptor(own))]
        else:
            values = (0, 1) if name in COUNTS or name == "size" and "message" not in function and "read" not in function else \
                wrong_numbers(plain)
            if name == "size":
                values = tuple(value for value in values if value < len(stage.out)) + (3,)
            cases += [(f"{name} = {value}", i, value) for value in values]
    return cases


def try_function(stage: Stage, function: str, parameters: list, tell: object) -> int:
    tried = 0
    if function.endswith("_destroy"):
        tell("NULL")
        getattr(stage.library, function)(None)
        return 1
    tell("good arguments")
    first = try_call(stage, function, parameters)
    check_result(function, first)
    renew(stage)
    for what, place, argument in cases_of(stage, function, parameters):
        tell(what)
        result = try_call(stage, function, parameters, place, argument)
        check_result(function, result)
        if "scene_set" in function or "scene_add" in function:
            draw(stage)
        renew(stage)
        tried += 1
    tell("good arguments once more")
    again = try_call(stage, function, parameters)
    assert not returns_code(function) or again == first or first == abi.ERROR["ERROR_CANCELLED"], f"returned {again}, and {first} at first"
    return tried


def try_alone(library: str, function: str, all_of_them: dict) -> tuple[bool, str]:
    """In a process of its own: whether all went well, and how many cases, or what went wrong in which."""
    here, there = os.pipe()
    child = os.fork()
    if not child:
        os.close(here)
        signal.alarm(SECONDS)
        folder = Path(tempfile.mkdtemp())
        last = [""]

        def tell(what: str) -> None:
            last[0] = what
            os.write(there, b"\0" + what.encode(errors="replace")[:600])

        status = 1
        try:
            os.chdir(folder)
            loaded = ctypes.CDLL(library)
            for name, types in abi.CALLS.items():
                getattr(loaded, name).restype = abi.RESULTS.get(name, ctypes.c_int)
                getattr(loaded, name).argtypes = [ctypes.c_void_p if kind not in SIMPLE else kind for kind in types]
            stage = Stage(loaded, folder)
            count = OTHERS[function](stage, all_of_them, tell) if function in OTHERS else \
                try_function(stage, function, all_of_them[function], tell)
            os.write(there, b"\0" + str(count).encode())
            status = 0
        except BaseException as error:  # noqa: BLE001 - the process ends with it
            os.write(there, b"\0" + f"{last[0]}: {type(error).__name__}: {error}".encode()[:600])
        shutil.rmtree(folder, ignore_errors=True)
        os._exit(status)
    os.close(there)
    told = b""
    while part := os.read(here, 1 << 16):
        told = (told + part)[-4000:]
    os.close(here)
    _, status = os.waitpid(child, 0)
    what = told.rsplit(b"\0", 1)[-1].decode(errors="replace")
    if os.WIFSIGNALED(status):
        end = signal.Signals(os.WTERMSIG(status)).name
        return False, f"{what}: {'took too long' if end == 'SIGALRM' else end}"
    return os.WEXITSTATUS(status) == 0, what


OTHERS = {"orders": try_orders, "pairs": try_pairs, "threads": try_threads}
SIMPLE = {ctypes.c_int, ctypes.c_uint32, ctypes.c_uint64, ctypes.c_size_t, ctypes.c_float, ctypes.c_double, ctypes.c_char_p}


def main() -> int:
    library, wanted = str(Path(sys.argv[1]).resolve()), sys.argv[2:]
    all_of_them = declarations()
    missing = set(abi.CALLS) ^ set(all_of_them)
    assert not missing, f"declarations that were not understood: {missing}"
    passed = failed = cases = 0
    start = time.monotonic()
    for function in chosen([*all_of_them, *OTHERS], wanted):
        good, told = try_alone(library, function, all_of_them)
        passed, failed = passed + good, failed + (not good)
        cases += int(told) if good else 0
        if not good:
            print(f"FAILED {function} ({told})", flush=True)
    print(f"{cases} cases of {len(all_of_them)} functions, {time.monotonic() - start:.0f} s")
    print(f"{passed} passed, {failed} failed, 0 skipped")
    return int(failed > 0)


sys.exit(main())
