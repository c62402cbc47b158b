// SPDX-License-Identifier: GPL-3.0-or-later
// Styles of `patina draw`: those of addon/presets/styles that need no data of their own, without cast shadows.
#include "draw.h"
#include "base/color.h"
#include "base/elementary.h"
#include "base/words.h"

#include <math.h>
#include <string.h>

#define PI 3.14159265358979323846
enum { NONE = -1 }; // of a color

// Values that a file leaves out are the defaults of the add-on's properties. Colors are sRGB, as in the files.
struct draw_style {
    const char *name;
    int32_t color, background;
    uint32_t source, smooth;             // of colors
    float exposure, contrast, opacity;   // contrast, opacity: 0 is 1
    int32_t lamp, ambient;               // lamp NONE: unlit
    double azimuth, height, power, fill; // degrees, from behind the viewer
    float width, soft, line_opacity;     // width 0: no lines
    uint32_t line_source;
    int32_t line;
    const char *effects[5]; // as of --effect; NULL behind the last
};

// clang-format off
static const struct draw_style styles[] = {
    {"plaster",    0xece7de, 0x54585f, PATINA_COLOR_FIXED, PATINA_SMOOTH_GAUSSIAN, 0, 0, 0,
     0xfff6ea, 0x7c8594, -60, 38, 3.1, 0.12, 0, 0, 0, 0, 0, {"obscurance_strength=1.2"}},
    {"technical",  0xd8dade, 0xffffff, PATINA_COLOR_FIXED, 0, 0, 0, 0,
     NONE, 0, 0, 0, 0, 0, 1.5f, 0, 1, PATINA_LINE_FIXED, 0, {"edl_strength=1.2", "edl_radius=1.4"}},
    {"ink",        0xffffff, 0xffffff, PATINA_COLOR_FIXED, PATINA_SMOOTH_GAUSSIAN, 0, 0, 0,
     0xffffff, 0x6a6a6a, -60, 38, 2, 0.05, 2.5f, 0, 1, PATINA_LINE_FIXED, 0x08080a,
     {"obscurance_strength=1", "hatch_levels=2", "hatch_spacing=6", "hatch_color=0.01,0.01,0.012", "hatch_ground=1"}},
    {"blueprint",  0x3a6cb4, 0x1c4580, PATINA_COLOR_FIXED, 0, 0, 0, 0,
     0xffffff, 0xc0c0c0, 50, 20, 1.2, 0, 1.5f, 0, 1, PATINA_LINE_FIXED, 0xf2f7ff,
     {"obscurance_strength=1", "paper_color=1,1,1", "paper_grain=0.12"}},
    {"museum",     0xe7e7e7, 0x17181b, PATINA_COLOR_OWN, 0, 0, 0, 0,
     0xfff0dc, 0x5a606a, -58, 40, 5.5, 0.06, 0, 0, 0, 0, 0, {"obscurance_strength=1"}},
    {"watercolor", 0xe7e7e7, 0xffffff, PATINA_COLOR_OWN, PATINA_SMOOTH_BOX, 1, 0.85f, 0,
     0xffffff, 0xb4bccc, -55, 45, 3.2, 0.2, 3, 0.7f, 0.8f, PATINA_LINE_POINT, 0x959595, // 0.3 of the points' own
     {"obscurance_strength=0.8", "toon_bands=3", "toon_softness=0.5", "paper_color=0.939,0.888,0.776", "paper_grain=0.22"}},
    {"night",      0xe7e7e7, 0x04050a, PATINA_COLOR_HEIGHT, 0, 0.8f, 0, 0,
     NONE, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, {"edl_strength=1.6", "edl_radius=2", "obscurance_strength=1"}},
    {"xray",       0xbfe4ff, 0x02060c, PATINA_COLOR_FIXED, 0, 0, 0, 0.28f,
     0xffffff, 0x3a4858, 170, 15, 7, 0.7, 0, 0, 0, 0, 0, {"edl_strength=1", "edl_radius=1.4"}},
};
// clang-format on

int draw_find_style(const char *name, const struct draw_style **style)
{
    *style = NULL;
    for (size_t i = 0; i < sizeof styles / sizeof *styles; i++)
        if (pt_same_word(name, styles[i].name))
            *style = &styles[i];
    return *style || pt_same_word(name, "scan") ? 0 : -1;
}

static void put_color(int32_t hex, float color[3])
{
    for (int k = 0; k < 3; k++)
        color[k] = (float)pt_linear_of_srgb((hex >> 8 * (2 - k) & 0xFF) / 255.0);
}

void draw_style_settings(const struct draw_style *style, patina_settings *settings)
{
    settings->film_transparent = !style;
    if (!style)
        return;
    settings->smooth = style->smooth;
    settings->own_background = 1;
    put_color(style->background, settings->background);
    if (style->lamp != NONE)
        put_color(style->ambient, settings->world_color);
}

int draw_style_cloud(const struct draw_style *style, const patina_cloud *cloud, patina_scene *scene)
{
    if (!style)
        return patina_scene_add_cloud(scene, cloud, NULL);
    const struct tool_color color = {.source = style->source, .exposure = style->exposure, .contrast = style->contrast};
    patina_cloud_style look = PATINA_CLOUD_STYLE_INIT;
    float table[PATINA_MAX_RAMP][3];
    look.lighting = style->lamp == NONE ? PATINA_LIGHTING_UNLIT : PATINA_LIGHTING_LIT;
    look.transparency = style->opacity > 0 ? 1 - style->opacity : 0;
    const int code = tool_set_color(&color, cloud, table, &look);
    put_color(style->color, look.color);
    return code ? code : patina_scene_add_cloud(scene, cloud, &look);
}

int draw_style_effects(const struct draw_style *style, patina_scene *scene)
{
    patina_effects effects = PATINA_EFFECTS_INIT;
    for (int i = 0; style && i < 5 && style->effects[i]; i++)
        if (tool_parse_effect("--effect", style->effects[i], &effects))
            return PATINA_ERROR_ARGUMENT;
    return patina_scene_set_effects(scene, &effects);
}

int draw_style_lines(const struct draw_style *style, patina_scene *scene)
{
    patina_lines lines = PATINA_LINES_INIT;
    if (!style || !(style->width > 0))
        return patina_scene_set_lines(scene, NULL);
    lines.width = style->width;
    lines.soft = style->soft;
    lines.transparency = 1 - style->line_opacity;
    lines.source = style->line_source;
    put_color(style->line, lines.color);
    return patina_scene_set_lines(scene, &lines);
}

int draw_style_moves_surface(const struct draw_style *style) { return style && (style->width > 0 || style->opacity > 0); }

// Two suns, as the add-on's Studio Light: azimuths are from the drawing's right hand, turned with it around the vertical.
int draw_style_lights(const struct draw_style *style, const double right[3], patina_scene *scene)
{
    int code = PATINA_OK;
    for (int i = 0; i < 2 && !code; i++) {
        const double power = i ? style->power * style->fill : style->power,
                     height = i ? fabs(style->height) / 3 : style->height;
        const double up = height * PI / 180, turn = (style->azimuth + 120 * i) * PI / 180, level = hypot(right[0], right[1]);
        const double x = level > 0 ? right[0] / level : 1, y = level > 0 ? right[1] / level : 0;
        const double aside = pt_sin(turn) * pt_cos(up), near = pt_cos(turn) * pt_cos(up);
        patina_light_desc light = {.struct_size = sizeof light,
                                   .type = PATINA_LIGHT_SUN,
                                   .power = (float)power,
                                   .direction = {-(x * aside + y * near), -(y * aside - x * near), -pt_sin(up)}};
        if (!(power > 0))
            continue;
        put_color(style->lamp, light.color);
        code = patina_scene_add_light(scene, &light);
    }
    return code;
}
