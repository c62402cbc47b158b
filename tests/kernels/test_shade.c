// SPDX-License-Identifier: GPL-3.0-or-later
// shade: colours of every format, normals measured, filled, blended and estimated, Phong light.
#include "marks.h"
#include "shared/colors.h"

#include <math.h>
#include <string.h>

struct setup {
    struct picture picture;
    struct shade_args args; // light_types as the lights are: check
    struct light_view lights;
    float ramps[3 * (PT_RAMP_MOST + 1)]; // the instance's is behind an entry of another's
    void *colors;
    size_t colors_size;
    uint8_t *opacities;
    uint32_t *shadows; // two lights; room for as many pixels
    uint32_t *marks;
    float *shading; // before
};

static struct setup make(struct harness *h, struct rng *rng, int perspective, enum picture_kind kind, uint32_t format)
{
    struct setup s = {.picture = picture_random(h, rng, picture_view(67, 45, perspective), kind, 0.4)};
    picture_invent(&s.picture, rng, 0.7, 9);
    struct instance_args *instance = &s.args.instance;
    s.args.view = s.picture.view;
    s.args.eye_z = perspective ? 0.0f : -3.0f;
    instance->id_base = s.picture.id_base;
    picture_slots(instance, s.picture.count * 3 / 4);
    instance->has_normals = 1;
    instance->color_format = format;
    instance->opacity = 1.0f;
    instance->lit = 1;
    instance->shininess = 32;
    instance->ambient = 0.7f;
    instance->diffuse = 0.9f;
    instance->specular = 0.5f;
    s.colors_size = (size_t)instance->slots * 12;
    s.colors = harness_alloc(h, s.colors_size);
    for (size_t i = 0; i < (size_t)instance->slots * 3; i++) {
        if (format == 1)
            ((uint8_t *)s.colors)[i] = (uint8_t)rng_next(rng);
        else
            ((float *)s.colors)[i] = (float)rng_range(rng, 0.0, 1.5);
    }
    if (format == 1)
        s.colors_size = ((size_t)instance->slots * 3 + 3) / 4 * 4;
    for (int c = 0; c < 3; c++) {
        instance->color[c] = (float)rng_unit(rng);
        s.lights.world[c] = (float)rng_unit(rng);
    }
    uint8_t *shown = memset(harness_alloc(h, instance->slots + 1u), 1, instance->slots); // as a picture does
    uint32_t places;
    s.marks = marks_of(h, shown, instance->slots, 1, &places);
    s.shadows = harness_alloc(h, s.picture.count * 8 + 8);
    for (size_t i = 0; i < (size_t)instance->slots * 2; i++)
        s.shadows[i] = rng_below(rng, 255 * 8 + 1) | (uint32_t)rng_next(rng) << PT_SHADOW_SHIFT; // 8 samples
    s.args.arrived = format != 1;
    s.args.light_count = 4;
    for (uint32_t i = 0; i < s.args.light_count; i++) {
        struct light_args *light = &s.lights.each[i];
        light->type = i % 2 ? 2 : 1;
        rng_direction(rng, light->vector);
        for (int c = 0; c < 3; c++) {
            light->color[c] = (float)rng_range(rng, 0.0, 4.0);
            light->vector[c] *= i % 2 ? 3.0f : 1.0f;
        }
    }
    s.shading = harness_alloc(h, s.picture.count * 16);
    for (size_t i = 0; i < s.picture.count; i++) {
        if (rng_below(rng, 4))
            rng_direction(rng, s.shading + 4 * i);
    }
    return s;
}

static void cast_by_points(struct setup *s) // by two of the lights, at most
{
    s->args.casting = 2;
    s->args.scales[0] = s->args.scales[1] = 1.0f / (255.0f * 8.0f);
}

static void check(struct harness *h, struct setup *s, double most_open)
{
    const struct picture *picture = &s->picture;
    size_t count = picture->count, open = 0;
    float *unset = harness_alloc(h, count * 16);
    for (size_t i = 0; i < count * 4; i++)
        unset[i] = -5.0f;
    struct pt_buffer *keys = harness_buffer(h, picture->keys, count * 8);
    struct pt_buffer *from = harness_buffer(h, picture->from, count * 4);
    struct pt_buffer *normal = harness_buffer(h, picture->normal, count * 16);
    struct pt_buffer *deff = harness_buffer(h, picture->deff, count * 4);
    struct pt_buffer *colors = harness_buffer(h, s->colors, s->colors_size);
    struct pt_buffer *shadows = harness_buffer(h, s->shadows, count * 8 + 8);
    struct pt_buffer *marks = harness_buffer(h, s->marks, marks_size(s->args.instance.slots));
    struct pt_buffer *shading = harness_buffer(h, s->shading, count * 16);
    struct pt_buffer *color = harness_buffer(h, unset, count * 16), *arrived = harness_buffer(h, unset, count * 4);
    struct pt_buffer *opacities = harness_buffer(h, s->opacities, s->opacities ? s->args.instance.slots : 0);
    struct pt_buffer *lights = s->args.instance.lit ? harness_buffer(h, &s->lights, sizeof s->lights) : NULL;
    struct pt_buffer *ramps = s->args.recolor.source ? harness_buffer(h, s->ramps, sizeof s->ramps) : NULL;
    s->args.light_types = 0;
    for (uint32_t i = 0; i < s->args.light_count; i++)
        s->args.light_types |= 1u << s->lights.each[i].type;
    HARNESS_RUN(h, shade, &s->args, keys, from, normal, deff, colors, shading, color, opacities, shadows, marks, arrived,
                lights, ramps);
    const float *got = harness_read(h, color), *got_n = harness_read(h, shading), *got_share = harness_read(h, arrived);
    struct ref_planes planes = picture_planes(picture);
    planes.colors = s->colors;
    planes.shadows = s->shadows;
    planes.marks = s->marks;
    planes.opacities = s->opacities;
    planes.lights = &s->lights;
    planes.ramps = s->ramps;
    float *transparent = harness_alloc(h, count * 4);
    const struct ref_shade *kept = harness_kept(h); // the first device's reference serves the others
    struct ref_shade *all = kept ? NULL : harness_alloc(h, count * sizeof *all);
    for (size_t i = 0; i < count; i++) {
        int x = (int)(i % picture->view.width), y = (int)(i / picture->view.width);
        if (all)
            all[i] = ref_shade(&s->args, &planes, x, y);
        const struct ref_shade expected = (all ? all : kept)[i];
        const float *c = got + 4 * i, *n = got_n + 4 * i;
        if (!expected.written) {
            if (memcmp(c, unset + 4 * i, 16) || memcmp(n, s->shading + 4 * i, 16))
                harness_fail(h, "untouched", x, y, "was written");
            continue;
        }
        open += (size_t)expected.unsure;
        transparent[i] = n[3];
        if (!harness_near(n[3], expected.opacity, TOL_OPACITY * expected.opacity))
            harness_fail(h, "opacity", x, y, "got %.9g, expected %.9g", n[3], expected.opacity);
        if (!isfinite(c[0]) || !isfinite(c[1]) || !isfinite(c[2]))
            harness_fail(h, "color", x, y, "got (%g %g %g)", c[0], c[1], c[2]);
        if (expected.unsure || expected.singular)
            continue;
        for (int k = 0; k < 4; k++)
            if (!harness_near(c[k], expected.color[k], expected.color_error[k]))
                harness_fail(h, "color", x, y, "channel %d: got %.9g, expected %.9g +- %.2g (from %u)", k, c[k],
                             expected.color[k], expected.color_error[k], picture->from[i]);
        double off = ref_length(ref_add(ref_vec_of(n), ref_scale(expected.n, -1.0)));
        if (!(off <= 2.0 * expected.normal_error))
            harness_fail(h, "normal", x, y, "got (%.7f %.7f %.7f), expected (%.7f %.7f %.7f) +- %.2g", n[0], n[1], n[2],
                         expected.n.x, expected.n.y, expected.n.z, 2.0 * expected.normal_error);
        if (!harness_near(got_share[i], s->args.arrived ? expected.shadow : -5.0, 8.0 * TOL_UNIT))
            harness_fail(h, "shadow", x, y, "got %.9g, expected %.9g", got_share[i], expected.shadow);
    }
    if (all)
        harness_keep(h, all, count * sizeof *all);
    harness_same(h, "opacity", transparent, count, 4, 1, picture->view.width);
    harness_unsure(h, open, count, most_open);
}

// Of the instance and of points, 0 and 1 exactly among them.
static void opacities(struct harness *h)
{
    static const float values[] = {0.0f, 1.0f, 0.3f, 1e-6f};
    for (size_t i = 0; i < sizeof values / sizeof values[0]; i++)
        for (int own = 0; own < 2; own++) {
            struct rng rng = {11};
            struct setup s = make(h, &rng, 1, PICTURE_SURFACES, 1);
            s.args.instance.opacity = values[i];
            s.args.instance.has_opacities = own != 0;
            s.opacities = own ? harness_alloc(h, s.args.instance.slots) : NULL;
            for (uint32_t k = 0; k < s.args.instance.slots && own; k++)
                s.opacities[k] = rng_below(&rng, 3) ? (uint8_t)rng_next(&rng) : rng_below(&rng, 2) ? 255 : 0;
            s.args.blend = i % 2;
            s.args.instance.lit = i < 2;
            check(h, &s, TOL_UNSURE_SHARE);
        }
}

static void formats(struct harness *h)
{
    for (uint32_t format = 0; format < 3; format++)
        for (uint32_t lit = 0; lit < 2; lit++) {
            struct rng rng = {format};
            struct setup s = make(h, &rng, 1, PICTURE_SURFACES, format);
            s.args.instance.lit = lit;
            check(h, &s, TOL_UNSURE_SHARE);
        }
}

// Colours that blended discs and averages left in a plane: of the pixel where a surface was measured, and of each that shows it.
static void planes_of_colors(struct harness *h)
{
    static const uint32_t of_planes[] = {PT_COLOR_OF_PLANE, PT_COLOR_OF_PIXEL};
    for (int i = 0; i < 2; i++)
        for (uint32_t blend = 0; blend < 3; blend++) {
            struct rng rng = {12};
            struct setup s = make(h, &rng, 1, PICTURE_SURFACES, 0);
            s.args.instance.color_format = of_planes[i];
            s.args.blend = blend;
            s.colors_size = s.picture.count * 16;
            s.colors = harness_alloc(h, s.colors_size);
            for (size_t k = 0; k < 4 * s.picture.count; k++)
                ((float *)s.colors)[k] = (float)rng_range(&rng, 0.0, 1.5);
            check(h, &s, TOL_UNSURE_SHARE);
        }
}

static void kinds(struct harness *h)
{
    for (int p = 0; p < 2; p++)
        for (int kind = 0; kind < PICTURE_KINDS; kind++)
            for (uint32_t blend = 0; blend <= 8; blend = blend < 2 ? blend + 1 : 4 * blend) { // 0, 1, 2, 8
                struct rng rng = {(uint64_t)kind};
                struct setup s = make(h, &rng, p, (enum picture_kind)kind, 2);
                s.args.blend = blend;
                check(h, &s, kind == PICTURE_GRAZING || kind == PICTURE_TIGHT ? TOL_UNSURE_HARD : TOL_UNSURE_SHARE);
            }
}

static void estimated(struct harness *h)
{
    for (int p = 0; p < 2; p++) {
        struct rng rng = {7};
        struct setup s = make(h, &rng, p, PICTURE_SURFACES, 0);
        s.args.instance.has_normals = 0; // no difference: the normal plane holds the estimates
        s.args.blend = 3;
        check(h, &s, TOL_UNSURE_SHARE);
    }
}

static void materials(struct harness *h)
{
    static const struct {
        uint32_t shininess;
        float ambient, diffuse, specular;
    } known[] = {{1, 0, 0, 1}, {2, 1, 1, 1}, {500, 0, 0, 1}, {32, 1, 0, 0}, {32, 0, 1, 0}, {32, 0, 0, 0}};
    for (size_t i = 0; i < sizeof known / sizeof known[0]; i++) {
        struct rng rng = {8};
        struct setup s = make(h, &rng, 1, PICTURE_SURFACES, 2);
        s.args.instance.shininess = known[i].shininess;
        s.args.instance.ambient = known[i].ambient;
        s.args.instance.diffuse = known[i].diffuse;
        s.args.instance.specular = known[i].specular;
        check(h, &s, TOL_UNSURE_SHARE);
    }
}

// No light, 32 lights, a light at a point, lights far away and behind.
static void lights(struct harness *h)
{
    struct rng rng = {9};
    struct setup s = make(h, &rng, 1, PICTURE_SURFACES, 2);
    s.args.light_count = 0;
    check(h, &s, TOL_UNSURE_SHARE);
    s.args.light_count = PT_MAX_LIGHTS;
    cast_by_points(&s);
    for (uint32_t i = 0; i < PT_MAX_LIGHTS; i++) {
        struct light_args *light = &s.lights.each[i];
        light->type = 1 + i % 2;
        light->shadow = i % 3; // none, the first, the second
        rng_direction(&rng, light->vector);
        for (int c = 0; c < 3; c++) {
            light->color[c] = (float)rng_unit(&rng);
            light->vector[c] *= i % 2 ? (float)pow(10.0, rng_range(&rng, -1.0, 4.0)) : 1.0f;
        }
    }
    check(h, &s, TOL_UNSURE_SHARE);
    s.args.casting = 0; // an instance that receives none
    check(h, &s, TOL_UNSURE_SHARE);
    s.args.light_count = 1;
    s.lights.each[0].type = 2;
    for (size_t i = 0; i < s.picture.count; i += 97) { // exactly at a point
        if (s.picture.keys[i] == REF_EMPTY_KEY)
            continue;
        struct ref_ray ray = ref_ray(&s.args.view, (int)(i % 67), (int)(i / 67));
        double z = ref_key_z(s.picture.keys[i]);
        s.lights.each[0].vector[0] = (float)(ray.u * z);
        s.lights.each[0].vector[1] = (float)(ray.v * z);
        s.lights.each[0].vector[2] = (float)-z;
        check(h, &s, TOL_UNSURE_SHARE);
    }
}

// Spots with hard and soft edges, panels near and far, with shadows and without.
static void shapes(struct harness *h)
{
    for (uint64_t seed = 10; seed < 16; seed++) {
        struct rng rng = {seed};
        struct setup s = make(h, &rng, seed % 2 ? 1 : 0, PICTURE_SURFACES, 0);
        if (seed % 3)
            cast_by_points(&s);
        for (uint32_t i = 0; i < s.args.light_count; i++) {
            struct light_args *light = &s.lights.each[i];
            light->type = 3 + i % 2;
            light->shadow = (uint32_t)seed % 3;
            rng_direction(&rng, light->axis);
            light->cone[0] = (float)rng_range(&rng, 0.0, 0.9);
            light->cone[1] = (float)rng_range(&rng, 1.0, 20.0);
            for (int k = 0; k < 3 * PT_AREA_POINTS; k++)
                light->points[k / 3][k % 3] = light->vector[k % 3] + (float)rng_range(&rng, -0.3, 0.3);
        }
        check(h, &s, TOL_UNSURE_SHARE);
    }
}

// Words of shown points, by rank.
static void ranked(struct harness *h)
{
    for (uint64_t seed = 40; seed < 46; seed++) {
        struct rng rng = {seed};
        struct setup s = make(h, &rng, seed % 2 ? 1 : 0, PICTURE_SURFACES, (uint32_t)seed % 3);
        cast_by_points(&s);
        s.args.marked = 1;
        s.args.step = 2;
        s.args.blend = seed % 3;
        for (uint32_t i = 0; i < 2 * (s.args.instance.slots + 1); i++)
            s.shadows[i] = rng_below(&rng, 255 * 8 + 1) | (uint32_t)rng_next(&rng) << PT_SHADOW_SHIFT;
        for (uint32_t i = 0; i < s.args.light_count; i++)
            s.lights.each[i].shadow = i % 3;
        check(h, &s, TOL_UNSURE_SHARE);
    }
}

// What discs blended to in place of points' words, from none to all of the light.
static void pixels(struct harness *h)
{
    for (uint64_t seed = 30; seed < 34; seed++) {
        struct rng rng = {seed};
        struct setup s = make(h, &rng, seed % 2 ? 1 : 0, PICTURE_SURFACES, 2);
        s.args.of_pixels = 1;
        s.args.blend = seed % 3;
        for (size_t i = 0; i < 2 * s.picture.count; i++)
            s.shadows[i] = rng_below(&rng, 4) ? rng_below(&rng, PT_SHADOW_SUM + 1) : i % 2 ? PT_SHADOW_SUM : 0;
        for (uint32_t i = 0; i < s.args.light_count; i++)
            s.lights.each[i].shadow = i % 3;
        s.args.casting = 2;
        s.args.scales[0] = s.args.scales[1] = 1.0f / (float)PT_SHADOW_SUM;
        check(h, &s, TOL_UNSURE_SHARE);
    }
}

// Ambient light by direction, bright and near nothing, with lights and alone.
static void directed(struct harness *h)
{
    for (uint64_t seed = 20; seed < 26; seed++) {
        struct rng rng = {seed};
        struct setup s = make(h, &rng, seed % 2 ? 1 : 0, seed < 24 ? PICTURE_SURFACES : PICTURE_NOISE, 2);
        s.args.directed = 1;
        for (int k = 0; k < 27; k++)
            s.lights.ambient[k % 9][k / 9] = (float)rng_range(&rng, -1.0, 1.0) * (seed % 3 ? 1.0f : 50.0f);
        s.args.light_count = seed % 4 ? s.args.light_count : 0;
        s.args.instance.specular = seed % 2 ? 0.5f : 0.0f;
        s.args.blend = seed % 3 ? 1 : 2;
        check(h, &s, TOL_UNSURE_SHARE);
    }
}

// Ramps of all sources and lengths; scalars among which some are NaN and infinite; words of shapes; exposure and contrast.
static void ramps(struct harness *h)
{
    static const uint32_t entries[] = {2, 7, 256};
    for (uint32_t source = 0; source <= PT_RAMP_TRUST; source++)
        for (uint32_t i = 0; i < 6; i++) {
            struct rng rng = {source * 10 + i};
            const int trust = source == PT_RAMP_TRUST, scalar = source == PT_RAMP_SCALAR || trust;
            struct setup s = make(h, &rng, i % 2, i < 3 ? PICTURE_SURFACES : PICTURE_NOISE,
                                  scalar || source > 1 ? 0 : 1 + i % 2);
            struct recolor_args *recolor = &s.args.recolor;
            s.args.instance.color_format = scalar ? PT_COLOR_OF_SCALAR : source > 1 ? 0 : s.args.instance.color_format;
            s.args.instance.lit = i % 3 == 0;
            recolor->source = source;
            recolor->first = i % 2;
            recolor->entries = entries[i % 3];
            recolor->graded = i > 1;
            recolor->gain = i == 2 ? 8.0f : i == 5 ? 0.125f : 1.0f;
            recolor->contrast = i == 3 ? 2.5f : i == 4 ? 0.3f : 1.0f;
            for (int k = 0; k < 3; k++)
                recolor->along[k] = (float)rng_range(&rng, -0.4, 0.4);
            recolor->zero = trust ? 0.1f : scalar ? -4.0f : source == PT_RAMP_DISTANCE ? 2.0f : 0.3f;
            for (uint32_t k = 0; k < 3 * recolor->entries; k++)
                s.ramps[3 * recolor->first + k] = (float)rng_unit(&rng);
            for (uint32_t k = 0; k < s.args.instance.slots && scalar; k++)
                ((float *)s.colors)[k] = k % 50 == 7   ? NAN
                                         : k % 50 == 8 ? INFINITY
                                         : k % 50 == 9 ? -INFINITY
                                                       : (float)rng_range(&rng, -6.0, 3.0);
            for (uint32_t k = 0; k < s.args.instance.slots && trust; k++) // all levels and kinds, any classes
                ((uint32_t *)s.colors)[k] = (uint32_t)(rng_unit(&rng) * 0x3FFFFF) | k % 6 << PT_SHAPE_KIND_SHIFT |
                                            k % PT_TRUST_LEVELS << PT_SHAPE_TRUST_SHIFT | k % 3 << 30;
            recolor->along[0] = trust ? 1.1f : recolor->along[0];
            check(h, &s, TOL_UNSURE_SHARE);
        }
}

// Reference alone: the middle of a ramp from black to white; two stops up; a contrast of 2 takes mid grey for itself.
static void ramp_sanity(struct harness *h)
{
    uint64_t key = ref_key(2.0f, 0);
    uint32_t from = 0;
    float normal[4] = {0, 0, 1, 1}, deff = 0.1f, scalar = 3.0f;
    struct shade_args args = {.view = {.width = 1, .height = 1}};
    args.instance = (struct instance_args){
        .id_count = 1, .opacity = 1.0f, .color_format = PT_COLOR_OF_SCALAR, .color = {0.9f, 0.1f, 0.1f}};
    args.recolor = (struct recolor_args){
        .source = PT_RAMP_SCALAR, .along = {0.5f}, .zero = 2.0f, .entries = 2, .gain = 1.0f, .contrast = 1.0f};
    const float ramp[] = {0, 0, 0, 1, 1, 1};
    struct ref_planes planes = {.keys = &key, .from = &from, .normal = normal, .deff = &deff, .colors = &scalar, .ramps = ramp};
    HARNESS_CHECK(h, fabs(ref_shade(&args, &planes, 0, 0).color[0] - 0.5) < 1e-6);
    args.recolor.graded = 1;
    args.recolor.gain = 4.0f;
    HARNESS_CHECK(h, fabs(ref_shade(&args, &planes, 0, 0).color[0] - 2.0) < 1e-6);
    args.recolor.gain = 0.36f; // mid grey
    args.recolor.contrast = 2.0f;
    HARNESS_CHECK(h, fabs(ref_shade(&args, &planes, 0, 0).color[0] - 0.18) < 1e-6);
    args.recolor.gain = 0.18f; // a stop below it: two with the contrast
    HARNESS_CHECK(h, fabs(ref_shade(&args, &planes, 0, 0).color[0] - 0.045) < 1e-6);
    args.recolor.graded = 0;
    scalar = NAN;
    HARNESS_CHECK(h, fabs(ref_shade(&args, &planes, 0, 0).color[0] - 0.9) < 1e-6);
}

// Reference alone: a white wall, lit head-on by a sun of irradiance pi, is as bright as a mirror of it: 1.
static void sanity(struct harness *h)
{
    uint64_t key = ref_key(2.0f, 0);
    uint32_t from = 0;
    float normal[4] = {0, 0, -1, 1}, deff = 0.1f; // turned away: lit all the same
    struct shade_args args = {.view = {.width = 1, .height = 1}, .light_count = 1};
    args.instance = (struct instance_args){
        .id_count = 1, .has_normals = 1, .opacity = 1.0f, .lit = 1, .shininess = 8, .diffuse = 1.0f, .color = {1, 0.5f, 0}};
    struct light_view lights = {.world = {0}};
    lights.each[0] = (struct light_args){.type = 1, .color = {(float)3.14159265358979, 0.0f, 0.0f}, .vector = {0, 0, 1}};
    struct ref_planes planes = {.keys = &key, .from = &from, .normal = normal, .deff = &deff, .lights = &lights};
    struct ref_shade out = ref_shade(&args, &planes, 0, 0);
    HARNESS_CHECK(h, fabs(out.color[0] - 1.0) < 1e-6 && out.color[1] == 0.0 && out.color[3] == 1.0);
    lights.each[0].type = 2; // two units before the wall: a quarter
    lights.each[0].vector[2] = 0.0f;
    HARNESS_CHECK(h, fabs(ref_shade(&args, &planes, 0, 0).color[0] - 0.25) < 1e-6);
    uint32_t word = 51; // a fifth of one sample is lost
    planes.shadows = &word;
    lights.each[0].shadow = args.casting = 1;
    args.scales[0] = 1.0f / 255.0f;
    HARNESS_CHECK(h, fabs(ref_shade(&args, &planes, 0, 0).color[0] - 0.2) < 1e-6);
    HARNESS_CHECK(h, fabs(ref_shade(&args, &planes, 0, 0).shadow - 0.8) < 1e-6);
    args.casting = 0;
    args.instance.specular = 1.0f; // the highlight doubles it
    HARNESS_CHECK(h, fabs(ref_shade(&args, &planes, 0, 0).color[0] - 0.5) < 1e-6);
    args.light_count = 0;
    args.instance.ambient = args.directed = 1;
    lights.ambient[0][0] = 0.5f; // half a sphere's worth of white sky above the eye, which the wall, turned to it, sees whole
    lights.ambient[3][0] = 0.5f;
    lights.ambient[8][2] = -1.0f; // below zero: no light
    HARNESS_CHECK(h, fabs(ref_shade(&args, &planes, 0, 0).color[0] - 1.0) < 1e-6);
    HARNESS_CHECK(h, ref_shade(&args, &planes, 0, 0).color[2] == 0.0);
    HARNESS_CHECK(h, fabs(ref_srgb(188) - 0.502886) < 1e-5 && ref_srgb(255) == 1.0 && ref_srgb(0) == 0.0);
}

int main(int argc, char **argv)
{
    static const struct harness_case cases[] = {
        {"sanity", sanity, 1},
        {"colour formats, lit and unlit", formats, 0},
        {"colours of a plane", planes_of_colors, 0},
        {"pictures of all kinds, paper and refined", kinds, 0},
        {"estimated normals", estimated, 0},
        {"opacities", opacities, 0},
        {"materials", materials, 0},
        {"lights", lights, 0},
        {"spots and panels", shapes, 0},
        {"shadow words of pixels", pixels, 0},
        {"words of shown points", ranked, 0},
        {"ambient light by direction", directed, 0},
        {"sanity of ramps", ramp_sanity, 1},
        {"ramps, exposure, contrast", ramps, 0},
    };
    return harness_main(argc, argv, cases, sizeof cases / sizeof cases[0]);
}
