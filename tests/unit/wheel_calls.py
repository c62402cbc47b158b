# SPDX-License-Identifier: GPL-3.0-or-later
"""The installed package patina_render, call by call: shapes, exact depths and normals, errors. test_wheel.py runs it in a fresh environment.

    wheel_calls.py FOLDER        an empty one
"""
import inspect
import sys
import threading
import unittest
from pathlib import Path

import numpy as np
import patina_render as patina

FOLDER = Path()
COUNT = 20000


def ball(radius: float = 1.0, center: tuple[float, ...] = (0.0, 0.0, 0.0)) -> tuple[np.ndarray, np.ndarray]:
    """Positions and unit normals on a spiral from pole to pole, (n, 3) float64."""
    z = 1 - (2 * np.arange(COUNT) + 1) / COUNT
    turn, ring = np.arange(COUNT) * (np.pi * (3 - 5 ** 0.5)), np.sqrt(1 - z * z)
    normals = np.stack([ring * np.cos(turn), ring * np.sin(turn), z], axis=1)
    return radius * normals + center, normals


def scene_of(cloud: patina.Cloud, *transform: np.ndarray, **how: object) -> patina.Scene:
    scene = patina.Scene()
    scene.add(cloud, *transform, **how)
    return scene


def render(scene: patina.Scene, width: int = 96, height: int = 64, **how: object) -> patina.Render:
    return patina.render(scene, width, height, device="cpu", **how)


class Calls(unittest.TestCase):
    def test_shapes(self) -> None:
        positions, normals = ball()
        scene = scene_of(patina.Cloud(positions, normals=normals))
        result = render(scene, passes=patina.renders.PASSES)
        self.assertEqual((result.image.shape, result.image.dtype), ((64, 96, 4), np.float32))
        self.assertEqual((result.depth.shape, result.normal.shape), ((64, 96), (64, 96, 3)))
        self.assertEqual(set(result.passes), set(patina.renders.PASSES))
        for plane in (result.image, *result.passes.values()):
            self.assertTrue(plane.flags.c_contiguous and plane.flags.owndata and plane.dtype == np.float32)
        self.assertEqual(result.stats["points"], COUNT)
        with self.assertRaisesRegex(KeyError, "the pass depth was not rendered"):
            render(scene, passes=()).depth

    def test_depth_and_normal_are_the_balls(self) -> None:
        """Of a parallel view from above: z and normal in each pixel by the equation of the ball."""
        positions, normals = ball()
        cloud = patina.Cloud(positions, normals=normals)
        cloud.analyze()
        scene = scene_of(cloud)
        scene.look_parallel(eye=(0, 0, 5), target=(0, 0, 0), height=2.5, up=(0, 1, 0))
        result = render(scene, 128, 128)
        x, y = np.meshgrid((np.arange(128) + 0.5) / 128 * 2.5 - 1.25, 1.25 - (np.arange(128) + 0.5) / 128 * 2.5)  # row 0 is the top
        inside = x * x + y * y < 0.9
        height = np.sqrt(np.where(inside, 1 - x * x - y * y, 0))
        self.assertTrue(np.isfinite(result.depth[inside]).all())
        self.assertLess(np.abs(result.depth - (5 - height))[inside].max(), 0.08)
        angle = np.degrees(np.arccos(np.clip((result.normal * np.stack([x, y, height], axis=2)).sum(axis=2), -1, 1)))
        self.assertLess(angle[inside].mean(), 1.5)
        self.assertTrue(np.isinf(result.depth[0, 0]) and result.image[0, 0, 3] == 0)

    def test_row_0_is_the_top(self) -> None:
        positions, _ = ball()
        colors = np.where(positions[:, 2:] > 0, (1.0, 0.0, 0.0), (0.0, 0.0, 1.0))  # red above blue
        scene = scene_of(patina.Cloud(positions, colors))
        scene.frame(azimuth=0, elevation=0)
        image = render(scene).image
        np.testing.assert_allclose(image[16, 48], (1, 0, 0, 1), atol=1e-5)
        np.testing.assert_allclose(image[48, 48], (0, 0, 1, 1), atol=1e-5)

    def test_colors_of_each_type(self) -> None:
        positions, _ = ball()
        for values, linear in ((np.uint8([188, 0, 255]), (0.503, 0, 1)), (np.uint16([65535, 0, 0]), (1, 0, 0)), (np.float64([0.25, 0.5, 1]), (0.25, 0.5, 1)),
                               (np.float32([0.25, 0.5, 1, 7]), (0.25, 0.5, 1))):
            image = render(scene_of(patina.Cloud(positions, np.tile(values, (COUNT, 1))))).image
            np.testing.assert_allclose(image[32, 48, :3], linear, atol=2e-3)

    def test_positions_of_each_type(self) -> None:
        """Coordinates of maps give the image that those around 0 give."""
        positions, normals = ball()
        here = render(scene_of(patina.Cloud(positions, normals=normals)))
        far = render(scene_of(patina.Cloud(positions + (4.5e5, 5.2e6, 300), normals=normals)))
        self.assertGreater((np.isfinite(here.depth) == np.isfinite(far.depth)).mean(), 0.999)
        strided = np.zeros((COUNT, 6), np.float32)
        strided[:, ::2] = positions
        self.assertEqual(patina.Cloud(strided[:, ::2]).count, COUNT)
        self.assertEqual(patina.Cloud([[0, 0, 0], [1, 2, 3]]).box.tolist(), [[0, 0, 0], [1, 2, 3]])

    def test_points_that_are_not_finite_are_left_out(self) -> None:
        cloud = patina.Cloud([[0, 0, 0], [np.nan, 0, 0], [0, np.inf, 0]])
        self.assertEqual((len(cloud), cloud.drawn), (3, 1))

    def test_styles(self) -> None:
        positions, normals = ball()
        cloud = patina.Cloud(positions, scalars=positions[:, 2], normals=normals, classes=np.arange(COUNT) % 3)
        fixed = render(scene_of(cloud, lit=False, color=(0.1, 0.2, 0.3))).image
        np.testing.assert_allclose(fixed[32, 48], (0.1, 0.2, 0.3, 1), atol=1e-5)
        by_scalar = scene_of(cloud, lit=False, color_by="scalar", ramp="grey", ramp_range=(-1, 1))
        by_scalar.frame(elevation=0)
        image = render(by_scalar).image
        self.assertGreater(image[12, 48, 0], image[32, 48, 0] + 0.1)
        self.assertLess(image[52, 48, 0], image[32, 48, 0] - 0.05)
        half = render(scene_of(cloud, lit=False, opacity=0.5)).image
        self.assertAlmostEqual(half[32, 48, 3], 0.75, delta=0.02)  # front and back
        lit = render(scene_of(cloud)).image
        self.assertGreater(lit[..., 0].max() - lit[32:34, 40:56, 0].min(), 0.05)
        moved = np.eye(4)
        moved[:3, 3] = (10, 0, 0)
        scene = scene_of(cloud, moved)
        scene.look(eye=(10, -4, 0), target=(10, 0, 0))
        self.assertAlmostEqual(render(scene).depth[32, 48], 3, delta=0.05)

    def test_background_and_lights(self) -> None:
        positions, normals = ball()
        cloud, scene = patina.Cloud(positions, normals=normals), patina.Scene(background=(0.2, 0.4, 0.6), ambient=(0, 0, 0))
        scene.add(cloud)
        scene.add_sun((-1, 0, 0), 3.0)
        scene.frame(azimuth=0, elevation=0)
        image = render(scene).image
        np.testing.assert_allclose(image[0, 0], (0.2, 0.4, 0.6, 1), atol=1e-6)
        self.assertGreater(image[32, 66, 0], 0.3)  # right, towards +x
        self.assertLess(image[32, 30, 0], 0.02)

    def test_analysis(self) -> None:
        positions, normals = ball()
        cloud = patina.Cloud(positions)
        self.assertFalse(cloud.is_analyzed or cloud.has_normals)
        cloud.analyze(stations=[(0, 0, 0)])
        found = cloud.analysis()
        self.assertTrue(cloud.is_analyzed and cloud.has_normals)
        self.assertEqual({name: values.shape for name, values in found.items()},
                         {"normal": (COUNT, 3), "spacing": (COUNT,), "half_axes": (COUNT, 2), "sigma": (COUNT,), "kind": (COUNT,), "trust": (COUNT,)})
        self.assertLess(np.quantile((found["normal"] * normals).sum(axis=1), 0.99), -0.99)  # towards the station in the middle
        self.assertEqual(patina.KINDS[np.bincount(found["kind"]).argmax()], "surface")
        self.assertAlmostEqual(np.median(found["spacing"]), np.sqrt(4 * np.pi / COUNT), delta=0.004)

    def test_files(self) -> None:
        positions, _ = ball()
        text = FOLDER / "ball.xyz"
        np.savetxt(text, positions, fmt="%.6f")
        cloud = patina.Cloud.read(text)
        self.assertEqual((cloud.count, repr(cloud)), (COUNT, f"Cloud({COUNT} points)"))
        cloud.analyze()
        saved = FOLDER / "ball.cloud"
        cloud.save(saved)
        again = patina.Cloud.read(str(saved))
        self.assertTrue(again.is_analyzed)
        np.testing.assert_array_equal(render(scene_of(again)).image, render(scene_of(cloud)).image)
        with self.assertRaises(FileExistsError):
            cloud.save(saved)
        cloud.save(saved, overwrite=True)
        with self.assertRaises(ValueError):
            cloud.save(FOLDER / "ball.ply")

    def test_png(self) -> None:
        image = np.zeros((3, 5, 4), np.float32)
        image[1, 2] = (0.25, 0.5, 0, 0.5)
        shown = patina.to_srgb(image)
        self.assertEqual(shown[1, 2].tolist(), [188, 255, 0, 128])
        path = FOLDER / "image.png"
        patina.write_png(path, image)
        before = path.read_bytes()
        self.assertEqual(before[:8], b"\x89PNG\r\n\x1a\n")
        with self.assertRaises(FileExistsError):
            patina.write_png(path, shown)
        patina.write_png(path, shown, overwrite=True)
        self.assertEqual(path.read_bytes(), before)
        with self.assertRaises(ValueError):
            patina.write_png(FOLDER / "none.png", np.zeros((3, 5)))
        with self.assertRaises(OSError):
            patina.write_png(FOLDER / "none" / "none.png", image)
        self.assertEqual([name.name for name in FOLDER.iterdir() if "none" in name.name or name.name.startswith(".")], [])

    def test_same_bytes(self) -> None:
        positions, normals = ball()
        scene = scene_of(patina.Cloud(positions, normals=normals))
        first = render(scene, threads=1)
        others = [patina.Renderer("cpu-scalar").render(scene, 96, 64), render(scene, threads=3)]
        found = []
        threads = [threading.Thread(target=lambda: found.append(render(scene, threads=1))) for _ in range(4)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        self.assertEqual(len(found), 4)
        for other in others + found:
            np.testing.assert_array_equal(other.image, first.image)
            np.testing.assert_array_equal(other.depth, first.depth)

    def test_an_empty_scene_is_background(self) -> None:
        result = render(patina.Scene(background=(0.5, 0, 0)))
        np.testing.assert_allclose(result.image, np.broadcast_to((0.5, 0, 0, 1), (64, 96, 4)), atol=1e-6)
        self.assertTrue(np.isinf(result.depth).all())
        self.assertEqual(render(scene_of(patina.Cloud(np.empty((0, 3))))).image.max(), 0)

    def test_errors_say_what_is_wrong(self) -> None:
        positions, _ = ball()
        cloud = patina.Cloud(positions)
        scene = scene_of(cloud)

        def view(**camera: object) -> None:
            other = scene_of(cloud)
            other.look(**{"eye": (0, -5, 0), "target": (0, 0, 0)} | camera)

        for call, error, said in (
                (lambda: patina.Cloud(positions[:, :2]), ValueError, r"positions has the shape \(20000, 2\); \(20000, 3\) is needed"),
                (lambda: patina.Cloud(5), ValueError, "positions has the shape"),
                (lambda: patina.Cloud([["a", "b", "c"]]), ValueError, "numbers are needed"),
                (lambda: patina.Cloud(positions, positions[1:]), ValueError, "colors has the shape"),
                (lambda: patina.Cloud(positions, np.zeros((COUNT, 3), int)), ValueError, "uint8, uint16 or floats are needed"),
                (lambda: patina.Cloud(positions, classes=np.full(COUNT, 256)), ValueError, "0 to 255"),
                (lambda: patina.Cloud(positions, opacities=positions), ValueError, r"\(20000, 1\) or \(20000,\) is needed"),
                (lambda: patina.Cloud.read(FOLDER / "none.ply"), patina.Error, "none.ply"),
                (lambda: patina.Cloud.read(FOLDER / "none.cloud"), patina.Error, "none.cloud"),
                (lambda: cloud.analyze(neighbors=1000), patina.Error, "neighbours"),
                (lambda: cloud.analyze(stations=[(0, 0)]), ValueError, "stations has the shape"),
                (lambda: scene.add(cloud, np.eye(3)), ValueError, r"\(4, 4\) is needed"),
                (lambda: scene.add(cloud, opacity=2), ValueError, "0 to 1"),
                (lambda: scene.add(cloud, color_by="mood"), ValueError, "'mood'; one of own, fixed"),
                (lambda: scene.add(cloud, ramp="mud"), patina.Error, "mud"),
                (lambda: scene.add(cloud, color=(1, 2)), ValueError, "three finite numbers"),
                (lambda: scene.add_sun((np.nan, 0, 0)), ValueError, "three finite numbers"),
                (lambda: view(target=(0, -5, 0)), ValueError, "equal"),
                (lambda: view(up=(0, 1, 0)), ValueError, "parallel"),
                (lambda: view(fov=180), ValueError, "fov"),
                (lambda: render(scene, 0, 10), ValueError, "0 x 10"),
                (lambda: render(scene, 1.5, 10), TypeError, "integer"),
                (lambda: render(scene, samples=5000), patina.Error, "5000 samples a pixel"),
                (lambda: render(scene, passes=["smell"]), ValueError, "no pass 'smell'; the passes are depth, normal"),
                (lambda: patina.render(scene, 8, 8, device="abacus"), patina.Error, "abacus")):
            with self.assertRaisesRegex(error, said) as raised:
                call()
            self.assertLess(len(str(raised.exception)), 300)
        scene.frame(azimuth=float("nan"))
        with self.assertRaises(patina.Error):
            render(scene)
        scene.frame()
        self.assertEqual(render(scene).image[32, 48, 3], 1, "renders after all of this")

    def test_everything_is_described(self) -> None:
        self.assertRegex(patina.version(), r"^\d+\.\d+\.\d+\+[0-9a-f]{12}$")
        self.assertIn("(720, 1280, 4) float32", inspect.getdoc(patina))
        for name in patina.__all__:
            value = getattr(patina, name)
            if not callable(value):
                continue
            self.assertTrue(inspect.getdoc(value), name)
            if isinstance(value, type) and value is not patina.Error:
                for method, member in vars(value).items():
                    if not method.startswith("_") and callable(member):
                        self.assertTrue(inspect.getdoc(member), f"{name}.{method}")


if __name__ == "__main__":
    FOLDER = Path(sys.argv.pop(1)).resolve()
    result = unittest.main(exit=False).result
    bad = len(result.failures) + len(result.errors)
    print(f"{result.testsRun - bad} passed, {bad} failed, 0 skipped")
    sys.exit(1 if bad else 0)
