// SPDX-License-Identifier: GPL-3.0-or-later
#include "scene.h"
#include "base/descriptor.h"

#include "clip.h"
#include "mask.h"
#include "scene/clouds/paged.h"
#include "scene/clouds/parts.h"
#include "scans.h"
#include "shared/balls.h"
#include "shared/lines.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

static int fail(const patina_scene *scene, const char *what)
{
    return pt_fail(scene ? &scene->handle : NULL, PATINA_ERROR_ARGUMENT, "%s", what);
}

static int finite_floats(const float *values, int count)
{
    for (int i = 0; i < count; i++)
        if (!isfinite(values[i]))
            return 0;
    return 1;
}

static int all_finite(const double *values, int count)
{
    for (int i = 0; i < count; i++)
        if (!isfinite(values[i]))
            return 0;
    return 1;
}

int patina_scene_create(patina_scene **out)
{
    if (!out)
        return fail(NULL, "patina_scene_create: out is NULL");
    patina_scene *scene = *out = calloc(1, sizeof *scene);
    if (!scene)
        return pt_fail(NULL, PATINA_ERROR_MEMORY, "a scene: out of memory");
    pt_handle_init(&scene->handle);
    const patina_settings defaults = {.struct_size = sizeof defaults};
    patina_scene_set_effects(scene, NULL);
    return patina_scene_set_settings(scene, &defaults);
}

void patina_scene_destroy(patina_scene *scene)
{
    if (!scene)
        return;
    patina_scene_clear(scene);
    free(scene->instances);
    free(scene->lights);
    free(scene->clips);
    pt_handle_destroy(&scene->handle);
    free(scene);
}

int patina_scene_clear(patina_scene *scene)
{
    if (!scene)
        return fail(NULL, "patina_scene_clear: scene is NULL");
    for (uint32_t i = 0; i < scene->cloud_count; i++)
        free((void *)scene->instances[i].style.ramp);
    scene->cloud_count = scene->given = scene->light_count = scene->mesh_count = scene->clip_count = 0;
    scene->triangles = 0;
    return PATINA_OK;
}

// Room for so many elements, or NULL.
static void *grow(void *array, uint32_t count, uint32_t *room, size_t size)
{
    if (count <= *room)
        return array;
    uint32_t wanted = *room ? 2 * *room : 8;
    wanted = wanted < count ? count : wanted;
    void *grown = realloc(array, wanted * size);
    if (grown)
        *room = wanted;
    return grown;
}

static int check_color(const patina_scene *scene, patina_cloud_style *style, const patina_cloud *cloud)
{
    if (style->color_source > PATINA_COLOR_TRUST)
        return fail(scene, "cloud style: no such color_source");
    if (style->color_source == PATINA_COLOR_SCALAR && !cloud->info.has_scalars)
        return fail(scene, "cloud style: a ramp over scalars, and the cloud has none");
    if (style->ramp && (style->ramp_count < 2 || style->ramp_count > PATINA_MAX_RAMP))
        return pt_fail(&scene->handle, PATINA_ERROR_ARGUMENT, "cloud style: a ramp of %u colours; 2 to %d can be had",
                       style->ramp_count, PATINA_MAX_RAMP);
    for (uint32_t i = 0; style->ramp && i < 3 * style->ramp_count; i++)
        if (!isfinite(style->ramp[i]))
            return fail(scene, "cloud style: a colour of the ramp is not finite");
    if (!isfinite(style->ramp_range[0]) || !isfinite(style->ramp_range[1]))
        return fail(scene, "cloud style: ramp_range is not finite");
    if (!(fabsf(style->exposure) <= 32.0f) || !(style->contrast >= 0.0f && style->contrast <= 16.0f))
        return fail(scene, "cloud style: exposure must be between -32 and 32 stops, contrast between 0 and 16");
    if (style->clip_off > 1)
        return fail(scene, "cloud style: clip_off is 0 or 1");
    if (style->free_space > PATINA_FREE_SPACE_USE)
        return fail(scene, "cloud style: no such free_space");
    if (style->hidden_kinds >> 6)
        return fail(scene, "cloud style: hidden_kinds has unknown bits");
    if (!isfinite(style->least_trust) || style->least_trust > 1.0f)
        return fail(scene, "cloud style: least_trust must be at most 1");
    style->contrast = style->contrast == 0.0f ? 1.0f : style->contrast;
    if (style->mask && (style->mask->handle.magic != PT_MAGIC || style->mask->of != cloud->alive))
        return fail(scene, "cloud style: the mask is destroyed, or of another cloud");
    if (style->grade && (style->grade->handle.magic != PT_MAGIC || style->grade->of != cloud->alive ||
                         style->grade->size != cloud->slots * pt_color_size(cloud->color_format)))
        return fail(scene, "cloud style: the grade is destroyed, of another cloud, or of other colours");
    return PATINA_OK;
}

static void default_grey(float color[3])
{
    if (pt_is_zero(color))
        color[0] = color[1] = color[2] = 0.8f;
}

// Of points there may be any number: a picture numbers what it sees. Of triangles it numbers all.
static int too_many(const patina_scene *scene, uint64_t triangles)
{
    if (scene->triangles + triangles <= 0xFFFFFFFEull)
        return PATINA_OK;
    return pt_fail(&scene->handle, PATINA_ERROR_TOO_MANY_POINTS,
                   "the scene would hold %llu triangles with this instance; 4294967294 can be told apart",
                   (unsigned long long)(scene->triangles + triangles));
}

static int check_soft(const patina_scene *scene, patina_cloud_style *style, const patina_cloud *cloud)
{
    if (style->soft > PATINA_SOFT_HIDDEN || style->soft_model > PATINA_SOFT_ONE_LAYER)
        return fail(scene, "cloud style: no such soft or soft_model");
    if (style->soft_shells > (uint32_t)PT_SOFT_SHELLS)
        return pt_fail(&scene->handle, PATINA_ERROR_ARGUMENT, "cloud style: %u soft_shells; the most is %u", style->soft_shells,
                       (uint32_t)PT_SOFT_SHELLS);
    if (!(style->soft_radius >= 0.0f) || !isfinite(style->soft_radius))
        return fail(scene, "cloud style: soft_radius must be 0 or more");
    if (!(style->soft_opacity >= 0.0f && style->soft_opacity <= 1.0f) ||
        !(style->soft_modulation >= 0.0f && style->soft_modulation <= 1.0f))
        return fail(scene, "cloud style: soft_opacity and soft_modulation must be within 0 and 1");
    if (!(style->soft_threshold >= 0.0f && style->soft_threshold <= 1.0f))
        return fail(scene, "cloud style: soft_threshold must be within 0 and 1");
    if (style->field ? style->field->handle.magic != PT_MAGIC || style->field->of != cloud->alive : pt_has_field(style))
        return fail(scene, "cloud style: the field is missing, destroyed, or of another cloud");
    style->soft_opacity = style->soft_opacity == 0.0f ? 0.5f : style->soft_opacity;
    if (!pt_has_balls(style))
        return PATINA_OK;
    for (uint32_t i = 0; i < scene->cloud_count; i++) {
        const patina_cloud_style *other = &scene->instances[i].style;
        if (pt_has_balls(other) && (other->soft_model != style->soft_model || other->soft_shells != style->soft_shells))
            return pt_fail(
                &scene->handle, PATINA_ERROR_ARGUMENT,
                "cloud style: soft clouds of a scene are drawn together, and instance %u has another soft_model or soft_shells",
                i);
    }
    return PATINA_OK;
}

static int check_style(const patina_scene *scene, patina_cloud_style *style, const patina_cloud *cloud)
{
    const float *c = style->color;
    if (!pt_take_matrix(style->world_from_object))
        return fail(scene, "cloud style: world_from_object is not finite");
    if (!(style->d_min >= 0.0f) || !isfinite(style->d_min))
        return fail(scene, "cloud style: d_min must be 0 or more");
    if (!(style->transparency >= 0.0f) || !(style->transparency <= 1.0f))
        return fail(scene, "cloud style: transparency must be within 0 and 1");
    if (style->lighting > PATINA_LIGHTING_LIT)
        return fail(scene, "cloud style: no such lighting");
    if (!isfinite(c[0]) || !isfinite(c[1]) || !isfinite(c[2]) || !isfinite(style->ambient + style->diffuse + style->specular))
        return fail(scene, "cloud style: colour and Phong factors must be finite");
    if (style->lighting == PATINA_LIGHTING_AUTO)
        style->lighting = cloud->info.has_colors && style->color_source == PATINA_COLOR_OWN ? PATINA_LIGHTING_UNLIT
                                                                                            : PATINA_LIGHTING_LIT;
    if (style->exact > 1)
        return fail(scene, "cloud style: exact is 0 or 1");
    if (!style->exact)
        default_grey(style->color);
    if (!style->exact && style->ambient == 0.0f && style->diffuse == 0.0f && style->specular == 0.0f)
        style->ambient = style->diffuse = 1.0f;
    if (!(style->transparency >= 0.0f) || !(style->transparency <= 1.0f))
        return fail(scene, "cloud style: transparency must be between 0 and 1");
    if (!(style->radius >= 0.0f) || !isfinite(style->radius))
        return fail(scene, "cloud style: radius must be 0 or more");
    if (!(style->largest_gap >= 0.0f) || !isfinite(style->largest_gap))
        return fail(scene, "cloud style: largest_gap must be 0 or more");
    if (style->shadow_off > 7)
        return fail(scene, "cloud style: shadow_off has unknown bits");
    style->shininess = style->shininess == 0 ? 32 : style->shininess > 4096 ? 4096 : style->shininess;
    int error = check_soft(scene, style, cloud);
    error = error ? error : pt_check_ranges(scene, style, cloud);
    return error ? error : check_color(scene, style, cloud);
}

static int copy_ramp(patina_cloud_style *style)
{
    size_t size = 3 * (size_t)style->ramp_count * sizeof *style->ramp;
    if (!style->ramp)
        return PATINA_OK;
    float *copy = malloc(size);
    if (copy)
        memcpy(copy, style->ramp, size);
    style->ramp = copy;
    return copy ? PATINA_OK : PATINA_ERROR_MEMORY;
}

// Sums of what is drawn as range images, and maps of faint points, are not those of all parts together. Masks and grades have
// parts, too; fields and scans no cloud in parts has.
static int check_parts(const patina_scene *scene, const patina_cloud_style *style, const patina_cloud *cloud)
{
    const char *lacks = style->surface == PATINA_SURFACE_RANGES ? "range images"
                        : cloud->info.has_opacities && !(style->shadow_off & PATINA_SHADOW_NO_CAST)
                            ? "shadows of points that have opacities of their own"
                            : NULL;
    if (!cloud->part_count || !lacks)
        return PATINA_OK;
    return pt_fail(&scene->handle, PATINA_ERROR_UNSUPPORTED,
                   "cloud style: %s: not of a cloud of %llu points; up to 2147483647 can have them", lacks,
                   (unsigned long long)cloud->info.count);
}

// Behind the clouds that are there, which has room.
static int put_part(patina_scene *scene, const patina_cloud *whole, const patina_cloud *part, const patina_cloud_style *style)
{
    struct pt_instance *added = &scene->instances[scene->cloud_count];
    patina_cloud_style own = *style;
    own.mask = pt_mask_part(style->mask, (uint32_t)(part - pt_part(whole, 0)));
    own.grade = pt_grade_part(style->grade, (uint32_t)(part - pt_part(whole, 0)));
    if (copy_ramp(&own))
        return pt_fail(&scene->handle, PATINA_ERROR_MEMORY, "scene: out of memory for the ramp of instance %u", scene->given);
    memmove(added + 1, added, scene->mesh_count * sizeof *added);
    *added = (struct pt_instance){
        .source = PT_SOURCE_CLOUD, .number = scene->given, .cloud = part, .whole = whole, .style = own};
    scene->cloud_count++;
    return PATINA_OK;
}

static void take_last(patina_scene *scene)
{
    struct pt_instance *last = &scene->instances[--scene->cloud_count];
    free((void *)last->style.ramp);
    memmove(last, last + 1, scene->mesh_count * sizeof *last);
}

int patina_scene_add_cloud(patina_scene *scene, const patina_cloud *cloud, const patina_cloud_style *style)
{
    patina_cloud_style checked;
    if (!scene || !cloud || cloud->handle.magic != PT_MAGIC)
        return fail(scene, "patina_scene_add_cloud: scene or cloud is NULL or destroyed");
    int error = pt_take(&scene->handle, "patina_scene_add_cloud", style, &checked, sizeof checked);
    error = error ? error : check_style(scene, &checked, cloud);
    if (error || (error = check_parts(scene, &checked, cloud)))
        return error;
    const uint32_t parts = pt_part_count(cloud), before = scene->cloud_count;
    void *grown = grow(scene->instances, before + parts + scene->mesh_count, &scene->instance_room, sizeof *scene->instances);
    if (!grown)
        return pt_fail(&scene->handle, PATINA_ERROR_MEMORY, "scene: out of memory for instance %u", scene->given);
    scene->instances = grown;
    for (uint32_t i = 0; i < parts && !error; i++)
        error = put_part(scene, cloud, pt_part(cloud, i), &checked);
    while (error && scene->cloud_count > before)
        take_last(scene);
    scene->given += !error;
    return error;
}

uint32_t pt_scene_parts(const patina_scene *scene, uint32_t number, uint32_t *first)
{
    uint32_t low = 0, high = scene->cloud_count, count = 0;
    while (low < high) { // numbers rise
        const uint32_t middle = low + (high - low) / 2;
        if (scene->instances[middle].number < number)
            low = middle + 1;
        else
            high = middle;
    }
    while (low + count < scene->cloud_count && scene->instances[low + count].number == number)
        count++;
    *first = low;
    return count;
}

int patina_scene_add_mesh(patina_scene *scene, const patina_mesh *mesh, const patina_mesh_style *style)
{
    patina_mesh_style checked;
    if (!scene || !mesh || mesh->handle.magic != PT_MAGIC)
        return fail(scene, "patina_scene_add_mesh: scene or mesh is NULL or destroyed");
    int error = pt_take(&scene->handle, "patina_scene_add_mesh", style, &checked, sizeof checked);
    if (error)
        return error;
    if (!pt_take_matrix(checked.world_from_object))
        return fail(scene, "mesh style: world_from_object is not finite");
    if (!isfinite(checked.color[0] + checked.color[1] + checked.color[2]))
        return fail(scene, "mesh style: colour must be finite");
    if (checked.shadow_off & ~(uint32_t)(PATINA_SHADOW_NO_CAST | PATINA_SHADOW_NO_RECEIVE))
        return fail(scene, "mesh style: shadow_off has unknown bits");
    if (checked.unlit > 1 || checked.alpha > PATINA_ALPHA_BLEND ||
        !(checked.alpha_least >= 0.0f && checked.alpha_least <= 1.0f))
        return fail(scene, "mesh style: unlit is 0 or 1, alpha is a patina_alpha, alpha_least within 0..1");
    if (checked.texture && checked.texture->handle.magic != PT_MAGIC)
        return fail(scene, "mesh style: texture was destroyed");
    if (checked.texture && !mesh->has_uv)
        return fail(scene, "mesh style: a texture, but the mesh has no uv");
    checked.alpha_least = checked.alpha_least > 0.0f ? checked.alpha_least : 0.5f;
    if (!checked.texture || checked.texture->opaque)
        checked.alpha = PATINA_ALPHA_NONE;
    if (checked.exact > 1)
        return fail(scene, "mesh style: exact is 0 or 1");
    if (!checked.exact)
        default_grey(checked.color);
    error = too_many(scene, mesh->info.triangle_count);
    if (error)
        return error;
    void *grown = grow(scene->instances, scene->cloud_count + scene->mesh_count + 1, &scene->instance_room,
                       sizeof *scene->instances);
    if (!grown)
        return pt_fail(&scene->handle, PATINA_ERROR_MEMORY, "scene: out of memory for mesh %u", scene->mesh_count);
    scene->instances = grown;
    *pt_mesh_at(scene, scene->mesh_count++) = (struct pt_instance){
        .source = PT_SOURCE_MESH, .mesh = mesh, .mesh_style = checked, .id_base = (uint32_t)scene->triangles};
    scene->triangles += mesh->info.triangle_count;
    return PATINA_OK;
}

static int check_light(const patina_scene *scene, patina_light_desc *light)
{
    const double pi = 3.14159265358979323846;
    if (light->type < PATINA_LIGHT_SUN || light->type > PATINA_LIGHT_AREA || light->shape > PATINA_AREA_ELLIPSE)
        return fail(scene, "light: no such type or shape");
    if (!all_finite(light->position, 3) || !all_finite(light->direction, 3) || !all_finite(light->side, 3) ||
        !isfinite(light->power) || !isfinite(light->color[0] + light->color[1] + light->color[2]))
        return fail(scene, "light: position, direction, side, power and colour must be finite");
    if (!(light->angle >= 0.0f && light->angle <= (float)pi) || !(light->cone >= 0.0f && light->cone <= (float)pi))
        return fail(scene, "light: angle and cone must be between 0 and pi");
    if (!(light->blend >= 0.0f && light->blend <= 1.0f))
        return fail(scene, "light: blend must be between 0 and 1");
    if (!(light->radius >= 0.0f) || !(light->size[0] >= 0.0f) || !(light->size[1] >= 0.0f) ||
        !isfinite(light->radius + light->size[0] + light->size[1]))
        return fail(scene, "light: radius and size must be finite and 0 or more");
    if (pt_is_zero(light->color))
        light->color[0] = light->color[1] = light->color[2] = 1.0f;
    light->cone = light->cone == 0.0f ? (float)(pi / 4.0) : light->cone;
    for (int k = 0; k < 2; k++)
        light->size[k] = light->size[k] == 0.0f ? 1.0f : light->size[k];
    double length = sqrt(pt_dot(light->direction, light->direction));
    if (!(length > 0.0) || !isfinite(length)) { // also where it over- or underflows
        light->direction[0] = light->direction[1] = 0.0;
        light->direction[2] = -1.0;
        length = 1.0;
    }
    for (int k = 0; k < 3; k++)
        light->direction[k] /= length;
    return PATINA_OK;
}

int patina_scene_add_light(patina_scene *scene, const patina_light_desc *light)
{
    patina_light_desc checked;
    if (!scene || !light)
        return fail(scene, "patina_scene_add_light: scene or light is NULL");
    int error = pt_take(&scene->handle, "patina_scene_add_light", light, &checked, sizeof checked);
    if (error || (error = check_light(scene, &checked)))
        return error;
    if (scene->light_count == PT_MAX_LIGHTS)
        return pt_fail(&scene->handle, PATINA_ERROR_ARGUMENT, "the scene has %d lights already, the most there can be",
                       PT_MAX_LIGHTS);
    void *grown = grow(scene->lights, scene->light_count + 1, &scene->light_room, sizeof *scene->lights);
    if (!grown)
        return pt_fail(&scene->handle, PATINA_ERROR_MEMORY, "scene: out of memory for light %u", scene->light_count);
    scene->lights = grown;
    scene->lights[scene->light_count++] = checked;
    return PATINA_OK;
}

int patina_scene_add_clip(patina_scene *scene, const patina_clip *clip)
{
    patina_clip checked;
    if (!scene || !clip)
        return fail(scene, "patina_scene_add_clip: scene or clip is NULL");
    const int error = pt_take(&scene->handle, "patina_scene_add_clip", clip, &checked, sizeof checked);
    if (error)
        return error;
    if (!pt_take_matrix(checked.world_from_clip))
        return fail(scene, "clip: world_from_clip is not finite");
    if (checked.shape > PATINA_CLIP_PLANE || checked.cut > 1)
        return fail(scene, "clip: no such shape, or cut is neither 0 nor 1");
    if (!isfinite(checked.tint[0] + checked.tint[1] + checked.tint[2]) || !(checked.tint_width >= 0.0f) ||
        !isfinite(checked.tint_width) || !(checked.tint_strength >= 0.0f && checked.tint_strength <= 1.0f))
        return fail(scene, "clip: tint and tint_width must be finite, the width 0 or more, the strength between 0 and 1");
    void *grown = grow(scene->clips, scene->clip_count + 1, &scene->clip_room, sizeof *scene->clips);
    if (!grown)
        return pt_fail(&scene->handle, PATINA_ERROR_MEMORY, "scene: out of memory for clip %u", scene->clip_count);
    scene->clips = grown;
    scene->clips[scene->clip_count++] = checked;
    return PATINA_OK;
}

int patina_scene_set_camera(patina_scene *scene, const patina_camera *given)
{
    double axes[9], position[3];
    patina_camera taken;
    const patina_camera *const camera = &taken;
    if (!scene || !given)
        return fail(scene, "patina_scene_set_camera: scene or camera is NULL");
    const int error = pt_take(&scene->handle, "patina_scene_set_camera", given, &taken, sizeof taken);
    if (error)
        return error;
    if (!all_finite(camera->world_from_camera, 16) || pt_camera_axes(camera, axes, position))
        return fail(scene, "camera: world_from_camera is singular or not finite");
    if (!(camera->right > camera->left) || !(camera->top > camera->bottom) || !isfinite(camera->right - camera->left) ||
        !isfinite(camera->top - camera->bottom))
        return fail(scene, "camera: the window must have right > left and top > bottom");
    if (!(camera->far_clip > camera->near_clip) || !isfinite(camera->far_clip) || !isfinite(camera->near_clip))
        return fail(scene, "camera: far_clip must be beyond near_clip");
    if (!camera->orthographic && !(camera->near_clip > 0.0))
        return fail(scene, "camera: near_clip must be above 0 in perspective");
    if ((!camera->orthographic && (float)camera->near_clip < FLT_MIN) ||
        !isfinite((float)(camera->far_clip - camera->near_clip)))
        return fail(scene, "camera: near_clip and far_clip must be within float32");
    scene->camera = *camera;
    scene->has_camera = 1;
    return PATINA_OK;
}

int patina_scene_set_settings(patina_scene *scene, const patina_settings *settings)
{
    patina_settings s;
    if (!scene || !settings)
        return fail(scene, "patina_scene_set_settings: scene or settings is NULL");
    const int error = pt_take(&scene->handle, "patina_scene_set_settings", settings, &s, sizeof s);
    if (error)
        return error;
    s.width = s.width ? s.width : 1024;
    s.height = s.height ? s.height : 1024;
    if (s.width > 65536 || s.height > 65536)
        return pt_fail(&scene->handle, PATINA_ERROR_ARGUMENT, "settings: a picture of %u x %u; the most is 65536", s.width,
                       s.height);
    if (!s.region[0] && !s.region[1] && !s.region[2] && !s.region[3]) {
        s.region[2] = s.width;
        s.region[3] = s.height;
    }
    if (s.region[0] >= s.region[2] || s.region[1] >= s.region[3] || s.region[2] > s.width || s.region[3] > s.height)
        return pt_fail(&scene->handle, PATINA_ERROR_ARGUMENT, "settings: the region %u,%u - %u,%u is empty or outside %u x %u",
                       s.region[0], s.region[1], s.region[2], s.region[3], s.width, s.height);
    if (s.quality > PATINA_QUALITY_PAPER || s.fill > PATINA_FILL_OFF || s.smooth > PATINA_SMOOTH_OFF ||
        s.antialias > PATINA_ANTIALIAS_OFF || s.fill_iterations > 64)
        return fail(scene, "settings: quality, fill, smooth, antialias or fill_iterations is out of range");
    if (s.surface > PATINA_SURFACE_RANGES)
        return fail(scene, "settings: no such surface");
    if (!(s.error_target >= 0.0f) || !isfinite(s.error_target))
        return fail(scene, "settings: error_target is negative or not finite");
    if (s.strata > PT_STRATA)
        return pt_fail(&scene->handle, PATINA_ERROR_ARGUMENT, "settings: %u strata; the most is %d", s.strata, PT_STRATA);
    if (!isfinite(s.world_color[0] + s.world_color[1] + s.world_color[2]))
        return fail(scene, "settings: world_color is not finite");
    if (s.own_background > 1 || !isfinite(s.background[0] + s.background[1] + s.background[2]))
        return fail(scene, "settings: own_background is 0 or 1, background is finite");
    if (s.world_directed > 1 || !finite_floats(&s.world_light[0][0], 27))
        return fail(scene, "settings: world_directed is 0 or 1, world_light is finite");
    if (s.layers > PATINA_MAX_LAYERS)
        return pt_fail(&scene->handle, PATINA_ERROR_ARGUMENT, "settings: %u layers; the most is %d", s.layers,
                       PATINA_MAX_LAYERS);
    if (s.layer_passes & ~(1u << PATINA_PASS_COMBINED | 1u << PATINA_PASS_DEPTH | 1u << PATINA_PASS_NORMAL))
        return fail(scene, "settings: layer_passes can be COMBINED, DEPTH and NORMAL only");
    if (s.shadow_samples > 4096 || s.shadow_resolution > 16384 || s.shadow_lazy > 1 || s.shadow_progressive > 1 ||
        s.shadow_uncut > 1)
        return fail(scene, "settings: at most 4096 shadow samples and 16384 texels; shadow_lazy, shadow_progressive and "
                           "shadow_uncut are 0 or 1");
    if (!(s.shadow_error >= 0.0f) || !isfinite(s.shadow_error))
        return fail(scene, "settings: shadow_error is negative or not finite");
    if (s.depth > PATINA_DEPTH_SURFACE)
        return fail(scene, "settings: no such depth");
    if (s.average > 1)
        return pt_fail(&scene->handle, PATINA_ERROR_ARGUMENT, "settings: average %u is none of 0 and 1", s.average);
    if (!(s.detail >= 0.0f) || !isfinite(s.detail))
        return fail(scene, "settings: detail is negative or not finite");
    if (s.pixel_samples > 4096)
        return pt_fail(&scene->handle, PATINA_ERROR_ARGUMENT, "settings: %u samples a pixel; the most is 4096",
                       s.pixel_samples);
    if (!(s.pixel_noise >= 0.0f) || !isfinite(s.pixel_noise) || s.pixel_progressive > 1)
        return fail(scene, "settings: pixel_noise is negative or not finite, or pixel_progressive not 0 or 1");
    s.pixel_samples = s.pixel_samples ? s.pixel_samples : s.pixel_noise > 0.0f ? 256 : 1;
    s.shadow_samples = s.shadow_samples ? s.shadow_samples : s.shadow_error > 0.0f ? 256 : 1;
    s.shadow_resolution = s.shadow_resolution ? s.shadow_resolution : 4096;
    if (!s.passes)
        s.passes = (1u << PATINA_PASS_COUNT) - 1;
    scene->settings = s;
    return PATINA_OK;
}

int patina_scene_set_lines(patina_scene *scene, const patina_lines *lines)
{
    patina_lines l;
    if (!scene)
        return fail(scene, "patina_scene_set_lines: scene is NULL");
    scene->has_lines = 0;
    const int error = lines ? pt_take(&scene->handle, "patina_scene_set_lines", lines, &l, sizeof l) : PATINA_OK;
    if (error || !lines)
        return error;
    if (!(l.width >= 0.0f) || !isfinite(l.width) || !(l.offset >= 0.0f) || !isfinite(l.offset))
        return fail(scene, "lines: width and offset must be finite and 0 or more");
    if (l.world && l.width == 0.0f)
        return fail(scene, "lines: a width in world units must be above 0");
    if (!l.world && l.width > PT_LINE_MOST)
        return pt_fail(&scene->handle, PATINA_ERROR_ARGUMENT, "lines: %g pixels wide; the most is %d", (double)l.width,
                       PT_LINE_MOST);
    if (!(l.transparency >= 0.0f && l.transparency <= 1.0f) || !(l.soft >= 0.0f && l.soft <= 1.0f))
        return fail(scene, "lines: transparency and soft must be between 0 and 1");
    if (l.exact > 1 || l.source > PATINA_LINE_DEPTH || l.surface > PATINA_LINE_SURFACE_NONE)
        return fail(scene, "lines: no such source or surface, or exact is neither 0 nor 1");
    if (!isfinite(l.color[0] + l.color[1] + l.color[2] + l.far_color[0] + l.far_color[1] + l.far_color[2]) ||
        !isfinite(l.paper[0] + l.paper[1] + l.paper[2] + l.range[0] + l.range[1]))
        return fail(scene, "lines: colours and range must be finite");
    l.width = l.width == 0.0f ? 2.0f : l.width;
    const int black = !l.exact && pt_is_zero(l.color), no_paper = !l.exact && pt_is_zero(l.paper);
    for (int k = 0; k < 3; k++) {
        l.color[k] = black && l.source == PATINA_LINE_POINT ? 0.25f : l.color[k];
        l.paper[k] = no_paper ? 1.0f : l.paper[k];
    }
    scene->lines = l;
    scene->has_lines = 1;
    return PATINA_OK;
}

// ---- a camera that frames the scene -----------------------------------------------------------------------------------

void pt_box_corners(const double lower[3], const double upper[3], const double matrix[16], pt_corner_work *work, void *context)
{
    double linear[9], translation[3], p[3], q[3];
    pt_split_matrix(matrix, linear, translation);
    for (int corner = 0; corner < 8; corner++) {
        for (int k = 0; k < 3; k++)
            p[k] = corner >> k & 1 ? upper[k] : lower[k];
        pt_apply(linear, p, q);
        for (int k = 0; k < 3; k++)
            q[k] += translation[k];
        work(context, q);
    }
}

static void chunk_corners(const struct pt_chunk *chunk, const double matrix[16], pt_corner_work *work, void *context)
{
    double lower[3], upper[3];
    for (int k = 0; k < 3; k++) {
        lower[k] = chunk->origin[k] + (double)chunk->box_min[k];
        upper[k] = chunk->origin[k] + (double)chunk->box_max[k];
    }
    pt_box_corners(lower, upper, matrix, work, context);
}

void pt_mesh_corners(const struct pt_instance *instance, pt_corner_work *work, void *context)
{
    if (pt_mesh_drawn(instance->mesh))
        chunk_corners(&instance->mesh->box, instance->mesh_style.world_from_object, work, context);
}

void pt_cloud_corners(const struct patina_cloud *cloud, const struct pt_sieve *sieve, const double matrix[16],
                      pt_corner_work *work, void *context)
{
    struct pt_chunk box;
    pt_paged_enter(cloud, 0);
    for (uint32_t page = pt_page_first(cloud); page != PATINA_NO_PAGE;) {
        const int absent = !pt_page_is_there(cloud, page);
        if (absent) {
            pt_page_box(cloud, page, &box);
            if (!sieve || pt_sieve_page(sieve, &box) != PT_CUT_AWAY)
                chunk_corners(&box, matrix, work, context);
        }
        page = pt_page_next(cloud, page, !absent || !pt_page_nests(cloud)); // what lies within a box adds nothing
    }
    for (uint32_t c = 0; (c = pt_chunk_from(cloud, c)) < cloud->chunk_count; c++)
        if (!sieve || pt_sieve_chunk(sieve, &cloud->chunks[c], NULL, NULL) != PT_CUT_AWAY)
            chunk_corners(&cloud->chunks[c], matrix, work, context);
    pt_paged_leave(cloud);
}

// PATINA_ERROR_MEMORY when there is none; without points, nothing is called back.
int pt_each_corner(const patina_scene *scene, pt_corner_work *work, void *context)
{
    struct pt_inverse_clip *room = malloc((scene->clip_count + 1) * sizeof *room);
    if (!room)
        return pt_fail(&scene->handle, PATINA_ERROR_MEMORY, "framing the scene: out of memory");
    for (uint32_t i = 0; i < scene->cloud_count; i++) {
        const patina_cloud *cloud = scene->instances[i].cloud;
        struct pt_sieve sieve = pt_sieve_make(scene, &scene->instances[i], PT_EVERY_POINT, room);
        pt_cloud_corners(cloud, &sieve, scene->instances[i].style.world_from_object, work, context);
    }
    for (uint32_t i = 0; i < scene->mesh_count; i++)
        pt_mesh_corners(pt_mesh_at(scene, i), work, context);
    free(room);
    return PATINA_OK;
}
