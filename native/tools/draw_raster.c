// SPDX-License-Identifier: GPL-3.0-or-later
// Where the pixels of a drawing's image are, and the files beside a GeoTIFF that tell it: a world file, a .prj and a .json.
#include "draw.h"
#include "base/words.h"

#include <math.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#define LEVEL 1e-12 // how far from 1 the height of a horizontal plane's normal may be

int draw_is_tiff(const char *path)
{
    const char *dot = strrchr(path, '.');
    return dot && (pt_same_word(dot, ".tif") || pt_same_word(dot, ".tiff"));
}

char *draw_path_with(const char *path, const char *ending)
{
    const char *dot = strrchr(path, '.');
    const size_t length = dot ? (size_t)(dot - path) : strlen(path);
    char *made = malloc(length + strlen(ending) + 1);
    if (!made) {
        tool_say("out of memory");
        return NULL;
    }
    memcpy(made, path, length);
    strcpy(made + length, ending);
    return made;
}

static int is_level(const double axes[3][3]) { return fabs(axes[2][2]) >= 1 - LEVEL; }

int draw_coordinates(const struct draw_image *image, double along[2][2], double middle[2])
{
    double axes[3][3] = {{0}}, away[3];
    draw_axes(image->desc, axes);
    const int level = is_level((const double(*)[3])axes);
    for (int k = 0; k < 3; k++)
        away[k] = image->desc->origin[k] - image->zero[k];
    for (int i = 0; i < 2; i++) {
        along[i][0] = level ? axes[0][i] : i == 0;
        along[i][1] = level ? axes[1][i] : i == 1;
        middle[i] = level ? image->desc->origin[i] : away[0] * axes[i][0] + away[1] * axes[i][1] + away[2] * axes[i][2];
    }
    return level;
}

void draw_raster(const struct draw_image *image, struct tool_raster *raster)
{
    double along[2][2], middle[2];
    const int level = draw_coordinates(image, along, middle);
    *raster = (struct tool_raster){.epsg = level ? image->options->epsg : 0,
                                   .name = level ? "Local coordinates, in meters"
                                                 : "Coordinates on a plane: x to the right, y up, in meters"};
    const double left = -0.5 * image->pixel * image->width, top = 0.5 * image->pixel * image->height;
    for (int i = 0; i < 2; i++) {
        raster->corner[i] = middle[i] + left * along[i][0] + top * along[i][1];
        raster->along_row[i] = image->pixel * along[i][0];
        raster->down[i] = 0 - image->pixel * along[i][1]; // no -0
    }
}

// ---- files beside --------------------------------------------------------------------------------------------------

static int write_text(const char *path, const char *ending, const char *format, ...) __attribute__((format(printf, 3, 4)));

static int write_text(const char *path, const char *ending, const char *format, ...)
{
    struct pt_whole whole;
    char *beside = draw_path_with(path, ending), why[128];
    if (!beside)
        return TOOL_FAILED;
    int error = pt_whole_begin(beside, &whole);
    if (!error) {
        va_list list;
        va_start(list, format);
        const int good = vfprintf(whole.stream, format, list) >= 0 && !fflush(whole.stream) && !ferror(whole.stream);
        va_end(list);
        error = pt_whole_end(&whole, good);
    }
    if (error)
        tool_say("'%s' cannot be written: %s", beside, pt_error_text(error, why, sizeof why));
    free(beside);
    return error ? TOOL_FAILED : TOOL_OK;
}

// The zones of UTM, whose EPSG codes follow each other. Other systems need a database.
static const struct {
    uint32_t first, last, zone; // zone: of the first
    const char *name, *datum, *spheroid;
    double north; // false northing
} utm[] = {
    {32601, 32660, 1, "WGS_1984_UTM_Zone_%uN", "GCS_WGS_1984\",DATUM[\"D_WGS_1984", "WGS_1984\",6378137.0,298.257223563", 0},
    {32701, 32760, 1, "WGS_1984_UTM_Zone_%uS", "GCS_WGS_1984\",DATUM[\"D_WGS_1984", "WGS_1984\",6378137.0,298.257223563", 1e7},
    {25828, 25838, 28, "ETRS_1989_UTM_Zone_%uN", "GCS_ETRS_1989\",DATUM[\"D_ETRS_1989", "GRS_1980\",6378137.0,298.257222101",
     0},
    {26901, 26923, 1, "NAD_1983_UTM_Zone_%uN", "GCS_North_American_1983\",DATUM[\"D_North_American_1983",
     "GRS_1980\",6378137.0,298.257222101", 0},
};

static int write_prj(const struct draw_image *image, uint32_t epsg)
{
    for (size_t i = 0; i < sizeof utm / sizeof *utm; i++) {
        char name[64];
        if (epsg < utm[i].first || epsg > utm[i].last)
            continue;
        const uint32_t zone = utm[i].zone + epsg - utm[i].first;
        const char *mark = strstr(utm[i].name, "%u");
        snprintf(name, sizeof name, "%.*s%u%s", (int)(mark - utm[i].name), utm[i].name, zone, mark + 2);
        return write_text(image->path, ".prj",
                          "PROJCS[\"%s\",GEOGCS[\"%s\",SPHEROID[\"%s]],PRIMEM[\"Greenwich\",0.0],"
                          "UNIT[\"Degree\",0.0174532925199433]],PROJECTION[\"Transverse_Mercator\"],"
                          "PARAMETER[\"False_Easting\",500000.0],PARAMETER[\"False_Northing\",%.1f],"
                          "PARAMETER[\"Central_Meridian\",%.1f],PARAMETER[\"Scale_Factor\",0.9996],"
                          "PARAMETER[\"Latitude_Of_Origin\",0.0],UNIT[\"Meter\",1.0]]\n",
                          name, utm[i].datum, utm[i].spheroid, utm[i].north, 6.0 * zone - 183.0);
    }
    tool_say("%s: no .prj is written for EPSG:%u, whose parameters are not known here; the GeoTIFF names it", image->path,
             epsg);
    return TOOL_OK;
}

int draw_write_beside(const struct draw_image *image, const struct tool_raster *raster)
{
    const patina_drawing_desc *desc = image->desc;
    const double *row = raster->along_row, *down = raster->down;
    double axes[3][3] = {{0}}, zero[3];
    char crs[32] = "null";
    draw_axes(desc, axes);
    memcpy(zero, image->zero, sizeof zero);
    if (is_level((const double(*)[3])axes)) { // the file's coordinates are those of the world
        memcpy(zero, (const double[3]){0, 0, desc->origin[2]}, sizeof zero);
        memcpy(axes, (const double[2][3]){{1, 0, 0}, {0, 1, 0}}, sizeof(double[2][3]));
    }
    int result = write_text(image->path, ".tfw", "%.17g\n%.17g\n%.17g\n%.17g\n%.17g\n%.17g\n", row[0], row[1], down[0], down[1],
                            raster->corner[0] + 0.5 * (row[0] + down[0]), raster->corner[1] + 0.5 * (row[1] + down[1]));
    if (!result && raster->epsg)
        result = write_prj(image, raster->epsg);
    if (image->options->epsg)
        snprintf(crs, sizeof crs, "\"EPSG:%u\"", image->options->epsg);
    if (result)
        return result;
    return write_text(image->path, ".json",
                      "{\n  \"scale\": %.17g,\n  \"width\": %u,\n  \"height\": %u,\n  \"pixel\": %.17g,\n"
                      "  \"upper_left\": [%.17g, %.17g],\n  \"along_row\": [%.17g, %.17g],\n  \"down\": [%.17g, %.17g],\n"
                      "  \"origin\": [%.17g, %.17g, %.17g],\n  \"right\": [%.17g, %.17g, %.17g],\n"
                      "  \"up\": [%.17g, %.17g, %.17g],\n  \"normal\": [%.17g, %.17g, %.17g],\n"
                      "  \"front\": %.17g,\n  \"back\": %.17g,\n  \"crs\": %s,\n"
                      "  \"measured_pixels\": %llu,\n  \"filled_pixels\": %llu\n}\n",
                      desc->scale, image->width, image->height, image->pixel, raster->corner[0], raster->corner[1], row[0],
                      row[1], down[0], down[1], zero[0], zero[1], zero[2], axes[0][0], axes[0][1], axes[0][2], axes[1][0],
                      axes[1][1], axes[1][2], axes[2][0], axes[2][1], axes[2][2], desc->front, desc->back, crs,
                      (unsigned long long)image->measured, (unsigned long long)image->filled);
}
