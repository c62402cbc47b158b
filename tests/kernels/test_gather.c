// SPDX-License-Identifier: GPL-3.0-or-later
// gather: soft points as records: balls of any radius, about the eye and behind it, sifted, lit, coloured; bit for bit the same.
#include "points.h"
#include "shared/balls.h"

#include <math.h>
#include <string.h>

static const uint32_t sizes[] = {1, 15, 16, 17, 300, 700, 31, 2};
enum { SIZES = sizeof sizes / sizeof sizes[0] };

struct setup {
    struct scene scene;
    struct gather_args args;
    struct light_view lights;
    float ramps[9]; // the instance's is its last two
    uint32_t *field, *drawn, *shadows, records;
    void *colors;
    size_t colors_size;
    uint8_t *opacities;
};

static uint32_t float_bits(double number)
{
    const float cut = (float)number;
    uint32_t bits;
    memcpy(&bits, &cut, 4);
    return bits;
}

static uint32_t field_word(double f, double radius)
{
    return (uint32_t)(f * (double)PT_FIELD_MOST + 0.5) << PT_FIELD_SHIFT | (float_bits(radius) >> 15 & PT_FIELD_RADIUS);
}

static void set_lights(struct rng *rng, struct setup *s, uint32_t count)
{
    struct shade_args *args = &s->args.shade;
    args->light_count = count;
    args->casting = 2;
    args->scales[0] = args->scales[1] = 1.0f / (255.0f * 8.0f);
    for (uint32_t i = 0; i < count; i++) {
        struct light_args *light = &s->lights.each[i];
        light->type = i % 3 == 2 ? 3 : i % 2 ? 2 : 1;
        rng_direction(rng, light->vector);
        rng_direction(rng, light->axis);
        light->cone[0] = 0.3f;
        light->cone[1] = 4.0f;
        for (int c = 0; c < 3; c++) {
            light->color[c] = (float)rng_range(rng, 0.0, 4.0);
            light->vector[c] *= i % 3 ? 9.0f : 1.0f;
        }
        light->shadow = i < 2 ? i + 1 : 0;
        args->light_types |= 1u << light->type;
    }
}

// Points about a camera's view at this distance, a third of them solid, with balls from `narrow` to `wide`.
static struct setup make(struct harness *h, struct rng *rng, int perspective, uint32_t format, double distance, double narrow,
                         double wide)
{
    struct setup s = {.scene = {.view = points_window(67, 45, perspective, perspective ? 60.0 : 20.0)}};
    struct view_args *view = &s.scene.view;
    struct camera camera = points_look(rng, view, 1.0 / (double)view->ray_xs, distance);
    struct cloud *cloud = points_add_cloud(h, rng, &s.scene, &camera, sizes, SIZES, 0, 70);
    struct instance_args *instance = &s.args.shade.instance;
    points_scatter_about(rng, cloud, 1.5);
    s.args = (struct gather_args){.shade = {.view = *view, .eye_z = perspective ? 0.0f : (float)camera.near_clip},
                                  .threshold = 20000,
                                  .radius_scale = 1.25f,
                                  .opacity = 0.8f,
                                  .within = 1,
                                  .radius_step = 1u << 15};
    s.lights.world[0] = s.lights.world[1] = s.lights.world[2] = 0.5f;
    *instance = (struct instance_args){.id_base = 70,
                                       .id_count = cloud->slots,
                                       .slots = cloud->slots,
                                       .has_normals = 1,
                                       .color_format = format,
                                       .lit = 1,
                                       .shininess = 16,
                                       .ambient = 0.7f,
                                       .diffuse = 0.9f,
                                       .specular = 0.5f,
                                       .color = {0.2f, 0.9f, 0.4f},
                                       .opacity = 0.9f};
    for (int k = 0; k < 9; k++)
        instance->normal_matrix[k] = (float)camera.rotation[k];
    s.field = harness_alloc(h, 4 * (size_t)cloud->slots);
    s.colors = harness_alloc(h, s.colors_size = 12 * (size_t)cloud->slots);
    s.opacities = harness_alloc(h, (size_t)cloud->slots + 4);
    s.shadows = harness_alloc(h, 8 * (size_t)cloud->slots);
    for (uint32_t i = 0; i < cloud->slots; i++) {
        s.field[i] = field_word(rng_unit(rng), narrow * pow(wide / narrow, rng_unit(rng)));
        s.opacities[i] = (uint8_t)(rng_below(rng, 4) ? rng_next(rng) : rng_below(rng, 2) * 255);
        for (uint32_t k = 0; k < 2; k++)
            s.shadows[k * cloud->slots + i] = rng_below(rng, 255 * 8 + 1) | (uint32_t)rng_next(rng) << PT_SHADOW_SHIFT;
        for (uint32_t k = 0; k < 3 && format != 1; k++)
            ((float *)s.colors)[3 * i + k] = (float)rng_range(rng, 0.0, 1.5);
        for (uint32_t k = 0; k < 3 && format == 1; k++)
            ((uint8_t *)s.colors)[3 * i + k] = (uint8_t)rng_next(rng);
    }
    for (uint32_t c = 0; c < cloud->chunk_count; c++) {
        cloud->chunks[c].record = s.records;
        s.records += cloud->chunks[c].padded;
    }
    return s;
}

// Every second chunk is sifted.
static void sift(struct harness *h, struct rng *rng, struct setup *s)
{
    struct cloud *cloud = &s->scene.clouds[0];
    uint32_t words = 0;
    s->drawn = harness_alloc(h, cloud->slots);
    for (uint32_t c = 0; c < cloud->chunk_count; c += 2) {
        cloud->chunks[c].sifted = 1 + words;
        words += (cloud->chunks[c].padded + PT_SLOTS_A_WORD - 1) / PT_SLOTS_A_WORD;
    }
    for (uint32_t i = 0; i < words; i++)
        s->drawn[i] = (uint32_t)rng_next(rng);
    s->args.sifted = 1;
}

static void check_record(struct harness *h, const struct ref_record *wanted, const float *got, uint32_t slot)
{
    uint32_t word;
    memcpy(&word, got + 7, 4);
    const int drawn = got[2] < INFINITY;
    if (wanted->drawn == REF_UNSURE && !drawn)
        return;
    if (drawn != (wanted->drawn != REF_NO)) {
        harness_fail(h, "drawn", (int)slot, 0, "is %d; z %g, radius %g, opacity %g", drawn, wanted->place[2], wanted->radius,
                     wanted->opacity);
        return;
    }
    for (int k = 0; k < 3 && drawn; k++) {
        if (!harness_near(got[k], wanted->place[k], wanted->place_error[k] + 1e-30))
            harness_fail(h, "place", (int)slot, k, "got %.9g, expected %.9g", (double)got[k], wanted->place[k]);
        if (wanted->singular ? !isfinite(got[4 + k])
                             : !wanted->unsure && !harness_near(got[4 + k], wanted->color[k], wanted->color_error[k] + 1e-7))
            harness_fail(h, "color", (int)slot, k, "got %.9g, expected %.9g within %.3g", (double)got[4 + k], wanted->color[k],
                         wanted->color_error[k]);
    }
    if (drawn && !harness_near(got[3], wanted->radius, wanted->radius_error))
        harness_fail(h, "radius", (int)slot, 0, "got %.9g, expected %.9g", (double)got[3], wanted->radius);
    if (drawn && !harness_near((word >> PT_SOFT_SHIFT) / (double)PT_SOFT_STEPS, wanted->opacity, wanted->opacity_error))
        harness_fail(h, "opacity", (int)slot, 0, "got %.9g, expected %.9g", (word >> PT_SOFT_SHIFT) / (double)PT_SOFT_STEPS,
                     wanted->opacity);
    if (drawn && !harness_near((word & 255u) / 255.0, wanted->weight, 0.51 / 255.0))
        harness_fail(h, "weight", (int)slot, 0, "got %u of 255, expected %.9g", word & 255u, wanted->weight);
}

// Returns how many are drawn.
static uint32_t run(struct harness *h, const struct setup *s)
{
    const struct cloud *cloud = &s->scene.clouds[0];
    const size_t slots = cloud->slots, size = 4 * PT_SOFT_WORDS * (size_t)s->records;
    const struct instance_args *instance = &s->args.shade.instance;
    uint32_t drawn = 0;
    struct pt_buffer *points = harness_buffer(h, harness_alloc(h, size), size);
    HARNESS_RUN(h, gather, &s->args, points, harness_buffer(h, cloud->chunks, cloud->chunk_count * sizeof *cloud->chunks),
                points_positions(h, cloud->chunks, cloud->chunk_count, cloud->positions, cloud->slots),
                harness_buffer(h, cloud->surfels, 4 * slots), harness_buffer(h, s->field, 4 * slots),
                instance->color_format ? harness_buffer(h, s->colors, s->colors_size) : NULL,
                instance->has_opacities ? harness_buffer(h, s->opacities, (slots + 3) / 4 * 4) : NULL,
                harness_buffer(h, s->shadows, 8 * slots), s->drawn ? harness_buffer(h, s->drawn, slots) : NULL,
                instance->lit ? harness_buffer(h, &s->lights, sizeof s->lights) : NULL,
                s->args.shade.recolor.source ? harness_buffer(h, s->ramps, sizeof s->ramps) : NULL);
    const float *got = harness_read(h, points);
    harness_same(h, "records", got, (size_t)PT_SOFT_WORDS * s->records, 4, PT_SOFT_WORDS, s->records);
    const struct ref_planes planes = {.surfels = cloud->surfels,
                                      .colors = s->colors,
                                      .opacities = s->opacities,
                                      .shadows = s->shadows,
                                      .lights = &s->lights,
                                      .ramps = s->ramps};
    for (uint32_t c = 0; c < cloud->chunk_count; c++)
        for (uint32_t i = 0; i < cloud->chunks[c].padded; i++) {
            const float *record = got + PT_SOFT_WORDS * (size_t)(cloud->chunks[c].record + i);
            const struct ref_record wanted = ref_gather(&s->args, &cloud->chunks[c], cloud->positions, s->field, s->drawn,
                                                        &planes, i);
            check_record(h, &wanted, record, cloud->chunks[c].first + i);
            drawn += record[2] < INFINITY;
        }
    harness_note(h, "%u of %u records drawn", drawn, s->records);
    return drawn;
}

static void formats(struct harness *h)
{
    for (uint32_t format = 0; format < 3; format++)
        for (int perspective = 0; perspective < 2; perspective++) {
            struct rng rng = {31 + format};
            struct setup s = make(h, &rng, perspective, format, 4.0, 0.01, 0.3);
            set_lights(&rng, &s, 3);
            points_pad(&s.scene.clouds[0]);
            s.args.shade.instance.has_opacities = format == 1;
            s.args.weight = format == 2 ? 1.0f / 30000.0f : 0.0f;
            if (format)
                sift(h, &rng, &s);
            HARNESS_CHECK(h, run(h, &s) > 100);
        }
}

static void unlit_directed_and_a_ramp(struct harness *h)
{
    struct rng rng = {41};
    struct setup s = make(h, &rng, 1, 2, 4.0, 0.01, 0.3);
    points_pad(&s.scene.clouds[0]);
    s.args.shade.instance.lit = 0;
    s.args.shade.recolor = (struct recolor_args){.graded = 1, .gain = 1.3f, .contrast = 1.2f};
    HARNESS_CHECK(h, run(h, &s) > 100);
    s.args.shade.instance.lit = s.args.shade.directed = 1;
    s.args.shade.instance.specular = 0.0f;
    for (int k = 0; k < 27; k++)
        s.lights.ambient[k % 9][k / 9] = (float)rng_range(&rng, 0.0, 0.3);
    run(h, &s);
    s.args.shade.recolor = (struct recolor_args){
        .source = PT_RAMP_DISTANCE, .along = {0.3f}, .zero = 3.0f, .first = 1, .entries = 2};
    for (int k = 0; k < 9; k++)
        s.ramps[k] = (float)rng_unit(&rng);
    s.args.shade.instance.color_format = 0;
    HARNESS_CHECK(h, run(h, &s) > 100);
}

// Radii from 1e-3 to 1e3, and clouds as large.
static void radii(struct harness *h)
{
    for (int perspective = 0; perspective < 2; perspective++) {
        struct rng rng = {51};
        struct setup s = make(h, &rng, perspective, 2, 4.0, 1e-3, 1e3);
        set_lights(&rng, &s, 1);
        points_pad(&s.scene.clouds[0]);
        HARNESS_CHECK(h, run(h, &s) > 100);
    }
}

// Words that are radii alone, and steps between two of them; 0 is none.
static void words(struct harness *h)
{
    for (uint32_t whole = 0; whole < 2; whole++) {
        struct rng rng = {81 + whole};
        struct setup s = make(h, &rng, 1, 2, 4.0, 0.05, 0.3);
        set_lights(&rng, &s, 1);
        points_pad(&s.scene.clouds[0]);
        s.args.whole = whole;
        s.args.radius_step = whole ? 1 : (float_bits(0.3) - float_bits(0.05)) / (PT_FIELD_RADIUS - 1) + 1;
        s.args.radius_base = whole ? 0 : float_bits(0.05) - s.args.radius_step;
        s.args.weight = whole ? 1e-5f : 1.0f / 30000.0f;
        for (uint32_t i = 0; i < s.scene.clouds[0].slots; i++) {
            s.field[i] = whole ? float_bits(rng_range(&rng, 0.05, 0.3)) : (uint32_t)rng_next(&rng);
            s.field[i] = i % 9 ? s.field[i] : whole ? 0 : s.field[i] & ~PT_FIELD_RADIUS;
        }
        HARNESS_CHECK(h, run(h, &s) > 100);
    }
}

// The eye stands among the points; many lie behind it, some balls around it. Without `within` only those before it show.
static void about_the_eye(struct harness *h)
{
    uint32_t drawn[2];
    for (uint32_t within = 0; within < 2; within++) {
        struct rng rng = {61};
        struct setup s = make(h, &rng, 1, 2, 0.2, 0.05, 3.0);
        set_lights(&rng, &s, 2);
        points_pad(&s.scene.clouds[0]);
        s.args.within = within;
        drawn[within] = run(h, &s);
    }
    HARNESS_CHECK(h, drawn[0] < drawn[1]);
}

// Opacity 0 and 1, the threshold at both ends, no radius, no normal, places that are none.
static void ends(struct harness *h)
{
    struct rng rng = {71};
    struct setup s = make(h, &rng, 1, 0, 4.0, 0.05, 0.3);
    struct cloud *cloud = &s.scene.clouds[0];
    set_lights(&rng, &s, 1);
    const float none[] = {NAN, INFINITY, -INFINITY, 3e38f};
    for (uint32_t i = 0; i < 64; i++)
        *points_coordinate(cloud, 5, i, (int)(i % 3)) = none[i % 4];
    points_pad(cloud);
    for (uint32_t i = 0; i < cloud->slots; i++) {
        if (i % 5 == 0)
            s.field[i] &= ~PT_FIELD_RADIUS;
        if (i % 7 == 0)
            cloud->surfels[i] |= PT_NORMAL_NONE;
        if (i % 11 == 0)
            s.field[i] |= 0xFFFFu << PT_FIELD_SHIFT;
        if (i % 13 == 0)
            s.field[i] = s.args.threshold << PT_FIELD_SHIFT | (s.field[i] & PT_FIELD_RADIUS); // at it: solid
    }
    s.args.opacity = s.args.shade.instance.opacity = 1.0f;
    HARNESS_CHECK(h, run(h, &s) > 100);
    s.args.threshold = 0;
    run(h, &s);
    s.args.opacity = 0.0f;
    HARNESS_CHECK(h, run(h, &s) == 0);
    s.args.opacity = 1.0f;
    s.args.threshold = 65535;
    HARNESS_CHECK(h, run(h, &s) == 0);
}

static void packed(struct harness *h)
{
    points_packed(h, formats);
    points_packed(h, radii);
    points_packed(h, about_the_eye);
}

int main(int argc, char **argv)
{
    static const struct harness_case cases[] = {
        {"packed positions", packed, 0},
        {"formats of colours", formats, 0},
        {"unlit, directed, a ramp", unlit_directed_and_a_ramp, 0},
        {"radii from 1e-3 to 1e3", radii, 0},
        {"words", words, 0},
        {"about the eye", about_the_eye, 0},
        {"ends", ends, 0},
    };
    return harness_main(argc, argv, cases, sizeof cases / sizeof cases[0]);
}
