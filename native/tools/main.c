// SPDX-License-Identifier: GPL-3.0-or-later
// patina: looks at, renders and converts point clouds without Blender.
#include "tool.h"

#include <stdarg.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char usage_before[] =
    "patina info FILE                     what a file of points holds\n"
    "patina convert IN OUT.ply            writes a binary PLY\n"
    "patina convert IN OUT.cloud          writes the built and analysed cloud: it opens at once, and parts read their share\n"
    "                                     built on the disk, below a cap of memory, from a million points on in levels\n"
    "  --attribute NAME                   with a scalar of the file, for --ramp\n"
    "  --memory SIZE                      that it takes at most, as 2G or 500M (default: a third of what is free)\n"
    "  --analysis on|off                  made on the disk too, within that memory\n"
    "  --pack on|off                      positions of 8 bytes in place of 12, moved by less than a millionth of a chunk's\n"
    "                                     width; says by how much (off)\n"
    "  --order keep|drop                  drop: points are numbered as the file has them, 4 bytes a point less (keep)\n"
    "patina analyse FILE -o OUT.ply       normal, spacing, radii, thickness, kind and trust of every point, as columns\n"
    "  --trusted                          leaves points of less trust than 0.64 out of the file: mixed pixels, strays\n"
    "  --neighbours K                     3 to 64 (16, and 48 where 16 leave doubts)\n"
    "  --grid                             of scans with rows and columns by the neighbours there, with their true borders\n"
    "patina analyse IN.cloud -o OUT.cloud what every point knows goes into the cloud, as convert does it for others\n"
    "  --memory SIZE                      that it takes, as 2G or 500M; the rest lies on the disk (default: a third of what "
    "is\n"
    "                                     free)\n"
    "patina render FILE... -o OUT.png     draws clouds as surfaces\n"
    "  --size WxH                         of the picture (1024x1024)\n"
    "  --region X0,Y0,X1,Y1               only these pixels, from the bottom left\n"
    "  --camera AZIMUTH,ELEVATION[,FOV]   degrees; frames the clouds (default 30,40)\n"
    "  --look X,Y,Z,X,Y,Z[,FOV]           from the first point to the second\n"
    "  --panorama WxH                     all around, as an equirectangular picture; north (y) is its middle\n"
    "  --eye X,Y,Z                        where a panorama is seen from (0,0,0)\n"
    "  --ortho WIDTH                      parallel projection, WIDTH world units wide\n"
    "  --quality refined|paper            depth of filled pixels: tangent plane, or as in the paper\n"
    "  --fill closed|paper|off            hole filling; --iterations N (0: automatic)\n"
    "  --surface auto|splats|fill|ranges  discs where points lie wide and filling elsewhere, all discs, all filled, or merged\n"
    "                                     as range images of a scanner, in a coarser picture whose pixels are joined into "
    "faces\n"
    "  --range-gamma G                    of range images: depths merged into one surface, object units (default: two "
    "samples)\n"
    "  --range-sharpness F                a second pass, its pixels F (0.5 to 0.95) as wide, where the first is not sharp\n"
    "  --range-pixel S                    of the coarser picture, 1 to 64 pixels (default: as wide as two samples lie apart)\n"
    "  --range-culling ANGLE              of range images: leaves out scans that looked more than ANGLE degrees (to 180) "
    "beside\n"
    "                                     the view\n"
    "  --analysis auto|on|off|grid        points' own spacings and footprints, and normals where a file has none (auto: where\n"
    "                                     something asks for them; range images do not); grid: of scans with rows and columns\n"
    "                                     by the neighbours there, with their true borders\n"
    "  --radius R                         of the discs, world units (default: the points' own, else 1.75 spacings)\n"
    "  --largest-gap W                    no disc is wider, world units: wider gaps stay open\n"
    "  --smooth alleviated|gaussian|box|off\n"
    "  --antialias layers|background|off\n"
    "  --lit, --unlit                     default: clouds with colours are shown unlit\n"
    "  --cull                             leave out points that face away\n"
    "  --error E                          picks quality and fill: colour error at most E of white, if it can be had\n"
    "  --opacity X[,X...]                 0 to 1, of each FILE; the last counts for those behind it\n"
    "  --soft base|concentric|express|sp|olt[,N...]   points are balls of density, all FILEs' or those of these numbers (from\n"
    "                                     1 on); to compare with: sp: opaque splats, olt: one layer of them, transparent\n"
    "  --soft-field WHAT[,MIN,MAX]        only points above the threshold are; of an attribute, or of luminance, density or\n"
    "                                     uncertainty: the numbers that become 0 and 1. class:N,...: of these classes;\n"
    "                                     point:X,Y,Z, plane:X,Y,Z,NX,NY,NZ, axis:X,Y,Z,DX,DY,DZ: by the distance from it\n"
    "  --soft-threshold T                 0 to 1 (0.5)\n"
    "  --soft-radius R                    of the balls, world units (default: the points' own, else 1.13 spacings)\n"
    "  --soft-opacity X                   of a ball through its centre, 0 to 1 (0.5)\n"
    "  --soft-modulation X                0 to 1: single points show (0)\n"
    "  --soft-shells N                    of concentric, 1 to 64 (default: as many as a ball's size asks for)\n"
    "  --color R,G,B                      linear, of all points\n"
    "  --ramp height|distance|ATTRIBUTE[,MIN,MAX]   colours by height, distance to the eye, or a scalar of the file\n"
    "  --ramp-colors NAME                 viridis, grey, heat, spectrum, relief, diverging, classes\n"
    "  --attribute NAME                   the scalar of the file that --effect contour_source=attribute follows (the ramp's)\n"
    "  --exposure STOPS, --contrast C     of the points' colours, before light\n"
    "  --hide-classes N[,N...]            points of these classes are left out\n"
    "  --hide-kinds KIND[,KIND...]        points of these kinds are left out: unknown, surface, border, line, volume, stray\n"
    "  --trust X                          0 to 1; points of less trust, which are probably no surface, are left out (0.64);\n"
    "                                     0: all are drawn\n"
    "  --free-space off|show|use          points, and surface closed between points, that one of the scanner's stations saw\n"
    "                                     through: as they are, in magenta, or left out; for files that know their stations\n"
    "  --clip-box X,Y,Z,X,Y,Z             only what lies in it, or in another; --cut-box: only what does not\n"
    "  --clip-tint R,G,B,WIDTH            colours the surface that near to a cut, world units\n"
    "  --mesh FILE.obj                    triangles among the points, in grey; may be repeated\n"
    "  --layer-distance D                 two surfaces of see-through points lie at least so far apart, world units (default: "
    "by\n"
    "                                     their spacing)\n"
    "  --layers N                         at most so many layers of surface (0: 8 where something is transparent)\n"
    "  --background R,G,B                 linear; also the ambient light, unless told\n"
    "  --ambient R,G,B                    linear; the ambient light\n";

// Options of effects stand between the two.
static const char usage_behind[] =
    "  --headlight                        one light from the camera in place of the two, without shadows\n"
    "  --shadows                          the brighter light casts shadows\n"
    "  --sun AZIMUTH,HEIGHT[,DIAMETER]    where from and how wide, degrees (default: over the left shoulder, sharp)\n"
    "  --depth point|surface              of a pixel: its nearest point's, or its surface's in the middle (for --dump-planes)\n"
    "  --average                          the mean of the points about a pixel's surface, not the nearest: truer, steadier\n"
    "  --detail PIXELS                    of clouds in levels no finer ones than leave so many pixels between points (0: all)\n"
    "  --pixel-samples N                  the mean of about so many samples a pixel, 1 to 4096 (1)\n"
    "  --noise E                          as many as it takes for colours to be off by E of white at most (at most 256, or N)\n"
    "  --samples N                        of a sun with a diameter, 1 to 4096 (16)\n"
    "  --shadow-error E                   as many as it takes to be off by E of its light at most (at most 256, or N)\n"
    "  --save-shadows FILE                computes the shadows of all points and keeps them\n"
    "  --load-shadows FILE                takes them from there\n"
    "  --lines WIDTH[,SOFT[,OPACITY]]     silhouettes, pixels; they fade over SOFT of the width (0: hard)\n"
    "  --line-units pixels|world          what WIDTH counts\n"
    "  --line-source fixed|point|depth    one colour, the points' own times it, or from near to far\n"
    "  --line-color R,G,B, --line-far R,G,B   linear (black, black)\n"
    "  --line-range NEAR,FAR              depths of the two (those of the clouds)\n"
    "  --line-surface shown|paper|none    what lies under the lines\n"
    "  --line-offset D                    least step in depth, world units (0: that of two layers)\n"
    "  --transparent                      background with alpha 0\n"
    "  --pass NAME[,MIN,MAX]              what the picture shows in place of colours: depth, normal, source, shadow, line,\n"
    "                                     trust, thickness, density or disagreement (of the scans of range images);\n"
    "                                     numbers by --ramp-colors, over a range that is told\n"
    "  --device auto|cpu|cpu-scalar|cpu-sse42|cpu-avx2|cpu-avx512|cpu-neon|gl-egl|gl-osmesa|gl-wgl\n"
    "  --threads N, --batch N             of the CPU device (0: automatic)\n"
    "  --memory SIZE                      that a picture holds of .cloud files at a time, as 2G or 500M (default: a third of\n"
    "                                     what is free); larger ones are read in rounds, to the same picture\n"
    "  --repeat N                         then measure N frames, the camera turning one degree a frame\n"
    "  --stats json                       one JSON object on standard output\n"
    "  --dump-plan                        the passes, and why\n"
    "  --dump-planes FOLDER               raw planes of the picture, its passes among them\n"
    "  --verbose                          the library's log too\n"
    "  --tiles CxR --tile N               one of C x R tiles of the picture, from 1 on, from the top left: for `merge`\n"
    "  --strip ROWS                       draws so many rows at a time: a large picture takes less memory\n"
    "patina scatter FILE... --part K/N -o K.keys   what part K of the points shows of the picture that `render` with the same\n"
    "                                     options draws; of .cloud files it reads no other points\n"
    "  --behind NEXT                      of a round behind the first\n"
    "patina merge FILE... -o OUT.png      the picture of all its tiles, or of all its parts' keys, with the same bytes\n"
    "  --next NEXT                        of parts whose layers take further rounds: then this is written, and the exit\n"
    "                                     status is 3; scatter all parts --behind NEXT, and merge the keys of all rounds\n"
    "  --device NAME, --threads N, --memory SIZE   as of render\n"
    "patina version\n"
    "Exit status: 0 done, 1 failed, 2 wrong use, 3 another round is wanted, 130 cancelled.\n";

static void print_usage(FILE *out)
{
    fputs(usage_before, out);
    tool_print_effects(out);
    fputs(usage_behind, out);
}

// ---- messages ----------------------------------------------------------------------------------------------------

static void say(const char *format, va_list list)
{
    fputs("patina: ", stderr);
    vfprintf(stderr, format, list);
    fputc('\n', stderr);
}

void tool_say(const char *format, ...)
{
    va_list list;
    va_start(list, format);
    say(format, list);
    va_end(list);
}

int tool_misuse(const char *format, ...)
{
    va_list list;
    va_start(list, format);
    say(format, list);
    va_end(list);
    fputs("'patina help' lists commands and options.\n", stderr);
    return TOOL_USAGE;
}

int tool_failed(const char *what, const void *handle, int code)
{
    if (code == PATINA_ERROR_CANCELLED || tool_cancelled()) {
        tool_say("cancelled");
        return TOOL_CANCELLED;
    }
    char message[1024] = "";
    if (!handle || !patina_message(handle, message, sizeof message))
        patina_message(NULL, message, sizeof message);
    const char *sentence = message[0] ? message : patina_error_text(code);
    if (!strncmp(sentence, what, strlen(what))) // it names the file itself
        tool_say("%s", sentence);
    else
        tool_say("%s: %s", what, sentence);
    return TOOL_FAILED;
}

void tool_drain_log(int least)
{
    static const char *const kinds[] = {"error", "warning", "note"};
    char line[1024];
    int level;
    while (patina_log_next(line, sizeof line, &level))
        if (level > 0 && level <= least) // errors reach the user as the message of the call that failed
            tool_say("%s: %s", kinds[level > 2 ? 2 : level], line);
}

// ---- signals -----------------------------------------------------------------------------------------------------

static struct pt_mutex cancel_lock;
static patina_progress *cancel_progress;
static patina_frame *cancel_frame;
static atomic_int cancelled;

static void interrupted(void)
{
    pt_mutex_lock(&cancel_lock);
    if (atomic_exchange(&cancelled, 1) || (!cancel_progress && !cancel_frame))
        _Exit(TOOL_CANCELLED);
    if (cancel_progress)
        patina_progress_cancel(cancel_progress);
    if (cancel_frame)
        patina_frame_cancel(cancel_frame);
    pt_mutex_unlock(&cancel_lock);
}

int tool_watch_signals(void)
{
    pt_mutex_init(&cancel_lock);
    return pt_watch_interrupts(interrupted);
}

void tool_cancellable(patina_progress *progress, patina_frame *frame)
{
    pt_mutex_lock(&cancel_lock);
    cancel_progress = progress;
    cancel_frame = frame;
    pt_mutex_unlock(&cancel_lock);
}

int tool_cancelled(void) { return atomic_load(&cancelled); }

// ------------------------------------------------------------------------------------------------------------------

int main(int count, char **arguments)
{
    if (pt_program_begin(&count, &arguments)) {
        tool_say("out of memory");
        return TOOL_FAILED;
    }
    if (count < 2) {
        print_usage(stderr);
        return TOOL_USAGE;
    }
    const char *command = arguments[1];
    if (!strcmp(command, "help") || !strcmp(command, "--help") || !strcmp(command, "-h")) {
        print_usage(stdout);
        return TOOL_OK;
    }
    if (!strcmp(command, "version") || !strcmp(command, "--version")) {
        printf("patina %s\n", patina_version());
        return TOOL_OK;
    }
    if (tool_watch_signals())
        tool_say("warning: Ctrl-C will end the program without tidying up");
    if (!strcmp(command, "render"))
        return tool_render(count - 2, arguments + 2);
    if (!strcmp(command, "scatter"))
        return tool_scatter(count - 2, arguments + 2);
    if (!strcmp(command, "merge"))
        return tool_merge(count - 2, arguments + 2);
    if (!strcmp(command, "info"))
        return tool_info(count - 2, arguments + 2);
    if (!strcmp(command, "convert"))
        return tool_convert(count - 2, arguments + 2);
    if (!strcmp(command, "analyse"))
        return tool_analyse(count - 2, arguments + 2);
    return tool_misuse("there is no command '%s'", command);
}
