// SPDX-License-Identifier: GPL-3.0-or-later
// How lights see the scene [D 6], SPEC 4. A light's view is a scene of its own: the clouds that cast, a camera that looks
// from the light, a picture as large as the clouds' spacing asks for. The passes are those of any picture, up to filling.
//
// Suns look in parallel. Other lights look in perspective at the box of the casters while it spans less than 120 degrees
// (beyond that the texels in the middle shrink to a quarter of those at the edge), else through the six faces of a cube.
#include "light_points.h"
#include "scene/clip.h"
#include "scene/mask.h"
#include "scene/clouds/paged.h"
#include "scene/soft.h"
#include "shared/balls.h"
#include "base/elementary.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define PI 3.14159265358979323846

// A sun's texel is so many times as wide as half of the surface is spaced, as the light sees it. Over 24 suns 0.173% of the points
// of tests/scenes/test_shadow are wrong at 1, 0.179% at 1.2, 0.188% at 1.4 and 0.203% at 1.5; a map of a million points takes 6.1 ms
// at 1, 4.5 at 1.2, for it has fewer holes. Near lights see some points much farther apart than others: theirs is 1, and where a
// caster has no normals 1.8, for these are estimated in the map: of the umbra of a plate 5% stays lit at 1, 1.7% at 1.4, 0.1 to 1%
// at 1.8.
static const double coarseness = 1.2, coarseness_bare = 1.8;
static const double widest = 1.7320508075688772; // tangent of 60 degrees
enum { LEAST_TEXELS = 16, SURVEY_TEXELS = 1024, MESH_TEXELS = 2048 };
// Of soft points: texels of a quarter of a ball's radius (of half, shadows are off by twice as much), at most so many across, and as many slabs of depth as fit into 64 MB. Over
// tests/scenes/test_soft_shadow: SPEC 5.
enum { SOFT_TEXELS = 1024, VEIL_NUMBERS = 1 << 24 };

// ---- casters and receivers ---------------------------------------------------------------------------------------------

static int casts(const struct pt_instance *instance)
{
    return !(instance->style.shadow_off & PATINA_SHADOW_NO_CAST) && instance->whole->info.drawn;
}

// Whether some of its points are surface; whether some are balls that take light.
static int casts_solid(const struct pt_instance *instance) { return casts(instance) && !pt_all_soft(instance); }

static int casts_soft(const struct pt_instance *instance)
{
    return casts(instance) && pt_has_balls(&instance->style) && instance->style.transparency < 1.0f;
}

int pt_soft_casts(const struct patina_scene *scene)
{
    for (uint32_t i = 0; i < scene->cloud_count; i++)
        if (casts_soft(&scene->instances[i]))
            return 1;
    return 0;
}

int pt_soft_receives(const struct patina_scene *scene)
{
    for (uint32_t i = 0; i < scene->cloud_count; i++)
        if (pt_has_balls(&scene->instances[i].style) && pt_receives(&scene->instances[i]))
            return 1;
    return 0;
}

int pt_mesh_casts(const struct pt_instance *instance)
{
    return !(instance->mesh_style.shadow_off & PATINA_SHADOW_NO_CAST) && pt_mesh_drawn(instance->mesh);
}

int pt_mesh_receives(const struct pt_instance *instance)
{
    return !(instance->mesh_style.shadow_off & PATINA_SHADOW_NO_RECEIVE) && !instance->mesh_style.unlit &&
           pt_mesh_drawn(instance->mesh);
}

// Meshes are opaque, and among the opaque casters of everyone.
static int meshes_cast(const struct pt_shadow_group *group) { return !group || group->only == PT_NO_INSTANCE; }

// Words of whole textures that are kept at the most where they come by and by: a gigabyte of them.
static uint64_t most_words(void)
{
    const char *told = getenv("PATINA_SHADOW_WORDS");
    return told && *told ? strtoull(told, NULL, 10) : 1ull << 28;
}

static int are_too_many(const struct patina_scene *scene, const struct pt_plan *plan)
{
    uint64_t words = 0;
    for (uint32_t i = 0; i < scene->cloud_count; i++)
        words += pt_receives(&scene->instances[i]) ? plan->light_count * scene->instances[i].cloud->slots : 0;
    return words > most_words();
}

int pt_plan_lazy(const struct patina_scene *scene, const struct pt_plan *plan)
{
    const patina_settings *settings = &scene->settings;
    return (settings->shadow_lazy || (settings->shadow_progressive && plan->words_are_many)) && plan->layers <= 1 &&
           !(settings->shadow_error > 0.0f) && !pt_soft_receives(scene);
}

// What it takes of 255 parts of light.
static uint32_t loss_of(const struct pt_instance *instance)
{
    return 255 - (uint32_t)(255.0f * instance->style.transparency + 0.5f);
}

static int spares_itself(const struct pt_instance *instance)
{
    return (instance->style.shadow_off & PATINA_SHADOW_NO_SELF) != 0;
}

static int opaque(const struct pt_instance *instance)
{
    return casts_solid(instance) && loss_of(instance) == 255 && !instance->cloud->info.has_opacities;
}

// Layer behind layer, for its points have opacities of their own.
static int in_layers(const struct pt_instance *instance)
{
    return casts_solid(instance) && loss_of(instance) && instance->cloud->info.has_opacities;
}

int pt_casts_in_layers(const struct patina_scene *scene)
{
    for (uint32_t i = 0; i < scene->cloud_count; i++)
        if (in_layers(&scene->instances[i]))
            return 1;
    return 0;
}

// Whether some part of its cloud does.
static int receives(const struct pt_instance *instance)
{
    struct pt_instance whole = *instance;
    whole.cloud = instance->whole;
    return pt_receives(&whole);
}

uint32_t pt_shadow_groups(const struct patina_scene *scene, struct pt_shadow_group *groups)
{
    uint32_t count = 0, casters = 0;
    for (uint32_t i = 0; i < scene->cloud_count; i++)
        casters += pt_is_first_part(scene, i) && opaque(&scene->instances[i]);
    for (uint32_t i = 0; i < scene->mesh_count; i++)
        casters += (uint32_t)pt_mesh_casts(pt_mesh_at(scene, i));
    if (casters)
        groups[count++] = (struct pt_shadow_group){PT_NO_INSTANCE, PT_NO_INSTANCE, 255, 0, 0};
    for (uint32_t i = 0; i < scene->cloud_count; i++) {
        const struct pt_instance *instance = &scene->instances[i];
        if (!pt_is_first_part(scene, i))
            continue;
        if (opaque(instance) && spares_itself(instance) && receives(instance) && casters > 1)
            groups[count++] = (struct pt_shadow_group){PT_NO_INSTANCE, i, 255, 0, 0};
        if (casts_solid(instance) && loss_of(instance) && !opaque(instance))
            groups[count++] = (struct pt_shadow_group){i, PT_NO_INSTANCE, loss_of(instance), in_layers(instance), 0};
        if (casts_soft(instance))
            groups[count++] = (struct pt_shadow_group){i, PT_NO_INSTANCE, 255, 0, 1};
    }
    return count;
}

static int group_casts(const struct patina_scene *scene, const struct pt_shadow_group *group, uint32_t i)
{
    if (group->only != PT_NO_INSTANCE)
        return pt_same_cloud(scene, i, group->only);
    return opaque(&scene->instances[i]) && (group->without == PT_NO_INSTANCE || !pt_same_cloud(scene, i, group->without));
}

int pt_group_receives(const struct patina_scene *scene, const struct pt_shadow_group *group, uint32_t i)
{
    const struct pt_instance *instance = &scene->instances[i];
    if (!pt_receives(instance))
        return 0;
    if (group->only != PT_NO_INSTANCE)
        return !pt_same_cloud(scene, i, group->only) || !spares_itself(instance);
    if (group->without != PT_NO_INSTANCE)
        return pt_same_cloud(scene, i, group->without);
    return !(spares_itself(instance) && opaque(instance));
}

// ---- what there is to see ------------------------------------------------------------------------------------------------

// Bounds of the casters' chunks in a frame (rows x, y, z) from `eye`; perspective: of x / -z and y / -z too.
struct extent {
    const double *axes, *eye;
    double reach;     // of balls beyond their centres
    int some, behind; // behind: part of it is beside or behind the eye
    double lower[3], upper[3];
    double tangent[4]; // left, bottom, right, top
};

static void extend_to(struct extent *extent, const double p[3])
{
    for (int k = 0; k < 3; k++) {
        extent->lower[k] = extent->some ? fmin(extent->lower[k], p[k]) : p[k];
        extent->upper[k] = extent->some ? fmax(extent->upper[k], p[k]) : p[k];
    }
    for (int k = 0; k < 2; k++) {
        double tangent = -p[2] > 0.0 ? p[k] / -p[2] : 0.0;
        extent->behind |= !(-p[2] > 0.0) || !(fabs(tangent) <= widest);
        extent->tangent[k] = extent->some ? fmin(extent->tangent[k], tangent) : tangent;
        extent->tangent[2 + k] = extent->some ? fmax(extent->tangent[2 + k], tangent) : tangent;
    }
    extent->some = 1;
}

static void extend(void *context, const double corner[3])
{
    struct extent *extent = context;
    double p[3], away[3];
    for (int k = 0; k < 3; k++)
        away[k] = corner[k] - extent->eye[k];
    pt_apply(extent->axes, away, p);
    if (!(extent->reach > 0.0)) {
        extend_to(extent, p);
        return;
    }
    for (int side = 0; side < 8; side++) {
        const double q[3] = {p[0] + (side & 1 ? 1.0 : -1.0) * extent->reach, p[1] + (side & 2 ? 1.0 : -1.0) * extent->reach,
                             p[2] + (side & 4 ? 1.0 : -1.0) * extent->reach};
        extend_to(extent, q);
    }
}

// The scene with those of its clips that count for shadows. Its handle is not to be touched.
static struct patina_scene as_cut(const struct patina_scene *scene)
{
    struct patina_scene cut = *scene;
    if (scene->settings.shadow_uncut)
        cut.clip_count = 0;
    return cut;
}

// World units: of the widest ball, or of most balls of the cloud.
static double ball_radius(const struct pt_instance *instance, int most)
{
    const struct patina_cloud *cloud = instance->whole;
    const double *m = instance->style.world_from_object;
    double scale = 0.0, reach = most ? 0.0 : INFINITY;
    if (instance->style.soft_radius > 0.0f)
        return (double)instance->style.soft_radius;
    for (int c = 0; c < 3; c++)
        scale = fmax(scale, sqrt(m[c] * m[c] + m[4 + c] * m[4 + c] + m[8 + c] * m[8 + c]));
    for (uint32_t c = 0; (c = pt_chunk_from(cloud, c)) < cloud->chunk_count; c++) {
        const double own = pt_soft_reach(cloud, &cloud->chunks[c]);
        reach = most ? fmax(reach, own) : fmin(reach, own);
    }
    return !isfinite(reach) ? 0.0 : scale * (most ? reach : 0.5 * reach);
}

// room: NULL: chunks are seen whole.
static void look_at_points(const struct patina_scene *cut, const struct pt_instance *instance, enum pt_points points,
                           struct pt_inverse_clip *room, struct extent *extent)
{
    const struct pt_sieve sieve = room ? pt_sieve_make(cut, instance, points, room) : (struct pt_sieve){.instance = instance};
    extent->reach = points == PT_SOFT_POINTS ? ball_radius(instance, 1) : 0.0;
    pt_cloud_corners(instance->cloud, &sieve, instance->style.world_from_object, extend, extent);
    extent->reach = 0.0;
}

static struct extent look(const struct patina_scene *scene, const struct pt_shadow_group *group, const double axes[9],
                          const double eye[3])
{
    struct extent extent = {.axes = axes, .eye = eye};
    const struct patina_scene cut = as_cut(scene);
    struct pt_inverse_clip *room = malloc((cut.clip_count + 1) * sizeof *room); // without: chunks are seen whole
    for (uint32_t i = 0; i < scene->cloud_count; i++) {
        const struct pt_instance *instance = &scene->instances[i];
        if (group ? !group_casts(scene, group, i) : !casts(instance))
            continue;
        if (group ? !group->soft : casts_solid(instance))
            look_at_points(&cut, instance, PT_SOLID_POINTS, room, &extent);
        if (group ? group->soft : casts_soft(instance))
            look_at_points(&cut, instance, PT_SOFT_POINTS, room, &extent);
    }
    free(room);
    for (uint32_t i = 0; i < scene->mesh_count; i++)
        if (meshes_cast(group) && pt_mesh_casts(pt_mesh_at(scene, i)))
            pt_mesh_corners(pt_mesh_at(scene, i), extend, &extent);
    return extent;
}

// ---- light frames ----------------------------------------------------------------------------------------------------------

// The six faces of a cube: exact permutations, so that all agree about z to the bit.
static void face_axes(uint32_t face, double axes[9])
{
    memset(axes, 0, 9 * sizeof *axes);
    double sign = face & 1u ? -1.0 : 1.0;
    uint32_t k = face >> 1;
    axes[6 + k] = sign;          // z
    axes[3 + (k + 2) % 3] = 1.0; // y
    axes[(k + 1) % 3] = sign;    // x = y cross z
}

// Where the light is and looks in a sample. axes: of the light's maps, in and out: a sun turns them.
static void place_sample(const struct pt_plan_light *planned, uint32_t sample, double axes[9], double position[3])
{
    const patina_light_desc *light = planned->light;
    double p[2], frame[9], across[2];
    pt_light_sample(sample, p);
    memcpy(axes, planned->axes, 9 * sizeof *axes);
    memcpy(position, light->position, 3 * sizeof *position);
    if (light->type == PATINA_LIGHT_AREA) {
        pt_area_point(light, p);
        pt_light_frame(light->direction, light->side, frame);
        memcpy(across, p, sizeof across);
    } else {
        pt_light_disc(p);
        memcpy(frame, planned->axes, sizeof frame);
        double radius = light->type == PATINA_LIGHT_SUN ? pt_tan(0.5 * fmin((double)light->angle, 0.99 * PI))
                                                        : (double)light->radius;
        across[0] = radius * p[0];
        across[1] = radius * p[1];
    }
    if (light->type != PATINA_LIGHT_SUN) {
        for (int k = 0; k < 3; k++)
            position[k] += across[0] * frame[k] + across[1] * frame[3 + k];
        return;
    }
    double direction[3], length;
    for (int k = 0; k < 3; k++) {
        position[k] = 0.0;
        direction[k] = across[0] * frame[k] + across[1] * frame[3 + k] - frame[6 + k];
    }
    length = sqrt(pt_dot(direction, direction));
    for (int k = 0; k < 3; k++)
        direction[k] /= length;
    pt_light_frame(direction, frame, axes);
}

static int has_area(const patina_light_desc *light)
{
    return light->type == PATINA_LIGHT_SUN ? light->angle > 0.0f : light->type == PATINA_LIGHT_AREA ? 1 : light->radius > 0.0f;
}

// ---- cameras -----------------------------------------------------------------------------------------------------------

// The camera of a view with axes and eye that holds `extent`. Parallel views start half a unit of depth before the first
// caster, so that z > 0.
static void set_camera(const double axes[9], const double eye[3], const struct extent *extent, int parallel, int face,
                       patina_camera *camera)
{
    *camera = (patina_camera){.struct_size = sizeof *camera, .orthographic = (uint32_t)parallel};
    for (int r = 0; r < 3; r++) {
        for (int c = 0; c < 3; c++)
            camera->world_from_camera[4 * r + c] = axes[3 * c + r];
        camera->world_from_camera[4 * r + 3] = eye[r];
    }
    camera->world_from_camera[15] = 1.0;
    const double *window = extent->tangent;
    double span[4] = {extent->lower[0], extent->lower[1], extent->upper[0], extent->upper[1]};
    double cube[4] = {-1.0, -1.0, 1.0, 1.0};
    window = parallel ? span : face ? cube : window;
    camera->left = window[0];
    camera->bottom = window[1];
    camera->right = window[2];
    camera->top = window[3];
    double first = -extent->upper[2], last = -extent->lower[2];
    double size = fmax(last - first, fmax(span[2] - span[0], span[3] - span[1]));
    size = size > 0.0 ? size : 1.0;
    if (parallel) {
        camera->near_clip = first - 0.01 * size;
        camera->far_clip = last + 0.01 * size;
    } else {
        camera->far_clip = 1.01 * last;
        camera->near_clip = fmax(0.99 * first, 1e-6 * camera->far_clip);
    }
}

// Grows the window to whole texels around its middle; returns how many: at most `most`, or they get wider.
static uint32_t fit(double *low, double *high, double texel, uint32_t most)
{
    most = most < LEAST_TEXELS ? LEAST_TEXELS : most;
    texel = fmax(texel, (*high - *low) / (most - 3.0));
    double count = ceil((*high - *low) / texel * (1.0 - 1e-9)) + 2.0;
    count = !(count > LEAST_TEXELS) ? LEAST_TEXELS : count > most ? most : count;
    double middle = 0.5 * (*low + *high);
    *low = middle - 0.5 * count * texel;
    *high = middle + 0.5 * count * texel;
    return (uint32_t)count;
}

int pt_light_scene(const struct patina_scene *scene, const struct pt_plan_light *light, const struct pt_shadow_group *group,
                   uint32_t sample, uint32_t face, struct pt_instance *instances, struct patina_scene *out, double window[4])
{
    double axes[9], position[3];
    int parallel = light->light->type == PATINA_LIGHT_SUN;
    place_sample(light, sample, axes, position);
    if (light->cube)
        face_axes(face, axes);
    struct extent extent = look(scene, group, axes, position);
    if (!extent.some || (!parallel && !(extent.lower[2] < 0.0)))
        return 0;
    out->in_parts = scene->in_parts;
    out->clips = scene->clips;
    out->clip_count = as_cut(scene).clip_count;
    out->instances = instances;
    out->cloud_count = 0;
    for (uint32_t i = 0; i < scene->cloud_count; i++)
        if (group_casts(scene, group, i)) {
            instances[out->cloud_count] = scene->instances[i];
            instances[out->cloud_count].style.cull_back = 0; // both sides cast
            instances[out->cloud_count].style.surface = 0;   // maps are filled
            if (!group->soft)
                instances[out->cloud_count].style.transparency = 0; // its map has one layer
            out->cloud_count++;
        }
    out->mesh_count = 0;
    for (uint32_t i = 0; i < scene->mesh_count; i++)
        if (meshes_cast(group) && pt_mesh_casts(pt_mesh_at(scene, i)))
            *pt_mesh_at(out, out->mesh_count++) = *pt_mesh_at(scene, i);
    set_camera(axes, position, &extent, parallel, light->cube != 0, &out->camera);
    out->has_camera = 1;
    out->settings = (patina_settings){.struct_size = sizeof out->settings,
                                      .quality = scene->settings.quality,
                                      .fill = scene->settings.fill,
                                      .surface = PATINA_SURFACE_FILL};
    patina_camera *camera = &out->camera;
    uint32_t most = scene->settings.shadow_resolution;
    double texel = light->texel;
    if (group->soft) {
        // the middle of the balls, or of those before a light among them
        const double away = parallel ? 1.0 : -0.5 * extent.lower[2] + fmax(-0.5 * extent.upper[2], 0.0);
        most = most < SOFT_TEXELS ? most : SOFT_TEXELS;
        texel = 0.25 * ball_radius(&scene->instances[group->only], 0) / away;
    }
    out->settings.width = fit(&camera->left, &camera->right, texel, most);
    out->settings.height = fit(&camera->bottom, &camera->top, texel, most);
    out->settings.region[2] = out->settings.width;
    out->settings.region[3] = out->settings.height;
    const double cube[4] = {-1.0, -1.0, 1.0, 1.0}, whole[4] = {camera->left, camera->bottom, camera->right, camera->top};
    memcpy(window, light->cube ? cube : whole, sizeof whole);
    return 1;
}

uint32_t pt_veil_slabs(const struct patina_scene *map)
{
    const uint32_t slabs = VEIL_NUMBERS / (map->settings.width * map->settings.height);
    return slabs < PT_SOFT_VEILS ? slabs : PT_SOFT_VEILS;
}

// ---- planning a light ----------------------------------------------------------------------------------------------------

// Towards the middle of the casters; spots that see no further than 60 degrees look along their cone.
static void aim(const struct patina_scene *scene, struct pt_plan_light *planned)
{
    static const double world[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1}, none[3];
    const patina_light_desc *light = planned->light;
    if (light->type == PATINA_LIGHT_SUN) {
        pt_light_frame(light->direction, none, planned->axes);
        return;
    }
    struct extent around = look(scene, NULL, world, light->position);
    double middle[3], length;
    for (int k = 0; k < 3; k++)
        middle[k] = 0.5 * (around.lower[k] + around.upper[k]);
    length = sqrt(pt_dot(middle, middle));
    for (int k = 0; k < 3; k++)
        middle[k] = length > 0.0 ? middle[k] / length : light->direction[k];
    pt_light_frame(middle, none, planned->axes);
    planned->cube = 0;
    for (uint32_t sample = 0; sample < (has_area(light) ? 16u : 1u); sample++) { // from all over its area
        double axes[9], position[3];
        place_sample(planned, sample, axes, position);
        planned->cube |= (uint32_t)look(scene, NULL, axes, position).behind;
    }
}

static int some_mesh_receives(const struct patina_scene *scene)
{
    for (uint32_t i = 0; i < scene->mesh_count; i++)
        if (pt_mesh_receives(pt_mesh_at(scene, i)))
            return 1;
    return 0;
}

// How wide a texel is, from the casters' spacing as a survey with square texels sees it.
static int choose_texel(const struct patina_scene *scene, struct pt_pool *pool, struct pt_plan_light *planned)
{
    double axes[9], position[3], spacing = 0.0, widest_window = 0.0;
    int parallel = planned->light->type == PATINA_LIGHT_SUN;
    place_sample(planned, 0, axes, position);
    for (uint32_t face = 0; face < (planned->cube ? 6u : 1u); face++) {
        struct patina_scene survey = {.instances = scene->instances,
                                      .cloud_count = scene->cloud_count,
                                      .clips = scene->clips,
                                      .clip_count = as_cut(scene).clip_count,
                                      .has_camera = 1};
        struct pt_plan plan = {.pool = pool, .ids.filled = 1}; // as maps are, whatever the clouds are drawn as
        if (planned->cube)
            face_axes(face, axes);
        struct extent extent = look(scene, NULL, axes, position);
        if (!extent.some || (!parallel && !(extent.lower[2] < 0.0)))
            continue;
        set_camera(axes, position, &extent, parallel, planned->cube != 0, &survey.camera);
        patina_camera *camera = &survey.camera;
        double texel = fmax(camera->right - camera->left, camera->top - camera->bottom) / SURVEY_TEXELS;
        texel = texel > 0.0 ? texel : 1e-6;
        survey.settings = (patina_settings){.struct_size = sizeof survey.settings, .surface = PATINA_SURFACE_FILL};
        survey.settings.width = fit(&camera->left, &camera->right, texel, SURVEY_TEXELS + 2);
        survey.settings.height = fit(&camera->bottom, &camera->top, texel, SURVEY_TEXELS + 2);
        survey.settings.region[2] = survey.settings.width;
        survey.settings.region[3] = survey.settings.height;
        pt_handle_init(&survey.handle);
        int error = pt_plan_spacing(&survey, &plan);
        pt_handle_destroy(&survey.handle);
        double seen = plan.spacing_middle * texel;
        if (!error && seen > 0.0)
            spacing = spacing > 0.0 ? fmin(spacing, seen) : seen;
        widest_window = fmax(widest_window, texel * SURVEY_TEXELS);
        pt_plan_destroy(&plan);
        if (error)
            return error;
    }
    double size = widest_window > 0.0 ? widest_window : 1e-6; // spacing is not known of a handful of points
    int bare = 0;
    for (uint32_t i = 0; i < scene->cloud_count; i++)
        bare |= casts(&scene->instances[i]) && !scene->instances[i].cloud->info.has_normals;
    // On triangles the edge of a shadow shows as it is: texels of a 2048th are half a pixel where the picture shows all of it.
    const double finest = some_mesh_receives(scene) ? size / MESH_TEXELS : INFINITY;
    double wanted = spacing > 0.0 ? (parallel ? coarseness : bare ? coarseness_bare : 1.0) * spacing : size / SURVEY_TEXELS;
    wanted = fmin(wanted, finest);
    double least = size / fmax(scene->settings.shadow_resolution - 3.0, LEAST_TEXELS);
    planned->capped = wanted < least;
    planned->texel = fmin(fmax(wanted, least), fmax(size / LEAST_TEXELS, least));
    return PATINA_OK;
}

int pt_plan_light_map(const struct patina_scene *scene, struct pt_plan *plan, uint32_t i)
{
    struct pt_plan_light *light = &plan->lights[i];
    if (light->known)
        return PATINA_OK;
    aim(scene, light);
    const int error = choose_texel(scene, plan->pool, light);
    light->known = !error;
    return error;
}

int pt_plan_light_text(const struct patina_scene *scene, struct pt_plan *plan, uint32_t i)
{
    static const char *const names[] = {"", "sun", "point light", "spot", "area light"};
    struct pt_plan_light *planned = &plan->lights[i];
    struct pt_shadow_group *groups = pt_arena_take(&plan->arena, (3 * (size_t)scene->cloud_count + 1) * sizeof *groups);
    struct pt_instance *instances = pt_arena_take(&plan->arena,
                                                  ((size_t)scene->cloud_count + scene->mesh_count + 1) * sizeof *instances);
    if (!groups || !instances || pt_plan_light_map(scene, plan, i))
        return PATINA_ERROR_MEMORY;
    struct patina_scene view = {0}; // its first map
    double window[4];
    uint32_t count = pt_shadow_groups(scene, groups), faces = planned->cube ? 6 : 1;
    for (uint32_t face = 0; face < faces && count; face++)
        if (pt_light_scene(scene, planned, &groups[0], 0, face, instances, &view, window))
            break;
    snprintf(planned->reason, sizeof planned->reason, "%s, %s%u sample%s, %s %u x %u texels, %s", names[planned->light->type],
             planned->samples > 1 && scene->settings.shadow_error > 0.0f ? "to the error target, at most " : "",
             planned->samples, planned->samples > 1 ? "s" : "", planned->cube ? "six maps of" : "a map of", view.settings.width,
             view.settings.height, planned->capped ? "as fine as is allowed" : "as fine as its points");
    return PATINA_OK;
}

void pt_plan_lights(const struct patina_scene *scene, struct pt_plan *plan)
{
    for (uint32_t i = 0; i < scene->light_count; i++) {
        const patina_light_desc *light = &scene->lights[i];
        const uint32_t samples = has_area(light) ? scene->settings.shadow_samples : 1;
        if (light->shadows)
            plan->lights[plan->light_count++] = (struct pt_plan_light){.light = light, .samples = samples};
    }
    plan->words_are_many = are_too_many(scene, plan);
}

// ---- what a texture depends on -------------------------------------------------------------------------------------------

struct key {
    double *numbers;
    size_t count, room;
};

static void put(struct key *key, double number)
{
    if (key->count < key->room)
        key->numbers[key->count] = number;
    key->count++;
}

static void put_word(struct key *key, uint64_t word)
{
    put(key, (double)(word >> 32)); // exact
    put(key, (double)(word & 0xFFFFFFFFu));
}

// What is cut out of the instance: clips in its own frame, hidden classes, hidden shapes, masked and soft points.
static void put_cuts(struct key *key, const struct patina_scene *scene, const struct pt_instance *instance)
{
    const uint32_t clips = instance->style.clip_off || scene->settings.shadow_uncut ? 0 : scene->clip_count;
    const double *object = instance->style.world_from_object;
    int hiding = 0;
    for (int k = 0; k < 8; k++)
        hiding |= (instance->cloud->info.class_bits[k] & instance->style.hidden_classes[k]) != 0;
    for (int k = 0; k < 8 && hiding; k++)
        put(key, (double)instance->style.hidden_classes[k]);
    if (hiding)
        put_word(key, instance->cloud->class_hash);
    uint32_t shapes[8]; // the words themselves are in the cloud's fingerprint
    hiding = pt_hidden_shapes(instance, shapes);
    for (int k = 0; k < 8 && hiding; k++)
        put(key, (double)shapes[k]);
    if (pt_mask_of(instance))
        put_word(key, pt_mask_of(instance)->hash);
    if (pt_has_field(&instance->style)) {
        put_word(key, instance->style.field->hash);
        put(key, (double)pt_field_steps(instance->style.soft_threshold));
    }
    for (uint32_t i = 0; i < clips; i++) {
        const patina_clip *clip = &scene->clips[i];
        double turned[9], across[9], from[3], product[9];
        pt_split_matrix(clip->world_from_clip, turned, from);
        for (int r = 0; r < 3; r++) { // what moves with the cloud keeps its products with the cloud's axes
            from[r] -= object[4 * r + 3];
            for (int c = 0; c < 3; c++)
                across[3 * c + r] = object[4 * r + c];
        }
        put(key, (double)(2 * clip->shape + clip->cut));
        pt_multiply(across, turned, product);
        for (int k = 0; k < 9; k++)
            put(key, product[k]);
        pt_apply(across, from, product);
        for (int k = 0; k < 3; k++)
            put(key, product[k]);
    }
}

// Its matrix as the light sees it: the same when light and cloud move together. A sun is everywhere: where the first
// cloud or mesh is.
static void put_matrix(struct key *key, const struct patina_scene *scene, const struct pt_plan_light *planned,
                       const double matrix[16])
{
    const double *first = scene->cloud_count ? scene->instances[0].style.world_from_object
                                             : pt_mesh_at(scene, 0)->mesh_style.world_from_object;
    const double *from = planned->light->position;
    double linear[9], translation[3], turned[9], moved[3], frame[9];
    pt_light_frame(planned->light->direction, planned->light->side, frame);
    pt_split_matrix(matrix, linear, translation);
    for (int k = 0; k < 3; k++)
        translation[k] -= planned->light->type == PATINA_LIGHT_SUN ? first[4 * k + 3] : from[k];
    pt_multiply(frame, linear, turned);
    pt_apply(frame, translation, moved);
    for (int k = 0; k < 9; k++)
        put(key, turned[k]);
    for (int k = 0; k < 3; k++)
        put(key, moved[k]);
}

static void put_instance(struct key *key, const struct patina_scene *scene, const struct pt_plan_light *planned,
                         uint64_t identity, uint32_t i)
{
    const struct pt_instance *instance = &scene->instances[i];
    put_word(key, identity);
    put(key, (double)instance->style.shadow_off);
    put(key, (double)loss_of(instance));
    put(key, (double)instance->style.lighting);
    put(key, (double)instance->style.d_min);
    if (casts_soft(instance)) {
        const patina_cloud_style *style = &instance->style;
        const double own[] = {(double)style->soft,        (double)style->soft_model,   (double)style->soft_shells,
                              (double)style->soft_radius, (double)style->soft_opacity, (double)style->soft_modulation,
                              (double)style->transparency};
        for (size_t k = 0; k < sizeof own / sizeof *own; k++)
            put(key, own[k]);
    }
    put_matrix(key, scene, planned, instance->style.world_from_object);
    put_cuts(key, scene, instance);
}

size_t pt_light_key(const struct patina_scene *scene, const struct pt_plan_light *planned,
                    uint64_t (*identity)(const struct patina_cloud *cloud), double *numbers, size_t room)
{
    const patina_light_desc *light = planned->light;
    struct key key = {numbers, 0, room};
    put(&key, (double)light->type);
    put(&key, (double)light->shape);
    put(&key, (double)light->angle);
    put(&key, (double)light->radius);
    put(&key, (double)light->size[0]);
    put(&key, (double)light->size[1]);
    put(&key, (double)scene->settings.shadow_resolution);
    put(&key, (double)scene->settings.quality);
    put(&key, (double)scene->settings.fill);
    put(&key, (double)scene->settings.shadow_error);
    for (uint32_t i = 0; i < scene->cloud_count; i++)
        put_instance(&key, scene, planned, identity(scene->instances[i].cloud), i);
    for (uint32_t i = 0; i < scene->mesh_count; i++)
        if (pt_mesh_casts(pt_mesh_at(scene, i))) {
            put_word(&key, atomic_load(&pt_mesh_at(scene, i)->mesh->alive->fingerprint));
            put_matrix(&key, scene, planned, pt_mesh_at(scene, i)->mesh_style.world_from_object);
            put(&key, (double)pt_mesh_at(scene, i)->mesh_style.alpha);
            if (pt_mesh_at(scene, i)->mesh_style.alpha) { // its holes
                put(&key, (double)pt_mesh_at(scene, i)->mesh_style.alpha_least);
                put_word(&key, atomic_load(&pt_mesh_at(scene, i)->mesh_style.texture->alive->fingerprint));
            }
        }
    return key.count;
}

int pt_same_key(const double *a, const double *b, size_t count)
{
    for (size_t i = 0; i < count; i++)
        if (!(fabs(a[i] - b[i]) <= 1e-9 * fmax(1e-6, fmax(fabs(a[i]), fabs(b[i])))))
            return 0;
    return 1;
}
