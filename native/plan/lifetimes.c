// SPDX-License-Identifier: GPL-3.0-or-later
// How long each plane is needed, told from the steps, and which of them share memory: a plane takes a slab whose last plane is done
// with. What readers and the next render need has memory of its own.
#include "passes.h"

#include <math.h>
#include <string.h>

enum { NO_LIFE = 0 };

struct builder_of_lives {
    struct pt_plan *plan;
    uint32_t (*of)[PT_SLOTS]; // 1 + the life at hand of a plane; NO_LIFE: none yet
    uint32_t clock;           // a pass, or as many as run as one, or a step
};

int pt_plane_is_kept(enum pt_plane which, uint32_t index)
{
    return pt_plane_rows[which].size == PT_SIZE_CROP || (which == PT_PLANE_KEYS && !index);
}

static void use(struct builder_of_lives *b, enum pt_plane which, uint32_t index)
{
    struct pt_plan *plan = b->plan;
    if (pt_plane_is_kept(which, index) || !pt_plan_plane_bytes(plan, which, index))
        return;
    if (b->of[which][index] == NO_LIFE) {
        plan->lives[plan->life_count++] = (struct pt_life){
            .plane = which, .index = index, .first = b->clock, .bytes = pt_plan_plane_bytes(plan, which, index)};
        b->of[which][index] = plan->life_count;
    }
    plan->lives[b->of[which][index] - 1].last = b->clock;
}

static void use_passes(struct builder_of_lives *b, uint32_t first, uint32_t count, int as_one)
{
    for (uint32_t i = first; i < first + count; i++) {
        b->plan->passes[i].when = b->clock;
        for (uint32_t k = 0; k < b->plan->passes[i].ref_count; k++) {
            const struct pt_ref *ref = &b->plan->passes[i].refs[k];
            const int known = ref->of == PT_OF_FRAME && b->of[ref->which][ref->index] != NO_LIFE;
            const int left = ref->which + 1 == b->plan->passes[first].leaves;
            if (ref->of == PT_OF_FRAME && (!as_one || known || left || pt_plane_rows[ref->which].carried))
                use(b, ref->which, ref->index);
        }
    }
    b->clock++;
}

static void use_step(struct builder_of_lives *b, struct pt_step *step, const struct pt_abilities *abilities)
{
    const struct pt_plan *plan = b->plan;
    step->when = b->clock;
    if (step->of == PT_STEP_CLEAR)
        use(b, step->plane.which, step->plane.index);
    if (step->of == PT_STEP_COVERED)
        use(b, PT_PLANE_TILES, PT_TILE_LEVEL);
    if (step->of == PT_STEP_LIGHT && plan->mesh.shadows) {
        use(b, PT_PLANE_MESH_SHOWN, 0);
        use(b, PT_PLANE_MESH_PLACES, 0);
        use(b, PT_PLANE_MESH_WORDS, 0);
    }
    for (uint32_t i = step->first; i < step->first + step->count;) {
        const uint32_t some = abilities->together ? abilities->together(abilities->device, &plan->passes[i]) : 0;
        const uint32_t taken = some ? some : 1;
        use_passes(b, i, taken, taken > 1);
        i += taken;
    }
    b->clock++;
}

// The slab that fits best, of those whose last plane is done with: the least that is large enough, else the largest, which grows.
static uint32_t slab_for(const struct pt_plan *plan, const struct pt_life *life)
{
    uint32_t best = plan->slab_count;
    for (uint32_t s = 0; s < plan->slab_count; s++) {
        const struct pt_slab *slab = &plan->slabs[s], *than = &plan->slabs[best];
        if (slab->last >= life->first)
            continue;
        const int fits = slab->bytes >= life->bytes,
                  better = best == plan->slab_count ||
                           (than->bytes >= life->bytes ? fits && slab->bytes < than->bytes : slab->bytes > than->bytes);
        if (better)
            best = s;
    }
    return best;
}

static void share(struct pt_plan *plan, int apart)
{
    for (uint32_t i = 0; i < plan->life_count; i++) { // in the order of their first uses
        struct pt_life *life = &plan->lives[i];
        life->slab = apart ? plan->slab_count : slab_for(plan, life);
        struct pt_slab *slab = &plan->slabs[life->slab];
        plan->slab_count += life->slab == plan->slab_count;
        slab->bytes = slab->bytes > life->bytes ? slab->bytes : life->bytes;
        slab->last = life->last;
    }
}

// Slabs that no plane needs at a time.
static uint64_t idle_at(const struct pt_plan *plan, uint32_t when)
{
    uint64_t busy = 0;
    for (uint32_t i = 0; i < plan->life_count; i++)
        if (plan->lives[i].first <= when && when <= plan->lives[i].last)
            busy |= (uint64_t)1 << plan->lives[i].slab % 64;
    return plan->slab_count <= 64 ? ~busy & (plan->slab_count == 64 ? ~(uint64_t)0 : ((uint64_t)1 << plan->slab_count) - 1) : 0;
}

// Kept planes of the picture: each once.
static uint64_t kept_bytes(const struct pt_plan *plan)
{
    uint64_t seen[PT_PLANE_COUNT] = {0}, bytes = pt_plan_plane_bytes(plan, PT_PLANE_KEYS, 0);
    for (uint32_t i = 0; i < plan->pass_count; i++)
        for (uint32_t k = 0; k < plan->passes[i].ref_count; k++) {
            const struct pt_ref *ref = &plan->passes[i].refs[k];
            if (ref->of != PT_OF_FRAME || pt_plane_rows[ref->which].size != PT_SIZE_CROP || seen[ref->which] >> ref->index & 1u)
                continue;
            seen[ref->which] |= (uint64_t)1 << ref->index;
            bytes += pt_plan_plane_bytes(plan, ref->which, ref->index);
        }
    return bytes;
}

// No camera that moves a little is to ask for other memory: up to an eighth more.
static uint64_t rounded_up(uint64_t count)
{
    uint64_t step = 1;
    while (count / step >= 16)
        step *= 2;
    return (count + step - 1) / step * step;
}

void pt_plan_set_bins(struct pt_plan *plan, uint32_t threads, uint64_t had)
{
    const uint32_t bins = pt_bins_of(&plan->view);
    plan->discs.bins = 0;
    if (!threads || !pt_plan_draws(plan, PT_AS_DISCS))
        return;
    const double full = 1.25 * plan->discs.entries / PT_BIN_DISCS, begun = (double)threads * (bins + PT_BIN_SHARE);
    const size_t most = (size_t)16 * UINT32_MAX; // what is wanted beyond is refused when it is asked for
    size_t bytes = pt_bins_bytes(bins, threads, rounded_up((uint64_t)fmin(full + begun, 4e9)));
    bytes = had > bytes && had / 4 < bytes ? (size_t)had : bytes;
    plan->discs.bins = (uint32_t)(((bytes < most ? bytes : most) + 15) / 16);
}

int pt_plan_share_planes(struct pt_plan *plan, const struct pt_abilities *abilities, int apart)
{
    enum { MOST_LIVES = PT_PLANE_COUNT * PT_SLOTS }; // one of each plane
    struct builder_of_lives b = {.plan = plan};
    b.of = pt_arena_take(&plan->arena, PT_PLANE_COUNT * sizeof *b.of);
    plan->lives = pt_arena_take(&plan->arena, MOST_LIVES * sizeof *plan->lives);
    plan->slabs = pt_arena_take(&plan->arena, (MOST_LIVES + 1) * sizeof *plan->slabs);
    if (!b.of || !plan->lives || !plan->slabs)
        return PATINA_ERROR_MEMORY;
    pt_plan_set_bins(plan, abilities->bin_threads, abilities->bins_had);
    for (uint32_t i = 0; i < plan->step_count; i++)
        use_step(&b, &plan->steps[i], abilities);
    share(plan, apart);
    for (uint32_t i = 0; i < plan->step_count; i++)
        if (plan->steps[i].of == PT_STEP_LIGHT)
            plan->steps[i].idle = idle_at(plan, plan->steps[i].when);
    plan->peak = kept_bytes(plan);
    for (uint32_t s = 0; s < plan->slab_count; s++)
        plan->peak += plan->slabs[s].bytes;
    return PATINA_OK;
}
