// SPDX-License-Identifier: GPL-3.0-or-later
// The lettering of sheets: letters of single strokes, with the proportions of ISO 3098 (capitals 10, small letters 7, strokes 1 wide).
//
// A letter is a list of strokes. A point is its x as a digit, and its y as a letter: a is -3, d the baseline, k the height of x, n that of
// capitals. A large letter is a control point of quadratic curves; between two of these there is a point in their middle.
#include "page.h"

#include <math.h>
#include <string.h>

enum { SPACING = 2, BLANK = 5, STEPS = 6, BASE = 'd', CAPITAL = 10, LIFT = 3 };

static const char *const ascii[] = {
    // from '!' on
    "0n0g 0d0d",
    "0n0k 2n2k",
    "1d2n 4d5n 0g6g 0k6k",
    "6l6N3n0N0I3i6I6D3d0D0f 3p3b",
    "0d6n 0l0N2N2l2J0J0l 4f4H6H6f6D4D4f",
    "6d1k1N4N4K0I0D5D6h",
    "0n0k",
    "2o0L0F2c",
    "0o2L2F0c",
    "2m2g 0l4h 4l0h",
    "3l3f 0i6i",
    "1e1d0b",
    "0i4i",
    "1d1d",
    "0c5o",
    "0i0N5N5i5D0D0i",
    "0l3n3d",
    "0l0N5N5J0d5d",
    "0n5n2j5J5D0D0f",
    "4d4n0g5g",
    "5n0n0j2j5J5D0D0f",
    "4n0N0g0D5D5g5J0J0g",
    "0n5n1d",
    "0l0N5N5l5I0I0l 0g0I5I5g5D0D0g",
    "1d5D5k5N0N0k0H5H5k",
    "1d1d 1j1j",
    "1j1j 1e1d0b",
    "6l0i6f",
    "0k6k 0g6g",
    "0l6i0f",
    "0l0N5N5J2I2g 2d2d",
    "7e6D0D0N8N8G6G6k 6i6K3K3G6G6i",
    "0d3n6d 1g5g",
    "0d0n3n6N6I3i0i 3i6I6D3d0d",
    "6l6N3n0N0D3d6D6f",
    "0d0n2n6N6D2d0d",
    "5n0n0d5d 0i4i",
    "5n0n0d 0i4i",
    "6l6N3n0N0D3d6D6i4i",
    "0d0n 6d6n 0i6i",
    "0d0n",
    "4n4g4D0D0g",
    "0d0n 6n0h 2j6d",
    "0n0d5d",
    "0d0n4f8n8d",
    "0d0n6d6n",
    "3n0N0D3d6D6N3n",
    "0d0n3n6N6H3h0h",
    "3n0N0D3d6D6N3n 4f7c",
    "0d0n3n6N6H3h0h 3h6d",
    "6l6N3n0N0I3i6I6D3d0D0f",
    "0n6n 3n3d",
    "0n0g0D3d6D6g6n",
    "0n3d6n",
    "0n2d4n6d8n",
    "0d6n 0n6d",
    "0n3i6n 3i3d",
    "0n6n0d6d",
    "2o0o0c2c",
    "0o5c",
    "0o2o2c0c",
    "0k3n6k",
    "0b6b",
    "0n2l",
    "5k5d 5h5K0K0D5D5h",
    "0n0d 0h0K5K5D0D0h",
    "5j4K3k0K0D3d4D5e",
    "5n5d 5h5K0K0D5D5h",
    "0h5h5K0K0D3d4D5e",
    "4n2N2l2d 0k4k",
    "5k5d5A1A0b 5h5K0K0D5D5h",
    "0n0d 0h0K5K5h5d",
    "0k0d 0n0n",
    "2k2c2A0a 2n2n",
    "0n0d 4k0g 1h4d",
    "0n0d",
    "0k0d 0h0K4K4h4d 4h4K8K8h8d",
    "0k0d 0h0K5K5h5d",
    "0g0K5K5g5D0D0g",
    "0k0a 0h0K5K5D0D0h",
    "5k5a 5h5K0K0D5D5h",
    "0k0d 0h0K3k",
    "4j4K2k0K0H2h4H4D2d0D0e",
    "1m1f1D3d 0k3k",
    "0k0g0D5D5g 5k5d",
    "0k2d4k",
    "0k2d4k6d8k",
    "0d4k 0k4d",
    "0k2d 4k1a",
    "0k4k0d4d",
    "3o1O1l1I0i1I1f1C3c",
    "0o0a",
    "0o2O2l2I3i2I2f2C0c",
    "0h2L3i4F6j",
};

static const struct {
    uint32_t code;
    const char *strokes;
} others[] = {
    {0xA0, ""},                           // no-break space
    {0xAB, "2k0h2e 5k3h5e"},              // quotation marks, to the left
    {0xB0, "0l0N3N3l3J0J0l"},             // degree
    {0xB1, "3m3g 0j6j 0d6d"},             // plus or minus
    {0xB2, "0m0N3N3L0i3i"},               // squared
    {0xB3, "0n3n1l3L3I0I0j"},             // cubed
    {0xB5, "0k0a 0g0D5D5g 5k5d"},         // micro
    {0xB7, "0i0i"},                       // middle dot
    {0xBB, "0k2h0e 3k5h3e"},              // quotation marks, to the right
    {0xC6, "0d4n8n 4n4d8d 1g4g 4i7i"},    // AE
    {0xD7, "0f4j 4f0j"},                  // times
    {0xD8, "3n0N0D3d6D6N3n 0d6n"},        // O with a stroke
    {0xDF, "0d0l0N4N4J2j5J5D2d"},         // sharp s
    {0xE6, "4h4K0K0D4D4h8h8K4K4h4D6d8e"}, // ae
    {0xF8, "0g0K5K5g5D0D0g 0d5k"},        // o with a stroke
    {0x110, "1d1n3n7N7D3d1d 0i4i"},       // D with a stroke
    {0x111, "5n5d 5h5K0K0D5D5h 3m6m"},    // d with a stroke
    {0x131, "0k0d"},                      // dotless i
    {0x141, "1n1d6d 0g4j"},               // L with a stroke
    {0x142, "1n1d 0h2j"},                 // l with a stroke
    {0x3BC, "0k0a 0g0D5D5g 5k5d"},        // mu
    {0x3C3, "6k3k0K0D5D5g5J3k"},          // sigma
    {0x2013, "0i6i"},                     // dashes
    {0x2014, "0i9i"},
    {0x2018, "1n0m0k"}, // quotation marks
    {0x2019, "1n1m0k"},
    {0x201A, "1e1d0b"},
    {0x201C, "1n0m0k 3n2m2k"},
    {0x201D, "1n1m0k 3n3m2k"},
    {0x201E, "1e1d0b 3e3d2b"},
    {0x2026, "0d0d 2d2d 4d4d"},             // three dots
    {0x20AC, "7l6N4n1N1D4d6D7f 0j5j 0h5h"}, // euro
    {0x2212, "0i6i"},                       // minus
};

// A letter, the one below its accent, and the accent.
static const char composed[] =
    "ÀA` ÁA' ÂA^ ÃA~ ÄA\" ÅAo ÇC, ÈE` ÉE' ÊE^ ËE\" ÌI` ÍI' ÎI^ ÏI\" ÑN~ ÒO` ÓO' ÔO^ ÕO~ ÖO\" ÙU` ÚU' ÛU^ ÜU\" ÝY' àa` áa' âa^ "
    "ãa~ äa\" åao çc, èe` ée' êe^ ëe\" ìi` íi' îi^ ïi\" ñn~ òo` óo' ôo^ õo~ öo\" ùu` úu' ûu^ üu\" ýy' ÿy\" ĀA- āa- ĂAu ăau ĄA; "
    "ąa; "
    "ĆC' ćc' ČCv čcv ĎDv ďdv ĒE- ēe- ĖE. ėe. ĘE; ęe; ĚEv ěev ĞGu ğgu ĢG, ĪI- īi- ĮI; įi; İI. ĶK, ķk, ĹL' ĺl' ĻL, ļl, ŃN' ńn' "
    "ŅN, "
    "ņn, ŇNv ňnv ŌO- ōo- ŐO= őo= ŔR' ŕr' ŘRv řrv ŚS' śs' ŞS, şs, ŠSv šsv ŢT, ţt, ŤTv ťtv ŪU- ūu- ŮUo ůuo ŰU= űu= ŲU; ųu; ŸY\" "
    "ŹZ' "
    "źz' ŻZ. żz. ŽZv žzv ȘS, șs, ȚT, țt, ";

static const struct {
    char name;
    const char *strokes; // over small letters, around x = 2
} accents[] = {
    {'`', "1n3l"},           {'\'', "3n1l"},    {'^', "0l2n4l"},   {'~', "0l1N2m3L4n"}, {'"', "1m1m 3m3m"},
    {'o', "1m1N3N3m3L1L1m"}, {'v', "0n2l4n"},   {'-', "0m4m"},     {'u', "0n0L4L4n"},   {'.', "2m2m"},
    {'=', "2n1l 4n3l"},      {',', "2d3B2a1a"}, {';', "2d1B2a3a"},
};

uint32_t page_code_point(const char **text)
{
    const uint8_t *at = (const uint8_t *)*text;
    const int more = at[0] < 0x80                    ? 0
                     : at[0] >= 0xC2 && at[0] < 0xE0 ? 1
                     : at[0] >= 0xE0 && at[0] < 0xF0 ? 2
                     : at[0] >= 0xF0 && at[0] < 0xF5 ? 3
                                                     : -1;
    uint32_t code = more <= 0 ? at[0] : at[0] & (0x3Fu >> more);
    *text += 1;
    for (int i = 1; i <= more; i++) {
        if ((at[i] & 0xC0) != 0x80)
            return 0xFFFD;
        code = code << 6 | (at[i] & 0x3F);
    }
    const int whole = more < 2 ||
                      (more == 2 ? code >= 0x800 && (code < 0xD800 || code > 0xDFFF) : code >= 0x10000 && code < 0x110000);
    if (more < 0 || !whole)
        return 0xFFFD;
    *text += more;
    return code;
}

struct glyph {
    const char *strokes, *accent; // NULL: no accent
    int lift;                     // of the accent
    int dotless;                  // only the first stroke
};

// Whether there is such a letter; else a box.
static int find(uint32_t code, struct glyph *glyph)
{
    static const char box[] = "0d0n5n5d0d";
    *glyph = (struct glyph){.strokes = box};
    if (code > ' ' && code <= '~') {
        glyph->strokes = ascii[code - '!'];
        return 1;
    }
    if (code == ' ')
        glyph->strokes = "";
    for (size_t i = 0; i < sizeof others / sizeof *others; i++)
        if (others[i].code == code)
            glyph->strokes = others[i].strokes;
    for (const char *at = composed; *at; at += 3) {
        if (page_code_point(&at) != code)
            continue;
        const char base = at[0];
        glyph->strokes = ascii[base - '!'];
        glyph->dotless = base == 'i';
        glyph->lift = (base >= 'A' && base <= 'Z') || strchr("ldt", base) ? LIFT : 0;
        for (size_t i = 0; i < sizeof accents / sizeof *accents; i++)
            if (accents[i].name == at[1])
                glyph->accent = accents[i].strokes;
        glyph->lift = at[1] == ',' || at[1] == ';' ? 0 : glyph->lift;
        return 1;
    }
    return glyph->strokes != box;
}

static int width_of(const struct glyph *glyph)
{
    int width = 0;
    for (const char *at = glyph->strokes; *at; at++)
        width = *at >= '0' && *at <= '9' && *at - '0' > width ? *at - '0' : width;
    return *glyph->strokes ? width + SPACING : BLANK;
}

static double width_of_text(const char *text)
{
    double width = -SPACING;
    while (*text) {
        struct glyph glyph;
        find(page_code_point(&text), &glyph);
        width += width_of(&glyph);
    }
    return width > 0 ? width : 0;
}

int page_can_letter(const char *text)
{
    while (*text) {
        struct glyph glyph;
        if (!find(page_code_point(&text), &glyph))
            return 0;
    }
    return 1;
}

// ---- drawing -----------------------------------------------------------------------------------------------------

struct pen {
    struct page *page;
    const struct lettering *at;
    double size[2]; // of a unit, millimeters
    double start;   // of the letter, units
};

static void add(const struct pen *pen, const double place[2])
{
    const double x = pen->size[0] * (pen->start + place[0]), y = pen->size[1] * place[1];
    page_point(pen->page, pen->at->x + (pen->at->turned ? -y : x), pen->at->y + (pen->at->turned ? x : y));
}

static void add_curve(const struct pen *pen, const double from[2], const double by[2], const double to[2])
{
    for (int i = 1; i <= STEPS; i++) {
        const double t = (double)i / STEPS, a = (1 - t) * (1 - t), b = 2 * t * (1 - t), c = t * t;
        add(pen, (const double[2]){a * from[0] + b * by[0] + c * to[0], a * from[1] + b * by[1] + c * to[1]});
    }
}

// One stroke; returns where the next one begins, or the text's end.
static const char *draw_stroke(const struct pen *pen, const char *text, double right, double up)
{
    double last[2] = {0}, control[2] = {0};
    int curved = 0;
    page_shape(pen->page, PATINA_DRAWING_TEXT, 0.1 * pen->at->height, 0, 0);
    for (; *text && *text != ' '; text += 2) {
        const int is_control = text[1] < 'a';
        const double point[2] = {text[0] - '0' + right, text[1] + (is_control ? 'a' - 'A' : 0) - BASE + up};
        const double middle[2] = {0.5 * (control[0] + point[0]), 0.5 * (control[1] + point[1])};
        const double *end = is_control ? middle : point;
        if (curved)
            add_curve(pen, last, control, end);
        else if (!is_control)
            add(pen, point);
        if (curved || !is_control)
            memcpy(last, end, sizeof last);
        if (is_control)
            memcpy(control, point, sizeof control);
        curved = is_control;
    }
    return *text ? text + 1 : text;
}

static void draw(const struct pen *pen, const struct glyph *glyph)
{
    const char *at = glyph->strokes;
    while (*at && !(glyph->dotless && at != glyph->strokes))
        at = draw_stroke(pen, at, 0, 0);
    const double middle = 0.5 * (width_of(glyph) - SPACING);
    for (at = glyph->accent ? glyph->accent : ""; *at;)
        at = draw_stroke(pen, at, middle - 2, glyph->lift);
}

void page_letter(struct page *page, const char *text, const struct lettering *at)
{
    struct pen pen = {.page = page, .at = at};
    const double width = width_of_text(text), unit = at->height / CAPITAL;
    const double fitting = at->most > 0 && width * unit > at->most ? at->most / (width * unit) : 1;
    pen.size[0] = unit * fitting;
    pen.size[1] = unit * fmin(1, fitting / 0.7); // down to seven tenths, letters only get narrower
    pen.start = -at->anchor * width;
    while (*text) {
        struct glyph glyph;
        find(page_code_point(&text), &glyph);
        draw(&pen, &glyph);
        pen.start += width_of(&glyph);
    }
}
