// SPDX-License-Identifier: GPL-3.0-or-later
// `patina render`: soft points, and the fields that divide them.
#include "tool.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

// MODEL[,FILE...]
static int parse_soft(const char *text, struct tool_soft *soft)
{
    static const struct {
        const char *word;
        uint32_t model;
    } models[] = {{"base", PATINA_SOFT_BASE},
                  {"concentric", PATINA_SOFT_CONCENTRIC},
                  {"express", PATINA_SOFT_EXPRESS},
                  {"sp", PATINA_SOFT_SPLATS},
                  {"olt", PATINA_SOFT_ONE_LAYER}};
    const size_t length = strcspn(text, ",");
    double n[TOOL_OPACITIES];
    for (size_t k = 0; k < sizeof models / sizeof *models; k++)
        if (strlen(models[k].word) == length && !memcmp(models[k].word, text, length))
            soft->model = models[k].model + 1;
    soft->file_count = text[length] ? parse_numbers(text + length + 1, n, 1, TOOL_OPACITIES) : 0;
    for (int i = 0; i < soft->file_count; i++) {
        if (n[i] < 1 || n[i] > TOOL_MOST_SIZE || n[i] != floor(n[i]))
            return -1;
        soft->files[i] = (uint32_t)n[i];
    }
    return soft->model && soft->file_count >= 0 ? 0 : -1;
}

static void unit(double v[3])
{
    const double length = sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    for (int k = 0; k < 3; k++)
        v[k] /= length;
}

// point:X,Y,Z[,MIN,MAX]; plane: and axis: with a direction behind the place: across the plane, along the axis.
static int parse_shape(const char *text, uint32_t shape, patina_field_desc *field)
{
    const int own = shape == PATINA_FIELD_FROM_POINT ? 3 : 6;
    double n[8], *m = field->world_from_shape;
    const int count = parse_numbers(text, n, own, own + 2);
    if (count != own && count != own + 2)
        return -1;
    memset(m, 0, sizeof field->world_from_shape);
    m[0] = m[5] = m[10] = m[15] = 1.0;
    for (int k = 0; k < 3; k++)
        m[4 * k + 3] = n[k];
    if (own == 6) { // z along it, x and y across
        double *z = n + 3, x[3], y[3];
        if (!(z[0] != 0 || z[1] != 0 || z[2] != 0))
            return -1;
        unit(z);
        const int least = fabs(z[0]) <= fabs(z[1]) && fabs(z[0]) <= fabs(z[2]) ? 0 : fabs(z[1]) <= fabs(z[2]) ? 1 : 2;
        for (int k = 0; k < 3; k++)
            x[k] = (k == least) - z[least] * z[k];
        unit(x);
        for (int k = 0; k < 3; k++)
            y[k] = z[(k + 1) % 3] * x[(k + 2) % 3] - z[(k + 2) % 3] * x[(k + 1) % 3];
        for (int k = 0; k < 3; k++) {
            m[4 * k] = x[k];
            m[4 * k + 1] = y[k];
            m[4 * k + 2] = z[k];
        }
    }
    field->source = PATINA_FIELD_DISTANCE;
    field->shape = shape;
    if (count > own)
        memcpy(field->range, n + own, sizeof field->range);
    return count > own && field->range[0] == field->range[1] ? -1 : 0;
}

static int parse_classes(const char *text, patina_field_desc *field)
{
    double n[256];
    const int count = parse_numbers(text, n, 1, 256);
    field->source = PATINA_FIELD_CLASSES;
    for (int i = 0; i < count; i++) {
        if (n[i] < 0 || n[i] > 255 || n[i] != floor(n[i]))
            return -1;
        field->classes[(uint32_t)n[i] / 32] |= 1u << (uint32_t)n[i] % 32;
    }
    return count < 0 ? -1 : 0;
}

// A word or an attribute's name, and the numbers that become 0 and 1.
static int parse_numbers_of(const char *text, struct tool_soft *soft)
{
    static const struct {
        const char *word;
        uint32_t source;
    } known[] = {
        {"uncertainty", PATINA_FIELD_UNCERTAINTY}, {"density", PATINA_FIELD_DENSITY}, {"luminance", PATINA_FIELD_LUMINANCE}};
    const size_t length = strcspn(text, ",");
    if (!length || length >= sizeof soft->attribute)
        return -1;
    memcpy(soft->attribute, text, length);
    soft->attribute[length] = 0;
    soft->field.source = PATINA_FIELD_VALUES;
    for (size_t k = 0; k < sizeof known / sizeof *known; k++)
        if (!strcmp(soft->attribute, known[k].word)) {
            soft->field.source = known[k].source;
            soft->attribute[0] = 0;
        }
    return text[length] && (parse_numbers(text + length + 1, soft->field.range, 2, 2) < 0 ||
                            soft->field.range[0] == soft->field.range[1])
               ? -1
               : 0;
}

static int parse_field(const char *text, struct tool_soft *soft)
{
    static const char *const shapes[] = {"point:", "plane:", "axis:"}; // patina_field_shape
    soft->attribute[0] = 0;
    soft->field = (patina_field_desc){.struct_size = sizeof soft->field};
    for (uint32_t shape = 0; shape < 3; shape++)
        if (!strncmp(text, shapes[shape], strlen(shapes[shape])))
            return parse_shape(text + strlen(shapes[shape]), shape, &soft->field);
    if (!strncmp(text, "class:", 6))
        return parse_classes(text + 6, &soft->field);
    return parse_numbers_of(text, soft);
}

static int parse_between(const char *text, double most, double *value)
{
    return parse_numbers(text, value, 1, 1) < 0 || *value < 0 || *value > most ? -1 : 0;
}

int tool_parse_soft(const char *name, const char *value, struct tool_soft *soft)
{
    int bad;
    if (!strcmp(name, "--soft"))
        return parse_soft(value, soft);
    if (!strcmp(name, "--soft-shells")) {
        double n = 0;
        bad = parse_between(value, 64, &n) || n < 1 || n != floor(n);
        soft->shells = bad ? 0 : (uint32_t)n;
    } else if (!strcmp(name, "--soft-radius")) {
        bad = parse_between(value, 1e30, &soft->radius) || !(soft->radius > 0);
    } else if (!strcmp(name, "--soft-opacity")) {
        bad = parse_between(value, 1, &soft->opacity) || !(soft->opacity > 0);
    } else if (!strcmp(name, "--soft-modulation")) {
        bad = parse_between(value, 1, &soft->modulation);
    } else if (!strcmp(name, "--soft-field")) {
        bad = parse_field(value, soft);
        soft->divided |= 1;
    } else if (!strcmp(name, "--soft-threshold")) {
        bad = parse_between(value, 1, &soft->threshold);
        soft->divided |= 2;
    } else {
        return 1;
    }
    soft->shaped = 1;
    return bad ? -1 : 0;
}

int tool_check_soft(const struct tool_soft *soft, int file_count)
{
    if (soft->shaped && !soft->model)
        return tool_misuse("--soft-... options need --soft");
    if (soft->divided == 2)
        return tool_misuse("--soft-threshold needs --soft-field");
    for (int i = 0; i < soft->file_count; i++)
        if (soft->files[i] > (uint32_t)file_count)
            return tool_misuse("--soft: there is no FILE %u", soft->files[i]);
    return TOOL_OK;
}

int tool_is_soft(const struct tool_soft *soft, int file)
{
    int is = soft->model && !soft->file_count;
    for (int i = 0; i < soft->file_count; i++)
        is |= soft->files[i] == (uint32_t)file + 1;
    return is;
}

int tool_set_soft(const struct tool_soft *soft, int file, const patina_cloud *cloud, const float *numbers,
                  patina_progress *progress, patina_field **field, patina_cloud_style *style)
{
    const int is = tool_is_soft(soft, file), divided = is && soft->divided;
    style->soft = divided ? PATINA_SOFT_FIELD : is ? PATINA_SOFT_ALL : PATINA_SOFT_OFF;
    style->soft_model = is ? soft->model - 1 : 0;
    style->soft_shells = soft->shells;
    style->soft_radius = (float)soft->radius;
    style->soft_opacity = (float)soft->opacity;
    style->soft_modulation = (float)soft->modulation;
    style->soft_threshold = (float)(soft->divided & 2 ? soft->threshold : 0.5);
    style->field = NULL;
    if (!divided)
        return PATINA_OK;
    patina_cloud_info info = {.struct_size = sizeof info};
    patina_field_desc desc = soft->field;
    int code = patina_cloud_get_info(cloud, &info);
    desc.values = numbers;
    desc.count = numbers ? info.count : 0;
    if (!code)
        code = patina_field_create(cloud, &desc, progress, field);
    style->field = *field;
    return code;
}
