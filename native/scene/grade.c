// SPDX-License-Identifier: GPL-3.0-or-later
// Grades: a cloud's own colours, changed scan by scan. Every scan has a table from light to its 8 bits, so that a picture may
// follow a slider: 32 ns a point of one core, a second for 30 million shared by all cores.
#include "mask.h"

#include "base/color.h"
#include "base/platform.h"
#include "base/elementary.h"
#include "scene/clouds/paged.h"
#include "scene/clouds/parts.h"
#include "scene/clouds/shape_word.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

// By the root of the light, since gamma and sRGB are steep where it is dark: a step is at most 0.2 of the 8 bits' with a gamma of 2.
enum { STEPS = 1 << 14, MOST_SCANS = 65535 };

static const float luma[3] = {0.2126f, 0.7152f, 0.0722f};

struct tone {
    int same; // as it was
    float factor[3], saturation, power;
    uint8_t *encode; // STEPS, of 8-bit colours; tones of one power share it
    int shares;      // another tone's
};

struct grading {
    const struct patina_cloud *cloud;
    const uint16_t *scans;
    struct tone *tones;
    uint32_t tone_count;
    float linear[256];                // of sRGB
    const struct patina_grade *grade; // of the cloud or of a part, as the cloud
};

// Warm: more red and less blue, at the luminance of white.
static void set_factors(const patina_scan_grade *grade, const float *balance, struct tone *tone)
{
    const float warm[3] = {(float)pt_exp2(0.5 * (double)grade->temperature), 1.0f,
                           (float)pt_exp2(-0.5 * (double)grade->temperature)};
    const float white = luma[0] * warm[0] + luma[1] * warm[1] + luma[2] * warm[2];
    for (int k = 0; k < 3; k++)
        tone->factor[k] = grade->gain * warm[k] / white * (balance ? balance[k] : 1.0f);
    tone->saturation = grade->saturation;
    tone->power = 1.0f / grade->gamma;
    tone->same = grade->gain == 1.0f && grade->gamma == 1.0f && grade->saturation == 1.0f && grade->temperature == 0.0f;
    for (int k = 0; k < 3 && balance; k++)
        tone->same &= balance[k] == 1.0f;
}

static void encode_steps(struct tone *tone)
{
    for (int i = 0; i < STEPS; i++) {
        const double root = (double)i / (STEPS - 1), light = pt_pow(root * root, (double)tone->power);
        tone->encode[i] = (uint8_t)(255.0 * pt_srgb_of_linear(light) + 0.5);
    }
}

// Gain, temperature and saturation, of light.
static void turn(const struct tone *tone, float c[3])
{
    for (int k = 0; k < 3; k++)
        c[k] *= tone->factor[k];
    const float grey = luma[0] * c[0] + luma[1] * c[1] + luma[2] * c[2];
    for (int k = 0; k < 3; k++) {
        c[k] = grey + tone->saturation * (c[k] - grey);
        c[k] = c[k] > 0.0f ? c[k] : 0.0f;
    }
}

static void grade_bytes(const struct grading *grading, const struct tone *tone, const uint8_t *from, uint8_t *to)
{
    float c[3] = {grading->linear[from[0]], grading->linear[from[1]], grading->linear[from[2]]};
    turn(tone, c);
    for (int k = 0; k < 3; k++)
        to[k] = tone->encode[(int)((c[k] < 1.0f ? sqrtf(c[k]) : 1.0f) * (STEPS - 1) + 0.5f)];
}

static void grade_floats(const struct tone *tone, const float *from, float *to)
{
    float c[3] = {from[0], from[1], from[2]};
    turn(tone, c);
    for (int k = 0; k < 3; k++)
        to[k] = fminf((float)pt_pow((double)c[k], (double)tone->power), 65504.0f);
}

static void grade_chunks(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    const struct grading *grading = context;
    const struct patina_cloud *cloud = grading->cloud;
    const size_t size = pt_color_size(cloud->color_format);
    const int black = grading->grade->keeps_black && cloud->info.uncolored && cloud->shapes;
    (void)thread;
    for (uint32_t c = begin; c < end; c++) {
        const struct pt_chunk *chunk = &cloud->chunks[c];
        for (size_t slot = chunk->first; slot < (size_t)chunk->first + chunk->padded; slot++) {
            const uint32_t scan = grading->scans ? grading->scans[pt_number_of(cloud, slot)] : 0;
            const struct tone *tone = scan < grading->tone_count && !grading->tones[scan].same ? &grading->tones[scan] : NULL;
            const char *from = (const char *)cloud->colors + slot * size;
            char *to = (char *)grading->grade->colors + slot * size;
            if (black && cloud->shapes[slot] & PT_SHAPE_UNCOLORED)
                memset(to, 0, size);
            else if (!tone)
                memcpy(to, from, size);
            else if (cloud->color_format == PT_COLOR_SRGB8)
                grade_bytes(grading, tone, (const uint8_t *)from, (uint8_t *)to);
            else
                grade_floats(tone, (const float *)(const void *)from, (float *)(void *)to);
        }
    }
}

static int check(const patina_cloud *cloud, const patina_scan_grade *grades, const float *balance, uint32_t count)
{
    if (!cloud || cloud->handle.magic != PT_MAGIC || !grades || !count || count > MOST_SCANS)
        return pt_fail(NULL, PATINA_ERROR_ARGUMENT, "patina_grade_create: a cloud that was destroyed, or not 1 to %d scans",
                       MOST_SCANS);
    if (!cloud->colors)
        return pt_fail(&cloud->handle, PATINA_ERROR_EMPTY, "patina_grade_create: the cloud has no colours");
    for (uint32_t i = 0; i < count; i++) {
        const patina_scan_grade *g = &grades[i];
        if (!(g->gain >= 0.0f && g->gain <= 65504.0f) || !(g->gamma >= 0.01f && g->gamma <= 100.0f) ||
            !(g->saturation >= 0.0f && g->saturation <= 100.0f) || !(fabsf(g->temperature) <= 16.0f))
            return pt_fail(
                &cloud->handle, PATINA_ERROR_ARGUMENT,
                "patina_grade_create: scan %u: gain 0 to 65504, gamma 0.01 to 100, saturation 0 to 100, temperature -16 to 16",
                i);
        for (uint32_t k = 3 * i; k < 3 * i + 3 && balance; k++)
            if (!(balance[k] >= 0.0f && balance[k] <= 65504.0f))
                return pt_fail(&cloud->handle, PATINA_ERROR_ARGUMENT,
                               "patina_grade_create_balanced: scan %u: balance 0 to 65504", i);
    }
    return PATINA_OK;
}

static int set_tones(struct grading *grading, const patina_scan_grade *grades, const float *balance)
{
    for (int i = 0; i < 256; i++)
        grading->linear[i] = (float)pt_linear_of_srgb(i / 255.0);
    grading->tones = calloc(grading->tone_count, sizeof *grading->tones);
    const struct tone *shared = NULL; // the last that has its own
    for (uint32_t i = 0; grading->tones && i < grading->tone_count; i++) {
        struct tone *tone = &grading->tones[i];
        set_factors(&grades[i], balance ? balance + 3 * (size_t)i : NULL, tone);
        if (tone->same || grading->cloud->color_format != PT_COLOR_SRGB8)
            continue;
        tone->encode = shared && tone->power == shared->power ? shared->encode : NULL;
        if ((tone->shares = tone->encode != NULL))
            continue;
        shared = tone;
        tone->encode = malloc(STEPS);
        if (!tone->encode)
            return 0;
        encode_steps(tone);
    }
    return grading->tones != NULL;
}

int patina_grade_create(const patina_cloud *cloud, const uint16_t *scans, const patina_scan_grade *grades, uint32_t count,
                        patina_grade **out)
{
    return patina_grade_create_balanced(cloud, scans, grades, NULL, count, 0, out);
}

// As those of a mask.
static int divide(struct patina_grade *grade, const patina_cloud *cloud)
{
    const size_t size = pt_color_size(cloud->color_format);
    grade->parts = calloc(cloud->part_count, sizeof *grade->parts);
    for (uint32_t i = 0; grade->parts && i < cloud->part_count; i++) {
        const struct patina_cloud *part = pt_part(cloud, i);
        grade->parts[i] = (struct patina_grade){.alive = pt_alive_create(),
                                                .size = part->slots * size,
                                                .colors = (char *)grade->colors + part->first_slot * size,
                                                .keeps_black = grade->keeps_black};
        grade->part_count += grade->parts[i].alive != NULL;
    }
    return grade->part_count == cloud->part_count;
}

static int make_grade(const patina_cloud *cloud, const uint16_t *scans, const patina_scan_grade *grades, const float *balance,
                      uint32_t count, int keeps_black, patina_grade **out)
{
    struct patina_grade *grade = calloc(1, sizeof *grade);
    struct pt_pool *pool = pt_pool_create(pt_pool_threads_for(0, cloud->slots), 0);
    struct grading grading = {.cloud = cloud, .scans = scans, .tone_count = count, .grade = grade};
    if (grade) {
        pt_handle_init(&grade->handle);
        grade->of = pt_alive_share(cloud);
        grade->alive = pt_alive_create();
        grade->keeps_black = keeps_black;
        grade->size = cloud->slots * pt_color_size(cloud->color_format);
        grade->colors = pt_pages_alloc(grade->size + 4); // kernels read words
    }
    const int good = grade && pool && grade->alive && grade->colors && (!cloud->part_count || divide(grade, cloud)) &&
                     set_tones(&grading, grades, balance);
    for (uint32_t i = 0; i < pt_part_count(cloud) && good; i++) {
        grading.grade = pt_grade_part(grade, i);
        grading.cloud = pt_part(cloud, i);
        pt_parallel(pool, grading.cloud->chunk_count, 4, grade_chunks, &grading);
    }
    if (good && cloud->part_count)
        pt_cloud_return(cloud); // a large file's colours and order were read
    if (!good)
        patina_grade_destroy(grade);
    for (uint32_t i = 0; grading.tones && i < count; i++)
        if (!grading.tones[i].shares)
            free(grading.tones[i].encode);
    free(grading.tones);
    pt_pool_destroy(pool);
    *out = good ? grade : NULL;
    return good ? PATINA_OK
                : pt_fail(NULL, PATINA_ERROR_MEMORY, "colours of %llu points: out of memory",
                          (unsigned long long)cloud->info.count);
}

int patina_grade_create_balanced(const patina_cloud *cloud, const uint16_t *scans, const patina_scan_grade *grades,
                                 const float *balance, uint32_t count, uint32_t keep_colors, patina_grade **out)
{
    if (!out)
        return pt_fail(NULL, PATINA_ERROR_ARGUMENT, "patina_grade_create: out is NULL");
    *out = NULL;
    if (keep_colors > 1)
        return pt_fail(NULL, PATINA_ERROR_ARGUMENT, "patina_grade_create_balanced: keep_colors %u is none of 0 and 1",
                       keep_colors);
    int error = check(cloud, grades, balance, count);
    if (error || (error = pt_whole_enter(cloud, "patina_grade_create")))
        return error;
    error = make_grade(cloud, scans, grades, balance, count, (int)keep_colors, out);
    pt_paged_leave(cloud);
    return error;
}

void patina_grade_destroy(patina_grade *grade)
{
    if (!grade)
        return;
    pt_pages_free(grade->colors, grade->size + 4);
    for (uint32_t i = 0; i < grade->part_count; i++)
        pt_alive_end(grade->parts[i].alive);
    free(grade->parts);
    pt_alive_end(grade->alive);
    pt_alive_release(grade->of);
    pt_handle_destroy(&grade->handle);
    free(grade);
}
