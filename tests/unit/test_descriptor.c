// SPDX-License-Identifier: GPL-3.0-or-later
// Programs and libraries of different age: every descriptor, cut after each 8 bytes and longer than the library's, does what patina.h
// promises ("Descriptors"). Each lies in memory of its own size, so that the sanitizer finds a byte that is read or written beyond.
#include <patina/patina.h>

#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { POINTS = 64, MORE = 24 };

static struct {
    patina_device *device;
    patina_cloud *cloud, *bare;
    patina_mesh *mesh;
    patina_scene *scene;
    patina_frame *frame;
    patina_file *file;
    float points[POINTS][3], plane[POINTS][3], pixels[4 * 4 * 4];
    uint32_t row[POINTS], column[POINTS];
    uint8_t bits[POINTS / 8];
} stage;

// ---- descriptors that the library reads ------------------------------------------------------------------------------------

static int device(const void *desc)
{
    patina_device *out = NULL;
    const int code = patina_device_create(desc, &out);
    patina_device_destroy(out);
    return code;
}

static int cloud(const void *desc)
{
    patina_cloud *out = NULL;
    const int code = patina_cloud_create(desc, NULL, &out);
    patina_cloud_destroy(out);
    return code;
}

static int ended(int code, patina_task *task)
{
    if (!code)
        code = patina_task_wait(task);
    patina_task_destroy(task);
    return code;
}

static int cloud_task(const void *desc)
{
    patina_task *task = NULL;
    const int code = patina_task_build(desc, NULL, &task);
    return ended(code, task);
}

static int fingerprint(const void *desc)
{
    patina_task *task = NULL;
    uint64_t values[2];
    const int code = patina_task_fingerprint(desc, values, &task);
    return ended(code, task);
}

static int write_ply(const void *desc)
{
    return patina_write_ply("/dev/null/no", desc) == PATINA_ERROR_FILE ? PATINA_OK : patina_write_ply("/dev/null/no", desc);
}

static int analyse(const void *desc) { return patina_cloud_analyse(stage.bare, desc, NULL); }

static int analyse_task(const void *desc)
{
    patina_task *task = NULL;
    const int code = patina_task_analyse(stage.bare, desc, NULL, &task);
    return ended(code, task);
}

static int neighbourhoods(const void *desc) { return patina_cloud_neighbourhoods(stage.cloud, desc, NULL); }

static int mesh(const void *desc)
{
    patina_mesh *out = NULL;
    const int code = patina_mesh_create(desc, &out);
    patina_mesh_destroy(out);
    return code;
}

static int texture(const void *desc)
{
    patina_texture *out = NULL;
    const int code = patina_texture_create(desc, &out);
    patina_texture_destroy(out);
    return code;
}

static int grid(const void *desc) { return patina_grid_normals(desc, NULL, stage.plane[0]); }

static int grid_task(const void *desc)
{
    patina_task *task = NULL;
    const int code = patina_task_grid_normals(desc, NULL, stage.plane[0], &task);
    return ended(code, task);
}

static int add_cloud(const void *desc)
{
    patina_scene_clear(stage.scene);
    return patina_scene_add_cloud(stage.scene, stage.cloud, desc);
}

static int add_mesh(const void *desc)
{
    patina_scene_clear(stage.scene);
    return patina_scene_add_mesh(stage.scene, stage.mesh, desc);
}

static int add_clip(const void *desc)
{
    patina_scene_clear(stage.scene);
    return patina_scene_add_clip(stage.scene, desc);
}

static int add_light(const void *desc)
{
    patina_scene_clear(stage.scene);
    return patina_scene_add_light(stage.scene, desc);
}

static int set_camera(const void *desc) { return patina_scene_set_camera(stage.scene, desc); }

static int set_settings(const void *desc) { return patina_scene_set_settings(stage.scene, desc); }

static int set_effects(const void *desc) { return patina_scene_set_effects(stage.scene, desc); }

static int set_lines(const void *desc) { return patina_scene_set_lines(stage.scene, desc); }

static int panorama_camera(const void *desc)
{
    patina_camera camera = {.struct_size = sizeof camera};
    uint32_t side;
    return patina_panorama_camera(desc, 0, &camera, &side);
}

static int pick(const void *desc)
{
    patina_scene_clear(stage.scene);
    assert_int_equal(patina_scene_add_cloud(stage.scene, stage.cloud, NULL), PATINA_OK);
    return patina_scene_pick(stage.scene, NULL, desc, NULL, stage.bits, sizeof stage.bits);
}

struct input {
    const char *name;
    int (*call)(const void *);
    size_t size;
    const void *whole;
};

// A descriptor of `size` bytes that begins as `whole` does, with `tail` in each byte beyond `known`.
static int call_with(const struct input *input, const void *whole, size_t known, size_t size, unsigned char tail)
{
    unsigned char *desc = malloc(size);
    assert_non_null(desc);
    memset(desc, tail, size);
    memcpy(desc, whole, known < size ? known : size);
    memcpy(desc, &size, sizeof size < size ? sizeof size : size);
    const int code = input->call(desc);
    free(desc);
    return code;
}

static void check_input(const struct input *input)
{
    unsigned char *cut = calloc(1, input->size);
    assert_non_null(cut);
    const size_t wrong[] = {0, 1, sizeof(size_t), (size_t)1 << 40};
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++) {
        memcpy(cut, input->whole, input->size);
        memcpy(cut, wrong + i, sizeof *wrong);
        if (input->call(cut) != PATINA_ERROR_ARGUMENT)
            fail_msg("%s: struct_size %zu is not refused", input->name, wrong[i]);
    }
    const int whole = call_with(input, input->whole, input->size, input->size, 0);
    if (whole)
        fail_msg("%s: the whole descriptor is refused with %d", input->name, whole);
    for (size_t size = 16; size < input->size; size += 8) {
        memset(cut, 0, input->size);
        memcpy(cut, input->whole, size);
        const int expected = call_with(input, cut, input->size, input->size, 0);
        const int code = call_with(input, input->whole, input->size, size, 0);
        if (code != expected)
            fail_msg("%s of %zu bytes gives %d, with zeros behind them %d", input->name, size, code, expected);
    }
    if (call_with(input, input->whole, input->size, input->size + MORE, 0))
        fail_msg("%s: a longer one with zeros behind what is known is refused", input->name);
    if (call_with(input, input->whole, input->size, input->size + MORE, 1) != PATINA_ERROR_UNSUPPORTED)
        fail_msg("%s: what is not known is not refused", input->name);
    free(cut);
}

static void test_what_is_read(void **state)
{
    (void)state;
    static float results[3 * POINTS];
    const patina_array position = {stage.points, PATINA_FLOAT32, 3, 0};
    const patina_device_desc device_desc = {
        .struct_size = sizeof device_desc, .name = "cpu", .threads = 1, .memory_cap = 1u << 30};
    const patina_cloud_desc cloud_desc = {
        .struct_size = sizeof cloud_desc, .count = POINTS, .position = position, .origin = {1, 2, 3}, .threads = 1};
    const double station[3] = {0, 0, 5};
    const patina_analysis_desc analysis = {
        .struct_size = sizeof analysis, .neighbours = 6, .threads = 1, .station_count = 1, .stations = station};
    const patina_neighbourhoods wanted = {.struct_size = sizeof wanted, .normal = results, .neighbours = 3, .threads = 1};
    const patina_mesh_desc mesh_desc = {
        .struct_size = sizeof mesh_desc, .vertex_count = 6, .position = position, .triangle_count = 2};
    const patina_texture_desc texture_desc = {.struct_size = sizeof texture_desc,
                                              .width = 4,
                                              .height = 4,
                                              .pixels = {stage.pixels, PATINA_FLOAT32, 4, 0},
                                              .raw = 1,
                                              .wrap = PATINA_WRAP_CLIP};
    const patina_grid_desc grid_desc = {.struct_size = sizeof grid_desc,
                                        .count = POINTS,
                                        .position = stage.points[0],
                                        .column = stage.column,
                                        .row = stage.row,
                                        .station = {0, 0, 5}};
    patina_cloud_style cloud_style = PATINA_CLOUD_STYLE_INIT;
    cloud_style.transparency = 0.5f;
    const patina_mesh_style mesh_style = PATINA_MESH_STYLE_INIT;
    const patina_clip clip = {.struct_size = sizeof clip, .cut = 1, .tint = {1, 1, 1}, .tint_strength = 1, .tint_width = 1};
    const patina_light_desc light = {
        .struct_size = sizeof light, .type = PATINA_LIGHT_SPOT, .power = 1, .cone = 1, .shadows = 1};
    patina_camera camera = {.struct_size = sizeof camera};
    assert_int_equal(patina_scene_frame_camera(stage.scene, 0, 0, 0, &camera), PATINA_OK);
    const patina_settings settings = {
        .struct_size = sizeof settings, .width = 16, .height = 16, .layers = 2, .pixel_noise = 0.5f, .average = 1};
    const patina_effects effects = PATINA_EFFECTS_INIT;
    const patina_lines lines = PATINA_LINES_INIT;
    const patina_panorama panorama = {.struct_size = sizeof panorama,
                                      .width = 8,
                                      .height = 4,
                                      .world_from_camera = {[0] = 1, [5] = 1, [10] = 1, [15] = 1},
                                      .near_clip = 0.1,
                                      .far_clip = 10};
    const patina_pick picked = {.struct_size = sizeof picked, .threads = 1};
    const struct input inputs[] = {
        {"patina_device_create", device, sizeof device_desc, &device_desc},
        {"patina_cloud_create", cloud, sizeof cloud_desc, &cloud_desc},
        {"patina_task_build", cloud_task, sizeof cloud_desc, &cloud_desc},
        {"patina_task_fingerprint", fingerprint, sizeof cloud_desc, &cloud_desc},
        {"patina_write_ply", write_ply, sizeof cloud_desc, &cloud_desc},
        {"patina_cloud_analyse", analyse, sizeof analysis, &analysis},
        {"patina_task_analyse", analyse_task, sizeof analysis, &analysis},
        {"patina_cloud_neighbourhoods", neighbourhoods, sizeof wanted, &wanted},
        {"patina_mesh_create", mesh, sizeof mesh_desc, &mesh_desc},
        {"patina_texture_create", texture, sizeof texture_desc, &texture_desc},
        {"patina_grid_normals", grid, sizeof grid_desc, &grid_desc},
        {"patina_task_grid_normals", grid_task, sizeof grid_desc, &grid_desc},
        {"patina_scene_add_cloud", add_cloud, sizeof cloud_style, &cloud_style},
        {"patina_scene_add_mesh", add_mesh, sizeof mesh_style, &mesh_style},
        {"patina_scene_add_clip", add_clip, sizeof clip, &clip},
        {"patina_scene_add_light", add_light, sizeof light, &light},
        {"patina_scene_set_camera", set_camera, sizeof camera, &camera},
        {"patina_scene_set_settings", set_settings, sizeof settings, &settings},
        {"patina_scene_set_effects", set_effects, sizeof effects, &effects},
        {"patina_scene_set_lines", set_lines, sizeof lines, &lines},
        {"patina_panorama_camera", panorama_camera, sizeof panorama, &panorama},
        {"patina_scene_pick", pick, sizeof picked, &picked},
    };
    for (size_t i = 0; i < sizeof inputs / sizeof *inputs; i++)
        check_input(inputs + i);
}

// ---- structures that the library writes ------------------------------------------------------------------------------------

static int device_info(void *to) { return patina_device_get_info(stage.device, to); }

static int cloud_info(void *to) { return patina_cloud_get_info(stage.cloud, to); }

static int mesh_info(void *to) { return patina_mesh_get_info(stage.mesh, to); }

static int file_info(void *to) { return patina_file_get_info(stage.file, to); }

static int file_attribute(void *to) { return patina_file_get_attribute(stage.file, 0, to); }

static int frame_stats(void *to) { return patina_frame_get_stats(stage.frame, to); }

static int framed_camera(void *to) { return patina_scene_frame_camera(stage.scene, 20, 30, 0, to); }

static int face_camera(void *to)
{
    const patina_panorama panorama = {.struct_size = sizeof panorama,
                                      .width = 8,
                                      .height = 4,
                                      .world_from_camera = {[0] = 1, [5] = 1, [10] = 1, [15] = 1},
                                      .near_clip = 0.1,
                                      .far_clip = 10};
    uint32_t side;
    return patina_panorama_camera(&panorama, 1, to, &side);
}

static int picked(void *to)
{
    static const double corners[6] = {0, 0, 16, 0, 16, 16}, place[2] = {8, 8};
    const patina_pick pick = {.struct_size = sizeof pick, .polygon = corners, .corners = 3, .threads = 1};
    return patina_scene_pick_nearest(stage.scene, NULL, &pick, place, NULL, to);
}

static unsigned char *filled(const char *name, int (*call)(void *), size_t size)
{
    unsigned char *to = malloc(size);
    assert_non_null(to);
    memset(to, 0xab, size);
    memcpy(to, &size, sizeof size);
    if (call(to))
        fail_msg("%s of %zu bytes is refused", name, size);
    size_t kept;
    memcpy(&kept, to, sizeof kept);
    assert_int_equal(kept, size);
    return to;
}

static void check_output(const char *name, int (*call)(void *), size_t size)
{
    const size_t wrong[] = {0, 1, sizeof(size_t), (size_t)1 << 40};
    unsigned char *whole = filled(name, call, size), *more = filled(name, call, size + MORE);
    assert_memory_equal(more + sizeof size, whole + sizeof size, size - sizeof size);
    for (size_t i = size; i < size + MORE; i++)
        assert_int_equal(more[i], 0);
    for (size_t cut = 16; cut < size; cut += 8) {
        unsigned char *to = filled(name, call, cut);
        assert_memory_equal(to + sizeof size, whole + sizeof size, cut - sizeof size);
        free(to);
    }
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++) {
        memcpy(whole, wrong + i, sizeof *wrong);
        if (call(whole) != PATINA_ERROR_ARGUMENT)
            fail_msg("%s: struct_size %zu is not refused", name, wrong[i]);
    }
    assert_int_equal(call(NULL), PATINA_ERROR_ARGUMENT);
    free(whole);
    free(more);
}

static void test_what_is_written(void **state)
{
    (void)state;
    patina_scene_clear(stage.scene);
    assert_int_equal(patina_scene_add_cloud(stage.scene, stage.cloud, NULL), PATINA_OK);
    patina_camera camera = {.struct_size = sizeof camera};
    assert_int_equal(patina_scene_frame_camera(stage.scene, 0, 0, 0, &camera), PATINA_OK);
    assert_int_equal(patina_scene_set_camera(stage.scene, &camera), PATINA_OK);
    assert_int_equal(patina_frame_render(stage.frame, stage.scene), PATINA_OK);
    check_output("patina_device_info", device_info, sizeof(patina_device_info));
    check_output("patina_cloud_info", cloud_info, sizeof(patina_cloud_info));
    check_output("patina_mesh_info", mesh_info, sizeof(patina_mesh_info));
    check_output("patina_file_info", file_info, sizeof(patina_file_info));
    check_output("patina_file_attribute", file_attribute, sizeof(patina_file_attribute));
    check_output("patina_frame_stats", frame_stats, sizeof(patina_frame_stats));
    check_output("patina_scene_frame_camera", framed_camera, sizeof(patina_camera));
    check_output("patina_scene_pick_nearest", picked, sizeof(patina_picked));
    check_output("patina_panorama_camera", face_camera, sizeof(patina_camera));
}

// ---- zero and default ------------------------------------------------------------------------------------------------------

// The middle of a picture of the cloud, close up, filled, on grey paper where there are effects.
static void middle(const patina_cloud_style *style, const patina_effects *effects, float rgba[4])
{
    static float pixels[16 * 16][4];
    const patina_settings settings = {.struct_size = sizeof settings, .width = 16, .height = 16, .world_color = {1, 1, 1}};
    patina_camera camera = {.struct_size = sizeof camera};
    patina_scene_clear(stage.scene);
    assert_int_equal(patina_scene_add_cloud(stage.scene, stage.bare, style), PATINA_OK);
    assert_int_equal(patina_scene_set_settings(stage.scene, &settings), PATINA_OK);
    assert_int_equal(patina_scene_set_effects(stage.scene, effects), PATINA_OK);
    assert_int_equal(patina_scene_set_lines(stage.scene, NULL), PATINA_OK);
    assert_int_equal(patina_scene_frame_camera(stage.scene, 0, 89, 0, &camera), PATINA_OK);
    assert_int_equal(patina_scene_set_camera(stage.scene, &camera), PATINA_OK);
    assert_int_equal(patina_frame_render(stage.frame, stage.scene), PATINA_OK);
    assert_int_equal(patina_frame_read(stage.frame, PATINA_PASS_COMBINED, pixels[0], sizeof pixels), PATINA_OK);
    memcpy(rgba, pixels[8 * 16 + 8], 4 * sizeof *rgba);
}

static void test_black_is_black(void **state)
{
    (void)state;
    const patina_cloud_style zero = {.struct_size = sizeof zero};
    patina_cloud_style style = PATINA_CLOUD_STYLE_INIT;
    float plain[4], same[4], black[4];
    middle(NULL, NULL, plain);
    assert_true(plain[0] > 0.5f); // grey in white light
    middle(&style, NULL, same);
    assert_memory_equal(same, plain, sizeof plain);
    middle(&zero, NULL, same);
    assert_memory_equal(same, plain, sizeof plain);
    memset(style.color, 0, sizeof style.color);
    middle(&style, NULL, black);
    assert_true(black[0] == 0.0f && black[1] == 0.0f && black[2] == 0.0f && black[3] == 1.0f);
    style = (patina_cloud_style)PATINA_CLOUD_STYLE_INIT;
    style.ambient = style.diffuse = 0.0f; // no light of any kind
    middle(&style, NULL, black);
    assert_true(black[0] == 0.0f && black[3] == 1.0f);

    patina_effects effects = PATINA_EFFECTS_INIT;
    effects.paper_grain = 1e-6f;
    middle(NULL, &effects, same);
    assert_true(same[0] > 0.9f * plain[0]);
    memset(effects.paper_color, 0, sizeof effects.paper_color);
    middle(NULL, &effects, black);
    assert_true(black[0] == 0.0f && black[3] == 1.0f);
    effects.exact = 0;
    middle(NULL, &effects, black);
    assert_memory_equal(black, same, sizeof same);
}

// Where zero means what the table of effects says, it is zero; colours, of which it does not, are spelled out.
static void test_effects_begin_as_the_table_says(void **state)
{
    (void)state;
    const patina_effects begun = PATINA_EFFECTS_INIT;
#define PATINA_EFFECT_NUMBER(field, ...) assert_true(begun.field == 0.0f);
#define PATINA_EFFECT_COUNT(field, ...) assert_int_equal(begun.field, 0);
#define PATINA_EFFECT_COLOR(field, when, zero, ...)                                                                            \
    assert_true(begun.field[0] == (float)(zero) && begun.field[1] == (float)(zero) && begun.field[2] == (float)(zero));
#define PATINA_EFFECT_AXIS(field, ...) assert_true(begun.field[0] == 0.0f && begun.field[1] == 0.0f && begun.field[2] == 0.0f);
#include "patina/effects.def"
}

static int set_up(void **state)
{
    (void)state;
    static const char text[] = "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n"
                               "property float time\nend_header\n1 2 3 4\n";
    for (uint32_t i = 0; i < POINTS; i++) {
        stage.row[i] = i / 8;
        stage.column[i] = i % 8;
        stage.points[i][0] = (float)(i % 8);
        stage.points[i][1] = (float)(i / 8);
    }
    const patina_device_desc device_desc = {.struct_size = sizeof device_desc, .name = "cpu", .threads = 1};
    const patina_cloud_desc cloud_desc = {
        .struct_size = sizeof cloud_desc, .count = POINTS, .position = {stage.points, PATINA_FLOAT32, 3, 0}};
    const patina_mesh_desc mesh_desc = {.struct_size = sizeof mesh_desc,
                                        .vertex_count = 3,
                                        .position = {stage.points, PATINA_FLOAT32, 3, 0},
                                        .triangle_count = 1};
    return patina_device_create(&device_desc, &stage.device) || patina_cloud_create(&cloud_desc, NULL, &stage.cloud) ||
           patina_cloud_create(&cloud_desc, NULL, &stage.bare) || patina_mesh_create(&mesh_desc, &stage.mesh) ||
           patina_scene_create(&stage.scene) || patina_frame_create(stage.device, &stage.frame) ||
           patina_file_open_memory(text, sizeof text - 1, &stage.file);
}

static int tear_down(void **state)
{
    (void)state;
    patina_file_destroy(stage.file);
    patina_frame_destroy(stage.frame);
    patina_scene_destroy(stage.scene);
    patina_mesh_destroy(stage.mesh);
    patina_cloud_destroy(stage.bare);
    patina_cloud_destroy(stage.cloud);
    patina_device_destroy(stage.device);
    return 0;
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_what_is_read),
        cmocka_unit_test(test_what_is_written),
        cmocka_unit_test(test_black_is_black),
        cmocka_unit_test(test_effects_begin_as_the_table_says),
    };
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
