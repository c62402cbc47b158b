// SPDX-License-Identifier: GPL-3.0-or-later
#include "pager.h"

#include "hiding.h"
#include "page_check.h"

#include "base/platform.h"
#include "residency.h"
#include "scene/clouds/page_sums.h"

#include <stdlib.h>
#include <string.h>

enum {
    SHARE = 3,     // of the free memory
    OWN_SHARE = 3, // of OWN_OF parts of a device's own memory: planes need the rest
    OWN_OF = 4,
    HIDING_STEPS = 64,      // of scatter at most: later ones leave out what those before them hide
    HIDING_LEAST = 1 << 20, // bytes a step
    HIDING_WORTH = 16,      // steps, below which all is read at one go
    HIDING_HOLDS = 2, // times what it reads: the system maps what lies beside it in the file, which is not of the same step
    LEAST = 64 << 20, // bytes, however little is free: less would be read over and over
    ROUNDS_A_CAP = 2, // the last round's pages and this one's
    ROOM_OF = 8,      // of the cap are left free at least when all is given back, for threads read on meanwhile
    ROOM = 32 << 20,  // or so much where half of it allows: Linux 6.18 maps a whole folio at one touch, up to 2 MB
    TAKEN = 50000,    // bytes a microsecond, that threads take at most of a file that lies in the system's memory
};

// Clouds that several instances show count once.
static int is_first(const struct patina_scene *scene, uint32_t i)
{
    for (uint32_t k = 0; k < i; k++)
        if (scene->instances[k].cloud == scene->instances[i].cloud)
            return 0;
    return 1;
}

static uint64_t mapped_bytes(const struct patina_scene *scene)
{
    uint64_t bytes = 0;
    for (uint32_t i = 0; i < scene->cloud_count; i++)
        bytes += scene->instances[i].cloud->mapped && is_first(scene, i) ? pt_cloud_mapped_bytes(scene->instances[i].cloud) : 0;
    return bytes;
}

static uint64_t share_of_free(void)
{
    const uint64_t free_bytes = pt_free_memory(), share = free_bytes / SHARE;
    return !free_bytes ? UINT64_MAX : share < LEAST ? LEAST : share; // where nobody knows, all may be held
}

// ---- a device that copies clouds -----------------------------------------------------------------------------------------

// What a scene's clouds take there, and what the largest of their chunks takes.
static uint64_t copied_bytes(const struct patina_scene *scene, uint64_t *chunk)
{
    uint64_t bytes = 0;
    *chunk = 0;
    for (uint32_t i = 0; i < scene->cloud_count; i++) {
        const struct patina_cloud *cloud = scene->instances[i].cloud;
        const uint64_t all = is_first(scene, i) ? pt_cloud_copied_bytes(cloud) : 0;
        const uint64_t most = all ? all / cloud->slots * pt_cloud_largest_chunk(cloud) : 0;
        bytes += all;
        *chunk = most > *chunk ? most : *chunk;
    }
    return bytes;
}

static uint64_t lesser(uint64_t a, uint64_t b) { return a < b ? a : b; }

// The cap that was given counts what is mapped, the device's memory all there is. 0: they lie there whole.
static uint64_t cap_of_copies(const struct patina_device *device, const struct patina_scene *scene, uint64_t mapped,
                              uint64_t *round)
{
    const uint64_t own = device->own_memory / OWN_OF * OWN_SHARE, failed = device->ranges.failed;
    uint64_t chunk, cap = device->mapped_cap && mapped > device->mapped_cap ? device->mapped_cap : UINT64_MAX;
    const uint64_t bytes = copied_bytes(scene, &chunk);
    if (own && bytes > own)
        cap = lesser(cap, own);
    if (failed && bytes >= failed)
        cap = lesser(cap, ROUNDS_A_CAP * PT_RANGE_LEAST);
    cap = cap == UINT64_MAX ? 0 : cap;
    *round = cap / ROUNDS_A_CAP;
    return cap;
}

// Ranges are of a chunk at least, and there are two of them.
static int open_copies(struct pt_pager *pager, struct patina_device *device)
{
    uint64_t chunk;
    copied_bytes(pager->scene, &chunk);
    device->ranges = (struct pt_ranges){.most = pager->round, .failed = device->ranges.failed};
    if (pager->cap && pager->round < chunk) {
        device->ranges.most = 0;
        return pt_fail(
            &device->handle, PATINA_ERROR_MEMORY,
            "%s: a cap of %.3f MB is too small for two ranges of points: a range is a chunk at least, of which one takes "
            "%.3f MB here",
            device->info.name, 1e-6 * (double)pager->cap, 1e-6 * (double)chunk);
    }
    return PATINA_OK;
}

// ---- the cap -------------------------------------------------------------------------------------------------------------

// 0: all of it fits.
static uint64_t cap_for(const struct patina_device *device, const struct patina_scene *scene, uint64_t mapped, uint64_t *round)
{
    *round = 0;
    if (device->copies)
        return cap_of_copies(device, scene, mapped, round);
    if (!mapped)
        return 0;
    const uint64_t cap = device->mapped_cap ? device->mapped_cap : share_of_free();
    *round = cap / ROUNDS_A_CAP;
    return mapped > cap ? cap : 0;
}

uint64_t pt_pager_cap(const struct patina_device *device, const struct patina_scene *scene, uint64_t *round)
{
    return cap_for(device, scene, mapped_bytes(scene), round);
}

// ---- giving back ---------------------------------------------------------------------------------------------------------

static uint64_t held_now(const struct pt_pager *pager)
{
    const uint64_t now = pt_file_memory();
    return !pager->before ? pager->cap : now > pager->before ? now - pager->before : 0; // where nobody knows, all there may be
}

static void give_back(struct pt_pager *pager)
{
    for (uint32_t i = 0; i < pager->scene->cloud_count; i++)
        if (pager->scene->instances[i].cloud->mapped)
            pt_cloud_return(pager->scene->instances[i].cloud);
}

// Gives all back where `more` bytes do not fit beside what is held.
static void make_room(struct pt_pager *pager, uint64_t more)
{
    const uint64_t held = held_now(pager);
    uint64_t most = atomic_load(&pager->held);
    while (held > most && !atomic_compare_exchange_weak(&pager->held, &most, held))
        ;
    if (!held || held + more <= pager->cap)
        return;
    give_back(pager);
    atomic_fetch_add(&pager->returned, 1);
}

static uint64_t left_free(uint64_t cap)
{
    const uint64_t least = cap / ROOM_OF, most = cap / 2;
    return ROOM < least ? least : ROOM < most ? ROOM : most;
}

// Of the device's threads: one looks, the others go on.
static void look(void *context)
{
    struct pt_pager *pager = context;
    if (pt_look_is_due(&pager->look))
        make_room(pager, left_free(pager->cap));
}

// ---- damaged pages -------------------------------------------------------------------------------------------------------

// Where all fits, of a chunk that a pass walks all that the file has; else, for it would be read in vain, what says where its points are.
static uint32_t looked_at(const struct pt_pager *pager) { return pager->cap ? 1u << PT_ARRAY_POSITIONS : UINT32_MAX; }

static void make_room_for(void *pager, uint64_t more) { make_room(pager, more); }

// What a pass walks of files: all of its lists, of which no more is held than of a pass in rounds.
static int check_lists(struct pt_pager *pager, const struct pt_pass *pass, const struct pt_chunk_list *lists, uint32_t count)
{
    const struct pt_check how = {looked_at(pager), pass->output ? NULL : pager->cancel, make_room_for, look, pager};
    const uint64_t most = pager->cap ? pager->round : UINT64_MAX;
    int found = PATINA_OK;
    for (struct pt_chunk_range range = {0}; found >= 0 && pt_next_range(lists, count, most, &range);) {
        const int one = pt_check_range(&how, lists, &range);
        found = one ? one : found;
    }
    for (uint32_t i = 0; i < count; i++)
        pt_pages_tell(lists[i].cloud);
    return found;
}

static int check_clouds(const struct pt_pager *pager)
{
    const struct pt_check how = {UINT32_MAX, pager->cancel, NULL, NULL, NULL};
    int found = PATINA_OK;
    for (uint32_t i = 0; i < pager->scene->cloud_count && found >= 0; i++) {
        const struct patina_cloud *cloud = pager->scene->instances[i].cloud;
        const int one = pt_check_cloud(&how, cloud);
        found = one ? one : found;
        pt_pages_tell(cloud);
    }
    return found;
}

static uint32_t lost_pages(const struct patina_scene *scene)
{
    uint32_t lost = 0;
    for (uint32_t i = 0; i < scene->cloud_count; i++)
        lost += pt_is_first_part(scene, i) ? pt_pages_lose(scene->instances[i].whole) : 0;
    return lost;
}

void pt_pager_prepare(struct pt_pager *pager, const struct patina_scene *scene)
{
    if (mapped_bytes(scene))
        pt_disk_watch();
    pager->losses = pt_disk_losses();
    pager->lost = lost_pages(scene);
}

int pt_pager_lose(struct pt_pager *pager)
{
    const uint64_t losses = pt_disk_losses(); // before they are looked for: those that come meanwhile are found next time
    if (!pager || losses == pager->losses)
        return PATINA_OK;
    const uint32_t before = pager->lost;
    pager->losses = losses;
    pager->lost = lost_pages(pager->scene);
    return pager->lost == before ? PATINA_OK : PT_AGAIN;
}

int pt_pager_open(struct pt_pager *pager, struct patina_device *device, const struct patina_scene *scene)
{
    pager->device = device;
    pager->scene = scene;
    pager->mapped = mapped_bytes(scene);
    if (pt_pager_lose(pager)) // since the plan was begun, which has them all
        return PT_AGAIN;
    pager->cap = cap_for(device, scene, pager->mapped, &pager->round);
    const int error = device->copies ? open_copies(pager, device) : PATINA_OK;
    if (error)
        return error;
    for (uint32_t i = 0; i < scene->cloud_count; i++) // what others found, who draw nothing
        pt_pages_tell(scene->instances[i].cloud);
    if (device->copies && pager->mapped && !pager->cap) { // it takes all of them
        const int damaged = check_clouds(pager);
        if (damaged)
            return damaged;
    }
    if (!pager->cap || !pager->mapped)
        return PATINA_OK;
    give_back(pager);
    pager->before = pt_file_memory();
    pt_look_begin(&pager->look, pager->cap, TAKEN);
    device->ops->watch(device, look, pager);
    return PATINA_OK;
}

void pt_pager_close(struct pt_pager *pager)
{
    pt_sieves_free(&pager->sieves);
    if (pager->device->copies) {
        pager->read += pager->device->ranges.read;
        pager->rounds = pager->device->ranges.rounds > pager->rounds ? pager->device->ranges.rounds : pager->rounds;
        pager->rounds += pager->mapped && !pager->rounds; // whole: in one
    }
    if (!pager->cap || !pager->mapped)
        return;
    make_room(pager, 0);
    pager->device->ops->watch(pager->device, NULL, NULL);
}

// ---- rounds --------------------------------------------------------------------------------------------------------------

int pt_pager_begin_pass(struct pt_pager *pager, const struct pt_plan *plan, const struct pt_pass *pass, const patina_part *part)
{
    if (!pager || !pager->mapped || !pager->device->copies || !pager->cap ||
        (pager->merged && pt_pass_role(pass) == PT_ROLE_KEYS))
        return PATINA_OK;
    struct pt_chunk_list *lists = calloc(pass->ref_count + 1u, sizeof *lists);
    if (!lists)
        return pt_fail(&pager->device->handle, PATINA_ERROR_MEMORY, "looking at pages of files: out of memory");
    const uint32_t count = pt_pass_lists(plan, pass, lists);
    for (uint32_t i = 0; i < count && part; i++) {
        const uint64_t all = lists[i].count, first = pt_share_before(part, part->part - 1, all);
        lists[i].chunks += first;
        lists[i].count = (uint32_t)(pt_share_before(part, part->part, all) - first);
    }
    const int error = check_lists(pager, pass, lists, count);
    free(lists);
    return error;
}

int pt_pager_begin(struct pt_pager *pager, const struct pt_plan *plan)
{
    int found = PATINA_OK;
    for (uint32_t i = 0; i < plan->pass_count && found >= 0; i++) {
        const int one = pt_pager_begin_pass(pager, plan, &plan->passes[i], NULL);
        found = one ? one : found;
    }
    return found;
}

// What a range of lists is of one of them: [first, end).
static void part_of(const struct pt_chunk_list *lists, const struct pt_chunk_range *range, uint32_t list, uint32_t *first,
                    uint32_t *end)
{
    *first = list == range->list ? range->chunk : 0;
    *end = list < range->end_list ? lists[list].count : range->end_chunk;
    if (list < range->list || list > range->end_list)
        *first = *end = 0;
}

// The disk may begin with it: chunks that lie beside each other at one go.
static void expect(const struct pt_chunk_list *lists, uint32_t count, const struct pt_chunk_range *range)
{
    for (uint32_t i = range->list; i < count && i <= range->end_list; i++) {
        uint32_t first, end;
        part_of(lists, range, i, &first, &end);
        for (uint32_t c = first; c < end;) {
            const struct chunk_view *chunk = &lists[i].chunks[c++];
            uint64_t slots = (uint64_t)chunk->first + chunk->padded;
            for (; c < end && lists[i].chunks[c].first == slots && lists[i].chunks[c].cull == chunk->cull; c++)
                slots += lists[i].chunks[c].padded;
            pt_cloud_expect(lists[i].cloud, lists[i].arrays & ~(chunk->cull ? 0 : lists[i].culled), chunk->first, slots);
        }
    }
}

struct bound {
    const struct pt_chunk_list *lists, *all; // all: before chunks without a mark were left out
    struct pt_late_sieve **sieves;           // of the lists: NULL, or what runs on a range before the pass does
    struct pt_buffer *parts;                 // of the lists
    struct pt_buffer **buffers;
    uint32_t count;
    uint64_t most;           // bytes that a range reads
    struct pt_hiding hiding; // no memory: nothing is hidden
};

struct drawn {                         // at a time
    const struct pt_chunk_list *lists; // the pass's, or all of their own
    struct pt_chunk_range range;
};

// Where all fits, the kernel alone leaves out what is hidden: steps take scatter a tenth longer.
static int hides(const struct pt_pager *pager, const struct pt_pass *pass, uint64_t bytes)
{
    return pager->cap && pt_pass_role(pass) == PT_ROLE_KEYS && bytes >= (uint64_t)HIDING_WORTH * HIDING_LEAST;
}

static void begin_hiding(const struct pt_pass *pass, struct pt_buffer *const *buffers, uint64_t bytes, struct bound *bound)
{
    uint32_t width, height;
    const uint64_t *keys = buffers[pt_pass_keys(pass, &width, &height)]->data;
    const uint64_t step = bytes / HIDING_STEPS;
    if (pt_hiding_begin(&bound->hiding, bound->lists, bound->count, keys, width, height))
        bound->most = lesser(bound->most, step > HIDING_LEAST ? step : HIDING_LEAST);
}

// The one after *drawn, which begins as nothing.
static int next_range(struct bound *bound, struct drawn *drawn)
{
    if (!bound->hiding.memory) {
        drawn->lists = bound->lists;
        return pt_next_range(bound->lists, bound->count, bound->most, &drawn->range);
    }
    drawn->range = (struct pt_chunk_range){.end_list = bound->count};
    return (drawn->lists = pt_hiding_next(&bound->hiding, bound->most, &drawn->range.bytes)) != NULL;
}

static int run_range(const struct bound *bound, struct pt_buffer *const *whole, const struct drawn *drawn, pt_run_bound *run,
                     void *context)
{
    for (uint32_t i = 0; i < bound->count; i++) {
        const struct pt_chunk_list *list = &drawn->lists[i];
        uint32_t first, end;
        part_of(drawn->lists, &drawn->range, i, &first, &end);
        bound->parts[i] = *whole[list->ref];
        bound->parts[i].data = (void *)(uintptr_t)(list->chunks + first); // which kernels only read
        bound->parts[i].size = (end - first) * sizeof *list->chunks;
        bound->buffers[list->ref] = &bound->parts[i];
        const int error = bound->sieves[i] && end > first ? pt_sieve_run(bound->sieves[i], &bound->parts[i]) : PATINA_OK;
        if (error)
            return error;
    }
    return run(context, bound->buffers);
}

// What is damaged of a range: where something is, all others are looked at too, for the picture is planned once more then.
static int check_range(struct pt_pager *pager, const struct pt_pass *pass, const struct bound *bound, const struct drawn *drawn)
{
    const struct pt_check how = {looked_at(pager), pass->output ? NULL : pager->cancel, NULL, look, pager};
    const int found = pt_check_range(&how, drawn->lists, &drawn->range);
    const int more = found == PT_AGAIN ? check_lists(pager, pass, bound->all, bound->count) : PATINA_OK;
    return more < 0 ? more : found;
}

// One after another; while one is drawn, the disk reads the next, which the keys of the one before that left open.
static int run_ranges(struct pt_pager *pager, const struct pt_pass *pass, struct bound *bound, struct pt_buffer *const *whole,
                      pt_run_bound *run, void *context)
{
    struct drawn drawn = {0}, next;
    int error = PATINA_OK, some = next_range(bound, &drawn);
    if (some)
        expect(drawn.lists, bound->count, &drawn.range);
    while (some && !error) {
        next = drawn;
        some = next_range(bound, &next);
        if (some)
            expect(next.lists, bound->count, &next.range);
        make_room(pager, bound->hiding.memory ? HIDING_HOLDS * drawn.range.bytes : drawn.range.bytes);
        error = check_range(pager, pass, bound, &drawn);
        error = error ? error : run_range(bound, whole, &drawn, run, context);
        pager->read += drawn.range.bytes;
        drawn = next;
    }
    return error;
}

// Whether some slot of the chunk is marked: PT_MARK_SLOTS.
static int is_marked(const uint32_t *marks, const struct chunk_view *chunk)
{
    for (uint32_t slot = chunk->first, end = chunk->first + chunk->padded; slot < end;) {
        const uint32_t at = slot % PT_MARK_SLOTS, left = PT_MARK_SLOTS - at, count = left < end - slot ? left : end - slot;
        const uint32_t own = (count < PT_MARK_SLOTS ? (1u << count) - 1 : UINT32_MAX) << at;
        if (marks[2 * (size_t)(slot / PT_MARK_SLOTS)] & own)
            return 1;
        slot += count;
    }
    return 0;
}

// Leaves out the chunks that no point of is marked: nothing of them is tested, and nothing need be read. Returns where the list lies from
// now on; NULL: as it was.
static struct chunk_view *keep_marked(const struct pt_pager *pager, const struct pt_pass *pass,
                                      struct pt_buffer *const *buffers, struct pt_chunk_list *list)
{
    const int ref = pager->cap ? pt_pass_marks(pass) : -1;
    struct chunk_view *kept = ref < 0 ? NULL : malloc((list->count + 1) * sizeof *kept);
    uint32_t count = 0;
    if (!kept)
        return NULL;
    for (uint32_t c = 0; c < list->count; c++)
        if (is_marked(buffers[ref]->data, &list->chunks[c]))
            kept[count++] = list->chunks[c];
    list->chunks = kept;
    list->count = count;
    return kept;
}

// Finds the sieves that wait for a pass. Its lists then read what these read, too.
static void find_sieves(struct pt_pager *pager, const struct pt_plan *plan, const struct pt_pass *pass, struct bound *bound,
                        struct pt_chunk_list *lists)
{
    for (uint32_t i = 0; i < bound->count; i++) {
        bound->sieves[i] = pt_sieve_of(pager->sieves, plan, pass, lists[i].ref);
        if (bound->sieves[i])
            pt_sieve_join(bound->sieves[i], &lists[i]);
    }
}

static int run_pass(struct pt_pager *pager, const struct pt_plan *plan, const struct pt_pass *pass,
                    struct pt_buffer *const *buffers, pt_run_bound *run, void *context)
{
    struct pt_chunk_list *lists = calloc(2 * (pass->ref_count + 1u), sizeof *lists);
    struct bound bound = {.lists = lists, .most = pager->round, .sieves = calloc(pass->ref_count + 1u, sizeof *bound.sieves)};
    struct chunk_view *marked = NULL;
    uint64_t bytes = 0;
    uint32_t ranges = 0;
    if (!lists || !bound.sieves) {
        free(lists);
        free(bound.sieves);
        return pt_fail(&pager->device->handle, PATINA_ERROR_MEMORY, "looking at pages of files: out of memory");
    }
    bound.count = pt_pass_lists(plan, pass, lists);
    find_sieves(pager, plan, pass, &bound, lists);
    for (uint32_t i = 0; i < bound.count; i++) { // of a layer or a part they are not all that was planned
        struct pt_chunk_list *list = &lists[i];
        list->chunks = buffers[list->ref]->data ? buffers[list->ref]->data : list->chunks;
        list->count = (uint32_t)(buffers[list->ref]->size / sizeof *list->chunks);
    }
    bound.all = memcpy(lists + pass->ref_count + 1, lists, bound.count * sizeof *lists);
    marked = bound.count == 1 ? keep_marked(pager, pass, buffers, &lists[0]) : NULL;
    ranges = pt_count_ranges(lists, bound.count, pager->cap ? pager->round : UINT64_MAX, &bytes);
    ranges = ranges > 1 && !pt_pass_divides(pass) ? 1 : ranges;
    pager->rounds = ranges > pager->rounds ? ranges : pager->rounds;
    const int hiding = hides(pager, pass, bytes);
    if (ranges > 1 || hiding || marked) {
        bound.parts = calloc(bound.count, sizeof *bound.parts);
        bound.buffers = calloc(pass->ref_count, sizeof *bound.buffers);
    }
    int error;
    if (bound.parts && bound.buffers) {
        memcpy(bound.buffers, buffers, pass->ref_count * sizeof *bound.buffers);
        if (hiding)
            begin_hiding(pass, buffers, bytes, &bound);
        error = run_ranges(pager, pass, &bound, buffers, run, context);
    } else { // in one, which need not be held whole: whoever runs it looks after that
        pager->read += bytes;
        error = check_lists(pager, pass, lists, bound.count);
        for (uint32_t i = 0; i < bound.count && !error; i++)
            error = bound.sieves[i] ? pt_sieve_run(bound.sieves[i], buffers[lists[i].ref]) : PATINA_OK;
        error = error ? error : run(context, buffers);
    }
    pt_hiding_end(&bound.hiding);
    for (uint32_t i = 0; i < bound.count; i++)
        if (bound.sieves[i])
            pt_sieve_drop(&pager->sieves, bound.sieves[i]);
    free(bound.sieves);
    free(marked);
    free(lists);
    free(bound.parts);
    free(bound.buffers);
    return error;
}

int pt_pager_run(struct pt_pager *pager, const struct pt_plan *plan, const struct pt_pass *pass,
                 struct pt_buffer *const *buffers, pt_run_bound *run, void *context, size_t context_size)
{
    const int alone = !pager || !pager->mapped || pager->device->copies; // a device that copies looks after its ranges itself
    if (!alone && pager->cap && !pager->merged && pt_sieve_waits(plan, pass))
        return pt_sieve_keep(&pager->sieves, plan, pass, buffers, run, context, context_size)
                   ? pt_fail(&pager->device->handle, PATINA_ERROR_MEMORY, "looking at pages of files: out of memory")
                   : PATINA_OK;
    const int error = alone ? run(context, buffers) : run_pass(pager, plan, pass, buffers, run, context);
    return error ? error : pt_pager_lose(pager);
}
