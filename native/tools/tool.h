// SPDX-License-Identifier: GPL-3.0-or-later
// The command line `patina`: what its files share. It sees nothing of the library but patina.h, and holds a
// base/platform.h of its own.
#ifndef TOOL_H
#define TOOL_H

#include "patina/patina.h"
#include "base/platform.h"

#include <stdio.h>

enum tool_exit { TOOL_OK = 0, TOOL_FAILED = 1, TOOL_USAGE = 2, TOOL_AGAIN = 3, TOOL_CANCELLED = 130 };

// Each takes the arguments after its own name and returns a tool_exit.
int tool_render(int count, char **arguments);
int tool_scatter(int count, char **arguments);
int tool_merge(int count, char **arguments);
int tool_info(int count, char **arguments);
int tool_convert(int count, char **arguments);
int tool_analyse(int count, char **arguments);
int tool_distance(int count, char **arguments);
int tool_ground(int count, char **arguments);
int tool_draw_lines(int count, char **arguments);
int tool_help(int count, char **arguments);

// The commands, the topics, and the names of their options.
void tool_print_usage(FILE *out);

// ---- messages, on stderr -----------------------------------------------------------------------------------------

// To standard output, without a line end. Characters that would command a terminal become question marks, as in tool_say.
void tool_print(const char *format, ...) __attribute__((format(printf, 1, 2)));
void tool_say(const char *format, ...) __attribute__((format(printf, 1, 2)));
// What messages begin with from now on: one of several jobs. NULL: nothing.
void tool_say_within(const char *what);
// Wrong use: the sentence and, of a command line, where help is. Returns TOOL_USAGE.
int tool_misuse(const char *format, ...) __attribute__((format(printf, 1, 2)));
// How a command takes its options. Both functions get `options`.
struct tool_syntax {
    const char *prefix;                                                    // of the message about an unknown option
    int (*take_switch)(const char *name, void *options);                   // 0 if it is an option without a value
    int (*take_value)(const char *name, const char *value, void *options); // 0; -1: a bad value; 1: no such option
};

// Takes all options; other arguments are files, and so are all after "--". Files are moved to the beginning of `arguments`, and *files is
// how many they are. A tool_exit: TOOL_USAGE after a message.
int tool_walk_options(const struct tool_syntax *syntax, int count, char **arguments, void *options, int *files);
// A library call failed: says `what` and the library's message. handle may be NULL. Returns a tool_exit.
int tool_failed(const char *what, const void *handle, int code);
// Passes the library's log on; level: the least important kind to show (1 warnings, 2 information too).
void tool_drain_log(int level);

// The attribute of a file by its name; *index is UINT32_MAX where there is none. count: the file's points. Returns a patina_error.
int tool_find_attribute(const patina_file *file, const char *name, uint64_t *count, uint32_t *index);

// ---- Ctrl-C ------------------------------------------------------------------------------------------------------

// What a signal shall cancel; NULL, NULL: nothing. The second signal always ends the program.
void tool_cancellable(patina_progress *progress, patina_frame *frame);
int tool_cancelled(void);

// ---- options -----------------------------------------------------------------------------------------------------

enum tool_view { VIEW_ANGLES, VIEW_LOOK };
enum tool_analysis { TOOL_ANALYSED_WHERE_NEEDED, TOOL_ANALYSED, TOOL_UNANALYSED, TOOL_ANALYSED_BY_GRID };

enum { TOOL_MOST_SIZE = 65536, TOOL_OPACITIES = 64, TOOL_MESHES = 64, TOOL_CLIPS = 64, TOOL_TILES = 65536 };

// Colours of points and clips.
struct tool_color {
    uint32_t source; // patina_color_source
    char attribute[64];
    const char *scalar; // the attribute that contour lines follow; NULL: the ramp's
    double range[2];
    int has_range;
    const char *ramp; // NULL: viridis
    float fixed[3], exposure, contrast;
    uint32_t hidden[8];
    uint32_t free_space, hidden_kinds; // of patina_cloud_style
    float least_trust;
    patina_clip clips[TOOL_CLIPS];
    int clip_count;
    float tint[4];        // and width; 0: none
    uint32_t keep_colors; // points without a color stay black
    int unbalanced;       // scans keep the light that they were taken with
};

// Soft points.
struct tool_soft {
    uint32_t model;                 // 0: none is soft; 1 + patina_soft_model
    uint32_t files[TOOL_OPACITIES]; // which of the files are, from 1 on
    int file_count;                 // 0: all
    uint32_t shells;
    double radius, opacity, modulation, threshold;
    patina_field_desc field; // without values
    char attribute[64];      // whose numbers these are; empty: it has none
    int divided;             // 1: by the field; 2: the threshold is given
    int shaped;              // one of the options beside --soft is given
};

struct tool_options {
    char **files; // into the argument vector
    int file_count;
    const char *output, *planes, *save_shadows, *load_shadows; // NULL: not asked for
    const char *device;
    uint32_t threads, batch;
    uint64_t memory; // bytes that a picture holds of .cloud files; 0: automatic
    enum tool_view view;
    double azimuth, elevation, fov;  // degrees; fov 0 = the library's default
    double eye[3], target[3];        // VIEW_LOOK, and the eye of a panorama
    uint32_t panorama[2];            // width and height; 0 = none
    double ortho_width;              // world units; 0 = perspective
    uint32_t lighting;               // patina_lighting
    double opacity[TOOL_OPACITIES];  // of the files in turn, the last of those behind it
    double radius;                   // of discs, world units; 0: automatic
    double largest_gap;              // that they close, world units; 0: automatic
    double layer_distance;           // world units; 0: automatic
    double range_gamma, range_pixel; // of range images; 0: automatic
    double range_sharpness;          // 0: one pass
    double range_culling;            // degrees; 0: none
    struct tool_soft soft;
    int opacity_count;               // 0: all opaque
    const char *meshes[TOOL_MESHES]; // OBJ files
    int mesh_count;
    uint32_t analysis; // tool_analysis
    int cull, transparent, shadows, headlight, sun, json, dump_plan, verbose;
    float ambient[3];
    double sun_at[3];        // degrees around z (as the camera's azimuth), above the horizon, diameter
    int repeat;              // measured frames; 0 = just the picture
    uint32_t tiles[2], tile; // columns and rows, and which, from 1 on, from the top left; 0: the whole picture
    uint32_t strip;          // rows that are drawn at a time; 0: all
    uint32_t part[2];        // of so many; 0: the whole cloud
    const char *behind;      // what the last round's merge left; NULL: the first
    uint64_t digest;         // of the arguments that say what the picture is
    patina_settings settings;
    patina_effects effects;
    struct tool_color color;
    int has_lines, line_options; // asked for; shaped
    uint32_t pass;               // patina_pass that the picture shows
    double pass_range[2];        // of its numbers, at the ramp's ends
    int has_pass_range;
    patina_lines lines;
};

// Reads between `least` and `most` numbers separated by commas. Returns how many, or -1.
int parse_numbers(const char *text, double *numbers, int least, int most);
// Bytes, of at least a megabyte: 500M, 2G, 1.5G. 0, or -1.
int tool_parse_memory(const char *text, uint64_t *bytes);
// Options of effects (effects.c): 0 good, -1 a bad value, 1 no such option.
int tool_parse_effect(const char *name, const char *value, patina_effects *effects);
void tool_print_effects(FILE *out);           // the lines of `patina help` about them
const char *tool_effect_option(size_t index); // the name of an effect's option; NULL behind the last

// NAME[,MIN,MAX] of a pass. 0, or -1 for a bad value.
int tool_parse_pass(const char *value, struct tool_options *options);

// Fills options from the arguments of `render`; files point into the vector, which is reordered. Returns a tool_exit.
int tool_parse_render(int count, char **arguments, struct tool_options *options);
// Whether an option of any command takes no value.
int tool_is_switch(const char *name);

// Options of tiles, strips and parts. 0 taken, -1 a bad value, 1 none of them.
int tool_parse_farm(const char *name, const char *value, struct tool_options *options);
// Whether they go with the others, once all are there; scatters: `patina scatter` asks. A tool_exit.
int tool_check_farm(struct tool_options *options, int scatters);
// Whether its strips are the whole picture: nothing is asked for that is found of the whole.
int tool_may_strip(const struct tool_options *options);
// An option of tool_soft: 0 taken, -1 a bad value, 1 none of them.
int tool_parse_soft(const char *name, const char *value, struct tool_soft *soft);
int tool_check_soft(const struct tool_soft *soft, int file_count); // together: a tool_exit
// Whether points of the file, from 0 on, may be soft; and how. numbers: of the field's attribute, or NULL. *field: the scene needs it.
int tool_is_soft(const struct tool_soft *soft, int file);
int tool_set_soft(const struct tool_soft *soft, int file, const patina_cloud *cloud, const float *numbers,
                  patina_progress *progress, patina_field **field, patina_cloud_style *style);

// An option of tool_color: 0 taken, -1 a bad value, 1 none of them.
int tool_parse_color(const char *name, const char *value, struct tool_color *color);

// Whether a file can be read and begins with these bytes, 16 at most.
int tool_begins(const char *path, const char *bytes, size_t size);

// What `convert` does where a built cloud is written.
struct tool_build {
    const char *in, *out, *attribute; // attribute: NULL: none
    uint64_t memory;                  // bytes; 0: automatic
    int unanalysed, pack, drop_order;
};
int tool_convert_to_cloud(const struct tool_build *build); // a tool_exit

// ---- clouds --------------------------------------------------------------------------------------------------------

// What a file knows of its scanner; station NULL: nothing.
struct tool_stations {
    uint32_t count, direction_count; // of stations; of scans whose beams are parallel, where there is no station
    double *places, *directions;
    uint16_t *station;     // scan of each point
    int told;              // by the file; 0: there is one scan, and all are of it
    int32_t *row, *column; // NULL: not known
};

int tool_take_stations(const patina_file *file, struct tool_stations *out); // a patina_error; free in any case
// Which scan each point is of, and how these were taken, for range images.
struct tool_scans {
    patina_scans *made; // NULL: the file tells of none
    int directed;       // of one at least it is known in which direction the scanner looked
};

// stations: of the same file. A patina_error.
int tool_take_scans(const patina_file *file, const struct tool_stations *stations, const patina_cloud *cloud,
                    struct tool_scans *out);
// Into the description of an analysis, which needs them until it is done.
void tool_describe_stations(const struct tool_stations *stations, patina_analysis_desc *desc);
// Its grids tell what every point knows, or a line of standard error says that there are none.
void tool_use_grid(const struct tool_stations *stations, const char *path, patina_analysis_desc *desc);
// Which of its scans each point is of; or a line of standard error says that this is not known. A patina_error.
int tool_make_scans(const struct tool_stations *stations, const char *path, const patina_cloud *cloud, patina_scans **out);
// Colors of the cloud whose scans are balanced (SPEC 11); *out stays NULL where nothing is to be balanced. A patina_error.
int tool_balance(const struct tool_stations *stations, const struct tool_color *color, const patina_cloud *cloud,
                 patina_progress *progress, patina_grade **out);
void tool_free_stations(struct tool_stations *stations);

extern const char *const tool_kinds[6]; // patina_kind

// Each returns a patina_error. table: room for the ramp, read until the cloud is added.
// numbers: of the attribute by that name, in the given order, to be freed; empty: of none. scans: NULL: not asked for.
int tool_load_cloud(const char *path, const struct tool_color *color, const char *attribute, patina_progress *progress,
                    patina_cloud **out, float **numbers, struct tool_stations *stations, struct tool_scans *scans);
int tool_set_color(const struct tool_color *color, const patina_cloud *cloud, float table[PATINA_MAX_RAMP][3],
                   patina_cloud_style *style);
int tool_add_clips(const struct tool_color *color, patina_scene *scene);

// ---- output ------------------------------------------------------------------------------------------------------

// Writes premultiplied linear RGBA, row 0 at the bottom, as an 8-bit sRGB PNG, whole or not at all; alpha: keep it. name: of a text
// in it; NULL: none. 0, or -1 after a message.
int tool_write_png(const char *path, const float *pixels, uint32_t width, uint32_t height, int alpha, const char *name,
                   const char *text);
// The same by parts, the picture's top first. NULL or -1 after a message; closing frees it in any case.
struct tool_png;
struct tool_png *tool_png_open(const char *path, uint32_t width, uint32_t height, int alpha, const char *name,
                               const char *text);
int tool_png_rows(struct tool_png *png, const float *pixels, uint32_t rows); // row 0 at the bottom
int tool_png_bytes(struct tool_png *png, const uint8_t *row);                // as they stand in the file
int tool_png_close(struct tool_png *png, int good);                          // not good: no file is written

// One row of premultiplied linear RGBA as sRGB of 8 or 16 bits. alpha: keep it; colors are then not premultiplied.
void tool_encode_row(uint8_t *row, const float *pixels, uint32_t width, int alpha);
void tool_encode_row16(uint16_t *row, const float *pixels, uint32_t width); // keeps alpha

// The pass that the options ask for, in place of colours in `count` pixels of premultiplied RGBA: where something is. Says the range
// of the ramp. A patina_error.
int tool_color_pass(const struct tool_options *options, const patina_frame *frame, size_t count, float *pixels);

// ---- tiles and parts -------------------------------------------------------------------------------------------------

// What `render` does in place of rendering.
struct tool_parts {
    int scatter;             // a part's keys
    const char *const *keys; // of all parts, to be merged
    int count;
    const char *next; // NULL, or where a further round is told what lies behind
};
int tool_draw(int count, char **arguments, const struct tool_parts *parts);
int tool_merge_tiles(int count, char **paths, const char *output);

extern const char tool_tile_name[]; // of the text in a tile's PNG
void tool_tile_text(const struct tool_options *options, char *text, size_t size);
// tile: from 1 on, from the top left, row by row. region: as patina_settings has it.
void tool_tile_region(const uint32_t tiles[2], uint32_t tile, uint32_t width, uint32_t height, uint32_t region[4]);
// The arguments that say what a picture is, as one text; the caller frees it. NULL without memory.
char *tool_options_text(int count, char **arguments);
uint64_t tool_digest(const char *text);

// Times of several frames, whole and by pass.
struct tool_times;
struct tool_times *tool_times_create(int frames);
void tool_times_destroy(struct tool_times *times);
// Adds a frame of `ms`, with its passes as the frame tells them. 0, or -1 without memory.
int tool_times_add(struct tool_times *times, double ms, const patina_frame *frame);
double tool_times_median(const struct tool_times *times);
// Prints one JSON object on stdout.
void tool_times_print(struct tool_times *times, const char *device, const patina_frame_stats *stats, double analysis_ms);

#endif
