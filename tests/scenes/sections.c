// SPDX-License-Identifier: GPL-3.0-or-later
#include "sections.h"
#include "support.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define PI 3.14159265358979323846
#define STEP 0.0005 // of what is compared, meters

// ---- truth -------------------------------------------------------------------------------------------------------------------

void section_line(struct section *section, double ax, double ay, double bx, double by, double slope)
{
    section->piece[section->pieces++] = (struct section_piece){.a = {ax, ay}, .b = {bx, by}, .slope = slope};
}

void section_arc(struct section *section, double x, double y, double radius, double from, double to)
{
    section->piece[section->pieces++] = (struct section_piece){.center = {x, y}, .radius = radius, .from = from, .to = to};
}

void section_polygon(struct section *section, const double (*at)[2], uint32_t count)
{
    for (uint32_t i = 0; i < count; i++) {
        const double *a = at[i], *b = at[(i + 1) % count];
        section_line(section, a[0], a[1], b[0], b[1], 0.0);
        memcpy(section->corner[section->corners++], a, sizeof section->corner[0]);
    }
}

static double piece_length(const struct section_piece *p)
{
    return p->radius > 0.0 ? p->radius * (p->to - p->from) : hypot(p->b[0] - p->a[0], p->b[1] - p->a[1]);
}

double section_length(const struct section *section)
{
    double sum = 0.0;
    for (uint32_t i = 0; i < section->pieces; i++)
        sum += piece_length(&section->piece[i]);
    return sum;
}

// Place and normal (outwards, or to the left) at a share of the piece's length.
static void piece_at(const struct section_piece *p, double share, double place[2], double normal[2])
{
    if (p->radius > 0.0) {
        const double angle = p->from + share * (p->to - p->from);
        normal[0] = cos(angle);
        normal[1] = sin(angle);
        for (int k = 0; k < 2; k++)
            place[k] = p->center[k] + p->radius * normal[k];
        return;
    }
    const double x = p->b[0] - p->a[0], y = p->b[1] - p->a[1], length = hypot(x, y);
    normal[0] = -y / length;
    normal[1] = x / length;
    place[0] = p->a[0] + share * x;
    place[1] = p->a[1] + share * y;
}

// Signed distance of a place from a piece; its absolute value is the distance.
static double piece_distance(const struct section_piece *p, const double at[2])
{
    if (p->radius > 0.0) {
        const double x = at[0] - p->center[0], y = at[1] - p->center[1];
        double angle = atan2(y, x);
        while (angle < p->from)
            angle += 2.0 * PI;
        if (angle <= p->to)
            return hypot(x, y) - p->radius;
        double best = INFINITY;
        for (int end = 0; end < 2; end++) {
            const double e = end ? p->to : p->from;
            best = fmin(best, hypot(x - p->radius * cos(e), y - p->radius * sin(e)));
        }
        return best;
    }
    const double x = p->b[0] - p->a[0], y = p->b[1] - p->a[1], length = hypot(x, y);
    const double u = ((at[0] - p->a[0]) * x + (at[1] - p->a[1]) * y) / length, t = fmin(fmax(u, 0.0), length);
    const double v = ((at[1] - p->a[1]) * x - (at[0] - p->a[0]) * y) / length;
    return copysign(hypot(v, u - t), v);
}

static double truth_distance(const struct section *section, const double at[2])
{
    double best = INFINITY;
    for (uint32_t i = 0; i < section->pieces; i++) {
        const double d = piece_distance(&section->piece[i], at);
        best = fabs(d) < fabs(best) ? d : best;
    }
    return best;
}

// ---- scans -------------------------------------------------------------------------------------------------------------------

static double gaussian(struct pcg *random)
{
    const double u = 1.0 - pcg_unit(random), v = pcg_unit(random);
    return sqrt(-2.0 * log(u)) * cos(2.0 * PI * v);
}

patina_cloud *section_cloud(const struct section *section, const struct section_scan *scan)
{
    struct pcg random = pcg_seed(scan->seed);
    const double *right = scan->plane.right, *up = scan->plane.up;
    const double out[3] = {right[1] * up[2] - right[2] * up[1], right[2] * up[0] - right[0] * up[2],
                           right[0] * up[1] - right[1] * up[0]};
    const double area = section_length(section) * 2.0 * scan->height, all = area / (scan->spacing * scan->spacing);
    double(*world)[3] = malloc(((size_t)(3.0 * all) + 1000) * sizeof *world);
    uint64_t count = 0;
    for (uint32_t i = 0; i < section->pieces; i++) {
        const struct section_piece *p = &section->piece[i];
        const double steep = sqrt(1.0 + p->slope * p->slope), length = piece_length(p);
        const uint64_t columns = (uint64_t)(length / scan->spacing),
                       rows = (uint64_t)(2.0 * scan->height * steep / scan->spacing);
        for (uint64_t k = 0; k < columns * rows; k++) {
            double at[2], normal[2];
            const double a = scan->regular ? 0.5 : pcg_unit(&random), b = scan->regular ? 0.5 : pcg_unit(&random);
            const double share = scan->regular ? ((double)(k % columns) + a) / (double)columns : a;
            const double w = scan->height * (2.0 * (scan->regular ? ((double)(k / columns) + b) / (double)rows : b) - 1.0);
            piece_at(p, share, at, normal);
            double aside = scan->sigma * gaussian(&random);
            if (pcg_unit(&random) < scan->wrong)
                aside = pcg_between(&random, 0.02, 0.5) * (pcg_unit(&random) < 0.5 ? -1.0 : 1.0);
            const double v = w * p->slope + aside / steep, depth = w - aside * p->slope / steep;
            for (int c = 0; c < 3; c++)
                world[count][c] = scan->plane.origin[c] + (at[0] + v * normal[0]) * right[c] + (at[1] + v * normal[1]) * up[c] +
                                  depth * out[c];
            count++;
        }
    }
    const patina_cloud_desc desc = {
        .struct_size = sizeof desc, .count = count, .position = {.data = world, .type = PATINA_FLOAT64, .components = 3}};
    patina_cloud *cloud = NULL;
    CHECK(patina_cloud_create(&desc, NULL, &cloud), NULL);
    CHECK(patina_cloud_analyse(cloud, NULL, NULL), cloud);
    free(world);
    return cloud;
}

// ---- comparison --------------------------------------------------------------------------------------------------------------

struct drawn { // vertices of a line, the first again at the end if it is closed
    double (*at)[2];
    uint32_t count, layer;
};

static struct drawn *read_lines(const patina_drawing *drawing, uint32_t *count, struct section_error *error)
{
    patina_drawing_info info = {.struct_size = sizeof info};
    CHECK(patina_drawing_get_info(drawing, &info), drawing);
    struct drawn *lines = calloc(info.lines + 1, sizeof *lines);
    *count = info.lines;
    for (uint32_t i = 0; i < info.lines; i++) {
        patina_drawing_line about = {.struct_size = sizeof about};
        CHECK(patina_drawing_get_line(drawing, i, &about), drawing);
        lines[i].at = malloc((about.vertices + 1) * sizeof *lines[i].at);
        CHECK(patina_drawing_read_line(drawing, i, &lines[i].at[0][0], about.vertices * sizeof *lines[i].at), drawing);
        lines[i].count = about.vertices;
        lines[i].layer = about.layer;
        if (about.closed)
            memcpy(lines[i].at[lines[i].count++], lines[i].at[0], sizeof *lines[i].at);
        error->lines += about.layer == PATINA_DRAWING_CUT;
        error->closed += about.closed;
        error->bridged += about.layer == PATINA_DRAWING_CUT_BRIDGED;
    }
    error->length = info.layer_lengths[PATINA_DRAWING_CUT];
    error->bridged_length = info.layer_lengths[PATINA_DRAWING_CUT_BRIDGED];
    return lines;
}

static double distance_to(const struct drawn *lines, uint32_t count, const double at[2])
{
    double best = INFINITY;
    for (uint32_t i = 0; i < count; i++)
        for (uint32_t j = 0; j + 1 < lines[i].count && lines[i].layer == PATINA_DRAWING_CUT; j++) {
            struct section_piece step = {0};
            memcpy(step.a, lines[i].at[j], sizeof step.a);
            memcpy(step.b, lines[i].at[j + 1], sizeof step.b);
            if (memcmp(step.a, step.b, sizeof step.a))
                best = fmin(best, fabs(piece_distance(&step, at)));
        }
    return best;
}

static int compare_doubles(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static void measure_drawn(const struct section *section, const struct drawn *lines, uint32_t count, double within,
                          struct section_error *error)
{
    double *all = malloc(((size_t)(error->length / STEP) + 100000) * sizeof *all), sum = 0.0, square = 0.0;
    size_t taken = 0, near = 0;
    for (uint32_t i = 0; i < count; i++)
        for (uint32_t j = 0; j + 1 < lines[i].count && lines[i].layer == PATINA_DRAWING_CUT; j++) {
            const double *a = lines[i].at[j], *b = lines[i].at[j + 1], length = hypot(b[0] - a[0], b[1] - a[1]);
            const uint32_t steps = (uint32_t)(length / STEP) + 1;
            for (uint32_t k = 0; k < steps; k++) {
                const double t = (k + 0.5) / steps, at[2] = {a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])};
                const double d = truth_distance(section, at);
                all[taken++] = fabs(d);
                if (fabs(d) > within)
                    continue;
                near++;
                sum += d;
                square += d * d;
            }
        }
    qsort(all, taken, sizeof *all, compare_doubles);
    error->bias = near ? sum / (double)near : 0.0;
    error->rms = near ? sqrt(square / (double)near) : 0.0;
    error->p95 = taken ? all[taken * 95 / 100] : 0.0;
    error->farthest = taken ? all[taken - 1] : 0.0;
    error->wrong = taken ? 1.0 - (double)near / (double)taken : 0.0;
    free(all);
}

struct section_error section_compare(const struct section *section, const patina_drawing *drawing, double within)
{
    struct section_error error = {0};
    uint32_t count;
    struct drawn *lines = read_lines(drawing, &count, &error);
    measure_drawn(section, lines, count, within, &error);
    double missed = 0.0, whole = 0.0;
    for (uint32_t i = 0; i < section->pieces; i++) {
        const uint32_t steps = (uint32_t)(piece_length(&section->piece[i]) / (4.0 * STEP)) + 1;
        for (uint32_t k = 0; k < steps; k++) {
            double at[2], normal[2];
            piece_at(&section->piece[i], (k + 0.5) / steps, at, normal);
            const double d = distance_to(lines, count, at);
            error.missing = fmax(error.missing, d);
            missed += d > within;
            whole += 1.0;
        }
    }
    error.missed = whole > 0.0 ? missed / whole : 0.0;
    for (uint32_t i = 0; i < section->corners; i++) {
        double best = INFINITY;
        for (uint32_t k = 0; k < count; k++)
            for (uint32_t j = 0; j < lines[k].count; j++)
                best = fmin(best, hypot(lines[k].at[j][0] - section->corner[i][0], lines[k].at[j][1] - section->corner[i][1]));
        error.corner = fmax(error.corner, best);
    }
    for (uint32_t i = 0; i < count; i++)
        free(lines[i].at);
    free(lines);
    return error;
}
