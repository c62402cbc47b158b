// SPDX-License-Identifier: GPL-3.0-or-later
// From header to columns: which property is what, room for the columns, then the rows of either kind.
//
// Elements behind the points are not needed: where the file ends in one of them, that is told and the points stay. Faces
// give normals where there are no others.
// Integer colours of type char, short, int and uint are taken as 0..255 (their writers meant bytes), uchar is 0..255,
// ushort 0..65535, float and double are linear. A Gaussian splat without colours has the sRGB colour of its base, the
// constant term of its spherical harmonics (Kerbl et al., 3D Gaussian Splatting, 2023); ply_splats.c makes its disc. What is no
// position, normal or colour becomes an attribute; lists are left out.
#include "base/progress.h"
#include "ply.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { FAMILY = 4 }; // names in a family: x y z, or red green blue alpha

static const char *const position_names[][FAMILY] = {{"x", "y", "z", NULL}};
static const char *const normal_names[][FAMILY] = {
    {"nx", "ny", "nz", NULL}, {"normal_x", "normal_y", "normal_z", NULL}, {"normalx", "normaly", "normalz", NULL}};
static const char *const color_names[][FAMILY] = {
    {"red", "green", "blue", "alpha"}, {"r", "g", "b", "a"}, {"diffuse_red", "diffuse_green", "diffuse_blue", "diffuse_alpha"}};
static const char *const splat_names[][FAMILY] = {{"f_dc_0", "f_dc_1", "f_dc_2", NULL}};
static const double harmonic = 0.28209479177387814; // Y00 = sqrt(1 / (4 pi))

struct plan {
    const struct pt_input *input;
    struct patina_file *file;
    const struct ply_header *header;
    const struct ply_element *points;
    const struct ply_property *properties; // of the points
    struct ply_target *targets;            // one a property
    bool *taken;                           // one a property: it is part of a position, normal or colour
    double *staged;                        // positions whose detail float32 may not hold
    const struct ply_element *faces;       // that normals come from; NULL: none, or the points have normals
    const struct ply_element *grid;        // of a scanner; NULL: none
    bool splats;                           // the points are Gaussian splats
};

static int out_of_memory(const struct plan *plan)
{
    return pt_fail(NULL, PATINA_ERROR_MEMORY, "%s: no memory for %llu points", plan->input->name,
                   (unsigned long long)plan->points->count);
}

// Room for a column; counts have been held against the file's size, so the product stays far below 2^64.
static void *column(const struct plan *plan, size_t bytes_per_point)
{
    return malloc(plan->points->count ? (size_t)plan->points->count * bytes_per_point : 1);
}

// ---- finding properties --------------------------------------------------------------------------------------------

static int64_t find(const struct plan *plan, const char *name)
{
    for (uint32_t k = 0; name && k < plan->points->properties; k++)
        if (!strcmp(plan->properties[k].name, name))
            return k;
    return -1;
}

// The first family whose first three names are all scalars of the points. found[3] is -1 where the family's fourth is
// missing.
static bool find_family(const struct plan *plan, const char *const families[][FAMILY], size_t count, int64_t found[FAMILY])
{
    for (size_t f = 0; f < count; f++) {
        bool all = true;
        for (int c = 0; c < FAMILY; c++) {
            found[c] = find(plan, families[f][c]);
            if (found[c] >= 0 && plan->properties[found[c]].count_type != PATINA_NONE)
                found[c] = -1;
            all &= c == 3 || found[c] >= 0;
        }
        if (all)
            return true;
    }
    return false;
}

// ---- columns -------------------------------------------------------------------------------------------------------

static void aim(struct plan *plan, int64_t property, void *data, uint32_t type, uint32_t step)
{
    plan->taken[property] = true;
    plan->targets[property] = (struct ply_target){.data = data, .type = type, .step = step, .scale = 1};
}

// Text may hold more digits than its declared float does, so it is staged like the types that float32 cannot hold.
static int plan_positions(struct plan *plan)
{
    struct patina_file *file = plan->file;
    int64_t found[FAMILY];
    if (!find_family(plan, position_names, 1, found)) {
        int missing = found[0] < 0 ? 0 : found[1] < 0 ? 1 : 2;
        if (find(plan, "packed_position") >= 0)
            return pt_fail(NULL, PATINA_ERROR_FORMAT,
                           "%s: Gaussian splats, packed as SuperSplat does; export them as a plain PLY", plan->input->name);
        return pt_fail(NULL, PATINA_ERROR_FORMAT, "%s: element %s has no scalar property %s", plan->input->name,
                       plan->points->name, position_names[0][missing]);
    }
    bool stage = plan->header->format == PLY_ASCII;
    file->position_type = plan->properties[found[0]].type;
    for (int c = 0; c < 3; c++) {
        uint32_t type = plan->properties[found[c]].type;
        stage |= type == PATINA_FLOAT64 || type == PATINA_INT32 || type == PATINA_UINT32;
        if (type == PATINA_FLOAT64)
            file->position_type = type;
    }
    if (stage)
        plan->staged = column(plan, 3 * sizeof(double));
    else
        file->position = column(plan, 3 * sizeof(float));
    if (stage ? !plan->staged : !file->position)
        return out_of_memory(plan);
    for (int c = 0; c < 3; c++) {
        if (stage)
            aim(plan, found[c], plan->staged + c, PATINA_FLOAT64, 3);
        else
            aim(plan, found[c], file->position + c, PATINA_FLOAT32, 3);
    }
    return PATINA_OK;
}

static int plan_normals(struct plan *plan)
{
    int64_t found[FAMILY];
    if (!find_family(plan, normal_names, sizeof normal_names / sizeof *normal_names, found))
        return PATINA_OK;
    plan->file->normal = column(plan, 3 * sizeof(float));
    if (!plan->file->normal)
        return out_of_memory(plan);
    for (int c = 0; c < 3; c++)
        aim(plan, found[c], plan->file->normal + c, PATINA_FLOAT32, 3);
    return PATINA_OK;
}

static uint32_t color_class(uint32_t type)
{
    return pt_is_float(type) ? PATINA_FLOAT32 : type == PATINA_UINT16 ? PATINA_UINT16 : PATINA_UINT8;
}

static double color_maximum(uint32_t color_type)
{
    return color_type == PATINA_UINT8 ? 255 : color_type == PATINA_UINT16 ? 65535 : 1;
}

static void fill_alpha(struct patina_file *file)
{
    for (uint64_t i = 0; i < file->count; i++) {
        if (file->color_type == PATINA_UINT8)
            ((uint8_t *)file->color)[4 * i + 3] = UINT8_MAX;
        else if (file->color_type == PATINA_UINT16)
            ((uint16_t *)file->color)[4 * i + 3] = UINT16_MAX;
        else
            ((float *)file->color)[4 * i + 3] = 1;
    }
}

static int plan_splat_colors(struct plan *plan)
{
    struct patina_file *file = plan->file;
    int64_t found[FAMILY];
    if (!find_family(plan, splat_names, 1, found))
        return PATINA_OK;
    file->color_type = PATINA_UINT8;
    file->color = column(plan, 4);
    if (!file->color)
        return out_of_memory(plan);
    fill_alpha(file);
    for (int c = 0; c < 3; c++) {
        aim(plan, found[c], (uint8_t *)file->color + c, PATINA_UINT8, 4);
        plan->targets[found[c]].scale = 255 * harmonic;
        plan->targets[found[c]].offset = 127.5;
    }
    return PATINA_OK;
}

static int plan_colors(struct plan *plan)
{
    struct patina_file *file = plan->file;
    const struct ply_property *p = plan->properties;
    int64_t found[FAMILY];
    if (!find_family(plan, color_names, sizeof color_names / sizeof *color_names, found))
        return plan_splat_colors(plan);
    uint32_t type = color_class(p[found[0]].type);
    if (type != color_class(p[found[1]].type) || type != color_class(p[found[2]].type))
        return pt_fail(NULL, PATINA_ERROR_FORMAT, "%s: properties %s, %s and %s mix the types %s, %s and %s", plan->input->name,
                       p[found[0]].name, p[found[1]].name, p[found[2]].name, ply_type_name(p[found[0]].type),
                       ply_type_name(p[found[1]].type), ply_type_name(p[found[2]].type));
    size_t size = pt_type_size(type);
    file->color_type = type;
    file->color = column(plan, 4 * size);
    if (!file->color)
        return out_of_memory(plan);
    for (size_t c = 0; c < 4; c++) {
        if (found[c] < 0) {
            fill_alpha(file);
            continue;
        }
        aim(plan, found[c], (uint8_t *)file->color + c * size, type, 4);
        plan->targets[found[c]].wrap = p[found[c]].type == PATINA_INT8;
        // Alpha may be of another type than the colours.
        plan->targets[found[c]].scale = color_maximum(type) / color_maximum(color_class(p[found[c]].type));
    }
    return PATINA_OK;
}

static int plan_attributes(struct plan *plan)
{
    struct patina_file *file = plan->file;
    const struct ply_property *p = plan->properties;
    uint32_t count = 0;
    for (uint32_t k = 0; k < plan->points->properties; k++)
        count += !plan->taken[k] && p[k].count_type == PATINA_NONE;
    file->attributes = calloc(count ? count : 1, sizeof *file->attributes);
    if (!file->attributes)
        return out_of_memory(plan);
    for (uint32_t k = 0; k < plan->points->properties; k++) {
        if (plan->taken[k] || p[k].count_type != PATINA_NONE || (plan->splats && ply_is_splat_rest(p[k].name)))
            continue;
        struct pt_column *attribute = &file->attributes[file->attribute_count++];
        memcpy(attribute->name, p[k].name, sizeof attribute->name);
        attribute->type = p[k].type;
        attribute->data = column(plan, pt_type_size(p[k].type));
        if (!attribute->data)
            return out_of_memory(plan);
        aim(plan, k, attribute->data, attribute->type, 1);
    }
    return PATINA_OK;
}

// ---- the whole -----------------------------------------------------------------------------------------------------

const struct ply_element *ply_find_points(const struct ply_header *header)
{
    static const char *const names[] = {"vertex", "vertices", "point", "points"};
    for (size_t n = 0; n < sizeof names / sizeof *names; n++)
        for (uint32_t e = 0; e < header->element_count; e++)
            if (!strcmp(header->elements[e].name, names[n]))
                return &header->elements[e];
    return NULL;
}

// Reads the points, and passes over what stands before them. `before`: where the faces begin if they do.
static int read_to_points(const struct plan *plan, struct ply_cursor *at, struct ply_cursor *before)
{
    int code = PATINA_OK;
    for (const struct ply_element *e = plan->header->elements; e <= plan->points && !code; e++) {
        if (e == plan->faces)
            *before = *at;
        code = ply_read_rows(at, e, e == plan->points ? plan->targets : NULL, NULL);
    }
    return code;
}

// A fault in the faces is no loss of points: a line in the log.
static int read_faces(const struct plan *plan, struct ply_cursor *at)
{
    struct patina_file *file = plan->file;
    struct ply_faces faces = {.position = file->position, .points = file->count};
    struct ply_lists lists = {.take = ply_take_face, .context = &faces};
    faces.strips = !strcmp(plan->faces->name, "tristrips");
    faces.normal = file->normal = calloc(file->count + 1, 3 * sizeof *file->normal);
    if (!file->normal)
        return out_of_memory(plan);
    lists.property = (uint32_t)ply_find_corners(plan->header, plan->faces);
    at->tone = PLY_WARN;
    int code = ply_read_rows(at, plan->faces, NULL, &lists);
    free(lists.items);
    ply_finish_faces(&faces);
    if (faces.bad)
        pt_log(PT_LOG_WARNING,
               "%s: %llu faces name points that are not there, and were left out; the first, %llu, names %.0f of %llu",
               plan->input->name, (unsigned long long)faces.bad, (unsigned long long)faces.bad_row, faces.bad_point,
               (unsigned long long)file->count);
    if (!faces.used) {
        free(file->normal);
        file->normal = NULL;
    }
    return code;
}

// Range images as the Stanford repository has them: each cell of a grid lists the point in it, if there is one. They were
// taken along -z, row by row from below. Where the file ends in them the grid is left out.
static int read_grid(const struct plan *plan, struct ply_cursor *at)
{
    struct patina_file *file = plan->file;
    struct ply_grid grid = {.columns = plan->header->grid_columns, .points = file->count};
    struct ply_lists lists = {.take = ply_take_cell, .context = &grid};
    lists.property = (uint32_t)ply_find_corners(plan->header, plan->grid);
    grid.row = column(plan, sizeof *grid.row);
    grid.column = column(plan, sizeof *grid.column);
    file->scans = calloc(1, sizeof *file->scans);
    int code = grid.row && grid.column && file->scans ? PATINA_OK : out_of_memory(plan);
    if (!code) {
        memset(grid.row, 0xFF, file->count * sizeof *grid.row);
        memset(grid.column, 0xFF, file->count * sizeof *grid.column);
        at->tone = PLY_WARN;
        code = ply_read_rows(at, plan->grid, NULL, &lists);
        free(lists.items);
    }
    if (grid.bad || grid.twice)
        pt_log(PT_LOG_WARNING,
               "%s: %llu cells of the range_grid name points that are not there, and %llu one that another cell has",
               plan->input->name, (unsigned long long)grid.bad, (unsigned long long)grid.twice);
    if (code) {
        free(grid.row);
        free(grid.column);
        return code;
    }
    file->scans[0] = (struct pt_scan){.count = file->count,
                                      .columns = plan->header->grid_columns,
                                      .rows = plan->header->grid_rows,
                                      .station = {0, 0, 1},
                                      .parallel = true,
                                      .pose = {[0] = 1, [5] = 1, [10] = 1}};
    file->scan_count = 1;
    code = pt_file_add_attribute(file, "column", PATINA_UINT16, grid.column);
    if (code)
        free(grid.row);
    else
        code = pt_file_add_attribute(file, "row", PATINA_UINT16, grid.row);
    return code ? out_of_memory(plan) : pt_file_grid_normals(file, plan->input);
}

// Passes over what stands behind the points. Where the file ends too early there, a line in the log says so.
static int read_behind(const struct plan *plan, struct ply_cursor *at)
{
    const struct ply_element *end = plan->header->elements + plan->header->element_count;
    at->tone = PLY_WARN;
    for (const struct ply_element *e = plan->points + 1; e < end; e++) {
        int code = e == plan->faces  ? read_faces(plan, at)
                   : e == plan->grid ? read_grid(plan, at)
                                     : ply_read_rows(at, e, NULL, NULL);
        if (code)
            return code == PATINA_ERROR_FORMAT ? PATINA_OK : code;
    }
    ply_warn_of_rest(*at);
    return PATINA_OK;
}

static const struct ply_element *find_faces(const struct plan *plan)
{
    static const char *const names[] = {"face", "faces", "tristrips"};
    const struct ply_header *header = plan->header;
    for (size_t n = 0; n < sizeof names / sizeof *names && !plan->file->normal; n++)
        for (uint32_t e = 0; e < header->element_count; e++)
            if (!strcmp(header->elements[e].name, names[n]) && header->elements[e].count &&
                ply_find_corners(header, &header->elements[e]) >= 0)
                return &header->elements[e];
    return NULL;
}

// A grid behind the points that has as many cells as it says.
static const struct ply_element *find_grid(const struct plan *plan)
{
    const struct ply_header *h = plan->header;
    for (const struct ply_element *e = plan->points + 1; e < h->elements + h->element_count; e++) {
        if (strcmp(e->name, "range_grid") || !e->count || ply_find_corners(h, e) < 0 ||
            pt_file_find_attribute(plan->file, "row") || pt_file_find_attribute(plan->file, "column"))
            continue;
        if (e->count == (uint64_t)h->grid_columns * h->grid_rows && h->grid_columns < PLY_NO_CELL && h->grid_rows < PLY_NO_CELL)
            return e;
        pt_log(PT_LOG_WARNING, "%s: the range_grid of %llu cells is left out: num_cols and num_rows say %u x %u",
               plan->input->name, (unsigned long long)e->count, h->grid_columns, h->grid_rows);
    }
    return NULL;
}

// What the file says of its points, and room for them.
static int plan_points(struct plan *plan)
{
    static const char *const formats[] = {"", "PLY ascii", "PLY binary_little_endian", "PLY binary_big_endian"};
    struct patina_file *file = plan->file;
    file->count = plan->points->count;
    snprintf(file->format, sizeof file->format, "%s", formats[plan->header->format]);
    memcpy(file->origin, plan->header->origin, sizeof file->origin);
    plan->properties = plan->header->properties + plan->points->first;
    plan->targets = calloc(plan->points->properties + 1u, sizeof *plan->targets);
    plan->taken = calloc(plan->points->properties + 1u, sizeof *plan->taken);
    if (!plan->targets || !plan->taken)
        return out_of_memory(plan);
    plan->splats = ply_are_splats(plan->properties, plan->points->properties);
    int code = plan_positions(plan);
    if (!code)
        code = plan_normals(plan);
    if (!code)
        code = plan_colors(plan);
    return code ? code : plan_attributes(plan);
}

static void free_plan(struct plan *plan)
{
    free(plan->staged);
    free(plan->targets);
    free(plan->taken);
}

static int read_points(struct plan *plan)
{
    struct patina_file *file = plan->file;
    struct ply_cursor at = {
        .input = plan->input, .header = plan->header, .offset = plan->header->body, .line = plan->header->body_line};
    // Before a byte is allocated; again by the readers of the rows, where elements stand before the points.
    int code = ply_check_count(&at, plan->points);
    if (code)
        return code;
    if (plan->points->count > UINT32_MAX - 1)
        return pt_fail(NULL, PATINA_ERROR_TOO_MANY_POINTS, "%s: %llu points, more than 2^32 - 2", plan->input->name,
                       (unsigned long long)plan->points->count);
    if ((code = plan_points(plan)))
        return code;
    plan->faces = find_faces(plan);
    plan->grid = find_grid(plan);
    struct ply_cursor before = at;
    if ((code = ply_check_line_ends(plan->input, plan->header)) || (code = read_to_points(plan, &at, &before)))
        return code;
    if (plan->staged) {
        pt_file_place(file, plan->staged);
        plan->staged = NULL;
    }
    if (plan->faces && plan->faces < plan->points && (code = read_faces(plan, &before)) && code != PATINA_ERROR_FORMAT)
        return code;
    if ((code = read_behind(plan, &at)))
        return code;
    if (plan->splats && ply_make_discs(file, plan->input->name))
        return out_of_memory(plan);
    pt_file_measure(file);
    pt_progress_set(plan->input->progress, 1);
    return PATINA_OK;
}

int pt_ply_read(struct patina_file *file, const struct pt_input *input)
{
    struct plan plan = {.input = input, .file = file};
    struct ply_header *header = calloc(1, sizeof *header); // 150 KB: too much for a stack
    if (!header)
        return pt_fail(NULL, PATINA_ERROR_MEMORY, "%s: out of memory", input->name);
    int code = ply_read_header(input, header);
    if (code)
        goto done;
    plan.header = header;
    plan.points = ply_find_points(header);
    if (!plan.points) {
        code = pt_fail(NULL, PATINA_ERROR_FORMAT, "%s: the header declares no element vertex", input->name);
        goto done;
    }
    code = read_points(&plan);
    if (!code && ply_read_scans(file, input, header->body))
        code = out_of_memory(&plan);
done:
    free_plan(&plan);
    free(header);
    return code;
}

// ---- windows -------------------------------------------------------------------------------------------------------

int ply_read_window(struct patina_file *file, const struct ply_element *window, struct ply_cursor *at, const double origin[3])
{
    struct plan plan = {.input = at->input, .file = file, .header = at->header, .points = window};
    int code = plan_points(&plan);
    if (!code)
        code = ply_read_rows(at, window, plan.targets, NULL);
    if (!code && plan.staged) {
        pt_file_place_at(file, plan.staged, origin);
        plan.staged = NULL;
    }
    if (!code && plan.splats && ply_make_discs(file, at->before ? NULL : at->input->name))
        code = out_of_memory(&plan);
    if (!code)
        pt_file_measure(file);
    free_plan(&plan);
    return code;
}

bool ply_is_fine(const struct ply_header *header, const struct ply_element *points)
{
    bool fine = header->format == PLY_ASCII;
    for (uint32_t k = points->first; k < points->first + points->properties; k++) {
        const struct ply_property *p = &header->properties[k];
        const bool place = !strcmp(p->name, "x") || !strcmp(p->name, "y") || !strcmp(p->name, "z");
        fine |= place && (p->type == PATINA_FLOAT64 || p->type == PATINA_INT32 || p->type == PATINA_UINT32);
    }
    return fine;
}

const char *ply_why_whole(const struct pt_input *input, const struct ply_header *header, const struct ply_element *points)
{
    const struct plan plan = {.header = header, .points = points, .properties = header->properties + points->first};
    int64_t found[FAMILY];
    const bool normals = find_family(&plan, normal_names, sizeof normal_names / sizeof *normal_names, found);
    for (const struct ply_element *e = header->elements; e < header->elements + header->element_count; e++) {
        const bool faces = !strcmp(e->name, "face") || !strcmp(e->name, "faces") || !strcmp(e->name, "tristrips");
        if (e->count && faces && !normals && ply_find_corners(header, e) >= 0)
            return "its faces give the points their normals";
        if (e->count && e > points && !strcmp(e->name, "range_grid"))
            return "its range_grid gives the points their normals";
    }
    return ply_tells_of_scans(input, header->body) ? "its header tells of scans" : NULL;
}
