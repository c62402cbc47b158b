// SPDX-License-Identifier: GPL-3.0-or-later
#include "execute.h"

#include <stdlib.h>

static uint32_t columns_of(const struct pt_plan *plan)
{
    uint32_t size[2];
    pt_plan_plane_size(plan, PT_PLANE_TILES, PT_TILE_LEVEL, size);
    return size[0];
}

// Of a rectangle of pixels: x0, y0, x1, y1 in tiles.
static void tile_rect(const uint32_t pixels[4], uint32_t out[4])
{
    for (int k = 0; k < 2; k++) {
        out[k] = pixels[k] >> PT_TILE_LEVEL;
        out[2 + k] = (pixels[2 + k] + (1u << PT_TILE_LEVEL) - 1) >> PT_TILE_LEVEL;
    }
}

uint64_t pt_layer_pixels(const struct pt_plan *plan, const struct pt_tile *tiles)
{
    uint32_t rect[4], columns = columns_of(plan);
    uint64_t pixels = 0;
    tile_rect(plan->view.rect, rect);
    for (uint32_t y = rect[1]; y < rect[3]; y++)
        for (uint32_t x = rect[0]; x < rect[2]; x++)
            pixels += tiles[(size_t)y * columns + x].covered;
    return pixels;
}

static int may_show(const struct pt_bounds *bounds, const struct pt_tile *tiles, uint32_t columns)
{
    uint32_t rect[4];
    tile_rect(bounds->rect, rect);
    for (uint32_t y = rect[1]; y < rect[3]; y++)
        for (uint32_t x = rect[0]; x < rect[2]; x++)
            if (tiles[(size_t)y * columns + x].least < bounds->z_far)
                return 1;
    return 0;
}

uint32_t pt_layer_chunks(const struct pt_plan *plan, uint32_t instance, const struct pt_tile *tiles, struct chunk_view *out,
                         uint64_t *points)
{
    const struct pt_plan_instance *from = &plan->instances[instance];
    uint32_t columns = columns_of(plan), count = 0;
    for (uint32_t c = 0; c < from->chunk_count; c++) {
        if (!may_show(&from->bounds[c], tiles, columns))
            continue;
        *points += from->chunks[c].count;
        out[count++] = from->chunks[c];
    }
    return count;
}

// ---- the loop ------------------------------------------------------------------------------------------------------------

int pt_read_covered(struct pt_execution *e, const struct pt_step *step)
{
    const struct pt_buffer *tiles = &e->binder.planes->at[PT_PLANE_TILES][PT_TILE_LEVEL];
    if (!e->tiles && !(e->tiles = malloc(tiles->size)))
        return pt_fail(&e->device->handle, PATINA_ERROR_MEMORY, "a frame: out of memory");
    int error = e->device->ops->buffer_read(e->device, tiles, 0, e->tiles, tiles->size);
    if (!error)
        e->layers[step->layer - 1].pixels = pt_layer_pixels(e->plan, e->tiles);
    return error;
}

// Chooses the chunks of a layer. *some: 0 when there is nothing behind.
static int choose_chunks(struct pt_execution *e, struct pt_layer *layer, int *some)
{
    const struct pt_plan *plan = e->plan;
    int error = PATINA_OK;
    for (uint32_t i = 0; i < plan->instance_count && !error; i++) {
        const uint32_t most = plan->instances[i].chunk_count;
        if (!most)
            continue;
        if (!e->behind[i] && !(e->behind[i] = malloc(most * sizeof **e->behind)))
            return pt_fail(&e->device->handle, PATINA_ERROR_MEMORY, "a frame: out of memory");
        const uint32_t count = pt_layer_chunks(plan, i, e->tiles, e->behind[i], &layer->points);
        error = pt_bind_chunks(&e->binder, i, e->behind[i], count);
    }
    *some = layer->points > 0 || plan->mesh.triangles;
    return error;
}

int pt_run_layer(struct pt_execution *e, const struct pt_step *step)
{
    struct pt_layer *layer = &e->layers[step->layer - 1];
    int some = 0;
    if (e->ended)
        return PATINA_OK;
    *layer = (struct pt_layer){0};
    int error = layer[-1].pixels ? choose_chunks(e, layer, &some) : PATINA_OK;
    e->ended = !some;
    if (error || !some)
        return error;
    e->layer_count = step->layer;
    return pt_walk(e, step + 1, pt_step_after(step));
}
