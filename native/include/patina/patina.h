// SPDX-License-Identifier: GPL-3.0-or-later
// Patina: image-space rendering of point clouds. This header is the manual.
//
// A program describes a scene (clouds, lights, a camera, settings), renders it into a frame on a device, and reads passes (images of one
// kind of floats) out of the frame:
//
//     patina_device *device; patina_device_create(NULL, &device);
//     patina_cloud *cloud;   patina_cloud_load("statue.ply", NULL, &cloud);
//     patina_scene *scene;   patina_scene_create(&scene);
//     patina_scene_add_cloud(scene, cloud, NULL);
//     patina_camera camera = { .struct_size = sizeof camera };
//     patina_scene_frame_camera(scene, 30, 40, 0, &camera);
//     patina_scene_set_camera(scene, &camera);
//     patina_frame *frame;   patina_frame_create(device, &frame);
//     patina_frame_render(frame, scene);
//     patina_frame_read(frame, PATINA_PASS_COMBINED, rgba, sizeof rgba);
//
// Conventions
//   Handles are opaque; `*_create`, `*_open` and `*_load` give ownership, `*_destroy` takes it back and accepts NULL.
//   Functions return PATINA_OK (0) or a negative code; the sentence that says what and where is at the handle (patina_message), or at the
//   thread (patina_message(NULL)) when no handle came to be.
//   A descriptor's first field is struct_size = sizeof of it; every other field's zero means "default". Passing NULL for a descriptor means
//   all defaults. Inputs are copied before the call returns.
//   Where a descriptor has `exact`, 0 takes a colour of three zeros, and Phong factors of three zeros, for "default"; with 1 they are
//   black, and none. PATINA_*_INIT begins such a descriptor: exact, with every default spelled out.
//   Programs and libraries may be of different age. A descriptor that is shorter than the library's is taken as if the rest were zero; of a
//   longer one what the library does not know must be zero, else PATINA_ERROR_UNSUPPORTED. Structures that are handed out are filled as far
//   as they reach; what the library does not know becomes 0. struct_size must be a multiple of 8 from 16 to 65536, else
//   PATINA_ERROR_ARGUMENT. New fields stand at the end, and never in what was padding; fields neither move nor go.
//   Pictures are row-major float32, row 0 at the BOTTOM (as Blender's and OpenGL's), colour scene-linear and premultiplied. Matrices are
//   float64, row-major, column vectors: world = M * object.
//   View space is right-handed and looks down -z. "z" in passes is linear distance: to the camera plane in perspective, from the near plane
//   in orthographic views; +inf where nothing is.
//
// Threads: any handle may be used from any thread, one call at a time per handle; the exceptions, which may be called at any time from any
// thread, are patina_frame_cancel, patina_frame_progress, patina_progress_cancel, patina_progress_value, patina_task_done, patina_message
// and patina_log_next. A task counts as a call of the handles that it was given, from its start until it is done. Different handles are
// independent. A cloud may be in many scenes and frames at once. No frame may be rendering it while a call changes it
// (patina_cloud_set_colors, _set_scalars, _analyse, patina_task_apply) or destroys it.
#ifndef PATINA_H
#define PATINA_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#if defined(_WIN32) && defined(PATINA_BUILDS_LIBRARY)
#define PATINA_API __declspec(dllexport)
#elif defined(_WIN32)
#define PATINA_API
#else
#define PATINA_API __attribute__((visibility("default")))
#endif

// The version of Patina. build/version.py reads it here, compares all other places with it, and writes a new one to all of them.
// Before 1.0.0 a program needs a library of the same minor version. From then on it needs the same major version, and at least its own
// minor version.
#define PATINA_VERSION_MAJOR 1
#define PATINA_VERSION_MINOR 0
#define PATINA_VERSION_PATCH 0

// One list of errors. X(name, code, sentence)
#define PATINA_ERRORS(X)                                                                                                       \
    X(ERROR_ARGUMENT, -1, "an argument is out of range")                                                                       \
    X(ERROR_MEMORY, -2, "out of memory")                                                                                       \
    X(ERROR_FILE, -3, "the file cannot be opened, read or written")                                                            \
    X(ERROR_FORMAT, -4, "the file does not hold what its format promises")                                                     \
    X(ERROR_UNSUPPORTED, -5, "this build or machine cannot do that")                                                           \
    X(ERROR_DEVICE, -6, "the device failed or was lost")                                                                       \
    X(ERROR_CANCELLED, -7, "cancelled")                                                                                        \
    X(ERROR_TOO_MANY_POINTS, -8, "too many points for one cloud or picture")                                                   \
    X(ERROR_EMPTY, -9, "there is nothing to read")                                                                             \
    X(ERROR_INTERNAL, -10, "internal error")                                                                                   \
    X(ERROR_TOO_LARGE, -11, "the image is too large for the memory or the device: render it in smaller regions")

enum patina_error {
    PATINA_OK = 0,
#define PATINA_X(name, code, text) PATINA_##name = code,
    PATINA_ERRORS(PATINA_X)
#undef PATINA_X
};

typedef struct patina_device patina_device;
typedef struct patina_cloud patina_cloud;
typedef struct patina_mesh patina_mesh;
typedef struct patina_texture patina_texture;
typedef struct patina_mask patina_mask;
typedef struct patina_grade patina_grade;
typedef struct patina_field patina_field;
typedef struct patina_scans patina_scans;
typedef struct patina_scene patina_scene;
typedef struct patina_frame patina_frame;
typedef struct patina_file patina_file;
typedef struct patina_progress patina_progress;
typedef struct patina_task patina_task;

// ---- errors, log, version -------------------------------------------------------------------------------------

// Library version as MAJOR.MINOR.PATCH+1a2b3c4d5e6f, the last a sum of the sources; static storage.
PATINA_API const char *patina_version(void);
// Size in bytes of one of this interface's structures in the library, by its name: "patina_camera". 0: the library has none of that
// name, or name is NULL. A size smaller than the caller's: the library is older than the caller's header.
PATINA_API size_t patina_struct_size(const char *name);
// The general sentence of a code; static storage, never NULL.
PATINA_API const char *patina_error_text(int code);
// Copies the last message of a handle (any kind), or of the calling thread when handle is NULL, as UTF-8 into
// buffer (size bytes, always terminated). Returns the full length, 0 when there is none.
PATINA_API size_t patina_message(const void *handle, char *buffer, size_t size);
// Takes the oldest unread log line out of the process-wide ring (256 lines, oldest dropped). Returns its length, 0 when
// there is none. level: 0 error, 1 warning, 2 information.
PATINA_API size_t patina_log_next(char *buffer, size_t size, int *level);

// ---- progress of long calls that have no frame (loading, building a cloud) --------------------------------------

PATINA_API int patina_progress_create(patina_progress **out);
PATINA_API void patina_progress_destroy(patina_progress *progress);
PATINA_API void patina_progress_cancel(patina_progress *progress);       // the call returns PATINA_ERROR_CANCELLED soon
PATINA_API float patina_progress_value(const patina_progress *progress); // 0..1

// ---- device ----------------------------------------------------------------------------------------------------

typedef struct patina_device_desc {
    size_t struct_size;
    const char *name;    // "auto" (default), "cpu", "cpu-scalar", "gl-egl", "gl-osmesa"; CPU levels may be asked for
                         // by name too: "cpu-sse42", "cpu-avx2", "cpu-avx512", on ARM "cpu-neon"
    uint32_t threads;    // CPU worker threads; 0 = one per core available to the process
    uint32_t batch;      // scheduling batch (items a worker takes at once); 0 = automatic. Never changes a picture.
    uint64_t memory_cap; // bytes of planes that a frame may hold (about 100 a pixel, 150 in transparent scenes); 0 = no limit
    // Bytes that a picture holds at a time of clouds that patina_cloud_open maps. More is read in rounds and given back; no picture changes
    // by it. 0 = a third of the memory that is free when a picture begins; UINT64_MAX = no limit. OpenGL copies clouds whole if a given cap
    // and the graphics memory have room for them, else ranges of their points, as often as it needs them. PATINA_ERROR_MEMORY: a cap without
    // room for two ranges, some 300 KB.
    uint64_t mapped_cap;
} patina_device_desc;

typedef struct patina_device_info {
    size_t struct_size;
    char name[32];         // "cpu-avx512", "gl-egl", ...
    char description[192]; // processor or GL renderer and version
    uint32_t threads;
    uint32_t hardware; // 1 when a GPU does the work
    uint32_t key64;    // 1 when 64-bit atomics passed the self-test
} patina_device_info;

// Makes a device. "auto" takes GL on a hardware driver, else the CPU. A device that cannot be had is
// PATINA_ERROR_UNSUPPORTED with the reason; it is never silently replaced by another (auto excepted).
PATINA_API int patina_device_create(const patina_device_desc *desc, patina_device **out);
PATINA_API void patina_device_destroy(patina_device *device); // after its frames
PATINA_API int patina_device_get_info(const patina_device *device, patina_device_info *info);

// ---- cloud -----------------------------------------------------------------------------------------------------

enum patina_type { // element types of caller's arrays
    PATINA_NONE = 0,
    PATINA_FLOAT32 = 1,
    PATINA_FLOAT64 = 2,
    PATINA_UINT8 = 3,
    PATINA_UINT16 = 4,
    PATINA_UINT32 = 5,
    PATINA_INT8 = 6,
    PATINA_INT16 = 7,
    PATINA_INT32 = 8,
};

// A view of a caller's array: element i starts at data + i * stride; stride 0 = tightly packed.
typedef struct patina_array {
    const void *data;
    uint32_t type; // patina_type
    uint32_t components;
    uint64_t stride; // bytes
} patina_array;

typedef struct patina_cloud_desc {
    size_t struct_size;
    uint64_t count;
    patina_array position; // 3 x FLOAT32 or FLOAT64, in object units. NaN/Inf rows are left out (and counted)
    patina_array normal;   // 3 x FLOAT32/FLOAT64, any length; zero or NaN = that point has none. Optional
    patina_array color;    // 3 or 4 x UINT8/UINT16 (sRGB, 0..max) or FLOAT32 (linear). A 4th component is ignored. Optional.
                           // UINT8 stays 3 bytes a point at rest; the others become float32, 12 bytes, within +-65504
    patina_array opacity;  // 1 x UINT8/UINT16 (0..max) or FLOAT32/FLOAT64 (0..1, clamped; NaN = 1), times the instance's.
                           // Optional; kept in steps of 1/255, a byte a point
    patina_array scalar;   // 1 x any type: what a ramp colours (intensity, class, scan number ...). Optional; float32 at rest
    patina_array classes;  // 1 x UINT8: class of each point, as in LAS; style.hidden_classes hides some. Optional
    double origin[3];      // added to every position, in float64
    uint32_t threads;      // 0 = one per core
    patina_array radius;   // 1 x FLOAT32/FLOAT64, of the point's disc, object units; negative or NaN = 0. Optional; for
                           // PATINA_SURFACE_SPLATS. 4 bytes a point
} patina_cloud_desc;

typedef struct patina_cloud_info {
    size_t struct_size;
    uint64_t count; // points as given; ids are 0 .. count-1 in the given order
    uint64_t drawn; // of them with finite positions and opacity above 0
    uint64_t chunks;
    uint64_t bytes;                // anonymous memory held at rest
    double box_min[3], box_max[3]; // over the drawn points; an empty cloud has min > max
    double spacing;                // median over chunks of the local spacing (about 1/sqrt(points per area)), object units
    double spacing_min, spacing_max;
    uint64_t invalid_positions, invalid_normals, invalid_colors; // NaN/Inf (normals: or zero); the last two of drawn points
    uint32_t has_normals, has_colors, has_opacities;
    double origin[3];
    double layer_distance; // what d_min = 0 stands for at the median spacing, object units. Each chunk takes its own spacing's
    uint32_t has_radii;
    float radius_most; // of the points' own radii
    uint32_t has_scalars, has_classes;
    float scalar_range[2];      // least and greatest finite scalar; 0, 0 without one
    uint32_t class_bits[8];     // classes that drawn points have: class c is bit c % 32 of word c / 32
    uint32_t has_shapes;        // the cloud was analysed: patina_cloud_analyse
    uint32_t normals_oriented;  // 1: every normal knows its side, as given or by a station; PATINA_SIDES_VOTED: some by votes
    uint64_t estimated_normals; // of points whose normal the analysis found
    uint64_t kinds[6];          // drawn points of each patina_kind
    uint64_t seen_through;      // drawn points that some station saw through: patina_analysis_desc.free_space
    uint32_t packed;            // 1: of a file that was saved so: patina_save_desc.pack
    uint32_t numbered;          // 1: points are numbered as the file has them: patina_save_desc.drop_order
    double packed_error;        // how far packing moved a position at most, object units
    uint64_t trusts[16];        // drawn points of each level of trust, where analysed: level l stands for 1 - ((15 - l) / 15)^2
    double trust_default;       // least trust of points that are drawn by default: PATINA_TRUST_DEFAULT
    uint64_t uncolored; // drawn points without a color of their own, whose neighbors lent them one: patina_cloud_analyse
} patina_cloud_info;

// Builds a cloud: chunks of Morton neighbours, strata, boxes, normal cones, local spacing. At most 24 bytes a point
// at rest (position 12, id 4, colour 3, normal and spacing 4, opacity 1; a scalar 4 and a class 1 more), at most 16 more
// while building. At most 2147483647 points; patina_builder_begin takes more.
PATINA_API int patina_cloud_create(const patina_cloud_desc *desc, patina_progress *progress, patina_cloud **out);
PATINA_API void patina_cloud_destroy(patina_cloud *cloud);
// Gives a cloud other colours (as in the descriptor, count elements; NULL data: none) and leaves all else as it is, so
// that painting uploads colours alone. No frame may be rendering it meanwhile. Of an analysed cloud points without a color get their
// neighbors' again, as patina_cloud_analyse says.
PATINA_API int patina_cloud_set_colors(patina_cloud *cloud, const patina_array *color);
// The same for scalars.
PATINA_API int patina_cloud_set_scalars(patina_cloud *cloud, const patina_array *scalar);
// The scalars that `share` of the points lie below and above, 0 <= share < 0.5; 0: the least and the greatest finite ones.
// PATINA_ERROR_EMPTY without a finite scalar.
PATINA_API int patina_cloud_scalar_range(const patina_cloud *cloud, double share, float range[2]);
// The box of a cloud without strays: points outside of the box of 90 percent of them that have hardly another near. Of a
// cloud without any its own box; an empty cloud has min > max.
PATINA_API int patina_cloud_dense_box(const patina_cloud *cloud, double box_min[3], double box_max[3]);
// At most `room` of the drawn points, evenly chosen, for previews: all of them if there are no more. Of a saved cloud (patina_cloud_open) it
// reads the first strata of each chunk, little else. hidden: leaves points out, as in patina_mask_create, of `size` bytes; NULL and 0: none.
// Then it writes about `room` of the others. positions: 3 * room, object units. colors: 3 * room, linear; normals: 3 * room, unit, 0
// where a point has none; scalars: room. Each of these three may be NULL, and stays as it is if the cloud has none. *count: how many were
// written. Of a cloud in pages: of those that arrived, and PATINA_ERROR_UNSUPPORTED for hidden ones while some are on their way.
PATINA_API int patina_cloud_thin(const patina_cloud *cloud, const uint8_t *hidden, size_t size, uint64_t room, float *positions,
                                 float *colors, float *normals, float *scalars, uint64_t *count);
// What every point knows (SPEC 11), from its nearest neighbours among all points: normal, spacing, footprint, thickness, kind.
enum patina_kind {
    PATINA_KIND_UNKNOWN = 0, // not analysed, alone, or all neighbours at its own place
    PATINA_KIND_SURFACE = 1,
    PATINA_KIND_BORDER = 2, // of a surface: neighbours on one side only
    PATINA_KIND_LINE = 3,   // a wire, a railing's bar
    PATINA_KIND_VOLUME = 4, // foliage
    PATINA_KIND_STRAY = 5,  // far from what its neighbours are part of
};

// Where nothing tells the side of a surface, 64 views from outside vote for the one that is seen; sheets face up.
#define PATINA_SIDES_VOTED 2

// Numbers of patina_analysis_desc.trust_features: scene/analysis/trust_features.h lists them.
#define PATINA_TRUST_FEATURES 33
// By default points of less trust are not drawn: at most 1 % of the right samples of any scene for tuning have less. Where 0.05 % of a cloud's
// points have less, its default is raised, to PATINA_TRUST_MOST at most, while at most 1 % of those that are probably right have less.
#define PATINA_TRUST_DEFAULT 0.64f
#define PATINA_TRUST_MOST 0.84f

typedef struct patina_analysis_desc {
    size_t struct_size;
    uint32_t neighbours;    // 3..64; 0 = 16, and 48 where 16 leave doubts
    uint32_t threads;       // 0 = one per core
    uint32_t keep_normals;  // 1 = only missing normals are estimated. 0 = all are, on the side of those that the cloud has
    uint32_t station_count; // places of the scanner, in object units: estimated normals face the one that ...
    const double *stations; // 3 each
    patina_array station;   // ... 1 x UINT8/UINT16 names for each point, count elements; without it, the nearest. Optional
    // 1 = points that a station, not their own, saw through are marked: its samples around the direction to the point lie farther. Needs
    // stations and station. Meanwhile 4 bytes for each direction of a station, 128 MiB at most; what all saw, 64 MiB at most, stays.
    uint32_t free_space;
    // Of each point in its scan's grid, 1 x UINT16/UINT32/INT32, count elements: footprints and free space take from them how far apart
    // directions are. Optional: else found from how dense directions are.
    patina_array row, column;
    uint32_t grid; // 1 = neighbours in its scan's grid, and not those in space alone, tell a point's normal and footprint, and
                   // that a surface ends where depth steps behind it or nothing came back. Needs row and column, and
                   // for each scan where it was taken from: stations, or directions. 16 bytes a point and 4 a
                   // cell meanwhile. Points that lie in no cell, or in one with another point, are as without it
    patina_array scan;        // with grid: each point's scan, 1 x UINT8/UINT16. Optional: else as station says, or one for all
    uint32_t direction_count; // with grid, of scans whose beams are parallel, and whose place nobody knows: ...
    const double *directions; // ... in which each looked, 3 each, any length; 0 0 0: it has a station
    // NULL, or PATINA_TRUST_FEATURES numbers of each of `count` points in the given order, to train trust with; 0 of points that are not
    // drawn. For patina_cloud_analyse.
    float *trust_features;
    // 1 = points without a color stay black. 0 = points among colored ones that are exactly black, or whose color was not finite, get the
    // mean of their trusted colored neighbors (SPEC 11).
    uint32_t keep_colors;
} patina_analysis_desc;

// The second change that a cloud allows: gives points normals, spacings of their own, and footprints, so that what closes
// a picture follows from them (8 bytes a point, 4 of them new, 20 more meanwhile). No frame may be rendering it meanwhile. desc may be
// NULL. On failure or cancel the cloud stays as it was. Any number of threads gives the same bytes.
PATINA_API int patina_cloud_analyse(patina_cloud *cloud, const patina_analysis_desc *desc, patina_progress *progress);

// Arrays of the caller's, patina_cloud_info.count elements in the given order; NULL = not wanted. Points that are not drawn read 0. Those
// of the first group are as the analysis left them, in steps of what 8 bytes hold; without one, 0 but for what the cloud was given.
typedef struct patina_neighbourhoods {
    size_t struct_size;
    float *normal;         // 3 each; 0 = none
    float *axis;           // 3 each: direction of the greater half axis; 0 without a normal
    float *spacing;        // about 1 / sqrt(points per area) where the point lies
    float *half_axes;      // 2 each, of its footprint, the greater first
    float *sigma;          // thickness: noise, and disagreement of scans; 0 = unknown
    uint8_t *kind;         // patina_kind
    float *trust;          // 0..1: the probability that the point is not a wrong sample (a mixed pixel, a stray)
    uint8_t *seen_through; // 1: by some station, see patina_analysis_desc.free_space
    // From the `neighbours` nearest, walked anew for any cloud.
    uint32_t neighbours; // 1..64
    uint32_t threads;    // 0 = one per core
    uint32_t *numbers;   // `neighbours` each: of the points, nearest first, equal distances by number; 2^32 - 1 = there is none
    double *distances;   // likewise; +inf
    float *soft_radius;  // [S Eq. 20], with the farthest distance outside the root
    float *uncertainty;  // [S Eq. 21], in parts of its 99th percentile, at most 1. From the cloud's normals
} patina_neighbourhoods;

PATINA_API int patina_cloud_neighbourhoods(const patina_cloud *cloud, const patina_neighbourhoods *wanted,
                                           patina_progress *progress);

// Writes the built cloud to a file, and opens it again by mapping: nothing is read but what is drawn, and the memory stays
// the file's. A file of another version or machine, or a damaged one, is PATINA_ERROR_FORMAT: build the cloud anew. While a
// cloud is open its file may be replaced (patina_cloud_save does), not written into. A cloud of a file with damaged pages is not saved
// (PATINA_ERROR_FORMAT, which names them): they would pass as good. patina_cloud_save_as makes it smaller.
PATINA_API int patina_cloud_save(const patina_cloud *cloud, const char *path);
// A file may hold any number of points. One of more than 2147483647 slots (points, and padding of chunks) is drawn, told of, saved, masked,
// graded, and given colours and scalars like any; patina_cloud_analyse, patina_cloud_neighbourhoods, scans and fields refuse it
// (PATINA_ERROR_TOO_MANY_POINTS) and change nothing.
PATINA_API int patina_cloud_open(const char *path, patina_cloud **out);
// The same, with an offset (3 numbers of at most 1e30) added to every position, in float64. No point is read or written for it.
PATINA_API int patina_cloud_open_at(const char *path, const double *offset, patina_cloud **out);
// Reads a saved cloud whole and compares the sum of each of its sections with that of the writing, which opening leaves out but
// for the chunks: PATINA_ERROR_FORMAT where any differs. progress: may be NULL; stops it too. Any thread, open clouds or not.
PATINA_API int patina_cloud_verify(const char *path, patina_progress *progress);
PATINA_API int patina_cloud_get_info(const patina_cloud *cloud, patina_cloud_info *info);

// ---- scene -----------------------------------------------------------------------------------------------------

enum patina_lighting { PATINA_LIGHTING_AUTO = 0, PATINA_LIGHTING_UNLIT = 1, PATINA_LIGHTING_LIT = 2 };
// AUTO: clouds shown in colours of their own are unlit (these hold the light of the day of the scan), others lit.

// Where the colour of points comes from. From SCALAR on: a ramp over the point's scalar, the world's z, the object's z, the distance
// to the camera (its plane, in orthographic views) of the surface that a pixel shows, or the point's trust. Points of a cloud that was
// not analysed have no trust: they take style.color.
enum patina_color_source {
    PATINA_COLOR_OWN = 0, // the point's; where the cloud has none, style.color
    PATINA_COLOR_FIXED = 1,
    PATINA_COLOR_SCALAR = 2,
    PATINA_COLOR_HEIGHT = 3,
    PATINA_COLOR_OBJECT_HEIGHT = 4,
    PATINA_COLOR_DISTANCE = 5,
    PATINA_COLOR_TRUST = 6
};
#define PATINA_MAX_RAMP 256
// A ramp by name: grey, viridis, heat, spectrum, relief, diverging; classes: of LAS classes, for a range of 0 to 255.
PATINA_API int patina_ramp(const char *name, float colors[PATINA_MAX_RAMP][3]);

// Of points that a station saw through, and of surface that was closed between points where one looked through. SHOW: magenta in
// place of their own colour (with color_source OWN). USE: the points are not drawn and cast no shadow; what was closed is open again
// and shows what lies behind, which takes such a picture twice the time (light maps, and pictures of several layers, close it all the same).
enum patina_free_space { PATINA_FREE_SPACE_OFF = 0, PATINA_FREE_SPACE_SHOW = 1, PATINA_FREE_SPACE_USE = 2 };

// What points are. ALL: every one is a ball of density, drawn in the order of depth with those of all soft clouds, over what is opaque
// and behind it, hidden by what is opaque before it. Keys, depth, picks, lines and other passes tell of the rest of the scene. Soft
// points take shadows, and cast them as dark as what they let through up to each point. FIELD: so are points whose field is above
// soft_threshold; the others are as with OFF. HIDDEN: points whose field is above soft_threshold are not drawn and cast no shadow; the others
// are as with OFF.
enum patina_soft { PATINA_SOFT_OFF = 0, PATINA_SOFT_ALL = 1, PATINA_SOFT_FIELD = 2, PATINA_SOFT_HIDDEN = 3 };
// BASE: the density along the ray, exactly, through balls that intersect. CONCENTRIC: by shells of even density, which come to BASE as
// they grow many. EXPRESS: a disc a ball, ten times faster. For comparison, as in the paper: SPLATS: the nearest discs alone, opaque;
// ONE_LAYER: the same, with their opacities: nothing of what is soft behind them shows. Both cast and take shadows as EXPRESS.
enum patina_soft_model {
    PATINA_SOFT_BASE = 0,
    PATINA_SOFT_CONCENTRIC = 1,
    PATINA_SOFT_EXPRESS = 2,
    PATINA_SOFT_SPLATS = 3,
    PATINA_SOFT_ONE_LAYER = 4
};

// What a cloud leaves out of shadows [D 6].
enum patina_shadow_off { PATINA_SHADOW_NO_CAST = 1, PATINA_SHADOW_NO_RECEIVE = 2, PATINA_SHADOW_NO_SELF = 4 };

typedef struct patina_cloud_style {
    size_t struct_size;
    double world_from_object[16]; // all zero = identity. Mirrored, non-uniform, singular: all allowed
    uint32_t lighting;            // patina_lighting
    uint32_t cull_back;           // 1 = points that face away are not drawn; ignored without normals, and of transparent clouds
    float d_min;                  // the paper's d~, world units: least distance of two layers; 0 = automatic
    float color[3];               // linear; colour of points without one. All zero = (0.8, 0.8, 0.8), unless exact
    float ambient, diffuse, specular; // Phong factors; all three zero = 1, 1, 0
    uint32_t shininess;               // Phong exponent; 0 = 32
    // Share of light that a surface lets through, 0..1; 0 = opaque, 1 = not drawn. Opacity is 1 - transparency, times the point's own
    // [D 5]. Its shadow is lighter by it once, however many of its surfaces stand in the way; with opacities of points, by up to 8 of them.
    float transparency;
    uint32_t shadow_off; // bits of patina_shadow_off; 0 = casts shadows, receives them, and shadows itself
    float radius; // of every point's disc, world units, for SURFACE_SPLATS; 0 = the point's own, else 1.75 local spacings
    uint32_t color_source;      // patina_color_source
    const float *ramp;          // ramp_count x 3, linear; copied. Evenly spaced over the range, straight between, even
                                // beyond. NULL = from black to white. A scalar that is NaN takes `color`
    uint32_t ramp_count;        // 2..PATINA_MAX_RAMP
    float ramp_range[2];        // values at its ends; equal = automatic: least and greatest value of the cloud's points,
                                // for heights and distances of its chunks' boxes, for trust 0 and 1
    float exposure;             // stops, -32..32; on the colour, before light
    float contrast;             // 0..16: slope in stops around mid grey (0.18), after exposure; 0 = 1
    uint32_t hidden_classes[8]; // bits as in patina_cloud_info.class_bits: points that are not drawn and cast no shadow
    uint32_t clip_off;          // 1 = clips leave this cloud whole
    // Of clouds that were analysed; nothing for others:
    uint32_t free_space;   // patina_free_space: what becomes of what a station saw through
    uint32_t hidden_kinds; // bits 1 << patina_kind: points that are not drawn and cast no shadow
    float least_trust;     // points of less trust are not drawn and cast no shadow; 0 = the cloud's own default, negative = all
                           // are drawn. Where no point has as much, all are drawn, too: patina_frame_stats.none_trusted
    float largest_gap;     // world units; no disc is wider, whatever its radius; 0 = as wide as it is
    // Of this cloud: points that it hides are not drawn and cast no shadow. NULL = none. Like the cloud, mask and grade must outlive the
    // scene or the next patina_scene_clear.
    const patina_mask *mask;
    const patina_grade *grade; // of this cloud: its colours in place of the cloud's own. NULL = none
    uint32_t exact;            // 1 = black is black, and three Phong factors of 0 are none
    uint32_t was_padding;      // says nothing
    // Of soft points [Seemann et al.], SPEC 5; nothing for others:
    uint32_t soft;         // patina_soft
    uint32_t soft_model;   // patina_soft_model; the same of all soft clouds of a scene, as soft_shells is
    uint32_t soft_shells;  // CONCENTRIC: of every ball, 1..64; 0 = as many as its size on screen asks for
    float soft_radius;     // of every ball, world units; 0 = the point's own radius, else 1.13 times its spacing, as [S Eq. 20]
                           // has it of even points: a point without neighbours is not seen then
    float soft_opacity;    // of a ball through its centre, 0..1, times the cloud's and the point's opacity; 0 = 0.5
    float soft_modulation; // 0..1, from the model's own opacity (0) to one that falls evenly from a ball's centre to its rim,
                           // so that single points show (1); 1 - W of [S Eq. 22].
                           // FIELD: l_m - t of it: such a share of the field's range above the threshold leads from that
                           // opacity to the model's own; 0 = none of it
    const patina_field *field; // of this cloud, for FIELD and HIDDEN. It must outlive what the mask must
    float soft_threshold;      // FIELD, HIDDEN: 0..1; points with more are soft, or hidden
    float soft_unused;         // says nothing
    // Of points as range images [Kawata & Kanai], SPEC 6; nothing for others:
    const patina_scans *scans; // of this cloud: the scans that it was made of. NULL = one. It must outlive what the mask must
    uint32_t surface;          // patina_surface: 0 = as in the settings, RANGES = this cloud as range images whatever they say
    // gamma, object units: points so far behind the nearest in their pixel of the image buffer are one surface with it, as scans that
    // do not quite fit. Such pixels beside each other are joined up to that step, or four of their widths. 0 = automatic: twice the
    // interval of the samples, as the scans or else the spacings say, or two widths.
    float range_gamma;
    // Of the image buffer's pixels: 1..64 pixels of the picture. 0 = automatic: as wide as two samples lie apart, 1..32.
    float range_pixel;
    // 0 = one pass; else 0.5..0.95: a second, whose pixels are so much finer, shows where the first is not sharp: at outlines, where many
    // points share a pixel, where a surface is grazed. [K II.E] has 0.66 to 0.83.
    float range_sharpness;
    // 0 = none; else radians, up to pi: of the first 1024 scans those are left out whole whose direction is at a greater angle to that
    // from the eye to the middle of the cloud's box.
    float range_cull;
    uint32_t range_unused; // says nothing
} patina_cloud_style;
#define PATINA_CLOUD_STYLE_INIT                                                                                                \
    {                                                                                                                          \
        .struct_size = sizeof(patina_cloud_style), .color = {0.8f, 0.8f, 0.8f}, .ambient = 1.0f, .diffuse = 1.0f,              \
        .shininess = 32, .contrast = 1.0f, .exact = 1                                                                          \
    }

enum patina_clip_shape { PATINA_CLIP_BOX = 0, PATINA_CLIP_PLANE = 1 };

// A box (-1..1 along each of its axes) or a plane that cuts clouds. A point is kept when it lies in one of the boxes that
// keep, if there are any, in no box that cuts, and on the right side of every plane.
typedef struct patina_clip {
    size_t struct_size;
    double world_from_clip[16]; // all zero = identity. Mirrored, non-uniform: allowed. A flat box holds no points; a plane
                                // needs its x and y axes, or it cuts nothing
    uint32_t shape;             // patina_clip_shape
    uint32_t cut;               // 0 = keeps what is inside, of a plane its z <= 0; 1 = cuts that out
    float tint[3];              // linear; colour of the surface near the cut
    float tint_strength;        // 0..1; 0 = not tinted
    float tint_width;           // how far from the cut, world units
} patina_clip;

enum patina_light_type { PATINA_LIGHT_SUN = 1, PATINA_LIGHT_POINT = 2, PATINA_LIGHT_SPOT = 3, PATINA_LIGHT_AREA = 4 };
enum patina_area_shape { PATINA_AREA_RECTANGLE = 0, PATINA_AREA_ELLIPSE = 1 };

typedef struct patina_light_desc {
    size_t struct_size;
    uint32_t type;
    float color[3];      // linear; all zero = white
    float power;         // sun: irradiance W/m2; others: radiant power W, of spots as if they shone all around. As in Blender
    double position[3];  // world, all but suns; area: its middle
    double direction[3]; // world, sun, spot, area: the way the light travels; zero = (0,0,-1)
    double side[3];      // world, area: along its width; zero = any. Made perpendicular to direction
    float angle;         // sun: radians that its disc spans, 0..pi; 0 = sharp shadows
    float radius;        // point, spot: of the ball that shines; 0 = sharp shadows. Changes nothing but shadows
    float size[2];       // area: width along side, and height; 0 = 1
    uint32_t shape;      // area: patina_area_shape
    float cone;          // spot: radians between opposite edges, 0..pi; 0 = pi/4
    float blend;         // spot: share of the cone over which the edge fades, 0..1
    uint32_t shadows;    // 1 = casts shadows
} patina_light_desc;

typedef struct patina_camera {
    size_t struct_size;
    uint32_t orthographic;
    double world_from_camera[16];    // columns are normalised; a scaled camera is allowed
    double left, right, bottom, top; // window at distance 1 (perspective) or in world units (orthographic)
    double near_clip, far_clip;      // distances along the view; orthographic near may be negative
    uint32_t
        panorama_face; // 1 = a face of a panorama, as patina_panorama_camera sets it: eye-dome lighting compares distances from the
                       // eye in place of depths along the view, so that the cube's edges do not show
    uint32_t camera_unused; // says nothing
} patina_camera;

enum patina_quality { PATINA_QUALITY_REFINED = 0, PATINA_QUALITY_PAPER = 1 }; // filled depth: tangent plane | source's
enum patina_fill { PATINA_FILL_CLOSED = 0, PATINA_FILL_PAPER = 1, PATINA_FILL_OFF = 2 };
// How points become a surface. AUTO: of clouds that were analysed, points whose footprint is wider than a pixel or two are discs,
// as wide as it, the others are filled; where fill is not CLOSED, and of clouds that were not, all are filled. FILL: image-space filling,
// as quality and fill say. SPLATS: each point is a flat disc across its normal (without one: across the view), discs within a layer
// distance of the nearest one are blended; quality, fill, their iterations and error_target say nothing then. Light maps are filled always.
// RANGES: points are merged in a coarser picture, the image buffer, and its pixels joined into faces, whose normals follow from them, as
// the style's `range_` fields say; no normals, no analysis and no filling are needed, and scans that do not quite fit are one surface.
// For clouds whose style has surface RANGES alone, too.
enum patina_surface { PATINA_SURFACE_AUTO = 0, PATINA_SURFACE_SPLATS = 1, PATINA_SURFACE_FILL = 2, PATINA_SURFACE_RANGES = 3 };
// What the depth pass tells of a pixel with points. POINT: z of the nearest point in it, wherever in the pixel that lies: as the
// keys. SURFACE: z of that point's surface in the middle of the pixel; where surface is SPLATS, the mean of the discs there: of noisy
// points the nearest lies in front. Meshes are exact either way.
enum patina_depth { PATINA_DEPTH_POINT = 0, PATINA_DEPTH_SURFACE = 1 };
enum patina_smooth { PATINA_SMOOTH_ALLEVIATED = 0, PATINA_SMOOTH_GAUSSIAN = 1, PATINA_SMOOTH_BOX = 2, PATINA_SMOOTH_OFF = 3 };
enum patina_antialias { PATINA_ANTIALIAS_LAYERS = 0, PATINA_ANTIALIAS_BACKGROUND = 1, PATINA_ANTIALIAS_OFF = 2 };

typedef struct patina_settings {
    size_t struct_size;
    uint32_t width, height;    // full picture; 0 = 1024
    uint32_t region[4];        // x0, y0, x1, y1 in pixels (from bottom left): render only this crop; all zero = whole
    uint32_t quality;          // patina_quality
    uint32_t fill;             // patina_fill
    uint32_t fill_iterations;  // 0 = automatic (closed: follows the spacing on screen; paper: 1)
    uint32_t smooth;           // patina_smooth
    uint32_t antialias;        // patina_antialias
    uint32_t film_transparent; // 1 = background has alpha 0
    float world_color[3];      // linear; background and ambient light
    uint32_t passes;           // bits 1 << PATINA_PASS_*: passes to make beside the combined one; 0 = all
    uint32_t layers;           // at most so many layers of surface are peeled and blended, up to PATINA_MAX_LAYERS;
                               // 0 = 8. One is enough where everything in view is opaque; else peeling ends when a
                               // layer is empty or less than 1/512 of the light comes through. Paper [D 4, 5]
    uint32_t layer_passes;     // bits 1 << PATINA_PASS_COMBINED, _DEPTH, _NORMAL: kept of every layer for
                               // patina_frame_read_layer; layers are then peeled behind opaque surfaces too. 0 = none
    float error_target; // > 0: chooses the cheapest quality and fill with this expected colour error, or the best; 0 = as set
    uint32_t strata;    // 1..6: draw only every 32nd, 16th, .. 1st point of each chunk, rounded up to 16 points:
                        // a quick picture while navigating, filling closes the gaps. 0 = all
    // Shadow textures [D 6], of lights that cast: for every point and light the share of the light that arrives.
    uint32_t shadow_samples;     // of a light's area, 1..4096; 0 = 1: its middle; with shadow_error at most so many, 0 = 256
    uint32_t shadow_resolution;  // most texels on a side of a light's map; 0 = 4096. Fewer where the points lie wider
    uint32_t shadow_lazy;        // 1 = only points that the picture shows are tested, and the next frame tests anew: for
                                 // final pictures. 0 = whole textures, kept until something that they depend on changes
    uint32_t shadow_progressive; // 1 = one sample after a change, and every further render of the frame doubles them up to
                                 // shadow_samples (stats: shadow_pending); not with shadow_lazy. Where whole textures would
                                 // take more than a gigabyte, of points that the picture shows alone, for each view anew
    // > 0: a light's samples double until their expected error is at most this share of its light. Expected from what the last doubling
    // changed, root mean square over points in the penumbra; borders, a spacing wide, are off more. Whole textures, with shadow_lazy too. 0 = off.
    float shadow_error;
    uint32_t own_background; // 1 = background lies behind the points, and world_color only lights them
    float background[3];     // linear, with own_background; not where the film is transparent
    uint32_t surface;        // patina_surface
    uint32_t shadow_uncut;   // 1 = what clips cut away still casts shadows
    // Of a picture at rest, 1..4096; 0 = 1, with pixel_noise at most so many, 0 = 256. The colour is the mean of about so many samples a
    // pixel: of finer pixels where that is truer, of shifted pictures for the rest, each smoothed and anti-aliased as set (truest with
    // antialias on). Other passes and keys are those of one sample. Above 1 shadow textures are whole, in spite of shadow_lazy, and of
    // shadow_progressive without pixel_progressive.
    uint32_t pixel_samples;
    uint32_t depth;          // patina_depth
    uint32_t world_directed; // 1 = ambient light differs by direction: world_light, not world_color, which stays the background
    float world_light[3][9]; // with world_directed, of red, green, blue: the irradiance over pi of a surface with the normal n
                             // (unit, world) as weights of 1, x, y, z, xy, yz, zx, x^2 - y^2, 3 z^2 - 1; below 0 it counts as 0
    uint32_t pixel_progressive; // 1 = patina_frame_render makes the picture of one sample, and each patina_frame_refine betters
                                // it. What comes in the end is the same to the bit
    float pixel_noise; // > 0: samples end once stats.pixel_error is at most this; of a region by its own pixels. Asked at
                       // certain numbers of samples, which neither threads nor steps change. 0 = pixel_samples as set
    // 1 = pixels of filled clouds show the mean of the points about their surface, weighted by how near the pixel's middle each fell, not
    // the nearest point: colours, and normals where points have them. Truer where several points fall into a pixel, steadier in motion.
    // Not where colours come from a ramp or points have opacities of their own; discs show means either way.
    uint32_t average;
    // > 0: of clouds whose files hold them in levels, finer levels are left out where points of the next coarser one lie at most so many
    // pixels apart: for quick pictures before the exact one. Not of what discs alone or range images show. 0 = all points.
    float detail;
} patina_settings;

#define PATINA_MAX_LAYERS 16

// Of the choices among the fields of effects.
enum patina_effect_choice {
    PATINA_NO_CHOICE = 0,
#define PATINA_EFFECT_ITEM(constant, value, ...) PATINA_##constant = value,
#include "effects.def"
};

// Effects in image space, on the colours of every layer: effects.def lists them, with what each field may be, what its zero stands for
// and its unit. Zero leaves an effect out. Lengths in pixels are those of the picture, lengths along the view are those from the camera.
typedef struct patina_effects {
    size_t struct_size;
    uint32_t exact; // 1 = black paper is black
#define PATINA_EFFECT_NUMBER(field, ...) float field;
#define PATINA_EFFECT_COUNT(field, ...) uint32_t field;
#define PATINA_EFFECT_COLOR(field, ...) float field[3];
#define PATINA_EFFECT_AXIS(field, ...) float field[3];
#define PATINA_EFFECT_SWITCH(field, ...) uint32_t field;
#define PATINA_EFFECT_CHOICE(field, ...) uint32_t field;
#include "effects.def"
} patina_effects;
// No effect. Zero is what effects.def says it stands for, but of colours, which exact makes black.
#define PATINA_EFFECTS_INIT                                                                                                    \
    {                                                                                                                          \
        .struct_size = sizeof(patina_effects), .exact = 1, .paper_color = { 1.0f, 1.0f, 1.0f }                                 \
    }

enum patina_line_source { PATINA_LINE_FIXED = 0, PATINA_LINE_POINT = 1, PATINA_LINE_DEPTH = 2 };
enum patina_line_surface { PATINA_LINE_SURFACE_SHOWN = 0, PATINA_LINE_SURFACE_PAPER = 1, PATINA_LINE_SURFACE_NONE = 2 };

// Silhouettes [Xu 2004]: a line outside every outline, on whatever lies behind it, as if each point were drawn first as an opaque
// disc, larger by the width and pushed back by the offset. A line pixel has the depth of the outline. It needs no normals; with
// them smooth surfaces show none, however oblique. Where layers are peeled each has its lines.
typedef struct patina_lines {
    size_t struct_size;
    float width;        // pixels, 0..16; 0 = 2. In world units with `world`: as wide on screen as that is there, at most 16
    uint32_t world;     // 1 = width in world units, above 0
    float offset;       // world units: least step in depth that makes a line, more by 1 / |n.v| on oblique surfaces. Small ones
                        // draw creases too. 0 = automatic: that which makes two layers (d_min, twice the local spacing, ..)
    uint32_t source;    // patina_line_source: `color`; that of the outline's own points (of meshes white), times `color`; from
                        // `color` near to `far_color` far
    float color[3];     // linear; all zero = black, of POINT a quarter unless exact
    float far_color[3]; // DEPTH
    float range[2];     // DEPTH: z of near and far; far not beyond near = those of everything's boxes
    float transparency; // 0 = opaque, 1 = not drawn
    float soft;       // share of the width over which a line fades outwards, 0..1; 0 = hard, anti-aliased where the picture is
    uint32_t surface; // patina_line_surface: what lies under the lines. NONE hides what is behind it still, where opaque
    float paper[3];   // PAPER: linear; all zero = white, unless exact
    uint32_t exact;   // 1 = black is black
} patina_lines;
#define PATINA_LINES_INIT                                                                                                      \
    {                                                                                                                          \
        .struct_size = sizeof(patina_lines), .width = 2.0f, .paper = {1.0f, 1.0f, 1.0f}, .exact = 1                            \
    }

PATINA_API int patina_scene_create(patina_scene **out);
PATINA_API void patina_scene_destroy(patina_scene *scene); // clouds stay
PATINA_API int patina_scene_clear(patina_scene *scene);    // removes clouds, meshes, lights and clips
// The cloud must outlive the scene or the next patina_scene_clear. Instances get ids in order of adding: the base
// of instance i is the sum of the counts before it.
PATINA_API int patina_scene_add_cloud(patina_scene *scene, const patina_cloud *cloud, const patina_cloud_style *style);
// Any number of clips.
PATINA_API int patina_scene_add_clip(patina_scene *scene, const patina_clip *clip);
// At most 32 lights.
PATINA_API int patina_scene_add_light(patina_scene *scene, const patina_light_desc *light);
PATINA_API int patina_scene_set_camera(patina_scene *scene, const patina_camera *camera);
PATINA_API int patina_scene_set_settings(patina_scene *scene, const patina_settings *settings);
// NULL: no effects, as at first.
PATINA_API int patina_scene_set_effects(patina_scene *scene, const patina_effects *effects);
// NULL: no lines, as after patina_scene_create. patina_scene_clear leaves them. On an error there are none.
PATINA_API int patina_scene_set_lines(patina_scene *scene, const patina_lines *lines);
// The world-space box of all that the scene may draw, as far as clips leave it: points with the radii of their discs and soft balls, and
// meshes. Near and far planes that hold this box cut nothing. Set the settings first: they decide what is drawn as discs. An empty scene has
// min > max.
PATINA_API int patina_scene_extent(const patina_scene *scene, double box_min[3], double box_max[3]);
// The values at the two ends of an instance's ramp, as images of the scene take them: of the style's ramp_range, or what stands for it
// where that is automatic. Automatic distances need the camera. PATINA_ERROR_EMPTY for a cloud without points. Any thread.
PATINA_API int patina_scene_ramp_range(const patina_scene *scene, uint32_t instance, double range[2]);
// A camera that frames the scene's clouds, as far as clips leave them and without strays (patina_cloud_dense_box), seen from
// `azimuth` degrees around z (0 = from -y) and `elevation` degrees above the horizon, vertical field of view fov_degrees
// (0 = 45.8). Near and far hold the radii of discs and soft balls too, and so does the picture.
PATINA_API int patina_scene_frame_camera(const patina_scene *scene, double azimuth, double elevation, double fov_degrees,
                                         patina_camera *camera);

// ---- frame -----------------------------------------------------------------------------------------------------

// X(NAME, channels, sentence)
#define PATINA_PASSES(X)                                                                                                       \
    X(COMBINED, 4, "premultiplied scene-linear colour")                                                                        \
    X(DEPTH, 1, "linear z, +inf where nothing is")                                                                             \
    X(NORMAL, 3, "world-space unit normal, 0 where nothing is")                                                                \
    X(SOURCE, 1, "0 nothing; 1 measured; 0.5 measured without a color; 1 + d filled from d pixels away; negative: mixed")      \
    X(SHADOW, 1, "mean share of the casting lights that arrives; 1 lit by all, or nothing there")                              \
    X(LINE, 1, "share of the pixel that a line covers, of the first layer; 0 without lines")                                   \
    X(TRUST, 1, "0..1, of the nearest point, as analysed; 0 where nothing is known, or nothing is")                            \
    X(THICKNESS, 1, "sigma of the nearest point's surface, world units; 0 where nothing is known, or nothing is")              \
    X(DENSITY, 1, "soft points before the surface, for each square of the world's unit across the pixel's ray; 0 without any") \
    X(DISAGREEMENT, 1, "of range images: how far apart the scans lie there along the normal, world units; 0: only one is there")

enum patina_pass {
#define PATINA_X(name, channels, text) PATINA_PASS_##name,
    PATINA_PASSES(PATINA_X)
#undef PATINA_X
        PATINA_PASS_COUNT
};

// What a picture of scattered points is expected to be off by, as measured on a smooth, evenly sampled sphere and torus at the same spacing
// on screen (build/curves). Edges, thin parts, sheets close behind each other, noise and scan rows make it more: by `doubt` at most on the
// shapes that were tried. Wider apart than measured it grows as it did last; all are +inf where points lie more than 64 pixels apart or no
// spacing is known.
typedef struct patina_expected_error {
    float color;    // root mean square over the pixels that are or should be covered, sRGB over grey, shares of white
    float coverage; // 1 - shared pixels / pixels covered by either
    float depth;    // root mean square, spacings of the points
    float normal;   // mean angle, degrees
    float doubt;    // how many times `color` other shapes were off at most; >= 1
} patina_expected_error;

typedef struct patina_frame_stats {
    size_t struct_size;
    uint32_t width, height;    // of the passes (the region's)
    uint64_t points;           // in the scene
    uint64_t points_scattered; // in chunks that were not culled
    uint64_t triangles;        // of meshes in view
    uint64_t chunks, chunks_culled;
    double ms;            // whole render call
    uint64_t plane_bytes; // planes held by the frame, those of shadow maps too
    uint32_t layers;      // of surface that show something; 1 without peeling, 0 where nothing is in view
    float spacing_px;     // of points on screen, that 95% of the covered area stays below
    patina_expected_error expected;
    uint64_t shadow_bytes;                // shadow textures held by the frame
    uint32_t shadow_maps;                 // light views drawn for this picture; 0 when every texture was at hand
    uint32_t shadow_width, shadow_height; // of the largest of them, texels
    uint32_t shadow_pending;              // progressive: lights that further renders still refine
    uint32_t shadow_samples;              // of the light that took most
    float shadow_error;                   // the largest of the lights' expected errors, with settings.shadow_error
    uint64_t chunks_clipped;              // of the culled: those that clips and hidden classes took whole
    uint64_t chunks_cut;                  // in view, whose points were tested one by one
    uint32_t pixel_samples;               // whose mean every pixel is at least; 1: of the picture without samples
    uint32_t pixel_pending;               // progressive: samples a pixel that patina_frame_refine takes yet, at most
    float pixel_error;        // expected standard error of the mean, shares of white in levels as sRGB's, root mean square over
                              // the pixels whose samples differ; 0 = not known: fewer than two shifted pictures
    uint64_t mapped_bytes;    // of the scene's clouds in files that patina_cloud_open mapped
    uint64_t mapped_cap;      // how much of them may be held: device_desc.mapped_cap; 0 = they fit, or OpenGL has copies
    uint64_t mapped_held;     // and as it was measured
    uint64_t mapped_read;     // by passes over points, each counted; what pixels ask of single points comes to it
    uint32_t mapped_rounds;   // of the pass over points that took most; 0 where nothing is mapped
    uint32_t mapped_returned; // how often all that was held was given back
    // Points of mapped files that cannot be read any more, cut short or on a disk that is gone: they are not drawn. The log names each
    // such file once.
    uint64_t points_lost;
    uint64_t untrusted;    // points of the scene that are left out for their trust: patina_cloud_style.least_trust
    uint64_t none_trusted; // points of clouds in which no point has that much trust, so that all are drawn
} patina_frame_stats;

// A frame keeps its planes from render to render. The device must outlive it. Frames of one device may be rendered from
// several threads; they take turns.
PATINA_API int patina_frame_create(patina_device *device, patina_frame **out);
PATINA_API void patina_frame_destroy(patina_frame *frame);
// Renders; blocks. On any error the last good picture stays readable.
PATINA_API int patina_frame_render(patina_frame *frame, const patina_scene *scene);
// Plans without rendering, and returns PATINA_ERROR_TOO_LARGE where patina_frame_render would refuse the image before it begins: a plane
// has 2^29 pixels or more, or is larger than the device's buffers, or all of them are larger than memory_cap or the memory that is free.
// A smaller region may do.
// The same of the maps of lights, which a lower shadow_resolution makes smaller. What kernels keep beside their buffers is not counted.
PATINA_API int patina_frame_check(patina_frame *frame, const patina_scene *scene);
// Betters the picture that patina_frame_render made with settings.pixel_progressive, by a step: with shadow_progressive the next
// sample of soft shadows, then samples of pixels: a shifted or finer picture, or some of its rows, and further ones until ms
// have passed. For as long as stats.pixel_pending says so; else PATINA_ERROR_EMPTY. The scene must be as it was: what has changed
// since would be mixed in (PATINA_ERROR_ARGUMENT where size, region or samples have). Blocks. On any error, and when it is
// cancelled, what was reached stays readable, and patina_frame_refine may go on; another patina_frame_render ends it.
PATINA_API int patina_frame_refine(patina_frame *frame, const patina_scene *scene, double ms);
PATINA_API void patina_frame_cancel(patina_frame *frame); // the running (or else the next) render or refinement stops soon
PATINA_API float patina_frame_progress(const patina_frame *frame); // 0..1
// Copies a pass, width * height * channels float32, into the caller's buffer; size in bytes must fit exactly.
PATINA_API int patina_frame_read(const patina_frame *frame, uint32_t pass, float *pixels, size_t size);
// Copies a pass of one layer, as patina_frame_read does: COMBINED (what the layer alone shows, before no background), DEPTH or
// NORMAL, asked for in settings.layer_passes. layer: 1 (nearest) to settings.layers; layers that do not exist read as
// nothing (0, depth +inf). Like keys they are gone after a render that failed or was cancelled (PATINA_ERROR_EMPTY).
PATINA_API int patina_frame_read_layer(const patina_frame *frame, uint32_t layer, uint32_t pass, float *pixels, size_t size);
// The nearest depth within two pixels of each pixel: what hides a host's overlays has to be that much wider than the surface. Both are
// width * height floats, `size` bytes each, and not the same. Any thread.
PATINA_API int patina_nearest_depths(const float *depths, uint32_t width, uint32_t height, float *nearest, size_t size);
// The visibility keys of the first layer, width * height uint64: float_bits(z) << 32 | id. Unlike the passes they are gone after a render
// that failed or was cancelled, and with a cloud that they show (PATINA_ERROR_EMPTY). PATINA_ERROR_TOO_MANY_POINTS: keys do not hold the
// numbers (patina_frame_read_numbers does). PATINA_ERROR_FILE: a mapped cloud's file, which has the numbers, cannot be read.
PATINA_API int patina_frame_read_keys(const patina_frame *frame, uint64_t *keys, size_t size);

PATINA_API int patina_frame_get_stats(const patina_frame *frame, patina_frame_stats *stats);

#ifdef __cplusplus
}
#endif

// The rest of the manual, which this header includes.
#include "builder.h"
#include "diagnostics.h"
#include "drawings.h"
#include "files.h"
#include "measure.h"
#include "meshes.h"
#include "pages.h"
#include "panorama.h"
#include "parts.h"
#include "points.h"
#include "shadows.h"
#include "tasks.h"
#endif
