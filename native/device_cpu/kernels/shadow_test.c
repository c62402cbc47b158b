// SPDX-License-Identifier: GPL-3.0-or-later
// shadow_test: points against the filled map of a light. [D 6], SPEC 4; twin of shaders/kernels/shadow_test.comp
//
// Words of a cloud's points belong to one chunk each, so threads never meet. Lit points are not written at all.
#include "device_cpu/points.h"
#include "shadow_words.h"
#include "shared/shadows.h"

struct shadow_test {
    const struct pt_cpu_call *call;
    struct shadow_test_args args; // with the wider texel
};

// Where PT_LANES points fall: z, pixel and texel, and which of them lie behind what the map shows there by more than their
// least d_eff.
struct fall {
    vf at[2], z, map;
    vi column, row, texel;
    vm behind;
};

// Points of a chunk that may be in shadow, and where they fall: few of a block are, and they are tested side by side.
enum { BLOCK = 128, QUEUE = BLOCK + PT_LANES };

struct queue {
    uint32_t count, slot[QUEUE], column[QUEUE], row[QUEUE], texel[QUEUE], behind[QUEUE];
    uint32_t at[2][QUEUE], z[QUEUE], map[QUEUE]; // floats
};

// 1. project and compare.
static struct fall fall_of(const struct shadow_test *test, const struct chunk_view *chunk, const vf p[3], vm lanes)
{
    const struct view_args *view = &test->args.view;
    vf at[3];
    pt_project(view, chunk, p, at);
    struct fall f = {.z = at[2], .at = {at[0], at[1]}};
    const vm inside = pt_in_window(view, test->args.window, at, lanes);
    f.column = vi_sub(vf_int(vf_floor(f.at[0])), vi_set((uint32_t)view->origin_x));
    f.row = vi_sub(vf_int(vf_floor(f.at[1])), vi_set((uint32_t)view->origin_y));
    f.texel = vi_add(vi_mul(f.row, vi_set(view->width)), f.column);
    f.map = vi_float(vi_gather_z(PT_DATA(test->call, shadow_test, keys), f.texel, inside));
    // no d_eff is less than that of a surface without spacing that faces the light; a thousandth off for rounding
    vf least = vf_set(0.999f) * vf_layer_distance(view, test->args.instance.d_min, vf_zero(), f.z, vf_set(1.0f));
    f.behind = vm_and(inside, vf_lt(f.map + least, f.z));
    return f;
}

// Depths of the map around those of PT_LANES texels, or 0 beyond its edge.
struct around {
    vf z[8];
    vm known[8]; // on the map
};

static void look_around(const struct view_args *view, const uint64_t *keys, vi column, vi row, vm lanes, struct around *around)
{
    const vi next = vi_set(1), columns = vi_set(view->width), rows = vi_set(view->height);
    const vm west = vm_and(lanes, vi_lt_unsigned(vi_sub(column, next), columns));
    const vm east = vm_and(lanes, vi_lt_unsigned(vi_add(column, next), columns));
    for (uint32_t i = 0, k = 0; i < 3; i++) {
        const vi y = vi_sub(vi_add(row, vi_set(i)), next), at = vi_add(vi_mul(y, columns), column);
        const vm on = vi_lt_unsigned(y, rows), known[3] = {vm_and(west, on), vm_and(lanes, on), vm_and(east, on)};
        vi first[2], then[2]; // of the columns -1 and 0, and of 0 and 1
        vi_gather_two_z(keys, vi_sub(at, next), known[0], first);
        vi_gather_two_z(keys, at, known[1], then);
        const vi z[3] = {first[0], then[0], then[1]};
        for (uint32_t j = 0; j < 3; j++)
            if (i != 1 || j != 1) {
                around->known[k] = known[j];
                around->z[k++] = vi_float(z[j]);
            }
    }
}

// The greatest depth of the 3 x 3 texels that is not beyond `last`: a surface of unknown slope may be as far as its neighbours.
static vf farthest(const struct around *around, vf map, vf last)
{
    const vf empty = vf_set(pt_float(PT_KEY_EMPTY_Z));
    vf z = map;
    for (uint32_t i = 0; i < 8; i++)
        z = vf_select(vm_and(around->known[i], vm_and(vf_lt(around->z[i], empty), vf_le(around->z[i], last))),
                      vf_max(z, around->z[i]), z);
    return z;
}

// Which of `lanes` have a texel around that shows nothing.
static vm beside_nothing(const struct around *around, vm lanes)
{
    vm beside = vm_not(lanes);
    for (uint32_t i = 0; i < 8; i++)
        beside = vm_or(beside, vm_and(around->known[i], vf_le(vf_set(pt_float(PT_KEY_EMPTY_Z)), around->z[i])));
    return vm_and(lanes, beside);
}

// Those of `dark` that enough of the texels around shadow, too.
static vm supported(const struct around *around, vf d, vf z, vm dark)
{
    vi count = vi_set(0);
    for (uint32_t i = 0; i < 8; i++)
        count = vi_add(count, vi_select(vm_and(around->known[i], vf_lt(around->z[i] + d, z)), vi_set(1), vi_set(0)));
    return vm_and(dark, vm_not(vi_lt_unsigned(count, vi_set(PT_SHADOW_SUPPORT))));
}

// 2. d_eff of those of PT_LANES points in this view. *none: those without a normal.
static vf layer_distance(const struct shadow_test *test, const vf at[2], vf z, vi id, vm lanes, vm *none)
{
    const struct view_args *view = &test->args.view;
    const struct instance_args *instance = &test->args.instance;
    vi word = vi_gather(PT_DATA(test->call, shadow_test, surfels), id, lanes);
    vf spacing = vf_look_up(instance->spacing, PT_SPACINGS, vi_shr(word, PT_SPACING_SHIFT)), n[3];
    *none = vi_eq(vi_and(word, vi_set(PT_NORMAL_BITS)), vi_set(PT_NORMAL_NONE));
    if (!instance->has_normals)
        *none = lanes;
    vf_view_normal(instance, word, n);
    vf square = (n[0] * n[0] + n[1] * n[1]) + n[2] * n[2];
    *none = vm_and(lanes, vm_or(*none, vm_not(vf_le(vf_set(1e-30f), square))));
    vf scale = vf_rsqrt(square), ray[2];
    for (int k = 0; k < 3; k++)
        n[k] = n[k] * scale;
    ray[0] = vf_set(view->ray_x0) + vf_set(view->ray_xs) * at[0];
    ray[1] = vf_set(view->ray_y0) + vf_set(view->ray_ys) * at[1];
    vf inverse = vf_rcp(vf_max(vf_cosine(view, n, ray), vf_set(PT_COSINE_FLOOR)));
    return vf_layer_distance(view, instance->d_min, spacing, z, vf_select(*none, vf_set(1.0f), inverse));
}

// Which of PT_LANES points are in shadow.
static uint32_t in_shadow(const struct shadow_test *test, const struct fall *f, vi id)
{
    struct around around;
    vm none;
    vf d = layer_distance(test, f->at, f->z, id, f->behind, &none);
    vm dark = vm_and(f->behind, vf_lt(f->map + d, f->z));
    if (!vm_bits(dark))
        return 0;
    look_around(&test->args.view, PT_DATA(test->call, shadow_test, keys), f->column, f->row, dark, &around);
    none = vm_and(none, dark);
    if (vm_bits(none)) {
        vi source = pt_source_gather(PT_DATA(test->call, shadow_test, from), f->texel, none);
        vf shown = vf_gather(PT_DATA(test->call, shadow_test, deff), source, none), last = vf_set(pt_float(PT_KEY_EMPTY_Z));
        vf steep = vf_select(beside_nothing(&around, none), d * vf_set(PT_SHADOW_STEEP), d);
        if (test->args.view.perspective)
            last = f->map + vf_set(PT_SHADOW_APART) * shown;
        d = vf_select(none, vf_max(steep, shown), d);
        dark = vm_and(dark, vf_lt(vf_select(none, farthest(&around, f->map, last), f->map) + d, f->z));
    }
    return vm_bits(supported(&around, d, f->z, dark));
}

// 3. what the map takes of 255 from a point in the shadow of a texel.
static inline uint32_t loss_at(const struct shadow_test *test, uint32_t texel)
{
    if (!test->args.faint)
        return test->args.loss;
    const uint32_t *keys = PT_DATA(test->call, shadow_test, keys); // low words: ids
    const uint8_t *opacities = PT_DATA(test->call, shadow_test, opacities);
    return pt_shadow_share(test->args.loss, opacities[keys[2 * (size_t)texel] - test->args.caster]);
}

// Queues the points of PT_LANES slots from i on that `lanes` names.
static void enqueue(struct queue *queue, uint32_t i, const struct fall *fall, uint32_t lanes)
{
    const uint32_t count = queue->count;
    vi_pack(queue->slot + count, vi_add(vi_set(i), vi_lanes()), lanes);
    vi_pack(queue->column + count, fall->column, lanes);
    vi_pack(queue->row + count, fall->row, lanes);
    vi_pack(queue->texel + count, fall->texel, lanes);
    vi_pack(queue->behind + count, vi_select(fall->behind, vi_set(1), vi_set(0)), lanes);
    for (uint32_t k = 0; k < 2; k++)
        vi_pack(queue->at[k] + count, vf_bits(fall->at[k]), lanes);
    vi_pack(queue->z + count, vf_bits(fall->z), lanes);
    vi_pack(queue->map + count, vf_bits(fall->map), lanes);
    queue->count += (uint32_t)__builtin_popcount(lanes);
}

// PT_LANES queued points from i on.
static struct fall queued(const struct queue *queue, uint32_t i, vm lanes)
{
    return (struct fall){.at = {vi_float(vi_load(queue->at[0] + i)), vi_float(vi_load(queue->at[1] + i))},
                         .z = vi_float(vi_load(queue->z + i)),
                         .map = vi_float(vi_load(queue->map + i)),
                         .column = vi_load(queue->column + i),
                         .row = vi_load(queue->row + i),
                         .texel = vi_load(queue->texel + i),
                         .behind = vm_and(lanes, vi_eq(vi_load(queue->behind + i), vi_set(1)))};
}

// Queues those of BLOCK slots from `first` on that have to be tested, or looked at in any case.
static void fill_queue(const struct shadow_test *test, const struct chunk_view *chunk, const uint32_t *points, uint32_t first,
                       struct queue *queue)
{
    const struct shadow_test_args *args = &test->args;
    const uint32_t *marks = PT_DATA(test->call, shadow_test, marks); // none where none are asked for
    const uint32_t last = chunk->count - first < BLOCK ? chunk->count : first + BLOCK;
    queue->count = 0;
    for (uint32_t i = first; i < last; i += PT_LANES) {
        vm lanes = vm_first(pt_lanes_left(i, last));
        if (args->marked)
            lanes = pt_are_shown(marks, chunk->first + i, lanes);
        if (!vm_bits(lanes))
            continue;
        vf p[3];
        pt_load_points(chunk, points, i, p);
        const struct fall fall = fall_of(test, chunk, p, lanes);
        const uint32_t wanted = vm_bits(args->close || args->compare ? lanes : fall.behind); // lit ones too, to look at
        if (wanted)
            enqueue(queue, i, &fall, wanted);
    }
}

// Tests PT_LANES queued points from `at` on.
static uint32_t test_points(const struct shadow_test *test, const struct chunk_view *chunk, const struct queue *queue,
                            uint32_t at)
{
    const struct shadow_test_args *args = &test->args;
    const uint32_t *marks = PT_DATA(test->call, shadow_test, marks);
    uint32_t *words = (uint32_t *)PT_DATA(test->call, shadow_test, shadows) + args->base, differs = 0;
    const vm lanes = vm_first(pt_lanes_left(at, queue->count));
    const struct fall fall = queued(queue, at, lanes);
    const vi id = vi_add(vi_load(queue->slot + at), vi_set(chunk->first));
    const uint32_t shadowed = vm_bits(fall.behind) ? in_shadow(test, &fall, id) : 0;
    for (uint32_t left = args->close || args->compare ? vm_bits(lanes) : shadowed; left; left &= left - 1) {
        const uint32_t k = (uint32_t)__builtin_ctz(left), slot = chunk->first + queue->slot[at + k];
        // 4. what the sample takes goes into the word
        differs |= pt_shadow_note(words + pt_word_at(marks, args->marked, args->step, slot),
                                  shadowed >> k & 1u ? loss_at(test, queue->texel[at + k]) : 0, args->alone || args->close,
                                  args->samples);
    }
    return differs;
}

static uint32_t test_chunk(const struct shadow_test *test, const struct chunk_view *chunk)
{
    const uint32_t *points = pt_chunk_points(PT_DATA(test->call, shadow_test, positions), chunk);
    uint32_t differs = 0;
    struct queue queue;
    for (uint32_t first = 0; first < chunk->count; first += BLOCK) {
        fill_queue(test, chunk, points, first, &queue);
        for (uint32_t at = 0; at < queue.count; at += PT_LANES)
            differs |= test_points(test, chunk, &queue, at);
    }
    return differs;
}

static void test_chunks(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    const struct shadow_test *test = context;
    const struct chunk_view *chunks = PT_DATA(test->call, shadow_test, chunks);
    uint32_t differs = 0;
    (void)thread;
    for (uint32_t c = begin; c < end && !pt_cpu_cancelled(test->call); c++)
        differs |= test_chunk(test, &chunks[c]);
    if (differs && test->args.compare)
        __atomic_store_n((uint32_t *)PT_DATA(test->call, shadow_test, differs), 1, __ATOMIC_RELAXED);
}

int PT_KERNEL_ENTRY(shadow_test)(const struct pt_cpu_call *call)
{
    struct shadow_test test = {call, *(const struct shadow_test_args *)call->arguments};
    test.args.view.footprint = test.args.view.footprint * PT_TEXEL_SLACK;
    pt_parallel(call->pool, (uint32_t)(call->buffers[PT_BUF_shadow_test_chunks]->size / sizeof(struct chunk_view)), 4,
                test_chunks, &test);
    return pt_cpu_cancelled(call) ? PATINA_ERROR_CANCELLED : PATINA_OK;
}
