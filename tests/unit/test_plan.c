// SPDX-License-Identifier: GPL-3.0-or-later
// The plan without a device: which passes a scene calls for, and why the others are left out (DESIGN rule 3).
#include "plan/passes.h"
#include "scenes/support.h"
#include "shared/filling.h"
#include "shared/lines.h"
#include "shared/measured.h"
#include "shared/picture.h"
#include "shared/points.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>

#include <cmocka.h>

#include "square.h" // behind cmocka.h

static void test_every_pass_runs_or_has_a_reason(void **state)
{
    (void)state;
    patina_cloud *cloud = square(1);
    patina_scene *scene = scene_above(cloud, 2.5, 1, 0);
    struct pt_plan plan = plan_of(scene);
    for (int k = 0; k < PT_KERNEL_COUNT; k++)
        assert_true((passes_of(&plan, (enum pt_kernel)k) > 0) != (skipped(&plan, pt_kernels[k].name) != NULL));
    for (uint32_t i = 0; i < plan.pass_count; i++)
        assert_true(plan.passes[i].reason[0]);
    assert_non_null(skipped(&plan, "normals")); // the cloud has them
    pt_plan_destroy(&plan);
    patina_scene_destroy(scene);
    patina_cloud_destroy(cloud);
}

static void test_missing_normals_are_estimated(void **state)
{
    (void)state;
    patina_cloud *cloud = square(0);
    patina_scene *scene = scene_above(cloud, 2.5, 1, 1);
    struct pt_plan plan = plan_of(scene);
    assert_int_equal(passes_of(&plan, PT_KERNEL_normals), 1);
    assert_true(plan.points_scattered == COUNT); // back faces are never culled without normals
    pt_plan_destroy(&plan);
    patina_scene_destroy(scene);
    patina_cloud_destroy(cloud);
}

static void test_settings_leave_passes_out(void **state)
{
    (void)state;
    patina_cloud *cloud = square(1);
    patina_scene *scene = scene_above(cloud, 2.5, 1, 0);
    patina_settings settings = {.struct_size = sizeof settings,
                                .fill = PATINA_FILL_OFF,
                                .smooth = PATINA_SMOOTH_OFF,
                                .antialias = PATINA_ANTIALIAS_OFF,
                                .passes = 1u << PATINA_PASS_COMBINED};
    assert_int_equal(patina_scene_set_settings(scene, &settings), PATINA_OK);
    struct pt_plan plan = plan_of(scene);
    static const char *const out[] = {"fill", "pull", "push", "smooth", "antialias", "extract"};
    for (size_t i = 0; i < sizeof out / sizeof *out; i++)
        assert_non_null(skipped(&plan, out[i]));
    assert_int_equal(plan.pass_count, 4); // scatter, surface, shade, compose
    pt_plan_destroy(&plan);
    patina_scene_destroy(scene);
    patina_cloud_destroy(cloud);
}

static const struct pt_step *step_of(const struct pt_plan *plan, enum pt_step_of of, uint32_t layer)
{
    for (uint32_t i = 0; i < plan->step_count; i++)
        if (plan->steps[i].of == of && plan->steps[i].layer == layer)
            return &plan->steps[i];
    return NULL;
}

// Every pass stands in one step, in order; loops hold their rounds and say when they end.
static void test_steps_hold_the_whole_plan(void **state)
{
    (void)state;
    patina_cloud *cloud = square(1);
    patina_scene *scene = scene_above(NULL, 2.5, 1, 0);
    const patina_cloud_style style = {.struct_size = sizeof style, .transparency = 0.5f, .lighting = PATINA_LIGHTING_LIT};
    const patina_light_desc light = {
        .struct_size = sizeof light, .type = PATINA_LIGHT_SUN, .power = 3, .angle = 0.1f, .shadows = 1};
    const patina_settings settings = {
        .struct_size = sizeof settings, .width = 64, .height = 64, .layers = 3, .shadow_samples = 5, .shadow_error = 0.1f};
    assert_int_equal(patina_scene_add_cloud(scene, cloud, &style), PATINA_OK);
    assert_int_equal(patina_scene_add_light(scene, &light), PATINA_OK);
    assert_int_equal(patina_scene_set_settings(scene, &settings), PATINA_OK);
    struct pt_plan plan = plan_of(scene);
    uint32_t next = 0;
    for (uint32_t i = 0; i < plan.step_count; i++) {
        assert_true(plan.steps[i].reason[0]);
        assert_true(i + plan.steps[i].inside < plan.step_count);
        if (plan.steps[i].of == PT_STEP_PASSES || plan.steps[i].of == PT_STEP_MARK) {
            assert_int_equal(plan.steps[i].first, next);
            next += plan.steps[i].count;
        }
    }
    assert_int_equal(next, plan.pass_count);
    const struct pt_step *samples = step_of(&plan, PT_STEP_LIGHT, 1), *layers = step_of(&plan, PT_STEP_LAYERS, 2);
    assert_non_null(samples);
    assert_int_equal(samples->most, 5);
    assert_int_equal(samples->ends, PT_END_UNCHANGED | PT_END_ERROR_MET);
    assert_non_null(layers);
    assert_int_equal(layers->most, 2);
    assert_true(layers->ends & PT_END_LAYER_EMPTY);
    assert_non_null(step_of(&plan, PT_STEP_LAYER, 3));
    assert_null(step_of(&plan, PT_STEP_LIGHT, 2)); // which points the second layer shows changes no texture
    pt_plan_destroy(&plan);
    patina_scene_destroy(scene);
    patina_cloud_destroy(cloud);
}

// A light's map is a plan of its own, made of scene, plan and round alone: the same twice, and what is not tested has no pass.
static void test_maps_are_plans(void **state)
{
    (void)state;
    patina_cloud *cloud = square(1);
    patina_scene *scene = scene_above(NULL, 2.5, 1, 0);
    const patina_cloud_style style = {.struct_size = sizeof style, .lighting = PATINA_LIGHTING_LIT};
    const patina_light_desc light = {.struct_size = sizeof light, .type = PATINA_LIGHT_SUN, .power = 3, .shadows = 1};
    assert_int_equal(patina_scene_add_cloud(scene, cloud, &style), PATINA_OK);
    assert_int_equal(patina_scene_add_light(scene, &light), PATINA_OK);
    struct pt_plan plan = plan_of(scene), maps[2];
    assert_int_equal(plan.group_count, 1);
    assert_int_equal(pt_plan_light_map(scene, &plan, 0), PATINA_OK);
    const struct pt_round round = {.points = 1}, nobody = {0};
    for (int i = 0; i < 2; i++)
        assert_int_equal(pt_plan_map(scene, &plan, &round, &maps[i]), PATINA_OK);
    assert_int_equal(passes_of(&maps[0], PT_KERNEL_shadow_test), 1);
    assert_int_equal(maps[0].pass_count, maps[1].pass_count);
    for (uint32_t i = 0; i < maps[0].pass_count; i++) {
        const struct pt_pass *a = &maps[0].passes[i], *b = &maps[1].passes[i];
        assert_int_equal(a->argument_size, b->argument_size);
        assert_memory_equal(a->arguments, b->arguments, a->argument_size);
        assert_false(a->output);
    }
    assert_true(pt_plan_tested(scene, &plan, &round, 0));
    assert_false(pt_plan_tested(scene, &plan, &nobody, 0));
    pt_plan_destroy(&maps[0]);
    pt_plan_destroy(&maps[1]);
    pt_plan_destroy(&plan);
    patina_scene_destroy(scene);
    patina_cloud_destroy(cloud);
}

// Room is made for the passes that are asked for.
static void test_planes_of_the_picture(void **state)
{
    (void)state;
    patina_cloud *cloud = square(1);
    patina_scene *scene = scene_above(cloud, 2.5, 1, 0);
    const patina_settings settings = {.struct_size = sizeof settings,
                                      .passes = 1u << PATINA_PASS_COMBINED | 1u << PATINA_PASS_DEPTH};
    for (int all = 0; all < 2; all++) {
        struct pt_plan plan = plan_of(scene);
        for (int p = PT_PLANE_COMBINED; p < PT_PLANE_LAYER_COMBINED; p++) {
            const int asked = p == PT_PLANE_COMBINED || p == PT_PLANE_DEPTH ||
                              (!all && (p == PT_PLANE_NORMALS || p == PT_PLANE_SOURCE));
            assert_int_equal(pt_plan_writes(&plan, (enum pt_plane)p), asked);
        }
        pt_plan_destroy(&plan);
        assert_int_equal(patina_scene_set_settings(scene, &settings), PATINA_OK);
    }
    patina_scene_destroy(scene);
    patina_cloud_destroy(cloud);
}

// Passes that read what lines wrote stay where they wrote: what lies beyond is of no one, or of another picture.
static void test_ink_stays_within_lines(void **state)
{
    (void)state;
    patina_cloud *cloud = square(1);
    patina_scene *scene = scene_above(cloud, 4.0, 1, 0);
    const patina_lines lines = {.struct_size = sizeof lines, .width = 2.0f, .source = PATINA_LINE_POINT};
    const uint32_t *rect = NULL;
    uint32_t inks = 0;
    assert_int_equal(patina_scene_set_lines(scene, &lines), PATINA_OK);
    struct pt_plan plan = plan_of(scene);
    for (uint32_t i = 0; i < plan.pass_count; i++) {
        const struct pt_pass *pass = &plan.passes[i];
        const uint32_t *ink = ((const struct ink_args *)pass->arguments)->view.rect;
        if (pass->kernel == PT_KERNEL_lines)
            rect = ((const struct lines_args *)pass->arguments)->view.rect;
        if (pass->kernel != PT_KERNEL_ink)
            continue;
        assert_non_null(rect);
        assert_true(ink[0] >= rect[0] && ink[1] >= rect[1] && ink[2] <= rect[2] && ink[3] <= rect[3]);
        inks++;
    }
    assert_int_equal(inks, 2); // the pass of shares, and the points' colours
    pt_plan_destroy(&plan);
    patina_scene_destroy(scene);
    patina_cloud_destroy(cloud);
}

// Planes that are needed at the same time share no memory, and every plane that a pass alone binds is in one or is kept.
static void test_planes_share_memory(void **state)
{
    (void)state;
    patina_cloud *cloud = square(1);
    patina_scene *scene = scene_above(NULL, 2.5, 1, 0);
    const patina_cloud_style style = {.struct_size = sizeof style, .lighting = PATINA_LIGHTING_LIT};
    const patina_effects effects = {.struct_size = sizeof effects, .obscurance_strength = 1.0f};
    assert_int_equal(patina_scene_add_cloud(scene, cloud, &style), PATINA_OK);
    assert_int_equal(patina_scene_set_effects(scene, &effects), PATINA_OK);
    uint64_t peaks[2];
    for (int apart = 0; apart < 2; apart++) {
        struct pt_plan plan = plan_of(scene);
        uint32_t shared = 0;
        assert_int_equal(pt_plan_share_planes(&plan, &(struct pt_abilities){.bin_threads = 2}, apart), PATINA_OK);
        for (uint32_t i = 0; i < plan.life_count; i++) {
            const struct pt_life *a = &plan.lives[i];
            assert_false(pt_plane_is_kept(a->plane, a->index));
            assert_true(a->first <= a->last && a->bytes <= plan.slabs[a->slab].bytes);
            for (uint32_t k = 0; k < i; k++) {
                const struct pt_life *b = &plan.lives[k];
                shared += a->slab == b->slab;
                assert_true(a->slab != b->slab || b->last < a->first || a->last < b->first);
                assert_true(a->plane != b->plane || a->index != b->index);
            }
        }
        for (uint32_t i = 0; i < plan.pass_count; i++)
            for (uint32_t k = 0; k < plan.passes[i].ref_count; k++) {
                const struct pt_ref *ref = &plan.passes[i].refs[k];
                int known = ref->of != PT_OF_FRAME || pt_plane_is_kept(ref->which, ref->index);
                for (uint32_t l = 0; l < plan.life_count && !known; l++)
                    known = plan.lives[l].plane == ref->which && plan.lives[l].index == ref->index;
                assert_true(known);
            }
        assert_true(apart ? !shared && plan.slab_count == plan.life_count : shared > 0);
        peaks[apart] = plan.peak;
        pt_plan_destroy(&plan);
    }
    assert_true(peaks[0] < peaks[1]);
    patina_scene_destroy(scene);
    patina_cloud_destroy(cloud);
}

// Bins of discs are a plane from splat to the last blend, with the room that the rule says, and none on devices without.
static void test_bins_of_discs(void **state)
{
    (void)state;
    patina_cloud *cloud = square(1);
    const patina_settings settings = {
        .struct_size = sizeof settings, .width = 64, .height = 64, .surface = PATINA_SURFACE_SPLATS};
    for (int discs = 0; discs < 2; discs++)
        for (uint32_t threads = 0; threads < 4; threads += 3) {
            patina_scene *scene = scene_above(cloud, 2.5, 1, 0);
            assert_int_equal(!discs || patina_scene_set_settings(scene, &settings) == PATINA_OK, 1);
            struct pt_plan plan = plan_of(scene);
            uint32_t lives = 0;
            assert_int_equal(pt_plan_share_planes(&plan, &(struct pt_abilities){.bin_threads = threads}, 0), PATINA_OK);
            for (uint32_t i = 0; i < plan.life_count; i++)
                lives += plan.lives[i].plane == PT_PLANE_DISC_BINS;
            assert_int_equal(lives, discs && threads);
            assert_int_equal(plan.discs.bins > 0, discs && threads);
            for (uint32_t i = 0; i < plan.pass_count && lives; i++)
                for (uint32_t k = 0; k < plan.passes[i].ref_count; k++)
                    if (plan.passes[i].refs[k].of == PT_OF_FRAME && plan.passes[i].refs[k].which == PT_PLANE_DISC_BINS)
                        assert_true(plan.passes[i].kernel == PT_KERNEL_splat || plan.passes[i].kernel == PT_KERNEL_blend);
            if (lives) {
                const uint64_t told = 16 * (uint64_t)plan.discs.bins;
                assert_true(plan.discs.entries >= (double)plan.points_scattered);
                assert_true(told >= pt_bins_bytes(pt_bins_of(&plan.view), threads, plan.points_scattered / PT_BIN_DISCS));
                pt_plan_set_bins(&plan, threads, 2 * told); // what the picture before came to
                assert_int_equal(16 * (uint64_t)plan.discs.bins, 2 * told);
                pt_plan_set_bins(&plan, threads, 8 * told); // of another view
                assert_int_equal(16 * (uint64_t)plan.discs.bins, told);
            }
            pt_plan_destroy(&plan);
            patina_scene_destroy(scene);
        }
    patina_cloud_destroy(cloud);
}

static uint32_t blend_of(const patina_scene *scene)
{
    struct pt_plan plan = plan_of(scene);
    uint32_t blend = UINT32_MAX;
    for (uint32_t i = 0; i < plan.pass_count; i++)
        if (plan.passes[i].kernel == PT_KERNEL_shade)
            blend = ((const struct shade_args *)plan.passes[i].arguments)->blend;
    pt_plan_destroy(&plan);
    return blend;
}

static void test_normals_are_blended_where_they_show(void **state)
{
    (void)state;
    patina_cloud *cloud = square(1);
    patina_scene *scene = scene_above(cloud, 2.5, 1, 0);
    patina_settings settings = {.struct_size = sizeof settings};
    patina_cloud_style unlit = {.struct_size = sizeof unlit, .lighting = PATINA_LIGHTING_UNLIT};
    assert_true(blend_of(scene) > 0); // lit
    assert_int_equal(patina_scene_clear(scene), PATINA_OK);
    assert_int_equal(patina_scene_add_cloud(scene, cloud, &unlit), PATINA_OK);
    assert_true(blend_of(scene) > 0); // the normal pass
    settings.passes = 1u << PATINA_PASS_COMBINED;
    assert_int_equal(patina_scene_set_settings(scene, &settings), PATINA_OK);
    assert_int_equal(blend_of(scene), 0);
    patina_scene_destroy(scene);
    patina_cloud_destroy(cloud);
}

static void test_nothing_in_view_is_said(void **state)
{
    (void)state;
    patina_cloud *cloud = square(1);
    patina_scene *behind = scene_above(cloud, 2.5, -1, 1), *empty = scene_above(NULL, 2.5, 1, 0);
    struct pt_plan plan = plan_of(behind); // from below every chunk faces away
    assert_string_equal(skipped(&plan, "scatter"), "no cloud is in view");
    assert_true(plan.chunks_culled == plan.chunks && plan.chunks > 0);
    assert_int_equal(passes_of(&plan, PT_KERNEL_compose), 1); // the background is a picture too
    pt_plan_destroy(&plan);
    plan = plan_of(empty);
    assert_string_equal(skipped(&plan, "scatter"), "the scene has no cloud");
    pt_plan_destroy(&plan);
    patina_scene_destroy(behind);
    patina_scene_destroy(empty);
    patina_cloud_destroy(cloud);
}

// As many passes as layers, none where everything is opaque, back faces kept.
static void test_layers(void **state)
{
    (void)state;
    static const struct {
        float transparency;
        uint32_t asked, passes, layers;
    } cases[] = {{0.0f, 0, 0, 1},
                 {0.0f, 5, 0, 1},
                 {0.5f, 0, 0, 8},
                 {0.5f, 1, 0, 1},
                 {0.5f, 3, 0, 3},
                 {0.0f, 0, 1u << PATINA_PASS_DEPTH, 8},
                 {0.0f, 2, 1u << PATINA_PASS_COMBINED, 2}};
    patina_cloud *cloud = square(1);
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        patina_scene *scene = scene_above(cloud, 2.5, 1, 0);
        patina_cloud_style style = {.struct_size = sizeof style, .transparency = cases[i].transparency};
        patina_settings settings = {.struct_size = sizeof settings, .layers = cases[i].asked, .layer_passes = cases[i].passes};
        assert_int_equal(patina_scene_clear(scene), PATINA_OK);
        assert_int_equal(patina_scene_add_cloud(scene, cloud, &style), PATINA_OK);
        assert_int_equal(patina_scene_set_settings(scene, &settings), PATINA_OK);
        struct pt_plan plan = plan_of(scene);
        assert_int_equal(plan.layers, cases[i].layers);
        assert_int_equal(passes_of(&plan, PT_KERNEL_scatter), cases[i].layers);
        assert_int_equal(passes_of(&plan, PT_KERNEL_peel), cases[i].layers > 1 ? cases[i].layers : 0);
        assert_true((skipped(&plan, "peel") != NULL) == (cases[i].layers == 1));
        if (cases[i].layers == 1)
            assert_non_null(strstr(skipped(&plan, "peel"), cases[i].transparency > 0.0f ? "settings" : "opaque"));
        for (uint32_t k = 0; k < plan.pass_count; k++)
            assert_true(plan.passes[k].layer <= plan.layers &&
                        (!k || plan.passes[k].layer >= plan.passes[k - 1].layer || plan.passes[k].layer == 0));
        pt_plan_destroy(&plan);
        patina_scene_destroy(scene);
    }
    patina_scene *behind = scene_above(cloud, 2.5, -1, 1);
    patina_cloud_style glass = {.struct_size = sizeof glass, .cull_back = 1, .transparency = 0.5f};
    assert_int_equal(patina_scene_clear(behind), PATINA_OK);
    assert_int_equal(patina_scene_add_cloud(behind, cloud, &glass), PATINA_OK);
    struct pt_plan plan = plan_of(behind);
    assert_true(plan.points_scattered == COUNT);
    for (uint32_t c = 0; c < plan.instances[0].chunk_count; c++)
        assert_false(plan.instances[0].chunks[c].cull);
    pt_plan_destroy(&plan);
    glass.transparency = 1.0f;
    assert_int_equal(patina_scene_clear(behind), PATINA_OK);
    assert_int_equal(patina_scene_add_cloud(behind, cloud, &glass), PATINA_OK);
    plan = plan_of(behind);
    assert_non_null(skipped(&plan, "scatter"));
    pt_plan_destroy(&plan);
    patina_scene_destroy(behind);
    patina_cloud_destroy(cloud);
}

static void test_no_camera_is_an_error(void **state)
{
    (void)state;
    patina_scene *scene = NULL;
    struct pt_plan plan;
    char message[256];
    assert_int_equal(patina_scene_create(&scene), PATINA_OK);
    assert_int_equal(pt_plan_create(scene, NULL, &plan), PATINA_ERROR_ARGUMENT);
    assert_true(patina_message(scene, message, sizeof message) > 0);
    assert_non_null(strstr(message, "camera"));
    patina_scene_destroy(scene);
}

static void test_lines_are_planned_where_asked_for(void **state)
{
    (void)state;
    patina_cloud *cloud = square(1);
    patina_scene *scene = scene_above(cloud, 2.5, 1, 0);
    patina_lines lines = {.struct_size = sizeof lines, .width = 3};
    struct pt_plan without = plan_of(scene);
    assert_non_null(skipped(&without, "lines"));
    assert_int_equal(patina_scene_set_lines(scene, &lines), PATINA_OK);
    struct pt_plan plan = plan_of(scene);
    assert_int_equal(passes_of(&plan, PT_KERNEL_lines), 1);
    assert_int_equal(passes_of(&plan, PT_KERNEL_ink), 1);
    assert_true(plan.line_radius == 3.0f && plan.guard >= without.guard);
    assert_int_equal(plan.passes[plan.pass_count - 1].kernel, PT_KERNEL_ink); // behind what runs as one
    uint32_t together = 0;
    for (uint32_t i = 0; i < plan.pass_count; i++)
        together = plan.passes[i].together ? i + plan.passes[i].together : together;
    assert_int_equal(together, plan.pass_count - 1);
    pt_plan_destroy(&plan);
    pt_plan_destroy(&without);
    lines.world = 1; // orthographic: as wide everywhere
    lines.width = 0.025f;
    assert_int_equal(patina_scene_set_lines(scene, &lines), PATINA_OK);
    plan = plan_of(scene);
    assert_true(fabsf(plan.line_radius - 0.025f * 1024 / 2.5f) < 1e-3f);
    pt_plan_destroy(&plan);
    patina_scene_destroy(scene);
    patina_cloud_destroy(cloud);
}

// Cues that look around in keys run with shading as one; depth of field behind them, in the colours that these leave.
static void test_cues_run_as_one(void **state)
{
    (void)state;
    patina_cloud *cloud = square(1);
    patina_scene *scene = scene_above(cloud, 2.5, 1, 0);
    patina_effects effects = {.struct_size = sizeof effects, .edl_strength = 1, .obscurance_strength = 1};
    for (int focused = 0; focused < 2; focused++) {
        effects.focus_distance = 2.0f;
        effects.focus_aperture = focused ? 0.1f : 0.0f;
        assert_int_equal(patina_scene_set_effects(scene, &effects), PATINA_OK);
        struct pt_plan plan = plan_of(scene);
        uint32_t first = 0;
        while (first < plan.pass_count - 1 && !plan.passes[first].together)
            first++;
        const struct pt_pass *pass = &plan.passes[first];
        assert_int_equal(pass->kernel, PT_KERNEL_shade);
        assert_int_equal(first + pass->together, plan.pass_count - (uint32_t)focused);
        assert_int_equal(pass->leaves, focused ? 1 + PT_PLANE_COLOR_B : 0);
        if (focused)
            assert_int_equal(plan.passes[plan.pass_count - 1].kernel, PT_KERNEL_focus);
        pt_plan_destroy(&plan);
    }
    patina_scene_destroy(scene);
    patina_cloud_destroy(cloud);
}

// What a pass may bind, kernels.def says: anything else fails the plan.
static void test_passes_bind_what_their_kernels_list(void **state)
{
    (void)state;
    const struct fill_args fill = {.view = {.level = 2}};
    const struct pt_ref keys = pt_plane_at(PT_PLANE_KEYS, 2), from = pt_plane_at(PT_PLANE_FROM, 2);
    const struct pt_ref normal = pt_plane_at(PT_PLANE_NORMAL, 0), deff = pt_plane_at(PT_PLANE_DEFF, 0);
    const struct {
        uint32_t count;
        struct pt_ref refs[6];
        int right;
    } fills[] = {
        {5, {keys, from, normal, deff, deff}, 1},
        {5, {keys, from, normal, deff, pt_plane_at(PT_PLANE_SPAN, 0)}, 1},
        {4, {keys, from, normal, deff}, 0},
        {6, {keys, from, normal, deff, deff, deff}, 0},
        {5, {keys, normal, from, deff, deff}, 0}, // formats
        {5, {keys, from, normal, deff, pt_buffer_of(PT_SHADOWS, 0)}, 0},
        {5, {pt_plane_at(PT_PLANE_KEYS, 1), from, normal, deff, deff}, 0},  // another level than the view's
        {5, {keys, from, normal, deff, pt_plane_at(PT_PLANE_DEPTH, 0)}, 0}, // of the crop
        {5, {keys, from, normal, deff, pt_nothing()}, 0},                   // needed
        {5, {keys, keys, normal, deff, deff}, 0},
    };
    for (size_t i = 0; i < sizeof fills / sizeof *fills; i++)
        assert_int_equal(pt_check_bindings(PT_KERNEL_fill, &fill, fills[i].refs, fills[i].count) == PATINA_OK, fills[i].right);

    const struct scatter_args scatter = {.instances = 2};
    const struct pt_ref chunks = pt_buffer_of(PT_CHUNKS, 0), places = pt_buffer_of(PT_POSITIONS, 0),
                        words = pt_buffer_of(PT_SURFELS, 0);
    const struct pt_ref two[] = {
        pt_plane_at(PT_PLANE_KEYS, 0), pt_nothing(), pt_nothing(), chunks, places, words, chunks, places, words};
    const struct pt_ref mixed[] = {pt_plane_at(PT_PLANE_KEYS, 0), pt_nothing(), pt_nothing(), chunks, words, places};
    assert_int_equal(pt_check_bindings(PT_KERNEL_scatter, &scatter, two, 9), PATINA_OK);
    assert_int_equal(pt_check_bindings(PT_KERNEL_scatter, &scatter, two, 8), PATINA_ERROR_INTERNAL); // half an instance
    assert_int_equal(pt_check_bindings(PT_KERNEL_scatter, &scatter, mixed, 6), PATINA_ERROR_INTERNAL);

    // what is written has no other name in the pass: nothing stands in for it
    const struct resolve_args resolve = {.with_span = 0};
    struct pt_ref refs[] = {pt_plane_at(PT_PLANE_KEYS, 0), words,        normal, deff,
                            pt_plane_at(PT_PLANE_FROM, 0), pt_nothing(), deff};
    assert_int_equal(pt_check_bindings(PT_KERNEL_resolve, &resolve, refs, 7), PATINA_ERROR_INTERNAL);
    refs[6] = pt_nothing();
    assert_int_equal(pt_check_bindings(PT_KERNEL_resolve, &resolve, refs, 7), PATINA_OK);

    struct pt_plan plan = {0};
    struct pt_builder builder = {.plan = &plan};
    pt_add(&builder, PT_KERNEL_resolve, "resolve", &resolve, sizeof resolve, refs, 6);
    assert_int_equal(builder.failed, PATINA_ERROR_INTERNAL);
    pt_plan_destroy(&plan);
}

// What of the kind the plan has: passes that find it, that bind what its row says of an instance, and that tell what it shows.
static void check_kind(const struct pt_plan *plan, enum pt_kind kind, int drawn)
{
    const struct pt_kind_row *row = &pt_kinds[kind];
    const enum pt_kernel binds = row->sees == PT_KERNEL_coarsen ? PT_KERNEL_scatter : row->sees;
    const uint32_t of = row->source == PT_SOURCE_MESH ? PT_OF_MESH : PT_OF_INSTANCE;
    uint32_t bound = 0, of_kind = 0;
    assert_true(row->reach && row->pixels >= 0.0);
    for (uint32_t i = 0; i < plan->instance_count; i++)
        of_kind += (uint32_t)pt_draws(&plan->instances[i], kind);
    if (kind != PT_AS_SOFT && kind != PT_AS_MESH)
        assert_int_equal(of_kind > 0, drawn);
    if (!drawn) {
        assert_true(kind == PT_AS_POINTS || !passes_of(plan, row->sees)); // range images are scattered, too
        return;
    }
    assert_true(passes_of(plan, row->sees) && passes_of(plan, row->shows));
    for (uint32_t i = 0; i < plan->pass_count; i++)
        for (uint32_t k = 0; plan->passes[i].kernel == binds && k < plan->passes[i].ref_count; k++)
            for (uint32_t b = 0; b < row->buffer_count; b++)
                bound |= (uint32_t)(plan->passes[i].refs[k].of == of && plan->passes[i].refs[k].which == row->buffers[b]) << b;
    assert_int_equal(bound, (1u << row->buffer_count) - 1);
}

// Points, range images, soft points and a mesh beside each other, then discs; a scene's clouds keep their numbers, whenever meshes come.
static void test_every_kind_has_its_passes(void **state)
{
    (void)state;
    static const float corners[3][3] = {{-1, -1, 0.5f}, {1, -1, 0.5f}, {0, 1, 0.5f}};
    static const uint32_t indices[3] = {0, 1, 2};
    const patina_mesh_desc desc = {
        .struct_size = sizeof desc,
        .vertex_count = 3,
        .triangle_count = 1,
        .position = {corners, PATINA_FLOAT32, 3, 0},
        .indices = indices,
    };
    patina_mesh *mesh = NULL;
    patina_cloud *cloud = square(1);
    assert_int_equal(patina_mesh_create(&desc, &mesh), PATINA_OK);
    const patina_cloud_style styles[] = {
        {.struct_size = sizeof *styles},
        {.struct_size = sizeof *styles, .surface = PATINA_SURFACE_RANGES},
        {.struct_size = sizeof *styles, .soft = PATINA_SOFT_ALL, .soft_radius = 0.1f},
    };
    for (int splats = 0; splats < 2; splats++) {
        const patina_settings settings = {.struct_size = sizeof settings,
                                          .width = 64,
                                          .height = 64,
                                          .surface = splats ? PATINA_SURFACE_SPLATS : PATINA_SURFACE_FILL};
        patina_scene *scene = scene_above(cloud, 2.5, 1, 0);
        assert_int_equal(patina_scene_add_mesh(scene, mesh, NULL), PATINA_OK);
        for (uint32_t i = 1; i < 3 && !splats; i++) {
            assert_int_equal(patina_scene_add_cloud(scene, cloud, &styles[i]), PATINA_OK);
            assert_int_equal(scene->instances[i].style.soft, styles[i].soft);
        }
        assert_int_equal(patina_scene_add_mesh(scene, mesh, NULL), PATINA_OK);
        for (uint32_t i = 0; i < scene->cloud_count + scene->mesh_count; i++)
            assert_int_equal(scene->instances[i].source, i < scene->cloud_count ? PT_SOURCE_CLOUD : PT_SOURCE_MESH);
        assert_int_equal(pt_mesh_at(scene, 1)->id_base, 1); // triangles before it
        assert_int_equal(patina_scene_set_settings(scene, &settings), PATINA_OK);
        struct pt_plan plan = plan_of(scene);
        for (int kind = 0; kind < PT_AS_COUNT; kind++)
            check_kind(&plan, (enum pt_kind)kind, kind == PT_AS_MESH || (kind == PT_AS_DISCS) == splats);
        pt_plan_destroy(&plan);
        patina_scene_destroy(scene);
    }
    patina_mesh_destroy(mesh);
    patina_cloud_destroy(cloud);
}

// What passes share is written once: light where some cloud is lit, of ramps those that differ. What an instance has of its own is in
// its arguments, and these are small; what is known late too.
static void test_light_and_ramps_are_shared(void **state)
{
    (void)state;
    static const float red[] = {0, 0, 0, 1, 0, 0}, green[] = {0, 0, 0, 0, 1, 0, 1, 1, 1};
    const patina_light_desc lights[] = {
        {.struct_size = sizeof *lights, .type = PATINA_LIGHT_POINT, .power = 3, .position = {0, 0, 4}},
        {.struct_size = sizeof *lights, .type = PATINA_LIGHT_SUN, .power = 3, .direction = {0, 0, -1}, .shadows = 1}};
    patina_cloud_style style = {.struct_size = sizeof style, .color_source = PATINA_COLOR_HEIGHT};
    patina_cloud *cloud = square(1);
    patina_scene *scene = scene_above(NULL, 2.5, 1, 0);
    for (int i = 0; i < 4; i++) { // the third is lit and receives shadows, the fourth is lit alone
        style.ramp = i == 1 ? green : red;
        style.ramp_count = i == 1 ? 3 : 2;
        style.lighting = i < 2 ? PATINA_LIGHTING_UNLIT : PATINA_LIGHTING_LIT;
        style.shadow_off = i < 3 ? 0 : PATINA_SHADOW_NO_RECEIVE;
        assert_int_equal(patina_scene_add_cloud(scene, cloud, &style), PATINA_OK);
        struct pt_plan plan = plan_of(scene);
        assert_true((plan.light != NULL) == (i >= 2));
        assert_int_equal(plan.ramp_entries, i == 0 ? 2 : 5);
        pt_plan_destroy(&plan);
    }
    for (int i = 0; i < 2; i++)
        assert_int_equal(patina_scene_add_light(scene, &lights[i]), PATINA_OK);
    struct pt_plan plan = plan_of(scene);
    assert_true(plan.light->each[0].type == PATINA_LIGHT_POINT && !plan.light->each[0].shadow);
    assert_true(plan.light->each[1].type == PATINA_LIGHT_SUN && plan.light->each[1].shadow == 1);
    uint32_t shades = 0;
    for (uint32_t i = 0; i < plan.pass_count; i++) {
        const struct pt_pass *pass = &plan.passes[i];
        struct shade_args args;
        if (pass->kernel != PT_KERNEL_shade)
            continue;
        assert_true(pass->argument_size == sizeof args && sizeof args < 1024);
        memcpy(&args, pass->arguments, sizeof args);
        const uint32_t instance = plan.instances[shades++].of, lit = instance > 1;
        assert_true(pass->refs[PT_BUF_shade_lights].of == (lit ? PT_OF_PLAN : PT_OF_NOTHING));
        assert_true(pass->refs[PT_BUF_shade_ramps].of == PT_OF_PLAN);
        assert_int_equal(args.light_count, 2 * lit);
        assert_int_equal(args.light_types, lit ? 1u << PATINA_LIGHT_POINT | 1u << PATINA_LIGHT_SUN : 0);
        assert_int_equal(args.casting, instance == 2);
        assert_int_equal(args.recolor.first, instance == 1 ? 2 : 0);
        assert_true((pass->late == PT_LATE_POINTS) == (instance == 2));
        pt_plan_late(pass, &(struct pt_words){.samples = {5}}, &args);
        assert_true(args.scales[0] == (instance == 2 ? 1.0f / (255.0f * 5.0f) : 0.0f));
    }
    assert_int_equal(shades, 4);
    pt_plan_destroy(&plan);
    patina_scene_destroy(scene);
    patina_cloud_destroy(cloud);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_light_and_ramps_are_shared),
        cmocka_unit_test(test_every_kind_has_its_passes),
        cmocka_unit_test(test_lines_are_planned_where_asked_for),
        cmocka_unit_test(test_every_pass_runs_or_has_a_reason),
        cmocka_unit_test(test_missing_normals_are_estimated),
        cmocka_unit_test(test_settings_leave_passes_out),
        cmocka_unit_test(test_steps_hold_the_whole_plan),
        cmocka_unit_test(test_maps_are_plans),
        cmocka_unit_test(test_planes_of_the_picture),
        cmocka_unit_test(test_ink_stays_within_lines),
        cmocka_unit_test(test_planes_share_memory),
        cmocka_unit_test(test_bins_of_discs),
        cmocka_unit_test(test_nothing_in_view_is_said),
        cmocka_unit_test(test_no_camera_is_an_error),
        cmocka_unit_test(test_normals_are_blended_where_they_show),
        cmocka_unit_test(test_layers),
        cmocka_unit_test(test_cues_run_as_one),
        cmocka_unit_test(test_passes_bind_what_their_kernels_list),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
