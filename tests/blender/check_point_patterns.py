# SPDX-License-Identifier: GPL-3.0-or-later
"""Textures by formula on points, against what Cycles renders of the same nodes at the same places."""

import bpy
import numpy as np
from check_point_materials import Tree, evaluated
from harness import Skip, add_points, check, check_close, new_scene, saved
from patina.sync.points import perlin

SIDE = 64
# The largest difference of colors from 0 to 1, in any channel of any pixel: a 25th of a step of 8 bits. Measured: 2.4e-5 in 3.4, and
# 1.05e-4 in 5.2, whose Cycles rounds coordinates otherwise: it grows with octaves, and with the distance between the channels' noises.
WORST = 1.5e-4


class Plane:
    """A slanted plane of SIDE x SIDE pixels in Cycles. Its positions are above 0, since images keep no negative colors."""

    def __init__(self):
        self.scene = scene = new_scene(SIDE, SIDE)
        if not hasattr(scene, "cycles"):
            raise Skip("this Blender has no Cycles")
        mesh = bpy.data.meshes.new("plane")
        mesh.from_pydata([(0, 0, 0.25), (2, 0, 0.5), (2, 2, 1.25), (0, 2, 1.0)], [], [(0, 1, 2, 3)])
        self.mesh = bpy.data.objects.new("plane", mesh)
        scene.collection.objects.link(self.mesh)
        scene.camera.location = (1, 1, 4)
        scene.camera.data.type, scene.camera.data.ortho_scale = 'ORTHO', 1.9
        scene.cycles.samples, scene.cycles.use_denoising, scene.cycles.device = 1, False, 'CPU'
        scene.cycles.pixel_filter_type, scene.cycles.filter_width = 'BOX', 0.01
        self.points = add_points(np.zeros((1, 3)), name="first")
        self.tree = Tree(self.points)
        mesh.materials.append(self.tree.material)
        self.place = self.tree.node('ShaderNodeNewGeometry').outputs["Position"]
        self.shine = self.tree.node('ShaderNodeEmission')
        # where the pixels are, as Cycles has it: the points stand there
        self.places = self.rendered(self.place)
        bpy.data.objects.remove(self.points)
        self.points = add_points(self.places, name="points")
        self.points.data.materials.append(self.tree.material)
        self.points.hide_render = True

    def rendered(self, socket):
        """(n, 3) of Cycles."""
        output = self.tree.tree.get_output_node('ALL').inputs[0]
        before = output.links[0].from_socket
        self.tree.set(self.shine.inputs[0], socket)
        self.tree.tree.links.new(self.shine.outputs[0], output)
        self.points.hide_render, self.scene.render.engine = True, 'CYCLES'
        bpy.ops.render.render()
        self.scene.render.engine = 'PATINA'
        self.tree.tree.links.new(before, output)
        return saved()[..., :3].reshape(-1, 3)

    def check(self, what, socket):
        self.tree.color(socket)
        ours, _, notices = evaluated(self.points)
        check(not notices, f"{what}: {notices}")
        theirs = np.maximum(self.rendered(socket), 0)
        check(np.ptp(theirs) > 0.1, f"{what}: Cycles shows {theirs.min()} to {theirs.max()}")
        off = np.abs(ours - theirs).max(1)
        check(off.max() <= WORST, f"{what}: at most {off.max():.3g} off, {np.quantile(off, 0.99):.3g} in 1 % of the pixels")

    def texture(self, kind, properties=None, vector=True, **values):
        node = self.tree.node(kind, properties, **values)
        if vector:
            self.tree.set(node.inputs["Vector"], self.place)
        return node


def both(plane, what, node):
    for output in node.outputs:
        if output.enabled:
            plane.check(f"{what}, {output.name}", output)


def test_gradients_and_checkers_like_cycles():
    plane = Plane()
    for kind in ('LINEAR', 'QUADRATIC', 'EASING', 'DIAGONAL', 'SPHERICAL', 'QUADRATIC_SPHERE', 'RADIAL'):
        mapped = plane.tree.node('ShaderNodeMapping', Vector=plane.place, Location=(-0.5, -0.4, -0.6), Scale=(0.7, 0.8, 0.9))
        node = plane.tree.node('ShaderNodeTexGradient', {"gradient_type": kind}, Vector=mapped.outputs[0])
        both(plane, f"Gradient {kind}", node)
    for scale in (1.0, 5.3):
        both(plane, f"Checker {scale}", plane.texture('ShaderNodeTexChecker', Scale=scale, Color1=(0.9, 0.5, 0.1, 1)))


def test_waves_like_cycles():
    """Each type, direction and profile; bent by noise."""
    plane = Plane()
    for rings, directions in (('bands', "X Y Z DIAGONAL"), ('rings', "X Y Z SPHERICAL")):
        for direction in directions.split():
            for profile in ('SIN', 'SAW', 'TRI') if direction == "Y" else ('SIN',):
                node = plane.texture('ShaderNodeTexWave', {"wave_type": rings.upper(), f"{rings}_direction": direction, "wave_profile": profile},
                                     Scale=1.3, Phase_Offset=0.7)
                plane.check(f"Wave {rings} {direction} {profile}", node.outputs[0])
    both(plane, "Wave bent", plane.texture('ShaderNodeTexWave', Scale=1.1, Distortion=3.0, Detail=2.6, Detail_Scale=1.4, Detail_Roughness=0.6))


def test_magic_like_cycles():
    """Each depth, and undistorted."""
    plane = Plane()
    for depth in range(11):
        node = plane.texture('ShaderNodeTexMagic', {"turbulence_depth": depth}, Scale=1.4, Distortion=1.2)
        plane.check(f"Magic {depth}", node.outputs[0])
    both(plane, "Magic plain", plane.texture('ShaderNodeTexMagic', {"turbulence_depth": 0}, Scale=2.0, Distortion=0.0))


def test_noise_like_cycles():
    """Each number of dimensions, octaves in part, distorted; Fac and Color."""
    plane = Plane()
    x = plane.tree.node('ShaderNodeSeparateXYZ', _0=plane.place).outputs[0]
    for axes in ('1D', '2D', '3D', '4D'):
        values = {"W": x} if axes in ('1D', '4D') else {}
        for detail, roughness, distortion in ((0.0, 0.5, 0.0), (2.0, 0.5, 0.0), (3.4, 0.7, 0.8)):
            node = plane.texture('ShaderNodeTexNoise', {"noise_dimensions": axes}, axes != '1D', Scale=3.1, Detail=detail, Roughness=roughness,
                                 Distortion=distortion, **values)
            both(plane, f"Noise {axes} {detail} {distortion}", node)
    if "Lacunarity" in node.inputs:
        node = plane.texture('ShaderNodeTexNoise', Scale=2.0, Detail=2.5, Lacunarity=2.7)
        both(plane, "Noise with lacunarity", node)
        node = plane.texture('ShaderNodeTexNoise', {"normalize": False}, Scale=2.0, Detail=2.5)
        both(plane, "Noise as it is", node)
    detail = plane.texture('ShaderNodeTexNoise', Scale=2.0, Detail=x, Roughness=x)
    both(plane, "Noise with a detail for each point", detail)


def test_default_places_like_cycles():
    """Without a vector, textures are placed by the points' box, and move with the object."""
    plane = Plane()
    node = plane.tree.node('ShaderNodeTexNoise')
    plane.tree.color(node.outputs["Fac"])
    first = evaluated(plane.points)[0]
    low, size = plane.places.min(0), np.ptp(plane.places, axis=0)
    wanted = perlin.octaves((plane.places - low) / size * np.float32(5), np.float32([[2]]), np.float32([[0.5]]))
    check_close(first, np.repeat(wanted, 3, 1), 1e-5, "by the box")
    plane.points.location.x = 3
    check_close(evaluated(plane.points)[0], first, 1e-6, "moved")


def test_noise_of_bad_places():
    """Places that are no numbers, or far away, end in finite noise; whole places have the value of their cell's corner, 0."""
    places = np.float32([(np.nan, 0, 0), (np.inf, 1, 2), (-np.inf, 0, 0), (3e38, 0, 0), (4, -7, 2)])
    for axes in (1, 2, 3):
        found = perlin.noise(places[:, :axes])
        check(np.isfinite(found).all() and np.abs(found).max() <= 2, f"{axes}: {found.ravel()}")
        check(found[-1, 0] == 0, f"{axes}: {found[-1, 0]}")
    check(not len(perlin.noise(np.zeros((0, 3), np.float32))), "no places")
