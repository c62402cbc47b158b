// SPDX-License-Identifier: GPL-3.0-or-later
// Passes of a step, one after another, or as one where the device takes some so.
#include "execute.h"

#include <stdlib.h>
#include <string.h>

static int is_output(const struct pt_pass *pass) { return pass->output; }

// The pass's arguments, with what is known late.
static int arguments_of(struct pt_execution *e, uint32_t i, const void **out)
{
    const struct pt_pass *pass = &e->plan->passes[i];
    const struct pt_shadows *shadows = e->binder.shadows;
    const int of_pixels = pass->late == PT_LATE_PIXELS;
    struct pt_words words = {.step = shadows->of_marked && !of_pixels ? shadows->light_count : 0};
    *out = pass->arguments;
    if (pass->late == PT_LATE_NOTHING)
        return PATINA_OK;
    if (!e->late[i] && !(e->late[i] = malloc(pass->argument_size)))
        return pt_fail(&e->device->handle, PATINA_ERROR_MEMORY, "a frame: out of memory");
    for (uint32_t k = 0; k < PT_MAX_LIGHTS; k++)
        words.samples[k] = of_pixels ? shadows->pixels.samples[k] : shadows->lights[k].samples;
    memcpy(e->late[i], pass->arguments, pass->argument_size);
    pt_plan_late(pass, &words, e->late[i]);
    *out = e->late[i];
    return PATINA_OK;
}

struct call { // of a pass whose buffers are bound
    struct pt_execution *execution;
    const struct pt_pass *pass;
    const void *arguments;
};

// The picture is written last, and at one go where the frame holds an earlier one: a cancelled frame leaves that.
static int run_bound(void *context, struct pt_buffer *const *buffers)
{
    const struct call *call = context;
    struct pt_execution *e = call->execution;
    return e->device->ops->run(e->device, call->pass->kernel, call->arguments, call->pass->argument_size, buffers,
                               call->pass->ref_count, pt_polled(e));
}

// Bins that the pass found too small; 0: there are none.
static int grow_bins(struct pt_execution *e, const struct pt_pass *pass, struct pt_buffer **bound)
{
    for (uint32_t k = 0; k < pass->ref_count; k++)
        if (pass->refs[k].of == PT_OF_FRAME && bound[k]->wanted > bound[k]->size)
            return pt_planes_grow(e->device, e->binder.planes, e->plan, pass->refs[k].which, bound[k]->wanted);
    return PATINA_ERROR_INTERNAL;
}

// Planes that lie between passes that run as one are neither made nor written. Those that go from layer to layer are, and what `first`
// says that they leave.
static int is_made(const struct pt_pass *first, const struct pt_ref *ref)
{
    return ref->of != PT_OF_FRAME || pt_plane_rows[ref->which].carried || ref->which + 1 == first->leaves;
}

// Counts what a pass reads and writes. first: of the passes that run as one with it; NULL: it runs alone.
static void note_bytes(struct pt_execution *e, const struct pt_pass *first, const struct pt_pass *pass,
                       struct pt_buffer *const *bound)
{
    const struct pt_kernel_row *row = &pt_kernels[pass->kernel];
    for (uint32_t k = 0; k < pass->ref_count; k++) {
        const struct pt_buffer_row *buffer = &row->buffers[k < row->fixed ? k : row->fixed + (k - row->fixed) % row->each];
        if (bound[k] && (!first || is_made(first, &pass->refs[k])))
            e->times->bytes += (uint64_t)bound[k]->size * (uint64_t)(buffer->read + buffer->written);
    }
}

static int run_pass(struct pt_execution *e, uint32_t i)
{
    const struct pt_pass *pass = &e->plan->passes[i];
    if (e->merge && pt_is_of_parts(pass)) {
        const int taken = pt_merge_take(e->merge, &e->binder, e->scene, pass, &e->round);
        if (taken || pt_pass_role(pass) == PT_ROLE_KEYS)
            return taken;
        // what discs show follows: those before the settled depths are found once more, and no key changes
    }
    const void *arguments;
    struct pt_buffer *few[16], **bound = pass->ref_count <= 16 ? few : calloc(pass->ref_count, sizeof *bound);
    int error = bound ? arguments_of(e, i, &arguments)
                      : pt_fail(&e->device->handle, PATINA_ERROR_MEMORY, "a frame: out of memory");
    for (uint32_t k = 0; k < pass->ref_count && !error; k++)
        error = pt_bind(&e->binder, &pass->refs[k], &bound[k]);
    if (!error) {
        note_bytes(e, NULL, pass, bound);
        struct call call = {e, pass, arguments};
        do
            error = pt_pager_run(e->pager, e->plan, pass, bound, run_bound, &call, sizeof call);
        while (error == PT_MORE_ROOM && !(error = grow_bins(e, pass, bound)));
    }
    if (bound != few)
        free(bound);
    return error;
}

static int bind_between(struct pt_binder *binder, const struct pt_pass *first, const struct pt_ref *ref, struct pt_buffer **out)
{
    const struct pt_ref as_it_is = {PT_OF_LEFT, ref->which, ref->index};
    return pt_bind(binder, is_made(first, ref) ? ref : &as_it_is, out);
}

uint32_t pt_passes_together(const void *of, const struct pt_pass *passes)
{
    const struct patina_device *device = of;
    struct pt_bound_pass some[64]; // not bound yet
    if (!passes->together || !device->ops->run_tail ||
        (device->ops->tail_length && passes->together > sizeof some / sizeof *some))
        return 0;
    if (!device->ops->tail_length)
        return passes->together;
    for (uint32_t i = 0; i < passes->together; i++)
        some[i] = (struct pt_bound_pass){.kernel = passes[i].kernel, .arguments = passes[i].arguments};
    return device->ops->tail_length(some, passes->together);
}

static int run_together(struct pt_execution *e, uint32_t first, uint32_t count)
{
    const struct pt_pass *passes = e->plan->passes + first;
    uint32_t refs = 0;
    for (uint32_t i = 0; i < count; i++)
        refs += passes[i].ref_count;
    struct pt_bound_pass *bound = calloc(count, sizeof *bound);
    struct pt_buffer **buffers = calloc(refs, sizeof *buffers), **next = buffers;
    int error = bound && buffers ? PATINA_OK : pt_fail(&e->device->handle, PATINA_ERROR_MEMORY, "a frame: out of memory");
    for (uint32_t i = 0; i < count && !error; i++) {
        bound[i] = (struct pt_bound_pass){passes[i].kernel, NULL, next, passes[i].ref_count, passes[i].argument_size};
        error = arguments_of(e, first + i, &bound[i].arguments);
        for (uint32_t k = 0; k < passes[i].ref_count && !error; k++)
            error = bind_between(&e->binder, passes, &passes[i].refs[k], next++);
        if (!error)
            note_bytes(e, passes, &passes[i], bound[i].buffers);
    }
    if (!error)
        error = e->device->ops->run_tail(e->device, bound, count, pt_polled(e));
    free(bound);
    free(buffers);
    return error;
}

static int is_cancelled(const struct pt_execution *e)
{
    const atomic_int *cancel = pt_polled(e);
    return cancel && atomic_load(cancel);
}

// A pass, or `count` as one.
static int run_some(struct pt_execution *e, uint32_t first, uint32_t count)
{
    const int output = is_output(&e->plan->passes[first + count - 1]);
    const uint32_t when = e->plan->passes[first].when;
    if (is_cancelled(e))
        return PATINA_ERROR_CANCELLED;
    if (!e->writing && output) {
        const int error = pt_planes_ensure_picture(e->device, e->binder.planes, e->plan);
        if (error)
            return error;
        e->writing = 1;
    }
    int error = pt_planes_poison(e->device, e->binder.planes, e->plan, when, 0);
    if (!error)
        error = count > 1 ? run_together(e, first, count) : run_pass(e, first);
    return error ? error : pt_planes_poison(e->device, e->binder.planes, e->plan, when, 1);
}

// ---- or handed over at one go --------------------------------------------------------------------------------------------

static uint32_t taken_at(const struct pt_execution *e, uint32_t i)
{
    const uint32_t some = pt_passes_together(e->device, &e->plan->passes[i]);
    return some ? some : 1;
}

static const char *name_of(const struct pt_execution *e, uint32_t i, uint32_t taken)
{
    return taken > 1 ? "tail" : e->plan->passes[i].name;
}

// Passes from `first` on that need no decision between them: up to those that write the picture, or these.
static uint32_t handed_over(const struct pt_execution *e, uint32_t first, uint32_t end)
{
    uint32_t i = first;
    for (uint32_t taken; i < end && !e->writing; i += taken) {
        taken = taken_at(e, i);
        if (is_output(&e->plan->passes[i + taken - 1]))
            break;
    }
    return e->writing ? end : i;
}

// What passes bind, and which of them run as one.
static int bind_groups(struct pt_execution *e, uint32_t first, uint32_t end, struct pt_bound_pass *bound,
                       struct pt_buffer **buffers, struct pt_group *groups, uint32_t *count)
{
    int error = PATINA_OK;
    for (uint32_t i = first, taken; i < end && !error; i += taken) {
        struct pt_group *group = &groups[(*count)++];
        const uint64_t bytes = e->times->bytes;
        taken = taken_at(e, i);
        *group = (struct pt_group){.passes = bound,
                                   .count = taken,
                                   .done = e->progress_done +
                                           e->progress_share * (float)(i + taken) / (float)e->plan->pass_count};
        for (uint32_t k = i; k < i + taken && !error; k++, bound++) {
            const struct pt_pass *pass = &e->plan->passes[k];
            *bound = (struct pt_bound_pass){pass->kernel, NULL, buffers, pass->ref_count, pass->argument_size};
            error = arguments_of(e, k, &bound->arguments);
            for (uint32_t r = 0; r < pass->ref_count && !error; r++, buffers++)
                error = taken > 1 ? bind_between(&e->binder, &e->plan->passes[i], &pass->refs[r], buffers)
                                  : pt_bind(&e->binder, &pass->refs[r], buffers);
            if (!error)
                note_bytes(e, taken > 1 ? &e->plan->passes[i] : NULL, pass, bound->buffers);
        }
        group->bytes = e->times->bytes - bytes;
    }
    return error;
}

// followed: the next group's time is in that of this one.
static void note_group(struct pt_execution *e, const char *name, const struct pt_group *group, int followed)
{
    if (!group->joined)
        pt_note_time(e->times, followed ? "pixels" : name, group->ms);
    pt_note_work(e->times, name, group->bytes, &group->counts);
}

static int hand_over(struct pt_execution *e, uint32_t first, uint32_t end)
{
    uint32_t refs = 0, count = 0;
    for (uint32_t i = first; i < end; i++)
        refs += e->plan->passes[i].ref_count;
    struct pt_bound_pass *bound = calloc(end - first, sizeof *bound);
    struct pt_group *groups = calloc(end - first, sizeof *groups);
    struct pt_buffer **buffers = calloc(refs + 1, sizeof *buffers);
    int error = bound && groups && buffers ? bind_groups(e, first, end, bound, buffers, groups, &count)
                                           : pt_fail(&e->device->handle, PATINA_ERROR_MEMORY, "a frame: out of memory");
    if (!error)
        error = e->device->ops->run_groups(e->device, groups, count, pt_polled(e), e->progress);
    for (uint32_t g = 0, i = first; g < count && !error; i += groups[g++].count)
        note_group(e, name_of(e, i, groups[g].count), &groups[g], g + 1 < count && groups[g + 1].joined);
    free(bound);
    free(groups);
    free(buffers);
    return error;
}

static int run_handed_over(struct pt_execution *e, uint32_t first, uint32_t end)
{
    int error = PATINA_OK;
    for (uint32_t to; first < end && !error; first = to) {
        to = handed_over(e, first, end);
        if (to == first) {
            if (is_cancelled(e))
                return PATINA_ERROR_CANCELLED;
            error = pt_planes_ensure_picture(e->device, e->binder.planes, e->plan);
            e->writing = 1;
            to = end;
        }
        error = error ? error : hand_over(e, first, to);
    }
    return error;
}

int pt_run_passes(struct pt_execution *e, uint32_t first, uint32_t count)
{
    if (e->device->ops->run_groups && !e->merge && !e->binder.planes->poisoned)
        return run_handed_over(e, first, first + count);
    const uint32_t end = first + count;
    struct pt_counts counts = {0}, asked;
    uint64_t bytes = e->times->bytes;
    double before = pt_milliseconds();
    int error = e->device->ops->counts(e->device, &counts);
    for (uint32_t i = first; i < end && !error;) {
        const uint32_t taken = taken_at(e, i);
        const char *name = name_of(e, i, taken);
        error = run_some(e, i, taken);
        i += taken;
        if (error)
            break;
        if (i < end && e->plan->passes[i].name == name) // timed with it
            continue;
        error = e->device->ops->wait(e->device); // so that a time is that of its work
        const double now = pt_milliseconds();
        pt_note_time(e->times, name, now - before);
        before = now;
        error = error ? error : e->device->ops->counts(e->device, &asked);
        if (error)
            break;
        counts = pt_counts_between(&counts, &asked);
        pt_note_work(e->times, name, e->times->bytes - bytes, &counts);
        counts = asked;
        bytes = e->times->bytes;
        if (e->progress)
            atomic_store(e->progress, e->progress_done + e->progress_share * (float)i / (float)e->plan->pass_count);
    }
    return error;
}
