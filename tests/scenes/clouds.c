// SPDX-License-Identifier: GPL-3.0-or-later
#include "clouds.h"

#include "support.h"

#include <math.h>
#include <stdlib.h>

struct pcg pcg_seed(uint64_t seed)
{
    struct pcg random = {.state = seed * 0x9E3779B97F4A7C15u + 0x853C49E6748FEA9Bu};
    pcg_u32(&random);
    pcg_u32(&random);
    return random;
}

// PCG-XSH-RR 64/32 (O'Neill).
uint32_t pcg_u32(struct pcg *random)
{
    uint64_t old = random->state;
    random->state = old * 6364136223846793005u + 1442695040888963407u;
    uint32_t word = (uint32_t)(((old >> 18) ^ old) >> 27);
    uint32_t turn = (uint32_t)(old >> 59);
    return (word >> turn) | (word << ((0u - turn) & 31u));
}

double pcg_unit(struct pcg *random)
{
    uint64_t high = pcg_u32(random) >> 5, low = pcg_u32(random) >> 6;
    return (double)(high << 26 | low) * 0x1p-53;
}

double pcg_between(struct pcg *random, double low, double high) { return low + (high - low) * pcg_unit(random); }

static void *reserve(uint64_t count, size_t size)
{
    void *memory = calloc(count ? count : 1, size);
    if (!memory)
        support_die("out of memory for %llu points", (unsigned long long)count);
    return memory;
}

struct points points_create(uint64_t count, unsigned columns)
{
    struct points points = {.count = count, .position = reserve(count, 3 * sizeof(float))};
    if (columns & POINTS_NORMALS)
        points.normal = reserve(count, 3 * sizeof(float));
    if (columns & POINTS_COLORS)
        points.color = reserve(count, 3);
    return points;
}

void points_free(struct points *points)
{
    free(points->position);
    free(points->normal);
    free(points->color);
    *points = (struct points){0};
}

// A colour that varies smoothly over the surface, so that smoothing and filling have something to get wrong.
static void put(struct points *points, uint64_t i, const double p[3], const double n[3])
{
    for (int k = 0; k < 3; k++) {
        points->position[3 * i + k] = (float)p[k];
        if (points->normal)
            points->normal[3 * i + k] = (float)n[k];
        if (points->color)
            points->color[3 * i + k] = (uint8_t)lrint(127.5 + 100.0 * sin(3.0 * p[k] + p[(k + 1) % 3] + k));
    }
}

struct points points_sphere(uint64_t count, double radius, unsigned columns, uint64_t seed)
{
    struct points points = points_create(count, columns);
    struct pcg random = pcg_seed(seed);
    for (uint64_t i = 0; i < count; i++) {
        double z = pcg_between(&random, -1.0, 1.0), turn = pcg_between(&random, 0.0, 2.0 * M_PI);
        double across = sqrt(1.0 - z * z);
        double n[3] = {across * cos(turn), across * sin(turn), z};
        double p[3] = {radius * n[0], radius * n[1], radius * n[2]};
        put(&points, i, p, n);
    }
    return points;
}

struct points points_torus(uint64_t count, double ring, double tube, unsigned columns, uint64_t seed)
{
    struct points points = points_create(count, columns);
    struct pcg random = pcg_seed(seed);
    for (uint64_t i = 0; i < count; i++) {
        double around, inside;
        do { // the outer half has more area: reject in proportion
            inside = pcg_between(&random, 0.0, 2.0 * M_PI);
        } while (pcg_unit(&random) * (ring + tube) > ring + tube * cos(inside));
        around = pcg_between(&random, 0.0, 2.0 * M_PI);
        double n[3] = {cos(inside) * cos(around), cos(inside) * sin(around), sin(inside)};
        double p[3] = {ring * cos(around) + tube * n[0], ring * sin(around) + tube * n[1], tube * n[2]};
        put(&points, i, p, n);
    }
    return points;
}

struct points points_disc(uint64_t count, double radius, unsigned columns, uint64_t seed)
{
    struct points points = points_create(count, columns);
    struct pcg random = pcg_seed(seed);
    for (uint64_t i = 0; i < count; i++) {
        double r = radius * sqrt(pcg_unit(&random)), turn = pcg_between(&random, 0.0, 2.0 * M_PI);
        put(&points, i, (double[3]){r * cos(turn), r * sin(turn), 0.0}, (double[3]){0.0, 0.0, 1.0});
    }
    return points;
}

struct points points_rectangle(uint64_t count, double width, double height, unsigned columns, uint64_t seed)
{
    struct points points = points_create(count, columns);
    struct pcg random = pcg_seed(seed);
    for (uint64_t i = 0; i < count; i++) {
        double x = pcg_between(&random, -0.5, 0.5) * width, y = pcg_between(&random, -0.5, 0.5) * height;
        put(&points, i, (double[3]){x, y, 0.0}, (double[3]){0.0, 0.0, 1.0});
    }
    return points;
}

struct points points_triangle(uint64_t count, const double corner[3][2], unsigned columns, uint64_t seed)
{
    struct points points = points_create(count, columns);
    struct pcg random = pcg_seed(seed);
    for (uint64_t i = 0; i < count; i++) {
        double a = pcg_unit(&random), b = pcg_unit(&random);
        if (a + b > 1.0) {
            a = 1.0 - a;
            b = 1.0 - b;
        }
        double p[3] = {0};
        for (int k = 0; k < 2; k++)
            p[k] = corner[0][k] + a * (corner[1][k] - corner[0][k]) + b * (corner[2][k] - corner[0][k]);
        put(&points, i, p, (double[3]){0.0, 0.0, 1.0});
    }
    return points;
}

struct points points_box(uint64_t count, const double half[3], unsigned columns, uint64_t seed)
{
    struct points points = points_create(count, columns);
    struct pcg random = pcg_seed(seed);
    double area[3] = {half[1] * half[2], half[2] * half[0], half[0] * half[1]};
    for (uint64_t i = 0; i < count; i++) {
        double pick = pcg_unit(&random) * (area[0] + area[1] + area[2]);
        int axis = pick < area[0] ? 0 : pick < area[0] + area[1] ? 1 : 2;
        double side = pcg_unit(&random) < 0.5 ? -1.0 : 1.0;
        double p[3], n[3] = {0};
        for (int k = 0; k < 3; k++)
            p[k] = pcg_between(&random, -1.0, 1.0) * half[k];
        p[axis] = side * half[axis];
        n[axis] = side;
        put(&points, i, p, n);
    }
    return points;
}

struct points points_grid(uint32_t columns_x, uint32_t rows_y, double pitch, unsigned columns)
{
    struct points points = points_create((uint64_t)columns_x * rows_y, columns);
    for (uint64_t i = 0; i < points.count; i++) {
        double x = ((double)(i % columns_x) + 0.5 - 0.5 * columns_x) * pitch;
        double y = ((double)(i / columns_x) + 0.5 - 0.5 * rows_y) * pitch;
        put(&points, i, (double[3]){x, y, 0.0}, (double[3]){0.0, 0.0, 1.0});
    }
    return points;
}

double area_sphere(double radius) { return 4.0 * M_PI * radius * radius; }

double area_torus(double ring, double tube) { return 4.0 * M_PI * M_PI * ring * tube; }

void points_transform(struct points *points, const double matrix[9], const double move[3])
{
    for (uint64_t i = 0; i < points->count; i++) {
        float *p = points->position + 3 * i, *n = points->normal ? points->normal + 3 * i : NULL;
        double q[3] = {p[0], p[1], p[2]}, m[3] = {n ? n[0] : 0.0, n ? n[1] : 0.0, n ? n[2] : 0.0};
        for (int k = 0; k < 3; k++) {
            const double *row = matrix + 3 * k;
            p[k] = (float)(row[0] * q[0] + row[1] * q[1] + row[2] * q[2] + move[k]);
            if (n)
                n[k] = (float)(row[0] * m[0] + row[1] * m[1] + row[2] * m[2]);
        }
    }
}

patina_cloud_desc points_desc(const struct points *points)
{
    patina_cloud_desc desc = {.struct_size = sizeof desc, .count = points->count};
    desc.position = (patina_array){.data = points->position, .type = PATINA_FLOAT32, .components = 3};
    if (points->normal)
        desc.normal = (patina_array){.data = points->normal, .type = PATINA_FLOAT32, .components = 3};
    if (points->color)
        desc.color = (patina_array){.data = points->color, .type = PATINA_UINT8, .components = 3};
    return desc;
}

patina_cloud *points_upload(const struct points *points)
{
    patina_cloud_desc desc = points_desc(points);
    patina_cloud *cloud = NULL;
    CHECK(patina_cloud_create(&desc, NULL, &cloud), NULL);
    return cloud;
}

patina_cloud *cloud_of_colors(uint64_t count, const void *position, const void *color, uint32_t type, uint32_t threads)
{
    patina_cloud *cloud = NULL;
    const patina_cloud_desc desc = {.struct_size = sizeof desc,
                                    .count = count,
                                    .threads = threads,
                                    .position = {position, PATINA_FLOAT64, 3, 0},
                                    .color = {color, type, 3, 0}};
    CHECK(patina_cloud_create(&desc, NULL, &cloud), NULL);
    return cloud;
}

double srgb_of_linear(double light) { return light <= 0.0031308 ? 12.92 * light : 1.055 * pow(light, 1 / 2.4) - 0.055; }
