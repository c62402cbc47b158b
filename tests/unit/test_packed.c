// SPDX-License-Identifier: GPL-3.0-or-later
// Packed positions, and files without an order (SPEC 13): what they may be off by, that all who read points on the host find floats at their
// places, what numbers points have, files of the versions before, and heads that lie.
#include "base/platform.h"
#include "scene/analysis/analysis.h"
#include "scene/clouds/fingerprint.h"
#include "scenes/clouds.h"
#include "scenes/packed.h"
#include "scenes/support.h"

#include "folder.h" // behind cmocka.h

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { POINTS = 60000, SECTION = 1 << 16 };
enum {
    VERSION_AT = 8,
    CHUNK_SIZE_AT = 12,
    CHUNKS_AT = 20,
    SUM_AT = 504,
    PAGES_AT = 512,
    ERROR_AT = 520,
    PACKED_AT = 528,
    UNORDERED_AT = 532,
    TAIL = 24 + 128 + 8 // bytes of the header behind its sum: of pages, packing and order, levels of trust, uncolored points
};

#ifdef _WIN32
static char folder[] = "patina-packed-XXXXXX";
#else
static char folder[] = "/tmp/patina-packed-XXXXXX";
#endif

static const char *at(const char *name)
{
    static char path[4][256];
    static int turn;
    turn = (turn + 1) % 4;
    snprintf(path[turn], sizeof path[turn], "%s/%s", folder, name);
    return path[turn];
}

static patina_cloud *open_cloud(const char *name)
{
    patina_cloud *cloud = NULL;
    CHECK(patina_cloud_open(at(name), &cloud), NULL);
    return cloud;
}

static patina_cloud *torus(void)
{
    struct points points = points_torus(POINTS, 2.0, 0.7, POINTS_ALL, 3);
    patina_cloud_desc desc = points_desc(&points);
    double *far = malloc(3 * POINTS * sizeof *far);
    patina_cloud *cloud = NULL;
    for (int i = 0; i < 3 * POINTS; i++)
        far[i] = (double)points.position[i] + 4.5e6;
    far[30] = NAN; // one of them is nowhere
    desc.position = (patina_array){far, PATINA_FLOAT64, 3, 0};
    CHECK(patina_cloud_create(&desc, NULL, &cloud), NULL);
    points_free(&points);
    free(far);
    return cloud;
}

// plain, packed and floats: the torus, packed, and floats where that has its points.
static int make_files(void **state)
{
    (void)state;
    if (make_folder_of(folder))
        return 1;
    patina_cloud *cloud = torus();
    CHECK(patina_cloud_save(cloud, at("plain")), cloud);
    patina_cloud_destroy(cloud);
    packed_write(at("plain"), at("packed"), at("floats"));
    return 0;
}

static int remove_files(void **state)
{
    static const char *const names[] = {"plain", "packed", "floats", "found", "wanted", "bad"};
    (void)state;
    for (size_t i = 0; i < sizeof names / sizeof *names; i++)
        remove(at(names[i]));
    return rmdir(folder);
}

// ---- words -----------------------------------------------------------------------------------------------------------------

static struct pt_chunk box_of(const float *positions, uint32_t padded)
{
    struct pt_chunk chunk = {.count = padded, .padded = padded};
    for (uint32_t k = 0; k < 3; k++) {
        chunk.box_min[k] = INFINITY;
        chunk.box_max[k] = -INFINITY;
        for (uint32_t i = 0; i < padded; i++) {
            chunk.box_min[k] = fminf(chunk.box_min[k], positions[k * padded + i]);
            chunk.box_max[k] = fmaxf(chunk.box_max[k], positions[k * padded + i]);
        }
    }
    return chunk;
}

// Off by half a step at most, within its box, and packed again the same.
static void check_chunk(const float *positions, uint32_t padded)
{
    struct pt_chunk chunk = box_of(positions, padded), again;
    const struct patina_cloud cloud = {.packed = 1};
    uint32_t words[2 * 64], twice[2 * 64];
    float floats[3 * 64], reach = 0.0f;
    for (uint32_t i = 0; i < 3 * padded; i++)
        reach = fmaxf(reach, fabsf(positions[i]));
    const double step = (double)pt_chunk_step(&chunk);
    int power;
    assert_true(frexp(step, &power) == 0.5 && step >= 0x1p-126);
    assert_true((double)reach <= step * (PT_PACKED_MIDDLE - 1)); // and no less would do
    assert_true(step <= 0x1p-126 || (double)reach > 0.5 * step * (PT_PACKED_MIDDLE - 1));
    const double moved = pt_chunk_pack(&chunk, positions, words);
    assert_true(moved <= sqrt(3.0) * 0.5 * step);
    struct patina_cloud of = cloud;
    of.positions = words;
    const float *now = pt_chunk_positions(&of, &chunk, floats);
    for (uint32_t i = 0; i < padded; i++) {
        float p[3];
        pt_point_offset(&of, &chunk, i, p);
        for (uint32_t k = 0; k < 3; k++) {
            const float x = now[k * padded + i];
            assert_true(fabs((double)x - (double)positions[k * padded + i]) <= 0.5 * step);
            assert_true(p[k] == x && chunk.box_min[k] <= x && x <= chunk.box_max[k]);
        }
    }
    again = chunk;
    assert_true((double)pt_chunk_step(&chunk) == step);
    assert_true(pt_chunk_pack(&again, now, twice) == 0.0);
    assert_memory_equal(words, twice, 8 * padded);
    assert_memory_equal(&again, &chunk, sizeof chunk);
}

static void test_words(void **state)
{
    (void)state;
    struct pcg random = pcg_seed(9);
    float p[3 * 64] = {0};
    check_chunk(p, 16); // all at the origin
    for (int turn = 0; turn < 4000; turn++) {
        const double size = exp2(pcg_between(&random, -140.0, 127.9));
        for (int i = 0; i < 3 * 64; i++)
            p[i] = (float)(size * pcg_between(&random, -1, 1) * (turn % 3 || i % 64 ? 1.0 : 1e-3));
        check_chunk(p, 64);
    }
    // where the step changes, and ties
    for (int power = -100; power < 100; power += 7)
        for (int off = -2; off <= 2; off++) {
            const double edge = ldexp((double)(PT_PACKED_MIDDLE - 1), power);
            memset(p, 0, sizeof p);
            p[0] = (float)(edge + off * ldexp(0.125, power));
            p[17] = -p[0];
            for (int i = 1; i < 16; i++)
                p[i] = (float)ldexp(i * 1001 + 0.5, power);
            check_chunk(p, 16);
        }
    // words hold 21 bits of each, and numbers that are none lie somewhere within
    for (int turn = 0; turn < 1000; turn++) {
        uint32_t words[2], q[3];
        const float step = 0.25f, given[3] = {NAN, INFINITY, -INFINITY};
        float point[3], out[3];
        for (int k = 0; k < 3; k++)
            point[k] = (float)((int32_t)(pcg_u32(&random) % (2u * PT_PACKED_MIDDLE - 1u)) - (PT_PACKED_MIDDLE - 1)) * step;
        pt_packed_words(point, step, words);
        pt_packed_point(words[0], words[1], step, out);
        assert_memory_equal(point, out, sizeof out);
        pt_packed_words(given, step, words);
        pt_packed_parts(words[0], words[1], q);
        assert_true(q[0] == 1 && q[1] == 2 * PT_PACKED_MIDDLE - 1 && q[2] == 1);
    }
}

// ---- files -----------------------------------------------------------------------------------------------------------------

static void test_file(void **state)
{
    (void)state;
    patina_cloud *plain = open_cloud("plain"), *packed = open_cloud("packed");
    patina_cloud_info info = {.struct_size = sizeof info};
    CHECK(patina_cloud_get_info(plain, &info), plain);
    assert_true(!info.packed && !info.numbered && info.packed_error == 0.0 && info.drawn == POINTS - 1);
    CHECK(patina_cloud_get_info(packed, &info), packed);
    assert_true(info.packed && !info.numbered && info.count == POINTS && packed->order);
    double most = 0.0, coarsest = 0.0;
    for (uint32_t c = 0; c < packed->chunk_count; c++) {
        const struct pt_chunk *chunk = &packed->chunks[c];
        coarsest = fmax(coarsest, (double)pt_chunk_step(chunk));
        for (uint32_t i = 0; i < chunk->count; i++) {
            double p[3], q[3], square = 0.0;
            pt_point_place(plain, &plain->chunks[c], i, p);
            pt_point_place(packed, chunk, i, q);
            for (int k = 0; k < 3; k++) {
                square += (q[k] - p[k]) * (q[k] - p[k]);
                assert_true(info.box_min[k] <= q[k] && q[k] <= info.box_max[k]);
            }
            most = fmax(most, sqrt(square));
            assert_int_equal(pt_number_of(packed, chunk->first + i), pt_number_of(plain, chunk->first + i));
        }
    }
    print_message("off by %.3g at most, told %.3g; the coarsest step is %.3g\n", most, info.packed_error, coarsest);
    assert_true(fabs(most - info.packed_error) < 2e-9 &&
                most < sqrt(0.75) * coarsest + 2e-9); // at 4.5e6 float64 has steps of 9e-10
    assert_true(pt_cloud_mapped_bytes(plain) - pt_cloud_mapped_bytes(packed) == 4 * plain->slots);
    CHECK(patina_cloud_verify(at("packed"), NULL), NULL);
    CHECK(patina_cloud_save(packed, at("found")), packed); // and it stays so
    assert_same_file(at("found"), at("packed"));
    patina_cloud_destroy(packed);
    patina_cloud_destroy(plain);
    const patina_save_desc odd = {.struct_size = sizeof odd, .pack = 2};
    packed = open_cloud("packed");
    assert_int_equal(patina_cloud_save_as(packed, at("bad"), &odd), PATINA_ERROR_ARGUMENT);
    assert_int_equal(patina_cloud_save_as(packed, NULL, NULL), PATINA_ERROR_ARGUMENT);
    assert_false(is_there(at("bad")));
    patina_cloud_destroy(packed);
}

static void test_order(void **state)
{
    (void)state;
    const patina_save_desc drop = {.struct_size = sizeof drop, .drop_order = 1}, pack = {.struct_size = sizeof pack, .pack = 1};
    patina_cloud *plain = open_cloud("plain");
    CHECK(patina_cloud_save_as(plain, at("found"), &drop), plain);
    CHECK(patina_cloud_verify(at("found"), NULL), NULL);
    patina_cloud *cloud = open_cloud("found");
    assert_true(cloud->info.numbered && !cloud->order && cloud->info.count == POINTS - 1 && cloud->info.drawn == POINTS - 1);
    assert_true(pt_cloud_mapped_bytes(plain) - pt_cloud_mapped_bytes(cloud) == 4 * plain->slots);
    float *positions = malloc(3 * POINTS * sizeof *positions);
    uint32_t next = 0;
    for (uint32_t c = 0; c < cloud->chunk_count; c++) {
        const struct pt_chunk *chunk = &cloud->chunks[c];
        for (uint32_t i = 0; i < chunk->padded; i++)
            assert_int_equal(pt_number_of(cloud, chunk->first + i), next + (i < chunk->count ? i : chunk->count - 1));
        for (uint32_t i = 0; i < chunk->count; i++)
            pt_point_offset(cloud, chunk, i, positions + 3 * (size_t)(next + i));
        next += chunk->count;
    }
    assert_int_equal(next, POINTS - 1);
    CHECK(patina_cloud_save(cloud, at("wanted")), cloud);
    assert_same_file(at("found"), at("wanted"));
    patina_cloud_destroy(cloud);
    patina_cloud_destroy(plain);
    // one that lies as it was given: its order says nothing, and goes
    const patina_cloud_desc desc = {.struct_size = sizeof desc, .count = 1, .position = {positions, PATINA_FLOAT32, 3, 0}};
    CHECK(patina_cloud_create(&desc, NULL, &cloud), NULL);
    CHECK(patina_cloud_save_as(cloud, at("found"), &pack), cloud);
    patina_cloud_destroy(cloud);
    cloud = open_cloud("found");
    assert_true(cloud->info.numbered && cloud->info.packed && pt_number_of(cloud, 0) == 0 && pt_number_of(cloud, 15) == 0);
    patina_cloud_destroy(cloud);
    const patina_cloud_desc nothing = {.struct_size = sizeof nothing};
    const patina_save_desc both = {.struct_size = sizeof both, .pack = 1, .drop_order = 1};
    CHECK(patina_cloud_create(&nothing, NULL, &cloud), NULL);
    CHECK(patina_cloud_save_as(cloud, at("found"), &both), cloud);
    patina_cloud_destroy(cloud);
    patina_cloud_destroy(open_cloud("found"));
    free(positions);
}

// ---- who reads points on the host ------------------------------------------------------------------------------------------

static void test_host(void **state)
{
    (void)state;
    patina_cloud *cloud[2] = {open_cloud("packed"), open_cloud("floats")};
    const double stations[6] = {4.5e6, 4.5e6, 4.5e6, 4.5e6 + 9, 4.5e6, 4.5e6};
    uint8_t *station = malloc(POINTS), *bits[2];
    for (uint32_t i = 0; i < POINTS; i++)
        station[i] = (uint8_t)(i % 2);
    const patina_analysis_desc desc = {.struct_size = sizeof desc,
                                       .station_count = 2,
                                       .stations = stations,
                                       .station = {station, PATINA_UINT8, 1, 0},
                                       .free_space = 1};
    struct pt_analysis found[2];
    double low[2][3], high[2][3];
    patina_field_info fields[2];
    for (int i = 0; i < 2; i++) {
        CHECK(pt_analysis_compute(cloud[i], &desc, NULL, NULL, &found[i]), NULL);
        CHECK(patina_cloud_dense_box(cloud[i], low[i], high[i]), cloud[i]);
        patina_field *field = NULL;
        const patina_field_desc by = {.struct_size = sizeof by, .source = PATINA_FIELD_DISTANCE, .range = {0, 1e7}};
        CHECK(patina_field_create(cloud[i], &by, NULL, &field), cloud[i]);
        fields[i] = (patina_field_info){.struct_size = sizeof fields[i]};
        CHECK(patina_field_get_info(field, &fields[i]), NULL);
        patina_field_destroy(field);
        patina_scene *scene = scene_of(cloud[i], NULL);
        const double eye[3] = {4.5e6 + 3, 4.5e6 - 4, 4.5e6 + 3}, target[3] = {4.5e6, 4.5e6, 4.5e6};
        const patina_camera camera = camera_perspective(eye, target, 45, 200, 150, 0.1, 100);
        CHECK(patina_scene_set_camera(scene, &camera), scene);
        const patina_settings settings = settings_default(200, 150);
        CHECK(patina_scene_set_settings(scene, &settings), scene);
        const double polygon[6] = {20, 20, 180, 40, 90, 130};
        const patina_pick pick = {.struct_size = sizeof pick, .polygon = polygon, .corners = 3};
        bits[i] = calloc((POINTS + 7) / 8, 1);
        CHECK(patina_scene_pick(scene, NULL, &pick, NULL, bits[i], (POINTS + 7) / 8), scene);
        patina_scene_destroy(scene);
    }
    assert_memory_equal(found[0].surfels, found[1].surfels, cloud[0]->slots * 4);
    assert_memory_equal(found[0].shapes, found[1].shapes, cloud[0]->slots * 4);
    assert_int_equal(found[0].sights.bytes, found[1].sights.bytes);
    assert_memory_equal(low[0], low[1], sizeof low[0]);
    assert_memory_equal(high[0], high[1], sizeof high[0]);
    assert_memory_equal(&fields[0], &fields[1], sizeof fields[0]);
    assert_memory_equal(bits[0], bits[1], (POINTS + 7) / 8);
    uint32_t picked = 0;
    for (uint32_t i = 0; i < POINTS; i++)
        picked += bits[0][i / 8] >> i % 8 & 1;
    print_message("%u of %u points picked, kinds %llu %llu\n", picked, POINTS, (unsigned long long)found[0].kinds[1],
                  (unsigned long long)found[0].kinds[2]);
    assert_true(picked > 1000 && found[0].kinds[PATINA_KIND_SURFACE] > POINTS / 2);
    assert_true(pt_cloud_fingerprint(cloud[0]) != pt_cloud_fingerprint(cloud[1]));
    for (int i = 0; i < 2; i++) {
        pt_analysis_free(&found[i]);
        patina_cloud_destroy(cloud[i]);
        free(bits[i]);
    }
    free(station);
}

// On the disk as in memory.
static void test_analysed_file(void **state)
{
    (void)state;
    const patina_analysis_desc desc = {.struct_size = sizeof desc};
    patina_cloud *cloud = open_cloud("packed");
    CHECK(patina_cloud_analyse(cloud, &desc, NULL), cloud);
    CHECK(patina_cloud_save(cloud, at("wanted")), cloud);
    patina_cloud_destroy(cloud);
    CHECK(patina_cloud_analyse_file(at("packed"), &desc, 16 << 20, at("found"), NULL), NULL);
    assert_same_file(at("found"), at("wanted"));
    CHECK(patina_cloud_verify(at("found"), NULL), NULL);
}

// ---- versions, and heads that lie ------------------------------------------------------------------------------------------

static void put(unsigned char *data, size_t where, uint32_t word) { memcpy(data + where, &word, sizeof word); }

static uint32_t word_at(const unsigned char *data, size_t where)
{
    uint32_t word;
    memcpy(&word, data + where, sizeof word);
    return word;
}

// Writes "bad" with the sum that a head of `tail` bytes behind it has.
static void write_summed(unsigned char *data, size_t size, size_t tail)
{
    uint64_t sum = pt_fingerprint(word_at(data, VERSION_AT), data, SUM_AT);
    sum = pt_fingerprint(sum, data + SECTION, (size_t)word_at(data, CHUNKS_AT) * word_at(data, CHUNK_SIZE_AT));
    sum = tail ? pt_fingerprint(sum, data + PAGES_AT, tail) : sum;
    memcpy(data + SUM_AT, &sum, sizeof sum);
    FILE *stream = fopen(at("bad"), "wb");
    assert_non_null(stream);
    assert_int_equal(fwrite(data, 1, size, stream), size);
    fclose(stream);
}

static void assert_refused(const char *why)
{
    patina_cloud *cloud = NULL;
    assert_int_equal(patina_cloud_open(at("bad"), &cloud), PATINA_ERROR_FORMAT);
    assert_null(cloud);
    assert_non_null(strstr(support_message(NULL), why));
}

// What version 11 wrote has nothing behind the sum of its pages, and that is of another beginning.
static void test_version_before(void **state)
{
    (void)state;
    size_t size;
    unsigned char *data = bytes_of(at("plain"), &size);
    const uint32_t chunks = word_at(data, CHUNKS_AT);
    patina_cloud *plain = open_cloud("plain");
    put(data, VERSION_AT, 11);
    memset(data + ERROR_AT, 0xFF, 16); // nobody looks there
    const size_t sums = (size_t)chunks * (PT_ARRAY_SHAPES)*4, where = size - (sums + SECTION - 1) / SECTION * SECTION;
    const uint64_t page_sum = pt_fingerprint(11, data + where, sums);
    memcpy(data + PAGES_AT, &page_sum, sizeof page_sum);
    write_summed(data, size, 8);
    free(data);
    patina_cloud *old = open_cloud("bad");
    assert_true(old->page_sums && !old->packed && !old->unordered && old->info.packed_error == 0.0);
    assert_int_equal(old->info.struct_size, sizeof old->info);
    assert_int_equal(old->slots, plain->slots);
    assert_memory_equal(old->positions, plain->positions, plain->slots * 12);
    assert_memory_equal(old->order, plain->order, plain->slots * 4);
    CHECK(patina_cloud_save(old, at("found")), old); // every page is found to be good
    assert_same_file(at("found"), at("plain"));
    patina_cloud_destroy(old);
    patina_cloud_destroy(plain);
}

static void test_lying_heads(void **state)
{
    (void)state;
    static const struct {
        size_t where;
        uint32_t word;
        const char *why;
    } lies[] = {{PACKED_AT, 0, "its header is damaged"},
                {PACKED_AT, 2, "its header is damaged"},
                {UNORDERED_AT, 1, "its header is damaged"},
                {UNORDERED_AT, 7, "its header is damaged"},
                {ERROR_AT + 4, 0x7FF80000u, "its header is damaged"},
                {VERSION_AT, 15, "another version"},
                {VERSION_AT, 9, "another version"},
                {VERSION_AT, 13, "its header or chunks are damaged"},
                {VERSION_AT, 12, "its header or chunks are damaged"},
                {VERSION_AT, 11, "its header is damaged"}};
    size_t size;
    unsigned char *data = bytes_of(at("packed"), &size), *copy = malloc(size);
    for (size_t i = 0; i < sizeof lies / sizeof *lies; i++) {
        memcpy(copy, data, size);
        put(copy, lies[i].where, lies[i].word);
        write_summed(copy, size, TAIL);
        assert_refused(lies[i].why);
    }
    // a chunk of more points than any has, and boxes that are none
    const size_t first = SECTION;
    for (int lie = 0; lie < 3; lie++) {
        memcpy(copy, data, size);
        struct pt_chunk chunk;
        memcpy(&chunk, copy + first, sizeof chunk);
        if (lie == 0)
            chunk.padded = chunk.count = PT_CHUNK_POINTS + 16;
        else
            chunk.box_max[1] = lie == 1 ? NAN : INFINITY;
        memcpy(copy + first, &chunk, sizeof chunk);
        write_summed(copy, size, TAIL);
        assert_refused("a chunk is damaged");
    }
    // steps are of boxes: whatever these are, points lie somewhere, and a picture comes
    for (int lie = 0; lie < 3; lie++) {
        memcpy(copy, data, size);
        struct pt_chunk chunk;
        memcpy(&chunk, copy + first, sizeof chunk);
        for (int k = 0; k < 3; k++) {
            chunk.box_min[k] = lie == 0 ? 0.0f : lie == 1 ? -FLT_MAX : 1.0f;
            chunk.box_max[k] = lie == 0 ? 0.0f : lie == 1 ? FLT_MAX : -1e-40f;
        }
        memcpy(copy + first, &chunk, sizeof chunk);
        write_summed(copy, size, TAIL);
        patina_device *device = support_device_first();
        patina_cloud *cloud = open_cloud("bad");
        patina_scene *scene = scene_of(cloud, NULL);
        const double eye[3] = {4.5e6 + 3, 4.5e6 - 4, 4.5e6 + 3}, target[3] = {4.5e6, 4.5e6, 4.5e6};
        const patina_camera camera = camera_perspective(eye, target, 45, 100, 80, 0.1, 100);
        const patina_settings settings = settings_default(100, 80);
        struct picture picture = picture_render(device, scene, &camera, &settings);
        assert_true(picture_count(&picture) > 100);
        picture_free(&picture);
        patina_scene_destroy(scene);
        patina_cloud_destroy(cloud);
        patina_device_destroy(device);
    }
    free(copy);
    free(data);
}

int main(int argc, char **argv)
{
    support_arguments(argc, argv);
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_words),         cmocka_unit_test(test_file),
                                       cmocka_unit_test(test_order),         cmocka_unit_test(test_host),
                                       cmocka_unit_test(test_analysed_file), cmocka_unit_test(test_version_before),
                                       cmocka_unit_test(test_lying_heads)};
    return cmocka_run_group_tests(tests, make_files, remove_files);
}
