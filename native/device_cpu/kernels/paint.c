// SPDX-License-Identifier: GPL-3.0-or-later
// paint: pixels that show a mesh take its image's colour; twin of shaders/kernels/paint.comp
#include "texture.h"
#include "shared/meshes.h"

static void paint_row(void *context, uint32_t y)
{
    const struct pt_cpu_call *call = context;
    const struct paint_args *args = call->arguments;
    const struct view_args *view = &args->view;
    const uint64_t *shown = PT_DATA(call, paint, shown), *mesh_keys = PT_DATA(call, paint, mesh_keys);
    const float *vertices = PT_DATA(call, paint, vertices);
    float *albedo = PT_DATA(call, paint, albedo);
    for (uint32_t x = view->rect[0]; x < view->rect[2]; x += PT_LANES) {
        const size_t at = (size_t)y * view->width + x;
        vi index;
        const vm ours = pt_pixels_of_mesh(&args->mesh, shown, mesh_keys, at, pt_lanes_left(x, view->rect[2]), &index);
        if (!vm_bits(ours))
            continue;
        struct pt_triangle t;
        struct pt_on_image place;
        vf color[4];
        pt_find_triangle(view, &args->mesh, vertices, PT_DATA(call, paint, indices), index, x, y, ours, &t);
        pt_place_on_image(&t, &args->mesh.texture, vertices, ours, &place);
        pt_image_at(&args->mesh.texture, PT_DATA(call, paint, texels), &place, ours, color);
        if (!args->mesh.texture.blend)
            color[3] = vf_set(1.0f);
        vf_store4(albedo + 4 * at, color, vm_bits(ours));
    }
}

int PT_KERNEL_ENTRY(paint)(const struct pt_cpu_call *call)
{
    const struct paint_args *args = call->arguments;
    return pt_rows(call, &args->view, paint_row);
}
