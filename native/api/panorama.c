// SPDX-License-Identifier: GPL-3.0-or-later
// Equirectangular pictures, joined from the six sides of a cube around the eye. Sides overlap by a guard band, in which
// colours go over from one to the other: what image space decides differently in two views leaves no seam.
#include "base/descriptor.h"
#include "base/error.h"
#include "base/pool.h"
#include "base/elementary.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define PI 3.14159265358979323846
#define GUARD (1.0 / 32) // half the width of a band, in halves of a face

// Right, up and back of each face in the camera's space: ahead, right, behind, left, above, below.
static const double AXES[6][3][3] = {
    {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}},  {{0, 0, 1}, {0, 1, 0}, {-1, 0, 0}}, {{-1, 0, 0}, {0, 1, 0}, {0, 0, -1}},
    {{0, 0, -1}, {0, 1, 0}, {1, 0, 0}}, {{1, 0, 0}, {0, 0, 1}, {0, -1, 0}}, {{1, 0, 0}, {0, 0, -1}, {0, 1, 0}},
};

struct wave { // of one of the two angles
    double sine, cosine;
};

struct join {
    uint32_t x0, y0, width, height; // of the region
    uint32_t side;                  // pixels of a face
    uint32_t pass, channels;
    const float *const *faces;
    const uint64_t *const *key_faces; // or NULL
    struct wave *across, *up;         // of quarter points: two for each column, two for each row; then of the middles
    float *pixels;
    uint64_t *keys;
};

// The angles of a region: [low, high] from the first border of the whole picture to the last.
static void angles(struct wave *out, const double range[2], uint32_t whole, uint32_t first, uint32_t count)
{
    const double step = (range[1] - range[0]) / whole;
    for (uint32_t i = 0; i < 3 * count; i++) {
        const double place = i < 2 * count ? first + 0.25 + 0.5 * i : first + 0.5 + (i - 2 * count);
        out[i].sine = pt_sin(range[0] + step * place);
        out[i].cosine = pt_cos(range[0] + step * place);
    }
}

// Where a direction falls on a face, in [-1, 1] without the guard; 0 when it is behind it.
static int on_face(uint32_t face, const double direction[3], double place[2])
{
    const double(*axes)[3] = AXES[face];
    double p[3];
    for (int i = 0; i < 3; i++)
        p[i] = axes[i][0] * direction[0] + axes[i][1] * direction[1] + axes[i][2] * direction[2];
    if (p[2] >= 0)
        return 0;
    place[0] = p[0] / -p[2];
    place[1] = p[1] / -p[2];
    return fabs(place[0]) < 1 + GUARD && fabs(place[1]) < 1 + GUARD;
}

// The share of a face in what is seen there: from 1 within it to 0 at the end of its guard band.
static double share(const double place[2])
{
    double product = 1;
    for (int i = 0; i < 2; i++)
        product *= fmin(fmax((1 + GUARD - fabs(place[i])) / (2 * GUARD), 0), 1);
    return product;
}

static double texel(const struct join *join, double place) { return (place / (1 + GUARD) * 0.5 + 0.5) * join->side; }

// Adds a face's colour between four pixels.
static void add_color(const struct join *join, uint32_t face, const double place[2], double weight, double sum[4])
{
    const double last = join->side - 1;
    double low[2], part[2];
    size_t at[2][2];
    for (int i = 0; i < 2; i++) {
        const double t = fmin(fmax(texel(join, place[i]) - 0.5, 0), last);
        low[i] = floor(t);
        part[i] = t - low[i];
        at[i][0] = (size_t)low[i];
        at[i][1] = (size_t)fmin(low[i] + 1, last);
    }
    for (int corner = 0; corner < 4; corner++) {
        const int right = corner & 1, upper = corner >> 1;
        const double w = weight * (right ? part[0] : 1 - part[0]) * (upper ? part[1] : 1 - part[1]);
        const float *pixel = join->faces[face] + 4 * (at[1][upper] * join->side + at[0][right]);
        for (int i = 0; i < 4; i++)
            sum[i] += w * (double)pixel[i];
    }
}

static void to_direction(const struct wave *across, const struct wave *up, double direction[3])
{
    direction[0] = up->cosine * across->sine;
    direction[1] = up->sine;
    direction[2] = -up->cosine * across->cosine;
}

// The mean of four points of the pixel; each is mixed from the faces that show it.
static void color(const struct join *join, uint32_t x, uint32_t y, float *out)
{
    double sum[4] = {0};
    for (uint32_t point = 0; point < 4; point++) {
        double direction[3], place[2], shares[6], total = 0;
        to_direction(&join->across[2 * x + (point & 1)], &join->up[2 * y + (point >> 1)], direction);
        for (uint32_t face = 0; face < 6; face++)
            total += shares[face] = on_face(face, direction, place) ? share(place) : 0;
        for (uint32_t face = 0; face < 6; face++)
            if (shares[face] > 0 && on_face(face, direction, place))
                add_color(join, face, place, 0.25 * shares[face] / total, sum);
    }
    for (int i = 0; i < 4; i++)
        out[i] = (float)sum[i];
}

// The pixel of the face that shows most of it, which is never mixed. far: its distance for one unit of z.
static size_t nearest(const struct join *join, uint32_t x, uint32_t y, uint32_t *face, double *far)
{
    double direction[3], best = -1, found[2] = {0};
    to_direction(&join->across[2 * join->width + x], &join->up[2 * join->height + y], direction);
    for (uint32_t i = 0; i < 6; i++) {
        double place[2];
        if (on_face(i, direction, place) && share(place) > best) {
            best = share(place);
            *face = i;
            memcpy(found, place, sizeof found);
        }
    }
    size_t at[2];
    *far = 1;
    for (int i = 0; i < 2; i++) {
        at[i] = (size_t)fmin(fmax(texel(join, found[i]), 0), join->side - 1);
        const double middle = (2 * (at[i] + 0.5) / join->side - 1) * (1 + GUARD);
        *far += middle * middle;
    }
    *far = sqrt(*far);
    return at[1] * join->side + at[0];
}

static void rows(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    const struct join *join = context;
    (void)thread;
    for (uint32_t y = begin; y < end; y++) {
        for (uint32_t x = 0; x < join->width; x++) {
            const size_t to = (size_t)y * join->width + x;
            if (!join->key_faces && join->pass == PATINA_PASS_COMBINED) {
                color(join, x, y, join->pixels + 4 * to);
                continue;
            }
            uint32_t face = 0;
            double far = 1;
            const size_t from = nearest(join, x, y, &face, &far);
            if (join->key_faces) {
                join->keys[to] = join->key_faces[face][from];
                continue;
            }
            const uint32_t n = join->channels;
            memcpy(join->pixels + n * to, join->faces[face] + n * from, n * sizeof(float));
            if (join->pass == PATINA_PASS_DEPTH)
                join->pixels[to] = (float)(join->pixels[to] * far);
        }
    }
}

// The panorama with its defaults; the message when it is not one.
static int read_panorama(const patina_panorama *given, const char *call, patina_panorama *out)
{
    static const double whole[2][2] = {{-PI, PI}, {-PI / 2, PI / 2}};
    if (!given)
        return pt_fail(NULL, PATINA_ERROR_ARGUMENT, "%s: panorama is NULL", call);
    const int error = pt_take(NULL, call, given, out, sizeof *out);
    if (error)
        return error;
    if (!out->longitude[0] && !out->longitude[1])
        memcpy(out->longitude, whole[0], sizeof whole[0]);
    if (!out->latitude[0] && !out->latitude[1])
        memcpy(out->latitude, whole[1], sizeof whole[1]);
    uint32_t *r = out->region;
    if (!r[0] && !r[1] && !r[2] && !r[3]) {
        r[2] = out->width;
        r[3] = out->height;
    }
    if (!out->width || !out->height || out->width > 65536 || out->height > 65536)
        return pt_fail(NULL, PATINA_ERROR_ARGUMENT, "%s: %u x %u pixels, 1 to 65536 a side were expected", call, out->width,
                       out->height);
    if (r[0] >= r[2] || r[1] >= r[3] || r[2] > out->width || r[3] > out->height)
        return pt_fail(NULL, PATINA_ERROR_ARGUMENT, "%s: the region %u,%u to %u,%u does not lie within %u x %u pixels", call,
                       r[0], r[1], r[2], r[3], out->width, out->height);
    for (int i = 0; i < 2; i++) {
        const double *range = i ? out->latitude : out->longitude;
        if (!(range[0] < range[1] && range[0] >= whole[i][0] - 1e-5 && range[1] <= whole[i][1] + 1e-5))
            return pt_fail(NULL, PATINA_ERROR_ARGUMENT, "%s: %s from %g to %g", call, i ? "latitudes" : "longitudes", range[0],
                           range[1]);
    }
    return PATINA_OK;
}

// Pixels of a face's side: in its middle, where they are widest, as many to a radian as the picture has.
static uint32_t side_of(const patina_panorama *panorama)
{
    const double across = panorama->width / (panorama->longitude[1] - panorama->longitude[0]);
    const double up = panorama->height / (panorama->latitude[1] - panorama->latitude[0]);
    return (uint32_t)fmax(ceil(2 * (1 + GUARD) * fmax(across, up)), 8);
}

int patina_panorama_camera(const patina_panorama *panorama, uint32_t face, patina_camera *camera, uint32_t *size)
{
    patina_panorama p;
    const int code = read_panorama(panorama, "patina_panorama_camera", &p);
    if (code)
        return code;
    if (face >= 6 || !camera || !size)
        return pt_fail(NULL, PATINA_ERROR_ARGUMENT, "patina_panorama_camera: face %u of 6, or camera or size is NULL", face);
    patina_camera found;
    memset(&found, 0, sizeof found); // its padding too, which is copied
    found.left = found.bottom = -1 - GUARD;
    found.right = found.top = 1 + GUARD;
    found.near_clip = p.near_clip / (1.7320508 * (1 + GUARD)); // a corner is so much farther
    found.far_clip = p.far_clip;
    found.panorama_face = 1;
    for (int row = 0; row < 3; row++) {
        const double *from = p.world_from_camera + 4 * row;
        double *to = found.world_from_camera + 4 * row;
        for (int i = 0; i < 3; i++)
            to[i] = from[0] * AXES[face][i][0] + from[1] * AXES[face][i][1] + from[2] * AXES[face][i][2];
        to[3] = from[3];
    }
    found.world_from_camera[15] = 1;
    *size = side_of(&p);
    return pt_give(NULL, "patina_panorama_camera", &found, sizeof found, camera);
}

static int run(const patina_panorama *panorama, const char *call, struct join *join, uint32_t bytes, size_t size)
{
    patina_panorama p;
    const int code = read_panorama(panorama, call, &p);
    if (code)
        return code;
    join->x0 = p.region[0];
    join->y0 = p.region[1];
    join->width = p.region[2] - p.region[0];
    join->height = p.region[3] - p.region[1];
    join->side = side_of(&p);
    const size_t needed = (size_t)join->width * join->height * bytes;
    if (size != needed)
        return pt_fail(NULL, PATINA_ERROR_ARGUMENT, "%s: %zu bytes, %zu were expected", call, size, needed);
    join->across = malloc(3 * ((size_t)join->width + join->height) * sizeof *join->across);
    if (!join->across)
        return pt_fail(NULL, PATINA_ERROR_MEMORY, "%s: out of memory", call);
    join->up = join->across + 3 * (size_t)join->width;
    angles(join->across, p.longitude, p.width, join->x0, join->width);
    angles(join->up, p.latitude, p.height, join->y0, join->height);
    struct pt_pool *pool = pt_pool_create(0, 0); // NULL: this thread does it
    pt_parallel(pool, join->height, 0, rows, join);
    pt_pool_destroy(pool);
    free(join->across);
    return PATINA_OK;
}

int patina_panorama_join(const patina_panorama *panorama, uint32_t pass, const float *const faces[6], float *pixels,
                         size_t size)
{
    static const uint32_t channels[] = {
#define PATINA_X(name, count, text) count,
        PATINA_PASSES(PATINA_X)
#undef PATINA_X
    };
    struct join join = {.pass = pass, .faces = faces, .pixels = pixels};
    int missing = !faces || !pixels || pass >= PATINA_PASS_COUNT;
    for (int i = 0; i < 6 && !missing; i++)
        missing = !faces[i];
    if (missing)
        return pt_fail(NULL, PATINA_ERROR_ARGUMENT, "patina_panorama_join: a face or pixels is NULL, or pass %u", pass);
    join.channels = channels[pass];
    return run(panorama, "patina_panorama_join", &join, join.channels * (uint32_t)sizeof(float), size);
}

int patina_panorama_join_keys(const patina_panorama *panorama, const uint64_t *const faces[6], uint64_t *keys, size_t size)
{
    struct join join = {.key_faces = faces, .keys = keys};
    int missing = !faces || !keys;
    for (int i = 0; i < 6 && !missing; i++)
        missing = !faces[i];
    if (missing)
        return pt_fail(NULL, PATINA_ERROR_ARGUMENT, "patina_panorama_join_keys: a face or keys is NULL");
    return run(panorama, "patina_panorama_join_keys", &join, sizeof(uint64_t), size);
}
