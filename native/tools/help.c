// SPDX-License-Identifier: GPL-3.0-or-later
// patina help: the commands, and the options by topic.
#include "tool.h"

#include <stddef.h>
#include <string.h>

enum { COLUMN = 37, WIDTH = 100 }; // where explanations begin; where lists of names wrap

static const char commands[] =
    "Patina renders point clouds as surfaces. The manual has more: addon/README.md.\n"
    "\n"
    "patina info FILE                     points, box, columns, scans, spacing, memory\n"
    "patina render FILE... -o OUT.png     renders clouds as surfaces\n"
    "patina convert IN OUT.ply            writes a binary PLY\n"
    "patina convert IN OUT.cloud          writes a saved cloud: built and analyzed, it opens at once\n"
    "patina analyse FILE -o OUT.ply       writes normal, spacing, radii, thickness, kind and trust of every point\n"
    "patina analyse IN.cloud -o OUT.cloud adds the analysis to a saved cloud\n"
    "patina distance FILE OTHER -o OUT.ply  adds to each point its distance to another cloud, and the interval of that\n"
    "patina ground FILE -o OUT.ply        adds to each point its height above the ground\n"
    "patina draw FILE... --plane PLANE -o OUT.dxf   draws a section, an elevation or a plan to scale\n"
    "patina scatter FILE... -o K.keys     draws one part of the points of an image, for merge\n"
    "patina merge FILE... -o OUT.png      merges tiles or parts into one image\n"
    "patina help [TOPIC|--OPTION|all]     the options of a topic, the topic of an option, or all options\n"
    "patina version                       the version\n"
    "\n"
    "Options take their value as --NAME VALUE or --NAME=VALUE. After --, all arguments are files.\n"
    "Exit status: 0 done, 1 failed, 2 wrong use, 3 merge needs another round, 130 canceled.\n";

static const struct topic {
    const char *name, *about, *text;
    int effects; // the options of effects come first
} topics[] = {
    {"convert", "convert and analyse files",
     "  --attribute NAME                   convert to .cloud: keep this scalar of the file, for --ramp\n"
     "  --memory SIZE                      memory to use, such as 500M or 2G (a third of what is free)\n"
     "  --analysis on|off                  convert to .cloud: with or without the analysis (on)\n"
     "  --pack on|off                      convert to .cloud: positions of 8 bytes instead of 12. Points move by less\n"
     "                                     than a millionth of a chunk's width; says by how much (off)\n"
     "  --order keep|drop                  convert to .cloud: drop the order of the points, 4 bytes per point less (keep)\n"
     "  --trusted                          analyse: leave points of low trust out of the file\n"
     "  --neighbours K                     analyse: 3 to 64 neighbors (16, and 48 where 16 leave doubts)\n"
     "  --keep-colors                      analyse: of IN.cloud; points without a color stay black\n"
     "  --grid                             analyse: use the rows and columns of scans, with their true borders\n",
     0},
    {"measure", "distances between clouds, height above ground",
     "  --normal-scale D                   distance: diameter of the balls that give the normals, of the file's normals only\n"
     "                                     the side (two cylinders)\n"
     "  --cylinder D                       distance: diameter of the cylinders whose points are averaged (six spacings)\n"
     "  --depth L                          distance: farther surfaces are not looked for (ten cylinders)\n"
     "  --registration-error R             distance: of the clouds to each other, one standard deviation (0)\n"
     "  --cell C                           ground: width of a cell (0.5, or by size and spacing)\n"
     "  --threshold T                      ground: points nearer to the ground than T are ground (a cell)\n"
     "  --largest W                        ground: width of the largest object, such as a building (100 cells)\n",
     0},
    {"draw", "survey drawings to scale: lines as DXF, SVG or GeoJSON, images as PNG or GeoTIFF, both as PDF",
     "  --plane section:X0,Y0,X1,Y1        a vertical plane along a line; looks to its left\n"
     "  --plane elevation:AZIMUTH[,DISTANCE]   a vertical plane, seen from where --camera AZIMUTH stands; DISTANCE from\n"
     "                                     the middle of the clouds towards the viewer (before all points)\n"
     "  --plane plan:Z                     a horizontal plane at the height Z, seen from above\n"
     "  --plane frame:X,Y,Z,RX,RY,RZ,UX,UY,UZ   any plane: its middle, its direction to the right, and up\n"
     "  --extent W,H                       width and height around the plane's middle, meters (the clouds)\n"
     "  --depth FRONT,BACK                 how far the image reaches before and behind the plane, meters (0, the clouds)\n"
     "  --scale N                          the scale 1:N (50)\n"
     "  --thickness T                      of the slab whose points make cut lines, meters (three spacings)\n"
     "  --contours INTERVAL                contours of the ground, or of a facade, meters; the fifth is heavier\n"
     "  --outlines                         for DXF and SVG: where surfaces end before what is behind them, at their depth\n"
     "  --flat                             DXF in millimeters of the sheet, instead of meters at the true place\n"
     "  --style NAME                       of the image: scan, plaster, technical, ink, blueprint, museum, watercolor,\n"
     "                                     night or xray (scan)\n"
     "  --pixel SIZE                       of an image, meters (a third of a line of 0.25 mm on paper)\n"
     "  --bits 8|16                        of each channel of a GeoTIFF (8)\n"
     "  --depth-map                        beside OUT.tif, OUT-depth.tif: distances before the plane, float32; NaN: nothing\n"
     "  --mask                             beside OUT.tif, OUT-mask.tif: 0 nothing, 1 measured, 2 filled\n"
     "  --crs EPSG:N                       the projected coordinate system of the clouds, for GeoTIFFs of plans (local)\n"
     "  --sheet NAME                       A0, A1, A2, A3, A4 or Letter, for PDF and SVG: with a frame, a title block, a\n"
     "                                     scale bar, north and coordinates (the bare drawing)\n"
     "  --title FIELD=TEXT                 of the title block: title, project, author, number or date; may be repeated\n"
     "  -o FILE, --output FILE             .dxf, .svg, .pdf, .png or .tif; may be repeated\n"
     "  --batch FILE.json                  many drawings: a list of objects whose keys are these options, such as\n"
     "                                     [{\"plane\": \"plan:1.2\", \"scale\": 20, \"outputs\": [\"a.dxf\", \"a.pdf\"]}].\n"
     "                                     The clouds are read once. Other options of the command are of all drawings\n"
     "  --device NAME, --threads N         as for render\n",
     0},
    {"output", "size, passes and measurements",
     "  -o FILE, --output FILE             the image, a PNG\n"
     "  --size WxH                         size of the image (1024x1024)\n"
     "  --region X0,Y0,X1,Y1               only these pixels, from the bottom left\n"
     "  --transparent                      background with alpha 0\n"
     "  --pass NAME[,MIN,MAX]              a pass instead of colors: depth, normal, source, shadow, line, trust,\n"
     "                                     thickness, density or disagreement. Numbers use --ramp-colors over a range\n"
     "                                     that is printed\n"
     "  --depth point|surface              depth of a pixel: its nearest point, or its surface in the middle; for\n"
     "                                     --dump-planes (point)\n"
     "  --dump-planes FOLDER               all passes as raw floats\n"
     "  --repeat N                         then measures N frames; the camera turns one degree per frame\n"
     "  --stats json                       measurements as one JSON object on standard output\n"
     "  --dump-plan                        the passes that run, and why\n"
     "  --verbose                          the library's log too\n",
     0},
    {"view", "camera and projection",
     "  --camera AZIMUTH,ELEVATION[,FOV]   degrees; frames the clouds (30,40)\n"
     "  --look X,Y,Z,X,Y,Z[,FOV]           looks from the first point to the second\n"
     "  --ortho WIDTH                      parallel projection, WIDTH world units wide\n"
     "  --panorama WxH                     all around, as an equirectangular image; north (y) is its middle\n"
     "  --eye X,Y,Z                        position of the panorama (0,0,0)\n",
     0},
    {"surface", "how points become a surface",
     "  --surface auto|splats|fill|ranges  discs where points lie wide and filling elsewhere, all discs, all filled, or\n"
     "                                     range images (auto)\n"
     "  --quality refined|paper            depth of filled pixels: tangent plane, or as in the paper (refined)\n"
     "  --fill closed|paper|off            hole filling (closed)\n"
     "  --iterations N                     rounds of hole filling (0: automatic)\n"
     "  --error E                          chooses quality and fill: color error at most E of white, if possible\n"
     "  --smooth alleviated|gaussian|box|off   smoothing of colors (alleviated)\n"
     "  --antialias layers|background|off  which edges are blended (layers)\n"
     "  --average                          mean of the points about a pixel's surface: more accurate, steadier, slower\n"
     "  --analysis auto|on|off|grid        spacing, footprint and normal of each point; auto: if something needs it;\n"
     "                                     grid: from the rows and columns of scans, with their true borders (auto)\n"
     "  --radius R                         radius of the discs, world units (the points' own, else 1.75 spacings)\n"
     "  --largest-gap W                    no disc is wider, world units: wider gaps stay open\n"
     "  --cull                             leaves out points that face away\n"
     "  --mesh FILE.obj                    triangles among the points, in gray; may be repeated\n",
     0},
    {"ranges", "range images, with --surface ranges",
     "  --range-gamma G                    depths that are merged into one surface, object units (two samples)\n"
     "  --range-pixel S                    size of the coarse pixels, 1 to 64 (as wide as two samples lie apart)\n"
     "  --range-sharpness F                a second pass with pixels F (0.5 to 0.95) as wide, where the first is not sharp\n"
     "  --range-culling ANGLE              leaves out scans that looked more than ANGLE degrees (to 180) beside the view\n",
     0},
    {"points", "color, transparency, and which points are drawn",
     "  --color R,G,B                      one linear color for all points\n"
     "  --ramp height|distance|trust|ATTRIBUTE[,MIN,MAX]   colors by height, distance to the eye, trust, or a scalar\n"
     "  --ramp-colors NAME                 viridis, grey, heat, spectrum, relief, diverging or classes (viridis)\n"
     "  --attribute NAME                   the scalar that --effect contour_source=attribute follows (the ramp's)\n"
     "  --exposure STOPS, --contrast C     of the points' colors, before light\n"
     "  --keep-colors                      points without a color stay black (they take their neighbors' color)\n"
     "  --no-balance                       scans keep their own exposure and white balance\n"
     "  --opacity X[,X...]                 0 to 1, of each FILE; the last counts for those behind it\n"
     "  --layers N                         at most so many layers of surface (0: 8 where something is transparent)\n"
     "  --layer-distance D                 least distance of two surfaces, world units (by the spacing)\n"
     "  --hide-classes N[,N...]            leaves out points of these classes\n"
     "  --hide-kinds KIND[,KIND...]        leaves out kinds: unknown, surface, border, line, volume. Strays: --trust\n"
     "  --trust X                          leaves out points of less trust than X, 0 to 1 (automatic). 0 draws all points\n"
     "  --free-space off|show|use          points and closed surface that a scanner saw through: as they are, magenta, or\n"
     "                                     left out; for files with scanner positions (off)\n"
     "  --clip-box X,Y,Z,X,Y,Z             only what lies in it, or in another; may be repeated\n"
     "  --cut-box X,Y,Z,X,Y,Z              only what does not lie in it\n"
     "  --clip-tint R,G,B,WIDTH            colors the surface that near to a cut, world units\n",
     0},
    {"soft", "points as balls of density",
     "  --soft base|concentric|express|sp|olt[,N...]   all FILEs, or those of these numbers (from 1 on). For comparison:\n"
     "                                     sp: opaque splats, olt: one transparent layer of them\n"
     "  --soft-field WHAT[,MIN,MAX]        only points above the threshold. WHAT: an attribute, luminance, density or\n"
     "                                     uncertainty; MIN and MAX become 0 and 1. class:N,...: these classes.\n"
     "                                     point:X,Y,Z, plane:X,Y,Z,NX,NY,NZ, axis:X,Y,Z,DX,DY,DZ: distance from it\n"
     "  --soft-threshold T                 0 to 1 (0.5)\n"
     "  --soft-radius R                    of the balls, world units (the points' own, else 1.13 spacings)\n"
     "  --soft-opacity X                   of a ball through its center, 0 to 1 (0.5)\n"
     "  --soft-modulation X                0 to 1: single points show (0)\n"
     "  --soft-shells N                    of concentric, 1 to 64 (by the size of the balls)\n",
     0},
    {"light", "lights, background and shadows",
     "  --lit, --unlit                     with or without lights (clouds with colors: without)\n"
     "  --background R,G,B                 linear; also the ambient light, unless that is given\n"
     "  --ambient R,G,B                    linear; the ambient light\n"
     "  --headlight                        one light from the camera instead of the two, without shadows\n"
     "  --sun AZIMUTH,HEIGHT[,DIAMETER]    direction and width, degrees (over the left shoulder, sharp)\n"
     "  --shadows                          the brighter light casts shadows\n"
     "  --samples N                        of a sun with a diameter, 1 to 4096 (16)\n"
     "  --shadow-error E                   as many samples as an error of E of its light needs (at most 256, or N)\n"
     "  --save-shadows FILE                computes the shadows of all points and stores them\n"
     "  --load-shadows FILE                uses stored shadows\n",
     0},
    {"effects", "depth cues and drawing",
     "  --effect FIELD=VALUE               any field of an effect by its name in patina/effects.def. VALUE: a number, three\n"
     "                                     numbers of a color or an axis, or the word of a choice\n",
     1},
    {"lines", "lines around outlines",
     "  --lines WIDTH[,SOFT[,OPACITY]]     pixels; they fade over SOFT of the width (0: hard)\n"
     "  --line-units pixels|world          unit of WIDTH (pixels)\n"
     "  --line-source fixed|point|depth    one color, the points' own times it, or from near to far (fixed)\n"
     "  --line-color R,G,B, --line-far R,G,B   linear (black, black)\n"
     "  --line-range NEAR,FAR              depths of these two colors (those of the clouds)\n"
     "  --line-surface shown|paper|none    what lies under the lines (shown)\n"
     "  --line-offset D                    least step in depth, world units (0: that of two layers)\n",
     0},
    {"device", "samples, device and memory",
     "  --pixel-samples N                  the mean of about so many samples per pixel, 1 to 4096 (1)\n"
     "  --noise E                          as many samples as an error of E of white needs (at most 256, or N)\n"
     "  --detail PIXELS                    clouds in levels: none finer than leaves so many pixels between points (0: all)\n"
     "  --device NAME                      auto, cpu, cpu-scalar, cpu-sse42, cpu-avx2, cpu-avx512, cpu-neon, gl-egl,\n"
     "                                     gl-osmesa or gl-wgl (auto)\n"
     "  --threads N, --batch N             of the processor (0: automatic)\n"
     "  --memory SIZE                      memory for .cloud files at a time, such as 500M or 2G (a third of what is free).\n"
     "                                     Larger files are read in rounds, to the same image\n",
     0},
    {"farm", "tiles, strips and parts",
     "  --tiles CxR --tile N               render: one of C x R tiles, from 1 on, from the top left; for merge\n"
     "  --strip ROWS                       render: so many rows at a time; a large image takes less memory\n"
     "  --part K/N                         scatter: part K of N of the points, with the options of render. Of .cloud files\n"
     "                                     it reads no other points\n"
     "  --behind NEXT                      scatter: of a round after the first\n"
     "  --next NEXT                        merge: written if layers need another round; the exit status is then 3.\n"
     "                                     Scatter all parts with --behind NEXT, and merge the keys of all rounds\n"
     "  --device NAME, --threads N, --memory SIZE   merge: as for render\n",
     0},
};

enum { TOPICS = sizeof topics / sizeof *topics };

static int is_name(char c) { return (c >= 'a' && c <= 'z') || c == '-'; }

// The next option in the text that stands before the column of explanations, from `at` on. NULL: there is none.
// length: of its name.
static const char *next_option(const char *text, const char *at, size_t *length)
{
    for (const char *line = at; *at; at++) {
        while (line > text && line[-1] != '\n')
            line--;
        if (at[0] == '-' && at[1] == '-' && at[2] >= 'a' && at - line < COLUMN && (at[-1] == ' ' || at == text)) {
            for (*length = 2; is_name(at[*length]);)
                ++*length;
            return at;
        }
        if (*at == '\n')
            line = at + 1;
    }
    return NULL;
}

static int has_option(const struct topic *topic, const char *name)
{
    size_t length;
    for (size_t i = 0; topic->effects && tool_effect_option(i); i++)
        if (!strcmp(tool_effect_option(i), name))
            return 1;
    for (const char *at = topic->text; (at = next_option(topic->text, at, &length)); at += length)
        if (strlen(name) == length && !memcmp(at, name, length))
            return 1;
    return 0;
}

static size_t print_name(FILE *out, size_t column, const char *name, size_t length)
{
    enum { INDENT = 12 };
    if (column + 1 + length > WIDTH || !column) {
        fprintf(out, "%s%*s", column ? "\n" : "", INDENT, "");
        column = INDENT;
    }
    fprintf(out, " %.*s", (int)length, name);
    return column + 1 + length;
}

static void print_names(FILE *out, const struct topic *topic)
{
    size_t length, column = 0;
    for (size_t i = 0; topic->effects && tool_effect_option(i); i++)
        column = print_name(out, column, tool_effect_option(i), strlen(tool_effect_option(i)));
    for (const char *at = topic->text; (at = next_option(topic->text, at, &length)); at += length)
        column = print_name(out, column, at, length);
    fputc('\n', out);
}

static void print_topic(FILE *out, const struct topic *topic)
{
    fprintf(out, "%s: %s\n", topic->name, topic->about);
    if (topic->effects)
        tool_print_effects(out);
    fputs(topic->text, out);
}

void tool_print_usage(FILE *out)
{
    fputs(commands, out);
    fputs("\nTopics, and their options:\n", out);
    for (int i = 0; i < TOPICS; i++) {
        fprintf(out, "  %-10s %s\n", topics[i].name, topics[i].about);
        print_names(out, topics + i);
    }
}

int tool_help(int count, char **arguments)
{
    if (!count) {
        tool_print_usage(stdout);
        return TOOL_OK;
    }
    const char *wanted = arguments[0];
    const int all = !strcmp(wanted, "all");
    int found = 0;
    for (int i = 0; i < TOPICS; i++)
        if (all || !strcmp(wanted, topics[i].name) || has_option(topics + i, wanted)) {
            if (found++)
                putchar('\n');
            print_topic(stdout, topics + i);
        }
    return found ? TOOL_OK : tool_misuse("help: '%s' is neither a topic nor an option", wanted);
}
