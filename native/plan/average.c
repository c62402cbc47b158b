// SPDX-License-Identifier: GPL-3.0-or-later
// The passes of means over the points about a surface, in place of the nearest one.
#include "passes.h"
#include "shared/means.h"

static int wants_normals(const struct pt_builder *builder, const struct pt_plan_instance *instance)
{
    return instance->args.has_normals && (instance->args.lit || (builder->scene->settings.passes >> PATINA_PASS_NORMAL & 1u) ||
                                          pt_effects_want_normals(builder->scene));
}

int pt_averages(const struct pt_builder *builder, const struct pt_plan_instance *instance)
{
    return builder->scene->settings.average && pt_draws(instance, PT_AS_POINTS) && !instance->args.has_opacities &&
           (instance->instance->style.color_source == PATINA_COLOR_OWN || wants_normals(builder, instance));
}

void pt_plan_average(struct pt_builder *builder)
{
    struct pt_plan *plan = builder->plan;
    uint32_t averaged = 0;
    for (uint32_t i = 0; i < plan->instance_count; i++) {
        const struct pt_plan_instance *instance = &plan->instances[i];
        if (!pt_averages(builder, instance))
            continue;
        if (instance->instance->whole->part_count) // each part would take means of its own points alone
            builder->failed = pt_fail(&builder->scene->handle, PATINA_ERROR_UNSUPPORTED,
                                      "settings.average: not of a cloud of %llu points; up to 2147483647 can have means",
                                      (unsigned long long)instance->instance->whole->info.count);
        const struct average_args args = {.view = pt_view_filled(plan, instance),
                                          .instance = instance->args,
                                          .normals = (uint32_t)wants_normals(builder, instance),
                                          .sifted = plan->drawn_words > 0};
        const struct pt_ref refs[] = {pt_keys_of(builder, 0),          pt_from_of(builder, 0),
                                      pt_plane_at(PT_PLANE_DEFF, 0),   pt_plane_at(PT_PLANE_NORMAL, 0),
                                      pt_plane_at(PT_PLANE_ALBEDO, 0), pt_buffer_of(PT_CHUNKS, i),
                                      pt_buffer_of(PT_POSITIONS, i),   pt_buffer_of(PT_SURFELS, i),
                                      pt_buffer_of(PT_COLORS, i),      args.sifted ? pt_buffer_of(PT_DRAWN, 0) : pt_nothing()};
        PT_REASON(pt_add(builder, PT_KERNEL_average, "average", &args, sizeof args, refs, sizeof refs / sizeof *refs),
                  "colour%s of instance %u: means over the points about its surface", args.normals ? " and normals" : "", i);
        averaged++;
    }
    if (!averaged)
        pt_skip(builder, "average",
                !builder->scene->settings.average ? "the settings ask for the nearest points"
                : !plan->filled                   ? "discs are blended"
                                                  : "ramps and opacities of points are the nearest ones'");
}
