# SPDX-License-Identifier: GPL-3.0-or-later
"""patina.h for ctypes. Made of the header by build/generate_abi: change that, and run this."""

from __future__ import annotations

from ctypes import Array as Array_
from ctypes import (POINTER, Structure, c_char, c_char_p, c_double, c_float, c_int, c_size_t, c_uint32, c_uint64, c_void_p,
                    sizeof)
from typing import Any

VERSION = (1, 0)  # of the header; the patch number may differ

SIDES_VOTED = 2
TRUST_FEATURES = 33
TRUST_DEFAULT = 0.64
TRUST_MOST = 0.84
MAX_RAMP = 256
MAX_LAYERS = 16

# patina_pass: name → (number, channels)
PASSES = {"COMBINED": (0, 4), "DEPTH": (1, 1), "NORMAL": (2, 3), "SOURCE": (3, 1), "SHADOW": (4, 1), "LINE": (5, 1),
          "TRUST": (6, 1), "THICKNESS": (7, 1), "DENSITY": (8, 1), "DISAGREEMENT": (9, 1)}

ERROR = {"OK": 0, "ERROR_ARGUMENT": -1, "ERROR_MEMORY": -2, "ERROR_FILE": -3, "ERROR_FORMAT": -4, "ERROR_UNSUPPORTED": -5,
         "ERROR_DEVICE": -6, "ERROR_CANCELLED": -7, "ERROR_TOO_MANY_POINTS": -8, "ERROR_EMPTY": -9, "ERROR_INTERNAL": -10,
         "ERROR_TOO_LARGE": -11}
TYPE = {"NONE": 0, "FLOAT32": 1, "FLOAT64": 2, "UINT8": 3, "UINT16": 4, "UINT32": 5, "INT8": 6, "INT16": 7, "INT32": 8}
KIND = {"UNKNOWN": 0, "SURFACE": 1, "BORDER": 2, "LINE": 3, "VOLUME": 4, "STRAY": 5}
LIGHTING = {"AUTO": 0, "UNLIT": 1, "LIT": 2}
COLOR_SOURCE = {"OWN": 0, "FIXED": 1, "SCALAR": 2, "HEIGHT": 3, "OBJECT_HEIGHT": 4, "DISTANCE": 5, "TRUST": 6}
FREE_SPACE = {"OFF": 0, "SHOW": 1, "USE": 2}
SOFT = {"OFF": 0, "ALL": 1, "FIELD": 2, "HIDDEN": 3}
SOFT_MODEL = {"BASE": 0, "CONCENTRIC": 1, "EXPRESS": 2, "SPLATS": 3, "ONE_LAYER": 4}
SHADOW_OFF = {"NO_CAST": 1, "NO_RECEIVE": 2, "NO_SELF": 4}
CLIP_SHAPE = {"BOX": 0, "PLANE": 1}
LIGHT_TYPE = {"SUN": 1, "POINT": 2, "SPOT": 3, "AREA": 4}
AREA_SHAPE = {"RECTANGLE": 0, "ELLIPSE": 1}
QUALITY = {"REFINED": 0, "PAPER": 1}
FILL = {"CLOSED": 0, "PAPER": 1, "OFF": 2}
SURFACE = {"AUTO": 0, "SPLATS": 1, "FILL": 2, "RANGES": 3}
DEPTH = {"POINT": 0, "SURFACE": 1}
SMOOTH = {"ALLEVIATED": 0, "GAUSSIAN": 1, "BOX": 2, "OFF": 3}
ANTIALIAS = {"LAYERS": 0, "BACKGROUND": 1, "OFF": 2}
EFFECT_CHOICE = {"NO_CHOICE": 0, "CONTOUR_HEIGHT": 0, "CONTOUR_PLANE": 1, "CONTOUR_ATTRIBUTE": 2}
LINE_SOURCE = {"FIXED": 0, "POINT": 1, "DEPTH": 2}
LINE_SURFACE = {"SHOWN": 0, "PAPER": 1, "NONE": 2}
DRAWING_LAYER = {"CUT": 0, "CUT_BRIDGED": 1, "OUTLINE": 2, "CREASE": 3, "CONTOUR": 4, "CONTOUR_INDEX": 5, "PROFILE": 6,
                 "FRAME": 7, "TEXT": 8}
WRAP = {"REPEAT": 0, "EXTEND": 1, "CLIP": 2}
ALPHA = {"NONE": 0, "CLIP": 1, "BLEND": 2}
KEYS_KIND = {"PART": 1, "NEXT": 2}
FIELD_SOURCE = {"VALUES": 0, "SCALAR": 1, "LUMINANCE": 2, "CLASSES": 3, "DISTANCE": 4, "UNCERTAINTY": 5, "DENSITY": 6}
FIELD_SHAPE = {"FROM_POINT": 0, "FROM_PLANE": 1, "FROM_AXIS": 2}


class Descriptor(Structure):
    """A structure whose first field is its size; zero everywhere else means "default"."""

    def __init__(self, **fields: Any) -> None:
        super().__init__(struct_size=sizeof(self))
        types = dict(self._fields_)
        for name, value in fields.items():
            kind = types[name]
            setattr(self, name, kind(*value) if issubclass(kind, Array_) else value)


class DeviceDesc(Descriptor):
    _fields_ = [("struct_size", c_size_t), ("name", c_char_p), ("threads", c_uint32), ("batch", c_uint32),
                ("memory_cap", c_uint64), ("mapped_cap", c_uint64)]


class DeviceInfo(Descriptor):
    _fields_ = [("struct_size", c_size_t), ("name", c_char * 32), ("description", c_char * 192), ("threads", c_uint32),
                ("hardware", c_uint32), ("key64", c_uint32)]


class Array(Structure):
    _fields_ = [("data", c_void_p), ("type", c_uint32), ("components", c_uint32), ("stride", c_uint64)]


class CloudDesc(Descriptor):
    _fields_ = [("struct_size", c_size_t), ("count", c_uint64), ("position", Array), ("normal", Array), ("color", Array),
                ("opacity", Array), ("scalar", Array), ("classes", Array), ("origin", c_double * 3), ("threads", c_uint32),
                ("radius", Array)]


class CloudInfo(Descriptor):
    _fields_ = [("struct_size", c_size_t), ("count", c_uint64), ("drawn", c_uint64), ("chunks", c_uint64),
                ("bytes", c_uint64), ("box_min", c_double * 3), ("box_max", c_double * 3), ("spacing", c_double),
                ("spacing_min", c_double), ("spacing_max", c_double), ("invalid_positions", c_uint64),
                ("invalid_normals", c_uint64), ("invalid_colors", c_uint64), ("has_normals", c_uint32),
                ("has_colors", c_uint32), ("has_opacities", c_uint32), ("origin", c_double * 3),
                ("layer_distance", c_double), ("has_radii", c_uint32), ("radius_most", c_float), ("has_scalars", c_uint32),
                ("has_classes", c_uint32), ("scalar_range", c_float * 2), ("class_bits", c_uint32 * 8),
                ("has_shapes", c_uint32), ("normals_oriented", c_uint32), ("estimated_normals", c_uint64),
                ("kinds", c_uint64 * 6), ("seen_through", c_uint64), ("packed", c_uint32), ("numbered", c_uint32),
                ("packed_error", c_double), ("trusts", c_uint64 * 16), ("trust_default", c_double), ("uncolored", c_uint64)]


class AnalysisDesc(Descriptor):
    _fields_ = [("struct_size", c_size_t), ("neighbours", c_uint32), ("threads", c_uint32), ("keep_normals", c_uint32),
                ("station_count", c_uint32), ("stations", c_void_p), ("station", Array), ("free_space", c_uint32),
                ("row", Array), ("column", Array), ("grid", c_uint32), ("scan", Array), ("direction_count", c_uint32),
                ("directions", c_void_p), ("trust_features", c_void_p), ("keep_colors", c_uint32)]


class Neighbourhoods(Descriptor):
    _fields_ = [("struct_size", c_size_t), ("normal", c_void_p), ("axis", c_void_p), ("spacing", c_void_p),
                ("half_axes", c_void_p), ("sigma", c_void_p), ("kind", c_void_p), ("trust", c_void_p),
                ("seen_through", c_void_p), ("neighbours", c_uint32), ("threads", c_uint32), ("numbers", c_void_p),
                ("distances", c_void_p), ("soft_radius", c_void_p), ("uncertainty", c_void_p)]


class CloudStyle(Descriptor):
    _fields_ = [("struct_size", c_size_t), ("world_from_object", c_double * 16), ("lighting", c_uint32),
                ("cull_back", c_uint32), ("d_min", c_float), ("color", c_float * 3), ("ambient", c_float),
                ("diffuse", c_float), ("specular", c_float), ("shininess", c_uint32), ("transparency", c_float),
                ("shadow_off", c_uint32), ("radius", c_float), ("color_source", c_uint32), ("ramp", c_void_p),
                ("ramp_count", c_uint32), ("ramp_range", c_float * 2), ("exposure", c_float), ("contrast", c_float),
                ("hidden_classes", c_uint32 * 8), ("clip_off", c_uint32), ("free_space", c_uint32),
                ("hidden_kinds", c_uint32), ("least_trust", c_float), ("largest_gap", c_float), ("mask", c_void_p),
                ("grade", c_void_p), ("exact", c_uint32), ("was_padding", c_uint32), ("soft", c_uint32),
                ("soft_model", c_uint32), ("soft_shells", c_uint32), ("soft_radius", c_float), ("soft_opacity", c_float),
                ("soft_modulation", c_float), ("field", c_void_p), ("soft_threshold", c_float), ("soft_unused", c_float),
                ("scans", c_void_p), ("surface", c_uint32), ("range_gamma", c_float), ("range_pixel", c_float),
                ("range_sharpness", c_float), ("range_cull", c_float), ("range_unused", c_uint32)]


class Clip(Descriptor):
    _fields_ = [("struct_size", c_size_t), ("world_from_clip", c_double * 16), ("shape", c_uint32), ("cut", c_uint32),
                ("tint", c_float * 3), ("tint_strength", c_float), ("tint_width", c_float)]


class LightDesc(Descriptor):
    _fields_ = [("struct_size", c_size_t), ("type", c_uint32), ("color", c_float * 3), ("power", c_float),
                ("position", c_double * 3), ("direction", c_double * 3), ("side", c_double * 3), ("angle", c_float),
                ("radius", c_float), ("size", c_float * 2), ("shape", c_uint32), ("cone", c_float), ("blend", c_float),
                ("shadows", c_uint32)]


class Camera(Descriptor):
    _fields_ = [("struct_size", c_size_t), ("orthographic", c_uint32), ("world_from_camera", c_double * 16),
                ("left", c_double), ("right", c_double), ("bottom", c_double), ("top", c_double), ("near_clip", c_double),
                ("far_clip", c_double), ("panorama_face", c_uint32), ("camera_unused", c_uint32)]


class Settings(Descriptor):
    _fields_ = [("struct_size", c_size_t), ("width", c_uint32), ("height", c_uint32), ("region", c_uint32 * 4),
                ("quality", c_uint32), ("fill", c_uint32), ("fill_iterations", c_uint32), ("smooth", c_uint32),
                ("antialias", c_uint32), ("film_transparent", c_uint32), ("world_color", c_float * 3), ("passes", c_uint32),
                ("layers", c_uint32), ("layer_passes", c_uint32), ("error_target", c_float), ("strata", c_uint32),
                ("shadow_samples", c_uint32), ("shadow_resolution", c_uint32), ("shadow_lazy", c_uint32),
                ("shadow_progressive", c_uint32), ("shadow_error", c_float), ("own_background", c_uint32),
                ("background", c_float * 3), ("surface", c_uint32), ("shadow_uncut", c_uint32), ("pixel_samples", c_uint32),
                ("depth", c_uint32), ("world_directed", c_uint32), ("world_light", c_float * 27),
                ("pixel_progressive", c_uint32), ("pixel_noise", c_float), ("average", c_uint32), ("detail", c_float)]


class Effects(Descriptor):
    _fields_ = [("struct_size", c_size_t), ("exact", c_uint32), ("edl_strength", c_float), ("edl_radius", c_float),
                ("obscurance_strength", c_float), ("obscurance_radius", c_float), ("fog_start", c_float),
                ("fog_end", c_float), ("fog_density", c_float), ("fog_fixed", c_uint32), ("fog_color", c_float * 3),
                ("toon_bands", c_uint32), ("toon_softness", c_float), ("hatch_levels", c_uint32),
                ("hatch_spacing", c_float), ("hatch_color", c_float * 3), ("hatch_opacity", c_float),
                ("hatch_ground", c_float), ("contour_source", c_uint32), ("contour_axis", c_float * 3),
                ("contour_start", c_float), ("contour_interval", c_float), ("contour_width", c_float),
                ("contour_every", c_uint32), ("contour_bold", c_float), ("contour_color", c_float * 3),
                ("contour_opacity", c_float), ("focus_aperture", c_float), ("focus_distance", c_float),
                ("paper_color", c_float * 3), ("paper_grain", c_float)]


class Lines(Descriptor):
    _fields_ = [("struct_size", c_size_t), ("width", c_float), ("world", c_uint32), ("offset", c_float),
                ("source", c_uint32), ("color", c_float * 3), ("far_color", c_float * 3), ("range", c_float * 2),
                ("transparency", c_float), ("soft", c_float), ("surface", c_uint32), ("paper", c_float * 3),
                ("exact", c_uint32)]


class ExpectedError(Structure):
    _fields_ = [("color", c_float), ("coverage", c_float), ("depth", c_float), ("normal", c_float), ("doubt", c_float)]


class FrameStats(Descriptor):
    _fields_ = [("struct_size", c_size_t), ("width", c_uint32), ("height", c_uint32), ("points", c_uint64),
                ("points_scattered", c_uint64), ("triangles", c_uint64), ("chunks", c_uint64), ("chunks_culled", c_uint64),
                ("ms", c_double), ("plane_bytes", c_uint64), ("layers", c_uint32), ("spacing_px", c_float),
                ("expected", ExpectedError), ("shadow_bytes", c_uint64), ("shadow_maps", c_uint32),
                ("shadow_width", c_uint32), ("shadow_height", c_uint32), ("shadow_pending", c_uint32),
                ("shadow_samples", c_uint32), ("shadow_error", c_float), ("chunks_clipped", c_uint64),
                ("chunks_cut", c_uint64), ("pixel_samples", c_uint32), ("pixel_pending", c_uint32),
                ("pixel_error", c_float), ("mapped_bytes", c_uint64), ("mapped_cap", c_uint64), ("mapped_held", c_uint64),
                ("mapped_read", c_uint64), ("mapped_rounds", c_uint32), ("mapped_returned", c_uint32),
                ("points_lost", c_uint64), ("untrusted", c_uint64), ("none_trusted", c_uint64)]


class BuilderDesc(Descriptor):
    _fields_ = [("struct_size", c_size_t), ("memory", c_uint64), ("count", c_uint64), ("box_min", c_double * 3),
                ("box_max", c_double * 3), ("threads", c_uint32), ("narrow_colors", c_uint32)]


class SaveDesc(Descriptor):
    _fields_ = [("struct_size", c_size_t), ("pack", c_uint32), ("drop_order", c_uint32)]


class DrawingDesc(Descriptor):
    _fields_ = [("struct_size", c_size_t), ("origin", c_double * 3), ("right", c_double * 3), ("up", c_double * 3),
                ("extent", c_double * 2), ("front", c_double), ("back", c_double), ("scale", c_double), ("epsg", c_uint32),
                ("unused", c_uint32)]


class CutDesc(Descriptor):
    _fields_ = [("struct_size", c_size_t), ("thickness", c_double), ("threads", c_uint32), ("unused", c_uint32),
                ("places", c_void_p), ("shown", POINTER(c_void_p))]


class ContourDesc(Descriptor):
    _fields_ = [("struct_size", c_size_t), ("interval", c_double), ("cell", c_double), ("index", c_uint32),
                ("threads", c_uint32)]


class OutlineDesc(Descriptor):
    _fields_ = [("struct_size", c_size_t), ("depth", c_void_p), ("width", c_uint32), ("height", c_uint32),
                ("pixel", c_double), ("spacing", c_double), ("measured", c_void_p)]


class DrawingInfo(Descriptor):
    _fields_ = [("struct_size", c_size_t), ("lines", c_uint32), ("layer_lines", c_uint32 * 9),
                ("layer_lengths", c_double * 9), ("samples", c_uint64), ("untrusted", c_uint64), ("spacing", c_double),
                ("sigma", c_double), ("thickness", c_double)]


class DrawingLine(Descriptor):
    _fields_ = [("struct_size", c_size_t), ("layer", c_uint32), ("closed", c_uint32), ("vertices", c_uint32),
                ("unused", c_uint32)]


class FileInfo(Descriptor):
    _fields_ = [("struct_size", c_size_t), ("format", c_char * 48), ("count", c_uint64), ("attributes", c_uint32),
                ("position_type", c_uint32), ("color_type", c_uint32), ("has_normals", c_uint32), ("origin", c_double * 3),
                ("box_min", c_double * 3), ("box_max", c_double * 3), ("invalid_positions", c_uint64),
                ("stations", c_uint32), ("scans", c_uint32), ("splats", c_uint32), ("unused", c_uint32)]


class FileAttribute(Descriptor):
    _fields_ = [("struct_size", c_size_t), ("name", c_char * 64), ("type", c_uint32)]


class FileScan(Descriptor):
    _fields_ = [("struct_size", c_size_t), ("name", c_char * 64), ("first", c_uint64), ("count", c_uint64),
                ("columns", c_uint32), ("rows", c_uint32), ("pose", c_double * 12), ("station", c_double * 3),
                ("direction", c_double * 3), ("interval", c_double), ("has_station", c_uint32), ("unused", c_uint32)]


class GridDesc(Descriptor):
    _fields_ = [("struct_size", c_size_t), ("count", c_uint64), ("position", c_void_p), ("column", c_void_p),
                ("row", c_void_p), ("station", c_double * 3)]


class RowsInfo(Descriptor):
    _fields_ = [("struct_size", c_size_t), ("count", c_uint64), ("whole", c_char * 80)]


class DistanceDesc(Descriptor):
    _fields_ = [("struct_size", c_size_t), ("count", c_uint64), ("other_count", c_uint64), ("position", Array),
                ("normal", Array), ("other", Array), ("origin", c_double * 3), ("other_origin", c_double * 3),
                ("normal_scale", c_double), ("cylinder", c_double), ("depth", c_double), ("registration_error", c_double),
                ("threads", c_uint32), ("unused", c_uint32)]


class GroundDesc(Descriptor):
    _fields_ = [("struct_size", c_size_t), ("count", c_uint64), ("position", Array), ("cell", c_double),
                ("threshold", c_double), ("largest", c_double), ("threads", c_uint32), ("unused", c_uint32)]


class MeshDesc(Descriptor):
    _fields_ = [("struct_size", c_size_t), ("vertex_count", c_uint64), ("position", Array), ("normal", Array),
                ("color", Array), ("triangle_count", c_uint64), ("indices", c_void_p), ("uv", Array)]


class MeshInfo(Descriptor):
    _fields_ = [("struct_size", c_size_t), ("vertex_count", c_uint64), ("triangle_count", c_uint64), ("bytes", c_uint64),
                ("box_min", c_double * 3), ("box_max", c_double * 3)]


class TextureDesc(Descriptor):
    _fields_ = [("struct_size", c_size_t), ("width", c_uint32), ("height", c_uint32), ("pixels", Array), ("raw", c_uint32),
                ("nearest", c_uint32), ("wrap", c_uint32)]


class MeshStyle(Descriptor):
    _fields_ = [("struct_size", c_size_t), ("world_from_object", c_double * 16), ("color", c_float * 3),
                ("shadow_off", c_uint32), ("unlit", c_uint32), ("texture", c_void_p), ("alpha", c_uint32),
                ("alpha_least", c_float), ("exact", c_uint32)]


class Page(Structure):
    _fields_ = [("box_min", c_double * 3), ("box_max", c_double * 3), ("gap", c_double), ("count", c_uint32),
                ("parent", c_uint32)]


class PagesDesc(Descriptor):
    _fields_ = [("struct_size", c_size_t), ("pages", c_void_p), ("page_count", c_uint32), ("color_type", c_uint32),
                ("has_normals", c_uint32), ("has_scalars", c_uint32), ("has_classes", c_uint32), ("box_min", c_double * 3),
                ("box_max", c_double * 3), ("memory_cap", c_uint64)]


class PagesInfo(Descriptor):
    _fields_ = [("struct_size", c_size_t), ("points", c_uint64), ("arrived", c_uint64), ("pages", c_uint32),
                ("pages_arrived", c_uint32), ("wanted", c_uint64), ("pages_wanted", c_uint32), ("returned", c_uint32)]


class Panorama(Descriptor):
    _fields_ = [("struct_size", c_size_t), ("width", c_uint32), ("height", c_uint32), ("region", c_uint32 * 4),
                ("world_from_camera", c_double * 16), ("longitude", c_double * 2), ("latitude", c_double * 2),
                ("near_clip", c_double), ("far_clip", c_double)]


class Part(Descriptor):
    _fields_ = [("struct_size", c_size_t), ("part", c_uint32), ("of", c_uint32), ("behind", c_char_p), ("note", c_char_p)]


class KeysInfo(Descriptor):
    _fields_ = [("struct_size", c_size_t), ("kind", c_uint32), ("part", c_uint32), ("of", c_uint32), ("round", c_uint32),
                ("engine", c_char * 32), ("picture", c_uint64), ("note_size", c_uint64)]


class ScanGrade(Structure):
    _fields_ = [("gain", c_float), ("gamma", c_float), ("saturation", c_float), ("temperature", c_float)]


class Scan(Structure):
    _fields_ = [("direction", c_double * 3), ("interval", c_double)]


class FieldDesc(Descriptor):
    _fields_ = [("struct_size", c_size_t), ("source", c_uint32), ("shape", c_uint32), ("count", c_uint64),
                ("values", c_void_p), ("range", c_double * 2), ("classes", c_uint32 * 8), ("invert", c_uint32),
                ("unused", c_uint32), ("world_from_object", c_double * 16), ("world_from_shape", c_double * 16)]


class FieldInfo(Descriptor):
    _fields_ = [("struct_size", c_size_t), ("range", c_double * 2), ("histogram", c_uint64 * 256)]


class Pick(Descriptor):
    _fields_ = [("struct_size", c_size_t), ("instance", c_uint32), ("polygon", c_void_p), ("corners", c_uint32),
                ("classes", c_uint32 * 8), ("threads", c_uint32)]


class Picked(Descriptor):
    _fields_ = [("struct_size", c_size_t), ("found", c_uint32), ("number", c_uint64), ("position", c_double * 3),
                ("distance", c_double)]


class Read(Structure):
    _fields_ = [("pass_", c_uint32), ("pixels", c_void_p), ("size", c_size_t)]


# name → types of arguments; what returns anything but int stands in RESULTS
CALLS = {
    "patina_version": (),
    "patina_struct_size": (c_char_p,),
    "patina_error_text": (c_int,),
    "patina_message": (c_void_p, c_char_p, c_size_t),
    "patina_log_next": (c_char_p, c_size_t, c_void_p),
    "patina_progress_create": (POINTER(c_void_p),),
    "patina_progress_destroy": (c_void_p,),
    "patina_progress_cancel": (c_void_p,),
    "patina_progress_value": (c_void_p,),
    "patina_device_create": (POINTER(DeviceDesc), POINTER(c_void_p)),
    "patina_device_destroy": (c_void_p,),
    "patina_device_get_info": (c_void_p, POINTER(DeviceInfo)),
    "patina_cloud_create": (POINTER(CloudDesc), c_void_p, POINTER(c_void_p)),
    "patina_cloud_destroy": (c_void_p,),
    "patina_cloud_set_colors": (c_void_p, POINTER(Array)),
    "patina_cloud_set_scalars": (c_void_p, POINTER(Array)),
    "patina_cloud_scalar_range": (c_void_p, c_double, c_void_p),
    "patina_cloud_dense_box": (c_void_p, c_void_p, c_void_p),
    "patina_cloud_thin": (c_void_p, c_void_p, c_size_t, c_uint64, c_void_p, c_void_p, c_void_p, c_void_p, c_void_p),
    "patina_cloud_analyse": (c_void_p, POINTER(AnalysisDesc), c_void_p),
    "patina_cloud_neighbourhoods": (c_void_p, POINTER(Neighbourhoods), c_void_p),
    "patina_cloud_save": (c_void_p, c_char_p),
    "patina_cloud_open": (c_char_p, POINTER(c_void_p)),
    "patina_cloud_open_at": (c_char_p, c_void_p, POINTER(c_void_p)),
    "patina_cloud_verify": (c_char_p, c_void_p),
    "patina_cloud_get_info": (c_void_p, POINTER(CloudInfo)),
    "patina_ramp": (c_char_p, c_void_p),
    "patina_scene_create": (POINTER(c_void_p),),
    "patina_scene_destroy": (c_void_p,),
    "patina_scene_clear": (c_void_p,),
    "patina_scene_add_cloud": (c_void_p, c_void_p, POINTER(CloudStyle)),
    "patina_scene_add_clip": (c_void_p, POINTER(Clip)),
    "patina_scene_add_light": (c_void_p, POINTER(LightDesc)),
    "patina_scene_set_camera": (c_void_p, POINTER(Camera)),
    "patina_scene_set_settings": (c_void_p, POINTER(Settings)),
    "patina_scene_set_effects": (c_void_p, POINTER(Effects)),
    "patina_scene_set_lines": (c_void_p, POINTER(Lines)),
    "patina_scene_extent": (c_void_p, c_void_p, c_void_p),
    "patina_scene_ramp_range": (c_void_p, c_uint32, c_void_p),
    "patina_scene_frame_camera": (c_void_p, c_double, c_double, c_double, POINTER(Camera)),
    "patina_frame_create": (c_void_p, POINTER(c_void_p)),
    "patina_frame_destroy": (c_void_p,),
    "patina_frame_render": (c_void_p, c_void_p),
    "patina_frame_check": (c_void_p, c_void_p),
    "patina_frame_refine": (c_void_p, c_void_p, c_double),
    "patina_frame_cancel": (c_void_p,),
    "patina_frame_progress": (c_void_p,),
    "patina_frame_read": (c_void_p, c_uint32, c_void_p, c_size_t),
    "patina_frame_read_layer": (c_void_p, c_uint32, c_uint32, c_void_p, c_size_t),
    "patina_nearest_depths": (c_void_p, c_uint32, c_uint32, c_void_p, c_size_t),
    "patina_frame_read_keys": (c_void_p, c_void_p, c_size_t),
    "patina_frame_get_stats": (c_void_p, POINTER(FrameStats)),
    "patina_builder_begin": (c_char_p, POINTER(BuilderDesc), POINTER(c_void_p)),
    "patina_builder_add": (c_void_p, POINTER(CloudDesc)),
    "patina_builder_add_file": (c_void_p, c_void_p, c_char_p),
    "patina_builder_end": (c_void_p, c_void_p),
    "patina_builder_destroy": (c_void_p,),
    "patina_cloud_analyse_file": (c_char_p, POINTER(AnalysisDesc), c_uint64, c_char_p, c_void_p),
    "patina_cloud_save_as": (c_void_p, c_char_p, POINTER(SaveDesc)),
    "patina_frame_stats_json": (c_void_p, c_char_p, c_size_t),
    "patina_frame_plan_text": (c_void_p, c_void_p, c_char_p, c_size_t),
    "patina_frame_keep_planes": (c_void_p, c_uint32),
    "patina_frame_measure": (c_void_p, c_uint32),
    "patina_frame_dump_planes": (c_void_p, c_char_p),
    "patina_drawing_create": (POINTER(DrawingDesc), POINTER(c_void_p)),
    "patina_drawing_destroy": (c_void_p,),
    "patina_drawing_cut": (c_void_p, POINTER(c_void_p), c_uint32, POINTER(CutDesc), c_void_p),
    "patina_drawing_contour": (c_void_p, POINTER(c_void_p), c_uint32, POINTER(ContourDesc), c_void_p),
    "patina_drawing_outline": (c_void_p, POINTER(OutlineDesc)),
    "patina_drawing_get_info": (c_void_p, POINTER(DrawingInfo)),
    "patina_drawing_get_line": (c_void_p, c_uint32, POINTER(DrawingLine)),
    "patina_drawing_read_line": (c_void_p, c_uint32, c_void_p, c_size_t),
    "patina_drawing_read_depths": (c_void_p, c_uint32, c_void_p, c_size_t),
    "patina_drawing_write": (c_void_p, c_char_p, c_uint32),
    "patina_file_open": (c_char_p, c_void_p, POINTER(c_void_p)),
    "patina_file_open_memory": (c_void_p, c_size_t, POINTER(c_void_p)),
    "patina_file_destroy": (c_void_p,),
    "patina_file_get_info": (c_void_p, POINTER(FileInfo)),
    "patina_file_get_attribute": (c_void_p, c_uint32, POINTER(FileAttribute)),
    "patina_file_get_scan": (c_void_p, c_uint32, POINTER(FileScan)),
    "patina_file_read_positions": (c_void_p, c_void_p, c_size_t),
    "patina_file_read_normals": (c_void_p, c_void_p, c_size_t),
    "patina_file_read_colors_u8": (c_void_p, c_void_p, c_size_t),
    "patina_file_read_colors_f32": (c_void_p, c_void_p, c_size_t),
    "patina_file_read_stations": (c_void_p, c_void_p, c_size_t),
    "patina_file_read_attribute": (c_void_p, c_uint32, c_void_p, c_size_t),
    "patina_grid_normals": (POINTER(GridDesc), c_void_p, c_void_p),
    "patina_rows_open": (c_char_p, c_void_p, POINTER(c_void_p)),
    "patina_rows_get_info": (c_void_p, POINTER(RowsInfo)),
    "patina_rows_next": (c_void_p, c_uint64, POINTER(c_void_p)),
    "patina_rows_destroy": (c_void_p,),
    "patina_file_cloud": (c_void_p, c_uint32, c_void_p, POINTER(c_void_p)),
    "patina_cloud_load": (c_char_p, c_void_p, POINTER(c_void_p)),
    "patina_write_ply": (c_char_p, POINTER(CloudDesc)),
    "patina_distance_defaults": (POINTER(DistanceDesc),),
    "patina_cloud_distance": (POINTER(DistanceDesc), c_void_p, c_void_p, c_void_p),
    "patina_task_cloud_distance": (POINTER(DistanceDesc), c_void_p, c_void_p, c_void_p, POINTER(c_void_p)),
    "patina_ground_defaults": (POINTER(GroundDesc),),
    "patina_ground": (POINTER(GroundDesc), c_void_p, c_void_p, c_void_p),
    "patina_task_ground": (POINTER(GroundDesc), c_void_p, c_void_p, c_void_p, POINTER(c_void_p)),
    "patina_mesh_create": (POINTER(MeshDesc), POINTER(c_void_p)),
    "patina_mesh_destroy": (c_void_p,),
    "patina_mesh_get_info": (c_void_p, POINTER(MeshInfo)),
    "patina_texture_create": (POINTER(TextureDesc), POINTER(c_void_p)),
    "patina_texture_destroy": (c_void_p,),
    "patina_scene_add_mesh": (c_void_p, c_void_p, POINTER(MeshStyle)),
    "patina_cloud_pages_begin": (POINTER(PagesDesc), POINTER(c_void_p)),
    "patina_cloud_page_give": (c_void_p, c_uint32, POINTER(CloudDesc)),
    "patina_cloud_wanted": (c_void_p, c_double, c_void_p, c_uint32, c_void_p),
    "patina_cloud_get_pages": (c_void_p, POINTER(PagesInfo)),
    "patina_task_give_page": (c_void_p, c_uint32, POINTER(CloudDesc), POINTER(c_void_p)),
    "patina_panorama_camera": (POINTER(Panorama), c_uint32, POINTER(Camera), c_void_p),
    "patina_panorama_join": (POINTER(Panorama), c_uint32, c_void_p * 6, c_void_p, c_size_t),
    "patina_panorama_join_keys": (POINTER(Panorama), c_void_p * 6, c_void_p, c_size_t),
    "patina_frame_scatter": (c_void_p, c_void_p, POINTER(Part), c_char_p),
    "patina_frame_merge": (c_void_p, c_void_p, POINTER(c_void_p), c_uint32, c_char_p, c_void_p),
    "patina_keys_get_info": (c_char_p, POINTER(KeysInfo)),
    "patina_keys_read_note": (c_char_p, c_char_p, c_size_t),
    "patina_mask_create": (c_void_p, c_void_p, c_void_p, c_size_t, POINTER(c_void_p)),
    "patina_mask_destroy": (c_void_p,),
    "patina_grade_create": (c_void_p, c_void_p, POINTER(ScanGrade), c_uint32, POINTER(c_void_p)),
    "patina_grade_create_balanced": (c_void_p, c_void_p, POINTER(ScanGrade), c_void_p, c_uint32, c_uint32,
                                     POINTER(c_void_p)),
    "patina_grade_destroy": (c_void_p,),
    "patina_cloud_balance": (c_void_p, c_void_p, c_uint32, c_void_p, c_void_p),
    "patina_scans_create": (c_void_p, c_void_p, POINTER(Scan), c_uint32, POINTER(c_void_p)),
    "patina_scans_destroy": (c_void_p,),
    "patina_field_create": (c_void_p, POINTER(FieldDesc), c_void_p, POINTER(c_void_p)),
    "patina_field_destroy": (c_void_p,),
    "patina_field_get_info": (c_void_p, POINTER(FieldInfo)),
    "patina_frame_read_numbers": (c_void_p, c_void_p, c_size_t),
    "patina_scene_pick": (c_void_p, c_void_p, POINTER(Pick), c_void_p, c_void_p, c_size_t),
    "patina_scene_pick_nearest": (c_void_p, c_void_p, POINTER(Pick), c_void_p, c_void_p, POINTER(Picked)),
    "patina_frame_highlight": (c_void_p, c_void_p, c_void_p, c_float, c_void_p, c_size_t),
    "patina_frame_bake_shadows": (c_void_p, c_void_p),
    "patina_frame_read_shadows": (c_void_p, c_uint32, c_uint32, c_void_p, c_size_t),
    "patina_frame_save_shadows": (c_void_p, c_char_p),
    "patina_frame_load_shadows": (c_void_p, c_void_p, c_char_p),
    "patina_task_render": (c_void_p, c_void_p, POINTER(Read), c_uint32, POINTER(c_void_p)),
    "patina_task_refine": (c_void_p, c_void_p, c_double, POINTER(Read), c_uint32, POINTER(c_void_p)),
    "patina_task_build": (POINTER(CloudDesc), c_void_p, POINTER(c_void_p)),
    "patina_task_set_colors": (c_void_p, POINTER(Array), POINTER(c_void_p)),
    "patina_task_analyse": (c_void_p, POINTER(AnalysisDesc), c_void_p, POINTER(c_void_p)),
    "patina_task_apply": (c_void_p,),
    "patina_task_fingerprint": (POINTER(CloudDesc), c_void_p, POINTER(c_void_p)),
    "patina_task_grid_normals": (POINTER(GridDesc), c_void_p, c_void_p, POINTER(c_void_p)),
    "patina_task_open_file": (c_char_p, c_void_p, POINTER(c_void_p)),
    "patina_task_save": (c_void_p, c_char_p, POINTER(c_void_p)),
    "patina_task_add_to_build": (c_void_p, POINTER(CloudDesc), POINTER(c_void_p)),
    "patina_task_end_build": (c_void_p, c_void_p, POINTER(c_void_p)),
    "patina_task_analyse_file": (c_char_p, POINTER(AnalysisDesc), c_uint64, c_char_p, c_void_p, POINTER(c_void_p)),
    "patina_task_verify": (c_char_p, c_void_p, POINTER(c_void_p)),
    "patina_task_thin": (c_char_p, c_void_p, c_void_p, c_size_t, c_uint64, c_void_p, c_void_p, c_void_p, c_void_p, c_void_p,
                         POINTER(c_void_p)),
    "patina_task_done": (c_void_p,),
    "patina_task_wait": (c_void_p,),
    "patina_task_take_cloud": (c_void_p, POINTER(c_void_p)),
    "patina_task_take_file": (c_void_p, POINTER(c_void_p)),
    "patina_task_destroy": (c_void_p,),
}
RESULTS = {"patina_version": c_char_p, "patina_struct_size": c_size_t, "patina_error_text": c_char_p,
           "patina_message": c_size_t, "patina_log_next": c_size_t, "patina_progress_destroy": None,
           "patina_progress_cancel": None, "patina_progress_value": c_float, "patina_device_destroy": None,
           "patina_cloud_destroy": None, "patina_scene_destroy": None, "patina_frame_destroy": None,
           "patina_frame_cancel": None, "patina_frame_progress": c_float, "patina_builder_destroy": None,
           "patina_frame_stats_json": c_size_t, "patina_frame_plan_text": c_size_t, "patina_drawing_destroy": None,
           "patina_file_destroy": None, "patina_rows_destroy": None, "patina_mesh_destroy": None,
           "patina_texture_destroy": None, "patina_mask_destroy": None, "patina_grade_destroy": None,
           "patina_scans_destroy": None, "patina_field_destroy": None, "patina_task_destroy": None}

# effects.def: what Blender shows of each effect, and how
EFFECTS = (
    {"name": "edl", "label": "Eye-Dome Lighting", "panel": "CUES",
     "about": "What lies behind its neighbors on screen is darker: shape shows without light and normals",
     "fields": (
         {"name": "edl_strength", "kind": "NUMBER", "property": "edl_strength", "when": "STRENGTH", "label": "Strength",
          "about": "How dark edges and slopes become", "least": 0, "zero": 0, "unit": "NONE", "start": 1, "low": 0,
          "usual": 3, "high": 10},
         {"name": "edl_radius", "kind": "NUMBER", "property": "edl_radius", "when": "PART", "label": "Radius",
          "about": "How far away the neighbors lie that are compared", "least": 1, "zero": 1.4, "unit": "PIXELS",
          "start": 1.4, "low": 1, "usual": 16, "high": 16},
     )},
    {"name": "obscurance", "label": "Ambient Obscurance", "panel": "CUES",
     "about": "Folds and corners are darker, by what surrounds them",
     "fields": (
         {"name": "obscurance_strength", "kind": "NUMBER", "property": "obscurance_strength", "when": "STRENGTH",
          "label": "Strength", "about": "How dark folds and corners become", "least": 0, "zero": 0, "unit": "NONE",
          "start": 1, "low": 0, "usual": 3, "high": 10},
         {"name": "obscurance_radius", "kind": "NUMBER", "property": "obscurance_radius", "when": "PART", "label": "Radius",
          "about": "How far around a point others darken it, at most 32 pixels", "least": 0, "zero": 0, "unit": "LENGTH",
          "start": 0, "low": 0, "usual": 10, "high": 1e+30,
          "automatic": (0.1, "A fixed radius; else it is a 32nd of the clouds' diagonal")},
     )},
    {"name": "fog", "label": "Fog", "panel": "CUES",
     "about": "Points fade with their distance",
     "fields": (
         {"name": "fog_start", "kind": "NUMBER", "property": "fog_start", "when": "PART", "label": "Start",
          "about": "Distance from the camera at which fog begins", "least": -1e+30, "zero": 0, "unit": "LENGTH", "start": 5,
          "low": 0, "usual": 1e+30, "high": 1e+30},
         {"name": "fog_end", "kind": "NUMBER", "property": "fog_end", "when": "PART", "label": "End",
          "about": "Distance from the camera at which fog is as dense as it becomes", "least": -1e+30, "zero": 0,
          "unit": "LENGTH", "start": 25, "low": 0, "usual": 1e+30, "high": 1e+30},
         {"name": "fog_density", "kind": "NUMBER", "property": "fog_density", "when": "STRENGTH", "label": "Density",
          "about": "How much fog hides at its end and beyond", "least": 0, "zero": 0, "unit": "SHARE", "start": 1, "low": 0,
          "usual": 1, "high": 1},
         {"name": "fog_fixed", "kind": "SWITCH", "property": "fog_use_color", "when": "PART", "label": "Own Color",
          "about": "A color of its own; else points fade into the background"},
         {"name": "fog_color", "kind": "COLOR", "property": "fog_color", "when": "fog_fixed", "label": "Color",
          "about": "Color of the fog", "zero": 0, "unit": "COLOR", "start": (0.7, 0.75, 0.8), "low": 0, "usual": 1,
          "high": 1e+30},
     )},
    {"name": "toon", "label": "Toon", "panel": "DRAWING",
     "about": "Light goes in bands, with obscurance and eye-dome lighting; the points' own colors stay",
     "fields": (
         {"name": "toon_bands", "kind": "COUNT", "property": "toon_bands", "when": "STRENGTH", "label": "Bands",
          "about": "How many lights there are", "least": 2, "zero": 0, "unit": "NONE", "start": 3, "low": 2, "usual": 16,
          "high": 16},
         {"name": "toon_softness", "kind": "NUMBER", "property": "toon_softness", "when": "PART", "label": "Softness",
          "about": "Share of a band that its edge takes", "least": 0, "zero": 0, "unit": "SHARE", "start": 0.15, "low": 0,
          "usual": 1, "high": 1},
     )},
    {"name": "hatch", "label": "Hatching", "panel": "DRAWING",
     "about": "Strokes that follow the surface, wider where the picture is darker",
     "fields": (
         {"name": "hatch_levels", "kind": "COUNT", "property": "hatch_levels", "when": "STRENGTH", "label": "Directions",
          "about": "Strokes in so many directions, each from darker tones on", "least": 1, "zero": 0, "unit": "NONE",
          "start": 2, "low": 1, "usual": 3, "high": 3},
         {"name": "hatch_spacing", "kind": "NUMBER", "property": "hatch_spacing", "when": "PART", "label": "Spacing",
          "about": "Distance of two strokes on screen", "least": 3, "zero": 6, "unit": "PIXELS", "start": 6, "low": 3,
          "usual": 40, "high": 1000},
         {"name": "hatch_color", "kind": "COLOR", "property": "hatch_color", "when": "PART", "label": "Ink",
          "about": "Color of the strokes", "zero": 0, "unit": "COLOR", "start": (0.01, 0.01, 0.012), "low": 0, "usual": 1,
          "high": 1e+30},
         {"name": "hatch_opacity", "kind": "NUMBER", "property": "hatch_opacity", "when": "PART", "label": "Opacity",
          "about": "How much the ink hides", "least": 0, "zero": 1, "unit": "SHARE", "start": 1, "low": 0.01, "usual": 1,
          "high": 1},
         {"name": "hatch_ground", "kind": "NUMBER", "property": "hatch_ground", "when": "PART", "label": "White Ground",
          "about": "How far the points' colors give way to white beneath the strokes", "least": 0, "zero": 0,
          "unit": "SHARE", "start": 0, "low": 0, "usual": 1, "high": 1},
     )},
    {"name": "contour", "label": "Contour Lines", "panel": "DRAWING",
     "about": "Lines of equal height, as on maps, equally wide on screen whatever the slope",
     "fields": (
         {"name": "contour_source", "kind": "CHOICE", "property": "contour_source", "when": "PART", "label": "Along",
          "about": "What is equal on a line",
          "items": (("HEIGHT", "Height", "The world's height"), ("PLANE", "Distance from a Plane", "The distance from a plane through the world's origin"), ("ATTRIBUTE", "Attribute", "An attribute of the points: the ramp's, or what their Color panel names"))},
         {"name": "contour_axis", "kind": "AXIS", "property": "contour_axis", "when": "contour_source=PLANE",
          "label": "Plane's Normal", "about": "What the plane stands across"},
         {"name": "contour_start", "kind": "NUMBER", "property": "contour_start", "when": "PART", "label": "Start",
          "about": "Height, or distance, of one of the bold lines, from which the others are counted",
          "least": -1000000000000.0, "zero": 0, "unit": "HEIGHT", "start": 0, "low": -1e+30, "usual": 1e+30, "high": 1e+30},
         {"name": "contour_interval", "kind": "NUMBER", "property": "contour_interval", "when": "PART", "label": "Interval",
          "about": "From one line to the next in height", "least": 1e-09, "zero": 0, "unit": "LENGTH", "start": 0, "low": 0,
          "usual": 100, "high": 1000000000.0,
          "automatic": (1, "A fixed interval; else it is a round number that makes 10 to 25 lines of all clouds")},
         {"name": "contour_width", "kind": "NUMBER", "property": "contour_width", "when": "PART", "label": "Width",
          "about": "Of a line on screen", "least": 0.1, "zero": 1, "unit": "PIXELS", "start": 1, "low": 0.1, "usual": 10,
          "high": 100},
         {"name": "contour_every", "kind": "COUNT", "property": "contour_every", "when": "PART", "label": "Bold Every",
          "about": "One line of so many is bold; 1: none is", "least": 1, "zero": 5, "unit": "NONE", "start": 5, "low": 1,
          "usual": 20, "high": 1000},
         {"name": "contour_bold", "kind": "NUMBER", "property": "contour_bold", "when": "PART", "label": "Bold Width",
          "about": "Of a bold line on screen", "least": 0.1, "zero": 2, "unit": "PIXELS", "start": 2, "low": 0.1,
          "usual": 10, "high": 100},
         {"name": "contour_color", "kind": "COLOR", "property": "contour_color", "when": "PART", "label": "Ink",
          "about": "Color of the lines", "zero": 0, "unit": "COLOR", "start": (0.09, 0.03, 0.01), "low": 0, "usual": 1,
          "high": 1e+30},
         {"name": "contour_opacity", "kind": "NUMBER", "property": "contour_opacity", "when": "STRENGTH",
          "label": "Opacity", "about": "How much a line hides", "least": 0, "zero": 0, "unit": "SHARE", "start": 1,
          "low": 0.01, "usual": 1, "high": 1},
     )},
    {"name": "focus", "label": "Depth of Field", "panel": "CAMERA",
     "about": "",
     "fields": (
         {"name": "focus_aperture", "kind": "NUMBER", "property": "focus_aperture", "when": "STRENGTH", "label": "Aperture",
          "about": "Diameter of the lens: focal length / f-number", "least": 0, "zero": 0, "unit": "LENGTH", "start": 0,
          "low": 0, "usual": 1e+30, "high": 1e+30},
         {"name": "focus_distance", "kind": "NUMBER", "property": "focus_distance", "when": "PART", "label": "Distance",
          "about": "What is sharp, along the view", "least": 0, "zero": 0, "unit": "LENGTH", "start": 0, "low": 0,
          "usual": 1e+30, "high": 1e+30},
     )},
    {"name": "paper", "label": "Paper", "panel": "DRAWING",
     "about": "The whole picture is tinted and grained as if it were on paper",
     "fields": (
         {"name": "paper_color", "kind": "COLOR", "property": "paper_color", "when": "STRENGTH", "label": "Tint",
          "about": "Color of the paper", "zero": 1, "unit": "COLOR", "start": (0.93, 0.88, 0.78), "low": 0, "usual": 1,
          "high": 1},
         {"name": "paper_grain", "kind": "NUMBER", "property": "paper_grain", "when": "STRENGTH", "label": "Grain",
          "about": "How uneven the paper is", "least": 0, "zero": 0, "unit": "SHARE", "start": 0.15, "low": 0, "usual": 1,
          "high": 1},
     )},
)
OWN_EFFECTS = tuple(effect for effect in EFFECTS if effect["panel"] != "CAMERA")  # not the camera's
