// SPDX-License-Identifier: GPL-3.0-or-later
// The plan of a frame: which kernels run, on what, and why the others do not. Pure data from scene and settings; no device
// is called (SPEC 8, DESIGN rule 3).
#ifndef PT_PLAN_H
#define PT_PLAN_H

#include "base/arena.h"
#include "device.h"
#include "expected.h"
#include "scene/scene.h"
#include "kinds.h"
#include "steps.h"
#include "shared/clips.h"
#include "shared/colors.h"

#include <math.h>

enum { PT_LEVELS = 6 }; // of the pyramid: level 0 and up to five coarser ones

// Layers behind the first have keys, from and shading of their own: the passes of the picture show the first. Coarser levels
// serve one layer after another. What a plane holds says kernels.def. No order here means anything.
// X(name, format, size, slots, carried)
//   size: WINDOW: the view's; LIGHTS: one of these for each light that casts shadows; CROP: the picture that callers read; TILES: of
//         16 x 16 pixels of the window; RECORDS: no pixels, but plan->soft.records of them; BINS: as many as these need; DISCS:
//         plan->discs.bins; CELLS: of the largest image buffer; VEILS: the view's, plan->soft.veils for each pixel
//   slots: ONE; LEVELS: coarser ones too; LAYERS: one each
//   carried: from layer to layer
#define PT_PLANES(X)                                                                                                           \
    X(KEYS, key, WINDOW, LEVELS, 0)                                                                                            \
    X(FROM, u32, WINDOW, LEVELS, 0)                                                                                            \
    X(NORMAL, f32x4, WINDOW, ONE, 0)                                                                                           \
    X(DEFF, f32, WINDOW, ONE, 0)                                                                                               \
    X(SPAN, f32, WINDOW, ONE, 0)                                                                                               \
    X(SHADING, f32x4, WINDOW, ONE, 0)                                                                                          \
    X(ARRIVED, f32, WINDOW, ONE, 0)                                                                                            \
    X(ALBEDO, f32x4, WINDOW, ONE, 0)                                                                                           \
    X(AWAY, f32, WINDOW, ONE, 0)                                                                                               \
    X(LIGHT, u32, LIGHTS, ONE, 0)                                                                                              \
    X(OFFSET, f32, WINDOW, ONE, 0)                                                                                             \
    X(OBSCURED, f32, WINDOW, ONE, 0)                                                                                           \
    X(VALUES, f32, WINDOW, ONE, 0)                                                                                             \
    X(SLOPES, f32x4, WINDOW, ONE, 0)                                                                                           \
    X(UNLIT, f32x4, WINDOW, ONE, 0)                                                                                            \
    X(COLOR_A, f32x4, WINDOW, ONE, 0)                                                                                          \
    X(COLOR_B, f32x4, WINDOW, ONE, 0)                                                                                          \
    X(KEYS_BEHIND, key, WINDOW, ONE, 0)                                                                                        \
    X(FROM_BEHIND, u32, WINDOW, ONE, 0)                                                                                        \
    X(SHADING_BEHIND, f32x4, WINDOW, ONE, 0)                                                                                   \
    X(LIMIT, f32, WINDOW, ONE, 1)                                                                                              \
    X(THROUGH, f32, WINDOW, ONE, 1)                                                                                            \
    X(OVER, f32x4, WINDOW, ONE, 1)                                                                                             \
    X(TILES, tile, TILES, ONE, 1)                                                                                              \
    X(MESH_KEYS, key, WINDOW, ONE, 0)                                                                                          \
    X(MESH_SHOWN, key, WINDOW, ONE, 0)                                                                                         \
    X(MESH_NORMAL, f32x4, WINDOW, ONE, 0)                                                                                      \
    X(MESH_ALBEDO, f32x4, WINDOW, ONE, 0)                                                                                      \
    X(MESH_PLACES, f32x3, WINDOW, ONE, 0)                                                                                      \
    X(MESH_WORDS, u32, WINDOW, ONE, 0)                                                                                         \
    X(LINE, f32, WINDOW, ONE, 0)                                                                                               \
    X(NEAREST, u32, WINDOW, ONE, 0)                                                                                            \
    X(LINE_BEHIND, f32, WINDOW, ONE, 0)                                                                                        \
    X(NEAREST_BEHIND, u32, WINDOW, ONE, 0)                                                                                     \
    X(KEYS_KEPT, key, WINDOW, ONE, 0)                                                                                          \
    X(CELLS, key, CELLS, ONE, 0)                                                                                               \
    X(CELL_BEYOND, f32, CELLS, ONE, 0)                                                                                         \
    X(CELL_PLACE, f32x4, CELLS, ONE, 0)                                                                                        \
    X(CELL_MERGED, f32x4, CELLS, ONE, 0)                                                                                       \
    X(CELL_INCLINED, f32x4, CELLS, ONE, 0)                                                                                     \
    X(CELL_LEAST, f32, CELLS, ONE, 0)                                                                                          \
    X(CELL_MOST, f32, CELLS, ONE, 0)                                                                                           \
    X(APART, f32, WINDOW, ONE, 0)                                                                                              \
    X(COMBINED, f32x4, CROP, ONE, 0)                                                                                           \
    X(DEPTH, f32, CROP, ONE, 0)                                                                                                \
    X(NORMALS, f32x3, CROP, ONE, 0)                                                                                            \
    X(SOURCE, f32, CROP, ONE, 0)                                                                                               \
    X(SHADOW, f32, CROP, ONE, 0)                                                                                               \
    X(LINES, f32, CROP, ONE, 0)                                                                                                \
    X(DISC_BINS, bins, DISCS, ONE, 0)                                                                                          \
    X(SOFT_POINTS, record, RECORDS, ONE, 0)                                                                                    \
    X(SOFT_BINS, bins, BINS, ONE, 0)                                                                                           \
    X(SOFT_REACHED, f32, WINDOW, ONE, 0)                                                                                       \
    X(VEIL, f32, VEILS, ONE, 0)                                                                                                \
    X(TRUST, f32, CROP, ONE, 0)                                                                                                \
    X(THICKNESS, f32, CROP, ONE, 0)                                                                                            \
    X(DENSITY, f32, CROP, ONE, 0)                                                                                              \
    X(DISAGREEMENT, f32, CROP, ONE, 0)                                                                                         \
    X(LAYER_COMBINED, f32x4, CROP, LAYERS, 0)                                                                                  \
    X(LAYER_DEPTH, f32, CROP, LAYERS, 0)                                                                                       \
    X(LAYER_NORMALS, f32x3, CROP, LAYERS, 0)

enum pt_plane {
#define PT_X(name, format, size, slots, carried) PT_PLANE_##name,
    PT_PLANES(PT_X)
#undef PT_X
        PT_PLANE_COUNT
};

enum pt_plane_size {
    PT_SIZE_WINDOW,
    PT_SIZE_LIGHTS,
    PT_SIZE_CROP,
    PT_SIZE_TILES,
    PT_SIZE_RECORDS,
    PT_SIZE_BINS,
    PT_SIZE_DISCS,
    PT_SIZE_CELLS,
    PT_SIZE_VEILS
};
enum pt_plane_slots { PT_SLOTS_ONE, PT_SLOTS_LEVELS, PT_SLOTS_LAYERS };

struct pt_plane_row {
    const char *name;
    enum pt_format format;
    enum pt_plane_size size;
    enum pt_plane_slots slots;
    int carried;
};
extern const struct pt_plane_row pt_plane_rows[PT_PLANE_COUNT];

static inline uint32_t pt_plane_bytes(enum pt_plane plane) { return pt_format_bytes[pt_plane_rows[plane].format]; }
// One plane of the picture that callers read, or one for each layer.
static inline int pt_of_picture(enum pt_plane plane)
{
    return pt_plane_rows[plane].size == PT_SIZE_CROP && pt_plane_rows[plane].slots == PT_SLOTS_ONE;
}

// Of 16 bytes: what is counted, and for each record six entries of tiles' lists: a tile's always fits.
enum { PT_SOFT_BINS_HEAD = 4, PT_SOFT_BINS_EACH = 3 };

enum { PT_SLOTS = 16 }; // levels or layers that a plane may have
_Static_assert((int)PT_LEVELS <= (int)PT_SLOTS && PATINA_MAX_LAYERS <= (int)PT_SLOTS, "planes have too few slots");

// PT_MARKS and PT_SHADOWS belong to the frame's shadows, not to the cloud; PT_CLIPS and PT_DRAWN to the plan as a whole; PT_MASK to
// the instance's mask. PT_FIELD: its field, or 1 where all points are soft, with the points' radii; PT_FIELD_ONE: with radii of 1.
// PT_SCANS: those of its style. PT_FINE_CHUNKS, and up to PT_RANGE_FINER of them: in the finer and finer cells of range images.
enum pt_instance_buffer {
    PT_CHUNKS,
    PT_POSITIONS,
    PT_SURFELS,
    PT_COLORS,
    PT_OPACITIES,
    PT_RADII,
    PT_SCALARS,
    PT_CLASSES,
    PT_SHAPES,
    PT_SIGHTS,
    PT_INSTANCE_BUFFERS,
    PT_MARKS = PT_INSTANCE_BUFFERS,
    PT_SHADOWS,
    PT_CLIPS,
    PT_DRAWN,
    PT_MASK,
    PT_FIELD,
    PT_FIELD_ONE,
    PT_SCANS,
    PT_FINE_CHUNKS,
    PT_FINER_CHUNKS,
    PT_FINEST_CHUNKS
};
enum { PT_RANGE_FINER = PT_FINEST_CHUNKS - PT_FINE_CHUNKS + 1 };

enum pt_mesh_buffer { PT_MESH_VERTICES, PT_MESH_INDICES, PT_MESH_TEXELS };

enum pt_plan_buffer { PT_PLAN_LIGHTS, PT_PLAN_RAMPS, PT_PLAN_BUFFERS }; // of plan->light and plan->ramps

// What of a pass's arguments is known only when its turn comes: how many samples shadow words hold, of points or of pixels.
enum pt_late { PT_LATE_NOTHING, PT_LATE_POINTS, PT_LATE_PIXELS };

struct pt_pass {
    enum pt_kernel kernel;
    uint32_t layer;   // from 1 on; 0: of the whole picture
    const char *name; // what statistics add it to
    char reason[96];
    const void *arguments; // owned by the plan
    size_t argument_size;
    const struct pt_ref *refs;
    uint32_t ref_count;
    enum pt_late late; // pt_plan_late
    int output;        // writes the picture that readers see
    uint32_t when;     // pt_plan_share_planes: its place in time
    uint32_t together; // so many passes from this one on may run as one: nothing else reads the planes between them. 0: alone
    uint32_t leaves;   // but 1 + this plane, of colours, which they leave to what follows; 0: they write the picture, or peel
};

struct pt_skipped {
    const char *name;
    char reason[128];
};

// Where a chunk's points may be seen, nothing left out.
struct pt_bounds {
    uint32_t rect[4]; // in the planes
    float z_far;
};

// A light whose shadow texture the frame needs.
struct pt_plan_light {
    const patina_light_desc *light;
    uint32_t samples; // wanted
    // pt_plan_light_map, once:
    uint32_t known;
    uint32_t cube;   // six maps a sample instead of one
    uint32_t capped; // its texels are wider than the points' spacing asks for
    double texel;    // width of a texel: at distance 1, or of suns anywhere
    double axes[9];  // of its maps (not of a cube's): rows x, y, z, looks down -z
    char reason[128];
};

// What one kind alone has of a planned instance; its own files read it.
struct pt_drawn_discs {
    float radius, radius_scale, radius_most, surface_scale; // as disc_args has them
};
struct pt_drawn_balls {
    float radius_scale; // as gather_args has it
};

// What is drawn of an instance in one way. An instance in view whose points have footprints is two of these: its fine chunks as
// points, and behind all others its wide ones as discs, with ids of their own (pt_plan_ids).
struct pt_plan_instance {
    const struct pt_instance *instance;
    uint32_t of;       // its place in the scene: shadows are kept by it
    double thinned;    // how much farther apart than its cloud's the points that are drawn lie
    enum pt_kind kind; // none of PT_AS_MESH: these are pt_plan_mesh
    union {
        struct pt_drawn_discs discs;
        const struct pt_range *range; // of range images: their image buffer (ranges.h)
        struct pt_drawn_balls balls;  // of soft points
    } as;
    struct instance_args args;
    struct chunk_view *chunks; // those in view
    struct pt_bounds *bounds;  // of each of them
    uint32_t chunk_count;
    uint64_t points;                                    // of these chunks, drawn ones
    uint32_t rect[4];                                   // of its points in the planes; empty: x0 >= x1
    uint32_t chunks_cut;                                // of its chunks, those that are sifted
    int by_class, by_shape, by_mask, by_field, by_scan; // some of them by class, by shape, by mask, by field, by scan
    int marked;                                         // shown with what stations saw through in magenta
};

static inline int pt_draws(const struct pt_plan_instance *instance, enum pt_kind kind)
{
    return instance->kind == kind && instance->chunk_count;
}

// What one pass draws of the soft points: rows of the picture, a slab of depth, and which instances of the plan hold its points.
struct pt_soft_part {
    uint32_t rows[2];
    float z_from, z_to;
    uint32_t first, count; // of plan->instances
    uint32_t records;
};

// Of plan->ramps.
struct pt_plan_ramp {
    uint32_t first, entries;
};

struct pt_plan_mesh {
    const struct pt_instance *instance;
    struct mesh_args args;
    uint32_t rect[4]; // in the planes; empty where it is out of view: x0 >= x1
};

// What one kind alone has of a plan, as `as` holds it of an instance.
struct pt_plan_soft {
    uint32_t count, entries;    // instances in view; those and what parts draw
    struct pt_soft_part *parts; // those farther away first, rows beside each other
    uint32_t part_count;
    uint32_t records; // room for the largest part
    float depths[2];  // z that balls of the whole picture begin and end at
    uint32_t veils;   // of a light's map: slabs of depth that its soft points are counted in; 0: it is one of surfaces
};
struct pt_plan_discs {
    double entries;        // in bins, as their sizes on screen let expect
    uint32_t bins;         // of 16 bytes: pt_plan_set_bins
    uint32_t first, count; // ids whose points are discs
};
// The slots of a cloud that have ids: from the first of the chunks in view to the end of the last.
struct pt_window {
    uint32_t first, count; // slots
    uint32_t id;           // of the first
};
struct pt_plan_ids {
    struct pt_window *windows; // of the scene's clouds: their ids follow each other in this order
    uint64_t points;           // of all windows: where triangles' ids begin
    uint32_t discs; // the first of those that points have as discs beside others that are not; 0: everything is filled
    int filled;     // none of these: 32 bits hold no more
};
struct pt_plan_images {
    uint32_t reach; // pixels, of what is drawn as range images around the picture; 0: nothing is
    uint32_t cells; // of the largest image buffer
};
struct pt_plan_meshes {
    struct pt_plan_mesh *list;
    uint32_t count;
    uint64_t triangles; // of those in view; 0: none is
    int shadows;        // some of these receive shadows: their pixels are tested
};

// The maps of one sample: those of all opaque casters; of all but one that must not shadow itself, for that one; and of
// every transparent caster by itself, layer behind layer where its points have opacities of their own.
struct pt_shadow_group {
    uint32_t only, without; // clouds, by the first instance of each, or PT_NO_INSTANCE
    uint32_t loss;          // 1..255
    int faint;              // its points have opacities of their own
    int soft;               // its soft points: no surface, but what they let through up to any depth
};
enum {
    PT_NO_INSTANCE = 0xFFFFFFFFu,
    PT_PIXELS = 0xFFFFFFFEu
};                            // PT_PIXELS: those that show meshes, of which shadows are kept, too
enum { PT_FAINT_LAYERS = 8 }; // of a caster whose points have opacities of their own, at most

// What is tested against a light's map.
struct pt_receiver {
    const struct patina_cloud *cloud; // NULL: the picture's pixels that show meshes
    struct chunk_view *chunks;
    uint32_t chunk_count;
};

// From when to when a plane is needed, in the plan's order, and which slab of memory holds it.
struct pt_life {
    enum pt_plane plane;
    uint32_t index, first, last, slab;
    size_t bytes;
};

struct pt_slab {
    size_t bytes;
    uint32_t last; // when its last plane is done with
};

struct pt_plan {
    struct pt_pool *pool;     // that it is made by; NULL: by the calling thread alone
    struct view_args view;    // level 0; rect: union over instances and meshes
    uint32_t levels;          // coarse levels
    uint32_t crop[4];         // x, y, width, height of the picture in the planes
    uint32_t pixel_offset[2]; // of the crop in the full picture
    uint32_t guard;           // pixels by which the padded picture is wider on each side
    struct pt_plan_instance
        *instances; // behind those that the count counts: soft ones, whole, and then what parts draw of them
    uint32_t instance_count;
    struct pt_plan_ids ids;
    struct pt_plan_soft soft;
    struct pt_plan_discs discs;
    struct pt_plan_images ranges;
    struct pt_plan_meshes mesh;
    int sigmas;  // some points know how thick their surface is: d_eff follows it, and the span plane holds
    int reaches; // points know how far they spread: holes are closed no farther
    struct pt_pass *passes;
    uint32_t pass_count;
    struct pt_step *steps; // what of them runs when
    uint32_t step_count;
    struct pt_life *lives; // of planes that are not kept, in the order of their first uses
    uint32_t life_count;
    struct pt_slab *slabs;
    uint32_t slab_count;
    uint64_t peak;                  // bytes of all planes together, those of light maps apart
    struct pt_shadow_group *groups; // of casters
    uint32_t group_count;
    struct pt_receiver *receivers; // of a light's map
    uint32_t receiver_count;
    struct pt_skipped skipped[PT_KERNEL_COUNT + 4];
    uint32_t skipped_count;
    struct pt_plan_light lights[PT_MAX_LIGHTS]; // those that cast, in the scene's order
    uint32_t light_count;
    int words_are_many;       // whole textures of theirs would be too large to be kept
    struct light_view *light; // all of it, as shading reads it; NULL: nothing is lit
    float *ramps;             // of all that has one, a table; equal ones are there once
    uint32_t ramp_entries, ramp_room;
    struct pt_plan_ramp *ramp_list;
    uint32_t ramp_count, ramp_list_room;
    uint64_t points, points_scattered, chunks, chunks_culled, chunks_clipped, chunks_cut;
    struct clip_view *clips; // of divided chunks, and for tint
    uint32_t clip_count, clip_room;
    uint32_t drawn_words;
    double spacing_px;      // local spacing on screen that 95% of the covered area stays below
    double spacing_middle;  // that half of it stays below
    uint32_t iterations;    // of each filling filter
    int filled;             // some points around the picture are pixels, not discs
    uint32_t quality, fill; // as set, or as the error target chose them
    int map;                // of a light
    int panorama;           // of a face of one
    enum pt_means means;    // that `expected` is of
    patina_expected_error expected;
    uint32_t layers;   // at most so many are peeled; 1: no peeling
    int transparent;   // something in view lets light through
    float line_radius; // of the widest line, pixels; 0: none
    uint32_t reopens;  // how often points are drawn where closed pixels are taken back: 2; 0: none are
    uint32_t
        assessed; // of PATINA_PASS_TRUST, _THICKNESS, _DENSITY, _DISAGREEMENT, bits 1 << those that are asked for and known of something
    uint64_t mapped_cap,
        round_bytes; // of what is held of clouds in files, and read of them at a time (rounds.h); 0: all there is
    int copied;      // by a device that copies clouds: then of them all, in ranges (slots.h)
    struct pt_arena *arena;
};

// ids.c: numbers what is in view, by the windows' slots. Whether 32 bits hold it, with ids of discs unless plan->ids.filled.
int pt_plan_number(const struct patina_scene *scene, struct pt_plan *plan);
int pt_plan_too_many(const struct patina_scene *scene, const struct pt_plan *plan); // says so
// Gives an instance of a cloud its ids; discs: those of its points as discs (plan->ids.discs), or 0.
void pt_set_ids(const struct pt_plan *plan, uint32_t instance, uint32_t discs, struct instance_args *args);

// Times an instance's spacing of a class of sigma: a thickness, world units. What is left out makes nothing thicker.
static inline float pt_sigma_scale(const struct pt_plan_instance *instance)
{
    return (float)(1.0 / (16.0 * instance->thinned));
}

// Whether some of the kind is in view, soft points and meshes apart.
static inline int pt_plan_draws(const struct pt_plan *plan, enum pt_kind kind)
{
    for (uint32_t i = 0; i < plan->instance_count; i++)
        if (pt_draws(&plan->instances[i], kind))
            return 1;
    return 0;
}

// Is there anything in view that is no soft point?
static inline int pt_plan_shows(const struct pt_plan *plan) { return plan->points_scattered || plan->mesh.triangles; }

// Every pointer inside belongs to the plan, but for the pool's (NULL: the calling thread makes it alone), whose threads change nothing of it;
// the clouds must outlive it. Message on the scene when it fails.
int pt_plan_create(const struct patina_scene *scene, struct pt_pool *pool, struct pt_plan *plan);
void pt_plan_destroy(struct pt_plan *plan);

// Width and height of a plane at a level (of planes with levels) or of a layer.
void pt_plan_plane_size(const struct pt_plan *plan, enum pt_plane plane, uint32_t level, uint32_t size[2]);
static inline size_t pt_plan_plane_bytes(const struct pt_plan *plan, enum pt_plane plane, uint32_t level)
{
    uint32_t size[2];
    pt_plan_plane_size(plan, plane, level, size);
    return (size_t)size[0] * size[1] * pt_plane_bytes(plane);
}

// Whether the picture that readers see has this plane.
int pt_plan_writes(const struct pt_plan *plan, enum pt_plane plane);

// lifetimes.c. How many passes from one on a device runs as one: device.h, tail_length.
typedef uint32_t pt_together(const void *device, const struct pt_pass *passes);
// What planes depend on of a device.
struct pt_abilities {
    pt_together *together; // NULL: every pass runs alone
    const void *device;    // of together
    uint32_t bin_threads;  // device.h
    uint64_t bins_had;     // bytes that the bins of discs came to in the picture before
};
// Finds plan->discs.bins, plan->lives, and which of them share slabs; apart: none do, for all are to be looked at afterwards.
// PATINA_ERROR_MEMORY, or 0.
int pt_plan_share_planes(struct pt_plan *plan, const struct pt_abilities *abilities, int apart);
// The rule of the bins' room: a quarter more entries than are expected, for each thread a block of each tile that is not full, and those
// that it took and did not come to, rounded up by an eighth at most; or what the picture before came to, where that is no four times as
// much. More is asked for when it is needed (PT_MORE_ROOM). 0: no disc is in view, or threads are 0.
void pt_plan_set_bins(struct pt_plan *plan, uint32_t threads, uint64_t had);
// Has memory of its own from render to render: readers, or the next render, need it.
int pt_plane_is_kept(enum pt_plane which, uint32_t index);

// A line a step or pass, of loops their ends, of each light's maps the first, and a line for each pass that is left out. Finds what the
// lights' maps are like. Returns the full length.
size_t pt_plan_text(const struct patina_scene *scene, struct pt_plan *plan, char *buffer, size_t size);

// view.c: how the camera sees the scene.
int pt_plan_view(const struct patina_scene *scene, struct pt_plan *plan);
// No more than the spacings on screen.
int pt_plan_spacing(const struct patina_scene *scene, struct pt_plan *plan);
// soft.c, once the window is known: soft instances in view, and their parts.
struct pt_eye;
int pt_place_soft(const struct patina_scene *scene, struct pt_plan *plan, const struct pt_eye *eye);
// reopen.c, once the layers are known: plan->reopens.
uint32_t pt_reopen_rounds(const struct patina_scene *scene, const struct pt_plan *plan);
// window.c: whether the instance's points may be discs.
int pt_knows_discs(const struct patina_scene *scene, const struct pt_plan *plan, const struct pt_instance *instance);
// Whether every cloud knows how far its points spread, and that is to be kept to.
int pt_knows_reach(const struct patina_scene *scene, const struct pt_plan *plan);
// Whether layer distances follow what an analysis found: where some surfaces lie nearer to each other than two spacings. Elsewhere
// that tells nothing, and a million points on a torus would take a fifth longer to fill. Decided for the whole scene: a region's
// planes are those of the whole.
int pt_knows_sigmas(const struct patina_scene *scene);
// window.c, once the spacings are known: how holes are closed; how many layers; which pixels the planes hold, with a picture
// that is `guard` pixels wider on each side.
void pt_choose_filling(const struct patina_scene *scene, struct pt_plan *plan);
void pt_choose_layers(const patina_settings *settings, struct pt_plan *plan);
void pt_choose_window(const struct patina_scene *scene, struct pt_plan *plan, uint32_t guard);
static inline uint32_t pt_round_up(uint32_t value, uint32_t multiple) { return (value + multiple - 1) / multiple * multiple; }
// How far, in pixels, the effects of a picture carry influence. (effects.c)
uint32_t pt_effects_reach(const struct patina_scene *scene);
// Every chunk of the instance that is there as the plan's view sees it, inside or outside; nothing is culled.
int pt_plan_chunks(const struct patina_scene *scene, struct pt_plan *plan, const struct pt_instance *instance,
                   struct instance_args *args, struct chunk_view **chunks, uint32_t *count);

// ---- clips and hidden classes: clip.c --------------------------------------------------------------------------------

struct pt_builder;
struct pt_sieve;
// Gives a chunk its clips and drawn words, where it is divided.
int pt_plan_divide(struct pt_plan *plan, struct pt_plan_instance *instance, const struct pt_sieve *sieve,
                   const struct pt_chunk *chunk, struct chunk_view *out);
void pt_plan_sift(struct pt_builder *builder);                      // passes before scatter
void pt_plan_tint(struct pt_builder *builder, enum pt_plane color); // passes on a layer's colour

// ---- colours: color.c -------------------------------------------------------------------------------------------------

// The instance's ramp, exposure and contrast, and the format of what shade reads for its colours.
void pt_plan_recolor(struct pt_builder *builder, const struct pt_plan_instance *instance, struct shade_args *args);
// What shading takes the colours of instance i from: its own, its scalars, or its shape words.
struct pt_ref pt_colors_of(const struct pt_plan_instance *instance, uint32_t i, const struct recolor_args *recolor);
// Puts a ramp, of linear RGB, into the plan's table, unless it is there.
void pt_plan_ramp(struct pt_builder *builder, const float *ramp, uint32_t entries, struct recolor_args *out);

// ---- shadows: light.c -----------------------------------------------------------------------------------------------

// Where the loops around a map stand.
struct pt_round {
    uint32_t light, group, sample, face;
    uint32_t layer;     // of a faint caster, from 0 on
    int points, pixels; // which are tested: receivers, or pixels that show meshes
    int compare;        // whether the samples so far differ is asked
};

// maps.c, pure as all planning: the sub-plan of a light's map with its tests; without passes where there is nothing to see. picture:
// the plan with the loops. Those of other threads may be made at the same time.
int pt_plan_map(const struct patina_scene *scene, const struct pt_plan *picture, const struct pt_round *round,
                struct pt_plan *map);
// What the round's maps took together goes into the sum, of receivers that several were tested for.
int pt_plan_close(const struct patina_scene *scene, const struct pt_plan *picture, const struct pt_round *round,
                  struct pt_plan *map);
// Whether anything is tested against the group's maps.
int pt_plan_tested(const struct patina_scene *scene, const struct pt_plan *picture, const struct pt_round *round,
                   uint32_t group);
// Shadow words as a pass finds them.
struct pt_words {
    uint32_t samples[PT_MAX_LIGHTS]; // of each light
    uint32_t step;                   // of marked points alone, so many a point; 0: of all slots, a light's behind the other's
};
// shading.c: writes what is known late into a copy of the pass's arguments.
void pt_plan_late(const struct pt_pass *pass, const struct pt_words *words, void *arguments);
// plan.c: the loops of all shadow textures, without a picture.
int pt_plan_textures(const struct patina_scene *scene, struct pt_plan *plan);

// Lists plan->lights.
void pt_plan_lights(const struct patina_scene *scene, struct pt_plan *plan);
// What the maps of light i are like: before they are drawn. Lights whose textures are kept need none.
int pt_plan_light_map(const struct patina_scene *scene, struct pt_plan *plan, uint32_t i);
int pt_plan_light_text(const struct patina_scene *scene, struct pt_plan *plan, uint32_t i); // the same, told in its reason
// Once they are known: of a sample of light i.
static inline uint32_t pt_light_faces(const struct pt_plan *plan, uint32_t i) { return plan->lights[i].cube ? 6 : 1; }
static inline int pt_receives(const struct pt_instance *instance) // shadows, at all
{
    return !(instance->style.shadow_off & PATINA_SHADOW_NO_RECEIVE) && instance->style.lighting == PATINA_LIGHTING_LIT &&
           instance->cloud->info.drawn;
}
int pt_mesh_casts(const struct pt_instance *instance);
int pt_mesh_receives(const struct pt_instance *instance);
int pt_soft_casts(const struct patina_scene *scene);      // some soft point does
int pt_soft_receives(const struct patina_scene *scene);   // shadows: some soft point
int pt_casts_in_layers(const struct patina_scene *scene); // some cloud does: its points have opacities of their own
// Only points that the picture shows are tested. Not of several layers: which points the second shows is known too late. Not
// with an error target: a part of the picture would stop at other samples than the whole. Not where soft points take shadows: no
// pixel tells which of them it shows.
int pt_plan_lazy(const struct patina_scene *scene, const struct pt_plan *plan);

uint32_t pt_shadow_groups(const struct patina_scene *scene, struct pt_shadow_group *groups); // at most 3 instances + 1
int pt_group_receives(const struct patina_scene *scene, const struct pt_shadow_group *group, uint32_t instance);

uint32_t pt_veil_slabs(const struct patina_scene *map); // of a soft group's scene: as many as there is memory for

// A scene of the group's casters as a sample of the light sees them, for pt_plan_depth. instances: room for the scene's. The
// window is what of the map counts, in window units: left, bottom, right, top. 0: there is nothing to see.
int pt_light_scene(const struct patina_scene *scene, const struct pt_plan_light *light, const struct pt_shadow_group *group,
                   uint32_t sample, uint32_t face, struct pt_instance *instances, struct patina_scene *out, double window[4]);

// What a light's texture depends on, in a fixed order: integers as such, lengths and angles relative to the light.
// Returns the count of numbers; writes at most `room`.
size_t pt_light_key(const struct patina_scene *scene, const struct pt_plan_light *light,
                    uint64_t (*identity)(const struct patina_cloud *cloud), double *numbers, size_t room);
int pt_same_key(const double *a, const double *b, size_t count);

#endif
