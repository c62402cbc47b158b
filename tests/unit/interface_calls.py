# SPDX-License-Identifier: GPL-3.0-or-later
"""Calls of functions of patina.h with the arguments of interface_stage.py, in order or not, from one thread or several."""

import ctypes
import random
import sys
import threading
import time

from interface_stage import CODES, DESTROYS, SIDE, Stage, abi

DRAWN = 0.25  # seconds, after which a picture is cancelled
ORDERS = 150
THREADS, SECONDS_OF_THREADS = 2, 6.0
NEVER = {"patina_progress_cancel", "patina_frame_cancel"}


def end(timer: threading.Timer) -> None:
    """What it cancels may be destroyed afterwards."""
    timer.cancel()
    timer.join()


def draw(stage: Stage) -> None:
    """The scene, such as it is by now: any code, and it comes back."""
    frame, scene = stage.handle("frame"), stage.handle("scene")
    timer = threading.Timer(DRAWN, lambda: stage.call("patina_frame_cancel", frame))
    timer.start()
    code = stage.call("patina_frame_render", frame, scene)
    end(timer)
    assert code in CODES, code


def finish(stage: Stage, function: str, arguments: list, parameters: list) -> None:
    """What the call gave is used once, and destroyed."""
    if parameters and parameters[-1][1] == "out" and "patina_task" in parameters[-1][0] and isinstance(arguments[-1], type(ctypes.byref(ctypes.c_int()))):
        task = arguments[-1]._obj
        if task.value:
            assert stage.call("patina_task_wait", task) in CODES
            if "analyse" in function:
                assert stage.call("patina_task_apply", task) in CODES
            stage.library.patina_task_destroy(task)
        return
    if parameters and parameters[-1][1] == "out" and arguments[-1] is not None:
        made, kind = arguments[-1]._obj, parameters[-1][0].replace("const", "").replace("*", "").strip()
        if made.value:
            getattr(stage.library, f"{kind}_destroy")(made)
            made.value = None


def try_call(stage: Stage, function: str, parameters: list, place: int = -1, argument: object = None) -> object:
    arguments = [argument if i == place else stage.good(function, kind, name) for i, (kind, name) in enumerate(parameters)]
    drawn = [i for i, (kind, _) in enumerate(parameters) if kind.replace("const", "").replace(" ", "") == "patina_frame*"]
    timer = None
    if drawn and arguments[drawn[0]] and function != "patina_frame_destroy":
        frame = arguments[drawn[0]]
        timer = threading.Timer(DRAWN, lambda: stage.call("patina_frame_cancel", frame))
        timer.start()
    result = getattr(stage.library, function)(*arguments)
    if timer:
        end(timer)
    finish(stage, function, arguments, parameters)
    return result


def drop(stage: Stage, kind: str) -> None:
    """Destroys the stage's handle of a kind, so that the next one is new."""
    if kind in stage.handles:
        getattr(stage.library, f"patina_{'cloud' if kind == 'pages' else kind}_destroy")(stage.handles.pop(kind))


def renew(stage: Stage) -> None:
    """The handles that a function uses up or changes, as new."""
    for kind in ("builder", "rows", "task", "pages"):
        drop(stage, kind)
    if "scene" in stage.handles:
        stage.set_scene(stage.handles["scene"])


def returns_code(function: str) -> bool:
    return abi.RESULTS.get(function, ctypes.c_int) is ctypes.c_int and function != "patina_task_done"


def check_result(function: str, result: object) -> None:
    assert not returns_code(function) or result in CODES, (function, result)


def try_orders(stage: Stage, all_of_them: dict, tell: object) -> int:
    """Good calls in any order: of what was never drawn, of what is over, twice."""
    random.seed(49)
    usable = [name for name in all_of_them if not name.endswith("_destroy") and name not in NEVER]
    for _ in range(ORDERS):
        way = []
        for kind in ("frame", "builder", "rows", "task"):
            drop(stage, kind)
        stage.handles["frame"] = stage.make("patina_frame_create", stage.handle("device"))  # nothing was drawn in it
        for name in random.choices(usable, k=12):
            way.append(name.removeprefix("patina_"))
            tell(", ".join(way))
            result = try_call(stage, name, all_of_them[name])
            check_result(name, result)
        if "scene" in stage.handles:
            stage.set_scene(stage.handles["scene"])
    return ORDERS


def first_of(parameters: list) -> str:
    """The kind of the handle that a function is of."""
    own = parameters[0][0].replace("const", "").replace("*", "").strip().removeprefix("patina_") if parameters else ""
    return own if own in DESTROYS else ""


def try_pairs(stage: Stage, all_of_them: dict, tell: object) -> int:
    """Of each kind of handle every call after every other, on one that is new: never drawn, never added to, never waited for."""
    tried = 0
    for kind in ("frame", "scene", "builder", "rows", "task", "file", "pages", "progress"):
        own = "cloud" if kind == "pages" else kind
        names = [name for name, parameters in all_of_them.items() if first_of(parameters) == own and not name.endswith("_destroy") and
                 (kind != "pages" or "page" in name or "wanted" in name)]
        assert names, kind
        for first in names:
            for second in names:
                drop(stage, kind)
                if kind == "frame":
                    stage.handles["frame"] = stage.make("patina_frame_create", stage.handle("device"))
                elif kind == "scene":
                    stage.handles["scene"] = stage.make("patina_scene_create")
                for name in (first, second):
                    tell(f"{first}, {second}: {name}")
                    result = try_call(stage, name, all_of_them[name])
                    check_result(name, result)
                tried += 1
        if kind == "scene":
            stage.set_scene(stage.handle("scene"))
    return tried


def _changes_a_cloud(parameters: list) -> bool:
    return any(kind.replace(" ", "") == "patina_cloud*" for kind, _ in parameters)


def try_threads(stage: Stage, all_of_them: dict, tell: object) -> int:
    """By the rule of patina.h: threads with handles of their own, which share a device, a cloud, a mesh and a texture, call whatever there is,
    while another thread calls what may be called at any time. Each picture of theirs that comes to its end is the one that a thread alone
    draws."""
    shared = {kind: stage.handle(kind) for kind in ("device", "cloud", "mesh", "texture")}
    stage.handle("scene"), stage.handle("frame")
    wanted = picture(stage)
    usable = [name for name, parameters in all_of_them.items()
              if not name.endswith("_destroy") and name not in NEVER and not _changes_a_cloud(parameters) and "device_create" not in name]
    wrong, counts, stages = [], [], []
    for i in range(THREADS):
        folder = stage.folder / str(i)
        folder.mkdir()
        own = Stage(stage.library, folder)
        own.handles.update(shared)
        for kind in ("frame", "scene", "progress"):
            own.handle(kind)
        for kind in ("ply", "cloud", "keys", "shadows"):  # before somebody cancels what writes them
            own.path(kind)
        stages.append(own)

    def work(own: Stage, seed: int) -> None:
        chance, tried = random.Random(seed), 0
        try:
            while time.monotonic() < end and not wrong:
                for name in chance.choices(usable, k=6):
                    result = try_call(own, name, all_of_them[name])
                    check_result(name, result)
                    tried += 1
                own.set_scene(own.handles["scene"])
                own.call("patina_frame_keep_planes", own.handles["frame"], 0)
                found = picture(own)
                assert found in (b"", wanted), f"thread {seed}: another picture"
                tried += 1
        except BaseException as error:  # noqa: BLE001 - told by the thread that waits
            wrong.append(error)
        counts.append(tried)

    def interfere() -> None:
        text = ctypes.create_string_buffer(64)
        chance = random.Random(1)
        while time.monotonic() < end and not wrong:
            for own in stages:
                own.library.patina_frame_progress(own.handles["frame"])
                own.library.patina_progress_value(own.handles["progress"])
                own.library.patina_message(own.handles["frame"], text, 64)
                own.library.patina_log_next(text, 64, None)
                if chance.random() < 0.05:
                    own.library.patina_frame_cancel(own.handles["frame"])
                if chance.random() < 0.05:
                    own.library.patina_progress_cancel(own.handles["progress"])
            time.sleep(0.001)

    tell(f"{THREADS} threads")
    threads = [threading.Thread(target=work, args=(own, i)) for i, own in enumerate(stages)] + [threading.Thread(target=interfere)]
    before, end = sys.getswitchinterval(), time.monotonic() + SECONDS_OF_THREADS
    sys.setswitchinterval(1e-4)
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    sys.setswitchinterval(before)
    if wrong:
        raise wrong[0]
    assert len(counts) == THREADS and all(counts), counts
    return sum(counts)


def picture(stage: Stage) -> bytes:
    """What the stage's scene looks like; nothing where somebody cancelled it."""
    frame = stage.handles["frame"]
    code = stage.call("patina_frame_render", frame, stage.handles["scene"])
    if code == abi.ERROR["ERROR_CANCELLED"]:
        return b""
    assert not code, code
    pixels = (ctypes.c_float * (SIDE * SIDE * 4))()
    assert not stage.call("patina_frame_read", frame, 0, pixels, ctypes.sizeof(pixels))
    return bytes(pixels)
