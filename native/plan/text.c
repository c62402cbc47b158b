// SPDX-License-Identifier: GPL-3.0-or-later
// What a plan says of itself: its planes' sizes, which of them readers see, and all of it in words.
#include "passes.h"

#include <stdio.h>

static const struct {
    uint32_t bytes, levels;
} plane_table[PT_PLANE_COUNT] = {
#define PT_X(name, bytes, levels) {bytes, levels},
    PT_PLANES(PT_X)
#undef PT_X
};

int pt_plan_writes(const struct pt_plan *plan, enum pt_plane plane)
{
    for (uint32_t i = 0; i < plan->pass_count; i++)
        for (uint32_t k = 0; k < plan->passes[i].ref_count && plan->passes[i].output; k++)
            if (plan->passes[i].refs[k].of == PT_OF_FRAME && plan->passes[i].refs[k].which == (uint32_t)plane)
                return 1;
    return 0;
}

void pt_plan_plane_size(const struct pt_plan *plan, enum pt_plane which, uint32_t level, uint32_t size[2])
{
    if (which >= PT_PLANE_COMBINED) {
        size[0] = plan->crop[2];
        size[1] = plan->crop[3];
        return;
    }
    struct view_args view = pt_view_at(plan, plane_table[which].levels ? level : 0);
    size[0] = view.width;
    size[1] = view.height;
}

size_t pt_plan_text(const struct pt_plan *plan, char *buffer_out, size_t size)
{
    size_t length = 0;
#define LINE(...)                                                                                                      \
    length += (size_t)snprintf(buffer_out && length < size ? buffer_out + length : NULL,                               \
                               buffer_out && length < size ? size - length : 0, __VA_ARGS__)
    LINE("planes %u x %u, crop %u x %u at %u, %u, %u coarse levels\n", plan->view.width, plan->view.height,
         plan->crop[2], plan->crop[3], plan->crop[0], plan->crop[1], plan->levels);
    LINE("expected error: colour %.4f of white, coverage %.4f, depth %.2f spacings, normals %.2f degrees (%s)\n",
         (double)plan->expected.color, (double)plan->expected.coverage, (double)plan->expected.depth,
         (double)plan->expected.normal,
         pt_means_name(plan->means));
    LINE("points %llu, scattered %llu, chunks %llu, culled %llu\n", (unsigned long long)plan->points,
         (unsigned long long)plan->points_scattered, (unsigned long long)plan->chunks,
         (unsigned long long)plan->chunks_culled);
    if (plan->chunks_clipped || plan->chunks_cut)
        LINE("chunks clipped %llu, cut %llu\n", (unsigned long long)plan->chunks_clipped,
             (unsigned long long)plan->chunks_cut);
    for (uint32_t i = 0; i < plan->pass_count; i++)
        LINE("run  %-10s %s\n", plan->passes[i].name, plan->passes[i].reason);
    for (uint32_t i = 0; i < plan->light_count; i++)
        LINE("run  %-10s %s\n", "lit", plan->lights[i].reason);
    for (uint32_t i = 0; i < plan->skipped_count; i++)
        LINE("skip %-10s %s\n", plan->skipped[i].name, plan->skipped[i].reason);
#undef LINE
    return length;
}
