// SPDX-License-Identifier: GPL-3.0-or-later
// patina render FILE... -o OUT.png; patina scatter; and what patina merge does of keys
#include "view.h"
#include "base/trust.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

// What one run holds; everything may be NULL.
struct job {
    struct tool_options options;
    const struct tool_parts *parts;
    char *text;     // the arguments that say what the picture is
    uint32_t round; // that a merge asks for; 0: the picture is done
    patina_device *device;
    patina_device_info device_info;
    patina_progress *progress;
    patina_cloud **clouds; // options.file_count, as fields, of those that have one
    patina_field **fields;
    struct tool_scans *scans; // beside them
    patina_grade **grades;
    patina_mesh *meshes[TOOL_MESHES];
    patina_scene *scene;
    patina_frame *frame;
    struct tool_box box;
    float *pixels;
    patina_panorama panorama; // where the options ask for one
    patina_frame_stats stats; // of the picture
    double analysis_ms;
    int stripped; // it was too large, and was drawn and written in strips
    int lost;     // files could not be read any more: pictures lack their points
};

static void destroy(struct job *job)
{
    tool_cancellable(NULL, NULL);
    patina_frame_destroy(job->frame);
    patina_scene_destroy(job->scene);
    for (int i = 0; job->fields && i < job->options.file_count; i++)
        patina_field_destroy(job->fields[i]);
    for (int i = 0; job->clouds && i < job->options.file_count; i++)
        patina_cloud_destroy(job->clouds[i]);
    for (int i = 0; job->scans && i < job->options.file_count; i++)
        patina_scans_destroy(job->scans[i].made);
    for (int i = 0; job->grades && i < job->options.file_count; i++)
        patina_grade_destroy(job->grades[i]);
    free(job->grades);
    free(job->fields);
    for (int i = 0; i < job->options.mesh_count; i++)
        patina_mesh_destroy(job->meshes[i]);
    free(job->clouds);
    free(job->scans);
    patina_progress_destroy(job->progress);
    patina_device_destroy(job->device);
    free(job->pixels);
    free(job->text);
}

static int open_device(struct job *job)
{
    const patina_device_desc desc = {
        .struct_size = sizeof desc,
        .name = job->options.device,
        .threads = job->options.threads,
        .batch = job->options.batch,
        .mapped_cap = job->options.memory,
    };
    int code = patina_device_create(&desc, &job->device);
    if (code)
        return tool_failed(job->options.device ? job->options.device : "auto", NULL, code);
    job->device_info.struct_size = sizeof job->device_info;
    code = patina_device_get_info(job->device, &job->device_info);
    return code ? tool_failed("device", job->device, code) : TOOL_OK;
}

static int load_meshes(struct job *job)
{
    for (int i = 0; i < job->options.mesh_count; i++) {
        int code = tool_load_mesh(job->options.meshes[i], &job->meshes[i]);
        if (!code)
            code = patina_scene_add_mesh(job->scene, job->meshes[i], NULL);
        if (code)
            return tool_failed(job->options.meshes[i], NULL, code);
    }
    return TOOL_OK;
}

// Range images need none, but for what hides points by it, and for passes of it.
static int needs_analysis(const struct tool_options *options, int has_normals)
{
    const struct tool_color *color = &options->color;
    return options->settings.surface != PATINA_SURFACE_RANGES || options->soft.model || color->free_space ||
           color->hidden_kinds || color->least_trust > 0.0f || color->source == PATINA_COLOR_TRUST ||
           (options->cull && !has_normals) || options->pass == PATINA_PASS_TRUST || options->pass == PATINA_PASS_THICKNESS;
}

static int analyse(struct job *job, patina_cloud *cloud, const char *path, const struct tool_stations *stations)
{
    patina_analysis_desc desc = {.struct_size = sizeof desc, .threads = job->options.threads, .keep_normals = 1};
    tool_describe_stations(stations, &desc);
    desc.keep_colors = job->options.color.keep_colors;
    desc.free_space = job->options.color.free_space != PATINA_FREE_SPACE_OFF;
    patina_cloud_info info = {.struct_size = sizeof info};
    const int error = patina_cloud_get_info(cloud, &info);
    if (error || info.has_shapes || job->options.analysis == TOOL_UNANALYSED || // a saved cloud knows
        (job->options.analysis == TOOL_ANALYSED_WHERE_NEEDED && !needs_analysis(&job->options, (int)info.has_normals)))
        return error;
    const double start = pt_milliseconds();
    if (job->options.analysis == TOOL_ANALYSED_BY_GRID)
        tool_use_grid(stations, path, &desc);
    const int code = patina_cloud_analyse(cloud, &desc, job->progress);
    job->analysis_ms += pt_milliseconds() - start;
    if (code == PATINA_ERROR_TOO_MANY_POINTS && job->options.analysis == TOOL_ANALYSED_WHERE_NEEDED) {
        tool_say("note: %s is drawn without an analysis: it has more points than one takes", path);
        return PATINA_OK;
    }
    return code;
}

static int load_clouds(struct job *job)
{
    const struct tool_options *options = &job->options;
    job->clouds = calloc((size_t)options->file_count + 1, sizeof *job->clouds);
    job->scans = calloc((size_t)options->file_count + 1, sizeof *job->scans);
    job->fields = calloc((size_t)options->file_count + 1, sizeof *job->fields);
    job->grades = calloc((size_t)options->file_count + 1, sizeof *job->grades);
    int code = job->clouds && job->scans && job->fields && job->grades ? patina_progress_create(&job->progress)
                                                                       : PATINA_ERROR_MEMORY;
    if (!code)
        code = patina_scene_create(&job->scene);
    if (code)
        return tool_failed("scene", NULL, code);

    patina_cloud_style style = PATINA_CLOUD_STYLE_INIT;
    style.lighting = options->lighting;
    style.cull_back = options->cull ? 1 : 0;
    style.radius = (float)options->radius;
    style.largest_gap = (float)options->largest_gap;
    style.d_min = (float)options->layer_distance;
    style.range_gamma = (float)options->range_gamma;
    style.range_pixel = (float)options->range_pixel;
    style.range_sharpness = (float)options->range_sharpness;
    style.range_cull = (float)(options->range_culling * 3.14159265358979323846 / 180.0);
    float table[PATINA_MAX_RAMP][3];
    tool_cancellable(job->progress, NULL);
    for (int i = 0; i < options->file_count; i++) {
        patina_cloud_info info = {.struct_size = sizeof info};
        struct tool_stations stations = {0};
        float *numbers = NULL;
        code = tool_load_cloud(options->files[i], &options->color,
                               tool_is_soft(&options->soft, i) ? options->soft.attribute : "", job->progress, &job->clouds[i],
                               &numbers, &stations, &job->scans[i]);
        if (!code)
            code = analyse(job, job->clouds[i], options->files[i], &stations);
        if (!code)
            code = tool_balance(&stations, &options->color, job->clouds[i], job->progress, &job->grades[i]);
        if (!code && options->pass == PATINA_PASS_DISAGREEMENT && !job->scans[i].made)
            code = tool_make_scans(&stations, options->files[i], job->clouds[i], &job->scans[i].made);
        tool_free_stations(&stations);
        if (!code)
            code = patina_cloud_get_info(job->clouds[i], &info);
        if (!code)
            code = tool_set_soft(&options->soft, i, job->clouds[i], numbers, job->progress, &job->fields[i], &style);
        free(numbers);
        if (code)
            return tool_failed(options->files[i], NULL, code);
        if (!info.count)
            tool_say("warning: %s holds no points", options->files[i]);
        if (options->opacity_count)
            style.transparency = (float)(1 - options->opacity[i < options->opacity_count ? i : options->opacity_count - 1]);
        style.scans = job->scans[i].made;
        style.grade = job->grades[i];
        if (options->range_culling > 0.0 && !job->scans[i].directed)
            tool_say("warning: %s does not say in which direction its scans were taken: none is left out", options->files[i]);
        code = tool_set_color(&options->color, job->clouds[i], table, &style);
        if (!code)
            code = patina_scene_add_cloud(job->scene, job->clouds[i], &style);
        if (code)
            return tool_failed(options->files[i], job->scene, code);
    }
    code = tool_add_clips(&options->color, job->scene);
    return code ? tool_failed("clip", job->scene, code) : load_meshes(job);
}

static int set_view(struct job *job, double turn, patina_camera *camera)
{
    if (job->options.panorama[0]) {
        uint32_t side;
        tool_panorama(&job->options, &job->box, &job->panorama);
        const int bad = patina_panorama_camera(&job->panorama, 0, camera, &side);
        return bad ? bad : patina_scene_set_camera(job->scene, camera);
    }
    const int code = tool_camera(&job->options, job->scene, &job->box, turn, camera);
    return code ? code : patina_scene_set_camera(job->scene, camera);
}

static int set_scene(struct job *job)
{
    patina_camera camera = {.struct_size = sizeof camera};
    int code = patina_scene_set_settings(job->scene, &job->options.settings);
    if (!code)
        code = patina_scene_extent(job->scene, job->box.min, job->box.max);
    if (!code)
        code = patina_scene_set_effects(job->scene, &job->options.effects);
    if (!code)
        code = patina_scene_set_lines(job->scene, job->options.has_lines ? &job->options.lines : NULL);
    if (!code)
        code = set_view(job, 0, &camera);
    if (!code)
        code = tool_lights(job->scene, &job->options, &camera);
    if (!code)
        code = patina_frame_create(job->device, &job->frame);
    if (code)
        return tool_failed("scene", job->scene, code);
    tool_cancellable(NULL, job->frame);
    return tool_cancelled() ? tool_failed("scene", NULL, PATINA_ERROR_CANCELLED) : TOOL_OK;
}

static int shadows(struct job *job)
{
    const struct tool_options *options = &job->options;
    int code = PATINA_OK;
    if (options->load_shadows)
        code = patina_frame_load_shadows(job->frame, job->scene, options->load_shadows);
    if (!code && options->save_shadows)
        code = patina_frame_bake_shadows(job->frame, job->scene);
    if (!code && options->save_shadows)
        code = patina_frame_save_shadows(job->frame, options->save_shadows);
    return code ? tool_failed(options->load_shadows ? options->load_shadows : options->save_shadows, job->frame, code)
                : TOOL_OK;
}

static int dump_plan(struct job *job)
{
    const size_t size = patina_frame_plan_text(job->frame, job->scene, NULL, 0) + 1;
    char *text = calloc(size, 1);
    if (!text || size == 1) {
        free(text);
        return tool_failed("plan", job->frame, PATINA_ERROR_INTERNAL);
    }
    patina_frame_plan_text(job->frame, job->scene, text, size);
    fputs(text, job->options.json ? stderr : stdout); // with --stats, standard output is one JSON object
    free(text);
    return TOOL_OK;
}

// The picture, with the camera as asked for, of a region; also the warm-up of the measurement. Returns a code of patina.h.
static int try_region(struct job *job, const uint32_t region[4], double *ms)
{
    const double start = pt_milliseconds();
    if (job->options.panorama[0]) {
        const int bad = tool_draw_panorama(&job->options, &job->panorama, job->scene, job->frame, &job->pixels, &job->stats);
        job->lost |= job->stats.points_lost > 0;
        *ms = pt_milliseconds() - start;
        return bad;
    }
    const size_t count = (size_t)(region[2] - region[0]) * (region[3] - region[1]), size = count * 4 * sizeof(float);
    patina_settings settings = job->options.settings;
    memcpy(settings.region, region, sizeof settings.region);
    int code = patina_scene_set_settings(job->scene, &settings);
    if (!code && job->options.output && !(job->pixels = malloc(size))) { // before any work is done
        code = patina_frame_check(job->frame, job->scene);               // whose message has figures
        code = code ? code : PATINA_ERROR_TOO_LARGE;
    }
    if (!code && job->options.planes)
        code = patina_frame_keep_planes(job->frame, 1);
    if (!code && job->parts->count)
        code = patina_frame_merge(job->frame, job->scene, job->parts->keys, (uint32_t)job->parts->count, job->parts->next,
                                  &job->round);
    else if (!code)
        code = patina_frame_render(job->frame, job->scene);
    *ms = pt_milliseconds() - start;
    job->stats.struct_size = sizeof job->stats;
    if (job->round)
        return PATINA_OK;
    if (!code)
        code = patina_frame_get_stats(job->frame, &job->stats);
    job->lost |= job->stats.points_lost > 0;
    if (!code && job->options.planes)
        code = patina_frame_dump_planes(job->frame, job->options.planes);
    if (!code && job->options.output) {
        code = patina_frame_read(job->frame, PATINA_PASS_COMBINED, job->pixels, size);
        if (!code && job->options.pass != PATINA_PASS_COMBINED)
            code = tool_color_pass(&job->options, job->frame, count, job->pixels);
    }
    return code;
}

static int draw_failed(const struct job *job, int code)
{
    return code ? tool_failed(job->options.panorama[0] ? "panorama" : "render", job->frame, code) : TOOL_OK;
}

enum { LEAST_STRIP = 16 }; // rows: the margin around them is wider

// Some rows at a time, from the top, which are written before the next are drawn. rows: at most; where these are too large for the memory
// or the device, half as many.
static int draw_strips(struct job *job, const uint32_t region[4], uint32_t rows, double *ms)
{
    const struct tool_options *options = &job->options;
    const uint32_t width = region[2] - region[0], height = region[3] - region[1];
    char text[160];
    tool_tile_text(options, text, sizeof text);
    struct tool_png *png = tool_png_open(options->output, width, height, options->transparent,
                                         options->tile ? tool_tile_name : NULL, text);
    int result = png ? TOOL_OK : TOOL_FAILED;
    for (uint32_t end = region[3]; end > region[1] && !result;) {
        const uint32_t left = end - region[1], some = left < rows ? left : rows;
        double part = 0;
        const int code = try_region(job, (uint32_t[]){region[0], end - some, region[2], end}, &part);
        if (code == PATINA_ERROR_TOO_LARGE && some > LEAST_STRIP) {
            rows = some / 2;
        } else {
            result = draw_failed(job, code);
            if (!result && tool_png_rows(png, job->pixels, some))
                result = TOOL_FAILED;
            end -= some;
        }
        free(job->pixels);
        job->pixels = NULL;
        *ms += part;
    }
    if (png && tool_png_close(png, !result) && !result)
        result = TOOL_FAILED;
    job->stats.width = width;
    job->stats.height = height;
    return result;
}

// Of a strip: at most so many, and half of them as often as the memory or the device demands. 0: no strip fits, and the message says so of
// the whole.
static uint32_t rows_that_fit(struct job *job, const uint32_t region[4], uint32_t most)
{
    const uint32_t height = region[3] - region[1];
    patina_settings settings = job->options.settings;
    uint32_t rows = most < height ? most : height;
    for (;; rows /= 2) {
        // That in the middle needs most, for it has margins on both sides.
        const uint32_t low = region[1] + (height - rows) / 2;
        memcpy(settings.region, (uint32_t[]){region[0], low, region[2], low + rows}, sizeof settings.region);
        int code = patina_scene_set_settings(job->scene, &settings);
        code = code ? code : patina_frame_check(job->frame, job->scene);
        if (code != PATINA_ERROR_TOO_LARGE) // what else is wrong, drawing says
            return rows;
        if (rows / 2 < LEAST_STRIP)
            break;
    }
    memcpy(settings.region, region, sizeof settings.region);
    patina_scene_set_settings(job->scene, &settings);
    patina_frame_check(job->frame, job->scene);
    return 0;
}

// The whole picture, or strips where it is too large.
static int draw(struct job *job, double *ms)
{
    const struct tool_options *options = &job->options;
    uint32_t region[4] = {0, 0, options->settings.width, options->settings.height};
    if (options->settings.region[2])
        memcpy(region, options->settings.region, sizeof region);
    if (options->strip) {
        const uint32_t fit = rows_that_fit(job, region, options->strip); // before the first is drawn
        return fit ? draw_strips(job, region, fit, ms) : draw_failed(job, PATINA_ERROR_TOO_LARGE);
    }
    const int code = try_region(job, region, ms);
    if (code != PATINA_ERROR_TOO_LARGE || !tool_may_strip(options) || job->parts->count)
        return draw_failed(job, code);
    free(job->pixels);
    job->pixels = NULL;
    const uint32_t rows = rows_that_fit(job, region, (region[3] - region[1] + 1) / 2);
    if (!rows)
        return draw_failed(job, code);
    job->stripped = 1;
    return draw_strips(job, region, rows, ms);
}

static int scatter(struct job *job)
{
    const struct tool_options *options = &job->options;
    const patina_part part = {.struct_size = sizeof part,
                              .part = options->part[0],
                              .of = options->part[1],
                              .behind = options->behind,
                              .note = job->text};
    const double start = pt_milliseconds();
    const int code = patina_frame_scatter(job->frame, job->scene, &part, options->output);
    if (code)
        return tool_failed("scatter", job->frame, code);
    tool_say("%s: part %u of %u, %s, %.1f ms", options->output, part.part, part.of, job->device_info.name,
             pt_milliseconds() - start);
    return TOOL_OK;
}

static int write_picture(const struct job *job)
{
    const struct tool_options *options = &job->options;
    char text[160];
    tool_tile_text(options, text, sizeof text);
    return tool_write_png(options->output, job->pixels, job->stats.width, job->stats.height, options->transparent,
                          options->tile ? tool_tile_name : NULL, text);
}

static int measure(struct job *job)
{
    struct tool_times *times = tool_times_create(job->options.repeat);
    int code = times ? patina_frame_measure(job->frame, job->options.json != 0) : PATINA_ERROR_MEMORY;
    for (int i = 1; i <= job->options.repeat && !code; i++) {
        patina_camera camera = {.struct_size = sizeof camera};
        code = tool_cancelled() ? PATINA_ERROR_CANCELLED : set_view(job, i, &camera);
        const double start = pt_milliseconds();
        if (!code)
            code = patina_frame_render(job->frame, job->scene);
        const double ms = pt_milliseconds() - start;
        patina_frame_stats stats = {.struct_size = sizeof stats};
        if (!code)
            code = patina_frame_get_stats(job->frame, &stats);
        job->lost |= stats.points_lost > 0;
        if (!code && tool_times_add(times, ms, job->frame))
            code = PATINA_ERROR_MEMORY;
    }
    if (!code && job->options.json)
        tool_times_print(times, job->device_info.name, &job->stats, job->analysis_ms);
    else if (!code)
        tool_say("median of %d frames: %.2f ms", job->options.repeat, tool_times_median(times));
    tool_times_destroy(times);
    return code ? tool_failed("render", job->frame, code) : TOOL_OK;
}

// Prints one warning for each file of which no point has the trust that the options ask for.
static void warn_of_untrusted(const struct job *job)
{
    for (int i = 0; i < job->options.file_count; i++) {
        patina_cloud_info info = {.struct_size = sizeof info};
        if (!job->clouds[i] || patina_cloud_get_info(job->clouds[i], &info) || !info.has_shapes)
            continue;
        const double asked = (double)job->options.color.least_trust;
        const double least = asked == 0.0 ? info.trust_default : asked;
        const uint64_t untrusted = pt_points_below(&info, pt_lowest_level(least));
        if (untrusted && untrusted == pt_points_below(&info, PT_TRUST_TOP + 1))
            tool_say(
                "warning: %s: none of %llu points is trusted, so all of them are drawn. They may all be strays (see --trust)",
                job->options.files[i], (unsigned long long)untrusted);
    }
}

static int run(struct job *job)
{
    const struct tool_options *options = &job->options;
    double ms = 0;
    int result = open_device(job);
    if (!result)
        result = load_clouds(job);
    if (!result)
        result = set_scene(job);
    if (!result && options->dump_plan)
        result = dump_plan(job);
    if (!result && options->panorama[0] && !tool_panorama_fits(&job->panorama))
        result = TOOL_FAILED;
    if (!result)
        result = shadows(job);
    if (result || (!options->output && !options->planes && !options->repeat))
        return result;
    if (job->parts->scatter)
        return scatter(job);

    result = draw(job, &ms);
    if (!result && job->round) {
        tool_say("%s: round %u is wanted: scatter all parts --behind %s, and merge the keys of all rounds", options->output,
                 job->round, job->parts->next);
        return TOOL_AGAIN;
    }
    if (!result && job->stats.none_trusted)
        warn_of_untrusted(job);
    if (!result && options->output) {
        if (!options->strip && !job->stripped && write_picture(job))
            return TOOL_FAILED;
        char left_out[64] = "";
        if (job->stats.untrusted)
            snprintf(left_out, sizeof left_out, " (%llu left out for their trust)", (unsigned long long)job->stats.untrusted);
        tool_say("%s: %llu points%s, %ux%u, %s, %.1f ms", options->output, (unsigned long long)job->stats.points, left_out,
                 job->stats.width, job->stats.height, job->device_info.name, ms);
    }
    if (!result && options->repeat)
        result = measure(job);
    return result;
}

int tool_draw(int count, char **arguments, const struct tool_parts *parts)
{
    struct job job = {.parts = parts, .text = tool_options_text(count, arguments)};
    int result = job.text ? tool_parse_render(count, arguments, &job.options)
                          : tool_failed("render", NULL, PATINA_ERROR_MEMORY);
    if (!result)
        result = tool_check_farm(&job.options, parts->scatter);
    job.options.digest = result ? 0 : tool_digest(job.text);
    if (!result)
        result = run(&job);
    tool_drain_log(job.options.verbose ? 2 : 1); // it names files that were lost
    result = !result && job.lost ? TOOL_FAILED : result;
    destroy(&job);
    return result;
}

int tool_render(int count, char **arguments) { return tool_draw(count, arguments, &(struct tool_parts){0}); }
