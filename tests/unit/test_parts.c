// SPDX-License-Identifier: GPL-3.0-or-later
// Clouds in parts (parts.h): small ones, which PATINA_PART_SLOTS divides, are in all that is asked of them what they are undivided; tables
// of chunks, and builders, whose counts are beyond 2^31 and 2^32; calls that take no such cloud say so.
#include "base/platform.h"
#include "scene/disk/builder.h"
#include "scene/clouds/page_sums.h"
#include "scene/clouds/parts.h"
#include "scenes/clouds.h"
#include "scenes/support.h"

#include "folder.h" // behind cmocka.h

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { POINTS = 60000, PART = 8192, NOWHERE = 77, FILES = 4 };

static const char *const files[FILES] = {"plain", "packed", "numbered", "both"};
static const patina_save_desc how[FILES] = {{.struct_size = sizeof how[0]},
                                            {.struct_size = sizeof how[0], .pack = 1},
                                            {.struct_size = sizeof how[0], .drop_order = 1},
                                            {.struct_size = sizeof how[0], .pack = 1, .drop_order = 1}};

#ifdef _WIN32
static char folder[] = "patina-parts-XXXXXX";
#else
static char folder[] = "/tmp/patina-parts-XXXXXX";
#endif

static const char *at(const char *name)
{
    static char path[4][256];
    static int turn;
    turn = (turn + 1) % 4;
    snprintf(path[turn], sizeof path[turn], "%s/%s", folder, name);
    return path[turn];
}

static void set_part_slots(const char *value)
{
#ifdef _WIN32
    _putenv_s("PATINA_PART_SLOTS", value ? value : "");
#else
    if (value)
        setenv("PATINA_PART_SLOTS", value, 1);
    else
        unsetenv("PATINA_PART_SLOTS");
#endif
}

static patina_cloud *open_whole(const char *name)
{
    patina_cloud *cloud = NULL;
    CHECK(patina_cloud_open(at(name), &cloud), NULL);
    assert_true(!cloud->part_count && pt_part_count(cloud) == 1 && pt_part(cloud, 0) == cloud);
    return cloud;
}

static patina_cloud *open_parts(const char *name)
{
    char text[16];
    patina_cloud *cloud = NULL;
    snprintf(text, sizeof text, "%d", PART);
    set_part_slots(text);
    CHECK(patina_cloud_open(at(name), &cloud), NULL);
    set_part_slots(NULL);
    assert_true(cloud->part_count >= POINTS / PART);
    return cloud;
}

// All that a cloud may have, what its stations saw too.
static patina_cloud *make_cloud(void)
{
    struct points points = points_torus(POINTS, 2.0, 0.7, POINTS_ALL, 3);
    patina_cloud_desc desc = points_desc(&points);
    float *values = malloc(2 * POINTS * sizeof *values);
    uint8_t *bytes = malloc(3 * POINTS);
    const double stations[6] = {0, 0, 0, 4, 0, 0};
    patina_cloud *cloud = NULL;
    for (int i = 0; i < POINTS; i++) {
        values[i] = 0.001f * (float)(i % 7);
        values[POINTS + i] = (float)i;
        bytes[i] = (uint8_t)(100 + i % 150);
        bytes[POINTS + i] = (uint8_t)(i % 5);
        bytes[2 * POINTS + i] = (uint8_t)(i % 2);
    }
    points.position[3 * NOWHERE] = NAN;
    desc.radius = (patina_array){values, PATINA_FLOAT32, 1, 0};
    desc.scalar = (patina_array){values + POINTS, PATINA_FLOAT32, 1, 0};
    desc.opacity = (patina_array){bytes, PATINA_UINT8, 1, 0};
    desc.classes = (patina_array){bytes + POINTS, PATINA_UINT8, 1, 0};
    const patina_analysis_desc analysis = {.struct_size = sizeof analysis,
                                           .neighbours = 4,
                                           .station_count = 2,
                                           .stations = stations,
                                           .station = {bytes + 2 * POINTS, PATINA_UINT8, 1, 0},
                                           .free_space = 1};
    CHECK(patina_cloud_create(&desc, NULL, &cloud), NULL);
    CHECK(patina_cloud_analyse(cloud, &analysis, NULL), cloud);
    assert_true(cloud->sights.count == 2);
    points_free(&points);
    free(values);
    free(bytes);
    return cloud;
}

static int make_files(void **state)
{
    (void)state;
    if (make_folder_of(folder))
        return 1;
    set_part_slots(NULL);
    patina_cloud *cloud = make_cloud();
    for (int i = 0; i < FILES; i++)
        CHECK(patina_cloud_save_as(cloud, at(files[i]), &how[i]), cloud);
    patina_cloud_destroy(cloud);
    return 0;
}

static int remove_files(void **state)
{
    (void)state;
    for (int i = 0; i < FILES; i++)
        remove(at(files[i]));
    remove(at("found"));
    remove(at("built"));
    remove(at("wanted"));
    return rmdir(folder);
}

// ---- open ------------------------------------------------------------------------------------------------------------------

static void check_arrays(const patina_cloud *part, const patina_cloud *wanted)
{
    struct patina_cloud copies[2] = {*part, *wanted};
    struct pt_section found[PT_ARRAYS], whole[PT_ARRAYS];
    pt_cloud_sections(&copies[0], found);
    pt_cloud_sections(&copies[1], whole);
    for (int i = PT_ARRAY_POSITIONS; i < PT_ARRAY_SIGHTS; i++) {
        const uint64_t each = pt_cloud_array_bytes(wanted, (enum pt_array)i);
        assert_int_equal(*found[i].data != NULL, *whole[i].data != NULL);
        assert_int_equal(part->mapped >> i & 1u, wanted->mapped >> i & 1u);
        if (*whole[i].data)
            assert_memory_equal(*found[i].data, (const char *)*whole[i].data + part->first_slot * each, part->slots * each);
    }
    for (int i = PT_ARRAY_SIGHTS; i < PT_ARRAYS; i++) { // all of them
        assert_int_equal(found[i].size, whole[i].size);
        assert_memory_equal(*found[i].data, *whole[i].data, whole[i].size);
    }
}

static void check_chunk(const patina_cloud *whole, const patina_cloud *part, uint32_t c, const patina_cloud *wanted)
{
    const struct pt_chunk *chunk = &part->chunks[c], *of = &wanted->chunks[part->first_chunk + c];
    assert_true(part->first_slot + chunk->first == of->first && pt_chunk_slot(part, chunk) == chunk->first);
    assert_true(pt_chunk_slot(whole, chunk) == of->first && pt_chunk_slot(wanted, of) == of->first);
    struct pt_chunk same = *chunk;
    same.first = of->first;
    assert_memory_equal(&same, of, sizeof same);
    for (uint32_t i = 0; i < chunk->padded; i++) {
        double p[3][3];
        pt_point_place(part, chunk, i, p[0]);
        pt_point_place(whole, chunk, i, p[1]);
        pt_point_place(wanted, of, i, p[2]);
        assert_memory_equal(p[0], p[2], sizeof p[0]);
        assert_memory_equal(p[1], p[2], sizeof p[1]);
        const uint64_t number = pt_number_of(wanted, of->first + i);
        assert_true(pt_number_of(part, chunk->first + i) == number && pt_number_of(whole, of->first + i) == number);
    }
}

static void test_open(void **state)
{
    (void)state;
    for (int file = 0; file < FILES; file++) {
        patina_cloud *wanted = open_whole(files[file]), *cloud = open_parts(files[file]);
        uint64_t slots = 0, drawn = 0, bytes = 0;
        uint32_t chunks = 0;
        for (uint32_t k = 0; k < cloud->part_count; k++) {
            const patina_cloud *part = pt_part(cloud, k);
            assert_true(part->first_slot == slots && part->first_chunk == chunks && part->first_number == drawn);
            assert_true(part->slots && part->slots <= PART && part->info.count == wanted->info.count);
            assert_int_equal(part->info.chunks, part->chunk_count);
            check_arrays(part, wanted);
            for (uint32_t c = 0; c < part->chunk_count; c++)
                check_chunk(cloud, part, c, wanted);
            pt_cloud_return(part);
            pt_cloud_expect(part, 1u << PT_ARRAY_POSITIONS | 1u << PT_ARRAY_COLORS, 0, part->slots);
            check_arrays(part, wanted);
            for (uint32_t j = 0; j < k; j++)
                assert_true(pt_cloud_fingerprint(part) != pt_cloud_fingerprint(pt_part(cloud, j)));
            slots += part->slots;
            drawn += part->info.drawn;
            chunks += part->chunk_count;
            bytes += pt_cloud_mapped_bytes(part);
        }
        assert_true(slots == wanted->slots && drawn == wanted->info.drawn && chunks == wanted->chunk_count);
        assert_true(cloud->slots == slots && cloud->chunk_count == chunks);
        assert_int_equal(pt_cloud_mapped_bytes(cloud), pt_cloud_mapped_bytes(wanted));
        assert_true(bytes >= pt_cloud_mapped_bytes(wanted) && bytes < pt_cloud_mapped_bytes(wanted) + 16 * cloud->part_count);
        assert_true(pt_cloud_fingerprint(cloud) == pt_cloud_fingerprint(wanted));
        assert_int_equal(pt_is_as_it_lies(cloud), pt_is_as_it_lies(wanted));
        patina_cloud_info info[2] = {{.struct_size = sizeof info[0]}, {.struct_size = sizeof info[0]}};
        CHECK(patina_cloud_get_info(cloud, &info[0]), cloud);
        CHECK(patina_cloud_get_info(wanted, &info[1]), wanted);
        assert_memory_equal(&info[0], &info[1], sizeof info[0]);
        double box[2][6];
        float range[2][2];
        CHECK(patina_cloud_dense_box(cloud, box[0], box[0] + 3), cloud);
        CHECK(patina_cloud_dense_box(wanted, box[1], box[1] + 3), wanted);
        CHECK(patina_cloud_scalar_range(cloud, 0.1, range[0]), cloud);
        CHECK(patina_cloud_scalar_range(wanted, 0.1, range[1]), wanted);
        assert_memory_equal(box[0], box[1], sizeof box[0]);
        assert_memory_equal(range[0], range[1], sizeof range[0]);
        patina_cloud_destroy(cloud);
        patina_cloud_destroy(wanted);
    }
}

// ---- save ------------------------------------------------------------------------------------------------------------------

static void test_saved(void **state)
{
    (void)state;
    for (int file = 0; file < FILES; file++)
        for (int i = 0; i < FILES; i++) {
            patina_cloud *wanted = open_whole(files[file]), *cloud = open_parts(files[file]);
            CHECK(patina_cloud_save_as(wanted, at("wanted"), &how[i]), wanted);
            CHECK(patina_cloud_save_as(cloud, at("found"), &how[i]), cloud);
            assert_same_file(at("found"), at("wanted"));
            CHECK(patina_cloud_verify(at("found"), NULL), NULL);
            patina_cloud_destroy(cloud);
            patina_cloud_destroy(wanted);
        }
}

// Colours and scalars are set by number; where that cannot be, all stays.
static void test_values(void **state)
{
    (void)state;
    float *values = malloc(3 * POINTS * sizeof *values);
    for (int i = 0; i < 3 * POINTS; i++)
        values[i] = i % 4999 ? (float)(i % 1000) / 1000.0f : NAN;
    const patina_array colors[2] = {{values, PATINA_FLOAT32, 3, 0}, {.data = NULL}}, scalar = {values, PATINA_FLOAT32, 1, 0};
    const patina_array wrong = {values, PATINA_FLOAT32, 2, 0};
    for (int file = 0; file < FILES; file++)
        for (int turn = 0; turn < 2; turn++) {
            patina_cloud *two[2] = {open_whole(files[file]), open_parts(files[file])};
            const unsigned before = atomic_load(&two[1]->parts[1].alive->colors);
            two[0]->keeps_colors = 1; // no analysis takes clouds that are that large, so that none lends colors to their points
            assert_int_equal(patina_cloud_set_colors(two[1], &wrong), PATINA_ERROR_ARGUMENT);
            for (int i = 0; i < 2; i++) {
                CHECK(patina_cloud_set_colors(two[i], &colors[turn]), two[i]);
                CHECK(patina_cloud_set_scalars(two[i], turn ? &colors[1] : &scalar), two[i]);
                CHECK(patina_cloud_save(two[i], at(i ? "found" : "wanted")), two[i]);
            }
            assert_same_file(at("found"), at("wanted"));
            for (uint32_t k = 0; k < two[1]->part_count; k++) {
                const patina_cloud *part = pt_part(two[1], k);
                check_arrays(part, two[0]);
                assert_true(part->color_format == two[0]->color_format && part->info.has_colors == two[0]->info.has_colors);
                assert_true(part->info.invalid_colors == two[0]->info.invalid_colors && part->info.drawn < POINTS);
            }
            assert_true(atomic_load(&two[1]->parts[1].alive->colors) > before);
            patina_cloud_destroy(two[0]);
            patina_cloud_destroy(two[1]);
        }
    free(values);
}

// ---- damaged pages ---------------------------------------------------------------------------------------------------------

// A bit of a position, where the first word of the chunk is another one.
static void damage(const char *name, uint32_t page)
{
    patina_cloud *cloud = open_whole(name);
    const uint64_t each = pt_cloud_array_bytes(cloud, PT_ARRAY_POSITIONS);
    const size_t wanted = 65536 + (cloud->chunk_count * sizeof *cloud->chunks + 65535) / 65536 * 65536 +
                          cloud->chunks[page].first * each;
    size_t size;
    unsigned char *data = bytes_of(at(name), &size);
    assert_memory_equal(data + wanted, (const char *)cloud->positions + cloud->chunks[page].first * each, each);
    data[wanted] ^= 4;
    patina_cloud_destroy(cloud);
    FILE *stream = fopen(at("found"), "wb");
    assert_non_null(stream);
    assert_int_equal(fwrite(data, 1, size, stream), size);
    fclose(stream);
    free(data);
}

static void test_damage(void **state)
{
    (void)state;
    for (int file = 0; file < FILES; file += 3) {
        char log[2048], wanted[64];
        patina_cloud *good = open_parts(files[file]);
        for (uint32_t k = 0; k < good->part_count; k++)
            for (uint32_t c = 0; c < good->parts[k].chunk_count; c++) {
                assert_int_equal(pt_page_check(&good->parts[k], c, UINT32_MAX), 0);
                assert_int_equal(pt_page_unseen(&good->parts[k], c, UINT32_MAX), 0);
            }
        assert_false(pt_pages_are_damaged(good));
        const uint32_t page = good->parts[3].first_chunk + 1, pages = good->chunk_count;
        patina_cloud_destroy(good);
        damage(files[file], page);
        for (int by_whole = 0; by_whole < 2; by_whole++) {
            patina_cloud *cloud = open_parts("found");
            const patina_cloud *part = &cloud->parts[3];
            assert_int_equal(pt_page_check(part, 0, UINT32_MAX), 0);
            assert_int_equal(by_whole ? pt_page_check(cloud, page, UINT32_MAX) : pt_page_check(part, 1, UINT32_MAX), 1);
            assert_true(pt_page_is_damaged(part, 1) && pt_page_is_damaged(cloud, page) && !pt_page_is_damaged(part, 0));
            assert_false(pt_page_is_damaged(&cloud->parts[2], 1));
            assert_true(pt_pages_are_damaged(part) && pt_pages_are_damaged(cloud));
            support_drain_log(log, sizeof log);
            pt_pages_tell(&cloud->parts[by_whole ? 1 : 3]); // whoever tells it, once
            pt_pages_tell(part);
            assert_int_equal(support_drain_log(log, sizeof log), 1);
            snprintf(wanted, sizeof wanted, "page %u of %u is damaged", page + 1, pages);
            assert_non_null(strstr(log, wanted));
            assert_int_equal(patina_cloud_save(cloud, at("wanted")), PATINA_ERROR_FORMAT);
            assert_non_null(strstr(support_message(cloud), wanted));
            support_drain_log(log, sizeof log);
            patina_cloud_destroy(cloud);
        }
        assert_int_equal(patina_cloud_verify(at("found"), NULL), PATINA_ERROR_FORMAT);
    }
}

// ---- what takes none -------------------------------------------------------------------------------------------------------

static void assert_refused(int code, const patina_cloud *cloud, const char *call)
{
    char count[24];
    snprintf(count, sizeof count, "%llu", (unsigned long long)cloud->info.count);
    assert_int_equal(code, PATINA_ERROR_TOO_MANY_POINTS);
    const char *said = support_message(NULL);
    if (!strstr(said, call) || !strstr(said, count))
        support_die("'%s' should name %s and %s", said, call, count);
}

static void test_refused(void **state)
{
    (void)state;
    patina_cloud *cloud = open_parts("plain");
    const patina_analysis_desc analysis = {.struct_size = sizeof analysis};
    const patina_field_desc field_desc = {.struct_size = sizeof field_desc, .source = PATINA_FIELD_DISTANCE, .range = {0, 1}};
    const patina_scan scan = {.interval = 0.001};
    static float spacing[POINTS];
    const patina_neighbourhoods wanted = {.struct_size = sizeof wanted, .spacing = spacing};
    patina_scans *scans = NULL;
    patina_field *field = NULL;
    assert_refused(patina_scans_create(cloud, NULL, &scan, 1, &scans), cloud, "patina_scans_create");
    assert_refused(patina_field_create(cloud, &field_desc, NULL, &field), cloud, "patina_field_create");
    assert_refused(patina_cloud_neighbourhoods(cloud, &wanted, NULL), cloud, "patina_cloud_neighbourhoods");
    assert_refused(patina_cloud_analyse(cloud, &analysis, NULL), cloud, "patina_cloud_analyse");
    assert_true(!scans && !field);
    set_part_slots("8192");
    assert_refused(patina_cloud_analyse_file(at("plain"), &analysis, 0, at("found"), NULL), cloud, "patina_cloud_analyse_file");
    set_part_slots(NULL);
    CHECK(patina_cloud_save(cloud, at("found")), cloud); // nothing changed
    assert_same_file(at("found"), at("plain"));
    patina_cloud_destroy(cloud);
    const float place[3] = {0, 0, 0};
    const patina_cloud_desc many = {.struct_size = sizeof many, .count = 1ull << 31, .position = {place, PATINA_FLOAT32, 3, 0}};
    assert_int_equal(patina_cloud_create(&many, NULL, &cloud), PATINA_ERROR_TOO_MANY_POINTS);
    assert_non_null(strstr(support_message(NULL), "built on the disk"));
    char log[4096];
    support_drain_log(log, sizeof log);
}

// ---- counts beyond what a test writes --------------------------------------------------------------------------------------

enum { CHUNKS = 1100000 };

// A table of 4.5e9 slots, whose arrays are nowhere.
static void test_table(void **state)
{
    (void)state;
    struct patina_cloud *cloud = pt_cloud_new();
    assert_non_null(cloud);
    cloud->unordered = 1;
    cloud->chunk_count = CHUNKS;
    cloud->chunks = calloc(CHUNKS, sizeof *cloud->chunks);
    assert_non_null(cloud->chunks);
    for (uint32_t c = 0; c < CHUNKS; c++) {
        cloud->chunks[c] = (struct pt_chunk){.first = (uint32_t)cloud->slots, .count = 4090, .padded = 4096};
        cloud->slots += 4096;
        cloud->info.drawn += 4090;
    }
    cloud->info.count = cloud->info.drawn;
    assert_int_equal(pt_parts_make(cloud, pt_part_slots()), PATINA_OK);
    assert_int_equal(cloud->part_count, 17);
    uint64_t slot = 0, number = 0;
    for (uint32_t k = 0; k < cloud->part_count; k++) {
        const patina_cloud *part = pt_part(cloud, k);
        assert_true(part->slots <= 1u << 28 && part->first_slot == slot && part->first_number == number);
        for (uint32_t c = 0; c < part->chunk_count; c += 997) {
            const struct pt_chunk *chunk = &part->chunks[c];
            const uint64_t first = 4090ull * (part->first_chunk + c);
            assert_true(chunk->first == 4096u * c && pt_chunk_slot(cloud, chunk) == 4096ull * (part->first_chunk + c));
            assert_true(pt_number_of(part, chunk->first + 7ull) == first + 7);
            assert_true(pt_number_of(cloud, pt_chunk_slot(cloud, chunk) + 4095) == first + 4089);
        }
        slot += part->slots;
        number += part->info.drawn;
    }
    assert_true(slot > UINT32_MAX && slot == cloud->slots && number == cloud->info.count);
    assert_true(pt_number_of(cloud, cloud->slots - 1) == cloud->info.count - 1);
    patina_cloud_destroy(cloud);
}

// A file of 256 GiB, all holes, is mapped on any machine that promises more than it has. The thread sanitizer leaves a program
// between 512 GiB and 1.5 TiB of addresses, by where the system puts its stack.
static void test_larger_than_memory(void **state)
{
    (void)state;
#ifdef _WIN32
    print_message("skip: Windows counts what is mapped so as memory\n");
#else
    const size_t size = (size_t)1 << 38;
    FILE *stream = fopen(at("found"), "wb");
    assert_non_null(stream);
    const int made = !ftruncate(fileno(stream), (off_t)size);
    fclose(stream);
    FILE *rule = fopen("/proc/sys/vm/overcommit_memory", "r");
    const int strict = rule && fgetc(rule) == '2';
    if (rule)
        fclose(rule);
    if (!made || strict) {
        print_message("skip: %s\n", made ? "this system promises no more memory than it has" : "no file here may be so large");
        return;
    }
    struct pt_disk disk;
    void *data = NULL;
    assert_int_equal(pt_disk_open(at("found"), &disk), 0);
    assert_int_equal(pt_disk_map(&disk, 0, size, PT_DISK_ANYWHERE, &data), 0);
    assert_true(!((const char *)data)[0] && !((const char *)data)[size - 1]);
    pt_pages_free(data, size);
    pt_disk_close(&disk);
#endif
}

// As if `before` points had come already, that were nowhere.
static patina_cloud *build(const char *name, uint64_t before, uint64_t count, const patina_cloud_desc *desc)
{
    patina_builder *builder = NULL;
    const patina_builder_desc how_much = {.struct_size = sizeof how_much, .memory = 64 << 20, .count = count};
    CHECK(patina_builder_begin(at(name), &how_much, &builder), NULL);
    builder->count = builder->invalid_positions = before;
    CHECK(patina_builder_add(builder, desc), builder);
    CHECK(patina_builder_end(builder, NULL), builder);
    patina_builder_destroy(builder);
    CHECK(patina_cloud_verify(at(name), NULL), NULL);
    return open_whole(name);
}

static void test_built(void **state)
{
    (void)state;
    struct points points = points_torus(20000, 2.0, 0.7, POINTS_ALL, 5);
    const patina_cloud_desc desc = points_desc(&points);
    patina_cloud *plain = build("built", 0, 0, &desc); // and mapped from there on: Windows does not replace it
    const uint64_t befores[] = {0x7FFFFFFFull - 300, 0xFFFFFFFFull - 20000, 0xFFFFFFFFull - 19999, 7ull << 33};
    char log[2048];
    for (int i = 0; i < 4; i++) {
        support_drain_log(log, sizeof log);
        patina_cloud *cloud = build("found", befores[i], 0, &desc);
        const int numbered = i > 1;
        support_drain_log(log, sizeof log);
        assert_int_equal(strstr(log, "numbered as they lie") != NULL, numbered);
        assert_true(cloud->unordered == numbered && cloud->info.drawn == 20000);
        assert_true(cloud->info.count == (numbered ? 20000 : befores[i] + 20000));
        assert_true(cloud->info.invalid_positions == befores[i]);
        for (uint64_t slot = 0; slot < cloud->slots && !numbered; slot++)
            assert_true(pt_number_of(cloud, slot) == befores[i] + pt_number_of(plain, slot));
        if (!numbered) { // the same chunks of the same points
            assert_true(cloud->slots == plain->slots);
            assert_memory_equal(cloud->positions, plain->positions, plain->slots * 12);
            assert_memory_equal(cloud->surfels, plain->surfels, plain->slots * 4);
        }
        patina_cloud_destroy(cloud);
    }
    patina_cloud_destroy(plain);
    // so many may come; what they need on the disk is asked for before
    patina_builder *builder = NULL;
    const patina_builder_desc many = {.struct_size = sizeof many, .count = 1ull << 44};
    CHECK(patina_builder_begin(at("found"), &many, &builder), NULL);
    assert_int_equal(patina_builder_add(builder, &desc), PATINA_ERROR_FILE);
    assert_non_null(strstr(support_message(builder), "GB on the disk"));
    patina_builder_destroy(builder);
    support_drain_log(log, sizeof log);
    points_free(&points);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_open),    cmocka_unit_test(test_saved),
        cmocka_unit_test(test_values),  cmocka_unit_test(test_damage),
        cmocka_unit_test(test_refused), cmocka_unit_test(test_table),
        cmocka_unit_test(test_built),   cmocka_unit_test(test_larger_than_memory),
    };
    return cmocka_run_group_tests(tests, make_files, remove_files);
}
