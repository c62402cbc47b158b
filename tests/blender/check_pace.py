# SPDX-License-Identifier: GPL-3.0-or-later
"""How much is drawn while the view moves: plain arithmetic, on machines that are made up here."""

from harness import check
from patina.draw import pace


def took(level, points, pixels):
    """Seconds of a picture's points and of its pixels, not as pace.py guesses: a part of both is the same at every level."""
    return points * (0.1 + 0.9 * 0.62 ** (pace.STRATA - level.strata)), pixels * (0.1 + 0.9 / level.shrink ** 1.5)


def orbit(chooser, points, pixels, beside, pictures=40):
    """The levels of pictures on a machine that takes so many seconds for all points, all pixels and Blender's redraw."""
    levels = []
    for _ in range(pictures):
        level = chooser.level
        levels.append(level)
        chooser.note(level, *took(level, points, pixels))
        chooser.seen(beside)
    return levels


def test_all_is_drawn_where_there_is_time():
    levels = orbit(pace.Pace(0.06), 0.012, 0.004, 0.010)
    check(levels[-1] == pace.FULL, f"{levels[-1]}")
    check(len(set(levels[5:])) == 1, f"levels take turns: {levels[5:]}")


def test_blenders_time_counts():
    """A picture that alone would fit takes less where Blender needs its share, until both fit together."""
    chooser = pace.Pace(0.06)
    levels = orbit(chooser, 0.024, 0.004, 0.035)
    last = levels[-1]
    check(last != pace.FULL and sum(took(last, 0.024, 0.004)) <= 0.06 - 0.035, f"{last}")
    check(len(set(levels[8:])) == 1, f"levels take turns: {levels[8:]}")
    check(orbit(chooser, 0.024, 0.004, 0.002)[-1] == pace.FULL, "the window went away, the coarse picture stayed")


def test_a_slow_window_keeps_its_picture():
    """Where Blender alone takes longer than asked for, a picture is only as coarse as is worth it."""
    levels = orbit(pace.Pace(0.06), 0.012, 0.004, 0.1)
    check(sum(took(levels[-1], 0.012, 0.004)) <= 0.02 and levels[-1].shrink == 1, f"{levels[-1]}")
    check(len(set(levels[8:])) == 1, f"levels take turns: {levels[8:]}")
    check(orbit(pace.Pace(0.06), 10.0, 10.0, 0.1)[-1] == pace.LEAST, "a picture of seconds, and not the least is drawn")


def test_a_coarse_picture_does_not_stay():
    """When other programs let go of the processor, the picture is soon as fine as before."""
    chooser = pace.Pace(0.06)
    fine = orbit(chooser, 0.012, 0.004, 0.05)[-1]
    coarse = orbit(chooser, 0.2, 0.2, 0.15, 8)[-1]
    check(coarse.loss() >= fine.loss() + 4, f"{coarse} after {fine}")
    again = orbit(chooser, 0.012, 0.004, 0.05, 20)[-1]
    check(again.loss() <= fine.loss() + 2 and again.shrink == 1, f"{again}, was {fine}")


def test_one_pause_is_forgotten():
    chooser = pace.Pace(0.06)
    orbit(chooser, 0.012, 0.004, 0.005)
    chooser.seen(30.0)
    levels = orbit(chooser, 0.012, 0.004, 0.005, 6)
    check(levels[-1] == pace.FULL, f"{levels}")
    for _ in range(3):
        chooser.note(chooser.level, 2.0, 2.0)
    levels = orbit(chooser, 0.012, 0.004, 0.005, 20)
    check(levels[0] == pace.LEAST and levels[-1] == pace.FULL, f"{levels}")
