// SPDX-License-Identifier: GPL-3.0-or-later
#include "eye.h"

#include <math.h>
#include <string.h>

int pt_eye_of(const struct patina_scene *scene, struct pt_eye *camera)
{
    const patina_camera *c = &scene->camera;
    const patina_settings *s = &scene->settings;
    if (pt_camera_axes(c, camera->axes, camera->position))
        return pt_fail_again(&scene->handle, PATINA_ERROR_ARGUMENT);
    camera->orthographic = c->orthographic != 0;
    camera->xs = (c->right - c->left) / s->width;
    camera->ys = (c->top - c->bottom) / s->height;
    camera->left = c->left;
    camera->bottom = c->bottom;
    camera->near_clip = c->near_clip;
    camera->far_clip = c->far_clip;
    camera->width = s->width;
    camera->height = s->height;
    return PATINA_OK;
}

void pt_pad_eye(struct pt_eye *camera, uint32_t guard)
{
    camera->left -= guard * camera->xs;
    camera->bottom -= guard * camera->ys;
    camera->width += 2.0 * guard;
    camera->height += 2.0 * guard;
}

void pt_object_of(const struct pt_eye *camera, const double world_from_object[16], struct pt_object *object)
{
    pt_split_matrix(world_from_object, object->linear, object->translation);
    pt_multiply(camera->axes, object->linear, object->view);
    double size = 0.0, determinant = pt_invert(object->linear, object->inverse);
    object->scale = 0.0;
    for (int c = 0; c < 3; c++) {
        double column[3] = {object->linear[c], object->linear[3 + c], object->linear[6 + c]};
        object->scale = fmax(object->scale, sqrt(pt_dot(column, column)));
    }
    size = object->scale * object->scale * object->scale;
    object->singular = !(fabs(determinant) > 1e-14 * size) || !(size > 0.0);
    if (object->singular)
        memset(object->inverse, 0, sizeof object->inverse);
    double offset[3];
    for (int k = 0; k < 3; k++)
        offset[k] = camera->position[k] - object->translation[k];
    pt_apply(object->inverse, camera->orthographic ? camera->axes + 6 : offset, object->eye);
    object->eye[3] = camera->orthographic ? 0.0 : 1.0;
}

void pt_normal_matrix(const struct pt_eye *camera, const struct pt_object *object, float out[9])
{
    double cofactors[9], product[9], largest = 0.0;
    pt_cofactors(object->linear, cofactors);
    double sign = pt_dot(object->linear, cofactors) < 0.0 ? -1.0 : 1.0;
    pt_multiply(camera->axes, cofactors, product);
    for (int i = 0; i < 9; i++)
        largest = fmax(largest, fabs(product[i]));
    for (int i = 0; i < 9; i++) // a singular object has no normals
        out[i] = object->singular || !(largest > 0.0) ? 0.0f : (float)(sign * product[i] / largest);
}

// What makes the normal matrix the inverse transposed, times the largest stretch.
static float axis_scale(const struct pt_eye *camera, const struct pt_object *object)
{
    double cofactors[9], product[9], largest = 0.0;
    pt_cofactors(object->linear, cofactors);
    pt_multiply(camera->axes, cofactors, product);
    for (int i = 0; i < 9; i++)
        largest = fmax(largest, fabs(product[i]));
    return object->singular ? 1.0f : (float)(largest * object->scale / fabs(pt_dot(object->linear, cofactors)));
}

void pt_object_rows(const struct pt_eye *camera, const struct pt_object *object, double rows[9])
{
    const double sx = 1.0 / camera->xs, sy = 1.0 / camera->ys;
    const double ox = -camera->left * sx, oy = -camera->bottom * sy; // pixel of the axis
    const double *v = object->view;
    for (int c = 0; c < 3; c++) {
        rows[c] = sx * v[c];
        rows[3 + c] = sy * v[3 + c];
        rows[6 + c] = -v[6 + c];
        if (!camera->orthographic) {
            rows[c] += ox * rows[6 + c];
            rows[3 + c] += oy * rows[6 + c];
        }
    }
}

void pt_chunk_translation(const struct pt_eye *camera, const struct pt_object *object, const struct pt_chunk *chunk,
                          double translation[3])
{
    double world[3], view[3];
    pt_apply(object->linear, chunk->origin, world);
    for (int k = 0; k < 3; k++) // subtract first: the difference is exact where 5e6 m cancel
        world[k] = (world[k] + object->translation[k]) - camera->position[k];
    pt_apply(camera->axes, world, view);
    const double sx = 1.0 / camera->xs, sy = 1.0 / camera->ys;
    const double ox = -camera->left * sx, oy = -camera->bottom * sy;
    translation[2] = camera->orthographic ? -view[2] - camera->near_clip : -view[2];
    translation[0] = sx * view[0] + ox * (camera->orthographic ? 1.0 : translation[2]);
    translation[1] = sy * view[1] + oy * (camera->orthographic ? 1.0 : translation[2]);
}

// Of z, from which on a reach may come to many pixels.
#define NEAR_REACH 0.01

// Whether a box lies beyond one side of the view, its part behind the camera too, where the screen bounds nothing. q: of its
// corners, screen X and Y times z, and z, each off by `error` at most. A pixel narrower than exact.
static int lies_beside(const struct pt_eye *camera, double q[3][8], const double error[3], double reach)
{
    for (int k = 0; k < 2; k++) {
        const double size = k ? camera->height : camera->width, scale = 1.0 / (k ? camera->ys : camera->xs);
        const double wide = error[k] + reach * scale * (1.0 + fabs(k ? camera->bottom : camera->left)), deep = error[2] + reach;
        int low = 0, high = 0;
        for (int i = 0; i < 8; i++) {
            const double pixel = fabs(q[2][i]) + deep;
            low += q[k][i] + pixel + wide < 0.0;
            high += q[k][i] - size * (q[2][i] + deep) - pixel - wide > 0.0;
        }
        if (low == 8 || high == 8)
            return 1;
    }
    return 0;
}

// Extent of the chunk's box and what lies within `reach` of it, world units, on screen a pixel wider than exact and not cut off at the
// picture's; 0 when it is outside the view. balls: what lies within reach of a point beyond the near or far plane may still show.
static int chunk_bounds(const struct pt_eye *camera, const struct pt_chunk *chunk, const double rows[9],
                        const double translation[3], double reach, int balls, struct pt_extent *out)
{
    double *const rect = out->rect;
    const double z_far = camera->orthographic ? camera->far_clip - camera->near_clip : camera->far_clip;
    const double z_near = camera->orthographic ? 0.0 : camera->near_clip;
    double z_min = INFINITY, z_max = -INFINITY, q[3][8]; // of the corners
    double error[3], slop; // what float32 may move a point by: where |R p| is large beside the sum, more than a pixel
    rect[0] = rect[1] = INFINITY;
    rect[2] = rect[3] = -INFINITY;
    for (int k = 0; k < 3; k++) {
        double part[3][2];
        error[k] = fabs(translation[k]);
        for (int c = 0; c < 3; c++) {
            part[c][0] = rows[3 * k + c] * (double)chunk->box_min[c];
            part[c][1] = rows[3 * k + c] * (double)chunk->box_max[c];
            error[k] += pt_most(fabs(part[c][0]), fabs(part[c][1]));
        }
        error[k] *= 0x1p-21;
        for (int i = 0; i < 8; i++)
            q[k][i] = ((part[0][i & 1] + part[1][i >> 1 & 1]) + part[2][i >> 2]) + translation[k];
    }
    for (int i = 0; i < 8; i++) {
        z_min = pt_least(q[2][i], z_min);
        z_max = pt_most(q[2][i], z_max);
        double w = camera->orthographic ? 1.0 : q[2][i];
        for (int k = 0; k < 2 && w > 0.0; k++) {
            double at = q[k][i] / w;
            rect[k] = pt_least(at - 1.0, rect[k]);
            rect[2 + k] = pt_most(at + 1.0, rect[2 + k]);
        }
    }
    out->beside = 0;
    slop = 1e-5 * (fabs(z_min) + fabs(z_max)) + error[2];
    out->z_middle = 0.5 * (pt_most(z_min, z_near) + pt_most(z_max, z_near));
    out->z_beyond = z_max + slop + reach;
    out->z_before = z_min - slop - reach;
    out->share = z_min < z_near ? (z_max - z_near) / (z_max - z_min) : 1.0;
    const double nearest_z = z_min - reach;
    const double around = slop + (balls ? reach : 0.0);
    if (!(z_max + around >= z_near) || !(z_min - around <= z_far))
        return 0;
    double nearest = camera->orthographic ? 1.0 : pt_most(nearest_z, z_near) - error[2];
    for (int k = 0; k < 2; k++) {
        double far = pt_most(fabs(rect[k]), fabs(rect[2 + k])), wider = INFINITY;
        if (camera->orthographic)
            wider = error[k];
        else if (nearest > 0.0)
            wider = (error[k] + far * error[2]) / nearest + far * 0x1p-20;
        // sideways, and along the view at the rim's slope
        double step = k ? camera->ys : camera->xs, start = k ? camera->bottom : camera->left;
        double slope = pt_most(fabs(start + step * rect[k]), fabs(start + step * rect[2 + k]));
        if (reach > 0.0)
            wider += camera->orthographic ? reach / step : reach * (1.0 + slope) / (step * pt_most(nearest, 0.0));
        rect[k] -= wider;
        rect[2 + k] += wider;
    }
    if (!camera->orthographic && nearest_z < z_near) { // corners behind the camera bound nothing
        rect[0] = rect[1] = -INFINITY;
        rect[2] = rect[3] = INFINITY;
        return !lies_beside(camera, q, error, reach);
    }
    // the bounds of wide discs right before the camera are wide
    out->beside = !camera->orthographic && reach > NEAR_REACH * nearest_z && lies_beside(camera, q, error, reach);
    // what is not a number bounds nothing
    return !(rect[0] >= camera->width || rect[1] >= camera->height || rect[2] <= 0.0 || rect[3] <= 0.0);
}

int pt_kind_bounds(const struct pt_eye *camera, enum pt_kind kind, const struct pt_to_place *what, const struct pt_chunk *box,
                   const double rows[9], const double translation[3], struct pt_extent *out)
{
    const struct pt_kind_row *row = &pt_kinds[kind];
    if (!chunk_bounds(camera, box, rows, translation, row->reach(what, box), row->beyond, out))
        return 0;
    for (int k = 0; k < 4; k++)
        out->rect[k] += k < 2 ? -row->pixels : row->pixels;
    return 1;
}

void pt_chunk_eye(const struct pt_object *object, const struct pt_chunk *chunk, double eye[4])
{
    eye[3] = object->eye[3];
    for (int k = 0; k < 3; k++)
        eye[k] = eye[3] > 0.0 ? object->eye[k] - chunk->origin[k] : object->eye[k];
}

void pt_set_product(const double rows[9], const double translation[3], float row[9], float hi[3], float lo[3])
{
    for (int k = 0; k < 9; k++)
        row[k] = (float)rows[k];
    for (int k = 0; k < 3; k++) {
        hi[k] = (float)translation[k];
        lo[k] = (float)(translation[k] - (double)hi[k]);
    }
}

void pt_set_chunk(const struct pt_eye *camera, const struct pt_object *object, const double rows[9],
                  const struct pt_instance *instance, const struct pt_chunk *chunk, uint32_t count, uint32_t cull,
                  struct chunk_view *out)
{
    double translation[3], eye[4] = {0};
    pt_chunk_translation(camera, object, chunk, translation);
    pt_set_product(rows, translation, out->row, out->hi, out->lo);
    if (cull)
        pt_chunk_eye(object, chunk, eye);
    for (int k = 0; k < 4; k++)
        out->eye[k] = (float)eye[k];
    out->first = chunk->first;
    out->count = count;
    out->padded = chunk->padded;
    out->cull = cull;
    out->step = instance->cloud && instance->cloud->packed ? pt_chunk_step(chunk) : 0.0f;
}

#define LARGEST_LAYER 1e30f

void pt_set_instance(const struct pt_eye *camera, const struct pt_object *object, const struct pt_instance *instance,
                     double thinned, struct instance_args *args)
{
    const struct patina_cloud *cloud = instance->cloud;
    const patina_cloud_style *style = &instance->style;
    args->slots = (uint32_t)cloud->slots;
    args->has_normals = cloud->info.has_normals;
    args->color_format = cloud->color_format ? cloud->color_format : pt_is_marked(instance) ? PT_COLOR_FLOAT : PT_COLOR_NONE;
    args->lit = style->lighting == PATINA_LIGHTING_LIT;
    args->shininess = style->shininess;
    args->opacity = 1.0f - style->transparency;
    args->has_opacities = cloud->info.has_opacities;
    args->ambient = style->ambient;
    args->diffuse = style->diffuse;
    args->specular = style->specular;
    memcpy(args->color, style->color, sizeof args->color);
    // finite with all that they are multiplied by: within an infinite layer distance empty pixels would be neighbours
    args->d_min = fminf(style->d_min, LARGEST_LAYER);
    pt_normal_matrix(camera, object, args->normal_matrix);
    args->axis_scale = axis_scale(camera, object);
    for (uint32_t k = 0; k < PT_SPACINGS; k++)
        args->spacing[k] = (float)fmin(thinned * cloud->spacing_base * pt_spacing_of_class(k) * object->scale, LARGEST_LAYER);
}

void pt_join_rect(uint32_t rect[4], const uint32_t other[4])
{
    if (rect[0] >= rect[2]) {
        memcpy(rect, other, 4 * sizeof *rect);
        return;
    }
    for (int k = 0; k < 2; k++) {
        rect[k] = other[k] < rect[k] ? other[k] : rect[k];
        rect[2 + k] = other[2 + k] > rect[2 + k] ? other[2 + k] : rect[2 + k];
    }
}

int pt_rect_in_window(const struct view_args *view, const double bounds[4], uint32_t pad, uint32_t rect[4])
{
    const double origin[2] = {(double)view->origin_x - pad, (double)view->origin_y - pad};
    const double size[2] = {view->width, view->height};
    for (int k = 0; k < 2; k++) { // cut first: what is left is whole numbers that fit
        double first = pt_most(bounds[k] - origin[k], 0.0), last = pt_least(bounds[2 + k] - origin[k], size[k]);
        if (!(last > 0.0) || !(first < size[k]))
            return 0;
        rect[k] = (uint32_t)first;
        rect[2 + k] = (uint32_t)last;
        rect[2 + k] += (double)rect[2 + k] < last;
    }
    return rect[0] < rect[2] && rect[1] < rect[3];
}

uint32_t pt_drawn_points(const struct patina_scene *scene, const struct pt_chunk *chunk)
{
    uint32_t strata = scene->settings.strata;
    if (!strata || strata == PT_STRATA)
        return chunk->count;
    uint32_t count = (pt_chunk_prefix(chunk, strata) + PT_CHUNK_ALIGN - 1) / PT_CHUNK_ALIGN * PT_CHUNK_ALIGN;
    return count < chunk->count ? count : chunk->count;
}
