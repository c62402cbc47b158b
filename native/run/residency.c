// SPDX-License-Identifier: GPL-3.0-or-later
#include "residency.h"

#include "page_check.h"
#include "scene/mask.h"
#include "scene/clouds/paged.h"
#include "scene/soft.h"

#include <stdlib.h>
#include <string.h>

static void drop(struct patina_device *device, struct pt_resident *resident)
{
    for (int i = 0; i < PT_INSTANCE_BUFFERS; i++)
        device->ops->buffer_destroy(device, &resident->buffers[i]);
    device->ops->buffer_destroy(device, &resident->fields[0]);
    device->ops->buffer_destroy(device, &resident->fields[1]);
    device->ops->buffer_destroy(device, &resident->marked);
    free(resident->given);
    resident->given = NULL;
}

static void destroy(struct pt_resident *resident, struct patina_device *device)
{
    drop(device, resident);
    pt_alive_release(resident->alive);
    free(resident);
}

// How what points have is given to a device: whole, or range by range.
static int how_points(const struct patina_device *device) { return PT_BORROW | (device->ranges.most ? PT_IN_RANGES : 0); }

// Whether that is how it was given.
static int as_now(const struct patina_device *device, const struct pt_buffer *buffer)
{
    return !device->copies || !buffer->size || (buffer->name == 0) == (device->ranges.most != 0);
}

// Of a cloud of which pages are absent, chunks that lie beside each other at one go: there need be no memory between them (scene/clouds/paged.h).
static int give_chunks(struct patina_device *device, const struct patina_cloud *cloud, size_t each, const char *data,
                       struct pt_buffer *out)
{
    int error = device->ops->buffer_create(device, cloud->slots * each, NULL, PT_COPY, out);
    for (uint32_t c = pt_chunk_from(cloud, 0); c < cloud->chunk_count && !error; c = pt_chunk_from(cloud, c)) {
        const size_t first = cloud->chunks[c].first;
        size_t count = 0;
        for (; c < cloud->chunk_count && cloud->chunks[c].count; c++)
            count += cloud->chunks[c].padded;
        error = device->ops->buffer_write(device, out, first * each, data + first * each, count * each);
    }
    return error;
}

static int give_points(struct patina_device *device, const struct patina_cloud *cloud, size_t size, const void *data,
                       struct pt_buffer *out)
{
    if (device->copies && !device->ranges.most && pt_paged_absent(cloud))
        return give_chunks(device, cloud, size / cloud->slots, data, out);
    return device->ops->buffer_create(device, size, data, how_points(device), out);
}

static void forget_dead(struct pt_residency *residency, struct patina_device *device)
{
    for (struct pt_resident **at = &residency->first; *at;) {
        struct pt_resident *resident = *at;
        if (atomic_load(&resident->alive->alive)) {
            at = &resident->next;
            continue;
        }
        *at = resident->next;
        destroy(resident, device);
    }
}

// Surface words as they are now, and shapes where radii would lie, unless the cloud has its own.
static int upload_shapes(struct patina_device *device, const struct patina_cloud *cloud, struct pt_resident *resident)
{
    const void *radii = cloud->radii ? (const void *)cloud->radii : cloud->shapes;
    device->ops->buffer_destroy(device, &resident->buffers[PT_SURFELS]);
    device->ops->buffer_destroy(device, &resident->buffers[PT_RADII]);
    device->ops->buffer_destroy(device, &resident->buffers[PT_SHAPES]);
    device->ops->buffer_destroy(device, &resident->buffers[PT_SIGHTS]);
    resident->shapes = atomic_load(&cloud->alive->shapes);
    int error = give_points(device, cloud, cloud->slots * 4, cloud->surfels, &resident->buffers[PT_SURFELS]);
    if (!error && cloud->radii && cloud->shapes)
        error = give_points(device, cloud, cloud->slots * 4, cloud->shapes, &resident->buffers[PT_SHAPES]);
    if (error || !radii)
        return error;
    return give_points(device, cloud, cloud->slots * 4, radii, &resident->buffers[PT_RADII]);
}

// The colours and scalars as they are now, in place of what the buffer holds.
static int upload_colors(struct patina_device *device, const struct patina_cloud *cloud, struct pt_resident *resident)
{
    device->ops->buffer_destroy(device, &resident->buffers[PT_COLORS]);
    device->ops->buffer_destroy(device, &resident->buffers[PT_SCALARS]);
    resident->colors = atomic_load(&cloud->alive->colors);
    int error = !cloud->scalars
                    ? PATINA_OK
                    : give_points(device, cloud, pt_scalar_bytes(cloud), cloud->scalars, &resident->buffers[PT_SCALARS]);
    if (error)
        return error;
    if (!cloud->colors)
        return PATINA_OK;
    return give_points(device, cloud, cloud->slots * pt_color_size(cloud->color_format), cloud->colors,
                       &resident->buffers[PT_COLORS]);
}

// ---- clouds in pages -----------------------------------------------------------------------------------------------------

// What a chunk that is there holds: its page's points, and the class of their spacing.
static uint64_t holds(const struct patina_cloud *cloud, uint32_t c)
{
    uint32_t spacing;
    memcpy(&spacing, &cloud->chunks[c].spacing, sizeof spacing);
    return (uint64_t)pt_paged_arrivals(cloud, c) << 32 | spacing;
}

// Remembers what was uploaded. Without memory for it all pages are uploaded when one changes.
static void note_pages(const struct patina_device *device, const struct patina_cloud *cloud, struct pt_resident *resident)
{
    if (!cloud->paged || !device->copies || device->ranges.most)
        return;
    free(resident->given);
    resident->given = calloc((size_t)cloud->chunk_count + 1, sizeof *resident->given);
    for (uint32_t c = pt_chunk_from(cloud, 0); c < cloud->chunk_count && resident->given; c = pt_chunk_from(cloud, c + 1))
        resident->given[c] = holds(cloud, c);
}

// Writes `padded` slots from the chunk's first on into all buffers, or into the surface words alone.
static int write_chunks(struct patina_device *device, const struct patina_cloud *cloud, struct pt_resident *resident,
                        const struct pt_chunk *chunk, size_t padded, int words_alone)
{
    const struct {
        enum pt_instance_buffer which;
        const void *data;
    } parts[] = {{PT_SURFELS, cloud->surfels}, {PT_POSITIONS, cloud->positions}, {PT_OPACITIES, cloud->opacities},
                 {PT_CLASSES, cloud->classes}, {PT_SCALARS, cloud->scalars},     {PT_COLORS, cloud->colors}};
    int error = PATINA_OK;
    for (size_t i = 0; i < (words_alone ? 1 : sizeof parts / sizeof *parts) && !error; i++) {
        struct pt_buffer *buffer = &resident->buffers[parts[i].which];
        const size_t each = buffer->size / cloud->slots;
        if (parts[i].data && buffer->size)
            error = device->ops->buffer_write(device, buffer, chunk->first * each,
                                              (const char *)parts[i].data + chunk->first * each, padded * each);
    }
    return error;
}

// Uploads the chunks that differ from what the buffers hold, those that lie beside each other at one go.
static int renew_pages(struct patina_device *device, const struct patina_cloud *cloud, struct pt_resident *resident)
{
    int error = PATINA_OK;
    uint32_t before = 0; // chunks up to here are done
    for (uint32_t c = pt_chunk_from(cloud, 0); !error; c = pt_chunk_from(cloud, c)) {
        for (; before < c; before++)
            resident->given[before] = 0; // absent
        if (c >= cloud->chunk_count)
            break;
        const struct pt_chunk *first = &cloud->chunks[c];
        const uint64_t had = resident->given[c], has = holds(cloud, c);
        const int words_alone = had >> 32 == has >> 32;
        size_t padded = 0;
        if (had == has) {
            before = ++c;
            continue;
        }
        while (c < cloud->chunk_count && cloud->chunks[c].count && cloud->chunks[c].first == first->first + padded &&
               resident->given[c] != holds(cloud, c) && (resident->given[c] >> 32 == holds(cloud, c) >> 32) == words_alone) {
            padded += cloud->chunks[c].padded;
            resident->given[c] = holds(cloud, c);
            c++;
        }
        before = c;
        error = write_chunks(device, cloud, resident, first, padded, words_alone);
    }
    for (int i = 0; i < 2; i++)
        device->ops->buffer_destroy(device, &resident->fields[i]);
    device->ops->buffer_destroy(device, &resident->marked);
    if (error)
        drop(device, resident); // whoever takes it next uploads it whole
    resident->pages = atomic_load(&cloud->alive->pages) - (error != PATINA_OK);
    return error;
}

static int upload_all(struct patina_device *device, const struct patina_cloud *cloud, struct pt_resident *resident)
{
    int error = PATINA_OK;
    const struct {
        enum pt_instance_buffer which;
        const void *data;
        size_t size;
    } parts[] = {
        {PT_POSITIONS, cloud->positions, cloud->slots * 4 * pt_position_words(cloud)},
        {PT_OPACITIES, cloud->opacities, cloud->slots},
        {PT_CLASSES, cloud->classes, cloud->slots},
    };
    for (size_t i = 0; i < sizeof parts / sizeof *parts; i++) {
        if (!parts[i].data)
            continue;
        error = give_points(device, cloud, parts[i].size, parts[i].data, &resident->buffers[parts[i].which]);
        if (error)
            return error;
    }
    resident->buffers[PT_POSITIONS].each = 4 * pt_position_words(cloud);
    resident->pages = atomic_load(&cloud->alive->pages);
    error = upload_shapes(device, cloud, resident);
    if (!error)
        error = upload_colors(device, cloud, resident);
    if (!error)
        note_pages(device, cloud, resident);
    if (!resident->buffers[PT_POSITIONS].wrapped && !device->ranges.most) // a copy: the file itself need not be held beside it
        pt_cloud_return(cloud);
    return error;
}

// Where the driver has no memory for it whole, from now on range by range: PT_AGAIN, for what is bound already would lie there otherwise.
// run/pager.h chooses ranges when the picture begins once more.
static int upload(struct patina_device *device, const struct patina_cloud *cloud, struct pt_resident *resident)
{
    const int error = upload_all(device, cloud, resident);
    if (!error)
        return PATINA_OK;
    drop(device, resident);
    resident->pages = atomic_load(&cloud->alive->pages) - 1; // nothing is there: whoever takes it next uploads it
    if (error != PATINA_ERROR_MEMORY || !device->copies || device->ranges.most)
        return error;
    device->ranges.failed = pt_cloud_copied_bytes(cloud);
    return PT_AGAIN;
}

// What changed since it was uploaded.
static int renew(struct patina_device *device, const struct patina_cloud *cloud, struct pt_resident *resident)
{
    const int stale = resident->pages != atomic_load(&cloud->alive->pages);
    const int by_page = resident->given && !cloud->shapes && !cloud->radii;
    if ((stale && !by_page) || !as_now(device, &resident->buffers[PT_POSITIONS])) {
        drop(device, resident);
        return upload(device, cloud, resident);
    }
    int error = stale ? renew_pages(device, cloud, resident) : PATINA_OK;
    if (error)
        return error;
    error = resident->shapes == atomic_load(&cloud->alive->shapes) ? PATINA_OK : upload_shapes(device, cloud, resident);
    if (error || resident->colors == atomic_load(&cloud->alive->colors))
        return error;
    return upload_colors(device, cloud, resident);
}

// What is there already, or NULL; forgets the dead on the way.
static struct pt_resident *find(struct pt_residency *residency, struct patina_device *device, const struct pt_alive *alive)
{
    struct pt_resident *resident;
    forget_dead(residency, device);
    for (resident = residency->first; resident && resident->alive != alive; resident = resident->next)
        ;
    return resident;
}

static struct pt_resident *begin(struct patina_device *device, struct pt_alive *alive)
{
    struct pt_resident *resident = calloc(1, sizeof *resident);
    if (!resident) {
        pt_fail(&device->handle, PATINA_ERROR_MEMORY, "a cloud's or mesh's place on the device: out of memory");
        return NULL;
    }
    resident->alive = alive;
    atomic_fetch_add(&alive->references, 1);
    return resident;
}

// Takes it in, or destroys it where uploading failed.
static int end(struct pt_residency *residency, struct patina_device *device, struct pt_resident *resident, int error,
               struct pt_resident **out)
{
    if (error) {
        destroy(resident, device);
        return error;
    }
    resident->next = residency->first;
    *out = residency->first = resident;
    return PATINA_OK;
}

int pt_residency_take(struct pt_residency *residency, struct patina_device *device, const struct patina_cloud *cloud,
                      struct pt_resident **out)
{
    struct pt_resident *resident = *out = find(residency, device, cloud->alive);
    if (resident)
        return renew(device, cloud, resident);
    resident = begin(device, cloud->alive);
    return resident ? end(residency, device, resident, upload(device, cloud, resident), out) : PATINA_ERROR_MEMORY;
}

int pt_residency_mark(struct patina_device *device, const struct patina_cloud *cloud, struct pt_resident *resident)
{
    static const uint8_t magenta[3] = {255, 0, 255};
    static const float linear_magenta[3] = {1.0f, 0.0f, 1.0f}, grey[3] = {0.8f, 0.8f, 0.8f};
    const uint32_t colors = atomic_load(&cloud->alive->colors), shapes = atomic_load(&cloud->alive->shapes);
    const enum pt_color_format format = cloud->color_format ? cloud->color_format : PT_COLOR_FLOAT;
    const size_t size = pt_color_size(format);
    const void *mark = format == PT_COLOR_FLOAT ? (const void *)linear_magenta : magenta;
    if (resident->marked.size && as_now(device, &resident->marked) && resident->marked_colors == colors &&
        resident->marked_shapes == shapes)
        return PATINA_OK;
    device->ops->buffer_destroy(device, &resident->marked);
    char *words = malloc(cloud->slots * size);
    if (!words)
        return pt_fail(&device->handle, PATINA_ERROR_MEMORY, "showing free space: out of memory");
    for (uint32_t c = pt_chunk_from(cloud, 0); c < cloud->chunk_count; c = pt_chunk_from(cloud, c + 1))
        for (uint64_t slot = cloud->chunks[c].first, end = slot + cloud->chunks[c].padded; slot < end; slot++) {
            const int marked = cloud->shapes && (cloud->shapes[slot] & PT_SHAPE_SEEN_THROUGH);
            const void *own = cloud->colors ? (const char *)cloud->colors + slot * size : (const void *)grey;
            memcpy(words + slot * size, marked ? mark : own, size);
        }
    int error = device->ops->buffer_create(device, cloud->slots * size, words, how_points(device) & PT_IN_RANGES,
                                           &resident->marked);
    free(words);
    resident->marked_colors = colors;
    resident->marked_shapes = shapes;
    return error;
}

int pt_residency_field(struct patina_device *device, const struct patina_cloud *cloud, const struct patina_field *by,
                       struct pt_resident *resident, int one)
{
    const struct pt_soft_code code = pt_soft_code(cloud, by, one);
    struct pt_buffer *field = &resident->fields[one];
    const uint32_t shapes = atomic_load(&cloud->alive->shapes);
    if (field->size && as_now(device, field) && (one || resident->field_shapes == shapes))
        return PATINA_OK;
    device->ops->buffer_destroy(device, field);
    uint32_t *words = malloc((cloud->slots + 1) * sizeof *words);
    if (!words)
        return pt_fail(&device->handle, PATINA_ERROR_MEMORY, "soft points: out of memory");
    for (uint32_t c = 0; c < cloud->chunk_count; c++) {
        const struct pt_chunk *chunk = &cloud->chunks[c];
        for (uint32_t slot = chunk->first; slot < chunk->first + chunk->padded; slot++)
            words[slot] = pt_soft_word(code, by ? by->steps[slot] : (uint32_t)PT_FIELD_MOST,
                                       one ? 1.0f : pt_soft_radius(cloud, chunk, slot));
    }
    const int error = device->ops->buffer_create(device, cloud->slots * sizeof *words, words, how_points(device) & PT_IN_RANGES,
                                                 field);
    free(words);
    resident->field_shapes = one ? resident->field_shapes : shapes;
    return error;
}

int pt_residency_see(struct patina_device *device, const struct patina_cloud *cloud, struct pt_resident *resident)
{
    struct pt_buffer *sights = &resident->buffers[PT_SIGHTS];
    return sights->size ? PATINA_OK : device->ops->buffer_create(device, cloud->sights.bytes, cloud->sights.words, 1, sights);
}

int pt_residency_take_mesh(struct pt_residency *residency, struct patina_device *device, const struct patina_mesh *mesh,
                           struct pt_resident **out)
{
    struct pt_resident *resident = *out = find(residency, device, mesh->alive);
    if (resident)
        return PATINA_OK;
    if (!(resident = begin(device, mesh->alive)))
        return PATINA_ERROR_MEMORY;
    int error = device->ops->buffer_create(device, mesh->info.vertex_count * mesh->stride * sizeof *mesh->vertices,
                                           mesh->vertices, PT_BORROW, &resident->buffers[PT_MESH_VERTICES]);
    if (!error)
        error = device->ops->buffer_create(device, 3 * mesh->info.triangle_count * sizeof *mesh->indices, mesh->indices, 1,
                                           &resident->buffers[PT_MESH_INDICES]);
    return end(residency, device, resident, error, out);
}

int pt_residency_take_bytes(struct pt_residency *residency, struct patina_device *device, struct pt_alive *alive,
                            const void *data, size_t size, struct pt_resident **out)
{
    struct pt_resident *resident = *out = find(residency, device, alive);
    if (resident)
        return PATINA_OK;
    if (!(resident = begin(device, alive)))
        return PATINA_ERROR_MEMORY;
    const int error = size ? device->ops->buffer_create(device, size, data, PT_BORROW, &resident->buffers[0]) : PATINA_OK;
    return end(residency, device, resident, error, out);
}

int pt_residency_take_points(struct pt_residency *residency, struct patina_device *device, struct pt_alive *alive,
                             const void *data, size_t size, struct pt_resident **out)
{
    struct pt_resident *resident = *out = find(residency, device, alive);
    const int there = resident != NULL;
    if (there && as_now(device, &resident->buffers[0]))
        return PATINA_OK;
    if (!resident && !(resident = begin(device, alive)))
        return PATINA_ERROR_MEMORY;
    drop(device, resident);
    const int error = device->ops->buffer_create(device, size, data, how_points(device), &resident->buffers[0]);
    return there ? error : end(residency, device, resident, error, out);
}

int pt_residency_take_texture(struct pt_residency *residency, struct patina_device *device,
                              const struct patina_texture *texture, struct pt_resident **out)
{
    return pt_residency_take_bytes(residency, device, texture->alive, texture->texels, texture->bytes, out);
}

void pt_residency_release(struct pt_residency *residency, struct patina_device *device)
{
    while (residency->first) {
        struct pt_resident *resident = residency->first;
        residency->first = resident->next;
        destroy(resident, device);
    }
}
